"""Random missions under `available`, from file to audited plan: what bracket claims is simulated.

Fifty in the suite, ten thousand in the campaign (``make soak``), which tells how many had an
answer, had none, or were not proved. Currents, flow rates and shares of the wells range over
magnitudes; deadlines and batteries are short, long or neither; the laser may charge in the air, and
charging may taper.
"""

from __future__ import annotations

import math
import zlib
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

import optuav
from optuav import Mission, Plan, SolverError
from optuav.engines import bracket
from optuav.options import ORDERS
from optuav.solving import Program, formulate
from optuav.solving.question import problem_of
from optuav.solving.route_models import RouteModel
from optuav.status import Status
from tests.examples import few
from tests.mission.strategies import Document, documents
from tests.plan.made import available_by_integration
from tests.solving.delivered import longer, rests, slack

INSIDE = 1e-9
"""Share of the capacity by which an answer may miss a limit of charge."""
OUTSIDE = 1e-11
"""Share of the capacity that is more than rounding of the oracle."""
MARGIN_S = 1e-6
"""How far beyond what none should exceed times are tried, and a grid may reach."""
CASADI_S = 1e-4
"""How far beyond it a local solver may reach, which allows itself as much."""
SHORT_S = 1e-2
"""By how much a local optimum is counted as short of the proved one."""
AGREES = 1e-6
"""Share of the capacity to which a plan and its simulation agree."""
GRID_EVERY, CASADI_EVERY, INTEGRATED_EVERY = 3, 8, 10
"""One mission in so many is handed to the engines that take longer, and to SciPy."""


@st.composite
def wild_documents(draw: st.DrawFn) -> Document:
    """A mission file with a battery from hopeless to plenty, and a laser from weak to far too much.

    All figures but those of the battery, the deadline and the laser are as elsewhere in the tests.
    """
    document = draw(documents(most_buildings=2))
    limits, battery = document["limits"], document["battery"]
    limits["deadline_s"] *= draw(st.sampled_from([1.0, 4.0, 0.3, 0.1]))
    limits["min_soc"] = draw(st.sampled_from([0.0, 0.05, 0.2, draw(st.floats(0.0, 0.95))]))
    limits["keep_soc"] = draw(st.sampled_from(["end", "always"]))
    battery["capacity_As"] *= draw(st.sampled_from([1.0, 4.0, 0.3, 0.1]))
    battery["available_fraction"] = draw(st.floats(0.03, 0.97))
    battery.pop("flow_rate_per_min", None)
    battery["flow_rate_per_s"] = draw(
        st.floats(-7.0, -1.0).map(lambda power: 10.0**power) | st.just(0.0)
    )
    stronger = draw(st.sampled_from([1.0, 4.0, 15.0]))
    battery["charge_current_A"] *= stronger
    battery["charging"] = draw(st.sampled_from(["constant", "taper"]))
    if "laser" in document:
        document["laser"]["power_W"] *= draw(st.sampled_from([0.1, 1.0, 15.0]))
    for key in ("charge_current_A", "charge_power_W"):
        if key in document.get("flight", {}):
            document["flight"][key] *= stronger
    return document


@st.composite
def questions(draw: st.DrawFn) -> Program:
    """A problem over a mission that can be flown, though perhaps not in time."""
    mission = Mission.from_dict(draw(wild_documents()))
    name = draw(st.sampled_from(["P1", "P1", "P3", "P4"]))
    building = order = None
    if name == "P4":
        assume(mission.buildings)
        building = draw(st.sampled_from([each.name for each in mission.buildings]))
        order = draw(st.sampled_from([None, *ORDERS]))
    program = formulate(mission, problem_of(name, building=building, order=order))
    assume(program.parts)
    return program


def by(program: Program, engine: str, slot_s: float | None = None) -> Program:
    return replace(program, question=replace(program.question, engine=engine, slot_s=slot_s))


def beyond_of(program: Program, part: RouteModel, tally: Counter[str]) -> float:
    """What no hover of a part exceeds [s], −∞ if none is possible; both ends held against wells."""
    found, network = bracket.solve(part.model, len(part.routes)), program.network
    assert found.beyond is not None
    rest = found.values.get("rest_time_s", np.zeros(len(part.routes)))
    for route, hover_s, rest_s, beyond_s, status in zip(
        part.routes.tolist(), found.objective, rest, found.beyond, found.statuses, strict=True
    ):
        answered = not math.isnan(hover_s)
        if answered:
            assert slack(network, route, hover_s, rest_s, looks=30) >= -INSIDE
            assert hover_s <= beyond_s
        horizon_s = network.mission.limits.deadline_s
        hovers_s = longer(beyond_s, horizon_s, MARGIN_S)
        rested = "rest_time_s" in found.values
        tried_s = rests([rest_s] if answered else [], horizon_s) if rested else np.zeros(1)
        kept = slack(network, route, hovers_s[:, None], tried_s[None]) > OUTSIDE
        assert not kept.any(), (route, beyond_s, np.argwhere(kept))
        tally["itineraries"] += 1
        tally["itineraries not proved"] += status in (Status.FEASIBLE, Status.UNKNOWN)
    return float(found.beyond.max())


