"""A graph that the user has edited read back: places, legs and itineraries with its figures."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from optuav.arrays import Booleans, Floats
from optuav.errors import Fault, InputError
from optuav.mission.graph import EDGE_FIGURES, SOURCE, node_name, validate_graph
from optuav.mission.itineraries import itineraries
from optuav.mission.legs import Legs
from optuav.mission.network import Network, network
from optuav.mission.places import ENDS, HOVER, Places
from optuav.mission.schema import Mission
from optuav.mission.words import shown

if TYPE_CHECKING:
    from optuav.mission.graph import Graph

ROUNDING = 1e-9
"""Relative; so far may a received power pass what the battery takes."""
SAME_PLACE_M = 1e-6
"""A place that is stated no further off [m] is where the mission has it."""


def edited_network(mission: Mission, view: Graph) -> Network:
    """Places, legs and itineraries of a mission as a graph that the user has edited has them.

    A missing edge forbids the leg; an edge with other figures becomes a leg of constant current,
    marked as edited; sight and received power are taken from the nodes.

    Raises
    ------
    InputError
        If the graph is out of order or does not belong to the mission.
    """
    computed = network(mission)
    faults = validate_graph(view) or (
        *_strangers(computed.places, view),
        *_overcharged(computed, view),
    )
    if faults:
        raise InputError(faults)
    where = _edited_places(computed, view)
    table = edited_legs(computed.legs, where.names, view)
    return Network(mission, where, table, itineraries(table, where))


def edited_legs(
    table: Legs, names: Sequence[str], view: Graph, needed: Booleans | None = None
) -> Legs:
    """A table of legs with the figures of the edges of a graph that is in order.

    Parameters
    ----------
    table
        Legs as computed.
    names
        Of the places.
    view
        The graph.
    needed
        Whether a leg without an edge is forbidden (leg,), all by default; the others stay as they
        were computed.
    """
    columns = {name: getattr(table, name).copy() for name in ("distance_m", "peak_speed_m_s")}
    stages = {
        name: getattr(table, name).copy() for name in ("durations_s", "currents_A", "powers_W")
    }
    flyable, edited = table.flyable.copy(), np.zeros_like(table.edited)
    flyable[slice(None) if needed is None else needed] = False
    figures = np.stack([getattr(table, name) for name in EDGE_FIGURES])
    number = {way: leg for leg, way in enumerate(zip(table.start, table.end, strict=True))}
    place = {name: k for k, name in enumerate(names)}
    for start, end, data in view.edges(data=True):
        leg = number.get((place[start], place[end]))
        if leg is None:
            continue
        flyable[leg] = True
        stated = [float(data[name]) for name in EDGE_FIGURES]
        if table.flyable[leg] and (figures[:, leg] == stated).all():
            continue
        edited[leg] = True
        duration_s, charge_As, energy_J, distance_m, peak_speed_m_s = stated
        columns["distance_m"][leg], columns["peak_speed_m_s"][leg] = distance_m, peak_speed_m_s
        for name, total in (("currents_A", charge_As), ("powers_W", energy_J)):
            stages[name][:, leg] = total / duration_s if duration_s > 0.0 else 0.0
        stages["durations_s"][:, leg] = 0.0
        stages["durations_s"][0, leg] = duration_s
    return replace(table, **columns, **stages, flyable=flyable, edited=edited)


def _strangers(where: Places, view: Graph) -> Iterator[Fault]:
    """What belongs to another mission: places that this one has not, or has elsewhere."""
    known: dict[object, Floats] = dict(zip(where.names, where.position_m, strict=True))
    for node, data in view.nodes(data=True):
        if node not in known:
            yield Fault(node_name(node), "", "the mission has no such place", SOURCE)
            continue
        position_m = [float(each) for each in data["position_m"]]
        if not (np.abs(position_m - known[node]) <= SAME_PLACE_M).all():
            by = "route.hover_m" if node == ENDS[HOVER] else "mission.replace"
            words = f"places are moved in the mission, by {by}"
            yield Fault(f"{node_name(node)}.position_m", shown(position_m), words, SOURCE)


def _overcharged(computed: Network, view: Graph) -> Iterator[Fault]:
    """Power at places that the battery would not take."""
    given = computed.mission.battery
    most_W = given.charge_current_A * given.nominal_voltage_V
    computed_W = dict(zip(computed.places.names, computed.places.received_power_W, strict=True))
    for node, data in view.nodes(data=True):
        power_W = float(data["received_power_W"]) if data["laser_sight"] else 0.0
        if power_W > max(most_W, computed_W.get(node, power_W)) * (1.0 + ROUNDING):
            words = f"at most {most_W:g} W charge at battery.charge_current_A"
            yield Fault(f"{node_name(node)}.received_power_W", shown(power_W), words, SOURCE)


def _edited_places(computed: Network, view: Graph) -> Places:
    where = computed.places
    sight, power, current = (
        where.laser_sight.copy(),
        where.received_power_W.copy(),
        where.charge_current_A.copy(),
    )
    for place, name in enumerate(where.names):
        if name not in view:
            sight[place], power[place], current[place] = False, 0.0, 0.0
            continue
        data = view.nodes[name]
        sight[place] = bool(data["laser_sight"])
        stated_W = float(data["received_power_W"]) if sight[place] else 0.0
        if stated_W != power[place]:
            power[place] = stated_W
            current[place] = stated_W / computed.mission.battery.nominal_voltage_V
    edited = (sight != where.laser_sight) | (power != where.received_power_W)
    return replace(
        where,
        laser_sight=sight,
        received_power_W=power,
        charge_current_A=current,
        edited=edited,
    )
