"""Which engine answers, and handing it the model; engines load on first use."""

from __future__ import annotations

from formulations.perspectives import AVAILABLE
from optuav.engines.capabilities import CAPABILITIES, need, takers
from optuav.engines.solution import Solution
from optuav.errors import InputError
from optuav.modelling import Model
from optuav.modelling.classify import Traits, traits
from optuav.solving.question import AUTO, Question

GRID = "grid"
"""The engine of slots, and of slots only."""
LINEAR_ONLY = tuple(each.name for each in CAPABILITIES if not each.nonlinear)
"""The engines for which a perspective of the paper has to be asked."""


def chosen_engine(model: Model, asked: Question) -> str:
    """Name of the engine that answers a question about a model.

    Raises
    ------
    InputError
        If the engine that was asked for does not take the model, or none does.
    """
    slots = asked.slot_s is not None
    found = traits(model)
    if asked.engine != AUTO:
        refuse_unfit(found, asked)
        return asked.engine
    engines = takers(found, slots)
    if slots and GRID in engines:
        return GRID
    continuous = [each for each in engines if each != GRID]
    if not continuous:
        more = "; with slot_s, the grid does" if GRID in engines else ""
        raise InputError(f"no engine takes this model: {found}{more}")
    return continuous[0]


def refuse_unfit(found: Traits, asked: Question) -> None:
    """Refuse the engine that was asked for if it does not take a model.

    Raises
    ------
    InputError
        With the engines that do.
    """
    try:
        need(asked.engine, found, asked.slot_s is not None)
    except InputError as error:
        beyond_it = asked.engine in LINEAR_ONLY and not found.linear
        if asked.perspective != AVAILABLE or not beyond_it:
            raise
        words = "The perspectives of the paper are linear: perspective battery, for example"
        raise InputError(f"{error}. {words}") from None


def answer(model: Model, programmes: int, asked: Question) -> Solution:
    """Answers to all programmes of a model.

    Raises
    ------
    InputError
        If no engine takes the model.
    SolverError
        If the engine fails or the time limit passes.
    """
    engine = chosen_engine(model, asked)
    if engine == "closed-form":
        from optuav.engines import closed_form

        return closed_form.solve(model, programmes)
    if engine == "cvxpy":
        from optuav.engines import linear

        return linear.solve(model, programmes, asked.slot_s, asked.time_limit_s, asked.solver)
    if engine == "bracket":
        from optuav.engines import bracket

        return bracket.solve(model, programmes)
    if engine == "casadi":
        from optuav.engines import smooth

        return smooth.solve(model, programmes, asked.time_limit_s)
    from optuav.engines import grid

    assert asked.slot_s is not None
    return grid.solve(model, programmes, asked.slot_s, asked.time_limit_s)
