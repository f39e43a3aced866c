"""Declare: a problem with the same feasible set and the same optimum as another statement."""

import copy
from collections.abc import Collection, Mapping, Sequence
from dataclasses import MISSING, dataclass, fields, replace
from typing import ClassVar

import numpy as np

from formulations.formulation import Formulation
from optuav.arrays import Booleans, Floats
from optuav.engines.registry import preferred
from optuav.engines.solution import Solution
from optuav.errors import Fault, InputError
from optuav.exercises.exercise import Exercise, Grade, Kind, Task
from optuav.mission.messages import shown
from optuav.modelling import Check, Checks, Model, check
from optuav.modelling.classify import traits
from optuav.modelling.traversal import evaluate
from optuav.solving import Program, formulate
from optuav.solving.parts import Part

SIDE = 13  # Values of each unknown on the grid of points, in equal steps
BEYOND = 0.25  # Margin of the grid around the feasible sets, relative to their width
HALVED = 12  # Halvings of a grid step that a limit crosses
AMBIGUOUS = 1e-6  # Least slack of a point that is compared, relative to max(1, |right side|)
SAME = 1e-5  # Largest difference of two equal optima, relative to max(1, |optimum|)


@dataclass(frozen=True)
class Declare(Exercise):
    """Exercise whose answer is equivalent to a model, or to a program of one route.

    The decorated function returns the model or the program.
    """

    kind: ClassVar[Kind] = "declare"

    @np.errstate(all="ignore")  # Points around a feasible set may leave a function's domain
    def grade(self, task: Task, answer: object) -> Grade:
        """Return the grade of a formulation or a model."""
        return _grade(self.function(task), task, answer)


def _grade(asked: Program | Model, task: Task, answer: object) -> Grade:
    """Return the grade of a formulation or a model."""
    wanted = asked if isinstance(asked, Model) else _of_one_route(asked.parts[0])
    names = {variable.name for variable in wanted.variables}
    unknowns = f"a problem with the unknowns {', '.join(sorted(names))}"
    model = _model_of(answer, asked, unknowns, task)
    if (declared := {variable.name for variable in model.variables}) != names:
        listed = ", ".join(sorted(declared)) or "one without any"
        raise InputError([Fault("answer", listed, unknowns)])
    binary = {variable.name: variable.binary for variable in model.variables}
    for variable in wanted.variables:
        if variable.binary != binary[variable.name]:
            words = f"{variable.name} is {'not ' if variable.binary else ''}binary in your problem"
            return Grade.wrong(
                task, words, "may it take only the values 0 and 1, or every value between them?"
            )
    if not model.has_objective:
        words = "your problem has no objective"
        return Grade.wrong(task, words, "state one with model.maximise or model.minimise")
    best = _solved(wanted)
    points = _points(wanted, model, best.point(0))
    differs = _difference(task, points, check(wanted, points), check(model, points))
    if differs is not None:
        return differs
    own = _solved(model)
    if not own.status.has_answer:
        words = f"the feasible set is right, but your problem is {own.status.value}"
        return Grade.wrong(task, words, "check the objective")
    reached = float(np.asarray(evaluate(wanted.objective, own.point(0))))
    if abs(reached - best.objective[0]) > SAME * max(1.0, abs(best.objective[0])):
        at = _words({name: values[0] for name, values in own.values.items()})
        words = f"the feasible set is right, but the optimum is wrong; yours is {at}"
        return Grade.wrong(task, words, "check the quantity that you maximise or minimise")
    if not _orders_alike(wanted, model, points):
        words = "the feasible set and the best point are right, but the objective is wrong"
        return Grade.wrong(task, words, "compare each coefficient of the objective with the task")
    count = next(iter(points.values())).size
    return Grade.correct(task, f"same feasible set at {count} points, same optimum")


def _model_of(answer: object, asked: Program | Model, unknowns: str, task: Task) -> Model:
    """Return the model that an answer declares; a formulation is declared on the program's route.

    A formulation without a rest has no such route: the error names the unknowns that are needed.
    """
    if isinstance(answer, Model):
        return answer
    words = "a Model of optuav.modelling"
    if isinstance(asked, Program):
        if isinstance(answer, type) and issubclass(answer, Formulation):
            if needed := _needed(answer):
                example = f"{answer.__name__}({', '.join(f'{name}=...' for name in needed)})"
                words = f"an object, such as {example}, because {' and '.join(needed)} must be set"
                raise InputError([Fault("answer", shown(answer), words)])
            answer = answer()
        open_ = {"building", "order"}
        if isinstance(answer, Formulation) and open_ <= {f.name for f in fields(answer) if f.init}:
            question, rests = asked.question, asked.parts[0].rests
            building, order = question.problem.building, question.problem.order
            answer = replace(answer, building=building, order=order)
            program = formulate(task.mission, answer, perspective=question.perspective)
            for part in program.parts:
                if part.rests == rests:
                    return _of_one_route(part)
            raise InputError([Fault("answer", shown(answer), unknowns)])
        words = "an object of an optuav.Formulation that takes any building and order"
    raise InputError([Fault("answer", shown(answer), words)])


