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
from optuav.engines.export import to_lp, to_mps
from optuav.errors import InputError
from optuav.modelling import Model

Writer = Callable[..., str]
WRITERS = pytest.mark.parametrize("write", [to_lp, to_mps])
OPTIMAL, INFEASIBLE = highspy.HighsModelStatus.kOptimal, highspy.HighsModelStatus.kInfeasible


class Read:
    """What HiGHS finds in a text: the programme, and its optimum."""

    def __init__(self, text: str, folder: Path) -> None:
        path = folder / ("programme.lp" if "\nEnd\n" in text else "programme.mps")
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


@WRITERS
@pytest.mark.parametrize("perspective", ["battery", "energy", "adjusted"])
@pytest.mark.parametrize("name", QUESTIONS)
def test_problems_of_the_paper_are_read_back_to_the_same_optimum(
    write: Writer, name: str, perspective: str, read: Callable[[str], Read]
) -> None:
    problem, options = QUESTIONS[name]
    program = optuav.formulate("paper", problem, perspective=perspective, **options)
    plan = program.solve()
    part = program.parts[-1]
    found = read(write(part.model, part.model.row(0)))
    assert found.status == OPTIMAL
    by_file = {"hover_time_s": plan.hover_time_s, "rest_time_s": plan.rest_time_s}
    goal_s = plan.flight_time_s + plan.rest_time_s if "P2" in problem else plan.hover_time_s
    assert found.objective == pytest.approx(goal_s, rel=1e-9)
    assert found.values.keys() == {each.name for each in part.model.variables}
    if problem != "P2":  # whose hover time is free
        assert found.values["hover_time_s"] == pytest.approx(by_file["hover_time_s"], abs=1e-6)


@WRITERS
def test_the_check_number_of_the_specification(write: Writer, read: Callable[[str], Read]) -> None:
    """719.5399 s for resting first on b1."""
    options = QUESTIONS["P4 rest-first"][1]
    (part,) = optuav.formulate("paper", "P4", **{"perspective": "battery", **options}).parts
    assert read(write(part.model, part.model.row(0))).objective == pytest.approx(719.5399, abs=1e-4)


@WRITERS
def test_constraints_are_called_by_their_labels(write: Writer, read: Callable[[str], Read]) -> None:
    (part,) = optuav.formulate(
        "paper", "P4", building="b1", order="rest-first", perspective="battery"
    ).parts
    rows = read(write(part.model, part.model.row(0))).programme.row_names_
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


@WRITERS
def test_binary_unknowns_stay_whole(write: Writer, read: Callable[[str], Read]) -> None:
    """Against all subsets tried one by one; the relaxation would be better."""
    values, weights, room = [10.0, 13.0, 7.0, 11.5], [3.0, 4.0, 2.5, 3.75], 9.0
    best = max(
        sum(values[k] for k in subset)
        for size in range(5)
        for subset in itertools.combinations(range(4), size)
        if sum(weights[k] for k in subset) <= room
    )
    found = read(write(knapsack(values, weights, room), {}))
    assert found.objective == pytest.approx(100.0 + best)
    assert {round(value, 9) for value in found.values.values()} == {0.0, 1.0}
    assert found.values["never"] == 0.0


@WRITERS
def test_signs_equalities_and_free_unknowns(write: Writer, read: Callable[[str], Read]) -> None:
    """Minimise x + 2 y − 3 with x + y = −4, x ≥ −10, y ≤ −1 free below: x = 6, y = −10 by z."""
    model = Model("signs")
    x = model.variable("x", "x", unit="1", lower=-10.0)
    y = model.variable("y", "y", unit="1", lower=-math.inf, upper=-1.0)
    z = model.variable("z", "z", unit="1", lower=-math.inf)
    model.minimise(x + 2.0 * y - 3.0)
    model.subject_to("sum", x + y == -4.0)
    model.subject_to("floor", z <= y)
    model.subject_to("z is not lower", -z <= 10.0)
    found = read(write(model, {}))
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


@WRITERS
def test_any_name_is_made_one_that_solvers_read(write: Writer, read: Callable[[str], Read]) -> None:
    """Words of the formats, what looks like a number, letters beyond ASCII, names that collide."""
    model = Model("names\nEnd")
    unknowns = [
        model.variable(name, f"x_{k}", unit="1", upper=k + 1.0) for k, name in enumerate(HOSTILE)
    ]
    model.maximise(sum(unknowns))
    for k, (name, each) in enumerate(zip(HOSTILE, unknowns, strict=True)):
        model.subject_to(name if name.strip() else f"row {k}", each <= k + 0.25)
    found = read(write(model, {}, ["a remark\nSubject To"]))
    assert list(found.values.values()) == pytest.approx([k + 0.25 for k in range(len(HOSTILE))])
    assert len(set(found.values)) == len(HOSTILE)
    assert len({*found.programme.row_names_}) == len(HOSTILE)
    assert all(name.isascii() and len(name) < 200 for name in found.values)
    assert {"a_b", "a_b_2", "A_B_3", "x_infeasibility_s"} <= found.values.keys()


