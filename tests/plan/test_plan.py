"""A plan: its times, its battery against SciPy's integration, and that it is whole."""

from __future__ import annotations

import copy
import math
import pickle
import sys
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

import optuav
from optuav import InputError, NoPlanError, Plan
from tests.examples import few
from tests.mission.strategies import missions
from tests.plan.made import INFEASIBLE, available_by_integration, feasible, plans
from tests.several_devices import plan_over_three

FIGURES = (
    "hover_time_s",
    "rest_time_s",
    "flight_time_s",
    "mission_time_s",
    "route",
    "stops",
    "peak_speed_m_s",
    "runs_dry_s",
    "overfull_s",
    "warnings",
)
LEVEL = 1e-6
"""Share of the capacity within which the integration is trusted."""


def check_whole(plan: Plan) -> None:
    """Phases follow each other in time and place, and the totals are theirs."""
    moment_s, place = 0.0, "origin"
    for phase in plan.phases:
        assert phase.start_s == pytest.approx(moment_s, abs=1e-9)
        assert phase.start_place == place
        assert phase.duration_s == pytest.approx(math.fsum(s.duration_s for s in phase.stages))
        assert phase.end_s == phase.start_s + phase.duration_s
        assert phase.kind == "flight" or phase.start_place == phase.end_place
        moment_s, place = phase.end_s, phase.end_place
    assert place == "destination"
    total_s = {
        kind: math.fsum(phase.duration_s for phase in plan.phases if phase.kind == kind)
        for kind in ("hover", "rest", "flight")
    }
    assert plan.hover_time_s == pytest.approx(total_s["hover"])
    assert plan.rest_time_s == pytest.approx(total_s["rest"])
    assert plan.flight_time_s == pytest.approx(total_s["flight"])
    assert plan.mission_time_s == pytest.approx(moment_s)
    assert plan.mission_time_s <= plan.mission.limits.deadline_s * (1 + 1e-9)
    flights = [phase for phase in plan.phases if phase.kind == "flight"]
    assert plan.route == ("origin", *(phase.end_place for phase in flights))
    assert plan.peak_speed_m_s == max(phase.peak_speed_m_s for phase in flights)
    assert [(stop.kind, stop.at, stop.start_s, stop.duration_s) for stop in plan.stops] == [
        (phase.kind, phase.end_place, phase.start_s, phase.duration_s)
        for phase in plan.phases
        if phase.kind != "flight"
    ]


