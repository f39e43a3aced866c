"""Missions over several devices: check numbers, theorems, and an oracle that shares no code.

The check numbers are those of a prototype of its own; the theorems are proved on paper and tried
here on small missions.
"""

from __future__ import annotations

import itertools
import math
import warnings
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import optuav
from optuav.engines import dispatch
from optuav.errors import InputError
from optuav.options import Perspective
from optuav.solving import device_routes, wanted_hover
from optuav.solving.question import solve_model
from optuav.status import Status
from tests.kibam import Kibam
from tests.solving.devices import Town, random_town

PLACES = {"west": (400, 2600, 0), "north": (1000, 3000, 0), "east": (1700, 2400, 0)}
DEVICES = [{"name": name, "position_m": list(at)} for name, at in PLACES.items()]
PAPER = optuav.load("paper").replace({"limits.deadline_s": 1800})
THREE = PAPER.replace({"devices": DEVICES})
SHARED = THREE.replace(
    {f"devices.{name}.share": share for name, share in zip(PLACES, (0.5, 0.3, 0.2), strict=True)}
)
STRONG = SHARED.replace({"battery.charge_current_A": 40, "laser.power_W": 5000})
TABLE2 = optuav.load("paper-table2").replace({"limits.deadline_s": 1800, "devices": DEVICES[:2]})


# Check numbers


def test_hover_points_and_legs_of_three_devices() -> None:
    """w_U of each device alone, and the legs between two of them."""
    graph = optuav.graph(THREE)
    at_m = {
        "west": (496.2356, 2110.3833, 50.0),
        "north": (1000.0, 2501.0152, 50.0),
        "east": (1582.3933, 1915.0727, 50.0),
    }
    for name, place_m in at_m.items():
        assert graph.nodes[name]["position_m"] == pytest.approx(place_m, abs=5e-5)
        assert graph.nodes[name]["kind"] == "hover"
        assert graph.nodes[name]["device"] == name
        assert graph.nodes[name]["share"] == pytest.approx(1 / 3)
    legs_s = graph.edges["west", "north"]["duration_s"], graph.edges["north", "east"]["duration_s"]
    assert legs_s == pytest.approx((20.14658, 22.53101), abs=5e-6)
    roads = 3 * 4 + 2 * 10 * 4
    blocked = 4  # Legs along the towers at both ends
    assert graph.number_of_edges() == roads - blocked


NUMBERS = [
    (THREE, "battery", 736.282546, 936.094, "north west east b2"),
    (THREE, "energy", 558.131999, None, None),
    (THREE, "available", 647.331326, 1016.469, "east north b9 west"),
    (SHARED, "battery", 736.282546, 936.094, "north west east b2"),
    (SHARED, "energy", 558.131999, None, None),
    (SHARED, "available", 644.376029, None, "east west b9 north"),
    (STRONG, "battery", 1248.703167, 423.673, None),
    (STRONG, "energy", 981.311418, None, None),
    (STRONG, "available", 1152.807091, None, "east west b9 north"),
    (TABLE2, "battery", 989.768610, 731.456, "b1 west north"),
    (TABLE2, "energy", 735.897671, None, None),
    (TABLE2, "available", 863.151953, 849.662, "north b9 west"),
]


@pytest.mark.parametrize(("mission", "perspective", "hover_s", "rest_s", "way"), NUMBERS)
def test_check_numbers_of_the_longest_hover(
    mission: optuav.Mission,
    perspective: str,
    hover_s: float,
    rest_s: float | None,
    way: str | None,
) -> None:
    """Hover, rest and route of four missions in three perspectives."""
    plan = optuav.solve(mission, perspective=perspective)
    assert plan.status is Status.OPTIMAL
    assert plan.hover_time_s == pytest.approx(hover_s, abs=1.5e-6)
    assert plan.rest_time_s == pytest.approx(rest_s, abs=1e-3) if rest_s else True
    assert plan.route[1:-1] == tuple(way.split()) if way else True
    shares = {device.name: device.share for device in mission.served}
    for name, time_s in plan.hovers.items():
        assert time_s == pytest.approx(shares[name] * plan.hover_time_s, rel=1e-12)
    assert plan.flyable or perspective != "available"


@pytest.mark.parametrize(
    ("mission", "order", "hover_s"),
    [(THREE, None, 554.821), (STRONG, None, 849.828)],
)
def test_what_a_rest_between_two_hovers_gains(
    mission: optuav.Mission, order: str | None, hover_s: float
) -> None:
    """Through the wells, a rest before or after all hovers is worth little."""
    best = max(
        optuav.solve(mission, optuav.P1(order=order)).hover_time_s
        for order in ("rest-first", "hover-first")
    )
    assert best == pytest.approx(hover_s, abs=5e-4)


