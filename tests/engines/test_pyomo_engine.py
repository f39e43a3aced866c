"""Models handed to Pyomo: its solvers find what the engines of the package find, or are refused."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import highspy
import numpy as np
import pytest
from pyomo.environ import SolverFactory, TerminationCondition, value
from pyomo.opt import SolverResults

import optuav
from optuav.engines.export import to_file
from optuav.engines.pyomo_engine import Pyomo
from optuav.engines.pyomo_model import to_pyomo
from optuav.errors import InputError, SolverError
from optuav.modelling import Model, Parameter
from optuav.modelling.expression import Operand
from optuav.solving.question import PROBLEMS
from optuav.status import Status
from tests.cli.run import run
from tests.diagnosis.missions import only
from tests.engines import nl_solver

B1 = optuav.P4("b1", order="rest-first")
B9 = optuav.P4("b9", order="hover-first")


@pytest.mark.parametrize("perspective", ["battery", "adjusted"])
@pytest.mark.parametrize("name", [*PROBLEMS, "P4"])
def test_highs_agrees_on_the_problems_of_the_paper(name: str, perspective: Any) -> None:
    """On few roofs: the objective, the route and the rest, proved by the answer alone."""
    few = optuav.load("paper").replace({f"buildings.b{k}": None for k in range(3, 11)})
    problem = PROBLEMS.get(name, B1)
    ours = optuav.solve(few, problem, perspective=perspective)
    plan = optuav.solve(few, problem, perspective=perspective, engine=Pyomo())
    assert plan.route == ours.route
    assert (plan.engine, plan.status) == ("pyomo", Status.OPTIMAL)
    assert plan.hover_time_s == pytest.approx(ours.hover_time_s, abs=1e-6)
    assert plan.rest_time_s == pytest.approx(ours.rest_time_s, abs=1e-6)


def test_the_choice_of_a_route_by_branch_and_bound() -> None:
    """The MILP of `route_choice`, whose optimum SPEC states: 719.5399 s."""
    found = optuav.route_choice("paper", perspective="battery")
    assert found.model is not None
    solution = Pyomo().solve(found.model, 1)
    assert solution.objective[0] == pytest.approx(719.5399, abs=1e-4)
    assert solution.proof == "branch and bound (appsi_highs)"
    chosen = [name for name, x in solution.point(0).items() if x == 1.0]
    assert len([each for each in chosen if each.startswith("choice")]) == 1


@pytest.mark.parametrize("form", ["lp", "mps", "nl"])
def test_the_choice_of_a_route_as_a_file(form: str, tmp_path: Path) -> None:
    """HiGHS reads LP and MPS; of .nl the header counts 21 binary unknowns among the others."""
    text = optuav.route_choice("paper", perspective="battery").to_file(form)
    if form == "nl":
        assert text.splitlines()[6].split()[:2] == ["21", "0"]
        return
    path = tmp_path / f"choice.{form}"
    path.write_text(text, "utf-8")
    solver = highspy.Highs()
    solver.setOptionValue("output_flag", False)
    assert solver.readModel(str(path)) != highspy.HighsStatus.kError
    solver.run()
    assert solver.getInfo().objective_function_value == pytest.approx(719.5399, abs=1e-4)


@pytest.mark.parametrize("problem", [optuav.P1(), B9, optuav.P3()], ids=lambda each: each.name)
def test_a_file_for_ampl_holds_the_programme_through_both_wells(problem: Any) -> None:
    """CasADi reads it, its IPOPT solves it: the answer of the bracket."""
    program = optuav.formulate("paper", problem)
    text = program.to_file("nl")
    point, word = nl_solver.by_ipopt(text)
    assert word == "Solve_Succeeded"
    head = text.splitlines()[0].split("; ")
    assert head[-len(point)].endswith("is hover_time_s, Δ [s]")
    assert point[0] == pytest.approx(program.solve().hover_time_s, abs=1e-5)


@pytest.mark.parametrize(("form", "mark"), [("gms", "* "), ("bar", "// ")])
def test_files_for_gams_and_baron_say_what_their_names_are(form: str, mark: str) -> None:
    lines = optuav.formulate("paper", B9).to_file(form).splitlines()
    notes = [each.removeprefix(mark) for each in lines if each.startswith(mark)]
    assert "route origin -> hover -> b9 -> destination" in notes
    name, _, words = notes[-2].partition(" is ")
    assert words == "hover_time_s, Δ [s]"
    assert any(name in each and "exp(" in each for each in lines if not each.startswith(mark))


@pytest.mark.parametrize("form", ["lp", "mps", "nl", "gms", "bar"])
def test_a_path_is_written_in_the_form_of_its_suffix(form: str, tmp_path: Path) -> None:
    """As text, as a path, in capitals, and by the command, always the text of the form."""
    program = optuav.formulate("paper", optuav.P3(), perspective="battery")
    text = program.to_file(form)
    for path in (tmp_path / f"one.{form}", str(tmp_path / f"two.{form.upper()}")):
        assert program.to_file(path) == text
        assert Path(path).read_text("utf-8") == text
    asked = ("paper", "--problem", "P3", "--perspective", "battery", "--save")
    file = tmp_path / f"three.{form}"
    assert run("formulate", *asked, str(file)).out == f"wrote {file}\n"
    assert file.read_text("utf-8") == text.rstrip("\n") + "\n"
    choice = optuav.route_choice("paper", perspective="battery")
    assert choice.to_file(tmp_path / f"c.{form}") == (tmp_path / f"c.{form}").read_text("utf-8")


@pytest.mark.parametrize(
    ("form", "words"),
    [
        ("p.txt", r"form = 'p.txt': must be a name that ends in \.lp, \.mps, \.nl, \.gms or \.bar"),
        ("gsm", r"form = 'gsm': must be one of lp, mps, nl, gms, bar; did you mean 'gms'"),
        ("no/p.nl", "no/p.nl: there is no directory no"),
        (3, "form = 3: must be a form, or the path of a file"),
    ],
)
def test_another_form_is_refused(form: Any, words: str) -> None:
    with pytest.raises(InputError, match=words):
        optuav.formulate("paper", "P3", perspective="battery").to_file(form)


@pytest.mark.parametrize(
    ("stated", "words"),
    [
        ({"solver": 3}, "solver = 3: must be a name, such as 'appsi_highs'"),
        ({"options": 3}, "options = 3: must be values by name"),
        (
            {"options": {"nonsense": 1}},
            r"options\['nonsense'\] = 1: must be an option and a value of Hi",
        ),
        (
            {"options": {"presolve": "perhaps"}},
            r"options\['presolve'\] = 'perhaps': must be an option",
        ),
        ({"options": {"time_limit": "x"}, "solver": "highs"}, r"options\['time_limit'\] = 'x'"),
        ({"options": {"mip_rel_gap": [1]}}, r"options\['mip_rel_gap'\] = \[1\]: must be an option"),
        ({"options": {3: 1}}, r"options\[3\] = 1: must be an option and a value of HiGHS"),
    ],
)
def test_what_the_engine_does_not_take_is_refused_when_it_is_made(stated: Any, words: str) -> None:
    """Pyomo would leave such options out without a word."""
    with pytest.raises(InputError, match=words):
        Pyomo(**stated)


def test_a_solver_of_nonlinear_models_answers_through_pyomo() -> None:
    """SPEC's 597.270 s, of a local solver; and again with another deadline."""
    engine = Pyomo(nl_solver.NAME)
    plan = optuav.solve("paper", B9, engine=engine)
    assert plan.hover_time_s == pytest.approx(597.270, abs=1e-3)
    assert (plan.status, plan.flyable) == (Status.LOCALLY_OPTIMAL, True)
    assert plan.proof == "local: casadi-nl says optimal"
    compiled = optuav.formulate("paper", B9, engine=engine).compile()
    for deadline_s in (700.0, 1000.0):
        ours = optuav.solve(optuav.load("paper").replace({"limits.deadline_s": deadline_s}), B9)
        again = compiled.solve(deadline_s=deadline_s)
        assert again.objective[0] == pytest.approx(ours.hover_time_s, abs=1e-5)


