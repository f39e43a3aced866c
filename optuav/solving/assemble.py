"""Quantities that formulations speak of, from the arrays of a mission or of its variants."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Protocol

import numpy as np

from formulations.parameters import FROM_HOVER, QUANTITIES, TO_HOVER, Quantities
from optuav.arrays import Floats, Integers
from optuav.mission import Mission
from optuav.network import vehicle
from optuav.network.network import NO_LEG, Legs, Network
from optuav.network.places import FIRST_BUILDING, HOVER, as_points, as_table
from optuav.network.variants import Variants
from optuav.physics.flight import STAGES
from optuav.physics.kibam import Stage
from optuav.physics.quantity import Quantity


def quantities(
    network: Network, which: Integers, *, rests: bool = True, hover_open: bool = False
) -> Quantities:
    """Quantities of some itineraries, arrays with one entry each.

    Parameters
    ----------
    network
        Places, legs and itineraries.
    which
        Numbers of itineraries; all of them direct, or all by way of a building. The steps on the
        way are among the quantities where all stay in the same order.
    rests
        Whether a rest on the building may be chosen.
    hover_open
        Whether the legs to and from the hover point are named among the steps rather than stated.
    """
    pairs = _Pairs(network, _Single(network), np.zeros_like(which), which)
    steps: tuple[Stage | str, ...] = ()
    if len(np.unique(network.routes.rest_first[which])) <= 1:
        steps = pairs.steps(rests=rests, hover_open=hover_open)
    return pairs.quantities(steps, end_gap_m=_end_gap_m(network, which), rests=rests)


def variant_quantities(
    variants: Variants, number: Integers, itineraries: Integers, *, rests: bool, steps: bool = False
) -> Quantities:
    """Quantities of pairs of a variant and an itinerary, arrays with one entry a pair.

    Parameters
    ----------
    variants
        The variants of a mission.
    number, itineraries
        Of variant and itinerary (pair,); all itineraries direct, or all by way of a building.
    rests
        Whether a rest on the building may be chosen.
    steps
        Whether to include the steps on the way, which need all itineraries in one order.
    """
    pairs = _Pairs(variants.network, variants, number, itineraries)
    return pairs.quantities(pairs.steps(rests=rests) if steps else (), end_gap_m=0.0, rests=rests)


class _Tables(Protocol):
    """What quantities are taken from, as tables (variant or 1, place, leg or route)."""

    @property
    def mission(self) -> Mission: ...
    @property
    def position_m(self) -> Floats: ...
    @property
    def coverage_radius_m(self) -> Quantity: ...
    @property
    def received(self) -> vehicle.Flow: ...
    @property
    def hover_load(self) -> vehicle.Flow: ...
    @property
    def flight_time_s(self) -> Floats: ...
    @property
    def flight_charge_As(self) -> Floats: ...
    @property
    def flight_energy_J(self) -> Floats: ...
    @property
    def stages(self) -> list[tuple[Quantity, Quantity]]: ...

    def take(
        self, values: Quantity, variants: Integers, columns: Integers | None = None
    ) -> Quantity:
        """Entries of a table by variant and column."""


class _Single:
    """The tables of a single network."""

    def __init__(self, network: Network) -> None:
        places, routes, legs = network.places, network.routes, network.legs
        self.mission = network.mission
        self.position_m = places.position_m[None]
        self.coverage_radius_m = vehicle.coverage_radius_m(network.mission)
        self.received = vehicle.Flow(places.charge_current_A[None], places.received_power_W[None])
        self.hover_load = vehicle.hover_load(network.mission)
        self.flight_time_s = routes.flight_time_s[None]
        self.flight_charge_As = routes.flight_charge_As[None]
        self.flight_energy_J = routes.flight_energy_J[None]
        pairs = zip(legs.durations_s, legs.currents_A, strict=True)
        self.stages: list[tuple[Quantity, Quantity]] = [(t[None], i[None]) for t, i in pairs]

    def take(
        self, values: Quantity, variants: Integers, columns: Integers | None = None
    ) -> Quantity:
        """Entries of a table by column; a number where no column is named."""
        table = as_table(values)
        return float(table[0, 0]) if columns is None else table[0, columns]


class _Pairs:
    """Pairs of a variant and an itinerary, and the tables that their quantities are taken from."""

    def __init__(
        self, network: Network, tables: _Tables, number: Integers, itineraries: Integers
    ) -> None:
        self.network, self.tables = network, tables
        self.number, self.itineraries = number, itineraries

    def take(self, values: Quantity, columns: Integers | None = None) -> Quantity:
        """Entries of a table: of its columns by place, leg or route; or of its only one."""
        return self.tables.take(values, self.number, columns)

    def quantities(
        self, steps: tuple[Stage | str, ...], *, end_gap_m: Quantity, rests: bool
    ) -> Quantities:
        """All quantities; those of one mission that do not depend on the route are numbers."""
        tables, take, routes = self.tables, self.take, self.itineraries
        battery, limits = tables.mission.battery, tables.mission.limits
        nominal_V = take(battery.nominal_voltage_V)
        hover_A, hover_W = map(take, tables.hover_load)
        received_A, received_W = (take(each[:, [HOVER]]) for each in tables.received)
        rest_A, rest_W = self._rest()
        hover_m = tables.position_m[:, [HOVER]]
        apart_m = hover_m - as_points(tables.mission.link.device_m)
        flight_J = take(tables.flight_energy_J, routes)
        flight_As = take(tables.flight_charge_As, routes)
        flight_V = _mean_voltage_V(flight_J, flight_As, nominal_V)
        hover_V = _mean_voltage_V(hover_W, hover_A, nominal_V)
        return Quantities(
            deadline_s=take(limits.deadline_s),
            min_soc=take(limits.min_soc),
            packs=take(battery.packs),
            capacity_As=take(battery.capacity_As),
            nominal_voltage_V=nominal_V,
            flight_time_s=take(tables.flight_time_s, routes),
            flight_charge_As=flight_As,
            flight_energy_J=flight_J,
            hover_current_A=hover_A - received_A,
            hover_power_W=hover_W,
            hover_received_W=received_W,
            rest_current_A=rest_A,
            rest_received_W=rest_W,
            flight_voltage_V=flight_V,
            hover_voltage_V=hover_V,
            flight_battery_J=self._full_J("flight_energy_J", flight_V),
            hover_battery_J=self._full_J("hover_energy_J", hover_V),
            available_fraction=take(battery.available_fraction),
            flow_rate_per_s=take(battery.flow_rate_per_s),
            hover_distance_m=take(np.sqrt((apart_m**2).sum(axis=-1))),
            coverage_radius_m=take(tables.coverage_radius_m),
            hover_altitude_m=take(hover_m[..., 2]),
            min_altitude_m=take(limits.min_altitude_m),
            max_altitude_m=take(limits.max_altitude_m),
            end_gap_m=end_gap_m,
            steps=steps,
            tapers=battery.charging == "taper",
            rests=rests,
        )

    def _rest(self) -> list[Quantity]:
        """Net current [A] and power [W] into the battery while resting, 0 without a building."""
        building = self.network.routes.building[self.itineraries]
        drawn = map(self.take, vehicle.rest_load(self.tables.mission))
        pairs = zip(self.tables.received, drawn, strict=True)
        return [
            np.where(building >= 0, self.take(table, FIRST_BUILDING + building) - flow, 0.0)
            for table, flow in pairs
        ]

    def _full_J(self, key: str, voltage_V: Quantity) -> Quantity | None:
        """What the full battery holds; computed if its size varies and its energy was stated."""
        battery = self.tables.mission.battery
        if (stated_J := getattr(battery, key)) is not None:
            return self.take(stated_J)
        if getattr(self.network.mission.battery, key) is None:
            return None
        return self.take(battery.packs) * self.take(battery.capacity_As) * voltage_V

    def steps(self, *, rests: bool, hover_open: bool = False) -> tuple[Stage | str, ...]:
        """The stages of the legs, and the stays by name; figures of a single pair are numbers."""
        table = self.network.legs
        found: list[Stage | str] = []
        for legs in self.network.routes.legs[self.itineraries].T:
            if (legs == NO_LEG).all():
                continue
            start, end = table.start[legs[0]], table.end[legs[0]]
            if hover_open and HOVER in (start, end):
                found.append(TO_HOVER if end == HOVER else FROM_HOVER)
            else:
                found += self._stages(legs)
            if end == HOVER:
                found.append("hover")
            elif end >= FIRST_BUILDING and rests:
                found.append("rest")
        return tuple(found)

    def _stages(self, legs: Integers) -> list[Stage]:
        """The stages that take any time on some of the legs."""
        every, found = np.zeros(len(legs)), []
        for durations_s, currents_A in self.tables.stages:
            duration_s = every + self.take(durations_s, legs)
            net_A = every - self.take(currents_A, legs)
            if len(legs) == 1:
                net_A, duration_s = float(net_A[0]), float(duration_s[0])
            if np.any(duration_s):
                found.append(Stage(net_A, duration_s))
        return found


def entries(given: Quantities, which: Any) -> Quantities:
    """Quantities of some of the itineraries, by their numbers or a slice."""

    def taken(values: Any) -> Any:
        return np.ravel(values)[which] if np.ndim(values) else values

    figures = {each.name: taken(getattr(given, each.name)) for each in QUANTITIES}
    steps = (s if isinstance(s, str) else Stage(*map(taken, s)) for s in given.steps)
    return replace(given, **figures, steps=tuple(steps))


def _end_gap_m(network: Network, which: Integers) -> Floats:
    """By how much routes miss the mission's origin and destination [m]."""
    mission, table = network.mission, network.legs
    position_m, legs = network.places.position_m, network.routes.legs[which]
    last = np.take_along_axis(legs, (legs != NO_LEG).sum(axis=1)[:, None] - 1, axis=1)[:, 0]
    start_m = position_m[table.start[legs[:, 0]]] - np.array(mission.route.origin_m)
    end_m = position_m[table.end[last]] - np.array(mission.route.destination_m)
    gap_m: Floats = np.linalg.norm(start_m, axis=1) + np.linalg.norm(end_m, axis=1)
    return gap_m


