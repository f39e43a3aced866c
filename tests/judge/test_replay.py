"""Replay: plans against the simulation, the simulation against SciPy and physics by hand."""

from __future__ import annotations

import itertools
import re
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

import optuav
from optuav import InputError, Mission, NoPlanError, plots
from optuav.judge import Itinerary, Replay, Stop
from tests.examples import few
from tests.mission.strategies import missions
from tests.plan.made import INFEASIBLE, available_by_integration, feasible, plans

Floats = npt.NDArray[np.float64]
LEVEL = 1e-6
"""Share of the capacity to which charges agree."""
WELLS = {"empty", "full"}


def kinds(replayed: Replay) -> set[str]:
    """What is wrong, by kind."""
    return {event.kind for event in replayed.violations}


def judged(mission: Mission, *stops: tuple[str, str, float]) -> Replay:
    """The replay of stops (kind, at, duration) over a mission."""
    return optuav.replay(Itinerary(mission, tuple(Stop(at, kind, s) for kind, at, s in stops)))


def test_direct_runs_dry_at_660_s() -> None:
    """SPEC: `paper` direct hovers 688.85 s, but its available well is empty at 660.26 s."""
    replayed = optuav.replay(optuav.solve("paper", "P3", perspective="battery"))
    assert not replayed.flyable
    assert kinds(replayed) == {"empty"}
    assert replayed.times_s["hover_time_s"] == pytest.approx(688.848, abs=5e-4)
    assert replayed.first_s("empty") == pytest.approx(660.26, abs=0.005)


def test_one_rest_runs_dry_and_is_overcharged() -> None:
    """SPEC: the best single rest is dry at 1095.5 s and holds 104 % of y1 after resting."""
    replayed = optuav.replay(optuav.solve("paper", perspective="battery"))
    assert kinds(replayed) == WELLS
    assert replayed.first_s("empty") == pytest.approx(1095.5, abs=0.005)
    (full,) = (event for event in replayed.events if event.kind == "full")
    assert full.value is not None
    assert full.value / (0.8 * 72_000) == pytest.approx(1.04, abs=0.005)


def test_answers_of_the_perspective_available_can_be_flown() -> None:
    """On `paper` and where charging is strong, with the battery empty at some moment."""
    for keys in ({}, {"battery.charge_current_A": 150.0, "laser.power_W": 15_000.0}):
        mission = optuav.load("paper").replace(keys)
        replayed = optuav.replay(optuav.solve(mission, perspective="available"))
        assert replayed.flyable, replayed.violations


def test_the_longest_flyable_hover_is_on_the_edge() -> None:
    """SPEC: P3 under `available` is 577.524 s; a hundredth of a second more is dry."""
    paper = optuav.load("paper")
    assert judged(paper, ("hover", "hover", 577.523)).flyable
    assert kinds(judged(paper, ("hover", "hover", 577.535))) == {"empty"}


def test_two_rests_of_the_specification_can_be_flown() -> None:
    """SPEC 3: rest b9 231.8 s, hover 605.456 s, rest b10 254.2 s in 1200 s; no longer hover."""
    paper = optuav.load("paper")
    stops = [("rest", "b9", 231.8), ("hover", "hover", 605.4), ("rest", "b10", 254.2)]
    replayed = judged(paper, *stops)
    assert replayed.flyable, replayed.violations
    assert [phase.end.name for phase in replayed.phases if phase.kind == "flight"] == [
        *("b9", "hover", "b10", "destination")
    ]
    stops[1] = ("hover", "hover", 606.0)
    assert not judged(paper, *stops).flyable


@pytest.mark.parametrize("name", feasible())
def test_plans_agree_with_their_simulation(name: str) -> None:
    """No figure of any of our plans differs, and only the wells are out of bounds."""
    plan = plans()[name]
    replayed = optuav.replay(plan)
    assert kinds(replayed) <= WELLS
    assert replayed.flyable == (plan.runs_dry_s is None and plan.overfull_s is None)
    assert plan.soc == pytest.approx(replayed.soc, abs=LEVEL)
    assert replayed.mission_time_s == pytest.approx(plan.mission_time_s, rel=1e-9)


class Integrated(NamedTuple):
    """Wells at the end of every phase [A s], when they first pass a limit [s], and y1 over time."""

    ends_As: list[Floats]
    passed_s: dict[str, float]
    moments_s: Floats
    available_As: Floats


