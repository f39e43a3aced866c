"""Many variants of a mission at once: its keys as columns, its quantities as tables.

A table has one row a variant and one column a leg, a place or an itinerary; what is the same in all
variants has a single row. Buildings stay where they are.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from formulations.quantities import Quantities
from optuav.arrays import Booleans, Floats, Integers
from optuav.mission import Mission
from optuav.network import vehicle
from optuav.network.network import Network, build_network
from optuav.network.obstacles import CLEAR, Prisms, prisms
from optuav.network.places import FIRST_BUILDING, HOVER
from optuav.network.routes import NO_LEG
from optuav.physics.kibam import Stage
from optuav.physics.quantity import norm
from optuav.solving.given import mean_voltage_V
from optuav.studies.uncertain.obstacles import clear

Columns = Mapping[str, Floats]
"""Values by key, ``"link.device_m[0]"`` for a component; one entry a variant."""

Table = npt.NDArray[np.float64]

KEY = re.compile(r"(\w+)\.(\w+)(?:\[([012])\])?")
_ENERGIES = ("flight_energy_J", "hover_energy_J")


def with_columns(mission: Mission, columns: Columns) -> Mission:
    """The mission with columns in place of numbers: for formulas, and not validated.

    As in `Mission.replace`, stated energies of the full battery go where its size varies.
    """
    tables: dict[str, dict[str, Any]] = {}
    for key, values in columns.items():
        found = KEY.fullmatch(key)
        assert found is not None, key
        table, name, place = found.groups()
        changed = tables.setdefault(table, {})
        column: Any = np.asarray(values, dtype=float)[:, None]
        if place is not None:
            vector = list(changed.get(name, getattr(getattr(mission, table), name)))
            vector[int(place)] = column
            column = tuple(vector)
        changed[name] = column
    if {"packs", "capacity_As"} & tables.get("battery", {}).keys():
        tables["battery"] = dict.fromkeys(_ENERGIES) | tables["battery"]
    changes = {
        table: getattr(mission, table).model_copy(update=changed)
        for table, changed in tables.items()
    }
    return mission.model_copy(update=changes)


@dataclass(frozen=True)
class Base:
    """The mission that varies, worked out once.

    Parameters
    ----------
    worked_out
        Places, legs and itineraries of the mission.
    obstacles
        Its buildings.
    """

    worked_out: Network
    obstacles: Prisms

    @classmethod
    def of(cls, mission: Mission) -> Self:
        """A mission with all its itineraries."""
        return cls(build_network(mission), prisms(mission))

    @property
    def mission(self) -> Mission:
        """The mission."""
        return self.worked_out.mission

    def only(self, itinerary: int) -> Self:
        """The same with a single itinerary, number 0, and the legs that it uses."""
        route, table = self.worked_out.routes.take([itinerary]), self.worked_out.legs
        flown = route.legs != NO_LEG
        used = route.legs[flown]
        legs = replace(
            table, **{each.name: getattr(table, each.name)[..., used] for each in fields(table)}
        )
        route = replace(route, legs=np.where(flown, np.cumsum(flown) - 1, NO_LEG))
        return replace(self, worked_out=replace(self.worked_out, legs=legs, routes=route))


@dataclass(frozen=True)
class Ensemble:
    """Variants of a mission.

    Parameters
    ----------
    base
        The mission that varies.
    columns
        What varies.
    known_radius_m
        Their coverage radius (variant, 1) [m] where it is known.
    """

    base: Base
    columns: Columns
    known_radius_m: Any = None

    @cached_property
    def count(self) -> int:
        """Number of variants."""
        return len(next(iter(self.columns.values())))

    @cached_property
    def mission(self) -> Mission:
        """The mission with columns in place of numbers."""
        return with_columns(self.base.mission, self.columns)

    @cached_property
    def coverage_radius_m(self) -> Any:
        """d_max (variant, 1) or a number [m]."""
        known_m = self.known_radius_m
        return vehicle.coverage_radius_m(self.mission) if known_m is None else known_m

    @cached_property
    def position_m(self) -> Table:
        """Places (variant or 1, place, 3) [m]; NaN for a hover point out of reach."""
        route = self.mission.route
        hover_m = vehicle.hover_point_m(self.mission, self.coverage_radius_m)
        ends = [_points(route.origin_m), _points(hover_m)]
        ends.append(_points(route.destination_m))
        roofs = self.base.worked_out.places.position_m[None, FIRST_BUILDING:]
        rows = max(len(each) for each in ends)
        return np.concatenate(
            [np.broadcast_to(each, (rows, *each.shape[1:])) for each in (*ends, roofs)], axis=1
        )

    @cached_property
    def flyable_legs(self) -> Booleans:
        """Whether a leg can be flown and crosses no building (variant or 1, leg)."""
        can_be_flown: Booleans = np.isfinite(_table(self._loads.duration_s))
        if self.mission.flight.through_buildings:
            return can_be_flown
        ends = np.sort(np.stack(self._start_end, axis=1), axis=1)
        lines, line = np.unique(ends, axis=0, return_inverse=True)
        free = clear(self.base.obstacles, self.position_m, lines, lines - FIRST_BUILDING)
        return np.asarray(can_be_flown & free[:, line])

    @cached_property
    def received(self) -> vehicle.Flow:
        """Current [A] and power [W] from the laser by place (variant or 1, place)."""
        places = self.position_m.shape[1]
        if self.mission.laser is None:
            return vehicle.Flow(np.zeros((1, places)), np.zeros((1, places)))
        laser_m = _points(self.mission.laser.position_m)
        rows = max(len(laser_m), len(self.position_m))
        lit_m = np.concatenate(
            [np.broadcast_to(m, (rows, *m.shape[1:])) for m in (self.position_m, laser_m)], axis=1
        )
        number = np.arange(places)
        exempt = np.maximum(number - FIRST_BUILDING, CLEAR)[:, None]
        lines = np.stack([np.full(places, places), number], axis=1)
        sight = clear(self.base.obstacles, lit_m, lines, exempt)
        distance_m = norm(tuple(np.moveaxis(self.position_m - laser_m, -1, 0)))
        load = vehicle.charging(self.mission, distance_m)
        return vehicle.Flow(*(np.where(sight, _table(each), 0.0) for each in load))

    @cached_property
    def flight_time_s(self) -> Table:
        """Flight time of itineraries (variant or 1, itinerary) [s]."""
        return self._total(self._loads.duration_s)

    @cached_property
    def flight_charge_As(self) -> Table:
        """Charge drawn in flight (variant or 1, itinerary) [A s]."""
        return self._total(self._loads.charge_As)

    @cached_property
    def flight_energy_J(self) -> Table:
        """Energy drawn in flight (variant or 1, itinerary) [J]."""
        return self._total(self._loads.energy_J)

    @cached_property
    def flyable(self) -> Booleans:
        """Whether all legs of an itinerary can be flown (variant or 1, itinerary)."""
        numbers = self._routes.legs
        able = np.concatenate([self.flyable_legs, np.ones((len(self.flyable_legs), 1), bool)], 1)
        return np.asarray(able[:, numbers].all(axis=2))

    @cached_property
    def hover_load(self) -> vehicle.Flow:
        """Drawn while hovering, radio included (variant or 1, 1)."""
        return vehicle.Flow(*map(_table, vehicle.hover_load(self.mission)))

    @cached_property
    def rest_current_A(self) -> Table:
        """Net current into the battery while resting (variant or 1, itinerary) [A]."""
        return self._resting(self.received.current_A, vehicle.rest_load(self.mission).current_A)

    @cached_property
    def rest_received_W(self) -> Table:
        """Net power into the battery while resting (variant or 1, itinerary) [W]."""
        return self._resting(self.received.power_W, vehicle.rest_load(self.mission).power_W)

    def quantities(
        self, variants: Integers, itineraries: Integers, *, rests: bool, steps: bool = False
    ) -> Quantities:
        """Quantities of pairs of a variant and an itinerary, arrays with one entry a pair.

        Parameters
        ----------
        variants, itineraries
            Numbers (pair,); all itineraries direct, or all by way of a building.
        rests
            Whether a rest on the building may be chosen.
        steps
            Whether the steps on the way are told; all itineraries stay in the same order then.
        """
        battery, limits = self.mission.battery, self.mission.limits

        def take(values: Any) -> Any:
            return _taken(_table(values), variants, itineraries)

        def voltage_V(energy: Any, charge: Any) -> Any:
            return mean_voltage_V(take(energy), take(charge), take(battery.nominal_voltage_V))

        def full_J(key: str, voltage_V: Any) -> Any:
            """As stated; where that went with another size of the battery, what takes its place."""
            stated_J = getattr(battery, key)
            if stated_J is not None:
                return take(stated_J)
            if getattr(self.base.mission.battery, key) is None:
                return None
            return take(battery.packs) * take(battery.capacity_As) * voltage_V

        hover_m = self.position_m[:, HOVER]
        apart_m = hover_m - _points(self.mission.link.device_m)[:, 0]
        at_hover = vehicle.Flow(*(each[:, [HOVER]] for each in self.received))
        hover = self.hover_load
        flight_V = voltage_V(self.flight_energy_J, self.flight_charge_As)
        hover_V = voltage_V(hover.power_W, hover.current_A)
        return Quantities(
            deadline_s=take(limits.deadline_s),
            min_soc=take(limits.min_soc),
            packs=take(battery.packs),
            capacity_As=take(battery.capacity_As),
            nominal_voltage_V=take(battery.nominal_voltage_V),
            flight_time_s=take(self.flight_time_s),
            flight_charge_As=take(self.flight_charge_As),
            flight_energy_J=take(self.flight_energy_J),
            hover_current_A=take(hover.current_A - at_hover.current_A),
            hover_power_W=take(hover.power_W),
            hover_received_W=take(at_hover.power_W),
            rest_current_A=take(self.rest_current_A),
            rest_received_W=take(self.rest_received_W),
            flight_voltage_V=flight_V,
            hover_voltage_V=hover_V,
            flight_battery_J=full_J("flight_energy_J", flight_V),
            hover_battery_J=full_J("hover_energy_J", hover_V),
            available_fraction=take(battery.available_fraction),
            flow_rate_per_s=take(battery.flow_rate_per_s),
            hover_distance_m=take(np.sqrt((apart_m**2).sum(axis=-1, keepdims=True))),
            coverage_radius_m=take(self.coverage_radius_m),
            hover_altitude_m=take(hover_m[:, 2:]),
            min_altitude_m=take(limits.min_altitude_m),
            max_altitude_m=take(limits.max_altitude_m),
            end_gap_m=0.0,
            steps=self._steps(variants, itineraries, rests) if steps else (),
            tapers=battery.charging == "taper",
            rests=rests,
        )

    def _steps(self, variants: Integers, itineraries: Integers, rests: bool) -> tuple[Any, ...]:
        """Stages of the legs as phases of constant current, and the stays by name."""
        loads, ends = self._loads, self.base.worked_out.legs.end
        found: list[Any] = []
        for legs in self._routes.legs[itineraries].T:
            if legs[0] == NO_LEG:
                continue
            for duration_s, current_A in zip(loads.durations_s, loads.currents_A, strict=True):
                here = _taken(_table(duration_s), variants, legs)
                drawn = _taken(_table(current_A), variants, legs)
                if np.any(here):
                    every = np.zeros(len(variants))
                    found.append(Stage(every - drawn, every + here))
            if ends[legs[0]] == HOVER:
                found.append("hover")
            elif ends[legs[0]] >= FIRST_BUILDING and rests:
                found.append("rest")
        return tuple(found)

    @cached_property
    def _routes(self) -> Any:
        return self.base.worked_out.routes

    @cached_property
    def _start_end(self) -> tuple[Integers, Integers]:
        table = self.base.worked_out.legs
        return table.start, table.end

    @cached_property
    def _loads(self) -> Any:
        start, end = self._start_end
        way_m = self.position_m[:, end] - self.position_m[:, start]
        x, y, z = np.moveaxis(way_m, -1, 0)
        return vehicle.leg_loads(self.mission, (x, y, z))[0]

    def _total(self, per_leg: Any) -> Table:
        """Sums over the legs of itineraries."""
        table = _table(per_leg)
        padded = np.concatenate([table, np.zeros((len(table), 1))], axis=1)
        first, *others = (padded[:, legs] for legs in self._routes.legs.T)
        total: Table = sum(others, first)
        return total

    def _resting(self, received: Table, drawn: Any) -> Table:
        building = self._routes.building
        net = received[:, FIRST_BUILDING + building] - drawn
        return np.where(building >= 0, net, 0.0)


def _table(values: Any) -> Any:
    """Values as a table: a number has one row and one column."""
    return np.reshape(values, (1, 1)) if np.ndim(values) == 0 else np.asarray(values)


def _points(vector: Any) -> Table:
    """A place with components that are numbers or columns, as (variant or 1, 1, 3)."""
    columns = np.broadcast_arrays(*map(_table, vector))
    return np.stack(columns, axis=-1)


def _taken(table: Table, rows: Integers, columns: Integers) -> Any:
    """Entries of a table, or the one it has."""
    if table.shape == (1, 1):
        return float(table[0, 0])
    row = rows if table.shape[0] > 1 else np.zeros_like(rows)
    return table[row, columns if table.shape[1] > 1 else 0]
