"""Is anything feasible at all? Asked often, so without making a plan."""

from __future__ import annotations

import math

import numpy as np

from optuav.engines import closed_form, grid
from optuav.engines.ranges import Values, implied_upper_bounds, lower_bounds, own_upper_bounds
from optuav.engines.solution import Status
from optuav.modelling import Model, NotAffineError, check
from optuav.solving import Program
from optuav.solving.planning import Part

SAMPLES = 25
"""Points a side of the lattice on which a programme is tried that is not linear."""
FINEST = 1e-4
"""First step of the lattice as a share of the range."""
MOST_SLOTS = 100_000
"""Slots of an unknown above which no whole slots are looked for."""
FIRST_SLOTS = 400
"""Slots of an unknown that are looked at: the first ones bind the least."""


def feasible(program: Program) -> bool:
    """Whether some route of a question has feasible times.

    Exact for programmes that are linear in one or two unknowns, as the paper's are. With times in
    slots, and where programmes are not linear, some slots or a lattice of points are tried, so
    that a yes is certain and a no is not. For any other programme the engine is asked.
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


def _reach(model: Model, parameters: Values) -> dict[str, tuple[float, float]]:
    """How far every unknown can go, at the most."""
    lower = lower_bounds(model, parameters)
    upper = implied_upper_bounds(model, parameters, lower)
    own = own_upper_bounds(model, parameters)
    return {name: (least, min(upper[name], own[name])) for name, least in lower.items()}


def _in_slots(model: Model, parameters: Values, slot_s: float) -> bool:
    """Whether some of the first whole slots are feasible, by the tests of the grid engine."""
    reach = _reach(model, parameters)
    if not all(most - least <= MOST_SLOTS * slot_s for least, most in reach.values()):
        return False
    axes = [axis[:FIRST_SLOTS] for axis in grid.axes(model, parameters, slot_s)]
    points = dict(zip(reach, np.ix_(*axes), strict=True))
    return bool(grid.cells(grid.tests(model, parameters), points).any())


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
