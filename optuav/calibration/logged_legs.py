"""Acceleration and speed cap from the legs in flight logs.

They are those of the trapezoids that follow the logged speeds best. When each leg begins and ends
is fitted as well: a distance summed up from the same speeds would share their errors, and a cap
that is held against it would look surer than it is.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from optuav.arrays import Booleans, Floats
from optuav.calibration.estimation import NOTHING, Estimate, Unknown, estimate
from optuav.calibration.fit import Panel, Value, unclear, values_of
from optuav.calibration.flight_log import LEAST_SAMPLES, Log
from optuav.physics.flight import regime_leg

REACHED = 0.98
"""Share of the speed cap that the fastest leg would reach without it at least, for it to bind."""
GAIN = 9.0
"""Least gain of the sum of squares, in variances, by which a cap shows: three standard errors."""
ROUNDS = 20
"""Most steps to the best moments at which a leg begins and ends; two or three are usual."""
FOUND_S = 1e-9
"""Change of these moments below which they are found."""


@dataclass(frozen=True)
class Leg:
    """A leg as logged: times from its first sample [s], speeds [m/s]."""

    time_s: Floats
    speed_m_s: Floats

    @property
    def distance_m(self) -> float:
        """The speeds summed up."""
        return float(np.trapezoid(self.speed_m_s, self.time_s))

    @property
    def middle_s(self) -> float:
        """The moment about which the way is done."""
        return float(np.trapezoid(self.speed_m_s * self.time_s, self.time_s)) / self.distance_m


def legs_in(log: Log) -> Iterator[Leg]:
    """Every stretch of flight that begins and ends slowly."""
    assert log.speed_m_s is not None
    flying = np.concatenate([[False], log.phase == "flight", [False]])
    edges = np.flatnonzero(np.diff(flying.astype(int)))
    for start, end in edges.reshape(-1, 2):
        # One sample more at either side, where it still stands.
        chosen = slice(max(start - 1, 0), end + 1)
        time_s, speed_m_s = log.time_s[chosen], log.speed_m_s[chosen]
        whole = max(speed_m_s[0], speed_m_s[-1]) < 0.5 * np.max(speed_m_s)
        if whole and len(time_s) >= LEAST_SAMPLES // 2:
            yield Leg(time_s - time_s[0], speed_m_s)


def fit_motion(
    legs: Sequence[Leg],
) -> tuple[tuple[Value, ...], tuple[Panel, ...], tuple[str, ...]]:
    """Acceleration and cap, the speeds they explain, and what is to be said of them."""
    if not legs:
        words = "no leg from standing to standing with its speed: acceleration_m_s2 is missing here"
        return (), (), (words,)
    observed = np.concatenate([leg.speed_m_s for leg in legs])
    fastest = float(np.max(observed))
    longest_m = max(leg.distance_m for leg in legs)
    speeds = _speeds(legs)

    def fitted(keys: Sequence[str], starts: Iterable[Sequence[float]]) -> Estimate:
        return estimate(
            [Unknown(key) for key in keys],
            lambda values: speeds(*values) - observed,
            starts,
            bootstrap=False,
            eliminated=2 * len(legs),
        )

    keys: tuple[str, ...] = ("flight.acceleration_m_s2", "flight.max_speed_m_s")
    found = fitted(keys, [(a, fastest) for a in (0.5, 2.0, 8.0)])
    acceleration, cap = found.values
    without = fitted(keys[:1], [(acceleration,)])
    warnings: tuple[str, ...] = unclear(found)
    close = cap >= REACHED * math.sqrt(acceleration * longest_m)
    if close or _gain(found, without) < GAIN:
        keys, found = keys[:1], without
        warnings = ("no leg is long enough to show a speed cap: max_speed_m_s is missing here",)
    ends_s = np.cumsum([0.0, *(leg.time_s[-1] for leg in legs)])
    at_s = np.concatenate([leg.time_s + end for leg, end in zip(legs, ends_s[:-1], strict=True)])
    panel = Panel(
        "speed",
        "m/s",
        tuple(observed.tolist()),
        tuple(speeds(*found.values.tolist()).tolist()),
        at=tuple(at_s.tolist()),
        at_words="time in the legs [s]",
    )
    return values_of(found, keys, f"fitted to the speed of {len(legs)} legs"), (panel,), warnings


def _gain(found: Estimate, without: Estimate) -> float:
    """By how much the sum of squares is less with a cap, in variances of a residual."""
    more = without.residuals @ without.residuals - found.residuals @ found.residuals
    return float(more) / max(found.spread or 0.0, NOTHING) ** 2


def _speeds(legs: Sequence[Leg]) -> Callable[..., Floats]:
    """Speeds [m/s] of the trapezoids of an acceleration and a cap that follow the legs best."""
    time_s = np.concatenate([leg.time_s for leg in legs])
    speed_m_s = np.concatenate([leg.speed_m_s for leg in legs])
    leg_of = np.repeat(np.arange(len(legs)), [len(leg.time_s) for leg in legs])
    distance_m = np.array([leg.distance_m for leg in legs])
    middle_s = np.array([leg.middle_s for leg in legs])

    def mean(values: Floats, where: Booleans) -> Floats:
        """Of each leg; 0 of nothing."""
        count = np.bincount(leg_of[where], minlength=len(legs))
        return np.bincount(leg_of[where], values[where], len(legs)) / np.maximum(count, 1)

    def speeds(acceleration_m_s2: float, cap_m_s: float = math.inf) -> Floats:
        loads, _ = regime_leg(distance_m, acceleration_m_s2, 1.0, 1.0, cap_m_s)
        start_s = middle_s - 0.5 * loads.durations_s[0]
        end_s = middle_s + 0.5 * loads.durations_s[0]
        for _ in range(ROUNDS):
            rising = acceleration_m_s2 * (time_s - start_s[leg_of])
            falling = acceleration_m_s2 * (end_s[leg_of] - time_s)
            fitted: Floats = np.clip(np.minimum(rising, falling), 0.0, cap_m_s)
            sloped = (fitted > 0.0) & (fitted < cap_m_s)
            early_s = (fitted - speed_m_s) / acceleration_m_s2
            later_s = mean(early_s, sloped & (rising < falling))
            sooner_s = mean(early_s, sloped & (rising >= falling))
            if max(np.max(np.abs(later_s)), np.max(np.abs(sooner_s))) <= FOUND_S:
                break
            start_s, end_s = start_s + later_s, end_s - sooner_s
        return fitted

    return speeds
