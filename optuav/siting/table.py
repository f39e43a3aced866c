"""Hover times by mission and place of the laser."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from optuav.arrays import Booleans, Floats
from optuav.mission import Mission
from optuav.network.network import build_network
from optuav.network.variants import Variants
from optuav.options import Perspective
from optuav.solving.best_plans import hover_times_s

AT_ONCE = 4096
"""Missions times places of the laser computed together, about: as many as fit the cache."""


def hover_table(missions: Sequence[Mission], sites_m: Floats, perspective: Perspective) -> Floats:
    """Longest hovers (mission, site) [s] with the laser at each site (site, 3) [m].

    NaN where there is no plan.
    """
    found_s = np.empty((len(missions), len(sites_m)))
    for numbers, hover_s, _ in with_laser_at(missions, sites_m, perspective):
        found_s[numbers] = hover_s
    return found_s


def with_laser_at(
    missions: Sequence[Mission], sites_m: Floats, perspective: Perspective
) -> Iterator[tuple[list[int], Floats, Booleans]]:
    """Some missions by number, their hovers (mission, site) [s], what is lit (…, site, place).

    Missions that differ in the place of their device alone are computed together.
    """
    alike = dict[Mission, list[int]]()
    for number, mission in enumerate(missions):
        link = mission.link.model_copy(update={"device_m": (0.0, 0.0, 0.0)})
        alike.setdefault(mission.model_copy(update={"link": link}), []).append(number)
    at_once = max(1, AT_ONCE // len(sites_m))
    for group in alike.values():
        network = build_network(missions[group[0]])
        for first in range(0, len(group), at_once):
            numbers = group[first : first + at_once]
            shape = len(numbers), len(sites_m)
            devices_m = np.array([missions[number].link.device_m for number in numbers])
            columns: dict[str, Floats] = {}
            for axis in range(3):
                columns[f"laser.position_m[{axis}]"] = np.tile(sites_m[:, axis], shape[0])
                columns[f"link.device_m[{axis}]"] = np.repeat(devices_m[:, axis], shape[1])
            variants = Variants(network, columns)
            hover_s = hover_times_s(variants, perspective).max(axis=1)
            hover_s[np.isneginf(hover_s)] = np.nan
            power_W = variants.received.power_W
            lit = np.broadcast_to(power_W > 0.0, (variants.count, power_W.shape[1]))
            yield numbers, hover_s.reshape(shape), lit.reshape(*shape, -1)
