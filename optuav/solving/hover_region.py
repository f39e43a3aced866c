"""Where a UAV may hover: within reach of the device, in the altitude band."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from optuav.arrays import Floats
from optuav.mission import Mission
from optuav.network import vehicle
from optuav.physics.quantity import TINY

WITHIN = 1.0 - 1e-12
"""Share of the coverage radius that is used, for rounding."""


@dataclass(frozen=True)
class Region:
    """A ball around the device, cut by the altitude band.

    Parameters
    ----------
    centre_m, radius_m
        Device and d_max [m].
    low_m, high_m
        Least and largest altitude in the ball and in the band [m]; low > high where there is none.
    """

    centre_m: Floats
    radius_m: float
    low_m: float
    high_m: float

    def beyond_m(self, points_m: Floats) -> Floats:
        """How far points (…, 3) [m] are beyond the ball, the floor and the ceiling, (…, 3) [m]."""
        z = points_m[..., 2]
        distance_m = np.linalg.norm(points_m - self.centre_m, axis=-1)
        return np.stack([distance_m - self.radius_m, self.low_m - z, z - self.high_m], axis=-1)

    def inside(self, points_m: Floats) -> Floats:
        """Points (…, 3) [m] moved into the region: up or down, then level to the device."""
        z = np.clip(points_m[..., 2:], self.low_m, self.high_m)
        way_m = points_m[..., :2] - self.centre_m[:2]
        share = self._level_m(z) / np.maximum(np.linalg.norm(way_m, axis=-1, keepdims=True), TINY)
        return np.concatenate([self.centre_m[:2] + np.minimum(1.0, share) * way_m, z], axis=-1)

    def spread(self, angles: int, radii: int, heights: int) -> Floats:
        """Points (point, 3) [m] all over the region, its rim, floor and ceiling included."""
        φ = np.linspace(0.0, 2.0 * np.pi, angles, endpoint=False)
        share = np.sqrt(np.linspace(1.0, 0.0, radii, endpoint=False))
        z = np.linspace(self.low_m, self.high_m, heights)
        φ, share, z = (each.ravel() for each in np.meshgrid(φ, share, z))
        way_m = (share * self._level_m(z))[:, None] * np.column_stack([np.cos(φ), np.sin(φ)])
        return np.column_stack([self.centre_m[:2] + way_m, z])

    def _level_m(self, altitude_m: Floats) -> Floats:
        """Radius of the disc at an altitude [m]."""
        height_m = altitude_m - self.centre_m[2]
        level_m: Floats = np.sqrt(np.maximum(self.radius_m**2 - height_m**2, 0.0))
        return level_m


def region(mission: Mission) -> Region:
    """Where the UAV of a mission may hover."""
    radius_m, limits = WITHIN * vehicle.coverage_radius_m(mission), mission.limits
    device_m = np.array(mission.link.device_m)
    return Region(
        device_m,
        radius_m,
        max(limits.min_altitude_m, float(device_m[2]) - radius_m),
        min(limits.max_altitude_m, float(device_m[2]) + radius_m),
    )
