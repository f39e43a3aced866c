"""The quantities that formulations use, from the arrays of a mission or of its variants."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import lru_cache, partial
from typing import Any

import numpy as np

from formulations.parameters import (
    FROM_HOVER,
    TO_HOVER,
    Covered,
    Hover,
    Landing,
    MissionFigure,
    Quantities,
)
from formulations.soc import STAYS
from optuav.arrays import Integers
from optuav.mission.keys import numeric_keys, stated_value
from optuav.network import vehicle
from optuav.network.legs import NO_LEG
from optuav.network.network import Network
from optuav.network.places import HOVER
from optuav.network.routes import totals
from optuav.network.variants import Variants, as_variants
from optuav.physics.kibam import Shift, Stage
from optuav.physics.quantity import Quantity


def quantities(
    source: Network | Variants,
    which: Integers,
    variant: Integers | None = None,
    *,
    rests: bool = True,
    steps: bool = True,
    hover_open: bool = False,
    shifts: Sequence[Shift] = (),
) -> Quantities:
    """Quantities of some itineraries, all direct or all by way of a building.

    Arrays have one entry per itinerary of a mission, or of numbered variants of it. The steps on
    the way are among them if all stay in the same order, and for the same shares: the stages of
    flight, or legs as a whole if `shifts` says what their stages do. Legs to and from an open hover
    point are named. So are the landings, if the mission wants its reserve there.
    """
    variants = as_variants(source) if isinstance(source, Network) else source
    one_order = _one_order(variants, which)
    way = tuple[Any, ...]()
    if steps and one_order:
        way = tuple(_steps(variants, which, variant, rests, hover_open, shifts))
    landings = tuple[Landing, ...]()
    if variants.mission.limits.keep_soc == "always" and one_order:
        landings = tuple(_landings(variants, which, variant, rests, way))
    changes: dict[str, Any] = {"steps": way, "landings": landings, "rests": rests}
    if variants.mission.devices:
        changes["covered"] = tuple(_covered(variants, which, variant))
        if way or landings:
            changes["hovers"] = tuple(_hovers(variants, which, variant))
    changes["numbers"] = partial(numbers, variants, which, variant)
    return select(route_quantities(variants), which, variant, **changes)


def _one_order(variants: Variants, which: Integers) -> bool:
    """Whether itineraries stay in the same order, and at the hover points for the same shares."""
    routes = variants.network.routes
    after = routes.rest_after[which]
    if not (after == after[:1]).all():
        return False
    shares = np.array([device.share for device in variants.mission.served])[routes.devices[which]]
    return bool((shares == shares[:1]).all())


def _hovers(variants: Variants, which: Integers, variant: Integers | None) -> Iterator[Hover]:
    """The hovers of itineraries over several devices, in flight order."""
    served, points = variants.mission.served, variants.network.places.hovers
    drawn_A = table_entries(variants.hover_load.current_A, variant, np.zeros(len(which), np.intp))
    for devices in variants.network.routes.devices[which].T:
        received_A, received_W = (
            table_entries(table, variant, points[devices]) for table in variants.received
        )
        share = served[int(devices[0])].share if len(devices) else 1.0
        yield Hover(share, drawn_A - received_A, received_W)


def _covered(variants: Variants, which: Integers, variant: Integers | None) -> Iterator[Covered]:
    """The hover points of several devices, in the mission's order."""
    of_points = variants.hover_distances_m, variants.hover_altitudes_m
    for number, device in enumerate(variants.mission.served):
        column = np.full(len(which), number)
        figures = (table_entries(table, variant, column) for table in of_points)
        yield Covered(device.name, *figures)


def numbers(
    variants: Variants, which: Integers, variant: Integers | None
) -> dict[str, MissionFigure]:
    """The mission's numbers by table and key, and the length and the places of itineraries."""
    named, network = dict[str, MissionFigure](), variants.network
    for name, allowed in numeric_keys().items():
        unit = "1" if allowed.unit == "-" else allowed.unit
        if (value := stated_value(variants.mission, name)) is not None:
            value = table_entries(value, variant, which)
        named[name.replace(".", "_", 1)] = MissionFigure(value, unit, name)
    flown_m = totals(variants.distance_m, network.routes.legs)
    named["flight_distance_m"] = MissionFigure(table_entries(flown_m, variant, which), "m")
    building = network.routes.building[which]
    stays = {} if variants.mission.devices else {"hover": np.full(len(which), HOVER)}
    stays |= {"rest": network.places.on(building)} if (building >= 0).all() else {}
    for stay, place in stays.items():
        for axis in range(3):
            at_m = table_entries(variants.position_m[..., axis], variant, place)
            named[f"{stay}_position_m[{axis}]"] = MissionFigure(at_m, "m")
    return named


