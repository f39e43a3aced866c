"""Acceleration and speed cap from the legs in flight logs.

They are those of the trapezoids, of the logged distance and centred like the logged legs, that
follow the speed best.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from optuav.arrays import Floats
from optuav.calibration.estimation import Unknown, estimate
from optuav.calibration.fit import Panel, Value, unclear, values_of
from optuav.calibration.flight_log import LEAST_SAMPLES, Log
from optuav.physics.regimes import regime_leg

REACHED = 0.98
"""Share of the speed cap that the fastest leg would reach without it at least, for it to bind."""


@dataclass(frozen=True)
class Leg:
    """A leg as logged: times from its middle [s], speeds [m/s], distance [m]."""

    time_s: Floats
    speed_m_s: Floats
    distance_m: float


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
            distance_m = float(np.trapezoid(speed_m_s, time_s))
            middle_s = float(np.trapezoid(speed_m_s * time_s, time_s)) / distance_m
            yield Leg(time_s - middle_s, speed_m_s, distance_m)


def fit_motion(
    legs: Sequence[Leg],
) -> tuple[tuple[Value, ...], tuple[Panel, ...], tuple[str, ...]]:
    """Acceleration and cap, the speeds they explain, and what is to be said of them."""
    if not legs:
        words = "no leg from standing to standing with its speed: acceleration_m_s2 is missing here"
        return (), (), (words,)
    observed = np.concatenate([leg.speed_m_s for leg in legs])
    fastest = float(np.max(observed))

    def speeds(acceleration_m_s2: float, cap_m_s: float) -> Floats:
        return np.concatenate([_speed(leg, acceleration_m_s2, cap_m_s) for leg in legs])

    keys: tuple[str, ...] = ("flight.acceleration_m_s2", "flight.max_speed_m_s")
    starts = [(a, fastest) for a in (0.5, 2.0, 8.0)]
    found = estimate(
        [Unknown(key) for key in keys],
        lambda values: speeds(*values) - observed,
        starts,
        bootstrap=False,
    )
    longest_m = max(leg.distance_m for leg in legs)
    acceleration, cap = found.values
    warnings: tuple[str, ...] = unclear(found)
    if cap >= REACHED * math.sqrt(acceleration * longest_m):
        keys = keys[:1]
        found = estimate(
            [Unknown(key) for key in keys],
            lambda values: speeds(values[0], math.inf) - observed,
            [(acceleration,)],
            bootstrap=False,
        )
        cap = math.inf
        warnings = ("no leg is long enough to show a speed cap: max_speed_m_s is missing here",)
    fitted = speeds(float(found.values[0]), float(cap))
    ends_s = np.cumsum([0.0, *(leg.time_s[-1] - leg.time_s[0] for leg in legs)])
    at_s = np.concatenate(
        [leg.time_s - leg.time_s[0] + end for leg, end in zip(legs, ends_s[:-1], strict=True)]
    )
    panel = Panel(
        "speed",
        "m/s",
        tuple(observed.tolist()),
        tuple(fitted.tolist()),
        at=tuple(at_s.tolist()),
        at_words="time in the legs [s]",
    )
    return values_of(found, keys, f"fitted to the speed of {len(legs)} legs"), (panel,), warnings


def _speed(leg: Leg, acceleration_m_s2: float, cap_m_s: float) -> Floats:
    """Speed [m/s] of the bang-bang leg of the same distance."""
    loads, peak_m_s = regime_leg(leg.distance_m, acceleration_m_s2, 1.0, 1.0, cap_m_s)
    before_end_s = 0.5 * loads.durations_s[0] - np.abs(leg.time_s)
    speed_m_s: Floats = np.clip(acceleration_m_s2 * before_end_s, 0.0, peak_m_s)
    return speed_m_s
