"""Programs compiled once and solved often, by every engine, with changed parameters by name."""

from __future__ import annotations

import copy
import dataclasses
import math
import pickle
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import Any

import numpy as np
import pytest

import optuav
from formulations.formulation import Formulation, Given
from optuav.engines.registry import ENGINES
from optuav.errors import InputError, SolverError
from optuav.mission import Mission, load
from optuav.modelling import Model
from optuav.status import Status
from tests.asking import formulate

TOLERANCE_S = {"closed-form": 1e-9, "cvxpy": 1e-6, "bracket": 1e-6, "casadi": 1e-4, "grid": 1e-9}
P4 = {"problem": "P4", "building": "b1", "order": "rest-first"}


def with_limits(**limits: float) -> Mission:
    """The mission ``paper`` with other limits."""
    return load("paper").replace({f"limits.{name}": value for name, value in limits.items()})


TWO_ROOFS = {f"buildings.b{k}": None for k in range(2, 10)}
"""Of ten, the first and the last."""
CHANGES: list[dict[str, float]] = [
    {},
    {"deadline_s": 900.0},
    {"min_soc": 0.1},
    {"deadline_s": 800.0, "min_soc": 0.0},
    {"deadline_s": 2000.0, "min_soc": 0.3},
]


@pytest.mark.parametrize(
    "asked", [{"problem": "P3"}, P4, {"problem": "P1"}], ids=lambda asked: asked["problem"]
)
@pytest.mark.parametrize("engine", ENGINES)
def test_changed_parameters_are_changed_missions(engine: str, asked: dict[str, Any]) -> None:
    """One program solved again is each mission formulated anew and solved by the same engine."""
    if engine == "casadi" and asked["problem"] == "P1":
        pytest.skip("four routes, nine starts each: the other problems tell as much")
    options = {"engine": engine, "perspective": "battery", **asked}
    compiled = formulate(with_limits().replace(TWO_ROOFS), **options).compile()
    for change in [*CHANGES, {}]:
        plan = formulate(with_limits(**change).replace(TWO_ROOFS), **options).solve()
        found = compiled.solve(**change)
        assert found.engine == engine
        assert found.status is plan.status
        point = found.point(0)
        assert point["hover_time_s"] == pytest.approx(plan.hover_time_s, abs=TOLERANCE_S[engine])
        if "rest_time_s" in point:
            assert point["rest_time_s"] == pytest.approx(
                plan.rest_time_s, abs=1e2 * TOLERANCE_S[engine]
            )


@pytest.mark.parametrize("engine", ["closed-form", "cvxpy", "casadi"])
@pytest.mark.parametrize("perspective", ["battery", "energy", "adjusted"])
def test_another_battery_is_another_mission(engine: str, perspective: str) -> None:
    """Also where joules are counted: what a full battery holds grows with packs and capacity."""
    compiled = formulate("paper", **P4, perspective=perspective).compile(engine)
    for change in ({"capacity_As": 40000.0}, {"packs": 3}, {"capacity_As": 20000.0, "packs": 4}):
        mission = load("paper").replace({f"battery.{key}": each for key, each in change.items()})
        plan = formulate(mission, **P4, perspective=perspective, engine=engine).solve()
        found_s = compiled.solve(**change).point(0)["hover_time_s"]
        assert found_s == pytest.approx(plan.hover_time_s, abs=TOLERANCE_S[engine])


def test_stated_energies_of_the_full_battery_are_parameters() -> None:
    """E_1 and E_2 of ``paper-table2``: solved again with others as the mission that states them."""
    compiled = formulate("paper-table2", "P3", perspective="adjusted").compile()
    assert {"flight_battery_J", "hover_battery_J"} <= set(compiled.parameters)
    stated = {"battery.flight_energy_J": 1.0e6, "battery.hover_energy_J": 0.9e6}
    plan = formulate(load("paper-table2").replace(stated), "P3", perspective="adjusted").solve()
    found = compiled.solve(flight_battery_J=1.0e6, hover_battery_J=0.9e6)
    assert found.objective[0] == pytest.approx(plan.hover_time_s, abs=1e-9)


