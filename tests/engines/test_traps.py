"""Where the libraries below would say something wrong: one clear error or status instead."""

from __future__ import annotations

import math
import sys
import time
from typing import Any

import casadi
import highspy
import numpy as np
import pytest

import optuav
from formulations.formulation import Formulation, Given
from formulations.p3 import P3
from formulations.p4 import P4
from optuav.cli import main
from optuav.engines import casadi_engine, cvxpy_engine
from optuav.engines.casadi_engine import Casadi, CasadiProgramme
from optuav.engines.cvxpy_engine import Cvxpy, CvxpyProgramme
from optuav.engines.registry import ENGINES
from optuav.engines.registry import engine as engine_of
from optuav.errors import InputError, SolverError
from optuav.modelling import Model
from optuav.solving import formulate, solve
from optuav.solving.question import problem_of
from optuav.status import Status
from tests.engines.conformance import p3, p4
from tests.engines.optimality import solved
from tests.formulations.given import quantities

CONTINUOUS = [name for name in ENGINES if engine_of(name).slots is not None]
LINEAR = ("--perspective", "battery")
DIRECT_S = 688.848
"""Δ of the direct flight of the mission ``paper``, bound by charge."""


def slot_s(engine: str) -> float | None:
    """Slots for the engine that takes nothing else."""
    return 1.0 if engine == "grid" else None


def test_highs_itself_drops_a_row_without_a_number() -> None:
    """The trap: max x with x ≤ NaN and x ≤ 10 is "optimal" at 10."""
    highs = highspy.Highs()
    highs.silent()
    highs.addVars(1, np.zeros(1), np.array([10.0]))
    highs.changeColsCost(1, np.array([0], np.int32), np.array([-1.0]))
    highs.addRow(-highspy.kHighsInf, math.nan, 1, np.array([0], np.int32), np.array([1.0]))
    highs.run()
    assert highs.getModelStatus() == highspy.HighsModelStatus.kOptimal
    assert highs.getSolution().col_value[0] == 10.0


@pytest.mark.parametrize("name", ["deadline_s", "min_soc", "hover_current_A", "rest_current_A"])
@pytest.mark.parametrize("engine", ENGINES)
def test_missing_number_is_an_error(engine: str, name: str) -> None:
    """NaN in any place of a programme: status error, and no values to travel on."""
    found = solved(
        engine, P4("b1").model(quantities(**{name: math.nan}), "battery"), slot_s(engine)
    )
    assert found.status is Status.ERROR
    assert np.isnan([found.objective[0], *(values[0] for values in found.values.values())]).all()
    with pytest.raises(SolverError, match="error"):
        found.point(0)


@pytest.mark.parametrize("engine", ENGINES)
def test_missing_number_spoils_its_own_programme_only(engine: str) -> None:
    """Of three itineraries the middle one has no flight time."""
    given = quantities(flight_time_s=np.array([50.0, math.nan, 60.0]))
    found = solved(engine, P4("b1").model(given, "battery"), slot_s(engine), programmes=3)
    assert [status.has_answer for status in found.statuses] == [True, False, True]
    assert found.statuses[1] is Status.ERROR


