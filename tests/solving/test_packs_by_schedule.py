"""The longest hover under a schedule: against every pair of slots, and between the steps."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import optuav
from optuav import P4
from optuav.errors import InputError, SolverError
from optuav.mission import Mission, load
from optuav.network.network import Network, build_network
from optuav.network.timeline import carry, route_phases
from optuav.plan import Plan
from optuav.solving import packs_by_schedule
from optuav.status import Status
from tests.asking import solve
from tests.examples import few

SCHEDULES = {
    "sequential": {},
    "round-robin": {},
    "alternating": {"battery.period_s": 20.0},
    "most-available": {},
}


def small(schedule: str, **more: object) -> Mission:
    """`paper` with packs of 6000 A s, a strong laser and 160 s, so that every pair can be tried."""
    return load("paper").replace(
        {
            "battery.capacity_As": 6000,
            "battery.charge_current_A": 60,
            "laser.power_W": 9000,
            "limits.deadline_s": 160,
            "buildings": [b.model_dump() for b in load("paper").buildings[6:8]],
            "battery.schedule": schedule,
            **SCHEDULES[schedule],
            **more,
        }
    )


@functools.cache
def best_plan(schedule: str) -> Plan:
    """The plan of the small mission in continuous times."""
    return solve(small(schedule), perspective="available")


def can_be_flown(network: Network, route: int, hover_s: float, rest_s: float) -> bool:
    """One pair, flown phase by phase and judged afterwards."""
    mission = network.mission
    planned = route_phases(network, route, hover_s, rest_s)
    time_s = sum(each.duration_s for each in planned)
    if time_s > mission.limits.deadline_s + 1e-9:
        return False
    flown = carry(mission, planned)
    left_As = sum(sum(well) for well in flown.wells[-1])
    capacity_As = mission.battery.packs * mission.battery.capacity_As
    return flown.ended_s is None and left_As >= mission.limits.min_soc * capacity_As


@pytest.mark.parametrize(
    ("schedule", "min_soc"),
    [
        ("sequential", 0.05),
        ("round-robin", 0.3),
        ("alternating", 0.05),
        ("most-available", 0.3),
        pytest.param("sequential", 0.3, marks=pytest.mark.soak),
        pytest.param("round-robin", 0.05, marks=pytest.mark.soak),
        pytest.param("alternating", 0.3, marks=pytest.mark.soak),
        pytest.param("most-available", 0.05, marks=pytest.mark.soak),
    ],
)
def test_slots_are_searched_to_the_end(schedule: str, min_soc: float) -> None:
    """No pair of slots of any route hovers longer; among the best, the shortest mission wins."""
    mission = small(schedule, **{"limits.min_soc": min_soc})
    network, slot_s = build_network(mission), 10.0
    steps = slot_s * np.arange(1, 16)
    tried = []
    for route, flight_s in enumerate(network.routes.flight_time_s.tolist()):
        for hover_s in steps[::-1]:  # shorter ones are no better than the first that can be flown
            rests = steps if route else [0.0]
            flown = [rest_s for rest_s in rests if can_be_flown(network, route, hover_s, rest_s)]
            tried += [(-hover_s, flight_s + hover_s + rest_s, route) for rest_s in flown]
            if flown:
                break
    plan = solve(mission, perspective="available", slot_s=slot_s)
    longest_s, mission_s, _ = min(tried)
    assert plan.status is Status.OPTIMAL
    assert plan.proof.startswith("exhaustive")
    assert plan.hover_time_s == pytest.approx(-longest_s)
    assert plan.mission_time_s == pytest.approx(mission_s)
    assert plan.flyable is True


@few(3)
@given(
    schedule=st.sampled_from([*SCHEDULES]),
    capacity_As=st.floats(4_000.0, 9_000.0),
    flow_rate_per_s=st.sampled_from([0.0, 1e-4, 5e-3, 0.05]),
    available_fraction=st.floats(0.2, 0.9),
    charge_current_A=st.floats(5.0, 80.0),
    packs=st.integers(2, 3),
    slot_s=st.sampled_from([4.0, 9.0]),
)
def test_no_pair_that_can_be_flown_is_passed_over(
    schedule: str, packs: int, slot_s: float, **battery: float
) -> None:
    """The search begins below hovers that the flight after them rules out, and loses no pair."""
    numbers = {f"battery.{name}": value for name, value in battery.items()}
    mission = small(schedule, **numbers, **{"battery.packs": packs})
    found = solve(mission, slot_s=slot_s)
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(packs_by_schedule._Route, "_needed_As", lambda *_: -np.inf)
        every = solve(mission, slot_s=slot_s)
    assert (found.status, bool(found)) == (every.status, bool(every))
    if found:
        assert (found.hover_time_s, found.rest_time_s) == (every.hover_time_s, every.rest_time_s)
        assert found.route == every.route


@pytest.mark.parametrize("schedule", SCHEDULES)
def test_continuous_times_are_no_worse_than_slots_and_can_be_flown(schedule: str) -> None:
    """A little more cannot, at this rest; and what is not proved is not called so."""
    mission = small(schedule)
    plan = best_plan(schedule)
    slots = solve(mission, perspective="available", slot_s=4.0)
    assert plan.status is Status.FEASIBLE
    assert "not proved" in plan.proof
    assert plan.hover_time_s >= slots.hover_time_s
    assert plan.runs_dry_s is None
    assert plan.warnings == ()
    network = build_network(mission)
    routes = network.routes
    building = [b.name for b in mission.buildings]
    (route,) = (
        number
        for number in range(len(routes))
        if [building[k] for k in routes.building[[number]] if k >= 0]
        == [name for name in plan.route if name in building]
        and (routes.order(number) != "hover-first")
        == (plan.route.index("hover") + 2 == len(plan.route))
    )
    assert can_be_flown(network, route, plan.hover_time_s, plan.rest_time_s)
    assert not can_be_flown(network, route, plan.hover_time_s + 0.002, plan.rest_time_s)


@pytest.mark.parametrize("schedule", ["pooled", *SCHEDULES])
@pytest.mark.parametrize(
    ("problem", "deadline_s", "slot_s", "hover_s"),
    [
        ("P1", 100.0, 10.0, 24.2078),  # the last slot is cut short by the deadline
        ("P1", 100.0, 24.0, 24.2078),
        ("P1", 100.0, 1e4, 0.0),  # which has to be affordable whole
        ("P3", 95.0, 5.0, 19.2078),
        (P4("b1"), 100.0, 10.0, None),  # no pair of whole slots fits
        (P4("b1"), 110.0, 10.0, 10.0),  # nothing of it is cut short
        (P4("b1"), 110.0, 9.0, 9.0),
    ],
)
def test_slots_are_the_same_under_every_schedule(
    schedule: str, problem: Any, deadline_s: float, slot_s: float, hover_s: float | None
) -> None:
    """Where charge is plenty: a stay takes a slot at least, and the same slots may be cut short."""
    far = {f"buildings.b{k}": None for k in range(3, 11)}
    values = {"limits.deadline_s": deadline_s, "battery.schedule": schedule, **far}
    mission = load("paper").replace({**values, **SCHEDULES.get(schedule, {})})
    plan = optuav.solve(mission, problem, slot_s=slot_s)
    assert plan.status is (Status.INFEASIBLE if hover_s is None else Status.OPTIMAL)
    if hover_s is not None:
        assert plan.hover_time_s == pytest.approx(hover_s, abs=1e-4)
        assert plan.rest_time_s == (slot_s if isinstance(problem, P4) else 0.0)


def test_a_slot_that_is_cut_short_has_to_be_affordable_whole() -> None:
    """As for pooled packs: 66 s of hover are left, and charge for 65 s."""
    mission = small("sequential", **{"limits.deadline_s": 66.0 + 75.792246115529})
    longest_s = solve(mission, "P3").hover_time_s
    for slot_s in (1.0, 2.0, 5.0, 7.0):
        slots = solve(mission, "P3", slot_s=slot_s)
        assert slots.hover_time_s == slot_s * (longest_s // slot_s)


def test_the_time_limit_holds_among_many_turns(monkeypatch: pytest.MonkeyPatch) -> None:
    """It is looked at after every turn, which nobody keeps; too many turns are refused at once."""
    mission = small("sequential", **{"limits.deadline_s": 200})
    turns = {"battery.schedule": "alternating", "battery.period_s": 0.01}
    clock = Ticking()
    monkeypatch.setattr(packs_by_schedule, "time", clock)
    with pytest.raises(SolverError, match="ended after 50 s"):
        solve(mission.replace(turns), time_limit_s=50.0)
    assert clock.seconds < 60.0
    with pytest.raises(
        InputError, match=r"period_s = 0\.001: .*limits.deadline_s / 20000 = 0\.01 \[s\]"
    ):
        mission.replace({**turns, "battery.period_s": 0.001})


def test_every_pack_is_told_at_the_end_of_every_phase() -> None:
    plan = solve(small("sequential"), "P3", perspective="available")
    assert all(len(phase.available_As) == 2 for phase in plan.phases)
    left_As = sum(plan.phases[-1].available_As) + sum(plan.phases[-1].bound_As)
    assert plan.soc is not None
    assert plan.soc["battery"] == pytest.approx(left_As / 12_000.0)


def test_paper_by_schedule() -> None:
    """Direct: the order of the packs costs hover, and alternating costs least."""
    paper = load("paper")
    hover_s = {
        schedule: solve(
            paper.replace({"battery.schedule": schedule, **more}), "P3", perspective="available"
        ).hover_time_s
        for schedule, more in SCHEDULES.items()
    }
    pooled_s = solve(paper, "P3", perspective="available").hover_time_s
    assert hover_s["sequential"] < hover_s["round-robin"] == hover_s["most-available"]
    assert hover_s["round-robin"] < hover_s["alternating"] < pooled_s


def test_linear_perspectives_answer_the_programme_as_stated() -> None:
    """Charge balance knows no packs: the answer stays, and the warning tells when it would fall."""
    paper = load("paper")
    pooled = solve(paper, perspective="battery")
    apart = solve(paper.replace({"battery.schedule": "sequential"}), perspective="battery")
    assert apart.hover_time_s == pooled.hover_time_s
    assert apart.runs_dry_s is not None
    assert "no pack is left to fly on" in apart.warnings[0]


def test_nothing_feasible_is_said() -> None:
    plan = solve(small("sequential", **{"battery.capacity_As": 2000}), perspective="available")
    assert not plan
    assert "leaves a pack to fly on" in plan.reasons[0]


@pytest.mark.parametrize("option", [{"problem": "P2"}, {"engine": "casadi"}])
def test_questions_that_only_pooled_packs_can_be_asked(option: dict[str, str]) -> None:
    with pytest.raises(InputError, match="schedule"):
        solve(small("sequential"), perspective="available", **option)


@pytest.mark.parametrize("schedule", SCHEDULES)
def test_a_single_pack_is_the_pooled_battery(schedule: str) -> None:
    """Proved, by the same engine, without a word of turns that nobody takes."""
    mission = small(schedule, **{"battery.packs": 1, "battery.capacity_As": 12_000})
    plan = solve(mission)
    pooled = solve(mission.replace({"battery.schedule": "pooled", "battery.period_s": None}))
    assert plan.status is Status.OPTIMAL
    for name in ("engine", "proof", "phases", "soc", "notes", "warnings", "flyable"):
        assert getattr(plan, name) == getattr(pooled, name), name


class Ticking:
    """A clock that is a second later each time that somebody looks."""

    def __init__(self) -> None:
        self.seconds = 0.0

    def monotonic(self) -> float:
        self.seconds += 1.0
        return self.seconds


@pytest.mark.parametrize(("slot_s", "short_s"), [(None, 400.5), (8.0, 100.5)])
def test_past_the_time_limit_the_best_so_far_is_the_answer(
    slot_s: float | None, short_s: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It can be flown, is not called the best, and a search with more time finds no less."""
    mission = small("sequential")
    best = best_plan("sequential") if slot_s is None else solve(mission, slot_s=slot_s)
    best_s = best.hover_time_s
    found_s = []
    for limit_s in (short_s, 2.0 * short_s, 1e6):
        monkeypatch.setattr(packs_by_schedule, "time", Ticking())
        plan = solve(mission, slot_s=slot_s, time_limit_s=limit_s)
        early = limit_s < 1e6
        assert plan.flyable is True
        assert any(f"ended after {limit_s:g} s" in note for note in plan.notes) is early
        assert (plan.status is Status.FEASIBLE) is (early or slot_s is None)
        found_s.append(plan.hover_time_s)
    assert found_s == sorted(found_s)
    assert found_s[-1] == best_s
    monkeypatch.setattr(packs_by_schedule, "time", Ticking())
    with pytest.raises(SolverError) as refused:
        solve(mission, slot_s=slot_s, time_limit_s=0.5)
    for words in (
        "battery.schedule = 'sequential' ended after 0.5 s, the time limit, without a plan or",
        f": 0 of 5 routes were searched to the end, Δ and T' in steps of {slot_s or 1:g} s. ",
        "Allow more time (time_limit_s), or ask for less: longer slots (slot_s), or fewer routes",
    ):
        assert words in str(refused.value)


@pytest.mark.parametrize(
    ("options", "fewer"),
    [({"trajectory": "direct"}, ""), ({}, ", or fewer routes (trajectory, order)")],
)
def test_without_a_plan_in_time_less_is_advised_only_where_less_can_be_asked(
    options: dict[str, str], fewer: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whoever asked for one route is not told to ask for fewer."""
    monkeypatch.setattr(packs_by_schedule, "time", Ticking())
    with pytest.raises(SolverError) as refused:
        solve(small("sequential"), time_limit_s=0.5, **options)
    assert str(refused.value).endswith(f"ask for less: longer slots (slot_s){fewer}")
