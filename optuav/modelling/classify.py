"""The kind of a model, found from its trees: linear, smooth, integer, and in how many unknowns."""

from __future__ import annotations

import math
from typing import NamedTuple, TypeAlias

import numpy as np

from optuav.modelling.expression import Call, Expression, Operand
from optuav.modelling.forms import (
    NotAffineError,
    NotExponentialError,
    Relaxation,
    affine,
    exponential,
)
from optuav.modelling.model import Model
from optuav.modelling.traversal import KINKED, PARTIALS

Flaw: TypeAlias = tuple[str, str]
"""Label of a constraint, or "objective", and what it is not and why."""


class Traits(NamedTuple):
    """Properties of a model."""

    unknowns: int  # Number of variables
    integer: bool = False  # Whether some variable is binary
    open_below: tuple[str, ...] = ()  # Symbols of the variables without a lower bound
    # Name of the first function that is not known to have derivatives everywhere; empty if there is
    # none. Over parameters alone steps and kinks do no harm.
    rough: str = ""
    nonlinear: Flaw | None = None  # The first that is not affine in the variables
    # Whether it maximises one of at most two unknowns ≥ 0, and prefers the other to be small.
    longest: bool = False
    unlevelled: Flaw | None = None  # The first constraint that is no form of times and levellings

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
    walked, unknowns = model.walked, model.variables
    if isinstance(walked.traits, Traits):
        return walked.traits
    others = [each for each in unknowns if each is not model.objective]
    bounds = [each.lower if isinstance(each.lower, float) else math.nan for each in unknowns]
    integer = any(each.binary for each in unknowns)
    longest = (
        model.sense == "maximise"
        and len(others) < len(unknowns) <= 2
        and all(any(each is other for other in others) for each in model.preferences)
        and all(bound == 0.0 for bound in bounds)
        and not integer
    )
    open_below = (
        each.symbol for each, bound in zip(unknowns, bounds, strict=True) if bound == -math.inf
    )
    calls = (each for each in walked.nodes if isinstance(each, Call))
    rough = (c for c in calls if c.ufunc not in PARTIALS and (c.moves or c.ufunc not in KINKED))
    with np.errstate(all="ignore"):
        forms = walked.forms
        found = Traits(
            len(unknowns),
            integer,
            tuple(open_below),
            next((node.ufunc.__name__ for node in rough), ""),
            _first_nonlinear(model),
            longest,
            _first_unlevelled(model) if longest and len(forms) < len(walked.nodes) else None,
        )
    walked.traits = found
    return found


def _first_nonlinear(model: Model) -> Flaw | None:
    """The first that is not affine, with the function to blame."""
    done, label = model.walked.forms, "objective"
    try:
        affine(model.objective, {}, done)
        label = "preference"
        for each in model.preferences:
            affine(each, {}, done)
        for constraint in model.constraints:
            label = constraint.label
            for side in constraint.relation.sides:
                affine(side, {}, done)
    except NotAffineError as error:
        return label, str(error)
    return None


def _first_unlevelled(model: Model) -> Flaw | None:
    """The first constraint that has no form, even with bounds of `Bounded` functions."""
    done, relaxed, forms = dict[int, Operand](), Relaxation(), model.walked.forms
    for constraint in model.constraints:
        try:
            for side in constraint.relation.sides:
                if isinstance(side, Expression) and id(side) not in forms:
                    exponential(side, {}, done, relaxed)
        except NotExponentialError as error:
            return constraint.label, str(error)
    return None