def integrated(replayed: Replay) -> Integrated:
    """The pooled packs by SciPy's integration of (11)-(12) over the stages, with its events.

    Where charging tapers, y1 stays at ωB once it is there.
    """
    given = replayed.mission.battery
    B, ω, k = given.packs * given.capacity_As, given.available_fraction, given.flow_rate_per_s
    wells, passed_s = np.array([ω * B, (1 - ω) * B]), dict[str, float]()
    ends_As, moments_s, available_As = [], [np.zeros(0)], [np.zeros(0)]

    def integrate(
        current_A: float, start_s: float, duration_s: float, *, is_held: bool = False
    ) -> float:
        """Go on from the wells; return the share of the duration after which y1 has to be held."""
        nonlocal wells

        def slope(_: float, y: Floats) -> list[float]:
            seeping_A = k * (y[0] / ω - y[1] / (1 - ω))
            net_A = 0.0 if is_held else current_A - seeping_A
            return [duration_s * net_A, duration_s * seeping_A]

        def dry(_: float, y: Floats) -> float:
            return float(y[0])

        def full(_: float, y: Floats) -> float:
            return float(y[0] - ω * B)

        dry.direction, full.direction = -1.0, 1.0  # type: ignore[attr-defined]
        full.terminal = given.charging == "taper" and not is_held  # type: ignore[attr-defined]
        if full.terminal and ω * B - wells[0] <= 1e-12 * B and slope(0.0, wells)[0] >= 0.0:
            return 0.0
        found = solve_ivp(
            slope,
            (0.0, 1.0),
            wells,
            method="LSODA",
            t_eval=np.linspace(0.0, 1.0, 33),
            events=(dry, full),
            rtol=1e-11,
            atol=1e-12 * B,
        )
        is_full = full.terminal and len(found.t_events[1]) > 0
        wells = found.y_events[1][-1] if is_full else found.y[:, -1]
        moments_s.append(start_s + duration_s * found.t)
        available_As.append(found.y[0])
        for name, moments, beyond_As in zip(
            ("empty", "full"), found.t_events, (-wells[0], wells[0] - ω * B), strict=True
        ):
            if beyond_As > LEVEL * B and name not in passed_s:
                passed_s[name] = start_s + duration_s * (moments[0] if len(moments) else 0.0)
        return float(found.t_events[1][0]) if is_full else 1.0

    for phase in replayed.phases:
        for stage in phase.stages:
            current_A, start_s, duration_s = stage.net[0], stage.start_s, stage.duration_s
            share = integrate(current_A, start_s, duration_s)
            if share < 1.0:
                start_s, duration_s = start_s + share * duration_s, (1.0 - share) * duration_s
                integrate(current_A, start_s, duration_s, is_held=True)
        ends_As.append(wells)
    return Integrated(ends_As, passed_s, np.concatenate(moments_s), np.concatenate(available_As))


def agrees(replayed: Replay) -> None:
    """The closed form says what integration says: wells, moments, and y1 in between."""
    found, given = integrated(replayed), replayed.mission.battery
    slack_As = LEVEL * given.packs * given.capacity_As
    assert replayed.course is not None
    for mine, theirs in zip(replayed.course.ends, found.ends_As, strict=True):
        assert np.allclose(mine[0], theirs, rtol=0.0, atol=slack_As)
    moments = {e.kind: e.time_s for e in replayed.events if e.kind in WELLS}
    assert moments == pytest.approx(found.passed_s, rel=1e-6, abs=1e-4)
    trace = replayed.trace
    between = np.interp(found.moments_s, trace.time_s, trace.available_As[:, 0])
    assert np.allclose(between, found.available_As, rtol=0.0, atol=1e-4 * slack_As / LEVEL)


@pytest.mark.parametrize("name", [*feasible()[:2], "table 2", "edited", "no laser", "wind"])
def test_the_closed_form_is_the_integral(name: str) -> None:
    """Closed form with Newton's steps, and SciPy's integration with events."""
    agrees(optuav.replay(plans()[name]))


