"""Which engine takes which model: one table, from which choices, errors and docs are made."""

from __future__ import annotations

from dataclasses import dataclass

from optuav.errors import Fault, InputError
from optuav.modelling.classify import Traits

MOST_UNKNOWNS = 2


@dataclass(frozen=True)
class Capability:
    """What an engine takes and gives.

    Parameters
    ----------
    name
        As `optuav.solve` is given it.
    nonlinear
        Whether it takes models that are not linear.
    integer
        Whether it takes binary unknowns.
    slots
        Whether it takes times in whole slots; None if it takes nothing else.
    most_unknowns
        Largest number of unknowns; None for any.
    needs_smooth
        Whether it needs derivatives.
    needs_lower_bounds
        Whether every unknown needs a lower bound.
    needs_levelling
        Whether it needs the longest of at most two times as objective, and as constraints what
        phases of constant current give.
    gives
        What its answer is worth, in words.
    """

    name: str
    nonlinear: bool
    integer: bool
    slots: bool | None
    most_unknowns: int | None
    needs_smooth: bool
    needs_lower_bounds: bool
    gives: str
    needs_levelling: bool = False

    def obstacle(self, model: Traits, slots: bool) -> str:
        """Why the engine does not take a model, in words; empty if it does."""
        if self.most_unknowns is not None and model.unknowns > self.most_unknowns:
            return f"it takes at most {self.most_unknowns} unknowns, the model has {model.unknowns}"
        if not model.linear and not self.nonlinear:
            where, why = model.nonlinear_label, model.nonlinear_words
            return f"it takes linear models only; {where!r} is not: {why}"
        if self.needs_smooth and not model.smooth:
            return f"it needs derivatives; {model.rough} has kinks, or none that are known"
        if self.needs_lower_bounds and model.open_below:
            return f"it needs a lower bound on {', '.join(model.open_below)}"
        if model.integer and not self.integer:
            return "it takes no binary unknowns"
        if self.needs_levelling and not model.longest:
            return "it looks for the largest of at most two unknowns from 0, and for nothing else"
        if self.needs_levelling and model.unlevelled_label:
            where, why = model.unlevelled_label, model.unlevelled_words
            return f"{where!r} is not what phases of constant current give: {why}"
        if slots and self.slots is False:
            return "it takes continuous times only"
        return ""


CAPABILITIES = (
    Capability(
        "closed-form",
        nonlinear=False,
        integer=False,
        slots=False,
        most_unknowns=MOST_UNKNOWNS,
        needs_smooth=False,
        needs_lower_bounds=True,
        gives="exact, over all itineraries at once, with the constraints that bind",
    ),
    Capability(
        "cvxpy",
        nonlinear=False,
        integer=True,
        slots=True,
        most_unknowns=None,
        needs_smooth=False,
        needs_lower_bounds=False,
        gives="global, with multipliers; binary unknowns and slots by branch and bound",
    ),
    Capability(
        "bracket",
        nonlinear=True,
        integer=False,
        slots=False,
        most_unknowns=MOST_UNKNOWNS,
        needs_smooth=False,
        needs_lower_bounds=True,
        needs_levelling=True,
        gives="a feasible time and proof that none is longer, through both wells",
    ),
    Capability(
        "casadi",
        nonlinear=True,
        integer=False,
        slots=False,
        most_unknowns=None,
        needs_smooth=True,
        needs_lower_bounds=False,
        gives="a local optimum, the best of several starts",
    ),
    Capability(
        "grid",
        nonlinear=True,
        integer=False,
        slots=None,
        most_unknowns=MOST_UNKNOWNS,
        needs_smooth=False,
        needs_lower_bounds=True,
        gives="exhaustive over whole slots: the verifying reference",
    ),
)
"""All engines, in the order in which "auto" prefers them for continuous times."""

ENGINES = tuple(each.name for each in CAPABILITIES)


def takers(model: Traits, slots: bool) -> tuple[str, ...]:
    """Names of the engines that take a model."""
    return tuple(each.name for each in CAPABILITIES if not each.obstacle(model, slots))


def need(engine: str, model: Traits, slots: bool) -> None:
    """Refuse an engine that does not take a model, and name those that do.

    Raises
    ------
    InputError
        With the reason; also if there is no such engine.
    """
    if engine not in ENGINES:
        raise InputError([Fault("engine", repr(engine), f"one of {', '.join(ENGINES)}")])
    capability = next(each for each in CAPABILITIES if each.name == engine)
    why = capability.obstacle(model, slots)
    if why:
        others = ", ".join(takers(model, slots)) or "none"
        raise InputError(
            f"engine {engine} does not take this model: {why}. Engines that do: {others}"
        )
