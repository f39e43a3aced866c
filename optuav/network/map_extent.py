"""The scene of a mission: the content of its map, and its extent."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from optuav.arrays import Booleans, Floats
from optuav.mission import Mission
from optuav.network import vehicle
from optuav.network.places import Places, build_places
from optuav.network.prisms import Prisms, prisms

COVERAGE_SHARE = 0.4
"""Most that the coverage disc adds to the map on every side, as a share of the places' span."""

MOST_LINES = 1000  # Most buildings for showing all lines of sight


@dataclass(frozen=True)
class Scene:
    """A mission with its places, by number, and its buildings as prisms."""

    mission: Mission
    places: Places
    obstacles: Prisms

    def positions(self, names: Sequence[str]) -> Floats:
        """Positions of places (place, 3) [m] by their names."""
        return self.places.position_m[[self.places.names.index(name) for name in names]]

    @property
    def rings(self) -> list[Floats]:
        """Corners of the footprint of each building (corner, 2) [m]; empty without one."""
        corners_m, count = self.mission.buildings.outlines()
        return np.split(corners_m, np.cumsum(count))[:-1]

    @property
    def disc_radius_m(self) -> float:
        """Radius of the first device's coverage at the altitude of hovering [m], see `discs`."""
        return self.discs[0][1]

    @property
    def discs(self) -> list[tuple[Floats, float]]:
        """Middle (2,) and radius [m] of each device's coverage at the altitude of its hover point.

        The radius is NaN where the radio does not reach.
        """
        radius_m, discs = vehicle.coverage_radius_m(self.mission), list[tuple[Floats, float]]()
        for device, hover_m in zip(self.mission.served, self.places.hover_points_m, strict=True):
            hover_z_m, device_m = float(hover_m[2]), np.array(device.position_m)
            altitude_m = self.mission.limits.min_altitude_m if math.isnan(hover_z_m) else hover_z_m
            squared = radius_m**2 - (altitude_m - device_m[2]) ** 2
            discs.append((device_m[:2], math.sqrt(squared) if squared >= 0.0 else math.nan))
        return discs

    @property
    def corners_m(self) -> Floats:
        """Two corners (2, 2) of the box on the map worth showing [m].

        It holds all places, and the coverage as far as it does not dwarf them.
        """
        mission, discs = self.mission, self.discs
        seen = [
            *(device_m for device_m, _ in discs),
            *self.places.position_m[self.places.exists, :2],
        ]
        seen += [np.array(mission.laser.position_m[:2])] if mission.laser else []
        seen += [*mission.buildings.outlines()[0]]
        low, high = np.min(seen, axis=0), np.max(seen, axis=0)
        shown = np.stack([low, high])
        for device_m, radius_m in discs:
            if math.isfinite(radius_m):
                room = COVERAGE_SHARE * float((high - low).max()) or radius_m
                shown[0] = np.minimum(shown[0], np.maximum(device_m - radius_m, low - room))
                shown[1] = np.maximum(shown[1], np.minimum(device_m + radius_m, high + room))
        return shown

    def sight_lines(
        self, named: Collection[str] = (), most: int = MOST_LINES
    ) -> tuple[Floats, Booleans]:
        """Lines (line, 2, 2) on the map from the laser to where it may charge [m]; if clear.

        In a town of more than `most` buildings, which they would cover, those to the named places.
        """
        if self.mission.laser is None:
            return np.empty((0, 2, 2)), np.empty(0, dtype=bool)
        charging = np.concatenate([self.places.hovers, self.places.buildings])
        if len(self.mission.buildings) > most:
            charging = charging[[self.places.names[place] in named for place in charging]]
        charging = charging[self.places.exists[charging]]
        ends_m = self.places.position_m[charging, :2]
        source_m = np.broadcast_to(self.mission.laser.position_m[:2], ends_m.shape)
        return np.stack([source_m, ends_m], axis=1), self.places.laser_sight[charging]


def scene(mission: Mission) -> Scene:
    """The places and buildings that a map of a mission shows."""
    return Scene(mission, build_places(mission), prisms(mission.buildings))