def test_the_direct_flight_over_three_devices() -> None:
    """(P3) is the best order without a rest."""
    direct = optuav.solve(THREE, optuav.P3())
    assert direct.hover_time_s == pytest.approx(530.844, abs=5e-4)
    assert [stop.kind for stop in direct.stops] == ["hover"] * 3
    assert direct == optuav.solve(THREE, optuav.P3())


def test_the_shortest_mission_for_a_wanted_hover() -> None:
    """(P2) for nine tenths of the longest hover, in closed form."""
    plan = optuav.solve(THREE, optuav.P2(hover_time_s=662.6542918), perspective="battery")
    assert plan.mission_time_s == pytest.approx(1079.10295, abs=1e-5)
    assert plan.hover_time_s == pytest.approx(662.6542918, abs=1e-9)


# One device


def test_one_device_in_the_list_is_the_mission_without_it() -> None:
    """The same mission, file and graph, whatever the device is called."""
    one = PAPER.replace({"devices": [{"name": "sensor", "position_m": [1000, 3000, 0]}]})
    assert one == PAPER
    assert one.to_dict() == PAPER.to_dict()
    moved = {"name": "sensor", "position_m": [1000, 3000, 0], "hover_m": [1000, 2600, 60]}
    assert PAPER.replace({"devices": [moved]}).route.hover_m == (1000.0, 2600.0, 60.0)
    assert THREE.replace({"link.device_m": [1000, 3000, 0]}) == PAPER


def test_a_wanted_hover_of_one_device() -> None:
    """The least rest that charge and deadline need, by hand and through the wells."""
    longest = optuav.solve(PAPER, perspective="battery")
    plan = optuav.solve(PAPER, optuav.P2(hover_time_s=700), perspective="battery")
    assert plan.hover_time_s == pytest.approx(700.0)
    assert 0.0 < plan.rest_time_s < longest.rest_time_s
    assert plan.soc is not None
    assert plan.soc["battery"] == pytest.approx(0.05)
    most_s = optuav.solve(PAPER).hover_time_s
    through = optuav.solve(PAPER, optuav.P2(hover_time_s=most_s - 1.0))
    assert through.flyable
    assert through.status is Status.OPTIMAL
    assert not optuav.solve(PAPER, optuav.P2(hover_time_s=most_s + 0.01))


def test_a_wanted_hover_through_the_wells_as_another_engine_finds_it() -> None:
    """CasADi comes as close as its starts let it, and never below."""
    wanted = optuav.P2(hover_time_s=600)
    plan, other = optuav.solve(THREE, wanted), optuav.solve(THREE, wanted, engine="casadi")
    assert plan.mission_time_s == pytest.approx(other.mission_time_s, abs=1e-4)
    assert plan.mission_time_s <= other.mission_time_s + 1e-9


def charging_over_one(capacity_As: float) -> optuav.Mission:
    """Two devices, of which the laser gives more than hovering takes over only one."""
    listed = THREE.to_dict()
    devices = [
        {**device, "share": share}
        for device, share in zip(listed["devices"][:2], (0.1, 0.9), strict=True)
    ]
    roofs = [listed["buildings"][k] for k in (0, 7, 8)]
    strong = {"laser.power_W": 7430, "battery.charge_current_A": 130}
    small = {"battery.capacity_As": capacity_As, "battery.available_fraction": 0.6}
    return THREE.replace({"devices": devices, "buildings": roofs, **strong, **small})


@pytest.mark.parametrize(
    ("capacity_As", "hover_s", "most_asked"),
    [(7000, 100, 4), (7000, 1296, 1), (8000, 1477, 1), (9000, 100, 0), (9000, 2000, 0)],
)
def test_a_wanted_hover_asks_an_engine_about_few_routes(
    monkeypatch: pytest.MonkeyPatch, capacity_As: float, hover_s: float, most_asked: int
) -> None:
    """Its answer is that of CasADi on each of the 20 routes."""
    mission, wanted = charging_over_one(capacity_As), optuav.P2(hover_time_s=hover_s)
    by_route = optuav.solve(mission, wanted, engine="casadi")
    asked = list[int]()

    def counted(model: Any, programmes: int, *options: Any) -> Any:
        asked.append(programmes)
        return solve_model(model, programmes, *options)

    monkeypatch.setattr(wanted_hover, "solve_model", counted)
    plan = optuav.solve(mission, wanted)
    assert sum(asked) <= most_asked
    assert plan.reasons == by_route.reasons
    if plan:
        assert plan.route == by_route.route
        assert plan.objective == pytest.approx(by_route.objective, abs=1e-6)


def test_a_hover_that_fits_on_no_route_needs_no_engine(monkeypatch: pytest.MonkeyPatch) -> None:
    """That none fits is proved by the longest hovers, of the mission whose P2 took 15 s."""

    def refused(*_: Any) -> Any:
        raise AssertionError("an engine was asked")

    monkeypatch.setattr(dispatch, "answered", refused)
    plan = optuav.solve("three-sensors", optuav.P2(hover_time_s=2600))
    assert plan.status is Status.INFEASIBLE
    assert plan.reasons == ("2600 s of hover do not fit: the longest is 2356.02 s, by P1",)


