"""The engine that hands smooth programmes to CasADi: local, feasible to the bit, and honest."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import casadi
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from optuav.engines import casadi_engine, closed_form
from optuav.engines.casadi_engine import Casadi, CasadiProgramme
from optuav.errors import InputError, SolverError
from optuav.modelling import Model, Parameter, evaluate
from optuav.modelling.traversal import KINKED, PARTIALS
from optuav.status import Status
from tests.engines.conformance import p4
from tests.examples import few


def one(upper: float = math.inf, lower: float = 0.0) -> tuple[Model, object]:
    """A model with an unknown x."""
    model = Model("one")
    return model, model.variable("x", "x", unit="s", lower=lower, upper=upper)


@pytest.mark.parametrize(
    "ufunc", sorted([*PARTIALS, *KINKED], key=str), ids=lambda ufunc: ufunc.__name__
)
def test_functions_are_those_of_numpy(ufunc: np.ufunc) -> None:
    """Every ufunc has the values of NumPy on CasADi's symbols."""
    symbols = casadi.SX.sym("x", ufunc.nin)
    found = casadi_engine.applied(ufunc, [symbols[k] for k in range(ufunc.nin)])
    function = casadi.Function("f", [symbols], [found])
    rng = np.random.default_rng(0)
    for _ in range(20):
        point = rng.uniform(0.05, 0.95, ufunc.nin) + (ufunc is np.arccosh)
        assert float(function(point)) == pytest.approx(ufunc(*point), rel=1e-14)


@pytest.mark.parametrize(
    ("row", "status"),
    [
        (lambda x: 0.0 * x == 1.0, Status.INFEASIBLE),
        (lambda x: np.exp(-x) >= 2.0, Status.UNKNOWN),
        (lambda x: 0.0 * x == 0.0, Status.UNBOUNDED),
        (lambda x: x * x >= 4.0, Status.UNBOUNDED),
    ],
)
def test_unbounded_takes_a_feasible_point(row: Callable[[Any], Any], status: Status) -> None:
    """Where the iterates run away but no point satisfies the constraints, nothing is unbounded."""
    model, x = one()
    model.maximise(x)
    model.subject_to("row", row(x))
    assert Casadi().solve(model, 1).status is status


def test_unknown_function_is_refused_by_name() -> None:
    model, x = one(upper=3.0)
    model.maximise(np.rint(x))
    with pytest.raises(InputError, match="does not know the function rint"):
        Casadi().solve(model, 1)


