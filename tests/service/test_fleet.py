"""Fleets: counts by brute force, days by the judge, pads, refusals."""

import math
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.colors import to_hex

import optuav
from optuav.errors import InputError, NoPlanError
from optuav.judge.fleets import busiest, longest_gap
from optuav.looks import PHASES
from tests.examples import few
from tests.wells import SLOW

SHIPPED = ["paper", "paper-table2", "matrice350"]


@pytest.mark.parametrize("mission", SHIPPED)
@pytest.mark.parametrize("options", [{}, {"pad_power_W": 400}, {"swap_s": 120}], ids=str)
def test_fleets_last_for_four_days(mission: str, options: Any) -> None:
    """No dry well, no gap, no place used twice; one drone or place fewer fails."""
    cycle = optuav.coverage(mission, **options)
    fleet = cycle.fleet()
    replay = fleet.replay(days=4)
    assert replay.flyable, replay.violations
    assert replay.longest_gap_s == pytest.approx(0, abs=1e-6)
    busy_s = cycle.hover_s + cycle.flight_s
    if fleet.drones > 1:
        late_s = (fleet.drones - 1) * fleet.starts_every_s
        assert late_s < cycle.period_s * (1 + 1e-9), "one drone fewer would be in time"
    on_ground_s = cycle.rest_s if options.get("swap_s") else None
    on_ground_s = on_ground_s or fleet.drones * fleet.starts_every_s - busy_s
    assert (fleet.places - 1) * fleet.starts_every_s < on_ground_s
    short = replace(fleet, places=fleet.places - 1)
    kinds = {event.kind for event in short.replay(2).violations}
    assert kinds == {"place"}


@pytest.mark.parametrize("share", [0.4, 2.0, 2.5])
def test_parts_and_several_devices_are_covered(share: float) -> None:
    """As many hover at once as whole devices; below one, the gap is the one that is told."""
    fleet = optuav.coverage("matrice350").fleet(share)
    assert fleet.replay(2).flyable
    assert fleet.share == pytest.approx(share)


def test_a_ring_that_starts_too_rarely_has_a_gap_and_one_too_tight_runs_dry() -> None:
    """The judge finds both, from the same plans."""
    fleet = optuav.coverage("paper").fleet()
    late_s = tuple(1.01 * each for each in fleet.offsets_s)
    rarely = replace(fleet, starts_every_s=fleet.starts_every_s * 1.01, offsets_s=late_s)
    kinds = {event.kind for event in rarely.replay(1).violations}
    assert "gap" in kinds
    fewer = replace(fleet, drones=fleet.drones - 1, offsets_s=fleet.offsets_s[:-1])
    kinds = {event.kind for event in fewer.replay(1).violations}
    assert {"empty", "gap"} & kinds


@pytest.mark.parametrize(("devices", "drones", "published"), [(10, 44, 50)])
def test_staggered_devices_need_fewer_than_the_published_rule(
    devices: int, drones: int, published: int
) -> None:
    """k = m + ⌈mR⌉ with R = (T + r)/h = 3.39, against m (⌈R⌉ + 1)."""
    cycle = optuav.coverage("matrice350")
    h = cycle.hover_s
    published_cycle = replace(cycle, rest_s=3.39 * h - cycle.flight_s, period_s=4.39 * h)
    fleet = published_cycle.fleet(devices)
    assert fleet.drones == drones
    assert devices * (math.ceil(3.39) + 1) == published
    assert fleet.beams == fleet.places + devices


