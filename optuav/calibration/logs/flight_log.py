"""Flight logs: what was measured, and what the drone did meanwhile."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import numpy.typing as npt

from optuav.arrays import Booleans, Floats
from optuav.calibration import csv
from optuav.calibration.logs.samples import Columns, Readings, in_order
from optuav.mission.files import label, refusal
from optuav.mission.messages import plural
from optuav.presentation.numbers import figure, percent, seconds

STILL_m_s = 1.0  # speed over ground below which an airborne UAV hovers
LEVEL_m_s, LEVEL_SLOPE = 0.5, 0.2  # climb, and climb over speed, up to which flight is level
LASTING_S = 5.0  # shortest hover, and span of a point of steady flight
IDLE = 0.1  # share of the current in the air below which rotors stand
AFLOAT = 0.5  # share of the current in the air below which rotors carry nothing
FEW = 0.01  # share of wild values above which the unit of the column is in doubt
USUAL = 75.0  # percentile of currents that is one in the air, where no state says so
IN_THE_AIR = "ends in the air: its last part is missing"
REST, HOVER, FLIGHT, OTHER = "rest", "hover", "flight", "other"
# Reasons why samples are left out
CLIMBS, BRIEF = "of climbs and descents", "of brief stops"
GROUND, GAPS = "on the ground with rotors on", "beside gaps in the log"


@dataclass(frozen=True, eq=False)
class FlightLog:
    r"""A flight log: its samples, what the drone did at each, and why some are left out.

    Parameters
    ----------
    source
        The file.
    format
        Its format, and the program or autopilot that wrote it.
    samples
        Columns by name: time [s] from 0, current [A], voltage [V], speed over ground and climb
        [m/s], charge left (0 to 1), armed and landed (1 or 0, -1 where unknown).
    phase
        ``"rest"``, ``"hover"``, ``"flight"`` or ``"other"`` of every sample.
    reason
        Why a sample of the phase ``"other"`` is left out, else empty.
    airborne
        Whether the drone is in the air at a sample, as far as the log tells.
    used
        Whether the calibration uses a sample.
    packs
        Number of battery packs whose currents are added.
    notes, warnings
        Sentences on what was read, and on what may be wrong with it.

    Examples
    --------
    >>> import optuav, pathlib, tempfile
    >>> rows = [f"{100 * n},{-18},{22.2},{0},{90}" for n in range(200)]
    >>> heads = "time(millisecond),current(A),voltage(v),speed(mph),battery_percent"
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = pathlib.Path(folder) / "flight.csv"
    ...     _ = file.write_text("\n".join([heads, *rows]))
    ...     log = optuav.fit_regimes(file).logs[0]
    >>> log.format, set(log.phase.tolist()), float(log.samples.current_A[0])
    ('CSV of AirData or DJI', {'hover'}, 18.0)
    """

    source: str
    format: str
    samples: Columns
    phase: npt.NDArray[np.str_]
    reason: npt.NDArray[np.str_]
    airborne: Booleans
    used: Booleans
    packs: int = 1
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = field(default=())

    @property
    def step_s(self) -> Floats:
        """Span that each sample stands for [s]; none beside gaps."""
        spans = np.gradient(self.samples.time_s)
        usual = float(np.median(np.diff(self.samples.time_s)))
        return np.where(spans > csv.WIDEST_STEP * usual / 2.0, usual, spans)

    def shares(self, words: str) -> Iterator[str]:
        """Sentences on the share of the time that is used, and on the rest."""
        used, step_s, total_s = self.used, self.step_s, float(np.sum(self.step_s))
        parts = [
            f"{percent(np.sum(step_s[used & (self.phase == phase)]) / total_s, 0)} {phase}"
            for phase in (HOVER, FLIGHT, REST)
            if np.any(used & (self.phase == phase))
        ]
        share = float(np.sum(step_s[used])) / total_s
        of = f" ({', '.join(parts)})" if len(parts) > 1 else ""
        yield f"{self.source}: {percent(share, 0)} of {seconds(total_s, 0)} {words}{of}"
        reasons = np.where(self.reason != "", self.reason, self.phase)
        words_of = {HOVER: "of hover", FLIGHT: "of unsteady flight", REST: "at rest"}
        left = {why: float(np.sum(step_s[~used & (reasons == why)])) for why in set(reasons)}
        by_size = sorted(left.items(), key=lambda time: (-time[1], time[0]))
        gone = [
            f"{seconds(time_s, 0)} {words_of.get(why, why)}"
            for why, time_s in by_size
            if time_s >= 0.5
        ]
        if gone:
            yield f"{self.source}: left out are {', '.join(gone)}"


def flight_log(path: Path, format: str, readings: Readings) -> FlightLog:
    """The log with its phases; refused if it has no current or ends before it begins."""
    samples, packs, notes, warnings, damaged = readings
    source, warned = label(path), [*warnings]
    current_A = samples.current_A
    measured = np.isfinite(samples.time_s) & np.isfinite(current_A)
    for sign in csv.UNKNOWN["current"]:
        measured &= ~np.isclose(current_A, sign, rtol=csv.ROUNDED_UNIT, atol=0.0)
    measured &= np.all(np.abs([samples.time_s, current_A]) < csv.LARGEST, axis=0)
    samples, wild = _plausible(samples.only(measured), damaged=damaged)
    notes = [*notes, *wild]
    samples = samples.only(np.isfinite(samples.current_A))
    moves_on = in_order(samples.time_s)
    if (count := int(np.sum(~measured))) and measured.any():
        warned.append(f"{count} of {plural(len(measured), 'sample')} have no current")
    if count := int(np.sum(~moves_on)):
        words = f"{count} of {plural(len(measured), 'sample')}"
        warned.append(f"{words} have a time out of order and are left out")
    samples = samples.only(moves_on)
    current_A = samples.current_A
    if len(current_A) < 3 or not np.any(np.abs(current_A) > 0.0):
        words = "has no current: a sensor must measure it, and the autopilot must log it"
        few = "; ".join([f"has {plural(len(measured), 'sample')}", *notes])
        raise refusal(path, words if len(measured) > 2 else few)
    if np.sum(current_A) < 0.0:
        samples = samples._replace(current_A=-current_A)
        notes = [*notes, "the current is negative while discharging; its sign is turned"]
    samples = samples._replace(time_s=samples.time_s - samples.time_s[0])
    phase, reason, airborne = _phases(samples)
    armed, landed = int(samples.armed[-1]), int(samples.landed[-1])
    if armed != 0 and (landed == 0 or (landed < 0 and armed == 1)):
        warned.append(IN_THE_AIR)
    if not np.isfinite(samples.speed_m_s).any():
        warned.append("there are no speeds: hover and flight cannot be told apart")
    elif not np.isfinite(samples.climb_m_s).any():
        warned.append(
            "there is no speed up or down: climbs and descents count as hover or level flight, "
            "whose currents then are those of both"
        )
    heads = tuple(f"{source}: {words}" for words in notes)
    for name, values in (
        ("current", samples.current_A),
        ("voltage", samples.voltage_V),
        ("speed", samples.speed_m_s),
    ):
        if np.isfinite(values).any():
            most = float(np.nanmax(np.abs(values)))
            warned += csv.unit_doubts(f"the largest {name}", most, name, name)
    return FlightLog(
        *(source, format, samples, phase, reason, airborne, phase != OTHER, packs, heads),
        tuple(f"{source}: {words}" for words in warned),
    )


def _plausible(samples: Columns, *, damaged: bool) -> tuple[Columns, list[str]]:
    """Samples without the values that no UAV has, and sentences that count these.

    Where they are many, the unit of a column is in doubt instead, unless the log is damaged.
    """
    notes = list[str]()

    def known(kind: str, values: Floats) -> Floats:
        _, most, unit = csv.USUAL[kind]
        wild = np.abs(values) > most
        count = int(np.sum(wild))
        if not count or (count > FEW * len(values) and not damaged):
            return values
        of = f"{count} of {plural(len(values), kind)}"
        notes.append(f"left out are {of}: above {figure(most)} {unit}, which no UAV has")
        return np.where(wild, np.nan, values)

    plausible = samples._replace(
        current_A=known("current", samples.current_A),
        voltage_V=known("voltage", samples.voltage_V),
        speed_m_s=known("speed", samples.speed_m_s),
    )
    return plausible, notes


def _phases(samples: Columns) -> tuple[npt.NDArray[np.str_], npt.NDArray[np.str_], Booleans]:
    """What the drone does at each sample, why a sample is left out, and whether it is airborne."""
    time_s, current_A, _, speed_m_s, climb_m_s, _, armed, landed = samples
    climb = np.abs(np.nan_to_num(climb_m_s))
    usual_A = float(np.percentile(current_A[current_A > 0.0], USUAL))
    off = np.where(armed < 0, current_A < IDLE * usual_A, armed == 0)
    down = np.where(landed < 0, off | (current_A < AFLOAT * usual_A), landed == 1)
    slow = (speed_m_s < STILL_m_s) & (climb < LEVEL_m_s)
    level = climb <= np.maximum(LEVEL_m_s, LEVEL_SLOPE * np.nan_to_num(speed_m_s))
    if np.any(stops := slow & ~off & ~down):
        # An autopilot tells a take-off early and a landing late: rotors carry nothing there yet.
        carried = ~slow | (current_A >= AFLOAT * np.median(current_A[stops]))
        for run in runs(~off & ~down):
            taken_off = np.maximum.accumulate(carried[run])
            landing = np.maximum.accumulate(carried[run][::-1])[::-1]
            down[run] = ~(taken_off & landing)
    hovers = np.zeros(len(time_s), bool)
    for run in runs(slow & ~off & ~down):
        hovers[run] = time_s[run[-1]] - time_s[run[0]] >= LASTING_S
    gaps = np.diff(time_s) > csv.WIDEST_STEP * float(np.median(np.diff(time_s)))
    beside = np.append(gaps, False) | np.append(False, gaps)
    unknown = ~np.isfinite(speed_m_s)
    cases = {
        GAPS: beside,
        REST: off,
        GROUND: down,
        "without speeds": unknown,
        HOVER: hovers,
        BRIEF: slow,
        FLIGHT: level,
    }
    reason = np.select([*cases.values()], [*cases], CLIMBS)
    taken = np.isin(reason, (REST, HOVER, FLIGHT))
    # Without states and speeds, a low current is no landing: the discharge may be of a bench.
    stands = down & ((landed >= 0) | (speed_m_s < STILL_m_s))
    return np.where(taken, reason, OTHER), np.where(taken, "", reason), ~off & ~stands


def runs(chosen: Booleans) -> Iterator[npt.NDArray[np.intp]]:
    """The places of every run of chosen samples."""
    cuts = np.flatnonzero(np.diff(chosen)) + 1
    for run in np.split(np.arange(len(chosen)), cuts):
        if len(run) and chosen[run[0]]:
            yield run
