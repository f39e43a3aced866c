"""A problem of a user's own, one class, gets everything that the problems of the paper have."""

from __future__ import annotations

import itertools
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import optuav
from formulations.formulation import Formulation, Given
from optuav.engines import closed_form, grid
from optuav.engines.casadi_engine import Casadi
from optuav.engines.cvxpy_engine import Cvxpy
from optuav.engines.registry import takers
from optuav.engines.solution import Solution
from optuav.modelling import Model, Parameter, check
from optuav.modelling.classify import traits
from optuav.status import Status
from tests.formulations.given import LINEAR, quantities
from tests.mathtext import lines_that_can_be_set

OWN = ("LeastRest", "SmallestBattery")


class LeastRest(Formulation):
    """Least rest for a wanted hover time."""

    def declare(self, model: Model, given: Given) -> None:
        wanted = Parameter("wanted_hover_s", "Δ_w", "s", 85.0)
        hover, rest = given.hover_and_rest(model)
        model.minimise(rest)
        model.subject_to("wanted hover", hover == wanted, unit="s")
        model.subject_to("state of charge", given.soc_end(hover, rest) >= given.min_soc)
        given.keep_deadline(model, "deadline", hover, rest)


class SmallestBattery(Formulation):
    """Smallest battery pack for a wanted hover time."""

    def declare(self, model: Model, given: Given) -> None:
        wanted = Parameter("wanted_hover_s", "Δ_w", "s", 85.0)
        hover, rest = given.hover_and_rest(model)
        pack = model.variable("pack_As", "B_i", unit="A s", upper=100_000.0)
        charged = given.rest_current_A * rest
        drawn = given.flight_charge_As + given.hover_current_A * hover - charged
        model.minimise(pack)
        model.subject_to("wanted hover", hover == wanted, unit="s")
        model.subject_to("charge", (1.0 - given.min_soc) * given.packs * pack >= drawn, unit="A s")
        given.keep_deadline(model, "deadline", hover, rest)


def least_rest(**changes: Any) -> Model:
    """100 A s in flight, 10 Δ in hover, 5 T' back: 85 s of hover need 10 s of rest."""
    return LeastRest().model(quantities(**changes), "battery")


def smallest_battery(*, rests: bool) -> Model:
    return SmallestBattery().model(quantities(rests=rests), "battery")


def answered(model: Model, engine: str, slot_s: float = 5.0) -> Solution:
    if engine == "closed-form":
        return closed_form.solve(model, 1)
    if engine == "grid":
        return grid.solve(model, 1, slot_s=slot_s)
    return Cvxpy().solve(model, 1) if engine == "cvxpy" else Casadi().solve(model, 1)


# What is printed, and what it is

PAGE = """\
Least rest for a wanted hover time

minimise   T', then smallest Δ
over       Δ ∈ [0, ∞) s
           T' ∈ [0, ∞) s
subject to
  wanted hover     Δ = Δ_w
  state of charge  1 − (Q_fl + I_hv·Δ − I_rest·T') / (N·B_i) ≥ η0
  deadline         Δ + T' ≤ T_max − T_fl
where
  Δ_w     wanted_hover_s    85   s
  Q_fl    flight_charge_As  100  A s
  I_hv    hover_current_A   10   A
  I_rest  rest_current_A    5    A
  N       packs             2    1    battery.packs
  B_i     capacity_As       500  A s  battery.capacity_As
  η0      min_soc           0.1  1    limits.min_soc
  T_max   deadline_s        200  s    limits.deadline_s
  T_fl    flight_time_s     50   s
"""


def test_as_printed() -> None:
    """The parameter of its own stands among those of the mission."""
    assert str(least_rest()).splitlines() == PAGE.splitlines()


@pytest.mark.parametrize("model", [least_rest(), smallest_battery(rests=True)], ids=OWN)
def test_in_latex(model: Model) -> None:
    """Every line can be set, and none is missing."""
    lines = lines_that_can_be_set(model.to_latex())
    assert len(lines) == 1 + len(model.variables) + 3 + len(model.parameters)


