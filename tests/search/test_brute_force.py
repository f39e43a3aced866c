"""Long hovers over several stops, against all plans that code of its own can find.

Legs and net currents are what the judge simulates, the wells those of `tests.kibam`, and the best
stays of a sequence come from a grid and SciPy: nothing here is the search's.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import minimize

import optuav
from optuav.mission import Mission
from optuav.options import Perspective
from optuav.plan import Plan
from optuav.search import branch
from optuav.search.branch import SearchResult
from optuav.solving import several_stops as several
from optuav.status import Status
from tests.examples import few
from tests.kibam import Floats, Kibam

SHARES = (0.0, 0.003, 0.01, 0.03, 0.1, 0.2, 0.35, 0.5, 0.75, 1.0)
"""Stays of the grid, as shares of the time that flights leave [-]."""
POLISHED = 13  # Sequences whose best plan of the grid is improved
APART = 1e-7  # Distance that SciPy keeps from limits, as it may pass them by less [-]
SAME_S = 1e-5  # A few ties of the search
EARLY = 10_000  # Boxes after which the search ends
SHORT, SHORT_S = 0.05, 1.0  # Share and time by which its answer may then fall short [-], [s]


class Everything:
    """All plans of a mission, whose charge is followed by the judge's figures."""

    def __init__(self, mission: Mission, perspective: str) -> None:
        self.mission, self.perspective = mission, perspective
        self.stops = [optuav.Stop("hover", "hover", 1.0)]
        self.stops += [optuav.Stop(name, "rest", 1.0) for name in mission.buildings.names]
        # Stages of the legs that cross no building, and of stays: net current [A], duration [s].
        self.stages: dict[tuple[str, str], list[tuple[float, float]]] = {}
        for pair in itertools.product(self.stops, repeat=2):
            for phase in optuav.replay(optuav.Itinerary(mission, dict.fromkeys(pair))).phases:
                steps = [(float(each.net[0]), float(each.duration_s)) for each in phase.stages]
                if phase.crosses < 0:
                    self.stages[phase.start.name, phase.end.name] = steps

    def sequences(self, rests: int, hovers: int) -> Iterator[list[optuav.Stop]]:
        """Stops in order, hovers among them, with legs that can be flown between them."""
        for count in range(1, rests + hovers + 1):
            for stops in itertools.product(self.stops, repeat=count):
                hovered = sum(stop.kind == "hover" for stop in stops)
                once = all(a != b for a, b in itertools.pairwise(stops))
                legs = itertools.pairwise(["origin", *(stop.at for stop in stops), "destination"])
                asked = 1 <= hovered <= hovers and count - hovered <= rests
                if once and asked and self.stages.keys() >= set(legs):
                    yield [*stops]

    def margins(self, stops: Sequence[optuav.Stop], stays_s: Floats) -> Floats:
        """Distances to all limits (limit, plan) [-], < 0 where one is violated."""
        battery, limits, nothing = self.mission.battery, self.mission.limits, 0.0 * stays_s[0]
        capacity_As, share = battery.packs * battery.capacity_As, battery.available_fraction
        wells = Kibam(capacity_As, share, battery.flow_rate_per_s)
        rows, elapsed_s, drawn_As = list[Floats](), nothing, nothing
        names = ["origin", *(stop.at for stop in stops), "destination"]
        for number, leg in enumerate(itertools.pairwise(names)):
            steps: list[tuple[float, Floats | float]] = [*self.stages[leg]]
            drawn_As = drawn_As - sum(current_A * time_s for current_A, time_s in steps)
            if limits.keep_soc == "always":
                rows.append(1.0 - drawn_As / capacity_As - limits.min_soc + nothing)
            if number < len(stops):
                ((current_A, _),) = self.stages[leg[1], leg[1]]
                steps.append((current_A, stays_s[number]))
                drawn_As = drawn_As - current_A * stays_s[number]
            for current_A, time_s in steps:
                wells.spend(current_A, time_s)
                elapsed_s = elapsed_s + time_s
                level = wells.y1 / capacity_As + nothing
                rows += [level, share - level] if self.perspective == "available" else []
        spare = 1.0 - elapsed_s / limits.deadline_s
        return np.array([*rows, wells.soc - limits.min_soc + nothing, spare])

    def longest(self, rests: int, hovers: int) -> tuple[float, list[optuav.Stop]]:
        """The longest hover found [s], and its stops with their stays; −inf without a plan."""
        tried = []
        for stops in self.sequences(rests, hovers):
            spare_s = self.margins(stops, np.zeros((len(stops), 1)))[-1, 0]
            grid = np.array([*itertools.product(SHARES, repeat=len(stops))]).T
            grid = grid[:, grid.sum(axis=0) <= 1.0] * max(spare_s, 0.0) * 0.999
            stays_s = grid * self.mission.limits.deadline_s
            score = self.score(stops, stays_s)
            tried.append((score.max(), stops, stays_s[:, score.argmax()]))
        tried.sort(key=lambda each: -each[0])
        tried[:POLISHED] = [self.polished(*each) for each in tried[:POLISHED]]
        best_s, stops, stays_s = max(tried, key=lambda each: each[0], default=(-np.inf, [], []))
        stays = zip(stops, stays_s, strict=True)
        named = [optuav.Stop(stop.at, stop.kind, float(stay_s)) for stop, stay_s in stays]
        return (best_s, named) if best_s >= 0.0 else (-np.inf, [])

    def score(self, stops: Sequence[optuav.Stop], stays_s: Floats) -> Floats:
        """Hover times of plans [s], or by how much they violate limits, < 0."""
        hover_s = stays_s[[stop.kind == "hover" for stop in stops]].sum(axis=0)
        margin = self.margins(stops, stays_s).min(axis=0)
        return np.where(margin >= 0.0, hover_s, margin)

    def polished(
        self, score: float, stops: list[optuav.Stop], stays_s: Floats
    ) -> tuple[float, list[optuav.Stop], Floats]:
        """The plan, with the stays that SciPy makes of it if they are better."""
        scale_s, hover = 100.0, np.array([stop.kind == "hover" for stop in stops], float)

        def limits(x: Floats) -> Floats:
            return self.margins(stops, scale_s * x[:, None])[:, 0] - APART

        def slopes(x: Floats) -> Floats:
            steps = np.column_stack([np.zeros(len(x)), 1e-6 * np.eye(len(x))])
            rows = self.margins(stops, scale_s * (x[:, None] + steps))
            return (rows[:, 1:] - rows[:, :1]) / 1e-6

        found = minimize(
            lambda x: -hover @ x,
            stays_s / scale_s,
            jac=lambda _: -hover,
            bounds=[(0.0, None)] * len(stops),
            constraints={"type": "ineq", "fun": limits, "jac": slopes},
            method="SLSQP",
            options={"maxiter": 40},
        )
        better_s = scale_s * np.maximum(found.x, 0.0)
        new = float(self.score(stops, better_s[:, None])[0])
        return (new, stops, better_s) if new > score else (score, stops, stays_s)


