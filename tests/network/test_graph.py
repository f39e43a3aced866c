"""The graph of a mission: its contract, what is wrong with a spoilt one, and edits that count."""

from __future__ import annotations

import itertools
import json
import math
from decimal import Decimal
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import networkx as nx
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import optuav
from optuav.mission import Mission
from optuav.network.graph import EDGE_FIGURES, edited_network
from tests.examples import few
from tests.mission.strategies import missions
from tests.several_devices import three
from tests.solving.by_hand import longest_of_all

if TYPE_CHECKING:
    from optuav.network.graph import Graph

PAPER = optuav.load("paper")
NODE_ATTRIBUTES = ("kind", "position_m", "laser_sight", "received_power_W")
HOSTILE: tuple[Any, ...] = (
    *(None, "", "5", -1, -1e-300, math.nan, math.inf, -math.inf, True, 10**400, 1e308, 1e150),
    *(0, 0.0, 1e-320, Fraction(1, 3), Decimal(3), 1j, (), [1], [0, 0, 0], [[1], [2], [3]], {}),
    *(np.nan, np.array(3.0), np.array([1.0, 2.0]), np.zeros((3, 3)), np.array(["a", "b", "c"])),
    *(np.float32(2.5), np.int64(7), np.bool_(True), np.str_("building"), object(), "hover"),
    *((1, 2, math.nan), (10**400, 0, 0), ("0", "0", "0"), b"origin", float, {1, 2}),
)


def graph_of(mission: Mission = PAPER) -> Graph:
    return optuav.graph(mission)


def keys(view: Graph) -> list[str]:
    """What `validate_graph` finds fault with."""
    return [fault.key for fault in optuav.validate_graph(view)]


def test_the_contract() -> None:
    """Nodes, edges and attributes as documented; plain numbers, so that any exporter takes them."""
    view = graph_of()
    names = [f"b{number}" for number in range(1, 11)]
    assert isinstance(view, nx.DiGraph)
    assert list(view) == ["origin", "hover", "destination", *names]
    assert set(view.edges) == {
        *itertools.pairwise(("origin", "hover", "destination")),
        *itertools.product(("origin", "hover"), names),
        *itertools.product(names, ("hover", "destination")),
    }
    for name, data in view.nodes(data=True):
        assert tuple(data) == NODE_ATTRIBUTES
        assert data["kind"] == (name if name in ("origin", "hover", "destination") else "building")
        assert [type(each) for each in data["position_m"]] == [float] * 3
        assert data["laser_sight"] is True
        assert type(data["received_power_W"]) is float
    for _, _, data in view.edges(data=True):
        assert tuple(data) == EDGE_FIGURES
        assert {type(figure) for figure in data.values()} == {float}
    assert optuav.validate_graph(view) == ()


def test_figures_of_the_shipped_mission() -> None:
    """SPEC 4: leg w0 → wU, and a level leg there and back."""
    leg = graph_of().edges["origin", "hover"]
    assert leg["duration_s"] == pytest.approx(37.8961, abs=5e-5)
    assert leg["charge_As"] == pytest.approx(3921.555, abs=5e-4)
    assert leg["energy_J"] == pytest.approx(63533, abs=0.5)
    assert leg["distance_m"] == pytest.approx(math.hypot(1000, 2501.0152), abs=5e-4)
    assert leg["peak_speed_m_s"] == pytest.approx(154.89, abs=5e-3)


def test_blocked_legs_have_no_edge_and_dark_roofs_no_power() -> None:
    """A tower between the laser and b9, and between the origin and b1."""
    towers = [
        {"name": "tower", "position_m": [900, 875, 300], "footprint_m": [60, 60]},
        {"name": "mast", "position_m": [25, 150, 90], "footprint_m": [10, 10]},
    ]
    view = graph_of(PAPER.replace({"buildings": [*PAPER.to_dict()["buildings"], *towers]}))
    assert not view.has_edge("origin", "b1")
    assert view.has_edge("b1", "hover")
    assert view.nodes["b9"]["laser_sight"] is False
    assert view.nodes["b9"]["received_power_W"] == 0.0


@pytest.mark.campaign
@few(5, most=1000)
@given(missions())
def test_an_unedited_graph_is_in_order_and_changes_nothing(mission: Mission) -> None:
    """Also where there is no hover point, no laser, no building, or nothing can fly."""
    view = graph_of(mission)
    assert optuav.validate_graph(view) == ()
    assert optuav.solve(mission, graph=view, perspective="battery") == optuav.solve(
        mission, perspective="battery"
    )
    assert not edited_network(mission, view).legs.edited.any()


