"""Solutions: no value without an answer, no answer that was not evaluated again."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from typing import Any

import numpy as np
import pytest

import optuav
from optuav.engines import prices, registry
from optuav.engines.solution import Solution, concatenated, single
from optuav.errors import SolverError
from optuav.modelling import Model, Parameter
from optuav.options import Perspective
from optuav.status import Status


def two_answers(x: float) -> Solution:
    """A value of `limited`, and a programme without one."""
    return Solution(
        engine="test",
        proof="none",
        declared=limited(),
        statuses=[Status.OPTIMAL, Status.INFEASIBLE],
        objective=np.array([x, np.nan]),
        values={"x": np.array([x, np.nan])},
        tight=[["limit"], []],
    )


def limited() -> Model:
    """x at most 3 in the first programme, at most 4 in the second."""
    model = Model("test")
    x = model.variable("x", "x", unit="s")
    model.subject_to("limit", x <= Parameter("p", "p", "s", np.array([3.0, 4.0])))
    return model


@pytest.mark.parametrize("status", list(Status))
def test_which_statuses_have_values(status: Status) -> None:
    assert status.has_answer == (status.value in ("optimal", "locally_optimal", "feasible"))


def test_value_of_a_failed_solve_cannot_be_read() -> None:
    """NaN must not travel on as a time."""
    assert two_answers(3.0).point(0) == {"x": 3.0}
    with pytest.raises(SolverError, match="infeasible"):
        two_answers(3.0).point(1)


def test_labels_of_what_binds() -> None:
    assert two_answers(3.0).binding_labels(0) == ("limit",)
    assert two_answers(3.0).binding_labels(1) == ()


def test_answers_are_evaluated_again_with_their_own_parameters() -> None:
    """3 is feasible in the first programme, 3.5 only in the second, NaN nowhere."""
    two_answers(3.0).verify(0)
    for wrong, excess in ((3.5, "0.5"), (np.nan, "nan"), (-1.0, "1")):
        with pytest.raises(SolverError, match=f"by {excess}"):
            two_answers(wrong).verify(0)


def test_slack_of_every_constraint_in_its_own_unit() -> None:
    """By label, with each programme's own parameters; nothing where there is no answer."""
    found = replace(two_answers(1.0), statuses=[Status.OPTIMAL, Status.OPTIMAL])
    found = replace(found, values={"x": np.array([1.0, 5.0])})
    assert found.slacks["limit"].tolist() == [2.0, -1.0]
    assert found.slacks["bounds of x"].tolist() == [1.0, 5.0]
    np.testing.assert_array_equal(two_answers(1.0).slacks["limit"], [2.0, np.nan])


def test_slack_of_two_bounds_under_one_label_is_the_nearer() -> None:
    model = Model("test")
    model.variable("x", "x", unit="s", lower=1.0, upper=9.0, label="time")
    found = Solution("test", "", model, [Status.OPTIMAL], np.zeros(1), {"x": np.array([3.0])})
    assert found.slacks["time"].tolist() == [2.0]


def corner(x: float, weights: dict[str, float]) -> Solution:
    """Of max 2 x, 3 x ≤ 12, x + 1 ≥ −2, x ≤ 10: best at x = 4 with the multiplier 2/3."""
    model = Model("corner")
    unknown = model.variable("x", "x", unit="s", upper=10.0)
    model.maximise(2.0 * unknown)
    model.subject_to("above", 3.0 * unknown <= 12.0)
    model.subject_to("below", unknown + 1.0 >= -2.0)
    values = {"x": np.array([x])}
    return Solution("t", "", model, [Status.OPTIMAL], np.array([2.0 * x]), values, duals=[weights])


@pytest.mark.parametrize(
    ("x", "weights", "expected"),
    [
        pytest.param(4.0, {"above": 2 / 3}, (0, 0, 0, 0), id="optimal"),
        pytest.param(10.0, {"bounds of x": 2.0}, (18 / 12, 0, 0, 0), id="violated"),
        pytest.param(3.0, {"above": 2 / 3}, (0, 0, 2, 0), id="slack with a weight"),
        pytest.param(4.0, {"above": 0.5}, (0, 0, 0, 0.5), id="not stationary"),
        pytest.param(4.0, {"above": 1.0, "below": 1.0}, (0, 0, 7, 0), id="pushed from below"),
        pytest.param(4.0, {"above": 1 / 3, "below": -1.0}, (0, 1, 7, 0), id="negative"),
        pytest.param(0.0, {"above": 1.0, "bounds of x": 1.0}, (0, 0, 12, 0), id="lower bound"),
        pytest.param(4.0, {}, (0, np.nan, np.nan, np.nan), id="no multipliers"),
        pytest.param(4.0, {"above": np.nan}, (0, np.nan, np.nan, np.nan), id="multipliers unknown"),
    ],
)
def test_what_an_answer_lacks(
    x: float, weights: dict[str, float], expected: tuple[float, ...]
) -> None:
    """Violation, sign, complementarity and stationarity, each by hand."""
    found = corner(x, weights).residuals()
    assert tuple(found) == pytest.approx(expected, abs=1e-15, nan_ok=True)