def test_a_local_solver_proves_no_infeasibility() -> None:
    """Its word is not enough: the package looks for a proof of its own, and finds one here."""
    late = optuav.load("paper").replace({"limits.min_soc": 0.99})
    (part,) = optuav.formulate(late, B9).parts
    assert Pyomo(nl_solver.NAME).solve(part.model, 1).status is Status.UNKNOWN
    assert optuav.solve(late, B9, engine=Pyomo(nl_solver.NAME)).status is Status.INFEASIBLE


def test_parameters_of_the_model_can_be_changed_in_pyomo() -> None:
    """As its users do: a deadline of 900 s, solved by Pyomo without optuav."""
    model = optuav.formulate("paper", B1, perspective="battery").to_pyomo()
    model.parameters["deadline_s"] = 900.0
    SolverFactory("appsi_highs").solve(model)
    tight = optuav.load("paper").replace({"limits.deadline_s": 900.0})
    plan = optuav.solve(tight, B1, perspective="battery")
    assert value(model.objective) == pytest.approx(plan.hover_time_s, abs=1e-5)
    assert [*model.constraints] == ["P4.a state of charge", "P4.b deadline"]
    assert model.preferences[1].active is False


def of_one(limit: Operand, **bounds: Operand) -> Model:
    """max x, limit(x) ≤ 1."""
    model = Model("one unknown")
    x = model.variable("x", "x", unit="s", **bounds)
    model.maximise(x)
    model.subject_to("limit", limit(x) <= 1.0)
    return model