# Against an oracle that shares no code


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("energy", [False, True])
def test_linear_perspectives_against_a_programme_per_route(seed: int, energy: bool) -> None:
    """Every order of devices and place of the rest, each by HiGHS, with the reserve at landings."""
    town = random_town(seed, count=2 + seed % 2, roofs=3, always=seed % 4 > 1)
    plan = optuav.solve(town.mission(), perspective="energy" if energy else "battery")
    known = {route: town.linear(route, energy) for route in town.routes()}
    best_s = max(hover_s for hover_s, _ in known.values())
    if not math.isfinite(best_s):
        assert not plan
        return
    hover_s, rest_s = known[plan.route[1:-1]]
    assert plan.hover_time_s == pytest.approx(best_s, abs=1e-6)
    assert hover_s == pytest.approx(best_s, abs=1e-6)
    assert plan.rest_time_s == pytest.approx(rest_s, abs=1e-5)


KINDS = {"usual": (4.5e-5, 0.8), "quick": (2e-3, 0.3), "none": (0.0, 0.6)}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", [0, 1])
def test_available_against_a_dense_search(kind: str, seed: int) -> None:
    """No plan of a dense search over all routes is longer, and the plan keeps all limits."""
    rate_per_s, fraction = KINDS[kind]
    town = random_town(20 + seed, 2, 2, always=seed == 1, rate_per_s=rate_per_s, fraction=fraction)
    plan = optuav.solve(town.mission())
    assert plan.status is Status.OPTIMAL
    route = plan.route[1:-1]
    assert town.slack(route, plan.hover_time_s, plan.rest_time_s) >= -1e-9
    dense_s = max(town.available(route, points=40) for route in town.routes())
    assert plan.hover_time_s == pytest.approx(dense_s, abs=5e-3)
    assert plan.hover_time_s >= dense_s - 1e-6


def test_engines_agree_on_three_devices() -> None:
    """CVXPY, CasADi and the grid, each on all routes or all pairs of slots."""
    battery = optuav.solve(THREE, perspective="battery").hover_time_s
    by_cvxpy = optuav.solve(THREE, perspective="battery", engine="cvxpy")
    assert by_cvxpy.hover_time_s == pytest.approx(battery, abs=1e-6)
    available = optuav.solve(THREE).hover_time_s
    between = optuav.P1(order="between", device_order=("east", "north", "west"))
    by_casadi = optuav.solve(THREE, between, engine="casadi")
    assert by_casadi.hover_time_s == pytest.approx(available, abs=1e-5)
    in_slots = optuav.solve(THREE, between, slot_s=20.0)
    assert 0.0 <= available - in_slots.hover_time_s < 40.0
    assert in_slots.hover_time_s / 20.0 == pytest.approx(round(in_slots.hover_time_s / 20.0))
    assert optuav.audit(in_slots).flyable


# Theorems


def test_order_by_time_alone_where_charge_goes_with_time() -> None:
    """A.1: with one current on all legs the best route is the shortest of its kind in time."""
    town = random_town(3, 3, 3)
    plan = optuav.solve(town.mission(), perspective="battery")
    stays = plan.route[1:-1]
    roofs = [place for place in stays if place in town.roofs]

    def flight_s(route: tuple[str, ...]) -> float:
        ends = itertools.pairwise(("origin", *route, "destination"))
        return sum(town.leg_s(*pair) for pair in ends)

    alike = [r for r in town.routes() if [x for x in r if x in town.roofs] == roofs]
    assert flight_s(stays) == pytest.approx(min(map(flight_s, alike)), abs=1e-9)


