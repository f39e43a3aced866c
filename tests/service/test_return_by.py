"""The last moment to leave: P3 and P4 again, stepping through the wells, refusals."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

import optuav
from optuav.errors import InputError, NoPlanError
from optuav.maps.output import blocks
from optuav.maps.positions import DEVICE, hovers
from optuav.physics.kibam import Battery, Stage, Tilted, Wells, step
from optuav.presentation.text import as_text
from optuav.service.return_by import _time_for
from tests.examples import few
from tests.wells import SLOW

WIND = {"wind.velocity_m_s": [12.0, 0.0, 0.0]}
SHIPPED = ["paper", "paper-table2", "paper-drag", "matrice350", "relay-today"]


def test_known_moments() -> None:
    """P3 and P4 on b9, as the specification has them."""
    times = optuav.return_by("paper")
    by_place = {row["place"]: row for row in times.rows}
    assert by_place["destination"]["latest_s"] == pytest.approx(577.524, abs=5e-4)
    assert by_place["b9"]["latest_s"] == pytest.approx(597.270, abs=5e-4)


def test_what_the_laser_gives_is_said_and_lost_without_it() -> None:
    """As the link budget has it; a mission whose receiver stays behind names both tables."""
    relay = optuav.load("relay-today")
    lit, dark = (
        optuav.return_by(mission)
        for mission in (relay, relay.replace({"laser": None, "receiver": None}))
    )
    given_A = optuav.link_budget(relay, "hover").current_A
    assert lit.received_current_A == pytest.approx(given_A)
    assert dark.hover_current_A == pytest.approx(lit.hover_current_A + given_A)
    assert f"the laser gives {given_A:.4g} A" in str(lit)
    assert "the laser gives 0 A" in str(dark)
    with pytest.raises(InputError, match=r"without \[laser\], remove \[receiver\] too"):
        relay.replace({"laser": None})


def test_an_empty_well_has_no_sign() -> None:
    """What rounding leaves of an empty well is 0.0, not −0.0."""
    times = optuav.return_by("paper")
    assert " 0.0 A s in the bound one" in str(replace(times, bound_As=-1e-12))


def test_the_picture_marks_the_last_moments() -> None:
    """Of the destination and of the place that leaves most time."""
    times = optuav.return_by("paper")
    (ax,) = times.plot()["return.png"].axes
    marks = [line.get_xdata()[0] for line in ax.get_lines()[2:]]
    assert marks == pytest.approx([times.rows[0]["latest_s"], times.latest_s])


@pytest.mark.parametrize("mission", SHIPPED)
def test_the_longest_direct_hover_ends_at_the_last_moment(mission: str) -> None:
    """P3 without a deadline is found by other code, a bracket over the declared model."""
    far = optuav.load(mission).replace({"limits.deadline_s": 1e6})
    row = optuav.return_by(far).rows[0]
    assert row["latest_s"] == pytest.approx(optuav.solve(far, "P3").hover_time_s, abs=1e-5)


def lowest(mission: optuav.Mission, place: str, hover_s: float) -> tuple[float, float]:
    """Least y1 and the last charge [A s], by Euler steps through the KiBaM's own equations."""
    battery = mission.battery
    B, ω = battery.packs * battery.capacity_As, battery.available_fraction
    k_F = battery.flow_rate_per_s
    y1, y2, least = ω * B, (1 - ω) * B, math.inf
    plan = optuav.solve(mission, "P3")
    hover_A = -next(p.current_A for p in plan.phases if p.kind == "hover")
    legs = {(p.start_place, p.end_place): p for p in plan.phases}
    stages = [(-s.current_A, s.duration_s) for s in legs["origin", "hover"].stages]
    stages += [(hover_A, hover_s)]
    stages += [(-s.current_A, s.duration_s) for s in legs["hover", place].stages]
    for current_A, duration_s in stages:
        count = max(1, math.ceil(duration_s / 0.01))
        dt = duration_s / count
        for _ in range(count):
            flow = k_F * (y2 / (1 - ω) - y1 / ω)
            y1, y2 = y1 + dt * (flow - current_A), y2 - dt * flow
        least = min(least, y1)
    return least, y1 + y2


