"""Comparisons by method: what agrees is said to agree, and what does not is found out."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest

import optuav
from formulations.algorithms import algorithm1, best_pair
from optuav.engines import grid
from optuav.engines.casadi_engine import Casadi
from optuav.engines.cvxpy_engine import Cvxpy
from optuav.engines.solution import Solution
from optuav.errors import InputError, SolverError
from optuav.status import Status
from optuav.studies.compare_methods import MethodAnswer, MethodComparison
from tests.several_devices import three

SLOTS_S = (1.0, 60.0)
in_battery = partial(optuav.compare, perspective="battery")


def two_buildings(name: str = "paper", **values: Any) -> optuav.Mission:
    """A shipped mission with b1 and b9 alone."""
    mission = optuav.load(name)
    kept = [each.model_dump() for each in mission.buildings if each.name in ("b1", "b9")]
    return mission.replace(
        {"buildings": kept} | {k.replace("__", "."): v for k, v in values.items()}
    )


def one_building(name: str = "paper", **values: Any) -> optuav.Mission:
    """A shipped mission with b1 alone."""
    mission = two_buildings(name, **values)
    return mission.replace({"buildings": [each.model_dump() for each in mission.buildings[:1]]})


def name(row: MethodAnswer) -> str:
    """The problem of a row with its building and order."""
    return " ".join(row[part] for part in ("problem", "building", "order") if row[part])


def names(found: MethodComparison) -> list[str]:
    return list(dict.fromkeys(map(name, found.rows)))


def cell(found: MethodComparison, problem: str, method: str) -> MethodAnswer:
    """The only row of a problem and a method by their names."""
    (only,) = [row for row in found.rows if (name(row), row["method"]) == (problem, method)]
    return only


@pytest.fixture(scope="module")
def paper() -> MethodComparison:
    """The mission `paper` with two buildings, by every method."""
    return in_battery(two_buildings(), slots_s=SLOTS_S)


def test_rows_and_columns(paper: MethodComparison) -> None:
    assert names(paper) == [
        "P3",
        "P4 b1 rest-first",
        "P4 b1 hover-first",
        "P4 b9 rest-first",
        "P4 b9 hover-first",
        "P1",
    ]
    methods = list(dict.fromkeys(row["method"] for row in paper.rows))
    assert methods == [
        "closed form",
        "LP",
        "CasADi wells",
        "grid 1 s",
        "MILP 1 s",
        "grid 60 s",
        "MILP 60 s",
    ]
    assert len(paper.rows) == len(names(paper)) * len(methods)


def test_everything_agrees_on_the_paper(paper: MethodComparison) -> None:
    assert paper.agrees
    assert paper.disagreements == paper.failures == ()
    assert all(row["agrees"] for row in paper.rows)


@pytest.mark.parametrize(
    ("row", "hover_time_s"),
    [("P3", 688.848), ("P4 b1 rest-first", 719.5399), ("P1", 719.5399)],
)
def test_continuous_methods_find_the_check_numbers_of_the_specification(
    paper: MethodComparison, row: str, hover_time_s: float
) -> None:
    for method in ("closed form", "LP", "CasADi wells"):
        found = cell(paper, row, method)
        assert found["hover_time_s"] == pytest.approx(hover_time_s, abs=1e-3)
        assert abs(found["gap_s"] or 0.0) < 1e-6
        assert found["largest_gap_s"] is None


@pytest.mark.parametrize("order", ["rest-first", "hover-first"])
@pytest.mark.parametrize("method", ["grid 60 s", "MILP 60 s"])
def test_slots_are_those_of_algorithm_1_as_printed(
    paper: MethodComparison, order: str, method: str
) -> None:
    """Its two loops over Δ and T', with the charge counted from the phases of a plan."""
    plan = optuav.solve(two_buildings(), optuav.P4("b9", order=order), perspective="battery")
    drawn_As = sum(-p.current_A * p.duration_s for p in plan.phases if p.kind == "flight")
    current = {phase.kind: phase.current_A for phase in plan.phases}

    def soc(hover_s: float, rest_s: float) -> float:
        used = drawn_As - current["hover"] * hover_s - current["rest"] * rest_s
        return 1.0 - used / 72_000.0

    pair = best_pair(algorithm1(soc, 1200.0 - plan.flight_time_s, 0.05, 60.0))
    assert pair is not None
    found = cell(paper, f"P4 b9 {order}", method)
    assert found["hover_time_s"] == pair[0]
    assert found["gap_s"] == pytest.approx(plan.hover_time_s - pair[0])


