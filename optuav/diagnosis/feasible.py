"""Whether anything is feasible at all, of many missions at once and without a plan."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from formulations.parameters import QUANTITIES, Quantities
from formulations.soc import PAPER
from optuav.arrays import Booleans, Floats, Integers, Values
from optuav.diagnosis.question import Case
from optuav.engines import bracket, closed_form, grid
from optuav.engines.linear_form import slot_ranges
from optuav.errors import InputError, SolverError
from optuav.modelling import Model, NotAffineError
from optuav.modelling.check import evaluated, holding
from optuav.modelling.forms import NotExponentialError, affine
from optuav.network.feasibility import impossibilities
from optuav.physics.kibam import Stage
from optuav.solving.assemble import quantities
from optuav.solving.program import declared, groups
from optuav.solving.question import Question, answer
from optuav.status import Status

AT_ONCE = 1 << 13
"""Routes that are examined together: few enough to stay in the cache, and in bounded memory."""
MOST_SEARCHED = 3000
"""Slots of an unknown above which not all of them are tried."""
FIRST_SLOTS = 1000
"""Slots that are then tried one by one; as many beyond them, further and further apart."""


def feasible(cases: Sequence[Case]) -> list[bool]:
    """Whether some route of each case has feasible times.

    Exact for programmes in one or two unknowns that are linear, or state what phases of constant
    current do to the wells of a battery, as those of the package do; up to some thousand slots
    too. With more slots some are tried, so that a yes is certain and a no is not. For other
    programmes the engine is asked.
    """
    found = np.zeros(len(cases), dtype=bool)
    for stack in _stacks(cases):
        model = declared(stack.question, stack.given)
        if model is not None:
            _mark(found, stack, model)
    return [bool(each) for each in found]


class Stack(NamedTuple):
    """Routes of several cases as the quantities of one declaration."""

    question: Question  # The same about all of them
    given: Quantities  # Arrays with one entry a route
    cases: Integers  # Number of the case that each route belongs to


def _stacks(cases: Sequence[Case]) -> Iterator[Stack]:
    """All routes that can be flown, those together that a single declaration can serve."""
    alike: dict[Hashable, list[Stack]] = {}
    for number, (question, network) in enumerate(cases):
        if impossibilities(network):
            continue
        for which, rests in groups(question, network):
            given = quantities(network, which, rests=rests)
            if question.perspective in PAPER:
                given = replace(given, steps=())
            missing = tuple(each.name for each in QUANTITIES if getattr(given, each.name) is None)
            stays = tuple(step if isinstance(step, str) else "" for step in given.steps)
            own = alike.setdefault((question, given.rests, missing, stays), [])
            own.append(Stack(question, given, np.full(len(which), number)))
    for members in alike.values():
        portion: list[Stack] = []
        for each in members:
            if portion and sum(len(own.cases) for own in (*portion, each)) > AT_ONCE:
                yield _joined(portion)
                portion = []
            portion.append(each)
        yield _joined(portion)


def _joined(stacks: Sequence[Stack]) -> Stack:
    """Stacks of the same kind one after the other."""
    counts = [len(each.cases) for each in stacks]
    every = [each.given for each in stacks]

    def join(values: Sequence[Floats | float]) -> Floats:
        pairs = zip(values, counts, strict=True)
        return np.concatenate([np.broadcast_to(value, n) for value, n in pairs], dtype=float)

    first = every[0]
    figures: Values = {
        each.name: join([getattr(given, each.name) for given in every])
        for each in QUANTITIES
        if getattr(first, each.name) is not None
    }
    steps = [
        step
        if isinstance(step, str)
        else Stage(*map(join, zip(*(given.steps[k] for given in every), strict=True)))
        for k, step in enumerate(first.steps)
    ]
    cases = np.concatenate([each.cases for each in stacks])
    return Stack(stacks[0].question, replace(first, **figures, steps=tuple(steps)), cases)


def _mark(found: Booleans, stack: Stack, model: Model) -> None:
    """Mark the cases of which some route has feasible times."""
    slot_s = stack.question.slot_s
    possible = _continuous(stack, model)
    if slot_s is not None:
        possible &= _meetable(model, slot_s)
    for entry in np.flatnonzero(possible).tolist():
        case = stack.cases[entry]
        if not found[case]:
            found[case] = slot_s is None or _in_slots(model, model.row(entry), slot_s)


def _continuous(stack: Stack, model: Model) -> Booleans:
    """Which routes have feasible times, whole slots or not; evaluated outside the engine."""
    count = len(stack.cases)
    few = len(model.variables) <= closed_form.MOST_UNKNOWNS
    if few and not any(each.binary for each in model.variables):
        try:
            solution = closed_form.solve(model, count)
            unbounded = np.array([status is Status.UNBOUNDED for status in solution.statuses])
            return unbounded | _satisfied(model, solution.values)
        except NotAffineError:
            pass
        try:
            return _satisfied(model, bracket.some_point(model, count))
        except (NotExponentialError, InputError):
            pass
    try:
        statuses = answer(model, count, stack.question).statuses
    except SolverError:
        return np.zeros(count, bool)
    return np.array([status.has_answer for status in statuses])


def _satisfied(model: Model, values: Values) -> Booleans:
    """Where values satisfy every constraint, evaluated in NumPy."""
    holds = np.broadcast_arrays(*(row.satisfied for row in evaluated(model, values)))
    return np.asarray(np.logical_and.reduce(holds))


def _meetable(model: Model, slot_s: float) -> Booleans:
    """Whether whole slots can add up to what sums of unknowns have to equal, by programme."""
    possible = np.array(True)
    for relation in (constraint.relation for constraint in model.constraints):
        if relation.sense != "==":
            continue
        try:
            total, wanted = affine(relation.left, {}), affine(relation.right, {})
        except NotAffineError:
            continue
        whole = all(np.all(each == 1.0) for each in total.coefficients.values())
        if whole and not wanted.coefficients:
            seconds = wanted.constant - total.constant
            nearest = slot_s * np.round(seconds / slot_s)
            possible = possible & holding("==", nearest + total.constant, wanted.constant)
    return possible


def _in_slots(model: Model, parameters: Values, slot_s: float) -> bool:
    """Whether some whole slots are feasible, by the tests of the grid engine."""
    ranges = slot_ranges(model, parameters, slot_s)
    most = max(last - first for first, last in ranges.values())
    spread = _every if most <= MOST_SEARCHED else _spread
    axes = [slot_s * (first + spread(last - first)) for first, last in ranges.values()]
    points = dict(zip(ranges, np.ix_(*axes), strict=True))
    return bool(grid.cells(grid.tests(model, parameters), points).any())


def _every(last: float) -> Floats:
    return np.arange(last + 1.0)


def _spread(last: float) -> Floats:
    """Whole numbers up to the last one: the first of them all, then fewer and fewer."""
    further = np.floor(np.geomspace(FIRST_SLOTS, max(FIRST_SLOTS, last), FIRST_SLOTS))
    found = np.unique(np.concatenate([_every(FIRST_SLOTS - 1), further]))
    return found[found <= last]
