"""Constants of a rotor from a bench test, or from the data of propeller and motor.

Each quantity of a bench is weighted by the residuals that the fit leaves of it.
"""

import math
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from optuav.arrays import Floats
from optuav.calibration import csv
from optuav.calibration.fit import Fit, Value, curve, estimate, finished
from optuav.errors import Fault, InputError, refuse
from optuav.physics import rotor

LEAST_POINTS = 6
BENCH = csv.Format(
    {"speed": "rotor speed", "thrust": "force", "current": "current", "voltage": "voltage"},
    least=LEAST_POINTS,
)
PROPELLER = {"thrust_coefficient": "number", "torque_coefficient": "number", "radius": "length"}
MOTOR = {"velocity_constant": "velocity constant", "resistance": "resistance"}
MOTOR |= {"no_load_current": "current"}
SHEET = csv.Format(PROPELLER | {"air_density": "density"} | MOTOR, tuple(MOTOR))
KEYS = (
    *("lift_coefficient_N_s2_rad2", "velocity_constant_rpm_V", "resistance_ohm"),
    *("friction_torque_Nm", "viscous_damping_Nm_s_rad", "drag_coefficient_Nm_s2_rad2"),
)
"""Keys of [rotor] that a bench measures."""
QUANTITIES = {"thrust": "N", "current": "A", "voltage": "V"}
THRUST_PER_POWER = (0.003, 0.5, "N/W")  # usual, by least and most
ROUNDS = 3  # fits, each weighted by the residuals of the one before
LEAST_RESIDUAL = 1e-9  # of a quantity for its weight, over its largest value


