"""The quantities that formulations use, from the arrays of a mission or of its variants."""

from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property, lru_cache, partial
from typing import Any

import numpy as np

from formulations.parameters import FROM_HOVER, QUANTITIES, TO_HOVER, Quantities
from optuav.arrays import Floats, Integers
from optuav.network import vehicle
from optuav.network.legs import NO_LEG
from optuav.network.network import Network
from optuav.network.places import FIRST_BUILDING, HOVER, as_points
from optuav.network.variants import Variants
from optuav.physics.kibam import Stage
from optuav.physics.quantity import Quantity


class _Single:
    """A mission as tables over a single variant, see `Variants`."""

    def __init__(self, network: Network) -> None:
        places, routes = network.places, network.routes
        self.network, self.mission = network, network.mission
        self.position_m = places.position_m[None]
        self.coverage_radius_m = vehicle.coverage_radius_m(network.mission)
        self.received = vehicle.Flow(places.charge_current_A[None], places.received_power_W[None])
        self.hover_load = vehicle.hover_load(network.mission)
        totals = routes.flight_time_s, routes.flight_charge_As, routes.flight_energy_J
        self.flight = [each[None] for each in totals]

    @cached_property
    def figures(self) -> Quantities:
        """The quantities of all itineraries, without the steps on the way."""
        return _figures(self, np.arange(len(self.network.routes)))


_single = lru_cache(maxsize=1)(_Single)


def quantities(
    source: Network | Variants,
    which: Integers,
    variant: Integers | None = None,
    *,
    rests: bool = True,
    steps: bool = True,
    hover_open: bool = False,
) -> Quantities:
    """Quantities of some itineraries, all direct or all by way of a building.

    Arrays have one entry an itinerary, of a mission or of numbered variants. The steps on the way
    are included where all stay in the same order; legs to and from an open hover point are named.
    """
    tables = _single(source) if isinstance(source, Network) else source
    first = tables.network.routes.rest_first[which]
    alike = steps and (first.all() or not first.any())
    way = tuple(_steps(tables, which, variant, rests, hover_open)) if alike else ()
    if isinstance(tables, _Single):
        return entries(tables.figures, which, steps=way, rests=rests)
    return replace(_figures(tables, which, variant), steps=way, rests=rests)


def entries(given: Quantities, which: Integers | slice, **changes: Any) -> Quantities:
    """Quantities of some of the itineraries, some of them changed."""
    figures = {each.name: getattr(given, each.name) for each in QUANTITIES}
    figures = {name: value[which] if np.ndim(value) else value for name, value in figures.items()}
    steps = tuple(
        step if isinstance(step, str) else Stage(*(x[which] if np.ndim(x) else x for x in step))
        for step in given.steps
    )
    return replace(given, **{**figures, "steps": steps, **changes})


def _taken(values: Quantity, variant: Integers | None, columns: Integers | None = None) -> Quantity:
    """Entries of a table of variants and their places, legs or routes."""
    if isinstance(values, float):
        return float(values)
    table = np.atleast_2d(values)
    if table.shape == (1, 1):
        return float(table[0, 0])
    several = columns is not None and table.shape[1] > 1
    return table[variant if len(table) > 1 else 0, columns if several else 0]


def _steps(
    tables: _Single | Variants,
    which: Integers,
    variant: Integers | None,
    rests: bool,
    hover_open: bool,
) -> Iterator[Stage | str]:
    """The stages of flight and the stays of itineraries that stay in the same order."""
    network = tables.network
    for legs, stay in legs_and_stays(network, which, rests):
        ends = network.legs.start[legs[0]], network.legs.end[legs[0]]
        if hover_open and HOVER in ends:
            yield TO_HOVER if ends[1] == HOVER else FROM_HOVER
        else:
            for duration_s, current_A in _stages(tables, legs, variant):
                if duration_s.any():
                    net = 0.0 - current_A, duration_s
                    yield Stage(*(each.item() if len(legs) == 1 else each for each in net))
        if stay:
            yield stay


def _stages(
    tables: _Single | Variants, legs: Integers, variant: Integers | None
) -> Iterator[tuple[Floats, Floats]]:
    """Duration [s] and current [A] of each stage of legs, one of each itinerary."""
    if isinstance(tables, _Single):
        table = tables.network.legs
        return zip(table.durations_s[:, legs], table.currents_A[:, legs], strict=True)
    none = np.zeros(len(legs))
    pairs = zip(*tables.loads[:2], strict=True)
    return ((none + _taken(t, variant, legs), none + _taken(i, variant, legs)) for t, i in pairs)


def _figures(
    tables: _Single | Variants, which: Integers, variant: Integers | None = None
) -> Quantities:
    """Quantities of some itineraries without the steps on the way."""
    battery, limits, routes = tables.mission.battery, tables.mission.limits, tables.network.routes
    take = partial(_taken, variant=variant)
    building, packs, capacity_As = routes.building[which], battery.packs, battery.capacity_As
    packs, capacity_As, nominal_V = map(take, (packs, capacity_As, battery.nominal_voltage_V))
    flight_s, flight_As, flight_J = (take(each, columns=which) for each in tables.flight)
    hover_A, hover_W = map(take, tables.hover_load)
    voltages: dict[str, Quantity] = {}
    for load, drawn, given in ("flight", flight_As, flight_J), ("hover", hover_A, hover_W):
        draws = np.asarray(drawn) > 0.0
        mean_V = np.where(draws, given / np.where(draws, drawn, 1.0), nominal_V)[()]
        # What the full battery holds where that is stated; computed where its size varies.
        key, full_J = f"{load}_energy_J", None
        if getattr(tables.network.mission.battery, key) is not None:
            stated_J = getattr(battery, key)
            full_J = packs * capacity_As * mean_V if stated_J is None else take(stated_J)
        voltages |= {f"{load}_voltage_V": mean_V, f"{load}_battery_J": full_J}
    received_A, received_W = (take(each[:, [HOVER]]) for each in tables.received)
    rest_A, rest_W = (
        np.where(building >= 0, take(table, columns=FIRST_BUILDING + building) - take(drawn), 0.0)
        for table, drawn in zip(tables.received, vehicle.rest_load(tables.mission), strict=True)
    )
    hover_m = tables.position_m[:, [HOVER]]
    apart_m = hover_m - as_points(tables.mission.link.device_m)
    return Quantities(
        deadline_s=take(limits.deadline_s),
        min_soc=take(limits.min_soc),
        packs=packs,
        capacity_As=capacity_As,
        nominal_voltage_V=nominal_V,
        flight_time_s=flight_s,
        flight_charge_As=flight_As,
        flight_energy_J=flight_J,
        hover_current_A=hover_A - received_A,
        hover_power_W=hover_W,
        hover_received_W=received_W,
        rest_current_A=rest_A,
        rest_received_W=rest_W,
        **voltages,
        available_fraction=take(battery.available_fraction),
        flow_rate_per_s=take(battery.flow_rate_per_s),
        hover_distance_m=take(np.sqrt((apart_m**2).sum(axis=-1))),
        coverage_radius_m=take(tables.coverage_radius_m),
        hover_altitude_m=take(hover_m[..., 2]),
        min_altitude_m=take(limits.min_altitude_m),
        max_altitude_m=take(limits.max_altitude_m),
        end_gap_m=np.zeros(len(which)),
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
