"""The quantities that formulations use, from the arrays of a mission or of its variants."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from typing import Any

import numpy as np

from formulations.parameters import FROM_HOVER, QUANTITIES, TO_HOVER, Number, Quantities
from optuav.arrays import Floats, Integers
from optuav.mission import Mission
from optuav.mission.flight_model import flight_of
from optuav.mission.keys import numeric_keys, stated_keys
from optuav.network import vehicle
from optuav.network.legs import NO_LEG
from optuav.network.network import Network
from optuav.network.places import FIRST_BUILDING, HOVER, as_points
from optuav.network.variants import Variants
from optuav.physics.flight import Flow
from optuav.physics.kibam import Shift, Stage, shift
from optuav.physics.quantity import Quantity


@dataclass(frozen=True, eq=False)
class Single:
    """A mission as tables over a single variant, see `Variants`."""

    network: Network
    mission: Mission
    position_m: Floats
    coverage_radius_m: Quantity
    received: Flow
    hover_load: Flow
    flight: Sequence[Floats]
    stages: list[Stage]  # Of the legs, each (1, leg)

    @property
    def shifts(self) -> list[Shift]:
        """What the stages of the legs do to the charge of all packs, each (1, leg)."""
        pool = vehicle.pool(self.mission)
        return [shift(pool, each) for each in self.stages]


@lru_cache(maxsize=1)
def single(network: Network) -> tuple[Single, Quantities]:
    """A mission as tables, with its figures."""
    places, routes, legs, mission = network.places, network.routes, network.legs, network.mission
    totals = routes.flight_time_s, routes.flight_charge_As, routes.flight_energy_J
    tables = Single(
        network,
        mission,
        places.position_m[None],
        vehicle.coverage_radius_m(mission),
        Flow(places.charge_current_A[None], places.received_power_W[None]),
        vehicle.hover_load(mission),
        [each[None] for each in totals],
        [*map(Stage, 0.0 - legs.currents_A[:, None], legs.durations_s[:, None])],
    )
    return tables, figures(tables)


def quantities(
    source: Network | Variants,
    which: Integers,
    variant: Integers | None = None,
    *,
    rests: bool = True,
    steps: bool = True,
    hover_open: bool = False,
    known: Quantities | None = None,
    shifts: Sequence[Shift] = (),
) -> Quantities:
    """Quantities of some itineraries, all direct or all by way of a building.

    Arrays have one entry an itinerary, of a mission or of numbered variants of it, whose `figures`
    may be known. The steps on the way are among them where all stay in the same order: the stages
    of flight, or legs as a whole if what their stages do is given; legs to and from an open
    hover point are named.
    """
    tables: Single | Variants
    if isinstance(source, Network):
        tables, table = single(source)
    else:
        tables, table = source, known or figures(source)
    first = tables.network.routes.rest_first[which]
    alike = steps and (first.all() or not first.any())
    way = tuple(_steps(tables, which, variant, rests, hover_open, shifts)) if alike else ()
    others = partial(numbers, tables, which, variant)
    return chosen(table, which, variant, steps=way, rests=rests, numbers=others)


def numbers(
    tables: Single | Variants, which: Integers, variant: Integers | None
) -> dict[str, Number]:
    """The mission's numbers by table and key, and the length and the places of itineraries."""
    found, network = dict[str, Number](), tables.network
    stated = stated_keys(tables.mission)
    for name, allowed in numeric_keys().items():
        unit = "1" if allowed.unit == "-" else allowed.unit
        value = table_entries(stated[name].now, variant, which) if name in stated else None
        found[name.replace(".", "_", 1)] = Number(value, unit, name)

    def positions_m(place: Integers) -> Floats:
        axes = (table_entries(tables.position_m[..., axis], variant, place) for axis in range(3))
        return np.array([*axes])

    flown_m, legs = np.zeros(len(which)), network.legs
    for leg in network.routes.legs[which].T:
        way_m = positions_m(legs.end[leg]) - positions_m(legs.start[leg])
        flown_m += np.where(leg == NO_LEG, 0.0, np.sqrt((way_m**2).sum(axis=0)))
    found["flight_distance_m"] = Number(flown_m, "m")
    building = network.routes.building[which]
    stays = {"hover": np.full(len(which), HOVER)}
    stays |= {"rest": FIRST_BUILDING + building} if (building >= 0).all() else {}
    for stay, place in stays.items():
        for axis, at_m in enumerate(positions_m(place)):
            found[f"{stay}_position_m[{axis}]"] = Number(at_m, "m")
    return found


def chosen(
    table: Quantities, which: Integers, variant: Integers | None = None, **changes: Any
) -> Quantities:
    """Quantities of some itineraries of some variants, from a table of all; some changed."""
    taken = {each.name: getattr(table, each.name) for each in QUANTITIES}
    for name, values in taken.items():
        taken[name] = values if values is None else table_entries(values, variant, which)
    return replace(table, **{**taken, **changes})


def turned(table: Quantities) -> Quantities:
    """The same tables with one row a route and one column a variant."""
    named = {each.name: getattr(table, each.name) for each in QUANTITIES}
    return replace(table, **{name: v.T if np.ndim(v) else v for name, v in named.items()})


