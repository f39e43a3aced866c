"""What must not be negative in a box of plans, and what a second of each stay is worth to it.

The limits of y1 are those along a corner of the box, with its prices (`optuav.search.corner`); the
charge at the end is a limit as well, where a second of a stay is worth its current.

A sum of limits with weights ≥ 0 is a limit as well. Two kinds are useful: those that level the
prices of early and late stays, and those in which a rest's price in a limit on y1 ≥ 0 cancels
against y1 ≤ ωB.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from optuav.arrays import Floats
from optuav.physics.quantity import TINY
from optuav.search.boxes import Boxes
from optuav.search.corner import Corner
from optuav.search.terrain import Flown, Terrain


class Limit(NamedTuple):
    """A quantity that must not be negative, at the corner that is best for it, and its prices.

    Parameters
    ----------
    value_As
        At the corner (box,) [A s].
    price_A
        Least that it loses a second by which a stay leaves that corner (stop, box) [A].
    full
        Whether it keeps y1 ≤ ωB: then its corner is the one of short rests and long hovers.
    """

    value_As: Floats
    price_A: Floats
    full: bool


def limits(
    terrain: Terrain, boxes: Boxes, legs: Flown, low_s: Floats, high_s: Floats
) -> Iterator[Limit]:
    """0 ≤ y1 after every leg, y1 ≤ ωB after every stay, and the charge left at the end."""
    corner = Corner(terrain, boxes, legs, low_s, high_s)
    for _ in boxes.pattern:
        corner.fly()
        yield Limit(corner.available_As, corner.prices_A, full=False)
        corner.stay()
        if not terrain.tapers:
            yield Limit(corner.room_As, corner.prices_A, full=True)
    corner.fly()
    yield Limit(corner.available_As, corner.prices_A, full=False)
    price_A = np.where(np.array(boxes.pattern)[:, None], -corner.current_A, corner.current_A)
    yield Limit(corner.total_As - terrain.least_charge_As, price_A, full=False)


def _sum(one: Limit, other: Limit, weight: Floats) -> Limit:
    """A limit that follows from two with the same corner; the other counts with a weight ≥ 0."""
    return Limit(
        one.value_As + weight * other.value_As, one.price_A + weight * other.price_A, one.full
    )


def _weight(dear_A: Floats, price_A: Floats) -> Floats:
    """How often a price goes into another, 0 where either is none."""
    return np.maximum(dear_A, 0.0) * (price_A > TINY) / np.maximum(price_A, TINY)


def levelled(limits: Sequence[Limit], boxes: Boxes) -> list[Limit]:
    """Sums of limits that make it as dear to leave the corner early as late.

    A limit in the midst of a mission puts no price on what comes later, and the ones at the end a
    lower price on what came earlier, so each alone lets stays be traded where another forbids it.
    """
    found = []
    arrivals = [each for each in limits if not each.full]
    for hovering, stays in ((False, boxes.rests), (True, boxes.hovers)):
        parted = [pair for pair in itertools.pairwise(stays) if pair[1] > pair[0] + 1]
        for last in arrivals[-2:] if parted else ():
            level = last
            for early, late in reversed(parted):
                between = arrivals[early + 1 if hovering else late]
                dearer_A = level.price_A[late] - level.price_A[early]
                level = _sum(level, between, _weight(dearer_A, between.price_A[early]))
            found.append(level)
    return found


def against_full(limits: Sequence[Limit], rests: Sequence[int], width_s: Floats) -> list[Limit]:
    """Sums of a limit y1 ≤ ωB after a rest and a later one, in which the price of the rest cancels.

    Seen from the corner of long rests, y1 ≤ ωB has prices < 0: what leaving that corner gains.
    """
    found = []
    for number, limit in enumerate(limits):
        stay = number // 2
        if not limit.full or stay not in rests:
            continue
        missed_As = (limit.price_A * width_s).sum(axis=0)
        near = Limit(limit.value_As - missed_As, -limit.price_A, full=False)
        for later in limits[number + 1 :]:
            if not later.full:
                found.append(_sum(later, near, _weight(later.price_A[stay], limit.price_A[stay])))
    return found
