"""Loads of each regime, acceleration and speed cap from flight logs.

Loads are means over all time spent in a regime. If each sample depends on the one before,
x' = φ x + noise, the mean of n is as sure as the mean of n (1 − φ)/(1 + φ) independent ones [1]_.

Acceleration and speed cap belong to the trapezoids that follow the logged speeds best. When each
leg begins and ends is fitted as well: a distance summed up from the same speeds would share their
errors, and a cap that is compared with it would look surer than it is.

References
----------
.. [1] G. E. P. Box, G. M. Jenkins, G. C. Reinsel, G. M. Ljung, "Time Series Analysis", 5th ed.,
   Wiley, 2015, section 2.1.6.
.. [2] F. H. C. Marriott, J. A. Pope, "Bias in the estimation of autocorrelations", Biometrika,
   1954.
"""

import itertools
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from optuav.arrays import Booleans, Floats, Integers
from optuav.calibration import csv, fit
from optuav.calibration.fit import ConfidenceInterval, Fit, Panel, Value, finished, quantile
from optuav.calibration.logs import measurements
from optuav.calibration.logs.flight_log import FlightLog
from optuav.calibration.logs.read import flight_log_in
from optuav.errors import Fault, InputError, refuse
from optuav.mission.files import refusal
from optuav.mission.messages import nearest
from optuav.physics import bang_bang
from optuav.presentation.numbers import figure

OPTIONAL = {"voltage": "voltage", "power": "power", "speed": "speed", "phase": "text"}
LOG = csv.Format({"time": "time", "current": "current"} | OPTIONAL, tuple(OPTIONAL), least=10)
ORIGINS = {
    "flight": "mean in flight",
    "hover": "mean in hover",
    "rest": "mean at rest",
    "charge": "mean at rest, less that in the laser's light",
}
"""Phases of a log, "charge" a rest in the laser's light, and where their loads come from."""
PHASES = (*ORIGINS, "other")
TIME = "time in the logs [s]"
STILL_m_s = 1.0  # speed below which an airborne UAV hovers, where the log has no phases
IDLE = 0.1  # share of the median current below which the rotors stand
ENOUGH = 10  # fewest samples of a regime
MOST_ALIKE = 0.99  # largest correlation of neighbours that is believed
LEAST_LEG = 5  # fewest samples of a leg
REACHED = 0.98  # share of the cap that the longest leg must reach without it, for it to bind
MISFIT = 0.08  # rms of speeds off the trapezoids, over the largest, that one cap still explains
GAIN = 9.0  # least gain of the sum of squares by a cap, in variances: three standard errors
MOST_SHIFTS = 20  # most steps to the best begin and end of a leg; two are usual
FOUND_S = 1e-9  # change of these moments below which they are found


class Samples(NamedTuple):
    """Samples of flight logs, one log after another: speeds are NaN where a log has none."""

    time_s: Floats
    step_s: Floats  # span of each sample
    current_A: Floats
    power_W: Floats
    speed_m_s: Floats
    phase: npt.NDArray[np.str_]
    log: Integers  # number of the log


MeanLoads: TypeAlias = Mapping[str, Mapping[str, tuple[float, ConfidenceInterval]]]
"""Mean current [A] and power [W] by phase, then by name with unit, each with its interval."""