def entries(given: Quantities, which: Integers | slice, **changes: Any) -> Quantities:
    """Quantities of some of the itineraries, some of them changed."""

    def taken(values: Any) -> Any:
        if isinstance(values, Stage | Shift):
            return type(values)(*map(taken, values))
        if isinstance(values, list | tuple):
            return [*map(taken, values)]
        return values[which] if np.ndim(values) else values

    figures = {each.name: taken(getattr(given, each.name)) for each in QUANTITIES}
    return replace(given, **{**figures, "steps": taken(given.steps), **changes})


def table_entries(values: Quantity, variant: Integers | None, columns: Integers) -> Quantity:
    """Entries of a table of variants and their places, legs or routes; a number if all are one."""
    if isinstance(values, float):
        return float(values)
    table = np.atleast_2d(values)
    if table.shape == (1, 1):
        return float(table[0, 0])
    rows, across = table.shape
    if variant is None or rows == 1:
        return table[0].take(columns) if across > 1 else table[0, 0]
    if across == 1:
        return table[:, 0].take(variant)
    if not table.flags.c_contiguous:
        return table[variant, columns]
    return table.ravel().take(variant * across + columns)


def _steps(
    tables: Single | Variants,
    which: Integers,
    variant: Integers | None,
    rests: bool,
    hover_open: bool,
    shifts: Sequence[Shift],
) -> Iterator[Stage | list[Shift] | str]:
    """The flights and the stays of itineraries that stay in the same order."""
    network = tables.network
    for legs, stay in legs_and_stays(network, which, rests):
        ends = network.legs.start[legs[0]], network.legs.end[legs[0]]
        if hover_open and HOVER in ends:
            yield TO_HOVER if ends[1] == HOVER else FROM_HOVER
        elif shifts:
            yield [Shift(*(table_entries(t, variant, legs) for t in each)) for each in shifts]
        else:
            none = np.zeros(len(legs))
            for stage in tables.stages:
                net_A, duration_s = (none + table_entries(each, variant, legs) for each in stage)
                if duration_s.any():
                    net = net_A, duration_s
                    yield Stage(*(each.item() if len(legs) == 1 else each for each in net))
        if stay:
            yield stay


def figures(tables: Single | Variants) -> Quantities:
    """Quantities of all itineraries without the steps on the way, as tables.

    Each is a number, or an array (variant or 1, route or 1).
    """
    battery, limits, routes = tables.mission.battery, tables.mission.limits, tables.network.routes
    building, packs, capacity_As = routes.building, battery.packs, battery.capacity_As
    flight_s, flight_As, flight_J = tables.flight
    hover_A, hover_W = tables.hover_load
    voltages: dict[str, Quantity] = {}
    for load, drawn, given in ("flight", flight_As, flight_J), ("hover", hover_A, hover_W):
        draws = np.asarray(drawn) > 0.0
        mean_V = np.where(draws, given / np.where(draws, drawn, 1.0), battery.nominal_voltage_V)[()]
        # What the full battery holds where that is stated; computed where its size varies, and
        # of variants with NaN.
        key, full_J = f"{load}_energy_J", None
        if getattr(tables.network.mission.battery, key) is not None:
            stated_J = getattr(battery, key)
            full_J = packs * capacity_As * mean_V if stated_J is None else stated_J
            if np.isnan(full_J).any():
                full_J = np.where(np.isnan(full_J), packs * capacity_As * mean_V, full_J)
        voltages |= {f"{load}_voltage_V": mean_V, f"{load}_battery_J": full_J}
    received_A, received_W = (each[:, [HOVER]] for each in tables.received)
    rest_A, rest_W = (
        np.where(building >= 0, table[:, FIRST_BUILDING + building] - drawn, 0.0)
        for table, drawn in zip(tables.received, flight_of(tables.mission).rest(), strict=True)
    )
    hover_m = tables.position_m[:, [HOVER]]
    apart_m = hover_m - as_points(tables.mission.link.device_m)
    return Quantities(
        deadline_s=limits.deadline_s,
        min_soc=limits.min_soc,
        packs=packs,
        capacity_As=capacity_As,
        nominal_voltage_V=battery.nominal_voltage_V,
        flight_time_s=flight_s,
        flight_charge_As=flight_As,
        flight_energy_J=flight_J,
        hover_current_A=hover_A - received_A,
        hover_power_W=hover_W,
        hover_received_W=received_W,
        rest_current_A=rest_A,
        rest_received_W=rest_W,
        **voltages,
        available_fraction=battery.available_fraction,
        flow_rate_per_s=battery.flow_rate_per_s,
        hover_distance_m=np.sqrt((apart_m**2).sum(axis=-1)),
        coverage_radius_m=tables.coverage_radius_m,
        hover_altitude_m=hover_m[..., 2],
        min_altitude_m=limits.min_altitude_m,
        max_altitude_m=limits.max_altitude_m,
        end_gap_m=np.zeros((1, len(building))),
        tapers=battery.charging == "taper",
    )


def legs_and_stays(
    network: Network, which: Integers, rests: bool
) -> Iterator[tuple[Integers, str]]:
    """The legs that itineraries fly, one after the other, each with the stay after it."""
    for legs in network.routes.legs[which].T:
        if (legs != NO_LEG).any():
            end = network.legs.end[legs[0]]
            rest = "rest" if end >= FIRST_BUILDING and rests else ""
            yield legs, "hover" if end == HOVER else rest
