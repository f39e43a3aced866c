"""Constants of a rotor from a bench test and from data sheets."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import optuav
from optuav.arrays import Floats
from optuav.errors import InputError

DATA = Path(__file__).parents[2] / "examples" / "data"


def test_propeller_and_motor_give_the_specified_constants(tmp_path: Path) -> None:
    """κ_b = C_T ρ A r² is 3.8305e-6, κ_τ = C_Q ρ A r³ is κ0 of the paper's Table I."""
    found = optuav.fit_rotor([DATA / "propeller.csv"])
    rotor = optuav.load("paper").rotor
    assert rotor is not None
    for key, digits in (("lift_coefficient_N_s2_rad2", 5), ("drag_coefficient_Nm_s2_rad2", 5)):
        value = found.changes[f"rotor.{key}"]
        assert f"{value:.{digits - 1}e}" == f"{getattr(rotor, key):.{digits - 1}e}", key
    assert found.changes["rotor.resistance_ohm"] == 0.2
    assert found.panels == ()


def test_friction_from_the_current_without_a_load(tmp_path: Path) -> None:
    """κ_T = 9.5493/920 N m/A times 0.5 A."""
    file = tmp_path / "motor.csv"
    head, row = (DATA / "propeller.csv").read_text("utf-8").splitlines()[2:]
    file.write_text(f"{head},no_load_current_A\n{row},0.5\n")
    found = optuav.fit_rotor([file])
    assert found.changes["rotor.friction_torque_Nm"] == pytest.approx(0.5 * 9.5493 / 920, rel=1e-6)


def test_bench_finds_the_rotor_it_was_made_from() -> None:
    """The truth is inside every interval, but for one in twenty."""
    found = optuav.fit_rotor([DATA / "bench.csv"])
    rotor = optuav.load("paper").rotor
    inside = 0
    for each in found.values[:-1]:
        assert each.interval is not None
        true = getattr(rotor, each.key.removeprefix("rotor."))
        assert each.value == pytest.approx(true, rel=0.05)
        inside += each.interval.low <= true <= each.interval.high
    assert inside >= 5
    assert found.values[-1].key == "rotor.max_speed_rad_s"
    assert found.values[-1].value == pytest.approx(1060.0, rel=1e-3)
    assert [panel.quantity for panel in found.panels] == ["thrust", "current", "voltage"]


def test_exact_bench_gives_the_exact_rotor(tmp_path: Path) -> None:
    """Values from the formulas of the paper, written down here."""
    torque, friction, damping, drag, lift, winding = 9.5493 / 700, 0.02, 1e-4, 3e-8, 5e-6, 0.1
    lines = ["speed_rad_s,thrust_N,current_A,voltage_V"]
    for v in range(200, 1001, 50):
        current = (friction + damping * v + drag * v**2) / torque
        lines.append(f"{v},{lift * v**2!r},{current!r},{winding * current + torque * v!r}")
    file = tmp_path / "bench.csv"
    file.write_text("\n".join(lines))
    changes = optuav.fit_rotor([file]).changes
    for key, true in {
        "lift_coefficient_N_s2_rad2": lift,
        "velocity_constant_rpm_V": 700.0,
        "resistance_ohm": winding,
        "friction_torque_Nm": friction,
        "viscous_damping_Nm_s_rad": damping,
        "drag_coefficient_Nm_s2_rad2": drag,
    }.items():
        assert changes[f"rotor.{key}"] == pytest.approx(true, rel=1e-4), key


def steady(changes: Mapping[str, Any], v: float) -> tuple[float, float]:
    """Current and voltage at a speed [rad/s] by the constants of a fit, from the formulas."""
    rotor = {key.removeprefix("rotor."): value for key, value in changes.items()}
    torque = rotor["friction_torque_Nm"] + rotor["viscous_damping_Nm_s_rad"] * v
    torque += rotor["drag_coefficient_Nm_s2_rad2"] * v**2
    constant = 9.5493 / rotor["velocity_constant_rpm_V"]
    return torque / constant, rotor["resistance_ohm"] * torque / constant + constant * v


