"""Which engine answers a question about a model."""

from __future__ import annotations

from formulations.soc import AVAILABLE
from optuav.engines.registry import CAPABILITIES, Engine, capability, engine, need, takers
from optuav.engines.solution import Solution
from optuav.errors import InputError
from optuav.modelling import Model
from optuav.modelling.classify import Traits, traits
from optuav.solving.question import AUTO, Question

LINEAR_ONLY = tuple(each.name for each in CAPABILITIES if not each.nonlinear)
"""Engines that need a linear perspective, such as those of the paper."""


def chosen_engine(model: Model, question: Question) -> Engine:
    """The engine that answers a question about a model.

    Raises
    ------
    InputError
        If the engine that was named does not take the model, or none does.
    """
    slots = question.slot_s is not None
    found = traits(model)
    if question.engine != AUTO:
        refuse_unfit(found, question)
        return engine(question.engine)
    able = takers(found, slots)
    slots_only = [name for name in able if capability(name).slots is None]
    others = [name for name in able if name not in slots_only]
    preferred = [*slots_only, *others] if slots else others
    if not preferred:
        more = f"; with slot_s, {slots_only[0]} does" if slots_only else ""
        raise InputError(f"no engine takes this model: {found}{more}")
    return engine(preferred[0])


def refuse_unfit(found: Traits, question: Question) -> None:
    """Refuse the engine that was asked for if it does not take a model.

    Raises
    ------
    InputError
        With the engines that do.
    """
    try:
        need(question.engine, found, question.slot_s is not None)
    except InputError as error:
        beyond_it = question.engine_name in LINEAR_ONLY and not found.linear
        if question.perspective != AVAILABLE or not beyond_it:
            raise
        words = "The perspectives of the paper are linear: perspective battery, for example"
        raise InputError(f"{error}. {words}") from None


def answer(model: Model, programmes: int, question: Question) -> Solution:
    """Answers to all programmes of a model.

    Raises
    ------
    InputError
        If no engine takes the model.
    SolverError
        If the engine fails or the time limit passes.
    """
    return chosen_engine(model, question).solve(
        model, programmes, slot_s=question.slot_s, time_limit_s=question.time_limit_s
    )
