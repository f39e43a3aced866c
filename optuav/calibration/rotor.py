"""Constants of a rotor from a bench test, or from the data of propeller and motor.

Each quantity of a bench is weighted by the residuals that the fit leaves of it, which are of one
size or in proportion to its values; intervals are by profile likelihood.
"""

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from optuav.arrays import Floats
from optuav.calibration import csv, separable
from optuav.calibration.fit import Estimate, Fit, Value, curve, finished
from optuav.errors import Fault, InputError, refuse
from optuav.mission.messages import number
from optuav.physics import rotor
from optuav.presentation.numbers import figure, fixed

LEAST_POINTS = 6
BENCH = csv.Format(
    {"speed": "rotor speed", "thrust": "force", "current": "current", "voltage": "voltage"},
    least=LEAST_POINTS,
)
PROPELLER = {
    "thrust_coefficient": "thrust coefficient",
    "torque_coefficient": "torque coefficient",
    "radius": "length",
}
MOTOR = {"velocity_constant": "velocity constant", "resistance": "resistance"}
MOTOR |= {"no_load_current": "current"}
SHEET = csv.Format(
    PROPELLER | {"air_density": "density"} | MOTOR,
    tuple(MOTOR),
    also={"power_coefficient": ("torque_coefficient", "power coefficient")},
)
KEYS = (
    *("lift_coefficient_N_s2_rad2", "velocity_constant_rpm_V", "resistance_ohm"),
    *("friction_torque_Nm", "viscous_damping_Nm_s_rad", "drag_coefficient_Nm_s2_rad2"),
)
"""Keys of [rotor] that a bench measures."""
ORDER = (1, 2, 0, 3, 4, 5)  # of these in a fit: the last four enter linearly
PER_VOLT_RPM, WINDING_OHM = (1e-3, 1e6), (1e-6, 1e6)  # ranges of the first two
LOSSES = np.geomspace(0.003, 0.6, 12)  # starting shares of the voltage lost in the winding
QUANTITIES = {"thrust": "N", "current": "A", "voltage": "V"}
TOLD = {"thrust": 1, "current": 3, "voltage": 2}  # constants that each quantity tells
THRUST_PER_POWER = (0.003, 0.5, "N/W")  # usual, by least and most
MERIT = (0.2, 0.9)  # usual figure of merit, by least and most
WEIGHTED_FITS = 3  # fits, each weighted by the residuals of the one before
LEAST_RESIDUAL = 1e-9  # standard deviation of a quantity, over its largest value


