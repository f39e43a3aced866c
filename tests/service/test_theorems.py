"""Theorems of coverage and robust plans, attacked by random batteries, schedules and boxes."""

import itertools
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import optuav
from optuav.physics.kibam import Battery, Stage
from optuav.service.visit import Visit
from tests.cycles import flown, random_visit
from tests.examples import few
from tests.service.test_robust import flown as euler

SEEDS = st.integers(0, 10**6)


def full(visit: Visit) -> tuple[float, float]:
    """Both full wells."""
    B, share = visit.battery.capacity_As, visit.battery.available_fraction
    return share * B, (1.0 - share) * B


def lowest(visit: Visit, stages: list[Stage]) -> tuple[float, float]:
    """Least and largest y1 as a share of B, from full wells."""
    B = visit.battery.capacity_As
    ends = flown(visit, stages, full(visit))
    return min(y1 for y1, _ in ends) / B, max(y1 for y1, _ in ends) / B


@few(12)
@given(SEEDS)
def test_no_wells_allow_a_longer_hover_than_full_ones(seed: int) -> None:
    """So that share(h_full) bounds all cycles on a building; and the share grows with the hover."""
    rng = np.random.default_rng(seed)
    visit = random_visit(rng)
    if visit.from_full_s is None:
        return
    battery, most_s = visit.battery, visit.most_s
    B, share = battery.capacity_As, battery.available_fraction
    for _ in range(20):
        wells = share * B * rng.uniform(), (1.0 - share) * B * rng.uniform()
        stages = [*visit.stages(most_s * (1.0 + 1e-6) + 1e-6)]
        ends = flown(visit, stages, wells)
        assert min(y1 for y1, _ in ends) < 0.0 or sum(ends[-1]) < visit.least_As
    shares = [visit.share(hover_s) for hover_s in np.linspace(0.0, 2.0, 20) * most_s]
    assert np.all(np.diff(shares) > 0.0) or most_s == 0.0


@few(12)
@given(SEEDS)
def test_the_range_of_the_available_well_grows_with_the_hover(seed: int) -> None:
    """Over one cycle that repeats: what the bisection rests on."""
    rng = np.random.default_rng(seed)
    visit = random_visit(rng)
    if visit.balanced_s < 1.0:
        return
    ranges = list[float]()
    for hover_s in np.linspace(0.01, 1.2, 12) * visit.balanced_s:
        rest = Stage(visit.rest_A, visit.rest_s(hover_s))
        ends = flown(visit, [*visit.stages(hover_s), rest], visit.wells(hover_s))
        ranges.append(max(y1 for y1, _ in ends) - min(y1 for y1, _ in ends))
    assert np.all(np.diff(ranges) >= -1e-9 * visit.battery.capacity_As)


@few(12)
@given(SEEDS)
def test_two_unequal_hovers_cover_no_more_than_the_bound(seed: int) -> None:
    """A cycle of several visits that repeats, with any hovers and rests, in both wells."""
    rng = np.random.default_rng(seed)
    visit = random_visit(rng)
    if visit.from_full_s is None or visit.most_s < 1.0:
        return
    battery, bound = visit.battery, visit.share(visit.most_s)
    full = battery.available_fraction * battery.capacity_As
    for _ in range(10):
        hovers_s = rng.uniform(0.5, 1.05, 2) * visit.most_s
        rests_s = rng.uniform(0.3, 1.0, 2)
        needed_As = visit.hover_A * hovers_s.sum() + 2.0 * visit.flight_As
        rests_s *= needed_As / visit.rest_A / rests_s.sum()
        stages = list[Stage]()
        for hover_s, rest_s in zip(hovers_s, rests_s, strict=True):
            stages += [*visit.stages(hover_s), Stage(visit.rest_A, rest_s)]
        # Fifty periods settle the tilt; the level is free, so only ranges count
        wells = full, battery.capacity_As - full
        for _ in range(50):
            *_, wells = flown(visit, stages, wells)
        ends = flown(visit, stages, wells)
        y1 = [each for each, _ in [wells, *ends]]
        shift_As = full - max(y1)  # As full as the wells allow, by whole charge levels
        landings = [sum(end) + shift_As / battery.available_fraction for end in ends]
        if ends[-1] != pytest.approx(wells, abs=1e-9 * battery.capacity_As):
            continue
        if min(y1) + shift_As >= 0.0 and min(landings) >= visit.least_As:
            period_s = sum(stage.duration_s for stage in stages)
            assert hovers_s.sum() / period_s <= bound * (1.0 + 1e-9)


