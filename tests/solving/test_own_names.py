"""A user's own problem is never taken for one of the paper's, and models are never shared."""

from dataclasses import dataclass
from typing import Any

import pytest

import optuav
from optuav.errors import InputError
from optuav.modelling import check


@dataclass(frozen=True)
class Short(optuav.P1):
    """P1 with a limit of its own."""

    def declare(self, model: Any, given: Any) -> None:
        super().declare(model, given)
        model.subject_to("cap", model.variables[0] <= 100.0, unit="s")


def own(name: str) -> Any:
    """A problem of a user that hovers without a rest, under a name."""

    def declare(self: Any, model: Any, given: Any) -> None:
        hover = model.variable("hover_time_s", "Δ", unit="s")
        model.maximise(hover)
        model.subject_to("charge", given.soc_end(hover) >= given.min_soc)
        given.keep_wells(model, "wells", hover)
        given.keep_deadline(model, "deadline", hover)

    return type(name, (optuav.Formulation,), {"declare": declare, "__doc__": "An own problem."})()


@pytest.mark.parametrize("problem", [Short(), Short(stops=2), own("P2"), own("P4")])
def test_what_is_or_is_called_one_of_the_papers_is_refused(problem: Any) -> None:
    """Searches and proofs know those by type and name, and would leave the own limits out."""
    with pytest.raises(
        InputError, match=r"problem = .*(subclass Formulation itself|a name of its own)"
    ):
        optuav.solve("paper", problem)


def test_what_is_stated_on_the_model_of_an_answer_stays_there() -> None:
    """Programmes of a kind share their declaration, which nobody gets."""
    program = optuav.formulate("paper", "P3", perspective="battery")
    before = program.solve().hover_time_s
    (answer,) = program.answers()
    answer.model.subject_to("mine", answer.model.variables[0] <= 100.0, unit="s")
    assert optuav.solve("paper", "P3", perspective="battery").hover_time_s == before


def test_what_is_stated_on_a_part_is_solved() -> None:
    """Printed, checked, compiled and solved is the same model."""
    program = optuav.formulate("paper", "P3", perspective="battery")
    model = program.parts[0].model
    model.subject_to("mine", model.variables[0] <= 100.0, unit="s")
    assert program.solve().hover_time_s == pytest.approx(100.0, abs=1e-9)
    assert program.compile().solve().values["hover_time_s"] == pytest.approx(100.0, abs=1e-9)
    assert optuav.solve("paper", "P3", perspective="battery").hover_time_s > 600.0


@pytest.mark.parametrize("perspective", ["battery", "available", "wells"])
def test_the_model_of_an_answer_has_numbers(perspective: Any) -> None:
    """It is printed, checked and solved like that of the program."""
    program = optuav.formulate(
        "paper", optuav.P4("b1", order="rest-first"), perspective=perspective
    )
    (answer,) = program.answers()
    assert str(answer.model) == str(program)
    assert check(answer.model, answer.point(0)).satisfied


def test_without_a_rest_an_own_problem_is_solved_under_taper() -> None:
    """By way of a building, where a rest of 0 s meets a current that is a symbol."""
    mission = optuav.load("paper").replace({"battery.charging": "taper"})
    plan = optuav.solve(mission, own("NoRest"))
    assert plan.hover_time_s == pytest.approx(optuav.solve(mission, "P3").hover_time_s, abs=1e-6)


def test_a_bound_above_is_no_proof_that_none_is_longer() -> None:
    """Where charging tapers, the status feasible has a proof of its own."""
    mission = optuav.load("paper").replace({"battery.charging": "taper"})
    plan = optuav.solve(mission, optuav.P1(order="rest-first"))
    assert plan.status.value == "feasible"
    assert plan.proof == "bracketed: a feasible time, and a longer one that none exceeds"
    assert any("not proved: up to" in note for note in plan.notes)


def test_symbols_of_a_free_hover_point_are_written_once() -> None:
    """What depends on the point is no parameter as well."""
    program = optuav.formulate("paper", optuav.P1(hover_point="free"), perspective="battery")
    for part in program.parts:
        symbols = [
            line.split()[0] for line in str(part.model).partition("\nwhere\n")[2].splitlines()
        ]
        assert not {"T_fl", "Q_fl", "E_fl", "I_hv"} & {*symbols}


def test_the_deadline_takes_an_expression_for_the_hover() -> None:
    """As the state of charge and the wells do: here 10 s of hover before the counted ones."""

    @dataclass(frozen=True)
    class Late(optuav.Formulation):
        """Longest hover after a start of 10 s."""

        def declare(self, model: Any, given: Any) -> None:
            hover = model.variable("hover_time_s", "Δ", unit="s")
            model.maximise(hover)
            model.subject_to("charge", given.soc_end(hover + 10.0) >= given.min_soc)
            given.keep_deadline(model, "deadline", hover + 10.0)

    late = optuav.solve("paper", Late(), perspective="battery").hover_time_s
    alone = optuav.solve("paper", "P3", perspective="battery").hover_time_s
    assert late == pytest.approx(alone - 10.0, abs=1e-9)