def test_check_tells_what_is_violated_by_how_much() -> None:
    """At 85 s of hover and 6 s of rest 920 A s are drawn where 900 are allowed, of 1000."""
    rows = {row.label: row for row in check(least_rest(), {"hover_time_s": 85, "rest_time_s": 6})}
    charge = rows["state of charge"]
    assert (charge.left, charge.right) == pytest.approx((0.08, 0.1))
    assert charge.slack == pytest.approx(-0.02)
    assert not charge.satisfied
    assert rows["wanted hover"].satisfied
    assert rows["deadline"].slack == pytest.approx(59.0)
    assert charge.declared_at.startswith(f"{Path(__file__).name}:")


@pytest.mark.parametrize(
    ("model", "engines"),
    [
        (least_rest(), ("closed-form", "cvxpy", "casadi", "grid")),
        (smallest_battery(rests=False), ("closed-form", "cvxpy", "casadi", "grid")),
        (smallest_battery(rests=True), ("cvxpy", "casadi")),
    ],
    ids=["LeastRest", "SmallestBattery direct", "SmallestBattery"],
)
def test_what_it_is_is_found(model: Model, engines: tuple[str, ...]) -> None:
    """Linear, and three unknowns are too many for two engines."""
    assert traits(model).linear
    assert takers(traits(model), slots=False) == engines


@pytest.mark.parametrize("perspective", LINEAR)
def test_perspectives_come_with_the_state_of_charge(perspective: str) -> None:
    assert traits(LeastRest().model(quantities(), perspective)).linear


# Every engine


@pytest.mark.parametrize("engine", ["closed-form", "cvxpy", "casadi", "grid"])
def test_least_rest_by_hand(engine: str) -> None:
    """10 Δ − 5 T' ≤ 800 at Δ = 85; the slots of 5 s fit."""
    found = answered(least_rest(), engine)
    assert found.point(0) == pytest.approx({"hover_time_s": 85.0, "rest_time_s": 10.0}, abs=1e-6)
    assert found.objective[0] == pytest.approx(10.0, abs=1e-6)
    assert {"wanted hover", "state of charge"} <= set(found.binding_labels(0))


@pytest.mark.parametrize("engine", ["closed-form", "cvxpy", "casadi", "grid"])
def test_smallest_battery_by_hand(engine: str) -> None:
    """950 A s in flight and hover are 0.9 of 2 packs: 527.8 A s each, 530 in steps of 5."""
    found = answered(smallest_battery(rests=False), engine)
    expected = 530.0 if engine == "grid" else 950.0 / 1.8
    assert found.point(0)["pack_As"] == pytest.approx(expected)


@pytest.mark.parametrize("engine", ["cvxpy", "casadi"])
def test_smallest_battery_rests_as_long_as_there_is_time(engine: str) -> None:
    """65 s of rest bring 325 A s of the 950."""
    found = answered(smallest_battery(rests=True), engine).point(0)
    assert found["rest_time_s"] == pytest.approx(65.0, rel=1e-5)
    assert found["pack_As"] == pytest.approx(625.0 / 1.8, rel=1e-6)


@pytest.mark.parametrize("engine", ["closed-form", "cvxpy", "casadi", "grid"])
def test_no_time_for_hover_and_its_rest(engine: str) -> None:
    """85 s of hover and 10 s of rest do not go into 94.5 s."""
    assert answered(least_rest(flight_time_s=105.5), engine).status is Status.INFEASIBLE


# Shadow prices


@pytest.mark.parametrize("engine", ["closed-form", "cvxpy", "casadi"])
def test_shadow_prices_by_hand(engine: str) -> None:
    """T' = (100 + 10 Δ_w − 900)/5 with 900 = 0.9 · 2 · 500, in seconds of rest per unit."""
    prices = answered(least_rest(), engine).shadow_prices()
    expected = {
        "wanted_hover_s": 2.0,
        "flight_charge_As": 0.2,
        "hover_current_A": 17.0,
        "rest_current_A": -2.0,
        "packs": -90.0,
        "capacity_As": -0.36,
        "min_soc": 200.0,
        "deadline_s": 0.0,
        "flight_time_s": 0.0,
    }
    assert {name: price.more for name, price in prices.items()} == pytest.approx(expected, abs=1e-5)
    assert not any(price.has_kink for price in prices.values())