def test_what_is_no_number_is_not_taken_for_feasible() -> None:
    assert np.isnan(corner(np.nan, {}).residuals().violation)


def test_residuals_of_no_answer_cannot_be_read() -> None:
    with pytest.raises(SolverError, match="infeasible"):
        two_answers(3.0).residuals(1)


def test_a_solution_prints_its_constraints_and_what_it_lacks() -> None:
    """One programme with an answer as a table; any other in a line."""
    found = replace(corner(4.0, {"above": 0.5}), tight=[["above"]])
    assert str(found).splitlines() == [
        "optimal by t ()",
        "",
        "maximise 8 at x = 4 s",
        "constraint   slack  multiplier",
        "above            0         0.5  binds",
        "below            7           –",
        "bounds of x      4           –",
        "violation 0, sign 0, complementarity 0, stationarity 0.5",
    ]
    assert str(two_answers(3.0)) == "Solution by test: 1 optimal, 1 infeasible"


def test_the_proof_of_stacked_solutions_is_of_one_that_answers() -> None:
    """Not of a route that happens to be first and has no plan."""
    none = single(limited(), "test", {}, Status.INFEASIBLE, "none of 9 starts")
    answer = replace(two_answers(3.0).only(0), proof="the best of 9 starts", given={})
    found = concatenated([none, answer])
    assert found.proof == "the best of 9 starts"
    assert found.statuses == [Status.INFEASIBLE, Status.OPTIMAL]
    assert concatenated([none, none]).proof == "none of 9 starts"


def test_multipliers_that_follow_from_the_answer_are_computed_on_first_use(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """2 x under 3 x ≤ 12 gains 2/3 per unit of the right side."""
    counted, honest = [], prices.local_multipliers

    def local_multipliers(*arguments: object) -> dict[str, float]:
        counted.append(arguments)
        return honest(*arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(prices, "local_multipliers", local_multipliers)
    found = replace(corner(4.0, {}), duals=None)
    found.only(0).verify()
    assert not counted
    assert found.multipliers_at(0) == pytest.approx(
        {"above": 2 / 3, "below": 0.0, "bounds of x": 0.0}
    )
    assert len(counted) == 1


def test_stacked_solutions_compute_their_multipliers_on_first_use() -> None:
    found = concatenated(
        [replace(corner(4.0, {}), duals=None), replace(corner(4.0, {}), duals=None)]
    )
    assert [found.multipliers_at(k)["above"] for k in (0, 1)] == pytest.approx([2 / 3, 2 / 3])


def test_a_programme_without_an_answer_has_no_multipliers() -> None:
    found = replace(two_answers(3.0), duals=None)
    assert found.multipliers_at(1) == {}


COPIES: dict[str, Callable[[Any], Any]] = {
    "pickle": lambda each: pickle.loads(pickle.dumps(each)),
    "deepcopy": copy.deepcopy,
}


@pytest.mark.parametrize("copied", COPIES.values(), ids=COPIES)
@pytest.mark.parametrize("engine", registry.ENGINES)
def test_programs_and_solutions_survive_copies(engine: str, copied: Callable[[Any], Any]) -> None:
    """Solved before and after: nothing that they found depends on the identity of objects."""
    perspective: Perspective = "available" if engine in ("bracket", "grid") else "battery"
    slot_s = 60.0 if engine == "grid" else None
    problem = optuav.P4("b1", order="rest-first")
    program = optuav.formulate(
        "paper", problem, perspective=perspective, engine=engine, slot_s=slot_s
    )
    solution = program.compile().solve()
    said = [str(program), str(solution), solution.slacks, solution.shadow_prices()]
    again, multipliers = copied(solution), solution.multipliers_at(0)
    assert [str(copied(program)), str(again), again.slacks, again.shadow_prices()] == said
    assert again.multipliers_at(0) == multipliers
    assert copied(program).compile().solve().values == solution.values
    fresh = optuav.formulate("paper", problem, perspective=perspective, slot_s=slot_s)
    assert copied(fresh).compile(engine).solve().values == solution.values


def _solved(program: optuav.Program) -> optuav.Program:
    program.solve()
    return program


@pytest.mark.soak
def test_programs_survive_a_process_pool() -> None:
    """There and back, and solved in both places."""
    program = optuav.formulate("paper", "P3", perspective="battery")
    plan = program.solve()
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        for each in pool.map(_solved, [program] * 4):
            assert each.solve() == plan
            assert str(each) == str(program)