def fit_rotor(files: str | Path | Iterable[str | Path]) -> Fit:
    r"""Fit the constants of a rotor.

    At a steady speed v the thrust is ϱ v², the current (T_f + D_f v + κ0 v²)/κ and the voltage
    R i + κ v, κ = 9.5493/κ_V [1]_; data sheets give ϱ = C_T ρ A r², κ0 = C_Q ρ A r³ with A = π r²,
    and T_f = κ I_0 with the current I_0 that the motor draws without a load. Coefficients by n and
    D are T/(ρ n² D⁴) and P/(ρ n³ D⁵), with n in turns a second.

    Parameters
    ----------
    files
        CSV files of bench tests at steady speeds: ``speed_rad_s`` (or ``speed_rpm``),
        ``thrust_N`` (or ``thrust_g``), ``current_A``, ``voltage_V`` across the motor. Or one file
        with a single line of data of propeller and motor: ``thrust_coefficient`` and
        ``torque_coefficient``, or by n and D, as UIUC and APC publish them,
        ``thrust_coefficient_nD`` and ``power_coefficient_nD`` (or ``torque_coefficient_nD``);
        ``radius_m``, ``air_density_kg_m3`` and, if known,
        ``velocity_constant_rpm_V``, ``resistance_ohm``, ``no_load_current_A``.

    Returns
    -------
    Fit
        Keys of [rotor]. Steady speeds do not show the inertia, and data sheets show neither the
        largest speed nor the damping; for these, the mission keeps its own values.

    Raises
    ------
    InputError
        With every fault of the files, or if a constant is outside the range of its key.

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
        words = "must be bench tests, or one file of propeller and motor data, not both"
        raise InputError([Fault("", "", words, sheets[0].source)])
    return finished(_from_sheet(sources, sheets[0]) if sheets else _from_bench(sources, tables))


def _checked(table: csv.Measurements) -> csv.Measurements:
    """A file of either kind, all of whose numbers are above 0."""
    faults = list[Fault]()
    for name, values in table.numbers.items():
        faults += table.faults(values <= 0.0, name, "a number, x > 0")
    if "radius" in table.numbers and (lines := len(table.lines)) > 1:
        faults.append(Fault("lines", f"{lines}", "must be 1: a single propeller", table.source))
    if "speed" in table.numbers:
        faults += table.few("speed", LEAST_POINTS)
    refuse(faults)
    return table


def _from_sheet(sources: tuple[str, ...], table: csv.Measurements) -> Fit:
    """Constants from the data of propeller and motor."""
    data = {name: float(values[0]) for name, values in table.numbers.items()}
    disc_kg = data["air_density"] * math.pi * data["radius"] ** 3
    thrust, torque = data["thrust_coefficient"], data["torque_coefficient"]
    constants = {
        KEYS[0]: (thrust * disc_kg * data["radius"], "C_T ρ A r²"),
        KEYS[5]: (torque * disc_kg * data["radius"] ** 2, "C_Q ρ A r³"),
    }
    warnings = [*table.doubts(), *_merit_doubts(thrust, torque)]
    columns = {KEYS[1]: "velocity_constant", KEYS[2]: "resistance"}
    constants |= {key: (data[name], "as stated") for key, name in columns.items() if name in data}
    if {"velocity_constant", "no_load_current"} <= data.keys():
        torque_constant_Nm_A = rotor.RPM_PER_RAD_S / data["velocity_constant"]
        constants[KEYS[3]] = (torque_constant_Nm_A * data["no_load_current"], "9.5493/κ_V I_0")
    elif "no_load_current" in data:
        warnings.append("the friction torque needs velocity_constant_rpm_V as well")
    values = tuple(Value(f"rotor.{key}", *figures) for key, figures in constants.items())
    return Fit("rotor", sources, "data of a propeller and its motor", values, (), tuple(warnings))


def _merit_doubts(thrust_coefficient: float, torque_coefficient: float) -> Iterator[str]:
    """Doubt a ratio of the ideal power to the power in hover that no propeller has."""
    merit = math.sqrt(0.5 * thrust_coefficient**3) / torque_coefficient
    least, most = MERIT
    if not least <= merit <= most:
        yield (
            f"the figure of merit, C_T^1.5 / (√2 C_Q), is {fixed(merit)}, where a UAV has "
            f"{figure(least)} to {figure(most)}: look at both coefficients; those by n and D, as "
            "in T = C_T ρ n² D⁴, go under thrust_coefficient_nD and power_coefficient_nD"
        )


def _from_bench(sources: tuple[str, ...], tables: list[csv.Measurements]) -> Fit:
    """Constants that fit thrust, current and voltage over the speed."""
    measured = {
        name: np.concatenate([table.numbers[name] for table in tables]) for name in BENCH.kinds
    }
    speed, count = measured["speed"], len(measured["speed"])
    largest = {name: float(np.max(values)) for name, values in measured.items()}
    estimated = _estimate(measured)
    fitted, at_words = _model(estimated.values, speed), "speed of the rotor $v$ [rad/s]"

    def along(name: str, speed_rad_s: Floats) -> Floats:
        return _model(estimated.values, speed_rad_s)[name]

    panels = (
        curve(name, unit, measured[name], fitted[name], speed, at_words, partial(along, name))
        for name, unit in QUANTITIES.items()
    )
    doubts = [words for table in tables for words in table.doubts()]
    per_W = largest["thrust"] / (largest["current"] * largest["voltage"])
    doubts += csv.unit_doubts("the thrust per power", per_W, "thrust", "force", THRUST_PER_POWER)
    fastest = Value("rotor.max_speed_rad_s", largest["speed"], "fastest point of the bench")
    lift, *electric = estimated.values_for_mission(f"fitted to {count} points")
    if not any(value.determined for value in electric):  # then those of the mission go together
        electric = [replace(value, stated=False) for value in electric]
    values = (lift, *electric, fastest)
    data, warnings = f"{count} points of a bench test at steady speed", dict.fromkeys(doubts)
    return Fit("rotor", sources, data, values, tuple(panels), (*estimated.warnings, *warnings))


def _estimate(measured: Mapping[str, Floats]) -> Estimate:
    """The constants in the order of their keys, with residuals in standard deviations.

    For given κ_V and R the model is linear in the other constants.
    """
    speed, keys = measured["speed"], [f"rotor.{key}" for key in KEYS]
    spreads = {name: np.full(len(speed), np.max(measured[name])) for name in QUANTITIES}

    def scaled(values: Mapping[str, Floats]) -> Floats:
        return np.concatenate([values[name] / spreads[name] for name in QUANTITIES], axis=-1)

    def columns(others: Floats) -> tuple[Floats, Floats]:
        lift, *torques = np.hstack([np.zeros((4, 1)), np.identity(4)])[..., None]
        none, *ones = scaled(_model((lift, *others, *torques), speed))
        return np.stack(ones, axis=1) - none[:, None], scaled(measured) - none

    ordered = [keys[place] for place in ORDER]
    linear = [allowed.ge or 0.0 for key in ordered[2:] if (allowed := number(key))]
    problem = separable.Problem(columns, (PER_VOLT_RPM, WINDING_OHM), linear)
    best = problem.best(_starts(measured))
    for _ in range(WEIGHTED_FITS - 1):
        parts = np.split(best.residuals, len(QUANTITIES))
        for (name, told), part in zip(TOLD.items(), parts, strict=True):
            spreads[name] = _spread(spreads[name] * part, measured[name], len(speed) - told)
        best = problem.least(best.values[:2])
    freedom = len(speed) - max(TOLD.values())
    return separable.estimate(ordered, problem, best, freedom).ordered(keys)


def _spread(residuals: Floats, observed: Floats, freedom: int) -> Floats:
    """Standard deviations that are one, or in proportion to the values, as is likelier."""
    shapes = np.stack([np.full(len(observed), np.max(observed)), observed])
    sizes = np.linalg.norm(residuals / shapes, axis=1) / math.sqrt(freedom)
    spreads = np.maximum(sizes, LEAST_RESIDUAL)[:, None] * shapes
    likeliest: Floats = spreads[np.argmin(np.sum(np.log(spreads), axis=1))]
    return likeliest


def _starts(measured: Mapping[str, Floats]) -> Iterator[tuple[float, float]]:
    """κ_V and R of motors that lose some share of the voltage in the winding at full speed."""
    fastest = int(np.argmax(measured["speed"]))
    v, _, i, e = (float(values[fastest]) for values in measured.values())
    for lost in LOSSES.tolist():
        per_volt_rpm, winding_ohm = rotor.RPM_PER_RAD_S * v / ((1.0 - lost) * e), lost * e / i
        yield float(np.clip(per_volt_rpm, *PER_VOLT_RPM)), float(np.clip(winding_ohm, *WINDING_OHM))


def _model(values: Iterable[Any], speed_rad_s: Floats) -> dict[str, Floats]:
    """Thrust [N], current [A] and voltage [V] at steady speeds."""
    constants = dict(zip(KEYS, values, strict=True))
    motor = rotor.Motor(**constants, inertia_kg_m2=0.0, max_speed_rad_s=math.inf)
    current_A, voltage_V = rotor.current(motor, speed_rad_s), rotor.voltage(motor, speed_rad_s)
    thrust_N = motor.lift_coefficient_N_s2_rad2 * speed_rad_s**2
    return {"thrust": thrust_N, "current": current_A, "voltage": voltage_V}
