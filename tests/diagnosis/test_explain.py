"""Explanations: their words, and that the numbers in them are true."""

from __future__ import annotations

import importlib
import json
import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

import optuav
from formulations.formulation import Formulation, Given
from optuav.diagnosis import Explanation, explain
from optuav.diagnosis.infeasibility import plain
from optuav.diagnosis.parameter_prices import Price
from optuav.errors import InputError
from optuav.explorer.answers import answers
from optuav.modelling import Model
from optuav.status import Status
from tests.diagnosis.missions import PAPER, SMALL, InTime, only, repairs
from tests.wells import SLOW

WORDS = {
    "battery.packs": "pack",
    "battery.capacity_As": "of the capacity of a pack",
    "limits.min_soc": "of the charge to be left",
    "limits.deadline_s": "of the deadline",
}
P3_TEXT = """\
Optimum      hover 688.85 s at hover
What binds   Charge binds, the deadline does not.

Binding      charge left  5 % ≥ 5 %

To spare     688.848 s  hover time: 688.848 ≥ 0 s
             435.36 s   deadline: 688.848 ≤ 1124.21 s

Proof        on this route no point that satisfies all of these is better:
             819.016 ×  charge left  0.00122098·Δ ≤ 0.841068
             sum                     Δ ≤ 688.848

Prices       s of hover per unit of a parameter, the others held:
             battery.packs        N = 2               +389.033
             battery.capacity_As  B_i = 36000 A s     +0.0216129
             limits.min_soc       η0 = 0.05           −819.016
             flight_charge_As     Q_fl = 7843.11 A s  −0.0113752
             hover_current_A      I_hv = 87.9104 A    −7.8358

One more     one more pack gives 389 s of hover
             one more A s of the capacity of a pack gives 0.0216 s of hover
             0.01 more of the charge to be left costs 8.19 s of hover
             one more A s of the charge for the flights costs 0.0114 s of hover
             one more ampere of the current in hover costs 7.75 s of hover

No effect    limits.deadline_s, flight_time_s"""

P4_TEXT = """\
Optimum      rest 392.14 s at b1, hover 719.54 s at hover
What binds   Charge and deadline bind.

Binding      charge left  5 % ≥ 5 %
             deadline     1111.68 ≤ 1111.68 s

To spare     719.54 s   hover time: 719.54 ≥ 0 s
             392.144 s  rest time: 392.144 ≥ 0 s

Proof        on this route no point that satisfies all of these is better:
             735.366 ×   charge left  0.00122098·Δ − 0.000138889·T' ≤ 0.824078
             0.102134 ×  deadline     Δ + T' ≤ 1111.68
             sum                      Δ ≤ 719.54

Prices       s of hover per unit of a parameter, the others held:
             battery.packs        N = 2               +349.299
             battery.capacity_As  B_i = 36000 A s     +0.0194055
             limits.min_soc       η0 = 0.05           −735.366
             limits.deadline_s    T_max = 1200 s      +0.102134
             flight_charge_As     Q_fl = 9066.42 A s  −0.0102134
             hover_current_A      I_hv = 87.9104 A    −7.34896
             rest_current_A       I_rest = 10 A       +4.00513
             flight_time_s        T_fl = 88.3163 s    −0.102134

One more     one more pack gives 349 s of hover
             one more A s of the capacity of a pack gives 0.0194 s of hover
             0.01 more of the charge to be left costs 7.35 s of hover
             one more second of the deadline gives 0.102 s of hover
             one more A s of the charge for the flights costs 0.0102 s of hover
             one more ampere of the current in hover costs 7.27 s of hover
             one more ampere of the current at rest gives 3.96 s of hover
             one more second of the flight time costs 0.102 s of hover

Note         battery.charge_current_A = 10 A caps the charging current wherever
             the laser is in sight: a stronger laser changes nothing there"""