def fit_rotor(files: str | Path | Iterable[str | Path]) -> Fit:
    r"""Find the constants of a rotor.

    At a steady speed v the thrust is ϱ v², the current (T_f + D_f v + κ0 v²)/κ and the voltage
    R i + κ v, κ = 9.5493/κ_V [1]_; data sheets give ϱ = C_T ρ A r², κ0 = C_Q ρ A r³ with A = π r²,
    and T_f = κ I_0 with the current I_0 that the motor draws without a load.

    Parameters
    ----------
    files
        CSV files of bench tests at steady speeds: ``speed_rad_s`` (or ``speed_rpm``),
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

    References
    ----------
    .. [1] F. Morbidi, R. Cano, D. Lara, "Minimum-energy path generation for a quadrotor UAV",
       IEEE ICRA 2016.

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
    sources, tables = csv.read_all(files, [BENCH, SHEET], _checked)
    sheets = [table for table in tables if "radius" in table.numbers]
    if sheets and len(tables) > 1:
        words = "bench tests, or one file of propeller and motor data, not both"
        raise InputError([Fault("", "", words, sheets[0].source)])
    return finished(_from_sheet(sources, sheets[0]) if sheets else _from_bench(sources, tables))


def _checked(table: csv.Measurements) -> csv.Measurements:
    """A file of either kind, all of whose numbers are above 0."""
    faults = list[Fault]()
    for name, values in table.numbers.items():
        faults += table.faults(values <= 0.0, name, "above 0")
    if "radius" in table.numbers and (lines := len(table.lines)) > 1:
        faults.append(Fault("lines", f"{lines}", "1: a single propeller", table.source))
    if "speed" in table.numbers:
        faults += table.few("speed", LEAST_POINTS)
    refuse(faults)
    return table


def _from_sheet(sources: tuple[str, ...], table: csv.Measurements) -> Fit:
    """Constants from the data of propeller and motor."""
    data = {name: float(values[0]) for name, values in table.numbers.items()}
    disc_kg = data["air_density"] * math.pi * data["radius"] ** 3
    constants = {
        KEYS[0]: (data["thrust_coefficient"] * disc_kg * data["radius"], "C_T ρ A r²"),
        KEYS[5]: (data["torque_coefficient"] * disc_kg * data["radius"] ** 2, "C_Q ρ A r³"),
    }
    warnings = list(table.doubts())
    columns = {KEYS[1]: "velocity_constant", KEYS[2]: "resistance"}
    constants |= {key: (data[name], "as stated") for key, name in columns.items() if name in data}
    if {"velocity_constant", "no_load_current"} <= data.keys():
        torque_constant_Nm_A = rotor.RPM_PER_RAD_S / data["velocity_constant"]
        constants[KEYS[3]] = (torque_constant_Nm_A * data["no_load_current"], "9.5493/κ_V I_0")
    elif "no_load_current" in data:
        warnings.append("the friction torque needs velocity_constant_rpm_V as well")
    values = tuple(Value(f"rotor.{key}", *each) for key, each in constants.items())
    return Fit("rotor", sources, "data of a propeller and its motor", values, (), tuple(warnings))


def _from_bench(sources: tuple[str, ...], tables: list[csv.Measurements]) -> Fit:
    """Constants that fit thrust, current and voltage over the speed."""
    measured = {
        name: np.concatenate([table.numbers[name] for table in tables]) for name in BENCH.kinds
    }
    speed, count = measured["speed"], len(measured["speed"])
    largest = {name: float(np.max(values)) for name, values in measured.items()}
    weights = {name: 1.0 / largest[name] for name in QUANTITIES}

    def residuals(values: Floats) -> Floats:
        model = _model(values, speed)
        left = [weights[name] * (model[name] - measured[name]) for name in QUANTITIES]
        return np.concatenate(left)

    keys = tuple(f"rotor.{key}" for key in KEYS)
    # A usual motor at the fastest point: a tenth of the voltage is lost in the winding; 1 % of the
    # torque in friction, 30 % in damping.
    v, thrust, i, e = (float(values[np.argmax(speed)]) for values in measured.values())
    torque = 0.9 * e / v * i
    propeller = (0.01 * torque, 0.3 * torque / v, 0.69 * torque / v**2)
    start = (thrust / v**2, rotor.RPM_PER_RAD_S / (0.9 * e / v), 0.1 * e / i, *propeller)
    estimated = estimate(keys, residuals, [start])
    for _ in range(ROUNDS - 1):
        for name, part in zip(QUANTITIES, np.split(estimated.residuals, 3), strict=True):
            left = float(np.sqrt(np.mean((part / weights[name]) ** 2)))
            weights[name] = 1.0 / max(left, LEAST_RESIDUAL * largest[name])
        estimated = estimate(keys, residuals, [estimated.values.tolist()])
    fitted, at_words = _model(estimated.values, speed), "speed of the rotor $v$ [rad/s]"
    panels = (
        curve(name, unit, measured[name], fitted[name], speed, at_words)
        for name, unit in QUANTITIES.items()
    )
    doubts = [words for table in tables for words in table.doubts()]
    per_W = largest["thrust"] / (largest["current"] * largest["voltage"])
    doubts += csv.unit_doubts("the thrust per power", per_W, "thrust", "force", THRUST_PER_POWER)
    fastest = Value("rotor.max_speed_rad_s", largest["speed"], "fastest point of the bench")
    values = (*estimated.stated(f"fitted to {count} points"), fastest)
    data, warnings = f"{count} points of a bench test at steady speed", dict.fromkeys(doubts)
    return Fit("rotor", sources, data, values, tuple(panels), (*estimated.warnings, *warnings))


def _model(values: Floats, speed_rad_s: Floats) -> dict[str, Floats]:
    """Thrust [N], current [A] and voltage [V] at steady speeds."""
    constants = dict(zip(KEYS, values, strict=True))
    motor = rotor.Motor(**constants, inertia_kg_m2=0.0, max_speed_rad_s=math.inf)
    current_A, voltage_V = rotor.current(motor, speed_rad_s), rotor.voltage(motor, speed_rad_s)
    thrust_N = motor.lift_coefficient_N_s2_rad2 * speed_rad_s**2
    return {"thrust": thrust_N, "current": current_A, "voltage": voltage_V}
