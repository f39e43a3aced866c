"""The places of a mission as arrays: ends, hover point and buildings, with the laser's reach."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from optuav.arrays import Booleans, Floats, Integers
from optuav.mission.schema import Mission
from optuav.network import vehicle
from optuav.network.obstacles import CLEAR, Prisms, crossed

ORIGIN, HOVER, DESTINATION, FIRST_BUILDING = 0, 1, 2, 3
ENDS = ("origin", "hover", "destination")


@dataclass(frozen=True)
class Places:
    """Places by number: origin, hover, destination, then the buildings in the mission's order.

    Parameters
    ----------
    names
        Name of each place.
    position_m
        (place, 3) [m]; NaN for a hover point that does not exist.
    laser_sight
        Whether the laser is in clear sight.
    received_power_W, charge_current_A
        Charging power and current there [W], [A]; 0 without sight.
    edited
        Whether sight or power were stated by the user rather than computed.
    """

    names: tuple[str, ...]
    position_m: Floats
    laser_sight: Booleans
    received_power_W: Floats
    charge_current_A: Floats
    edited: Booleans

    @property
    def buildings(self) -> Integers:
        """Numbers of the places that are buildings."""
        return np.arange(FIRST_BUILDING, len(self.names))

    @property
    def exists(self) -> Booleans:
        """Whether a place is known; a hover point out of reach is not."""
        return np.asarray(np.isfinite(self.position_m).all(axis=1))


def build_places(mission: Mission, obstacles: Prisms) -> Places:
    """The places of a mission, with the laser's sight and charging power past its obstacles."""
    ends = (mission.route.origin_m, vehicle.hover_point_m(mission), mission.route.destination_m)
    roofs = [building.position_m for building in mission.buildings]
    position_m = np.array([*ends, *roofs], dtype=float)
    names = (*ENDS, *(building.name for building in mission.buildings))
    sight, edited = np.zeros(len(names), bool), np.zeros(len(names), bool)
    if mission.laser is None:
        dark = np.zeros(len(names))
        return Places(names, position_m, sight, dark, dark, edited)
    laser_m = np.array(mission.laser.position_m)
    known = np.flatnonzero(np.isfinite(position_m).all(axis=1))
    own_roof = np.where(known >= FIRST_BUILDING, known - FIRST_BUILDING, CLEAR)
    beams_m = np.broadcast_to(laser_m, (len(known), 3)), position_m[known]
    sight[known] = crossed(obstacles, *beams_m, own_roof[:, None]) == CLEAR
    distance_m = np.sqrt(((position_m - laser_m) ** 2).sum(axis=1))
    received = vehicle.charging(mission, distance_m)
    return Places(
        names,
        position_m,
        sight,
        np.where(sight, received.power_W, 0.0),
        np.where(sight, received.current_A, 0.0),
        edited,
    )