@few(8)
@given(st.integers(0, 10**6))
def test_a_second_later_is_too_late_and_a_second_earlier_is_in_time(seed: int) -> None:
    """Random batteries, stepped through by the differential equations."""
    random = np.random.default_rng(seed)
    mission = optuav.load("paper").replace(
        {
            "battery.capacity_As": float(random.uniform(12_000, 50_000)),
            "battery.available_fraction": float(random.uniform(0.1, 0.95)),
            "battery.flow_rate_per_s": float(10 ** random.uniform(-6, -2.5)),
            "limits.min_soc": float(random.choice([0.0, 0.05, 0.3])),
            "limits.deadline_s": 1e6,
        }
    )
    row = optuav.return_by(mission).rows[0]
    B = mission.battery.packs * mission.battery.capacity_As
    if row["latest_s"] is None:
        assert not optuav.solve(mission, "P3")
        return
    for later_s, holds in ((-1.0, True), (1.0, False)):
        if (hover_s := row["latest_s"] + later_s) >= 0.0:
            least, left = lowest(mission, "destination", hover_s)
            assert (least >= 0.0 and left >= mission.limits.min_soc * B) is holds


@pytest.mark.parametrize("flow_rate_per_s", [0.0, 1e-20, 1e-12, 1e-9])
def test_wells_that_hardly_level_out(flow_rate_per_s: float) -> None:
    """With k_F = 0 the available well alone lasts for (ωB − Q)/I; it was said to be dry at once."""
    mission = optuav.load("paper").replace({"battery.flow_rate_per_s": flow_rate_per_s})
    plan = optuav.solve(mission, "P3")
    legs = [phase for phase in plan.phases if phase.kind == "flight"]
    hover_A = -next(phase.current_A for phase in plan.phases if phase.kind == "hover")
    expected_s = (0.8 * 72_000 + sum(phase.charge_As for phase in legs)) / hover_A
    row = optuav.return_by(mission).rows[0]
    assert row["dry_s"] == pytest.approx(expected_s, rel=1e-12 + 1e4 * flow_rate_per_s)


@pytest.mark.parametrize("flow_rate_per_s", [1.0, 1e3])
def test_wells_that_level_out_at_once(flow_rate_per_s: float) -> None:
    """The battery as a whole lasts for (B − Q)/I; rounding left no bracket for it."""
    mission = optuav.load("paper").replace({"battery.flow_rate_per_s": flow_rate_per_s})
    plan = optuav.solve(mission, "P3", perspective="battery")
    legs = [phase for phase in plan.phases if phase.kind == "flight"]
    hover_A = -next(phase.current_A for phase in plan.phases if phase.kind == "hover")
    expected_s = (72_000 + sum(phase.charge_As for phase in legs)) / hover_A
    row = optuav.return_by(mission).rows[0]
    assert row["dry_s"] == pytest.approx(expected_s, rel=1e-4 / flow_rate_per_s)


@pytest.mark.parametrize("mission", SHIPPED)
def test_the_monitor_sounds_at_the_last_moment(mission: str) -> None:
    """a·y1 + b·y2 = g for the wells that the judge finds at the end of the longest hover."""
    far = optuav.load(mission).replace({"limits.deadline_s": 1e6})
    row = optuav.return_by(far).rows[0]
    plan = optuav.solve(far, "P3")
    trace = optuav.replay(plan).trace
    hover = next(phase for phase in plan.phases if phase.kind == "hover")
    at = hover.start_s + hover.duration_s
    y1, y2 = (
        np.interp(at, trace.time_s, wells[:, 0]) for wells in (trace.available_As, trace.bound_As)
    )
    B = far.battery.packs * far.battery.capacity_As
    assert row["a"] * y1 + row["b"] * y2 == pytest.approx(row["g_As"], abs=1e-4 * B)


def test_asking_again_on_the_way_gives_what_is_left() -> None:
    """From the hover point itself, with the wells after 100 s, 100 s less are left."""
    mission = optuav.load("paper")
    before = optuav.return_by(mission)
    plan = optuav.solve(mission, "P3")
    hover = next(phase for phase in plan.phases if phase.kind == "hover")
    battery = mission.battery
    B, ω, k_F = battery.packs * battery.capacity_As, battery.available_fraction, 4.5e-5
    y1, y2 = before.available_As, before.bound_As
    for _ in range(100_000):
        flow = k_F * (y2 / (1 - ω) - y1 / ω)
        y1, y2 = y1 + 1e-3 * (flow + hover.current_A), y2 - 1e-3 * flow
    assert y1 + y2 < B
    there = optuav.graph(mission).nodes["hover"]["position_m"]
    now = mission.replace(
        {
            "route.origin_m": list(there),
            "route.hover_m": list(there),
            "start": {"available_As": y1, "bound_As": y2},
        }
    )
    left = optuav.return_by(now).rows[0]
    assert left["latest_s"] == pytest.approx(before.rows[0]["latest_s"] - 100.0, abs=1e-3)


