"""How far the unknowns of a model can go, from their bounds and its linear constraints."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from contextlib import suppress

from optuav.arrays import Values
from optuav.errors import InputError
from optuav.modelling.expression import Operand
from optuav.modelling.forms import Affine, NotAffineError, excess
from optuav.modelling.model import Model
from optuav.modelling.traversal import evaluate, leaves

TOLERANCE = 1e-9
"""Relative, on the number of slots that fit."""


def lower_bounds(model: Model, parameters: Values) -> dict[str, float]:
    """The stated lower bound of every unknown."""
    return {each.name: float(evaluate(each.lower, parameters)) for each in model.variables}


def own_upper_bounds(model: Model, parameters: Values) -> dict[str, float]:
    """The stated upper bound of every unknown."""
    return {each.name: float(evaluate(each.upper, parameters)) for each in model.variables}


def implied_upper_bounds(
    model: Model, parameters: Values, lower: Mapping[str, float]
) -> dict[str, float]:
    """Upper bounds that linear constraints put on each unknown, the others at their lower."""
    return upper_bounds_by(linear_excesses(model, parameters), lower)


def linear_excesses(model: Model, parameters: Values) -> list[Affine]:
    """Expressions that linear constraints keep at most 0; two for an equation."""
    found: list[Affine] = []
    for relation in (each.relation for each in model.constraints):
        with suppress(NotAffineError):
            form, _ = excess(relation, parameters)
            found += map(form.times, relation.signs)
    return found


def upper_bounds_by(excesses: Iterable[Affine], lower: Mapping[str, float]) -> dict[str, float]:
    """As `implied_upper_bounds`, from expressions that are at most 0."""
    upper = dict.fromkeys(lower, math.inf)
    for constant, coefficients in excesses:
        if any(coefficient < 0.0 for coefficient in coefficients.values()):
            continue
        least = constant + sum(coefficients[name] * lower[name] for name in coefficients)
        if math.isinf(least):
            continue
        for name, coefficient in coefficients.items():
            if coefficient > 0.0:
                upper[name] = min(upper[name], lower[name] - least / coefficient)
    return upper


def last_slot(bound_s: float, slot_s: float, *, begun: bool) -> int:
    """Number of the last slot up to a bound; with `begun`, the one that the bound cuts short."""
    slots = bound_s / slot_s
    nearest = round(slots)
    if abs(slots - nearest) <= TOLERANCE * max(1.0, abs(slots)):
        return nearest
    return math.ceil(slots) if begun and slots > 0.0 else math.floor(slots)


def cut_short(model: Model) -> set[str]:
    """Unknowns whose last slot their own upper bound may cut short; an equation holds it whole."""
    equations = (each.relation for each in model.constraints if each.relation.sense == "==")
    equated = {leaf.name for relation in equations for leaf in leaves(*relation.sides)}
    bounded = (each for each in model.variables if not (each.binary or _is_infinite(each.upper)))
    return {each.name for each in bounded} - equated


def _is_infinite(bound: Operand) -> bool:
    return isinstance(bound, float) and math.isinf(bound)


def slot_ranges(model: Model, parameters: Values, slot_s: float) -> dict[str, tuple[int, int]]:
    """First and last slot of every unknown that is not binary, counted from 0.

    Where the last slot is cut short by the unknown's own upper bound it counts; where a constraint
    between unknowns ends the range, or an equation holds the unknown, whole slots only. Where no
    slot is left, the last one is the one before the first.

    Raises
    ------
    InputError
        If an unknown has no lower bound, or nothing bounds it from above.
    """
    lower = lower_bounds(model, parameters)
    implied = implied_upper_bounds(model, parameters, lower)
    own = own_upper_bounds(model, parameters)
    cut = cut_short(model)
    ranges = {}
    for variable in (each for each in model.variables if not each.binary):
        least, bound = lower[variable.name], min(implied[variable.name], own[variable.name])
        if not math.isfinite(least):
            raise InputError(f"whole slots need a lower bound on {variable.symbol}")
        if not bound < math.inf:
            raise InputError(f"whole slots need an upper bound on {variable.symbol}")
        bound = max(bound, least - slot_s)  # it may lie infinitely far below: no slot fits
        first = max(variable.first_slot, -last_slot(-least, slot_s, begun=False))
        ends_it = variable.name in cut and bound == own[variable.name] >= least
        last = last_slot(bound, slot_s, begun=ends_it)
        ranges[variable.name] = (first, max(last, first - 1))
    return ranges