@pytest.mark.parametrize("seed", range(6))
def test_only_the_front_of_flight_time_and_charge_can_be_best(seed: int) -> None:
    """A.1: of the routes by one roof, none that is worse in time and in charge hovers longest.

    Each leg has a duration and a charge of its own. Hovers follow from the closed form of A2.
    """
    rng = np.random.default_rng(seed)
    town = random_town(70 + seed, 3, 2)
    graph = optuav.graph(town.mission())
    for _, _, leg in graph.edges(data=True):
        leg["duration_s"] = float(rng.uniform(10, 80))
        leg["charge_As"] = float(rng.uniform(500, 6000))
    plan = optuav.solve(town.mission(), perspective="battery", graph=graph)

    def flight(route: tuple[str, ...]) -> tuple[float, float]:
        legs = [graph.edges[pair] for pair in itertools.pairwise(("origin", *route, "destination"))]
        return sum(leg["duration_s"] for leg in legs), sum(leg["charge_As"] for leg in legs)

    def hover_s(route: tuple[str, ...]) -> float:
        flight_s, flight_As = flight(route)
        roofs = [place for place in route if place in town.roofs]
        gain_A = town.net(roofs[0])[0] if roofs else 0.0
        draw_A = -sum(share * town.net(name)[0] for name, share in town.shares.items())
        left_s = town.deadline_s - flight_s
        left_As = (1.0 - town.min_soc) * town.capacity_As - flight_As
        if min(left_s, left_As + gain_A * left_s) < 0.0:
            return -math.inf
        return min(left_s, (left_As + gain_A * left_s) / (draw_A + gain_A))

    assert all(town.net(roof)[0] > 0.0 for roof in town.roofs)
    routes = [*town.routes()]
    roof = [place for place in plan.route if place in town.roofs]
    alike = [way for way in routes if [place for place in way if place in town.roofs] == roof]
    front = [
        way
        for way in alike
        if not any(
            all(a < b for a, b in zip(flight(other), flight(way), strict=True)) for other in alike
        )
    ]
    assert 0 < len(front) < len(alike)
    assert plan.route[1:-1] in front
    assert plan.hover_time_s == pytest.approx(max(map(hover_s, front)), abs=1e-6)
    assert plan.hover_time_s == pytest.approx(max(map(hover_s, routes)), abs=1e-6)


@pytest.mark.parametrize("seed", range(4))
def test_the_least_detour_is_the_best_place_to_rest(seed: int) -> None:
    """A.2, linear: the rest lies where Q + gT of the way over the roof grows least."""
    town = random_town(40 + seed, 3, 1)
    order = tuple(town.devices)
    mission = town.mission()
    plan = optuav.solve(mission, optuav.P4("b0", device_order=order), perspective="battery")
    gain_A, flight_A = town.net("b0")[0], town.flight[0]
    places = ("origin", *order, "destination")

    def detour(start: str, end: str) -> float:
        way = town.leg_s(start, "b0") + town.leg_s("b0", end) - town.leg_s(start, end)
        return (flight_A + gain_A) * way

    costs = [detour(*pair) for pair in itertools.pairwise(places)]
    if plan.rest_time_s > 0.0:
        assert plan.route.index("b0") - 1 == int(np.argmin(costs))


class DarkTown(Town):
    """A town whose laser sees only the roof b1."""

    def received_W(self, place: str) -> float:
        return super().received_W(place) if place == "b1" else 0.0


def test_a_roof_without_current_may_be_the_best_place_to_rest() -> None:
    """A.4: charge flows over from the bound well; only lit roofs, or no rest, lose half a minute.

    The roof is beside the hover point, and the rest draws nothing.
    """
    roofs = {"b0": (1000.0, 2300.0, 60.0), "b1": (200.0, 300.0, 60.0)}
    figures: dict[str, Any] = {"fraction": 0.5, "rate_per_s": 3e-4, "rest": (0.0, 0.0)}
    figures |= {"min_soc": 0.05, "charge_A": 5.0, "deadline_s": 1600.0}
    town = DarkTown({"d0": (1000.0, 2500.0, 50.0)}, roofs, {"d0": 1.0}, **figures)
    mission = town.mission()
    graph = optuav.graph(mission)
    for place in ("hover", "b0"):
        graph.nodes[place].update(laser_sight=False, received_power_W=0.0)
    best, lit, none = (
        optuav.solve(mission, problem, graph=graph)
        for problem in (optuav.P1(), optuav.P4("b1"), optuav.P3())
    )
    assert best.route == ("origin", "hover", "b0", "destination")
    assert best.rest_time_s > 60.0
    for plan, route in ((best, ("d0", "b0")), (lit, ("d0", "b1")), (none, ("d0",))):
        assert plan.hover_time_s == pytest.approx(town.available(route), abs=0.01)
    assert best.hover_time_s > lit.hover_time_s + 30.0 > none.hover_time_s + 30.0