def check_battery(plan: Plan) -> None:
    """Wells, moments of running dry and overfull, and states of charge, by other means."""
    given = plan.mission.battery
    B, ω = given.packs * given.capacity_As, given.available_fraction
    parts = list(available_by_integration(plan))
    moments_s = np.concatenate([moments for moments, _ in parts] or [np.zeros(1)])
    level = np.concatenate([available for _, available in parts] or [np.full(1, ω * B)]) / B
    for moment_s, beyond, limit in (
        (plan.runs_dry_s, -level, 0.0),
        (plan.overfull_s, level, ω),
    ):
        before = moments_s <= (math.inf if moment_s is None else moment_s - 1e-6)
        assert (beyond[before] <= limit + LEVEL).all()
        if moment_s is not None:
            order = np.argsort(moments_s, kind="stable")
            at = np.interp(moment_s, moments_s[order], beyond[order])
            steepest = np.abs(np.diff(level)).max()
            assert at == pytest.approx(limit, abs=steepest + LEVEL)
            assert (beyond[~before] >= limit - LEVEL).any()
    charge_As = B
    for phase in plan.phases:
        charge_As += math.fsum(stage.current_A * stage.duration_s for stage in phase.stages)
        (available_As,), (bound_As,) = phase.available_As, phase.bound_As
        assert available_As + bound_As == pytest.approx(charge_As, rel=1e-9, abs=1e-9 * B)
        if phase.duration_s:
            end = min(int(np.searchsorted(moments_s, phase.end_s - 1e-9)), len(level) - 1)
            assert available_As / B == pytest.approx(level[end], abs=LEVEL)
    assert plan.soc is not None
    assert plan.soc["battery"] == pytest.approx(charge_As / B, abs=1e-9)
    energy_J = math.fsum(s.power_W * s.duration_s for phase in plan.phases for s in phase.stages)
    E_0 = B * given.nominal_voltage_V
    assert plan.soc["energy"] == pytest.approx(1 + energy_J / E_0, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("kind", feasible())
def test_every_kind_of_plan_is_whole(kind: str) -> None:
    check_whole(plans()[kind])


@pytest.mark.parametrize("kind", feasible())
def test_every_kind_of_plan_keeps_account_of_the_battery(kind: str) -> None:
    check_battery(plans()[kind])


@pytest.mark.campaign
@given(missions(), st.sampled_from(["battery", "energy", "adjusted"]))
@settings(few(12))
def test_random_plans_are_whole_and_keep_account(mission: optuav.Mission, perspective: str) -> None:
    """Any k_F, ω, currents and legs, charging and draining."""
    plan = optuav.solve(mission, perspective=perspective)
    if plan:
        check_whole(plan)
        check_battery(plan)


def test_when_the_shipped_optimum_runs_dry_and_overfills() -> None:
    """To the digits of the specification; a quarter of the charge is still bound."""
    direct = plans()["direct"]
    assert direct.runs_dry_s == pytest.approx(660.26, abs=5e-3)
    assert direct.overfull_s is None
    assert plans()["optimal"].runs_dry_s == pytest.approx(1095.5, abs=0.05)
    assert plans()["optimal"].overfull_s is not None
    assert len(plans()["optimal"].warnings) == 2
    assert plans()["flyable"].warnings == ()
    assert plans()["flyable"].runs_dry_s is plans()["flyable"].overfull_s is None


def test_a_full_battery_that_is_charged_is_overfull_at_once() -> None:
    """Resting on the roof that the mission starts from."""
    mission = optuav.load("paper").replace({"route.origin_m": [50, 300, 60]})
    plan = optuav.solve(mission, optuav.P4("b1", order="rest-first"), perspective="battery")
    assert plan.rest_time_s > 0.0
    assert plan.overfull_s == 0.0


def test_without_flow_between_the_wells_the_available_one_is_all_there_is() -> None:
    """k_F = 0: dry once ω B is drawn."""
    mission = optuav.load("paper").replace({"battery.flow_rate_per_s": 0})
    plan = optuav.solve(mission, "P3", perspective="battery")
    leg_As, leg_s = 3921.555, 37.8961
    expected_s = leg_s + (0.8 * 72000 - leg_As) / 87.9104
    assert plan.runs_dry_s == pytest.approx(expected_s, abs=2e-3)
    assert plan.phases[-1].bound_As[0] == pytest.approx(0.2 * 72000)


def test_mean_current_and_power_of_a_phase_weigh_its_stages() -> None:
    """Net, into the battery: flight drains, rest charges; of no length, that of a stage."""
    optimal = plans()["optimal"]
    flight, rest = optimal.phases[:2]
    assert -flight.current_A * flight.duration_s == pytest.approx(
        math.fsum(-stage.current_A * stage.duration_s for stage in flight.stages)
    )
    assert [rest.current_A, rest.power_W] == pytest.approx([10.0, 111.0])
    nowhere = plans()["no way to hover"].phases[0]
    assert nowhere.duration_s == 0.0
    assert nowhere.current_A == nowhere.stages[0].current_A < 0.0


@pytest.mark.parametrize("kind", INFEASIBLE)
@pytest.mark.parametrize("name", FIGURES)
def test_without_a_plan_there_is_nothing_to_read(kind: str, name: str) -> None:
    """Every time and state raises, with the reason."""
    plan = plans()[kind]
    with pytest.raises(NoPlanError) as raised:
        getattr(plan, name)
    assert "infeasible" in str(raised.value)
    assert plan.reasons[0] in str(raised.value)


def test_a_plan_is_true_where_there_is_one() -> None:
    """So that `if plan:` reads as it should."""
    assert [kind for kind, plan in plans().items() if not plan] == list(INFEASIBLE)
    for kind in INFEASIBLE:
        assert plans()[kind].status == "infeasible"
        assert plans()[kind].soc is None
        assert plans()[kind].phases == ()


@pytest.mark.parametrize("kind", plans())
def test_plans_are_values(kind: str) -> None:
    """Equal to their copies, pickled and unpickled alike, and frozen."""
    plan = plans()[kind]
    for twin in (copy.deepcopy(plan), pickle.loads(pickle.dumps(plan))):
        assert twin == plan
        assert twin.to_dict() == plan.to_dict()
    name: str = "engine"
    with pytest.raises(ValidationError, match="frozen"):
        setattr(plan, name, "mine")


def with_phases(change: Any) -> Plan:
    """The shipped optimum with other phases, validated."""
    plan = plans()["optimal"]
    fields = {name: getattr(plan, name) for name in Plan.model_fields}
    return Plan(**fields | {"phases": change(plan.phases)})


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda p: p[:1] + p[2:][::-1], "begins elsewhere than the one before it ends"),
        (lambda p: (p[1],), "at least one is a flight"),
        (lambda p: (), "with status optimal, a plan needs phases and soc"),
        (lambda p: (replace(p[0], end_place="b99"),), "'b99' is not a place"),
        (lambda p: (replace(p[0], kind="rest"),), "a rest ends where it begins"),
        (lambda p: (replace(p[0], bound_As=(1.0, 2.0)),), "one entry a pack"),
    ],
)
def test_a_plan_whose_parts_do_not_fit_is_refused(change: Any, words: str) -> None:
    """What every reader of a plan relies on."""
    with pytest.raises(ValidationError, match=words):
        with_phases(change)


def test_a_plan_without_a_stop_is_a_plan() -> None:
    """Whether it can be flown is for a replay to say."""
    assert with_phases(lambda p: (p[0], *p[2:])).rest_time_s == 0.0


