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
    def devices_m(self) -> Floats:
        """Positions of the devices (device, 3) [m]."""
        return np.array([device.position_m for device in self.mission.served])

    @property
    def disc_radii_m(self) -> Floats:
        """Radius of every device's coverage at the altitude of hovering over it (device,) [m].

        NaN where it does not reach.
        """
        hover_z_m = self.places.position_m[self.places.hovers, 2]
        lowest_m = self.mission.limits.min_altitude_m
        height_m = np.where(np.isnan(hover_z_m), lowest_m, hover_z_m) - self.devices_m[:, 2]
        squared = vehicle.coverage_radius_m(self.mission) ** 2 - height_m**2
        return np.sqrt(np.where(squared >= 0.0, squared, np.nan))

    @property
    def corners_m(self) -> Floats:
        """Two corners (2, 2) of the box on the map worth showing [m].

        It holds all places, and the coverage as far as it does not dwarf them.
        """
        mission, devices_m, radii_m = self.mission, self.devices_m[:, :2], self.disc_radii_m
        seen = [*devices_m, *self.places.position_m[self.places.exists, :2]]
        seen += [np.array(mission.laser.position_m[:2])] if mission.laser else []
        seen += [*mission.buildings.outlines()[0]]
        low, high = np.min(seen, axis=0), np.max(seen, axis=0)
        first, last, span_m = low, high, float((high - low).max())
        for device_m, radius_m in zip(devices_m, radii_m.tolist(), strict=True):
            if math.isfinite(radius_m):
                room = COVERAGE_SHARE * span_m or radius_m
                low = np.minimum(low, np.maximum(device_m - radius_m, first - room))
                high = np.maximum(high, np.minimum(device_m + radius_m, last + room))
        return np.stack([low, high])

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
