"""Branch and bound over boxes: the farthest points of plane figures that are known by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from optuav.arrays import Floats
from optuav.engines import boxes
from optuav.engines.boxes import Boxes, Programmes, search

NONE = np.array([math.nan])


def farthest(
    figure: list[tuple[float, float, float]], corner: float = 4.0
) -> tuple[float, float, float]:
    """The largest x in all of some discs (middle x, y, and radius), with x and y from 0."""

    def margin(x: Floats, y: Floats, _: Programmes) -> Floats:
        slacks = [r**2 - (x - a) ** 2 - (y - b) ** 2 for a, b, r in figure]
        found: Floats = np.min(slacks, axis=0)
        return found

    def most(within: Boxes) -> Floats:
        slacks = [
            r**2
            - (np.clip(a, within.x_low, within.x_high) - a) ** 2
            - (np.clip(b, within.y_low, within.y_high) - b) ** 2
            for a, b, r in figure
        ]
        found: Floats = np.min(slacks, axis=0)
        return found

    zero, far = np.zeros(1), np.array([corner])
    start = Boxes(zero, far, zero, far, np.array([0]))
    x, y, beyond = search(start, most, margin, NONE, NONE, 1e-8)
    return float(x[0]), float(y[0]), float(beyond[0])


def test_disc() -> None:
    """Its rightmost point, where nothing changes with y to first order."""
    x, y, beyond = farthest([(1.0, 1.2, 1.5)])
    assert x <= 2.5 <= beyond
    assert beyond - x < 1e-6
    assert y == pytest.approx(1.2, abs=1e-3)


def test_corner_of_two_discs() -> None:
    """Discs of radius 1 around (1, 0.4) and (1, 1.6) meet at (1.8, 1)."""
    x, y, beyond = farthest([(1.0, 0.4, 1.0), (1.0, 1.6, 1.0)])
    assert x <= 1.8 <= beyond + 1e-12
    assert beyond - x < 1e-7
    assert y == pytest.approx(1.0, abs=1e-6)


def test_discs_that_do_not_meet() -> None:
    """Proof that there is no point, also where a thousandth is missing."""
    x, y, beyond = farthest([(1.0, 0.0, 1.0), (1.0, 2.001, 1.0)])
    assert math.isnan(x)
    assert math.isnan(y)
    assert beyond == -math.inf


def test_a_known_point_is_kept_where_none_is_better() -> None:
    """The far end of what is searched is all that is left to show."""
    zero, far = np.array([2.0]), np.array([3.0])
    start = Boxes(zero, far, zero, far, np.array([0]))

    def none(within: Boxes) -> Floats:
        return np.full_like(within.x_low, -1.0)

    def never(x: Floats, y: Floats, _: Programmes) -> Floats:
        return np.full_like(x, -1.0)

    x, y, beyond = search(start, none, never, np.array([2.0]), np.array([0.5]), 1e-8)
    assert (x[0], y[0], beyond[0]) == (2.0, 0.5, 2.0 + 1e-8)


@pytest.mark.parametrize("bound", [1.0, math.nan])
def test_what_cannot_be_dropped_is_not_called_proved(
    monkeypatch: pytest.MonkeyPatch, bound: float
) -> None:
    """A bound that tells nothing, or is no number, leaves all of the range open."""
    monkeypatch.setattr(boxes, "MOST_ROUNDS", 20)
    zero, far = np.zeros(1), np.ones(1)
    start = Boxes(zero, far, zero, far, np.array([0]))

    def anything(within: Boxes) -> Floats:
        return np.full_like(within.x_low, bound)

    def never(x: Floats, y: Floats, _: Programmes) -> Floats:
        return np.full_like(x, -1.0)

    x, _, beyond = search(start, anything, never, NONE, NONE, 1e-8)
    assert math.isnan(x[0])
    assert beyond[0] == 1.0


def test_programmes_do_not_mix() -> None:
    """Two lines x ≤ 1 and x ≤ 2, one a programme."""
    ends, zero, far = np.array([1.0, 2.0]), np.zeros(2), np.full(2, 4.0)
    start = Boxes(zero, far, zero, far, np.array([0, 1]))

    def margin(x: Floats, _: Floats, programme: Programmes) -> Floats:
        found: Floats = ends[programme] - x
        return found

    def most(within: Boxes) -> Floats:
        return margin(within.x_low, within.y_low, within.programme)

    x, _, beyond = search(start, most, margin, np.full(2, math.nan), np.full(2, math.nan), 1e-8)
    assert x == pytest.approx(ends, abs=1e-7)
    assert np.all(x <= ends)
    assert np.all(beyond >= ends)
