"""KiBaM: the closed form against the differential equations, known lifetimes, moments, limits."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from decimal import Decimal, localcontext
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from optuav.modelling import Parameter, Variable, evaluate
from optuav.physics import kibam, rotor, six_stages
from optuav.physics.kibam import Battery, Stage, Wells
from tests.examples import few
from tests.physics.reference import (
    AIRFRAME,
    BATTERY,
    CHARGE_A,
    COMMUNICATION_A,
    DESTINATION_M,
    HOVER_M,
    MOTOR,
    ORIGIN_M,
    WEIGHT_N,
    printed,
)
from tests.wells import after

MINUTE_S = 60.0

POOLS = st.builds(
    Battery,
    capacity_As=st.floats(10.0, 1e6),
    available_fraction=st.floats(0.05, 0.95),
    flow_rate_per_s=st.just(0.0) | st.floats(-8.0, -1.0).map(lambda power: 10.0**power),
)


class Case(NamedTuple):
    """A battery within its wells, under a constant current."""

    pool: Battery
    wells: Wells
    current_A: float
    duration_s: float

    @property
    def phase(self) -> Stage:
        return Stage(self.current_A, self.duration_s)

    @property
    def scale_As(self) -> float:
        """Size of the numbers, to judge rounding by."""
        return self.pool.capacity_As + abs(self.current_A) * self.duration_s


@st.composite
def cases(draw: st.DrawFn) -> Case:
    """From empty, full and in between; up to several hours and several capacities."""
    pool = draw(POOLS)
    level = st.sampled_from([0.0, 1.0]) | st.floats(0.0, 1.0)
    wells = Wells(draw(level) * pool.full.available_As, draw(level) * pool.full.bound_As)
    duration_s = draw(st.floats(1e-3, 2e4))
    charge = draw(st.just(0.0) | st.floats(-3.0, -1e-3) | st.floats(1e-3, 3.0))
    return Case(pool, wells, charge * pool.capacity_As / duration_s, duration_s)


def integrated(case: Case) -> np.ndarray:
    """Wells after a phase by eqs (11)-(12) of the paper, step by step."""
    ω, k_F = case.pool.available_fraction, case.pool.flow_rate_per_s

    def flow(_: float, wells: np.ndarray) -> list[float]:
        between = k_F * (wells[1] / (1 - ω) - wells[0] / ω)
        return [case.current_A + between, -between]

    stiff = case.pool.rate_per_s * case.duration_s > 100.0
    return solve_ivp(
        flow,
        (0.0, case.duration_s),
        case.wells,
        method="Radau" if stiff else "DOP853",
        rtol=1e-11,
        atol=1e-12 * case.scale_As,
    ).y[:, -1]


def exact(case: Case) -> tuple[float, float]:
    """Eqs (15)-(16) of the paper as printed, with digits enough for any cancellation."""
    with localcontext() as context:
        context.prec = 400
        y1, y2, current, δ = (Decimal(x) for x in (*case.wells, *case.phase))
        ω, k_F = Decimal(case.pool.available_fraction), Decimal(case.pool.flow_rate_per_s)
        k = k_F / (ω * (1 - ω))
        y, decay = y1 + y2, (-k * δ).exp()
        ramp = current * (k * δ - 1 + decay) / k
        return (
            float(y1 * decay + (y * k * ω + current) * (1 - decay) / k + ramp * ω),
            float(y2 * decay + y * (1 - ω) * (1 - decay) + ramp * (1 - ω)),
        )


# The closed form


def test_step_of_the_paper() -> None:
    """Ten minutes of hovering from full."""
    wells = kibam.step(BATTERY, Wells(57_600.0, 14_400.0), Stage(-87.91, 600.0))
    assert wells.available_As == printed("5696.064")
    assert wells.bound_As == printed("13557.936")
    assert wells.total_As / BATTERY.capacity_As == pytest.approx(1 - 87.91 * 600 / 72_000)


def test_full_battery() -> None:
    assert BATTERY.full == pytest.approx((57_600.0, 14_400.0), rel=1e-15)
    assert BATTERY.full.total_As == pytest.approx(72_000.0, rel=1e-15)
    assert BATTERY.rate_per_s == pytest.approx(4.5e-5 / 0.16, rel=1e-15)


@pytest.mark.campaign
@given(cases())
@settings(few(10))
def test_closed_form_solves_the_differential_equations(case: Case) -> None:
    wells = kibam.step(case.pool, case.wells, case.phase)
    np.testing.assert_allclose(wells, integrated(case), rtol=0, atol=1e-9 * case.scale_As)


@given(cases(), st.floats(-300.0, 6.0).map(lambda power: 10.0**power))
@example(Case(BATTERY, BATTERY.full, -87.91, 600.0), 1e-20)
@example(Case(BATTERY, BATTERY.full, -87.91, 600.0), 1e-12)
@example(Case(BATTERY, BATTERY.full, -87.91, 600.0), 1e300)
def test_closed_form_is_accurate_for_any_flow(case: Case, flow_rate_per_s: float) -> None:
    """For k'δ from nothing to infinity, against the paper's own form in 400 digits."""
    case = case._replace(
        pool=Battery(case.pool.capacity_As, case.pool.available_fraction, flow_rate_per_s)
    )
    wells = kibam.step(case.pool, case.wells, case.phase)
    np.testing.assert_allclose(wells, exact(case), rtol=0, atol=4e-15 * case.scale_As)


@given(cases())
def test_charge_is_counted(case: Case) -> None:
    """y1 + y2 changes by I t, whatever flows between the wells."""
    wells = kibam.step(case.pool, case.wells, case.phase)
    before = case.wells.available_As + case.wells.bound_As
    assert wells.available_As + wells.bound_As == pytest.approx(
        before + case.current_A * case.duration_s, rel=0, abs=4e-15 * case.scale_As
    )
    soc = (before + case.current_A * case.duration_s) / case.pool.capacity_As
    assert wells.total_As / case.pool.capacity_As == pytest.approx(soc, abs=1e-13)


@given(cases(), st.floats(0.0, 1.0))
def test_a_step_may_be_split(case: Case, share: float) -> None:
    """Two phases of the same current are one."""
    once = kibam.step(case.pool, case.wells, case.phase)
    parts = [
        Stage(case.current_A, share * case.duration_s),
        Stage(case.current_A, (1 - share) * case.duration_s),
    ]
    twice = after(case.pool, case.wells, parts)
    np.testing.assert_allclose(once, twice, rtol=0, atol=1e-14 * case.scale_As)


@given(cases())
def test_without_flow_the_bound_charge_stays(case: Case) -> None:
    pool = Battery(case.pool.capacity_As, case.pool.available_fraction, 0.0)
    available_As, bound_As = kibam.step(pool, case.wells, case.phase)
    assert bound_As == pytest.approx(case.wells.bound_As, rel=0, abs=4e-15 * case.scale_As)
    assert available_As == pytest.approx(
        case.wells.available_As + case.current_A * case.duration_s,
        rel=0,
        abs=4e-15 * case.scale_As,
    )


@pytest.mark.campaign
@given(cases())
@settings(few(10))
def test_idle_wells_level_out(case: Case) -> None:
    """After long enough both stand equally high, and then nothing moves any more."""
    assume(case.pool.flow_rate_per_s > 0.0)
    long_s = 50.0 / case.pool.rate_per_s
    available_As, bound_As = kibam.step(case.pool, case.wells, Stage(0.0, long_s))
    ω = case.pool.available_fraction
    assert available_As / ω == pytest.approx(bound_As / (1 - ω), rel=0, abs=1e-12 * case.scale_As)
    again = kibam.step(case.pool, Wells(available_As, bound_As), Stage(0.0, 1e9))
    np.testing.assert_allclose(again, (available_As, bound_As), atol=1e-12 * case.scale_As)


# Lifetimes of test loads

SLOW_FLOW_PER_S = 0.122 / MINUTE_S * 0.166 * (1 - 0.166)
SMALL, LARGE = (Battery(each * MINUTE_S, 0.166, SLOW_FLOW_PER_S) for each in (5.5, 11.0))


def lifetime_s(pool: Battery, load: Iterator[Stage]) -> float:
    """From full to an empty available well, one job after the other."""
    wells, start_s = pool.full, 0.0
    for phase in load:
        end = kibam.step(pool, wells, phase)
        if end.available_As < 0.0:
            return start_s + kibam.time_to_empty(pool, wells, phase.current_A)
        wells, start_s = end, start_s + phase.duration_s
    raise AssertionError("the load ends before the battery")


def jobs(idle_min: float, *currents_A: float) -> Iterator[Stage]:
    """One minute of each current in turn, each followed by some idle time."""
    for current_A in itertools.cycle(currents_A):
        yield Stage(-current_A, MINUTE_S)
        yield Stage(0.0, idle_min * MINUTE_S)


@pytest.mark.parametrize(
    ("idle_min", "currents_A", "small_min", "large_min"),
    [
        pytest.param(0.0, (0.25,), "4.53", "12.16", id="CL250"),
        pytest.param(0.0, (0.5,), "2.02", "4.53", id="CL500"),
        pytest.param(0.0, (0.5, 0.25), "2.58", "6.45", id="CLalt"),
        pytest.param(1.0, (0.25,), "10.80", "44.78", id="ILs250"),
        pytest.param(1.0, (0.5,), "4.30", "10.80", id="ILs500"),
        pytest.param(1.0, (0.5, 0.25), "4.80", "16.93", id="ILsalt"),
        pytest.param(2.0, (0.25,), "21.86", "84.90", id="ILl250"),
        pytest.param(2.0, (0.5,), "6.53", "21.86", id="ILl500"),
    ],
)
def test_lifetimes(
    idle_min: float, currents_A: tuple[float, ...], small_min: str, large_min: str
) -> None:
    """Test loads of Jongerden and Haverkort on batteries of 5.5 and 11 A min."""
    assert lifetime_s(SMALL, jobs(idle_min, *currents_A)) / MINUTE_S == printed(small_min)
    assert lifetime_s(LARGE, jobs(idle_min, *currents_A)) / MINUTE_S == printed(large_min)


def test_lifetimes_under_constant_load_in_one_call() -> None:
    """Without jobs, the moment comes straight from the full battery."""
    currents_A = np.array([-0.25, -0.5])
    for pool, minutes in ((SMALL, ("4.53", "2.02")), (LARGE, ("12.16", "4.53"))):
        found = kibam.time_to_empty(pool, pool.full, currents_A) / MINUTE_S
        assert [*found] == [printed(each) for each in minutes]


def test_lifetimes_at_full_and_half_duty() -> None:
    """Half the load lasts more than twice as long: charge flows back in the pauses."""
    pool = Battery(7200.0, 0.625, 4.5e-5)
    continuous = kibam.time_to_empty(pool, pool.full, -0.96) / MINUTE_S
    assert continuous == printed("91.1")
    second = itertools.cycle((Stage(-0.96, 0.5), Stage(0.0, 0.5)))
    assert lifetime_s(pool, second) / MINUTE_S == printed("202.9")


# Moments


def samples(case: Case, latest_s: float) -> np.ndarray:
    """y1 at many moments up to a latest one, by the differential equations' exact solution."""
    times = np.linspace(0.0, latest_s, 2001)
    ω, k = case.pool.available_fraction, case.pool.rate_per_s
    total = sum(case.wells) + case.current_A * times
    tilt = case.wells.available_As - ω * sum(case.wells)
    rise = -np.expm1(-k * times) / k if k > 0.0 else times
    return ω * total + tilt * np.exp(-k * times) + case.current_A * (1 - ω) * rise


