"""The places of a mission as arrays: ends, hover point and buildings, with the laser's reach."""

import itertools
import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from optuav.arrays import Booleans, Floats, Integers
from optuav.mission import Mission
from optuav.mission.messages import listed
from optuav.mission.schema import Laser
from optuav.network import vehicle
from optuav.network.obstacles import CLEAR, clear_lines
from optuav.network.prisms import Prisms
from optuav.physics import laser
from optuav.physics.quantity import Quantity, Vector, norm

ORIGIN, HOVER, DESTINATION, FIRST_BUILDING = 0, 1, 2, 3
ENDS = ("origin", "hover", "destination")


@dataclass(frozen=True)
class Places:
    """Places by number: origin, hover, destination, then the buildings in the mission's order."""

    names: tuple[str, ...]
    position_m: Floats  # (place, 3) [m]; NaN for a hover point that does not exist
    laser_sight: Booleans  # Whether the laser is in clear sight
    # Charging power and current there [W], [A]; 0 without sight.
    received_power_W: Floats
    charge_current_A: Floats
    edited: Booleans  # Whether sight or power were stated by the user rather than computed

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
    position_m = position_table(mission, mission.buildings.roof_m)
    sight, received = received_table(mission, position_m, obstacles)
    names = (*ENDS, *mission.buildings.names)
    power_W, current_A = received.power_W[0], received.current_A[0]
    return Places(names, position_m[0], sight[0], power_W, current_A, np.zeros(len(names), bool))


def position_table(mission: Mission, roofs_m: Floats, radius_m: Quantity | None = None) -> Floats:
    """Positions of all places (variant or 1, place, 3) [m]; NaN for a hover point out of reach.

    Figures may be columns (variant, 1), see `optuav.network.variants`; `roofs_m` (building, 3) are
    the positions of buildings, `radius_m` the coverage radius if known [m].
    """
    route = mission.route
    hover_m = vehicle.hover_point_m(mission, radius_m)
    ends_m = as_points(route.origin_m, hover_m, route.destination_m)
    return np.concatenate([ends_m, np.broadcast_to(roofs_m, (len(ends_m), *roofs_m.shape))], axis=1)


def received_table(
    mission: Mission, position_m: Floats, obstacles: Prisms
) -> tuple[Booleans, vehicle.Flow]:
    """Sight of the laser, and current and power from it, each (variant or 1, place).

    The places are those of `position_table`; the building below a place does not hide the laser.
    """
    count = position_m.shape[1]
    if mission.laser is None:
        dark = np.zeros((1, count))
        return np.zeros((1, count), bool), vehicle.Flow(dark, dark)
    laser_m, number = as_points(mission.laser.position_m), np.arange(count)
    lines = np.stack([np.full(count, count), number], axis=1)
    own_roof = np.maximum(number - FIRST_BUILDING, CLEAR)[:, None]
    from_laser_m = position_m - laser_m
    rows = len(from_laser_m)
    both_m = [np.broadcast_to(m, (rows, *m.shape[1:])) for m in (position_m, laser_m)]
    sight = clear_lines(obstacles, np.concatenate(both_m, axis=1), lines, own_roof)
    received = vehicle.charging(mission, norm(tuple(np.moveaxis(from_laser_m, -1, 0))))
    return sight, vehicle.Flow(*(np.where(sight, each, 0.0) for each in received))


def as_points(*places_m: Vector) -> Floats:
    """Places with components that are numbers or columns, as (variant or 1, place, 3)."""
    components = itertools.chain(*places_m)
    return np.stack(np.broadcast_arrays(*components), axis=-1).reshape(-1, len(places_m), 3)


class ChargingCap(NamedTuple):
    """What keeps a stronger laser from charging faster."""

    places: tuple[str, ...]  # Names of the places where it does
    words: str  # What it is, as a sentence


class LaserReach(NamedTuple):
    """What the laser can give at the places in its sight, without those stated in a graph."""

    most_A: float  # Largest charging current, were nothing capped; 0 where it sees no place
    capped_W: float  # Source power from which on all of them get the capped current


def laser_reach(mission: Mission, places: Places) -> LaserReach:
    """Return the limits of a laser; it moves nothing where the mission states the current."""
    assert mission.laser is not None
    lit, distance_m = _lit(mission.laser, places)
    if mission.flight.model == "regimes" and mission.flight.charge_current_A is not None:
        return LaserReach(math.inf, 0.0)
    if not lit.any():
        return LaserReach(0.0, 0.0)
    current_A = vehicle.charging(mission, distance_m[lit], capped=False).current_A
    alpha, light = vehicle.attenuation_per_km(mission), vehicle.conversion(mission)
    share = laser.transmission(alpha, float(distance_m[lit].max()))
    limit_W = mission.battery.charge_current_A * mission.battery.nominal_voltage_V
    return LaserReach(float(np.max(current_A)), float(laser.source_limit(light, limit_W, share)))


def _lit(source: Laser, places: Places) -> tuple[Booleans, Floats]:
    """Which places the laser sees, where a UAV may stay, and the distances to all [m]."""
    lit = places.laser_sight & ~places.edited
    lit[[ORIGIN, DESTINATION]] = False
    return lit, norm(tuple((places.position_m - source.position_m).T))


def charging_cap(mission: Mission, places: Places) -> ChargingCap | None:
    """Which key caps the charging current, and where; None if none does, or nothing may charge.

    Of the places where a UAV stays, without those whose power was stated in a graph.
    """
    if mission.laser is None:
        return None
    lit, distance_m = _lit(mission.laser, places)
    stated = mission.flight.charge_current_A if mission.flight.model == "regimes" else None
    key = "battery.charge_current_A" if stated is None else "flight.charge_current_A"
    current_A = mission.battery.charge_current_A if stated is None else stated
    free_A = vehicle.charging(mission, distance_m, capped=False).current_A
    capped = lit if stated is not None else lit & (free_A > current_A)
    if not (current_A and capped.any()):
        return None
    names = tuple(places.names[place] for place in np.flatnonzero(capped))
    at = "wherever the laser is in sight" if (capped == lit).all() else f"at {listed(names)}"
    caps = f"{key} = {current_A:g} A caps the charging current {at}"
    return ChargingCap(names, f"{caps}: a stronger laser changes nothing there")
