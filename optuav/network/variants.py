"""Many variants of a mission at once: its network as tables over them.

A table has one row per variant and one column per leg, place or route; a table that is the same in
all variants has a single row. Buildings stay where they are. A network is one row.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache, reduce
from itertools import groupby
from typing import Any

import numpy as np

from optuav.arrays import Booleans, Floats, Integers
from optuav.flight.model import BENT
from optuav.mission import Mission
from optuav.mission.buildings import Buildings
from optuav.mission.forms import SECTIONS
from optuav.mission.keys import numeric_keys, stated_value
from optuav.mission.mission import ENERGIES
from optuav.network import vehicle
from optuav.network.legs import shared_lines
from optuav.network.network import Network
from optuav.network.obstacles import CLEAR
from optuav.network.places import (
    as_points,
    clear_past,
    own_roofs,
    position_table,
    received_table,
)
from optuav.network.routes import totals
from optuav.network.ways import Ways, build_ways, loads_along
from optuav.physics.flight import Flow, Loads
from optuav.physics.kibam import Shift, Stage, falls_throughout, shift
from optuav.physics.quantity import Quantity, distance

TOTALS = ("flight_time_s", "flight_charge_As", "flight_energy_J")
LEG_TOTALS = ("duration_s", "charge_As", "energy_J")
KEPT = (
    *("position_m", "received", "able", "of_legs", "flight", "hover_load"),
    *("loads", "stages", "shifts"),
)
ON_RIM = 1e-9  # Relative; a hover point on the rim of the coverage is covered
Columns = Mapping[str, Floats]
"""Values by key, ``"link.device_m[0]"`` for a component; one entry per variant."""


@dataclass(frozen=True, eq=False)
class Variants:
    """Variants of a mission."""

    network: Network
    columns: Columns
    towns: tuple[Buildings, ...] = ()  # Other buildings, each in as many variants in a row

    @cached_property
    def count(self) -> int:
        """Number of variants."""
        return len(next(iter(self.columns.values())))

    def others(self, columns: Columns) -> Variants:
        """Variants by other values of the same keys; tables that no key moves are kept."""
        others = Variants(self.network, columns)
        if self.count > 1:
            for name in (name for name in KEPT if name in vars(self)):
                tables = getattr(self, name)
                rows = [tables] if isinstance(tables, np.ndarray) else _flat(tables)
                if all(np.ndim(row) < 2 or len(row) == 1 for row in rows):
                    vars(others)[name] = tables
        return others

    @cached_property
    def mission(self) -> Mission:
        """The mission with columns in place of numbers: for formulas, and not validated.

        As in `Mission.replace`, stated energies of the full battery are dropped if its size varies.
        """
        mission, tables = self.network.mission, dict[str, dict[str, object]]()
        for key, values in self.columns.items():
            table, _, name = key.partition(".")
            name, _, axis = name.partition("[")
            values_of_table = tables.setdefault(table, {})
            column = np.asarray(values, dtype=float)[:, None]
            if not axis:
                values_of_table[name] = column
                continue
            device, _, field = name.rpartition(".")
            owner = next((served for served in mission.devices if served.name == device), None)
            here = values_of_table.setdefault(
                name, list(getattr(owner or getattr(mission, table), field))
            )
            assert isinstance(here, list)
            here[int(axis[0])] = column
        of_devices = tables.pop("devices", {})
        if {"packs", "capacity_As"} & tables.get("battery", {}).keys():
            tables["battery"] = dict.fromkeys(ENERGIES) | tables["battery"]
        owners = {name: getattr(mission, name) or SECTIONS[name]() for name in tables}
        changed: dict[str, object] = {
            name: owners[name].model_copy(update=own) for name, own in tables.items()
        }
        if of_devices:
            changed["devices"] = tuple(
                device.model_copy(
                    update={
                        key: of_devices[name]
                        for key in ("position_m", "hover_m")
                        if (name := f"{device.name}.{key}") in of_devices
                    }
                )
                for device in mission.devices
            )
        return mission.model_copy(update=changed)

    @cached_property
    def hindrances(self) -> dict[str, Booleans]:
        """Where there is no flight, whatever the way and the battery (variant or 1, 1), by reason.

        The names as in `optuav.solving.best_plans.REASONS`, the first that applies first.
        """
        mission, limits = self.mission, self.mission.limits
        has_point = np.array([device.hover_m is not None for device in mission.served])
        altitude_m = self.hover_altitudes_m
        beyond = self.hover_distances_m > self.coverage_radius_m * (1.0 + ON_RIM)
        outside = (altitude_m < limits.min_altitude_m) | (altitude_m > limits.max_altitude_m)
        contradiction = np.atleast_2d(limits.min_altitude_m > limits.max_altitude_m)
        return {
            "contradiction": contradiction | np.atleast_2d(vehicle.starts_beyond(mission)),
            "no_lift": ~np.isfinite(self.hover_load.current_A),
            "too_windy": self.too_windy,
            "out_of_reach": _anywhere(np.isnan(altitude_m) | (has_point & beyond)),
            "altitude": _anywhere(has_point & outside),
        }

    @property
    def _past(self) -> tuple[Buildings, ...]:
        """The towns past which they fly."""
        return self.towns or (self.network.mission.buildings,)

    @property
    def too_windy(self) -> Booleans:
        """True if the wind is faster than the UAV can fly (variant or 1, 1)."""
        return np.atleast_2d(self.mission.flight_model.too_windy())

    @cached_property
    def coverage_radius_m(self) -> Quantity:
        """d_max (variant, 1) or a number [m]."""
        return vehicle.coverage_radius_m(self.mission)

    @cached_property
    def position_m(self) -> Floats:
        """Places (variant or 1, place, 3) [m]; NaN for a hover point out of reach."""
        roofs_m = self.network.places.position_m[self.network.places.first_building :]
        if self.towns:
            every_m = np.stack([town.roof_m[self.network.places.roofs] for town in self.towns])
            roofs_m = every_m.repeat(self.count // len(self.towns), axis=0)
        return position_table(self.mission, roofs_m, self.coverage_radius_m)

    def device_distance_m(self, places: slice) -> Floats:
        """Distance of some places from the one device (variant or 1, place) [m]."""
        x, y, z = np.moveaxis(self.position_m[:, places], -1, 0)
        return np.asarray(distance(self.mission.device_m, (x, y, z)))

    @cached_property
    def hover_distances_m(self) -> Floats:
        """Distance of every hover point from its device (variant or 1, device) [m]."""
        x, y, z = np.moveaxis(self.position_m[:, self.network.places.hovers], -1, 0)
        devices_m = as_points(*(device.position_m for device in self.mission.served))
        u, v, w = np.moveaxis(devices_m, -1, 0)
        return np.asarray(distance((u, v, w), (x, y, z)))

    @property
    def hover_altitudes_m(self) -> Floats:
        """Altitudes of the hover points (variant or 1, device) [m]."""
        return self.position_m[:, self.network.places.hovers, 2]

    @cached_property
    def received(self) -> Flow:
        """Current [A] and power [W] from the laser by place (variant or 1, place)."""
        roofs = self.network.places.roofs
        return received_table(self.mission, self.position_m, self._past, roofs)[1]

    @cached_property
    def able(self) -> Booleans:
        """True if all legs can be flown and the hover point be held (variant or 1, route)."""
        able = np.isfinite(np.atleast_2d(self.loads.duration_s))
        if self.mission.flight.obstacle_rule == "refuse":
            lines, line = self._lines
            free = clear_past(self._past, self.position_m, lines, self._own_roofs)
            able = able & free[:, line]
        elif self.ways is not None:
            able = able & (self.ways.blocker == CLEAR)[:, self._lines[1]]
        able = np.concatenate([able, np.ones((len(able), 1), bool)], axis=1)  # for NO_LEG
        held = np.isfinite(self.hover_load.current_A) & ~self.too_windy
        return np.asarray(able[:, self.network.routes.legs].all(axis=2) & held)

    @cached_property
    def of_legs(self) -> list[Floats]:
        """Duration [s], charge [A s] and energy [J] of legs, each (variant or 1, leg)."""
        return [np.atleast_2d(getattr(self.loads, name)) for name in LEG_TOTALS]

    @cached_property
    def flight(self) -> list[Floats]:
        """Flight time [s], charge [A s] and energy [J] of routes, each (variant or 1, route)."""
        return [totals(leg, self.network.routes.legs) for leg in self.of_legs]

    @cached_property
    def hover_load(self) -> Flow:
        """Drawn while hovering, radio included (variant or 1, 1)."""
        return Flow(*map(np.atleast_2d, vehicle.hover_load(self.mission)))

    @cached_property
    def stages(self) -> list[Stage]:
        """The stages of the legs, each (variant or 1, leg)."""
        table = zip(self.loads.currents_A, self.loads.durations_s, strict=True)
        return [Stage(*np.atleast_2d(0.0 - i, t)) for i, t in table]

    @cached_property
    def shifts(self) -> list[Shift]:
        """Effect of the stages of the legs on the charge of all packs, each (variant or 1, leg)."""
        return [shift(self.mission.pool, stage) for stage in self.stages]

    @cached_property
    def falls_in_flight(self) -> Booleans:
        """True if the available well falls all along every leg (variant or 1, 1)."""
        most_A = [np.where(t > 0.0, i, -np.inf).max(axis=1, keepdims=True) for i, t in self.stages]
        return np.asarray(falls_throughout(self.mission.pool, reduce(np.maximum, most_A)))

    @cached_property
    def loads(self) -> Loads:
        """Draw of the legs in their stages, each (variant or 1, leg) or a number."""
        legs = self.network.legs
        start_m, end_m = (self.position_m[:, end] for end in (legs.start, legs.end))
        waypoints_m = np.empty((1, len(legs.start), 0, 3))
        if self.ways is not None:
            waypoints_m = self.ways.of_legs(self._lines[1], legs.start > legs.end)
        return loads_along(self.mission.flight_model.leg, start_m, end_m, waypoints_m)

    @cached_property
    def _lines(self) -> tuple[Integers, Integers]:
        """The lines that legs fly along, and the number of each leg's line."""
        return shared_lines(self.network.legs.start, self.network.legs.end)

    @cached_property
    def ways(self) -> Ways | None:
        """The ways along the lines of legs; None where no leg is bent."""
        if self.mission.flight.obstacle_rule not in BENT:
            return None
        lines, _ = self._lines
        return build_ways(self.mission, self._past, self.position_m, lines, self._own_roofs)

    @property
    def _own_roofs(self) -> Integers:
        """Buildings that do not block a line, as its ends stand there ([variant,] line, 2)."""
        stood_on = own_roofs(self._past, self.position_m, self.network.places.roofs)
        roofs = stood_on[:, self._lines[0]]
        return roofs[0] if len(roofs) == 1 else roofs

    @cached_property
    def distance_m(self) -> Floats:
        """Lengths of the legs (variant or 1, leg) [m]."""
        return np.atleast_2d(self.loads.distance_m)


