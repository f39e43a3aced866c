"""Charging that tapers: against the differential equations, and what it never does."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from optuav.physics import kibam
from optuav.physics.kibam import Battery, Stage, Wells
from tests.examples import few

POOLS = st.builds(
    Battery,
    capacity_As=st.floats(10.0, 1e6),
    available_fraction=st.floats(0.05, 0.95),
    flow_rate_per_s=st.just(0.0) | st.floats(-8.0, -1.0).map(lambda power: 10.0**power),
)
LEVELS = st.sampled_from([0.0, 1.0]) | st.floats(0.0, 1.0)


class Case(NamedTuple):
    """A battery within its wells, and what a charger offers it."""

    pool: Battery
    wells: Wells
    phase: Stage

    @property
    def steady_s(self) -> float:
        """How long the phase goes on at its constant current [s]."""
        current_A, duration_s = self.phase
        return min(duration_s, float(kibam.time_to_full(self.pool, self.wells, current_A)))


@st.composite
def cases(draw: st.DrawFn) -> Case:
    """From empty to full, from a trickle to several capacities; sometimes discharging."""
    pool = draw(POOLS)
    wells = Wells(draw(LEVELS) * pool.full.available_As, draw(LEVELS) * pool.full.bound_As)
    duration_s = draw(st.floats(1e-3, 2e4))
    charge = draw(st.just(0.0) | st.floats(-3.0, -1e-3) | st.floats(1e-3, 3.0))
    return Case(pool, wells, Stage(charge * pool.capacity_As / duration_s, duration_s))


PAPER = Battery(72_000.0, 0.8, 4.5e-5)
NEARLY_FULL = Case(PAPER, Wells(57_000.0, 12_000.0), Stage(20.0, 900.0))
FALLING = Case(PAPER, Wells(57_600.0, 2_000.0), Stage(1.0, 4_000.0))
"""Full above and empty below: y1 falls first, although it is charged, and only then rises."""


def integrated(case: Case) -> np.ndarray:
    """Wells by the differential equations: of both until y1 = ωB, then of y2 alone."""
    pool, (current_A, duration_s) = case.pool, case.phase
    ω, k_F = pool.available_fraction, pool.flow_rate_per_s
    full_As, scale_As = ω * pool.capacity_As, pool.capacity_As
    options = {"rtol": 1e-11, "atol": 1e-12 * scale_As}
    stiff = pool.rate_per_s * duration_s > 100.0
    options["method"] = "Radau" if stiff else "DOP853"

    def both(_: float, y: np.ndarray) -> list[float]:
        seeps_A = k_F * (y[0] / ω - y[1] / (1 - ω))
        return [current_A - seeps_A, seeps_A]

    def filled(_: float, y: np.ndarray) -> float:
        return y[0] - full_As

    filled.terminal, filled.direction = True, 1.0
    start = np.array(case.wells, dtype=float)
    if start[0] >= full_As and both(0.0, start)[0] >= 0.0:
        spent_s, wells = 0.0, start
    else:
        found = solve_ivp(both, (0.0, duration_s), start, events=filled, **options)
        spent_s, wells = found.t[-1], found.y[:, -1]
    if spent_s >= duration_s:
        return wells
    rest = solve_ivp(
        lambda _, y: [k_F * (full_As / ω - y[0] / (1 - ω))],
        (spent_s, duration_s),
        wells[1:],
        **options,
    )
    return np.array([full_As, rest.y[0, -1]])


@pytest.mark.campaign
@given(cases())
@example(NEARLY_FULL)
@example(FALLING)
@settings(few(10))
def test_closed_form_solves_the_differential_equations(case: Case) -> None:
    found = kibam.tapered(*case)
    scale_As = case.pool.capacity_As + abs(case.phase.current_A) * case.phase.duration_s
    np.testing.assert_allclose(found, integrated(case), rtol=0, atol=2e-9 * scale_As)


def test_known_values() -> None:
    """By hand: y2 misses 2400 A s and makes up for half of it in ln 2/(ωk') of holding."""
    half_s = np.log(2.0) * 0.2 / 4.5e-5
    found = kibam.held(PAPER, Wells(57_600.0, 12_000.0), half_s)
    np.testing.assert_allclose(found, (57_600.0, 13_200.0), rtol=1e-14)
    assert np.isclose(kibam.holding_current(PAPER, Wells(57_600.0, 12_000.0)), 0.54, rtol=1e-13)
    assert kibam.tapered(PAPER, PAPER.full, Stage(6.0, 500.0)) == PAPER.full


@given(cases())
@example(NEARLY_FULL)
@example(FALLING)
def test_neither_overfull_nor_more_than_is_offered(case: Case) -> None:
    """y1 ≤ ωB and y2 ≤ (1−ω)B at the end; the current never exceeds what the charger offers."""
    end = kibam.tapered(*case)
    slack_As = 1e-11 * case.pool.capacity_As
    for well, full in zip(end, case.pool.full, strict=True):
        assert well <= full + slack_As
    offered_As = case.phase.current_A * case.phase.duration_s
    assert end.total_As - case.wells.total_As <= offered_As + 1e-11 * (
        case.pool.capacity_As + abs(offered_As)
    )
    steady_s = case.steady_s
    if steady_s < case.phase.duration_s:
        full = kibam.step(case.pool, case.wells, Stage(case.phase.current_A, steady_s))
        rounding_A = slack_As * case.pool.rate_per_s + 1e-9 * case.phase.current_A
        assert kibam.holding_current(case.pool, full) <= case.phase.current_A + rounding_A


@pytest.mark.campaign
@given(cases(), st.floats(0.0, 1.0), st.floats(0.0, 1.0))
@example(NEARLY_FULL, 0.9, 0.5)
@example(FALLING, 1.0, 0.8)
@settings(few(10))
def test_more_never_becomes_less(case: Case, share: float, offer: float) -> None:
    """Fuller wells stay fuller, well by well; and a stronger charger never leaves less in one."""
    assume(case.phase.current_A > 0.0)
    less = Wells(*(share * well for well in case.wells))
    weaker = Stage(offer * case.phase.current_A, case.phase.duration_s)
    most = kibam.tapered(*case)
    scale_As = case.pool.capacity_As + case.phase.current_A * case.phase.duration_s
    for wells, phase in ((less, case.phase), (case.wells, weaker), (less, weaker)):
        found = kibam.tapered(case.pool, wells, phase)
        assert all(a <= b + 1e-11 * scale_As for a, b in zip(found, most, strict=True))


@given(cases(), st.floats(0.0, 1.0))
@example(NEARLY_FULL, 0.3)
def test_holding_earlier_brings_no_more(case: Case, share: float) -> None:
    """What an engine may choose, a shorter steady part, is no better: if the charger can hold."""
    steady_s = share * case.steady_s
    current_A, duration_s = case.phase
    wells = kibam.step(case.pool, case.wells, Stage(current_A, steady_s))
    assume(kibam.holding_current(case.pool, wells) <= current_A)
    early = kibam.held(case.pool, wells, duration_s - steady_s)
    most = kibam.tapered(*case)
    scale_As = case.pool.capacity_As + abs(current_A) * duration_s
    assert all(a <= b + 1e-11 * scale_As for a, b in zip(early, most, strict=True))


@given(cases(), st.floats(0.0, 1.0))
@example(NEARLY_FULL, 0.5)
def test_a_phase_may_be_split(case: Case, share: float) -> None:
    """Two phases at the same offer are one, wherever the taper begins."""
    current_A, duration_s = case.phase
    once = kibam.tapered(*case)
    first = kibam.tapered(case.pool, case.wells, Stage(current_A, share * duration_s))
    twice = kibam.tapered(case.pool, first, Stage(current_A, (1.0 - share) * duration_s))
    scale_As = case.pool.capacity_As + abs(current_A) * duration_s
    np.testing.assert_allclose(once, twice, rtol=0, atol=1e-10 * scale_As)


@given(cases())
@example(NEARLY_FULL)
def test_continuous_in_the_duration(case: Case) -> None:
    """A moment more charges no more than the current times that moment, also where it tapers."""
    current_A, duration_s = case.phase
    moment_s = 1e-6 * duration_s
    once = kibam.tapered(*case)
    later = kibam.tapered(case.pool, case.wells, Stage(current_A, duration_s + moment_s))
    seeps_A = case.pool.rate_per_s * case.pool.capacity_As
    change_As = (abs(current_A) + seeps_A) * moment_s + 1e-11 * case.pool.capacity_As
    change_As += 1e-12 * abs(current_A) * duration_s
    assert all(abs(b - a) <= change_As for a, b in zip(once, later, strict=True))


def test_arrays_are_as_single_numbers() -> None:
    durations_s = np.linspace(0.0, 900.0, 7)
    current_A, _ = NEARLY_FULL.phase
    found = kibam.tapered(PAPER, NEARLY_FULL.wells, Stage(current_A, durations_s))
    for number, duration_s in enumerate(durations_s):
        one = kibam.tapered(PAPER, NEARLY_FULL.wells, Stage(current_A, duration_s))
        np.testing.assert_allclose([well[number] for well in found], one, rtol=1e-13)


@given(cases(), st.floats(0.0, 1.0), st.floats(0.0, 1.0))
@example(FALLING, 1.0, 1.0)
@example(NEARLY_FULL, 1.0, 1.0)
def test_a_taper_never_leaves_more_than_a_constant_current(
    case: Case, part: float, less: float
) -> None:
    """In either well, from as much or from less of both; nor more than when full."""
    pool, wells, (current_A, longest_s) = case
    stage = Stage(current_A, part * longest_s)
    constant, rounding_As = kibam.step(pool, wells, stage), 1e-11 * pool.capacity_As
    for share in (1.0, less):
        start = Wells(wells.available_As * share, wells.bound_As * share)
        end = kibam.tapered(pool, start, stage)
        for left, most, full in zip(end, constant, pool.full, strict=True):
            assert left <= min(most, full) + rounding_As
