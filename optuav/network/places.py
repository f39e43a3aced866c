"""The places of a mission as arrays: ends, hover points and buildings, with the laser's reach."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from optuav.arrays import Booleans, Floats, Integers
from optuav.mission import Mission
from optuav.mission.buildings import Buildings
from optuav.mission.keys import quantity
from optuav.mission.messages import first_ten
from optuav.network import vehicle
from optuav.network.obstacles import CLEAR, clear_lines, roofs_below
from optuav.network.prisms import prisms
from optuav.physics.flight import Flow
from optuav.physics.quantity import Quantity, Vector

ORIGIN, HOVER, DESTINATION, FIRST_BUILDING = 0, 1, 2, 3
"""Numbers of places with one device; of several, the others' hover points follow the destination,
and then the buildings."""
ENDS = ("origin", "hover", "destination")


def ends_of(mission: Mission) -> tuple[str, ...]:
    """Names of all places but the buildings, by number."""
    first, *others = (device.name for device in mission.served)
    return "origin", first, "destination", *others


def hover_point_of(place: str) -> str:
    """Return the hover point at a place in words: the only one, or that of a device."""
    return "the hover point" if place == "hover" else f"the hover point of {place}"


def on_landing(place: str, *, hovers: bool) -> str:
    """Return in words when a leg to a place ends, where the UAV hovers or lands."""
    if hovers:
        return f"on reaching {hover_point_of(place)}"
    return f"on landing at {'the ' * (place in ENDS)}{place}"


def lands(place: str, *, hovers: bool) -> str:
    """Return in words that a leg to a place ends, where the UAV hovers or lands."""
    if hovers:
        return f"reaches {hover_point_of(place)}"
    return f"lands at the {place}" if place in ENDS else f"lands on {place}"


@dataclass(frozen=True)
class Places:
    """Places by number: origin, hover, destination, then the buildings in the mission's order.

    The hover points of several devices are the place 1 and those between destination and buildings.
    """

    names: tuple[str, ...]
    position_m: Floats  # (place, 3) [m]; NaN for a hover point that does not exist
    laser_sight: Booleans  # Whether the laser is in clear sight
    # Charging power and current there [W], [A]; 0 without sight.
    received_power_W: Floats
    charge_current_A: Floats
    edited: Booleans  # Whether sight or power were stated by the user rather than computed
    roofs: Integers  # By place after the ends: number of its building in the mission, rising

    @property
    def first_building(self) -> int:
        """Number of the first place that is a building."""
        return len(self.names) - len(self.roofs)

    @property
    def buildings(self) -> Integers:
        """Numbers of the places that are buildings."""
        return np.arange(self.first_building, len(self.names))

    @property
    def hovers(self) -> Integers:
        """Numbers of the hover points, in the mission's order of devices."""
        return np.array([HOVER, *range(FIRST_BUILDING, self.first_building)])

    @property
    def hover_points_m(self) -> Floats:
        """Positions of the hover points (device, 3) [m]."""
        return self.position_m[self.hovers]

    def hovers_at(self, place: int) -> bool:
        """Whether a place is a hover point."""
        return place == HOVER or FIRST_BUILDING <= place < self.first_building

    def kind(self, place: int) -> str:
        """Kind of a place: origin, hover, destination or building."""
        if place >= self.first_building:
            return "building"
        return ENDS[HOVER if place >= FIRST_BUILDING else place]

    @property
    def exists(self) -> Booleans:
        """True if a place is known; a hover point out of reach is not."""
        return np.asarray(np.isfinite(self.position_m).all(axis=1))

    def take(self, numbers: Integers) -> "Places":
        """Return some of the places by number: the ends, and then others, rising."""
        columns = {field.name: getattr(self, field.name) for field in fields(self)[1:-1]}
        names = tuple(self.names[number] for number in numbers)
        first = self.first_building
        roofs = self.roofs[numbers[first:] - first]
        return Places(
            names, **{name: column[numbers] for name, column in columns.items()}, roofs=roofs
        )

    def on(self, building: Integers | int) -> Integers:
        """Return the numbers of the places on the roofs of buildings; the one before for −1."""
        return np.asarray(self.first_building - 1 + self.roofs.searchsorted(building, "right"))


