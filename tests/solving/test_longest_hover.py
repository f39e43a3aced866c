"""The plan of `solve` is that of the engine which answers all routes, and that of a batch."""

from __future__ import annotations

import random
from typing import Any

import numpy as np
import pytest

import optuav
from optuav import P1, P3, P4
from optuav.engines.registry import AUTO
from optuav.mission import Mission
from optuav.solving.longest_hover import longest_hover
from optuav.solving.program import best_plan, declared_program
from optuav.solving.question import checked_question
from optuav.status import Status

BASES = [optuav.load(name) for name in ("paper-table2", "matrice350")]
PROBLEMS = (P1(), P3(), P4("r2"), P1(order="hover-first"), P1(trajectory="traj2"))


def drawn(seed: int) -> Mission:
    """A small town, its reserve kept always or at the end, charged at constant current or not."""
    draw, base = random.Random(seed), BASES[seed % 2]
    (town,) = optuav.layouts(base, 1, "uniform", buildings=6, seed=seed)
    return town.replace(
        {
            "limits.deadline_s": draw.uniform(200.0, 3500.0),
            "limits.keep_soc": draw.choice(["end", "always"]),
            "battery.capacity_As": base.battery.capacity_As * draw.uniform(0.4, 2.0),
            "battery.flow_rate_per_s": 10.0 ** draw.uniform(-5.0, -2.5),
            "battery.charging": draw.choice(["constant", "constant", "taper"]),
            "start.soc": draw.uniform(0.6, 1.0),
        }
    )


@pytest.mark.parametrize("perspective", ["battery", "energy", "adjusted", "available"])
@pytest.mark.parametrize("seed", range(4))
def test_the_plan_is_that_of_the_engine_over_all_routes(seed: int, perspective: Any) -> None:
    """Times, status and proof, what binds and what the notes and the reasons say."""
    mission = drawn(seed)
    for problem in PROBLEMS:
        program = optuav.formulate(mission, problem, perspective=perspective)
        plan, own = program.solve(), program.plan_of_engine()
        for name in ("status", "engine", "proof", "reasons", "binding", "notes", "flyable"):
            assert getattr(plan, name) == getattr(own, name), name
        if not plan:
            continue
        assert plan.route == own.route
        assert plan == own


@pytest.mark.parametrize("perspective", ["battery", "available"])
@pytest.mark.parametrize("seed", [4, 5])
def test_the_times_are_those_of_a_batch(seed: int, perspective: Any) -> None:
    """To rounding; through the wells to the last bit, with the bound of an answer not proved."""
    mission = drawn(seed)
    arrays = optuav.batch_arrays(mission, {}, perspective=perspective)
    plan = optuav.solve(mission, perspective=perspective)
    assert arrays["status_words"][arrays["status"]] == plan.status.value
    for name in ("hover_time_s", "rest_time_s", "bound"):
        stated = getattr(plan, name) if plan else None
        stated = np.nan if stated is None else stated
        within_s = 0.0 if perspective == "available" else 1e-9
        np.testing.assert_allclose(arrays[name], stated, rtol=0.0, atol=within_s)


def test_a_bound_of_a_plan_that_is_not_proved_is_in_a_batch_too() -> None:
    """Charging tapers: what constant current allows bounds the hover."""
    for seed in range(40):
        mission = drawn(seed)
        if mission.battery.charging == "taper":
            plan = optuav.solve(mission)
            if plan and plan.status is Status.FEASIBLE:
                arrays = optuav.batch_arrays(mission, {})
                assert float(arrays["bound"]) == pytest.approx(plan.bound, rel=1e-12)
                return
    pytest.fail("no such mission was drawn")


def test_other_questions_are_left_to_an_engine() -> None:
    """Other problems, slots, a named engine, wells step by step, and a mission without a plan."""
    paper = optuav.load("paper")
    network = optuav.formulate(paper).network
    asked: list[dict[str, Any]] = [
        {"problem": "P2", "perspective": "battery"},
        {"slot_s": 60.0},
        {"engine": "bracket"},
        {"perspective": "wells"},
    ]
    for options in asked:
        assert longest_hover(checked_question(paper, **options), network) is None
    late = paper.replace({"limits.deadline_s": 1.0})
    program = optuav.formulate(late)
    assert program.question.engine == AUTO
    assert longest_hover(program.question, program.network) is None
    assert best_plan(program.question, program.network) == program.plan_of_engine()


def test_a_model_that_was_changed_is_solved_as_it_is() -> None:
    """Not as its problem says."""
    question = checked_question(optuav.load("paper"), P3(), "battery")
    network = optuav.formulate("paper").network
    program = declared_program(question, network)
    model = program.parts[0].model
    model.subject_to("at most 100 s", model.variables[0] <= 100.0, unit="s")
    assert program.solve().hover_time_s == pytest.approx(100.0, abs=1e-9)
