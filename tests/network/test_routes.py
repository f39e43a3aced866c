"""Routes with at most one stop, against plain loops over the table of legs."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given

import optuav
from optuav.mission import Mission
from optuav.network.legs import NO_LEG
from optuav.network.network import Network, build_network
from optuav.options import Order
from tests.examples import few
from tests.mission.strategies import missions


def in_the_order_of_ties(mission: Mission) -> Iterator[tuple[int, Order | None, tuple[str, ...]]]:
    """Building, order and route of every itinerary, as the documentation lists them."""
    yield -1, None, ("origin", "hover", "destination")
    for number, building in enumerate(mission.buildings):
        yield number, "rest-first", ("origin", building.name, "hover", "destination")
        yield number, "hover-first", ("origin", "hover", building.name, "destination")


def route(network: Network, index: int) -> tuple[str, ...]:
    """Names of the places of an itinerary, each leg beginning where the one before it ends."""
    names, table = network.places.names, network.legs
    numbers = [leg for leg in network.routes.legs[index] if leg != NO_LEG]
    for before, after in itertools.pairwise(numbers):
        assert table.end[before] == table.start[after]
    return (names[table.start[numbers[0]]], *(names[table.end[leg]] for leg in numbers))


@pytest.mark.campaign
@few(5, most=1000)
@given(missions())
def test_itineraries_are_all_routes_with_at_most_one_stop(mission: Mission) -> None:
    """Direct first, then by building, rest first and hover first; totals are sums over the legs."""
    network = build_network(mission)
    routes = network.routes
    expected = list(in_the_order_of_ties(mission))
    assert len(routes) == len(expected) == 1 + 2 * len(mission.buildings)
    for index, (building, order, names) in enumerate(expected):
        assert routes.building[index] == building
        assert routes.order(index) == order
        assert routes.rest_first[index] == (order == "rest-first")
        assert route(network, index) == names
    # Time, charge and energy; flyable if every leg is.
    network = build_network(mission)
    routes, table = network.routes, network.legs
    for index, legs in enumerate(routes.legs.tolist()):
        flown = [leg for leg in legs if leg != NO_LEG]
        assert routes.flyable[index] == all(table.flyable[leg] for leg in flown)
        for total, per_leg in (
            (routes.flight_time_s, table.duration_s),
            (routes.flight_charge_As, table.charge_As),
            (routes.flight_energy_J, table.energy_J),
        ):
            expected = math.fsum(per_leg[leg] for leg in flown)
            assert total[index] == pytest.approx(expected, rel=1e-12, nan_ok=True)


def test_one_blocked_leg_grounds_the_itineraries_that_use_it_alone() -> None:
    """A tower on the way from the origin to b1 leaves the other 20 routes."""
    mission = optuav.load("paper")
    tower = {"name": "tower", "position_m": [25, 150, 90], "footprint_m": [10, 10]}
    stated = [*mission.to_dict()["buildings"], tower]
    routes = build_network(mission.replace({"buildings": stated})).routes
    grounded = np.flatnonzero(~routes.flyable).tolist()
    assert [(routes.building[index], routes.order(index)) for index in grounded] == [
        (0, "rest-first")
    ]


def test_taking_some_keeps_their_order() -> None:
    """`take` cuts all columns alike."""
    routes = build_network(optuav.load("paper")).routes
    some = routes.take([4, 0])
    assert len(some) == 2
    assert [some.order(0), some.order(1)] == ["hover-first", None]
    assert some.flight_time_s.tolist() == [routes.flight_time_s[4], routes.flight_time_s[0]]
    assert some.legs.tolist() == [routes.legs[4].tolist(), routes.legs[0].tolist()]