def build_places(mission: Mission) -> Places:
    """The places of a mission, with the laser's sight and charging power past its buildings."""
    position_m = position_table(mission, mission.buildings.roof_m)
    roofs = np.arange(len(mission.buildings))
    sight, received = received_table(mission, position_m, (mission.buildings,), roofs)
    names = (*ends_of(mission), *mission.buildings.names)
    power_W, current_A = received.power_W[0], received.current_A[0]
    edited = np.zeros(len(names), bool)
    return Places(names, position_m[0], sight[0], power_W, current_A, edited, roofs)


def position_table(mission: Mission, roofs_m: Floats, radius_m: Quantity | None = None) -> Floats:
    """Positions of all places (variant or 1, place, 3) [m]; NaN for hover points out of reach.

    Figures may be columns (variant, 1), see `optuav.network.variants`; `roofs_m` are the positions
    of buildings ([variant,] building, 3), `radius_m` the coverage radius if known [m].
    """
    route = mission.route
    first_m, *others_m = vehicle.hover_points_m(mission, radius_m)
    ends_m = as_points(route.origin_m, first_m, route.destination_m, *others_m)
    return _joined(ends_m, roofs_m if roofs_m.ndim == 3 else roofs_m[None])


def received_table(
    mission: Mission, position_m: Floats, towns: Sequence[Buildings], roofs: Integers
) -> tuple[Booleans, Flow]:
    """Sight of the laser, and current and power from it, each (variant or 1, place).

    The places come from `position_table`, on the `roofs` of buildings by number; the building
    below a place does not hide the laser.
    """
    count = position_m.shape[1]
    if mission.laser is None:
        dark = np.zeros((1, count))
        return np.zeros((1, count), bool), Flow(dark, dark)
    laser_m = as_points(mission.laser.position_m)
    if len(position_m) == len(laser_m) == 1 and len(roofs) == len(towns[0]):
        ends_m = np.concatenate([laser_m, position_m[:, : count - len(roofs)]], axis=1)
        sight = _kept_sight(*towns, *ends_m.ravel().tolist())
    else:
        sight = _sight(towns, position_m, laser_m, roofs)
    x, y, z = np.moveaxis(position_m, -1, 0)
    received = vehicle.charging(mission, (x, y, z))
    return sight, Flow(*(np.where(sight, flow, 0.0) for flow in received))


@lru_cache(maxsize=4)
def _kept_sight(buildings: Buildings, *numbers_m: float) -> Booleans:
    """Sight of the laser (1, place), from its position and the ends', kept."""
    laser_m, *ends_m = np.reshape(numbers_m, (-1, 1, 1, 3))
    position_m = np.concatenate([*ends_m, buildings.roof_m[None]], axis=1)
    sight = _sight((buildings,), position_m, laser_m, np.arange(len(buildings)))
    sight.setflags(write=False)
    return sight


def _sight(
    towns: Sequence[Buildings], position_m: Floats, laser_m: Floats, roofs: Integers
) -> Booleans:
    """Sight of the laser by place (variant, place)."""
    number = np.arange(count := position_m.shape[1])
    lines = np.stack([np.full(count, count), number], axis=1)
    own_roof = np.append(np.full(count - len(roofs), CLEAR), roofs)[:, None]
    return clear_past(towns, _joined(position_m, laser_m), lines, own_roof)


def clear_past(
    towns: Sequence[Buildings], position_m: Floats, lines: Integers, exempt: Integers
) -> Booleans:
    """Like `clear_lines`, past the buildings of towns, each in as many variants in a row."""
    parts = zip(towns, np.split(position_m, len(towns)), strict=True)
    exempt_by_town = [exempt] * len(towns) if exempt.ndim == 2 else np.split(exempt, len(towns))
    rows = zip(parts, exempt_by_town, strict=True)
    return np.concatenate([clear_lines(prisms(e), part, lines, roofs) for (e, part), roofs in rows])