def test_what_has_no_last_moment_is_told() -> None:
    """Packs that take turns, a start too empty to arrive, and one too empty to come back."""
    paper = optuav.load("paper")
    with pytest.raises(InputError, match=r"battery\.schedule"):
        optuav.return_by(paper.replace({"battery.schedule": "sequential"}))
    with pytest.raises(NoPlanError, match="runs dry before"):
        optuav.return_by(paper.replace({"start": {"available_As": 100.0, "bound_As": 14_400.0}}))
    low = paper.replace({"start": {"available_As": 6000.0, "bound_As": 100.0}})
    assert optuav.return_by(low).rows[0]["latest_s"] is None
    assert "too late" in str(optuav.return_by(low))


@few(40)
@given(st.integers(0, 10**6))
@example(44)
def test_wells_far_from_level_by_many_moments(seed: int) -> None:
    """Tried moment by moment: when leaving is in time, and a monitor only if it is at once.

    The drone may have to wait until enough has flowed into its available well. A monitor told it
    to leave at once, into a dry well.
    """
    rng = np.random.default_rng(seed)
    B, ω = 10 ** rng.uniform(3, 5), rng.uniform(0.1, 0.95)
    battery = Battery(B, ω, 10 ** rng.uniform(-6, -1.5))
    begin = Wells(ω * B * rng.random() ** 2, (1 - ω) * B * rng.random())
    hover_A = B / 10 ** rng.uniform(1.5, 4) * rng.choice([1, 1, 0, -1])
    way = [
        Stage(-B / 10 ** rng.uniform(1.7, 4), rng.uniform(0, 40)) for _ in range(rng.integers(1, 5))
    ]
    least_As = rng.choice([0.0, 0.05, 0.3]) * B
    charge = Tilted.of(battery, begin)
    row = _time_for("b1", 0.0, battery, charge, hover_A, way, least_As)
    earliest_s, latest_s, a, b, g_As = (
        row[name] for name in ("earliest_s", "latest_s", "a", "b", "g_As")
    )
    until_s = min(4 * B / abs(hover_A) if hover_A else 1e4, 5e5)
    moments_s = np.concatenate([[0.0], np.geomspace(1e-7 * until_s, until_s, 2000)])
    at = step(battery, begin, Stage(-hover_A, moments_s))
    holds = at.available_As >= -1e-9 * B
    for stage in way:
        at = step(battery, at, stage)
        holds = holds & (at.available_As >= -1e-9 * B)
    holds = holds & (at.total_As >= least_As - 1e-9 * B)
    if not holds.any():
        assert latest_s is None or latest_s - earliest_s < 0.02 * until_s or latest_s > until_s
        return
    first = int(holds.argmax())
    last = first + int((~holds[first:]).argmax()) if not holds[first:].all() else len(moments_s)
    assert moments_s[max(first - 1, 0)] - 1e-6 <= earliest_s <= moments_s[first] + 1e-6
    assert latest_s >= moments_s[last - 1] * (1 - 1e-6)
    assert latest_s <= (moments_s[last] * (1 + 1e-6) if last < len(moments_s) else math.inf)
    assert (a is None) == (b is None) == (g_As is None) == (earliest_s > 0.0)


