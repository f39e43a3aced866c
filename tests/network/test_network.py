"""The paper's trajectories as choices of routes, against a search over all of them."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

import optuav
from formulations.p1 import P1
from optuav.mission import Mission
from optuav.network.graph import edited_network
from optuav.network.network import Network, build_network
from optuav.network.variants import as_variants
from optuav.options import ORDERS, TRAJECTORIES, Order
from optuav.solving.route_models import permitted_routes
from tests.examples import few
from tests.mission.strategies import missions

PAPER = optuav.load("paper")


def trajectory_routes(network: Network, name: Any, order: Order | None = None) -> Any:
    """Numbers of the flyable routes that a trajectory may use, in one order or in both."""
    return permitted_routes(as_variants(network), P1(trajectory=name, order=order)).nonzero()[1]


def chosen(mission: Mission, name: Any, order: Order | None = None) -> list[tuple[str, ...]]:
    """Routes of a trajectory as names of places."""
    network = build_network(mission)
    return [route(network, index) for index in trajectory_routes(network, name, order)]


def route(network: Network, index: int) -> tuple[str, ...]:
    building, order = network.routes.building[index], network.routes.order(index)
    if order is None:
        return ("origin", "hover", "destination")
    name = network.mission.buildings[building].name
    middle = (name, "hover") if order == "rest-first" else ("hover", name)
    return ("origin", *middle, "destination")


def searched(network: Network, name: str, order: Order | None) -> list[int]:
    """What a trajectory means, itinerary by itinerary."""
    routes, mission = network.routes, network.mission
    by_way = [
        index
        for index in range(1, len(routes))
        if routes.flyable[index] and order in (None, routes.order(index))
    ]
    direct = [0] if routes.flyable[0] else []
    if name == "direct":
        return direct
    if name == "optimal":
        return direct + by_way
    if name == "traj1":
        device_m = mission.link.device_m
        distances_m = [math.dist(each.position_m, device_m) for each in mission.buildings]
        nearest = [k for k, d in enumerate(distances_m) if d <= min(distances_m)][:1]
        return [index for index in by_way if routes.building[index] in nearest]
    times_s = {index: routes.flight_time_s[index] for index in by_way}
    return [index for index in by_way if times_s[index] <= min(times_s.values()) + 1e-6]


@pytest.mark.campaign
@few(5, most=1000)
@given(missions(), st.sampled_from(TRAJECTORIES), st.sampled_from([None, *ORDERS]))
def test_trajectories_are_what_they_say(mission: Mission, name: Any, order: Order | None) -> None:
    """All, the direct one, by way of the nearest building, the shortest by way of any."""
    network = build_network(mission)
    found = trajectory_routes(network, name, order).tolist()
    assert found == searched(network, name, order)


@pytest.mark.campaign
@few(5, most=1000)
@given(st.data())
def test_the_shortest_way_over_edited_legs(data: st.DataObject) -> None:
    """Any durations, 0 and ties among them, any legs forbidden."""
    view = optuav.graph(PAPER)
    durations_s = st.sampled_from([0.0, 10.0, 10.0 + 5e-7, 10.0 + 5e-6, 20.0, 1e9])
    for edge in view.edges:
        view.edges[edge].update(duration_s=data.draw(durations_s), charge_As=0.0, energy_J=0.0)
    view.remove_edges_from(data.draw(st.lists(st.sampled_from(list(view.edges)), max_size=30)))
    order = data.draw(st.sampled_from([None, *ORDERS]))
    network = edited_network(PAPER, view)
    found = trajectory_routes(network, "traj2", order).tolist()
    assert found == searched(network, "traj2", order)


def test_trajectories_of_the_shipped_mission() -> None:
    """b9 and b10 are as near to the device, b9 comes first; b1 and b2 are as short."""
    assert chosen(PAPER, "direct") == [("origin", "hover", "destination")]
    assert chosen(PAPER, "traj1") == [
        ("origin", "b9", "hover", "destination"),
        ("origin", "hover", "b9", "destination"),
    ]
    assert chosen(PAPER, "traj2") == [
        ("origin", "b1", "hover", "destination"),
        ("origin", "hover", "b2", "destination"),
    ]
    assert chosen(PAPER, "traj2", "hover-first") == [("origin", "hover", "b2", "destination")]
    assert len(chosen(PAPER, "optimal")) == 21
    assert len(chosen(PAPER, "optimal", "rest-first")) == 11


def test_the_network_of_equal_missions_is_kept_and_cannot_be_changed() -> None:
    """A second solve finds it, another mission has its own, and no use of it changes the next."""
    network = build_network(optuav.load("paper"))
    assert build_network(optuav.load("paper").replace({})) is network
    longer = build_network(optuav.load("paper").replace({"limits.deadline_s": 2000.0}))
    assert longer.mission.limits.deadline_s == 2000.0
    for array in (network.places.position_m, network.legs.durations_s, network.routes.flyable):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0.0


def test_a_mission_without_buildings_goes_direct() -> None:
    """traj1 and traj2 have no routes then."""
    mission = PAPER.replace({"buildings": []})
    assert chosen(mission, "traj1") == chosen(mission, "traj2") == []
    assert chosen(mission, "optimal") == chosen(mission, "direct")


def test_traj1_does_not_turn_to_another_building_when_the_nearest_is_blocked() -> None:
    """It is by way of the nearest, or not at all."""
    view = optuav.graph(PAPER)
    view.remove_node("b9")
    network = edited_network(PAPER, view)
    assert not len(trajectory_routes(network, "traj1"))
    assert len(trajectory_routes(network, "optimal")) == 19


def test_many_ties_are_no_trouble() -> None:
    """500 buildings on the same spot: 500 shortest ways in each order."""
    spot = [{"name": f"n{number}", "position_m": [700, 900, 60]} for number in range(500)]
    network = build_network(PAPER.replace({"buildings": spot}))
    assert len(trajectory_routes(network, "traj2")) in (500, 1000)
    assert len(trajectory_routes(network, "traj1")) == 2


@pytest.mark.parametrize("order", ORDERS)
def test_the_order_leaves_the_direct_way_alone(order: Order) -> None:
    """It speaks of rests."""
    assert chosen(PAPER, "direct", order) == [("origin", "hover", "destination")]
    assert ("origin", "hover", "destination") in chosen(PAPER, "optimal", order)
