"""Exhaustive search over whole slots: Algorithm 1 of the paper for any declared model.

Every unknown runs through the multiples of the slot within its bounds. Where the last slot is
cut short by the unknown's own upper bound, the slot must be affordable whole, and the answer is
the bound: the paper's 740.65 s. A constraint between unknowns allows whole slots only.

References
----------
.. [1] W. Jaafar, H. Yanikomeroglu, "Dynamics of laser-charged UAVs: a battery perspective",
   IEEE Internet of Things Journal, 2021, algorithm 1.
"""

import itertools
import math
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from optuav.arrays import Booleans, Floats, Values
from optuav.engines.linear_form import own_bounds, slot_ranges
from optuav.engines.registry import MOST_UNKNOWNS, OneByOne, Single
from optuav.engines.rows import TINY, levelled
from optuav.engines.solution import Solution, single
from optuav.errors import Fault, InputError, SolverError, shown
from optuav.modelling.check import CONSTRAINT_TOLERANCE, evaluated, holding, relations
from optuav.modelling.expression import Operand, Relation
from optuav.modelling.forms import CONSTANT, Exponential, NotExponentialError, exponential
from optuav.modelling.model import Model
from optuav.modelling.traversal import change_by_step, evaluate
from optuav.presentation.numbers import figure, typed
from optuav.status import Status

NAME = "grid"
PROOF = "exhaustive"
CELLS_AT_ONCE = 1 << 17
CURVED_CELLS_AT_ONCE = 1 << 15
"""The same where constraints are not linear, as every step on the way to them is kept."""
MOST_SLOTS = 1 << 24  # Slots of one unknown, so that they fit in memory
MOST_CELLS = 10**11  # Cells tried without a time limit: some hours at most for a route
TIED_VALUES = 1e-9
"""Difference of two equal values of a goal, as a share of the value, or of a second's worth."""


def axes(model: Model, parameters: Values, slot_s: float, *, limited: bool = True) -> list[Floats]:
    """Whole slots of each unknown [s]; refused if too many for memory or for unlimited time."""
    ranges = slot_ranges(model, parameters, slot_s).values()
    if any(last - first >= MOST_SLOTS for first, last in ranges):
        raise InputError(
            f"slots of {figure(slot_s)} s are too short: more than {MOST_SLOTS} of them fit"
        )
    count = math.prod(last - first + 1 for first, last in ranges)
    if count > MOST_CELLS and not limited:
        words = (
            f"longer slots, or time_limit_s: without it at most {figure(MOST_CELLS, 1)} pairs are"
        )
        raise InputError(
            [Fault("slot_s", typed(slot_s), f"{words} tried, these make {figure(count, 3)}")]
        )
    return [slot_s * np.arange(first, last + 1, dtype=float) for first, last in ranges]


Progress = Callable[[int, int], None]
Test = Callable[[Mapping[str, Floats], dict[int, Operand]], Operand]
"""Function that says which points satisfy a constraint; tests of the same points share results."""


def tests(model: Model, parameters: Values) -> tuple[list[Test], list[Test], list[Test]]:
    """Tests of linear inequalities, of those with a form, and of all others; axes keep bounds."""
    found: tuple[list[Test], list[Test], list[Test]] = [], [], []
    forms: dict[int, Operand] = {}
    for relation in (constraint.relation for constraint in model.constraints):
        test: Test = partial(_holds, relation, parameters)
        kind = 2
        with suppress(NotExponentialError):
            left, right = (exponential(side, parameters, forms) for side in relation.sides)
            if relation.sense != "==":
                form = (left - right) * relation.signs[0]
                limit = CONSTRAINT_TOLERANCE * max(1.0, abs(right.terms.get(CONSTANT, 0.0)))
                test, kind = partial(_compares, form, limit), 0 if form.linear else 1
        found[kind].append(test)
    return found