def test_no_monitor_says_leave_into_a_dry_well() -> None:
    """The bound well first has to refill the available one: the judge flies three moments."""
    low = {"start": {"available_As": 600.0, "bound_As": 4200.0}, "limits.min_soc": 0.0}
    quick = SLOW | {"battery.flow_rate_per_s": 5e-4}
    relay = optuav.load("relay-today").replace({**quick, **low, **WIND})
    times = optuav.return_by(relay)
    row = times.rows[0]
    assert row["earliest_s"] > 5.0
    for hover_s, holds in (
        (row["earliest_s"] - 1.0, False),
        (row["earliest_s"] + 1.0, True),
        (row["latest_s"] - 1.0, True),
        (row["latest_s"] + 1.0, False),
    ):
        flight = optuav.Itinerary(relay, optuav.Stop("hover", "hover", hover_s))
        assert (optuav.replay(flight).first_s("empty") is None) is holds
    assert row["a"] is row["b"] is row["g_As"] is None
    assert f"destination: not before {row['earliest_s']:.2f} s" in str(times)
    assert times.plot()
    assert optuav.return_by("paper").rows[0]["earliest_s"] == 0.0


def test_what_counts_on_the_wind_says_what_calm_air_gives() -> None:
    """Hovering takes less in wind: all answers say so, with those of the mission without it."""
    calm = optuav.load("relay-today")
    windy = calm.replace(WIND)
    cycle, other = optuav.coverage(windy), optuav.coverage(calm)
    pairs = [
        (optuav.return_by(windy).calm_latest_s, optuav.return_by(calm).latest_s),
        (cycle.calm_share, other.share),
        (cycle.event(4).calm_drones, other.event(4).drones),
        (cycle.fleet(2.0).calm_drones, other.fleet(2.0).drones),
        (cycle.horizon(8).calm_hover_s, other.horizon(8).hover_s),
    ]
    assert all(told == pytest.approx(gives) for told, gives in pairs)
    plan = optuav.solve(windy)
    words = f"the plan in calm air hovers {optuav.solve(calm).hover_time_s:.2f} s"
    assert f"this holds while the wind blows; {words}" in plan.notes
    assert str(other.watts(3)) in str(cycle.watts(3))
    told = [optuav.return_by(windy), cycle, cycle.event(4), cycle.fleet(), cycle.horizon(8)]
    told += [optuav.size_fleet(windy), optuav.robust(windy, {"drain": {"percent": 5}}, samples=9)]
    assert all("while the wind blows" in " ".join(str(each).split()) for each in told)
    robust = optuav.robust(windy, {"wind.velocity_m_s[0]": {"low": 0, "high": 12}}, samples=9)
    assert "while the wind blows" not in " ".join(str(robust).split())


def test_explanations_and_maps_say_what_calm_air_gives() -> None:
    """As the plan does, once; a map for the place where its hover is longest."""
    windy, calm = (optuav.load("relay-today").replace(wind) for wind in (WIND, {}))
    hover_s = optuav.solve(calm).hover_time_s
    for subject in (windy, optuav.solve(windy)):
        notes = [note for note in optuav.explain(subject).notes if "wind blows" in note]
        assert notes == [
            f"this holds while the wind blows; the plan in calm air hovers {hover_s:.2f} s"
        ]
    assert "wind blows" not in str(optuav.explain(calm))
    around: tuple[Any, ...] = 300.0, (300, 0, 600, 300), None, "available"
    found = hovers(DEVICE, windy, *around)
    there = calm.replace({DEVICE: found.facts["best_m"]})
    words = " ".join(as_text(blocks(found)).split())
    assert f"in calm air: {optuav.solve(there).hover_time_s:.2f} s of hover" in words
    assert "calm" not in as_text(blocks(hovers(DEVICE, calm, *around)))


def test_what_does_not_count_on_the_wind_says_nothing() -> None:
    """Without wind, and where rotors draw more to hold the drone against its force."""
    for mission in ("relay-today", optuav.load("paper").replace({"wind.force_N": [2.0, 0.0, 0.0]})):
        times, cycle = optuav.return_by(mission), optuav.coverage(mission)
        assert times.calm_latest_s is times.in_calm_air is cycle.calm_share is None
        assert "wind blows" not in f"{times}{cycle}{cycle.event(0.2)}{optuav.solve(mission)}"


def test_no_answer_in_calm_air_is_told() -> None:
    """A battery so small that in calm air the legs alone take too much."""
    wind = {"wind.velocity_m_s": [0.0, 8.0, 0.0]}
    cycle = optuav.coverage(
        optuav.load("relay-today").replace({**SLOW, "battery.capacity_As": 408, **wind})
    )
    assert cycle.calm_share is None
    assert "no building allows" in str(cycle)
    assert "no building allows" in str(cycle.fleet(0.01))
