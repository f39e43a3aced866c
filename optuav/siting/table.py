"""Hover times by mission and place of the laser."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from optuav.arrays import Floats
from optuav.mission import Mission
from optuav.network.network import build_network
from optuav.network.variants import Variants
from optuav.options import Perspective
from optuav.solving.batch import hover_times_s

AT_ONCE = 4096
"""Places of the laser computed together: as many as fit the cache."""


def moved(mission: Mission, sites_m: Floats) -> Variants:
    """The mission with its laser at each of some places (site, 3) [m]."""
    columns = {f"laser.position_m[{axis}]": sites_m[:, axis] for axis in range(3)}
    return Variants(build_network(mission), columns)


def longest_s(variants: Variants, perspective: Perspective) -> Floats:
    """The longest hover of each variant over all itineraries [s], NaN without a plan."""
    return np.asarray(np.fmax.reduce(hover_times_s(variants, perspective), axis=1))


def hover_table(missions: Sequence[Mission], sites_m: Floats, perspective: Perspective) -> Floats:
    """Longest hovers (mission, site) [s] with the laser at each site (site, 3) [m]."""
    parts = [slice(first, first + AT_ONCE) for first in range(0, len(sites_m), AT_ONCE)]
    rows = [
        np.concatenate([longest_s(moved(each, sites_m[part]), perspective) for part in parts])
        for each in missions
    ]
    return np.stack(rows)