def fit_regimes(
    files: str | Path | Iterable[str | Path], *, columns: Mapping[str, str] | None = None
) -> Fit:
    r"""Fit the loads of flight, hover, rest and charging, the acceleration and the speed cap.

    Parameters
    ----------
    files
        Flight logs as CSV: ``time_s``, ``current_A`` (positive while discharging), ``voltage_V`` or
        ``power_W``, and ``phase`` (flight, hover, rest, charge or other), ``speed_m_s`` or both.
        Without phases, a sample below a tenth of the usual current is rest, and any other sample
        below 1 m/s is hover. Or logs of PX4 (``.ulg``), ArduPilot (``.bin``), AirData or DJI (CSV),
        in which hover and level flight are recognised, see `Fit.logs`.
    columns
        For a CSV of another program: the column that each of its headings stands for, such as
        ``{"Amps": "current_A"}``.

    Returns
    -------
    Fit
        Keys of [flight] for ``flight.model = "regimes"``: currents [A], powers [W], acceleration
        [m/s²], speed cap [m/s]; with warnings where a regime or the speed is missing from the logs,
        or no UAV has such a load.

    Raises
    ------
    InputError
        With every fault of the files, if the logs contain neither flight nor hover, or if a load is
        outside the range of its key.

    Examples
    --------
    >>> import optuav, pathlib, tempfile
    >>> rows = [f"{n},{20 + n % 2},400,hover" for n in range(20)]
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = pathlib.Path(folder) / "log.csv"
    ...     _ = file.write_text("\n".join(["time_s,current_A,power_W,phase", *rows]))
    ...     optuav.fit_regimes([file]).changes["flight.hover_current_A"]
    20.5
    """
    flown = list[FlightLog]()

    def read_log(path: Path) -> tuple[Samples, tuple[str, ...]] | None:
        if log := flight_log_in(path, columns or {}):
            flown.append(log)
            return _samples_of(log)
        return None

    sources, records = csv.read_all(files, [LOG], _read_log, read_log)
    logs, doubts = zip(*records, strict=True)
    samples = _one_after_another(logs)
    series = {"current_A": samples.current_A, "power_W": samples.power_W}
    loads: MeanLoads = {
        phase: {
            key: mean_over_time(values[of_phase], samples.step_s[of_phase])
            for key, values in series.items()
        }
        for phase in ORIGINS
        if np.sum(of_phase := samples.phase == phase) >= ENOUGH
    }
    if not loads.keys() & {"flight", "hover"}:
        shares = "".join(f"; {words}" for log in flown for words in (*_notes(log), *log.warnings))
        words = f"must have at least {ENOUGH} samples of flight or of hover{shares}"
        raise InputError([Fault("", "", words, ", ".join(sources))])
    legs = list(_legs(samples))
    motion, panels, remarks = _motion(samples, legs)
    missing = [
        f"the logs have no {phase}: {phase}_current_A and {phase}_power_W are missing here"
        for phase in ("flight", "hover")
        if phase not in loads
    ]
    values, below_zero = _values_of(loads)
    warnings = *missing, *below_zero, *remarks, *dict.fromkeys(itertools.chain(*doubts))
    data = f"{len(samples.time_s)} samples, {len(legs)} legs with speeds"
    parts = (*motion, *values), (*_panels_of(loads, series, samples), *panels), warnings
    result = replace(
        Fit("regimes", sources, data, *parts, settings={"flight.model": "regimes"}),
        extends="matrice350",
        notes=tuple(itertools.chain.from_iterable(map(_notes, flown))),
        logs=tuple(flown),
    )
    return finished(result, "positive is discharge, a rest in the laser's light is charge")


def _one_after_another(logs: Sequence[Samples]) -> Samples:
    """The samples of logs, each numbered and beginning when the one before ends."""
    begins_s = np.cumsum([0.0, *(log.time_s[-1] for log in logs[:-1])])
    after = (
        log._replace(time_s=log.time_s + begin_s, log=log.log + number)
        for number, (log, begin_s) in enumerate(zip(logs, begins_s, strict=True))
    )
    return Samples(*map(np.concatenate, zip(*after, strict=True)))