def test_an_infeasible_plan_has_no_phases() -> None:
    """Status and phases go together."""
    plan = plans()["optimal"]
    fields = {name: getattr(plan, name) for name in Plan.model_fields}
    with pytest.raises(ValidationError, match="infeasible, a plan has no phases and soc"):
        Plan(**fields | {"status": "infeasible"})


def test_printing_a_plan_shows_its_summary_and_a_console_one_line() -> None:
    """Not thousands of letters of nested records."""
    plan = optuav.solve("paper", perspective="battery")
    assert str(plan) == plan.summary()
    assert repr(plan) == "<Plan for 'paper': P1, perspective battery, optimal, Δ = 719.54 s>"
    assert all("\n" not in repr(each) and len(repr(each)) < 100 for each in plans().values())


# The plan as a pandas table

COLUMNS = [
    *("kind", "start_place", "end_place", "start_s", "duration_s", "current_A", "power_W"),
    *("distance_m", "peak_speed_m_s", "edited", "available_As", "bound_As"),
]


@pytest.mark.parametrize("kind", feasible())
def test_one_row_a_phase(kind: str) -> None:
    """Each column has the attribute of its name; wells are summed over the packs."""
    pytest.importorskip("pandas")
    plan = plans()[kind]
    frame = plan.to_frame()
    assert list(frame.columns) == COLUMNS
    assert len(frame) == len(plan.phases)
    for name in COLUMNS[:-2]:
        assert frame[name].tolist() == [getattr(phase, name) for phase in plan.phases]
    assert frame["available_As"].tolist() == [sum(phase.available_As) for phase in plan.phases]
    assert frame["bound_As"].tolist() == [sum(phase.bound_As) for phase in plan.phases]
    assert frame["duration_s"].sum() == pytest.approx(plan.mission_time_s)
    assert frame["edited"].dtype == bool


@pytest.mark.parametrize("kind", INFEASIBLE)
def test_no_plan_no_rows(kind: str) -> None:
    """But the columns are there."""
    pytest.importorskip("pandas")
    frame = plans()[kind].to_frame()
    assert list(frame.columns) == COLUMNS
    assert len(frame) == 0


def test_without_pandas_a_frame_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    plan = optuav.solve("paper", "P3")
    for table in (
        plan,
        optuav.replay(plan),
        optuav.compare(plan.mission.replace({"buildings": []}), engines=["grid"], slots_s=60.0),
    ):
        with pytest.raises(
            InputError, match=r"data frames need pandas, of the extra optuav\[frame\]; "
        ):
            table.to_frame()


def test_a_table_shows_no_rounding_that_the_data_keeps() -> None:
    """A plan that is never dry has no well below zero in its table; its phases stay as they are."""
    pytest.importorskip("pandas")
    plan = optuav.solve("paper")
    assert plan.runs_dry_s is None
    assert min(sum(each.available_As) for each in plan.phases) < 0.0
    for table in (plan.to_frame(), optuav.replay(plan).trace.to_frame()):
        assert table.available_As.min() == 0.0
    dry = optuav.solve("paper", perspective="battery")
    assert dry.to_frame().available_As.min() < -9000.0


@pytest.mark.parametrize("name", optuav.shipped())
def test_a_table_over_time_shows_no_rounding(name: str) -> None:
    """Positions, speeds and wells are 0, or no rounding error; the trace keeps its numbers."""
    replayed = optuav.replay(optuav.solve(name, "P3", perspective="battery"))
    table = replayed.to_frame().select_dtypes("float")
    assert not ((table != 0.0) & (table.abs() < 1e-9)).to_numpy().any()
    kept_m = replayed.trace.position_m
    assert np.abs(table[["x_m", "y_m", "z_m"]].to_numpy() - kept_m).max() < 1e-5


def test_an_answer_shows_no_rounding_that_its_slacks_keep() -> None:
    (answer,) = optuav.formulate("paper", "P3", perspective="wells").answers()
    (row,) = [line.split("  ") for line in str(answer).splitlines() if line.startswith("P3.a")]
    assert [cell.strip() for cell in row if cell][1] == "0"
    assert answer.slacks["P3.a state of charge"][0] != 0.0


def test_tables_name_the_device_of_each_hover() -> None:
    """The plan's has a row per hover, a third of Δ each; the trace has all moments between."""
    pytest.importorskip("pandas")
    plan = plan_over_three()
    rows = plan.to_frame()
    hovers = rows[rows.kind == "hover"]
    assert [*hovers.end_place] == ["east", "north", "west"]
    assert [*hovers.duration_s] == pytest.approx([647.331326 / 3] * 3)
    trace = optuav.replay(plan).to_frame()
    trace = trace[trace.kind == "hover"]
    for name, moments in trace.groupby("end_place"):
        (row,) = hovers[hovers.end_place == name].itertuples()
        assert moments.time_s.min() == pytest.approx(row.start_s)
        assert moments.time_s.max() == pytest.approx(row.start_s + row.duration_s)
