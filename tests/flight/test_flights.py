"""Rotors with drag and a cap, and rotary wings: check numbers, replays, sweeps, broken input."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import optuav
from optuav.errors import InputError
from optuav.flight import Regimes, RotaryWing, Rotors
from optuav.network.network import build_network
from tests.examples import few

WING: dict[str, Any] = {
    "model": "rotary-wing",
    "blade_power_W": 79.85628,
    "induced_power_W": 88.62794,
    "induced_speed_m_s": 4.028543,
    "tip_speed_m_s": 120.0,
    "parasite_W_s3_m3": 0.00924263,
    "acceleration_m_s2": 2.0,
    "max_speed_m_s": 23.0,
    "climb_speed_m_s": 5.0,
    "descent_speed_m_s": 4.0,
}
WINGED = optuav.load("paper").replace({"flight": WING, "rotor": None})


def test_drag_and_cap_of_the_papers_scenario() -> None:
    """SPEC-FLIGHT: leg wU → wF, and (P3) under `battery` with drag and with a cap as well."""
    drag = optuav.load("paper-drag")
    legs = build_network(drag).legs
    assert legs.duration_s[1] == pytest.approx(113.60610, abs=5e-6)
    assert legs.charge_As[1] == pytest.approx(12_012.163, abs=5e-4)
    assert legs.peak_speed_m_s[1] == pytest.approx(25.10292, abs=5e-6)
    p3 = optuav.solve(drag, "P3", perspective="battery")
    assert p3.hover_time_s == pytest.approx(504.8, abs=0.05)
    assert not any("drag" in note for note in p3.notes)
    capped = drag.replace({"flight.max_speed_m_s": 15})
    assert optuav.solve(capped, "P3", perspective="battery").hover_time_s == pytest.approx(
        379.7, abs=0.05
    )


@pytest.mark.parametrize(("cap", "stops"), [(None, 1), (15.0, 2)])
def test_legs_with_drag_differ_there_and_back_and_replay(cap: float | None, stops: int) -> None:
    """A climb differs from a descent; the judge flies each as planned and stays below the cap."""
    mission = optuav.load("paper-drag").replace(
        {"flight.max_speed_m_s": cap, "limits.deadline_s": 2000, "route.origin_m": [0, 0, 0]}
    )
    model = mission.flight_model
    up, down = (model.leg(way_m) for way_m in ((300.0, 0.0, 60.0), (-300.0, 0.0, -60.0)))
    assert up.duration_s != pytest.approx(down.duration_s, rel=1e-6)
    replayed = optuav.replay(optuav.solve(mission, optuav.P1(stops=stops)))
    assert replayed.flyable
    assert replayed.trace.speed_m_s.max() <= (cap or 30.0) * (1 + 1e-9)


def test_power_and_speeds_of_the_published_wing() -> None:
    """SPEC-FLIGHT: hover, best range; hovering in a wind of 10 m/s is cheaper."""
    drawn = WINGED.flight_model.hover()
    assert drawn.power_W == pytest.approx(168.48422, abs=5e-6)
    assert drawn.current_A == pytest.approx(168.48422 / 11.1, abs=5e-6)
    named = {name: value for name, value, _ in WINGED.flight_model.figures()}
    assert named["air speed of best endurance"] == pytest.approx(10.21169, abs=5e-5)
    assert named["air speed of best range"] == pytest.approx(18.29448, abs=5e-5)
    windy = WINGED.replace({"wind.velocity_m_s": [6, 8, 0]}).flight_model.hover()
    assert windy.power_W == pytest.approx(126.0, abs=0.05)


@few(12, most=300)
@given(
    st.sampled_from(
        [{}, {"speed": "max"}, {"speed": "best-endurance"}, {"cruise_speed_m_s": 12.0}]
    ),
    st.tuples(st.floats(-6.0, 6.0), st.floats(-6.0, 6.0)),
    st.floats(0.5, 1.0),
)
def test_plans_of_a_wing_replay_in_any_wind(
    speed: dict[str, Any], wind: tuple[float, float], efficiency: float
) -> None:
    """The judge finds the speeds, charges and places of the plan again."""
    mission = WINGED.replace(
        {
            "flight": {**WING, **speed, "efficiency": efficiency},
            "wind.velocity_m_s": [*wind, 0.0],
            "limits.deadline_s": 2500.0,
        }
    )
    plan = optuav.solve(mission)
    replayed = optuav.replay(plan)
    assert replayed.flyable, replayed.violations
    assert plan.flyable
    flown = [each for each in plan.phases if each.kind == "flight"]
    assert replayed.trace.speed_m_s.max() == pytest.approx(max(x.peak_speed_m_s for x in flown))


def test_a_batch_of_winds_is_each_mission_alone() -> None:
    """Wind and cap are swept in arrays, with the figures of single missions."""
    pytest.importorskip("xarray")
    ranges = {"flight.max_speed_m_s": [10.0, 20.0], "wind.velocity_m_s[0]": [0.0, 5.0, 9.0]}
    found = optuav.batch(WINGED, ranges)["hover_time_s"].to_numpy()
    for row, cap in enumerate(ranges["flight.max_speed_m_s"]):
        for column, wind in enumerate(ranges["wind.velocity_m_s[0]"]):
            own = {"flight.max_speed_m_s": cap, "wind.velocity_m_s": [wind, 0, 0]}
            alone = optuav.solve(WINGED.replace(own)).hover_time_s
            assert found[row, column] == pytest.approx(alone, abs=1e-6)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"flight.speed": "fast"}, "flight.speed = 'fast': must be one of"),
        ({"flight.speed": "max", "flight.cruise_speed_m_s": 5}, "either speed or cruise_speed_m_s"),
        ({"flight.efficiency": 0}, "flight.efficiency = 0: must be a number, 0 < x <= 1"),
        ({"wind.velocity_m_s": 6}, "three numbers [x, y, 0], such as [6, 0, 0]"),
        ({"wind.force_N": [1, 0, 0]}, '[0, 0, 0] with flight.model = "rotary-wing"'),
        ({"air.density_kg_m3": 1.2}, 'not with flight.model = "rotary-wing"'),
        ({"body.drag_area_m2": 0.1}, "body.drag_area_m2 = 0.1: not with flight.model"),
        ({"rotor": dict(optuav.load("paper").rotor or {})}, "rotor = a table: not with"),
        ({"rotor.max_speed_rad_s": 900}, "rotor = a table: not with"),
        ({"body": None}, "body: is missing; a table [body]"),
    ],
)
def test_faults_of_a_wing_are_named(changes: dict[str, Any], words: str) -> None:
    """One clear error for each key that has no meaning or no such value."""
    with pytest.raises(InputError) as refusal:
        WINGED.replace(changes)
    (line,) = str(refusal.value).splitlines()
    assert words in line


def test_keys_of_other_models_are_refused_with_rotors() -> None:
    """A wind as a velocity, and a body without inertia, are no rotors'."""
    with pytest.raises(InputError, match=r'velocity_m_s.*\[0, 0, 0\] with flight.model = "rotors"'):
        optuav.load("paper").replace({"wind.velocity_m_s": [3, 0, 0]})
    with pytest.raises(InputError, match=r"inertia_x_kg_m2: is missing; .* needed by flight.model"):
        optuav.load("paper").replace({"body.inertia_x_kg_m2": None})


