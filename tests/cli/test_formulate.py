"""``optuav formulate``: mathematics on the screen, programmes in files."""

from __future__ import annotations

import re
from pathlib import Path

import highspy
import pytest

import optuav
from tests.cli.run import refused, run, widest


def test_text_is_the_printed_program() -> None:
    found = run(
        "formulate", "paper", "--perspective", "battery", "--problem", "P4", "--building", "b1"
    )
    assert found.code == 0
    assert found.out.rstrip() == str(
        optuav.formulate("paper", optuav.P4("b1"), perspective="battery")
    )
    assert "P4.b deadline" in found.out


def test_latex() -> None:
    found = run("formulate", "paper", "--problem", "P3", "--perspective", "energy", "--latex")
    assert found.code == 0
    assert found.out.startswith(r"\begin{align*}")
    assert r"\eta" in found.out


@pytest.mark.parametrize("form", ["lp", "mps"])
def test_a_saved_file_is_read_to_the_same_optimum(form: str, tmp_path: Path) -> None:
    path = tmp_path / f"p4.{form}"
    asked = (
        "formulate",
        "paper",
        "--perspective",
        "battery",
        "--problem",
        "P4",
        "--building",
        "b1",
        f"--{form}",
    )
    assert run(*asked, "--save", str(path)).out == f"wrote {path}\n"
    assert path.read_text("utf-8") == run(*asked).out
    solver = highspy.Highs()
    solver.setOptionValue("output_flag", False)
    solver.readModel(str(path))
    solver.run()
    assert solver.getInfo().objective_function_value == pytest.approx(719.5399, abs=1e-4)


def test_settings_and_options_reach_the_programme() -> None:
    found = run(
        *(
            "formulate",
            "paper",
            "--perspective",
            "battery",
            "--problem",
            "P3",
            "--set",
            "limits.deadline_s=800",
        ),
        *("--set", "limits.min_soc=0.2", "--lp"),
    )
    assert "<= 724.2077" in found.out
    plan = optuav.solve(
        optuav.load("paper").replace({"limits.deadline_s": 800, "limits.min_soc": 0.2}),
        "P3",
        perspective="battery",
    )
    slope, side = re.findall(r"-[ \d.]+\d", found.out.partition("P3.a_state_of_charge")[2])[:2]
    hover_s = float(side) / float(slope.replace(" ", ""))
    assert hover_s == pytest.approx(plan.hover_time_s, rel=1e-9)


def test_a_free_hover_point_and_slots_are_asked_for_as_of_solve() -> None:
    """The page of the same program in Python; slots say how the times are counted."""
    asked = ("formulate", "paper", "--perspective", "battery")
    found = run(*asked, "--hover-point", "free")
    program = optuav.formulate("paper", optuav.P1(hover_point="free"), perspective="battery")
    assert found.out.rstrip() == str(program)
    assert "z_w ∈ (−∞, ∞) m" in found.out
    found = run(*asked, "--slot-s", "5", "--problem", "P4", "--building", "b1")
    assert found.out.startswith("in whole slots of 5 s, Δ ≥ 5 s, T' ≥ 5 s\nP4: ")
    both = run(*asked, "--slot-s", "5", "--trajectory", "traj1", "--latex").out.splitlines()
    assert [line for line in both if line.startswith("%")] == [
        "% 1 of 2: without a rest, 2 routes",
        "% in whole slots of 5 s, the last of Δ cut short by its bound",
        "% 2 of 2: with a rest, 2 routes",
        "% in whole slots of 5 s, Δ ≥ 5 s, T' ≥ 5 s",
    ]


def test_where_the_deadline_is_tight_no_slot_is_said_to_be_cut_short() -> None:
    """1124.21 s of hover are no whole slots of 5 s, and no engine takes the last for less."""
    asked = ("paper", "--problem", "P2-tight", "--slot-s", "5", "--perspective", "battery")
    found = run("formulate", *asked)
    assert "P2.d deadline tight    Δ = T_max − T_fl\n" in found.out
    assert found.out.splitlines()[1] == "in whole slots of 5 s"
    answer = run("solve", *asked)
    assert answer.code == 1
    assert "exactly 1124.21 s are asked for" in answer.out


@pytest.mark.parametrize("written", ["1234.5678912", "10000000", "0.001"])
def test_slots_are_written_out(written: str) -> None:
    """With all their digits, and no power of ten, by what declares and by what answers."""
    asked = ("paper", "--problem", "P4", "--building", "b1", "--slot-s", written)
    lines = run("formulate", *asked, "--perspective", "battery").out.splitlines()
    assert lines[0] == f"in whole slots of {written} s, Δ ≥ {written} s, T' ≥ {written} s"
    answer = run("solve", *asked, "--perspective", "battery", "--engine", "cvxpy")
    assert f"slots of {written} s" in " ".join(answer.out.split())


def test_what_cannot_fly_is_an_honest_no() -> None:
    for option in ([], ["--lp"], ["--latex"]):
        found = run(
            "formulate", "paper", "--perspective", "battery", "--set", "body.mass_kg=50", *option
        )
        assert found.code == 1
        assert found.out.startswith("nothing can be flown: the UAV cannot fly")
        assert widest(found.out) <= 80


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--lp", "--mps"), "--lp, --mps: must be one of --latex, --lp, --mps"),
        (("--problem", "P4"), "problem P4 needs the name of a building"),
        (("--problem", "P3", "--building", "b1"), "problem P3 takes no building"),
        (("--perspective", "wells", "--lp"), "'P1.b state of charge' is not linear"),
        (
            ("--slot-s", "5", "--mps"),
            "--slot-s = 5.0: files and models for other solvers hold",
        ),
        (("--slot-s", "0"), "--slot-s = 0.0: must be a number, 0.001 <= x"),
        (("--hover-point", "free", "--lp"), "'P1.a outage' is not linear"),
        (("--hover-point", "here"), "--hover-point = 'here': must be one of w_U, free"),
        (("--save", "no/such/folder/x.lp", "--lp"), "there is no directory"),
        (("--set", "limits.min_soc=7"), "limits.min_soc = 7"),
    ],
)
def test_bad_input_is_refused_in_words(arguments: tuple[str, ...], words: str) -> None:
    assert words in refused("formulate", "paper", "--perspective", "battery", *arguments)


@pytest.mark.parametrize(
    ("setting", "code"), [("limits.deadline_s=60", 0), ("body.mass_kg=9", 1), ("link.gamma=1", 2)]
)
def test_the_exit_code_says_whether_there_is_a_model(setting: str, code: int) -> None:
    """A deadline shorter than any flight leaves a model, whose answer `solve` gives with code 1."""
    assert run("formulate", "paper", "--problem", "P3", "--set", setting).code == code
    assert run("solve", "paper", "--problem", "P3", "--set", setting).code == (code or 1)
