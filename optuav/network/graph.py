"""The mission as a plain `networkx.DiGraph`, and whether an edited graph is in order.

Nodes are ``"origin"``, ``"hover"``, ``"destination"`` and the names of the buildings, with

- ``kind``: ``"origin"``, ``"hover"``, ``"destination"`` or ``"building"``,
- ``position_m``: (x, y, z) [m],
- ``laser_sight``: whether the laser is in clear sight,
- ``received_power_W``: what the laser delivers there [W], 0 without sight.

An edge is a leg that an itinerary may use, with ``duration_s`` [s], ``charge_As`` [A s] and
``energy_J`` [J] drawn, ``distance_m`` [m] and ``peak_speed_m_s`` [m/s]. A leg that cannot be flown
or that crosses a building has no edge. Where nothing is in reach of the device there is no node
``"hover"``. Nodes of buildings and edges may be taken away, edges added and figures changed.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from numbers import Real
from typing import TYPE_CHECKING, Any

import numpy as np

from optuav.arrays import Booleans, Floats
from optuav.errors import Fault, InputError
from optuav.mission.schema import Mission
from optuav.mission.words import shown
from optuav.network.legs import Legs
from optuav.network.network import Network, build_network
from optuav.network.places import DESTINATION, ENDS, HOVER, ORIGIN, Places
from optuav.network.routes import itineraries

if TYPE_CHECKING:
    import networkx

    Graph = networkx.DiGraph[str]

EDGE_FIGURES = ("duration_s", "charge_As", "energy_J", "distance_m", "peak_speed_m_s")
SOURCE = "graph"
LARGEST = 1e100
"""Largest number that a graph may state, so that sums and products stay finite."""


def graph(mission: Mission) -> Graph:
    """The graph of a mission, see the module for its contract.

    Parameters
    ----------
    mission
        Any valid mission.

    Returns
    -------
    networkx.DiGraph
        A graph of its own, which may be edited and handed to `optuav.solve`.
    """
    return as_graph(build_network(mission))


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

    Returns
    -------
    tuple of Fault
        By node and edge, with their attributes as keys.
    """
    import networkx

    if not isinstance(view, networkx.DiGraph) or view.is_multigraph():
        return (Fault(SOURCE, type(view).__name__, "a networkx.DiGraph is needed"),)
    return tuple(_structure_faults(view)) + tuple(_node_faults(view)) + tuple(_edge_faults(view))


def _structure_faults(view: Graph) -> Iterator[Fault]:
    for end in (ENDS[ORIGIN], ENDS[DESTINATION]):
        if end not in view:
            yield Fault(node_name(end), "", "is missing", SOURCE)
    for loop in (node for node in view if view.has_edge(node, node)):
        yield Fault(edge_name(loop, loop), "", "a leg leads to another place", SOURCE)


def _node_faults(view: Graph) -> Iterator[Fault]:
    for node, data in view.nodes(data=True):
        kind = node if node in ENDS else "building"
        expected = {
            "kind": (_is_text(data.get("kind"), kind), f"{kind!r} is expected"),
            "position_m": (
                _is_position(data.get("position_m")),
                "three finite numbers [m] are needed",
            ),
            "laser_sight": (
                isinstance(data.get("laser_sight"), bool | np.bool_),
                "True or False is needed",
            ),
            "received_power_W": (
                _is_amount(data.get("received_power_W")),
                "a number ≥ 0 [W] is needed",
            ),
        }
        for name, (is_right, words) in expected.items():
            if not is_right:
                yield Fault(f"{node_name(node)}.{name}", shown(data.get(name)), words, SOURCE)


def _edge_faults(view: Graph) -> Iterator[Fault]:
    for start, end, data in view.edges(data=True):
        here = edge_name(start, end)
        faulty = [name for name in EDGE_FIGURES if not _is_amount(data.get(name))]
        for name in faulty:
            words = "a finite number ≥ 0 is needed"
            yield Fault(f"{here}.{name}", shown(data.get(name)), words, SOURCE)
        if faulty:
            continue
        duration_s, drawn = _number(data["duration_s"]), (data["charge_As"], data["energy_J"])
        if max(map(_number, drawn)) > LARGEST * duration_s:
            words = "a leg that draws charge takes time"
            yield Fault(f"{here}.duration_s", shown(duration_s), words, SOURCE)


def node_name(node: object) -> str:
    """A node, as faults call it."""
    return f"nodes[{shown(node)}]"


def edge_name(start: object, end: object) -> str:
    """An edge, as faults call it."""
    return f"edges[{shown(start)}, {shown(end)}]"


def _is_text(value: Any, text: str) -> bool:
    return isinstance(value, str) and value == text


def _number(value: Any) -> float:
    """A real number as a float, NaN for anything else."""
    if not isinstance(value, Real) or isinstance(value, bool):
        return math.nan
    try:
        return float(value)
    except OverflowError:
        return math.inf


def _is_amount(value: Any) -> bool:
    return 0.0 <= _number(value) <= LARGEST


def _is_position(value: Any) -> bool:
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if not isinstance(value, tuple | list) or len(value) != 3:
        return False
    return all(abs(_number(each)) <= LARGEST for each in value)


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
    computed = build_network(mission)
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
