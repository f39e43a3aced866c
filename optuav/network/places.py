"""The places of a mission as arrays: ends, hover point and buildings, with the laser's reach."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from optuav.arrays import Booleans, Floats, Integers
from optuav.mission import Mission
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


@dataclass(frozen=True)
class ChargingCap:
    """What keeps a stronger laser from charging faster.

    Parameters
    ----------
    key
        The key of the mission that states the current.
    current_A
        Its value [A].
    places
        Names of the places where it holds.
    everywhere
        Whether those are all places in sight of the laser.
    """

    key: str
    current_A: float
    places: tuple[str, ...]
    everywhere: bool

    def __str__(self) -> str:
        names = ", ".join(self.places[:10]) + (", …" if len(self.places) > 10 else "")
        at = "wherever the laser is in sight" if self.everywhere else f"at {names}"
        return (
            f"{self.key} = {self.current_A:g} A caps the charging current {at}: a stronger laser "
            "changes nothing there"
        )


def charging_cap(mission: Mission, places: Places) -> ChargingCap | None:
    """Which key caps the charging current, and where; None if more laser power charges faster.

    Places whose power was stated in a graph are left out.

    Examples
    --------
    >>> import optuav
    >>> from optuav.network.network import build_network
    >>> network = build_network(optuav.load("paper"))
    >>> print(charging_cap(network.mission, network.places))
    battery.charge_current_A = 10 A caps the charging current wherever the laser is in sight: a \
stronger laser changes nothing there
    """
    if mission.laser is None:
        return None
    key, current_A = "battery.charge_current_A", mission.battery.charge_current_A
    lit = places.laser_sight & ~places.edited
    capped = lit
    if mission.flight.model == "regimes" and mission.flight.charge_current_A is not None:
        key, current_A = "flight.charge_current_A", mission.flight.charge_current_A
    else:
        distance_m = np.sqrt(((places.position_m - mission.laser.position_m) ** 2).sum(axis=1))
        power_W = vehicle.received_power_W(mission, distance_m, np.inf)
        capped = lit & (power_W > current_A * mission.battery.nominal_voltage_V)
    names = tuple(places.names[place] for place in np.flatnonzero(capped))
    return ChargingCap(key, current_A, names, bool((capped == lit).all())) if names else None
