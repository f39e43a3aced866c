"""Certificates of infeasibility and of optimality, against ones worked out by hand."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import optuav
from optuav.diagnosis.infeasibility import (
    Certificate,
    bound,
    certificates,
    combination,
)
from optuav.engines.linear_form import linear_form
from optuav.modelling import Model, Parameter


def declared(declare: Callable[[Model, Any, Any], None], **bounds: float) -> Model:
    """A model in x, y ≥ 0 (or other bounds), maximising x + y."""
    model = Model("a test")
    x = model.variable("x", "x", unit="s", **bounds)
    y = model.variable("y", "y", unit="s", **bounds)
    model.maximise(x + y)
    declare(model, x, y)
    return model


def found(model: Model) -> list[Certificate]:
    return [*certificates(model, model.row(0))]


def multipliers(certificate: Certificate) -> dict[str, Fraction]:
    return {row.label: row.multiplier for row in certificate.rows}


def free(declare: Callable[[Model, Any, Any], None]) -> Model:
    return declared(declare, lower=-math.inf)


def test_a_constraint_against_a_bound() -> None:
    """x + y ≤ −1 with x, y ≥ 0: all three with multiplier 1 read 0 ≤ −1."""

    def declare(model: Model, x: Any, y: Any) -> None:
        model.subject_to("both", x + y <= -1.0)

    (certificate,) = found(declared(declare))
    assert multipliers(certificate) == {"both": 1, "bounds of x": 1, "bounds of y": 1}
    assert certificate.limit == -1
    assert certificate.holds()


def test_three_half_planes_without_a_common_point() -> None:
    """2x + y ≥ 8, x ≤ 3, y ≤ 1: the first, twice the second and the third read 0 ≤ −1."""

    def declare(model: Model, x: Any, y: Any) -> None:
        model.subject_to("together", 2.0 * x + y >= 8.0)
        model.subject_to("first", x <= 3.0)
        model.subject_to("second", y <= 1.0)

    (certificate,) = found(free(declare))
    assert multipliers(certificate) == {"together": 1, "first": 2, "second": 1}
    assert certificate.limit == -1
    assert certificate.labels == ("together", "first", "second")


def test_exact_fractions_where_floats_would_round() -> None:
    """3x ≥ 1 and 10x ≤ 3 conflict by 1/30 · 3 = 1/10, to the last digit."""

    def declare(model: Model, x: Any, y: Any) -> None:
        model.subject_to("at least", 3.0 * x >= 1.0)
        model.subject_to("at most", 10.0 * x <= 3.0)

    (certificate,) = found(free(declare))
    assert multipliers(certificate) == {"at least": 1, "at most": Fraction(3, 10)}
    assert certificate.limit == Fraction(-1, 10)


def test_an_equality_takes_part_from_either_side() -> None:
    """x + y = 4 with x ≤ 1, y ≤ 2 from one side, with x, y ≥ 3 from the other."""

    def low(model: Model, x: Any, y: Any) -> None:
        model.subject_to("sum", x + y == 4.0)
        model.subject_to("x", x <= 1.0)
        model.subject_to("y", y <= 2.0)

    def high(model: Model, x: Any, y: Any) -> None:
        model.subject_to("sum", x + y == 4.0)

    (certificate,) = found(free(low))
    assert (certificate.limit, certificate.rows[0].coefficients) == (-1, {"x": -1, "y": -1})
    (certificate,) = found(declared(high, lower=3.0))
    assert (certificate.limit, certificate.rows[0].coefficients) == (-2, {"x": 1, "y": 1})


def test_a_constraint_without_unknowns_is_a_conflict_by_itself() -> None:
    def declare(model: Model, x: Any, y: Any) -> None:
        model.subject_to("reach", Parameter("d", "d", "m", 7.0) <= 5.0)

    (certificate,) = found(declared(declare))
    assert certificate.labels == ("reach",)
    assert certificate.limit == -2


def test_conflicts_over_different_parameters_are_told_apart() -> None:
    """Deadline and charge are each violated: both are found, and each names its keys."""

    def declare(model: Model, x: Any, y: Any) -> None:
        deadline = Parameter("deadline_s", "T", "s", -5.0, "limits.deadline_s")
        charge = Parameter("charge_As", "Q", "A s", -1.0, "battery.capacity_As")
        model.subject_to("deadline", x + y <= deadline)
        model.subject_to("charge", 2.0 * x <= charge)

    first, second = found(declared(declare))
    assert {first.keys, second.keys} == {("limits.deadline_s",), ("battery.capacity_As",)}
    assert all(each.holds() for each in (first, second))
    assert set(first.labels) & set(second.labels) <= {"bounds of x", "bounds of y"}


def test_rounding_is_no_conflict() -> None:
    """A hover point on the rim of the coverage may be 1e-13 m outside."""

    def declare(model: Model, x: Any, y: Any) -> None:
        model.subject_to("rim", Parameter("d", "d", "m", 501.0 + 1e-13) <= 501.0)
        model.subject_to("deadline", x + y <= -1.0)

    (certificate,) = found(declared(declare))
    assert "rim" not in certificate.labels


def test_slots_begin_with_the_first_one() -> None:
    """Two stays of at least one slot of 5 s do not fit into 9 s, and do into 10 s."""
    for time_left_s, fits in ((9.0, False), (10.0, True)):
        model = Model("a test")
        hover = model.variable("hover_time_s", "Δ", unit="s", first_slot=1)
        rest = model.variable("rest_time_s", "T'", unit="s", first_slot=1)
        model.subject_to("deadline", hover + rest <= time_left_s)
        conflicts = [*certificates(model, {}, slot_s=5.0)]
        assert [each.labels for each in conflicts] == (
            [] if fits else [("deadline", "first slot of Δ", "first slot of T'")]
        )
        assert not [*certificates(model, {})]


def test_a_feasible_programme_has_no_certificate() -> None:
    assert not found(declared(lambda model, x, y: model.subject_to("sum", x + y <= 1.0)))


def test_constraints_that_are_not_linear_are_left_aside() -> None:
    """A product proves nothing; what is linear beside it conflicts by itself."""

    def product(model: Model, x: Any, y: Any) -> None:
        model.subject_to("product", x * y <= -1.0)

    def beside(model: Model, x: Any, y: Any) -> None:
        product(model, x, y)
        model.subject_to("both", x + y <= -1.0)

    assert found(declared(product)) == []
    (certificate,) = found(declared(beside))
    assert certificate.holds()
    assert "product" not in certificate.labels


# Random programmes ------------------------------------------------------------------------------

number = st.integers(-400, 400).map(lambda eighths: eighths / 8.0)
rows = st.lists(st.tuples(number, number, number), min_size=1, max_size=5)


def random_model(numbers: Sequence[tuple[float, float, float]]) -> Model:
    def declare(model: Model, x: Any, y: Any) -> None:
        for k, (a, b, limit) in enumerate(numbers):
            slack = Parameter(f"limit{k}", "b", "1", limit, f"limits.b{k}")
            model.subject_to(f"row {k}", a * x + b * y <= slack)

    return declared(declare)


def margin(a: np.ndarray[Any, Any], b: np.ndarray[Any, Any]) -> float:
    """By how much rows a x ≤ b can all be kept, at most 1; negative if infeasible."""
    from scipy.optimize import linprog

    cost = np.zeros(a.shape[1] + 1)
    cost[-1] = -1.0
    widened = np.hstack([a, np.ones((len(a), 1))])
    box = [(None, None)] * a.shape[1] + [(None, 1.0)]
    return float(linprog(cost, A_ub=widened, b_ub=b, bounds=box).x[-1])


@given(rows)
def test_a_certificate_is_found_exactly_when_a_linear_programme_is_infeasible(
    numbers: list[tuple[float, float, float]],
) -> None:
    model = random_model(numbers)
    form = linear_form(model, model.row(0))
    a, b = form.normals[..., 0], form.limits[:, 0]
    conflicts = found(model)
    widest = margin(a, b)
    if abs(widest) > 1e-6:
        assert bool(conflicts) == (widest < 0.0)
    stated = {(label, *a[k], b[k]) for k, label in enumerate(form.labels)}
    for conflict in conflicts:
        check_by_hand(conflict)
        for row in conflict.rows:
            pair = [float(row.coefficients.get(symbol, 0)) for symbol in "xy"]
            assert (row.label, *pair, float(row.limit)) in stated, "a row of the programme"
        check_minimal(conflict)


def check_by_hand(conflict: Certificate) -> None:
    """Exact sums, without the class's own."""
    assert conflict.holds()
    for symbol in "xy":
        terms = [
            row.multiplier * row.coefficients.get(symbol, Fraction(0)) for row in conflict.rows
        ]
        assert sum(terms) == 0
    assert sum(row.multiplier * row.limit for row in conflict.rows) < 0
    assert all(row.multiplier > 0 for row in conflict.rows)


