"""Affine forms: exact where there is one, refused by name where there is none."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from optuav.modelling import Let, NotAffineError, Parameter, Variable, affine

X: Any
Y: Any
X, Y = (Variable(name, name, "1", 0.0, math.inf, name, 0) for name in "xy")
P: Any = Parameter("p", "p", "1", 4.0)
SMALL = st.integers(-4, 4)


class Known(NamedTuple):
    """A tree beside its coefficients in exact arithmetic: constant, of x, of y."""

    tree: Any
    exact: tuple[Fraction, Fraction, Fraction]


def unit(tree: Any, *exact: int) -> Known:
    constant, of_x, of_y = (Fraction(number) for number in exact)
    return Known(tree, (constant, of_x, of_y))


def added(left: Known, right: Known) -> Known:
    a, b, c = (p + q for p, q in zip(left.exact, right.exact, strict=True))
    return Known(left.tree + right.tree, (a, b, c))


def subtracted(left: Known, right: Known) -> Known:
    a, b, c = (p - q for p, q in zip(left.exact, right.exact, strict=True))
    return Known(left.tree - right.tree, (a, b, c))


def scaled(known: Known, factor: int, way: int) -> Known:
    a, b, c = (factor * number for number in known.exact)
    trees = (known.tree * factor, float(factor) * known.tree, known.tree * (factor * P / P))
    return Known(trees[way], (a, b, c))


def halved(known: Known, power: int) -> Known:
    a, b, c = (number / 2**power for number in known.exact)
    return Known(known.tree / 2.0**power, (a, b, c))


def negated(known: Known) -> Known:
    a, b, c = (-number for number in known.exact)
    return Known(-known.tree, (a, b, c))


def named(known: Known) -> Known:
    return Known(Let("n", "n", "1", known.tree), known.exact)


KNOWN = st.recursive(
    st.sampled_from([unit(X, 0, 1, 0), unit(Y, 0, 0, 1), unit(P, 4, 0, 0)])
    | SMALL.map(lambda n: unit(float(n), n, 0, 0)),
    lambda parts: st.one_of(
        st.builds(added, parts, parts),
        st.builds(subtracted, parts, parts),
        st.builds(scaled, parts, SMALL, st.integers(0, 2)),
        st.builds(halved, parts, st.integers(-2, 3)),
        st.builds(negated, parts),
        st.builds(named, parts),
    ),
    max_leaves=15,
)


@given(KNOWN)
def test_affine_trees_are_recovered_exactly(known: Known) -> None:
    """Sums, differences, multiples and fractions of unknowns against exact arithmetic."""
    form = affine(known.tree, {})
    found = (form.constant, form.coefficients.get("x", 0.0), form.coefficients.get("y", 0.0))
    assert tuple(Fraction(float(number)) for number in found) == known.exact


@pytest.mark.parametrize(
    ("build", "ufunc"),
    [
        (lambda: X * Y, "multiply"),
        (lambda: X * X, "multiply"),
        (lambda: (X + 1.0) * (P - Y), "multiply"),
        (lambda: X / Y, "divide"),
        (lambda: 1.0 / X, "divide"),
        (lambda: P / (X + P), "divide"),
        (lambda: X**2, "power"),
        (lambda: 2.0**X, "power"),
        (lambda: abs(X), "absolute"),
        (lambda: np.exp(X), "exp"),
        (lambda: np.expm1(-P * X), "expm1"),
        (lambda: np.log(X), "log"),
        (lambda: np.log1p(X), "log1p"),
        (lambda: np.sqrt(X), "sqrt"),
        (lambda: np.sin(X), "sin"),
        (lambda: np.cos(X), "cos"),
        (lambda: np.arcsin(X), "arcsin"),
        (lambda: np.arctan2(X, P), "arctan2"),
        (lambda: np.arctan2(P, Y), "arctan2"),
        (lambda: np.maximum(X, 0.0), "maximum"),
        (lambda: np.minimum(X, Y), "minimum"),
        (lambda: np.sign(X), "sign"),
    ],
)
def test_nonlinear_forms_are_refused_by_name(build: Callable[[], Any], ufunc: str) -> None:
    """Wherever it stands in the tree, the error says which function it was."""
    for tree in (build(), 1.0 - 2.0 * build() + X):
        with pytest.raises(NotAffineError, match=rf"^{ufunc} of the unknowns is not linear"):
            affine(tree, {})


def test_functions_of_parameters_fold_to_numbers() -> None:
    """What no unknown enters may be as nonlinear as it likes."""
    form = affine(np.exp(-P) * X / np.sqrt(P) + np.maximum(P, 7.0) - P**2 * Y, {})
    assert form.constant == 7.0
    assert form.coefficients["x"] == pytest.approx(math.exp(-4.0) / 2.0, rel=1e-15)
    assert form.coefficients["y"] == -16.0


def test_parameters_may_be_given_other_values_and_arrays() -> None:
    """One entry a programme, as many as the array has."""
    form = affine(P * X + 1.0 / P, {"p": np.array([2.0, 4.0])})
    np.testing.assert_array_equal(form.coefficients["x"], [2.0, 4.0])
    np.testing.assert_array_equal(form.constant, [0.5, 0.25])
    assert affine(P * X, {}).coefficients["x"] == 4.0


def test_number_alone_is_affine() -> None:
    form = affine(3.0, {})
    assert (form.constant, form.coefficients) == (3.0, {})