@few(8)
@given(
    st.floats(10, 3000), st.floats(1, 300), st.floats(10, 9000), st.floats(0.05, 3),
    st.floats(0, 0.5),
)  # fmt: skip
def test_counts_by_brute_force(h: float, T: float, r: float, share: float, part: float) -> None:
    """The smallest ring in which every drone is back in time, by trying them.

    Places are counted at many moments of the schedule; a bay is free once the pack is exchanged.
    """
    cycle = optuav.coverage("paper")
    cycle = replace(cycle, hover_s=h, flight_s=T, rest_s=r, period_s=h + T + r)
    fleet = cycle.fleet(share, part * h)
    every_s = (h - part * h) / share
    drones = next(k for k in range(1, 10_000) if k * every_s >= (h + T + r) * (1 - 1e-8))
    assert abs(fleet.drones - drones) <= (abs((h + T + r) / every_s - fleet.drones) < 1e-6)
    assert fleet.starts_every_s == pytest.approx(every_s)
    swapped = replace(cycle, visit=replace(cycle.visit, swap_s=r))
    moments_s = np.arange(1, 400) / 401 * every_s
    turn_s = fleet.drones * every_s
    for ring, stay_s in ((fleet, turn_s - h - T), (swapped.fleet(share, part * h), r)):
        landed_s = h + T + every_s * np.arange(-2 * fleet.drones - 2, 1)[:, None]
        moment_s = moments_s + h + T
        used = ((landed_s <= moment_s) & (moment_s < landed_s + stay_s)).sum(axis=0)
        near = abs(stay_s / every_s - round(stay_s / every_s)) < 0.01  # Between two moments
        assert ring.places in ((used.max(), used.max() + 1) if near else (max(used.max(), 1),))


@few(12)
@given(st.floats(100, 3000), st.floats(1, 900), st.floats(10, 9000), st.floats(0.05, 3),
       st.floats(0, 0.5))  # fmt: skip
def test_beams_by_brute_force(h: float, T: float, r: float, share: float, part: float) -> None:
    """Enough for all drones that hover or are on the ground at once, and never more than drones."""
    cycle = optuav.coverage("paper")
    cycle = replace(cycle, hover_s=h, flight_s=T, rest_s=r, period_s=h + T + r)
    fleet = cycle.fleet(share, part * h)
    every_s, drones = fleet.starts_every_s, fleet.drones
    begun_s = every_s * np.arange(-3 * drones, drones)[:, None]
    moment_s = every_s * (0.5 + np.arange(500)) / 500
    out = (begun_s + 0.5 * T <= moment_s) & (moment_s < begun_s + 0.5 * T + h)
    landed_s = begun_s + h + T
    on_ground = (landed_s <= moment_s) & (moment_s < begun_s + drones * every_s)
    assert (out | on_ground).sum(axis=0).max() <= fleet.beams <= drones


def test_no_fleet_has_more_beams_than_drones() -> None:
    """`size paper` at 50 %: six drones had seven beams."""
    row = optuav.size_fleet("paper", None, 0.5).rows[0]
    assert (row["drones"], row["beams"]) == (6, 6)


@pytest.mark.parametrize(
    ("share", "overlap_s", "wrong", "kind"),
    [
        (1.0, 30.0, {"beams": 4}, "beam"),
        (1.0, 30.0, {"overlap_s": 60.0}, "overlap"),
        (2.0, 30.0, {"overlap_s": 31.0}, "overlap"),
        (0.4, 0.0, {"asked_share": 0.5, "longest_gap_s": 1e9}, "gap"),
        (2.5, 0.0, {"asked_share": 2.6}, "share"),
    ],
)
def test_the_judge_counts_beams_and_overlaps_and_trusts_no_stated_gap(
    share: float, overlap_s: float, wrong: Any, kind: str
) -> None:
    """A fleet flies as it says; one that says more is found out."""
    fleet = optuav.coverage("matrice350").fleet(share, overlap_s)
    assert fleet.replay(2).flyable, fleet.replay(2).violations
    kinds = {event.kind for event in replace(fleet, **wrong).replay(2).violations}
    assert kind in kinds


@few(6)
@given(st.floats(0.1, 3.0), st.floats(0.0, 0.5))
def test_the_judge_agrees_with_every_ring(share: float, part: float) -> None:
    """Any share and overlap: no fault, and the longest gap as stated."""
    cycle = optuav.coverage("matrice350")
    fleet = cycle.fleet(share, part * cycle.hover_s)
    replay = fleet.replay(1)
    assert replay.flyable, replay.violations
    assert replay.longest_gap_s <= fleet.longest_gap_s + 0.1