def test_the_better_of_two_tops_is_found_from_several_starts(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A single start in the middle climbs the lower one."""
    model, x = one(upper=10.0)
    model.maximise((x - 5.2) ** 4 - 20.0 * (x - 5.2) ** 2)
    found = Casadi().solve(model, 1)
    assert found.status is Status.LOCALLY_OPTIMAL
    values = [evaluate(model.objective, {"x": each}) for each in np.linspace(0.0, 10.0, 1001)]
    assert found.objective[0] == pytest.approx(max(values))
    monkeypatch.setattr(casadi_engine, "SHARES", (0.51,))
    assert Casadi().solve(model, 1).objective[0] < max(values) - 1.0


def test_solves_do_not_remember_each_other() -> None:
    """A binding deadline, an infeasible one, a long one, and the first again."""
    compiled = CasadiProgramme(p4())
    hovers = [compiled.solve({"T": T}).objective[0] for T in (150.0, -1.0, 1e6, 150.0)]
    by_closed_form = closed_form.solve(p4(T=1e6), 1).objective[0]
    expected = [310 / 3, math.nan, by_closed_form, 310 / 3]
    assert hovers == pytest.approx(expected, nan_ok=True, rel=1e-9)


def test_many_programmes_are_solved_one_after_the_other() -> None:
    """Arrays in the parameters; one is infeasible, which is not proved, one has no number."""
    model, x = one()
    p = Parameter("p", "p", "1", np.array([3.0, -1.0, math.nan]))
    model.maximise(x)
    model.subject_to("exponential", np.exp(x) - 1.0 <= p)
    found = Casadi().solve(model, 3)
    local, unknown, error = found.statuses
    assert (local, unknown) == (Status.LOCALLY_OPTIMAL, Status.UNKNOWN)
    assert error is Status.ERROR
    assert found.values["x"] == pytest.approx([math.log(4.0), math.nan, math.nan], nan_ok=True)


@pytest.mark.parametrize("scale", [1e-12, 1e-6, 1e6, 1e12])
def test_unit_of_the_objective_changes_nothing(scale: float) -> None:
    """IPOPT's tolerances are absolute: unscaled, it stops anywhere at slopes of 1e-12."""
    model, x = one(upper=2.0)
    y = model.variable("y", "y", unit="s")
    model.maximise(scale * (x + 2.0 * np.log1p(y)))
    model.subject_to("most", y <= 3.0)
    found = Casadi().solve(model, 1)
    assert found.point(0) == pytest.approx({"x": 2.0, "y": 3.0}, rel=1e-8)
    assert found.multipliers_at(0)["most"] == pytest.approx(0.5 * scale, rel=1e-6)


@pytest.mark.parametrize("size", [1e-5, 1.0, 1e6, 1e9])
def test_size_of_the_unknowns_changes_nothing(size: float) -> None:
    model, x = one()
    y = model.variable("y", "y", unit="s")
    model.maximise(x)
    model.subject_to("slant", x <= y)
    model.subject_to("sum", np.hypot(x, y) <= Parameter("r", "r", "s", size * math.sqrt(2.0)))
    assert Casadi().solve(model, 1).point(0) == pytest.approx({"x": size, "y": size}, rel=1e-4)


def test_next_to_no_room() -> None:
    """A constraint that leaves 1e-14 s of 900 s: solved, not said to be unbounded."""
    model, x = one(upper=900.0)
    model.maximise(x)
    model.subject_to("charge", 1e-3 * x <= Parameter("left", "left", "1", 1e-17))
    found = Casadi().solve(model, 1)
    assert found.status is Status.LOCALLY_OPTIMAL
    assert found.point(0)["x"] == pytest.approx(0.0, abs=1e-9)


def test_unknowns_without_bounds() -> None:
    """Starts need a place: around zero, or below the upper bound."""
    model, x = one(lower=-math.inf)
    y = model.variable("y", "y", unit="s", lower=-math.inf, upper=-1.0)
    model.minimise((x - 3.0) ** 2 + (y - 7.0) ** 2)
    assert Casadi().solve(model, 1).point(0) == pytest.approx({"x": 3.0, "y": -1.0}, abs=1e-8)


def test_earlier_preferences_go_first() -> None:
    """Among equal answers the smallest x, among those the smallest y; also with no objective."""
    model = Model("three")
    x, y, z = (model.variable(name, name, unit="s", upper=2.0) for name in ("x", "y", "z"))
    model.maximise(x + y + z)
    model.prefer_small(x)
    model.prefer_small(y)
    model.subject_to("sum", x + y + z <= 3.0)
    assert Casadi().solve(model, 1).point(0) == pytest.approx({"x": 0, "y": 1, "z": 2}, abs=1e-7)
    model.objective = 0.0
    x_s, y_s, _ = Casadi().solve(model, 1).point(0).values()
    assert (x_s, y_s) == pytest.approx((0.0, 0.0), abs=1e-7)


def test_a_linear_model_is_solved_from_one_start(monkeypatch: pytest.MonkeyPatch) -> None:
    """Any local optimum is the global one; preferences are asked where others are as good only."""
    calls: list[str] = []
    run = casadi_engine.run

    def counted(programme: Any, arguments: Any) -> Any:
        calls.append("")
        return run(programme, arguments)

    monkeypatch.setattr(casadi_engine, "run", counted)
    model = Model("two")
    x, y = (model.variable(name, name, unit="s", upper=2.0) for name in ("x", "y"))
    model.prefer_small(y)
    model.subject_to("sum", x + y <= 3.0)
    for goal, point, solved in ((2.0 * x + y, (2.0, 1.0), 1), (x, (2.0, 0.0), 2)):
        model.objective = goal
        assert (*Casadi().solve(model, 1).point(0).values(),) == pytest.approx(point, abs=1e-6)
        assert len(calls) == solved
        calls.clear()


@few(8)
@given(st.floats(0.1, 50.0), st.floats(0.1, 5.0), st.floats(0.5, 3.0))
def test_known_optimum_of_a_curved_programme(P: float, c: float, power: float) -> None:
    """max xᵃ yᵃ with x + c y = P is P/2 for x and P/(2 c) for y, whatever a."""
    model = Model("product")
    x, y = (model.variable(name, name, unit="s", lower=1e-6) for name in ("x", "y"))
    model.maximise(x**power * y**power)
    model.subject_to("budget", x + c * y == P)
    found = Casadi().solve(model, 1)
    assert found.status is Status.LOCALLY_OPTIMAL
    assert found.point(0) == pytest.approx({"x": P / 2, "y": P / (2 * c)}, rel=1e-5)


def test_point_keeps_its_bounds_and_constraints() -> None:
    """IPOPT relaxes bounds by 1e-8 of themselves unless told not to: here 1e-5 s over."""
    for seed in range(10):
        T = 1000.0 * np.random.default_rng(seed).random()
        model, x = one(upper=Parameter("T", "T", "s", T))
        model.maximise(x + 1e-3 * np.sin(x))
        model.subject_to("charge", np.expm1(1e-6 * x) <= math.expm1(1e-6 * T))
        found = Casadi().solve(model, 1)
        assert found.point(0)["x"] <= T
        assert found.point(0)["x"] >= T - 1e-6
        found.verify()


@pytest.mark.parametrize(
    ("constraint", "words"),
    [
        pytest.param(lambda x: np.exp(x) <= 0.5, "Infeasible_Problem_Detected", id="curved"),
        pytest.param(lambda x: x * x + 1.0 <= x, "Infeasible_Problem_Detected", id="no real root"),
    ],
)
def test_infeasible_by_ipopt_proves_nothing_where_it_is_not_linear(
    constraint: object, words: str
) -> None:
    """IPOPT's word is kept, which is local; it was called infeasible."""
    model, x = one(upper=10.0)
    model.maximise(x)
    model.subject_to("impossible", constraint(x))  # type: ignore[operator]
    found = Casadi().solve(model, 1)
    assert found.status is Status.UNKNOWN
    assert found.proof == "local: none of 3 starts led to a feasible point"
    assert words in found.words[0]


@pytest.mark.parametrize("objective", [np.square, np.sqrt, np.log1p], ids=lambda f: f.__name__)
def test_unbounded(objective: np.ufunc) -> None:
    """Also where the slope fades out, and IPOPT alone takes 1e13 s for an optimum."""
    model, x = one()
    model.maximise(objective(x))
    found = Casadi().solve(model, 1)
    assert (found.status, found.proof) == (Status.UNBOUNDED, "local: the iterates diverge")


def test_numbers_outside_a_function(capfd: pytest.CaptureFixture[str]) -> None:
    """The logarithm of a negative number is an error, and CasADi does not write to the screen."""
    model, x = one(upper=10.0)
    model.maximise(np.log(x - 20.0))
    assert Casadi().solve(model, 1).status is Status.ERROR
    assert capfd.readouterr() == ("", "")


def test_trouble_without_a_verdict_is_unknown() -> None:
    """Neither optimal nor infeasible nor unbounded."""
    model, x = one(upper=2.0)
    model.maximise(np.arcsin(x))  # its slope at the optimum, x = 1, is infinite
    model.subject_to("most", x <= 1.0)
    assert Casadi().solve(model, 1).status is Status.UNKNOWN


def test_settled_constraints_are_not_handed_over() -> None:
    """One without unknowns decides by itself."""
    model, x = one(upper=2.0)
    model.maximise(x)
    model.subject_to("reach", Parameter("d", "d", "m", 5.0) <= Parameter("r", "r", "m", 5.0))
    compiled = CasadiProgramme(model)
    assert compiled.solve({}).multipliers_at(0)["reach"] == 0.0
    found = compiled.solve({"r": 4.0})
    assert (found.status, found.proof) == (Status.INFEASIBLE, "evaluated")
    assert "reach" in found.words[0]
    assert compiled.solve({"d": math.nan}).status is Status.ERROR


@pytest.mark.parametrize("turned", [False, True])
def test_an_inequality_that_an_equation_implies_has_no_price(turned: bool) -> None:
    """By hand x = y = T/2. With both for limits it was 4e-5 s off, with multipliers of 1e8."""
    model, x = one()
    y = model.variable("y", "y", unit="s")
    end = Parameter("T", "T", "s", 2000.0)
    model.minimise(y)
    model.subject_to("most", end >= x + y if turned else x + y <= end)
    model.subject_to("all", x + y == end)
    model.subject_to("apart", x - y <= 0.0)
    found = Casadi().solve(model, 1)
    assert found.point(0) == pytest.approx({"x": 1000.0, "y": 1000.0}, abs=1e-7)
    weights = [found.multipliers_at(0)[label] for label in ("most", "all", "apart")]
    assert weights == pytest.approx([0.0, -0.5, 0.5], abs=1e-9)


def test_time_limit() -> None:
    """An error that says so, never an unfinished point."""
    model = Model("slow")
    unknowns = [model.variable(f"x{k}", f"x{k}", unit="s", upper=10.0) for k in range(3)]
    model.maximise(sum(np.sin(7.0 * x) * np.exp(0.1 * y) for x in unknowns for y in unknowns))
    with pytest.raises(SolverError, match="did not finish within the time limit"):
        Casadi().solve(model, 1, time_limit_s=1e-6)


@pytest.mark.parametrize(
    ("goal", "floor", "found"),
    [
        (lambda x: 2.0 * x, 0.0, (Status.OPTIMAL, 1.0)),  # both as small as they may be
        (lambda x: 2.0 * x, 9.0, (Status.LOCALLY_OPTIMAL, 3.0)),  # x² ≥ 9 holds from 3 on
        (lambda x: -2.0 * x, 0.0, (Status.LOCALLY_OPTIMAL, 4.0)),  # larger is better
        (lambda x: (x - 2.0) ** 2, 0.0, (Status.LOCALLY_OPTIMAL, 2.0)),  # not affine
    ],
)
def test_the_smallest_unknowns_are_an_answer_only_where_nothing_beats_them(
    goal: Callable[[Any], Any], floor: float, found: tuple[Status, float]
) -> None:
    """The point at all lower bounds is optimal if it is feasible and no goal falls from there."""
    model, x = one(lower=1.0, upper=4.0)
    model.minimise(goal(x))
    model.subject_to("curved", x * x >= floor)
    solution = Casadi().solve(model, 1)
    assert solution.status is found[0]
    assert solution.point(0)["x"] == pytest.approx(found[1], abs=1e-5)
    if found[0] is Status.OPTIMAL:
        assert solution.multipliers_at(0) == {"curved": 0.0, "bounds of x": 2.0}


def test_without_a_lower_bound_there_is_no_smallest_unknown() -> None:
    """What falls for ever is unbounded, also where all rows hold at minus infinity."""
    model, u = one(upper=5.0, lower=-math.inf)
    model.minimise(u)
    assert Casadi().solve(model, 1).status is Status.UNBOUNDED
