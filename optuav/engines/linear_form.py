"""Linear constraints of a model as rows A x ≤ b, and the bounds that they imply on the unknowns.

A linear model gives rows and goals for many programmes at once; of any other model the linear
constraints bound the unknowns, for whole slots and for where to look.
"""

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from optuav.arrays import Booleans, Floats, Values
from optuav.errors import InputError
from optuav.modelling.check import CONSTRAINT_TOLERANCE, relations
from optuav.modelling.expression import Operand
from optuav.modelling.forms import Affine, NotAffineError, affine, excess
from optuav.modelling.model import Model
from optuav.modelling.traversal import evaluate, leaves

SLOTS_ROUNDING = 1e-9  # Relative, on the number of slots that fit
TYPICAL = 1000.0  # Reach of an unknown without a bound
LEAST = 1e-3
"""Least reach for scaling an unknown, if the constraints leave it next to no room."""


@dataclass(frozen=True)
class LinearForm:
    """Rows A x ≤ b and goals; an equality gives two rows with the same label."""

    names: tuple[str, ...]  # Names of the unknowns
    labels: tuple[str, ...]  # Label of every row's constraint
    # −1 for the second row of an equality and for a lower bound of an unknown, 1 otherwise
    signs: tuple[float, ...]
    normals: Floats  # A (row, unknown, programme)
    limits: Floats  # b (row, programme)
    directions: Floats  # What to maximise first, then among equals…: (goal, unknown, programme)
    offsets: Floats  # Constants of these goals (goal, programme)
    sign: float  # 1 if the model maximises, −1 if it minimises: sign of the first goal
    bounds: tuple[tuple[int, int], ...]  # (row, unknown) of the unknowns' own bounds

    @property
    def usable(self) -> Booleans:
        """Programmes whose numbers are all numbers; a limit may be infinite."""
        usable = np.isfinite(self.normals).all(axis=(0, 1)) & ~np.isnan(self.limits).any(axis=0)
        usable &= np.isfinite(self.directions).all(axis=(0, 1))
        return np.asarray(usable & ~np.isnan(self.offsets).any(axis=0))


@np.errstate(divide="ignore", invalid="ignore", over="ignore")
def linear_form(model: Model, values: Values, programmes: int = 1) -> LinearForm:
    """The rows and goals of a linear model; `NotAffineError` if it is not linear.

    Parameters may have other values by name: numbers, or arrays with one entry a programme.
    """
    names = tuple(variable.name for variable in model.variables)
    labels, signs, bounds = list[str](), list[float](), list[tuple[int, int]]()
    column = {name: k for k, name in enumerate(names)}
    rows, done = list[tuple[float, Affine]](), model.walked.forms(values)
    for number, constraint in enumerate(relations(model)):
        relation, is_bound = constraint.relation, number >= len(model.constraints)
        form, right = excess(relation, values, done)
        if not form.coefficients:
            # Nothing but rounding stands between two stated figures that ought to be equal.
            allowance = CONSTRAINT_TOLERANCE * np.maximum(1.0, np.abs(right))
            form = Affine(np.where(np.abs(form.constant) <= allowance, 0.0, form.constant), {})
        for sign in relation.signs:
            bounds += [(len(rows), column[name]) for name in form.coefficients if is_bound]
            labels.append(constraint.label)
            signs.append(sign if is_bound or relation.sense == "==" else 1.0)
            rows.append((sign, form))
    goals = [(model.sign, affine(model.objective, values, done))]
    goals += [(-1.0, affine(preference, values, done)) for preference in model.preferences]

    def stack(forms: Sequence[tuple[float, Affine]]) -> tuple[Floats, Floats]:
        """Coefficients (form, unknown, programme) and constants (form, programme), with signs."""
        numbers = np.zeros((len(forms), len(names) + 1, programmes))
        for row, (_, (constant, coefficients)) in zip(numbers, forms, strict=True):
            row[-1] = constant
            for name, coefficient in coefficients.items():
                row[column[name]] = coefficient
        numbers *= np.array([sign for sign, _ in forms]).reshape(-1, 1, 1)
        return numbers[:, :-1], numbers[:, -1]

    normals, constants = stack(rows)
    figures = normals, -constants, *stack(goals)
    return LinearForm(names, (*labels,), (*signs,), *figures, model.sign, (*bounds,))


