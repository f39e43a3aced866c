"""Random missions through the whole room: cycles, fleets for four days, events, days, robust plans.

A few in the suite, a thousand in the campaign (``make soak EXAMPLES=1000``).
"""

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import optuav
from optuav.errors import InputError, NoPlanError
from tests.examples import few

SHIPPED = ["paper", "paper-table2", "paper-drag", "matrice350", "relay-today"]
REFUSED = (InputError, NoPlanError)


@st.composite
def missions(draw: st.DrawFn) -> optuav.Mission:
    """A shipped mission with another battery, charger, laser, reserve and weather."""
    mission = optuav.load(draw(st.sampled_from(SHIPPED)))
    battery = mission.battery
    changes: dict[str, Any] = {
        "battery.capacity_As": battery.capacity_As * draw(st.floats(0.1, 2.0)),
        "battery.available_fraction": draw(st.floats(0.1, 0.95)),
        "battery.flow_rate_per_s": draw(
            st.sampled_from([0.0, 1e-9]) | st.floats(-7.0, -2.5).map(lambda power: 10.0**power)
        ),
        "battery.charge_current_A": battery.charge_current_A * draw(st.floats(0.2, 4.0)),
        "limits.min_soc": draw(st.sampled_from([0.0, 0.05, 0.2]) | st.floats(0.0, 0.6)),
        "laser.power_W": 1000.0 * draw(st.floats(0.2, 5.0)),
    }
    return mission.replace(changes)


OPTIONS = st.sampled_from([{}, {}, {"lit_hover": False}]) | st.one_of(
    st.floats(1.0, 600.0).map(lambda time_s: {"swap_s": time_s}),
    st.floats(20.0, 3000.0).map(lambda power_W: {"pad_power_W": power_W}),
)


def ends(plan: optuav.Plan) -> Iterator[tuple[float, float, str]]:
    """Both wells as shares of B and the kind of phase after every stage, by eqs (15)-(16)."""
    start, battery = plan.mission.start, plan.mission.battery
    B, c = battery.packs * battery.capacity_As, battery.available_fraction
    k = max(battery.flow_rate_per_s / (c * (1.0 - c)), 1e-300)
    y1, y2 = (c, 1.0 - c) if start is None else (start.available_As / B, start.bound_As / B)
    for phase in plan.phases:
        for stage in phase.stages:
            t, d, y0 = stage.duration_s, -stage.current_A / B, y1 + y2
            e, lost_s = math.exp(-k * t), -math.expm1(-k * t) / k
            lag_s = t - lost_s  # (k t − 1 + e)/k
            y1 = y1 * e + (y0 * k * c - d) * lost_s - d * c * lag_s
            y2 = y2 * e + y0 * (1.0 - c) * (1.0 - e) - d * (1.0 - c) * lag_s
            yield y1, y2, phase.kind


@pytest.mark.campaign
@few(6)
@given(missions(), OPTIONS, st.floats(0.05, 3.0), st.sampled_from([0.0, 0.1, 0.5]))
def test_cycles_and_fleets(
    mission: optuav.Mission, options: Any, share: float, overlap: float
) -> None:
    """The same wells after a period; four days of a fleet; one drone or place fewer fails."""
    try:
        cycle = optuav.coverage(mission, **options)
    except REFUSED:
        return
    if cycle.building is None:
        assert cycle.share == 1.0
        return
    least, full = mission.limits.min_soc, mission.battery.available_fraction
    assert cycle.share <= cycle.bound * (1.0 + 1e-12)
    *visit, last = ends(cycle.plan)
    assert min(y1 for y1, _, _ in [*visit, last]) >= -1e-6
    assert max(y1 for y1, _, _ in [*visit, last]) <= full + 1e-6
    landings = [y1 + y2 for y1, y2, kind in [*visit, last] if kind == "flight"]
    assert landings[-1] >= least - 1e-6
    if "swap_s" not in options:
        B = mission.battery.packs * mission.battery.capacity_As
        start = cycle.plan.mission.start
        assert start is not None
        assert last[0] == pytest.approx(start.available_As / B, abs=1e-6)
        assert last[1] == pytest.approx(start.bound_As / B, abs=1e-6)
    replay = optuav.replay(cycle.plan)
    assert replay.flyable, replay.violations
    fleet = cycle.fleet(share, overlap * cycle.hover_s)
    flown = fleet.replay(days=4)
    assert flown.flyable, flown.events
    if fleet.drones > 1:
        assert (fleet.drones - 1) * fleet.starts_every_s < cycle.period_s
    turn_s = fleet.drones * fleet.starts_every_s
    fewer = replace(fleet, places=fleet.places - 1)
    short = fewer.replay(min(4.0, 3.0 * turn_s / 86_400.0))
    assert "place" in {event.kind for event in short.violations}


