"""``limits.keep_soc = "always"`` in every engine, and for the judge, on random missions.

The wells and all rows of the oracle are those of `tests.search.test_brute_force`, and states of
charge those of `tests.solving.test_keep_soc`: nothing here is the package's but legs and currents.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

import optuav
from optuav import Mission
from optuav.engines.pyomo_engine import Pyomo
from optuav.network.network import build_network
from tests.engines import nl_solver
from tests.examples import few
from tests.kibam import Floats
from tests.search.test_brute_force import Everything
from tests.search.test_brute_force import random_mission as mission_of_wells
from tests.solving.sequences import random_mission
from tests.solving.test_keep_soc import ALWAYS, LINEAR, Way

SEEDS = st.integers(0, 2**32 - 1)
ROUNDED = 1e-9  # By how much a time in slots or a margin may miss its limit [-]


def hover_s(plan: optuav.Plan) -> float:
    """How long a plan hovers [s]; −∞ for none."""
    return plan.hover_time_s if plan else -math.inf


def longest_in_slots_s(way: Way, perspective: str, slot_s: float) -> float:
    """The longest hover of a route in whole slots, at least one a stay [s]: every rest is tried.

    Without a rest it may be 0, and the deadline cuts a last slot short that can be afforded whole
    (SPEC 4: min(T_max − T_fl, ⌊charge limit⌋), as printed in the paper).
    """
    taken, given = way.rates(perspective)
    limits, hover = way.mission.limits, way.places.index("hover")
    left_s = limits.deadline_s - sum(time_s for time_s, *_ in way.flown)
    rests = len(way.places) - 1
    rest_s = slot_s * np.arange(1, max(2, left_s / slot_s + 2)) if rests else np.zeros(1)
    low = np.full_like(rest_s, slot_s if rests else 0.0)
    high = left_s - rest_s if rests else np.full(1, slot_s * np.ceil(left_s / slot_s - ROUNDED))
    for number in range(len(taken)):
        spare = 1.0 - limits.min_soc - sum(taken[: number + 1]) + 0.0 * rest_s
        if rests and 1 - hover < number:
            spare += given[1 - hover] * rest_s
        rate = given[hover] if hover < number else 0.0
        if rate < 0.0:
            high = np.minimum(high, spare / -rate)
        elif rate > 0.0:
            low = np.maximum(low, -spare / rate)
        else:
            high = np.where(spare >= -ROUNDED, high, -np.inf)
    most_s = slot_s * np.floor(high / slot_s + ROUNDED)
    longest_s = np.where(most_s >= low - ROUNDED, np.minimum(most_s, left_s), -np.inf).max()
    return float(longest_s) if left_s >= 0.0 else -math.inf


@pytest.mark.campaign
@few(12, 2000)
@given(seed=SEEDS, perspective=st.sampled_from(LINEAR), slot_s=st.sampled_from([3.0, 10.0, 37.0]))
def test_linear_engines_keep_it(seed: int, perspective: Any, slot_s: float) -> None:
    """CasADi and Pyomo as a programme per route by HiGHS, the grid as all rests that are tried."""
    mission = random_mission(np.random.default_rng(seed)).replace(ALWAYS)
    routes = build_network(mission).routes
    ways = [Way(mission, k) for k in np.flatnonzero(routes.flyable).tolist()]
    longest_s = max((way.longest_s(perspective) for way in ways), default=-math.inf)
    for engine in ("casadi", Pyomo()):
        found_s = hover_s(optuav.solve(mission, perspective=perspective, engine=engine))
        assert found_s == pytest.approx(longest_s, abs=1e-3, rel=1e-7)
    slots_s = [longest_in_slots_s(way, perspective, slot_s) for way in ways]
    plan = optuav.solve(mission, perspective=perspective, engine="grid", slot_s=slot_s)
    assert hover_s(plan) == pytest.approx(max(slots_s, default=-math.inf), abs=1e-6)


def longest_by_wells_in_slots_s(mission: Mission, slot_s: float) -> float:
    """The longest hover with at most one rest in whole slots [s], of all pairs of times."""
    everything, longest_s = Everything(mission, "available"), -math.inf
    for stops in everything.sequences(1, 1):
        direct, limits = len(stops) == 1, slice(None, -1 if len(stops) == 1 else None)
        left_s = mission.limits.deadline_s
        left_s *= everything.margins(stops, np.zeros((len(stops), 1)))[-1, 0]
        if left_s < 0.0:
            continue
        times_s: Floats = slot_s * np.arange(0.0 if direct else 1.0, left_s / slot_s + 1.0)
        stays_s = np.stack(np.meshgrid(*[times_s] * len(stops))).reshape(len(stops), -1)
        fits = everything.margins(stops, stays_s)[limits].min(axis=0) >= -ROUNDED
        (hover,) = (k for k, stop in enumerate(stops) if stop.kind == "hover")
        hovers_s = np.minimum(stays_s[hover], left_s)  # without a rest, as in the linear ones
        longest_s = max(longest_s, hovers_s[fits].max(initial=-math.inf))
    return longest_s


@pytest.mark.campaign
@few(6, 2000)
@given(seed=SEEDS, slot_s=st.sampled_from([20.0, 50.0]))
def test_engines_of_the_wells_keep_it(seed: int, slot_s: float) -> None:
    """The grid as all pairs of times; the bracket no shorter; CasADi and Pyomo as the bracket."""
    mission = mission_of_wells(seed).replace(ALWAYS)
    plan = optuav.solve(mission, engine="bracket")
    assert hover_s(optuav.solve(mission)) == pytest.approx(hover_s(plan), abs=1e-6)
    in_slots_s = longest_by_wells_in_slots_s(mission, slot_s)
    searched = optuav.solve(mission, engine="grid", slot_s=slot_s)
    assert hover_s(searched) == pytest.approx(in_slots_s, abs=1e-6)
    assert in_slots_s <= hover_s(plan) + 1e-6
    assert not plan or optuav.replay(plan).flyable
    for engine in ("casadi", Pyomo(nl_solver.NAME)):
        found = optuav.solve(mission, engine=engine)
        assert hover_s(found) == pytest.approx(hover_s(plan), abs=2e-3)


@pytest.mark.campaign
@few(20, 5000)
@given(seed=SEEDS, perspective=st.sampled_from(["battery", "available"]))
def test_the_judge_catches_a_reserve_that_is_broken_by_a_millionth(
    seed: int, perspective: Any
) -> None:
    """Of any plan that is made with less, at the landing with least; less is its rounding."""
    rng = np.random.default_rng(seed)
    mission = random_mission(rng).replace({"limits.min_soc": 0.0})
    if perspective == "available":
        mission = mission_of_wells(seed).replace({"limits.min_soc": 0.0})
    routes = build_network(mission).routes
    ways = [Way(mission, k) for k in np.flatnonzero(routes.flyable).tolist()]
    plan = optuav.solve(mission, perspective=perspective)
    assume(plan)
    at = [stop.at for stop in plan.stops]
    way = next(way for way in ways if way.places == at)
    taken, given = way.rates("battery")
    stays_s = [stop.duration_s for stop in plan.stops]
    left = [
        1.0
        - sum(taken[: number + 1])
        + sum(rate * stay_s for rate, stay_s in zip(given[:number], stays_s, strict=False))
        for number in range(len(taken))
    ]
    least = min(left)
    assume(least > 1e-5)
    for over, count in ((1.001e-6, 1), (0.999e-6, 0)):
        asked = mission.replace({**ALWAYS, "limits.min_soc": least + over})
        events = optuav.replay(optuav.Itinerary(asked, plan.stops)).violations
        found = [event for event in events if event.kind == "state of charge"]
        assert len(found) == count
        for event in found:
            assert event.value == pytest.approx(least, abs=1e-9)
            assert event.time_s == pytest.approx(
                sum(time_s for time_s, *_ in way.flown[: left.index(least) + 1])
                + sum(stays_s[: left.index(least)]),
                abs=1e-6,
            )
