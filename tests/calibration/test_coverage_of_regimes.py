"""Intervals of loads, acceleration and speed cap hold the truth as often as they say."""

from __future__ import annotations

from itertools import accumulate
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from scipy.stats import binom

import optuav
from optuav.arrays import Floats

TRUE = {
    "acceleration_m_s2": 2.5,
    "max_speed_m_s": 12.0,
    "flight_current_A": 26.0,
    "hover_current_A": 21.0,
    "rest_current_A": 0.4,
    "charge_current_A": 3.4,
}
COURSE = (("rest", 30.0), ("flight", None), ("hover", 150.0), ("flight", None), ("charge", 60.0))


class Flight(NamedTuple):
    """How long the legs are, how often the log is written, how far its speeds are off.

    And which part of its error the current keeps from one sample to the next.
    """

    leg_m: float
    step_s: float
    error_m_s: float
    wander: float = 0.0


LONG, SHORT = Flight(1500.0, 1.0, 0.15), Flight(420.0, 0.5, 0.15)
WANDERING = SHORT._replace(step_s=0.25, wander=0.8)


def written(path: Path, flight: Flight, random: np.random.Generator) -> Path:
    """A log of two legs, speeds with errors of their own and currents too."""
    leg_s = flight.leg_m / 12.0 + 12.0 / 2.5
    lasts_s = np.array([leg_s if duration is None else duration for _, duration in COURSE])
    ends_s = np.cumsum(lasts_s)
    time_s = np.arange(random.uniform(0.0, flight.step_s), ends_s[-1], flight.step_s)
    piece = np.searchsorted(ends_s, time_s, side="right")
    phase = [COURSE[number][0] for number in piece]
    left_s = ends_s[piece] - time_s
    climb = 2.5 * np.minimum(left_s, lasts_s[piece] - left_s)
    flies = np.array([each == "flight" for each in phase])
    speed_m_s = np.where(flies, np.minimum(climb, 12.0), 0.0)
    speed_m_s = np.abs(speed_m_s + flight.error_m_s * random.standard_normal(len(time_s)))
    means_A = {"rest": 0.4, "flight": 26.0, "hover": 21.0, "charge": 0.4 - 3.4}
    current_A = np.array([means_A[each] for each in phase]) * (
        1.0 + errors(random, len(time_s), flight.wander)
    )
    rows = zip(time_s, current_A, speed_m_s, phase, strict=True)
    lines = [f"{t:.3f},{i:.5f},23,{v:.4f},{word}" for t, i, v, word in rows]
    path.write_text("\n".join(["time_s,current_A,voltage_V,speed_m_s,phase", *lines]), "utf-8")
    return path


def errors(random: np.random.Generator, count: int, wander: float) -> Floats:
    """Of the currents, relative: 2 % that change by the sample, or wander."""
    drawn = 0.02 * random.standard_normal(count)
    drawn[0] /= (1.0 - wander**2) ** 0.5
    return np.array(list(accumulate(drawn, lambda error, more: wander * error + more)))


def covered(flight: Flight, runs: int, seed: int, tmp_path: Path) -> dict[str, int]:
    """How often each interval holds the truth."""
    random, counts = np.random.default_rng(seed), dict.fromkeys(TRUE, 0)
    for _ in range(runs):
        found = optuav.fit_regimes([written(tmp_path / "log.csv", flight, random)])
        values = {each.key.removeprefix("flight."): each for each in found.values}
        for key, true in TRUE.items():
            interval = values[key].interval
            assert interval is not None
            counts[key] += interval.low <= true <= interval.high
    return counts


@pytest.mark.parametrize("flight", [LONG, WANDERING])
def test_intervals_cover_the_truth(flight: Flight, tmp_path: Path) -> None:
    """Of 50 logs; so few as to fail come once in thousand times at a rate of 95 %."""
    for key, count in covered(flight, 50, 5, tmp_path).items():
        assert count >= binom.ppf(1e-3, 50, 0.95), (key, count)


@pytest.mark.soak
@pytest.mark.parametrize(
    "flight", [LONG, SHORT, WANDERING, Flight(420.0, 0.1, 0.3), Flight(200.0, 0.25, 0.1)]
)
def test_intervals_cover_at_their_nominal_rate(flight: Flight, tmp_path: Path) -> None:
    """95 % within what 400 logs can tell: four standard deviations are 4.4 %."""
    for key, count in covered(flight, 400, 11, tmp_path).items():
        assert count / 400 == pytest.approx(0.95, abs=0.0436), key