def test_where_rest_begins_its_price_has_two_sides() -> None:
    """80 s of hover need no rest: a second less saves nothing, a second more costs two."""
    model = least_rest(flight_charge_As=50.0)
    price = closed_form.solve(model, 1).shadow_prices()["wanted_hover_s"]
    assert (price.less, price.more) == pytest.approx((0.0, 2.0))


# Through the public functions, over a mission

MISSION = optuav.load("paper")
BARE = MISSION.replace({f"buildings.{each.name}": None for each in MISSION.buildings})


@pytest.mark.parametrize("engine", ["closed-form", "cvxpy", "casadi", "grid"])
def test_compiled_and_solved_again(engine: str) -> None:
    """Its own parameter may change like any other; the least rest is that of charge balance."""
    slot_s = 10.0 if engine == "grid" else None
    program = optuav.formulate(
        MISSION,
        LeastRest(building="b1", order="rest-first"),
        engine=engine,
        slot_s=slot_s,
        perspective="battery",
    )
    compiled = program.compile()
    assert "wanted_hover_s" in compiled.parameters
    for wanted_s, min_soc in itertools.product((690.0, 700.0), (0.05, 0.04)):
        found = compiled.solve(wanted_hover_s=wanted_s, min_soc=min_soc)
        given = program.parts[0].model.row(0)
        drawn_As = given["flight_charge_As"] + given["hover_current_A"] * wanted_s
        rest_s = (drawn_As - (1.0 - min_soc) * 72_000.0) / given["rest_current_A"]
        expected = np.ceil(rest_s / 10.0) * 10.0 if slot_s else rest_s
        assert found.objective[0] == pytest.approx(expected, abs=1e-5)


def test_an_engine_that_does_not_take_it_names_those_that_do() -> None:
    with pytest.raises(optuav.InputError, match="Engines that do: cvxpy, casadi"):
        optuav.formulate(
            MISSION, SmallestBattery(building="b1"), engine="closed-form", perspective="battery"
        )
    assert optuav.solve(
        BARE, SmallestBattery(), engine="closed-form", perspective="battery"
    ).route == (
        "origin",
        "hover",
        "destination",
    )


def test_longest_hover_turns_least_rest_around() -> None:
    """With the deadline at which that rest ends, (P1) hovers as long as was wanted."""
    compiled = optuav.formulate(MISSION, LeastRest(), perspective="battery").compile()
    for wanted_s in (690.0, 715.0):
        rest_s = compiled.solve(wanted_hover_s=wanted_s).point(0)["rest_time_s"]
        direct = optuav.solve(MISSION, optuav.P4("b1", order="rest-first"), perspective="battery")
        deadline_s = direct.flight_time_s + wanted_s + rest_s
        longest = optuav.solve(
            MISSION.replace({"limits.deadline_s": deadline_s}), perspective="battery"
        )
        assert longest.hover_time_s == pytest.approx(wanted_s, abs=1e-6)


def test_longest_hover_turns_smallest_battery_around() -> None:
    """With the smallest pack, (P1) hovers as long as was wanted."""
    found = (
        optuav.formulate(MISSION, SmallestBattery(), perspective="battery")
        .compile()
        .solve(wanted_hover_s=700.0)
    )
    mission = MISSION.replace({"battery.capacity_As": found.point(0)["pack_As"]})
    assert optuav.solve(mission, perspective="battery").hover_time_s == pytest.approx(
        700.0, abs=1e-6
    )


