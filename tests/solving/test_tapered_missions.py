"""`battery.charging = "taper"` from mission to audited plan."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import optuav
from optuav import InputError, Mission, Plan
from optuav.mission import load
from optuav.physics import kibam
from optuav.physics.kibam import Battery, Wells
from optuav.status import Status
from tests.asking import formulate, solve
from tests.solving.delivered import rests, slack

TAPER = {"battery.charging": "taper"}
STRONG = {**TAPER, "laser.power_W": 12_000.0, "battery.charge_current_A": 120.0}
INSIDE = 1e-9


@pytest.fixture(scope="module")
def mission() -> Mission:
    """`paper`, its charging tapered."""
    return load("paper").replace(TAPER)


@pytest.fixture(scope="module")
def plan(mission: Mission) -> Plan:
    """It rests first, so long that the available well is held full."""
    return solve(mission, optuav.P1(order="rest-first"))


def test_the_plan_is_delivered_and_none_is_longer(plan: Plan, mission: Mission) -> None:
    """By the tests' own wells; at constant current the same times would go past full."""
    program = formulate(mission, optuav.P4("b9", order="rest-first"))
    (route,) = program.parts[0].routes.tolist()
    times = np.array(plan.hover_time_s), plan.rest_time_s
    assert slack(program.network, route, *times) >= -INSIDE
    longer_s = plan.hover_time_s + np.array([[1e-4], [1e-2], [1.0]])
    tried_s = rests([plan.rest_time_s], mission.limits.deadline_s)[None]
    assert slack(program.network, route, longer_s, tried_s).max() < 0.0
    constant = formulate("paper", optuav.P4("b9", order="rest-first"))
    assert slack(constant.network, route, *times) < -1e-3


def test_the_plan_says_what_the_battery_takes(plan: Plan) -> None:
    """y1 is full after the rest, less charge went in than was offered, nothing is past full."""
    (rest,) = (each for each in plan.phases if each.kind == "rest")
    given = plan.mission.battery
    capacity_As = given.packs * given.capacity_As
    assert rest.available_As[0] == pytest.approx(given.available_fraction * capacity_As, rel=1e-12)
    before = plan.phases[plan.phases.index(rest) - 1]
    taken_As = rest.available_As[0] + rest.bound_As[0] - before.available_As[0] - before.bound_As[0]
    assert 0.0 < taken_As < 0.9 * rest.current_A * rest.duration_s
    assert plan.overfull_s is None
    assert plan.flyable is True
    assert plan.warnings == ()
    assert plan.soc is not None
    left_As = plan.phases[-1].available_As[0] + plan.phases[-1].bound_As[0]
    assert plan.soc["battery"] == pytest.approx(left_As / capacity_As, abs=1e-12)


def test_replay(plan: Plan) -> None:
    """The wells agree with those of the plan; the current falls and never rises."""
    found = optuav.replay(plan)
    assert found.flyable, found.violations
    trace, given = found.trace, plan.mission.battery
    pool = Battery(given.packs * given.capacity_As, given.available_fraction, given.flow_rate_per_s)
    (rest,) = (each for each in plan.phases if each.kind == "rest")
    resting = trace.kind == "rest"
    current_A = trace.current_A[resting]
    assert current_A.max() == rest.current_A
    assert np.all(np.diff(current_A) <= 1e-12)
    assert current_A[-1] < 0.5 * rest.current_A
    y1, y2 = trace.available_As[resting, 0], trace.bound_As[resting, 0]
    assert y1.max() <= pool.full.available_As * (1.0 + 1e-9)
    held = current_A < rest.current_A
    seeps_A = np.gradient(y2[held], trace.time_s[resting][held])
    assert current_A[held][5:-5] == pytest.approx(seeps_A[5:-5], rel=1e-3)
    last = Wells(float(y1[-1]), float(y2[-1]))
    assert kibam.holding_current(pool, last) == pytest.approx(current_A[-1], rel=1e-6)


def test_file_and_audit(plan: Plan, tmp_path: Path) -> None:
    """Saved, read and judged: flyable; a rest of another length is not the same plan."""
    path = tmp_path / "plan.json"
    plan.save(path)
    assert optuav.audit(path).flyable
    spoiled = path.read_text("utf-8").replace('"charging": "taper"', '"charging": "constant"')
    assert spoiled != path.read_text("utf-8")
    path.write_text(spoiled, "utf-8")
    assert not optuav.audit(path).flyable


