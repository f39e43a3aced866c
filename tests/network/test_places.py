"""Places as arrays: where they are, what the laser delivers there."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given

import optuav
from optuav.mission import Mission
from optuav.network.network import build_network
from optuav.network.places import ENDS, HOVER, Places
from tests.examples import few
from tests.mission.strategies import missions


def places_of(mission: Mission) -> Places:
    return build_network(mission).places


def weak(power_W: float) -> Mission:
    """The mission `paper` with a laser too weak to be limited, in air of 0.3 per km."""
    return optuav.load("paper").replace({"laser.power_W": power_W, "laser.attenuation_per_km": 0.3})


def test_ends_come_first_and_buildings_in_the_order_of_the_mission() -> None:
    """All tables count places this way."""
    mission = optuav.load("paper")
    where = places_of(mission)
    assert where.names == (*ENDS, *(f"b{number}" for number in range(1, 11)))
    assert where.position_m[:3].tolist() == [
        list(mission.route.origin_m),
        pytest.approx([1000, 2501.0152, 50], abs=5e-5),
        list(mission.route.destination_m),
    ]
    assert where.position_m[3:].tolist() == [list(each.position_m) for each in mission.buildings]
    assert list(where.buildings) == list(range(3, 13))


def test_the_shipped_mission_charges_with_its_limit_everywhere() -> None:
    """All of `paper` is in clear sight, and 1000 W deliver more than 10 A at 11.1 V."""
    where = places_of(optuav.load("paper"))
    assert where.laser_sight.all()
    assert where.charge_current_A == pytest.approx(np.full(13, 10.0))
    assert where.received_power_W == pytest.approx(np.full(13, 111.0))


def test_stated_charging_replaces_the_laser_model() -> None:
    """`paper-table2` charges with 5.992 A and 66.515 W in sight, at any distance."""
    where = places_of(optuav.load("paper-table2"))
    assert (where.charge_current_A == 5.992).all()
    assert (where.received_power_W == 66.515).all()


def test_a_weak_laser_delivers_by_distance() -> None:
    """P_0 = a1 a2 ν P_s + a2 b1 ν + b2 with ν = exp(−α d), d in km; never below 0."""
    a1, b1, a2, b2 = 0.34, -1.1, 0.5434, -0.2761
    for power_W in (2.0, 50.0, 300.0):
        where = places_of(weak(power_W))
        for position_m, received_W, current_A in zip(
            where.position_m, where.received_power_W, where.charge_current_A, strict=True
        ):
            ν = math.exp(-0.3 * math.dist(position_m, (1000, 0, 50)) / 1000)
            expected_W = max(0.0, a1 * a2 * ν * power_W + a2 * b1 * ν + b2)
            assert received_W == pytest.approx(expected_W, rel=1e-12, abs=1e-12)
            assert current_A == pytest.approx(expected_W / 11.1, rel=1e-12, abs=1e-12)


def test_without_a_laser_it_is_dark() -> None:
    """No table [laser]: no sight and no charging."""
    where = places_of(optuav.load("paper").replace({"laser": None}))
    assert not where.laser_sight.any()
    assert not where.received_power_W.any()
    assert not where.charge_current_A.any()


def test_a_roof_in_the_shadow_gets_nothing() -> None:
    """A tower between the laser and b9."""
    mission = optuav.load("paper")
    tower = {"name": "tower", "position_m": [900, 875, 300], "footprint_m": [60, 60]}
    stated = [*mission.to_dict()["buildings"], tower]
    where = places_of(mission.replace({"buildings": stated}))
    dark = [name for name, sees in zip(where.names, where.laser_sight, strict=True) if not sees]
    assert dark == ["b9"]
    shadow = where.names.index("b9")
    assert where.received_power_W[shadow] == where.charge_current_A[shadow] == 0.0


def test_a_hover_point_that_does_not_exist() -> None:
    """Nothing within reach of the device: no place, no sight, no charging."""
    where = places_of(optuav.load("paper").replace({"link.device_m": [1000, 3000, 900]}))
    assert np.isnan(where.position_m[HOVER]).all()
    assert not where.laser_sight[HOVER]
    assert where.received_power_W[HOVER] == where.charge_current_A[HOVER] == 0.0


@pytest.mark.campaign
@few(5, most=1000)
@given(missions())
def test_charging_is_a_matter_of_sight_and_of_the_limit(mission: Mission) -> None:
    """0 without sight; with it between 0 and the limit, or as stated."""
    where = places_of(mission)
    assert not where.received_power_W[~where.laser_sight].any()
    assert not where.charge_current_A[~where.laser_sight].any()
    lit = where.laser_sight
    if mission.flight.model == "regimes" and mission.flight.charge_current_A is not None:
        assert (where.charge_current_A[lit] == mission.flight.charge_current_A).all()
        assert (where.received_power_W[lit] == mission.flight.charge_power_W).all()
        return
    assert (where.charge_current_A >= 0.0).all()
    assert (where.charge_current_A <= mission.battery.charge_current_A * (1 + 1e-12)).all()
    power_W = where.charge_current_A * mission.battery.nominal_voltage_V
    assert where.received_power_W == pytest.approx(power_W, rel=1e-12)
