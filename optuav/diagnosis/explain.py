"""`optuav.explain`: why this optimum, why none, and what would help."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from formulations.formulation import Formulation
from formulations.p1 import P1
from formulations.wells import StepEnd
from optuav.diagnosis.asked import STOPS, Asked, asked, of_several_stops, with_problem
from optuav.diagnosis.conflict import conflicts
from optuav.diagnosis.explanation import Explanation, Side
from optuav.diagnosis.prices import prices
from optuav.diagnosis.proving import bound
from optuav.diagnosis.repair import repairs_of
from optuav.mission import Mission
from optuav.modelling import Model, NotAffineError, Relation, Variable
from optuav.modelling.check import evaluated, relations
from optuav.modelling.traversal import fold, has_unknowns, leaves
from optuav.modelling.writer import Text
from optuav.options import ProblemName
from optuav.plan import Plan
from optuav.solving import Program
from optuav.solving.dispatch import answer
from optuav.solving.plans import SAME_S, Part, words
from optuav.status import Status

TURNS = (
    "packs take turns, which is simulated and not declared: there are no constraints, prices or "
    "repairs to tell of; with battery.schedule=pooled there are"
)
LONGEST = 60
"""Terms of a constraint that are written out."""


def explain(
    subject: Program | Plan | Mission | str | Path,
    /,
    problem: Formulation | ProblemName | None = None,
    **options: Any,
) -> Explanation:
    """Explain an answer: what binds and what more would bring, or what conflicts and what repairs.

    Parameters
    ----------
    subject
        A plan, a program of `optuav.formulate`, or a mission as `optuav.solve` takes it.
    problem
        With a mission: as for `optuav.formulate`.
    **options
        The others of `optuav.formulate`, with a mission.

    Returns
    -------
    Explanation
        In words by `print`, as data by `to_dict`.

    Raises
    ------
    InputError
        As `optuav.solve`; or if options come with anything but a mission, or a plan does not tell
        its question: one over an edited graph or to a formulation of one's own.
    SolverError
        If the engine fails.
    """
    options = with_problem(problem, options)
    if isinstance(subject, Plan) and of_several_stops(subject) and not options:
        return Explanation(subject, notes=(STOPS,))
    question = asked(subject, options)
    program = question.program()
    plan = subject if isinstance(subject, Plan) and subject else program.solve()
    if question.takes_turns:
        return Explanation(plan, notes=(TURNS,))
    if question.hover_point == "free":
        return _at_its_point(question, plan)
    if plan:
        return _optimum(program, plan)
    if plan.status is not Status.INFEASIBLE:
        return Explanation(plan)
    return Explanation(plan, conflicts=conflicts(program), repairs=repairs_of(question))


def _at_w_U(problem: Formulation) -> Formulation:
    """(P1) with the hover point of the mission."""
    return replace(problem, hover_point="w_U") if isinstance(problem, P1) else problem


def _at_its_point(question: Asked, plan: Plan) -> Explanation:
    """The explanation of an answer with the hover point free: told with the point held."""
    if plan:
        told = explain(plan)
        held = "with the hover point held where it is: it has no price of its own"
    else:
        told = explain(
            question.mission,
            **{**question.options, "problem": _at_w_U(question.problem)},
        )
        held = "told for hovering at w_U; elsewhere within reach no plan was found either"
    return replace(told, plan=plan, notes=(held, *told.notes))


def _optimum(program: Program, plan: Plan) -> Explanation:
    """Why a plan is the best one: told of the programme with continuous times that it answers."""
    notes = []
    engine = "auto" if program.question.slot_s is not None else program.question.engine
    continuous = replace(program.question, slot_s=None, engine=engine)
    solutions = [answer(part.model, len(part.routes), continuous) for part in program.parts]
    chosen = program.best(solutions)
    if chosen is None:
        return Explanation(plan, notes=("the question, asked again, has no answer",))
    number, entry = chosen
    part, solution = program.parts[number], solutions[number]
    point = solution.point(entry)
    row = part.model.row(entry)
    hover_s = point.get("hover_time_s", 0.0)
    if program.question.slot_s is not None:
        notes.append(
            "an answer in slots has no shadow prices: constraints, proof and prices are those of "
            f"the optimum with continuous times, {hover_s:.2f} s of hover"
        )
    elif abs(hover_s - plan.hover_time_s) > SAME_S * max(1.0, hover_s):
        notes.append(f"solving again gives {hover_s:.6f} s of hover, not the plan's")
    try:
        proof = bound(part.model, row, solution.binding_labels(entry))
    except NotAffineError:
        proof = None
    return Explanation(
        plan,
        objective=_objective(part.model),
        sense=part.model.sense,
        constraints=tuple(_sides(program, part, entry, {**row, **point})),
        bound=proof,
        prices=prices(program, solutions, chosen),
        notes=tuple(notes),
    )


def _objective(model: Model) -> str:
    """What is sought, with its unit if all of it has the same."""
    goal = model.objective
    units = {each.unit for each in leaves(goal)}
    unit = f"{units.pop()} " if len(units) == 1 and units != {"1"} else ""
    if not isinstance(goal, Variable):
        return f"{unit}of {Text().write(goal)}"
    words = {"hover_time_s": "hover", "rest_time_s": "rest"}.get(goal.name, goal.symbol)
    return f"{unit}of {words}"


def _sides(program: Program, part: Part, entry: int, values: dict[str, float]) -> Iterator[Side]:
    """The constraints that unknowns move; others compare figures that the mission fixes."""
    model = part.model
    labels = words(program.network, part, entry, [each.label for each in relations(model)])
    for constraint, label, row in zip(
        relations(model), labels, evaluated(model, values), strict=True
    ):
        if not has_unknowns(*constraint.relation.sides):
            continue
        slack = float(row.slack)
        yield Side(
            label=label,
            unit=row.unit,
            statement=_statement(constraint.relation),
            left=float(row.left),
            sense=Text.senses[row.sense],
            right=float(row.right),
            slack=slack,
            binds=math.isclose(slack, 0.0, abs_tol=1e-6 * max(1.0, abs(float(row.right)))),
            kind=constraint.kind,
            step=constraint.step,
            in_flight=isinstance(constraint.moment, StepEnd) and not constraint.moment.stay,
        )


def _statement(relation: Relation) -> str:
    """A constraint as mathematics; one too long to read by its values alone."""
    notation = Text()
    sides = relation.sides
    if sum(fold(side, lambda leaf: 1, _terms, lambda let, inner: 1) for side in sides) > LONGEST:
        return ""
    return notation.write(relation).replace(notation.after, " ")


def _terms(ufunc: np.ufunc, arguments: tuple[Any, ...]) -> int:
    return sum(each if isinstance(each, int) else 1 for each in arguments)
