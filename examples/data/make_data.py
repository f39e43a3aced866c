"""Make the synthetic measurements of this folder: ``python examples/data/make_data.py``.

Each file says what is true in it, so that a fit can be held against it.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from optuav.physics import bang_bang, rotary_wing, rotor

FOLDER = Path(__file__).parent
MOTOR = rotor.Motor(3.8305e-6, 2.2518e-8, 0.04, 2e-4, 920.0, 0.2, 0.0, 1060.0)


def flight_log(folder: Path) -> None:
    """Stand, fly out, hover, fly back, stand in the laser's light; two samples a second."""
    random = np.random.default_rng(1)
    acceleration_m_s2, cap_m_s, distance_m = 2.5, 12.0, 420.0
    loads = bang_bang.leg((distance_m, 0.0, 0.0), acceleration_m_s2, 0.0, 0.0, cap_m_s)
    leg_s = loads.durations_s[0]
    course = (
        ("rest", 30.0, 0.4),
        ("flight", leg_s, 26.0),
        ("hover", 150.0, 21.0),
        ("flight", leg_s, 26.0),
        ("charge", 60.0, -3.0),
    )
    ends_s = np.cumsum([duration_s for _, duration_s, _ in course])
    lines, wander = [], 0.0
    for time_s in np.arange(0.0, ends_s[-1], 0.5):
        number = int(np.searchsorted(ends_s, time_s, side="right"))
        phase, duration_s, mean_A = course[number]
        wander = 0.8 * wander + 0.02 * random.standard_normal()
        current_A = mean_A * (1.0 + wander)
        voltage_V = 23.0 - 0.004 * time_s - 0.03 * current_A + 0.02 * random.standard_normal()
        before_end_s = ends_s[number] - time_s
        ramp_s = min(before_end_s, duration_s - before_end_s)
        speed_m_s = min(cap_m_s, acceleration_m_s2 * ramp_s) if phase == "flight" else 0.0
        speed_m_s = abs(speed_m_s + 0.15 * random.standard_normal())
        lines.append(f"{time_s:.1f},{current_A:.3f},{voltage_V:.3f},{speed_m_s:.2f},{phase}")
    _write(
        folder / "flight_log.csv",
        "Synthetic flight log. True: 26 A in flight, 21 A in hover, 0.4 A at rest, 3.4 A of",
        "charging (3 A net), legs of 420 m with 2.5 m/s2 and at most 12 m/s; the currents wander.",
        "time_s,current_A,voltage_V,speed_m_s,phase",
        *lines,
    )


def airdata_log(folder: Path) -> None:
    """Take off, hover and fly at seven speeds by turns, land; a sample a second, AirData's names.

    The power is that of Zeng, Xu and Zhang (2019).
    """
    random = np.random.default_rng(3)
    coefficients = rotary_wing.PowerCoefficients(79.86, 88.63, 4.03, 120.0, 0.0092)
    course = [(8.0, 0.0, 0.0, False), (6.0, 0.0, 0.0, True), (8.0, 0.0, 3.0, True)]
    for speed_m_s in (3.0, 6.0, 9.0, 12.0, 15.0, 18.0, 20.0):
        course += [(20.0, 0.0, 0.0, True), (30.0, speed_m_s, 0.0, True)]
    course += [(20.0, 0.0, 0.0, True), (12.0, 0.0, -2.0, True), (8.0, 0.0, 0.0, False)]
    lines, now_s = [], 0.0
    for number, (duration_s, cruise_m_s, climb_m_s, armed) in enumerate(course):
        on_ground = number < 2 or number == len(course) - 1
        for passed_s in np.arange(0.0, duration_s):
            ramp_m_s = 3.0 * min(passed_s, duration_s - passed_s)
            speed_m_s = abs(min(cruise_m_s, ramp_m_s) + 0.1 * random.standard_normal())
            power_W = float(np.asarray(rotary_wing.power(coefficients, speed_m_s)))
            power_W = (power_W + 15.0 * climb_m_s) * (1.0 + 0.03 * random.standard_normal())
            power_W = 5.0 if not armed else 40.0 if on_ground else power_W
            left = 1.0 - 0.0016 * now_s
            voltage_V = 14.4 + 2.4 * left - 0.03 * power_W / 15.0
            mph = (speed_m_s / 0.44704, -(climb_m_s + 0.05 * random.standard_normal()) / 0.44704)
            figures = (
                f"{1000 * now_s:.0f},{mph[0]:.2f},{mph[1]:.2f},{voltage_V:.3f},{100 * left:.0f}"
            )
            lines.append(f"{figures},{power_W / voltage_V:.2f},{armed},{on_ground}".lower())
            now_s += 1.0
    text = (
        "# Synthetic log with the names of AirData. True: the power of Zeng, Xu and Zhang (2019):",
        "# 79.86 W, 88.63 W, 4.03 m/s, 120 m/s, 0.0092 W s3/m3; no wind.",
        "time(millisecond),speed(mph), zSpeed(mph),voltage(v),battery_percent,current(A),"
        "isMotorOn,isOnGround",
        *lines,
    )
    (folder / "airdata_log.csv").write_text("\n".join(text) + "\n", "utf-8")


def bench(folder: Path) -> None:
    """One rotor of the mission `paper` at steady speeds, up and down."""
    random = np.random.default_rng(2)
    lines = []
    for speed_rad_s in np.concatenate([np.linspace(250.0, 1060.0, 14)] * 2):
        true = (
            MOTOR.lift_coefficient_N_s2_rad2 * speed_rad_s**2,
            rotor.current(MOTOR, speed_rad_s),
            rotor.voltage(MOTOR, speed_rad_s),
        )
        thrust_N, current_A, voltage_V = (
            value + size * random.standard_normal()
            for value, size in zip(true, (0.03, 0.05, 0.03), strict=True)
        )
        rpm = speed_rad_s * rotor.RPM_PER_RAD_S
        thrust_g = 1e3 * thrust_N / 9.80665
        lines.append(f"{rpm:.0f},{thrust_g:.1f},{current_A:.3f},{voltage_V:.3f}")
    _write(
        folder / "bench.csv",
        "Synthetic bench test. True: the rotor of the mission `paper`; errors of 0.03 N, 0.05 A",
        "and 0.03 V.",
        "speed_rpm,thrust_g,current_A,voltage_V",
        *lines,
    )


def _write(path: Path, *lines: str) -> None:
    """Remarks, header and lines."""
    header = next(number for number, line in enumerate(lines) if "_" in line and " " not in line)
    remarks = [f"# {line}" for line in lines[:header]]
    path.write_text("\n".join([*remarks, *lines[header:]]) + "\n", "utf-8")


def make(folder: Path = FOLDER) -> None:
    """Write all files."""
    flight_log(folder)
    airdata_log(folder)
    bench(folder)


if __name__ == "__main__":
    make()