@pytest.mark.parametrize(
    "function",
    [
        *(np.exp, np.log, np.log10, np.sqrt, np.sin, np.cos, np.tan, np.sinh, np.cosh, np.tanh),
        *(np.arcsin, np.arccos, np.arctan, np.arcsinh, np.arctanh, np.expm1, np.log1p),
        *(np.square, np.reciprocal, np.negative, np.absolute, np.floor, np.ceil),
        *(lambda x: np.maximum(x, 0.3), lambda x: np.minimum(0.3, 2.0 * x), lambda x: 2.0**x),
    ],
)
def test_functions_have_the_values_of_numpy(function: Any) -> None:
    (constraint,) = to_pyomo(of_one(function, upper=1.0), {}).constraints.values()
    assert value(constraint.body) == pytest.approx(function(0.5))


def test_a_function_that_pyomo_lacks_is_refused() -> None:
    with pytest.raises(InputError, match="Pyomo does not know the function arctan2"):
        to_pyomo(of_one(lambda x: np.arctan2(x, 2.0), upper=1.0), {})


def test_a_charge_that_tapers_is_refused() -> None:
    """It is no function of any solver."""
    tapers = optuav.load("paper").replace({"battery.charging": "taper"})
    with pytest.raises(InputError, match="does not know the function the hover that tapers"):
        optuav.formulate(tapers, B9).to_pyomo()


def test_a_format_that_lacks_a_function_is_refused_in_words() -> None:
    """BARON knows no sinh."""
    model = of_one(np.sinh, upper=1.0)
    assert "sinh" in to_file(model, {}, "gms")
    with pytest.raises(InputError, match=r"pyomo with its \.bar writer failed: .*sinh"):
        to_file(model, {}, "bar")


def test_digits_that_pyomo_would_lose_are_refused() -> None:
    """Without a flow between the wells k' is next to nothing, and exp(−k'Δ) − 1 is 0."""
    still = optuav.load("paper").replace({"battery.flow_rate_per_s": 0.0})
    with pytest.raises(InputError, match=r"exp\(x\) − 1 leaves no digits of a tiny x"):
        optuav.formulate(still, B9).to_file("nl")


def test_what_no_solver_need_see_is_not_handed_over() -> None:
    late = optuav.formulate(optuav.load("paper").replace({"limits.deadline_s": 60}), "P3")
    with pytest.raises(InputError, match="nothing to hand over: bounds of an unknown contradict"):
        late.to_pyomo()
    assert late.question.engine == "auto"
    found = Pyomo().solve(of_one(lambda x: x, upper=-1.0), 1)
    assert found.status is Status.INFEASIBLE


def test_two_quantities_of_one_name_stay_two() -> None:
    """Wells that are kept for two pairs of times have steps of the same names."""

    class Twice(optuav.Formulation):
        """Longest hover, its wells kept for a longer one too."""

        def declare(self, model: Any, given: Any) -> None:
            hover, rest = given.hover_and_rest(model)
            model.maximise(hover)
            given.keep_wells(model, "longer", hover + 10.0, rest)
            given.keep_wells(model, "as flown", hover, rest)
            given.keep_deadline(model, "deadline", hover, rest)

    own = Twice(building="b9", order="hover-first")
    ours = optuav.solve("paper", own, engine="casadi").hover_time_s
    plan = optuav.solve("paper", own, engine=Pyomo(nl_solver.NAME))
    assert plan.hover_time_s == pytest.approx(ours, abs=1e-5)


def test_linear_solvers_refuse_the_wells() -> None:
    with pytest.raises(
        InputError, match="pyomo does not accept this model: it accepts only linear"
    ):
        optuav.solve("paper", B9, engine=Pyomo())


