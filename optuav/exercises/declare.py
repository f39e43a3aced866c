"""Declarations: a problem with the same feasible set and the same optimum as another one."""

import copy
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, fields, replace
from typing import Any

import numpy as np

from formulations.formulation import Formulation
from optuav.arrays import Booleans, Floats
from optuav.engines.dispatch import preferred
from optuav.engines.solution import Solution
from optuav.errors import Fault, InputError
from optuav.exercises.task import Condition, Conditions, Task
from optuav.mission.messages import shown
from optuav.modelling import Check, Checks, Model, check
from optuav.modelling.classify import traits
from optuav.modelling.traversal import evaluate
from optuav.presentation.numbers import figure
from optuav.solving import Program, formulate

SIDE = 13  # Values of each unknown on the grid of points, in equal steps
BEYOND = 0.25  # Margin of the grid around the feasible sets, relative to their width
HALVED = 12  # Halvings of a grid step that a limit crosses
AMBIGUOUS = 1e-6  # Least slack of a point that is compared, relative to max(1, |right side|)
SAME_OPTIMUM_SHARE = 1e-5
"""Difference of two equal optima, as a share of the optimum, or of a second's worth."""


def same_problem(task: Task, answer: object, asked: Model | Program) -> Conditions:
    """Yield whether an answer declares a model, or a program of one route, in other words."""
    wanted = asked if isinstance(asked, Model) else _of_one_route(asked)
    names = {variable.name: variable.binary for variable in wanted.variables}
    unknowns = f"a problem with the unknowns {', '.join(sorted(names))}"
    model = answer if isinstance(answer, Model) else _declared(task, answer, asked, unknowns)
    binary = {variable.name: variable.binary for variable in model.variables}
    if binary.keys() != names.keys():
        listed = ", ".join(sorted(binary)) or "one without any"
        raise InputError([Fault("answer", listed, unknowns)])
    for name, is_binary in names.items():
        words = f"{name} is {'not ' if is_binary else ''}binary in your problem"
        hint = "may it take only the values 0 and 1, or every value between them?"
        yield Condition(binary[name] == is_binary, words, hint)
    hint = "state one with model.maximise or model.minimise"
    yield Condition(model.has_objective, "your problem has no objective", hint)
    best = _solved(wanted)
    points = _points(wanted, model, best.point(0))
    yield _same_set(points, check(wanted, points), check(model, points))
    solution = _solved(model)
    words = f"the feasible set is right, but your problem is {solution.status.value}"
    yield Condition(solution.status.has_answer, words, "check the objective")
    gap = abs(float(np.asarray(evaluate(wanted.objective, solution.point(0)))) - best.objective[0])
    at = _point_words({name: values[0] for name, values in solution.values.items()})
    words = f"the feasible set is right, but the optimum is wrong; yours is {at}"
    hint = "check the quantity that you maximise or minimise"
    size = max(best.second[0], abs(best.objective[0]))
    yield Condition(bool(gap <= SAME_OPTIMUM_SHARE * size), words, hint)
    words = "the feasible set and the best point are right, but the objective is wrong"
    hint = "compare each coefficient of the objective with the task"
    yield Condition(_orders_alike(wanted, model, points), words, hint)
    count = next(iter(points.values())).size
    yield Condition(True, f"same feasible set at {count} points, same optimum", is_fact=True)


def _declared(task: Task, answer: object, asked: Model | Program, unknowns: str) -> Model:
    """Return the model that a formulation declares on the route of a program."""
    if isinstance(asked, Model):
        raise InputError([Fault("answer", shown(answer), "a Model of optuav.modelling")])
    kind = answer if isinstance(answer, type) else type(answer)
    settable = (
        [field for field in fields(kind) if field.init] if issubclass(kind, Formulation) else []
    )
    unset = [f.name for f in settable if f.default is MISSING and f.default_factory is MISSING]
    if unset and answer is kind:
        example = f"{kind.__name__}({', '.join(f'{name}=...' for name in unset)})"
        words = f"an object with {' and '.join(unset)} set, such as {example}"
        raise InputError([Fault("answer", shown(answer), words)])
    if not {"building", "order"} <= {field.name for field in settable}:
        words = "an optuav.Formulation that takes any building and order"
        raise InputError([Fault("answer", shown(answer), words)])
    stated: Any = kind() if answer is kind else answer
    route = asked.question.problem
    program = formulate(task.mission, replace(stated, building=route.building, order=route.order))
    if not program.parts:  # It declares no rest
        raise InputError([Fault("answer", shown(answer), unknowns)])
    return _of_one_route(program)


def _of_one_route(program: Program) -> Model:
    """Return the declaration with the numbers of its first route."""
    model = program.parts[0].model
    return model.with_values(model.row(0))


def _solved(model: Model) -> Solution:
    return preferred(traits(model), slots=False).solve(model, 1)


