"""No answer depends on the unit of its objective: routes, times, proofs, ties and prices."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

import optuav
from optuav.engines import closed_form
from optuav.engines.registry import Engine
from optuav.engines.solution import Solution
from optuav.modelling import Model
from optuav.modelling.traversal import change_by_step
from optuav.network.network import build_network
from optuav.status import Status
from tests.examples import few

PAPER = optuav.load("paper")
FACTORS = (1e-12, 3.125e-8, 1e12)
TB_PER_S = 0.25e6 / 8.0 / 1e12  # 0.25 Mbit/s


@dataclass(frozen=True)
class Longest(optuav.Formulation):
    """Longest hover, stated in another unit and from another zero."""

    per_s: float = 1.0
    offset: float = 0.0

    def declare(self, model: Model, given: Any) -> None:
        hover, rest = given.hover_and_rest(model)
        model.maximise(self.per_s * hover + self.offset, unit="TB")
        given.keep_charge(model, "charge", hover, rest)
        given.keep_wells(model, "charge", hover, rest)
        given.keep_deadline(model, "deadline", hover, rest)


@dataclass(frozen=True)
class Cheapest(optuav.Formulation):
    """Least cost of a hover of 700 s: a second of rest costs twice one of flight."""

    per_s: float = 1.0

    def declare(self, model: Model, given: Any) -> None:
        hover, rest = given.hover_and_rest(model)
        model.minimise(self.per_s * (2.0 * rest + given.flight_time_s), unit="EUR")
        model.subject_to("hover", hover >= 700.0, unit="s")
        model.subject_to("charge", given.soc_end(hover, rest) >= given.min_soc)
        given.keep_wells(model, "charge", hover, rest)
        given.keep_deadline(model, "deadline", hover, rest)


@dataclass(frozen=True)
class LeastBattery(optuav.Formulation):
    """Smallest pack for a hover of 700 s; 1 of its unit is so many ampere-seconds."""

    unit_As: float = 1.0

    def declare(self, model: Model, given: Any) -> None:
        hover, rest = given.hover_and_rest(model)
        size = model.variable("size", "C", unit="of capacity", lower=1e3 / self.unit_As)
        model.minimise(size)
        drawn = given.flight_charge_As + given.hover_current_A * hover
        left = given.packs * self.unit_As * size - drawn + given.rest_current_A * rest
        whole = given.min_soc * given.packs * self.unit_As * size
        model.subject_to("hover", hover >= 700.0, unit="s")
        model.subject_to("charge", left >= whole, unit="A s")
        given.keep_deadline(model, "deadline", hover, rest)


def engines() -> list[Any]:
    """Engines of linear models, with the accuracy of their times [s]."""
    names = [("closed-form", 1e-9), ("cvxpy", 1e-6), ("casadi", 1e-5), ("auto", 1e-9)]
    return [pytest.param(*each, id=each[0]) for each in names]


@pytest.mark.parametrize("per_s", FACTORS)
@pytest.mark.parametrize(("engine", "close_s"), engines())
def test_the_published_optimum_in_any_unit(engine: str, close_s: float, per_s: float) -> None:
    """SPEC: 719.5399 s with 392.1438 s of rest at b1; a tie of 1e-6 units took direct."""
    plan = optuav.solve(PAPER, Longest(per_s), perspective="battery", engine=engine)
    assert plan.route == ("origin", "b1", "hover", "destination")
    assert plan.hover_time_s == pytest.approx(719.5399, abs=1e-4)
    assert plan.rest_time_s == pytest.approx(392.1438, abs=1e-4)
    one = optuav.solve(PAPER, Longest(), perspective="battery", engine=engine)
    assert plan.hover_time_s == pytest.approx(one.hover_time_s, abs=close_s)
    assert (plan.status, plan.route) == (one.status, one.route)
    assert plan.objective == pytest.approx(per_s * plan.hover_time_s, rel=1e-12)


@pytest.mark.parametrize("per_s", FACTORS)
def test_pyomo_in_any_unit(per_s: float) -> None:
    """HiGHS leaves out coefficients below 1e-9, and stops where the objective gains 1e-9."""
    pytest.importorskip("pyomo")
    plan = optuav.solve(PAPER, Longest(per_s), perspective="battery", engine=optuav.Pyomo())
    assert plan.hover_time_s == pytest.approx(719.5399, abs=1e-4)
    assert (plan.status, plan.route[1]) == (Status.OPTIMAL, "b1")


@pytest.mark.parametrize("per_s", FACTORS)
def test_slots_in_any_unit(per_s: float) -> None:
    """By hand: 35 slots of 20 s hovered, as 720 s exceed 719.54 s, need 220.4 s of rest: 12."""
    plan = optuav.solve(PAPER, Longest(per_s), perspective="battery", slot_s=20.0)
    assert (plan.hover_time_s, plan.rest_time_s, plan.route[1]) == (700.0, 240.0, "b1")


def test_terabytes_of_table2() -> None:
    """955.28 s by b1, as in seconds; the direct route, 950.98 s, was called optimal."""
    plan = optuav.solve("paper-table2", Longest(TB_PER_S), perspective="battery")
    assert (plan.route[1], plan.status) == ("b1", Status.OPTIMAL)
    assert plan.hover_time_s == pytest.approx(955.28, abs=0.005)
    assert f"\nObjective    {TB_PER_S * plan.hover_time_s:.6g} TB\n".replace("-", "−") in str(plan)


@pytest.mark.parametrize("per_s", FACTORS)
def test_wells_in_any_unit(per_s: float) -> None:
    """Bracketed with proof, as the longest hover of (P1) is: 597.270 s (SPEC)."""
    plan, p1 = optuav.solve(PAPER, Longest(per_s)), optuav.solve(PAPER)
    assert (plan.engine, plan.status) == ("bracket", Status.OPTIMAL)
    assert plan.hover_time_s == pytest.approx(597.270, abs=5e-4)
    assert plan.route == p1.route
    assert plan.rest_time_s == pytest.approx(p1.rest_time_s, abs=1e-6)


@pytest.mark.parametrize("per_s", FACTORS)
def test_wells_by_casadi_in_any_unit(per_s: float) -> None:
    plan = optuav.solve(PAPER, Longest(per_s, building="b10"), engine="casadi")
    assert plan.hover_time_s == pytest.approx(597.270, abs=5e-4)


@pytest.mark.parametrize("per_s", FACTORS)
def test_a_least_cost_in_any_unit(per_s: float) -> None:
    """The rest of 220.37 s at b1 that 700 s of hover need (docs/own-formulation)."""
    plan = optuav.solve(PAPER, Cheapest(per_s), perspective="battery")
    assert (plan.route[1], round(plan.rest_time_s, 2)) == ("b1", 220.37)
    assert plan.status is Status.OPTIMAL


@pytest.mark.parametrize("offset", [-719.5, -1e3, 1e4])
def test_a_zero_of_its_own_changes_nothing(offset: float) -> None:
    """Also where the best value is next to 0, of which no share is a tolerance."""
    for options in ({}, {"slot_s": 20.0}, {"engine": "casadi"}, {"engine": "cvxpy"}):
        plan = optuav.solve(PAPER, Longest(1e-9, 1e-9 * offset), perspective="battery", **options)
        assert plan.route[1] == "b1"
        least_s = 700.0 if "slot_s" in options else 719.5398
        assert least_s - 1e-9 <= plan.hover_time_s <= 719.5400


@pytest.mark.parametrize("unit_As", [1.0, 3600.0, 1e-3, 1e9])
def test_an_unknown_may_have_any_unit(unit_As: float) -> None:
    """By hand: N C (1 − η0) = Q_fl + I_hv 700 s − I_rest T', all time left being rested."""
    plan = optuav.solve(PAPER, LeastBattery(unit_As), perspective="battery")
    network = build_network(PAPER)
    best_As = math.inf
    for route, building in enumerate(network.routes.building.tolist()):
        rest_s = (1200.0 - float(network.routes.flight_time_s[route]) - 700.0) * (building >= 0)
        drawn_As = float(network.routes.flight_charge_As[route]) + 87.9104 * 700.0
        best_As = min(best_As, (drawn_As - 10.0 * rest_s) / (2.0 * 0.95))
    assert plan.objective * unit_As == pytest.approx(best_As, rel=1e-5)