@given(cases())
def test_moment_of_emptiness(case: Case) -> None:
    """y1 is 0 then, was not below before, and is below after; without discharge never."""
    moment_s = kibam.time_to_empty(case.pool, case.wells, case.current_A)
    if case.current_A >= 0.0:
        assert moment_s == math.inf
        return
    y1 = samples(case, moment_s)
    assert y1.min() >= -1e-12 * case.scale_As
    if moment_s > 1e-6 * case.duration_s:
        assert y1[-1] == pytest.approx(0.0, abs=1e-11 * case.scale_As)
    later = kibam.step(
        case.pool, case.wells, Stage(case.current_A, 1.01 * moment_s + 0.01 * case.duration_s)
    )
    assert later.available_As < 0.0


@pytest.mark.campaign
@given(cases())
@settings(few(10))
def test_moment_of_fullness(case: Case) -> None:
    """y1 is ωB then, was not above before, and is above after; without charging never."""
    moment_s = kibam.time_to_full(case.pool, case.wells, case.current_A)
    if case.current_A <= 0.0:
        assert moment_s == math.inf
        return
    full_As = case.pool.full.available_As
    y1 = samples(case, moment_s)
    assert y1.max() <= full_As + 1e-12 * case.scale_As
    if moment_s > 1e-6 * case.duration_s:
        assert y1[-1] == pytest.approx(full_As, abs=1e-11 * case.scale_As)
    later = kibam.step(
        case.pool, case.wells, Stage(case.current_A, 1.01 * moment_s + 0.01 * case.duration_s)
    )
    assert later.available_As > full_As


