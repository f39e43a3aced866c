"""Branch and bound over two times: boxes that hold no point are dropped until one point is best.

A box is dropped if some constraint is missed even by what it is at most over the box, or if no
point in it is better than one that is known. The boxes that reach farthest are halved first, across
the side that matters more.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, TypeAlias

import numpy as np

from optuav.arrays import Booleans, Floats

MOST_ROUNDS = 400
"""Of halving, before the search gives up."""
AT_ONCE = 256
"""Boxes of a programme that are halved in a round."""

Programmes: TypeAlias = np.ndarray[tuple[int, ...], np.dtype[np.intp]]


class Boxes(NamedTuple):
    """Ranges of x and y [s], each in a programme."""

    x_low: Floats
    x_high: Floats
    y_low: Floats
    y_high: Floats
    programme: Programmes

    def take(self, which: Booleans) -> Boxes:
        """Some of them."""
        return Boxes._make(each[which] for each in self)


Most: TypeAlias = Callable[[Boxes], Floats]
Margin: TypeAlias = Callable[[Floats, Floats, Programmes], Floats]


def search(
    start: Boxes, most: Most, margin: Margin, x: Floats, y: Floats, width_s: float
) -> tuple[Floats, Floats, Floats]:
    """Largest x, a y for it, and what no x is beyond, one a programme.

    Parameters
    ----------
    start
        All that has to be searched.
    most
        The least margin of the constraints over each box, or more; < 0 where it holds no point.
    margin
        The same at points (x, y) of some programmes.
    x, y
        Points that hold, one a programme; NaN where none is known.
    width_s
        How much an x may be short of the largest.
    """
    x, y = x.copy(), y.copy()
    boxes, fresh = start.take(np.zeros(len(start.programme), dtype=bool)), start
    for _ in range(MOST_ROUNDS):
        fresh = fresh.take(~(most(fresh) < 0.0))  # what is no number proves nothing
        _try(fresh, margin, x, y)
        boxes = _together(boxes, fresh)
        boxes = boxes.take(~(boxes.x_high <= x[boxes.programme] + width_s))
        if not len(boxes.programme):
            break
        halved = _farthest(boxes)
        fresh, boxes = _halves(boxes.take(halved), most), boxes.take(~halved)
    beyond = np.where(np.isnan(x), -np.inf, x + width_s)
    left = _together(boxes, fresh)
    np.maximum.at(beyond, left.programme, left.x_high)
    return x, y, beyond


def _together(*boxes: Boxes) -> Boxes:
    return Boxes._make(np.concatenate(each) for each in zip(*boxes, strict=True))


def _try(boxes: Boxes, margin: Margin, x: Floats, y: Floats) -> None:
    """Take over better points among the middles and the corners of boxes."""
    x_low, x_high, y_low, y_high, programme = boxes
    at_x = np.concatenate([0.5 * (x_low + x_high), x_high, x_high, x_low, x_low])
    at_y = np.concatenate([0.5 * (y_low + y_high), y_low, y_high, y_low, y_high])
    among = np.tile(programme, 5)
    better = np.flatnonzero(~(at_x <= x[among]))
    better = better[margin(at_x[better], at_y[better], among[better]) >= 0.0]
    better = better[np.argsort(at_x[better], kind="stable")]
    x[among[better]], y[among[better]] = at_x[better], at_y[better]


def _farthest(boxes: Boxes) -> Booleans:
    """Of every programme those that reach farthest."""
    order = np.lexsort((-boxes.x_high, boxes.programme))
    sorted_ = boxes.programme[order]
    rank = np.arange(len(order)) - np.searchsorted(sorted_, sorted_)
    found = np.zeros(len(order), dtype=bool)
    found[order] = rank < AT_ONCE
    return found


def _halves(boxes: Boxes, most: Most) -> Boxes:
    """Both halves of each, across the side along which the constraints differ more."""
    x_low, x_high, y_low, y_high, _ = boxes
    x_mid, y_mid = 0.5 * (x_low + x_high), 0.5 * (y_low + y_high)
    ends = [boxes._replace(x_low=at, x_high=at) for at in (x_low, x_high)]
    ends += [boxes._replace(y_low=at, y_high=at) for at in (y_low, y_high)]
    least_x, least_y = most(_together(*ends)).reshape(2, 2, -1).min(axis=1)
    longer = x_high - x_low >= y_high - y_low
    across_x = (least_x < least_y) | ((least_x == least_y) & longer)
    lower = boxes._replace(
        x_high=np.where(across_x, x_mid, x_high), y_high=np.where(across_x, y_high, y_mid)
    )
    upper = boxes._replace(
        x_low=np.where(across_x, x_mid, x_low), y_low=np.where(across_x, y_low, y_mid)
    )
    return _together(lower, upper)