LARGE = (1.2e-5, 920.0, 0.1, 0.005, 2e-6, 1.7e-7)
"""Constants of a motor with hardly any damping, in the order of the fit's values."""


def noisy_bench(path: Path, points: int, seed: int) -> Path:
    """A bench test of the motor `LARGE`, with errors of 1 % of the largest of each quantity."""
    random = np.random.default_rng(seed)
    lift, per_volt, winding, friction, damping, drag = LARGE
    v = np.linspace(200.0, 1000.0, points)
    current = (friction + damping * v + drag * v**2) * per_volt / 9.5493
    exact = lift * v**2, current, winding * current + 9.5493 / per_volt * v
    seen = [each + 0.01 * each.max() * random.standard_normal(points) for each in exact]
    rows = [",".join(f"{max(x, 1e-6)}" for x in row) for row in zip(v, *seen, strict=True)]
    path.write_text("\n".join(["speed_rad_s,thrust_N,current_A,voltage_V", *rows]), "utf-8")
    return path


@pytest.mark.parametrize("seed", range(3))
def test_what_is_not_determined_is_stated_beside_the_others(seed: int, tmp_path: Path) -> None:
    """Without the damping, the mission's would stand in, and the current be 300 % off."""
    found = optuav.fit_rotor(noisy_bench(tmp_path / "bench.csv", 12, seed))
    assert not all(value.determined for value in found.values)
    _, per_volt, winding, friction, damping, drag = LARGE
    for v in (500.0, 1000.0):
        current = (friction + damping * v + drag * v**2) * per_volt / 9.5493
        current_A, voltage_V = steady(found.changes, v)
        assert current_A == pytest.approx(current, rel=0.06)
        assert voltage_V == pytest.approx(winding * current + 9.5493 / per_volt * v, rel=0.06)


def held(sets: int, points: int, folder: Path) -> Floats:
    """How many of the sets have the truth inside each interval, whether it is determined or not."""
    counts = np.zeros(len(LARGE))
    for seed in range(sets):
        found = optuav.fit_rotor(noisy_bench(folder / "bench.csv", points, seed))
        for place, (value, true) in enumerate(zip(found.values, LARGE, strict=False)):
            assert value.interval is not None
            counts[place] += value.interval.low <= true <= value.interval.high
    return counts


def test_intervals_hold_the_truth_also_of_what_is_not_determined(tmp_path: Path) -> None:
    """Of 8 sets at least 5; fewer come once in 2000 times at a rate of 95 %."""
    assert (held(8, 12, tmp_path) >= 5).all()


@pytest.mark.soak
@pytest.mark.parametrize("points", [12, 28])
def test_intervals_cover_at_their_nominal_rate(points: int, tmp_path: Path) -> None:
    """In 90 to 99 of 100 sets; the ends of ranges make those of hidden constants safer."""
    assert (held(200, points, tmp_path) >= 180).all()


def test_a_narrow_range_of_speeds_determines_too_little(tmp_path: Path) -> None:
    """What the data do not determine is named; all constants together follow the bench."""
    head, *rows = (DATA / "bench.csv").read_text("utf-8").splitlines()[2:]
    file = tmp_path / "narrow.csv"
    noisy = [row for row in rows if 6000 < float(row.partition(",")[0]) < 9100]
    file.write_text("\n".join([head, *noisy]))
    with pytest.raises(InputError, match="different speeds"):
        optuav.fit_rotor([file])
    speeds = ("500", "501", "502", "503", "504", "505")
    lines = [f"{v},0.96,{14 + 0.05 * (-1) ** int(v)},8.0" for v in speeds]
    file.write_text("\n".join(["speed_rad_s,thrust_N,current_A,voltage_V", *lines]))
    found = optuav.fit_rotor([file])
    assert "drag_coefficient_Nm_s2_rad2" in found.warnings[0]
    current_A, voltage_V = steady(found.changes, 502.5)
    assert current_A == pytest.approx(14.0, abs=0.1)
    assert voltage_V == pytest.approx(8.0, abs=0.1)
    assert found.changes["rotor.lift_coefficient_N_s2_rad2"] == pytest.approx(
        0.96 / 502.5**2, rel=0.01
    )


