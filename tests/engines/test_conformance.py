"""Every engine on every problem of the table that it takes."""

from __future__ import annotations

import pytest

from optuav.engines.pyomo_engine import Pyomo
from optuav.engines.registry import ENGINES
from optuav.engines.solution import Solution
from optuav.errors import SolverError
from optuav.modelling.classify import traits
from optuav.status import Status
from tests.engines import nl_solver
from tests.engines.conformance import CASES, Case
from tests.engines.optimality import residuals, solved


def objects(case: Case) -> list[str]:
    """Names of those that take the problem; a local solver has no proof that there is no point."""
    found, slots = traits(case.build()), case.slot_s is not None
    able = {name: not each.obstacle(found, slots) for name, each in OBJECTS.items()}
    if case.name == "nothing to gain":  # Pyomo hands over no model without rows and without a goal
        return []
    able["pyomo with casadi-nl"] &= case.status.has_answer and not found.integer
    return [name for name, takes in able.items() if takes]


TOLERANCE = {"closed-form": 1e-11, "cvxpy": 1e-8, "bracket": 2e-7, "casadi": 2e-7, "grid": 1e-11}
TOLERANCE |= {"pyomo": 1e-8, "pyomo with casadi-nl": 2e-7}
"""Of values and multipliers, relative to max(1, size)."""
OBJECTS = {"pyomo": Pyomo(), "pyomo with casadi-nl": Pyomo(nl_solver.NAME)}
"""Engines of the package that have no name in the registry."""
PAIRS = [(case, engine) for case in CASES for engine in (*case.engines, *objects(case))]
every_pair = pytest.mark.parametrize(
    ("case", "engine"), PAIRS, ids=[f"{case.name}-{engine}" for case, engine in PAIRS]
)
ANSWERS: dict[tuple[str, str], Solution] = {}


def answer(case: Case, engine: str) -> Solution:
    """The solution of an engine, worked out once."""
    key = case.name, engine
    if key not in ANSWERS:
        ANSWERS[key] = solved(OBJECTS.get(engine, engine), case.build(), case.slot_s)
    return ANSWERS[key]


def close(expected: float, engine: str) -> object:
    tolerance = TOLERANCE[engine]
    return pytest.approx(expected, rel=tolerance, abs=tolerance)


def test_table_reaches_every_engine() -> None:
    """And its names are its own; every engine solves, and every one refuses, a good part of it."""
    assert len({case.name for case in CASES}) == len(CASES)
    solved_by = {
        engine: sum(engine == name for _, name in PAIRS) for engine in (*ENGINES, *OBJECTS)
    }
    assert all(10 <= count < len(CASES) for count in solved_by.values()), solved_by


@every_pair
def test_status(case: Case, engine: str) -> None:
    """IPOPT proves no global optimum, and says so; values belong to answers only."""
    found = answer(case, engine)
    local = engine == "casadi" and case.status is Status.OPTIMAL
    local |= engine == "pyomo with casadi-nl" and not traits(case.build()).linear
    assert found.status is (Status.LOCALLY_OPTIMAL if local else case.status)
    if local:
        assert "local" in found.proof
    if not case.status.has_answer:
        with pytest.raises(SolverError, match=case.status.value):
            found.point(0)


answered = pytest.mark.parametrize(
    ("case", "engine"),
    [pair for pair in PAIRS if pair[0].status.has_answer],
    ids=[f"{case.name}-{engine}" for case, engine in PAIRS if case.status.has_answer],
)
priced = pytest.mark.parametrize(
    ("case", "engine"),
    [pair for pair in PAIRS if pair[0].prices],
    ids=[f"{case.name}-{engine}" for case, engine in PAIRS if case.prices],
)


@answered
def test_objective_and_values(case: Case, engine: str) -> None:
    """Those of the table, and a point that passes the check outside the engine."""
    found = answer(case, engine)
    assert found.objective[0] == close(case.objective, engine)
    point = found.point(0)
    for name, value in case.values.items():
        assert point[name] == close(value, engine), name
    found.verify()


@priced
def test_multipliers(case: Case, engine: str) -> None:
    """Those that are unique, under the labels of the constraints."""
    multipliers = answer(case, engine).multipliers_at(0)
    for label, weight in case.multipliers.items():
        assert multipliers.get(label, 0.0) == close(weight, engine), label


@priced
def test_conditions_of_optimality(case: Case, engine: str) -> None:
    """Feasibility, multipliers ≥ 0, complementarity and stationarity, unique or not."""
    found = answer(case, engine).residuals()
    assert found.violation <= 2.0 * TOLERANCE[engine]
    assert found.sign <= TOLERANCE[engine]
    assert found.complementarity <= 1e2 * TOLERANCE[engine]
    assert found.stationarity <= 1e-6


@priced
def test_residuals_are_what_differences_say(case: Case, engine: str) -> None:
    """The solution's own figures, and the same without derivatives of trees."""
    solution = answer(case, engine)
    own, other = solution.residuals(), residuals(solution)
    assert own.violation <= max(other.feasibility, 0.0)
    assert own[1:3] == pytest.approx((other.sign, other.complementarity), rel=1e-9, abs=1e-12)
    assert own.stationarity == pytest.approx(other.stationarity, abs=1e-6)


@answered
def test_slacks(case: Case, engine: str) -> None:
    """None negative, but for rounding; none left where a constraint binds, but for the slot."""
    found = answer(case, engine)
    assert found.residuals().violation <= 2.0 * TOLERANCE[engine]
    for label in () if case.slot_s else found.binding_labels(0):
        assert abs(found.slacks[label][0]) <= 1e-4, label


@priced
def test_shadow_prices(case: Case, engine: str) -> None:
    """Both sides of every parameter, and of no other."""
    prices = answer(case, engine).shadow_prices()
    assert prices.keys() == case.prices.keys()
    for name, expected in case.prices.items():
        sides = expected if isinstance(expected, tuple) else (expected, expected)
        tolerance = 1e2 * TOLERANCE[engine]
        assert tuple(prices[name]) == pytest.approx(sides, rel=tolerance, abs=tolerance), name
        assert prices[name].has_kink == (sides[0] != sides[1]), name


@pytest.mark.parametrize("case", [case for case in CASES if case.slot_s], ids=lambda c: c.name)
def test_slots_have_no_prices(case: Case) -> None:
    """A small change leaves an answer in whole slots where it is, or moves it by a slot."""
    for engine in case.engines:
        assert answer(case, engine).shadow_prices() == {}