@settings(max_examples=200, deadline=None)
@given(data=st.data())
def test_available_charge_falls_in_the_hover_where_hovers_draw_enough(data: st.DataObject) -> None:
    """A.6: by wells of the tests' own, against differences of two nearly equal hovers.

    y1 falls all along a hover, and at every later moment by ∂y1/∂t_u = −((1 − e)ωI_u + e(I_u +
    k'z_u)), with z = y1 − ωy at its end and e = e^(−k'τ) after the time τ; so for a fixed rest a
    longer Δ leaves less at every moment.
    """
    fraction, rate_per_s = data.draw(st.floats(0.1, 0.9)), data.draw(st.floats(1e-5, 2e-3))
    capacity_As, levels_per_s = 1000.0, rate_per_s / (fraction * (1.0 - fraction))
    least_A = rate_per_s * capacity_As
    phases = list[tuple[str, float, float]]()  # Kind, current into the battery, time or share
    for kind in data.draw(st.permutations(["hover", "hover", "hover", "rest"])):
        phases.append(("flight", -data.draw(st.floats(0.0, 3.0)), data.draw(st.floats(0.0, 20.0))))
        net_A = -least_A * data.draw(st.floats(1.0, 3.0))
        net_A = data.draw(st.floats(-0.1, 2.0)) if kind == "rest" else net_A
        phases.append((kind, net_A, data.draw(st.floats(0.1, 1.0))))
    phases.append(("flight", -1.0, 10.0))
    rest_s = data.draw(st.floats(0.0, 200.0))
    times = {"flight": 1.0, "rest": rest_s, "hover": data.draw(st.floats(0.0, 0.2)) / rate_per_s}

    def flown(hover_s: float, longer: int = -1, more_s: float = 0.0) -> list[tuple[float, float]]:
        """y1 and z at the end of every phase, one of which lasts longer."""
        wells, moments = Kibam(capacity_As, fraction, rate_per_s), list[tuple[float, float]]()
        for number, (kind, net_A, amount) in enumerate(phases):
            lasts_s = amount * {**times, "hover": hover_s}[kind]
            wells.spend(net_A, lasts_s + more_s * (number == longer), samples=4)
            y1, y2 = float(wells.y1), float(wells.y2)
            moments.append((y1, y1 - fraction * (y1 + y2)))
        return moments

    hover_s = times["hover"]
    moments = flown(hover_s)
    within = [-1e-9 <= y1 <= fraction * capacity_As + 1e-9 for y1, _ in moments]
    assume(all(within))
    step_s = 1e-4 / rate_per_s
    for number, (kind, net_A, amount) in enumerate(phases):
        if kind != "hover":
            continue
        fall_A = -net_A + levels_per_s * moments[number][1]
        assert fall_A >= -1e-9 * least_A
        wells = Kibam(capacity_As, fraction, rate_per_s)
        for before, before_A, size in phases[:number]:
            wells.spend(before_A, size * times[before])
        along = [float(wells.y1)]
        for _ in range(5):
            wells.spend(net_A, 0.2 * amount * hover_s)
            along.append(float(wells.y1))
        assert max(np.diff(along)) <= 1e-9 * capacity_As
        more, fewer = (flown(hover_s, number, sign * step_s) for sign in (1.0, -1.0))
        later_s = 0.0
        for moment in range(number, len(phases)):
            if moment > number:
                later_s += phases[moment][2] * times[phases[moment][0]]
            fade = math.exp(-levels_per_s * later_s)
            slope_A = -(1.0 - fade) * fraction * -net_A - fade * fall_A
            by_difference_A = (more[moment][0] - fewer[moment][0]) / (2.0 * step_s)
            assert by_difference_A == pytest.approx(slope_A, rel=1e-4, abs=1e-5 * least_A)
    shorter = flown(data.draw(st.floats(0.0, 1.0)) * hover_s)
    assert all(
        less[0] <= y1[0] + 1e-9 * capacity_As for less, y1 in zip(moments, shorter, strict=True)
    )


def test_available_charge_may_rise_in_a_hover_that_draws_little() -> None:
    """The condition of A.6 is needed: half of k_F B, with wells that a fast flight has drained."""
    wells = Kibam(1000.0, 0.5, 1e-3)
    wells.spend(-40.0, 12.0)
    before_As = float(wells.y1)
    wells.spend(-0.5, 10.0)
    assert 0.0 < before_As < float(wells.y1)


@pytest.mark.parametrize("seed", range(3))
def test_splitting_a_device_in_two(seed: int) -> None:
    """A.7: at the same point, the linear optimum stays, and `available` never falls."""
    town = random_town(60 + seed, 2, 3)
    whole = town.mission()
    parts = Town(**{**vars(town), "devices": {**town.devices, "d2": town.devices["d1"]}})
    share = town.shares["d1"]
    parts.shares = {"d0": town.shares["d0"], "d1": 0.3 * share, "d2": 0.7 * share}
    for perspective in ("battery", "energy"):
        one, two = (optuav.solve(x, perspective=perspective) for x in (whole, parts.mission()))
        assert two.hover_time_s == pytest.approx(one.hover_time_s, abs=1e-6)
    one, two = optuav.solve(whole), optuav.solve(parts.mission())
    assert two.hover_time_s >= one.hover_time_s - 1e-6


def test_a_device_twice_in_the_paper() -> None:
    """A.7: halves change nothing, 95 and 5 % let a rest lie between."""
    paper = optuav.load("paper")
    at_m = [1000, 3000, 0]

    def hover_s(first: float) -> float:
        shares = {"a": first, "b": 1.0 - first}
        devices = [{"name": n, "position_m": at_m, "share": s} for n, s in shares.items()]
        return optuav.solve(paper.replace({"devices": devices})).hover_time_s

    assert hover_s(0.5) == pytest.approx(597.270, abs=5e-4)
    assert hover_s(0.95) == pytest.approx(598.264, abs=5e-4)