def map_arrays(table: Quantities, take: Callable[[Any], Any], **changes: Any) -> Quantities:
    """The quantities with other arrays in place of their own; some changed."""
    arrays = {name: take(x) for name, x in vars(table).items() if isinstance(x, np.ndarray)}
    return replace(table, **arrays | changes)


def select(
    table: Quantities, which: Integers, variant: Integers | None = None, **changes: Any
) -> Quantities:
    """Quantities of some itineraries of some variants, from a table of all; some changed."""
    return map_arrays(table, lambda values: table_entries(values, variant, which), **changes)


def transpose(table: Quantities) -> Quantities:
    """The same tables with one row per route and one column per variant."""
    return map_arrays(table, np.transpose)


def subset(table: Quantities, which: Integers | slice | int) -> Quantities:
    """Quantities of some of the itineraries, with their steps."""

    def taken(values: Any) -> Any:
        if isinstance(values, Stage | Shift):
            return type(values)(*map(taken, values))
        if isinstance(values, list | tuple):
            return [*map(taken, values)]
        return values[which] if isinstance(values, np.ndarray) else values

    landings = [
        landing._replace(charge_As=taken(landing.charge_As), energy_J=taken(landing.energy_J))
        for landing in table.landings
    ]
    steps, hovers = taken(table.steps), [Hover(*map(taken, hover)) for hover in table.hovers]
    covered = [Covered(*map(taken, point)) for point in table.covered]
    return map_arrays(table, taken, steps=steps, landings=landings, hovers=hovers, covered=covered)


def table_entries(values: Quantity, variant: Integers | None, columns: Integers) -> Quantity:
    """Entries of a table of variants and their places, legs or routes; a number if all are one."""
    if not isinstance(values, np.ndarray):
        return float(values)
    if values.size == 1:
        return float(values.item())
    rows, across = values.shape
    if variant is None or rows == 1:
        return values[0].take(columns)
    if across == 1:
        return values[:, 0].take(variant)
    if not values.flags.c_contiguous:
        return values[variant, columns]
    return values.ravel().take(variant * across + columns)


def _steps(
    variants: Variants,
    which: Integers,
    variant: Integers | None,
    rests: bool,
    hover_open: bool,
    shifts: Sequence[Shift],
) -> Iterator[Stage | list[Shift] | str]:
    """The flights and the stays of itineraries that stay in the same order."""
    network = variants.network
    for legs, stay in legs_and_stays(network, which, rests):
        ends = network.legs.start[legs[0]], network.legs.end[legs[0]]
        if hover_open and HOVER in ends:
            yield TO_HOVER if ends[1] == HOVER else FROM_HOVER
        elif shifts:
            yield [Shift(*(table_entries(t, variant, legs) for t in shift)) for shift in shifts]
        else:
            none = np.zeros(len(legs))
            for stage in variants.stages:
                net_A, duration_s = (
                    none + table_entries(values, variant, legs) for values in stage
                )
                if duration_s.any():
                    net = net_A, duration_s
                    yield Stage(*(value.item() if len(legs) == 1 else value for value in net))
        if stay:
            yield stay


def _landings(
    variants: Variants,
    which: Integers,
    variant: Integers | None,
    rests: bool,
    way: Sequence[Any],
) -> Iterator[Landing]:
    """The ends of all legs but the last, of itineraries that stay in the same order."""
    charge_As: Quantity = 0.0
    energy_J: Quantity = 0.0
    stays = tuple[str, ...]()
    begun = [n for n, step in enumerate(way) if isinstance(step, str) and step in STAYS]
    *legs_before, _ = legs_and_stays(variants.network, which, rests)
    for legs, stay in legs_before:
        charge, energy = (table_entries(table, variant, legs) for table in variants.of_legs[1:])
        charge_As, energy_J = charge_As + charge, energy_J + energy
        if stay:
            yield Landing(charge_As, energy_J, stays, begun[len(stays)] - 1 if begun else -1)
            stays = (*stays, stay)


