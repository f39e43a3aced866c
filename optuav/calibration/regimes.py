"""Loads by regime, acceleration and speed cap from flight logs.

Loads are means over all time spent in a regime. Neighbouring samples of a log are alike, so the
intervals come from the means of whole batches [1]_. Acceleration and cap are those of the
trapezoids, of the logged distance and centred like the logged legs, that follow the speed best.

References
----------
.. [1] A. M. Law, "Simulation Modeling and Analysis", 5th ed., McGraw-Hill, 2015, section 9.5.3.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from optuav.calibration.data import Column, Points, Table, check_record, read, together
from optuav.calibration.estimation import CONFIDENCE, Interval, Unknown, estimate
from optuav.calibration.fit import Fit, Panel, Value, unclear, values_of
from optuav.errors import Fault, InputError
from optuav.mission.words import nearest
from optuav.physics.regimes import regime_leg

COLUMNS = (
    Column("time", "time"),
    Column("current", "current"),
    Column("voltage", "voltage", needed=False),
    Column("power", "power", needed=False),
    Column("speed", "speed", needed=False),
    Column("phase", "text", needed=False),
)
PHASES = ("flight", "hover", "rest", "charge", "other")
"""What the column ``phase`` may say; "charge" is a rest in the laser's light."""
LEAST_SAMPLES = 10
BATCHES = 10
"""Of the samples of a regime, for its interval."""
STILL_m_s = 1.0
"""Speed below which an airborne UAV hovers, where the log has no phases."""
IDLE = 0.1
"""Share of the median current of all samples in the air below which the rotors stand."""
REACHED = 0.98
"""Share of the speed cap that the fastest leg would reach without it at least, for it to bind."""
WORDS = {
    "flight": "mean in flight",
    "hover": "mean in hover",
    "rest": "mean at rest",
    "charge": "mean at rest, less that in the laser's light",
}


@dataclass(frozen=True)
class Log:
    """A flight log: arrays with one entry a sample, SI units.

    Parameters
    ----------
    time_s, current_A, power_W
        When, and what is drawn; positive while discharging.
    speed_m_s
        Or None.
    phase
        One of `PHASES` a sample.
    """

    time_s: Points
    current_A: Points
    power_W: Points
    speed_m_s: Points | None
    phase: npt.NDArray[np.str_]


@dataclass(frozen=True)
class Leg:
    """A leg as logged: times from its middle [s], speeds [m/s], distance [m]."""

    time_s: Points
    speed_m_s: Points
    distance_m: float


def fit_regimes(files: Iterable[str | Path]) -> Fit:
    """Find the loads of flight, hover, rest and charging, the acceleration and the speed cap.

    Parameters
    ----------
    files
        Flight logs as CSV: ``time_s``, ``current_A`` (positive while discharging), ``voltage_V`` or
        ``power_W``, and ``phase`` (flight, hover, rest, charge or other), ``speed_m_s`` or both.
        Without phases a sample below a tenth of the usual current is rest, of the others one below
        1 m/s is hover.

    Returns
    -------
    Fit
        Keys of [flight] for ``flight.model = "regimes"``; with warnings where a regime or the speed
        is missing from the logs.

    Raises
    ------
    InputError
        With every fault of the files, or if the logs hold no flight and no hover.
    """
    paths = [Path(file) for file in files]
    logs = together(paths, _log)
    loads = dict(_loads(logs))
    if not loads.keys() & {"flight", "hover"}:
        words = f"at least {BATCHES} samples of flight or of hover"
        raise InputError([Fault("", "", words, ", ".join(map(str, paths)))])
    faults = list(_faults_of_loads(loads, ", ".join(map(str, paths))))
    if faults:
        raise InputError(faults)
    legs = [leg for log in logs if log.speed_m_s is not None for leg in _legs(log)]
    motion, panels, remarks = _motion(legs)
    warnings = [
        f"the logs have no {phase}: {phase}_current_A and {phase}_power_W are missing here"
        for phase in ("flight", "hover")
        if phase not in loads
    ]
    samples = sum(len(log.time_s) for log in logs)
    return Fit(
        kind="regimes",
        sources=tuple(map(str, paths)),
        data=f"{samples} samples, {len(legs)} legs with speeds",
        values=(*motion, *_values(loads)),
        panels=(*_load_panels(logs, loads), *panels),
        warnings=(*warnings, *remarks),
        settings={"flight.model": "regimes"},
    )