@pytest.mark.parametrize("engine", ["closed-form", "cvxpy", "casadi"])
def test_every_named_parameter_may_change(engine: str) -> None:
    """The issue's list at least: and each moves Δ as its shadow price says."""
    program = formulate("paper", **{"perspective": "battery", **P4})
    compiled, given = program.compile(engine), program.parts[0].model.row(0)
    needed = {"deadline_s", "min_soc", "capacity_As", "rest_current_A", "hover_current_A",
              "flight_time_s", "flight_charge_As"}  # fmt: skip
    assert needed <= set(compiled.parameters)
    base = compiled.solve()
    prices = base.shadow_prices()
    for name in set(compiled.parameters) - {"packs"}:  # of which there are whole ones only
        value = given[name]
        step = 1e-4 * value
        moved = compiled.solve(**{name: value + step}).objective[0] - base.objective[0]
        assert moved == pytest.approx(step * prices[name].more, rel=1e-2, abs=1e-5), name


def test_figures_of_every_itinerary_may_change() -> None:
    """An array has one entry an itinerary; a number holds for all of them."""
    program = formulate("paper", optuav.P4("b1"), perspective="battery")
    times_s = [each.model.row(0)["flight_time_s"] for each in program.parts]
    compiled = program.compile()
    assert len(program.parts) == 1
    flight_s = program.parts[0].model.parameters["flight_time_s"].value
    slower = compiled.solve(flight_time_s=list(flight_s + 30.0))
    assert slower.objective[0] == pytest.approx(
        compiled.solve(deadline_s=1170.0).objective[0], abs=1e-9
    )
    assert compiled.solve(flight_time_s=times_s[0]).status is Status.OPTIMAL
    (only,) = compiled.solve(flight_time_s=[1e4, flight_s[1]]).objective
    assert only == pytest.approx(
        formulate("paper", optuav.P4("b1", order="hover-first"), perspective="battery")
        .solve()
        .hover_time_s
    )


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (
            {"deadline": 900.0},
            r"deadline = 900.0: is not a parameter .*; there are .*deadline_s",
        ),
        ({"deadline_s": math.nan}, "deadline_s = nan: must be a finite number"),
        ({"deadline_s": math.inf}, "deadline_s = inf: must be a finite number"),
        ({"deadline_s": "900"}, "deadline_s = '900': must be a finite number"),
        ({"deadline_s": None}, "deadline_s = None: must be a finite number"),
        ({"deadline_s": True}, "deadline_s = true: must be a finite number"),
        ({"deadline_s": [1.0, 2.0, 3.0]}, "a finite number"),
        ({"deadline_s": [[900.0]]}, "a finite number"),
        ({"deadline_s": []}, "a finite number"),
        ({"deadline_s": [900.0, math.nan]}, "a finite number"),
        (
            {"deadline_s": -1.0},
            r"deadline_s = -1.0: must be a number, 0 < x <= 1e7 \[s\], like limits.dead",
        ),
        ({"deadline_s": 0}, r"deadline_s = 0: must be a number, 0 < x"),
        (
            {"min_soc": 2.0},
            r"min_soc = 2.0: must be a number, 0 <= x < 1 \[-\], like limits.min_soc",
        ),
        ({"min_soc": 1.0}, r"min_soc = 1.0"),
        (
            {"packs": 2.5},
            r"packs = 2.5: must be a whole number, 1 <= x <= 1000 \[-\], like battery.packs",
        ),
        ({"packs": 0}, r"packs = 0: must be a whole number"),
        ({"capacity_As": 0.0}, r"capacity_As = 0.0: must be a number, 0.001 <= x <= 1e9 \[A s\]"),
    ],
)
def test_values_that_cannot_be_used_are_refused(values: dict[str, Any], message: str) -> None:
    compiled = formulate("paper", **{"perspective": "battery", **P4}).compile()
    with pytest.raises(InputError, match=message):
        compiled.solve(**values)