def _extent(model: Model, name: str) -> tuple[float, ...]:
    """Return the least and the largest feasible value of an unknown, if they exist."""
    ends = list[float]()
    for sense in ("minimise", "maximise"):
        one = copy.copy(model)
        one.preferences, one.has_objective = [], False
        getattr(one, sense)(next(variable for variable in model.variables if variable.name == name))
        if (solution := _solved(one)).status.has_answer:
            ends.append(round(float(solution.point(0)[name]), 9) + 0.0)  # Without −0
    return tuple(ends)


def _points(model: Model, answer: Model, best: Mapping[str, float]) -> dict[str, Floats]:
    """Return a grid around both feasible sets, and points on both sides of limits on its lines.

    A binary unknown takes both values; one without a largest value, up to twice its optimum.
    """
    typical = float(np.mean([abs(x) for x in best.values() if x] or [1.0]))
    axes = list[Floats]()
    for variable in model.variables:
        value, ends = best[variable.name], _extent(model, variable.name)
        ends = ends if len(ends) == 2 else (*ends, value + (abs(value) or typical))
        marks = (*ends, value, *_extent(answer, variable.name))
        margin = BEYOND * (max(marks) - min(marks) or max(*map(abs, marks), typical))
        around = np.linspace(min(marks) - margin, max(marks) + margin, SIDE)
        axes.append(np.arange(2.0) if variable.binary else np.unique([*around, *marks]))
    grid = np.stack(np.meshgrid(*axes, indexing="ij"))
    points = [grid.reshape(len(grid), -1)]
    for problem in (model, answer):
        points += _at_limits(problem, grid, list(best))
    return dict(zip(best, np.concatenate(points, axis=1), strict=True))


def _at_limits(model: Model, grid: Floats, names: Sequence[str]) -> list[Floats]:
    """Return points on both sides of a model's limits, where they cross the lines of a grid."""

    def holds(points: Floats) -> Booleans:
        return _all(check(model, dict(zip(names, points, strict=True))), points[0].shape)

    inside, crossings = holds(grid), list[Floats]()
    for axis, variable in enumerate(model.variables):
        along, lines = np.moveaxis(inside, axis, -1), np.moveaxis(grid, axis + 1, -1)
        crossed = along[..., :-1] != along[..., 1:]
        if variable.binary or not crossed.any():
            continue
        first, last = lines[..., :-1][:, crossed], lines[..., 1:][:, crossed]
        for _ in range(HALVED):
            middle = 0.5 * (first + last)
            same = holds(middle) == along[..., :-1][crossed]
            first, last = np.where(same, middle, first), np.where(same, last, middle)
        crossings += [first, last]
    return crossings


def _all(rows: Checks, shape: tuple[int, ...]) -> Booleans:
    """Return whether all constraints hold at each point."""
    return np.asarray(np.all([np.broadcast_to(row.satisfied, shape) for row in rows], axis=0))


def _same_set(points: Mapping[str, Floats], wanted: Checks, stated: Checks) -> Condition:
    """Return whether both statements allow the same points; the words name one that differs."""
    shape = next(iter(points.values())).shape
    holds, holds_in_answer = _all(wanted, shape), _all(stated, shape)
    clear = [np.broadcast_to(_is_clear(row), shape) for row in (*wanted, *stated)]
    differ = np.flatnonzero((holds != holds_in_answer) & np.all(clear, axis=0))
    if not differ.size:
        return Condition(True, "the feasible set is right")
    first = differ[0]
    at = _point_words({name: values[first] for name, values in points.items()})
    if not holds[first]:
        hint = "put these values into each sentence of the task, and into your problem"
        return Condition(False, f"your problem allows {at}, which is not feasible", hint)
    broken = (row.label for row in stated if not np.broadcast_to(row.satisfied, shape)[first])
    hint = f"it violates your constraint {next(broken)!r}"
    return Condition(False, f"{at} is feasible, but your problem excludes it", hint)


def _is_clear(row: Check) -> Booleans:
    """Whether a constraint has a slack of 0, or one that is too large for rounding to decide."""
    size = np.abs(row.slack)
    return np.asarray((size == 0.0) | (size > AMBIGUOUS * np.maximum(1.0, np.abs(row.right))))


def _orders_alike(wanted: Model, model: Model, points: Mapping[str, Floats]) -> bool:
    """Whether both objectives prefer the same of any two feasible points, such as f and 2 f."""
    holds = _all(check(wanted, points), next(iter(points.values())).shape)
    inside = {name: values[holds] for name, values in points.items()}
    wanted_goal, reached = (
        problem.sign * np.broadcast_to(evaluate(problem.objective, inside), int(holds.sum()))
        for problem in (wanted, model)
    )
    reached = reached[np.lexsort((-reached, wanted_goal))]
    worst = (np.maximum.accumulate(reached) - reached).max(initial=0.0)
    return bool(worst <= SAME_OPTIMUM_SHARE * np.abs(reached).max(initial=0.0))


def _point_words(point: Mapping[str, float]) -> str:
    return "(" + ", ".join(f"{name} = {figure(value)}" for name, value in point.items()) + ")"
