"""The kind of a model, found from its trees: linear, smooth, integer, and in how many unknowns."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from optuav.modelling.affine import is_affine, not_affine
from optuav.modelling.derivatives import DIFFERENTIABLE, SMOOTH
from optuav.modelling.expression import Leaf, Operand, Variable
from optuav.modelling.kibam_form import NotExponentialError, Relaxation, exponential
from optuav.modelling.model import Model
from optuav.modelling.traversal import fold

Flaw: TypeAlias = tuple[str, str]
"""Label of a constraint, or "objective", and what it is not and why."""


@dataclass(frozen=True)
class Traits:
    """Properties of a model.

    Parameters
    ----------
    unknowns
        Number of variables.
    integer
        Whether some variable is binary.
    open_below
        Symbols of the variables without a lower bound.
    rough
        Name of the first function that is not known to have derivatives everywhere; empty if there
        is none.
    nonlinear
        The first that is not affine in the variables; None if all are.
    longest
        Whether it maximises one of at most two unknowns ≥ 0, and prefers the other to be small.
    unlevelled
        The first constraint that is no form of times and levellings; None if all are.
    """

    unknowns: int
    integer: bool = False
    open_below: tuple[str, ...] = ()
    rough: str = ""
    nonlinear: Flaw | None = None
    longest: bool = False
    unlevelled: Flaw | None = None

    @property
    def linear(self) -> bool:
        """Whether objective and constraints are affine in the variables."""
        return self.nonlinear is None

    @property
    def smooth(self) -> bool:
        """Whether all functions are known to have derivatives everywhere."""
        return not self.rough

    def __str__(self) -> str:
        kind = "linear" if self.linear else "not smooth" if self.rough else "smooth"
        integer = ", some unknowns binary" if self.integer else ""
        plural = "" if self.unknowns == 1 else "s"
        return f"{kind}, {self.unknowns} unknown{plural}{integer}"


def traits(model: Model) -> Traits:
    """The kind of a model; found once, and again where the model has changed.

    Examples
    --------
    >>> from optuav.modelling import Model
    >>> from optuav.modelling.classify import traits
    >>> model = Model("an example")
    >>> x = model.variable("x", "x", unit="s", upper=5.0)
    >>> model.maximise(x)
    >>> print(traits(model))
    linear, 1 unknown
    >>> model.subject_to("curved", x * x <= 9.0)
    >>> traits(model).nonlinear
    ('curved', 'multiply of the unknowns is not linear')
    """
    return model.remembered("traits", _traits)


def _traits(model: Model) -> Traits:
    nonlinear, rough = _first_faults(model)
    longest = _longest(model)
    return Traits(
        len(model.variables),
        any(each.binary for each in model.variables),
        tuple(
            each.symbol
            for each in model.variables
            if isinstance(each.lower, float) and each.lower == -math.inf
        ),
        rough,
        nonlinear,
        longest,
        _first_unlevelled(model) if longest else None,
    )


def _longest(model: Model) -> bool:
    others = [each for each in model.variables if each is not model.objective]
    return (
        model.sense == "maximise"
        and len(others) < len(model.variables) <= 2
        and all(any(each is other for other in others) for each in model.preferences)
        and all(isinstance(each.lower, float) and each.lower == 0.0 for each in model.variables)
        and not any(each.binary for each in model.variables)
    )


def _first_unlevelled(model: Model) -> Flaw | None:
    done, relaxed = dict[int, Operand](), Relaxation()
    for constraint, known in zip(model.constraints, model.side_forms, strict=True):
        if known:
            continue
        for side in constraint.relation.sides:
            try:
                exponential(side, {}, done, relaxed)
            except NotExponentialError as error:
                return constraint.label, str(error)
    return None


def _first_faults(model: Model) -> tuple[Flaw | None, str]:
    """The first that is not affine, and the first function that is not known to be smooth.

    Over parameters alone steps and kinks do no harm to smoothness, but a function whose derivative
    is not known does.
    """
    rough: list[str] = []
    done: dict[int, str | bool] = {}

    def leaf(node: Leaf) -> bool:
        return isinstance(node, Variable)

    def call(ufunc: np.ufunc, arguments: tuple[str | bool, ...]) -> str | bool:
        """Whether it varies with an unknown, or why it is not affine."""
        moving = [each is True or isinstance(each, str) for each in arguments]
        varies = any(moving)
        if ufunc not in (SMOOTH if varies else DIFFERENTIABLE):
            rough.append(ufunc.__name__)
        if not varies:
            return False
        faults = [each for each in arguments if isinstance(each, str)]
        return faults[0] if faults else is_affine(ufunc, moving) or not_affine(ufunc)

    named = [("objective", model.objective)]
    named += [("preference", each) for each in model.preferences]
    named += [(each.label, side) for each in model.constraints for side in each.relation.sides]
    found = [(label, fold(tree, leaf, call, done=done)) for label, tree in named]
    for tree in model.expressions:  # bounds too
        fold(tree, leaf, call, done=done)
    nonlinear = next(((label, fault) for label, fault in found if type(fault) is str), None)
    return nonlinear, rough[0] if rough else ""
