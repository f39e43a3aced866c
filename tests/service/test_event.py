"""Drones for an event: known counts, the judge's verdict, random rosters with one drone fewer."""

import math
from dataclasses import replace
from typing import Any

import highspy
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import optuav
from optuav.errors import InputError, NoPlanError
from optuav.physics.kibam import Stage
from optuav.service.roster import DroneRing, _overdrawn_As, _programme
from tests.cycles import random_visit
from tests.examples import few


@pytest.mark.parametrize(("hours", "drones"), [(1, 2), (2, 3), (4, 4), (8, 4), (24, 4)])
def test_known_counts(hours: float, drones: int) -> None:
    """Those that independent code found for matrice350."""
    assert optuav.coverage("matrice350").event(hours).drones == drones


@pytest.mark.parametrize("mission", ["paper", "paper-table2", "matrice350", "relay-today"])
@pytest.mark.parametrize(
    ("hours", "options"), [(0.1, {}), (5, {}), (1, {"pad_power_W": 500.0})], ids=str
)
def test_the_judge_flies_the_roster(mission: str, hours: float, options: Any) -> None:
    """No dry well, no low landing and no gap; hovers follow each other and fill the hours."""
    event = optuav.coverage(mission, **options).event(hours)
    replay = event.replay()
    assert replay.flyable, replay.violations
    assert event.drones >= event.least_drones
    ends_s = [row["start_s"] + row["hover_s"] for row in event.rows]
    assert [row["start_s"] for row in event.rows[1:]] == pytest.approx(ends_s[:-1])
    assert ends_s[-1] == pytest.approx(3600 * hours)


@pytest.mark.parametrize(("mission", "hours"), [("matrice350", 2.0), ("paper", 1.0)])
def test_random_rosters_with_a_drone_fewer_fail_by_charge(mission: str, hours: float) -> None:
    """Counted here by hand, hover by hover: below the least number none of many keeps charge."""
    coverage = optuav.coverage(mission)
    drones = coverage.event(hours).least_drones - 1
    hover = next(phase for phase in coverage.plan.phases if phase.kind == "hover")
    legs = [phase for phase in coverage.plan.phases if phase.kind == "flight"][:2]
    trip_s = sum(phase.duration_s for phase in legs)
    trip_As = -sum(phase.current_A * phase.duration_s for phase in legs)
    rest = next(phase for phase in coverage.plan.phases if phase.kind == "rest")
    battery = coverage.mission.battery
    B = battery.packs * battery.capacity_As
    least = coverage.mission.limits.min_soc * B
    random = np.random.default_rng(0)
    for _ in range(2000):
        count = int(random.integers(2, 14))
        hovers_s = random.dirichlet(np.full(count, 20.0)) * 3600 * hours
        starts_s = np.concatenate([[0.0], np.cumsum(hovers_s)])
        held = True
        for drone in range(drones):
            charge, back_s = B, -1e9
            for turn in range(drone, count, drones):
                if turn >= drones:
                    rest_s = starts_s[turn] - back_s - trip_s
                    held &= rest_s >= 0.0
                    charge = min(B, charge + rest.current_A * max(rest_s, 0.0))
                charge -= trip_As - hover.current_A * hovers_s[turn]
                back_s = starts_s[turn + 1]
                held &= charge >= least
        assert not held
    with pytest.raises(NoPlanError, match="at least"):
        coverage.event(hours, drones)


@pytest.mark.parametrize("mission", ["paper", "matrice350", "relay-today"])
@pytest.mark.parametrize(("hours", "swap_s"), [(0.2, 60.0), (2.0, 900.0), (1.5, 3e3)])
def test_exchanges_by_hand(mission: str, hours: float, swap_s: float) -> None:
    """Fewest drones: enough for one hover each, or back with a new pack when their turn comes."""
    coverage = optuav.coverage(mission, swap_s=swap_s)
    event, longest_s = coverage.event(hours), coverage.hover_s
    hovers, away_s = math.ceil(3600 * hours / longest_s), coverage.flight_s + swap_s
    # In ring order the others' hovers between two of its own, each as long as it can be
    turns = next(k for k in range(1, 99) if k >= hovers or (k - 1) * longest_s >= away_s)
    assert event.drones in (turns, turns + 1)
    assert event.replay().flyable
    free_s = dict.fromkeys(range(1, event.drones + 1), -math.inf)
    clock_s = 0.0
    for row in event.rows:
        assert row["start_s"] == pytest.approx(clock_s)
        assert row["hover_s"] <= longest_s * (1 + 1e-9)
        assert row["start_s"] >= free_s[row["drone"]] - 1e-6
        clock_s += row["hover_s"]
        free_s[row["drone"]] = clock_s + away_s
    assert clock_s == pytest.approx(3600 * hours)
    if (mission, hours) == ("paper", 0.2):
        assert [*event.plot()] == ["event.png"]


