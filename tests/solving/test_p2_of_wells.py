"""(P2) under `available`: found by a local solver, proved where (P1) or the flight bounds it."""

from __future__ import annotations

import math

import numpy as np
import pytest

import optuav
from optuav.solving import formulate
from optuav.status import Status
from tests.solving.delivered import slack

PAPER = optuav.load("paper")
NEAR = PAPER.replace(
    {"buildings": [each for each in PAPER.to_dict()["buildings"] if each["name"] == "b1"]}
)
"""The paper's mission with a single building, aside of the way."""


def test_as_printed_the_shortest_flight_is_the_answer() -> None:
    """Direct, without rest or hover: nothing is shorter than the shortest flight."""
    plan = optuav.solve(NEAR, "P2")
    assert (plan.status, plan.rest_time_s, plan.hover_time_s) == (Status.OPTIMAL, 0.0, 0.0)
    assert plan.route == ("origin", "hover", "destination")
    assert "all unknowns are at their lower bounds" in plan.proof


def test_tight_it_is_the_longest_hover_where_that_uses_the_deadline() -> None:
    """By way of b9: 597.270 s, as (P1), which engine bracket bounds."""
    plan = optuav.solve(PAPER, optuav.P2(tight=True, trajectory="traj1"))
    assert plan.status is Status.OPTIMAL
    assert "bracket" in plan.proof
    assert plan.hover_time_s == pytest.approx(597.270, abs=5e-4)
    assert plan.mission_time_s == pytest.approx(1200.0, abs=1e-6)


def test_tight_against_a_dense_search() -> None:
    """At 690 s (P1) hovers longer, direct, and lands early: proved by the routes that rest.

    Hover times 0.1 s apart, resting all the rest of the time, by the tests' own wells.
    """
    program = formulate(NEAR.replace({"limits.deadline_s": 690.0}), "P2-tight")
    plan = program.solve()
    assert plan.status is Status.OPTIMAL
    assert any("(P1) hovers 577.52 s" in note for note in plan.notes)
    network, best_s = program.network, -math.inf
    for route, building in enumerate(network.routes.building.tolist()):
        left_s = 690.0 - network.routes.flight_time_s[route]
        hovers_s = np.arange(0.0, left_s, 0.1) if building >= 0 else np.array([left_s])
        kept = slack(network, route, hovers_s, left_s - hovers_s) >= 0.0
        best_s = max(best_s, hovers_s[kept].max(initial=-math.inf))
    assert 0.0 <= plan.hover_time_s - best_s <= 0.1


def test_an_engine_that_bounds_nothing_proves_nothing() -> None:
    """By casadi alone tight plans stay what they are: local."""
    problem = optuav.P2(tight=True, trajectory="traj1", order="hover-first")
    plan = optuav.solve(PAPER, problem, engine="casadi")
    assert plan.status is Status.LOCALLY_OPTIMAL
    assert plan.proof.startswith("local")
