"""(P1) over all routes as one linear model: the best route, and how tight the relaxations are."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from formulations.milp import FORMS, Form, Route, route_choice
from formulations.parameters import Quantities
from optuav.engines.cvxpy_engine import Cvxpy, CvxpyProgramme
from optuav.modelling import evaluate

both_forms = pytest.mark.parametrize("form", FORMS)
CAPACITY_AS, DEADLINE_S = 1000.0, 100.0


def route(name: str, flight_s: float, drawn_As: float, hover_A: float, rest_A: float) -> Route:
    """A route without a rest where its current is 0."""
    given = Quantities(
        deadline_s=DEADLINE_S,
        min_soc=0.1,
        packs=1.0,
        capacity_As=CAPACITY_AS,
        nominal_voltage_V=10.0,
        flight_time_s=flight_s,
        flight_charge_As=drawn_As,
        flight_energy_J=10.0 * drawn_As,
        hover_current_A=hover_A,
        hover_power_W=10.0 * hover_A,
        hover_received_W=0.0,
        rest_current_A=rest_A,
        rest_received_W=10.0 * rest_A,
        hover_distance_m=1.0,
        coverage_radius_m=2.0,
        hover_altitude_m=50.0,
        min_altitude_m=10.0,
        max_altitude_m=100.0,
        end_gap_m=0.0,
        rests=rest_A > 0.0,
    )
    return Route(name, given)


def routes(seed: int) -> list[Route]:
    """One without and three with a rest."""
    rng = np.random.default_rng(seed)
    found = [route("direct", 10.0, rng.uniform(200.0, 700.0), 20.0, 0.0)]
    for number in range(3):
        flight_s, drawn_As, rest_A = rng.uniform((10.0, 200.0, 1.0), (40.0, 700.0, 15.0))
        found.append(route(f"roof {number}", flight_s, drawn_As, 20.0, rest_A))
    return found


def longest_s(given: Quantities) -> float:
    """Hover until 0.9 B are drawn, or rest until the deadline leaves just what was charged."""
    left_s, spare_As = DEADLINE_S - given.flight_time_s, 0.9 * CAPACITY_AS - given.flight_charge_As
    rest_s = max(0.0, given.hover_current_A * left_s - spare_As)
    rest_s /= given.hover_current_A + given.rest_current_A
    if not given.rests:
        return float(min(left_s, spare_As / given.hover_current_A))
    return float(left_s - rest_s)


def bound_s(some: Sequence[Route], form: Form) -> float:
    relaxed = route_choice(some, "battery", form, relaxed=True)
    return float(Cvxpy().solve(relaxed, 1).objective[0])


@both_forms
@pytest.mark.parametrize("seed", range(2))
def test_best_route_is_found(form: Form, seed: int) -> None:
    """As arithmetic tells route by route; the others are switched off."""
    some = routes(seed)
    alone = [longest_s(each.given) for each in some]
    found = Cvxpy().solve(route_choice(some, "battery", form), 1)
    point = found.point(0)
    assert found.objective[0] == pytest.approx(max(alone), abs=1e-6)
    choices = [point[f"choice[{number}]"] for number in range(1, len(some) + 1)]
    assert choices == [float(value == max(alone)) for value in alone]
    assert min(float(slack[0]) for slack in found.slacks.values()) > -1e-7


@pytest.mark.parametrize("seed", range(4))
def test_relaxed_hull_is_exact_and_relaxed_big_m_a_bound(seed: int) -> None:
    """Half of two routes is no better than the better one; a slackened row may be."""
    some = routes(seed)
    best_s = max(longest_s(each.given) for each in some)
    assert bound_s(some, "hull") == pytest.approx(best_s, abs=1e-6)
    assert bound_s(some, "big-M") >= best_s - 1e-6


def test_big_m_is_no_larger_than_the_deadline_needs() -> None:
    """Two routes alike but for 10 s of flight: half of each leaves the mean, and M their range."""
    some = [route("short", 10.0, 100.0, 1.0, 0.0), route("long", 20.0, 100.0, 1.0, 0.0)]
    assert bound_s(some, "big-M") == pytest.approx(90.0)
    large = route_choice(some, "battery", "big-M")
    tightest = {each.name: each for each in large.lets}
    assert evaluate(tightest["M2 of P1.d hover time, long"], {}) == pytest.approx(10.0)
    assert evaluate(tightest["M2 of P1.d hover time, short"], {}) == pytest.approx(0.0)


@both_forms
def test_a_route_without_a_rest_does_not_rest(form: Form) -> None:
    some = [route("direct", 10.0, 0.0, 10.0, 0.0), route("roof", 40.0, 600.0, 20.0, 1.0)]
    point = Cvxpy().solve(route_choice(some, "battery", form), 1).point(0)
    found = point["hover_time_s"], point["rest_time_s"], point["choice[1]"]
    assert found == pytest.approx((90.0, 0.0, 1.0))


@both_forms
def test_of_equal_plans_the_shortest_mission_and_then_the_first_route(form: Form) -> None:
    """80 s on each; the second and third take as long, the first flies 5 s longer."""
    some = [
        route(name, flight_s, 100.0, 10.0, 0.0)
        for name, flight_s in (("late", 15.0), ("first", 10.0), ("second", 10.0))
    ]
    point = Cvxpy().solve(route_choice(some, "battery", form), 1).point(0)
    assert [point[f"choice[{k}]"] for k in (1, 2, 3)] == [0.0, 1.0, 0.0]


@both_forms
def test_parameters_keep_their_names_where_all_routes_share_them(form: Form) -> None:
    """The deadline is one number for all; charges are told apart, and a change of one counts."""
    some = [route("direct", 10.0, 100.0, 10.0, 0.0), route("roof", 40.0, 600.0, 20.0, 1.0)]
    model = route_choice(some, "battery", form)
    assert {"deadline_s", "flight_charge_As[1]", "flight_charge_As[2]"} <= model.parameters.keys()
    assert model.parameters.keys().isdisjoint({"deadline_s[1]", "flight_charge_As"})
    found = CvxpyProgramme(model).solve({"flight_charge_As[1]": 400.0})
    assert found.objective[0] == pytest.approx(50.0)


def test_a_last_slot_may_be_cut_short() -> None:
    """Of 90 s at 20 s a slot: the end of the fifth slot, less the 10 s that the deadline cuts."""
    whole = route("direct", 10.0, 100.0, 1.0, 0.0)
    some = [
        Route("direct", whole.given, hover_s=(0.0, 80.0)),
        Route("direct, cut", whole.given, hover_s=(100.0, 100.0), cut_s=10.0),
    ]
    for form in FORMS:
        found = Cvxpy().solve(route_choice(some, "battery", form), 1)
        assert found.objective[0] == pytest.approx(90.0)
        assert found.point(0)["choice[2]"] == 1.0
