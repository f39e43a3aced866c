"""Means of records whose samples are alike: intervals by batches hold the truth."""

from __future__ import annotations

from itertools import accumulate

import numpy as np
import pytest

from optuav.calibration.batches import mean_over_time

RECORDS = 400


@pytest.mark.parametrize(("count", "alike"), [(20, 0.0), (120, 0.8), (300, 0.8), (1000, 0.95)])
def test_intervals_cover_at_their_nominal_rate(count: int, alike: float) -> None:
    """Of short records that wander too: 95 %, four standard deviations of 400 are 4.4 %."""
    random, inside = np.random.default_rng(3), 0
    for _ in range(RECORDS):
        drawn = random.standard_normal(count)
        drawn[0] /= (1.0 - alike**2) ** 0.5
        record = np.array(list(accumulate(drawn, lambda old, new: alike * old + new)))
        _, interval = mean_over_time(record, np.full(count, 0.5))
        inside += interval.low <= 0.0 <= interval.high
    assert inside / RECORDS == pytest.approx(0.95, abs=0.0436)


def test_a_record_of_one_value_has_no_width() -> None:
    assert mean_over_time(np.full(12, 3.0), np.ones(12)) == (3.0, (3.0, 3.0))


def test_steps_weigh() -> None:
    """A sample that stands for twice the time counts twice."""
    values, steps_s = np.arange(10.0), np.array([*np.ones(9), 2.0])
    mean, _ = mean_over_time(values, steps_s)
    assert mean == pytest.approx((45.0 + 9.0) / 11.0)