def _values_of(loads: MeanLoads) -> tuple[list[Value], list[str]]:
    """MeanLoads as values of a mission, and warnings where 0 is stated for one below."""
    values, warnings = list[Value](), list[str]()
    no_rest = (0.0, ConfidenceInterval(0.0, 0.0))
    for phase, means in loads.items():
        for unit, (mean, interval) in means.items():
            key, value, ends = f"flight.{phase}_{unit}", mean, interval
            if phase == "charge":
                drawn, resting = loads.get("rest", {}).get(unit, no_rest)
                value, reach = drawn - mean, math.hypot(ends.high - mean, resting.high - drawn)
                ends = ConfidenceInterval(value - reach, value + reach)
            if value < 0.0 <= ends.high:
                words = "lies no farther below 0 than the log leaves open: 0 is used"
                warnings.append(f"{key} = {figure(value, 3)} {words}")
                value = 0.0
            values.append(Value(key, value, ORIGINS[phase], ends))
    return values, warnings


def _panels_of(loads: MeanLoads, series: Mapping[str, Floats], samples: Samples) -> Iterator[Panel]:
    """Yield the current and the power of samples in a regime, with the mean of that regime."""
    in_regime = np.isin(samples.phase, list(loads))
    phases, at_s = samples.phase[in_regime].tolist(), samples.time_s[in_regime].tolist()
    for key, observed in series.items():
        quantity, unit = key.split("_")
        means, values = [loads[phase][key][0] for phase in phases], observed[in_regime].tolist()
        yield Panel(quantity, unit, values, means, (), at_s, TIME, (), phases)


def mean_over_time(values: Floats, steps_s: Floats) -> tuple[float, ConfidenceInterval]:
    """Mean of samples (sample,) that stand for some time each [s], and its interval."""
    mean = float(np.average(values, weights=steps_s))
    variance = float(np.average((values - mean) ** 2, weights=steps_s))
    alike = correlation_of_neighbours(values)
    freedom = max(len(values) * (1.0 - alike) / (1.0 + alike) - 1.0, 1.0)
    reach = quantile(fit.CONFIDENCE, freedom) * math.sqrt(variance / freedom)
    return mean, ConfidenceInterval(mean - reach, mean + reach)


def correlation_of_neighbours(values: Floats) -> float:
    """Correlation of neighbouring samples about the straight line through a record.

    So a voltage that sags does not pass for one that wanders. Without the bias of short records,
    about (2 + 4 φ)/n where it is (1 + 3 φ)/n about a mean [2]_.
    """
    count = len(values)
    place = np.arange(count)
    left = values - np.polyval(np.polyfit(place, values, 1), place)
    squares = float(left @ left)
    alike = float(left[1:] @ left[:-1]) / squares if squares > 0.0 else 0.0
    return float(np.clip((alike + 2.0 / count) / (1.0 - 4.0 / count), 0.0, MOST_ALIKE))


def _read_log(log: csv.Measurements) -> tuple[Samples, tuple[str, ...]]:
    """The samples of a log, its time from 0, and doubts about its values and units."""
    rows, left_out = _known(log)
    table = log.only(rows)
    numbers, phases = table.numbers, table.texts.get("phase", ())
    current_A, unknown = numbers["current"], np.full(len(table.lines), math.nan)
    voltage_V, speed_m_s = (numbers.get(column, unknown) for column in ("voltage", "speed"))
    faults = [*csv.record_faults(log), *csv.gaps(log)]
    if not faults and (len(current_A) < ENOUGH or not np.any(current_A > 0.0)):
        rest = "; ".join(left_out)
        words = f"must have at least {ENOUGH} lines of known values, some current above 0; {rest}"
        faults.append(Fault("", "", words, log.source))
    if ("voltage" in numbers) == ("power" in numbers):
        words = "one of the columns voltage and power, with their units"
        faults.append(Fault("", "", words, log.source))
    if "speed" not in numbers and "phase" not in table.texts:
        words = "a column phase, or one of speed with its unit, to tell flight from hover"
        faults.append(Fault("", "", words, log.source))
    for name in sorted(set(phases) - set(PHASES)):
        words = f"one of {', '.join(PHASES)}{nearest(name, PHASES)}"
        faults += table.faults(np.array(phases) == name, "phase", words)
    faults += table.faults(speed_m_s < 0.0, "speed", "a number, x >= 0")
    faults += table.faults(voltage_V <= 0.0, "voltage", "a number, x > 0")
    refuse(faults)
    power_W = numbers.get("power", current_A * voltage_V)
    phase = np.array(phases)
    if not phases:
        idle = current_A < IDLE * np.median(current_A[current_A > 0.0])
        phase = np.where(idle, "rest", np.where(speed_m_s < STILL_m_s, "hover", "flight"))
    time_s = log.numbers["time"] - log.numbers["time"][0]
    times = time_s[rows], np.gradient(time_s)[rows]
    samples = Samples(*times, current_A, power_W, speed_m_s, phase, np.zeros(len(phase), int))
    return samples, (*left_out, *table.doubts())


