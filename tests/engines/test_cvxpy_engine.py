"""The engine that hands linear programmes to CVXPY: compiled once, accurate, proved."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from optuav.engines import closed_form
from optuav.engines.cvxpy_engine import Cvxpy, CvxpyProgramme
from optuav.errors import InputError, SolverError
from optuav.modelling import Model, NotAffineError, Parameter
from optuav.status import Status
from tests.engines.conformance import CASES, Case, p4
from tests.engines.optimality import residuals
from tests.engines.test_closed_form import Linear
from tests.engines.test_closed_form import linear as small_programmes
from tests.examples import few

CONTINUOUS = [case for case in CASES if "cvxpy" in case.engines and case.slot_s is None]


def test_compiled_problem_is_parametrised_and_compiled_once() -> None:
    """DPP, also for ties; another solve takes the same compiled programme."""
    compiled = CvxpyProgramme(p4(R=0.0))
    assert compiled.problem.is_dcp(dpp=True)
    compiled.solve({})
    programme = compiled.problem._cache.param_prog
    assert programme is not None
    found = compiled.solve({"T": 60.0, "C": 500.0, "I": 4.0})
    assert found.point(0) == pytest.approx({"Δ": 60.0, "T'": 0.0}, abs=1e-8)
    assert compiled.problem._cache.param_prog is programme


def test_solves_do_not_remember_each_other() -> None:
    """A binding deadline, an infeasible one, an endless one, and the first again."""
    compiled = CvxpyProgramme(p4())
    hovers = [compiled.solve({"T": T}).objective[0] for T in (150.0, -1.0, math.inf, 150.0)]
    assert hovers == pytest.approx([310 / 3, math.nan, math.nan, 310 / 3], nan_ok=True)
    assert compiled.solve({"T": math.inf}).status is Status.UNBOUNDED
    assert compiled.solve({}).objective[0] == pytest.approx(310 / 3)


@pytest.mark.parametrize("binary", [False, True])
def test_terms_that_cancel_count_with_other_values(binary: bool) -> None:
    """The sparse matrix has a place for a coefficient that the model's own values make 0."""
    model = Model("two rates")
    x = model.variable("x", "x", unit="s", upper=10.0)
    y = model.variable("y", "y", unit="1", upper=1.0, binary=binary)
    gained, lost = (Parameter(name, name, "1/s", 1.0) for name in ("gained", "lost"))
    model.maximise(x + 1.0 * y)
    model.subject_to("limit", gained * x - lost * x <= 1.0)
    programme = CvxpyProgramme(model)
    for gain, longest in ((1.0, 10.0), (2.0, 1.0), (1.0, 10.0), (5.0, 0.25)):
        assert programme.solve({"gained": gain}).point(0)["x"] == pytest.approx(longest, abs=1e-8)


def test_many_programmes_are_solved_one_after_the_other() -> None:
    """Arrays in the parameters: the same as the closed form, entry by entry."""
    model = Model("many")
    x, y = model.variable("x", "x", unit="s"), model.variable("y", "y", unit="s")
    model.maximise(x)
    model.prefer_small(y)
    p = Parameter("p", "p", "s", np.array([3.0, -1.0, math.nan, 5.0, math.inf]))
    model.subject_to("sum", x + y <= p)
    model.subject_to("most", x - y <= 4.0)
    ours, theirs = Cvxpy().solve(model, 5), closed_form.solve(model, 5)
    assert list(ours.statuses) == list(theirs.statuses)
    assert ours.values["x"] == pytest.approx(theirs.values["x"], nan_ok=True)
    assert ours.values["y"] == pytest.approx(theirs.values["y"], nan_ok=True)


