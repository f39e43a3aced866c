"""Is anything feasible at all? Asked often, so without making a plan."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from optuav.engines import closed_form, grid
from optuav.engines.arrays import Floats
from optuav.engines.ranges import Values, implied_upper_bounds, lower_bounds, own_upper_bounds
from optuav.modelling import Model, NotAffineError, check
from optuav.solving import Program
from optuav.solving.planning import Part
from optuav.status import Status

SAMPLES = 25
"""Points a side of the lattice on which a programme is tried that is not linear."""
FINEST = 1e-4
"""First step of the lattice as a share of the range."""
MOST_SEARCHED = 3000
"""Slots of an unknown above which not all of them are looked at."""
FIRST_SLOTS = 1000
"""Slots that are then looked at one by one; as many beyond them grow further apart."""
MOST_SLOTS = 1e9
"""Slots beyond which none is looked at."""


def feasible(program: Program) -> bool:
    """Whether some route of a question has feasible times.

    Exact for programmes that are linear in one or two unknowns, as the paper's are, up to some
    thousand slots too. With more slots, and where programmes are not linear, some slots or a
    lattice of points are tried, so that a yes is certain and a no is not. For programmes in more
    unknowns the engine is asked.
    """
    return any(_feasible(program, part) for part in program.parts)


def _feasible(program: Program, part: Part) -> bool:
    model, slot_s = part.model, program.question.slot_s
    unknowns = model.variables
    if len(unknowns) > closed_form.MOST_UNKNOWNS or any(each.binary for each in unknowns):
        return program.solve().status.has_answer
    entries = list(range(len(part.routes)))
    try:
        statuses = closed_form.solve(model, len(part.routes)).statuses
    except NotAffineError:
        if slot_s is None:
            return any(_somewhere(model, model.row(entry)) for entry in entries)
    else:
        solved = (Status.OPTIMAL, Status.UNBOUNDED)
        entries = [entry for entry in entries if statuses[entry] in solved]
        if slot_s is None:
            return bool(entries)
    return any(_in_slots(model, model.row(entry), slot_s) for entry in entries)


def confirmed(program: Program) -> bool:
    """Whether a question has an answer: solved again, or with very many slots a feasible cell."""
    slot_s = program.question.slot_s
    if slot_s is not None and any(
        _longest(_reach(part.model, part.model.row(0)), slot_s) > MOST_SEARCHED
        for part in program.parts
    ):
        return feasible(program)
    return program.solve().status.has_answer


Reach = Mapping[str, tuple[float, float]]
"""Least and largest value by name of the unknown."""


def _reach(model: Model, parameters: Values) -> Reach:
    """How far every unknown can go, at the most."""
    lower = lower_bounds(model, parameters)
    upper = implied_upper_bounds(model, parameters, lower)
    own = own_upper_bounds(model, parameters)
    return {name: (least, min(upper[name], own[name])) for name, least in lower.items()}


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
    holds = [row.satisfied for row in check(model, {**parameters, **points})]
    return bool(np.logical_and.reduce(np.broadcast_arrays(*holds)).any())
