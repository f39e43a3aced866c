"""A program in writing: which of several routes a file holds, and that it says so."""

from __future__ import annotations

import copy
from pathlib import Path

import highspy
import pytest

import optuav
from optuav.errors import InputError, NoPlanError
from optuav.solving.question import problem_of


def optimum(text: str, path: Path) -> float:
    """What HiGHS makes of a file."""
    path.write_text(text, "utf-8")
    solver = highspy.Highs()
    solver.setOptionValue("output_flag", False)
    solver.readModel(str(path))
    solver.run()
    assert solver.getModelStatus() == highspy.HighsModelStatus.kOptimal
    return float(solver.getInfo().objective_function_value)


def test_text_and_latex_are_the_programs_own() -> None:
    program = optuav.formulate("paper", "P1", perspective="battery")
    latex = program.to_latex()
    assert latex.count(r"\text{maximise}") == len(program.parts) == 2


def test_of_several_models_each_tells_its_routes() -> None:
    """Both orders of P4 read alike otherwise; one model alone needs no such line."""
    both = optuav.formulate("paper", optuav.P4("b1"), perspective="available")
    lines = str(both).splitlines()
    assert [line for line in lines if " of 2: " in line] == [
        "1 of 2: rest first",
        "2 of 2: hover first",
    ]
    assert "% 2 of 2: hover first\n\\begin{align*}" in both.to_latex()
    every = str(optuav.formulate("paper", "P1", perspective="battery"))
    assert every.startswith("1 of 2: without a rest\nP1: ")
    assert "\n2 of 2: with a rest, 20 routes\nP1: " in every
    assert " of 1: " not in str(optuav.formulate("paper", "P3", perspective="battery"))


@pytest.mark.parametrize("form", ["lp", "mps"])
@pytest.mark.parametrize("perspective", ["battery", "energy", "adjusted"])
def test_a_file_holds_the_route_that_solve_takes(
    form: str, perspective: str, tmp_path: Path
) -> None:
    """21 routes for P1, 2 orders for P4; its optimum is that of the plan."""
    for problem, building, count in (("P1", None, 21), ("P4", "b3", 2), ("P3", None, 1)):
        program = optuav.formulate(
            "paper", problem_of(problem, building=building), perspective=perspective
        )
        plan = program.solve()
        text = program.to_file(form)
        assert optimum(text, tmp_path / f"file.{form}") == pytest.approx(
            plan.hover_time_s, rel=1e-9
        )
        assert f"route {' -> '.join(plan.route)}" in text
        said = f"the best of {count} routes, each a programme of its own"
        assert (said in text) is (count > 1)
        assert f"mission paper, perspective {perspective}" in text


@pytest.mark.parametrize("problem", ["P2", "P2-tight"])
def test_the_shortest_flight_and_rest(problem: str, tmp_path: Path) -> None:
    mission = optuav.load("paper").replace({"limits.deadline_s": 800})
    program = optuav.formulate(mission, problem, perspective="battery")
    plan = program.solve()
    shortest_s = plan.flight_time_s + plan.rest_time_s
    found = optimum(program.to_file("lp"), tmp_path / "file.lp")
    assert found == pytest.approx(shortest_s, rel=1e-9)
    if problem == "P2-tight":
        assert 800.0 - found == pytest.approx(678.69, abs=0.005)


def test_where_no_route_has_an_answer_the_shortest_flight_is_told() -> None:
    mission = optuav.load("paper").replace({"limits.deadline_s": 60})
    text = optuav.formulate(mission, "P1", perspective="battery").to_file("lp")
    assert "route origin -> hover -> destination" in text
    assert "no route has an answer; the shortest flight of 21 routes" in text


def test_what_is_not_linear_is_refused_before_anything_is_solved() -> None:
    with pytest.raises(InputError, match=r"'P1\.b state of charge' is not linear"):
        optuav.formulate("paper", "P1", perspective="wells").to_file("mps")


def test_where_nothing_flies_there_is_nothing_to_state() -> None:
    program = optuav.formulate(
        optuav.load("paper").replace({"body.mass_kg": 50}), "P1", perspective="battery"
    )
    words = "nothing can be flown: the UAV cannot fly"
    with pytest.raises(NoPlanError, match=words):
        program.to_file("lp")
    assert (len(program.parts), [*program.parts[:1]], [*program.parts]) == (0, [], [])
    with pytest.raises(NoPlanError, match=words):
        _ = program.parts[0]
    with pytest.raises(NoPlanError, match=words):
        _ = copy.deepcopy(program).parts[-1]
    with pytest.raises(NoPlanError, match=words):
        program.check({"hover_time_s": 1.0})
    assert program.to_latex().startswith(f"% {words}")


def test_an_unknown_form_is_refused() -> None:
    with pytest.raises(InputError, match="one of lp, mps, nl, gms, bar"):
        optuav.formulate("paper", "P3", perspective="battery").to_file("pdf")