def test_known_pads() -> None:
    """`matrice350` with three drones: 619 W by charge, more than the pack accepts."""
    pads = optuav.coverage("matrice350", perspective="battery").watts(3)
    assert round(pads.power_W) == 619
    assert not pads.accepted
    assert "more than battery.charge_current_A allows" in str(pads)
    battery = optuav.load("matrice350").battery
    hourly_A = battery.packs * battery.capacity_As / 3600.0  # Empties all packs in an hour
    assert pads.c_rate == pytest.approx(pads.power_W / battery.nominal_voltage_V / hourly_A)
    strong = optuav.coverage("matrice350").watts(5)
    assert strong.accepted
    found = optuav.coverage("matrice350", pad_power_W=strong.power_W)
    assert found.fleet().drones == 5
    less = optuav.coverage("matrice350", pad_power_W=0.999 * strong.power_W)
    assert less.fleet().drones == 6


@pytest.mark.parametrize("mission", ["relay-today", "matrice350"])
@pytest.mark.parametrize("options", [{}, {"swap_s": 120}, {"pad_power_W": 400}], ids=str)
def test_pads_serve_the_fleet_with_its_overlap(mission: str, options: Any) -> None:
    """The pads it names need as many drones, weaker ones more, whatever the coverage charged by."""
    pads = optuav.coverage(mission, **options).watts(3, 1.0, 60.0)
    strong = optuav.load(mission).replace({"battery.charge_current_A": 20.0})
    for power_W, drones in ((pads.power_W, 3), (0.999 * pads.power_W, 4)):
        cycle = optuav.coverage(strong, pad_power_W=power_W)
        assert cycle.building == pads.building
        assert cycle.fleet(1.0, 60.0).drones == drones
    assert pads.building in str(pads)


def test_no_pad_makes_up_for_an_overlap_as_long_as_the_hover() -> None:
    """One drone cannot cover all of the time; a long overlap is refused as for a fleet."""
    mission = optuav.load("matrice350").replace(SLOW)
    best = [each for each in mission.buildings if each.name == "b4"]
    cycle = optuav.coverage(mission.replace({"buildings": best}))
    with pytest.raises(InputError, match="must be at most half of the hover"):
        cycle.watts(8, 1.0, 900.0)
    for drones, overlap_s in ((1, 0.0), (3, 1e5)):
        with pytest.raises(NoPlanError, match=rf"{drones} drones?: even without rests"):
            cycle.watts(drones, 1.0, overlap_s)
    with pytest.raises(InputError, match="overlap_s = -1"):
        cycle.watts(3, 1.0, -1.0)


@few(30)
@given(st.lists(st.tuples(st.integers(0, 60), st.integers(1, 30)), min_size=1, max_size=12),
       st.integers(1, 3))  # fmt: skip
def test_gaps_and_places_by_brute_force(stated: list[tuple[int, int]], wanted: int) -> None:
    """Counts on every half second between whole ones, tried one by one."""
    intervals = [(float(begin), float(begin + lasts)) for begin, lasts in stated]
    moments = np.arange(0, 90) + 0.5
    count = [sum(begin < t < end for begin, end in intervals) for t in moments]
    runs = "".join("x" if each < wanted else " " for each in count).split()
    assert longest_gap(intervals, wanted, 0.0, 90.0)[0] == max(map(len, runs), default=0)
    assert busiest(intervals, 1e-9)[0] == max(count)


def test_the_picture_of_a_roster_has_its_hovers() -> None:
    """One bar per drone as long as the rows say, in the colour of hovers, and all of them below."""
    event = optuav.coverage("matrice350").event(2)
    (ax,) = event.plot()["event.png"].axes
    spans = {number: list[tuple[float, float]]() for number in range(event.drones + 1)}
    for bar in ax.collections:
        if to_hex(bar.get_facecolor()[0]) == PHASES["hover"].lower():
            low, high = bar.get_paths()[0].get_extents().get_points()
            spans[int(low[1] + 0.45)].append((low[0] * 3600.0, high[0] * 3600.0))
    rows = [(row["start_s"], row["start_s"] + row["hover_s"]) for row in event.rows]
    for number, drawn in spans.items():
        due = rows if number == event.drones else rows[number :: event.drones]
        assert np.array(sorted(drawn)) == pytest.approx(np.array(due), abs=1e-6)
    assert event.building in str(event)