@few(8, most=1000)
@pytest.mark.campaign
@given(small_programmes(2))
def test_agrees_with_the_closed_form(programme: Linear) -> None:
    """Parallel, empty, tied and degenerate programmes in small whole numbers."""
    model = programme.model()
    ours, theirs = Cvxpy().solve(model, 1), closed_form.solve(model, 1)
    assert ours.status is theirs.status
    if ours.status.has_answer:
        assert ours.objective[0] == pytest.approx(theirs.objective[0], abs=1e-8)
        preferred = sum(values[0] for values in theirs.values.values())
        assert sum(values[0] for values in ours.values.values()) == pytest.approx(
            preferred, abs=1e-8
        )


@pytest.mark.parametrize("scale", [1e-12, 1e12])
def test_unit_of_the_objective_changes_nothing(scale: float) -> None:
    """HiGHS takes slopes below 1e-7 for none; microseconds and ages have the same optimum."""
    model = Model("unit")
    x, y = (model.variable(name, name, unit="s") for name in ("x", "y"))
    model.maximise(scale * (x + 2.0 * y))
    model.subject_to("x", x <= 2.0)
    model.subject_to("y", y <= 3.0)
    found = Cvxpy().solve(model, 1)
    assert found.point(0) == {"x": 2.0, "y": 3.0}
    assert found.multipliers_at(0)["y"] == pytest.approx(2.0 * scale)


@pytest.mark.parametrize("scale", [1e-12, 1e-7, 1e7, 1e12])
def test_unit_of_a_row_changes_nothing(scale: float) -> None:
    """HiGHS drops coefficients below 1e-9: a battery of 1e12 A s has such a row."""
    model = Model("unit")
    x = model.variable("x", "x", unit="s", upper=500.0)
    model.maximise(x)
    model.subject_to("row", scale * x <= scale * Parameter("p", "p", "s", 123.0))
    found = Cvxpy().solve(model, 1)
    assert found.point(0)["x"] == pytest.approx(123.0, rel=1e-12)
    assert found.multipliers_at(0)["row"] == pytest.approx(1.0 / scale)
    assert tuple(found.shadow_prices()["p"]) == pytest.approx((1.0, 1.0))


def test_branch_and_bound_goes_to_the_end() -> None:
    """HiGHS stops at a relative gap of 1e-4 unless told not to: 0.07 s of 700 s."""
    rng = np.random.default_rng(3)
    model = Model("knapsack of routes")
    hover = model.variable("hover", "Δ", unit="s", upper=10_000.0)
    picks = [model.variable(f"z{k}", f"z{k}", unit="1", upper=1.0, binary=True) for k in range(12)]
    gains_s, costs_s = 90.0 + rng.random(12), 40.0 + rng.random(12)
    model.maximise(hover)
    model.subject_to(
        "gain", hover <= 100.0 + sum(g * z for g, z in zip(gains_s, picks, strict=True))
    )
    model.subject_to("cost", sum(c * z for c, z in zip(costs_s, picks, strict=True)) <= 205.0)
    chosen = (np.arange(2**12)[:, None] >> np.arange(12)) & 1
    best_s = 100.0 + (chosen @ gains_s)[chosen @ costs_s <= 205.0].max()
    found = Cvxpy().solve(model, 1)
    assert found.objective[0] == pytest.approx(best_s, abs=1e-8)
    assert found.proof == "branch and bound (HIGHS)"
    assert not found.multipliers_at(0)


def test_earlier_preferences_go_first() -> None:
    """Among equal answers the smallest x, among those the smallest y, z takes the rest."""
    model = Model("three")
    x, y, z = (model.variable(name, name, unit="s", upper=2.0) for name in ("x", "y", "z"))
    model.maximise(x + y + z)
    model.prefer_small(x)
    model.prefer_small(y)
    model.subject_to("sum", x + y + z <= 3.0)
    assert Cvxpy().solve(model, 1).point(0) == pytest.approx({"x": 0, "y": 1, "z": 2}, abs=1e-8)


def test_unknown_that_is_free_on_both_sides() -> None:
    """The closed form has no vertex for it, CVXPY needs none."""
    model = Model("free")
    x = model.variable("x", "x", unit="s", lower=-math.inf)
    model.maximise(x)
    model.subject_to("most", 2.0 * x <= -7.0)
    found = Cvxpy().solve(model, 1)
    assert (found.status, found.point(0)) == (Status.OPTIMAL, {"x": -3.5})