SHORT_TEXT = """\
Feasible if  one of these holds:
             limits.deadline_s >= 75.8                     now 60
             link.transmit_power_W >= 109                  now 5
             link.snr_threshold_dB <= -22                  now -11
             body.mass_kg <= 0.931                         now 1.3
             1240 <= rotor.max_speed_rad_s <= 110000       now 1060
             link.path_loss_exponent <= 1.66               now 2
             rotor.lift_coefficient_N_s2_rad2 >= 5.19e-06  now 3.8305e-06
             link.noise_power_W <= 8.08e-06                now 0.0001
             each is a single change; places were not moved

Conflict     on origin → hover → destination: range of the hover time cannot
             hold (limits.deadline_s); the proof:
             1 ×  range of the hover time  −Δ ≤ 0
             1 ×  range of the hover time  Δ ≤ −15.7922
             sum                           0 ≤ −15.7922, which is false

Conflict     on 20 routes, such as origin → b1 → hover → destination: range of
             the hover time, hover time ≥ 0, rest time ≥ 0 cannot hold together
             (limits.deadline_s); the proof:
             1 ×  range of the hover time  Δ + T' ≤ −28.3163
             1 ×  hover time ≥ 0           −Δ ≤ 0
             1 ×  rest time ≥ 0            −T' ≤ 0
             sum                           0 ≤ −28.3163, which is false

Exact        rounded here; --json gives exact fractions"""


def prices(explained: Explanation) -> dict[str, Price]:
    return {each.name: each for each in explained.prices}


# Words ------------------------------------------------------------------------------------------


def below_the_head(explained: Explanation) -> str:
    """The text without mission, problem and answer, which are those of the plan's summary."""
    head, _, rest = str(explained).partition("\n\n")
    assert explained.plan.summary().startswith(head)
    return rest


def test_the_words_for_the_direct_route_of_the_paper() -> None:
    assert below_the_head(explain("paper", perspective="battery", problem="P3")) == P3_TEXT


