"""The power against airspeed: the published check numbers, and independent minima."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import optuav
from optuav import InputError, Mission
from tests.cli.run import refused, run

WING = {
    "blade_power_W": 79.85628,
    "induced_power_W": 88.62794,
    "induced_speed_m_s": 4.028543,
    "tip_speed_m_s": 120.0,
    "parasite_W_s3_m3": 0.00924263,
}


def drone(**keys: Any) -> Mission:
    """`paper` with the rotary wing of Zeng, Xu and Zhang, of 20 N."""
    motion = {"acceleration_m_s2": 2.0, "max_speed_m_s": 30.0}
    vertical = {"climb_speed_m_s": 5.0, "descent_speed_m_s": 4.0}
    flight = {"model": "rotary-wing", **WING, **motion, **vertical}
    body = {"mass_kg": 20.0 / 9.8, "gravity_m_s2": 9.8}
    values = {"flight": flight, "body": body, "rotor": None}
    return optuav.load("paper").replace({**values, **keys})


def test_check_numbers() -> None:
    """Hover, best endurance and best range of the published UAV."""
    curve = optuav.power_curve(drone(), [0.0])
    assert curve.hover_power_W == pytest.approx(168.48422, abs=1e-5)
    assert curve.power_W.tolist() == pytest.approx([168.48422], abs=1e-5)
    assert curve.best_endurance_m_s == pytest.approx(10.21169, abs=1e-5)
    assert curve.best_endurance_power_W == pytest.approx(125.99078, abs=1e-5)
    assert curve.best_range_m_s == pytest.approx(18.29448, abs=1e-5)
    assert curve.best_range_power_W == pytest.approx(161.50995, abs=2e-5)


def test_named_speeds_are_least_of_the_curve() -> None:
    """Of 10 000 speeds none takes less power, or less energy per metre."""
    curve = optuav.power_curve(drone(), np.linspace(0.01, 30.0, 10_000))
    assert curve.power_W.min() == pytest.approx(curve.best_endurance_power_W, abs=1e-4)
    per_metre = (curve.power_W / curve.speeds_m_s).min()
    best = curve.best_range_power_W / curve.best_range_m_s
    assert per_metre == pytest.approx(best, abs=1e-6)


def test_wind_makes_hovering_cheaper() -> None:
    """At 10 m/s 126.0 W in place of 168.5 W; the curve is over air speed and stays."""
    windy = optuav.power_curve(drone(**{"wind.velocity_m_s": [6.0, 8.0, 0.0]}))
    assert windy.hover_power_W == pytest.approx(126.0, abs=0.05)
    assert windy.power_W.tolist() == optuav.power_curve(drone()).power_W.tolist()


def test_current_counts_efficiency_and_voltage() -> None:
    """I = P / (efficiency e_nom)."""
    mission = drone(**{"flight.efficiency": 0.8})
    curve = optuav.power_curve(mission, [0.0])
    expected = 168.48422 / 0.8 / mission.battery.nominal_voltage_V
    assert curve.current_A.tolist() == pytest.approx([expected], abs=1e-5)


def test_the_rotors_power_and_the_battery_s_have_two_names() -> None:
    """In rows, columns and print; no column is named just power."""
    curve = optuav.power_curve(drone(**{"flight.efficiency": 0.8}), [0.0])
    (row,) = curve.rows
    assert [*row] == ["speed_m_s", "rotor_power_W", "battery_power_W", "current_A"]
    assert row["rotor_power_W"] == pytest.approx(168.48422, abs=1e-5)
    assert row["battery_power_W"] == pytest.approx(168.48422 / 0.8, abs=1e-5)
    assert curve.battery_power_W.tolist() == [row["battery_power_W"]]
    assert "rotor power [W]  battery power [W]" in str(curve)
    assert "168.48             210.61" in str(curve)


def test_the_cap_binds_named_speeds() -> None:
    """With a cap of 9 m/s both are 9 m/s, and the default speeds end there."""
    curve = optuav.power_curve(drone(**{"flight.max_speed_m_s": 9.0}))
    assert (curve.best_endurance_m_s, curve.best_range_m_s) == (9.0, 9.0)
    assert (curve.speeds_m_s[0], curve.speeds_m_s[-1]) == (0.0, 9.0)


@pytest.mark.parametrize("speeds", [[], [-1.0], [float("nan")], ["fast"], "fast", [1e7]])
def test_what_is_no_speed_is_refused(speeds: Any) -> None:
    """With the argument and what it may be."""
    with pytest.raises(InputError, match=r"speeds_m_s = .*: must be numbers, 0 <= x <= 1e6"):
        optuav.power_curve(drone(), speeds)


def test_models_without_a_curve_are_refused() -> None:
    """Also on the command line, where the named speeds are shown."""
    assert "flight.model = 'rotors': must be 'rotary-wing'" in refused("power", "paper")


def test_the_command_shows_and_saves(tmp_path: Any) -> None:
    """Named speeds as text, all as a table, and a picture."""
    file = drone().save(tmp_path / "drone.toml")
    shown = run("power", str(file), "--save", str(tmp_path / "p.csv"), "--plot", str(tmp_path))
    assert "10.21 m/s in still air" in shown.out
    assert len((tmp_path / "p.csv").read_text().splitlines()) == 102
    assert (tmp_path / "power.png").exists()


def test_a_datasheet_gives_the_published_coefficients() -> None:
    """R 0.4 m, s 0.05, U_tip 120 m/s, d_0 0.6, 20 N; the paper rounds the disc to 0.503 m²."""
    sheet = optuav.RotorDatasheet(
        mass_kg=20.0 / 9.8,
        rotors=1,
        cells=6,
        capacity_mAh=5000,
        cruise_speed_m_s=30,
        rotor_radius_m=0.4,
        blade_solidity=0.05,
        tip_speed_m_s=120,
        drag_ratio=0.6,
    )
    flight: Any = sheet.mission().flight
    found = [getattr(flight, name) for name in WING]
    assert found == pytest.approx([*WING.values()], rel=1e-3)


def test_rotor_datasheets_tell_all_faults() -> None:
    """Missing, out of range and unknown, at once; and each kind of sheet has its own numbers."""
    wrong: dict[str, Any] = {"mass_kg": -1, "cells": 6, "hover_min": 30}
    with pytest.raises(InputError) as raised:
        optuav.RotorDatasheet(**wrong)
    told = {fault.key for fault in raised.value.faults}
    assert {"mass_kg", "hover_min", "rotor_radius_m", "drag_ratio", "capacity_mAh"} <= told
    assert "--from" in refused("new", "x.toml", "--rotor-radius-m", "0.3")
