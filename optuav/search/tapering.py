"""Rows of both wells after a stay that tapers once y1 = ωB, which are unknowns of their own.

A plan that holds more in both wells loses nothing by it, so rows from above are enough. Neither
well holds more than if the whole current had gone on, and no charge comes from elsewhere. y1 ≤ ωB.

What the bound well lacks, D = (1−ω)B − y2, never falls faster than by e^(−k_F t/(1−ω)), as y1 ≤ ωB,
and falls so once the charger tapers. With D after the shortest stay of a box, which is convex in
the wells before it (y2 is the largest that any current up to I reaches, a linear programme), and so
above its tangent plane, the product of both factors is above McCormick's planes.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple, TypeAlias

import numpy as np

from optuav.arrays import Floats
from optuav.physics.kibam import Battery, Stage, Wells, levelling, tapered, time_to_full
from optuav.search.bounds import AfterStay
from optuav.search.terrain import Boxes
from optuav.search.tilt import Tilt

Row: TypeAlias = tuple[Floats, Floats]
"""Coefficients (unknown, box) and the limit (box,) of their sum."""


class ChargePlanes(NamedTuple):
    """The charge on landing as planes in the unknowns."""

    total_As: Floats  # y without stays (box,)
    total_A: Floats  # and what the unknowns add (unknown, box)
    above: Tilt  # Above z
    below: Tilt  # Above −z


def tapering(
    battery: Battery,
    boxes: Boxes,
    stop: int,
    current_A: Floats,
    landing: ChargePlanes,
    wells_A: Floats,
    after: AfterStay,
) -> Iterator[Row]:
    """Rows of both wells after a stay, to which the unknowns add wells_A (well, unknown, box)."""
    share, rest = battery.available_fraction, battery.bound_fraction
    available_A, bound_A = wells_A
    low_s, high_s = boxes.low_s[stop], boxes.high_s[stop]
    before_As, total_A = landing.total_As, landing.total_A.copy()
    total_A[stop] = current_A
    above = landing.above.stayed(battery, stop, current_A, low_s, high_s)
    below = landing.below.stayed(battery, stop, -current_A, low_s, high_s)
    yield available_A + bound_A - total_A, before_As
    yield available_A - share * total_A - above.slope_A, share * before_As + above.height_As
    yield bound_A - rest * total_A - below.slope_A, rest * before_As + below.height_As
    yield available_A, after.most.available_As
    yield bound_A, after.most.bound_As
    yield available_A + bound_A, after.total_As
    rate, full_As = battery.flow_rate_per_s / rest, battery.full.bound_As
    lacks_As, lacks_A = _lacking(battery, Stage(current_A, low_s), landing, after.landed)
    least_As, last = full_As - after.soonest_As, np.exp(-rate * (high_s - low_s))
    for at_s in (low_s, high_s):
        # D e ≥ least D · e, and ≥ D e(high) + least D · (e − e(high)); e is above its tangents.
        tangent_As = least_As * np.exp(-rate * (at_s - low_s))
        row = bound_A.copy()
        row[stop] = -rate * tangent_As
        limit_As = full_As - tangent_As * (1.0 + rate * at_s)
        yield row, limit_As
        yield row - last * lacks_A, limit_As - last * (lacks_As - least_As)


def _lacking(
    battery: Battery, stay: Stage, landing: ChargePlanes, begin: Wells
) -> tuple[Floats, Floats]:
    """A plane below D after a stay, height − slope · x; it touches D of the wells at the beginning.

    While the current is constant, y2 is linear in the wells; from y1 = ωB on D only fades.
    """
    share, rest = battery.available_fraction, battery.bound_fraction
    steady_s = np.minimum(stay.duration_s, time_to_full(battery, begin, stay.current_A))
    fades = np.exp(-battery.flow_rate_per_s / rest * (stay.duration_s - steady_s))
    remaining, _ = levelling(battery, steady_s)
    by_available, by_bound = fades * rest * (1.0 - remaining), fades * (rest + share * remaining)
    by_total, by_tilt = share * by_available + rest * by_bound, by_available - by_bound
    rises = by_tilt > 0.0
    tilt_As = np.where(rises, landing.above.height_As, -landing.below.height_As)
    tilt_A = np.where(rises, landing.above.slope_A, -landing.below.slope_A)
    lacks_As = battery.full.bound_As - tapered(battery, begin, stay).bound_As
    lacks_As += by_available * begin.available_As + by_bound * begin.bound_As
    lacks_As -= by_total * landing.total_As + by_tilt * tilt_As
    return lacks_As, by_total * landing.total_A + by_tilt * tilt_A