@pytest.mark.parametrize("drones", [4, 5])
def test_the_picture_of_an_event_shows_overlaps_and_all_legs(drones: int) -> None:
    """Two drones on station never share a lane, and the axes hold the first and the last leg."""
    event = optuav.coverage("matrice350").event(4, drones, overlap_s=60.0)
    (ax,) = event.plot()["event.png"].axes
    extents = [path.get_extents() for bars in ax.collections for path in bars.get_paths()]
    low_h, high_h = ax.get_xlim()
    assert min(box.x0 for box in extents) > low_h
    assert max(box.x1 for box in extents) < high_h
    out, _, back, *_ = event.cycles[0].phases
    assert min(box.x0 for box in extents) <= -0.9 * out.duration_s / 3600.0
    assert max(box.x1 for box in extents) >= 4.0 + 0.9 * back.duration_s / 3600.0
    on_station = sorted((box.x0, box.x1, box.y0) for box in extents if box.y0 > drones)
    assert len(on_station) == len(event.rows)
    for (_, ends_h, lane), (begins_h, _, other) in pairwise(on_station):
        assert ends_h - begins_h == pytest.approx(60.0 / 3600.0)
        assert lane != other


def test_the_picture_and_the_table_of_a_fleet() -> None:
    """A bar per drone, a row per drone."""
    fleet = optuav.coverage("matrice350").fleet()
    assert [*fleet.plot()] == ["fleet.png"]
    assert len(fleet.to_frame()) == fleet.drones == 4
    assert "4, a start every" in str(fleet)
    lone = optuav.coverage("relay-today", swap_s=120).fleet(0.9)
    (ax,) = lone.plot()["fleet.png"].axes
    assert ax.get_title(loc="left") == "relay-today: 1 drone for 90 % of the time"


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ({"share": 0}, "share = 0: must be a number, 0 < x <= 1000"),
        ({"share": "all"}, "share = 'all'"),
        ({"overlap_s": -1}, "overlap_s = -1"),
        (
            {"overlap_s": 1e6},
            "overlap_s = 1000000.0: must be at most half of the hover of a cycle, 898.523 s",
        ),
    ],
)
def test_bad_fleets_are_refused(asked: Any, words: str) -> None:
    """Key, value and range."""
    with pytest.raises(InputError) as refusal:
        optuav.coverage(optuav.load("matrice350").replace(SLOW)).fleet(**asked)
    assert words in str(refusal.value)


def test_an_overlap_is_up_to_half_of_the_hover() -> None:
    """Two drones hover at once at most; beyond it a third one would."""
    cycle = optuav.coverage("matrice350")
    fleet = cycle.fleet(1.0, 0.5 * cycle.hover_s)
    assert fleet.share == pytest.approx(2.0)
    with pytest.raises(InputError, match="must be at most half"):
        cycle.fleet(1.0, 0.5 * cycle.hover_s + 1e-6)


def test_a_fleet_without_end_is_refused() -> None:
    """Weak pads let a drone hover for less than 1 % of the time."""
    with pytest.raises(NoPlanError, match="more than 100000: ask for a smaller share"):
        optuav.coverage("matrice350", pad_power_W=22).fleet(1000)


def test_bad_days_drones_and_shares_are_refused() -> None:
    """Of the replay and of pads."""
    cycle = optuav.coverage("matrice350")
    with pytest.raises(InputError, match="days = 0"):
        cycle.fleet().replay(0)
    with pytest.raises(InputError, match=r"drones = 1\.5: must be a whole number"):
        cycle.watts(1.5)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="share = -1"):
        cycle.watts(3, -1)