@pytest.mark.parametrize(
    ("current_A", "wells", "level_As"),
    [
        (-87.91, (57_600.0, 14_400.0), 0.0),
        (-5.0, (500.0, 14_000.0), 0.0),
        (8.0, (50.0, 60.0), 57_600.0),
    ],
)
def test_moments_by_integration(
    current_A: float, wells: tuple[float, float], level_As: float
) -> None:
    """The root of y1 − level on a dense solution of the differential equations."""

    def flow(_: float, y: np.ndarray) -> list[float]:
        between = 4.5e-5 * (y[1] / 0.2 - y[0] / 0.8)
        return [current_A + between, -between]

    latest_s = (sum(wells) if level_As == 0.0 else 72_000.0 - sum(wells)) / abs(current_A)
    solution = solve_ivp(
        flow, (0.0, latest_s), wells, method="DOP853", rtol=1e-12, atol=1e-8, dense_output=True
    ).sol
    expected = brentq(lambda t: solution(t)[0] - level_As, 1.0, latest_s, xtol=1e-9)
    moment = kibam.time_to_empty if level_As == 0.0 else kibam.time_to_full
    assert moment(BATTERY, Wells(*wells), current_A) == pytest.approx(expected, rel=1e-9)


def test_a_moment_does_not_depend_on_those_that_are_found_along_with_it() -> None:
    """To the last bit: what is settled does not move on while others are on their way."""
    current_A = np.random.default_rng(0).uniform(0.1, 50.0, 300)
    wells = Wells(20_000.0, 9_000.0)
    many = kibam.time_to_full(BATTERY, wells, current_A)
    alone = [kibam.time_to_full(BATTERY, wells, current_A[[k]]) for k in range(300)]
    assert np.concatenate(alone).tolist() == many.tolist()


