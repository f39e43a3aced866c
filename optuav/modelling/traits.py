"""What a model is, found from its trees: linear, smooth, integer, and in how many unknowns."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from optuav.modelling.affine import NotAffineError, affine
from optuav.modelling.expression import Leaf, Operand, Variable, fold
from optuav.modelling.model import Model

KINKED = frozenset({np.absolute, np.sign, np.heaviside, np.maximum, np.minimum})
"""Functions without a derivative somewhere."""


@dataclass(frozen=True)
class Traits:
    """Properties of a model.

    Parameters
    ----------
    unknowns
        Number of variables.
    linear
        Whether objective and constraints are affine in them.
    smooth
        Whether they have derivatives everywhere.
    integer
        Whether some variable is binary.
    open_below
        Symbols of the variables without a lower bound.
    nonlinear_label, nonlinear_words
        The first constraint (or "objective") that is not affine, and why; empty if all are.
    """

    unknowns: int
    linear: bool
    smooth: bool
    integer: bool
    open_below: tuple[str, ...] = ()
    nonlinear_label: str = ""
    nonlinear_words: str = ""

    def __str__(self) -> str:
        kind = "linear" if self.linear else "smooth" if self.smooth else "not smooth"
        integer = ", some unknowns binary" if self.integer else ""
        plural = "" if self.unknowns == 1 else "s"
        return f"{kind}, {self.unknowns} unknown{plural}{integer}"


def traits(model: Model) -> Traits:
    """Properties of a model, found by walking its trees."""
    label, words = _first_nonlinear(model)
    return Traits(
        unknowns=len(model.variables),
        linear=not label,
        smooth=all(_smooth(tree) for tree in model.expressions),
        integer=any(variable.binary for variable in model.variables),
        open_below=tuple(
            variable.symbol
            for variable in model.variables
            if isinstance(variable.lower, float) and variable.lower == -math.inf
        ),
        nonlinear_label=label,
        nonlinear_words=words,
    )


def _first_nonlinear(model: Model) -> tuple[str, str]:
    named = [("objective", model.objective)]
    named += [("preference", each) for each in model.preferences]
    for constraint in model.constraints:
        named += [
            (constraint.label, side)
            for side in (constraint.relation.left, constraint.relation.right)
        ]
    for label, tree in named:
        try:
            affine(tree, {})
        except NotAffineError as error:
            return label, str(error)
    return "", ""


def _smooth(expression: Operand) -> bool:
    """Whether no kinked function stands over a variable."""
    kinks = []

    def leaf(node: Leaf) -> bool:
        return isinstance(node, Variable)

    def call(ufunc: np.ufunc, arguments: tuple[Any, ...]) -> bool:
        varies = any(each is True for each in arguments)
        if varies and ufunc in KINKED:
            kinks.append(ufunc)
        return varies

    fold(expression, leaf, call)
    return not kinks
