"""The vertex engine against exact arithmetic, against HiGHS and against programmes by hand."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from fractions import Fraction
from typing import Any, Literal, NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import linprog

from optuav.engines import closed_form
from optuav.modelling import Model, NotAffineError, Parameter
from optuav.status import Status

Vector = Sequence[Any]


class Row(NamedTuple):
    """normal · x compared with a limit."""

    normal: Vector
    sense: Literal["<=", ">=", "=="]
    limit: Any


class Linear(NamedTuple):
    """A linear programme to maximise, unknowns from lower bounds upwards, small ones preferred."""

    goal: Vector
    rows: Sequence[Row]
    lower: Vector

    def model(self, scale: float = 1.0) -> Model:
        """Its declaration, the goal times a scale; labels are the numbers of the rows."""
        model = Model("test")
        unknowns = [
            model.variable(f"x{k}", f"x{k}", unit="s", lower=low)
            for k, low in enumerate(self.lower)
        ]
        model.maximise(scale * along(self.goal, unknowns))
        model.prefer_small(along([1.0] * len(unknowns), unknowns))
        for number, row in enumerate(self.rows):
            left = along(row.normal, unknowns)
            relations = {"<=": left <= row.limit, ">=": left >= row.limit, "==": left == row.limit}
            model.subject_to(str(number), relations[row.sense])
        return model

    def inequalities(self) -> list[tuple[tuple[Fraction, ...], Fraction]]:
        """All rows as a·x ≤ b in exact numbers."""
        exact = []
        for normal, sense, limit in self.rows:
            for sign in {"<=": (1,), ">=": (-1,), "==": (1, -1)}[sense]:
                exact.append(
                    (tuple(sign * Fraction(entry) for entry in normal), sign * Fraction(limit))
                )
        for k, low in enumerate(self.lower):
            normal = tuple(Fraction(-1 if j == k else 0) for j in range(len(self.lower)))
            exact.append((normal, -Fraction(low)))
        return exact


def along(vector: Vector, unknowns: Sequence[Any]) -> Any:
    return sum(a * x for a, x in zip(vector, unknowns, strict=True))


class Exact(NamedTuple):
    """The exact answer: status, best value, and the best vertices with the smallest sum."""

    status: Status
    value: Fraction | None = None
    points: Sequence[tuple[Fraction, ...]] = ()


def meet(rows: Sequence[tuple[tuple[Fraction, ...], Fraction]]) -> tuple[Fraction, ...] | None:
    """Cramer's rule for one or two equations."""
    if len(rows) == 1:
        ((a,), b) = rows[0]
        return (b / a,) if a else None
    ((p, q), e), ((r, s), f) = rows
    determinant = p * s - q * r
    return ((e * s - f * q) / determinant, (f * p - e * r) / determinant) if determinant else None


def solve_exactly(programme: Linear) -> Exact:
    """All vertices and all edges to infinity, in fractions."""
    rows = programme.inequalities()
    goal = [Fraction(entry) for entry in programme.goal]
    size = len(goal)
    vertices = {
        point
        for basis in itertools.combinations(rows, size)
        if (point := meet(basis)) is not None
        and all(along(normal, point) <= limit for normal, limit in rows)
    }
    if not vertices:
        return Exact(Status.INFEASIBLE)
    along_edges = (
        [(1,), (-1,)] if size == 1 else [edge for (p, q), _ in rows for edge in ((-q, p), (q, -p))]
    )
    for edge in along_edges:
        if along(goal, edge) > 0 and all(along(normal, edge) <= 0 for normal, _ in rows):
            return Exact(Status.UNBOUNDED)
    value = max(along(goal, point) for point in vertices)
    best = [point for point in vertices if along(goal, point) == value]
    least = min(map(sum, best))
    return Exact(Status.OPTIMAL, value, [point for point in best if sum(point) == least])


WHOLE = st.integers(-3, 3)


def linear(size: int) -> st.SearchStrategy[Linear]:
    """Programmes in small whole numbers: parallel, empty, tied and degenerate ones abound."""
    vector = st.tuples(*[WHOLE] * size)
    rows = st.builds(Row, vector, st.sampled_from(["<=", "<=", ">=", "=="]), st.integers(-6, 9))
    return st.builds(Linear, vector, st.lists(rows, max_size=5), vector)