def _compares(
    form: Exponential, limit: float, points: Mapping[str, Floats], done: dict[int, Operand]
) -> Operand:
    """An inequality, by functions of one axis each, and products of two of them."""
    terms, both = dict.fromkeys(points, 0.0 * limit), list[Operand]()
    for monomial, coefficient in form.terms.items():
        product = coefficient
        for name, kind in monomial:
            rate_per_s = np.asarray(form.rates_per_s.get(name) or TINY, dtype=float)
            x = points[name]
            product = product * (x if kind == "time" else levelled(rate_per_s, kind * x))
        if len(monomial) > 1:
            both.append(product)
        else:
            name = next((name for name, _ in monomial), next(iter(points)))
            terms[name] = terms[name] + product
    *outer, last = terms.values()
    return sum(both, sum(outer)) <= limit - last


def _holds(
    relation: Relation, parameters: Values, points: Mapping[str, Floats], done: dict[int, Operand]
) -> Operand:
    """Any constraint, evaluated."""
    sides = (evaluate(side, {**parameters, **points}, done) for side in relation.sides)
    return holding(relation.sense, *sides)


def cells(constraints: Iterable[Test], points: Mapping[str, Floats]) -> Booleans:
    """Return which cells satisfy every constraint; the axes broadcast against each other."""
    holds: Operand = np.True_
    done: dict[int, Operand] = {}
    for satisfied in constraints:
        holds = holds & satisfied(points, done)
    shape = np.broadcast_shapes(*(np.shape(point) for point in points.values()))
    return np.broadcast_to(holds, shape)