def _samples_of(log: FlightLog) -> tuple[Samples, tuple[str, ...]]:
    """The samples of a log of an autopilot, and doubts about it."""
    columns = log.samples
    if not np.isfinite(columns.voltage_V).any():
        raise refusal(Path(log.source), measurements.NO_VOLTAGE)
    power_W = columns.current_A * columns.voltage_V
    of = np.where(np.isfinite(power_W), log.phase, "other")
    power_W = np.nan_to_num(power_W)
    parts = columns.time_s, log.step_s, columns.current_A, power_W, columns.speed_m_s, of
    return Samples(*parts, np.zeros(len(of), int)), log.warnings


def _notes(log: FlightLog) -> Iterator[str]:
    """Sentences on the part of a log that is used."""
    yield from (f"{log.source}: {log.format}", *log.notes)
    yield from log.shares("are used")


def _known(log: csv.Measurements) -> tuple[Booleans, list[str]]:
    """Rows all of whose values are known, and sentences on the others.

    In the laser's light the current may be −1 A and the power −1 W.
    """
    complete, sentences = np.ones(len(log.lines), bool), list[str]()
    charging = np.array(log.texts.get("phase", [""] * len(complete))) == "charge"
    for column in filter(log.numbers.__contains__, csv.UNKNOWN):
        measured = charging & (log.numbers[column] < 0.0) & (column in ("current", "power"))
        rows = log.unknown(column) & ~measured
        complete &= ~rows
        sentences += log.left_out(column, rows)
    return complete, sentences


def _legs(samples: Samples) -> Iterator[Integers]:
    """The samples of every stretch of flight with speeds that begins and ends slowly."""
    flying = (samples.phase == "flight") & np.isfinite(samples.speed_m_s)
    # Whether a sample follows the one before in its log.
    follows = np.diff(samples.log, prepend=-1, append=-1) == 0
    cuts = np.flatnonzero(np.diff(flying) | ~follows[1:-1]) + 1
    for part in np.split(np.arange(len(flying)), cuts):
        if not flying[part[0]]:
            continue
        # One sample more at either side, where the UAV still stands.
        start, end = part[0] - int(follows[part[0]]), part[-1] + 1 + int(follows[part[-1] + 1])
        leg = np.arange(start, end)
        speed_m_s = samples.speed_m_s[leg]
        whole = max(speed_m_s[0], speed_m_s[-1]) < 0.5 * np.max(speed_m_s)
        if whole and len(leg) >= LEAST_LEG:
            yield leg