def own_roofs(towns: Sequence[Buildings], position_m: Floats, roofs: Integers) -> Integers:
    """The building that does not block the legs of each place (variant or 1, place): its own.

    That is the one on whose roof it stands; places after the ends stand on `roofs` by number.
    """
    first = position_m.shape[1] - len(roofs)
    parts = zip(towns, np.split(position_m[:, :first], len(towns)), strict=True)
    ends = np.concatenate([roofs_below(town, part.reshape(-1, 3)) for town, part in parts])
    ends = ends.reshape(-1, first)
    ends = ends[:1] if (ends == ends[0]).all() else ends
    return np.concatenate([ends, np.broadcast_to(roofs, (len(ends), len(roofs)))], axis=1)


def _joined(*tables: Floats) -> Floats:
    """Places in tables (variant or 1, place, 3) in one."""
    rows = max(map(len, tables))
    full_tables = [np.broadcast_to(table, (rows, *table.shape[1:])) for table in tables]
    return np.concatenate(full_tables, axis=1)


def as_points(*places_m: Vector) -> Floats:
    """Stack places with numbers or columns as components to (variant or 1, place, 3)."""
    components = itertools.chain(*places_m)
    return np.stack(np.broadcast_arrays(*components), axis=-1).reshape(-1, len(places_m), 3)


class ChargingCap(NamedTuple):
    """Limit that keeps a stronger laser from charging faster."""

    places: tuple[str, ...]  # Names of the places where it does
    words: str  # The warning as a sentence


class LaserReach(NamedTuple):
    """The laser's power at places in its sight, without powers stated in a graph."""

    most_A: float  # Largest charging current, were nothing capped; 0 where it sees no place
    capped_W: float  # Source power that gives all of them the capped current


def laser_reach(mission: Mission, places: Places) -> LaserReach:
    """Return the limits of a laser; it moves nothing where the mission states the current."""
    assert mission.laser is not None
    lit = _lit(places)
    if mission.flight_model.charging() is not None:
        return LaserReach(math.inf, 0.0)
    if not lit.any():
        return LaserReach(0.0, 0.0)
    x, y, z = places.position_m[lit].T
    current_A = vehicle.charging(mission, (x, y, z), capped=False).current_A
    away_m = float(vehicle.laser_distance_m(mission, (x, y, z)).max())
    assert mission.beam is not None
    most_W = mission.beam.enough_W(away_m, vehicle.charging_limit_W(mission))
    return LaserReach(float(np.max(current_A)), float(most_W))


def _lit(places: Places) -> Booleans:
    """Return which places the laser sees, where a UAV may stay."""
    lit = places.laser_sight & ~places.edited
    lit[[ORIGIN, DESTINATION]] = False
    return np.asarray(lit)


def charging_cap(mission: Mission, places: Places) -> ChargingCap | None:
    """Return the key that caps the charging current, and where; None without a cap or charging.

    Of the places where a UAV stays, without those whose power was stated in a graph.
    """
    if (beam := mission.beam) is None:
        return None
    (lit,), flow = _lit(places).nonzero(), mission.flight_model.charging()
    capped, keys = lit, ["flight.charge_current_A"]
    current_A = mission.battery.charge_current_A if flow is None else flow.current_A
    if flow is None:
        x, y, z = places.position_m[lit].T
        most_W = vehicle.charging_limit_W(mission)
        away_m = vehicle.laser_distance_m(mission, (x, y, z))
        caps = np.broadcast_to(beam.enough_W(away_m, most_W), lit.shape) < beam.laser.power_W
        capped, limits = lit[caps], beam.limiting_key(away_m, most_W)
        keys = [limits] if isinstance(limits, str) else [*dict.fromkeys(limits[caps].tolist())]
    if not (current_A and len(capped)):
        return None
    names = tuple(places.names[place] for place in capped.tolist())
    at = "wherever the laser is in sight" if len(capped) == len(lit) else f"at {first_ten(names)}"
    values = " and ".join(f"{key} = {quantity(mission, key)}" for key in keys)
    words = f"{values} cap{'s' * (len(keys) == 1)} the charging current {at}"
    return ChargingCap(names, f"{words}: a stronger laser changes nothing there")
