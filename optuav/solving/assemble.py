"""The quantities that formulations speak of, from the arrays of a mission or of its variants."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

import numpy as np

from formulations.parameters import FROM_HOVER, TO_HOVER, Quantities
from optuav.arrays import Integers
from optuav.network import vehicle
from optuav.network.network import NO_LEG, Network
from optuav.network.places import FIRST_BUILDING, HOVER, as_points
from optuav.network.variants import Variants
from optuav.physics.flight import Loads
from optuav.physics.kibam import Stage
from optuav.physics.quantity import Quantity


@lru_cache(maxsize=1)
class _Single:
    """A mission as tables over a single variant, see `Variants`."""

    def __init__(self, network: Network) -> None:
        places, routes, legs = network.places, network.routes, network.legs
        self.network, self.mission = network, network.mission
        self.position_m = places.position_m[None]
        self.coverage_radius_m = vehicle.coverage_radius_m(network.mission)
        self.received = vehicle.Flow(places.charge_current_A[None], places.received_power_W[None])
        self.hover_load = vehicle.hover_load(network.mission)
        totals = routes.flight_time_s, routes.flight_charge_As, routes.flight_energy_J
        self.flight = [each[None] for each in totals]
        drawn = legs.durations_s, legs.currents_A, legs.powers_W
        self.loads = Loads(*(tuple(table[:, None]) for table in drawn))


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

    Arrays have one entry an itinerary, of a mission or of numbered variants of it. The steps on the
    way are among them where all stay in the same order; legs to and from an open hover point are
    named.
    """
    tables = _Single(source) if isinstance(source, Network) else source
    network, battery, limits = tables.network, tables.mission.battery, tables.mission.limits
    routes = network.routes

    def take(values: Quantity, columns: Integers | None = None) -> Quantity:
        """Entries of a table of its variants and its places, legs or routes."""
        if isinstance(values, float):
            return float(values)
        table = np.atleast_2d(values)
        if table.shape == (1, 1):
            return float(table[0, 0])
        several = columns is not None and table.shape[1] > 1
        return table[variant if len(table) > 1 else 0, columns if several else 0]

    building, packs, capacity_As = routes.building[which], battery.packs, battery.capacity_As
    packs, capacity_As, nominal_V = map(take, (packs, capacity_As, battery.nominal_voltage_V))
    flight_s, flight_As, flight_J = (take(each, which) for each in tables.flight)
    hover_A, hover_W = map(take, tables.hover_load)
    voltages: dict[str, Quantity] = {}
    for load, drawn, given in ("flight", flight_As, flight_J), ("hover", hover_A, hover_W):
        draws = np.asarray(drawn) > 0.0
        mean_V = np.where(draws, given / np.where(draws, drawn, 1.0), nominal_V)[()]
        # What the full battery holds where that is stated; computed where its size varies.
        key, full_J = f"{load}_energy_J", None
        if getattr(network.mission.battery, key) is not None:
            stated_J = getattr(battery, key)
            full_J = packs * capacity_As * mean_V if stated_J is None else take(stated_J)
        voltages |= {f"{load}_voltage_V": mean_V, f"{load}_battery_J": full_J}
    received_A, received_W = (take(each[:, [HOVER]]) for each in tables.received)
    rest_A, rest_W = (
        np.where(building >= 0, take(table, FIRST_BUILDING + building) - take(drawn), 0.0)
        for table, drawn in zip(tables.received, vehicle.rest_load(tables.mission), strict=True)
    )
    hover_m = tables.position_m[:, [HOVER]]
    apart_m = hover_m - as_points(tables.mission.link.device_m)
    on_the_way, first = list[Stage | str](), routes.rest_first[which]
    alike = steps and (first.all() or not first.any())
    for legs, stay in legs_and_stays(network, which, rests) if alike else ():
        ends = network.legs.start[legs[0]], network.legs.end[legs[0]]
        if hover_open and HOVER in ends:
            on_the_way.append(TO_HOVER if ends[1] == HOVER else FROM_HOVER)
        else:
            for durations_s, currents_A in zip(*tables.loads[:2], strict=True):
                duration_s = np.zeros(len(legs)) + take(durations_s, legs)
                if duration_s.any():
                    net = np.zeros(len(legs)) - take(currents_A, legs), duration_s
                    on_the_way.append(
                        Stage(*(each.item() if len(legs) == 1 else each for each in net))
                    )
        if stay:
            on_the_way.append(stay)
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
        steps=tuple(on_the_way),
        tapers=battery.charging == "taper",
        rests=rests,
    )


def legs_and_stays(
    network: Network, which: Integers, rests: bool
) -> Iterator[tuple[Integers, str]]:
    """The legs that itineraries fly, one after the other, each with the stay behind it."""
    for legs in network.routes.legs[which].T:
        if (legs != NO_LEG).any():
            end = network.legs.end[legs[0]]
            rest = "rest" if end >= FIRST_BUILDING and rests else ""
            yield legs, "hover" if end == HOVER else rest