def test_well_that_first_rises_and_then_runs_dry() -> None:
    """From y1 = 0 the inflow carries a small load for a while."""
    wells = Wells(0.0, 14_400.0)
    inflow_A = 4.5e-5 * 14_400 / 0.2
    assert kibam.time_to_empty(BATTERY, wells, -1.001 * inflow_A) < 1e-6
    moment_s = kibam.time_to_empty(BATTERY, wells, -0.5 * inflow_A)
    case = Case(BATTERY, wells, -0.5 * inflow_A, moment_s)
    y1 = samples(case, moment_s)
    assert y1[1:-1].min() > 0.0
    assert y1[-1] == pytest.approx(0.0, abs=1e-6)
    assert moment_s > 1000.0


def test_well_that_first_falls_and_then_overflows() -> None:
    """With y1 full and y2 empty, a small charging current flows on into the bound well."""
    wells = Wells(57_600.0, 0.0)
    outflow_A = 4.5e-5 * 57_600 / 0.8
    assert kibam.time_to_full(BATTERY, wells, 1.001 * outflow_A) < 1e-6
    moment_s = kibam.time_to_full(BATTERY, wells, 0.5 * outflow_A)
    y1 = samples(Case(BATTERY, wells, 0.5 * outflow_A, moment_s), moment_s)
    assert y1[1:-1].max() < 57_600.0
    assert y1[-1] == pytest.approx(57_600.0, abs=1e-6)
    assert moment_s > 1000.0


