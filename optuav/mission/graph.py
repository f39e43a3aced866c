"""The mission as a plain `networkx.DiGraph`, and an edited graph read back.

Nodes are ``"origin"``, ``"hover"``, ``"destination"`` and the names of the buildings, with

- ``kind``: ``"origin"``, ``"hover"``, ``"destination"`` or ``"building"``,
- ``position_m``: (x, y, z) [m],
- ``laser_sight``: whether the laser is in clear sight,
- ``received_power_W``: what the laser delivers there [W], 0 without sight.

An edge is a leg that an itinerary may use, with ``duration_s`` [s], ``charge_As`` [A s] and
``energy_J`` [J] drawn, ``distance_m`` [m] and ``peak_speed_m_s`` [m/s]. A leg that cannot be flown
or that crosses a building has no edge. Where nothing is in reach of the device there is no node
``"hover"``.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from numbers import Real
from typing import TYPE_CHECKING, Any

import numpy as np

from optuav.errors import Fault, InputError
from optuav.mission.itineraries import itineraries
from optuav.mission.network import Network, network
from optuav.mission.places import ENDS, Places
from optuav.mission.schema import Mission

if TYPE_CHECKING:
    import networkx

    Graph = networkx.DiGraph[str]

EDGE_FIGURES = ("duration_s", "charge_As", "energy_J", "distance_m", "peak_speed_m_s")
SOURCE = "graph"


def graph(mission: Mission) -> Graph:
    """The graph of a mission, see the module for its contract.

    Parameters
    ----------
    mission
        Any valid mission.
    """
    return as_graph(network(mission))


def as_graph(worked_out: Network) -> Graph:
    """The graph of a mission that was worked out already."""
    import networkx

    where, table = worked_out.places, worked_out.legs
    kinds = [*ENDS, *["building"] * len(where.buildings)]
    exists = np.asarray(np.isfinite(where.position_m).all(axis=1))
    view: Graph = networkx.DiGraph(name=worked_out.mission.name)
    view.add_nodes_from(
        (
            name,
            {
                "kind": kind,
                "position_m": tuple(position),
                "laser_sight": sight,
                "received_power_W": power,
            },
        )
        for name, kind, position, sight, power, known in zip(
            where.names,
            kinds,
            where.position_m.tolist(),
            where.laser_sight.tolist(),
            where.received_power_W.tolist(),
            exists,
            strict=True,
        )
        if known
    )
    figures = [getattr(table, name).tolist() for name in EDGE_FIGURES]
    view.add_edges_from(
        (where.names[start], where.names[end], dict(zip(EDGE_FIGURES, row, strict=True)))
        for start, end, flyable, *row in zip(
            table.start, table.end, table.flyable, *figures, strict=True
        )
        if flyable
    )
    return view


def validate_graph(view: Graph) -> tuple[Fault, ...]:
    """Everything wrong with a graph, by the contract of the module; empty if it is in order.

    Parameters
    ----------
    view
        A graph, perhaps edited by hand.
    """
    import networkx

    if not isinstance(view, networkx.DiGraph) or view.is_multigraph():
        return (Fault("", type(view).__name__, "a networkx.DiGraph is needed", SOURCE),)
    return tuple(_structure_faults(view)) + tuple(_node_faults(view)) + tuple(_edge_faults(view))


def _structure_faults(view: Graph) -> Iterator[Fault]:
    for end in ENDS:
        if end not in view:
            yield Fault(f"nodes[{end!r}]", "", "is missing", SOURCE)
    for loop in (node for node in view if view.has_edge(node, node)):
        yield Fault(f"edges[{loop!r}, {loop!r}]", "", "a leg leads to another place", SOURCE)


def _node_faults(view: Graph) -> Iterator[Fault]:
    for node, data in view.nodes(data=True):
        here = f"nodes[{node!r}]"
        kind = node if node in ENDS else "building"
        if data.get("kind") != kind:
            yield Fault(f"{here}.kind", repr(data.get("kind")), f"{kind!r} is expected", SOURCE)
        position = data.get("position_m")
        if not _is_position(position):
            yield Fault(
                f"{here}.position_m", repr(position), "three finite numbers [m] are needed", SOURCE
            )
        sight = data.get("laser_sight")
        if not isinstance(sight, bool | np.bool_):
            yield Fault(f"{here}.laser_sight", repr(sight), "True or False is needed", SOURCE)
        power = data.get("received_power_W")
        if not _is_amount(power):
            yield Fault(
                f"{here}.received_power_W", repr(power), "a number ≥ 0 [W] is needed", SOURCE
            )


def _edge_faults(view: Graph) -> Iterator[Fault]:
    for start, end, data in view.edges(data=True):
        here = f"edges[{start!r}, {end!r}]"
        faulty = [name for name in EDGE_FIGURES if not _is_amount(data.get(name))]
        for name in faulty:
            yield Fault(
                f"{here}.{name}", repr(data.get(name)), "a finite number ≥ 0 is needed", SOURCE
            )
        if not faulty and data["duration_s"] == 0.0 and (data["charge_As"] or data["energy_J"]):
            yield Fault(f"{here}.duration_s", "0", "a leg that draws charge takes time", SOURCE)


def _is_amount(value: Any) -> bool:
    return (
        isinstance(value, Real)
        and not isinstance(value, bool)
        and math.isfinite(value)
        and float(value) >= 0.0
    )


def _is_position(value: Any) -> bool:
    return (
        isinstance(value, tuple | list | np.ndarray)
        and len(value) == 3
        and all(isinstance(each, Real) and math.isfinite(each) for each in value)
    )


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
    faults = validate_graph(view) or tuple(_strangers(computed.places, view))
    if faults:
        raise InputError(faults)
    where = _edited_places(computed, view)
    table = computed.legs
    names = where.names
    columns = {name: getattr(table, name).copy() for name in ("distance_m", "peak_speed_m_s")}
    stages = {
        name: getattr(table, name).copy() for name in ("durations_s", "currents_A", "powers_W")
    }
    flyable, edited = np.zeros_like(table.flyable), np.zeros_like(table.edited)
    figures = np.stack([getattr(table, name) for name in EDGE_FIGURES])
    for leg, (start, end) in enumerate(zip(table.start, table.end, strict=True)):
        data = view.get_edge_data(names[start], names[end])
        if data is None:
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
    table = replace(table, **columns, **stages, flyable=flyable, edited=edited)
    return Network(mission, where, table, itineraries(table, where))


def _strangers(where: Places, view: Graph) -> Iterator[Fault]:
    known = dict(zip(where.names, where.position_m.tolist(), strict=True))
    for node, data in view.nodes(data=True):
        position = data["position_m"]
        if node not in known:
            yield Fault(f"nodes[{node!r}]", "", "the mission has no such place", SOURCE)
        elif node != "hover" and list(position) != known[node]:
            yield Fault(
                f"nodes[{node!r}].position_m",
                repr(tuple(position)),
                "places are moved in the mission, with mission.replace",
                SOURCE,
            )
        elif node == "hover" and not np.allclose(position, known[node], rtol=0.0, atol=1e-6):
            yield Fault(
                "nodes['hover'].position_m",
                repr(tuple(position)),
                "the hover point is moved in the mission, by route.hover_m",
                SOURCE,
            )


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
    return replace(where, laser_sight=sight, received_power_W=power, charge_current_A=current)