def _motion(
    samples: Samples, legs: Sequence[Integers]
) -> tuple[tuple[Value, ...], tuple[Panel, ...], tuple[str, ...]]:
    """Acceleration and speed cap, the speeds that they explain, and warnings."""
    if not legs:
        words = "no leg from standing to standing with its speed: acceleration_m_s2 is missing here"
        return (), (), (words,)
    flown, leg_of = np.concatenate(legs), np.repeat(np.arange(len(legs)), [*map(len, legs)])
    observed, at_s = samples.speed_m_s[flown], samples.time_s[flown]
    distances_m, moments_m_s = (
        np.array([np.trapezoid(column[leg], samples.time_s[leg]) for leg in legs])
        for column in (samples.speed_m_s, samples.speed_m_s * samples.time_s)
    )
    speeds = _speeds(leg_of, at_s, observed, distances_m, moments_m_s / distances_m)

    def residuals(values: Floats) -> Floats:
        left: Floats = speeds(*values) - observed
        return left

    keys, moments = ("flight.acceleration_m_s2", "flight.max_speed_m_s"), 2 * len(legs)
    starts = [(a, float(np.max(observed))) for a in (0.5, 2.0, 8.0)]
    estimated = fit.estimate(keys, residuals, starts, eliminated=moments)
    warnings = estimated.warnings
    acceleration, cap = estimated.values
    without = fit.estimate(keys[:1], residuals, [(acceleration,)], eliminated=moments)
    more = without.residuals @ without.residuals - estimated.residuals @ estimated.residuals
    gain = float(more) / max(estimated.spread or 0.0, fit.NOTHING) ** 2
    if cap >= REACHED * math.sqrt(acceleration * distances_m.max()) or gain < GAIN:
        estimated = without
        warnings = ("no leg is long enough to show a speed cap: max_speed_m_s is missing here",)
    fitted = speeds(*estimated.values.tolist())
    course = fit.curve("speed", "m/s", observed, fitted, at_s, TIME)
    if (off_m_s := float(np.sqrt(np.mean((fitted - observed) ** 2)))) > MISFIT * observed.max():
        words = (
            f"legs of one acceleration and speed cap are {figure(off_m_s, 2)} m/s rms off the "
            "speeds"
        )
        missing = "acceleration_m_s2 and max_speed_m_s are missing here"
        advice = "for legs at different speeds use rotary-wing"
        return (), (course,), (f"{words}: {missing}; {advice}",)
    return (
        estimated.values_for_mission(f"fitted to the speed of {len(legs)} legs"),
        (course,),
        warnings,
    )


def _speeds(
    leg_of: Integers, time_s: Floats, speed_m_s: Floats, distance_m: Floats, middle_s: Floats
) -> Callable[..., Floats]:
    """Speeds [m/s] of the trapezoids of an acceleration and a cap that follow the legs best.

    Of the samples, and of the legs that they belong to: number, distance, mean time of flying it.
    """
    legs = len(distance_m)

    def mean(values: Floats, chosen: Booleans) -> Floats:
        """The mean of each leg; 0 of nothing."""
        count = np.bincount(leg_of[chosen], minlength=legs)
        return np.bincount(leg_of[chosen], values[chosen], legs) / np.maximum(count, 1)

    def speeds(acceleration_m_s2: float, cap_m_s: float = math.inf) -> Floats:
        loads = bang_bang.leg((distance_m, 0.0, 0.0), acceleration_m_s2, 1.0, 1.0, cap_m_s)
        start_s = middle_s - 0.5 * loads.durations_s[0]
        end_s = middle_s + 0.5 * loads.durations_s[0]
        for _ in range(MOST_SHIFTS):
            rising = acceleration_m_s2 * (time_s - start_s[leg_of])
            falling = acceleration_m_s2 * (end_s[leg_of] - time_s)
            fitted: Floats = np.clip(np.minimum(rising, falling), 0.0, cap_m_s)
            sloped = (fitted > 0.0) & (fitted < cap_m_s)
            early_s = (fitted - speed_m_s) / acceleration_m_s2
            later_s = mean(early_s, sloped & (rising < falling))
            sooner_s = mean(early_s, sloped & (rising >= falling))
            if max(np.max(np.abs(later_s)), np.max(np.abs(sooner_s))) <= FOUND_S:
                break
            start_s, end_s = start_s + later_s, end_s - sooner_s
        return fitted

    return speeds