def test_too_strong_a_wind_is_no_flight() -> None:
    """No plan, and the reason names wind, cap and keys."""
    plan = optuav.solve(WINGED.replace({"wind.velocity_m_s": [30, 0, 0]}))
    assert not plan
    assert "the wind blows at 30 m/s" in plan.reasons[0]
    assert "flight.max_speed_m_s" in plan.reasons[0]


def air_speeds_m_s(mission: optuav.Mission, plan: optuav.Plan) -> list[float]:
    """Horizontal air speed at the peak of each leg, from places, peak speeds and wind."""
    names, at_m = build_network(mission).places.names, build_network(mission).places.position_m
    found = []
    for leg in (each for each in plan.phases if each.kind == "flight"):
        way_m = at_m[names.index(leg.end_place)] - at_m[names.index(leg.start_place)]
        over_ground = leg.peak_speed_m_s * way_m / np.linalg.norm(way_m)
        found.append(float(np.hypot(*(over_ground - mission.wind.velocity_m_s)[:2])))
    return found


STORMY = optuav.load("relay-today").replace({"flight.cruise_speed_m_s": 20.0})


@pytest.mark.parametrize("wind", [[15.0, 0.0, 0.0], [-15.0, 0.0, 0.0], [-12.0, -12.0, 0.0]])
def test_a_stated_cruise_speed_keeps_the_cap_of_the_air_speed(wind: list[float]) -> None:
    """Against the wind a leg flies as fast as the cap allows, and a note says so."""
    mission = STORMY.replace({"wind.velocity_m_s": wind})
    plan = optuav.solve(mission)
    assert plan.flyable
    speeds_m_s = air_speeds_m_s(mission, plan)
    assert max(speeds_m_s) == pytest.approx(23.0, rel=1e-9)
    (note,) = (note for note in plan.notes if "cruise_speed_m_s = 20 m/s" in note)
    assert "flight.max_speed_m_s = 23 m/s" in note
    mild = optuav.solve(STORMY.replace({"wind.velocity_m_s": [2.0, 1.0, 0.0]}))
    assert not any("cruise_speed_m_s" in note for note in mild.notes)