@pytest.mark.parametrize("size", [1, 2])
def test_agrees_with_exact_arithmetic(size: int) -> None:
    """Status, value and the preferred vertex of whatever can be built from small numbers."""
    seen = set()

    @pytest.mark.campaign
    @given(linear(size))
    def compare(programme: Linear) -> None:
        exact = solve_exactly(programme)
        seen.add(exact.status)
        found = closed_form.solve(programme.model(), 1)
        assert found.statuses == [exact.status]
        if exact.value is None:
            assert np.isnan(found.objective).all()
            assert np.isnan(list(found.values.values())).all()
            return
        assert found.objective[0] == pytest.approx(float(exact.value), abs=1e-11)
        point = list(found.point(0).values())
        assert any(
            point == pytest.approx([float(entry) for entry in vertex], abs=1e-11)
            for vertex in exact.points
        )

    compare()
    assert seen == {Status.OPTIMAL, Status.INFEASIBLE, Status.UNBOUNDED}


HIGHS = {0: Status.OPTIMAL, 2: Status.INFEASIBLE, 3: Status.UNBOUNDED}


@pytest.mark.parametrize("size", [1, 2])
@pytest.mark.parametrize("equalities", [0, 1])
def test_agrees_with_highs(size: int, equalities: int) -> None:
    """Sixty programmes with any numbers, some with an equation."""
    rng = np.random.default_rng(1)
    seen = set()
    for _ in range(60):
        normals = rng.normal(size=(rng.integers(1, 6), size)) * 10.0 ** rng.integers(-2, 3)
        limits = rng.normal(size=len(normals)) + 1.0
        goal, lower = rng.normal(size=size), rng.normal(size=size)
        rows = [
            Row(normal, "==" if k < equalities else "<=", limit)
            for k, (normal, limit) in enumerate(zip(normals, limits, strict=True))
        ]
        answer = linprog(
            -goal,
            A_ub=normals[equalities:],
            b_ub=limits[equalities:],
            A_eq=normals[:equalities],
            b_eq=limits[:equalities],
            bounds=[(low, None) for low in lower],
            method="highs-ds",
            options={"presolve": False},
        )
        found = closed_form.solve(Linear(list(goal), rows, list(lower)).model(), 1)
        assert found.statuses == [HIGHS[answer.status]]
        seen.add(answer.status)
        if answer.status == 0:
            assert found.objective[0] == pytest.approx(
                -float(answer.fun or 0.0), rel=1e-7, abs=1e-7
            )
    assert seen >= {0, 2}


def test_many_programmes_are_solved_as_one_by_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """Arrays in every place, cut into stretches: the same answers, entry by entry."""
    rng = np.random.default_rng(2)
    entries = 60
    normals = rng.integers(-3, 4, size=(4, 2, entries)).astype(float)
    limits = rng.integers(-3, 9, size=(4, entries)).astype(float)
    goal, lower = (
        rng.normal(size=(2, entries)),
        rng.integers(-2, 2, size=(2, entries)).astype(float),
    )

    def programme(pick: Any) -> Linear:
        rows = [
            Row([normals[k, 0, pick], normals[k, 1, pick]], "<=", limits[k, pick]) for k in range(4)
        ]
        return Linear(list(goal[:, pick]), rows, list(lower[:, pick]))

    monkeypatch.setattr(closed_form, "NUMBERS_AT_ONCE", 7 * 15 * 6)
    together = closed_form.solve(programme(slice(None)).model(), entries)
    assert {Status.OPTIMAL, Status.INFEASIBLE, Status.UNBOUNDED} == set(together.statuses)
    for k in range(entries):
        alone = closed_form.solve(programme(k).model(), 1)
        assert together.statuses[k] == alone.statuses[0]
        np.testing.assert_array_equal(together.objective[k], alone.objective[0])
        for name, values in alone.values.items():
            np.testing.assert_array_equal(together.values[name][k], values[0])


SQUARE = [Row([1.0, 0.0], "<=", 2.0), Row([0.0, 1.0], "<=", 3.0)]
"""0 ≤ x0 ≤ 2, 0 ≤ x1 ≤ 3."""


@pytest.mark.parametrize("place", ["limit", "normal", "goal", "lower"])
def test_missing_number_spoils_its_own_programme_only(place: str) -> None:
    """NaN anywhere is an error of that entry, never an answer and never its neighbour's."""
    spoilt = np.array([1.0, math.nan, 1.0])
    limit, normal, goal, lower = (
        spoilt if place == each else 1.0 for each in ("limit", "normal", "goal", "lower")
    )
    programme = Linear([goal, 1.0], [Row([normal, 1.0], "<=", 4.0 * limit)], [0.5 * lower, 0.0])
    found = closed_form.solve(programme.model(), 3)
    assert found.statuses == [Status.OPTIMAL, Status.ERROR, Status.OPTIMAL]
    np.testing.assert_array_equal(found.objective, [4.0, math.nan, 4.0])
    assert found.binding_labels(1) == ()


