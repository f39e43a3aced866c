"""Which engine solves a model, and the call that asks it."""

from __future__ import annotations

from dataclasses import replace

from optuav.arrays import Values
from optuav.engines.registry import (
    AUTO,
    Engine,
    engine,
    engine_names,
    of_the_package,
    takers,
)
from optuav.engines.solution import Solution, returned
from optuav.errors import InputError
from optuav.modelling import Model
from optuav.modelling.classify import Traits, traits


def chosen_engine(wanted: str | Engine, model: Model, slots: bool, linear: str = "") -> Engine:
    """The engine that was asked for, or by "auto" the first that takes a model; else refused.

    The hint says how to get a linear model, if only that is in the way.
    """
    model_traits = traits(model)
    if wanted == AUTO:
        return preferred(model_traits, slots)
    need(wanted, model_traits, slots, linear)
    return engine(wanted)


def preferred(model: Traits, slots: bool) -> Engine:
    """The first engine that takes a model, in slots one for only slots; refused if none does."""
    able = (one for one in map(engine, engine_names()) if not one.obstacle(model, slots))
    if slots:
        chosen = min(able, key=lambda one: one.slots is not None, default=None)
    else:  # No more engines are loaded than are asked
        chosen = next((one for one in able if one.slots is not None), None)
    if chosen is not None:
        return chosen
    in_slots = takers(model, slots)
    more = f" in continuous times: set slot_s for engine {in_slots[0]}" if in_slots else ""
    raise InputError(f"no engine accepts this model ({model}){more}")


def need(wanted: str | Engine, model: Traits, slots: bool, linear: str = "") -> None:
    """Refuse an engine that does not take a model, and say which do, or how to get a linear one."""
    chosen = engine(wanted)
    if why := chosen.obstacle(model, slots):
        others = ", ".join(takers(model, slots)) or "none"
        hint = linear if model.nonlinear and not chosen.nonlinear else ""
        words = f"engine {chosen.name} does not accept this model: {why}."
        raise InputError(f"{words} Engines that do: {others}{hint}")


def answered(
    chosen: Engine,
    model: Model,
    programmes: int,
    values: Values | None = None,
    **limits: float | None,
) -> Solution:
    """The answers of an engine to all programmes of a model, checked if it is from outside.

    Arguments as of `optuav.engines.registry.Engine.solve`.
    """
    outside = not of_the_package(chosen)
    if values and outside:
        model, values = model.with_values(values), None  # an engine of a user may print the model
    solution = chosen.solve(model, programmes, values, **limits)
    if outside:
        solution = returned(solution, chosen.name, model, programmes)
    # An engine need not keep the values that were solved for.
    return solution if solution.given or not values else replace(solution, given=values)