def test_the_papers_perspectives_count_what_is_offered(mission: Mission) -> None:
    """Δ stays; what the battery really takes shows in the state of charge, and in the verdict."""
    for perspective in ("battery", "wells"):
        tapered = solve(mission, perspective=perspective)
        constant = solve("paper", perspective=perspective)
        assert tapered.hover_time_s == pytest.approx(constant.hover_time_s, abs=1e-6)
        assert tapered.soc is not None
        assert tapered.soc["battery"] < 0.05 - 1e-3
        assert tapered.flyable is False
        assert tapered.overfull_s is None
        assert constant.overfull_s is not None


def test_a_hover_that_charges(mission: Mission) -> None:
    """At constant current only short hovers are feasible, with a taper the whole deadline is."""
    asked: dict[str, Any] = {"limits.min_soc": 0.9}
    tapered = solve(load("paper").replace({**STRONG, **asked}), "P3")
    constant = {**STRONG, **asked, "battery.charging": "constant"}
    short = solve(load("paper").replace(constant), "P3")
    assert short.hover_time_s < 180.0
    assert tapered.mission_time_s == pytest.approx(tapered.mission.limits.deadline_s, abs=1e-6)
    assert optuav.replay(tapered).flyable


def test_several_stops(mission: Mission) -> None:
    """Where nothing is ever full the taper changes nothing: SPEC's 605.456 s with two rests."""
    found = solve(mission, optuav.P1(stops=2))
    assert found.status is Status.OPTIMAL
    assert found.hover_time_s == pytest.approx(605.456, abs=1e-3)
    assert optuav.replay(found).flyable


def test_several_stops_that_taper(mission: Mission, monkeypatch: pytest.MonkeyPatch) -> None:
    """A plan that is held full is found and judged so; an open gap is told."""
    monkeypatch.setattr("optuav.search.branch.MOST_BOXES", 1_000)
    asked = {"limits.deadline_s": 8000.0, "limits.min_soc": 0.9}
    changed = mission.replace(asked)
    found = solve(changed, optuav.P1(stops=1, hovers=2))
    assert found
    assert found.status is Status.OPTIMAL or "not proved" in " ".join(found.notes)
    assert optuav.replay(found).flyable
    one = solve(changed)
    assert found.hover_time_s >= one.hover_time_s - 1e-3


def test_engines_that_are_refused(mission: Mission) -> None:
    """As under `available` at constant current."""
    for engine in ("cvxpy", "closed-form"):
        with pytest.raises(InputError, match="only linear models"):
            formulate(mission, engine=engine)


def test_only_two_ways_of_charging() -> None:
    with pytest.raises(InputError, match=r"battery\.charging.*constant.*taper"):
        load("paper").replace({"battery.charging": "trickle"})


@pytest.mark.parametrize(
    "asked", [{"problem": "P4", "building": "b9", "order": "rest-first"}, {"stops": 2}]
)
def test_what_is_refused_is_told_and_binds_nothing(
    asked: dict[str, Any], mission: Mission, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The note's figure is the charge that was offered and is not there; energies count it all."""
    monkeypatch.setattr("optuav.search.branch.MOST_BOXES", 20_000)
    b9 = [each.model_dump() for each in mission.buildings if each.name == "b9"]
    long = mission.replace({"buildings": b9, "limits.deadline_s": 1600.0})
    plan = solve(long, **asked)
    assert plan.phases[1].available_As == pytest.approx((57_600.0,))
    assert plan.soc is not None
    net_As = sum(s.current_A * s.duration_s for phase in plan.phases for s in phase.stages)
    refused_As = (1.0 - plan.soc["battery"]) * 72_000.0 + net_As
    (note,) = (each for each in plan.notes if each.startswith("charging slowed down near full"))
    told = re.search(r"the (\S+) A s that the full battery refused", note)
    assert told is not None
    assert float(told[1]) == pytest.approx(refused_As, rel=1e-5)
    assert plan.binding
    assert not [label for label in plan.binding if "past full" in label]


def test_where_nothing_is_refused_nothing_is_told(mission: Mission) -> None:
    """The direct route of `paper` hovers and flies without being charged."""
    assert not [each for each in solve(mission, "P3").notes if "tapered" in each]
