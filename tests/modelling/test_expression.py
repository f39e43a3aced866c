"""Trees of ufuncs: built by operators and functions, equal to the same functions of numbers."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, reject
from hypothesis import strategies as st

from optuav.errors import InputError
from optuav.modelling import Expression, Let, Parameter, Relation, Variable, evaluate
from optuav.modelling.expression import Call
from optuav.modelling.traversal import leaves
from optuav.physics.kibam import Battery, Stage
from tests.wells import after

UNARY = (
    np.negative,
    np.positive,
    np.absolute,
    np.sqrt,
    np.exp,
    np.expm1,
    np.log,
    np.log1p,
    np.sin,
    np.cos,
    np.arcsin,
    np.sign,
)
BINARY = (
    np.add,
    np.subtract,
    np.multiply,
    np.divide,
    np.power,
    np.arctan2,
    np.maximum,
    np.minimum,
    np.hypot,
)

Recipe = Callable[[Any, Any], Any]
"""A function of two operands, to be cooked with symbols and with numbers."""


def symbol(name: str) -> Any:
    """A variable, of any type to the type checker: NumPy's functions do not know of it."""
    return Variable(name, name, "1", 0.0, math.inf, name, 0)


def mixed(ufunc: np.ufunc, *parts: Recipe) -> Recipe:
    return lambda x, y: ufunc(*(part(x, y) for part in parts))


def constant(number: float) -> Recipe:
    return lambda x, y: np.float64(number)


RECIPES = st.recursive(
    st.sampled_from([lambda x, y: x, lambda x, y: y])
    | st.floats(-3.0, 3.0, allow_subnormal=False).map(constant),
    lambda parts: (
        st.builds(mixed, st.sampled_from(UNARY), parts)
        | st.builds(mixed, st.sampled_from(BINARY), parts, parts)
    ),
    max_leaves=12,
)
NUMBERS = st.floats(-3.0, 3.0, allow_subnormal=False)


@given(RECIPES, NUMBERS, st.lists(NUMBERS, min_size=1, max_size=4))
@np.errstate(all="ignore")
def test_tree_evaluates_to_the_function_that_built_it(
    recipe: Recipe, x: float, y: list[float]
) -> None:
    """Any composition of ufuncs, at a number and an array: same bits as without the tree."""
    numbers = {"x": np.float64(x), "y": np.array(y)}
    try:
        tree = recipe(symbol("x"), symbol("y"))
    except InputError:  # a division by 0
        reject()
    np.testing.assert_array_equal(evaluate(tree, numbers), recipe(numbers["x"], numbers["y"]))


@pytest.mark.parametrize(
    "act",
    [operator.add, operator.sub, operator.mul, operator.truediv, operator.pow],
    ids=lambda act: act.__name__,
)
@pytest.mark.parametrize("other", [2, 2.5, np.float64(2.5), np.int64(2), np.array([0.5, 2.0])])
def test_operators_on_either_side(act: Callable[[Any, Any], Any], other: Any) -> None:
    """A number, a NumPy scalar or an array may stand left or right; an array stays one operand."""
    x = symbol("x")
    for tree, expected in ((act(x, other), act(3.0, other)), (act(other, x), act(other, 3.0))):
        assert isinstance(tree, Call)
        assert len(tree.arguments) == 2
        np.testing.assert_array_equal(evaluate(tree, {"x": 3.0}), expected)


@pytest.mark.parametrize("other", [None, 1j, np.array([1j]), "1", [], np.array([]), {}, [None]])
def test_what_is_no_real_number_is_refused_by_the_operator(other: Any) -> None:
    """Where it is written, with the symbol that it met; on either side."""
    x = symbol("x")
    for act in (lambda: x + other, lambda: other * x, lambda: x <= other):
        with pytest.raises(TypeError, match=r"operands are expressions, real numbers|unsupported"):
            act()
    with pytest.raises(TypeError, match="x: add takes no "):
        x + other


@pytest.mark.parametrize("zero", [0, 0.0, np.float64(0.0), np.array(0)])
@pytest.mark.parametrize("act", [operator.truediv, operator.floordiv, operator.mod])
def test_divisions_by_zero_are_refused(act: Callable[[Any, Any], Any], zero: Any) -> None:
    with pytest.raises(InputError, match="x is divided by 0"):
        act(symbol("x"), zero)


def test_only_closed_relations_are_stated() -> None:
    """The refusal speaks of what was written."""
    x = symbol("x")
    with pytest.raises(TypeError, match="strict ones"):
        bool(x < 1.0)
    with pytest.raises(TypeError, match="!= leaves out"):
        bool(x != 1.0)


def test_signs_and_size() -> None:
    x = symbol("x")
    assert evaluate(-x, {"x": 2.0}) == -2.0
    assert evaluate(+x, {"x": 2.0}) == 2.0
    assert evaluate(abs(x), {"x": -2.0}) == 2.0


def test_running_totals_work_as_with_numbers() -> None:
    """``total += x`` names a new sum; the old one is as it was, and no array changes in place."""
    x = symbol("x")
    total = first = x + 1.0
    total += x
    assert evaluate(total, {"x": 2.0}) == 5.0
    assert evaluate(first, {"x": 2.0}) == 3.0
    table = np.zeros(2)
    with pytest.raises(TypeError):
        table += x