def test_the_relaxation_of_the_choice_of_a_route_is_printed(paper: MethodComparison) -> None:
    """The convex hull leaves nothing over SPEC's 719.540 s, in slots neither."""
    bounds = [row["relaxation_s"] for row in paper.rows if row["relaxation_s"] is not None]
    assert bounds == pytest.approx([719.540] * (1 + len(SLOTS_S)), abs=1e-3)
    assert "its LP relaxation bounds Δ by 719.540 s\n" in str(paper)


def test_bounds_are_one_slot_or_two(paper: MethodComparison) -> None:
    assert cell(paper, "P3", "grid 60 s")["largest_gap_s"] == 60.0
    found = cell(paper, "P4 b1 rest-first", "grid 60 s")
    assert found["largest_gap_s"] == 120.0
    assert "not a whole number of slots" in found["words"]
    flight_s = optuav.solve(
        two_buildings(), optuav.P4("b1", order="rest-first"), perspective="battery"
    ).flight_time_s
    whole = two_buildings(limits__deadline_s=flight_s + 1000.0)
    compared = in_battery(whole, slots_s=(10.0,), engines=("grid",))
    assert cell(compared, "P4 b1 rest-first", "grid 10 s")["largest_gap_s"] == 10.0
    assert cell(compared, "P4 b1 hover-first", "grid 10 s")["largest_gap_s"] == 20.0


def test_p1_is_the_best_row_in_every_column(paper: MethodComparison) -> None:
    for method in dict.fromkeys(row["method"] for row in paper.rows):
        own = [row for row in paper.rows if row["method"] == method]
        column = {name(row): row["hover_time_s"] for row in own}
        best = column.pop("P1")
        assert best == pytest.approx(max(each or 0.0 for each in column.values()), abs=1e-6)


def test_each_cell_says_how_it_knows(paper: MethodComparison) -> None:
    proofs = {row["engine"]: row["proof"] for row in paper.rows}
    assert proofs["grid"] == "exhaustive"
    assert proofs["casadi"].startswith("local")
    assert "duality" in proofs["closed-form"]
    assert "branch and bound" in cell(paper, "P1", "MILP 60 s")["proof"]


@pytest.mark.parametrize(
    "perspective", ["energy", pytest.param("adjusted", marks=pytest.mark.soak)]
)
def test_the_other_linear_perspectives(perspective: str) -> None:
    """CasADi takes their own statement; no wells are behind them."""
    found = in_battery(one_building("paper-table2"), slots_s=(5.0,), perspective=perspective)
    assert found.agrees
    methods = list(dict.fromkeys(row["method"] for row in found.rows))
    assert methods == ["closed form", "LP", "CasADi", "grid 5 s", "MILP 5 s"]
    slots = cell(found, "P3", "grid 5 s")["hover_time_s"]
    assert slots == (695.0 if perspective == "energy" else 950.0)  # Table II: 697 and 950


def test_plans_that_can_be_flown_are_compared_by_default() -> None:
    """Through both wells: SPEC's 597.270 s, and of slots no bound, as nothing there is linear."""
    found = optuav.compare(two_buildings(), slots_s=(1.0,))
    assert found.perspective == "available"
    assert found.agrees
    methods = list(dict.fromkeys(row["method"] for row in found.rows))
    assert methods == ["bracket", "CasADi", "grid 1 s"]
    for method in methods[:2]:
        assert cell(found, "P1", method)["hover_time_s"] == pytest.approx(597.270, abs=1e-3)
    in_slots = cell(found, "P3", "grid 1 s")
    assert in_slots["hover_time_s"] == 577.0  # of 577.524 s, the direct flight that lasts
    assert in_slots["largest_gap_s"] is None
    assert "has no bound where the model is not linear in the times." in str(found)