def check_minimal(conflict: Certificate) -> None:
    """Without any one of its rows the others can be satisfied."""
    for kept in itertools.combinations(conflict.rows, len(conflict.rows) - 1):
        if not kept:
            continue
        a = np.array([[float(r.coefficients.get(s, 0)) for s in "xy"] for r in kept])
        assert margin(a, np.array([float(row.limit) for row in kept])) >= -1e-7


@given(rows.filter(lambda numbers: any(limit < 0 for *_, limit in numbers)), st.data())
def test_mutated_certificates_fail(
    numbers: list[tuple[float, float, float]], data: st.DataObject
) -> None:
    """A wrong multiplier, a wrong sign, a missing row or a looser limit is noticed."""
    for conflict in found(random_model(numbers)):
        k = data.draw(st.integers(0, len(conflict.rows) - 1))
        row = conflict.rows[k]

        def with_row(*changed: Any, k: int = k, conflict: Certificate = conflict) -> Certificate:
            return Certificate((*conflict.rows[:k], *changed, *conflict.rows[k + 1 :]))

        assert with_row(row).holds()
        assert not with_row(replace(row, multiplier=-row.multiplier)).holds()
        loose = -conflict.limit / row.multiplier
        assert not with_row(replace(row, limit=row.limit + loose)).holds()
        if row.coefficients:
            assert not with_row(
                replace(row, multiplier=row.multiplier + Fraction(1, 10**9))
            ).holds()
            assert not with_row().holds()
    assert not Certificate(()).holds()