@pytest.mark.parametrize(
    ("case", "solver"),
    [
        pytest.param(
            case,
            solver,
            id=f"{case.name}-{solver}",
            marks=[pytest.mark.soak] * ((row + column) % 2),  # half of the table in every run
        )
        for row, case in enumerate(CONTINUOUS)
        for column, solver in enumerate(("CLARABEL", "OSQP", "SCS", "SCIPY"))
    ],
)
def test_other_solvers_answer_as_accurately_or_not_at_all(case: Case, solver: str) -> None:
    """Their answers are proved with their own multipliers, and refused where that fails."""
    if any(variable.binary for variable in case.build().variables) and solver != "SCIPY":
        with pytest.raises(InputError, match=r"does not support whole numbers; .* HIGHS"):
            Cvxpy(solver).solve(case.build(), 1)
        return
    try:
        found = Cvxpy(solver).solve(case.build(), 1)
    except SolverError:
        if solver not in ("OSQP", "SCS"):
            raise
        return
    assert found.status is case.status
    if case.status.has_answer:
        assert found.objective[0] == pytest.approx(case.objective, rel=1e-6, abs=1e-6)
        assert solver in found.words[0]
        if found.multipliers_at(0):
            assert residuals(found).stationarity < 1e-5


def lying(monkeypatch: pytest.MonkeyPatch, **lies: Any) -> None:
    """Make CVXPY return other numbers than its solver found."""
    import cvxpy

    honest = cvxpy.Problem.solve

    def solve(problem: Any, *arguments: Any, **options: Any) -> Any:
        value = honest(problem, *arguments, **options)
        for variable in problem.variables():
            variable.save_value(lies.get("x", variable.value))
        for constraint in problem.constraints:
            constraint.save_dual_value(lies.get("weights", constraint.dual_value))
        return value

    monkeypatch.setattr(cvxpy.Problem, "solve", solve)