def own_bounds(model: Model, parameters: Values) -> dict[str, tuple[float, float]]:
    """The stated lower and upper bound of every unknown."""
    bounds = {}
    for variable in model.variables:
        low, high = (float(evaluate(end, parameters)) for end in (variable.lower, variable.upper))
        bounds[variable.name] = low, high
    return bounds


def implied_upper_bounds(
    model: Model, parameters: Values, lower: Mapping[str, float]
) -> dict[str, float]:
    """Upper bounds that linear constraints put on each unknown, the others at their lower."""
    upper, done = dict.fromkeys(lower, math.inf), dict[int, Operand]()
    excesses = list[Affine]()
    for relation in (constraint.relation for constraint in model.constraints):
        with suppress(NotAffineError):
            excesses += map(excess(relation, parameters, done)[0].times, relation.signs)
    for constant, coefficients in excesses:
        least = constant + sum(
            coefficient * lower[name] for name, coefficient in coefficients.items()
        )
        if math.isinf(least) or any(coefficient < 0.0 for coefficient in coefficients.values()):
            continue
        for name, coefficient in coefficients.items():
            if coefficient > 0.0:
                upper[name] = min(upper[name], lower[name] - least / coefficient)
    return upper


def reaches(model: Model, parameters: Values) -> tuple[Floats, Floats]:
    """Return a start for every unknown, and how far from there it may lie."""
    bounds = own_bounds(model, parameters)
    lower, upper = np.array([*bounds.values()]).reshape(-1, 2).T
    lowest = {name: low for name, (low, _) in bounds.items()}
    implied = implied_upper_bounds(model, parameters, lowest)
    reach = np.minimum(upper, [*implied.values()]) - lower
    reach = np.where((reach > 0.0) & (reach < math.inf), np.maximum(reach, LEAST), TYPICAL)
    open_below = np.where(np.isinf(upper), -0.5 * TYPICAL, upper - TYPICAL)
    return np.where(np.isinf(lower), open_below, lower), reach


def last_slot(bound_s: float, slot_s: float, *, begun: bool) -> int:
    """Number of the last slot up to a bound; with `begun`, the one that the bound cuts short."""
    slots = bound_s / slot_s
    nearest = round(slots)
    if abs(slots - nearest) <= SLOTS_ROUNDING * max(1.0, abs(slots)):
        return nearest
    return math.ceil(slots) if begun and slots > 0.0 else math.floor(slots)


def cut_short(model: Model) -> set[str]:
    """Unknowns whose last slot their own upper bound may cut short; an equation holds it whole."""
    equations = (row.relation for row in model.constraints if row.relation.sense == "==")
    equated = {leaf.name for relation in equations for leaf in leaves(*relation.sides)}
    counted = (variable for variable in model.variables if not variable.binary)
    ends = {x.name for x in counted if not (isinstance(x.upper, float) and math.isinf(x.upper))}
    return ends - equated


def slot_ranges(model: Model, parameters: Values, slot_s: float) -> dict[str, tuple[int, int]]:
    """First and last slot of every unknown that is not binary, from 0; last < first for none.

    A last slot that the unknown's own upper bound cuts short counts; one that a constraint between
    unknowns or an equation cuts short does not.
    """
    bounds, cut, ranges = own_bounds(model, parameters), cut_short(model), {}
    lowest = {name: least for name, (least, _) in bounds.items()}
    implied = implied_upper_bounds(model, parameters, lowest)
    for variable in (unknown for unknown in model.variables if not unknown.binary):
        least, most = bounds[variable.name]
        bound = min(implied[variable.name], most)
        if not math.isfinite(least):
            raise InputError(f"whole slots need a lower bound on {variable.symbol}")
        if not bound < math.inf:
            raise InputError(f"whole slots need an upper bound on {variable.symbol}")
        bound = max(bound, least - slot_s)  # it may lie infinitely far below: no slot fits
        first = max(variable.first_slot, -last_slot(-least, slot_s, begun=False))
        ends_it = variable.name in cut and bound == most >= least
        last = last_slot(bound, slot_s, begun=ends_it)
        ranges[variable.name] = (first, max(last, first - 1))
    return ranges