def test_bench_and_sheet_do_not_mix() -> None:
    with pytest.raises(InputError, match="not both"):
        optuav.fit_rotor([DATA / "bench.csv", DATA / "propeller.csv"])


def test_values_that_cannot_be(tmp_path: Path) -> None:
    """Every line is named."""
    file = tmp_path / "bench.csv"
    rows = "".join(f"{100 + n},1,{-1 if n in (2, 4) else 1},1\n" for n in range(8))
    file.write_text(f"speed_rad_s,thrust_N,current_A,voltage_V\n{rows}")
    with pytest.raises(InputError) as caught:
        optuav.fit_rotor([file])
    (fault,) = caught.value.faults
    assert fault.source.endswith("bench.csv, lines 4, 6")


def test_turns_a_minute_under_radians_are_doubted(tmp_path: Path) -> None:
    text = (DATA / "bench.csv").read_text("utf-8").replace("speed_rpm", "speed_rad_s")
    file = tmp_path / "bench.csv"
    file.write_text(text, "utf-8")
    assert any("the largest speed is 10122" in each for each in optuav.fit_rotor([file]).warnings)


def test_grams_under_newtons_are_doubted(tmp_path: Path) -> None:
    """A newton a watt is more than any propeller gives."""
    text = (DATA / "bench.csv").read_text("utf-8").replace("thrust_g", "thrust_N")
    file = tmp_path / "bench.csv"
    file.write_text(text, "utf-8")
    (words,) = optuav.fit_rotor([file]).warnings
    assert words.startswith("the thrust per power is 0.99712 N/W, where")
    assert words.endswith("perhaps the unit of thrust_N is g")


SHEET = "thrust_coefficient,torque_coefficient,radius_m,air_density_kg_m3"


def test_sizes_of_data_that_no_rotor_has_are_doubted(tmp_path: Path) -> None:
    """Milliohms under ohm, and a density in grams a litre is none of air: one warning each, after
    that of a propeller which wastes nothing."""
    file = tmp_path / "sheet.csv"
    file.write_text(f"{SHEET},resistance_ohm\n0.0048,2.35e-4,0.12,1225,200\n", "utf-8")
    density, resistance, merit = optuav.fit_rotor([file]).warnings
    assert merit.startswith("the figure of merit")
    assert density.startswith("the largest air_density is 1225 kg/m3, where")
    assert resistance.endswith("perhaps the unit of resistance_ohm is mohm")


def sheet(path: Path, head: str, row: str) -> Path:
    path.write_text(f"{head},radius_m,air_density_kg_m3\n{row},0.127,1.225\n", "utf-8")
    return path


def test_coefficients_by_turns_and_diameter_have_their_name(tmp_path: Path) -> None:
    """T = C_T ρ n² D⁴ and Q = C_P ρ n² D⁵/2π: 9.9 N at 8000 rpm of a propeller of 10 inches."""
    n, diameter = 8000 / 60, 0.254
    thrust_N = 0.1092 * 1.225 * n**2 * diameter**4
    torque_Nm = 0.0462 / math.tau * 1.225 * n**2 * diameter**5
    assert thrust_N == pytest.approx(9.9, abs=0.05)
    by_power = sheet(
        tmp_path / "a.csv", "thrust_coefficient_nD,power_coefficient_nD", "0.1092,0.0462"
    )
    by_torque = sheet(
        tmp_path / "b.csv",
        "thrust_coefficient_nD,torque_coefficient_nD",
        f"0.1092,{0.0462 / math.tau}",
    )
    for file in (by_power, by_torque):
        found = optuav.fit_rotor(file)
        v = 8000 * math.tau / 60
        assert found.warnings == ()
        lift, drag = found.changes.values()
        assert lift * v**2 == pytest.approx(thrust_N, rel=1e-6)
        assert drag * v**2 == pytest.approx(torque_Nm, rel=1e-6)