@lru_cache(maxsize=1)
def route_quantities(variants: Variants) -> Quantities:
    """Quantities of all itineraries without the steps on the way, as tables; the last are kept.

    Each is a number, or an array (variant or 1, route or 1).
    """
    battery, limits = variants.mission.battery, variants.mission.limits
    packs, capacity_As = battery.packs, battery.capacity_As
    building = variants.network.routes.building
    roof = variants.network.places.on(building)
    flight_s, flight_As, flight_J = variants.flight
    hover_A, hover_W = variants.hover_load
    voltages: dict[str, Quantity] = {}
    for load, drawn, drawn_J in ("flight", flight_As, flight_J), ("hover", hover_A, hover_W):
        draws = np.asarray(drawn) > 0.0
        nominal_V = battery.nominal_voltage_V
        mean_V = np.where(draws, drawn_J / np.where(draws, drawn, 1.0), nominal_V)[()]
        # The energy of the full battery if it is stated; variants without it have NaN.
        if (full_J := getattr(battery, f"{load}_energy_J")) is not None and np.isnan(full_J).any():
            full_J = np.where(np.isnan(full_J), packs * capacity_As * mean_V, full_J)
        voltages |= {f"{load}_voltage_V": mean_V, f"{load}_battery_J": full_J}
    places, served = variants.network.places, variants.mission.served
    received_A, received_W = (received[:, places.hovers] for received in variants.received)
    net_A, lit_W = (
        sum(device.share * table[:, [n]] for n, device in enumerate(served))
        for table in (hover_A - received_A, received_W)
    )
    resting = variants.mission.flight_model.rest()
    rest_A, rest_W = (
        np.where(building >= 0, table[:, roof] - drawn, 0.0)
        for table, drawn in zip(variants.received, resting, strict=True)
    )
    start, soc = variants.mission.start, None
    wells: tuple[Quantity | None, Quantity | None] = (None, None)
    if start is not None:
        if start.soc is not None and start.available_As is None and not np.isnan(start.soc).any():
            soc = start.soc
        elif start.soc is not None or start.available_As is not None:
            charge = vehicle.start(variants.mission).wells(variants.mission.pool)
            wells = np.atleast_2d(charge.available_As), np.atleast_2d(charge.bound_As)
    return Quantities(
        deadline_s=limits.deadline_s,
        min_soc=limits.min_soc,
        packs=1.0 * packs,
        capacity_As=capacity_As,
        nominal_voltage_V=battery.nominal_voltage_V,
        flight_time_s=flight_s,
        flight_charge_As=flight_As,
        flight_energy_J=flight_J,
        hover_current_A=net_A,
        hover_power_W=hover_W,
        hover_received_W=lit_W,
        rest_current_A=rest_A,
        rest_received_W=rest_W,
        **voltages,
        available_fraction=battery.available_fraction,
        flow_rate_per_s=battery.flow_rate_per_s,
        start_soc=soc,
        start_available_As=wells[0],
        start_bound_As=wells[1],
        hover_distance_m=variants.hover_distances_m.max(axis=1, keepdims=True),
        coverage_radius_m=np.atleast_2d(variants.coverage_radius_m),
        hover_altitude_m=variants.hover_altitudes_m.min(axis=1, keepdims=True),
        min_altitude_m=limits.min_altitude_m,
        max_altitude_m=limits.max_altitude_m,
        end_gap_m=np.zeros((1, len(building))),
        tapers=battery.charging == "taper",
    )


def legs_and_stays(
    network: Network, which: Integers, rests: bool
) -> Iterator[tuple[Integers, str]]:
    """The legs that itineraries fly, one after the other, each with the stay after it."""
    places = network.places
    for legs in network.routes.legs[which].T:
        if (legs != NO_LEG).any():
            end = int(network.legs.end[legs[0]])
            rest = "rest" if end >= places.first_building and rests else ""
            yield legs, "hover" if places.hovers_at(end) else rest
