"""Checking a point: which constraints hold, and by how much."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from optuav.engines import closed_form
from optuav.errors import InputError, SolverError
from optuav.modelling import Check, Model, Parameter, check
from optuav.modelling.check import refuse_misfits, unusable


def one_constraint(sense: str) -> Model:
    """x compared with 1000, no bounds."""
    model = Model("test")
    x = model.variable("x", "x", unit="s", lower=-math.inf)
    relation = {"<=": x <= 1000.0, ">=": x >= 1000.0, "==": x == 1000.0}[sense]
    model.subject_to("limit", relation, unit="s")
    return model


def only(rows: tuple[Check, ...]) -> Check:
    (row,) = rows
    return row


@pytest.mark.parametrize(
    ("sense", "x", "slack", "satisfied"),
    [
        ("<=", 900.0, 100.0, True),
        ("<=", 1100.0, -100.0, False),
        (">=", 900.0, -100.0, False),
        (">=", 1100.0, 100.0, True),
        ("==", 1000.0, 0.0, True),
        ("==", 900.0, -100.0, False),
        ("==", 1100.0, -100.0, False),
    ],
)
def test_slack_is_negative_where_it_is_violated(
    sense: str, x: float, slack: float, satisfied: bool
) -> None:
    row = only(check(one_constraint(sense), {"x": x}))
    assert (row.left, row.right, row.sense) == (x, 1000.0, sense)
    assert row.slack == slack
    assert bool(row.satisfied) is satisfied


@pytest.mark.parametrize("sense", ["<=", ">=", "=="])
def test_tolerance_is_a_billionth_of_the_right_side(sense: str) -> None:
    """1e-6 of 1000: rounding passes, anything that a person would notice does not."""
    beyond = -1.0 if sense == ">=" else 1.0
    model = one_constraint(sense)
    assert only(check(model, {"x": 1000.0 + beyond * 0.9e-6})).satisfied
    assert not only(check(model, {"x": 1000.0 + beyond * 1.1e-6})).satisfied


def test_small_right_sides_have_an_absolute_tolerance() -> None:
    model = Model("test")
    x = model.variable("x", "x", unit="1", lower=-math.inf)
    model.subject_to("small", x <= 0.0)
    assert only(check(model, {"x": 0.9e-9})).satisfied
    assert not only(check(model, {"x": 1.1e-9})).satisfied


def test_names_that_the_model_has_not_and_missing_ones_are_told_together() -> None:
    with pytest.raises(InputError) as refusal:
        check(one_constraint("<="), {"y": 1.0})
    assert [fault.key for fault in refusal.value.faults] == ["x", "y"]
    assert str(refusal.value) == (
        "x: is a variable of the model and needs a value\n"
        "y = 1.0: the model has no such name; it has x"
    )


def test_no_points_are_refused() -> None:
    """There is nothing at which a constraint could hold."""
    with pytest.raises(InputError, match="array of at least one number"):
        check(one_constraint("<="), {"x": []})


def test_arrays_of_points_say_where_they_are_violated() -> None:
    """How many, by how much at most; all of them hold with what is left at least."""
    row = only(check(one_constraint("<="), {"x": [900.0, 1100.0, 1001.0]}))
    assert row.cells[:3] == ("limit", "at 3 points", "VIOLATED at 2 by up to 100 s")
    row = only(check(one_constraint("<="), {"x": [900.0, 999.0]}))
    assert row.cells[:3] == ("limit", "at 2 points", "holds at all, least slack 1 s")


def test_bounds_are_constraints_too() -> None:
    """Numbers, expressions and infinities; the label of the bounds stands on both."""
    model = Model("test")
    left = Parameter("left_s", "T", "s", 10.0)
    model.variable("x", "x", unit="s", lower=2.0, upper=left, label="P.b time")
    model.variable("y", "y", unit="1")
    rows = check(model, {"x": 11.0, "y": 1.0})
    assert [(row.label, row.unit, float(row.slack)) for row in rows] == [
        ("P.b time", "s", 9.0),
        ("P.b time", "s", -1.0),
        ("bounds of y", "1", 1.0),
    ]


def test_rows_name_constraint_unit_and_source() -> None:
    row = only(check(one_constraint("<="), {"x": 0.0}))
    assert (row.label, row.unit) == ("limit", "s")
    assert row.declared_at.startswith("test_check.py:")


def test_rows_and_bounds_carry_what_their_constraints_are_about() -> None:
    """As data, so that nothing has to read a label; a moment is put behind the name."""
    model = Model("test")
    x = model.variable("x", "x", unit="s", upper=5.0, kind="deadline")
    model.subject_to("not dry", x >= 1.0, kind="dry", step=3, moment="after the rest")
    dry, lower, upper = (row.constraint for row in check(model, {"x": 2.0}))
    assert (dry.label, dry.name) == ("not dry after the rest", "not dry")
    assert (dry.kind, dry.step) == ("dry", 3)
    assert (lower.kind, upper.kind, lower.step) == ("deadline", "deadline", None)
    model.subject_to("not dry", x >= 1.0, moment="after the hover")
    with pytest.raises(ValueError, match="not dry after the rest"):
        model.subject_to("not dry", x >= 1.0, moment="after the rest")


def test_many_points_and_programmes_at_once() -> None:
    """Points along one axis, programmes along the other, and each cell by its own numbers."""
    model = Model("test")
    limit = Parameter("limit", "L", "s", np.array([1.0, 3.0]))
    x = model.variable("x", "x", unit="s")
    model.subject_to("limit", x <= limit)
    row = check(model, {"x": np.array([0.0, 2.0, 4.0])[:, None]})[0]
    np.testing.assert_array_equal(row.slack, [[1.0, 3.0], [-1.0, 1.0], [-3.0, -1.0]])
    np.testing.assert_array_equal(row.satisfied, [[True, True], [False, True], [False, False]])


def test_points_may_be_lists() -> None:
    """Of whatever numbers; as the arrays that they stand for."""
    row = check(one_constraint("<="), {"x": [900, 1100.0]})[0]
    np.testing.assert_array_equal(row.slack, [100.0, -100.0])


@pytest.mark.parametrize("value", ["900", None, [1.0, "x"], [[1.0], [1.0, 2.0]], {}], ids=repr)
def test_what_is_no_number_is_refused_by_name(value: Any) -> None:
    with pytest.raises(InputError, match=r"^x = "):
        check(one_constraint("<="), {"x": value})


def test_arrays_that_do_not_fit_are_refused_with_their_shapes() -> None:
    model = one_constraint("<=")
    model.subject_to("more", model.variable("y", "y", unit="s") <= 1.0)
    with pytest.raises(InputError, match=r"x \(2,\), y \(3,\)"):
        check(model, {"x": [1.0, 2.0], "y": [1.0, 2.0, 3.0]})


def test_arrays_fit_those_of_the_model() -> None:
    """A model of two programmes takes one number, or two, and refuses three in words."""
    model = Model("test")
    x = model.variable("x", "x", unit="s", upper=Parameter("limit", "L", "s", np.array([1.0, 2.0])))
    model.subject_to("twice", 2.0 * x <= 100.0)
    assert check(model, {"x": 1.5})[-1].satisfied.tolist() == [False, True]
    words = r"x \(3,\): must be arrays whose shapes broadcast, also with the model's \(2,\)$"
    with pytest.raises(InputError, match=words):
        check(model, {"x": [1.0, 2.0, 3.0]})
    assert check(model, {"x": [1.0, 2.0, 3.0], "limit": 2.5})[-1].satisfied.tolist() == [
        True,
        True,
        False,
    ]


def test_parameters_may_be_given_other_values() -> None:
    model = Model("test")
    x = model.variable("x", "x", unit="s", upper=Parameter("limit", "L", "s", 1.0))
    model.subject_to("twice", 2.0 * x <= 100.0)
    assert check(model, {"x": 2.0, "limit": 5.0})[-1].satisfied
    assert not check(model, {"x": 2.0})[-1].satisfied


@pytest.mark.parametrize("sense", ["<=", ">=", "=="])
@pytest.mark.parametrize("x", [math.nan, np.array(math.nan)])
def test_what_is_not_a_number_satisfies_nothing(sense: str, x: Any) -> None:
    assert not only(check(one_constraint(sense), {"x": x})).satisfied


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
    with pytest.raises(SolverError, match=r"^closed-form met numbers that it cannot use: p = nan$"):
        closed_form.solve(model, 2).refuse_unusable()


@pytest.mark.parametrize(
    "right",
    [math.nan, lambda x: x * math.nan, lambda x: x / Parameter("zero", "0", "1", 0.0)],
    ids=["side", "factor", "divisor"],
)
def test_labels_are_named(right: Any) -> None:
    """Of bare numbers that are none, and of unknowns over a parameter that is 0."""
    model = bounded_by(right)
    assert unusable(model, model.row(0)) == "'bad'"
    with pytest.raises(SolverError, match=r"cannot use: 'bad'$"):
        closed_form.solve(model, 1).refuse_unusable()


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
        with pytest.raises(
            InputError, match=r"bad = array of shape \(3,\): must be arrays with one entry"
        ):
            refuse_misfits(bounded_by(right), 2)
