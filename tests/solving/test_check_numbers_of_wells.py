"""The specification's check numbers for `available`: by every engine, and by integration alone."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import optuav
from optuav import Plan
from optuav.engines.casadi_engine import Casadi
from optuav.modelling import Model
from optuav.physics.kibam import Battery, Stage, step
from tests.asking import solve
from tests.kibam import Floats

PAPER = optuav.load("paper")
NUMBERS = [
    ({"problem": "P3"}, 577.524),
    ({"problem": "P4", "building": "b9", "order": "hover-first"}, 597.270),
    ({"problem": "P4", "building": "b10", "order": "hover-first"}, 597.270),
]
"""What is asked of `paper` at 1200 s, and Δ [s]."""
SLOT_S = 1.0
B, SHARE, FLOW = 72_000.0, 0.8, 4.5e-5


@pytest.mark.parametrize(("asked", "hover_s"), NUMBERS, ids=["direct", "b9", "b10"])
@pytest.mark.parametrize("engine", ["bracket", "casadi"])
def test_by_engine(engine: str, asked: dict[str, Any], hover_s: float) -> None:
    """In continuous times, to the digits printed."""
    plan = solve(PAPER, engine=engine, **asked)
    assert plan.engine == engine
    assert plan.hover_time_s == pytest.approx(hover_s, abs=5e-4)
    assert plan.flyable


@pytest.mark.parametrize(("asked", "hover_s"), NUMBERS, ids=["direct", "b9", "b10"])
def test_by_grid(asked: dict[str, Any], hover_s: float) -> None:
    """In whole seconds: the last one that is not longer."""
    plan = solve(PAPER, engine="grid", slot_s=SLOT_S, **asked)
    assert plan.hover_time_s == np.floor(hover_s)
    assert plan.flyable


@pytest.mark.parametrize(
    ("deadline_s", "options", "hover_s"),
    [
        (1200.0, {"stops": 2}, 605.456),
        pytest.param(1200.0, {"hovers": 2}, 598.976, marks=pytest.mark.soak),
        (2400.0, {"hovers": 2}, 742.834),
    ],
)
def test_several_stops_by_casadi(
    deadline_s: float, options: dict[str, int], hover_s: float
) -> None:
    """Along the places of the plan found by the search, a local solver finds the same times."""
    mission = PAPER.replace({"limits.deadline_s": deadline_s})
    plan = solve(mission, **options)
    assert plan.hover_time_s == pytest.approx(hover_s, abs=5e-4)
    found = Casadi().solve(along(plan, deadline_s), 1)
    assert found.objective[0] == pytest.approx(hover_s, abs=5e-4)


def along(plan: Plan, deadline_s: float) -> Model:
    """The longest hover along the places of a plan, stated anew: a time for every stay."""
    model = Model("stays along a way")
    battery = Battery(B, SHARE, FLOW)
    wells, used_s, hovered_s = battery.full, 0.0, 0.0
    for number, phase in enumerate(plan.phases):
        if phase.kind == "flight":
            for stage in phase.stages:
                wells = step(battery, wells, Stage(stage.current_A, stage.duration_s))
            used_s = used_s + phase.duration_s
        else:
            stay = model.variable(f"t{number}", f"t{number}", unit="s", upper=deadline_s)
            wells = step(battery, wells, Stage(phase.stages[0].current_A, stay))
            used_s = used_s + stay
            hovered_s = hovered_s + (stay if phase.kind == "hover" else 0.0)
        share = wells.available_As / B
        if number:  # the first leg leaves nothing to choose
            model.subject_to(f"not dry {number}", share >= 0.0)
            model.subject_to(f"not past full {number}", share <= SHARE)
    model.subject_to("charge", (wells.available_As + wells.bound_As) / B >= 0.05)
    model.subject_to("deadline", used_s <= deadline_s)
    model.maximise(hovered_s)
    return model


@pytest.mark.parametrize(("asked", "hover_s"), NUMBERS, ids=["direct", "b9", "b10"])
def test_by_integration_on_a_dense_grid(asked: dict[str, Any], hover_s: float) -> None:
    """Of times 1 ms apart the longest that the differential equations let the UAV fly."""
    plan = solve(PAPER, **asked)
    hovers_s = np.concatenate([np.arange(0.0, 1100.0, 50.0), hover_s + 1e-3 * np.arange(-6, 7)])
    rests_s = np.zeros(1)
    if plan.rest_time_s:
        rests_s = np.concatenate([np.linspace(0.0, 600.0, 25), plan.rest_time_s + np.arange(2.0)])
    kept = flown(plan, hovers_s[:, None], rests_s[None])
    assert hovers_s[kept.any(axis=1)].max() == pytest.approx(hover_s, abs=1.1e-3)


def flown(plan: Plan, hover_s: Floats, rest_s: Floats, looks: int = 12) -> Any:
    """Which stays can be flown along the plan's places, every stretch looked at several times."""
    cells = np.broadcast_shapes(hover_s.shape, rest_s.shape)
    times_s = {"hover": hover_s, "rest": rest_s}
    wells = np.concatenate([np.full(cells, SHARE).ravel(), np.full(cells, 1.0 - SHARE).ravel()])
    kept, used_s = np.ones(cells, bool), np.zeros(cells)
    for phase in plan.phases:
        for stage in phase.stages:
            stay_s = times_s.get(phase.kind, np.array(stage.duration_s))
            seconds = np.broadcast_to(stay_s, cells)
            levels = integrated(wells, stage.current_A / B, seconds.ravel(), looks)
            y1 = levels[: seconds.size].reshape(*cells, looks)
            kept &= (y1 >= -1e-9).all(axis=-1) & (y1 <= SHARE + 1e-9).all(axis=-1)
            wells, used_s = levels[:, -1], used_s + seconds
    return kept & (wells.reshape(2, *cells).sum(axis=0) >= 0.05) & (used_s <= 1200.0)


def integrated(wells: Floats, current: float, seconds: Floats, looks: int) -> Floats:
    """Shares of the capacity in both wells over stretches of unlike durations, side by side."""

    def slope(_: float, y: Floats) -> Floats:
        first, second = np.split(y, 2)
        flow = FLOW * (second / (1.0 - SHARE) - first / SHARE)
        return np.concatenate([seconds * (current + flow), -seconds * flow])

    moments: Sequence[float] = np.linspace(0.0, 1.0, looks)
    found = solve_ivp(slope, (0.0, 1.0), wells, t_eval=moments, rtol=1e-9, atol=1e-12)
    return np.asarray(found.y)