@pytest.mark.parametrize(
    ("relate", "sense"),
    [(operator.le, "<="), (operator.ge, ">="), (operator.eq, "==")],
)
@pytest.mark.parametrize("bound", [np.float64(2.0), np.array([1.0, 2.0])])
def test_comparison_states_a_relation(
    relate: Callable[[Any, Any], Any], sense: str, bound: Any
) -> None:
    """NumPy on either side yields one relation with its sides as written, never booleans."""
    x = symbol("x")
    stated = relate(x, bound)
    assert isinstance(stated, Relation)
    assert stated.left is x
    assert stated.sense == sense
    np.testing.assert_array_equal(stated.right, bound)
    turned = relate(bound, x)
    assert isinstance(turned, Relation)
    assert turned.right is x
    assert turned.sense == sense


def test_relations_have_no_truth_value() -> None:
    """``if x >= 1``, ``0 <= x <= 1`` and ``not x`` would decide before anything is known."""
    x = symbol("x")
    with pytest.raises(TypeError, match="truth value"):
        bool(x >= 1.0)
    with pytest.raises(TypeError, match="truth value"):
        _ = 0.0 <= x <= 1.0
    with pytest.raises(TypeError, match="truth value"):
        _ = not x


@pytest.mark.parametrize("relate", [operator.lt, operator.gt, operator.ne])
def test_strict_comparison_is_refused(relate: Callable[[Any, Any], Any]) -> None:
    with pytest.raises(TypeError, match="<=, >= or =="):
        relate(symbol("x"), 1.0)


def test_what_is_no_function_of_one_value_is_refused() -> None:
    """Reductions, outputs elsewhere and functions with two results have no place in a tree."""
    x = symbol("x")
    with pytest.raises(TypeError):
        np.add.reduce(x)
    with pytest.raises(TypeError):
        np.add(x, 1.0, out=np.zeros(1))
    with pytest.raises(TypeError):
        divmod(x, 2.0)
    with pytest.raises(TypeError):
        math.exp(x)


def test_symbols_are_told_apart_by_identity() -> None:
    """Although ``==`` states a relation, symbols serve as dictionary keys."""
    x, y = symbol("x"), symbol("y")
    assert {x: 1, y: 2}[y] == 2


def test_parameters_keep_their_value_unless_told_otherwise() -> None:
    x, p = symbol("x"), Parameter("p", "p", "1", 4.0)
    assert evaluate(p * x, {"x": 2.0}) == 8.0
    assert evaluate(p * x, {"x": 2.0, "p": 5.0}) == 10.0
    with pytest.raises(KeyError, match="x"):
        evaluate(p * x, {})


def test_arrays_of_values_broadcast() -> None:
    """One tree evaluates a whole plane of points."""
    x, y = symbol("x"), symbol("y")
    plane = evaluate(x - 2.0 * y, {"x": np.arange(3.0), "y": np.arange(2.0)[:, None]})
    np.testing.assert_array_equal(plane, [[0.0, 1.0, 2.0], [-2.0, -1.0, 0.0]])


def test_named_quantity_stands_for_its_expression() -> None:
    x = symbol("x")
    assert evaluate(2.0 * Let("n", "n", "1", x + 1.0), {"x": 3.0}) == 8.0


def test_deep_trees_are_walked_without_recursion() -> None:
    """A sum over thousands of terms is as deep as it is long."""
    x = symbol("x")
    total: Any = 0.0
    for _ in range(5000):
        total = total + x
    assert evaluate(total, {"x": 1.0}) == 5000.0


def test_shared_subtrees_are_evaluated_once() -> None:
    """Doubling forty times makes a tree of 2^40 paths and forty nodes."""
    doubled: Expression = symbol("x")
    for _ in range(40):
        doubled = doubled + doubled
    assert evaluate(doubled, {"x": 1.0}) == 2.0**40


def test_leaves_come_in_order_of_appearance_and_once() -> None:
    x, y, p = symbol("x"), symbol("y"), Parameter("p", "p", "1", 4.0)
    assert list(leaves(y * p + x, p - y)) == [y, p, x]


def test_two_symbols_of_one_name_are_refused() -> None:
    """Values are found by name, so a name means one thing."""
    with pytest.raises(InputError, match="'x'"):
        list(leaves(symbol("x") + symbol("x")))


def test_physics_takes_symbols() -> None:
    """The battery's own functions, unchanged: a tree that evaluates to what they give on floats."""
    hover, fraction = symbol("hover"), Parameter("fraction", "ω", "1", 0.7)
    start = Battery(1000.0, 0.7, 2e-3).full

    def soc(share: Any, hover_s: Any) -> Any:
        battery = Battery(1000.0, share, 2e-3)
        return (
            after(battery, start, [Stage(-3.0, hover_s), Stage(1.0, 60.0)]).total_As
            / battery.capacity_As
        )

    def available(share: Any, hover_s: Any) -> Any:
        battery = Battery(1000.0, share, 2e-3)
        return after(battery, start, [Stage(-3.0, hover_s), Stage(1.0, 60.0)]).available_As

    tree = soc(fraction, hover)
    assert isinstance(tree, Expression)
    assert evaluate(tree, {"hover": 40.0}) == soc(0.7, 40.0)
    assert evaluate(available(fraction, hover), {"hover": 40.0}) == available(0.7, 40.0)
    assert soc(0.7, 40.0) == pytest.approx(1.0 - (3.0 * 40.0 - 60.0) / 1000.0, abs=1e-12)