def _needed(kind: type[Formulation]) -> list[str]:
    """Return the fields of a class that have no default."""
    return [
        field.name
        for field in fields(kind)
        if field.init and field.default is MISSING and field.default_factory is MISSING
    ]


def _of_one_route(part: Part) -> Model:
    """Return the declaration with the numbers of its first route."""
    return part.model.with_values(part.model.row(0))


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


def _axis(known: Collection[float], typical: float) -> Floats:
    """Return values of an unknown around all known values, and the known values."""
    least, most = min(known), max(known)
    width = most - least or max(abs(most), typical)
    equal = np.linspace(least - BEYOND * width, most + BEYOND * width, SIDE)
    return np.unique([*equal, *known])


def _points(model: Model, answer: Model, best: Mapping[str, float]) -> dict[str, Floats]:
    """Return a grid around both feasible sets, and points on both sides of limits on its lines.

    A binary unknown takes both values; one without a largest value, up to twice its optimum.
    """
    typical = float(np.mean([abs(x) for x in best.values() if x] or [1.0]))
    axes = list[Floats]()
    for variable in model.variables:
        if variable.binary:
            axes.append(np.arange(2.0))
            continue
        value, extent = best[variable.name], _extent(model, variable.name)
        ends = extent if len(extent) == 2 else (*extent, value + (abs(value) or typical))
        axes.append(_axis({*ends, value, *_extent(answer, variable.name)}, typical))
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
    binary = {variable.name: variable.binary for variable in model.variables}
    for number, name in enumerate(names):
        if binary[name]:
            continue
        before, after = (
            np.moveaxis(grid, number + 1, -1)[..., cut] for cut in (slice(-1), slice(1, None))
        )
        along = np.moveaxis(inside, number, -1)
        crossed = along[..., :-1] != along[..., 1:]
        if not crossed.any():
            continue
        first, last, known = before[:, crossed], after[:, crossed], along[..., :-1][crossed]
        for _ in range(HALVED):
            middle = 0.5 * (first + last)
            same = holds(middle) == known
            first, last = np.where(same, middle, first), np.where(same, last, middle)
        crossings += [first, last]
    return crossings


def _all(rows: Checks, shape: tuple[int, ...]) -> Booleans:
    """Return whether all constraints hold at each point."""
    return np.asarray(np.all([np.broadcast_to(row.satisfied, shape) for row in rows], axis=0))


def _difference(
    task: Task, points: Mapping[str, Floats], wanted: Checks, stated: Checks
) -> Grade | None:
    """Return a grade that names the first point that only one of the statements allows."""
    shape = next(iter(points.values())).shape
    holds, own = _all(wanted, shape), _all(stated, shape)
    clear = [np.broadcast_to(_is_clear(row), shape) for row in (*wanted, *stated)]
    differ = np.flatnonzero((holds != own) & np.all(clear, axis=0))
    if not differ.size:
        return None
    first = differ[0]
    at = _words({name: values[first] for name, values in points.items()})
    if holds[first]:
        broken = next(
            each.label for each in stated if not np.broadcast_to(each.satisfied, shape)[first]
        )
        words = f"{at} is feasible, but your problem excludes it"
        return Grade.wrong(task, words, f"it violates your constraint {broken!r}")
    words = f"your problem allows {at}, which is not feasible"
    return Grade.wrong(
        task, words, "put these values into each sentence of the task, and into your problem"
    )


def _orders_alike(wanted: Model, model: Model, points: Mapping[str, Floats]) -> bool:
    """Whether both objectives prefer the same of any two feasible points, such as f and 2 f."""
    holds = _all(check(wanted, points), next(iter(points.values())).shape)
    inside = {name: values[holds] for name, values in points.items()}
    asked, own = (
        each.towards * np.broadcast_to(evaluate(each.objective, inside), int(holds.sum()))
        for each in (wanted, model)
    )
    own = own[np.lexsort((-own, asked))]
    worst = (np.maximum.accumulate(own) - own).max(initial=0.0)
    return bool(worst <= SAME * np.abs(own).max(initial=1.0))


def _is_clear(row: Check) -> Booleans:
    """Whether a constraint has a slack of 0, or one that is too large for rounding to decide."""
    size = np.abs(row.slack)
    return np.asarray((size == 0.0) | (size > AMBIGUOUS * np.maximum(1.0, np.abs(row.right))))


def _words(point: Mapping[str, float]) -> str:
    return "(" + ", ".join(f"{name} = {value:.6g}" for name, value in point.items()) + ")"