def test_a_graph_without_a_hover_point_is_in_order() -> None:
    """The device is out of reach: no node, and a plan that says so."""
    mission = PAPER.replace({"link.device_m": [1000, 3000, 900]})
    view = graph_of(mission)
    assert "hover" not in view
    assert optuav.validate_graph(view) == ()
    assert "out of reach" in optuav.solve(mission, graph=view, perspective="battery").reasons[0]


def test_all_faults_are_listed_at_once() -> None:
    """Structure, nodes and edges, each by its place in the graph."""
    view = graph_of()
    view.remove_node("destination")
    view.nodes["hover"]["kind"] = "building"
    view.nodes["b1"]["position_m"] = (50, 300)
    view.nodes["b2"]["laser_sight"] = 1
    view.nodes["b3"]["received_power_W"] = -1
    view.nodes["b4"].clear()
    view.edges["origin", "b1"]["duration_s"] = math.nan
    del view.edges["origin", "b2"]["energy_J"]
    view.edges["origin", "b3"]["duration_s"] = 0.0
    view.add_edge("b5", "b5", **view.edges["origin", "b5"])
    view.add_node("b99")
    assert sorted(keys(view)) == sorted(
        [
            "nodes['destination']",
            "edges['b5', 'b5']",
            "nodes['hover'].kind",
            "nodes['b1'].position_m",
            "nodes['b2'].laser_sight",
            "nodes['b3'].received_power_W",
            *(f"nodes['b4'].{name}" for name in NODE_ATTRIBUTES),
            *(f"nodes['b99'].{name}" for name in NODE_ATTRIBUTES),
            "edges['origin', 'b1'].duration_s",
            "edges['origin', 'b2'].energy_J",
            "edges['origin', 'b3'].duration_s",
        ]
    )
    with pytest.raises(optuav.InputError) as raised:
        optuav.solve(PAPER, graph=view, perspective="battery")
    assert raised.value.faults == optuav.validate_graph(view)


@pytest.mark.parametrize("other", [None, 3, {}, nx.Graph(), nx.MultiDiGraph(), "paper"])
def test_anything_but_a_directed_graph_is_refused(other: Any) -> None:
    """With the type that it has instead."""
    (fault,) = optuav.validate_graph(other)
    assert str(fault) == f"graph = {type(other).__name__}: must be a networkx.DiGraph"


def test_an_empty_graph_has_no_ends() -> None:
    """Origin and destination are always needed."""
    assert keys(nx.DiGraph()) == ["nodes['origin']", "nodes['destination']"]


def attempt(view: Graph) -> tuple[optuav.Plan | None, tuple[optuav.Fault, ...]]:
    """The plan over a graph, or the faults for which it is refused."""
    try:
        return optuav.solve(PAPER, graph=view, perspective="battery"), ()
    except optuav.InputError as error:
        return None, error.faults


@pytest.mark.campaign
@few(5, most=1000)
@given(st.data())
def test_a_damaged_graph_is_refused_or_solved(data: st.DataObject) -> None:
    """Whatever is done to it: clear faults, or the plan that belongs to its figures."""
    view: Any = graph_of()
    hostile = st.sampled_from(HOSTILE)
    nodes = st.sampled_from([*view, "b99", 7, ("origin",), None])
    for _ in range(data.draw(st.integers(1, 4))):
        match data.draw(st.integers(0, 6)):
            case 0:
                node = data.draw(st.sampled_from(["hover", "b1", "b2"]))
                if node in view:
                    attribute = data.draw(st.sampled_from(NODE_ATTRIBUTES))
                    view.nodes[node][attribute] = data.draw(hostile)
            case 1:
                if view.edges:
                    edge = data.draw(st.sampled_from(list(view.edges)))
                    view.edges[edge][data.draw(st.sampled_from(EDGE_FIGURES))] = data.draw(hostile)
            case 2:
                view.remove_nodes_from([data.draw(nodes)])
            case 3:
                edges = st.sampled_from([*view.edges, ("b1", "b2")])
                view.remove_edges_from(data.draw(st.lists(edges)))
            case 4:
                start, end = data.draw(nodes), data.draw(nodes)
                if start is not None and end is not None:
                    view.add_edge(start, end, **dict.fromkeys(EDGE_FIGURES, data.draw(hostile)))
            case 5:
                if "b3" in view:
                    view.nodes["b3"].pop(data.draw(st.sampled_from(NODE_ATTRIBUTES)), None)
            case _:
                view = nx.relabel_nodes(view, {data.draw(nodes): "b5"})
    faults = optuav.validate_graph(view)
    assert all(str(fault).isprintable() for fault in faults)
    plan, refused = attempt(view)
    if plan is None:
        assert refused
        assert refused == faults or not faults
        return
    assert not faults
    expected = longest_of_all(PAPER, view)
    assert bool(plan) == (expected is not None)
    if expected:
        assert plan.hover_time_s == pytest.approx(expected.hover_s, rel=1e-6, abs=1e-6)
    else:
        assert plan.reasons
    assert all(len(line) <= 80 for line in plan.summary().splitlines())