def test_moments_at_the_limits_and_never() -> None:
    """Empty and discharged: now. Full and charged: now. Idle, or the other way: never."""
    empty, full = Wells(0.0, 0.0), BATTERY.full
    assert kibam.time_to_empty(BATTERY, empty, -1.0) == 0.0
    assert kibam.time_to_full(BATTERY, full, 1.0) == pytest.approx(0.0, abs=1e-10)
    for current_A in (0.0, 5.0, -5e-324):
        assert kibam.time_to_empty(BATTERY, empty, current_A) == math.inf
    for current_A in (0.0, -5.0, 5e-324):
        assert kibam.time_to_full(BATTERY, full, current_A) == math.inf
    assert math.isnan(kibam.time_to_empty(BATTERY, full, math.nan))
    assert math.isnan(kibam.time_to_full(BATTERY, empty, math.nan))


def test_moments_without_flow() -> None:
    """k_F = 0: the available well is a tank of its own."""
    pool = Battery(1000.0, 0.4, 0.0)
    assert kibam.time_to_empty(pool, pool.full, -2.0) == pytest.approx(200.0, rel=1e-14)
    assert kibam.time_to_full(pool, Wells(100.0, 0.0), 2.0) == pytest.approx(150.0, rel=1e-14)


# Ends of a stage


@given(cases())
def test_ends_of_a_stage_are_the_extremes(case: Case) -> None:
    """Discharging, y1 is least at an end and cannot overflow; charging, it cannot run dry."""
    full_As = case.pool.full.available_As
    y1 = samples(case, case.duration_s)
    rounding = 1e-12 * case.scale_As
    if case.current_A <= 0.0:
        assert y1.min() >= min(y1[0], y1[-1]) - rounding
        assert y1.max() <= full_As + rounding
    else:
        assert y1.min() >= -rounding
        assert y1.max() <= max(y1[0], y1[-1]) + rounding


# A mission of the paper, phase by phase


def mission(places_m: list[tuple[float, float, float]]) -> list[list[Stage]]:
    """Phases of the legs between places, each stage of a leg with its own current."""
    legs = (
        six_stages.leg(AIRFRAME, MOTOR, tuple(np.subtract(end, start))).loads
        for start, end in itertools.pairwise(places_m)
    )
    return [
        [Stage(-i, t) for i, t in zip(each.currents_A, each.durations_s, strict=True)]
        for each in legs
    ]


HOVERING_A = (
    CHARGE_A
    - COMMUNICATION_A
    - 4 * rotor.current(MOTOR, rotor.hover_speed(MOTOR, (0.0, 0.0, -WEIGHT_N)))
)
RESTING_A = CHARGE_A
B1_M, B9_M = (50.0, 300.0, 60.0), (800.0, 1750.0, 100.0)


def test_direct_route_of_the_paper() -> None:
    """Hovering as long as the charge lasts, and as long as the available well does."""
    out, back = mission([ORIGIN_M, HOVER_M, DESTINATION_M])

    def at_end(hover_s: float) -> Wells:
        phases = [*out, Stage(HOVERING_A, hover_s), *back]
        return after(BATTERY, BATTERY.full, phases)

    by_charge_s = brentq(
        lambda hover_s: at_end(hover_s).total_As / BATTERY.capacity_As - 0.05, 1.0, 900.0
    )
    assert by_charge_s == printed("688.848")
    flyable_s = brentq(lambda hover_s: at_end(hover_s).available_As, 1.0, 900.0)
    assert flyable_s == printed("577.524")