def test_missing_constant_of_the_objective_is_an_error() -> None:
    model = Model("test")
    x = model.variable("x", "x", unit="s", upper=1.0)
    model.maximise(x + Parameter("p", "p", "s", np.array([1.0, math.nan])))
    found = closed_form.solve(model, 2)
    assert found.statuses == [Status.OPTIMAL, Status.ERROR]
    np.testing.assert_array_equal(found.objective, [2.0, math.nan])


def test_infinite_limits() -> None:
    """A limit that excludes nothing, and one that excludes everything."""
    limit = Parameter("limit", "L", "s", np.array([math.inf, -math.inf, 1.0]))
    model = Model("test")
    x = model.variable("x", "x", unit="s", upper=4.0)
    model.maximise(x)
    model.subject_to("limit", x <= limit)
    found = closed_form.solve(model, 3)
    assert found.statuses == [Status.OPTIMAL, Status.INFEASIBLE, Status.OPTIMAL]
    np.testing.assert_array_equal(found.values["x"], [4.0, math.nan, 1.0])


@pytest.mark.parametrize(
    ("programme", "point", "labels"),
    [
        pytest.param(Linear([1, 1], SQUARE, [0, 0]), [2, 3], {"0", "1"}, id="corner"),
        pytest.param(Linear([-1, 1], SQUARE, [0, 0]), [0, 3], {"1", "bounds of x0"}, id="bound"),
        pytest.param(Linear([0, 1], SQUARE, [0, 0]), [0, 3], {"1", "bounds of x0"}, id="tied edge"),
        pytest.param(
            Linear([0, 0], SQUARE, [0, 0]), [0, 0], {"bounds of x0", "bounds of x1"}, id="no goal"
        ),
        pytest.param(
            Linear([1, 1], [*SQUARE, Row([1, 1], "<=", 5)], [0, 0]),
            [2, 3],
            {"0", "1", "2"},
            id="three rows through a point",
        ),
        pytest.param(
            Linear([1, 1], [*SQUARE, Row([2, 0], "<=", 4), Row([1, 0], "<=", 9)], [0, 0]),
            [2, 3],
            {"0", "1", "2"},
            id="parallel rows",
        ),
        pytest.param(
            Linear([1, 0], [*SQUARE, Row([1, 1], "==", 1)], [0, 0]),
            [1, 0],
            {"2", "bounds of x1"},
            id="equation",
        ),
        pytest.param(
            Linear([1, 1], [*SQUARE, Row([0, 0], "<=", 0), Row([0, 0], ">=", -1)], [0, 0]),
            [2, 3],
            {"0", "1", "2"},
            id="a row of zeros",
        ),
        pytest.param(Linear([2], [Row([4], "<=", 10)], [1]), [2.5], {"0"}, id="one unknown"),
        pytest.param(Linear([-2], [Row([4], "<=", 10)], [1]), [1], {"bounds of x0"}, id="at bound"),
    ],
)
def test_point_and_binding_constraints(
    programme: Linear, point: list[float], labels: set[str]
) -> None:
    """Known by looking at them; ties go to the smallest sum of unknowns."""
    found = closed_form.solve(programme.model(), 1)
    assert list(found.point(0).values()) == pytest.approx(point, abs=1e-12)
    assert set(found.binding_labels(0)) == labels


@pytest.mark.parametrize(
    ("programme", "status"),
    [
        pytest.param(Linear([1, 0], [Row([0, 1], "<=", 1)], [0, 0]), "unbounded", id="open"),
        pytest.param(
            Linear([1, 0], [*SQUARE, Row([1, 0], ">=", 3)], [0, 0]), "infeasible", id="apart"
        ),
        pytest.param(
            Linear([1, 1], [*SQUARE, Row([0, 0], ">=", 1)], [0, 0]), "infeasible", id="0 ≥ 1"
        ),
        pytest.param(
            Linear([1, 1], [*SQUARE, Row([1, 1], "==", 9)], [0, 0]), "infeasible", id="equation"
        ),
        pytest.param(Linear([1], [], [0]), "unbounded", id="one unknown, open"),
        pytest.param(Linear([1], [Row([1], "<=", -1)], [0]), "infeasible", id="one unknown, apart"),
    ],
)
def test_programmes_without_an_optimum(programme: Linear, status: str) -> None:
    found = closed_form.solve(programme.model(), 1)
    assert found.statuses[0].value == status
    assert np.isnan(found.objective[0])
    assert found.binding_labels(0) == ()


