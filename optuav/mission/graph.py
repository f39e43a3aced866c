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
from collections.abc import Iterator
from numbers import Real
from typing import TYPE_CHECKING, Any

import numpy as np

from optuav.errors import Fault
from optuav.mission.network import Network, network
from optuav.mission.places import DESTINATION, ENDS, ORIGIN
from optuav.mission.schema import Mission
from optuav.mission.words import shown

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