# Optimality -------------------------------------------------------------------------------------


def test_the_bound_of_an_optimum_by_hand() -> None:
    """max x + y with 2x + y ≤ 8, x + 3y ≤ 9: (3, 2) by 2/5 of the first and 1/5 of the second."""

    def declare(model: Model, x: Any, y: Any) -> None:
        model.subject_to("first", 2.0 * x + y <= 8.0)
        model.subject_to("second", x + 3.0 * y <= 9.0)

    model = declared(declare)
    proof = bound(model, {}, ("first", "second"))
    assert proof is not None
    assert [row.multiplier for row in proof.rows] == [Fraction(2, 5), Fraction(1, 5)]
    assert proof.limit == 5
    assert proof.holds()
    weaker = Certificate(proof.rows[:1], proof.objective)
    assert not weaker.holds()
    assert bound(model, {}, ("first",)) is None


@pytest.mark.parametrize(
    "options",
    [{"problem": "P3"}, {"problem": optuav.P4("b1")}, {}, {"perspective": "energy"}],
)
def test_bounds_prove_the_optima_of_the_paper(options: dict[str, str]) -> None:
    """Exact multipliers of the binding rows add up to Δ ≤ the optimum."""
    from optuav.diagnosis import explain

    explained = explain("paper", **{"perspective": "battery", **options})
    assert explained.bound is not None
    assert explained.bound.holds()
    assert explained.bound.coefficients == {"Δ": 1}
    assert float(explained.bound.limit) == pytest.approx(explained.plan.hover_time_s, abs=1e-9)


def test_the_flight_of_the_paper_in_sixty_seconds() -> None:
    """0 ≤ 60 − 75.7922 for the direct route, from P3.b alone."""
    mission = optuav.load("paper").replace({"limits.deadline_s": 60})
    part = optuav.formulate(mission, "P3", perspective="battery").parts[0]
    (certificate,) = certificates(part.model, part.model.row(0))
    assert certificate.labels == ("P3.b hover time",)
    assert certificate.keys == ("limits.deadline_s",)
    assert float(certificate.limit) == pytest.approx(60 - 2 * 37.8961, abs=1e-4)
    data = certificate.to_dict()
    assert data["holds"] is True
    assert Fraction(data["sum"]["limit"]["exact"]) == certificate.limit


# Combinations in exact fractions ----------------------------------------------------------------


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