@few(12)
@given(st.integers(0, 10**6))
def test_rosters_are_told_apart_by_sums_only_where_the_programme_has_no_answer(seed: int) -> None:
    """Sums over runs of any width never refuse hovers that HiGHS finds."""
    rng = np.random.default_rng(seed)
    visit, drones, count = random_visit(rng), int(rng.integers(1, 9)), int(rng.integers(1, 40))
    if visit.balanced_s < 1.0:
        return
    longest_s = visit.balanced_s * rng.uniform(0.8, 1.0)
    # Also from a point to which legs take longer, and with overlaps
    far = replace(visit, out=(*visit.out, Stage(-visit.hover_A, rng.uniform(0, 20))))
    until_s, overlap_s = longest_s * count * rng.uniform(0.7, 1.0), rng.uniform(0, 0.2) * longest_s
    for visits, overlaps_s in (((visit,), 0.0), ((visit, far), 0.0), ((visit, far), overlap_s)):
        ring = DroneRing(tuple(visits[k % len(visits)] for k in range(drones)), until_s, overlaps_s)
        if _programme(ring, np.full(drones, longest_s), count) is not None:
            for width in range(1, count + 1):
                small = 1e-6 * visit.battery.capacity_As
                assert _overdrawn_As(ring, longest_s, count, width) <= small


def test_short_hovers_need_few_programmes(monkeypatch: pytest.MonkeyPatch) -> None:
    """With 175 hovers of 82 s, 473 programmes were solved; those without an answer are told."""
    paper, asked = optuav.load("paper"), list[int]()

    def counted(*given: Any) -> Any:
        asked.append(given[-1])
        return _programme(*given)

    monkeypatch.setattr("optuav.service.roster._programme", counted)
    event = optuav.coverage(paper.replace({"battery.capacity_As": 7200.0})).event(4)
    assert (event.drones, event.least_drones) == (16, 15)
    assert len(asked) <= 5


STRAY = {"battery.available_fraction": 0.2, "battery.flow_rate_per_s": 5e-4}
"""A battery whose available well binds: rosters by charge run dry."""


@pytest.mark.parametrize("hours", [1, 2, 24])
def test_the_ring_is_the_last_roster(hours: float) -> None:
    """Five drones cover all days; an event of hours took seven, nine, or a hundred at least."""
    coverage = optuav.coverage(optuav.load("matrice350").replace(STRAY))
    assert coverage.fleet().drones == 5
    for event in (coverage.event(hours), coverage.event(hours, 5)):
        assert event.drones <= 5
        assert event.replay().flyable


ROOFS = [
    {"name": "near", "position_m": [607.8, -239.4, 19.7], "footprint_m": [4.0, 4.0]},
    {"name": "lit", "position_m": [119.2, -211.2, 7.5], "footprint_m": [4.0, 4.0]},
]


def test_the_fewest_drones_over_all_buildings() -> None:
    """The best endless cycle rests near the laser, a short event near the hover point."""
    ways: Any = {"flight.obstacles": "ignore", "flight.through_buildings": None}
    mission = optuav.load("matrice350").replace({"buildings": ROOFS, **ways})
    coverage = optuav.coverage(mission)
    assert coverage.building == "lit"
    alone = [
        optuav.coverage(mission.replace({"buildings": [roof]})).event(0.5).drones for roof in ROOFS
    ]
    assert alone == [1, 2]
    event = coverage.event(0.5)
    assert (event.drones, event.least_drones, event.building) == (1, 1, "near")
    assert event.replay().flyable
    assert event.plans[0].building == "near"


def test_progress_names_what_is_tried() -> None:
    """Numbers in order, and the building of each roster."""
    told = list[tuple[int, int | None, str]]()
    optuav.coverage("matrice350").event(2, progress=lambda *step: told.append(step))
    assert [done for done, _, _ in told] == [*range(len(told))]
    assert told[-1][-1] == "3 drones on b4"


def test_an_interrupt_ends_a_programme_of_many_hovers(monkeypatch: pytest.MonkeyPatch) -> None:
    """The solver runs beside the thread that Ctrl-C reaches, and is told to stop."""
    stopped = list[bool]()

    def interrupted(*_: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("optuav.service.roster.Thread.join", interrupted)
    cancel = highspy.Highs.cancelSolve
    monkeypatch.setattr(
        highspy.Highs, "cancelSolve", lambda self: stopped.append(True) or cancel(self)
    )
    visit = random_visit(np.random.default_rng(1))
    ring = DroneRing((visit,) * 8, 2000 * visit.balanced_s, 0.0)
    with pytest.raises(KeyboardInterrupt):
        _programme(ring, np.full(8, visit.balanced_s), 2400)
    assert stopped


def test_too_few_drones_are_not_promised_that_one_more_is_enough() -> None:
    """Charge allows 3, the wells 5: of 4, too, every roster empties a well."""
    wells = {"battery.available_fraction": 0.2, "battery.flow_rate_per_s": 5e-4}
    coverage = optuav.coverage(optuav.load("matrice350").replace(wells))
    for drones in (3, 4):
        with pytest.raises(NoPlanError, match="allow more drones, or leave their number open"):
            coverage.event(2, drones)
    assert coverage.event(2).drones == 5


def test_bad_input() -> None:
    """Hours and drones out of range at once, exchanges, and charge alone."""
    coverage, wrong = optuav.coverage("matrice350"), ("8", float("nan"), 0, -1, 241)
    hours: Any
    for hours in wrong:
        with pytest.raises(InputError, match="hours"):
            coverage.event(hours)
    with pytest.raises(InputError) as refused:
        coverage.event(0, 0)
    assert {fault.key for fault in refused.value.faults} == {"hours", "drones"}
    with pytest.raises(InputError, match="perspective"):
        optuav.coverage("matrice350", perspective="battery").event(2)