def test_through_both_wells() -> None:
    """The perspective `wells` serves it too, prints in pages, and gives the same."""
    problem = LeastRest(building="b1", order="rest-first")
    through = optuav.formulate(MISSION, problem, perspective="wells").compile()
    plain = optuav.formulate(MISSION, problem, perspective="battery").compile()
    found, expected = (each.solve(wanted_hover_s=700.0) for each in (through, plain))
    assert (found.engine, expected.engine) == ("casadi", "closed-form")
    assert found.point(0) == pytest.approx(expected.point(0), abs=1e-4)
    assert len(str(through.program)) < 20_000


def test_makes_a_plan_that_can_be_kept(tmp_path: Path) -> None:
    """On the direct route 85 s need no rest; the file remembers the name of the problem."""
    plan = optuav.solve(MISSION, LeastRest(), perspective="battery")
    assert (plan.problem, plan.hover_time_s, plan.rest_time_s) == ("LeastRest", 85.0, 0.0)
    assert plan.route == ("origin", "hover", "destination")
    plan.save(tmp_path / "plan.json")
    assert optuav.load_plan(tmp_path / "plan.json") == plan


class AtLeast(Formulation):
    """Least rest for 300 s of hover or more, which no rest takes."""

    def declare(self, model: Model, given: Given) -> None:
        hover, rest = given.hover_and_rest(model)
        model.minimise(rest)
        model.subject_to("wanted hover", hover >= 300.0, unit="s")
        model.subject_to("charge", given.soc_end(hover, rest) >= given.min_soc)
        given.keep_deadline(model, "deadline", hover, rest)


class AtLeastLong(AtLeast):
    """The same, with the longest hover among those that need no rest."""

    def declare(self, model: Model, given: Given) -> None:
        super().declare(model, given)
        model.prefer_small(-model.variables[0])


@pytest.mark.parametrize("engine", ["closed-form", "cvxpy", "casadi", "grid"])
def test_of_equal_objectives_the_shortest_mission_wins(engine: str) -> None:
    """It rested 0 s at b1, on the way back from 653 s of hover: any hover was as good."""
    options = {"slot_s": 10.0} if engine == "grid" else {}
    few = MISSION.replace({"buildings": MISSION.buildings[:1]})
    plan = optuav.solve(few, AtLeast(), engine=engine, perspective="battery", **options)
    assert plan.route == ("origin", "hover", "destination")
    assert plan.hover_time_s == pytest.approx(300.0, abs=1e-6)
    assert plan.rest_time_s == 0.0


def test_what_a_problem_prefers_goes_before_the_shortest_stays() -> None:
    """688.848 s are what the battery hovers without a rest."""
    direct = MISSION.replace({"buildings": []})
    plan = optuav.solve(direct, AtLeastLong(), perspective="battery")
    assert plan.hover_time_s == pytest.approx(688.848, abs=1e-3)


class LastingRest(LeastRest):
    """Least rest with a battery that never runs dry."""

    def declare(self, model: Model, given: Given) -> None:
        super().declare(model, given)
        hover, rest = (each for each in model.variables)
        given.keep_wells(model, "battery", hover, rest)


def test_a_problem_of_ones_own_through_both_wells() -> None:
    """Turned around: by the deadline of its plan, no rest hovers longer than 85 s after all."""
    scarce = MISSION.replace({"battery.capacity_As": 9600.0})
    plan = optuav.solve(scarce, LastingRest(building="b1", order="hover-first"))
    assert plan.status is Status.LOCALLY_OPTIMAL
    assert plan.flyable
    assert plan.hover_time_s == pytest.approx(85.0, abs=1e-6)
    assert plan.rest_time_s > 0.0
    tight = scarce.replace({"limits.deadline_s": plan.mission_time_s})
    assert optuav.solve(tight, optuav.P4("b1", order="hover-first")).hover_time_s == pytest.approx(
        85.0, abs=1e-4
    )


class Backwards(Formulation):
    """A hover time that may be negative, and is."""

    def declare(self, model: Model, given: Given) -> None:
        hover = model.variable("hover_time_s", "Δ", unit="s", lower=-math.inf)
        model.minimise(hover)
        model.subject_to("hover time", hover >= -5.0, unit="s")


