"""(P1) with several stops held against every sequence of stops, and more freedom against less."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Callable
from typing import Any

import networkx
import numpy as np
import pytest

import optuav
from optuav import Mission, Plan, SolverError
from optuav.search import branch
from optuav.status import Status
from tests.solving.sequences import (
    LINEAR,
    Town,
    edited_graph,
    longest_hovers_s,
    random_mission,
)

MOST = [*itertools.product(range(3), (1, 2))]
"""Rests and hovers at most."""
BEHIND_THE_LASER = {
    "laser.power_W": 60.0,
    "laser.position_m": [1000.0, -1500.0, 70.0],
    "buildings.b10.position_m": [1000.0, -1500.0, 60.0],
    "limits.deadline_s": 2400.0,
}
"""Changes of `paper`: the last building charges best and is too far away."""
IN_THE_WAY = {
    "buildings.b5.position_m": [500.0, 1250.0, 60.0],
    "buildings.b5.footprint_m": [200.0, 40.0],
}


def soak(parts: int, suite: range, size: int) -> list[Any]:
    """Ranges of seeds: one for the suite, and others that are larger for the soak."""
    ranges = [suite, *(range(k * size, (k + 1) * size) for k in range(parts))]
    marks: list[Any] = [[], *([pytest.mark.soak] for _ in range(parts))]
    return [
        pytest.param(each, marks=mark, id=f"{each.start}-{each.stop - 1}")
        for each, mark in zip(ranges, marks, strict=True)
    ]


def plan_with(mission: Mission, graph: Any, perspective: Any, most: tuple[int, int]) -> Plan:
    """The plan with at most so many rests and hovers."""
    problem = optuav.P1(stops=most[0], hovers=most[1])
    return optuav.solve(mission, problem, perspective=perspective, graph=graph)


def hovers_s(mission: Mission, graph: Any, perspective: str) -> dict[Any, float]:
    """Longest hover by `solve` with at most so many rests and hovers [s]; −∞ for none."""
    plans = {most: plan_with(mission, graph, perspective, most) for most in MOST}
    return {most: plan.hover_time_s if plan else -math.inf for most, plan in plans.items()}


def cut_off(mission: Mission) -> networkx.DiGraph[str]:
    graph = optuav.graph(mission)
    graph.remove_edge("origin", "b9")
    return graph


@pytest.mark.parametrize(
    ("changes", "edit", "least_s"),
    [
        pytest.param(BEHIND_THE_LASER | IN_THE_WAY, None, 616.982, id="a blocked leg"),
        pytest.param(BEHIND_THE_LASER, cut_off, 622.6545, id="a removed edge"),
    ],
)
def test_the_building_that_charges_best_is_one_of_the_sequence(
    changes: dict[str, Any], edit: Callable[[Mission], Any] | None, least_s: float
) -> None:
    """More stops gave 606.341 s, more hovers 605.632 s, where one of each gives 616.982 s."""
    mission = optuav.load("paper").replace(changes)
    graph = edit(mission) if edit else None
    expected_s = longest_hovers_s(Town(mission, graph), "battery")
    found_s = hovers_s(mission, graph, "battery")
    assert found_s == pytest.approx(expected_s, abs=1e-6)
    assert found_s[1, 1] == pytest.approx(least_s, abs=1e-3)
    assert min(found_s[most] for most in MOST if most[0]) == found_s[1, 1]


@pytest.mark.parametrize("seeds", soak(parts=20, suite=range(68, 76), size=500))
def test_linear_perspectives_find_the_best_of_all_sequences(
    seeds: range, record_property: Callable[[str, object], None]
) -> None:
    """Of random missions with blocked legs and edited graphs; more freedom never gives less."""
    several = 0
    for seed in seeds:
        random = np.random.default_rng(seed)
        mission = random_mission(random)
        graph = edited_graph(mission, random)
        perspective = LINEAR[seed % 3]
        expected_s = longest_hovers_s(Town(mission, graph), perspective)
        found_s = hovers_s(mission, graph, perspective)
        for most in MOST:
            # Rounding decides of a hover of 0 s.
            agree = math.isclose(found_s[most], expected_s[most], rel_tol=1e-9, abs_tol=1e-6)
            nothing = max(found_s[most], expected_s[most]) <= 1e-6
            assert agree or nothing, (seed, perspective, most, found_s[most], expected_s[most])
        several += expected_s[2, 2] > expected_s[1, 1] + 1e-6
    record_property("count", f"{len(seeds)} missions, more stops pay in {several}")
    assert several


BOUND_S = re.compile(r"no plan hovers longer than (\S+) s")


@pytest.mark.parametrize("seeds", soak(parts=10, suite=range(61, 63), size=60))
def test_more_freedom_never_gives_less_where_the_wells_count(
    seeds: range,
    monkeypatch: pytest.MonkeyPatch,
    record_property: Callable[[str, object], None],
) -> None:
    """Under ``available``: a proved optimum and a stated bound reach what less freedom has found.

    A search that ends early is no worse than one rest and one hover, and no plan hovers longer than
    charge alone lets it.
    """
    monkeypatch.setattr(branch, "MOST_BOXES", 2_000)
    proved = 0
    for seed in seeds:
        random = np.random.default_rng(seed)
        mission = random_mission(random)
        graph = edited_graph(mission, random)
        charge_s = longest_hovers_s(Town(mission, graph), "battery")
        least_s, most_s = dict.fromkeys(MOST, -math.inf), dict.fromkeys(MOST, -math.inf)
        for most in MOST:
            try:
                plan = plan_with(mission, graph, "available", most)
                said, least_s[most] = plan.proof, plan.hover_time_s if plan else -math.inf
                most_s[most] = least_s[most]
                proved += most != (1, 1) and plan.status is Status.OPTIMAL
            except SolverError as error:
                said, plan = str(error), None
            if plan is None or plan.status is Status.FEASIBLE:
                bound = BOUND_S.search(said)
                most_s[most] = float(bound[1]) if bound else charge_s[most]
            assert least_s[most] <= max(charge_s[most], 0.0) + 1e-6, (seed, most)
        for less, more in itertools.product(MOST, MOST):
            if less[0] <= more[0] and less[1] <= more[1]:
                assert most_s[more] >= least_s[less] - 2e-6, (seed, less, more)
                assert less != (1, 1) or least_s[more] >= least_s[less] - 2e-6, (seed, more)
    record_property("count", f"{len(seeds)} missions, {proved} searches finished")
    assert proved


def test_wells_step_by_step_take_one_rest_and_one_hover() -> None:
    """There a rest more than none gives no less either, and what charge alone gives."""
    mission = optuav.load("paper").replace(BEHIND_THE_LASER)
    graph = cut_off(mission)
    expected_s = longest_hovers_s(Town(mission, graph), "battery")
    for trajectory, most in (("direct", (0, 1)), ("optimal", (1, 1))):
        problem = optuav.P1(trajectory=trajectory)
        plan = optuav.solve(mission, problem, perspective="wells", graph=graph)
        assert plan.hover_time_s == pytest.approx(expected_s[most], abs=1e-5)
    assert expected_s[1, 1] > expected_s[0, 1]