@pytest.mark.parametrize("scale", [1e-12, 1.0, 1e12])
def test_unit_of_the_objective_changes_nothing(scale: float) -> None:
    """Maximising hours or microseconds: same status, same point, value to scale."""
    bounded, open_end = Linear([1, 2], SQUARE, [0, 0]), Linear([1, 0], SQUARE[1:], [0, 0])
    found = closed_form.solve(bounded.model(scale), 1)
    assert found.statuses == [Status.OPTIMAL]
    assert found.objective[0] == pytest.approx(8.0 * scale)
    assert closed_form.solve(open_end.model(scale), 1).statuses == [Status.UNBOUNDED]


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6, 1e9])
def test_vertex_far_from_its_limits_is_found(size: float) -> None:
    """Rounding grows with the unknowns, whatever the limits: three rows meet at (size, size/3)."""
    rows = [
        Row([0.1, -0.3], "<=", 0.0),
        Row([0.3, 0.3], "<=", 0.4 * size),
        Row([0.7, 0.3], "<=", 0.8 * size),
    ]
    found = closed_form.solve(Linear([1.0, 0.0], rows, [0.0, 0.0]).model(), 1)
    assert found.statuses == [Status.OPTIMAL]
    assert found.point(0) == pytest.approx({"x0": size, "x1": size / 3.0}, rel=1e-9)
    assert {"1", "2"} <= {*found.binding_labels(0)}


@pytest.mark.parametrize("angle", [1e-3, 1e-6, 1e-8])
def test_rows_that_are_nearly_parallel(angle: float) -> None:
    """The optimum lies where they cross, between normals that hardly differ."""
    rows = [Row([1.0, 2.0], "<=", 300.0), Row([1.0, 2.0 + angle], "<=", 300.0 + 100.0 * angle)]
    programme = Linear([1.0, 2.0 + angle / 2.0], rows, [0.0, 0.0])
    found = closed_form.solve(programme.model(), 1)
    exact = solve_exactly(programme)
    assert found.statuses == [Status.OPTIMAL]
    assert exact.value is not None
    assert found.objective[0] == pytest.approx(float(exact.value), rel=1e-12)
    assert set(found.binding_labels(0)) == {"0", "1"}


def test_bounds_are_met_to_the_last_bit() -> None:
    """Where a bound and a slanted row meet, the answer keeps the bound as it was stated."""
    rows = [Row([0.3, 0.7], "<=", 123.456)]
    found = closed_form.solve(Linear([1.0, 0.0], rows, [0.1, 0.1]).model(), 1)
    assert found.point(0)["x1"] == 0.1


def test_minimising_returns_the_objective_with_its_sign() -> None:
    model = Model("test")
    x = model.variable("x", "x", unit="s", lower=2.0)
    model.minimise(3.0 * x + 1.0)
    found = closed_form.solve(model, 1)
    assert (found.objective[0], found.point(0)) == (7.0, {"x": 2.0})


def test_earlier_preferences_go_first() -> None:
    """Among equal answers the smallest x0, among those the largest x1."""
    model = Model("test")
    x, y = (model.variable(name, name, unit="s", upper=2.0) for name in ("x", "y"))
    model.maximise(0.0)
    model.prefer_small(x)
    model.prefer_small(-y)
    assert closed_form.solve(model, 1).point(0) == {"x": 0.0, "y": 2.0}


def test_objective_without_unknowns_is_worth_its_constant() -> None:
    """It holds for every programme, and only where there is an answer."""
    model = Model("test")
    model.variable("x", "x", unit="s", upper=Parameter("p", "p", "s", np.array([1.0, -1.0])))
    model.maximise(5.0)
    np.testing.assert_array_equal(closed_form.solve(model, 2).objective, [5.0, math.nan])


def test_what_it_does_not_take_is_refused_in_words() -> None:
    """Too many unknowns, unknowns without a lower bound, anything nonlinear."""
    rows = [Row([1, 1, 1], "<=", 1)]
    with pytest.raises(ValueError, match="one or two unknowns, the model has 3"):
        closed_form.solve(Linear([1, 1, 1], rows, [0, 0, 0]).model(), 1)
    with pytest.raises(ValueError, match="the model has 0"):
        closed_form.solve(Model("test"), 1)
    with pytest.raises(ValueError, match="lower bound on x1"):
        closed_form.solve(Linear([1, 1], SQUARE, [0, -math.inf]).model(), 1)
    model = Model("test")
    x = model.variable("x", "x", unit="s")
    model.maximise(x)
    model.subject_to("curved", np.exp(x) <= 2.0)
    with pytest.raises(NotAffineError, match="exp"):
        closed_form.solve(model, 1)
