"""Loads by regime, acceleration and speed cap from flight logs.

Loads are means over all time spent in a regime. Acceleration and cap are found in
`optuav.calibration.logged_legs`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from optuav.arrays import Floats
from optuav.calibration.batches import BATCHES, mean_over_time
from optuav.calibration.estimation import Interval
from optuav.calibration.fit import Fit, Panel, Value, refuse_outside
from optuav.calibration.flight_log import PHASES, Log, read_log
from optuav.calibration.logged_legs import fit_motion, legs_in
from optuav.calibration.plausible import doubts
from optuav.calibration.together import copies, together
from optuav.errors import Fault, InputError

SIGNS = "positive is discharge, a rest in the laser's light is charge"
WORDS = {
    "flight": "mean in flight",
    "hover": "mean in hover",
    "rest": "mean at rest",
    "charge": "mean at rest, less that in the laser's light",
}


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
        is missing from the logs, or a load is none of a UAV.

    Raises
    ------
    InputError
        With every fault of the files, if the logs hold no flight and no hover, or if a load is
        none that a mission may state.
    """
    paths = [Path(file) for file in files]
    logs = together(paths, read_log)
    loads = dict(_loads(logs))
    if not loads.keys() & {"flight", "hover"}:
        words = f"at least {BATCHES} samples of flight or of hover"
        raise InputError([Fault("", "", words, ", ".join(map(str, paths)))])
    found = tuple(_values(loads))
    values = tuple(map(_at_least_nothing, found))
    refuse_outside(values, ", ".join(map(str, paths)), (SIGNS,))
    legs = [leg for log in logs if log.speed_m_s is not None for leg in legs_in(log)]
    motion, panels, remarks = fit_motion(legs)
    warnings = [
        f"the logs have no {phase}: {phase}_current_A and {phase}_power_W are missing here"
        for phase in ("flight", "hover")
        if phase not in loads
    ]
    warnings += [
        f"{old.key} = {old.value:.3g} lies no farther below 0 than the log leaves open: 0 is stated"
        for old, new in zip(found, values, strict=True)
        if new is not old
    ]
    samples = sum(len(log.time_s) for log in logs)
    return Fit(
        kind="regimes",
        sources=tuple(map(str, paths)),
        data=f"{samples} samples, {len(legs)} legs with speeds",
        values=(*motion, *values),
        panels=(*_load_panels(logs, loads), *panels),
        warnings=(*warnings, *remarks, *_doubts(logs, loads), *copies(paths)),
        settings={"flight.model": "regimes"},
    )


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
        yield phase, {name: mean_over_time(values, steps_s) for name, values in columns.items()}


def _doubts(
    logs: Sequence[Log], loads: Mapping[str, Mapping[str, tuple[float, Interval]]]
) -> Iterator[str]:
    """What no UAV draws in the air, and how fast none is."""
    for phase in ("flight", "hover"):
        if phase in loads:
            current_A, power_W = (loads[phase][unit][0] for unit in ("current_A", "power_W"))
            sizes = {"current": current_A, "voltage": power_W / current_A}
            yield from doubts(f"in {phase}", sizes)
    speeds_m_s = [float(np.max(log.speed_m_s)) for log in logs if log.speed_m_s is not None]
    if speeds_m_s:
        yield from doubts("at most", {"speed": max(speeds_m_s)})


def _steps(log: Log) -> Floats:
    """How long each sample stands for [s]."""
    return np.gradient(log.time_s)


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


def _at_least_nothing(value: Value) -> Value:
    """A load below 0 that the log does not tell from 0, as 0."""
    noise = value.interval is not None and value.value < 0.0 <= value.interval.high
    return replace(value, value=0.0) if noise else value


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
