"""Several devices in every engine, and for the judge, on random missions.

The oracle is `tests.solving.devices`: every order of the devices and every place of the rest, by
legs, light and wells of its own.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import optuav
from optuav import P1, P4, Itinerary, Plan, Stop
from optuav.options import Order, Perspective
from tests.examples import few
from tests.solving.devices import Town, random_town

SEEDS = st.integers(0, 2**32 - 1)
WELLS = st.sampled_from([(4.5e-5, 0.8), (2e-3, 0.3), (0.0, 0.6)])
SLOT_S = 40.0


def town_of(seed: int, count: int, roofs: int, wells: tuple[float, float], *, always: bool) -> Town:
    """A town with wells of its own."""
    rate_per_s, fraction = wells
    changes = {"rate_per_s": rate_per_s, "fraction": fraction, "always": always}
    return random_town(seed, count, roofs, **changes)


def stated(plan: Plan) -> P1 | P4:
    """The question for a plan's own order of devices; with a rest, for its roof and its place."""
    order = tuple(place for place in plan.route if place in plan.hovers)
    rests = [place for place in plan.route[1:-1] if place not in plan.hovers]
    if not rests:
        return P1(trajectory="direct", device_order=order)
    before = plan.route.index(rests[0]) - 1
    where: Order = "between"
    if before in (0, len(order)):
        where = "hover-first" if before else "rest-first"
    return P4(rests[0], order=where, device_order=order)


@pytest.mark.campaign
@few(6)
@given(SEEDS, st.integers(2, 5), st.integers(0, 3), st.booleans(), st.booleans())
def test_linear_perspectives_are_the_best_of_all_routes(
    seed: int, count: int, roofs: int, always: bool, energy: bool
) -> None:
    """A programme per route by HiGHS, a mixed-integer one by CVXPY, and one along the edges."""
    count = count if seed % 8 == 0 else min(count, 3)  # 480 programmes a mission with five
    town = town_of(seed, count, roofs, (4.5e-5, 0.8), always=always)
    perspective: Perspective = "energy" if energy else "battery"
    plan = optuav.solve(town.mission(), perspective=perspective)
    best_s = max(town.linear(route, energy)[0] for route in town.routes())
    if not math.isfinite(best_s):
        assert not plan
        return
    assert plan.hover_time_s == pytest.approx(best_s, abs=1e-6)
    shares = {name: share * plan.hover_time_s for name, share in town.shares.items()}
    assert plan.hovers == pytest.approx(shares, abs=1e-6)
    by_cvxpy = optuav.solve(town.mission(), perspective=perspective, engine="cvxpy")
    assert by_cvxpy.hover_time_s == pytest.approx(best_s, abs=1e-5)


@pytest.mark.campaign
@few(4)
@given(SEEDS, st.integers(2, 5), st.integers(1, 3), WELLS, st.booleans())
def test_available_in_all_engines_and_for_the_judge(
    seed: int, count: int, roofs: int, wells: tuple[float, float], always: bool
) -> None:
    """The plan keeps all limits; CasADi on its route and the grid in slots find nothing longer."""
    town = town_of(seed, count, roofs, wells, always=always)
    mission = town.mission()
    plan = optuav.solve(mission)
    if not plan:
        rest_s = np.linspace(0.0, town.deadline_s, 200)
        assert all(town.slack(route, 0.0, rest_s).max() < 0.0 for route in town.routes())
        return
    charge = optuav.solve(mission, perspective="battery")
    route = plan.route[1:-1]
    assert plan.flyable
    assert town.slack(route, plan.hover_time_s, plan.rest_time_s) >= -1e-9
    assert plan.hover_time_s <= charge.hover_time_s + 1e-6
    by_casadi = optuav.solve(mission, stated(plan), engine="casadi")
    assert by_casadi.hover_time_s <= plan.hover_time_s + 2e-3
    in_slots = optuav.solve(mission, stated(plan), slot_s=SLOT_S)
    if in_slots:
        assert in_slots.hover_time_s <= plan.hover_time_s + 1e-6
        assert optuav.audit(in_slots).flyable
    own_s = town.available(route, points=40)
    assert own_s <= plan.hover_time_s + 1e-6


@pytest.mark.campaign
@few(4)
@given(SEEDS, st.integers(2, 5), st.integers(0, 4))
def test_the_judge_catches_what_breaks_a_rule(seed: int, count: int, fault: int) -> None:
    """A device left out, hovered over twice, too short, out of reach, or a second rest."""
    town = replace(random_town(seed, count, 3), min_soc=0.0, capacity_As=7.2e6, deadline_s=1e5)
    mission = town.mission()
    stops = [Stop(name, "hover", share * 200.0) for name, share in town.shares.items()]
    at = seed % count
    name, _, stay_s = stops[at].at, stops[at].kind, stops[at].duration_s
    assert not optuav.audit(Itinerary(mission, tuple(stops))).violations
    expected = "share"
    if fault == 0:
        del stops[at]
        expected = "device"
    elif fault == 1:
        stops += [Stop(stops[at - 1].at, "hover", 0.0)]
        expected = "device"
    elif fault == 2:
        stops[at] = Stop(name, "hover", stay_s - 1e-3)
    elif fault == 3:
        x, y, z = town.devices[str(name)]
        away = {f"devices.{name}.hover_m": [x + 3000.0, y, z]}
        mission, expected = mission.replace(away), "coverage"
    else:
        stops = [Stop("b0", "rest", 5.0), *stops, Stop("b1", "rest", 5.0)]
        expected = "rests"
    kinds = {event.kind for event in optuav.audit(Itinerary(mission, tuple(stops))).violations}
    assert expected in kinds