def _log(path: Path) -> Log:
    table = read(path, COLUMNS, LEAST_SAMPLES)
    check_record(table)
    numbers, faults = table.numbers, list[Fault]()
    if ("voltage" in numbers) == ("power" in numbers):
        words = "one of the columns voltage and power, with their units"
        faults.append(Fault("", "", words, table.source))
    if "speed" not in numbers and "phase" not in table.texts:
        words = "a column phase, or one of speed with its unit, to tell flight from hover"
        faults.append(Fault("", "", words, table.source))
    faults += _faults_of_cells(table)
    if faults:
        raise InputError(faults)
    current_A, speed_m_s = numbers["current"], numbers.get("speed")
    power_W = numbers["power"] if "power" in numbers else current_A * numbers["voltage"]
    if "phase" in table.texts:
        phase = np.array(table.texts["phase"])
    else:
        assert speed_m_s is not None
        idle = current_A < IDLE * np.median(current_A[current_A > 0.0])
        phase = np.where(idle, "rest", np.where(speed_m_s < STILL_m_s, "hover", "flight"))
    return Log(numbers["time"], current_A, power_W, speed_m_s, phase)


def _faults_of_cells(table: Table) -> Iterator[Fault]:
    for row, phase in enumerate(table.texts.get("phase", ())):
        if phase not in PHASES:
            yield table.fault(row, "phase", phase, f"{', '.join(PHASES)}{nearest(phase, PHASES)}")
    for name in ("speed", "voltage"):
        for index in np.flatnonzero(table.numbers.get(name, np.zeros(0)) < 0.0):
            yield table.fault(int(index), name, float(table.numbers[name][index]), "0 or above")
    if not np.max(table.numbers["current"]) > 0.0:
        largest = float(np.max(table.numbers["current"]))
        yield table.fault(0, "current", largest, "some current above 0: positive is discharge")


def _loads(logs: Sequence[Log]) -> Iterator[tuple[str, dict[str, tuple[float, Interval]]]]:
    """Mean current [A] and power [W] with their intervals, by phase."""
    for phase in PHASES[:-1]:
        columns = {
            "current_A": np.concatenate([log.current_A[log.phase == phase] for log in logs]),
            "power_W": np.concatenate([log.power_W[log.phase == phase] for log in logs]),
        }
        if len(columns["current_A"]) < BATCHES:
            continue
        steps_s = np.concatenate([_steps(log)[log.phase == phase] for log in logs])
        yield phase, {name: _mean(values, steps_s) for name, values in columns.items()}


def _faults_of_loads(
    loads: Mapping[str, Mapping[str, tuple[float, Interval]]], source: str
) -> Iterator[Fault]:
    """Regimes that would charge the battery."""
    for phase in ("flight", "hover", "rest"):
        mean_A = loads[phase]["current_A"][0] if phase in loads else 0.0
        if mean_A < 0.0:
            words = "0 or above: positive is discharge, and a rest in the laser's light is charge"
            yield Fault(f"mean current of {phase}", f"{mean_A:.4g} A", words, source)


def _steps(log: Log) -> Points:
    """How long each sample stands for [s]."""
    return np.gradient(log.time_s)


def _mean(values: Points, steps_s: Points) -> tuple[float, Interval]:
    """Mean over time, and its interval by batch means."""
    from scipy.special import stdtrit

    parts = zip(np.array_split(values, BATCHES), np.array_split(steps_s, BATCHES), strict=True)
    means = [float(np.average(part, weights=step)) for part, step in parts]
    mean = float(np.average(values, weights=steps_s))
    error = float(np.std(means, ddof=1)) / math.sqrt(BATCHES)
    reach = float(stdtrit(BATCHES - 1, 0.5 + 0.5 * CONFIDENCE)) * error
    return mean, Interval(mean - reach, mean + reach)


def _values(loads: Mapping[str, Mapping[str, tuple[float, Interval]]]) -> Iterator[Value]:
    for phase in ("flight", "hover", "rest"):
        for unit, (mean, interval) in loads.get(phase, {}).items():
            yield Value(f"flight.{phase}_{unit}", mean, WORDS[phase], interval)
    for unit, (mean, interval) in loads.get("charge", {}).items():
        drawn, own = loads.get("rest", {}).get(unit, (0.0, Interval(0.0, 0.0)))
        reach = math.hypot(interval.high - mean, own.high - drawn)
        value = drawn - mean
        yield Value(
            f"flight.charge_{unit}", value, WORDS["charge"], Interval(value - reach, value + reach)
        )