@pytest.mark.campaign
@few(2)
@given(
    missions(), st.sampled_from([{}, {"pad_power_W": 400.0}, {"swap_s": 90.0}]), st.floats(0.1, 3.0)
)
def test_events_and_days(mission: optuav.Mission, options: Any, hours: float) -> None:
    """The judge flies the roster and the day; a drone fewer than charge allows is refused."""
    try:
        cycle = optuav.coverage(mission, **options)
        hours = min(hours, cycle.hover_s / 36.0)  # At most a hundred hovers
        event = cycle.event(hours)
    except REFUSED:
        return
    replay = event.replay()
    assert replay.flyable, replay.events
    assert sum(row["hover_s"] for row in event.rows) == pytest.approx(3600.0 * hours)
    if event.least_drones > 1:
        with pytest.raises(NoPlanError, match="at least"):
            cycle.event(hours, event.least_drones - 1)
    if options:
        return
    try:
        day = cycle.horizon(hours)
    except REFUSED:
        return
    flown = optuav.replay(day.itinerary)
    assert flown.flyable, flown.violations
    assert day.hover_s <= day.bound_s * (1.0 + 1e-9)


@pytest.mark.campaign
@few(8)
@given(
    missions(),
    st.sampled_from(["P1", "P3"]),
    st.floats(0.5, 20.0),
    st.sampled_from(
        ["battery.capacity_As", "battery.flow_rate_per_s", "limits.min_soc", "body.mass_kg"]
    ),
    st.integers(0, 2**32 - 1),
)
def test_robust_plans(
    mission: optuav.Mission, problem: Any, percent: float, key: str, seed: int
) -> None:
    """At corners, and at points within: the judge flies the stays with the changed numbers."""
    table, _, name = key.partition(".")
    if (section := getattr(mission, table)) is None or not (now := getattr(section, name)):
        return
    try:
        found = optuav.robust(mission, {key: {"percent": percent}}, problem, samples=300)
    except REFUSED:
        return
    assert found.flyable == 1.0
    low, high = found.rows[0]["low"], found.rows[0]["high"]
    assert (low, high) == pytest.approx((now * (1 - percent / 100), now * (1 + percent / 100)))
    stops = [optuav.Stop(s.at, s.kind, s.duration_s) for s in found.plan.stops]
    hover_m = found.plan.mission.route.hover_m
    for value in (low, high, *np.random.default_rng(seed).uniform(low, high, 3)):
        other = mission.replace({key: float(value), "route.hover_m": hover_m})
        replay = optuav.replay(optuav.Itinerary(other, stops))
        assert replay.flyable, (value, replay.violations)


@pytest.mark.campaign
@few(6)
@given(missions())
def test_last_moments(mission: optuav.Mission) -> None:
    """The direct hover of the last moment can be flown, a thousandth longer it cannot."""
    mission = mission.replace({"limits.deadline_s": 1e7})
    try:
        row = optuav.return_by(mission).rows[0]
    except REFUSED:
        return
    if row["place"] != "destination" or row["latest_s"] == math.inf:
        return
    for hover_s, flyable in (
        ((0.0, False),)
        if row["latest_s"] is None
        else ((row["latest_s"] * (1 - 1e-6), True), (row["latest_s"] * 1.001 + 0.1, False))
    ):
        stop = optuav.Stop("hover", "hover", hover_s)
        kinds = {e.kind for e in optuav.replay(optuav.Itinerary(mission, [stop])).violations}
        assert (not kinds & {"empty", "state of charge"}) is flyable, row
