"""A declared linear model as rows A x ≤ b and goals c x, for many programmes at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from optuav.arrays import Booleans, Floats, Values
from optuav.modelling.check import TOLERANCE, relations
from optuav.modelling.forms import Affine, affine, excess
from optuav.modelling.model import Model


@dataclass(frozen=True)
class LinearForm:
    """Rows A x ≤ b and goals; an equality gives two rows with the same label.

    Parameters
    ----------
    names
        Names of the unknowns.
    labels, signs
        Label of the constraint of every row; −1 for the second row of an equality, 1 otherwise.
    normals, limits
        A (row, unknown, programme) and b (row, programme).
    directions, offsets
        What to maximise first, then among equals, and so on: coefficients (goal, unknown,
        programme) and constants (goal, programme).
    towards
        1 if the model maximises, −1 if it minimises: the first goal is the objective times this.
    bounds
        (row, unknown) of the rows that are the unknowns' own bounds.
    """

    names: tuple[str, ...]
    labels: tuple[str, ...]
    signs: tuple[float, ...]
    normals: Floats
    limits: Floats
    directions: Floats
    offsets: Floats
    towards: float
    bounds: tuple[tuple[int, int], ...]

    @property
    def usable(self) -> Booleans:
        """Programmes whose numbers are all numbers; a limit may be infinite."""
        found = np.isfinite(self.normals).all(axis=(0, 1)) & ~np.isnan(self.limits).any(axis=0)
        found &= np.isfinite(self.directions).all(axis=(0, 1)) & ~np.isnan(self.offsets).any(axis=0)
        return np.asarray(found)


@np.errstate(divide="ignore", invalid="ignore", over="ignore")
def linear_form(model: Model, values: Values, programmes: int = 1) -> LinearForm:
    """The rows and goals of a linear model.

    Parameters
    ----------
    model
        The declaration.
    values
        Values of parameters that differ from the model's, by name.
    programmes
        Number of entries of those parameters that are arrays.

    Raises
    ------
    NotAffineError
        If the model is not linear.
    """
    names = tuple(variable.name for variable in model.variables)
    labels: list[str] = []
    signs: list[float] = []
    forms: list[Affine] = []
    for constraint in relations(model):
        relation = constraint.relation
        form, right = excess(relation, values)
        if not form.coefficients:
            # Nothing but rounding stands between two stated figures that ought to be equal.
            allowance = TOLERANCE * np.maximum(1.0, np.abs(right))
            form = Affine(np.where(np.abs(form.constant) <= allowance, 0.0, form.constant), {})
        for sign in relation.signs:
            labels.append(constraint.label)
            signs.append(sign if relation.sense == "==" else 1.0)
            forms.append(form.times(sign))
    stated = sum(len(each.relation.signs) for each in model.constraints)
    bounds = tuple(
        (row, names.index(name))
        for row, form in enumerate(forms[stated:], start=stated)
        for name in form.coefficients
    )
    goals = [affine(model.objective, values).times(model.towards)]
    goals += [affine(each, values).times(-1.0) for each in model.preferences]
    normals, constants = _stack(forms, names, programmes)
    directions, offsets = _stack(goals, names, programmes)
    rows = tuple(labels), tuple(signs), normals, -constants
    return LinearForm(names, *rows, directions, offsets, model.towards, bounds)


def by_label(form: LinearForm, multipliers: Floats) -> dict[str, float]:
    """Multipliers of constraints, from those of rows; the two bounds of an unknown are netted."""
    found = dict.fromkeys(form.labels, 0.0)
    net: dict[tuple[str, int], float] = {}
    bounds = dict(form.bounds)
    for row, label in enumerate(form.labels):
        weight = float(multipliers[row])
        if row not in bounds:
            found[label] += form.signs[row] * weight
            continue
        k = bounds[row]
        pushed = weight if form.normals[row, k, 0] > 0.0 else -weight
        net[label, k] = net.get((label, k), 0.0) + pushed
    for (label, _), pushed in net.items():
        found[label] += abs(pushed)
    return found


def _stack(forms: Sequence[Affine], names: Sequence[str], programmes: int) -> tuple[Floats, Floats]:
    """Coefficients (form, unknown, programme) and constants (form, programme)."""
    coefficients = np.zeros((len(forms), len(names), programmes))
    constants = np.empty((len(forms), programmes))
    for k, form in enumerate(forms):
        constants[k] = form.constant
        for j, name in enumerate(names):
            if name in form.coefficients:
                coefficients[k, j] = form.coefficients[name]
    return coefficients, constants