@pytest.mark.parametrize("per_s", FACTORS)
@pytest.mark.parametrize("problem", [Longest, Cheapest])
def test_a_batch_in_any_unit(problem: Any, per_s: float) -> None:
    keys = {"limits.deadline_s": [60.0, 800.0, 1200.0, 1500.0], "battery.packs": [2, 2, 2, 3]}
    one, other = (
        optuav.batch_arrays(PAPER, keys, problem(each), perspective="battery")
        for each in (1.0, per_s)
    )
    for name in ("hover_time_s", "rest_time_s", "mission_time_s"):
        np.testing.assert_allclose(other[name], one[name], rtol=1e-9, atol=1e-9)
    for name in ("building", "order", "status", "reason"):
        assert np.array_equal(other[name], one[name])
    np.testing.assert_allclose(other["objective"], per_s * one["objective"], rtol=1e-9)


@pytest.mark.parametrize("per_s", FACTORS)
@pytest.mark.parametrize("perspective", ["battery", "available"])
def test_prices_are_per_unit_of_the_objective(perspective: Any, per_s: float) -> None:
    """Kinks too; at 1e-12 all multipliers had counted as none, and all sides as equal."""
    one, other = (
        optuav.formulate(PAPER, Longest(each), perspective=perspective).shadow_prices()
        for each in (1.0, per_s)
    )
    assert other.keys() == one.keys()
    for name, (less, more) in other.items():
        assert (less / per_s, more / per_s) == pytest.approx(tuple(one[name]), rel=1e-6), name
        assert other[name].has_kink == one[name].has_kink, name