def test_no_bound_is_claimed_where_resting_discharges() -> None:
    mission = one_building(
        "paper-table2",
        flight__rest_current_A=9.0,
        flight__charge_current_A=None,
        flight__charge_power_W=None,
        laser=None,
    )
    found = in_battery(mission, slots_s=(10.0,), engines=("grid", "cvxpy"))
    assert found.agrees
    in_slots = cell(found, "P4 b1 rest-first", "grid 10 s")
    assert in_slots["largest_gap_s"] is None
    assert "no bound: a longer rest can break P4.a state of charge" in in_slots["words"]
    assert "The theory has no bound where a longer rest can break P4.a" in str(found)
    assert cell(found, "P3", "grid 10 s")["largest_gap_s"] == 10.0


def test_where_no_slots_fit_the_whole_hover_is_lost() -> None:
    """100 s are left of the deadline: less than a slot of hover and one of rest."""
    mission = one_building(limits__deadline_s=188.3)
    found = in_battery(mission, slots_s=(60.0,), engines=("grid", "cvxpy"))
    assert found.agrees
    lost = cell(found, "P4 b1 rest-first", "grid 60 s")
    assert lost["status"] == "infeasible"
    assert lost["hover_time_s"] is lost["gap_s"] is None
    assert lost["words"].startswith("99.98")
    assert cell(found, "P3", "grid 60 s")["hover_time_s"] == pytest.approx(
        188.3 - 75.7922, abs=1e-3
    )


def test_what_is_infeasible_for_all_agrees_and_says_why() -> None:
    found = in_battery(one_building(limits__deadline_s=60), slots_s=(10.0,))
    assert found.agrees
    assert all(row["hover_time_s"] is None for row in found.rows)
    assert {row["status"] for row in found.rows} == {"infeasible"}
    assert "the flight takes 75.79 s" in found.reasons["P1"][0]
    assert "the flight takes 75.79 s" in str(found)


def test_of_what_cannot_fly_everything_agrees_that_there_is_no_plan() -> None:
    found = in_battery(one_building(body__mass_kg=50), slots_s=(10.0,))
    assert all(row["hover_time_s"] is None for row in found.rows)
    assert found.agrees
    assert {row["status"] for row in found.rows} == {"infeasible"}
    assert all(found.reasons.values())
    assert "No problem has a plan: the UAV cannot fly" in str(found)


def test_a_mission_without_buildings_has_two_rows() -> None:
    found = in_battery(optuav.load("paper").replace({"buildings": []}), slots_s=(10.0,))
    assert names(found) == ["P3", "P1"]
    assert found.agrees


# Sabotage


def later(solve: Callable[..., Solution], by_s: float) -> Callable[..., Solution]:
    """An engine that returns a hover time that is off."""

    def sabotaged(*arguments: Any, **options: Any) -> Solution:
        found = solve(*arguments, **options)
        values = {**found.values, "hover_time_s": found.values["hover_time_s"] + by_s}
        return replace(found, values=values, objective=found.objective + by_s)

    return sabotaged


def p3_alone() -> optuav.Mission:
    return optuav.load("paper").replace({"buildings": []})


def test_an_engine_that_is_a_millisecond_off_is_found_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Cvxpy, "solve", later(Cvxpy.solve, -1e-3))
    found = in_battery(p3_alone(), slots_s=(), engines=("cvxpy",))
    assert not found.agrees
    assert found.disagreements[0] == "P3, LP: 0.001 s from the closed form"
    assert "DISAGREE  P3, LP: 0.001 s from the closed form" in str(found)
    assert "All" not in str(found)
    assert found.to_dict()["agrees"] is False


def test_a_local_optimum_below_the_bracket_is_found_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Casadi, "solve", later(Casadi.solve, -1e-3))
    found = optuav.compare(p3_alone(), slots_s=(), engines=("casadi",))
    assert found.disagreements[0] == "P3, CasADi: 0.001 s from the bracket"


@pytest.mark.parametrize(("by_s", "agrees"), [(-9.0, True), (-11.0, True), (-20.0, False)])
def test_a_grid_beyond_the_bound_is_found_out(
    monkeypatch: pytest.MonkeyPatch, by_s: float, agrees: bool
) -> None:
    """P3 of `paper` loses 8.848 s to slots of 10 s; the bound is one slot more than is lost."""
    monkeypatch.setattr(grid.Grid, "solve", staticmethod(later(grid.solve, by_s)))
    found = in_battery(p3_alone(), slots_s=(20.0,), engines=("grid",))
    assert cell(found, "P3", "grid 20 s")["gap_s"] == pytest.approx(8.848 - by_s, abs=1e-3)
    assert cell(found, "P3", "grid 20 s")["largest_gap_s"] == 20.0
    assert found.agrees is agrees


