"""What a model is, found from its trees: linear, smooth, kinked, integer, open below."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from formulations.formulation import Formulation
from formulations.p1 import P1
from formulations.p2 import P2
from formulations.p3 import P3
from formulations.p4 import P4
from optuav.engines.registry import takers
from optuav.modelling import Model, Parameter
from optuav.modelling.classify import traits
from optuav.solving import formulate
from tests.formulations.given import LINEAR, quantities

p = Parameter("p", "p", "1", 2.0)


def of(relation: Callable[[Any, Any], Any]) -> Model:
    """max x subject to a relation of x and y."""
    model = Model("test")
    x, y = (model.variable(name, name, unit="1") for name in "xy")
    model.maximise(x)
    model.subject_to("row", relation(x, y))
    return model


@pytest.mark.parametrize(
    ("relation", "linear", "smooth"),
    [
        pytest.param(lambda x, y: x + y <= 1.0, True, True, id="sum"),
        pytest.param(lambda x, y: p * x - y / p >= p, True, True, id="times parameters"),
        pytest.param(lambda x, y: np.sin(p) * x == np.exp(p) * y, True, True, id="of parameters"),
        pytest.param(lambda x, y: x <= np.abs(p) + np.maximum(p, 1.0), True, True, id="kinks of p"),
        pytest.param(lambda x, y: -(+x) <= y - y, True, True, id="signs"),
        pytest.param(lambda x, y: x * y <= 1.0, False, True, id="product"),
        pytest.param(lambda x, y: p / x <= 1.0, False, True, id="divisor"),
        pytest.param(lambda x, y: x**2 <= y, False, True, id="square"),
        pytest.param(lambda x, y: np.expm1(x) <= y, False, True, id="function"),
        pytest.param(lambda x, y: y >= np.abs(x), False, False, id="modulus"),
        pytest.param(lambda x, y: y >= np.maximum(x, 1.0), False, False, id="maximum"),
        pytest.param(lambda x, y: y >= np.minimum(p, x), False, False, id="minimum"),
        pytest.param(lambda x, y: y >= np.sign(x), False, False, id="sign"),
        pytest.param(lambda x, y: y >= np.heaviside(x, 1.0), False, False, id="step"),
        pytest.param(lambda x, y: y >= np.sqrt(np.abs(x) + 1.0), False, False, id="kink below"),
        pytest.param(lambda x, y: y >= np.cbrt(x), False, True, id="cube root"),
        pytest.param(lambda x, y: x * y <= np.floor(p), False, True, id="steps of p"),
        pytest.param(lambda x, y: x * y <= np.mod(p, 2.0), False, False, id="unknown of p"),
    ],
)
def test_linear_and_smooth(relation: Callable[[Any, Any], Any], linear: bool, smooth: bool) -> None:
    """A function of parameters alone is a number, whatever it is."""
    found = traits(of(relation))
    assert (found.linear, found.smooth) == (linear, smooth)
    assert (found.unknowns, found.integer, found.open_below) == (2, False, ())
    assert (found.nonlinear or ("",))[0] == ("" if linear else "row")


@pytest.mark.parametrize(
    "function",
    [np.floor, np.ceil, np.trunc, np.rint, np.fabs, np.spacing]
    + [lambda x, f=f: f(x, 2.0) for f in (np.fmax, np.fmin, np.mod, np.fmod, np.floor_divide)],
)
def test_only_what_is_known_to_be_smooth_is(function: Callable[[Any], Any]) -> None:
    """Steps and kinks under other names, and functions of which nothing is known."""
    found = traits(of(lambda x, y: y >= function(x)))
    assert not found.smooth
    assert takers(found, slots=False) == ("grid",)


@pytest.mark.parametrize("factor", [lambda y: y, lambda y: np.exp(-0.01 * y), lambda y: p * y])
def test_times_that_multiply_are_not_for_bracket(factor: Callable[[Any], Any]) -> None:
    """It takes products of what levels out, and says before it starts that it takes no others."""
    found = traits(of(lambda x, y: x * factor(y) <= 1.0))
    assert found.unlevelled == ("row", "unknowns are multiplied")
    assert takers(found, slots=False) == ("casadi", "grid")
    assert not traits(of(lambda x, y: np.exp(-x) * np.exp(-y) >= 0.5)).unlevelled


def test_first_nonlinear_place_is_named() -> None:
    """The objective, a preference, then constraints in order; with the function to blame."""
    model = of(lambda x, y: x * y <= 1.0)
    x, y = model.variables
    model.subject_to("later", np.sin(x) <= 1.0)
    assert traits(model).nonlinear == ("row", "multiply of the unknowns is not linear")
    model.prefer_small(np.cos(y))
    assert traits(model).nonlinear == ("preference", "cos of the unknowns is not linear")
    model.objective = np.exp(x)
    assert traits(model).nonlinear == ("objective", "exp of the unknowns is not linear")


def test_kinks_in_a_named_quantity_count() -> None:
    model = of(lambda x, y: x <= 1.0)
    bent = model.let("bent", np.abs(model.variables[0]))
    model.subject_to("bent", bent <= 3.0)
    assert not traits(model).smooth


def test_integer_and_open_below() -> None:
    """Binary unknowns, and unknowns without a lower bound by symbol."""
    model = of(lambda x, y: x <= 1.0)
    assert not traits(model).integer
    model.variable("z", "z", unit="1", upper=1.0, binary=True)
    model.variable("a", "α", unit="1", lower=-math.inf)
    found = traits(model)
    assert (found.unknowns, found.integer, found.open_below) == (4, True, ("α",))


@pytest.mark.parametrize(
    ("relation", "words"),
    [
        (lambda x, y: x <= 1.0, "linear, 2 unknowns"),
        (lambda x, y: x * y <= 1.0, "smooth, 2 unknowns"),
        (lambda x, y: abs(x) <= 1.0, "not smooth, 2 unknowns"),
    ],
)
def test_in_words(relation: Callable[[Any, Any], Any], words: str) -> None:
    model = of(relation)
    assert str(traits(model)) == words
    model.variable("z", "z", unit="1", binary=True)
    assert str(traits(model)) == words.replace("2", "3") + ", some unknowns binary"


def test_one_unknown_in_words() -> None:
    model = Model("test")
    model.maximise(model.variable("x", "x", unit="1"))
    assert str(traits(model)) == "linear, 1 unknown"


@pytest.mark.parametrize("perspective", LINEAR)
@pytest.mark.parametrize("formulation", [P1(), P2(), P2(tight=True), P3(), P4("b1")])
def test_problems_of_the_paper_are_linear(formulation: Formulation, perspective: str) -> None:
    """In its own perspectives; P3 in Δ alone."""
    found = traits(formulation.model(quantities(), perspective))
    assert (found.linear, found.smooth, found.integer) == (True, True, False)
    assert found.unknowns == (1 if isinstance(formulation, P3) else 2)


@pytest.mark.parametrize("problem", ["P1", "P2", "P2-tight", "P3"])
def test_wells_are_smooth_and_not_linear(problem: str) -> None:
    """Through e^(−k'δ) of the times."""
    for part in formulate("paper", problem, perspective="wells").parts:
        found = traits(part.model)
        assert (found.linear, found.smooth) == (False, True)
        assert (found.nonlinear or ("",))[0].endswith("state of charge")