@pytest.mark.campaign
@given(missions(), st.sampled_from(["direct", "optimal", "traj2"]))
@settings(few(12))
def test_random_plans_agree_with_their_simulation(mission: Mission, trajectory: str) -> None:
    """Whatever the mission: figures agree, the wells alone may be out of bounds."""
    plan = optuav.solve(mission, optuav.P1(trajectory=trajectory), perspective="battery")
    if not plan:
        return
    replayed = optuav.replay(plan)
    assert kinds(replayed) <= WELLS, replayed.violations
    assert (replayed.first_s("empty") is not None) == (plan.runs_dry_s is not None)
    assert (replayed.first_s("full") is not None) == (plan.overfull_s is not None)


@pytest.mark.campaign
@given(missions())
@settings(few(12))
def test_moments_of_random_plans_against_a_dense_grid(mission: Mission) -> None:
    """SciPy's integration at 200 points a stage finds no violation where replay sees none."""
    plan = optuav.solve(mission, perspective="battery")
    if not plan:
        return
    replayed = optuav.replay(plan)
    given = mission.battery
    B = given.packs * given.capacity_As
    samples = list(available_by_integration(plan))
    y1 = np.concatenate([available for _, available in samples])
    assert (y1.min() < -2 * LEVEL * B) <= ("empty" in kinds(replayed))
    assert (y1.max() > (given.available_fraction + 2 * LEVEL) * B) <= ("full" in kinds(replayed))
    empty_s = replayed.first_s("empty")
    if empty_s is not None:
        time_s = np.concatenate([moments for moments, _ in samples])
        assert (y1[time_s < empty_s - 1e-3] > -2 * LEVEL * B).all()


@pytest.mark.campaign
@given(missions(), st.sampled_from(["constant", "taper"]), st.data())
@settings(few(12))
def test_the_closed_form_is_the_integral_on_any_itinerary(
    mission: Mission, charging: str, data: st.DataObject
) -> None:
    """Well beyond empty and full too, and where charging tapers: the same at the same moments."""
    if mission.battery.takes_turns:
        return
    names = ["hover", *(each.name for each in mission.buildings)]
    kind = st.sampled_from(["rest", "hover"])
    stop = st.builds(Stop, st.sampled_from(names), kind, st.floats(1.0, 900.0))
    stops = tuple(data.draw(st.lists(stop, max_size=4)))
    replayed = optuav.replay(Itinerary(mission.replace({"battery.charging": charging}), stops))
    if replayed.mission_time_s:
        agrees(replayed)


@pytest.mark.parametrize("charging", ["constant", "taper"])
@pytest.mark.parametrize("stay_s", [0.0, 5e-324, 1e-100, 1e-12])
def test_stays_of_next_to_no_time_change_nothing(stay_s: float, charging: str) -> None:
    """Before anything is flown and while the battery is full, too."""
    mission = optuav.load("paper").replace({"battery.charging": charging})
    rest, hover = Stop("b9", "rest", 100.0), Stop("hover", "hover", 10.0)
    short = [Stop(each.at, each.kind, stay_s) for each in (rest, hover)]
    found, plain = (
        optuav.replay(Itinerary(mission, (*extra, hover, rest)))
        for extra in (short, (Stop("b9", "rest", 0.0),))
    )
    assert found.flyable
    assert found.soc == pytest.approx(plain.soc, abs=LEVEL)
    assert np.isfinite(found.trace.available_As).all()


@pytest.mark.parametrize("name", [*feasible()[:3], "table 2", "wind", "edited"])
def test_table_is_one_motion(name: str) -> None:
    """It starts at the origin, ends at the destination, and its speed is that of its position."""
    plan = plans()[name]
    table = optuav.replay(plan).trace
    route = plan.mission.route
    assert np.allclose(table.position_m[0], route.origin_m)
    assert np.allclose(table.position_m[-1], route.destination_m, atol=1e-5)
    assert (np.diff(table.time_s) >= 0.0).all()
    moved_m = np.linalg.norm(np.diff(table.position_m, axis=0), axis=1)
    mean_m_s = 0.5 * (table.speed_m_s[1:] + table.speed_m_s[:-1])
    within = np.diff(table.time_s) > 0.0
    smooth = within & (table.stage[1:] == table.stage[:-1])
    if name == "edited":  # the length of the leg is the user's own
        smooth &= table.phase[1:] > 0
    # Where a leg of constant load turns from speeding up to braking, the trapezium cuts a corner.
    corner_m = 2.0 if plan.mission.flight.model == "regimes" else 1e-3
    assert abs(moved_m - mean_m_s * np.diff(table.time_s))[smooth].max() < corner_m
    assert moved_m[~within].max() < 1e-5
    if name != "edited":
        assert table.speed_m_s.max() == pytest.approx(plan.peak_speed_m_s, rel=2e-2)