def test_slots_that_beat_continuous_times_are_found_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Solution, "verify", lambda *_: None)
    monkeypatch.setattr(grid.Grid, "solve", staticmethod(later(grid.solve, 10.0)))
    found = in_battery(p3_alone(), slots_s=(10.0,), engines=("grid",))
    assert not found.agrees
    assert cell(found, "P3", "grid 10 s")["gap_s"] == pytest.approx(-1.152, abs=1e-3)
    assert "−1.15!" in str(found)


def test_an_integer_programme_that_is_not_the_grid_is_found_out(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Even where both are within the bound."""
    monkeypatch.setattr(grid.Grid, "solve", staticmethod(later(grid.solve, -1.0)))
    found = in_battery(p3_alone(), slots_s=(10.0,), engines=("grid", "cvxpy"))
    assert found.disagreements[0] == "P3, MILP 10 s: grid 10 s finds Δ = 679.000000 s"


def test_a_plan_where_there_is_none_is_found_out(monkeypatch: pytest.MonkeyPatch) -> None:
    def nothing(_: Any, model: Any, programmes: int, *__: Any, **___: Any) -> Solution:
        gone = np.full(programmes, np.nan)
        unknowns = {each.name: gone for each in model.variables}
        return Solution("casadi", "", model, [Status.INFEASIBLE] * programmes, gone, unknowns)

    monkeypatch.setattr(Casadi, "solve", nothing)
    found = in_battery(p3_alone(), slots_s=(), engines=("casadi",))
    assert found.disagreements[0] == "P3, CasADi wells: no plan, but one with Δ = 688.848 s"


def test_an_engine_that_fails_is_no_disagreement(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: Any, **__: Any) -> Solution:
        raise SolverError("it broke")

    monkeypatch.setattr(Casadi, "solve", fails)
    found = in_battery(p3_alone(), slots_s=(10.0,), engines=("casadi", "grid"))
    assert found.agrees
    assert found.failures == ("P3, CasADi wells: it broke", "P1, CasADi wells: it broke")
    broken = cell(found, "P3", "CasADi wells")
    assert (broken["status"], broken["agrees"], broken["hover_time_s"]) == ("error", None, None)
    assert "FAILED  P3, CasADi wells: it broke" in str(found)


def test_a_time_limit_is_handed_to_the_engines() -> None:
    found = in_battery(p3_alone(), slots_s=(1.0,), engines=("grid",), time_limit_s=1e-9)
    failure = "P3, grid 1 s: grid saw 0 of 689 cells within the time limit"
    assert found.failures[0] == failure


# As data and as text


def test_the_same_question_gives_the_same_data() -> None:
    engines = ("cvxpy", "grid")
    once, again = (in_battery(p3_alone(), slots_s=(60.0,), engines=engines) for _ in range(2))
    assert again == once
    assert json.dumps(again.to_dict()) == json.dumps(once.to_dict())
    assert again.to_csv() == once.to_csv()


def test_times_taken_are_shown_only_on_request(paper: MethodComparison) -> None:
    assert "time_s" not in paper.to_dict()["rows"][0]
    assert "time_s" not in paper.records()[0]
    timed = in_battery(p3_alone(), slots_s=(), engines=(), times=True)
    assert timed.to_dict()["rows"][0]["time_s"] > 0.0
    assert timed.records()[0]["time_s"] > 0.0
    assert timed.units["time_s"] == "s"


def test_data_are_plain(paper: MethodComparison) -> None:
    data = paper.to_dict()
    assert json.loads(json.dumps(data, allow_nan=False)) == data
    assert data["kind"] == "optuav comparison"
    assert data["mission"] == paper.mission.to_dict()
    assert len(data["rows"]) == len(paper.rows)
    assert data["rows"][0].items() >= paper.records()[0].items()
    assert data["units"]["gap_s"] == "s"


def test_a_frame_has_a_row_a_cell(paper: MethodComparison) -> None:
    pytest.importorskip("pandas")
    frame = paper.to_frame()
    assert len(frame) == len(paper.rows) == 42
    p3 = frame[(frame.problem == "P3") & (frame.method == "grid 1 s")].iloc[0]
    assert (p3.hover_time_s, p3.slot_s, bool(p3.agrees)) == (688.0, 1.0, True)


def test_comma_separated_values_are_read_back(paper: MethodComparison) -> None:
    rows = list(csv.DictReader(io.StringIO(paper.to_csv())))
    assert len(rows) == 42
    assert [float(row["hover_time_s"]) for row in rows] == [
        row["hover_time_s"] for row in paper.rows
    ]
    assert rows[0]["building"] == ""


def test_printed_it_fits_80_columns(paper: MethodComparison) -> None:
    lines = str(paper).splitlines()
    assert max(map(len, lines)) <= 80
    assert lines == [line.rstrip() for line in lines]
    assert lines[2] == "All 42 answers agree."  # The verdict comes first
    row = ["P1", "719.540", "0.54", "59.54", "yes"]
    assert any(line.split() == row for line in lines)


def test_where_nothing_is_feasible_one_sentence_takes_the_place_of_the_tables() -> None:
    found = in_battery(two_buildings(limits__deadline_s=60), slots_s=(10.0,), engines=("grid",))
    head, gap, verdict, other, *words = str(found).splitlines()
    assert head.startswith("paper")
    assert not gap + other
    assert " ".join(map(str.strip, words)) == (
        "No problem has a plan: the flight takes 75.79 s, longer than limits.deadline_s = 60 s."
    )
    assert verdict == "All 12 answers agree that nothing is feasible."


def test_reasons_of_single_problems_are_shown_once_each() -> None:
    """At 80 s the direct flight fits, and no detour over a roof: P3 and P1 alone have plans."""
    found = in_battery(two_buildings(limits__deadline_s=80), slots_s=(1.0,), engines=("grid",))
    text = " ".join(str(found).split())
    assert "by every method All 12 answers agree, 4 of them with a plan." in text
    assert "P4 b1 rest-first has no plan: the flight takes 88.32 s" in text
    assert text.count("has no plan:") == 4


def test_many_slots_and_long_names_fit_80_columns() -> None:
    mission = optuav.load("paper").replace(
        {
            "buildings": [
                {"name": "the very highest [bold]roof[/] of all", "position_m": [50, 300, 60]}
            ]
        }
    )
    slots = (7.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 1000.0, 12345.678)
    text = str(in_battery(mission, slots_s=slots, engines=("grid",)))
    assert max(map(len, text.splitlines())) <= 80
    assert "the very highest [b" in text
    assert all(f"{slot_s:g} s" in text for slot_s in slots)


# Arguments


def test_all_faults_are_reported_at_once() -> None:
    with pytest.raises(InputError) as caught:
        in_battery(
            "paper",
            slots_s=(0.0, math.nan),
            perspective="wells",
            engines=("gurobi",),
            time_limit_s=-1,
        )
    keys = [fault.key for fault in caught.value.faults]
    assert keys == ["slots_s", "slots_s", "time_limit_s", "perspective", "engines"]


def test_a_length_twice_is_refused() -> None:
    with pytest.raises(InputError, match="each length once"):
        in_battery("paper", slots_s=(1.0, 1))


def test_progress_counts_every_problem() -> None:
    """(P1), which takes longest, begins first; its rows are the last."""
    calls: list[tuple[int, int, str]] = []
    found = in_battery(
        p3_alone(), slots_s=(10.0,), engines=("grid",), progress=lambda *news: calls.append(news)
    )
    assert calls == [(0, 2, "P1"), (1, 2, "P3")]
    assert [row["problem"] for row in found.rows] == ["P3", "P3", "P1", "P1"]
    assert [*found.reasons] == ["P3", "P1"]


def test_slots_of_several_devices_are_long_by_default_and_named() -> None:
    """Short slots on many routes took minutes; the text says which lengths were taken."""
    devices = three().to_dict()["devices"][:2]
    roofs = three().to_dict()["buildings"][:1]
    compared = optuav.compare(
        three().replace({"devices": devices, "buildings": roofs}), engines="grid"
    )
    assert {row["slot_s"] for row in compared.rows} == {None, 10.0, 60.0}
    words = "With several devices, slots of 10 and 60 s are compared by default."
    assert words in " ".join(str(compared).split())
    one = optuav.compare(two_buildings(), engines="grid", slots_s=[10, 60])
    assert "several devices" not in str(one)