def test_optimum_of_the_paper_cannot_be_flown() -> None:
    """Resting on b1 first: 5 % charge at the end, y1 at −13 % of B, and at 104 % before."""
    out, on, back = mission([ORIGIN_M, B1_M, HOVER_M, DESTINATION_M])
    rested = after(BATTERY, BATTERY.full, [*out, Stage(RESTING_A, 392.1438)])
    end = after(BATTERY, rested, [*on, Stage(HOVERING_A, 719.5399), *back])
    assert end.total_As / BATTERY.capacity_As == pytest.approx(0.05, abs=1e-6)
    assert end.available_As / 72_000 == printed("-0.13")
    assert rested.available_As / 57_600 == printed("1.04")


def test_longest_hover_that_reaches_b9() -> None:
    """The available well then holds until the UAV rests, and after 1200 s in all at the end."""
    out, on, back = mission([ORIGIN_M, HOVER_M, B9_M, DESTINATION_M])

    def on_roof(hover_s: float) -> Wells:
        return after(BATTERY, BATTERY.full, [*out, Stage(HOVERING_A, hover_s), *on])

    hover_s = brentq(lambda hover_s: on_roof(hover_s).available_As, 1.0, 900.0)
    assert hover_s == printed("597.270")
    flight_s = sum(phase.duration_s for leg in (out, on, back) for phase in leg)
    rest = Stage(RESTING_A, 1200.0 - flight_s - hover_s)
    assert after(BATTERY, on_roof(hover_s), [rest, *back]).available_As > 0.0


# Arrays and symbols


def test_arrays_are_scalars_element_by_element() -> None:
    """Currents down, durations across, wells the same for all."""
    currents = np.array([-90.0, -5.0, 0.0, 10.0])[:, np.newaxis]
    durations = np.array([0.0, 1.0, 500.0])
    wells = Wells(30_000.0, 9_000.0)
    together = np.array(kibam.step(BATTERY, wells, Stage(currents, durations)))
    for row, (current,) in enumerate(currents):
        for column, duration in enumerate(durations):
            alone = kibam.step(BATTERY, wells, Stage(current, duration))
            np.testing.assert_allclose(together[:, row, column], alone, rtol=1e-14)
    for moment in (kibam.time_to_empty, kibam.time_to_full):
        found = moment(BATTERY, wells, currents[:, 0])
        np.testing.assert_allclose(
            found, [moment(BATTERY, wells, current) for current in currents[:, 0]], rtol=1e-13
        )


def test_symbols_give_what_floats_give() -> None:
    """Wells after two phases as a tree over a duration and the parameters of the battery."""
    hover = Variable("hover_time_s", "Δ", "s", 0.0, 1e4, "", 0)
    pool = Battery(
        Parameter("capacity_As", "B", "A s", 72_000.0),
        Parameter("available_fraction", "ω", "1", 0.8),
        Parameter("flow_rate_per_s", "k_F", "1/s", 4.5e-5),
    )
    tree = after(pool, pool.full, [Stage(-80.0, hover), Stage(10.0, 300.0)])
    for changed in ({}, {"flow_rate_per_s": 0.0}, {"available_fraction": 0.6}):
        constants = {"flow_rate_per_s": 4.5e-5, "available_fraction": 0.8, **changed}
        number = Battery(72_000.0, constants["available_fraction"], constants["flow_rate_per_s"])
        expected = after(number, number.full, [Stage(-80.0, 500.0), Stage(10.0, 300.0)])
        values = {"hover_time_s": 500.0, **changed}
        assert tuple(evaluate(each, values) for each in tree) == expected
        soc = evaluate(tree.total_As / pool.capacity_As, values)
        assert soc == expected.total_As / number.capacity_As