def _blocks(model: Model, ways: Sequence[Floats], most: int) -> Iterator[dict[str, Floats]]:
    """All cells in blocks of at most `most` cells: axes by name, shaped to broadcast."""
    *outer, last = ways
    *first, name = (variable.name for variable in model.variables)
    step = max(1, most // max([1, *map(len, outer)]))
    for begin in range(0, len(last), step):
        block = last[begin : begin + step]
        yield {first[0]: outer[0], name: block[:, None]} if first else {name: block}


def _cut(points: Mapping[str, Floats], kept: Operand) -> Mapping[str, Floats]:
    """A block without the rows and columns that keep no cell."""
    shape = np.broadcast_shapes(*(axis.shape for axis in points.values()))
    kept = np.broadcast_to(kept, shape)
    masks = [kept.any(axis=0), kept.any(axis=1)] if kept.ndim > 1 else [kept]
    return {n: axis[mask] for (n, axis), mask in zip(points.items(), masks, strict=True)}


def _best_cell(
    model: Model, parameters: Values, ways: list[Floats], latest: float, seen: Progress | None
) -> dict[str, float] | None:
    """The best feasible cell, ties broken by the model's preferences; None without one."""
    sign, tried, count = model.sign, 0, math.prod(map(len, ways))
    flat, formed, curved = tests(model, parameters)
    most = CURVED_CELLS_AT_ONCE if curved else CELLS_AT_ONCE
    trees = [model.objective, *model.preferences]
    best: tuple[list[float], list[float], dict[str, float]] | None = None
    for block in _blocks(model, ways, most):
        if seen:
            seen(tried, count)
        if time.monotonic() > latest:
            raise SolverError(
                f"{NAME} saw {figure(tried, 3)} of {figure(count, 3)} cells within the time limit"
            )
        tried += math.prod(map(np.size, block.values()))
        least = -math.inf if best is None else best[0][0] - best[1][0]
        points = _cut(block, sign * evaluate(model.objective, {**parameters, **block}) >= least)
        points = _cut(points, cells(flat, points))
        kept = cells([*flat, *formed, *curved], points)
        if not kept.any():
            continue
        values = {**parameters, **points}
        goals = [sign * evaluate(model.objective, values)]
        goals += [-evaluate(preference, values) for preference in model.preferences]
        where, scores, ties = np.nonzero(kept), list[float](), list[float]()
        cell = partial(_cell, points, kept.shape)
        for tree, goal in zip(trees, goals, strict=True):
            reached = np.broadcast_to(goal, kept.shape)[where]
            reached = np.where(np.isnan(reached), -np.inf, reached)
            if reached.max(initial=-np.inf) == -np.inf:
                break
            first = int(reached.argmax())
            here = {**parameters, **cell(tuple(index[first] for index in where))}
            scores.append(float(reached[first]))
            second = float(change_by_step(tree, model.variables, here))
            ties.append(TIED_VALUES * max(second, abs(scores[-1])))
            where = tuple(index[reached >= scores[-1] - ties[-1]] for index in where)
        if len(scores) < len(goals):
            continue
        rival = best or (scores, ties)
        differ = (a > b for a, b, tie in zip(scores, *rival[:2], strict=True) if abs(a - b) > tie)
        if best is None or next(differ, False):
            best = scores, ties, cell(tuple(index[0] for index in where))
    if best is None:
        return None
    bounds = own_bounds(model, parameters)
    return {name: min(value, bounds[name][1]) for name, value in best[2].items()}


def _cell(
    points: Mapping[str, Floats], shape: tuple[int, ...], place: tuple[np.intp, ...]
) -> dict[str, float]:
    """Values of the unknowns at a place in a block."""
    return {name: float(np.broadcast_to(axis, shape)[place]) for name, axis in points.items()}


def _tight(model: Model, parameters: Values, point: Values, slot_s: float) -> Iterator[str]:
    """Labels of rows that an equally good neighbouring slot would violate, the first by kind."""
    here = {**parameters, **point}
    for variable, step_s in itertools.product(model.variables, (slot_s, -slot_s)):
        moved = {**here, variable.name: point[variable.name] + step_s}
        better = evaluate(model.objective, moved) - evaluate(model.objective, here)
        if model.sign * better >= 0.0:
            broken = [row.constraint for row in evaluated(model, moved) if not row.satisfied]
            yield from {
                constraint.kind or constraint.label: constraint.label for constraint in broken[::-1]
            }.values()


@dataclass(frozen=True)
class Grid(OneByOne):
    """The engine that searches all whole slots.

    Parameters
    ----------
    progress
        Callback for progress: receives the number of cells of a programme tried so far, and of all.

    Examples
    --------
    >>> import optuav
    >>> from optuav.engines.grid import Grid
    >>> plan = optuav.solve("paper", "P3", engine=Grid(), slot_s=60.0)
    >>> print(f"{plan.hover_time_s:.3f} s, {plan.status.value}")
    540.000 s, optimal
    """

    progress: Progress | None = field(default=None, compare=False, repr=False)
    name = NAME
    nonlinear = True
    slots = None
    most_unknowns = MOST_UNKNOWNS
    needs = ("lower bounds",)

    def __post_init__(self) -> None:
        if self.progress is not None and not callable(self.progress):
            words = "a function of two numbers, or nothing"
            raise InputError([Fault("progress", shown(self.progress), words)])

    def prepare(
        self, model: Model, slot_s: float | None = None, time_limit_s: float | None = None
    ) -> Single:
        """Search every cell of a model in seconds whose unknowns have bounds."""
        if slot_s is None:
            raise InputError(f"engine {NAME} needs the length of a slot")
        if not 1 <= (unknowns := len(model.variables)) <= MOST_UNKNOWNS:
            raise ValueError(f"{NAME} accepts one or two unknowns, the model has {unknowns}")

        @np.errstate(divide="ignore", invalid="ignore", over="ignore")
        def solve(parameters: Mapping[str, float]) -> Solution:
            latest = math.inf if time_limit_s is None else time.monotonic() + time_limit_s
            solution = partial(single, model, NAME, parameters)
            if np.isnan(list(parameters.values())).any():
                return solution(Status.ERROR, PROOF, tight=())
            ways = axes(model, parameters, slot_s, limited=time_limit_s is not None)
            if (best := _best_cell(model, parameters, ways, latest, self.progress)) is None:
                return solution(Status.INFEASIBLE, PROOF, tight=())
            near = {*_tight(model, parameters, best, slot_s)}
            labels = dict.fromkeys(row.label for row in relations(model) if row.label in near)
            return solution(Status.OPTIMAL, PROOF, point=best, tight=(*labels,))

        return solve


solve = Grid().solve
"""Search every cell of every programme; see `Grid.prepare`."""
