"""Declaring a model: what is refused, what is remembered."""

from __future__ import annotations

import inspect
import pickle
from typing import Any, cast

import numpy as np
import pytest

from optuav.errors import InputError
from optuav.modelling import Model, Parameter, Relation, affine, check
from optuav.modelling.classify import traits


def test_constraint_remembers_the_line_that_declared_it() -> None:
    """The file's name and the line of the call, whichever function it stands in."""
    model = Model("test")
    x = model.variable("x", "x", unit="s")

    def declare() -> int:
        model.subject_to("inner", x <= 1.0)
        frame = inspect.currentframe()
        return 0 if frame is None else frame.f_lineno - 2

    line = declare()
    assert model.constraints[0].declared_at == f"test_model.py:{line}"


def test_names_and_labels_are_given_once() -> None:
    """A second use would silently replace the first in values, prices and messages."""
    model = Model("test")
    x = model.variable("x", "x", unit="s")
    model.subject_to("a", x <= 1.0)
    model.let("n", x + 1.0)
    with pytest.raises(InputError, match="variable 'x'"):
        model.variable("x", "y", unit="s")
    with pytest.raises(InputError, match="constraint 'a'"):
        model.subject_to("a", x <= 2.0)
    with pytest.raises(InputError, match="quantity 'n'"):
        model.let("n", x)


@pytest.mark.parametrize("stated", [True, 1.0, np.array([True])])
def test_constraint_must_compare_expressions(stated: Any) -> None:
    """Numbers compared with numbers leave a boolean, which states nothing."""
    with pytest.raises(TypeError, match="deadline"):
        Model("test").subject_to("deadline", cast(Relation, stated))


def test_variables_start_at_zero_and_have_labelled_bounds() -> None:
    model = Model("test")
    x = model.variable("x", "T'", unit="s")
    y = model.variable("y", "y", unit="s", lower=-1.0, upper=2.0, label="P9.z range")
    assert (x.lower, x.upper, x.label) == (0.0, float("inf"), "bounds of T'")
    assert (y.lower, y.upper, y.label) == (-1.0, 2.0, "P9.z range")


@pytest.mark.parametrize("second", ["maximise", "minimise"])
def test_a_second_objective_is_refused(second: str) -> None:
    """Of two, neither is dropped without a word, and the model stays as it was."""
    model = Model("test")
    x = model.variable("x", "x", unit="s")
    model.maximise(x)
    with pytest.raises(InputError, match=f"{second}: the model maximises an objective already"):
        getattr(model, second)(2.0 * x)
    assert (model.sense, model.objective is x) == ("maximise", True)


def test_row_picks_one_programme_of_several() -> None:
    """Arrays give their entry, numbers are shared by all."""
    model = Model("test")
    x = model.variable("x", "x", unit="s", upper=Parameter("p", "p", "s", np.array([1.0, 2.0])))
    model.subject_to("a", x * Parameter("q", "q", "1", 3.0) <= 4.0)
    assert model.row(1) == {"p": 2.0, "q": 3.0}


def test_parameters_are_found_wherever_they_occur() -> None:
    """In the objective, the bounds and the constraints; each once, in order of appearance."""
    model = Model("test")
    p, q, r = (Parameter(name, name, "1", 1.0) for name in "pqr")
    x = model.variable("x", "x", unit="1", upper=q)
    model.maximise(p * x)
    model.subject_to("a", x + q <= r)
    assert list(model.parameters) == ["p", "q", "r"]


def test_two_unknowns_with_one_symbol_are_refused() -> None:
    """No reader could tell them apart on the page."""
    model = Model("test")
    model.variable("x", "Δ", unit="s")
    with pytest.raises(InputError, match="variable with the symbol 'Δ' already"):
        model.variable("y", "Δ", unit="s")


@pytest.mark.parametrize("label", ["", "  "])
def test_a_constraint_without_a_label_is_refused(label: str) -> None:
    model = Model("test")
    x: Any = model.variable("x", "x", unit="1")
    with pytest.raises(InputError, match="needs a label"):
        model.subject_to(label, x <= 1.0)


def test_american_spelling_is_accepted() -> None:
    assert (Model.maximize, Model.minimize) == (Model.maximise, Model.minimise)


def test_what_is_remembered_is_found_again_once_the_model_changes() -> None:
    """Traits and parameters after a further constraint, another bound, another goal."""
    model = Model("changing")
    x = model.variable("x", "x", unit="s")
    model.maximise(x)
    assert (traits(model).linear, [*model.given]) == (True, [])
    x.upper = Parameter("most_s", "m", "s", 3.0)
    assert [*model.given] == ["most_s"]
    model.subject_to("curved", x**2 <= 4.0)
    assert not traits(model).linear
    x.binary = True
    assert traits(model).integer


def test_a_pickled_model_is_the_same_model() -> None:
    """Also once its trees were walked."""
    model = Model("pickled")
    x = model.variable("x", "x", unit="s", upper=Parameter("most_s", "m", "s", 3.0))
    model.maximise(x)
    model.subject_to("half", 2.0 * x <= 5.0)
    model.subject_to("twice", 0.5 * x <= 5.0)
    assert traits(model).linear
    again = pickle.loads(pickle.dumps(model))
    assert str(again) == str(model)
    assert check(again, {"x": 2.75}).satisfied == check(model, {"x": 2.75}).satisfied
    for one, expected in zip(again.constraints, (2.0, 0.5), strict=True):
        assert affine(one.relation.left, {}).coefficients == {"x": expected}
