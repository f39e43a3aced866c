"""Missions that begin with other than full wells: [start]."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

import optuav
from optuav.errors import InputError
from optuav.network import vehicle
from tests.examples import few

PAPER = optuav.load("paper")
FULL = {"start.available_As": 57_600.0, "start.bound_As": 14_400.0}
HALF = {"start.available_As": 30_000.0, "start.bound_As": 12_000.0}


def wells_at_the_end(plan: optuav.Plan) -> tuple[float, float]:
    """Both wells [A s] by numerical integration of eqs (11)-(12), from the start of the mission."""
    start, battery = plan.mission.start, plan.mission.battery
    size, share = battery.packs * battery.capacity_As, battery.available_fraction
    y = [share * size, (1 - share) * size]
    if start and start.soc is not None:
        y = [start.soc * each for each in y]
    elif start:
        y = [start.available_As or 0.0, start.bound_As or 0.0]
    for stage in (stage for phase in plan.phases for stage in phase.stages):

        def flow(_: float, y: Any, current_A: float = stage.current_A) -> list[float]:
            seeps = battery.flow_rate_per_s * (y[1] / (1 - share) - y[0] / share)
            return [current_A + seeps, -seeps]

        y = solve_ivp(flow, (0, stage.duration_s), y, rtol=1e-10, atol=1e-6).y[:, -1].tolist()
    return y[0], y[1]


@pytest.mark.parametrize("start", [{"start.soc": 0.8}, HALF])
@pytest.mark.parametrize("perspective", ["available", "battery", "energy", "adjusted"])
def test_plans_begin_with_the_wells_that_are_stated(start: Any, perspective: Any) -> None:
    """Plan, replay and an own integration end with the same wells, and no figure contradicts."""
    plan = optuav.solve(PAPER.replace(start), perspective=perspective)
    replay = optuav.replay(plan)
    assert not replay.by_kind["Contradicted"]
    assert optuav.audit(plan.to_dict()).replay is not None
    end = plan.phases[-1]
    own = wells_at_the_end(plan)
    assert [*end.available_As, *end.bound_As] == pytest.approx(own, abs=1e-2)
    assert plan.soc is not None
    assert plan.soc["battery"] == pytest.approx(sum(own) / 72_000, abs=1e-6)
    share = sum(HALF.values()) / 72_000 if start is HALF else 0.8
    full = optuav.replay(optuav.Itinerary(PAPER, plan.stops)).soc
    for name in ("energy", "adjusted"):
        assert replay.soc[name] == pytest.approx(full[name] - (1 - share), abs=1e-12)


@pytest.mark.parametrize("engine", ["bracket", "casadi", "grid"])
def test_engines_agree_on_a_start(engine: str) -> None:
    """Every engine finds the same longest hover, the grid to one slot."""
    mission = PAPER.replace({"start.soc": 0.8})
    best = optuav.solve(mission, "P3").hover_time_s
    assert 0 <= best - optuav.solve(mission, "P3", engine=engine).hover_time_s < 1 + 1e-6


def test_full_wells_at_the_start_change_nothing() -> None:
    """Wells that are full by the numbers give what no start gives."""
    plans = [optuav.solve(PAPER.replace(start)) for start in ({}, FULL, {"start.soc": 1})]
    assert [plan.hover_time_s for plan in plans] == pytest.approx([597.2697797883459] * 3, abs=1e-8)


@pytest.mark.campaign
@few(3, 100)
@given(st.floats(0.3, 1), st.floats(0.3, 1), st.sampled_from([1, 2]))
def test_batch_and_several_stops_agree_with_single_solves(y1: float, y2: float, stops: int) -> None:
    """The same start by batch, by solve and by the search; more stops are never worse."""
    start = {"start.available_As": 57_600 * y1, "start.bound_As": 14_400 * y2}
    mission = PAPER.replace(start)
    one = optuav.solve(mission)
    many = optuav.batch(PAPER, {key: [value] for key, value in start.items()}, paired=True)
    own = one.hover_time_s if one else np.nan
    assert float(np.ravel(many.hover_time_s)[0]) == pytest.approx(own, abs=1e-6, nan_ok=True)
    if one:
        assert optuav.replay(one).flyable
        more = optuav.solve(mission, optuav.P1(stops=stops, hovers=2), time_limit_s=1)
        assert more.hover_time_s >= own - 1e-6
        assert optuav.replay(more).flyable


def test_batch_displaces_wells_and_tells_of_those_beyond() -> None:
    """A varied capacity begins full, the mission's own keeps its wells; too much is a reason."""
    mission = PAPER.replace(HALF)
    found = optuav.batch(mission, {"battery.capacity_As": [36_000, 40_000]}).hover_time_s
    own = [optuav.solve(mission), optuav.solve(mission.replace({"battery.capacity_As": 40_000}))]
    assert np.ravel(found) == pytest.approx([each.hover_time_s for each in own], abs=1e-6)
    beyond = optuav.batch(mission, {"start.available_As": [30_000, 57_700]})
    assert np.isnan(np.ravel(beyond.hover_time_s)).tolist() == [False, True]