@pytest.mark.parametrize("name", ["optimal", "table 2", "edited"])
def test_table_balances(name: str) -> None:
    """Charge is the integral of the current, and the energy perspective that of the power."""
    plan = plans()[name]
    table = optuav.replay(plan).trace
    given = plan.mission.battery
    B = given.packs * given.capacity_As
    step_s = np.diff(table.time_s)
    left_As = table.available_As.sum(axis=1) + table.bound_As.sum(axis=1)
    gained_As = (table.current_A[:-1] * step_s).sum()
    assert left_As[-1] - left_As[0] == pytest.approx(gained_As, abs=LEVEL * B)
    assert table.soc["battery"] == pytest.approx(left_As / B)
    gained_J = (table.power_W[:-1] * step_s).sum() / (B * given.nominal_voltage_V)
    assert table.soc["energy"][-1] == pytest.approx(1.0 + gained_J, abs=LEVEL)
    assert plan.soc == pytest.approx({name: soc[-1] for name, soc in table.soc.items()}, abs=LEVEL)


def test_voltage_is_that_of_the_rotors() -> None:
    """SPEC: 14.11 V in hover, 16.35 V at full speed; resting draws nothing."""
    table = optuav.replay(plans()["optimal"]).trace
    paper = optuav.load("paper")
    hover = table.voltage_V[table.kind == "hover"]
    radio_A, radio_W = 5.0 / paper.link.transmit_voltage_V, 5.0
    assert paper.link.transmit_power_W == radio_W
    expected_V = (1310.994 + radio_W) / (4 * 23.2276 + radio_A)
    assert hover == pytest.approx(expected_V, rel=1e-5)
    assert table.voltage_V[table.stage == "brake"] == pytest.approx(16.3456, abs=5e-5)
    assert table.voltage_V[table.kind == "rest"] == pytest.approx(11.1)


def test_trace_is_computed_on_first_use() -> None:
    """The verdict alone stays cheap."""
    replayed = optuav.replay(plans()["direct"])
    assert "trace" not in vars(replayed)
    assert len(replayed.trace) == len(replayed.to_frame())
    assert "trace" in vars(replayed)


def test_every_broken_limit_is_an_event() -> None:
    """Deadline, state of charge, altitude, coverage, roof and building, each with its figures."""
    paper = optuav.load("paper")
    late = judged(paper, ("hover", "hover", 300.0), ("rest", "b9", 1000.0))
    (deadline,) = late.violations
    assert (deadline.kind, deadline.time_s, deadline.limit) == ("deadline", 1200.0, 1200.0)
    assert deadline.value == late.mission_time_s

    greedy = judged(paper.replace({"limits.min_soc": 0.4}), ("hover", "hover", 500.0))
    (least,) = greedy.violations
    assert (least.kind, least.limit) == ("state of charge", 0.4)
    assert least.value == greedy.soc["battery"]

    astray = judged(paper, ("hover", "b1", 10.0), ("rest", "origin", 10.0))
    coverage, roof = astray.violations
    assert (coverage.kind, roof.kind) == ("coverage", "no roof")
    assert str(roof).endswith("nothing to rest on at origin: no roof, and the ground is 50 m below")
    assert coverage.limit == pytest.approx(501.4836, abs=5e-5)
    assert coverage.value == pytest.approx(np.linalg.norm([950, 2700, 60]))

    low = paper.replace({"limits.min_altitude_m": 60, "route.hover_m": [1000, 2700, 55]})
    (altitude,) = judged(low, ("hover", "hover", 10.0)).violations
    assert (altitude.kind, altitude.value, altitude.limit) == ("altitude", 55.0, 60.0)


WALL = {"name": "wall", "position_m": [500, 1250, 90], "footprint_m": [300, 300]}


def test_a_building_in_the_way_is_a_violation_unless_the_mission_allows_it() -> None:
    """A wall across the direct way from the origin to the hover point."""
    paper = optuav.load("paper")
    walled = paper.replace({"buildings": [WALL]})
    (blocked,) = judged(walled, ("hover", "hover", 10.0)).violations
    assert (blocked.kind, blocked.time_s) == ("building", 0.0)
    assert "wall" in blocked.words
    assert judged(
        walled.replace({"flight.through_buildings": True}), ("hover", "hover", 10.0)
    ).flyable
    assert judged(walled, ("rest", "wall", 1.0), ("hover", "hover", 1.0)).flyable


