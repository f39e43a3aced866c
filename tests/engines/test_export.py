"""LP and MPS files: another solver reads the same programme, by the same names."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import highspy
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import optuav
from optuav.engines.export import to_file
from optuav.errors import InputError
from optuav.modelling import Model
from optuav.solving.question import problem_of

FORMS = ("lp", "mps")
DIGITS = 1e-14
"""Relative accuracy of the numbers that HiGHS writes."""
EACH_FORM = pytest.mark.parametrize("form", FORMS)
OPTIMAL, INFEASIBLE = highspy.HighsModelStatus.kOptimal, highspy.HighsModelStatus.kInfeasible


class Read:
    """What HiGHS finds in a text: the programme, and its optimum."""

    def __init__(self, text: str, folder: Path) -> None:
        path = folder / ("programme.lp" if "\nend\n" in text else "programme.mps")
        path.write_text(text, "utf-8")
        solver = highspy.Highs()
        solver.setOptionValue("output_flag", False)
        assert solver.readModel(str(path)) != highspy.HighsStatus.kError
        self.programme = solver.getLp()
        solver.run()
        self.status = solver.getModelStatus()
        self.objective = solver.getInfo().objective_function_value
        self.values = dict(
            zip(self.programme.col_names_, solver.getSolution().col_value, strict=True)
        )

    @property
    def matrix(self) -> np.ndarray[Any, Any]:
        """The coefficients (row, unknown)."""
        found = np.zeros((self.programme.num_row_, self.programme.num_col_))
        stored = self.programme.a_matrix_
        for column, (begin, end) in enumerate(itertools.pairwise(stored.start_)):
            for place in range(begin, end):
                found[stored.index_[place], column] = stored.value_[place]
        return found


@pytest.fixture
def read(tmp_path: Path) -> Callable[[str], Read]:
    """A function that has HiGHS read and solve a text."""
    return lambda text: Read(text, tmp_path)


QUESTIONS: Mapping[str, tuple[str, dict[str, Any]]] = {
    "P3": ("P3", {}),
    "P4 rest-first": ("P4", {"building": "b1", "order": "rest-first"}),
    "P4 hover-first": ("P4", {"building": "b9", "order": "hover-first"}),
    "P1 direct": ("P1", {"trajectory": "direct"}),
    "P2": ("P2", {"trajectory": "traj1", "order": "rest-first"}),
    "P2-tight": ("P2-tight", {"trajectory": "traj1", "order": "rest-first"}),
}


@EACH_FORM
@pytest.mark.parametrize("perspective", ["battery", "energy", "adjusted"])
@pytest.mark.parametrize("name", QUESTIONS)
def test_problems_of_the_paper_are_read_back_to_the_same_optimum(
    form: str, name: str, perspective: str, read: Callable[[str], Read]
) -> None:
    problem, options = QUESTIONS[name]
    program = optuav.formulate("paper", problem_of(problem, **options), perspective=perspective)
    plan = program.solve()
    part = program.parts[-1]
    found = read(to_file(part.model, part.model.row(0), form))
    assert found.status == OPTIMAL
    by_file = {"hover_time_s": plan.hover_time_s, "rest_time_s": plan.rest_time_s}
    goal_s = plan.flight_time_s + plan.rest_time_s if "P2" in problem else plan.hover_time_s
    assert found.objective == pytest.approx(goal_s, rel=1e-9)
    assert found.values.keys() == {each.name for each in part.model.variables}
    if problem != "P2":  # whose hover time is free
        assert found.values["hover_time_s"] == pytest.approx(by_file["hover_time_s"], abs=1e-6)


@EACH_FORM
def test_the_check_number_of_the_specification(form: str, read: Callable[[str], Read]) -> None:
    """719.5399 s for resting first on b1."""
    problem = optuav.P4("b1", order="rest-first")
    (part,) = optuav.formulate("paper", problem, perspective="battery").parts
    assert read(to_file(part.model, part.model.row(0), form)).objective == pytest.approx(
        719.5399, abs=1e-4
    )


@EACH_FORM
def test_constraints_are_called_by_their_labels(form: str, read: Callable[[str], Read]) -> None:
    (part,) = optuav.formulate(
        "paper", optuav.P4("b1", order="rest-first"), perspective="battery"
    ).parts
    rows = read(to_file(part.model, part.model.row(0), form)).programme.row_names_
    assert list(rows) == ["P4.a_state_of_charge", "P4.b_deadline"]


def knapsack(values: list[float], weights: list[float], room: float) -> Model:
    """Choose whole things of the largest value that fit; one more thing is ruled out."""
    model = Model("the best that fits")
    chosen = [
        model.variable(f"takes_{k}", f"x_{k}", unit="1", binary=True) for k in range(len(values))
    ]
    model.variable("never", "y", unit="1", upper=0.0, binary=True)
    model.maximise(sum(value * each for value, each in zip(values, chosen, strict=True)) + 100.0)
    total = sum(weight * each for weight, each in zip(weights, chosen, strict=True))
    model.subject_to("room", total <= room)
    return model


@EACH_FORM
def test_binary_unknowns_stay_whole(form: str, read: Callable[[str], Read]) -> None:
    """Against all subsets tried one by one; the relaxation would be better."""
    values, weights, room = [10.0, 13.0, 7.0, 11.5], [3.0, 4.0, 2.5, 3.75], 9.0
    best = max(
        sum(values[k] for k in subset)
        for size in range(5)
        for subset in itertools.combinations(range(4), size)
        if sum(weights[k] for k in subset) <= room
    )
    found = read(to_file(knapsack(values, weights, room), {}, form))
    assert found.objective == pytest.approx(100.0 + best)
    assert {round(value, 9) for value in found.values.values()} == {0.0, 1.0}
    assert found.values["never"] == 0.0


@EACH_FORM
def test_signs_equalities_and_free_unknowns(form: str, read: Callable[[str], Read]) -> None:
    """Minimise x + 2 y − 3 with x + y = −4, x ≥ −10, y ≤ −1 free below: x = 6, y = −10 by z."""
    model = Model("signs")
    x = model.variable("x", "x", unit="1", lower=-10.0)
    y = model.variable("y", "y", unit="1", lower=-math.inf, upper=-1.0)
    z = model.variable("z", "z", unit="1", lower=-math.inf)
    model.minimise(x + 2.0 * y - 3.0)
    model.subject_to("sum", x + y == -4.0)
    model.subject_to("floor", z <= y)
    model.subject_to("z is not lower", -z <= 10.0)
    found = read(to_file(model, {}, form))
    assert found.objective == pytest.approx(6.0 - 20.0 - 3.0)
    assert found.values == pytest.approx({"x": 6.0, "y": -10.0, "z": -10.0})


HOSTILE = [
    *("free", "inf", "infeasibility_s", "nan", "nancy", "e5", "E", "3x", ".5", "st", "end", "max"),
    *(
        "objective",
        "rhs",
        "bounds",
        "Δ",
        "Δ'",
        "a b",
        "a_b",
        "A_B",
        "a-b",
        "",
        "x" * 300,
        "x" * 301,
    ),
    *("\n", "such that", "binary", "semi", "sos", "marker", "_", "μ_1"),
]


@EACH_FORM
def test_any_name_is_made_one_that_solvers_read(form: str, read: Callable[[str], Read]) -> None:
    """Words of the formats, what looks like a number, letters beyond ASCII, names that collide."""
    model = Model("names\nEnd")
    unknowns = [
        model.variable(name, f"x_{k}", unit="1", upper=k + 1.0) for k, name in enumerate(HOSTILE)
    ]
    model.maximise(sum(unknowns))
    for k, (name, each) in enumerate(zip(HOSTILE, unknowns, strict=True)):
        model.subject_to(name if name.strip() else f"row {k}", each <= k + 0.25)
    found = read(to_file(model, {}, form, ["a remark\nSubject To"]))
    assert list(found.values.values()) == pytest.approx([k + 0.25 for k in range(len(HOSTILE))])
    assert len(set(found.values)) == len(HOSTILE)
    assert len({*found.programme.row_names_}) == len(HOSTILE)
    assert all(name.isascii() and len(name) < 200 for name in found.values)
    assert {"a_b", "a_b_2", "A_B_3", "x_infeasibility_s"} <= found.values.keys()


numbers = st.floats(-1e6, 1e6).filter(lambda x: x == 0.0 or abs(x) > 1e-6)
bounds = st.sampled_from(
    [(0.0, math.inf), (-math.inf, math.inf), (-math.inf, 0.1), (-3.0, -0.7), (1e-5, 1e5)]
)
costs = numbers.filter(bool)  # HiGHS leaves out an unknown that the programme does not speak of
columns = st.lists(st.tuples(costs, bounds), min_size=1, max_size=4)
rows = st.lists(
    st.tuples(
        st.lists(numbers, min_size=4, max_size=4), st.sampled_from(["<=", ">=", "=="]), numbers
    ),
    max_size=4,
)


@given(columns, rows, numbers, st.sampled_from(FORMS))
def test_numbers_are_read_back(
    tmp_path_factory: pytest.TempPathFactory,
    columns: list[tuple[float, tuple[float, float]]],
    rows: list[tuple[list[float], str, float]],
    constant: float,
    form: str,
) -> None:
    """Every coefficient, side, bound, sense and constant, to the digits that HiGHS writes."""

    def same(number: float) -> Any:
        return pytest.approx(number, rel=DIGITS, abs=0.0)

    model = Model("drawn")
    x = [
        model.variable(f"x{k}", f"x{k}", unit="1", lower=lower, upper=upper)
        for k, (_, (lower, upper)) in enumerate(columns)
    ]
    goal = sum(cost * each for (cost, _), each in zip(columns, x, strict=True))
    model.minimise(goal + constant)
    compare = {"<=": np.less_equal, ">=": np.greater_equal, "==": np.equal}
    for k, (coefficients, sense, side) in enumerate(rows):
        coefficients[0] = coefficients[0] or 1.0
        left = sum(c * each for c, each in zip(coefficients, x, strict=False))
        model.subject_to(f"r{k}", compare[sense](left, side))
    found = Read(to_file(model, {}, form), tmp_path_factory.getbasetemp())
    programme = found.programme
    assert programme.offset_ == same(constant)
    at = [programme.col_names_.index(f"x{k}") for k in range(len(x))]
    assert sorted(at) == list(range(programme.num_col_))
    for k, (cost, (lower, upper)) in zip(at, columns, strict=True):
        assert programme.col_cost_[k] == same(cost)
        assert programme.col_lower_[k] == same(lower)
        assert programme.col_upper_[k] == same(upper)
    assert list(programme.row_names_) == [f"r{k}" for k in range(len(rows))]
    for read, (stated, _, _) in zip(found.matrix[:, at], rows, strict=True):
        assert list(read) == same(stated[: len(x)])
    for k, (_, sense, side) in enumerate(rows):
        assert programme.row_lower_[k] == same(-math.inf if sense == "<=" else side)
        assert programme.row_upper_[k] == same(math.inf if sense == ">=" else side)


@EACH_FORM
def test_what_cannot_hold_is_infeasible_in_the_file_as_well(
    form: str, read: Callable[[str], Read]
) -> None:
    """A deadline before the flight ends, and a constraint without unknowns that is violated."""
    late = optuav.load("paper").replace({"limits.deadline_s": 60})
    (part,) = optuav.formulate(
        late, optuav.P4("b1", order="rest-first"), perspective="battery"
    ).parts
    assert read(to_file(part.model, part.model.row(0), form)).status == INFEASIBLE
    (direct,) = optuav.formulate(late, "P3", perspective="battery").parts
    assert read(to_file(direct.model, direct.model.row(0), form)).status == INFEASIBLE
    (p1,) = optuav.formulate("paper", optuav.P1(trajectory="direct"), perspective="battery").parts
    too_far = p1.model.row(0) | {"hover_distance_m": 600.0}
    assert read(to_file(p1.model, too_far, form)).status == INFEASIBLE


@EACH_FORM
def test_a_negative_upper_bound_leaves_the_lower_one(
    form: str, read: Callable[[str], Read]
) -> None:
    """Readers take a lower bound of 0 beside a negative upper one for none, if no row states it."""
    model = Model("contradiction")
    x = model.variable("x", "x", unit="s", upper=-5.0)
    model.maximise(x)
    found = read(to_file(model, {}, form))
    assert found.status == INFEASIBLE
    assert list(found.matrix[:, 0]) == [1.0]
    assert list(found.programme.row_lower_) == [0.0]


@EACH_FORM
def test_a_constraint_without_unknowns_that_holds_is_told_but_not_written(form: str) -> None:
    """Its sides differ by rounding, which another solver may not forgive."""
    (p1,) = optuav.formulate("paper", optuav.P1(trajectory="direct"), perspective="battery").parts
    text = to_file(p1.model, p1.model.row(0), form)
    assert "'P1.a outage' holds for all values of the unknowns: left out" in text
    assert "P1.a_outage" not in text


@EACH_FORM
def test_a_nonlinear_model_is_refused_by_the_constraint(form: str) -> None:
    (part,) = optuav.formulate("paper", "P3", perspective="wells").parts
    with pytest.raises(InputError, match=r"'P3\.a state of charge' is not linear: \w+ of the"):
        to_file(part.model, part.model.row(0), form)


@EACH_FORM
@pytest.mark.parametrize("number", [math.nan, math.inf])
def test_numbers_that_are_none_are_refused(form: str, number: float) -> None:
    """HiGHS would drop such a row and call the rest optimal."""
    (part,) = optuav.formulate("paper", "P3", perspective="battery").parts
    with pytest.raises(InputError, match=r"'P3\.a state of charge' has a number"):
        to_file(part.model, part.model.row(0) | {"hover_current_A": number}, form)


@EACH_FORM
def test_names_and_labels_stand_at_the_top_and_the_text_is_the_same_again(form: str) -> None:
    (part,) = optuav.formulate(
        "paper", optuav.P4("b1", order="rest-first"), perspective="battery"
    ).parts
    text = to_file(part.model, part.model.row(0), form)
    assert "P4.a_state_of_charge is 'P4.a state of charge'" in text
    assert "hover_time_s is Δ [s]" in text
    assert text == to_file(part.model, part.model.row(0), form)
