"""Random missions, from file to checked plan: four engines against exact arithmetic.

A few in the suite, ten thousand in the campaign (``make soak``). Deadlines and batteries are drawn
so that time, charge, both or neither are short.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from formulations.formulation import Formulation
from formulations.p1 import P1
from formulations.p3 import P3
from formulations.p4 import P4
from optuav.errors import InputError
from optuav.mission import Mission
from optuav.options import ORDERS
from optuav.plan import Plan
from optuav.solving import Program, formulate
from optuav.solving.program import CompiledProgram
from optuav.status import Status
from tests.engines.random_missions import Exact, exact
from tests.examples import few
from tests.formulations.given import LINEAR
from tests.mission.strategies import documents

WITHIN_S = {"closed-form": 1e-6, "cvxpy": 1e-5, "casadi": 1e-4}
"""How far the Δ of an engine may be from the exact one."""
PRICED_WITHIN = {
    engine: {"rel": share, "abs": share}
    for engine, share in {"closed-form": 3e-4, "cvxpy": 3e-4, "casadi": 1e-3}.items()
}
"""How far a shadow price may be from a difference, relative to what all of its parameter brings."""
HOPELESS_S = 1e-6
"""Δ below which an engine may call a programme infeasible, and may not where it is longer."""
SLOTS_S = (0.5, 1.0, 7.0, 10.0, 60.0)


@st.composite
def questions(draw: st.DrawFn) -> tuple[Mission, dict[str, Any]]:
    """A mission that can be flown, though perhaps not in time, and options of `formulate`."""
    document = draw(documents(most_buildings=2))
    document["limits"]["deadline_s"] *= draw(st.sampled_from([1.0, 0.3, 0.1]))
    document["battery"]["capacity_As"] *= draw(st.sampled_from([1.0, 0.3, 0.1, 0.03]))
    mission = Mission.from_dict(document)
    problem: Formulation = draw(st.sampled_from([P1(), P3(), P4("b1")]))
    if isinstance(problem, P4):
        assume(mission.buildings)
        building = draw(st.sampled_from([each.name for each in mission.buildings]))
        problem = P4(building, order=draw(st.sampled_from([None, *ORDERS])))
    asked = {"problem": problem, "perspective": draw(st.sampled_from(LINEAR))}
    assume(formulate(mission, **asked).parts)
    return mission, asked


def exact_best(program: Program) -> Exact | None:
    """Longest hover over all itineraries of a program, in fractions; None if none is feasible."""
    found = [
        exact(
            part.model.row(entry),
            program.question.perspective,
            rests=any(each.name == "rest_time_s" for each in part.model.variables),
        )
        for part in program.parts
        for entry in range(len(part.routes))
    ]
    return max((each for each in found if each is not None), default=None)


def by(program: Program, engine: str, **changes: Any) -> Program:
    return replace(program, question=replace(program.question, engine=engine, **changes))


def differences(plan: Plan, truth: Exact | None, tolerance_s: float) -> Iterator[str]:
    """What is wrong with a plan in continuous times."""
    if truth is None or not plan.status.has_answer:
        hopeless = truth is None or truth.hover_s <= HOPELESS_S
        if plan.status is not Status.INFEASIBLE or not hopeless:
            yield f"{plan.status} by {plan.engine}, exactly {truth}"
    elif abs(plan.hover_time_s - float(truth.hover_s)) > tolerance_s:
        yield f"Δ = {plan.hover_time_s} s by {plan.engine}, exactly {float(truth.hover_s)} s"


def differences_in_slots(
    program: Program, plan: Plan, truth: Exact | None, slot_s: float
) -> Iterator[str]:
    """What is wrong with a plan in whole slots: it loses up to two, one of a whole horizon."""
    hover_s = 0.0 if truth is None else float(truth.hover_s)
    if truth is None and plan:
        yield f"{plan.status} in slots where nothing is feasible"
    found_s = plan.hover_time_s if plan else 0.0
    if found_s > hover_s + 1e-6:
        yield f"Δ = {found_s} s in slots, exactly {hover_s} s"
    # Whoever has to rest, and loses charge by it, loses more than time.
    if not any(np.any(_rest(part.model.parameters) < 0.0) for part in program.parts):
        bound_s = 2.0 * slot_s + 1e-6
        if hover_s - found_s > bound_s:
            yield f"Δ = {found_s} s in slots of {slot_s} s, exactly {hover_s} s"


def _rest(parameters: Any) -> Any:
    resting = [parameters[name].value for name in RESTING if name in parameters]
    return resting[0] if resting else 0.0


RESTING = ("rest_current_A", "rest_received_W")


@few(1)
@pytest.mark.campaign
@given(questions(), st.sampled_from(SLOTS_S))
def test_engines_agree_on_whole_missions(
    question: tuple[Mission, dict[str, Any]], slot_s: float
) -> None:
    """On the longest hover over all itineraries, and on whether there is one."""
    mission, asked = question
    program = formulate(mission, **asked)
    truth = exact_best(program)
    wrong = [
        what
        for engine, tolerance_s in WITHIN_S.items()
        for what in differences(by(program, engine).solve(), truth, tolerance_s)
    ]
    searched = by(program, "grid", slot_s=slot_s).solve()
    wrong += differences_in_slots(program, searched, truth, slot_s)
    assert not wrong, "\n".join(wrong)


@settings(few(3), suppress_health_check=[HealthCheck.filter_too_much])
@pytest.mark.campaign
@given(questions(), st.sampled_from(list(PRICED_WITHIN)))
def test_prices_of_whole_missions_are_differences(
    question: tuple[Mission, dict[str, Any]], engine: str
) -> None:
    """Of every parameter that the itineraries share, to either side, ties and kinks among them."""
    mission, asked = question
    program = formulate(mission, **asked)
    prices = by(program, engine).shadow_prices()
    assume(prices)
    compiled, within = program.compile("closed-form"), PRICED_WITHIN[engine]
    here_s = compiled.solve().objective[0]
    for name, value in shared_parameters(program).items():
        size = abs(value) or 1.0
        price = [size * side for side in prices[name]]
        # Over a small step rounding counts, over a large one another constraint may take over.
        assert any(
            sides_agree(price, differences_of_best(compiled, here_s, name, value, step), within)
            for step in (1e-5, 1e-4, 1e-6)
        ), f"{name} = {value}: {prices[name]} by {engine}"


def shared_parameters(program: Program) -> dict[str, float]:
    """Values of the parameters that are one number for all itineraries, by name."""
    found = {
        name: parameter.value
        for part in program.parts
        for name, parameter in part.model.parameters.items()
    }
    return {name: float(value) for name, value in found.items() if np.ndim(value) == 0}


def differences_of_best(
    compiled: CompiledProgram, here_s: float, name: str, value: float, step: float
) -> list[float]:
    """(v(p (1 ∓ step)) − v(p))/step of the best itinerary; infinite where there is none.

    NaN where p may not have such a value.
    """
    size, found = abs(value) or 1.0, []
    for sign in (-1.0, 1.0):
        try:
            there = compiled.solve(**{name: value + sign * step * size})
        except InputError:
            found.append(math.nan)
            continue
        has_answer = there.status is not Status.INFEASIBLE
        gain = float(there.objective[0] - here_s) / step if has_answer else -math.inf
        found.append(sign * gain)
    return found


def sides_agree(price: list[float], found: list[float], within: Mapping[str, float]) -> bool:
    """Whether those sides of a price that differences tell are as they have it."""
    told = [pair for pair in zip(price, found, strict=True) if not math.isnan(pair[1])]
    return [side for side, _ in told] == pytest.approx([each for _, each in told], **within)


def test_comparison_can_fail() -> None:
    """A second too much, a missing and an undue plan are told, in slots too."""
    program = formulate("paper", "P3", perspective="battery")
    truth, plan = exact_best(program), program.solve()
    assert truth is not None
    assert float(truth.hover_s) == pytest.approx(688.848, abs=1e-3)
    none = formulate(
        program.network.mission.replace({"limits.deadline_s": 60}), "P3", perspective="battery"
    ).solve()
    longer = Exact(truth.hover_s + 1, truth.rest_s)
    assert not list(differences(plan, truth, 1e-6))
    assert not list(differences(none, None, 1e-6))
    for wrong in ((plan, longer), (plan, None), (none, truth)):
        assert len(list(differences(*wrong, 1e-6))) == 1
    searched = by(program, "grid", slot_s=1.0).solve()
    assert not list(differences_in_slots(program, searched, truth, 1.0))
    for far in (truth.hover_s - 1, truth.hover_s + 2):
        other = Exact(far, truth.rest_s)
        assert len(list(differences_in_slots(program, searched, other, 1.0))) == 1
    assert len(list(differences_in_slots(program, searched, None, 1.0))) == 2
