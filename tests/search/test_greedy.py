"""Long missions: known figures, the bound against the search and against random plans."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import optuav
from optuav.network.network import build_network
from optuav.network.one_stop import all_legs
from optuav.search.branch import TIE_S, search
from optuav.search.greedy import greedy, hover_bound_s
from optuav.search.plans import slack
from optuav.search.terrain import Terrain
from optuav.solving.several_stops import terrain
from tests.examples import few


def of_paper(**changes: object) -> Terrain:
    """The arrays of `paper` with other values."""
    stated = {key.replace("__", "."): value for key, value in changes.items()}
    network = build_network(optuav.load("paper").replace(stated))
    return terrain(replace(network, legs=all_legs(network)))


def test_eight_hours_of_paper() -> None:
    """The figures that independent code found: 3277.31 s of 3305.80 s."""
    day = of_paper(limits__deadline_s=28_800.0)
    plan = greedy(day, 100, 100)
    assert plan is not None
    assert plan.hover_s == pytest.approx(3277.31, abs=5e-3)
    assert hover_bound_s(day, 100, 100) == pytest.approx(3305.80, abs=5e-3)


@pytest.mark.campaign
@few(4, 100)
@given(st.integers(0, 10**6))
def test_the_bound_holds_and_greedy_plans_are_feasible(seed: int) -> None:
    """Random batteries and deadlines: greedy ≤ search ≤ bound; no limit breaks."""
    random = np.random.default_rng(seed)
    day = of_paper(
        limits__deadline_s=float(random.uniform(300, 6000)),
        limits__min_soc=float(random.choice([0.0, 0.05, 0.2])),
        battery__capacity_As=float(random.uniform(8_000, 40_000)),
        battery__available_fraction=float(random.uniform(0.2, 0.9)),
        battery__flow_rate_per_s=float(10 ** random.uniform(-5, -3)),
    )
    rests, hovers = int(random.integers(1, 3)), int(random.integers(1, 3))
    plan, bound_s = greedy(day, rests, hovers), hover_bound_s(day, rests, hovers)
    found = search(day, rests, hovers, time_limit_s=0.5)
    if found.stops is not None:
        assert found.stops.hover_s <= bound_s + TIE_S
    if plan is not None:
        assert plan.hover_s <= min(found.bound_s, bound_s) + TIE_S
        left_As = slack(day, plan.places[:, None], plan.stays_s[:, None])[0]
        assert left_As >= -1e-6 * float(day.battery.capacity_As)
        ways = zip(plan.places[:-1], plan.places[1:], strict=True)
        flown_s = sum(float(day.duration_s[way]) for way in ways)
        assert flown_s + plan.stays_s.sum() <= day.deadline_s + 1e-6


def test_no_plan_without_a_hover_that_draws_or_a_way_there() -> None:
    """A hover that charges is no day of visits, and has no bound by charge."""
    day = of_paper(limits__deadline_s=28_800.0)
    lit = replace(day, stay_current_A=np.abs(day.stay_current_A))
    assert greedy(lit, 5, 5) is None
    assert hover_bound_s(lit, 5, 5) == math.inf
    nowhere = replace(day, duration_s=np.full_like(day.duration_s, np.inf))
    assert greedy(nowhere, 5, 5) is None