@pytest.mark.parametrize(
    ("changes", "perspective"),
    [
        ({}, "available"),
        ({"limits.min_soc": 0.99}, "battery"),
        ({"limits.deadline_s": 60}, "available"),
    ],
)
def test_long_names_break_neither_formulas_nor_prices(
    changes: dict[str, float], perspective: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every comparison has both sides on its line, every price its number, within 80 columns.

    Repairs name no building; they are not looked for.
    """
    told = importlib.import_module("optuav.diagnosis.explain")
    monkeypatch.setattr(told, "repairs", lambda question: ())
    town = [each.model_dump() for each in optuav.load("paper").buildings[:3]]
    for each in town:
        each["name"] = f"roof {each['name']} of the national research centre for light and flight"
    mission = optuav.load("paper").replace({**changes, "buildings": town})
    lines = str(explain(mission, perspective=perspective)).splitlines()
    assert max(map(len, lines)) <= 80
    for line in lines:
        assert not re.search(r"(≤|≥|<=|>=|·|/|−)$", line), line
    if not changes:
        start = next(k for k, line in enumerate(lines) if line.startswith("Prices"))
        assert all(" = " in line for line in lines[start + 1 : lines.index("", start)])


def test_the_words_for_one_rest_on_b1() -> None:
    assert below_the_head(explain("paper", optuav.P4("b1"), perspective="battery")) == P4_TEXT


def test_what_binds_comes_first_in_words_and_the_rows_are_folded() -> None:
    """Without a label or a symbol: when the available well is empty; a notebook folds 18 rows."""
    explained = explain("paper")
    text = " ".join(str(explained).split())
    assert (
        "What binds The available well binds, the deadline does not. Binding available well empty "
        "on landing at b10 available well empty on landing at the destination To spare"
    ) in text
    for stated in (explained, explain("paper", perspective="battery"), explain("paper", "P2")):
        said = str(stated).partition("Binding")[2].partition("Prices")[0]
        assert not re.search(r"P\d\.|y_|η|bounds of|state of charge", said)
    shown = explained._repr_html_()
    assert "The available well binds, the deadline does not." in shown
    assert "<details><summary>Constraints (" in shown
    words = {each.words for each in explained.constraints if each.binds}
    assert words == {
        "available well empty on landing at b10",
        "available well empty on landing at the destination",
    }


def test_the_words_for_a_deadline_that_is_too_short() -> None:
    assert (
        below_the_head(explain(PAPER.replace({"limits.deadline_s": 60}), perspective="battery"))
        == SHORT_TEXT
    )


@pytest.mark.parametrize(
    ("changes", "options"),
    [
        ({}, {}),
        ({}, {"slot_s": 10.0, "problem": "P3", "perspective": "wells"}),
        ({}, {"problem": "P2-tight", "perspective": "adjusted"}),
        ({"limits.deadline_s": 80}, {"problem": optuav.P4("b1"), "slot_s": 10.0}),
    ],
)
def test_no_line_is_longer_than_eighty_columns(
    changes: dict[str, Any], options: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    only(monkeypatch, "limits")
    explained = explain(SMALL.replace(changes), **{"perspective": "battery", **options})
    assert max(map(len, str(explained).splitlines())) <= 80
    assert bool(explained) is (not changes)
    assert json.loads(json.dumps(explained.to_dict(), allow_nan=False))["mission"] == "paper"


# Numbers ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "key", "step"),
    [
        ({"problem": "P3"}, "limits.min_soc", 1e-4),
        ({"problem": "P3"}, "battery.capacity_As", 1.0),
        ({"problem": "P3"}, "limits.deadline_s", 0.01),
        ({"problem": optuav.P4("b1")}, "limits.deadline_s", 0.01),
        ({}, "battery.capacity_As", 1.0),
        ({"perspective": "energy"}, "battery.capacity_As", 1.0),
        ({"perspective": "adjusted"}, "battery.capacity_As", 1.0),
    ],
)
def test_prices_are_finite_differences_of_solve(
    options: dict[str, Any], key: str, step: float
) -> None:
    """And the sentence says the same number, for one more unit (or 0.01)."""
    explained = explain("paper", **{"perspective": "battery", **options})
    price = next(each for each in explained.prices if each.key == key)
    table, name = key.split(".")
    now = getattr(getattr(PAPER, table), name)

    def hover_s(value: float) -> float:
        return optuav.solve(
            PAPER.replace({key: value}), **{"perspective": "battery", **options}
        ).hover_time_s

    difference = (hover_s(now + step) - hover_s(now - step)) / (2.0 * step)
    assert price.more == pytest.approx(difference, rel=1e-5, abs=1e-9)
    assert price.less == pytest.approx(difference, rel=1e-5, abs=1e-9)
    gained = hover_s(now + price.step) - hover_s(now)
    assert price.gain == pytest.approx(gained, rel=1e-9, abs=1e-9)
    words = " ".join(str(explained).split())
    if gained:
        verb = "gives" if gained > 0 else "costs"
        sentence = rf"more (?:\S+ )*?{WORDS[key]} {verb} (\S+) s of hover"
        (number,) = re.findall(sentence, words)
        assert float(number) == pytest.approx(abs(gained), rel=6e-3)
    else:
        heading = "One stop" if explained.more_stops_open else "No effect"
        assert key in words.partition(heading)[2]


def test_one_more_pack_is_solved_not_extrapolated() -> None:
    """A third pack is worth less than its rate: the deadline takes over on the way."""
    mission = optuav.load("paper-table2")
    price = prices(explain(mission, perspective="battery"))["packs"]
    gained = (
        optuav.solve(
            mission.replace({"battery.packs": 3, "battery.flight_energy_J": None}),
            perspective="battery",
        ).hover_time_s
        - optuav.solve(mission, perspective="battery").hover_time_s
    )
    assert price.gain == pytest.approx(gained, abs=1e-6)
    assert price.gain < 0.5 * price.more


def test_one_more_pack_is_solved_again_through_the_wells_too() -> None:
    """In `available` the deadline takes over: 930.68 s with three packs, 597.27 s with two."""
    price = prices(explain(PAPER))["packs"]
    assert price.solved_again
    assert price.gain == pytest.approx(930.68 - 597.27, abs=0.01)
    assert price.gain < price.more - 5.0


@pytest.mark.parametrize("perspective", ["battery", "available"])
def test_without_any_pack_there_is_no_plan(perspective: str) -> None:
    one = PAPER.replace({"battery.packs": 1, "battery.capacity_As": 72000})
    price = prices(explain(one, problem="P3", perspective=perspective))["packs"]
    assert price.solved_again
    assert math.isinf(price.loss)


def test_steps_stay_within_what_a_key_may_be() -> None:
    """A percent more of 99 % would leave nothing bound."""
    nearly_all = PAPER.replace({"battery.available_fraction": 0.99})
    price = prices(explain(nearly_all, problem="P3"))["available_fraction"]
    assert price.step == pytest.approx(0.001)
    assert math.isfinite(price.gain)


def test_rounding_is_no_change() -> None:
    """Where charge and deadline end the hover together, another second brings nothing at all."""
    options = {"perspective": "battery", "problem": optuav.P1(trajectory="direct")}
    both = PAPER.replace({"limits.deadline_s": 764.6402552772585})
    explained = explain(both, **options)
    assert prices(explained)["deadline_s"].gain == 0.0
    assert "one more second of the deadline changes nothing" in " ".join(str(explained).split())


def test_one_more_pack_holds_more_joules_at_the_voltages_of_the_loads() -> None:
    """In `adjusted` E_1 and E_2 grow with the battery unless the mission states them."""
    price = prices(explain(PAPER, perspective="adjusted"))["packs"]
    more = optuav.solve(PAPER.replace({"battery.packs": 3}), perspective="adjusted")
    now = optuav.solve(PAPER, perspective="adjusted")
    assert price.gain == pytest.approx(more.hover_time_s - now.hover_time_s, abs=1e-6)
    assert price.gain == pytest.approx(358.0, abs=1.0)


def test_the_price_of_flight_time_is_that_of_an_edited_leg() -> None:
    """0.01 s more on the leg to the hover point, its charge held."""
    view = optuav.graph(SMALL)
    options = {"problem": optuav.P4("b1", order="rest-first")}
    price = prices(explain(SMALL, **{"perspective": "battery", **options}))["flight_time_s"]
    before = optuav.solve(SMALL, **{"perspective": "battery", **options}).hover_time_s
    view.edges["b1", "hover"]["duration_s"] += 0.01
    after = optuav.solve(SMALL, graph=view, **{"perspective": "battery", **options}).hover_time_s
    assert price.more == pytest.approx((after - before) / 0.01, rel=1e-6)


def test_where_routes_tie_the_price_of_a_figure_is_that_of_all() -> None:
    """b1 first and b2 last are equal: an ampere less for both to rest with costs 4.05 s."""
    explained = explain("paper", perspective="battery")
    found = prices(explained)
    rest, flight = found["rest_current_A"], found["flight_time_s"]
    assert not any(each.has_kink for each in (rest, flight))
    assert rest.loss == pytest.approx(-4.05, abs=0.01)
    assert rest.loss == pytest.approx(-rest.less, rel=0.02)
    assert flight.more == pytest.approx(-found["deadline_s"].more)
    assert "2 routes tie (b1 → hover, hover → b2): a price" in " ".join(str(explained).split())


def test_at_the_end_of_a_range_a_price_has_one_side() -> None:
    """No less than k_F = 0 is allowed, and it says so; more brings hover."""
    still = PAPER.replace({"battery.flow_rate_per_s": 0.0})
    explained = explain(still, "P3")
    price = prices(explained)["flow_rate_per_s"]
    assert (math.isnan(price.less), math.isnan(price.loss)) == (True, True)
    assert price.more == pytest.approx(262_817, rel=1e-5)
    text = " ".join(str(explained).split())
    assert "k_F = 0 1/s end of the range below, +262817 above" in text
    assert "flow_rate_per_s" not in text.partition("No effect")[2]
    (row,) = (e for e in explained.to_dict()["prices"] if e["name"] == "flow_rate_per_s")
    assert (row["less"], row["loss"]) == (None, None)


def test_the_dual_values_of_the_paper() -> None:
    """Δ grows by I_ch/(I_hv + I_ch) = 10/(87.9104 + 10) s a second of deadline."""
    found = prices(explain("paper", perspective="battery"))
    assert found["deadline_s"].more == pytest.approx(10 / 97.9104, rel=1e-5)
    assert found["min_soc"].more == pytest.approx(-72000 / 97.9104, rel=1e-5)
    direct = prices(explain("paper", perspective="battery", problem="P3"))
    assert direct["min_soc"].more == pytest.approx(-72000 / 87.9104, rel=1e-5)
    assert not direct["deadline_s"].matters


def test_what_binds() -> None:
    explained = explain("paper", optuav.P4("b1"), perspective="battery")
    assert {each.label for each in explained.constraints if each.binds} == set(
        explained.plan.binding
    )
    spare = {each.label: each.slack for each in explained.constraints if not each.binds}
    assert spare["bounds of Δ"] == pytest.approx(719.5399, abs=1e-4)


# Subjects ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"problem": optuav.P4("b9", order="hover-first"), "perspective": "energy"},
        {"problem": "P3", "slot_s": 10.0},
    ],
)
def test_a_saved_plan_is_explained_as_its_question(options: dict[str, Any], tmp_path: Path) -> None:
    plan = optuav.solve("paper", **{"perspective": "battery", **options})
    plan.save(tmp_path / "plan.json")
    from_file = explain(optuav.load_plan(tmp_path / "plan.json"))
    assert str(from_file) == str(explain("paper", **{"perspective": "battery", **options}))
    assert str(from_file) == str(
        explain(optuav.formulate("paper", **{"perspective": "battery", **options}))
    )


def test_a_saved_plan_that_does_not_exist_is_diagnosed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    only(monkeypatch, "limits")
    plan = optuav.solve(
        SMALL.replace({"limits.deadline_s": 80}), optuav.P4("b1"), perspective="battery"
    )
    plan.save(tmp_path / "plan.json")
    explained = explain(optuav.load_plan(tmp_path / "plan.json"))
    assert not explained
    assert "limits.deadline_s >= 88.4" in map(str, explained.repairs)
    (conflict,) = explained.conflicts
    assert conflict.routes == 2
    assert conflict.certificates[0].keys == ("limits.deadline_s",)


class Shortest(Formulation):
    """Least rest that allows a hover of ten minutes."""

    def declare(self, model: Model, given: Given) -> None:
        """Minimise T'."""
        hover = model.variable("hover_time_s", "Δ", unit="s", lower=600.0)
        rest = model.variable("rest_time_s", "T'", unit="s")
        model.minimise(rest)
        model.subject_to("charge", given.soc_end(hover, rest) >= given.min_soc)
        model.subject_to("deadline", hover + rest <= given.time_left, unit="s")


class Endless(Formulation):
    """Longest hover with nothing to end it."""

    def declare(self, model: Model, given: Given) -> None:
        """Maximise Δ."""
        model.maximise(model.variable("hover_time_s", "Δ", unit="s"))


def test_a_formulation_of_ones_own_is_explained() -> None:
    """Less deadline never helps to rest less; a lower reserve saves rest."""
    mission = SMALL.replace({"battery.capacity_As": 30000})
    explained = explain(mission, perspective="battery", problem=Shortest(building="b1"))
    assert explained.objective == "s of rest"
    price = prices(explained)["min_soc"]
    assert price.more == pytest.approx(60000 / 10, rel=1e-6)
    assert "costs" in str(explained)
    assert explained.bound is not None
    assert explained.bound.holds()
    assert -float(explained.bound.limit) == pytest.approx(explained.plan.rest_time_s, abs=1e-9)
    with pytest.raises(InputError, match="is not of the paper"):
        explain(explained.plan)


class LeastRest(Formulation):
    """Least rest for a hover of 560 s, in whatever perspective."""

    def declare(self, model: Model, given: Given) -> None:
        """Minimise T'."""
        hover, rest = given.hover_and_rest(model)
        model.minimise(rest)
        model.subject_to("wanted hover", hover == 560.0, unit="s")
        given.keep_wells(model, "battery", hover, rest)
        given.keep_deadline(model, "deadline", hover, rest)


def test_what_is_not_solved_again_is_not_told_of_a_whole_unit() -> None:
    """At its rate a third pack would save more rest than the plan has."""
    asked = LeastRest(building="b1", order="hover-first")
    explained = explain(SMALL, asked, perspective="available")
    price = prices(explained)["packs"]
    assert -price.more > explained.plan.rest_time_s > 0.0
    assert not price.solved_again
    assert plain(price)["gain"] is plain(price)["loss"] is None
    words = " ".join(str(explained).split())
    assert "s of rest per unit of a parameter, the others held, for small changes:" in words
    assert "One more" not in words


def test_what_nothing_keeps_finite_is_said() -> None:
    explained = explain("paper", perspective="battery", problem=Endless())
    assert not explained
    assert "keeps the objective finite" in str(explained)
    assert "Feasible if" not in str(explained)


def test_the_problem_may_be_the_second_argument() -> None:
    """As in `solve` and `formulate`, in `repairs` too."""
    options = {"perspective": "battery"}
    assert explain(SMALL, optuav.P4("b1"), **options).plan.building == "b1"
    lacking = SMALL.replace({"battery.capacity_As": 30000})
    assert explain(lacking, Shortest(building="b1"), **options).objective == "s of rest"
    late = SMALL.replace({"limits.deadline_s": 85})  # enough for P3 alone
    assert repairs(late, "P3", **options) == ()


def test_options_go_with_a_mission_only() -> None:
    plan = optuav.solve("paper", "P3", perspective="battery")
    with pytest.raises(InputError, match="problem: a plan has its own options"):
        explain(plan, problem="P3")
    with pytest.raises(InputError, match="problem"):
        explain("paper", problem="P5")


def test_a_plan_over_an_edited_graph_does_not_tell_its_question() -> None:
    view = optuav.graph(SMALL)
    view.edges["origin", "hover"]["duration_s"] = 50.0
    plan = optuav.solve(SMALL, "P3", graph=view, perspective="battery")
    with pytest.raises(InputError, match="graph="):
        explain(plan)
    program = optuav.formulate(SMALL, "P3", graph=view, perspective="battery")
    assert str(explain(program)) == str(
        explain(SMALL, problem="P3", graph=view, perspective="battery")
    )


def test_infinite_prices_are_null_in_data() -> None:
    """Where the legs take all the time, one second less leaves no plan."""
    asked = {"problem": "P3", "perspective": "battery"}
    plan = optuav.solve(PAPER, **asked)
    flight_s = plan.mission_time_s - plan.hover_time_s
    explained = explain(PAPER.replace({"limits.deadline_s": flight_s}), **asked)
    found = prices(explained)["deadline_s"]
    assert math.isinf(found.less)
    assert plain(found)["less"] is None
    assert "no plan below, +1 above" in str(explained)


@pytest.mark.parametrize("problem", ["P1", "P2"])
def test_figures_of_the_hover_point_have_no_price(problem: str) -> None:
    """At z_min = 50 m: with 60 m the hover point moves up, which the programme cannot tell."""
    higher = PAPER.replace({"limits.min_altitude_m": 60})
    assert optuav.solve(higher, problem, perspective="battery").status is Status.OPTIMAL
    explained = explain(PAPER, problem=problem, perspective="battery")
    assert "min_altitude_m" not in prices(explained)
    assert "edge" not in str(explained)


def test_a_free_hover_point_is_held_and_said_so() -> None:
    """A second more is worth what solving again with the point held and 1 s more brings."""
    explained = explain(SMALL, optuav.P1(hover_point="free"), perspective="battery")
    assert explained.notes[0].startswith("constraints and prices are those at the hover point")
    assert "at the hover point found" in " ".join(str(explained).split())
    held = SMALL.replace({"route.hover_m": list(explained.plan.mission.route.hover_m or ())})
    later = held.replace({"limits.deadline_s": held.limits.deadline_s + 1.0})
    before, after = (optuav.solve(each, perspective="battery") for each in (held, later))
    assert before.hover_time_s == pytest.approx(explained.plan.hover_time_s, abs=1e-4)
    (price,) = [each for each in explained.prices if each.key == "limits.deadline_s"]
    assert price.more == pytest.approx(after.hover_time_s - before.hover_time_s, abs=1e-6)


def test_without_a_plan_a_free_hover_point_is_told_of_the_nearest(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    only(monkeypatch, "limits")
    explained = explain(
        SMALL.replace({"buildings": [], "limits.deadline_s": 60}),
        optuav.P1(hover_point="free"),
        perspective="battery",
    )
    assert not explained
    assert explained.notes[0].startswith("this is for hovering at w_U")
    assert {each.key for each in explained.repairs} >= {"limits.deadline_s"}


# More stops -------------------------------------------------------------------------------------

LONG = PAPER.replace({"limits.deadline_s": 3000})


def test_what_more_stops_would_change_is_not_said_to_have_no_effect() -> None:
    """With 3000 s, one rest and one hover leave 2056 s unused; two hovers gain 212.77 s of them."""
    explained = explain(LONG)
    assert explained.plan.hover_time_s == pytest.approx(597.27, abs=0.01)
    assert explained.more_stops_open
    words = " ".join(str(explained).split())
    assert "--stops 2 --hovers 2" in words
    assert "P1(stops=2, hovers=2)" in words
    assert "No effect" not in words
    idle = words.partition("One stop")[2].partition("Note")[0]
    assert "limits.deadline_s" in idle
    assert "with more stops it may change" in idle


def test_more_stops_are_excluded_where_one_stop_reaches_what_charge_admits() -> None:
    """Legs obey the triangle inequality: in linear perspectives one stop is enough."""
    explained = explain(LONG, perspective="battery")
    assert not explained.more_stops_open
    assert "--stops" not in str(explained)


def test_a_search_for_more_stops_tells_what_they_bring() -> None:
    """As `solve` with two hovers and with one: 810.04 s, 597.27 s, and their difference."""
    explained = explain(LONG, optuav.P1(stops=2, hovers=2))
    assert explained.plan.hover_time_s == pytest.approx(810.043, abs=1e-3)
    assert explained.gain_s == pytest.approx(212.77, abs=0.01)
    assert explained.to_dict()["gain_s"] == explained.gain_s
    words = " ".join(str(explained).split())
    assert "810.04 s of hover, 212.77 s longer than with one rest and one hover" in words


def test_more_stops_that_bring_nothing_leave_the_explanation_of_one() -> None:
    """Prices and constraints are those of one rest and one hover."""
    explained = explain(SMALL, optuav.P1(stops=2, hovers=2), perspective="battery")
    alone = explain(SMALL, perspective="battery")
    assert explained.gain_s == 0.0
    assert "at most 2 rests and 2 hovers gain nothing" in " ".join(str(explained).split())
    assert (explained.prices, explained.constraints) == (alone.prices, alone.constraints)


def test_what_is_proved_of_more_stops_is_not_contradicted() -> None:
    """Two rests and two hovers gain nothing in `matrice350` with a reserve at the end."""
    explained = explain(optuav.load("matrice350").replace(SLOW), optuav.P1(stops=2, hovers=2))
    words = " ".join(str(explained).split())
    assert "at most 2 rests and 2 hovers gain nothing" in words
    assert "with more stops it may change" in words
    assert "more stops might gain" not in words


@pytest.mark.parametrize("perspective", ["battery", "available"])
def test_what_caps_the_charging_current_is_named(perspective: str) -> None:
    """A laser of 1e9 W charges no faster than battery.charge_current_A."""
    strong = PAPER.replace({"laser.power_W": 1e9})
    plans = [optuav.solve(each, perspective=perspective) for each in (PAPER, strong)]
    assert plans[0].hover_time_s == pytest.approx(plans[1].hover_time_s, abs=1e-6)
    notes = explain(strong, perspective=perspective).notes
    assert any("battery.charge_current_A = 10 A caps the charging current" in n for n in notes)
    faster = strong.replace({"battery.charge_current_A": 20})
    assert optuav.solve(faster, perspective=perspective).rest_time_s != plans[1].rest_time_s


def test_without_a_rest_no_cap_is_named() -> None:
    assert explain(PAPER, "P3", perspective="battery").notes == ()


def test_own_parameters_of_a_row_without_unknowns_are_shown() -> None:
    """Of the 1124.2078 s that the flight leaves, 500 s are to be to spare: 624.2078 s are."""
    explained = explain(SMALL, InTime(500), perspective="battery")
    (side,) = (each for each in explained.constraints if each.label == "to spare")
    assert (side.slack, side.binds) == (pytest.approx(624.2078, abs=1e-4), False)
    (price,) = (each for each in explained.prices if each.name == "spare_s")
    assert (price.value, price.gain, price.matters) == (500.0, 0.0, False)
    assert "spare_s" in str(explained).partition("No effect")[2]


def test_a_saved_plan_is_explained_as_the_plan(tmp_path: Path) -> None:
    """In Python as by the command, and refused where its simulation contradicts it."""
    plan = optuav.solve("paper", "P3", perspective="battery")
    file = plan.save(tmp_path / "plan.json")
    assert str(optuav.explain(file)) == str(optuav.explain(plan))
    wrong = file.read_text("utf-8").replace('"peak_speed_m_s": ', '"peak_speed_m_s": 1')
    file.write_text(wrong, "utf-8")
    with pytest.raises(InputError, match=r"plan\.json: its simulation contradicts this plan"):
        optuav.explain(str(file))


def test_what_binds_of_a_problem_of_ones_own_has_its_labels() -> None:
    """Neither is said to bind alone where constraints without a kind do."""

    @dataclass(frozen=True)
    class LeastRest(optuav.Formulation):
        """Least rest for a wanted hover time."""

        wanted_hover_s: float = 700.0
        label: str = "wanted hover"

        def declare(self, model: Any, given: Any) -> None:
            hover, rest = given.hover_and_rest(model)
            model.minimise(rest)
            model.subject_to(self.label, hover >= self.wanted_hover_s, unit="s")
            model.subject_to("charge", given.soc_end(hover, rest) >= given.min_soc)
            given.keep_deadline(model, "deadline", hover, rest)

    words = str(optuav.explain("paper", LeastRest(), perspective="battery"))
    assert "What binds   Wanted hover and charge bind." in words
    symbol = str(optuav.explain("paper", LeastRest(label="w"), perspective="battery"))
    assert "What binds   w and charge bind." in symbol


def test_the_current_over_a_device_is_named_and_has_its_share_of_the_price() -> None:
    """Charge and deadline bind: Δ = (σ + gτ)/(Ī + g), so that an ampere costs share·Δ/(Ī + g)."""
    shares = {"market": 0.5, "quay": 0.3, "school": 0.2}
    mission = optuav.load("three-sensors").replace(
        {f"devices.{name}.share": share for name, share in shares.items()}
    )
    explained = optuav.explain(mission)
    prices = {price.device: price for price in explained.prices if "hover_current" in price.name}
    rest = next(price for price in explained.prices if price.name == "rest_current_A")
    each_A = explained.plan.hover_time_s / (prices[""].value + rest.value)
    assert prices[""].more == pytest.approx(-each_A, rel=1e-6)
    for name, share in shares.items():
        price = prices[name]
        assert (price.more, price.less) == pytest.approx((-share * each_A,) * 2, rel=1e-6)
        assert price.gain == pytest.approx(price.more, rel=0.05)  # A whole ampere, solved again
    text = str(explained)
    assert "hover_current_A over market" in text
    assert "current in hover over school costs" in " ".join(text.split())
    assert "the draw up to the hover point of market" in " ".join(text.split())
    assert "hover_current_A[" not in text
    assert "landing_" not in text


def test_a_few_conflicts_stand_for_those_of_many_routes() -> None:
    """Repairs and the conflicts of the fastest routes; all of them are in the data."""
    explained = optuav.explain("three-sensors", optuav.P2(hover_time_s=99_999))
    text = str(explained)
    assert len(explained.conflicts) == 7
    assert text.index("hover_time_s <= 2350") < text.index("Conflict")
    assert text.count("\nConflict") == sum(len(e.proofs) for e in explained.conflicts[:3])
    left = sum(conflict.routes for conflict in explained.conflicts[3:])
    assert f"{left} routes have conflicts of their own" in text


def test_a_rest_that_has_to_lie_between_is_explained() -> None:
    """A building stands between both hover points, and every plan flies around it by its roof."""
    at_m = {"p": [800.0, 1500.0, 50.0], "q": [800.0, 2000.0, 50.0]}
    devices = [
        {"name": name, "position_m": [x - 100.0, y, 0.0], "hover_m": [x, y, z]}
        for name, (x, y, z) in at_m.items()
    ]
    mission = PAPER.replace({"limits.deadline_s": 1800, "devices": devices})
    explained = optuav.explain(mission)
    assert explained.plan.route == ("origin", "p", "b9", "q", "destination")
    why = "the rest lies between the hovers over p and q: without a rest there, no plan exists"
    assert why in explained.notes
    assert not answers(mission, {}).get("faults")
