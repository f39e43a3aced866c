"""A search for the largest value of a function, from starts by ever smaller random steps.

It uses no derivatives: the function may have cusps, jump, and be −∞ where nothing is possible.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from optuav.arrays import Floats
from optuav.status import SAME_S

AROUND = 120  # Points of a round of steps in all directions
SHRINK = 0.6  # Factor of the length of steps after a round without a better point
CLOSE_TO_BEST = 0.1  # Branches that are worse than the best by more than this are left
AGAIN = 8
"""Most further searches from near the best point; one that agrees ends them: small steps may be
caught by a ridge that leads to no top."""


class Point(NamedTuple):
    """A point (axis,) of one branch of a function, such as a route, and the value there."""

    value: float
    branch: int
    at: Floats


class Lengths(NamedTuple):
    """Lengths of steps; at the middle one, only the best start of each branch is kept."""

    first: float
    rough: float
    last: float


Values = Callable[[int, Floats, float], Floats]
"""Values at points (point, axis) of a branch; −∞ is as good as any below the least of interest."""
Around = Callable[[int, Floats, float, np.random.Generator], Floats]
"""Points (point, axis) to try around one of a branch, by steps of about a length, perhaps beyond
the borders."""
Inside = Callable[[Floats], Floats]
"""Points (…, axis) moved to within the borders."""


def all_around(_: int, at: Floats, length: float, random: np.random.Generator) -> Floats:
    """Return points around one in all directions; some keep one of its coordinates."""
    steps = length * random.normal(size=(AROUND, len(at)))
    for axis in range(len(at)):
        steps[axis :: len(at) + 1, axis] = 0.0
    return at + steps


def maximise(
    starts: Sequence[Point],
    values: Values,
    lengths: Lengths,
    inside: Inside,
    around: Around = all_around,
) -> Point:
    """Return the best point that steps lead to from one start or more.

    Each start is followed by steps from the first length down to the rough one, and the best start
    of each branch from there to the last. The same arguments always lead to the same point.
    """

    def climbed(top: Point, seed: int, first: float, last: float) -> Point:
        """Return the best point that ever smaller steps lead to, from one length to another."""
        random, length = np.random.default_rng(seed), first
        while length > last:
            points = inside(around(top.branch, top.at, length, random))
            trial_values = values(top.branch, points, top.value)
            best = int(trial_values.argmax())
            if trial_values[best] > top.value:
                top = Point(float(trial_values[best]), top.branch, points[best])
            else:
                length *= SHRINK
        return top

    rough = [climbed(start, 0, lengths.first, lengths.rough) for start in starts]
    rough.sort(key=lambda point: point.value)
    least = rough[-1].value - CLOSE_TO_BEST
    near = {point.branch: point for point in rough if point.value >= least}
    tops = [climbed(point, 0, lengths.rough, lengths.last) for point in near.values()]
    top = max(tops, key=lambda point: point.value)
    for seed in range(1, AGAIN + 1):
        step = lengths.rough * np.random.default_rng(seed).normal(size=len(top.at))
        beside = Point(-np.inf, top.branch, inside(top.at + step))
        again = climbed(beside, seed, lengths.rough, lengths.last)
        agrees = abs(again.value - top.value) <= SAME_S
        top = max(top, again, key=lambda point: point.value)
        if agrees:
            break
    return top