class NoNumber(Formulation):
    """A limit that is no number."""

    def declare(self, model: Model, given: Given) -> None:
        hover = model.variable("hover_time_s", "Δ", unit="s")
        model.maximise(hover)
        model.subject_to("bad", hover <= Parameter("limit_s", "L", "s", math.nan), unit="s")


class Misfit(Formulation):
    """An array that has nothing to do with the itineraries."""

    def declare(self, model: Model, given: Given) -> None:
        hover = model.variable("hover_time_s", "Δ", unit="s")
        model.maximise(hover)
        model.subject_to("bad", hover <= np.array([1.0, 2.0, 3.0]), unit="s")


def test_a_negative_time_makes_no_plan() -> None:
    with pytest.raises(optuav.InputError, match="hover_time_s = -5: must be at least 0 s"):
        optuav.solve("paper", Backwards(), perspective="battery")


@pytest.mark.parametrize("engine", ["closed-form", "cvxpy", "casadi"])
def test_numbers_that_are_none_are_named(engine: str) -> None:
    program = optuav.formulate("paper", NoNumber(), perspective="battery", engine=engine)
    for solve in (program.solve, program.compile().solve):
        with pytest.raises(optuav.SolverError, match=f"{engine} met .* cannot use: limit_s = nan"):
            solve()


def test_an_array_that_fits_no_itineraries_is_refused() -> None:
    with pytest.raises(optuav.InputError, match=r"bad = array of shape \(3,\)"):
        optuav.formulate("paper", Misfit(), perspective="battery")


class Aimless(Formulation):
    """Constraints, and nothing to be sought."""

    def declare(self, model: Model, given: Given) -> None:
        given.keep_deadline(model, "deadline", *given.hover_and_rest(model))


class Empty(Formulation):
    """An objective without an unknown."""

    def declare(self, model: Model, given: Given) -> None:
        model.maximise(given.time_left)


@pytest.mark.parametrize(
    ("formulation", "said"),
    [(Aimless(), "no objective was stated"), (Empty(), "no unknown was declared")],
)
def test_half_a_formulation_is_refused(formulation: Formulation, said: str) -> None:
    """Not solved as optimal with Δ = 0, nor left to an engine to stumble over."""
    with pytest.raises(optuav.InputError, match=f"{formulation.name}: {said}"):
        optuav.formulate("paper", formulation, perspective="battery")


def test_program_solution_and_checks_print_in_one_line_each() -> None:
    program = optuav.formulate("paper", "P3", perspective="battery")
    assert repr(program) == "<Program for 'paper': P3, perspective battery, 1 model>"
    own = optuav.formulate("paper", LeastRest(), perspective="battery")
    assert repr(own) == "<Program for 'paper': LeastRest, perspective battery, 2 models>"
    assert (
        repr(program.compile().solve()) == "<Solution by closed-form: optimal, objective 688.848>"
    )
    charge, first, _ = map(str, program.check({"hover_time_s": 700.0}))
    assert charge == "P3.a state of charge: 0.0363837 ≥ 0.05 VIOLATED by 0.0136163 p3.py:39"
    assert first == "P3.b hover time: 700 ≥ 0 s holds, slack 700 s p3.py:36"
    _, at_least, _ = map(str, program.check({"hover_time_s": [-1.0, 2.0, 3.0]}))
    assert at_least == "P3.b hover time: at 3 points VIOLATED at 1 by up to 1 s p3.py:36"


def test_a_check_prints_as_a_table() -> None:
    """Of every constraint both sides, by how much it holds or not, and the line that states it."""
    checks = optuav.formulate("paper", "P3", perspective="battery").check({"hover_time_s": 700.0})
    assert not checks.satisfied
    assert repr(checks) == "<Checks: 3 constraints, 1 violated>"
    assert str(checks).splitlines() == [
        "constraint            left and right    verdict                 declared at",
        "P3.a state of charge  0.0363837 ≥ 0.05  VIOLATED by 0.0136163   p3.py:39",
        "P3.b hover time       700 ≥ 0 s         holds, slack 700 s      p3.py:36",
        "P3.b hover time       700 ≤ 1124.21 s   holds, slack 424.208 s  p3.py:36",
    ]