@pytest.mark.parametrize("perspective", ["battery", "available"])
def test_order_in_the_file_and_scale_change_nothing(perspective: str) -> None:
    """A.8: permuted devices, and battery, currents and powers scaled together."""
    town = random_town(11, 3, 3)
    plan = optuav.solve(town.mission(), perspective=perspective)
    turned = Town(**{**vars(town), "devices": dict(reversed(town.devices.items()))})
    turned.shares = {name: town.shares[name] for name in turned.devices}
    other = optuav.solve(turned.mission(), perspective=perspective)
    assert other.hover_time_s == pytest.approx(plan.hover_time_s, abs=1e-6)
    assert other.route == plan.route
    longer = town.mission().replace({"limits.deadline_s": town.deadline_s + 60.0})
    assert optuav.solve(longer, perspective=perspective).hover_time_s >= plan.hover_time_s - 1e-6
    fuller = town.mission().replace({"limits.min_soc": town.min_soc - 0.05})
    assert optuav.solve(fuller, perspective=perspective).hover_time_s >= plan.hover_time_s - 1e-6


# Many routes


@pytest.mark.parametrize("perspective", ["battery", "energy", "available"])
def test_tables_of_orders_and_roofs_find_the_plan_of_all_rows(
    perspective: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Bounds leave out no best route, in any kind of question."""
    mission = random_town(5, 4, 4).mission()
    questions = (
        optuav.P1(),
        optuav.P1(order="between"),
        optuav.P1(order="hover-first"),
        optuav.P1(trajectory="direct"),
        optuav.P4("b2"),
    )
    by_rows = [optuav.solve(mission, each, perspective=perspective) for each in questions]
    for module in ("question", "device_routes", "best_plans"):
        monkeypatch.setattr(f"optuav.solving.{module}.MOST_ROWS", 8)
    for question, plan in zip(questions, by_rows, strict=True):
        other = optuav.solve(mission, question, perspective=perspective)
        assert (other.route, other.hover_time_s) == (plan.route, plan.hover_time_s)


def test_routes_are_compared_in_blocks_of_bounded_size(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two million routes whose bounds are open took 660 MB at once, in blocks 150 MB."""
    mission, sizes = random_town(4, 4, 4).mission(), list[int]()
    plan = optuav.solve(mission)
    for module in ("question", "device_routes", "best_plans"):
        monkeypatch.setattr(f"optuav.solving.{module}.MOST_ROWS", 8)
    monkeypatch.setattr(device_routes, "FIRST_ROUTES", 4)
    monkeypatch.setattr(device_routes, "MOST_AT_ONCE", 16)
    some_routes = device_routes.some_routes

    def counted(*arguments: Any) -> Any:
        sizes.append(len(arguments[2]))
        return some_routes(*arguments)

    monkeypatch.setattr(device_routes, "some_routes", counted)
    blocks = optuav.solve(mission)
    assert (blocks.route, blocks.hover_time_s) == (plan.route, plan.hover_time_s)
    assert max(sizes) == 16


def test_seven_devices_in_any_order_and_more_in_a_stated_one() -> None:
    """Two hundred thousand routes are compared; of eight devices, only along edges."""
    town = random_town(2, 7, 5, deadline_s=3600.0)
    plan = optuav.solve(town.mission(), perspective="battery")
    stays = plan.route[1:-1]
    shorter = town.linear(stays)[0]
    assert plan.hover_time_s == pytest.approx(shorter, abs=1e-6)
    for k in range(len(stays) - 1):  # No neighbours change places for a longer hover
        other = (*stays[:k], stays[k + 1], stays[k], *stays[k + 2 :])
        assert town.linear(other)[0] <= shorter + 1e-6
    eight = random_town(2, 8, 2, deadline_s=3600.0)
    with pytest.raises(InputError, match="device_order"):  # The wells are compared route by route
        optuav.solve(eight.mission())
    free = optuav.solve(eight.mission(), perspective="battery")
    order = tuple(reversed(eight.devices))
    stated = optuav.solve(eight.mission(), optuav.P1(device_order=order), perspective="battery")
    assert [name for name in stated.route if name in eight.devices] == list(order)
    assert free.hover_time_s >= stated.hover_time_s - 1e-6


# Refusals and reasons


def test_what_is_not_answered_for_several_devices_is_refused_at_once() -> None:
    """All faults in one error, each with its allowed values."""
    asked = optuav.P1(trajectory="traj1", stops=2, hovers=2, device_order=("west", "north"))
    with pytest.raises(InputError) as caught:
        optuav.solve(THREE, asked)
    keys = [fault.key for fault in caught.value.faults]
    assert {"device_order", "trajectory", "stops", "hovers"} <= {*keys}
    for question in (optuav.coverage, optuav.size_fleet, optuav.return_by):
        with pytest.raises(InputError, match="must be one device"):
            question(THREE)
    with pytest.raises(InputError, match="order = 'between': must be one of rest-first"):
        optuav.solve(PAPER, optuav.P1(order="between"))
    with pytest.raises(InputError, match="hover_time_s"):
        optuav.solve(PAPER, optuav.P2(tight=True, hover_time_s=3))


def test_a_device_out_of_reach_is_named() -> None:
    """By its own key, and with no word on the others."""
    high = THREE.replace({"devices.north.position_m": [1000, 3000, 800]})
    plan = optuav.solve(high)
    assert not plan
    (reason,) = plan.reasons
    assert reason.startswith("device north is out of reach")
    assert "devices.north.position_m" in reason
    low = THREE.replace({"devices.east.hover_m": [1582, 1915, 20]})
    assert "devices.east.hover_m is at 20 m" in optuav.solve(low).reasons[0]


# Plans and the judge


def test_the_judge_catches_every_broken_rule() -> None:
    """A device left out, hovered over twice, too short, out of reach; a rest too many."""
    hover_s = 150.0

    def kinds(*stops: optuav.Stop, mission: optuav.Mission = THREE) -> set[str]:
        verdict = optuav.audit(optuav.Itinerary(mission, stops))
        return {event.kind for event in verdict.violations}

    def hover(name: str, time_s: float = hover_s) -> optuav.Stop:
        return optuav.Stop(name, "hover", time_s)

    way = hover("east"), hover("north"), hover("west")
    assert kinds(*way) == set()
    assert kinds(*way[:2]) == {"device", "share"}
    assert kinds(way[0], way[1], way[2], hover("north", 0.0)) >= {"device"}
    assert kinds(way[0], way[1], hover("west", hover_s + 1.0)) == {"share"}
    assert kinds(way[0], way[1], hover("west", hover_s + 1e-6)) == set()
    rests = (optuav.Stop("b9", "rest", 10.0), optuav.Stop("b10", "rest", 10.0))
    assert kinds(way[0], rests[0], way[1], rests[1], way[2]) == {"rests"}
    far = THREE.replace({"devices.west.hover_m": [400, 1900, 60]})
    assert kinds(*way, mission=far) == {"coverage"}
    assert kinds(*way, optuav.Stop((900.0, 2000.0, 60.0), "hover", 1.0)) >= {"device"}


def test_a_plan_over_devices_survives_its_file(tmp_path: object) -> None:
    """Devices are in the mission of the file, and the judge agrees with what was read."""
    plan = optuav.solve(THREE, optuav.P1(device_order=("east", "north", "west")))
    read = optuav.load_plan(plan.save(f"{tmp_path}/plan.json"))
    assert read == plan
    assert read.device_order == ("east", "north", "west")
    assert optuav.audit(read).flyable


def test_an_edited_graph_over_devices_is_read_back() -> None:
    """A slow leg between two hover points is left, and a missing roof is not used."""
    graph = optuav.graph(THREE)
    assert optuav.validate_graph(graph) == ()
    graph.edges["east", "north"]["duration_s"] = 60.0
    graph.remove_node("b9")
    plan = optuav.solve(THREE, graph=graph)
    assert ("east", "north") not in {*itertools.pairwise(plan.route)}
    assert "b9" not in plan.route
    graph.nodes["west"]["share"] = 0.5
    with pytest.raises(InputError, match=r"share = .*: the shares .* change them in the mission"):
        optuav.solve(THREE, graph=graph)


def test_batches_over_the_place_of_a_device() -> None:
    """Each entry is the plan of its mission."""
    key, places_m = "devices.west.position_m[0]", [300.0, 500.0]
    arrays = optuav.batch_arrays(THREE, {key: places_m, "limits.deadline_s": [1500.0, 1800.0]})
    for row, x in enumerate(places_m):
        mission = THREE.replace({"devices.west.position_m": [x, 2600, 0]})
        plan = optuav.solve(mission)
        assert arrays["hover_time_s"][row, 1] == pytest.approx(plan.hover_time_s, abs=1e-8)
        building = arrays["building_words"][arrays["building"][row, 1]]
        assert building in plan.route
        assert arrays["order_words"][arrays["order"][row, 1]] == "between"
    with pytest.raises(InputError, match="the mission's devices are: west, north, east"):
        optuav.batch_arrays(THREE, {"devices.south.position_m[0]": [1.0]})


def test_longest_hovers_of_shares() -> None:
    """The bracket's function takes the hovers over devices as shares, with its proof."""
    from optuav.physics.kibam import Battery, Stage

    town = random_town(5, 2, 2, hover=(70.0, 1000.0), laser_W=0.0)
    flights = [Stage(-town.flight[0], time_s) for time_s in (20.0, 15.0, 12.0, 30.0)]
    battery = Battery(town.capacity_As, town.fraction, town.rate_per_s)
    limits = {"deadline_s": 2400.0, "min_soc": 0.1, "hover_current_A": 70.0}
    steps = [flights[0], ("hover", 0.3), flights[1], "rest", flights[2], ("hover", 0.7), flights[3]]
    found = optuav.longest_hovers(steps, battery=battery, rest_current_A=25.0, **limits)
    assert found.proved
    wells = battery.full
    from tests.wells import after

    hover_s, rest_s = float(found.hover_time_s), float(found.rest_time_s)
    stays = {"rest": Stage(25.0, rest_s)}
    flown = [
        stays["rest"]
        if step == "rest"
        else step
        if isinstance(step, Stage)
        else Stage(-70.0, step[1] * hover_s)
        for step in steps
    ]
    levels = [after(battery, wells, flown[:k]).available_As for k in range(1, len(flown) + 1)]
    assert min(levels) == pytest.approx(0.0, abs=1e-4)
    with pytest.raises(InputError, match=r"shares of the hover.* that add up to 1"):
        optuav.longest_hovers(
            [flights[0], ("hover", 0.3), ("hover", 0.6)], battery=battery, **limits
        )


@pytest.mark.parametrize("kind", KINDS)
def test_slots_against_all_pairs_of_slots(kind: str) -> None:
    """The grid finds the best pair of whole slots of a route, by wells of the tests' own."""
    rate_per_s, fraction = KINDS[kind]
    town = random_town(50, 3, 2, rate_per_s=rate_per_s, fraction=fraction)
    order, slot_s = ("d1", "d0", "d2"), 10.0
    question = optuav.P4("b0", order="between", device_order=order)
    plan = optuav.solve(town.mission(), question, slot_s=slot_s)
    slots = slot_s * np.arange(1.0, town.deadline_s / slot_s)
    hover_s, rest_s = np.meshgrid(slots, slots)
    ways = (order[0], "b0", *order[1:]), (*order[:2], "b0", order[2])
    best_s = max(
        float(hover_s[town.slack(way, hover_s, rest_s) >= -1e-9].max(initial=0.0)) for way in ways
    )
    assert plan.hover_time_s == pytest.approx(best_s, abs=1e-6)
    assert plan.hover_time_s > 0.0
    assert optuav.audit(plan).flyable


def test_many_routes_with_blocked_legs_are_compared_without_a_warning() -> None:
    """Legs that no route may fly have no figures; numpy says nothing of them to users."""
    at_m = np.random.default_rng(3).uniform((200, 2200), (1800, 2900), (6, 2))
    names = [f"d{k}" for k in range(len(at_m))]
    mission = PAPER.with_devices(
        {"name": names, "x_m": at_m[:, 0], "y_m": at_m[:, 1], "z_m": [0] * len(at_m)}
    )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        plan = optuav.solve(mission, perspective="energy")
    assert sorted(plan.hovers) == names


def test_repairs_count_every_order_of_the_devices() -> None:
    """The shortest deadline with a plan, to three digits, does not depend on the file's order."""
    sensors = optuav.load("three-sensors")
    short = sensors.replace({"limits.deadline_s": 20})
    devices = [device.model_dump() for device in reversed(sensors.devices)]
    known = set[str]()
    for mission in (short, short.replace({"devices": devices})):
        repairs = {repair.key: repair for repair in optuav.explain(mission).repairs}
        known.add(str(repairs["limits.deadline_s"]))
        value: Any = repairs["limits.deadline_s"].value
        assert optuav.solve(mission.replace({"limits.deadline_s": value}))
        assert not optuav.solve(mission.replace({"limits.deadline_s": value - 1.0}))
    assert len(known) == 1


def test_trajectories_are_compared_where_they_mean_something() -> None:
    """The paper's ways to choose a building go by one device."""
    compared = optuav.compare(THREE, by="trajectory", perspective="battery")
    assert [row["trajectory"] for row in compared.rows] == ["direct", "optimal"]


@pytest.mark.parametrize("perspective", ["battery", "available"])
def test_a_hover_that_is_too_long_is_told_with_the_longest(perspective: Perspective) -> None:
    """Over one device and several; a hair less has a plan."""
    for mission in (PAPER, THREE):
        longest_s = optuav.solve(mission, perspective=perspective).hover_time_s
        plan = optuav.solve(mission, optuav.P2(hover_time_s=9e4), perspective=perspective)
        assert plan.reasons == (
            f"90000 s of hover do not fit: the longest is {longest_s:.2f} s, by P1",
        )
        fits = optuav.P2(hover_time_s=longest_s - 1e-3)
        assert optuav.solve(mission, fits, perspective=perspective)


def test_a_shorter_wanted_hover_is_a_repair_like_others() -> None:
    """Rounded on the feasible side of the longest, by P1."""
    longest_s = optuav.solve("three-sensors").hover_time_s
    (first, *_) = optuav.explain("three-sensors", optuav.P2(hover_time_s=longest_s + 90)).repairs
    assert (first.key, first.comparison) == ("hover_time_s", "<=")
    assert longest_s - 1.0 <= first.value <= longest_s