def _flown_stages(table: Legs, legs: Integers) -> list[int]:
    """Numbers of the stages that take any time on some of the legs."""
    return [int(stage) for stage in np.flatnonzero(table.durations_s[:, legs].any(axis=1))]


def step_ends(network: Network, which: Integers, entry: int, *, rests: bool = True) -> list[str]:
    """The ends of the steps of one itinerary, by the places of its route.

    Parameters
    ----------
    network, which, rests
        As for `quantities`.
    entry
        Place of the itinerary among them.
    """
    table, names = network.legs, network.places.names
    legs, found = network.routes.legs[which], list[str]()
    for here, leg in zip(legs.T, legs[entry].tolist(), strict=True):
        if leg == NO_LEG:
            continue
        end = int(table.end[leg])
        flight = f"the flight {names[table.start[leg]]} → {names[end]}"
        stages = _flown_stages(table, here)
        found += [f"after stage {stage + 1} ({STAGES[stage]}) of {flight}" for stage in stages[:-1]]
        found += [f"at the end of {flight}"] * (len(stages) > 0)
        if end == HOVER:
            found.append("after the hover")
        elif end >= FIRST_BUILDING and rests:
            found.append(f"after the rest at {names[end]}")
    return found


def _mean_voltage_V(energy: Quantity, charge: Quantity, nominal_V: Quantity) -> Quantity:
    """The voltage at which a load draws: energy over charge or power over current; nominal at 0."""
    drawn = np.asarray(charge) > 0.0
    return np.where(drawn, energy / np.where(drawn, charge, 1.0), nominal_V)[()]
