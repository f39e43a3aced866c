"""Plans of every kind for the tests, and the battery integrated by SciPy."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache

import numpy as np
import numpy.typing as npt
from scipy.integrate import solve_ivp

import optuav
from optuav import Plan

Floats = npt.NDArray[np.float64]


@cache
def plans() -> dict[str, Plan]:
    """One of every kind, by a word for it."""
    paper, table2 = optuav.load("paper"), optuav.load("paper-table2")
    view = optuav.graph(paper)
    view.edges["origin", "b1"].update(duration_s=60.0, charge_As=5200.0, energy_J=83000.0)
    at_home = {"route.origin_m": [1000, 2800, 60], "route.hover_m": [1000, 2800, 60]}
    return {
        "optimal": optuav.solve(paper, perspective="battery"),
        "direct": optuav.solve(paper, optuav.P1(trajectory="direct"), perspective="battery"),
        "traj1": optuav.solve(paper, optuav.P1(trajectory="traj1"), perspective="battery"),
        "rest": optuav.solve(paper, optuav.P4("b3", order="hover-first"), perspective="battery"),
        "passing by": optuav.solve(
            paper.replace({"limits.deadline_s": 300}),
            optuav.P1(trajectory="traj2"),
            perspective="battery",
        ),
        "energy": optuav.solve(paper, "P3", perspective="energy"),
        "table 2": optuav.solve(table2, perspective="battery"),
        "slots": optuav.solve(table2, optuav.P4("b1"), slot_s=25.0, perspective="battery"),
        "cut short": optuav.solve(
            table2.replace({"limits.deadline_s": 800}), "P3", slot_s=1.0, perspective="battery"
        ),
        "edited": optuav.solve(
            paper, optuav.P4("b1", order="rest-first"), graph=view, perspective="battery"
        ),
        "no way to hover": optuav.solve(paper.replace(at_home), perspective="battery"),
        "no laser": optuav.solve(paper.replace({"laser": None}), perspective="battery"),
        "wind": optuav.solve(
            paper.replace({"wind.force_N": [1.5, -2, 0.5]}), perspective="battery"
        ),
        "flyable": optuav.solve(
            paper.replace({"limits.min_soc": 0.4}), "P3", perspective="battery"
        ),
        "P2": optuav.solve(paper, "P2", perspective="battery"),
        "too late": optuav.solve(paper.replace({"limits.deadline_s": 60}), perspective="battery"),
        "too heavy": optuav.solve(paper.replace({"body.mass_kg": 2}), perspective="battery"),
        "too far": optuav.solve(
            paper.replace({"link.device_m": [1000, 3000, 900]}), perspective="battery"
        ),
        "empty": optuav.solve(paper.replace({"limits.min_soc": 0.95}), "P3", perspective="battery"),
    }


def feasible() -> list[str]:
    """Kinds that have a plan, known without asking the plans."""
    return [name for name in plans() if name not in INFEASIBLE]


INFEASIBLE = ("too late", "too heavy", "too far", "empty")


def available_by_integration(plan: Plan, samples: int = 200) -> Iterator[tuple[Floats, Floats]]:
    """Moments [s] and the available well [A s] in every stage, by (11)-(12) and `solve_ivp`."""
    given = plan.mission.battery
    B, ω, k = given.packs * given.capacity_As, given.available_fraction, given.flow_rate_per_s
    wells, start_s = np.array([ω * B, (1 - ω) * B]), 0.0
    for current_A, duration_s in [
        (stage.current_A, stage.duration_s) for phase in plan.phases for stage in phase.stages
    ]:
        if not duration_s:
            continue

        def slope(_: float, y: Floats, current_A: float = current_A) -> list[float]:
            flow_A = k * (y[1] / (1 - ω) - y[0] / ω)
            return [current_A + flow_A, -flow_A]

        moments_s = np.linspace(0.0, duration_s, samples)
        result = solve_ivp(
            slope,
            (0.0, duration_s),
            wells,
            method="LSODA",
            t_eval=moments_s,
            rtol=1e-11,
            atol=1e-10 * B,
        )
        yield start_s + moments_s, result.y[0]
        wells, start_s = result.y[:, -1], start_s + duration_s