def test_a_place_without_sight_does_not_charge() -> None:
    """Resting there is allowed, with a note that it is of no use."""
    paper = optuav.load("paper")
    screen = {"name": "screen", "position_m": [900, 100, 90], "footprint_m": [100, 20]}
    mission = paper.replace({"buildings": [*paper.to_dict()["buildings"], screen]})
    hidden = judged(mission, ("rest", "b5", 100.0), ("hover", "hover", 10.0))
    seen = judged(paper, ("rest", "b5", 100.0), ("hover", "hover", 10.0))
    assert hidden.flyable
    assert [each.kind for each in hidden.events if each.kind == "no sight"] == ["no sight"]
    assert seen.first_s("no sight") is None
    gained_As = (seen.soc["battery"] - hidden.soc["battery"]) * 72_000
    assert gained_As == pytest.approx(1000.0)


def test_what_cannot_be_simulated_is_impossible() -> None:
    """Too heavy to fly, or nothing within reach of the device."""
    paper = optuav.load("paper")
    for keys in ({"body.mass_kg": 2.0}, {"link.device_m": [1000, 3000, 900]}):
        replayed = judged(paper.replace(keys), ("hover", "hover", 10.0))
        assert kinds(replayed) == {"impossible"}
        assert replayed.phases == ()
        with pytest.raises(NoPlanError):
            _ = replayed.trace


def test_power_that_the_user_stated_is_taken_as_it_is() -> None:
    """Edited sight and power are the user's, as the figures of edited legs are."""
    paper = optuav.load("paper").replace({"limits.min_soc": 0.5})
    view = optuav.graph(paper)
    view.nodes["b3"]["received_power_W"] = 55.5
    view.nodes["hover"]["laser_sight"] = False
    plan = optuav.solve(
        paper, optuav.P4("b3", order="hover-first"), graph=view, perspective="battery"
    )
    replayed = optuav.replay(plan)
    assert replayed.flyable, replayed.violations
    assert [each.words for each in replayed.events if each.kind == "stated"] == [
        "the hover at hover has figures that the user set",
        "the rest at b3 has figures that the user set",
    ]
    table = replayed.trace
    assert table.received_power_W[table.kind == "rest"] == pytest.approx(55.5)
    assert table.received_power_W[table.kind == "hover"] == pytest.approx(0.0, abs=1e-9)
    assert plan.soc == pytest.approx(replayed.soc, abs=LEVEL)


def test_ends_of_the_mission_are_kept() -> None:
    """A plan edited so that it leaves out its last leg."""
    plan = plans()["flyable"]
    cut = plan.model_copy(update={"phases": plan.phases[:-1], "soc": {}, "flyable": None})
    assert kinds(optuav.replay(cut)) == {"ends"}


@pytest.mark.parametrize("name", INFEASIBLE)
def test_there_is_nothing_to_replay_without_a_plan(name: str) -> None:
    with pytest.raises(NoPlanError):
        optuav.replay(plans()[name])


@pytest.mark.parametrize(
    ("stop", "words"),
    [
        (("b99", "rest", 1.0), "stops.0.at = 'b99': is not a place of the mission paper"),
        (("b1", "sleep", 1.0), 'stops.0.kind = \'sleep\': must be "rest" or "hover"'),
        (("b1", "rest", -1.0), "stops.0.duration_s = -1.0: must be a number, 0 <= x <= 1e7"),
        (("b1", "rest", float("nan")), "stops.0.duration_s = nan: must be a number, 0 <= x <= 1e7"),
    ],
)
def test_stops_that_cannot_be_are_refused(stop: tuple[Any, ...], words: str) -> None:
    """An unknown place counted as the destination, and nothing is wrong with what is NaN."""
    with pytest.raises(InputError, match=re.escape(words)):
        Itinerary(optuav.load("paper"), (Stop(*stop),))


def test_events_are_in_order_of_time() -> None:
    for name in feasible():
        events = optuav.replay(plans()[name]).events
        assert all(a.time_s <= b.time_s for a, b in itertools.pairwise(events))


