"""Which engine answers which question, found from the model itself."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from formulations.formulation import Formulation, Given
from optuav.engines.dispatch import need
from optuav.engines.registry import ENGINES, takers
from optuav.engines.registry import engine as engine_of
from optuav.errors import InputError
from optuav.mission import load
from optuav.modelling import Model
from optuav.modelling.classify import Traits, traits
from optuav.solving import formulate, solve


def chosen(problem: Any, **asked: Any) -> str:
    return solve("paper", problem, **{"perspective": "battery", **asked}).engine


class Kinked(Formulation):
    """Longest hover, cut off."""

    def declare(self, model: Model, given: Given) -> None:
        """State a kink."""
        hover = model.variable("hover_time_s", "Δ", unit="s", upper=given.time_left)
        model.maximise(np.minimum(hover, 100.0) - 0.01 * hover)


class Binary(Formulation):
    """Longest hover, on or off."""

    def declare(self, model: Model, given: Given) -> None:
        """State a choice."""
        hover = model.variable("hover_time_s", "Δ", unit="s", upper=given.time_left)
        on = model.variable("on", "z", unit="1", upper=1.0, binary=True)
        model.maximise(hover)
        model.subject_to("on", hover <= 100.0 * on)


class Free(Formulation):
    """Longest hover, the unknown from below."""

    def declare(self, model: Model, given: Given) -> None:
        """State an unknown without a lower bound."""
        hover = model.variable("hover_time_s", "Δ", unit="s", lower=-np.inf, upper=100.0)
        model.maximise(hover)


@pytest.mark.parametrize(
    ("problem", "asked", "engine"),
    [
        ("P1", {}, "closed-form"),
        ("P1", {"slot_s": 60.0}, "grid"),
        ("P3", {"perspective": "wells"}, "bracket"),
        ("P3", {"perspective": "wells", "slot_s": 60.0}, "grid"),
        (Kinked(), {"engine": "grid"}, "grid"),
        (Binary(), {}, "cvxpy"),
        (Binary(), {"slot_s": 60.0}, "cvxpy"),
        (Free(), {}, "cvxpy"),
    ],
)
def test_auto_takes_the_first_that_takes_the_model(
    problem: Any, asked: dict[str, Any], engine: str
) -> None:
    """And the grid for slots, where it can."""
    assert chosen(problem, **asked) == engine


def test_model_that_no_engine_takes() -> None:
    """A kink in continuous times; the refusal says what the model is, and what would help."""
    with pytest.raises(InputError, match=r"model \(not smooth, 1 unknown\) in .*: set slot_s for"):
        solve("paper", Kinked(), perspective="battery")


@pytest.mark.parametrize(
    ("problem", "asked", "why"),
    [
        (Kinked(), {"engine": "casadi"}, "it needs derivatives; minimum has kinks, or none"),
        (
            Kinked(),
            {"engine": "cvxpy"},
            "'objective' is not: minimum of the unknowns is not linear",
        ),
        (Binary(), {"engine": "casadi"}, "it does not support binary unknowns"),
        (Binary(), {"engine": "closed-form"}, "it does not support binary unknowns"),
        (Free(), {"engine": "closed-form"}, "it needs a lower bound on Δ"),
        (Free(), {"engine": "grid"}, "it needs a lower bound on Δ"),
        ("P1", {"engine": "closed-form", "slot_s": 1.0}, "it accepts only continuous times"),
        ("P1", {"engine": "casadi", "slot_s": 1.0}, "it accepts only continuous times"),
    ],
)
def test_impossible_pairs_are_refused_with_the_reason(
    problem: Any, asked: dict[str, Any], why: str
) -> None:
    """And with the names of those that would do."""
    with pytest.raises(InputError, match=why) as refusal:
        solve("paper", problem, **{"perspective": "battery", **asked})
    said = str(refusal.value).rpartition("Engines that do: ")[2]
    model = formulate("paper", problem, perspective="battery").parts[0].model
    slots = "slot_s" in asked or asked["engine"] == "grid"
    assert said == (", ".join(takers(traits(model), slots)) or "none")


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("slots", [False, True])
@pytest.mark.parametrize(
    "model",
    [
        Traits(2),
        Traits(3),
        Traits(2, integer=True),
        Traits(2, nonlinear=("a", "curved")),
        Traits(2, rough="sign", nonlinear=("a", "curved")),
        Traits(1, open_below=("x",)),
    ],
    ids=str,
)
def test_table_and_refusals_agree(model: Traits, slots: bool, engine: str) -> None:
    """An engine is among the takers just where it is not refused."""
    if engine in takers(model, slots):
        assert engine_of(engine).obstacle(model, slots) == ""
        need(engine, model, slots)
    else:
        with pytest.raises(InputError, match=f"engine {engine} does not accept this model"):
            need(engine, model, slots)


def test_formulate_refuses_an_engine_that_does_not_take_the_problem() -> None:
    """Before anything is solved, and with those that do."""
    with pytest.raises(InputError, match=r"closed-form does not accept.*cvxpy, grid"):
        formulate("paper", slot_s=1.0, engine="closed-form", perspective="battery")
    with pytest.raises(InputError, match="cvxpy does not accept"):
        formulate("paper", "P3", perspective="wells", engine="cvxpy")


def test_a_program_tells_what_it_is_and_who_takes_it() -> None:
    """Found from its trees, of every declared model; the engines that take all of them."""
    program = formulate("paper", perspective="battery")
    found = [traits(each.model) for each in program.parts]
    assert [each.unknowns for each in found] == [1, 2]
    assert all(each.linear and each.smooth and not each.integer for each in found)
    assert {"closed-form", "cvxpy", "casadi", "grid"} <= set(program.engines)
    assert "closed-form" not in formulate("paper", slot_s=1.0, perspective="battery").engines
    wells = formulate("paper", "P3", perspective="wells")
    assert not any(traits(each.model).linear for each in wells.parts)
    assert "casadi" in wells.engines
    assert "cvxpy" not in wells.engines
    nothing = formulate(load("paper").replace({"body.mass_kg": 2.5}), perspective="battery")
    assert nothing.engines == ()


def test_a_program_gives_the_whole_solution_too() -> None:
    """Of the best itinerary: the values and prices of the plan, with the multipliers."""
    program = formulate("paper", "P3", perspective="battery")
    solution, plan = program.compile().solve(), program.solve()
    assert solution.status is plan.status
    assert solution.point(0) == {"hover_time_s": plan.hover_time_s}
    assert solution.multipliers_at(0)["P3.a state of charge"] > 0.0
    assert solution.shadow_prices() == program.shadow_prices()
    late = (
        formulate(load("paper").replace({"limits.deadline_s": 60}), "P3", perspective="battery")
        .compile()
        .solve()
    )
    assert late.status == "infeasible"


def test_another_perspective_is_proposed_to_engines_of_linear_models_only() -> None:
    """With slots, casadi takes no perspective; the grid takes this one."""
    with pytest.raises(InputError, match="perspective battery, for example"):
        solve("paper", "P3", engine="closed-form")
    with pytest.raises(InputError, match=r"do: grid$"):
        solve("paper", "P3", engine="casadi", slot_s=50.0)