def flown_wrong(plan: Plan) -> Iterator[str]:
    """What is wrong with a plan that should be flyable, by replay and audit."""
    replayed, judged = optuav.replay(plan), optuav.audit(plan)
    if plan.flyable is not True or not replayed.flyable or not judged.flyable:
        yield f"not flyable: {judged}"
    battery = plan.mission.battery
    capacity_As = battery.packs * battery.capacity_As
    assert replayed.course is not None
    for phase, wells in zip(plan.phases, replayed.course.ends, strict=True):
        stated = np.array([phase.available_As, phase.bound_As])
        simulated = np.array([[w.available_As for w in wells], [w.bound_As for w in wells]])
        if np.abs(stated - simulated).max() > AGREES * capacity_As:
            yield f"{phase.kind}: wells {stated}, simulated {simulated}"


def integrated_wrong(plan: Plan) -> Iterator[str]:
    """The same by SciPy's integration of the differential equations, 200 points a stage."""
    battery = plan.mission.battery
    capacity_As = battery.packs * battery.capacity_As
    y1 = np.concatenate([available for _, available in available_by_integration(plan)])
    if y1.min() < -AGREES * capacity_As:
        yield f"dry by integration: {y1.min()}"
    if y1.max() > (battery.available_fraction + AGREES) * capacity_As:
        yield f"past full by integration: {y1.max()}"


def solved(program: Program) -> Plan | None:
    """The plan, or None where the engine says that it knows neither a plan nor that none exists."""
    try:
        return program.solve()
    except SolverError as error:
        if "neither a plan nor proof" in str(error):
            return None
        raise


def judge(program: Program, slots: int, tally: Counter[str]) -> None:
    """Hold one mission against the oracles, and count it; with so many slots for the grid.

    Its figures decide, as good as at random, whether it goes to further engines.
    """
    share = zlib.crc32(program.network.mission.model_dump_json().encode())
    beyond_s = max(beyond_of(program, part, tally) for part in program.parts)
    plan = solved(program)
    tapers = program.network.mission.battery.charging == "taper"
    among = " where charging tapers" if tapers else ""
    tally["missions"] += 1
    tally["missions that taper"] += tapers
    if plan is None:
        tally[f"neither answer nor proof{among}"] += 1
    elif plan:
        assert plan.engine == "bracket"
        proved = plan.status is Status.OPTIMAL
        tally["answered and proved" if proved else f"answered, not proved{among}"] += 1
        assert proved == (beyond_s - plan.hover_time_s <= MARGIN_S)
        assert proved or any("not proved" in note for note in plan.notes)
        wrong = list(flown_wrong(plan))
        if share % INTEGRATED_EVERY == 0 and not tapers:
            tally["integrated"] += 1
            wrong += integrated_wrong(plan)
        assert not wrong, "\n".join(wrong)
    else:
        assert plan.status is Status.INFEASIBLE
        assert plan.reasons
        assert beyond_s == -math.inf
        tally["proved infeasible"] += 1
    if share % GRID_EVERY == 0:
        tally["by grid"] += 1
        slot_s = program.network.mission.limits.deadline_s / slots
        searched = by(program, "grid", slot_s).solve()
        assert not searched or searched.hover_time_s <= beyond_s + MARGIN_S
    if share % CASADI_EVERY == 0 and not tapers:
        against_local(program, plan, beyond_s, tally)


def against_local(
    program: Program, plan: Plan | None, beyond_s: float, tally: Counter[str]
) -> None:
    """A local solver finds nothing longer; how often it stops short is counted."""
    local = by(program, "casadi").solve()
    tally["by casadi"] += 1
    if local:
        assert local.flyable
        assert local.hover_time_s <= beyond_s + CASADI_S
    if plan:
        hover_s = local.hover_time_s if local else -math.inf
        tally["casadi short"] += hover_s < plan.hover_time_s - SHORT_S


def test_oracle_can_fail() -> None:
    """A tenth of a second more than what bracket finds for `paper` is not delivered, less is."""
    program = formulate("paper", "P3")
    plan = program.solve()
    for more_s, kept in ((-0.1, True), (0.0, True), (0.1, False)):
        hover_s = np.array(plan.hover_time_s + more_s)
        assert (slack(program.network, 0, hover_s, 0.0) >= -INSIDE) == kept
    assert list(flown_wrong(program.solve())) == []
    promised = optuav.solve("paper", "P3", perspective="battery")
    assert len(list(flown_wrong(promised))) == 1
    assert len(list(integrated_wrong(promised))) == 1


@pytest.mark.campaign
def test_plans_can_be_flown_and_none_is_longer(record_property: Any) -> None:
    """Both ends of every bracket, the plan's simulation, and what other engines find."""
    tally = Counter[str]()

    @settings(few(4), suppress_health_check=[HealthCheck.filter_too_much, HealthCheck.too_slow])
    @given(questions(), st.integers(5, 60))
    def each(program: Program, slots: int) -> None:
        judge(program, slots, tally)

    each()
    record_property("count", ", ".join(f"{name}: {count}" for name, count in tally.items()))