@pytest.mark.campaign
@few(5, most=1000)
@given(st.data())
def test_edited_figures_make_the_plan(data: st.DataObject) -> None:
    """Measured legs, forbidden legs, lost sight and weaker light, against a plan made by hand."""
    name = data.draw(st.sampled_from(["paper", "paper-table2"]))
    mission = optuav.load(name).replace({"limits.deadline_s": data.draw(st.floats(100, 2500))})
    view = graph_of(mission)
    for edge in data.draw(st.lists(st.sampled_from(list(view.edges)), max_size=12)):
        for figure in data.draw(st.sets(st.sampled_from(EDGE_FIGURES))):
            view.edges[edge][figure] *= data.draw(st.floats(0.3, 3.0))
    view.remove_edges_from(data.draw(st.lists(st.sampled_from(list(view.edges)), max_size=12)))
    for node in data.draw(st.lists(st.sampled_from(list(view)), max_size=6)):
        view.nodes[node]["laser_sight"] = data.draw(st.booleans())
        view.nodes[node]["received_power_W"] *= data.draw(st.floats(0.0, 1.0))
    perspective = data.draw(st.sampled_from(["battery", "energy", "adjusted"]))
    expected = longest_of_all(mission, view, perspective)
    plan = optuav.solve(mission, graph=view, perspective=perspective)
    assert bool(plan) == (expected is not None)
    if expected is None:
        return
    assert plan.hover_time_s == pytest.approx(expected.hover_s, abs=1e-6)
    assert plan.mission_time_s == pytest.approx(expected.mission_s, abs=1e-5)
    unedited = graph_of(mission)
    for phase in plan.phases:
        if phase.kind != "flight":
            continue
        leg = view.edges[phase.start_place, phase.end_place]
        assert phase.edited == (leg != unedited.edges[phase.start_place, phase.end_place])
        assert phase.duration_s == pytest.approx(leg["duration_s"], rel=1e-12)
        assert -phase.current_A * phase.duration_s == pytest.approx(leg["charge_As"], rel=1e-9)
        assert -phase.power_W * phase.duration_s == pytest.approx(leg["energy_J"], rel=1e-9)
        assert phase.distance_m == leg["distance_m"]
        assert phase.peak_speed_m_s == leg["peak_speed_m_s"]


def test_an_edited_leg_is_one_stage_and_the_plan_says_so() -> None:
    """Constant current, marked as edited; the other legs keep their five stages."""
    view = graph_of()
    view.edges["origin", "b1"]["duration_s"] = 10.0
    plan = optuav.solve(PAPER, graph=view, perspective="battery")
    flights = [phase for phase in plan.phases if phase.kind == "flight"]
    assert [phase.edited for phase in flights] == [True, False, False]
    assert [each.duration_s for each in flights[0].stages if each.duration_s] == [10.0]
    assert all(each.duration_s for each in flights[1].stages)
    assert "some legs have figures from the graph, not from the flight model" in plan.notes
    assert "*" in plan.summary()
    assert "*" not in optuav.solve(PAPER, perspective="battery").summary()


def test_a_leg_may_be_added_where_a_building_is_in_the_way() -> None:
    """The user knows a way round it."""
    wall = {"name": "wall", "position_m": [500, 1250, 90], "footprint_m": [300, 300]}
    mission = PAPER.replace({"buildings": [wall]})
    view = graph_of(mission)
    assert not view.has_edge("origin", "hover")
    assert not optuav.solve(mission, "P3", perspective="battery")
    view.add_edge("origin", "hover", **graph_of().edges["origin", "hover"])
    plan = optuav.solve(mission, "P3", graph=view, perspective="battery")
    assert plan.hover_time_s == pytest.approx(688.848, abs=5e-4)
    assert plan.phases[0].edited, "not computed for this mission"


def test_edges_that_no_itinerary_uses_change_nothing() -> None:
    """From roof to roof: kept for later, checked all the same."""
    view = graph_of()
    view.add_edge("b1", "b2", **dict.fromkeys(EDGE_FIGURES, 1.0))
    assert (
        optuav.solve(PAPER, graph=view, perspective="battery").route
        == optuav.solve(PAPER, perspective="battery").route
    )
    view.edges["b1", "b2"]["energy_J"] = None
    assert keys(view) == ["edges['b1', 'b2'].energy_J"]


def test_a_removed_building_is_not_visited() -> None:
    """b1 and b2 gone: b9 is next best, as if the mission had not named them."""
    view = graph_of()
    view.remove_nodes_from(["b1", "b2"])
    plan = optuav.solve(PAPER, graph=view, perspective="battery")
    stated = PAPER.to_dict()["buildings"][2:]
    without = optuav.solve(PAPER.replace({"buildings": stated}), perspective="battery")
    assert plan.route == without.route
    assert plan.hover_time_s == without.hover_time_s


