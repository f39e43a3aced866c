"""Is anything feasible at all? Asked often, so of many missions at once and without a plan."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from optuav.arrays import Booleans, Floats, Values
from optuav.diagnosis.stacked import Case, Stack, stacks
from optuav.engines import bracket, closed_form, grid
from optuav.engines.ranges import implied_upper_bounds, lower_bounds, own_upper_bounds
from optuav.errors import InputError
from optuav.modelling import Model, NotAffineError
from optuav.modelling.affine import affine
from optuav.modelling.check import evaluated, holding
from optuav.modelling.kibam_form import NotExponentialError
from optuav.solving.declare import declared
from optuav.solving.dispatch import answer
from optuav.status import Status

SAMPLES = 25
"""Points a side of the lattice on which a programme is tried that no engine decides."""
FINEST = 1e-4
"""First step of the lattice as a share of the range."""
MOST_SEARCHED = 3000
"""Slots of an unknown above which not all of them are looked at."""
FIRST_SLOTS = 1000
"""Slots that are then looked at one by one; as many beyond them grow further apart."""
MOST_SLOTS = 1e9
"""Slots beyond which none is looked at."""


def feasible(cases: Sequence[Case]) -> list[bool]:
    """Whether some route of each case has feasible times.

    Exact for programmes in one or two unknowns that are linear, or state what phases of constant
    current do to the wells of a battery, as those of the package do; up to some thousand slots
    too. With more slots, and for other programmes, some slots or a lattice of points are tried, so
    that a yes is certain and a no is not. For programmes in more unknowns the engine is asked.
    """
    found = np.zeros(len(cases), dtype=bool)
    for stack in stacks(cases):
        model = declared(stack.asked, stack.given)
        if model is not None:
            _mark(found, stack, model)
    return [bool(each) for each in found]


def _mark(found: Booleans, stack: Stack, model: Model) -> None:
    """Mark the cases of which some itinerary has feasible times."""
    slot_s, count = stack.asked.slot_s, len(stack.cases)
    possible = _continuous(stack, model, count)
    if slot_s is not None:
        possible &= _meetable(model, slot_s)
    for entry in np.flatnonzero(possible).tolist():
        case = stack.cases[entry]
        if not found[case]:
            found[case] = slot_s is None or _in_slots(model, model.row(entry), slot_s)


def _continuous(stack: Stack, model: Model, count: int) -> Booleans:
    """Which itineraries have feasible times, whole slots or not; evaluated outside the engine."""
    if len(model.variables) > closed_form.MOST_UNKNOWNS or any(
        each.binary for each in model.variables
    ):
        statuses = answer(model, count, stack.asked).statuses
        return np.array([status.has_answer for status in statuses])
    try:
        solution = closed_form.solve(model, count)
        unbounded = np.array([status is Status.UNBOUNDED for status in solution.statuses])
        return unbounded | _satisfied(model, solution.values)
    except NotAffineError:
        pass
    try:
        return _satisfied(model, bracket.some_point(model, count))
    except (NotExponentialError, InputError):
        return np.array([_somewhere(model, model.row(entry)) for entry in range(count)])


def _satisfied(model: Model, values: Values) -> Booleans:
    """Where values satisfy every constraint, evaluated in NumPy."""
    holds = np.broadcast_arrays(*(row.satisfied for row in evaluated(model, values)))
    return np.asarray(np.logical_and.reduce(holds))


Reach = Mapping[str, tuple[float, float]]
"""Least and largest value by name of the unknown."""


def _reach(model: Model, parameters: Values) -> Reach:
    """How far every unknown can go, at the most."""
    lower = lower_bounds(model, parameters)
    upper = implied_upper_bounds(model, parameters, lower)
    own = own_upper_bounds(model, parameters)
    return {name: (least, min(upper[name], own[name])) for name, least in lower.items()}


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
        if all(np.all(each == 1.0) for each in total.coefficients.values()) and not (
            wanted.coefficients
        ):
            seconds = wanted.constant - total.constant
            nearest = slot_s * np.round(seconds / slot_s)
            possible = possible & holding("==", nearest + total.constant, wanted.constant)
    return possible


def _in_slots(model: Model, parameters: Values, slot_s: float) -> bool:
    """Whether some whole slots are feasible, by the tests of the grid engine."""
    reach = _reach(model, parameters)
    if _longest(reach, slot_s) <= MOST_SEARCHED:
        axes = grid.axes(model, parameters, slot_s)
    else:
        axes = [
            slot_s * (variable.first_slot + _spread((most - least) // slot_s))
            for variable, (least, most) in zip(model.variables, reach.values(), strict=True)
        ]
    points = dict(zip(reach, np.ix_(*axes), strict=True))
    return bool(grid.cells(grid.tests(model, parameters), points).any())


def _spread(last: float) -> Floats:
    """Whole numbers up to the last one: the first of them all, then fewer and fewer."""
    further = np.geomspace(FIRST_SLOTS, max(FIRST_SLOTS, min(last, MOST_SLOTS)), FIRST_SLOTS)
    return np.unique(np.concatenate([np.arange(FIRST_SLOTS), np.floor(further)]))


def _longest(reach: Reach, slot_s: float) -> float:
    """Slots of the unknown that has most."""
    return max((most - least) / slot_s for least, most in reach.values())


def _somewhere(model: Model, parameters: Values) -> bool:
    """Whether a point of a lattice, finer towards the lower bounds, satisfies every constraint."""
    reach = _reach(model, parameters)
    if not all(math.isfinite(most - least) and least <= most for least, most in reach.values()):
        return False
    shares = np.concatenate([[0.0], np.geomspace(FINEST, 1.0, SAMPLES - 1)])
    axes = [least + shares * (most - least) for least, most in reach.values()]
    points = dict(zip(reach, np.ix_(*axes), strict=True))
    return bool(_satisfied(model, {**parameters, **points}).any())