@lru_cache(maxsize=1)
def as_variants(*networks: Network) -> Variants:
    """Networks over the same buildings as variants of the first, each with its own figures.

    Hover points are stated in all of their missions, or in none. The last variants are kept.
    """
    first, missions = networks[0], [network.mission for network in networks]
    columns = dict[str, Floats]()
    comparable = numeric_keys(first.mission) if len(networks) > 1 else ()
    for table, keys in groupby(comparable, lambda key: key.partition(".")[0]):
        tables = [getattr(mission, table) for mission in missions]
        if all(other == tables[0] for other in tables[1:]):
            continue
        for key in keys:
            values = [stated_value(mission, key) for mission in missions]
            if any(value != values[0] for value in values):
                columns[key] = np.array(values, dtype=float)  # NaN for None

    def rows(table: str, name: str) -> Floats:
        """Arrays of all networks, one row each."""
        return np.stack([getattr(getattr(network, table), name) for network in networks])

    def stages(name: str) -> Floats:
        """Tables (stage, network, leg); legs of fewer segments have zeros."""
        tables = [getattr(network.legs, name) for network in networks]
        most = max(map(len, tables))
        short = [most - len(table) for table in tables]
        parts = zip(tables, short, strict=True)
        return np.stack([np.pad(x, ((0, k), (0, 0))) if k else x for x, k in parts], axis=1)

    received = rows("places", "charge_current_A"), rows("places", "received_power_W")
    variants = Variants(first, columns)
    vars(variants).update(
        count=len(networks),
        position_m=rows("places", "position_m"),
        received=Flow(*received),
        able=rows("routes", "flyable"),
        of_legs=[rows("legs", name) for name in LEG_TOTALS],
        flight=[rows("routes", name) for name in TOTALS],
        stages=[*map(Stage, 0.0 - stages("currents_A"), stages("durations_s"))],
        distance_m=rows("legs", "distance_m"),
    )
    return variants


def _anywhere(by_device: Booleans) -> Booleans:
    """Where something holds for any of the devices (variant or 1, 1)."""
    return np.asarray(
        by_device if by_device.shape[1] == 1 else by_device.any(axis=1, keepdims=True)
    )


def _flat(tables: Iterable[Any]) -> Iterator[Quantity]:
    """Tables, also those in tuples, one by one."""
    for table in tables:
        yield from _flat(table) if isinstance(table, tuple | list) else (table,)