@few(12)
@given(SEEDS)
def test_more_drawn_and_less_charged_is_never_fuller(seed: int) -> None:
    """The positive kernel: any factors within a box, any schedule, any number of stops."""
    rng = np.random.default_rng(seed)
    visit = random_visit(rng)
    B = visit.battery.capacity_As
    drains_A, charges_A = rng.uniform(0, B / 400, 8), rng.uniform(0, B / 900, 8) * rng.choice(2, 8)
    times_s = rng.uniform(1, 400, 8)

    def scaled(drain: Any, charge: Any) -> list[Stage]:
        currents_A = np.asarray(charge) * charges_A - np.asarray(drain) * drains_A
        return [*map(Stage, currents_A.tolist(), times_s.tolist())]

    least, _ = lowest(visit, scaled(1.1, 0.8))
    _, most = lowest(visit, scaled(0.9, 1.2))
    for _ in range(10):  # Also factors that change from stage to stage
        low, high = lowest(visit, scaled(rng.uniform(0.9, 1.1, 8), rng.uniform(0.8, 1.2, 8)))
        assert low >= least - 1e-9
        assert high <= most + 1e-9


@few(10)
@given(SEEDS)
def test_a_longer_hover_repeats_from_no_level_of_charge(seed: int) -> None:
    """The tilt has one periodic solution and the level is free: all levels of it are tried."""
    visit = random_visit(np.random.default_rng(seed))
    if not visit.longest_s or visit.longest_s > visit.most_s * (1.0 - 1e-4):
        return  # Charge binds: seen by other tests
    hover_s, battery = visit.longest_s * (1.0 + 1e-5) + 1e-3, visit.battery
    B, share = battery.capacity_As, battery.available_fraction
    stages = [*visit.stages(hover_s), Stage(visit.rest_A, visit.rest_s(hover_s))]
    wells = full(visit)
    for _ in range(2000):  # Brute force: flown until it repeats
        before, wells = wells, flown(visit, stages, wells)[-1]
        if abs(wells[0] - before[0]) < 1e-13 * B:
            break
    for moved_As in np.linspace(-1.0, 1.0, 400) * B:
        start = wells[0] + share * moved_As, wells[1] + (1.0 - share) * moved_As
        ends = [start, *flown(visit, stages, start)]
        too_full = max(y1 for y1, _ in ends) > share * B * (1.0 + 1e-12)
        dry = min(y1 for y1, _ in ends) < 0.0
        assert too_full or dry or sum(ends[-2]) < visit.least_As


@few(8)
@given(SEEDS)
def test_a_charger_that_tapers_covers_no_more(seed: int) -> None:
    """A longer hover, with the longest rest that would pay, is flown until it fails.

    In small steps, whose current is cut where y1 would pass ωB: a little more than a taper gives.
    """
    rng = np.random.default_rng(seed)
    visit = random_visit(rng)
    if not visit.longest_s or visit.longest_s > visit.most_s * (1.0 - 1e-4):
        return
    hover_s = visit.longest_s + rng.uniform(0.1, 1.0) * (visit.most_s - visit.longest_s)
    step_s = (hover_s / visit.share(visit.longest_s) - hover_s - visit.flight_s) / 60
    full_As, wells = full(visit)[0], full(visit)
    for _ in range(1500):
        before, ends = wells, flown(visit, [*visit.stages(hover_s)], wells)
        wells = ends[-1]
        if min(y1 for y1, _ in ends) < 0.0 or sum(wells) < visit.least_As:
            return
        for _ in range(60):
            y1, y2 = flown(visit, [Stage(visit.rest_A, step_s)], wells)[-1]
            wells = min(y1, full_As), y2
        assert wells != before, "it repeats and covers more"


