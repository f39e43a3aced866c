"""Constants of a rotor from a bench test, or from the data of propeller and motor.

A bench test at steady speeds gives thrust ϱ v², current (T_f + D_f v + κ0 v²)/κ and voltage
R i + κ v, κ = 9.5493/κ_V [1]_. Each quantity is weighted by the residuals that the fit leaves of
it. Data sheets give the coefficients of the propeller of radius r, ϱ = C_T ρ A r² and
κ0 = C_Q ρ A r³ with A = π r², and of the motor κ_V, R and the current I_0 that it draws without a
load, T_f = κ I_0.

References
----------
.. [1] F. Morbidi, R. Cano, D. Lara, "Minimum-energy path generation for a quadrotor UAV",
   IEEE ICRA 2016.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from optuav.arrays import Floats
from optuav.calibration import csv
from optuav.calibration.fit import Fit, Value, finished, panel, undetermined, values_of
from optuav.calibration.least_squares import estimate
from optuav.errors import Fault, InputError
from optuav.physics import rotor

LEAST_POINTS = 6
BENCH = csv.Format(
    (
        csv.Column("speed", "rotor speed"),
        csv.Column("thrust", "force"),
        csv.Column("current", "current"),
        csv.Column("voltage", "voltage"),
    ),
    least=LEAST_POINTS,
)
SHEET = csv.Format(
    (
        csv.Column("thrust_coefficient", "number"),
        csv.Column("torque_coefficient", "number"),
        csv.Column("radius", "length"),
        csv.Column("air_density", "density"),
        csv.Column("velocity_constant", "velocity constant", needed=False),
        csv.Column("resistance", "resistance", needed=False),
        csv.Column("no_load_current", "current", needed=False),
    )
)
SHEET_SIZES = {
    "radius": "radius",
    "air_density": "air density",
    "resistance": "resistance",
    "no_load_current": "current",
}
"""Columns of a data sheet whose size shows whether the unit is right, with the quantity."""
KEYS = (
    "lift_coefficient_N_s2_rad2",
    "velocity_constant_rpm_V",
    "resistance_ohm",
    "friction_torque_Nm",
    "viscous_damping_Nm_s_rad",
    "drag_coefficient_Nm_s2_rad2",
)
"""Of [rotor], found on a bench."""
SPEED = "speed of the rotor $v$ [rad/s]"
QUANTITIES = (("thrust", "N"), ("current", "A"), ("voltage", "V"))
ROUNDS = 3  # fits, each weighted by the residuals of the one before
LEAST_RESIDUAL = 1e-9  # of a quantity for its weight, over its largest value
TYPICAL = (0.1, 0.01, 0.3)
"""Shares with which the fit starts: of the voltage lost in the winding, of the torque in friction
and in damping."""


def fit_rotor(files: Iterable[str | Path]) -> Fit:
    r"""Find the constants of a rotor.

    Parameters
    ----------
    files
        Bench tests of one rotor at steady speeds, as CSV: ``speed_rad_s`` (or ``speed_rpm``),
        ``thrust_N`` (or ``thrust_g``), ``current_A``, ``voltage_V`` across the motor. Or one file
        with a single line of data of propeller and motor: ``thrust_coefficient``,
        ``torque_coefficient``, ``radius_m``, ``air_density_kg_m3`` and, if known,
        ``velocity_constant_rpm_V``, ``resistance_ohm``, ``no_load_current_A``.

    Returns
    -------
    Fit
        Keys of [rotor]. Steady speeds do not show the inertia, data sheets neither the largest
        speed nor the damping: the mission keeps its own.

    Raises
    ------
    InputError
        With every fault of the files, or if no mission may state a constant.

    Examples
    --------
    >>> import optuav, pathlib, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = pathlib.Path(folder) / "propeller.csv"
    ...     names = "thrust_coefficient,torque_coefficient,radius_m,air_density_kg_m3"
    ...     _ = file.write_text(f"{names}\n0.0048,2.3515e-4,0.12,1.225\n")
    ...     optuav.fit_rotor([file]).changes["rotor.lift_coefficient_N_s2_rad2"]
    3.830471e-06
    """
    paths = [Path(file) for file in files]
    tables = csv.read_all(paths, _read)
    sheets = [table for table in tables if "radius" in table.numbers]
    if not sheets:
        return _from_bench(paths, tables)
    if len(tables) > 1:
        words = "bench tests, or one file of propeller and motor data, not both"
        raise InputError([Fault("", "", words, sheets[0].source)])
    return _from_sheet(paths[0], sheets[0])


def _read(path: Path) -> csv.Measurements:
    table = csv.read(path, BENCH, SHEET)
    faults = [
        fault
        for name, values in table.numbers.items()
        for fault in table.faults(values <= 0.0, name, "above 0")
    ]
    lines, speeds = len(table.lines), len(np.unique(table.numbers.get("speed", [])))
    if "radius" in table.numbers and lines > 1:
        faults.append(Fault("lines", f"{lines}", "1: a single propeller", table.source))
    if "speed" in table.numbers and speeds < LEAST_POINTS:
        words = f"at least {LEAST_POINTS} different speeds; there are {speeds}"
        faults.append(Fault("", "", words, table.source))
    if faults:
        raise InputError(faults)
    return table


def _from_sheet(path: Path, table: csv.Measurements) -> Fit:
    given = {name: float(values[0]) for name, values in table.numbers.items()}
    radius_m = given["radius"]
    disc_kg_m = given["air_density"] * math.pi * radius_m**2
    found = {
        KEYS[0]: (given["thrust_coefficient"] * disc_kg_m * radius_m**2, "C_T ρ A r²"),
        KEYS[5]: (given["torque_coefficient"] * disc_kg_m * radius_m**3, "C_Q ρ A r³"),
    }
    sizes = {words: given[name] for name, words in SHEET_SIZES.items() if name in given}
    warnings = list(csv.unit_doubts("as stated", sizes))
    if "velocity_constant" in given:
        found[KEYS[1]] = (given["velocity_constant"], "as stated")
    if "resistance" in given:
        found[KEYS[2]] = (given["resistance"], "as stated")
    if {"velocity_constant", "no_load_current"} <= given.keys():
        torque_constant_Nm_A = rotor.RPM_PER_RAD_S / given["velocity_constant"]
        found[KEYS[3]] = (torque_constant_Nm_A * given["no_load_current"], "9.5493/κ_V I_0")
    elif "no_load_current" in given:
        warnings.append("the friction torque needs velocity_constant_rpm_V as well")
    values = tuple(Value(f"rotor.{key}", *each) for key, each in found.items())
    data = "data of a propeller and its motor"
    return finished(Fit("rotor", (str(path),), data, values, (), tuple(warnings)))


def _from_bench(paths: list[Path], tables: list[csv.Measurements]) -> Fit:
    measured = {
        name: np.concatenate([table.numbers[name] for table in tables])
        for name in ("speed", "thrust", "current", "voltage")
    }
    speed = measured["speed"]
    largest = {name: float(np.max(values)) for name, values in measured.items()}
    weights = {name: 1.0 / largest[name] for name, _ in QUANTITIES}

    def residuals(values: Floats) -> Floats:
        model = _model(values, speed)
        return np.concatenate(
            [weights[name] * (model[name] - measured[name]) for name, _ in QUANTITIES]
        )

    keys = tuple(f"rotor.{key}" for key in KEYS)
    found = estimate(keys, residuals, [_start(measured)])
    for _ in range(ROUNDS - 1):
        parts = np.split(found.residuals, len(QUANTITIES))
        for (name, _), part in zip(QUANTITIES, parts, strict=True):
            left = float(np.sqrt(np.mean((part / weights[name]) ** 2)))
            weights[name] = 1.0 / max(left, LEAST_RESIDUAL * largest[name])
        found = estimate(keys, residuals, [found.values.tolist()])
    fitted, order = _model(found.values, speed), np.argsort(speed, kind="stable")
    fastest = Value("rotor.max_speed_rad_s", largest["speed"], "fastest point of the bench")
    power_W = largest["current"] * largest["voltage"]
    sizes = {"rotor speed": largest["speed"], "current": largest["current"]}
    return finished(
        Fit(
            "rotor",
            tuple(map(str, paths)),
            f"{len(speed)} points of a bench test at steady speed",
            (*values_of(found, keys, f"fitted to {len(speed)} points"), fastest),
            tuple(
                panel(name, unit, measured[name][order], fitted[name][order], speed[order], SPEED)
                for name, unit in QUANTITIES
            ),
            (
                *undetermined(found),
                *csv.unit_doubts("at most", {**sizes, "voltage": largest["voltage"]}),
                *csv.unit_doubts(
                    "at full speed", {"thrust per power": largest["thrust"] / power_W}
                ),
            ),
        )
    )


def _model(values: Floats, speed_rad_s: Floats) -> dict[str, Floats]:
    """Thrust [N], current [A] and voltage [V] at steady speeds."""
    motor = rotor.Motor(
        **dict(zip(KEYS, values, strict=True)), inertia_kg_m2=0.0, max_speed_rad_s=math.inf
    )
    return {
        "thrust": motor.lift_coefficient_N_s2_rad2 * speed_rad_s**2,
        "current": rotor.current(motor, speed_rad_s),
        "voltage": rotor.voltage(motor, speed_rad_s),
    }


def _start(measured: dict[str, Floats]) -> tuple[float, ...]:
    """Values of a usual motor that fit the fastest point."""
    fastest = int(np.argmax(measured["speed"]))
    v, thrust, i, e = (float(values[fastest]) for values in measured.values())
    lost, friction, damping = TYPICAL
    torque_constant = (1.0 - lost) * e / v
    torque = torque_constant * i
    return (
        thrust / v**2,
        rotor.RPM_PER_RAD_S / torque_constant,
        lost * e / i,
        friction * torque,
        damping * torque / v,
        (1.0 - friction - damping) * torque / v**2,
    )