@pytest.mark.parametrize("name", ["nonsense", "ipopt_that_is_not_here", ""])
def test_a_solver_that_is_missing_is_named(name: str) -> None:
    with pytest.raises(
        InputError, match=r"solver = '.*': must be a solver that Pyomo finds; optuav\[py"
    ):
        optuav.solve("paper", B1, engine=Pyomo(name), perspective="battery")


def test_without_pyomo_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyomo", None)
    monkeypatch.setitem(sys.modules, "pyomo.environ", None)
    program = optuav.formulate("paper", B1, perspective="battery", engine=Pyomo())
    for ask in (program.to_pyomo, lambda: program.to_file("nl"), program.solve):
        with pytest.raises(InputError, match=r'pip install "\.\[pyomo\]"'):
            ask()
    assert program.to_file("lp")


class Liar:
    """A solver that takes any point for the best."""

    at_s = 0.0

    def __init__(self, **_: Any) -> None:
        self.options: dict[str, Any] = {}

    def available(self, exception_flag: bool = True) -> bool:
        return True

    def solve(self, model: Any, **_: Any) -> SolverResults:
        results = SolverResults()
        results.solver.termination_condition = self.said
        model.unknowns["hover_time_s"].value = self.at_s
        return results

    said = TerminationCondition.optimal


@pytest.fixture
def liar(monkeypatch: pytest.MonkeyPatch) -> Iterator[type[Liar]]:
    """The solver under its name, whose values are those that the model has."""
    from pyomo.core.base.PyomoModel import ModelSolutions

    monkeypatch.setattr(ModelSolutions, "load_from", lambda *_: None)
    SolverFactory.register("liar")(Liar)
    yield Liar
    SolverFactory.unregister("liar")


def test_a_claim_is_evaluated_again(liar: type[Liar], monkeypatch: pytest.MonkeyPatch) -> None:
    """(P3) hovers 688.848 s: 100 s are called feasible, and 700 s are no answer."""
    monkeypatch.setattr(liar, "at_s", 100.0)
    plan = optuav.solve("paper", "P3", perspective="battery", engine=Pyomo("liar"))
    assert (plan.status, plan.proof) == (Status.FEASIBLE, "liar says optimal")
    monkeypatch.setattr(liar, "at_s", 700.0)
    with pytest.raises(SolverError, match=r"pyomo returned a point that violates P3\.a state"):
        optuav.solve("paper", "P3", perspective="battery", engine=Pyomo("liar"))


@pytest.mark.parametrize(
    ("said", "words"),
    [
        (TerminationCondition.maxTimeLimit, "pyomo with liar did not finish within the time"),
        (TerminationCondition.solverFailure, "pyomo found neither a plan nor proof .* solverFa"),
    ],
)
def test_an_end_without_an_answer_is_an_error(
    liar: type[Liar], monkeypatch: pytest.MonkeyPatch, said: TerminationCondition, words: str
) -> None:
    monkeypatch.setattr(liar, "said", said)
    with pytest.raises(SolverError, match=words):
        optuav.solve("paper", "P3", perspective="battery", engine=Pyomo("liar"), time_limit_s=1)


def test_options_reach_the_solver() -> None:
    """Without a step, IPOPT has no answer."""
    stopped = Pyomo(nl_solver.NAME, options={"ipopt.max_iter": 0})
    with pytest.raises(SolverError, match="pyomo found neither a plan nor proof"):
        optuav.solve("paper", B9, engine=stopped)


def test_an_explanation_takes_the_engine(monkeypatch: pytest.MonkeyPatch) -> None:
    """Repairs stack programmes by their question, and so by its engine and its options."""
    only(monkeypatch, "limits")
    late = optuav.load("paper").replace({"limits.deadline_s": 95.0, "limits.min_soc": 0.88})
    engine = Pyomo(options={"presolve": "on"})
    explained = optuav.explain(late, B1, perspective="battery", engine=engine)
    assert explained.plan.status is Status.INFEASIBLE
    assert explained.repairs


def test_programmes_of_one_model() -> None:
    """Two limits at once, changed after the model was handed over."""
    limit = Parameter("limit", "p", "s", np.array([3.0, 4.0]))
    model = Model("two programmes")
    x = model.variable("x", "x", unit="s")
    model.maximise(x)
    model.subject_to("limit", 2.0 * x <= limit)
    compiled = Pyomo().compile(model, 2)
    assert compiled({}).objective == pytest.approx([1.5, 2.0])
    assert compiled({"limit": np.array([8.0, 1.0])}).objective == pytest.approx([4.0, 0.5])
