"""From the arrays of a mission to the quantities that formulations speak of."""

from __future__ import annotations

from typing import Any

import numpy as np

from formulations.parameters import FROM_HOVER, TO_HOVER, Quantities
from optuav.arrays import Floats, Integers
from optuav.network import vehicle
from optuav.network.legs import Legs
from optuav.network.network import Network
from optuav.network.places import FIRST_BUILDING, HOVER
from optuav.network.routes import NO_LEG
from optuav.network.timeline import hover_net, rest_net
from optuav.physics.flight import STAGES
from optuav.physics.kibam import Stage


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
        way are filled in where all stay in the same order.
    rests
        Whether a rest on the building may be chosen.
    hover_open
        Whether the legs to and from the hover point are named among the steps rather than stated.
    """
    mission, routes = network.mission, network.routes.take(which)
    given = mission.battery
    hover = vehicle.hover_load(mission)
    rest = rest_net(network, routes.building)
    resting = routes.building >= 0
    position_m = network.places.position_m
    hover_m, limits = position_m[HOVER], mission.limits
    return Quantities(
        deadline_s=mission.limits.deadline_s,
        min_soc=mission.limits.min_soc,
        packs=float(given.packs),
        capacity_As=given.capacity_As,
        nominal_voltage_V=given.nominal_voltage_V,
        flight_time_s=routes.flight_time_s,
        flight_charge_As=routes.flight_charge_As,
        flight_energy_J=routes.flight_energy_J,
        hover_current_A=-hover_net(network).current_A,
        hover_power_W=float(hover.power_W),
        hover_received_W=float(network.places.received_power_W[HOVER]),
        rest_current_A=np.where(resting, rest.current_A, 0.0),
        rest_received_W=np.where(resting, rest.power_W, 0.0),
        flight_voltage_V=mean_voltage_V(
            routes.flight_energy_J, routes.flight_charge_As, given.nominal_voltage_V
        ),
        hover_voltage_V=float(
            mean_voltage_V(hover.power_W, hover.current_A, given.nominal_voltage_V)
        ),
        flight_battery_J=given.flight_energy_J,
        hover_battery_J=given.hover_energy_J,
        available_fraction=given.available_fraction,
        flow_rate_per_s=given.flow_rate_per_s,
        hover_distance_m=float(np.linalg.norm(hover_m - np.array(mission.link.device_m))),
        coverage_radius_m=vehicle.coverage_radius_m(mission),
        hover_altitude_m=float(hover_m[2]),
        min_altitude_m=limits.min_altitude_m,
        max_altitude_m=limits.max_altitude_m,
        end_gap_m=_end_gap_m(network, which),
        steps=_steps(network, which, rests, hover_open),
        tapers=given.charging == "taper",
        rests=rests,
    )


def _end_gap_m(network: Network, which: Integers) -> Floats:
    """By how much routes miss the mission's origin and destination [m]."""
    mission, table = network.mission, network.legs
    position_m, legs = network.places.position_m, network.routes.legs[which]
    last = np.take_along_axis(legs, (legs != NO_LEG).sum(axis=1)[:, None] - 1, axis=1)[:, 0]
    start_m = position_m[table.start[legs[:, 0]]] - np.array(mission.route.origin_m)
    end_m = position_m[table.end[last]] - np.array(mission.route.destination_m)
    gap_m: Floats = np.linalg.norm(start_m, axis=1) + np.linalg.norm(end_m, axis=1)
    return gap_m


def _steps(
    network: Network, which: Integers, rests: bool, hover_open: bool
) -> tuple[Stage | str, ...]:
    """Stages of the legs as phases of constant current, and the stays by name.

    Figures are numbers for a single itinerary, else arrays with one entry each; none where the
    itineraries stay in different orders.
    """
    table, routes = network.legs, network.routes
    if len(np.unique(routes.rest_first[which])) > 1:
        return ()
    legs, first = routes.legs[which].T, routes.legs[which[0]]
    found: list[Stage | str] = []
    for leg, start, end in zip(
        legs, table.start[first].tolist(), table.end[first].tolist(), strict=True
    ):
        if (leg == NO_LEG).all():
            continue
        if hover_open and HOVER in (start, end):
            found.append(TO_HOVER if end == HOVER else FROM_HOVER)
        else:
            for stage in _stages(table, leg):
                current_A, duration_s = table.currents_A[stage, leg], table.durations_s[stage, leg]
                found.append(Stage(_figures(-current_A), _figures(duration_s)))
        if end == HOVER:
            found.append("hover")
        elif end >= FIRST_BUILDING and rests:
            found.append("rest")
    return tuple(found)


def _stages(table: Legs, legs: Integers) -> list[int]:
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
        stages = _stages(table, here)
        found += [f"after stage {stage + 1} ({STAGES[stage]}) of {flight}" for stage in stages[:-1]]
        found += [f"at the end of {flight}"] * (len(stages) > 0)
        if end == HOVER:
            found.append("after the hover")
        elif end >= FIRST_BUILDING and rests:
            found.append(f"after the rest at {names[end]}")
    return found


def _figures(values: Floats) -> Any:
    return values if len(values) > 1 else float(values[0])


def mean_voltage_V(energy: Any, charge: Any, nominal_V: Any) -> Floats:
    """The voltage at which a load draws: energy over charge or power over current; nominal at 0."""
    drawn = np.asarray(charge) > 0.0
    voltage_V: Floats = np.where(drawn, energy / np.where(drawn, charge, 1.0), nominal_V)
    return voltage_V
