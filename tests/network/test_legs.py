"""The table of legs, against one leg at a time."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given

import optuav
from optuav.flight.rotors import Rotors
from optuav.mission import Mission
from optuav.network.legs import Legs, build_legs
from optuav.network.network import build_network
from optuav.network.places import DESTINATION, HOVER, ORIGIN, Places
from optuav.network.prisms import prisms
from tests.examples import few
from tests.mission.strategies import missions


def table_of(mission: Mission) -> Legs:
    return build_network(mission).legs


def test_legs_are_numbered_as_documented() -> None:
    """0 and 1 are direct; 2 + 4 b to 5 + 4 b belong to building b."""
    mission = optuav.load("paper")
    two = table_of(mission.replace({"buildings": mission.to_dict()["buildings"][:2]}))
    b1, b2 = 3, 4
    assert list(zip(two.start, two.end, strict=True)) == [
        *((ORIGIN, HOVER), (HOVER, DESTINATION)),
        *((ORIGIN, b1), (b1, HOVER), (HOVER, b1), (b1, DESTINATION)),
        *((ORIGIN, b2), (b2, HOVER), (HOVER, b2), (b2, DESTINATION)),
    ]
    none = table_of(mission.replace({"buildings": []}))
    assert [none.start.tolist(), none.end.tolist()] == [[ORIGIN, HOVER], [HOVER, DESTINATION]]


def all_pairs(mission: Mission) -> tuple[Places, Legs]:
    """The places, and the legs between any two of them, both ways."""
    places = build_network(mission).places
    start, end = np.nonzero(~np.eye(len(places.names), dtype=bool))
    return places, build_legs(mission, places, prisms(mission.buildings), start, end)


@pytest.mark.campaign
@few(5, most=1000)
@given(missions())
def test_the_table_of_all_pairs_holds_the_one_stop_legs(mission: Mission) -> None:
    """The same figures, sight included, wherever both tables have a leg; and there and back."""
    network = build_network(mission)
    some, (_, every) = network.legs, all_pairs(mission)
    number = {pair: k for k, pair in enumerate(zip(every.start, every.end, strict=True))}
    for leg, pair in enumerate(zip(some.start, some.end, strict=True)):
        same = number[pair]
        assert every.flyable[same] == some.flyable[leg]
        for name in ("duration_s", "charge_As", "energy_J", "distance_m", "peak_speed_m_s"):
            one, other = getattr(every, name)[same], getattr(some, name)[leg]
            assert one == pytest.approx(other, rel=1e-12, nan_ok=True), name
    # Building to hover point and back: time, charge, energy, speed, and what is in the way.
    table = table_of(mission)
    there, back = slice(3, None, 4), slice(4, None, 4)
    for name in ("duration_s", "charge_As", "energy_J", "distance_m", "peak_speed_m_s"):
        column = getattr(table, name)
        assert column[there] == pytest.approx(column[back], rel=1e-9, nan_ok=True), name
    assert np.array_equal(table.crosses[there], table.crosses[back])
    assert np.array_equal(table.flyable[there], table.flyable[back])


def test_a_building_between_two_others_blocks_their_leg() -> None:
    """Three 60 m roofs in a line: the outer two do not see each other, their neighbours do."""
    rows = [
        {"name": f"n{k}", "position_m": [100.0 * k, 500.0, 60.0], "footprint_m": [40.0, 40.0]}
        for k in range(3)
    ]
    rows[1]["position_m"] = [100.0, 500.0, 90.0]
    mission = optuav.load("paper").replace({"buildings": rows})
    where, table = all_pairs(mission)
    flyable = {
        (where.names[a], where.names[b]): bool(free)
        for a, b, free in zip(table.start, table.end, table.flyable, strict=True)
    }
    assert not flyable["n0", "n2"]
    assert not flyable["n2", "n0"]
    assert flyable["n0", "n1"]
    assert flyable["n1", "n2"]


@pytest.mark.campaign
@few(5, most=1000)
@given(missions("rotors"))
def test_rotor_legs_are_those_of_the_physics_one_by_one(mission: Mission) -> None:
    """Durations and charges of every stage, wind included, as `six_stages.leg` gives them."""
    network = build_network(mission)
    where, table = network.places.position_m, network.legs
    for leg, (start, end) in enumerate(zip(table.start, table.end, strict=True)):
        x, y, z = (where[end] - where[start]).tolist()
        one = Rotors.of(mission).six_stage_leg((x, y, z))
        expected = {
            "distance_m": math.hypot(x, y, z),
            "peak_speed_m_s": one.peak_speed_m_s,
            "duration_s": one.loads.duration_s,
            "charge_As": one.loads.charge_As,
            "energy_J": one.loads.energy_J,
        }
        for name, value in expected.items():
            assert getattr(table, name)[leg] == pytest.approx(value, rel=1e-12, nan_ok=True), name
        stages = np.array(one.loads.durations_s, dtype=float)
        assert table.durations_s[:, leg] == pytest.approx(stages, rel=1e-9, nan_ok=True)
        assert list(table.currents_A[:, leg]) == list(one.loads.currents_A)


@pytest.mark.campaign
@few(5, most=1000)
@given(missions("regimes"))
def test_regime_legs_are_trapezoids(mission: Mission) -> None:
    """T = 2 sqrt(d/a), or d/v + v/a once the cap is reached; constant current and power."""
    given = mission.flight
    assert given.model == "regimes"
    network = build_network(mission)
    where, table = network.places.position_m, network.legs
    a, cap = given.acceleration_m_s2, given.max_speed_m_s or math.inf
    for leg, (start, end) in enumerate(zip(table.start, table.end, strict=True)):
        d = math.dist(where[start], where[end])
        if math.isnan(d):
            assert not table.flyable[leg]
            continue
        peak = math.sqrt(a * d)
        duration_s = 2 * math.sqrt(d / a) if peak <= cap else d / cap + cap / a
        assert table.duration_s[leg] == pytest.approx(duration_s, rel=1e-12)
        assert table.peak_speed_m_s[leg] == pytest.approx(min(peak, cap), rel=1e-12)
        assert table.charge_As[leg] == pytest.approx(duration_s * given.flight_current_A)
        assert table.energy_J[leg] == pytest.approx(duration_s * given.flight_power_W)


def test_direct_leg_of_the_shipped_mission() -> None:
    """SPEC 4: 37.8961 s, of it 3.1165 s turning, 3921.555 A s, 63 533 J, 154.89 m/s."""
    table = table_of(optuav.load("paper"))
    for leg in (0, 1):
        assert table.duration_s[leg] == pytest.approx(37.8961, abs=5e-5)
        assert table.durations_s[::2, leg].sum() == pytest.approx(3.1165, abs=5e-5)
        assert table.charge_As[leg] == pytest.approx(3921.555, abs=5e-4)
        assert table.energy_J[leg] == pytest.approx(63533, abs=0.5)
        assert table.peak_speed_m_s[leg] == pytest.approx(154.89, abs=5e-3)
    assert table.flyable.all(), "no one-stop leg crosses a building"


def test_a_uav_that_cannot_fly_has_no_legs() -> None:
    """Too heavy: every leg NaN and not flyable."""
    table = table_of(optuav.load("paper").replace({"body.mass_kg": 5}))
    assert not table.flyable.any()
    assert np.isnan(table.duration_s).all()


def test_a_leg_of_no_length_takes_nothing() -> None:
    """Hovering over the origin: a leg all the same, of 0 s."""
    mission = optuav.load("paper").replace({"route.origin_m": [1000, 2800, 60]})
    table = table_of(mission.replace({"route.hover_m": [1000, 2800, 60]}))
    assert table.flyable[0]
    assert table.duration_s[0] == table.charge_As[0] == table.energy_J[0] == 0.0