def test_all_faults_are_told_at_once() -> None:
    with pytest.raises(InputError) as refusal:
        formulate("paper", **{"perspective": "battery", **P4}).compile().solve(
            speed=1.0, min_soc="a", deadline_s=math.nan, packs=2.5
        )
    keys = [fault.key for fault in refusal.value.faults]
    assert keys == ["speed", "min_soc", "deadline_s", "packs"]


def test_every_entry_of_an_array_has_to_be_allowed() -> None:
    """And whole numbers may be floats, as arrays have them."""
    compiled = formulate("paper", optuav.P4("b1"), perspective="battery").compile()
    assert compiled.solve(packs=np.array([2.0, 3.0])).status is Status.OPTIMAL
    with pytest.raises(InputError, match=r"packs = .*a whole number"):
        compiled.solve(packs=[2.0, 2.5])


def test_what_comes_from_no_key_may_be_any_number() -> None:
    """A net current may have either sign; so may what a user declares."""
    compiled = formulate("paper", **{"perspective": "battery", **P4}).compile()
    assert compiled.solve(rest_current_A=-1.0).status is Status.OPTIMAL


@pytest.mark.parametrize("engine", ["closed-form", "cvxpy", "casadi", "grid"])
def test_infeasible_values_have_no_answer(engine: str) -> None:
    """The status says so; the next solve is as if nothing had been."""
    compiled = formulate("paper", **{"perspective": "battery", **P4}).compile(engine)
    first = compiled.solve().objective[0]
    found = compiled.solve(deadline_s=10.0)
    assert found.status is Status.INFEASIBLE
    with pytest.raises(SolverError, match="infeasible"):
        found.point(0)
    assert compiled.solve().objective[0] == pytest.approx(first, abs=1e-6)


@pytest.mark.parametrize("engine", ["closed-form", "cvxpy", "casadi"])
def test_values_that_divide_by_zero_are_an_error(engine: str) -> None:
    """Hovering at no voltage: no status, no number."""
    compiled = formulate("paper", **{"perspective": "adjusted", **P4}).compile(engine)
    with pytest.raises(SolverError, match=r"numbers that it cannot use|found no answer"):
        compiled.solve(hover_voltage_V=0.0)


class Endless(Formulation):
    """Longest hover with nothing against it."""

    def declare(self, model: Model, given: Given) -> None:
        """State no limit but a parameter in the objective."""
        hover = model.variable("hover_time_s", "Δ", unit="s")
        model.maximise(hover * given.min_soc)


def test_unbounded_is_not_left_out() -> None:
    """It has no value that could win, and is said before any that has one."""
    compiled = formulate("paper", Endless(), perspective="battery").compile()
    assert compiled.solve().status is Status.UNBOUNDED
    assert compiled.solve(min_soc=0.0).status is Status.OPTIMAL


def test_nothing_that_can_be_flown_is_refused_with_reasons() -> None:
    heavy = load("paper").replace({"body.mass_kg": 30.0})
    with pytest.raises(InputError, match="nothing to compile: "):
        formulate(heavy, perspective="battery").compile()


def test_engines_that_do_not_take_it_are_refused_with_those_that_do() -> None:
    program = formulate("paper", perspective="wells", **P4)
    with pytest.raises(InputError, match=r"closed-form .* Engines that do: bracket, casadi, grid"):
        program.compile("closed-form")
    with pytest.raises(InputError, match="engine = 'simplex': must be one of closed-form, cvxpy"):
        program.compile("simplex")


def test_grid_takes_the_slots_of_the_mission() -> None:
    """As `optuav.solve` does, where none are asked for."""
    compiled = formulate(with_limits(slot_s=7.0), **{"perspective": "battery", **P4}).compile(
        "grid"
    )
    assert compiled.question.slot_s == 7.0
    times_s = np.array(list(compiled.solve().point(0).values()))
    assert np.allclose(times_s % 7.0, 0.0)


