"""Coefficients of the power over air speed: found again from their own curve, and how surely."""

from __future__ import annotations

from math import sqrt
from pathlib import Path

import numpy as np
import pytest

import optuav
from optuav import InputError
from tests.cli.run import run

# The UAV of Zeng, Xu and Zhang (2019): P_0, P_i, v_0, U_tip, and ½ d_0 ρ s A.
TRUE = (79.85628, 88.62794, 4.028543, 120.0, 0.00924263)
KEYS = (
    "flight.blade_power_W",
    "flight.induced_power_W",
    "flight.induced_speed_m_s",
    "flight.tip_speed_m_s",
    "flight.parasite_W_s3_m3",
)


def power_W(speed_m_s: float) -> float:
    """Eq (12) as the paper prints it, which cancels at speed."""
    blades, lift, induced, tip, parasite = TRUE
    z = speed_m_s**2 / (2 * induced**2)
    level = lift * sqrt(sqrt(1 + z**2) - z)
    return blades * (1 + 3 * speed_m_s**2 / tip**2) + level + parasite * speed_m_s**3


def log(folder: Path, noise_W: float, count: int, seed: int = 0) -> Path:
    random = np.random.default_rng(seed)
    speeds = np.linspace(0.0, 25.0, count)
    rows = [f"{v},{power_W(v) + noise_W * random.standard_normal()}" for v in speeds]
    file = folder / "log.csv"
    file.write_text("\n".join(["speed_m_s,power_W", *rows]))
    return file


def test_exact_powers_give_the_coefficients_back(tmp_path: Path) -> None:
    """All five, to seven digits, from nine speeds."""
    found = optuav.fit_rotary_wing(log(tmp_path, 0.0, 9))
    assert [value.key for value in found.values] == [*KEYS]
    assert [value.value for value in found.values] == pytest.approx(TRUE, rel=1e-5)
    assert found.changes["flight.efficiency"] == 1.0


def test_intervals_hold_the_truth_about_as_often_as_they_say(tmp_path: Path) -> None:
    """Of 8 noisy logs, at least 6 intervals of each coefficient hold it, as 95 % are stated."""
    held = np.zeros(len(TRUE))
    for seed in range(8):
        found = optuav.fit_rotary_wing(log(tmp_path, 0.1, 60, seed))
        for number, (value, true) in enumerate(zip(found.values, TRUE, strict=True)):
            assert value.interval is not None
            held[number] += value.interval.low <= true <= value.interval.high
    assert (held >= 6).all(), held


def test_slow_flight_does_not_show_the_tip_speed(tmp_path: Path) -> None:
    """Below 8 m/s blades and fuselage add too little: the fit says so and states no tip speed."""
    file = log(tmp_path, 3.0, 60)
    file.write_text("\n".join(file.read_text().splitlines()[:20]))
    found = optuav.fit_rotary_wing(file)
    assert "flight.tip_speed_m_s" not in found.changes
    assert any("the data" in words for words in found.warnings)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("speed_m_s,power_W\n" + "5,100\n" * 8, "at least 6 different speeds; there are 1"),
        ("speed_m_s,power_W\n" + "\n".join(f"{-n},9" for n in range(8)), "speed = -1 m/s, …"),
        ("speed_m_s,power_W\n" + "\n".join(f"{n},0" for n in range(8)), "power = 0 W: above 0"),
        ("speed_m_s\n1\n2", "no column power_W or power_kW"),
    ],
)
def test_broken_logs_are_refused(text: str, words: str, tmp_path: Path) -> None:
    """With the column, the values and the lines."""
    file = tmp_path / "log.csv"
    file.write_text(text)
    with pytest.raises(InputError) as raised:
        optuav.fit_rotary_wing(file)
    assert words.split(" = ", maxsplit=1)[0] in str(raised.value)


def test_a_fragment_flies_once_the_motion_is_stated(tmp_path: Path) -> None:
    """The command's file, on a drone of the same model, has the fitted curve."""
    sheet = optuav.RotorDatasheet(
        mass_kg=2.04,
        cells=6,
        capacity_mAh=5000,
        cruise_speed_m_s=20,
        rotor_radius_m=0.3,
        blade_solidity=0.1,
        tip_speed_m_s=100,
        drag_ratio=1,
    )
    base, fragment = tmp_path / "base.toml", tmp_path / "fitted.toml"
    sheet.mission().save(base)
    file = log(tmp_path, 0.0, 9)
    asked = ("--extends", str(base), "--save", str(fragment), "--plot", str(tmp_path))
    assert run("calibrate", "rotary-wing", str(file), *asked).code == 0
    curve = optuav.power_curve(fragment, [0.0, 10.0, 18.0])
    assert curve.power_W == pytest.approx([power_W(v) for v in (0.0, 10.0, 18.0)], rel=1e-5)
    assert curve.best_endurance_m_s == pytest.approx(10.21169, abs=1e-4)
    assert (tmp_path / "fit.png").exists()