@pytest.mark.parametrize("torque", ["0.00736", "0.0462"])
def test_coefficients_by_turns_and_diameter_under_others_are_doubted(
    torque: str, tmp_path: Path
) -> None:
    """7.75 times the thrust; C_P as C_Q has a usual figure of merit, but C_T tells."""
    file = sheet(tmp_path / "a.csv", "thrust_coefficient,torque_coefficient", f"0.1092,{torque}")
    found = optuav.fit_rotor(file)
    assert any("perhaps the unit of thrust_coefficient is nD" in words for words in found.warnings)
    assert any("figure of merit" in words for words in found.warnings) == (torque == "0.00736")


@pytest.mark.parametrize(
    ("merit", "doubted"), [(0.19, True), (0.21, False), (0.89, False), (0.91, True)]
)
def test_a_figure_of_merit_is_doubted_outside_of_the_usual(
    merit: float, doubted: bool, tmp_path: Path
) -> None:
    """C_T^1.5 over √2 C_Q: the share of the ideal power."""
    row = f"0.01,{0.01**1.5 / math.sqrt(2.0) / merit}"
    found = optuav.fit_rotor(
        sheet(tmp_path / "a.csv", "thrust_coefficient,torque_coefficient", row)
    )
    assert any("figure of merit" in words for words in found.warnings) == doubted


def test_the_propeller_of_the_paper_is_doubted() -> None:
    """Its torque coefficient is the ideal one: a figure of merit of 1.00."""
    (words,) = optuav.fit_rotor(DATA / "propeller.csv").warnings
    assert words.startswith("the figure of merit, C_T^1.5 / (√2 C_Q), is 1.00, where a UAV has 0.2")


def test_two_torques_are_refused(tmp_path: Path) -> None:
    head = "thrust_coefficient_nD,torque_coefficient_nD,power_coefficient_nD"
    with pytest.raises(InputError, match="a second column of torque_coefficient"):
        optuav.fit_rotor(sheet(tmp_path / "a.csv", head, "0.1,0.01,0.05"))
    with pytest.raises(InputError, match="torque_coefficient_nD or power_coefficient_nD"):
        optuav.fit_rotor(sheet(tmp_path / "a.csv", "thrust_coefficient_nD", "0.1"))


def test_inches_under_metres_are_refused(tmp_path: Path) -> None:
    """A lift coefficient of 383 is none of a mission; the column and the units are named."""
    file = tmp_path / "sheet.csv"
    file.write_text(f"{SHEET}\n0.0048,2.35e-4,12,1.225\n", "utf-8")
    with pytest.raises(InputError, match=r"lift_coefficient_N_s2_rad2, .* = 383") as caught:
        optuav.fit_rotor([file])
    assert "the largest radius is 12 m" in str(caught.value)
    assert "perhaps the unit of radius_m is cm or mm or in" in str(caught.value)
    file.write_text(f"{SHEET.replace('radius_m', 'radius_in')}\n0.0048,2.35e-4,6,1.225\n")
    lift = optuav.fit_rotor([file]).changes["rotor.lift_coefficient_N_s2_rad2"]
    assert lift == pytest.approx(0.0048 * 1.225 * 3.14159265 * 0.1524**4, rel=1e-6)


def test_no_mission_lifts_with_383_newtons_at_a_radian_a_second() -> None:
    """Rotors of three metres have a coefficient of 1; what is larger is in another unit."""
    with pytest.raises(InputError, match="lift_coefficient_N_s2_rad2 = 383"):
        optuav.load("paper").replace({"rotor.lift_coefficient_N_s2_rad2": 383.0471})