@pytest.mark.parametrize("slot_s", [None, 10.0])
def test_a_hover_that_draws_what_it_receives_may_draw_more(slot_s: float | None) -> None:
    """In energies the terms of the hover cancel; with another power they do not."""
    regimes = {
        **dict.fromkeys(("rotor", "body")),
        "flight": {
            "model": "regimes",
            "acceleration_m_s2": 8.0,
            "flight_current_A": 95.0,
            "flight_power_W": 1400.0,
            "hover_current_A": 70.0,
            "hover_power_W": 111.0,
            "rest_current_A": 1.0,
            "rest_power_W": 12.0,
        },
        "battery.charge_current_A": 10.0,
        "battery.nominal_voltage_V": 11.1,
        "laser.power_W": 6000.0,
    }
    mission, problem = optuav.load("paper").replace(regimes), optuav.P1(trajectory="direct")
    program = optuav.formulate(mission, problem, perspective="energy", slot_s=slot_s)
    found = program.compile("cvxpy").solve(hover_power_W=1000.0)
    hover_s = 738.4531 if slot_s is None else 730.0
    assert found.point(0)["hover_time_s"] == pytest.approx(hover_s, abs=1e-4)


def test_program_is_left_as_it_was() -> None:
    """Compiling and solving change neither the declared model nor what the program answers."""
    program = formulate("paper", **{"perspective": "battery", **P4})
    before, page = program.solve(), str(program)
    compiled = program.compile("cvxpy")
    compiled.solve(deadline_s=700.0)
    assert (str(program), program.solve()) == (page, before)
    assert dataclasses.is_dataclass(program)


def test_public_name() -> None:
    """`formulate(...).compile()` is all that is needed."""
    assert formulate("paper", "P3").compile().solve(deadline_s=300.0).objective[0] < 300.0


def test_a_point_with_an_unknown_name_is_refused() -> None:
    """As in `solve`: each by name. Parameters of the programme are taken."""
    program = formulate("paper", "P3", perspective="battery")
    with pytest.raises(InputError) as refusal:
        program.check({"hover_time_s": 10.0, "deadline": 3.0, "rest_current_A": 1.0})
    assert [fault.key for fault in refusal.value.faults] == ["deadline", "rest_current_A"]
    assert "is not a parameter of the program; there are" in str(refusal.value)
    late = program.check({"hover_time_s": 10.0, "deadline_s": 3.0})
    assert not all(row.satisfied for row in late)


@pytest.mark.parametrize("again", [lambda c: pickle.loads(pickle.dumps(c)), copy.deepcopy])
@pytest.mark.parametrize("engine", [*ENGINES, optuav.Cvxpy(solver="CLARABEL")], ids=str)
def test_copies_of_a_compiled_program_solve_alike(engine: Any, again: Any) -> None:
    """With its options: the engine's own, and slots. The copy knows nothing of earlier calls."""
    slot_s = 10.0 if engine in ("cvxpy", "grid") else None
    program = optuav.formulate("paper", optuav.P4("b1"), perspective="battery", slot_s=slot_s)
    compiled = program.compile(engine)
    found, twin = compiled.solve(deadline_s=900.0), again(compiled)
    assert twin.solve(deadline_s=900.0).point(0) == pytest.approx(found.point(0), abs=1e-6)
    assert (twin.question, twin.parameters) == (compiled.question, compiled.parameters)
    with pytest.raises(InputError, match="is not a parameter of the program"):
        twin.solve(deadline=900.0)


def test_a_compiled_program_goes_to_another_process() -> None:
    """Its bound method too, as pools take it."""
    compiled = optuav.formulate("paper", "P3", perspective="battery").compile()
    with ProcessPoolExecutor(1, get_context("spawn")) as pool:
        found = pool.submit(compiled.solve, deadline_s=700.0).result()
    assert found.point(0) == compiled.solve(deadline_s=700.0).point(0)


@pytest.mark.parametrize(
    ("value", "words"),
    [(10**5000, "an integer of 16610 bits"), ({10**5000}, "a set"), (object(), "a object")],
    ids=["large", "large in a set", "object"],
)
def test_a_value_without_a_text_of_its_own_is_refused_in_words(value: object, words: str) -> None:
    """Python has no digits for a number so large, and an address differs from run to run."""
    compiled: Any = formulate("paper", "P3", perspective="battery").compile()
    with pytest.raises(InputError, match=f"^deadline_s = {words}: must be a finite number$"):
        compiled.solve(deadline_s=value)