def test_a_check_of_several_routes_names_those_that_violate() -> None:
    """And not how many points there are, of which a reader knows nothing."""
    checks = optuav.formulate("paper", optuav.P1(order="rest-first"), perspective="battery").check(
        {"hover_time_s": 719.0, "rest_time_s": 0.0}
    )
    charge = next(row for row in checks if row.label == "P1.b state of charge")
    assert charge.cells[1] == "rest first, 10 routes"
    assert charge.cells[2].startswith("VIOLATED at 10 by up to 0.")
    assert charge.cells[2].endswith(f": {', '.join(f'b{k}' for k in range(1, 11))}")
    assert not checks.satisfied
    ends = next(row for row in checks if row.label == "P1.c ends")
    assert ends.cells[1:3] == ("rest first, 10 routes", "holds at all, least slack 0 m")


def test_a_plan_is_no_point() -> None:
    """It flies one of the routes, and the point would be held against all of them."""
    program = optuav.formulate("paper", "P3", perspective="battery")
    with pytest.raises(optuav.InputError, match=r"values by name, such as {'hover_time_s': plan\."):
        program.check(program.solve())  # type: ignore[arg-type]


def test_line_of_the_formulation_is_told_where_others_state_for_it() -> None:
    """`keep_wells` and `hover_and_rest` stand in a file that a reader of P1 need not know."""
    checks = optuav.formulate("paper", "P1").check({"hover_time_s": 1.0, "rest_time_s": 1.0})
    assert {row.declared_at.partition(":")[0] for row in checks} == {"p1.py"}


class Borrowed(Formulation):
    """A fifth of the battery may be borrowed for 10 s of hover."""

    def declare(self, model: Model, given: Given) -> None:
        hover, rest = given.hover_and_rest(model)
        loan = model.variable("loan", "z", unit="1", upper=1.0, binary=True)
        model.maximise(hover - 10.0 * loan)
        model.subject_to("charge", given.soc_end(hover, rest) + 0.2 * loan >= given.min_soc)
        given.keep_deadline(model, "deadline", hover, rest)


def test_what_binds_is_told_of_a_point_of_branch_and_bound() -> None:
    """On every route: the loan is taken, the charge is used up, and a rest lasts what is left."""
    program = optuav.formulate("paper", Borrowed(), engine="cvxpy", perspective="battery")
    for part in program.parts:
        found = Cvxpy().solve(part.model, len(part.routes))
        assert found.values["loan"].tolist() == [1.0] * len(part.routes)
        binding = {"charge"} | ({"deadline"} if "rest_time_s" in found.values else set())
        assert all(binding <= {*found.binding_labels(k)} for k in range(len(part.routes)))


class LittleOfBoth(Formulation):
    """Longest hover, with an exposure that grows with hover times rest."""

    def declare(self, model: Model, given: Given) -> None:
        hover, rest = given.hover_and_rest(model)
        model.maximise(hover)
        model.subject_to("exposure", hover * rest <= 5000.0, unit="s2")
        model.subject_to("charge", given.soc_end(hover, rest) >= given.min_soc)
        given.keep_wells(model, "charge", hover, rest)
        given.keep_deadline(model, "deadline", hover, rest)


def test_a_proved_route_does_not_prove_the_others() -> None:
    """The direct route is best and proved; times that multiply are left to a local solver."""
    few = {f"buildings.b{k}": None for k in range(3, 11)}
    plan = optuav.solve(optuav.load("paper").replace(few), LittleOfBoth())
    assert plan.route == ("origin", "hover", "destination")
    assert plan.status is Status.LOCALLY_OPTIMAL
    assert plan.proof.startswith("local")