def accepted(subject: Plan | optuav.Itinerary, perspective: str) -> bool:
    """Whether the judge finds no fault but those that a perspective does not look at."""
    blind = ("empty", "full") if perspective == "battery" else ()
    return all(event.kind in blind for event in optuav.replay(subject).violations)


def random_mission(seed: int) -> Mission:
    """A mission with one to three buildings, where some of many limits bind."""
    mission, chance = optuav.load("paper"), np.random.default_rng(seed)
    chosen = chance.permutation(len(mission.buildings))[: chance.integers(1, 4)]
    return mission.replace(
        {
            "buildings": [mission.buildings[number] for number in sorted(chosen.tolist())],
            "laser.power_W": float(chance.choice([2000.0, 20000.0])),
            "limits.deadline_s": chance.uniform(200.0, 1500.0),
            "limits.min_soc": float(chance.choice([0.05, 0.4, 0.7])),
            "limits.keep_soc": ("end", "always")[seed % 2],
            "battery.capacity_As": chance.uniform(6000.0, 30000.0),
            "battery.charge_current_A": chance.uniform(10.0, 120.0),
            "battery.available_fraction": float(chance.choice([0.3, 0.6, 0.9])),
            "battery.flow_rate_per_s": float(chance.choice([4.5e-5, 5e-4, 5e-3])),
        }
    )


@pytest.mark.campaign
@pytest.mark.parametrize("perspective", ["battery", "available"])
@few(4, 200)
@given(st.integers(0, 10**6), st.sampled_from([(2, 1), (1, 2)]))
def test_no_plan_of_all_hovers_longer(
    perspective: Perspective, seed: int, most: tuple[int, int]
) -> None:
    """Whatever the judge accepts hovers no longer than the answer, which it accepts as well.

    The search alone is as good: without the plan of one rest that stands in where it is not. If it
    ends early, it is nearly as good, and its bound holds.
    """
    mission, (rests, hovers) = random_mission(seed), most
    best_s, stops = Everything(mission, perspective).longest(rests, hovers)
    assert not stops or accepted(optuav.Itinerary(mission, stops), perspective)
    results: list[SearchResult] = []

    def noted(*problem: Any, **options: Any) -> SearchResult:
        results.append(branch.search(*problem, **options))
        return results[-1]

    with patch.object(branch, "MOST_BOXES", EARLY), patch.object(several, "search", noted):
        plan = optuav.solve(mission, optuav.P1(stops=rests, hovers=hovers), perspective=perspective)
    for result in results:
        assert best_s <= result.bound_s + SAME_S
        found_s = result.stops.hover_s if result.stops else 0.0
        assert best_s <= found_s + (SHORT * best_s + SHORT_S if result.ended else SAME_S)
    if plan.status is Status.INFEASIBLE:
        assert not stops
        return
    assert accepted(plan, perspective)
    if plan.bound is None:
        assert best_s <= plan.hover_time_s + SAME_S
    else:
        assert best_s <= plan.bound + SAME_S