def test_speeds_that_drag_would_forbid_are_warned_of() -> None:
    """Above 40 m/s with either flight model, at the moment of the peak; not below."""
    paper = optuav.load("paper")
    fast = judged(paper, ("hover", "hover", 10.0))
    assert fast.flyable
    assert fast.first_s("no drag") == fast.first_s("peak speed") == pytest.approx(18.30, abs=0.005)
    regimes = optuav.load("paper-table2")
    assert judged(regimes, ("hover", "hover", 10.0)).first_s("no drag") is not None
    capped = regimes.replace({"flight.max_speed_m_s": 40.0})
    assert judged(capped, ("hover", "hover", 10.0)).first_s("no drag") is None


# Packs that carry the load one at a time

SCHEDULES = ("sequential", "round-robin", "alternating", "most-available")


def scheduled(schedule: str, **keys: object) -> Mission:
    """`paper` with a schedule and other keys, dots written as two underscores."""
    changed = {name.replace("__", "."): value for name, value in keys.items()}
    period = {"battery.period_s": 60.0} if schedule == "alternating" else {}
    return optuav.load("paper").replace({"battery.schedule": schedule, **period, **changed})


def hovering(given: Mission, hover_s: float) -> Replay:
    return optuav.replay(Itinerary(given, (Stop("hover", "hover", hover_s),)))


@pytest.mark.parametrize("schedule", SCHEDULES)
def test_without_flow_all_that_is_available_is_flown(schedule: str) -> None:
    """k_F = 0 and no laser: the packs hold out until ωB is drawn, whoever carries when.

    By hand: 3921.555 A s on the first leg of 37.8961 s, then 4 · 23.2276 A and the radio's 5 W.
    """
    given = scheduled(schedule, laser=None, battery__flow_rate_per_s=0.0)
    hover_A = 4 * 23.2276 + 5.0 / given.link.transmit_voltage_V
    expected_s = 37.8961 + (0.8 * 72_000 - 3921.555) / hover_A
    replayed = hovering(given, 600.0)
    assert replayed.first_s("empty") == pytest.approx(expected_s, abs=0.01)
    assert [event.kind for event in replayed.events].count("pack empty") == 2
    (empty,) = replayed.violations
    assert empty.value is not None
    assert -empty.value == pytest.approx((637.896 - expected_s) * hover_A + 3921.555, rel=1e-4)


@pytest.mark.parametrize("schedule", SCHEDULES)
def test_table_has_a_column_a_pack(schedule: str) -> None:
    """Both packs begin full, their charges change by what flows into them, and only that."""
    replayed = hovering(scheduled(schedule), 400.0)
    assert replayed.flyable
    table = replayed.trace
    assert table.available_As.shape == table.bound_As.shape == (len(table), 2)
    assert table.available_As[0] == pytest.approx([28_800.0, 28_800.0])
    total_As = (table.available_As + table.bound_As).sum(axis=1)
    drawn_As = -(table.current_A[:-1] * np.diff(table.time_s)).sum()
    assert total_As[-1] == pytest.approx(72_000.0 - drawn_As, abs=0.072)
    assert replayed.soc["battery"] == pytest.approx(total_As[-1] / 72_000)
    assert abs(np.diff(total_As)).max() < 120.0 * 16.0
    assert table.available_As.max() < 28_800.0 * (1 + 1e-9)
    assert {"available_As", "available_1_As", "bound_2_As"} <= set(replayed.to_frame().columns)


def test_pooled_is_what_a_single_pack_does() -> None:
    """One pack of the whole capacity under a schedule, and two used as one."""
    alone = {"battery__packs": 1, "battery__capacity_As": 72_000.0}
    single = hovering(scheduled("sequential", **alone), 650.0)
    both = hovering(optuav.load("paper"), 650.0)
    assert single.first_s("empty") == pytest.approx(both.first_s("empty"), abs=1e-6)


@pytest.mark.parametrize("schedule", SCHEDULES)
def test_audit_and_picture(schedule: str) -> None:
    """Where the packs give out, the table ends."""
    pytest.importorskip("matplotlib")
    replayed = hovering(scheduled(schedule), 650.0)
    assert "no pack is left to fly on" in str(optuav.audit(replayed.subject))
    assert replayed.trace.time_s[-1] == pytest.approx(replayed.first_s("empty"))
    axes = plots.profile(replayed)
    assert axes.speed.get_xlim()[1] == replayed.trace.time_s[-1]