@few(10)
@given(SEEDS)
def test_the_longest_hover_from_full_wells_by_marching(seed: int) -> None:
    """Charge and wells at the end of all hovers of a grid; in `battery` (F − Q)/I_h again."""
    visit = random_visit(np.random.default_rng(seed))
    for other in (visit, replace(visit, perspective="battery")):
        longest_s = -1.0 if other.from_full_s is None else other.from_full_s[0]
        for hover_s in np.arange(0.5, 240.0) * max(longest_s, 1.0) / 200.0:
            ends = flown(other, [*other.stages(float(hover_s))], full(other))
            dry = other.perspective != "battery" and min(y1 for y1, _ in ends) < 0.0
            assert bool(not dry and sum(ends[-1]) >= other.least_As) == (hover_s <= longest_s)


@few(10)
@given(SEEDS)
def test_the_monitor_knows_the_well_at_the_landing(seed: int) -> None:
    """a·y1 + b·y2 − g is y1 at the landing for any wells, by Euler steps through the leg back."""
    rng, mission = np.random.default_rng(seed), optuav.load("paper")
    row = optuav.return_by(mission).rows[0]
    plan = optuav.solve(mission, "P3", perspective="battery")
    B, ω, k_F = 72_000.0, 0.8, 4.5e-5
    y1, y2 = before = ω * B * rng.uniform(), (1.0 - ω) * B * rng.uniform()
    for stage in plan.phases[-1].stages:
        for _ in range(4000):
            flow, dt = k_F * (y2 / (1.0 - ω) - y1 / ω), stage.duration_s / 4000
            y1, y2 = y1 + dt * (flow + stage.current_A), y2 - dt * flow
    left_As = row["a"] * before[0] + row["b"] * before[1] - row["g_As"]
    assert left_As == pytest.approx(y1, abs=1e-5 * B)


def test_plans_of_larger_boxes_hold_wherever_plans_of_smaller_ones_do() -> None:
    """The safe sets are nested, so that one order statistic decides; by Euler steps."""
    rng = np.random.default_rng(1)
    problem = optuav.P4("b1", order="rest-first")
    plans = [
        optuav.robust(
            "paper", {"drain": {"percent": reach}, "charge": {"percent": 2 * reach}}, problem,
            samples=10,
        ).plan
        for reach in (2.0, 5.0, 8.0)
    ]  # fmt: skip
    for _ in range(12):
        drain, charge = rng.uniform(0.88, 1.12), rng.uniform(0.76, 1.24)
        holds = []
        for plan in plans:
            least, fullest, left = euler(plan, drain, charge)
            holds.append(least >= 0.0 and fullest <= 1.0 and left >= 0.05)
        assert holds == sorted(holds)


@few(8)
@given(st.floats(0.1, 3.0), st.integers(0, 30))
def test_pads_by_charge_in_closed_form(share: float, more: int) -> None:
    """`watts` by bisection against I = F/(kh/c − h − T) with h = (F − Q)/I_h."""
    cycle = optuav.coverage("matrice350", perspective="battery", lit_hover=False)
    battery = cycle.mission.battery
    B = battery.packs * battery.capacity_As
    phases = {phase.kind: phase for phase in cycle.plan.phases}
    flights_As = -sum(p.charge_As for p in cycle.plan.phases if p.kind == "flight")
    F = (1.0 - cycle.mission.limits.min_soc) * B
    h = (F - flights_As) / -phases["hover"].current_A
    drones = math.floor(share * (h + cycle.flight_s) / h) + 1 + more
    pads = cycle.watts(drones, share)
    rest_A = 0.45  # What the mission draws at rest, on top of what comes into the battery
    expected_A = rest_A + F / (drones * h / share - h - cycle.flight_s)
    assert pads.current_A == pytest.approx(expected_A, rel=1e-7)


