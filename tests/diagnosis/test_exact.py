"""Non-negative combinations: against known ones, against a linear programme, and exactly."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from optuav.diagnosis.exact import combination


def fractions(*numbers: int | str) -> list[Fraction]:
    return [Fraction(number) for number in numbers]


def total(weights: list[Fraction], columns: list[list[Fraction]]) -> list[Fraction]:
    rows = zip(*columns, strict=True)
    return [sum((y * x for y, x in zip(weights, row, strict=True)), Fraction(0)) for row in rows]


def test_two_vectors_that_make_a_third() -> None:
    """(1, 0)·2/3 + (1, 3)·1/3 = (1, 1), the only way."""
    found = combination([fractions(1, 0), fractions(1, 3)], fractions(1, 1))
    assert found == fractions("2/3", "1/3")


def test_what_needs_a_negative_multiplier_has_no_combination() -> None:
    assert combination([fractions(1, 0), fractions(1, 1)], fractions(0, 1)) is None


def test_nothing_makes_nothing() -> None:
    assert combination([], fractions(0, 0)) == []
    assert combination([], fractions(0, 1)) is None
    assert combination([fractions(3, -4)], fractions(0, 0)) == fractions(0)


def test_negative_targets_and_redundant_equations() -> None:
    """The second equation repeats the first; a basis of one vector does."""
    columns = [fractions(-2, -4), fractions(5, 10)]
    found = combination(columns, fractions(-6, -12))
    assert found == fractions(3, 0)


def test_a_cycling_example_of_the_simplex_method_ends() -> None:
    """Beale's degenerate rows, on which careless pivoting runs in circles."""
    columns = [
        fractions("1/4", "1/2", 0),
        fractions(-60, -90, 0),
        fractions("-1/25", "-1/50", 1),
        fractions(9, 3, 0),
        fractions(1, 0, 0),
        fractions(0, 1, 0),
        fractions(0, 0, 1),
    ]
    found = combination(columns, fractions(0, 0, 1))
    assert found is not None
    sums = [
        sum((y * c[k] for y, c in zip(found, columns, strict=True)), Fraction(0)) for k in range(3)
    ]
    assert sums == fractions(0, 0, 1)


small = st.integers(-4, 4).map(Fraction)
systems = st.integers(1, 4).flatmap(
    lambda size: st.tuples(
        st.lists(st.lists(small, min_size=size, max_size=size), max_size=6),
        st.lists(small, min_size=size, max_size=size),
    )
)


@given(systems)
def test_combinations_are_exact_and_found_whenever_there_are_some(
    system: tuple[list[list[Fraction]], list[Fraction]],
) -> None:
    """Sums and signs are checked exactly; existence by scipy's linear programming."""
    columns, target = system
    found = combination(columns, target)
    if found is None:
        assert not solvable(columns, target)
        return
    assert all(weight >= 0 for weight in found)
    assert total(found, columns) == target or not columns
    used = np.array([[float(x) for x in c] for y, c in zip(found, columns, strict=True) if y])
    assert not len(used) or np.linalg.matrix_rank(used) == len(used), "a column could be spared"


def solvable(columns: list[list[Fraction]], target: list[Fraction]) -> bool:
    from scipy.optimize import linprog

    if not columns:
        return not any(target)
    matrix = np.array([[float(x) for x in column] for column in columns]).T
    wanted = [float(x) for x in target]
    return bool(linprog(np.zeros(len(columns)), A_eq=matrix, b_eq=wanted).status == 0)