def test_a_removed_hover_point_grounds_the_mission() -> None:
    """It has no legs then, and the plan names them."""
    view = graph_of()
    view.remove_node("hover")
    plan = optuav.solve(PAPER, graph=view, perspective="battery")
    assert not plan
    assert plan.reasons == (
        "the leg origin → hover is not in the graph",
        "the leg hover → destination is not in the graph",
    )


def test_devices_and_shares_are_changed_in_the_mission() -> None:
    """A graph that changes them was solved with those of the mission."""
    for name, value, key in (
        ("device", "north", "nodes['west'].device"),
        ("share", -0.1, "nodes['west'].share"),
        ("share", 0.9, "share"),
    ):
        graph = optuav.graph(three())
        assert optuav.validate_graph(graph) == ()
        graph.nodes["west"][name] = value
        assert [fault.key for fault in optuav.validate_graph(graph)] == [key]
    graph = optuav.graph("paper")
    graph.nodes["b3"].update(device="b3", share=0.5)
    keys = [fault.key for fault in optuav.validate_graph(graph)]
    assert keys == ["nodes['b3'].device", "nodes['b3'].share"]


def test_a_graph_of_another_mission_is_refused() -> None:
    """Places that this mission has not, or has elsewhere."""
    moved = PAPER.replace({"buildings.b3.position_m": [230, 800, 60]})
    with pytest.raises(optuav.InputError, match=r"nodes\['b3'\]\.position_m") as raised:
        optuav.solve(PAPER, graph=graph_of(moved), perspective="battery")
    assert len(raised.value.faults) == 1
    named = PAPER.replace({"buildings.b3.name": "town hall"})
    with pytest.raises(optuav.InputError, match="no such place"):
        optuav.solve(PAPER, graph=graph_of(named), perspective="battery")
    away = PAPER.replace({"route.hover_m": [1000, 2700, 50]})
    with pytest.raises(optuav.InputError, match=r"route\.hover_m"):
        optuav.solve(PAPER, graph=graph_of(away), perspective="battery")


def test_more_power_than_the_battery_takes_is_refused() -> None:
    """10 A at 11.1 V; without sight the figure does not count."""
    view = graph_of()
    view.nodes["b1"]["received_power_W"] = 111.0
    assert not edited_network(PAPER, view).legs.edited.any()
    view.nodes["b1"]["received_power_W"] = 112.0
    with pytest.raises(optuav.InputError, match=r"at most 111 W charge at battery\.charge_current"):
        optuav.solve(PAPER, graph=view, perspective="battery")
    view.nodes["b1"]["laser_sight"] = False
    assert optuav.solve(PAPER, graph=view, perspective="battery")


def test_received_power_is_charged_at_the_nominal_voltage() -> None:
    """55.5 W are 5 A at 11.1 V; a place without sight gets nothing, whatever its figure says."""
    view = graph_of()
    view.nodes["b1"]["received_power_W"] = 55.5
    view.nodes["b2"]["laser_sight"] = False
    where = edited_network(PAPER, view).places
    by_name = dict(zip(where.names, where.charge_current_A, strict=True))
    assert by_name["b1"] == pytest.approx(5.0)
    assert by_name["b2"] == 0.0
    assert by_name["b3"] == pytest.approx(10.0)


def test_numbers_of_numpy_and_whole_numbers_are_numbers() -> None:
    """Figures computed with NumPy, positions as arrays or lists."""
    view = graph_of()
    for node, data in view.nodes(data=True):
        data["position_m"] = (
            np.array(data["position_m"]) if node == "b1" else list(data["position_m"])
        )
        data["laser_sight"] = np.bool_(data["laser_sight"])
        data["received_power_W"] = np.float64(data["received_power_W"])
    for _, _, data in view.edges(data=True):
        data.update({name: np.float64(figure) for name, figure in data.items()})
    assert optuav.solve(PAPER, graph=view, perspective="battery") == optuav.solve(
        PAPER, perspective="battery"
    )
    view.edges["origin", "b1"].update(duration_s=np.float32(15), charge_As=np.int64(1500))
    view.edges["b1", "hover"].update(energy_J=60000, charge_As=Fraction(7500, 2))
    assert optuav.solve(PAPER, graph=view, perspective="battery")


def test_a_round_trip_through_a_file_keeps_the_graph() -> None:
    """JSON turns tuples into lists; the plan stays the same."""
    data = nx.node_link_data(graph_of(), edges="edges")
    view: Any = nx.node_link_graph(json.loads(json.dumps(data)), edges="edges")
    assert optuav.solve(PAPER, graph=view, perspective="battery") == optuav.solve(
        PAPER, perspective="battery"
    )