def test_a_charger_that_stops_lets_a_waiting_fleet_run_dry() -> None:
    """Dark waiting after every rest: the wells drift, and `paper` runs dry in four days."""
    cycle, fleet = optuav.coverage("paper"), optuav.coverage("paper").fleet()
    visit, wait_s = cycle.visit, fleet.rows[0]["wait_s"]
    assert visit is not None
    assert wait_s > 0.0
    cycle_s = [*visit.stages(cycle.hover_s), Stage(visit.rest_A, cycle.rest_s), Stage(0.0, wait_s)]
    wells, least = visit.wells(cycle.hover_s), math.inf
    for _ in range(60):
        ends = flown(visit, cycle_s, wells)
        least, wells = min(least, *(y1 for y1, _ in ends)), ends[-1]
    assert -0.02 < least / visit.battery.capacity_As < -0.002


@few(12)
@given(SEEDS)
def test_a_longer_discharge_is_worse_if_it_draws_enough(seed: int) -> None:
    """With |I| ≥ (1 − ω) I_max no later y1 is higher; a gentle discharge may raise it."""
    rng = np.random.default_rng(seed)
    visit = random_visit(rng)
    battery, most_A = visit.battery, visit.battery.capacity_As / 400
    currents_A = -most_A * rng.uniform(1.0 - battery.available_fraction, 1.0, 8)
    charging = rng.uniform(size=8) < 0.3
    currents_A[charging] *= -1.0
    times_s = rng.uniform(1, 400, 8)
    stage = int(rng.choice(np.flatnonzero(~charging))) if not charging.all() else 0
    longer_s = times_s + np.eye(8)[stage] * rng.uniform(0.0, 200.0) * (not charging.all())
    ends, later = (
        np.array(flown(visit, [*map(Stage, currents_A.tolist(), lasts_s.tolist())], full(visit)))
        for lasts_s in (times_s, longer_s)
    )
    assert np.all(later[stage:, 0] <= ends[stage:, 0] + 1e-9 * battery.capacity_As)


def test_a_longer_gentle_discharge_may_be_better() -> None:
    """Below (1 − ω) I_max the bound well refills the available one faster than it is drawn."""
    battery = Battery(36_000.0, 0.4, 1e-3)
    visit = replace(random_visit(np.random.default_rng(0)), battery=battery)
    ends = [
        flown(visit, [Stage(-40.0, 200.0), Stage(-2.0, lasts_s)], full(visit))[-1][0]
        for lasts_s in (10.0, 60.0)
    ]
    assert ends[1] > ends[0]


@few(12)
@given(SEEDS)
def test_the_smallest_capacity_is_worst(seed: int) -> None:
    """For the same currents least y1 and the charge above η0 grow with B, at any k_F and ω."""
    rng = np.random.default_rng(seed)
    visit = random_visit(rng)
    least_share = rng.uniform(0.0, 0.3)
    currents_A = rng.uniform(-1.0, 0.4, 8) * visit.battery.capacity_As / 400
    stages = [*map(Stage, currents_A.tolist(), rng.uniform(1, 400, 8).tolist())]
    dry_As, spare_As = list[float](), list[float]()
    for size in np.sort(rng.uniform(0.5, 1.5, 6)):
        battery = replace(visit.battery, capacity_As=visit.battery.capacity_As * size)
        larger = replace(visit, battery=battery)
        ends = flown(larger, stages, full(larger))
        dry_As.append(min(y1 for y1, _ in ends))
        spare_As.append(sum(ends[-1]) - least_share * battery.capacity_As)
    assert np.all(np.diff(dry_As) > 0.0)
    assert np.all(np.diff(spare_As) > 0.0)