def _load_panels(
    logs: Sequence[Log], loads: Mapping[str, Mapping[str, tuple[float, Interval]]]
) -> Iterator[Panel]:
    """Current and power over the time of all logs, one after the other, and their means."""
    phase = np.concatenate([log.phase for log in logs])
    known = np.isin(phase, list(loads))
    ends_s = np.cumsum([0.0, *(log.time_s[-1] - log.time_s[0] for log in logs)])
    at_s = np.concatenate(
        [log.time_s - log.time_s[0] + end for log, end in zip(logs, ends_s[:-1], strict=True)]
    )
    for name, unit in (("current", "A"), ("power", "W")):
        observed = np.concatenate([getattr(log, f"{name}_{unit}") for log in logs])
        fitted = [loads[each][f"{name}_{unit}"][0] for each in phase[known]]
        yield Panel(
            name,
            unit,
            tuple(observed[known].tolist()),
            tuple(fitted),
            at=tuple(at_s[known].tolist()),
            at_words="time in the logs [s]",
            groups=tuple(phase[known].tolist()),
        )


def _legs(log: Log) -> Iterator[Leg]:
    """Every stretch of flight that begins and ends slowly."""
    assert log.speed_m_s is not None
    flying = np.concatenate([[False], log.phase == "flight", [False]])
    edges = np.flatnonzero(np.diff(flying.astype(int)))
    for start, end in edges.reshape(-1, 2):
        # One sample more at either side, where it still stands.
        chosen = slice(max(start - 1, 0), end + 1)
        time_s, speed_m_s = log.time_s[chosen], log.speed_m_s[chosen]
        whole = max(speed_m_s[0], speed_m_s[-1]) < 0.5 * np.max(speed_m_s)
        if whole and len(time_s) >= LEAST_SAMPLES // 2:
            distance_m = float(np.trapezoid(speed_m_s, time_s))
            middle_s = float(np.trapezoid(speed_m_s * time_s, time_s)) / distance_m
            yield Leg(time_s - middle_s, speed_m_s, distance_m)


def _motion(
    legs: Sequence[Leg],
) -> tuple[tuple[Value, ...], tuple[Panel, ...], tuple[str, ...]]:
    """Acceleration and cap, the speeds they explain, and what is to be said of them."""
    if not legs:
        words = "no leg from standing to standing with its speed: acceleration_m_s2 is missing here"
        return (), (), (words,)
    observed = np.concatenate([leg.speed_m_s for leg in legs])
    fastest = float(np.max(observed))

    def speeds(acceleration_m_s2: float, cap_m_s: float) -> Points:
        return np.concatenate([_speed(leg, acceleration_m_s2, cap_m_s) for leg in legs])

    keys: tuple[str, ...] = ("flight.acceleration_m_s2", "flight.max_speed_m_s")
    starts = [(a, fastest) for a in (0.5, 2.0, 8.0)]
    found = estimate(
        [Unknown(key) for key in keys],
        lambda values: speeds(*values) - observed,
        starts,
        bootstrap=False,
    )
    longest_m = max(leg.distance_m for leg in legs)
    acceleration, cap = found.values
    warnings: tuple[str, ...] = unclear(found)
    if cap >= REACHED * math.sqrt(acceleration * longest_m):
        keys = keys[:1]
        found = estimate(
            [Unknown(key) for key in keys],
            lambda values: speeds(values[0], math.inf) - observed,
            [(acceleration,)],
            bootstrap=False,
        )
        cap = math.inf
        warnings = ("no leg is long enough to show a speed cap: max_speed_m_s is missing here",)
    fitted = speeds(float(found.values[0]), float(cap))
    ends_s = np.cumsum([0.0, *(leg.time_s[-1] - leg.time_s[0] for leg in legs)])
    at_s = np.concatenate(
        [leg.time_s - leg.time_s[0] + end for leg, end in zip(legs, ends_s[:-1], strict=True)]
    )
    panel = Panel(
        "speed",
        "m/s",
        tuple(observed.tolist()),
        tuple(fitted.tolist()),
        at=tuple(at_s.tolist()),
        at_words="time in the legs [s]",
    )
    return values_of(found, keys, f"fitted to the speed of {len(legs)} legs"), (panel,), warnings


def _speed(leg: Leg, acceleration_m_s2: float, cap_m_s: float) -> Points:
    """Speed [m/s] of the bang-bang leg of the same distance."""
    loads, peak_m_s = regime_leg(leg.distance_m, acceleration_m_s2, 1.0, 1.0, cap_m_s)
    before_end_s = 0.5 * loads.durations_s[0] - np.abs(leg.time_s)
    speed_m_s: Points = np.clip(acceleration_m_s2 * before_end_s, 0.0, peak_m_s)
    return speed_m_s