def test_a_cruise_speed_that_no_wind_limits_keeps_its_digits() -> None:
    """The ground speed is the stated one, in every direction."""
    model = STORMY.replace({"wind.velocity_m_s": [2.0, 1.0, 0.0]}).flight_model
    for way_m in ((1000.0, 0.0, 0.0), (-600.0, 800.0, 10.0)):
        leg = model.leg(way_m)
        assert float(leg.duration_s) == pytest.approx(1000.0 / 20.0 + 20.0 / 2.0, rel=1e-14)


@pytest.mark.parametrize(
    ("model", "changes"),
    [
        (RotaryWing, {"flight.cruise_speed_m_s": 20.0, "wind.velocity_m_s": [-15.0, 0.0, 0.0]}),
        (RotaryWing, {"flight.speed": "best-range", "flight.max_speed_m_s": 9.0}),
        (Rotors, {"flight.max_speed_m_s": 15.0}),
        (Regimes, {"flight.max_speed_m_s": 5.0}),
    ],
)
def test_the_judge_sees_a_cap_that_the_model_forgets(
    model: Any, changes: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The air speed flown is computed from the leg itself, for any model of flight."""
    names = {RotaryWing: "relay-today", Rotors: "paper-drag", Regimes: "matrice350"}
    mission = optuav.load(names[model]).replace(changes)
    sound, leg = optuav.solve(mission, "P3", perspective="battery"), model.leg
    assert "speed" not in {event.kind for event in optuav.replay(sound).violations}
    uncapped = mission.replace({"flight.max_speed_m_s": 100.0})

    def forgetful(own: Any, way_m: Any) -> Any:
        return leg(model.of(uncapped), way_m)

    monkeypatch.setattr(model, "leg", forgetful)
    stops = optuav.Itinerary(mission, sound.stops)
    (*events,) = (event for event in optuav.replay(stops).violations if event.kind == "speed")
    assert events
    assert {event.limit for event in events} == {mission.flight.max_speed_m_s}
    assert min(event.value for event in events) > mission.flight.max_speed_m_s


@pytest.mark.parametrize("speed", [{}, {"flight.cruise_speed_m_s": 12.0}, {"flight.speed": "max"}])
def test_a_batch_of_storms_says_what_solve_says(speed: dict[str, Any]) -> None:
    """Where the wind exceeds the cap no scenario has a plan, whatever the form of the speed."""
    mission, cap_m_s = WINGED.replace(speed), 23.0
    winds = [0.0, -15.0, 22.9, 23.1, 30.0, -40.0]
    found = optuav.batch_arrays(mission, {"wind.velocity_m_s[0]": winds})
    words = found["reason_words"]
    for wind, hover_s, reason in zip(winds, found["hover_time_s"], found["reason"], strict=True):
        plan = optuav.solve(mission.replace({"wind.velocity_m_s": [wind, 0.0, 0.0]}))
        assert hover_s == pytest.approx(plan.hover_time_s if plan else math.nan, nan_ok=True)
        windy = abs(wind) > cap_m_s
        assert ("the wind is faster than its largest air speed" in words[reason]) == windy
        assert any("the wind blows" in why for why in plan.reasons) == windy


def test_no_plan_is_robust_against_winds_faster_than_the_cap() -> None:
    """The box of winds reaches beyond 23 m/s, where nothing flies."""
    gale = STORMY.replace({"wind.velocity_m_s": [20.0, 0.0, 0.0], "buildings": []})
    with pytest.raises(optuav.NoPlanError, match="no plan that holds in the whole box"):
        optuav.robust(gale, {"wind.velocity_m_s[0]": {"low": 15.0, "high": 25.0}})


def test_a_map_in_a_storm_is_empty() -> None:
    """A map asks as a batch does."""
    pytest.importorskip("xarray")
    stormy = STORMY.replace({"wind.velocity_m_s": [24.0, 0.0, 0.0]})
    found = optuav.maps.hover_point(stormy, 50.0, bounds=(550, 400, 650, 500))
    assert np.isnan(found).all()
    words = found.reason.attrs["words"].splitlines()
    assert "the wind is faster than its largest air speed" in words[int(found.reason[0, 0])]


def test_a_leg_without_a_way_forward_is_no_flight() -> None:
    """Best endurance is slower than this wind: solver and judge say so, and nothing is NaN."""
    own = {"flight.speed": "best-endurance", "wind.velocity_m_s": [-12.0, 12.0, 0.0]}
    mission = optuav.load("relay-today").replace(own)
    plan = optuav.solve(mission, "P3")
    assert "cannot be flown at its speed in this wind" in plan.reasons[0]
    stops = optuav.Itinerary(mission, (optuav.Stop("hover", "hover", 100.0),))
    replayed = optuav.replay(stops)
    assert not replayed.flyable
    assert "origin → hover cannot be flown in this wind" in replayed.violations[0].words