@pytest.mark.parametrize("engine", ENGINES)
def test_mission_with_a_missing_number_is_no_plan(
    engine: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An error of the engine, exit code 3; not a plan of the other itineraries."""
    module = sys.modules["optuav.solving.route_models"]
    honest = module.quantities

    def spoilt(*arguments: Any, **options: Any) -> Any:
        found = honest(*arguments, **options)
        current_A = np.array(found.rest_current_A)
        current_A[0] = math.nan
        object.__setattr__(found, "rest_current_A", current_A)
        return found

    monkeypatch.setattr(module, "quantities", spoilt)
    with pytest.raises(SolverError, match="numbers that it cannot use"):
        solve("paper", optuav.P4("b1"), engine=engine, perspective="battery")
    with pytest.raises(SystemExit) as exit_code:
        main(["solve", "paper", *LINEAR, "--problem", "P4", "--building", "b1", "--engine", engine])
    assert exit_code.value.code == 3


def test_ipopt_itself_relaxes_bounds() -> None:
    """The trap: with its own options it goes 1e-8 of a bound beyond it."""
    x = casadi.SX.sym("x")
    options = {"print_time": False, "ipopt.print_level": 0, "ipopt.sb": "yes"}
    ipopt = casadi.nlpsol("trap", "ipopt", {"x": x, "f": -x}, options)
    assert float(ipopt(x0=1.0, lbx=0.0, ubx=800.0)["x"]) > 800.0


@pytest.mark.parametrize("deadline_s", [800.0, 1200.0])
@pytest.mark.parametrize("order", ["rest-first", "hover-first"])
def test_ipopt_keeps_every_constraint_here(order: str, deadline_s: float) -> None:
    """Charge and deadline recomputed by hand, to a relative 1e-9; and little is given away."""
    problem = problem_of("P4", building="b1", order=order)
    (linear_part,) = formulate("paper", problem, perspective="battery").parts
    (wells,) = formulate("paper", problem, perspective="wells").parts
    found = CasadiProgramme(wells.model).solve({"deadline_s": deadline_s})
    hover_s, rest_s = found.point(0).values()
    given = linear_part.model.row(0)
    battery_As = given["packs"] * given["capacity_As"]
    drawn_As = given["flight_charge_As"] + given["hover_current_A"] * hover_s
    drawn_As -= given["rest_current_A"] * rest_s
    allowed_As = (1.0 - given["min_soc"]) * battery_As
    left_s = deadline_s - given["flight_time_s"]
    assert hover_s + rest_s <= left_s * (1.0 + 1e-9)
    assert drawn_As <= allowed_As + 1e-9 * battery_As
    assert min(left_s - hover_s - rest_s, (allowed_As - drawn_As) / 100.0) < 1e-4


def test_point_that_ipopt_calls_solved_is_evaluated_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """Beyond the charge by half a second of hover: no answer, whatever it says."""
    compiled = CasadiProgramme(p4())
    honest = casadi_engine.run

    def beyond(programme: Any, arguments: Any) -> Any:
        answer, word = honest(programme, arguments)
        return {**answer, "x": answer["x"] * (1.0 + 5e-3)}, word

    monkeypatch.setattr(casadi_engine, "run", beyond)
    assert compiled.solve({}).status is Status.UNKNOWN


@pytest.mark.parametrize("engine", CONTINUOUS)
def test_infeasible_is_said_with_its_proof(engine: str) -> None:
    """Global where a theorem says so, local where IPOPT found no way in."""
    # 100 − 5 T' ≤ −700 needs T' ≥ 160, and 150 s are left.
    found = solved(engine, p4(C=-700.0))
    assert found.status is Status.INFEASIBLE
    assert ("local" in found.proof) == (engine == "casadi")


@pytest.mark.parametrize("engine", CONTINUOUS)
def test_nearly_infeasible_is_decided_right(engine: str) -> None:
    """A hair of charge on either side of the last plan: 1e-5 of what the flight draws."""
    # Resting all 150 s brings 750: feasible from C = 100 − 750.
    assert solved(engine, p4(C=-650.0 + 1e-3)).status.has_answer
    assert solved(engine, p4(C=-650.0 - 1e-3)).status is Status.INFEASIBLE


@pytest.mark.parametrize("perspective", ["battery", "adjusted"])
@pytest.mark.parametrize("solver", ["OSQP", "SCS", "CLARABEL", "SCIPY"])
def test_first_order_solvers_are_accurate_or_refused(solver: str, perspective: str) -> None:
    """OSQP at its own tolerance is tenths of a second off and says optimal."""
    few = optuav.load("paper").replace({f"buildings.b{k}": None for k in range(2, 10)})
    exactly = solve(few, perspective=perspective)
    try:
        plan = solve(few, perspective=perspective, engine=Cvxpy(solver))
    except SolverError:
        return
    assert plan.hover_time_s == pytest.approx(exactly.hover_time_s, abs=1e-4)


def test_coarse_answer_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """Asked for less, OSQP says optimal a good part of a second off: the gap tells."""
    monkeypatch.setattr(cvxpy_engine, "SETTINGS", {"OSQP": {"eps_abs": 1e-4, "polishing": False}})
    with pytest.raises(SolverError, match="OSQP says optimal, but its answer"):
        Cvxpy("OSQP").solve(p4(), 1)


def test_solvers_keep_off_the_screen(capfd: pytest.CaptureFixture[str]) -> None:
    """OSQP remarks on polishing, HiGHS on its licence: standard output is the plan's alone."""
    for solver in ("HIGHS", "OSQP", "SCS", "CLARABEL", "SCIPY"):
        Cvxpy(solver).solve(p4(), 1)
    Cvxpy().solve(p4(), 1, slot_s=1.0)
    Casadi().solve(p4(), 1)
    assert capfd.readouterr() == ("", "")


class Curved(Formulation):
    """Longest hover with a logarithm."""

    def declare(self, model: Model, given: Given) -> None:
        """State an upper bound through a NumPy function."""
        hover = model.variable("hover_time_s", "Δ", unit="s", upper=given.time_left)
        model.maximise(hover)
        model.subject_to("limit", np.log1p(hover) <= 5.0)


@pytest.mark.parametrize("engine", ["cvxpy", "closed-form"])
def test_function_that_an_engine_cannot_take_is_named(engine: str) -> None:
    """CVXPY raises on np.log1p of its own symbols; the constraint and other engines are named."""
    with pytest.raises(InputError, match=f"engine {engine} .*'limit' is not: log1p.*casadi, grid"):
        solve("paper", Curved(), engine=engine, perspective="battery")
    assert solve(
        "paper", Curved(), engine="casadi", perspective="battery"
    ).hover_time_s == pytest.approx(math.exp(5.0) - 1)


def test_missing_solver_names_the_installed_ones(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(
        InputError, match=r"'GUROBO': must be one of CVXPY's solvers that are installed: .*HIGHS"
    ):
        solve("paper", engine=Cvxpy("GUROBO"), perspective="battery")
    with pytest.raises(SystemExit) as exit_code:
        main(["solve", "paper", *LINEAR, "--engine", "cvxpy", "--solver", "GUROBO"])
    assert exit_code.value.code == 2
    assert "GUROBO" in capsys.readouterr().err


@pytest.mark.parametrize("solver", [5, 0, "", False, ["highs"], [], b"HIGHS"])
def test_what_is_no_name_is_no_solver(solver: Any) -> None:
    """Refused like a wrong name; None alone stands for our choice."""
    with pytest.raises(
        InputError, match=r"one of CVXPY's solvers that are installed: .*HIGHS"
    ) as refused:
        solve("paper", "P3", engine=Cvxpy(solver), perspective="battery")
    assert repr(solver).replace("False", "false") in str(refused.value)


@pytest.mark.parametrize("name", ["HiGHS", "highs"])
def test_a_solver_is_known_by_its_name_in_any_case(name: str) -> None:
    """What follows from the name does not depend on it: settings, limits, what the proof says."""
    asked = {"slot_s": 60.0, "perspective": "battery", "time_limit_s": 60.0}
    plan = solve("paper", "P3", engine=Cvxpy(name), **asked)  # type: ignore[arg-type]
    assert plan == solve("paper", "P3", engine=Cvxpy("HIGHS"), **asked)  # type: ignore[arg-type]
    assert plan.proof == "branch and bound (HIGHS)"
    with pytest.raises(
        InputError, match=r"'gurobo': must be one of CVXPY's solvers that are installed: .*HIGHS"
    ):
        solve("paper", engine=Cvxpy("gurobo"), perspective="battery")


def test_solver_without_a_time_limit_is_refused() -> None:
    """Silently without a limit would be worse."""
    with pytest.raises(InputError, match="SCIPY accepts no time limit"):
        solve("paper", engine=Cvxpy("SCIPY"), time_limit_s=1.0, perspective="battery")


@pytest.mark.parametrize(
    "options",
    [
        pytest.param(["--engine", "cvxpy"], id="cvxpy"),
        pytest.param(["--engine", "cvxpy", "--slot-s", "1"], id="cvxpy in slots"),
        pytest.param(["--engine", "casadi"], id="casadi"),
        pytest.param(["--engine", "grid"], id="grid"),
    ],
)
def test_passed_time_limit_is_exit_code_3(
    options: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    """No plan is shown, proved or not."""
    with pytest.raises(SystemExit) as exit_code:
        main(["solve", "paper", *LINEAR, "--time-limit-s", "1e-9", *options])
    assert exit_code.value.code == 3
    shown = capsys.readouterr()
    assert shown.out == ""
    assert "limit" in shown.err


def test_time_limit_holds_within_a_run_of_ipopt(monkeypatch: pytest.MonkeyPatch) -> None:
    """Not only between two starts: here is one, and our own clock stands still."""
    compiled = CasadiProgramme(p4(), time_limit_s=1e-9)
    monkeypatch.setattr(time, "monotonic", lambda: 0.0)
    monkeypatch.setattr(casadi_engine, "MOST_STARTS", 1)
    with pytest.raises(SolverError, match="within the time limit"):
        compiled.solve({})


@pytest.mark.parametrize("engine", ENGINES)
def test_generous_time_limit_changes_nothing(engine: str) -> None:
    found = solve("paper", "P3", engine=engine, time_limit_s=60.0, perspective="battery")
    assert found.hover_time_s == pytest.approx(DIRECT_S, abs=1.0 if engine == "grid" else 1e-3)


class Endless(Formulation):
    """Longest hover with nothing against it."""

    def declare(self, model: Model, given: Given) -> None:
        """State no limit."""
        model.maximise(model.variable("hover_time_s", "Δ", unit="s"))


def test_bracket_needs_bounded_times() -> None:
    """It sweeps from the longest time that there can be, and says so where there is none."""
    with pytest.raises(InputError, match="needs a linear constraint that bounds hover_time_s"):
        solve("paper", Endless(), engine="bracket", perspective="battery")


@pytest.mark.parametrize("engine", [name for name in CONTINUOUS if name != "bracket"])
def test_unbounded_programme_is_said_to_be(engine: str) -> None:
    """No plan with an endless hover; the status goes through to the plan."""
    plan = solve("paper", Endless(), engine=engine, perspective="battery")
    assert plan.status is Status.UNBOUNDED
    assert not plan.phases
    assert any("finite" in reason for reason in plan.reasons)


def test_slots_without_an_end_are_refused() -> None:
    with pytest.raises(InputError, match="an upper bound on Δ"):
        solve("paper", Endless(), engine="grid", perspective="battery")


@pytest.mark.parametrize("failure", ["SolverError", "ValueError"])
def test_failure_inside_cvxpy_is_exit_code_3(
    failure: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Whatever the library raises in numerical trouble."""
    import cvxpy

    kind = cvxpy.error.SolverError if failure == "SolverError" else ValueError

    def fail(*arguments: Any, **options: Any) -> None:
        raise kind("numerical trouble")

    monkeypatch.setattr(cvxpy.Problem, "solve", fail)
    with pytest.raises(SystemExit) as exit_code:
        main(["solve", "paper", *LINEAR, "--engine", "cvxpy"])
    assert exit_code.value.code == 3
    assert "cvxpy with HIGHS failed: numerical trouble" in capsys.readouterr().err


@pytest.mark.parametrize("engine", ["cvxpy", "casadi"])
def test_missing_library_is_exit_code_3(
    engine: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Not a traceback: the package that is to be installed is named."""
    monkeypatch.setitem(sys.modules, engine, None)
    with pytest.raises(SystemExit) as exit_code:
        main(["solve", "paper", "--engine", engine, "--perspective", "battery"])
    assert exit_code.value.code == 3
    assert f"engine {engine} needs the package {engine}" in capsys.readouterr().err


def test_missing_ipopt_is_exit_code_3(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """CasADi says so by a bare RuntimeError."""

    def fail(*arguments: Any) -> None:
        raise RuntimeError("Plugin 'ipopt' is not found")

    monkeypatch.setattr(casadi, "nlpsol", fail)
    with pytest.raises(SystemExit) as exit_code:
        main(["solve", "paper", "--engine", "casadi", "--perspective", "battery"])
    assert exit_code.value.code == 3
    assert "casadi failed: Plugin 'ipopt' is not found" in capsys.readouterr().err


def test_failure_inside_ipopt_is_a_solver_error(monkeypatch: pytest.MonkeyPatch) -> None:
    """At any of its calls, with what the library itself said."""
    compiled = CasadiProgramme(p4())

    def fail(**arguments: Any) -> None:
        raise RuntimeError("numerical trouble")

    functions = compiled._functions._replace(programmes=[fail])
    monkeypatch.setattr(compiled, "_functions", functions)
    with pytest.raises(SolverError, match="casadi failed: numerical trouble"):
        compiled.solve({})


def say(monkeypatch: pytest.MonkeyPatch, words: list[str]) -> None:
    """Let CVXPY's status be these words in turn, and then what it is."""
    import cvxpy

    honest = cvxpy.Problem.status.fget
    left = iter(words)

    def status(problem: Any) -> Any:
        return next(left, None) or honest(problem)

    monkeypatch.setattr(cvxpy.Problem, "status", property(status))


@pytest.mark.parametrize(
    ("said", "refusal"),
    [
        ("infeasible_inaccurate", "not sure: infeasible_inaccurate"),
        ("unbounded_inaccurate", "not sure: unbounded_inaccurate"),
        ("user_limit", "limit of time or steps"),
    ],
)
def test_half_a_verdict_is_refused(
    said: str, refusal: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Words that leave it open are neither infeasible nor unbounded."""
    compiled = CvxpyProgramme(P3().model(quantities(), "battery"))
    say(monkeypatch, [said] * 9)
    with pytest.raises(SolverError, match=refusal):
        compiled.solve({})


@pytest.mark.parametrize(("C", "status"), [(900.0, Status.UNBOUNDED), (99.0, Status.INFEASIBLE)])
def test_infeasible_or_unbounded_is_followed_up(
    C: float, status: Status, monkeypatch: pytest.MonkeyPatch
) -> None:
    """HiGHS's presolve may leave it at that: without an objective the programme has an answer."""
    compiled = CvxpyProgramme(p3(C=C))
    say(monkeypatch, ["infeasible_or_unbounded"])
    found = compiled.solve({})
    assert (found.status, found.words) == (status, ["infeasible_or_unbounded"])


class Unfit:
    """No engine: it has none of their methods."""

    name = "unfit"


NO_ENGINE = "engine = .*: must be a name, or an instance of a subclass of Engine with a name"


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (Unfit(), NO_ENGINE),
        (optuav.Grid, r"engine = .*: must be an instance, such as Grid\(\), not the class"),
        (3, NO_ENGINE),
    ],
)
def test_what_is_no_engine_is_refused_in_words(given: Any, words: str) -> None:
    """A class instead of its object, or an object that states nothing."""
    with pytest.raises(optuav.InputError, match=words):
        optuav.solve("paper", engine=given)
    with pytest.raises(optuav.InputError, match=rf"{words}|must be .* an engine \(an instance"):
        optuav.register(given)


def test_an_engine_that_was_not_added_cannot_be_taken_out() -> None:
    with pytest.raises(
        optuav.InputError, match="name = 'zzz': must be one that was registered: none"
    ):
        optuav.unregister("zzz")