@pytest.mark.parametrize("schedule", ["sequential", "round-robin", "most-available"])
def test_packs_that_take_turns_begin_with_equal_parts(schedule: str) -> None:
    """Half full, each pack has half its charge, in plan and judge."""
    mission = PAPER.replace({"battery.schedule": schedule, "start.soc": 0.8})
    plan = optuav.solve(mission, "P3")
    trace = optuav.replay(plan).trace
    assert optuav.replay(plan).flyable
    assert trace.available_As[0].tolist() == pytest.approx([0.8 * 28_800] * 2)


def test_values_displace_each_other_and_wells_go_with_the_capacity() -> None:
    """`replace` and `extends` remove what made sense only with the old value."""
    wells = PAPER.replace(HALF)
    assert (
        wells.replace({"start.soc": 0.5}).start
        == optuav.load("paper").replace({"start.soc": 0.5}).start
    )
    for key, value in {"capacity_As": 1e5, "packs": 3, "available_fraction": 0.7}.items():
        revised = wells.replace({f"battery.{key}": value}).start
        assert revised is not None
        assert revised.available_As is revised.bound_As is None
    assert wells.replace({"limits.min_soc": 0.1}).start == wells.start
    kept = wells.replace({"battery.capacity_As": 40_000, **HALF}).start
    assert kept == wells.start
    assert optuav.Mission.from_dict(wells.to_dict()) == wells


@pytest.mark.parametrize(
    ("start", "words"),
    [
        ({"start.available_As": 57_601}, "start.available_As = 57601"),
        ({"start.available_As": 1e4}, "start.bound_As: is missing"),
        ({"start.bound_As": -1.0, "start.available_As": 0}, "0 <= x <= 14400"),
        ({"start.soc": 0.5, **HALF}, "either soc, or available_As and bound_As"),
        ({"start.soc": 1.1}, "start.soc = 1.1"),
    ],
)
def test_a_start_that_cannot_be_is_refused(start: Any, words: str) -> None:
    """One clear error with key and range."""
    with pytest.raises(InputError) as refusal:
        PAPER.replace({key: value for key, value in start.items() if value is not None})
    assert words in str(refusal.value)


def test_rounding_beyond_the_wells_is_clipped() -> None:
    """1e-6 B beyond a well is rounding: the mission begins full, or empty."""
    mission = PAPER.replace({"start.available_As": 57_600.05, "start.bound_As": -0.05})
    begin = vehicle.start(mission).wells(mission.pool)
    assert [float(each) for each in begin] == pytest.approx([57_600, 0], abs=1e-9)


def test_a_roof_does_not_block_the_legs_of_those_who_stand_on_it() -> None:
    """From and to a point on b9's roof, at its edge too, one by one and in a batch; not inside."""
    on_roof = PAPER.replace({"route.origin_m": [785, 1765, 100], "route.hover_m": [1000, 2502, 50]})
    direct = optuav.solve(on_roof, "P3")
    assert direct
    assert optuav.replay(direct).flyable
    below = on_roof.replace({"route.origin_m": [785, 1765, 90]})
    assert "origin lies inside building b9" in optuav.solve(below, "P3").reasons[0]
    back = on_roof.replace({"route.destination_m": [800, 1750, 100]})
    assert optuav.replay(optuav.solve(back, "P3")).flyable
    values = [100.0, 90.0, 120.0]
    many = optuav.batch(on_roof, {"route.origin_m[2]": values}, problem="P3").hover_time_s
    own = [optuav.solve(on_roof.replace({"route.origin_m": [785, 1765, z]}), "P3") for z in values]
    hovers = [plan.hover_time_s if plan else np.nan for plan in own]
    assert np.ravel(many) == pytest.approx(hovers, nan_ok=True, abs=1e-6)


@pytest.mark.parametrize("rule", ["over", "around"])
def test_a_bent_way_is_not_flown_over_the_own_roof(rule: str) -> None:
    """Where a roof below an end does not block the straight way, no way is bent for it."""
    keys = {"route.origin_m": [785, 1765, 100], "route.hover_m": [1000, 2502, 50]}
    straight = optuav.solve(PAPER.replace(keys), "P3")
    free = PAPER.replace({**keys, "flight.obstacles": rule})
    plan = optuav.solve(free, "P3")
    assert plan.waypoints_m == ((), ())
    assert plan.hover_time_s == straight.hover_time_s
    assert optuav.audit(plan).flyable
    (hover_s,) = optuav.batch(free, {"limits.deadline_s": [1200.0]}, problem="P3").hover_time_s
    assert float(hover_s) == pytest.approx(plan.hover_time_s, abs=1e-6)


@pytest.mark.parametrize("name", ["paper", "paper-table2", "paper-drag", "matrice350"])
def test_a_leg_of_no_length_costs_nothing(name: str) -> None:
    """Planning again on a roof or at the hover point begins without a flight."""
    mission = optuav.load(name)
    hover_m = [float(each) for each in vehicle.hover_point_m(mission)]
    there = mission.replace({"route.origin_m": hover_m, "route.hover_m": hover_m})
    plan = optuav.solve(there, "P3")
    assert plan.phases[0].duration_s == plan.phases[0].charge_As == 0.0
    assert optuav.replay(plan).flyable
