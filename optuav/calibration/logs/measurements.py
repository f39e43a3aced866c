"""Measurements that fits use, from flight logs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from optuav.arrays import Floats
from optuav.calibration import csv
from optuav.calibration.logs.flight_log import FLIGHT, HOVER, LASTING_S, FlightLog, runs
from optuav.mission.files import refusal
from optuav.presentation.numbers import percent, seconds

STEADY_m_s = 0.5  # largest standard deviation of a speed that is steady
FULL, EMPTY = 0.95, 0.15  # charge at the ends of the discharge of a full battery
NO_VOLTAGE = "has no voltage, which is needed to turn currents into powers"


def steady(log: FlightLog) -> tuple[csv.Measurements, FlightLog]:
    """Points of steady level flight and hover, mean speed and power of each, and what they use."""
    time_s, current_A, voltage_V, speed_m_s, *_ = log.samples
    if not np.isfinite(voltage_V).any():
        raise refusal(Path(log.source), NO_VOLTAGE)
    speeds, powers, used = list[float](), list[float](), np.zeros(len(time_s), bool)
    for phase in (HOVER, FLIGHT):
        for run in runs(log.phase == phase):
            count = int((time_s[run[-1]] - time_s[run[0]]) // LASTING_S)
            for part in np.array_split(run, count) if count else ():
                measured = np.isfinite(speed_m_s[part] * voltage_V[part])
                if measured.sum() < 2 or np.std(speed_m_s[part]) > STEADY_m_s:
                    continue
                used[part] = True
                speeds.append(float(np.mean(speed_m_s[part])) if phase == FLIGHT else 0.0)
                powers.append(float(np.mean(current_A[part] * voltage_V[part])))
    numbers = {"speed": np.array(speeds), "power": np.array(powers)}
    points = _measurements(log.source, {"speed": "speed", "power": "power"}, numbers)
    return points, replace(log, used=used)


def discharge(log: FlightLog) -> tuple[csv.Measurements, FlightLog]:
    """The record of a discharge of one pack, and what it uses; refused unless full to cut-off.

    It ends with the last sample in the air. After landing a battery recovers: with what follows,
    the time of cut-off would be too late.
    """
    time_s = log.samples.time_s
    draws = log.airborne if log.airborne.any() else log.samples.current_A > 0.0
    used = np.arange(len(time_s)) <= np.flatnonzero(draws)[-1]
    samples = log.samples.only(used)
    charge = samples.charge[np.isfinite(samples.charge)]
    if len(charge) and (charge[0] < FULL or charge[-1] > EMPTY):
        words = (
            f"a record of one discharge, from at least {percent(FULL)} to at most {percent(EMPTY)}"
        )
        ends = f"the log goes from {percent(charge[0], 0)} to {percent(charge[-1], 0)}"
        raise refusal(Path(log.source), f"{words} of the charge; {ends}")
    notes, warnings = [*log.notes], [*log.warnings, *_gaps(log.source, samples.time_s)]
    if not used.all():
        after_s, end_s = time_s[-1] - samples.time_s[-1], samples.time_s[-1]
        words = "the discharge ends with the last sample in the air"
        left = f"{seconds(after_s, 1)} after it are left out"
        notes.append(f"{log.source}: {words}, at {seconds(end_s, 1)}; {left}")
    numbers = {"time": samples.time_s, "current": samples.current_A / log.packs}
    record = _measurements(log.source, {"time": "time", "current": "current"}, numbers)
    return record, replace(log, used=used, notes=tuple(notes), warnings=tuple(warnings))


def _gaps(source: str, time_s: Floats) -> Iterator[str]:
    """A warning of gaps, in which the current of a discharge is not known."""
    steps_s = np.diff(time_s)
    wide_s = steps_s[steps_s > csv.WIDEST_STEP * np.median(steps_s)] if len(steps_s) else steps_s
    if len(wide_s):
        words = "the log has no current: the current before each gap is used"
        yield f"{source}: in gaps of {seconds(np.sum(wide_s), 1)} in all {words}"


def _measurements(
    source: str, kinds: Mapping[str, str], numbers: Mapping[str, Floats]
) -> csv.Measurements:
    """Numbers in SI units as a file of optuav would state them, numbered from 1."""
    lines = tuple(range(1, 1 + len(next(iter(numbers.values())))))
    return csv.Measurements(source, kinds, dict.fromkeys(kinds, 1.0), lines, numbers, {})
