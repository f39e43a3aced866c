"""Means of records whose samples are alike: intervals by batches hold the truth."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import accumulate

import numpy as np
import pytest

from optuav.arrays import Floats
from optuav.calibration.batches import _alike, mean_over_time

RECORDS = 400


def records(count: int, alike: float) -> Iterator[Floats]:
    """Records about 0 whose neighbours have a given correlation."""
    random = np.random.default_rng(3)
    for _ in range(RECORDS):
        drawn = random.standard_normal(count)
        drawn[0] /= (1.0 - alike**2) ** 0.5
        yield np.array(list(accumulate(drawn, lambda old, new: alike * old + new)))


@pytest.mark.parametrize(("count", "alike"), [(20, 0.0), (120, 0.8), (300, 0.8), (1000, 0.95)])
def test_intervals_cover_at_their_nominal_rate(count: int, alike: float) -> None:
    """95 %, where four standard deviations of 400 records are 4.4 %."""
    inside = 0
    for record in records(count, alike):
        _, interval = mean_over_time(record, np.full(count, 0.5))
        inside += interval.low <= 0.0 <= interval.high
    assert inside / RECORDS == pytest.approx(0.95, abs=0.0436)


def test_short_records_that_wander_slowly_cover_less() -> None:
    """As the page on calibration says: 60 samples of which neighbours correlate by 0.9."""
    means = [mean_over_time(record, np.full(60, 0.5)) for record in records(60, 0.9)]
    inside = np.mean([interval.low <= 0.0 <= interval.high for _, interval in means])
    assert 0.8 < inside < 0.92


@pytest.mark.parametrize("alike", [0.0, 0.5, 0.8])
def test_short_records_do_not_hide_how_alike_neighbours_are(alike: float) -> None:
    """Of 40 samples it comes out 0.1 (at 0.5) to 0.15 (at 0.8) too small if nothing is done."""
    assert np.mean([_alike(record) for record in records(40, alike)]) == pytest.approx(
        max(alike, 0.06), abs=0.055
    )


def test_a_voltage_that_sags_does_not_wander() -> None:
    """20 to 22 over a minute: the mean lies among the samples, and is told as by batches alone."""
    record = 20.0 + 2.0 * np.arange(60) / 59.0 + np.random.default_rng(0).normal(0.0, 0.05, 60)
    _, (low, high) = mean_over_time(record, np.ones(60))
    assert (low, high) == pytest.approx((20.56, 21.44), abs=0.1)


def test_a_record_of_one_value_has_no_width() -> None:
    assert mean_over_time(np.full(12, 3.0), np.ones(12)) == (3.0, (3.0, 3.0))


def test_steps_weigh() -> None:
    """A sample that stands for twice the time counts twice."""
    values, steps_s = np.arange(10.0), np.array([*np.ones(9), 2.0])
    mean, _ = mean_over_time(values, steps_s)
    assert mean == pytest.approx((45.0 + 9.0) / 11.0)