@pytest.mark.parametrize("per_s", [1e-12, 1e12])
def test_kinks_in_any_unit(per_s: float) -> None:
    """At 800 s direct and by way of b1 hover alike for other deadlines: two sides of a price."""
    program = optuav.formulate(
        PAPER.replace({"limits.deadline_s": 896.376}), Longest(per_s), perspective="battery"
    )
    assert program.shadow_prices()["min_soc"].less < 0.0


@pytest.mark.parametrize("per_s", FACTORS)
def test_an_explanation_in_any_unit(per_s: float) -> None:
    """The stated unit, the same parameters that matter, and whole steps solved again."""
    one, other = (
        optuav.explain(PAPER, Longest(each), perspective="battery") for each in (1.0, per_s)
    )
    assert other.objective == "TB"
    packs = next(price for price in other.prices if price.key == "battery.packs")
    words = " ".join(str(other).split())
    assert f"one more pack gives {packs.gain:.3g} TB ".replace("-", "−") in words.replace(",", " ")
    assert "Prices TB per unit of a parameter" in words
    for before, after in zip(one.prices, other.prices, strict=True):
        assert (before.name, before.matters) == (after.name, after.matters)
        assert before.has_kink == after.has_kink
        for side in ("less", "more", "gain", "loss"):
            expected = per_s * getattr(before, side)
            assert getattr(after, side) == pytest.approx(expected, rel=1e-6, nan_ok=True), side


@pytest.mark.parametrize("per_s", FACTORS)
def test_ties_are_the_same_in_any_unit(per_s: float) -> None:
    """b1 rest first ties with b2 hover first (SPEC): two routes, and no other."""
    program = optuav.formulate(PAPER, Longest(per_s), perspective="battery")
    tied = program.tied(program.answers())
    assert [program.network.route_names(program.parts[k].routes[e])[1:-1] for k, e in tied] == [
        ("b1", "hover"),
        ("hover", "b2"),
    ]


@dataclass(frozen=True)
class Cautious(Engine):
    """Exact answers of which it claims no more than that none is better by a second."""

    per_s: float = 1.0
    name: str = "cautious"
    most_unknowns = 2
    needs = ("lower bounds",)

    def solve(
        self, model: Model, programmes: int, values: Any = None, **_: float | None
    ) -> Solution:
        found = closed_form.solve(model, programmes, values)
        return replace(found, beyond=found.objective + self.per_s)


def test_what_is_not_proved_has_the_unit_of_the_objective() -> None:
    """A gap of a second is open, also where it is 3e-8 TB."""
    engine = Cautious(TB_PER_S)
    plan = optuav.solve(PAPER, Longest(TB_PER_S), perspective="battery", engine=engine)
    assert plan.status is Status.FEASIBLE
    assert "not proved: up to 3.125e−08 TB more has not been ruled out" in plan.notes
    assert plan.bound == pytest.approx(plan.objective + TB_PER_S, rel=1e-9)


def test_key_prices_in_any_unit() -> None:
    """A percent of a key that gives a second of hover is worth telling in TB as well."""
    mission = optuav.load("relay-today")
    one, other = (optuav.explain(mission, Longest(each)).key_prices for each in (1.0, TB_PER_S))
    assert any(row.size for row in one)
    for before, after in zip(one, other, strict=True):
        assert after.key == before.key
        expected = TB_PER_S * before.less, TB_PER_S * before.more
        assert (after.less, after.more) == pytest.approx(expected, rel=1e-4, nan_ok=True)


@given(exponent=st.floats(-12.0, 12.0), deadline_s=st.floats(100.0, 3000.0))
@example(exponent=-12.0, deadline_s=1200.0)
@few(8)
def test_any_unit_and_any_deadline(exponent: float, deadline_s: float) -> None:
    mission, per_s = PAPER.replace({"limits.deadline_s": deadline_s}), 10.0**exponent
    one, other = (
        optuav.solve(mission, Longest(each), perspective="battery") for each in (1.0, per_s)
    )
    assert (other.route, other.status) == (one.route, one.status)
    assert other.hover_time_s == pytest.approx(one.hover_time_s, abs=1e-9)
    assert other.rest_time_s == pytest.approx(one.rest_time_s, abs=1e-7)


def test_the_worth_of_a_second() -> None:
    """Slopes by hand; of an unknown that is no time, a thousandth of it counts."""
    model = Model("")
    hover = model.variable("hover_time_s", "Δ", unit="s")
    size = model.variable("size", "C", unit="A s")
    at = {"hover_time_s": np.array([2.0, 5.0]), "size": 3000.0}
    unknowns = model.variables
    assert change_by_step(7.0, unknowns, at) == 0.0
    assert change_by_step(hover, unknowns, at) == 1.0
    assert change_by_step(1e-9 * size, unknowns, at) == pytest.approx(3e-9)
    assert change_by_step(hover * hover + size, unknowns, at) == pytest.approx([4.0, 10.0])
    assert change_by_step(np.sqrt(hover), unknowns, {"hover_time_s": 0.0}) == 0.0  # No finite slope
    assert change_by_step(np.spacing(hover), unknowns, at) == 0.0  # No known slope