numbers = st.floats(-1e6, 1e6).filter(lambda x: x == 0.0 or abs(x) > 1e-6)
bounds = st.sampled_from(
    [(0.0, math.inf), (-math.inf, math.inf), (-math.inf, 0.1), (-3.0, -0.7), (1e-5, 1e5)]
)
columns = st.lists(st.tuples(numbers, bounds), min_size=1, max_size=4)
rows = st.lists(
    st.tuples(
        st.lists(numbers, min_size=4, max_size=4), st.sampled_from(["<=", ">=", "=="]), numbers
    ),
    max_size=4,
)


@given(columns, rows, numbers, st.sampled_from([to_lp, to_mps]))
def test_numbers_are_read_back_exactly(
    tmp_path_factory: pytest.TempPathFactory,
    columns: list[tuple[float, tuple[float, float]]],
    rows: list[tuple[list[float], str, float]],
    constant: float,
    write: Writer,
) -> None:
    """Every coefficient, side, bound, sense and constant that was declared."""
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
    found = Read(write(model, {}), tmp_path_factory.getbasetemp())
    programme = found.programme
    assert programme.offset_ == constant
    at = [programme.col_names_.index(f"x{k}") for k in range(len(x))]
    assert sorted(at) == list(range(programme.num_col_))
    for k, (cost, (lower, upper)) in zip(at, columns, strict=True):
        assert (programme.col_cost_[k], programme.col_lower_[k], programme.col_upper_[k]) == (
            (cost, lower, upper)
        )
    assert list(programme.row_names_) == [f"r{k}" for k in range(len(rows))]
    assert found.matrix[:, at].tolist() == [row[: len(x)] for row, _, _ in rows]
    for k, (_, sense, side) in enumerate(rows):
        assert programme.row_lower_[k] == (-math.inf if sense == "<=" else side)
        assert programme.row_upper_[k] == (math.inf if sense == ">=" else side)


@WRITERS
def test_what_cannot_hold_is_infeasible_in_the_file_as_well(
    write: Writer, read: Callable[[str], Read]
) -> None:
    """A deadline before the flight ends, and a constraint without unknowns that is violated."""
    late = optuav.load("paper").replace({"limits.deadline_s": 60})
    (part,) = optuav.formulate(
        late, "P4", building="b1", order="rest-first", perspective="battery"
    ).parts
    assert read(write(part.model, part.model.row(0))).status == INFEASIBLE
    (direct,) = optuav.formulate(late, "P3", perspective="battery").parts
    assert read(write(direct.model, direct.model.row(0))).status == INFEASIBLE
    (p1,) = optuav.formulate("paper", "P1", trajectory="direct", perspective="battery").parts
    too_far = p1.model.row(0) | {"hover_distance_m": 600.0}
    assert read(write(p1.model, too_far)).status == INFEASIBLE


@WRITERS
def test_a_constraint_without_unknowns_that_holds_is_told_but_not_written(write: Writer) -> None:
    """Its sides differ by rounding, which another solver may not forgive."""
    (p1,) = optuav.formulate("paper", "P1", trajectory="direct", perspective="battery").parts
    text = write(p1.model, p1.model.row(0))
    assert "'P1.a outage' speaks of no unknown, and holds: left out" in text
    assert "P1.a_outage" not in text


@WRITERS
def test_a_nonlinear_model_is_refused_by_the_constraint(write: Writer) -> None:
    (part,) = optuav.formulate("paper", "P3", perspective="wells").parts
    with pytest.raises(InputError, match=r"'P3\.a state of charge' is not linear: \w+ of the"):
        write(part.model, part.model.row(0))


@WRITERS
def test_several_programmes_at_once_are_refused(write: Writer) -> None:
    (part,) = optuav.formulate("paper", "P4", building="b1", perspective="battery").parts
    with pytest.raises(InputError, match=r"'P4\.a state of charge' has several"):
        write(part.model, {})


@WRITERS
@pytest.mark.parametrize("number", [math.nan, math.inf])
def test_numbers_that_are_none_are_refused(write: Writer, number: float) -> None:
    """HiGHS would drop such a row and call the rest optimal."""
    (part,) = optuav.formulate("paper", "P3", perspective="battery").parts
    with pytest.raises(InputError, match=r"'P3\.a state of charge' has a number"):
        write(part.model, part.model.row(0) | {"hover_current_A": number})


def test_lines_are_short_and_the_same_again() -> None:
    (part,) = optuav.formulate(
        "paper", "P4", building="b1", order="rest-first", perspective="battery"
    ).parts
    for write in (to_lp, to_mps):
        text = write(part.model, part.model.row(0))
        assert max(map(len, text.splitlines())) <= 80
        assert text == write(part.model, part.model.row(0))
