"""Several stops on random small missions: every answer is proved, and the judge accepts it."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import optuav
from optuav.mission import Mission
from optuav.status import Status
from tests.solving.test_sequences import soak

PAPER = optuav.load("paper")
LEVELLING = {"nothing flows": (0.0, 0.0), "slow": (4.5e-5, 2e-4), "quick": (5e-4, 6e-3)}
"""Least and largest flow rate between the wells [1/s]."""


def random_mission(seed: int) -> tuple[Mission, Any]:
    """One to three roofs, any of many limits that bind, and legs that break triangles."""
    random = np.random.default_rng(seed)
    least, most = [*LEVELLING.values()][seed % 3]
    chosen = sorted(random.permutation(10)[: random.integers(1, 4)].tolist())
    mission = PAPER.replace(
        {
            "buildings": [PAPER.buildings[number] for number in chosen],
            "laser.power_W": float(random.choice([2000.0, 20_000.0])),
            "limits.deadline_s": random.uniform(200.0, 1800.0),
            "limits.min_soc": float(random.choice([0.05, 0.4, 0.7])),
            "limits.keep_soc": ("end", "always")[seed % 2],
            "battery.capacity_As": random.uniform(6000.0, 36_000.0),
            "battery.charge_current_A": random.uniform(10.0, 120.0),
            "battery.available_fraction": random.uniform(0.1, 0.9),
            "battery.flow_rate_per_s": least * (most / least) ** random.random() if least else 0.0,
            "battery.charging": ("constant", "taper")[seed % 5 == 4],
        }
    )
    graph = optuav.graph(mission)
    for way in [*graph.edges]:
        if random.random() < 0.1:
            graph.remove_edge(*way)
        elif random.random() < 0.4:
            for figure in ("duration_s", "charge_As", "energy_J"):
                graph.edges[way][figure] *= random.uniform(0.2, 2.5)
    return mission, graph if seed % 4 else None


@pytest.mark.parametrize("seeds", soak(parts=10, suite=range(6), size=50))
def test_every_answer_is_proved(
    seeds: range, record_property: Callable[[str, object], None]
) -> None:
    """With up to three rests and hovers; never less than one of each.

    What is said to be impossible has no plan with one rest and one hover either.
    """
    for seed in seeds:
        mission, graph = random_mission(seed)
        problem = optuav.P1(stops=2 + seed % 2, hovers=2 + seed // 2 % 2)
        plan = optuav.solve(mission, problem, perspective="available", graph=graph)
        one = optuav.solve(mission, perspective="available", graph=graph)
        least_s = one.hover_time_s if one else -math.inf
        assert (plan.hover_time_s if plan else -math.inf) >= least_s - 2e-6, seed
        assert not plan or optuav.audit(plan).flyable, seed
        assert plan.status is not Status.FEASIBLE, seed
    record_property("count", f"{len(seeds)} missions, all proved")