@pytest.mark.parametrize(
    "lies",
    [
        pytest.param({"x": np.array([103.0, 140.0 / 3.0])}, id="not the best"),
        pytest.param({"x": np.array([104.0, 140.0 / 3.0])}, id="not feasible"),
        pytest.param({"weights": np.array([1.0, 0.0, 0.0, 0.0])}, id="no multipliers"),
        pytest.param({"weights": np.array([-1.0, 11.0, 0.0, 16.0])}, id="negative multipliers"),
        pytest.param({"weights": np.array([2 / 3, 1 / 3, 0.0, 0.0]) * 1.001}, id="too large"),
    ],
)
def test_answer_that_is_not_optimal_is_refused(
    lies: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A solver that says optimal is not believed: the gap to the bound is evaluated again."""
    lying(monkeypatch, **lies)
    with pytest.raises(SolverError, match="HIGHS says optimal, but its answer"):
        Cvxpy().solve(p4(), 1)


def test_same_numbers_pass() -> None:
    """What the last test refuses is refused for its numbers."""
    with pytest.MonkeyPatch.context() as patch:
        right = np.array([2 / 3, 1 / 3, 0.0, 0.0])
        lying(patch, x=np.array([310.0 / 3.0, 140.0 / 3.0]), weights=right)
        assert Cvxpy().solve(p4(), 1).status is Status.OPTIMAL


def test_slots_do_not_mistake_a_constraint_for_a_bound() -> None:
    """A constraint may have the label of an unknown's bounds, two unknowns may share one."""
    model = Model("one label")
    x = model.variable("x", "x", unit="s", upper=9.5, label="time")
    y = model.variable("y", "y", unit="s", upper=4.5, label="time")
    model.maximise(x + y)
    model.subject_to("time", x + 2.0 * y <= 12.0)
    # 10 slots of x, the last cut short, leave 1 of y: whole, 10 + 2 = 12.
    assert Cvxpy().solve(model, 1, slot_s=1.0).point(0) == {"x": 9.5, "y": 1.0}


def test_what_it_does_not_take_is_refused_in_words() -> None:
    """Anything nonlinear, and slots without an end."""
    model = Model("curved")
    x = model.variable("x", "x", unit="s")
    model.maximise(x)
    with pytest.raises(InputError, match="an upper bound on x"):
        Cvxpy().solve(model, 1, slot_s=1.0)
    model.subject_to("curved", np.exp(x) <= 2.0)
    with pytest.raises(NotAffineError, match="exp"):
        Cvxpy().solve(model, 1)


@pytest.mark.parametrize("seed", range(5))
def test_many_unknowns(seed: int) -> None:
    """Against scipy's linprog in six unknowns, beyond what the closed form takes."""
    from scipy.optimize import linprog

    rng = np.random.default_rng(seed)
    a, b, c = rng.normal(size=(9, 6)), rng.uniform(1.0, 4.0, 9), rng.normal(size=6)
    model = Model("six")
    unknowns = [model.variable(f"x{k}", f"x{k}", unit="s", upper=5.0) for k in range(6)]
    model.minimise(sum(w * x for w, x in zip(c, unknowns, strict=True)))
    for k in range(9):
        model.subject_to(str(k), sum(w * x for w, x in zip(a[k], unknowns, strict=True)) <= b[k])
    found = Cvxpy().solve(model, 1)
    expected = linprog(c, A_ub=a, b_ub=b, bounds=(0.0, 5.0))
    assert found.objective[0] == pytest.approx(expected.fun, abs=1e-9)
    assert [found.multipliers_at(0)[str(k)] for k in range(9)] == pytest.approx(
        -expected.ineqlin.marginals, abs=1e-9
    )


SMALL = st.integers(0, 6)


@few(8)
@given(st.lists(st.tuples(SMALL, SMALL, SMALL), min_size=1, max_size=4), SMALL, SMALL)
def test_whole_numbers_against_all_of_them(
    rows: list[tuple[int, int, int]], p: int, q: int
) -> None:
    """Two unknowns in slots of 1 s up to 8: every pair looked at."""
    model = Model("whole")
    x, y = (model.variable(name, name, unit="s", upper=8.0) for name in ("x", "y"))
    model.maximise(p * x + q * y)
    model.prefer_small(x)
    model.prefer_small(y)
    for number, (a, b, limit) in enumerate(rows):
        model.subject_to(str(number), a * x + b * y <= 3.0 * limit)
    pairs = [
        (p * i + q * j, -i, -j)
        for i in range(9)
        for j in range(9)
        if all(a * i + b * j <= 3.0 * limit for a, b, limit in rows)
    ]
    value, minus_x, minus_y = max(pairs)
    found = Cvxpy().solve(model, 1, slot_s=1.0)
    assert (found.objective[0], found.point(0)) == (value, {"x": -minus_x, "y": -minus_y})


@pytest.mark.parametrize("slot_s", [None, 1.0])
def test_every_preference_counts(slot_s: float | None) -> None:
    """Of x + y + z + w ≤ 25 and 0 to 10 each: x first, then y, then z, nothing left for w."""
    model = Model("Several preferences")
    names = ("x", "y", "z", "w")
    x, *others = (model.variable(name, name, unit="s", upper=10.0) for name in names)
    model.maximise(x)
    for each in others:
        model.prefer_small(-each)
    room = Parameter("room", "room", "s", 25.0)
    model.subject_to("room", sum(others, x) <= room)
    compiled = CvxpyProgramme(model, slot_s)
    for room_s, expected in ((25.0, [10.0, 10.0, 5.0, 0.0]), (37.0, [10.0, 10.0, 10.0, 7.0])):
        point = compiled.solve({"room": room_s}).point(0)
        assert [point[name] for name in names] == pytest.approx(expected, abs=1e-6)
