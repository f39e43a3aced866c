"""Numbers that no engine can use are told by the parameter, or by the label where they stand."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from optuav.engines import closed_form
from optuav.errors import InputError
from optuav.modelling import Model, Parameter
from optuav.modelling.usable import refuse_misfits, unusable


def bounded_by(right: Any) -> Model:
    """max x where x ≤ 3 and "bad" holds."""
    model = Model("test")
    x: Any = model.variable("x", "x", unit="1")
    model.maximise(x)
    model.subject_to("good", x <= 3.0)
    model.subject_to("bad", x <= right(x) if callable(right) else x <= right)
    return model


def test_parameters_are_named() -> None:
    p = Parameter("p", "p", "1", np.array([1.0, math.nan]))
    model = bounded_by(p)
    assert [unusable(model, model.row(k)) for k in range(2)] == ["", "p = nan"]
    assert closed_form.solve(model, 2).refusal(1) == (
        "closed-form met numbers that it cannot use: p = nan"
    )


@pytest.mark.parametrize(
    "right",
    [math.nan, lambda x: x * math.nan, lambda x: x / Parameter("zero", "0", "1", 0.0)],
    ids=["side", "factor", "divisor"],
)
def test_labels_are_named(right: Any) -> None:
    """Of bare numbers that are none, and of unknowns over a parameter that is 0."""
    model = bounded_by(right)
    assert unusable(model, model.row(0)) == "'bad'"
    assert closed_form.solve(model, 1).refusal(0).endswith("cannot use: 'bad'")


def test_an_infinite_limit_is_usable() -> None:
    model = bounded_by(math.inf)
    assert unusable(model, {}) == ""


def test_arrays_have_one_entry_or_one_a_programme() -> None:
    """Bare or of parameters, in a term or as a side; all misfits at once."""
    three = np.array([1.0, 2.0, 3.0])
    refuse_misfits(bounded_by(three), 3)
    refuse_misfits(bounded_by(np.array([1.0])), 3)
    refuse_misfits(bounded_by(1.0), 3)
    for right in (three, lambda x: x * three, Parameter("p", "p", "1", three)):
        with pytest.raises(InputError, match=r"bad = array of shape \(3,\): arrays with one entry"):
            refuse_misfits(bounded_by(right), 2)
