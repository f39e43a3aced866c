"""The network as a plain `networkx.DiGraph`: built, checked, and read back once edited."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from numbers import Real
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from optuav.arrays import Booleans
from optuav.errors import Fault, refuse
from optuav.fields import LARGEST
from optuav.mission import Mission, load
from optuav.mission.messages import shown
from optuav.mission.validation import WHOLE_SHARE
from optuav.network import vehicle
from optuav.network.legs import Legs
from optuav.network.network import Network, build_network
from optuav.network.places import DESTINATION, ENDS, ORIGIN
from optuav.network.routes import build_routes
from optuav.presentation.numbers import figure

if TYPE_CHECKING:
    import networkx

Graph: TypeAlias = "networkx.DiGraph[str]"

EDGE_FIGURES = ("duration_s", "charge_As", "energy_J", "distance_m", "peak_speed_m_s")
SOURCE = "graph"
ROUNDED_POWER = 1e-9  # Relative; a received power may exceed the battery's limit by this much
SAME_PLACE_M = 1e-6  # A position that is off by no more than this [m] is the mission's


def graph(mission: Mission | str | Path) -> Graph:
    """Return the network of a mission as a graph that you can edit.

    Nodes are ``"origin"``, ``"hover"``, ``"destination"`` and the names of the buildings. With
    several devices the hover point of each is a node of its name instead of ``"hover"``, and has
    its ``device`` and ``share`` too. All nodes have

    - ``kind``: ``"origin"``, ``"hover"``, ``"destination"`` or ``"building"``,
    - ``position_m``: (x, y, z) [m],
    - ``laser_sight``: whether the laser is in clear sight,
    - ``received_power_W``: power from the laser there [W], 0 without sight.

    An edge is a leg that a route may use, with ``duration_s`` [s], ``charge_As`` [A s] and
    ``energy_J`` [J] drawn, ``distance_m`` [m] and ``peak_speed_m_s`` [m/s]. A leg that cannot be
    flown or that crosses a building has no edge. If nothing is in reach of the device, there is no
    node ``"hover"``. You may remove nodes of buildings and edges, add edges and change figures;
    `validate_graph` checks the result.

    Legs come from the mission's flight model; the received power is
    P_0 = a1 a2 ν P_s + a2 b1 ν + b2 with ν = exp(−α d), up to the battery's limit ([1]_ eqs (10)
    and (14)).

    Parameters
    ----------
    mission
        A mission, the name of a shipped one, or the path of a mission file.

    Returns
    -------
    networkx.DiGraph
        A new graph, which you may edit and pass to `optuav.solve`.

    References
    ----------
    .. [1] W. Jaafar, H. Yanikomeroglu, "Dynamics of laser-charged UAVs: a battery perspective",
       IEEE Internet of Things Journal, 2021.

    Examples
    --------
    >>> import optuav
    >>> graph = optuav.graph("paper")
    >>> len(graph), graph.number_of_edges()
    (13, 42)
    >>> round(graph.edges["origin", "hover"]["duration_s"], 2)
    37.9
    >>> graph.remove_edge("origin", "hover")
    """
    return as_graph(build_network(load(mission)))


def as_graph(network: Network) -> Graph:
    """Return the graph of a network; see `graph`."""
    from optuav.network.display import MissionGraph

    places, legs = network.places, network.legs
    view: Graph = MissionGraph(name=network.mission.name)
    served = dict(zip(places.hovers.tolist(), network.mission.served, strict=True))
    in_order = [ORIGIN, *served, DESTINATION, *places.buildings.tolist()]
    for place in (place for place in in_order if places.exists[place]):
        of_device = {}
        if network.mission.devices and (device := served.get(place)):
            of_device = {"device": device.name, "share": device.share}
        view.add_node(
            places.names[place],
            kind=places.kind(place),
            position_m=tuple(places.position_m[place].tolist()),
            laser_sight=bool(places.laser_sight[place]),
            received_power_W=float(places.received_power_W[place]),
            **of_device,
        )
    flyable = np.flatnonzero(legs.flyable)
    figures = np.stack([getattr(legs, name)[flyable] for name in EDGE_FIGURES], axis=1)
    for leg, row in zip(flyable, figures.tolist(), strict=True):
        start, end = places.names[legs.start[leg]], places.names[legs.end[leg]]
        view.add_edge(start, end, **dict(zip(EDGE_FIGURES, row, strict=True)))
    return view


def validate_graph(view: Graph) -> tuple[Fault, ...]:
    """Return every fault of a graph, by the contract of `graph`.

    Parameters
    ----------
    view
        A graph, perhaps edited by hand.

    Returns
    -------
    tuple of Fault
        Faults by node and edge, with their attributes as keys; empty if the graph has none.

    Examples
    --------
    >>> import optuav
    >>> graph = optuav.graph("paper")
    >>> optuav.validate_graph(graph)
    ()
    >>> graph.nodes["b3"]["received_power_W"] = -1.0
    >>> print(*optuav.validate_graph(graph))
    graph: nodes['b3'].received_power_W = -1.0: must be a number ≥ 0 [W]
    """
    import networkx

    if not isinstance(view, networkx.DiGraph) or view.is_multigraph():
        return (Fault(SOURCE, type(view).__name__, "must be a networkx.DiGraph"),)
    return tuple(_faults(view))


def _faults(view: Graph) -> Iterator[Fault]:
    """Yield the faults of a directed graph, node by node and edge by edge."""
    several = any(
        data.get("kind") == "hover" for node, data in view.nodes(data=True) if node not in ENDS
    )
    for end in (ENDS[ORIGIN], ENDS[DESTINATION]):
        if end not in view:
            yield Fault(_node(end), "", "is missing", SOURCE)
    for node, data in view.nodes(data=True):
        if view.has_edge(node, node):
            yield Fault(_edge(node, node), "", "must lead to another place", SOURCE)
        kinds = [node] if node in ENDS else ["building", *["hover"] * ("hover" not in view)]
        position_m = data.get("position_m")
        if isinstance(position_m, np.ndarray):
            position_m = position_m.tolist()
        three = isinstance(position_m, tuple | list) and len(position_m) == 3
        power_W, own_kind = _number(data.get("received_power_W")), data.get("kind")
        inside = three and all(abs(_number(component)) <= LARGEST for component in position_m or ())
        is_kind = isinstance(own_kind, str) and own_kind in kinds
        kind = " or ".join(map(repr, kinds if several else kinds[:1]))
        is_bool = isinstance(data.get("laser_sight"), bool | np.bool_)
        hovers, share = own_kind == "hover", _number(data.get("share"))
        is_device = "device" not in data or (hovers and data["device"] == node)
        is_share = "share" not in data or (hovers and 0.0 < share <= 1.0)
        for name, right, words in (
            ("kind", is_kind, f"must be {kind}"),
            ("position_m", inside, "must be three finite numbers [m]"),
            ("laser_sight", is_bool, "must be True or False"),
            ("received_power_W", 0.0 <= power_W <= LARGEST, "must be a number ≥ 0 [W]"),
            ("device", is_device, "must be the name of its hover point, left out elsewhere"),
            ("share", is_share, "must be a number, 0 < x ≤ 1, left out elsewhere"),
        ):
            if not right:
                yield Fault(f"{_node(node)}.{name}", shown(data.get(name)), words, SOURCE)
    # Devices out of reach have no node: the shares of the others are less than 1.
    shares = [_number(share) for _, share in view.nodes(data="share", default=0.0)]
    if (total := sum(shares)) > 1.0 + WHOLE_SHARE:
        words = "the shares of all hover points add up to at most 1; change them in the mission"
        yield Fault("share", figure(total), words, SOURCE)
    for start, end, data in view.edges(data=True):
        figures = {name: _number(data.get(name)) for name in EDGE_FIGURES}
        faulty = [name for name, figure in figures.items() if not 0.0 <= figure <= LARGEST]
        words = "must be a finite number ≥ 0"
        if not faulty and (
            max(figures["charge_As"], figures["energy_J"]) > LARGEST * figures["duration_s"]
        ):
            faulty, words = ["duration_s"], "must be above 0: a leg that draws charge takes time"
        for name in faulty:
            yield Fault(f"{_edge(start, end)}.{name}", shown(data.get(name)), words, SOURCE)


def _node(node: object) -> str:
    """A node, as faults call it."""
    return f"nodes[{shown(node)}]"


def _edge(start: object, end: object) -> str:
    """An edge, as faults call it."""
    return f"edges[{shown(start)}, {shown(end)}]"


def _number(value: object) -> float:
    """A real number as a float, NaN for anything else."""
    if not isinstance(value, Real) or isinstance(value, bool):
        return math.nan
    try:
        return float(value)
    except OverflowError:
        return math.inf


def network_of(mission: Mission, view: Graph | None) -> Network:
    """The network of a mission, or of its graph where that was edited."""
    return build_network(mission) if view is None else edited_network(mission, view)


def edited_network(mission: Mission, view: Graph) -> Network:
    """The network of a mission with the figures of a graph that the user has edited.

    A missing edge forbids the leg; an edge with other figures becomes a leg of constant current,
    marked as edited; sight and received power are taken from the nodes. An `InputError` says what
    is out of order in the graph or does not belong to the mission.
    """
    computed = build_network(mission)
    refuse(validate_graph(view) or _foreign(computed, view))
    places, voltage_V = computed.places, mission.battery.nominal_voltage_V
    nodes = [view.nodes[name] if name in view else {} for name in places.names]
    sight = np.array([bool(data.get("laser_sight")) for data in nodes])
    power_W = np.array([float(data.get("received_power_W", 0.0)) for data in nodes]) * sight
    changed = power_W != places.received_power_W
    current_A = np.where(changed, power_W / voltage_V, places.charge_current_A)
    places = replace(
        places,
        laser_sight=sight,
        received_power_W=power_W,
        charge_current_A=np.where(sight, current_A, 0.0),
        edited=(sight != places.laser_sight) | changed,
    )
    legs = edited_legs(computed.legs, places.names, view)
    routes = build_routes(legs, computed.buildings, computed.routes.devices[:1])
    return Network(mission, places, legs, routes)


def edited_legs(
    legs: Legs, names: Sequence[str], view: Graph, needed: Booleans | None = None
) -> Legs:
    """A table of legs with the figures of the edges of a graph that is in order.

    A leg without an edge is forbidden if it is `needed` (leg,), by default all; others stay.
    """
    table = {name: column.copy() for name, column in legs.arrays.items()}
    table["flyable"][slice(None) if needed is None else needed] = False
    table["edited"][:] = False
    figures = np.stack([getattr(legs, name) for name in EDGE_FIGURES], axis=1)
    number = {way: leg for leg, way in enumerate(zip(legs.start, legs.end, strict=True))}
    place = {name: k for k, name in enumerate(names)}
    for start, end, data in view.edges(data=True):
        leg = number.get((place[start], place[end]))
        if leg is None:
            continue
        table["flyable"][leg] = True
        given_figures = [float(data[name]) for name in EDGE_FIGURES]
        if legs.flyable[leg] and (figures[leg] == given_figures).all():
            continue
        table["edited"][leg] = True
        duration_s, charge_As, energy_J, *way = given_figures
        table["distance_m"][leg], table["peak_speed_m_s"][leg] = way
        table["durations_s"][:, leg] = 0.0
        table["durations_s"][0, leg] = duration_s
        for name, drawn in (("currents_A", charge_As), ("powers_W", energy_J)):
            table[name][:, leg] = drawn / duration_s if duration_s > 0.0 else 0.0
    return replace(legs, **table)


def _foreign(computed: Network, view: Graph) -> Iterator[Fault]:
    """Nodes that are not the mission's, or elsewhere, or with more power than the battery takes."""
    places, most_W = computed.places, vehicle.charging_limit_W(computed.mission)
    number = {name: k for k, name in enumerate(places.names)}
    shares = {device.name: device.share for device in computed.mission.served}
    for node, data in view.nodes(data=True):
        if node not in number:
            yield Fault(_node(node), "", "the mission has no such place", SOURCE)
            continue
        known_m, known_W = places.position_m[number[node]], places.received_power_W[number[node]]
        if (kind := places.kind(number[node])) != data["kind"]:
            yield Fault(f"{_node(node)}.kind", shown(data["kind"]), f"must be {kind!r}", SOURCE)
        if "share" in data and data["share"] != shares.get(node):
            words = "shares are changed in the mission, by mission.replace"
            yield Fault(f"{_node(node)}.share", shown(data["share"]), words, SOURCE)
        position_m = [float(component) for component in data["position_m"]]
        if not (np.abs(position_m - known_m) <= SAME_PLACE_M).all():
            by = "mission.replace"
            if places.hovers_at(number[node]):
                by = f"devices.{node}.hover_m" if computed.mission.devices else "route.hover_m"
            words = f"places are moved in the mission, by {by}"
            yield Fault(f"{_node(node)}.position_m", shown(position_m), words, SOURCE)
        power_W = float(data["received_power_W"]) if data["laser_sight"] else 0.0
        if power_W > max(most_W, known_W) * (1.0 + ROUNDED_POWER):
            words = f"at most {figure(most_W)} W charge at battery.charge_current_A"
            yield Fault(f"{_node(node)}.received_power_W", shown(power_W), words, SOURCE)