@few(4)
@given(st.floats(0.7, 0.98), st.floats(1.0, 1.3))
def test_a_box_of_capacities_is_planned_for_the_smallest(low: float, high: float) -> None:
    """Its hover is that of `solve` with the smallest pack, whatever the largest is."""
    B = optuav.load("paper").battery.capacity_As
    robust = optuav.robust(
        "paper", {"battery.capacity_As": {"low": low * B, "high": high * B}}, "P3", samples=50
    )
    small = optuav.load("paper").replace({"battery.capacity_As": low * B})
    assert robust.hover_s == pytest.approx(optuav.solve(small, "P3").hover_time_s, abs=1e-6)


@pytest.mark.parametrize(
    ("mission", "key", "problem", "reach"),
    [
        ("paper", "wind.force_N", "P3", 1.0),
        pytest.param(*("paper-drag", "wind.force_N", "P3", 1.0), marks=pytest.mark.soak),
        ("relay-today", "wind.velocity_m_s", "P3", 5.0),
        ("paper", "route.origin_m", "P1", 100.0),
        ("paper", "laser.position_m", "P1", 200.0),
        # Worst points that have to be found: the hover point or b1 is dark, a rest on b3 fills most
        ("paper", "laser.position_m", optuav.P4("b1", order="rest-first"), 3000.0),
        ("paper", "laser.position_m", optuav.P4("b3", order="rest-first"), 6000.0),
        pytest.param(*("matrice350", "laser.position_m", "P1", 150.0), marks=pytest.mark.soak),
    ],
)
def test_plans_hold_where_the_worst_point_is_no_corner(
    mission: str, key: str, problem: Any, reach: float
) -> None:
    """The judge flies the plan on a grid within and at random points; corners would not do.

    A helicopter draws most in no wind, a rest fills most next to a laser, and roofs hide a beam.
    """
    table, _, name = key.partition(".")
    middle = np.array(getattr(getattr(optuav.load(mission), table), name))
    box = {
        f"{key}[{axis}]": {"low": middle[axis] - reach, "high": middle[axis] + 0.6 * reach}
        for axis in (0, 1)
    }
    robust = optuav.robust(mission, box, problem, samples=3000)
    assert robust.flyable == 1.0
    stops = [optuav.Stop(stop.at, stop.kind, stop.duration_s) for stop in robust.plan.stops]
    steps = np.linspace(-reach, 0.6 * reach, 5)
    within = np.random.default_rng(0).uniform(-reach, 0.6 * reach, (12, 2))
    for step in [np.zeros(2), *within, *np.array([*itertools.product(steps, steps)])]:
        other = robust.plan.mission.replace({key: [*(middle[:2] + step).tolist(), middle[2]]})
        replay = optuav.replay(optuav.Itinerary(other, stops))
        assert replay.flyable, (step, replay.violations)


@few(8)
@given(st.sampled_from(["paper", "paper-drag"]), SEEDS)
def test_legs_are_longest_and_draw_most_at_corners_of_the_wind(mission: str, seed: int) -> None:
    """Displacement times are log-convex in the wind's force; turns make a leg 0.01 % longer."""
    rng, still = np.random.default_rng(seed), optuav.load(mission)

    def legs(force_N: Any) -> Any:
        windy = still.replace({"wind.force_N": [*map(float, force_N), 0.0]})
        edges = optuav.graph(windy).edges
        return np.array([[leg["duration_s"], leg["charge_As"]] for leg in edges.values()]).T

    low = rng.uniform(-2.0, 1.0, 2)
    high = low + rng.uniform(0.0, 2.0, 2)
    corners = [legs(corner) for corner in itertools.product(*zip(low, high, strict=True))]
    longest_s, most_As = np.max(corners, axis=0)
    lasts_s, drawn_As = legs(rng.uniform(low, high))
    assert np.all(lasts_s <= longest_s * (1.0 + 1e-4))
    assert np.all(drawn_As <= most_As * (1.0 + 1e-6))
