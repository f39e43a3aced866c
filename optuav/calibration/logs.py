"""Flight logs of PX4, ArduPilot and DJI: what was measured, and what the drone did meanwhile.

Formats: ULog 1 (PX4), DataFlash (ArduPilot), and CSV as AirData and programs that decode DJI's
records write it. Speeds in all of these are over the ground.
"""

from __future__ import annotations

import io
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from optuav.arrays import Booleans, Floats
from optuav.calibration import csv
from optuav.errors import Fault, InputError, decimal, refuse
from optuav.mission.files import STANDARD, csv_rows, label, opened, refusal
from optuav.mission.formats import named
from optuav.mission.messages import nearest, plural, shown

LARGEST_LOG = 1_000_000_000  # bytes
ULOG, DATAFLASH = b"ULog\x01\x12\x35", b"\xa3\x95\x80"
INSTALL = 'python -m pip install "optuav[logs]"'

STILL_m_s = 1.0  # speed over ground below which an airborne UAV hovers
LEVEL_m_s, LEVEL_SLOPE = 0.5, 0.2  # climb, and climb over speed, up to which flight is level
LASTING_S = 5.0  # shortest hover, and span of a point of steady flight
STEADY_m_s = 0.5  # largest standard deviation of a speed that is steady
IDLE, AFLOAT = (
    0.1,
    0.5,
)  # shares of the current in the air below which rotors stand, or carry nothing
USUAL = 75.0  # percentile of currents that is one in the air, where no state says so
SAME_VOLTAGE = 0.1  # relative difference of the voltages of packs side by side
FULL, EMPTY = 0.95, 0.15  # charge at the ends of the discharge of a full battery

OF_LOGS = "a log is a ULog (.ulg), a DataFlash (.bin) or a CSV"
NO_VOLTAGE = "has no voltage: without it currents give no power"
DAMAGED = "is damaged; what could be read is used"
CUT_OFF = "is cut off; what could be read is used"
IN_THE_AIR = "ends in the air: its last part is missing"
REST, HOVER, FLIGHT, OTHER = "rest", "hover", "flight", "other"
CLIMBS, BRIEF, GROUND, GAPS = (
    "of climbs and descents",
    "of brief stops",
    "on the ground with rotors on",
    "beside gaps in the log",
)
"""Reasons why samples are left out."""


class Columns(NamedTuple):
    """Samples in order of time: NaN where a log has no value, -1 where it has no state."""

    time_s: Floats
    current_A: Floats  # positive while discharging
    voltage_V: Floats
    speed_m_s: Floats  # horizontal, over ground
    climb_m_s: Floats  # of either sign
    charge: Floats  # left in the battery, 0 to 1
    armed: npt.NDArray[np.int_]
    landed: npt.NDArray[np.int_]

    def only(self, rows: Booleans) -> Columns:
        """The samples that are chosen."""
        return Columns(
            *(self.time_s[rows], self.current_A[rows], self.voltage_V[rows]),
            *(self.speed_m_s[rows], self.climb_m_s[rows], self.charge[rows]),
            *(self.armed[rows], self.landed[rows]),
        )


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
    packs: int = 1
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = field(default=())

    @property
    def step_s(self) -> Floats:
        """Span that each sample stands for [s]; none beside gaps."""
        spans = np.gradient(self.samples.time_s)
        usual = float(np.median(np.diff(self.samples.time_s)))
        return np.where(spans > csv.WIDEST_STEP * usual / 2.0, usual, spans)

    def shares(self, used: Booleans, words: str) -> Iterator[str]:
        """Sentences on the share of the time that is used, and on the rest."""
        step_s, total_s = self.step_s, float(np.sum(self.step_s))
        parts = [
            f"{np.sum(step_s[used & (self.phase == phase)]) / total_s:.0%} {phase}"
            for phase in (HOVER, FLIGHT, REST)
            if np.any(used & (self.phase == phase))
        ]
        share = float(np.sum(step_s[used])) / total_s
        of = f" ({', '.join(parts)})" if len(parts) > 1 else ""
        yield f"{self.source}: {share:.0%} of {total_s:.0f} s {words}{of}".replace("%", " %")
        reasons = np.where(self.reason != "", self.reason, self.phase)
        words_of = {HOVER: "of hover", FLIGHT: "of unsteady flight", REST: "at rest"}
        left = {why: float(np.sum(step_s[~used & (reasons == why)])) for why in set(reasons)}
        by_size = sorted(left.items(), key=lambda each: (-each[1], each[0]))
        gone = [
            f"{time_s:.0f} s {words_of.get(why, why)}" for why, time_s in by_size if time_s >= 0.5
        ]
        if gone:
            yield f"{self.source}: left out are {', '.join(gone)}"


def read(path: Path, columns: Mapping[str, str]) -> FlightLog | None:
    """The flight log in a file; None if the file is a CSV with the headings of optuav."""
    if path == STANDARD:
        return None
    with opened(path, LARGEST_LOG) as file:
        head = file.read(4096)
    if head.startswith(ULOG):
        if columns:
            raise _no_columns(path)
        return _finished(path, "ULog of PX4", *_of_px4(path))
    if head.startswith(DATAFLASH):
        if columns:
            raise _no_columns(path)
        return _finished(path, "DataFlash log of ArduPilot", *_of_ardupilot(path))
    if what := named(head):
        advice = what.advice or OF_LOGS
        raise refusal(path, f"is {what.name}; {advice}")
    if path.suffix.lower() == ".txt" and path.stem.startswith("DJIFlightRecord"):
        words = "is a record of DJI in its own code; AirData and other programs make a CSV of it"
        raise refusal(path, words)
    if b"\0" in head:
        raise refusal(path, f"is not text and of no known format; {OF_LOGS}")
    return _of_csv(path, columns)


def steady(log: FlightLog) -> tuple[csv.Measurements, Booleans]:
    """Points of steady level flight and hover, mean speed and power of each, and their samples."""
    time_s, current_A, voltage_V, speed_m_s, *_ = log.samples
    if not np.isfinite(voltage_V).any():
        raise refusal(Path(log.source), NO_VOLTAGE)
    speeds, powers, used = list[float](), list[float](), np.zeros(len(time_s), bool)
    for phase in (HOVER, FLIGHT):
        for run in _runs(log.phase == phase):
            count = int((time_s[run[-1]] - time_s[run[0]]) // LASTING_S)
            for part in np.array_split(run, count) if count else ():
                known = np.isfinite(speed_m_s[part] * voltage_V[part])
                if known.sum() < 2 or np.std(speed_m_s[part]) > STEADY_m_s:
                    continue
                used[part] = True
                speeds.append(float(np.mean(speed_m_s[part])) if phase == FLIGHT else 0.0)
                powers.append(float(np.mean(current_A[part] * voltage_V[part])))
    numbers = {"speed": np.array(speeds), "power": np.array(powers)}
    return _measurements(log.source, {"speed": "speed", "power": "power"}, numbers), used


def discharge(log: FlightLog) -> csv.Measurements:
    """The record of a discharge of one pack, or a refusal if it is not one from full to cut-off."""
    charge = log.samples.charge[np.isfinite(log.samples.charge)]
    if len(charge) and (charge[0] < FULL or charge[-1] > EMPTY):
        words = f"a record of one discharge, from at least {FULL:.0%} to at most {EMPTY:.0%}"
        ends = f"the log goes from {charge[0]:.0%} to {charge[-1]:.0%}"
        raise refusal(Path(log.source), f"{words} of the charge; {ends}".replace("%", " %"))
    numbers = {"time": log.samples.time_s, "current": log.samples.current_A / log.packs}
    return _measurements(log.source, {"time": "time", "current": "current"}, numbers)


def _measurements(
    source: str, kinds: Mapping[str, str], numbers: Mapping[str, Floats]
) -> csv.Measurements:
    """Numbers in SI units as a file of optuav would state them, numbered from 1."""
    lines = tuple(range(1, 1 + len(next(iter(numbers.values())))))
    return csv.Measurements(source, kinds, dict.fromkeys(kinds, 1.0), lines, numbers, {})


def _no_columns(path: Path) -> InputError:
    return InputError([Fault("columns", "", "goes with a CSV file", label(path))])


# What a log says


class Recorded(io.BufferedReader):
    """A file that notes whether it ended within what was last read from it."""

    short = False

    def read(self, size: int | None = -1, /) -> bytes:
        """Read as always, and note whether less was left than is asked for."""
        content = super().read(size)
        # After the last whole message pyulog asks for the 3 bytes of a head and gets none.
        self.short = len(content) < (size or 0) and not (size == 3 and not content)
        return content


def _of_px4(path: Path) -> tuple[Columns, int, list[str], list[str]]:
    """Samples at the moments of the battery's messages."""
    try:
        from pyulog import ULog
    except ImportError:
        raise refusal(path, f"is a ULog of PX4, which needs pyulog: {INSTALL}") from None
    wanted = ["battery_status", "vehicle_local_position", "vehicle_gps_position", "sensor_gps"]
    wanted += ["actuator_armed", "vehicle_land_detected"]
    try:
        nowhere = io.StringIO()
        with Recorded(io.FileIO(path)) as file, redirect_stdout(nowhere), redirect_stderr(nowhere):
            log = ULog(file, wanted)
    except Exception:  # Damaged files raise errors of many kinds
        raise refusal(path, "is a ULog of PX4 that is damaged or cut off") from None
    warnings = [DAMAGED] if log.file_corruption else []
    warnings += [CUT_OFF] if file.short else []
    if lost_s := sum(dropout.duration for dropout in log.dropouts) / 1e3:
        warnings.append(f"the logger dropped out for {lost_s:.1f} s in all")
    messages: dict[str, list[Any]] = {name: [] for name in wanted}
    for each in sorted(log.data_list, key=lambda data: data.multi_id):
        messages[each.name].append({"t": each.data["timestamp"] / 1e6, **each.data})
    if not messages["battery_status"]:
        raise refusal(path, "has no battery_status: PX4 logged no battery")
    packs = [
        Pack(of["t"], _of(of, "current_a"), _of(of, "voltage_v"), _of(of, "remaining"))
        for of in messages["battery_status"]
    ]
    velocity = None
    if found := messages["vehicle_local_position"]:
        velocity = Velocity(found[0]["t"], *(_of(found[0], key) for key in ("vx", "vy", "vz")))
    elif found := [*messages["vehicle_gps_position"], *messages["sensor_gps"]]:
        keys = ("vel_n_m_s", "vel_e_m_s", "vel_d_m_s")
        velocity = Velocity(found[0]["t"], *(_of(found[0], key) for key in keys))
    states = {
        key: (found[0]["t"], found[0][key].astype(int))
        for name, key in (("actuator_armed", "armed"), ("vehicle_land_detected", "landed"))
        if (found := messages[name])
    }
    return *_sampled(packs, velocity, states), warnings


def _of_ardupilot(path: Path) -> tuple[Columns, int, list[str], list[str]]:
    """Samples at the moments of the battery's messages."""
    try:
        from pymavlink.DFReader import DFReader_binary
    except ImportError:
        words = f"is a DataFlash log of ArduPilot, which needs pymavlink: {INSTALL}"
        raise refusal(path, words) from None

    class Reader(DFReader_binary):  # type: ignore[misc]
        """Its own index, in Python: the one in C writes of damage to the terminal."""

        def init_arrays_fast(self, progress_callback: object = None) -> None:
            self.init_arrays(progress_callback)

    rows: dict[str, list[tuple[float, ...]]] = {}
    now_s, damaged = 0.0, io.StringIO()
    try:
        with redirect_stdout(damaged), redirect_stderr(damaged):
            reader = Reader(str(path))
            while (message := reader.recv_match(type=[*MESSAGES])) is not None:
                kind, values = message.get_type(), message.to_dict()
                if "TimeUS" in values:
                    now_s = values["TimeUS"] / 1e6
                elif "TimeMS" in values and kind != "GPS":  # whose milliseconds are of a week
                    now_s = values["TimeMS"] / 1e3
                names, inst = MESSAGES[kind], values.get("Inst", values.get("Instance", 0))
                if kind in CORES and values.get("C", values.get("I", 0)):
                    continue
                codes = dict(zip(message.fmt.columns, message.fmt.format, strict=False))
                # Firmware of before 2015 logs whole hundredths of amperes and volts.
                size = 0.01 if kind in BATTERIES and codes["Curr"] in "bBhHiI" else 1.0
                row = (now_s, *(size * float(values.get(name, np.nan)) for name in names))
                rows.setdefault(f"{kind}{inst}" if kind in BATTERIES else kind, []).append(row)
            ends = (
                reader.formats[number].len + places[-1]
                for number, places in enumerate(reader.offsets)
                if places and number in reader.formats
            )
            short = max(ends, default=0) > reader.data_len
            reader.close()
    except Exception:  # Damaged files raise errors of many kinds
        raise refusal(path, "is a DataFlash log of ArduPilot that is damaged") from None
    found = {name: np.array(each).T for name, each in rows.items()}
    batteries = [name for kind in BATTERIES for name in sorted(found) if name[:-1] == kind]
    if not batteries:
        raise refusal(path, "has no BAT or CURR messages: ArduPilot logged no battery")
    own = [name for name in batteries if name[:-1] == batteries[0][:-1]]
    packs = [
        Pack(t, amps, volts, left / 100.0) for t, amps, volts, left in map(found.__getitem__, own)
    ]
    velocity = next((Velocity(*found[kind]) for kind in CORES if kind in found), None)
    if velocity is None and "GPS" in found:
        t, ground, down = found["GPS"]
        velocity = Velocity(t, ground, np.zeros_like(ground), down)
    states = {}
    if "EV" in found:
        t, numbers = found["EV"]
        for key, (on, off) in EVENTS.items():
            if np.any(rows_of := np.isin(numbers, (on, off))):
                values = (numbers[rows_of] == on).astype(int)
                # Before its first change a state was the other one
                before = np.append(-np.inf, t[rows_of]), np.append(1 - values[0], values)
                states[key] = before
    warnings = ["has damaged parts, which are skipped"] if damaged.getvalue() else []
    warnings += [CUT_OFF] if short else []
    return *_sampled(packs, velocity, states), warnings


BATTERIES = ("BAT", "CURR")
CORES = ("XKF1", "NKF1", "EKF1")
MESSAGES: Mapping[str, tuple[str, ...]] = {
    **dict.fromkeys(BATTERIES, ("Curr", "Volt", "RemPct")),
    **dict.fromkeys(CORES, ("VN", "VE", "VD")),
    **{"GPS": ("Spd", "VZ"), "EV": ("Id",)},
}
EVENTS = {"armed": (10, 11), "landed": (18, 28)}
"""Numbers of the events that turn a state on and off."""


def _of(message: Mapping[str, Any], key: str) -> Floats:
    """A column of a message; NaN where this version of it has none."""
    return np.asarray(message.get(key, np.full(len(message["t"]), np.nan)), dtype=float)


class Pack(NamedTuple):
    """A battery's messages."""

    time_s: Floats
    current_A: Floats
    voltage_V: Floats
    charge: Floats


class Velocity(NamedTuple):
    """Velocities north, east and down."""

    time_s: Floats
    north_m_s: Floats
    east_m_s: Floats
    down_m_s: Floats


def _sampled(
    packs: Sequence[Pack],
    velocity: Velocity | None,
    states: Mapping[str, tuple[Floats, npt.NDArray[np.int_]]],
) -> tuple[Columns, int, list[str]]:
    """The samples of the first battery, with the currents of others side by side."""
    first, *others = packs
    time_s, current_A, count, notes = first.time_s, first.current_A.copy(), 1, list[str]()
    for other in others:
        voltages = float(np.nanmean(first.voltage_V)), float(np.nanmean(other.voltage_V))
        if np.any(other.current_A > 0.0) and abs(voltages[1] / voltages[0] - 1.0) < SAME_VOLTAGE:
            current_A += np.interp(time_s, other.time_s, other.current_A)
            count += 1
    if count > 1:
        notes.append(f"the current is that of {count} batteries side by side")
    unknown = np.full(len(time_s), np.nan)
    speed_m_s = climb_m_s = unknown
    if velocity is not None:
        at_s, *ways = velocity
        north, east, down = (np.interp(time_s, at_s, each) for each in ways)
        speed_m_s, climb_m_s = np.hypot(north, east), -down
    held = dict[str, npt.NDArray[np.int_]]()
    for key in ("armed", "landed"):
        held[key] = np.full(len(time_s), -1)
        if key in states:
            at_s, values = states[key]
            before = np.searchsorted(at_s, time_s, side="right") - 1
            held[key] = values[np.maximum(before, 0)]
    series = (time_s, current_A, first.voltage_V, speed_m_s, climb_m_s, first.charge)
    return Columns(*series, held["armed"], held["landed"]), count, notes


# CSV of other programs

FEET_m, MILES_PER_H = 0.3048, 0.44704
NAMES: Mapping[str, tuple[str, ...]] = {
    "time": ("time", "osd.flytime"),
    "current": ("current", "battery.current"),
    "voltage": ("voltage", "battery.voltage", "battery.totalvoltage"),
    "speed": ("speed", "osd.hspeed"),
    "climb": ("zspeed", "osd.zspeed", "osd.vspeed"),
    "charge": (
        "battery_percent",
        "battery.chargelevel",
        "battery.relativecapacity",
        "battery.life",
    ),
    "armed": ("osd.ismotoron", "osd.ismotorup", "ismotoron", "ismotorup"),
    "landed": ("osd.isonground", "osd.groundorsky", "isonground"),
}
"""Columns of AirData and of decoders of DJI's records, in small letters."""
DOWNWARD = "zspeed"  # End of names whose positive values are a descent, as DJI counts
SPEEDS: Mapping[str, float] = {
    **{"": 1.0, "m/s": 1.0, "mps": 1.0, "km/h": 1 / 3.6, "kph": 1 / 3.6},
    **{"mph": MILES_PER_H, "ft/s": FEET_m, "knots": 1852 / 3600},
}
WORTH: Mapping[str, Mapping[str, float]] = {
    "time": {"": 1.0, "s": 1.0, "ms": 1e-3, "millisecond": 1e-3, "milliseconds": 1e-3},
    "current": {"": 1.0, "a": 1.0, "ma": 1e-3},
    "voltage": {"": 1.0, "v": 1.0, "mv": 1e-3},
    **{"speed": SPEEDS, "climb": SPEEDS},
    "charge": {"": 0.01, "%": 0.01},
}
STATES = {"true": 1, "1": 1, "ground": 1, "on ground": 1, "yes": 1} | dict.fromkeys(
    ("false", "0", "sky", "no"), 0
)
UNIT = re.compile(r"(.*?) *[\[(]([^\[()\]]*)[\])]")
OWN = csv.Format(
    {
        **{"time": "time", "current": "current", "voltage": "voltage"},
        **{"speed": "speed", "climb": "speed"},
    }
)
"""Columns of optuav, for `columns`."""
NEW = "time_s, current_A, voltage_V, speed_m_s, climb_m_s, battery_percent, isMotorOn, isOnGround"


def _of_csv(path: Path, columns: Mapping[str, str]) -> FlightLog | None:
    """The log in a CSV file of another program; None if it has the headings of optuav."""
    source = label(path)
    with opened(path, csv.LARGEST_FILE) as file:
        # Only signs of degrees are lost, which some programs write in other codes.
        text = file.read().decode("utf-8-sig", errors="replace")
    first, _, rest = text.partition("\n")
    mark = ""
    if re.fullmatch(r"\"?sep=.\"?\s*", first):  # A hint for Excel
        mark, text = first.strip().strip('"')[-1], rest
    head = next((line for line in text.splitlines() if line.strip() and line[0] != "#"), "")
    mark = mark or max(",;\t", key=head.count)
    rows = csv_rows(text, source, mark)
    _, headings = next(rows, (0, list[str]()))
    places = dict[str, tuple[int, float]]()
    wrong = [old for old in columns if old not in headings]
    if wrong:
        words = f"a column of the file{nearest(wrong[0], headings)}"
        raise InputError([Fault("columns", shown(wrong[0]), words, source)])
    # Those that are named here first, then those with a unit: decoders of DJI's records put a
    # text such as 0m 2.8s before the seconds.
    ranks = [(old not in columns, not UNIT.fullmatch(old)) for old in headings]
    for place in sorted(range(len(headings)), key=ranks.__getitem__):
        heading = headings[place]
        if (found := _column(columns.get(heading, heading))) and found[0] not in places:
            places[found[0]] = place, found[1]
        elif heading in columns and found is None:
            words = f"one of {NEW}, or with another unit"
            raise InputError([Fault("columns", shown(columns[heading]), words, source)])
        elif heading in columns:
            words = f"names {columns[heading]} a second time"
            raise InputError([Fault("columns", shown(heading), words, source)])
    foreign = any(_foreign(heading) for heading in headings)
    refuse(_unknown_units(headings, places, source))
    if not columns and not (foreign and {"time"} & places.keys()):
        if len(headings) > 1 and not any(map(_has_unit, headings)):
            names = ", ".join(shown(heading) for heading in headings[:MOST_NAMED])
            more = ", …" * (len(headings) > MOST_NAMED)
            words = f"has no heading that is known: {names}{more}; use {OLD_NEW}, NEW one of {NEW}"
            raise refusal(path, f"{words}; headings of AirData, such as {OF_AIRDATA}, need none")
        return None
    if missing := [name for name in ("time", "current") if name not in places]:
        words = f"there is no column of the {' and of the '.join(missing)}; {OLD_NEW} names one"
        raise refusal(path, words)
    table = _cells(rows, places, decimal_comma=mark != ",")
    return _finished(path, "CSV" if columns else "CSV of AirData or DJI", *table)


OLD_NEW = "--column OLD=NEW"
OF_AIRDATA = "time(millisecond), current(A), voltage(v), speed(mph)"
MOST_NAMED = 8  # Headings of a file in a message


def _has_unit(heading: str) -> bool:
    """Return whether a heading ends in a unit, as those of optuav do."""
    _, line, unit = heading.rpartition("_")
    return bool(line) and any(unit in units for units in csv.UNITS.values())


def _unknown_units(
    headings: Sequence[str], places: Mapping[str, tuple[int, float]], source: str
) -> Iterator[Fault]:
    """Yield a fault for a quantity all of whose columns are in units that are not known."""
    for heading in headings:
        if (parts := UNIT.fullmatch(heading.strip().lower())) is None:
            continue
        for quantity, worth in WORTH.items():
            if parts[1] in NAMES[quantity] and quantity not in places:
                units = ", ".join(unit for unit in worth if unit)
                yield Fault("column", shown(heading), f"must be in one of {units}", source)


def _column(heading: str) -> tuple[str, float] | None:
    """The quantity that a heading names, and the SI value of its unit."""
    for quantity in OWN.kinds:
        if heading in (known := OWN.headings(quantity)):
            return quantity, known[heading]
    return _foreign(heading)


def _foreign(heading: str) -> tuple[str, float] | None:
    """The quantity that a heading of another program names, and the SI value of its unit."""
    small = heading.strip().lower()
    parts = UNIT.fullmatch(small)
    for name, unit in ((small, ""), parts.groups() if parts else (small, "")):
        for quantity, names in NAMES.items():
            if name in names and unit in (worth := WORTH.get(quantity, {"": 1.0})):
                return quantity, -worth[unit] if name.endswith(DOWNWARD) else worth[unit]
    return None


def _cells(
    rows: Iterator[tuple[int, list[str]]],
    places: Mapping[str, tuple[int, float]],
    *,
    decimal_comma: bool,
) -> tuple[Columns, int, list[str], list[str]]:
    """The samples of lines whose time and current are known, in order of time."""
    kept, lost, late, last_s = list[list[float]](), 0, 0, -np.inf
    for _, cells in rows:
        values = list[float]()
        for name in NAMES:
            place, worth = places.get(name, (-1, 1.0))
            cell = cells[place] if 0 <= place < len(cells) else ""
            values.append(_number(name, cell, worth, decimal_comma=decimal_comma))
        time_s, current_A = values[:2]
        if not np.isfinite([time_s, current_A]).all():
            lost += 1
        elif time_s <= last_s:
            late += 1
        else:
            last_s = time_s
            kept.append(values)
    table = np.array(kept).T if kept else np.empty((len(NAMES), 0))
    by_name = dict(zip(NAMES, table, strict=True))
    states = (np.nan_to_num(by_name[name], nan=-1).astype(int) for name in ("armed", "landed"))
    series = ("time", "current", "voltage", "speed", "climb", "charge")
    notes, warnings = list[str](), list[str]()
    if lost or late:
        parts = [f"{lost} without time or current"] * bool(lost)
        parts += [f"{late} whose time does not move on"] * bool(late)
        of = f"{lost + late} of {plural(len(kept) + lost + late, 'line')}"
        notes.append(f"{of} are not read: {' and '.join(parts)}")
    return Columns(*(by_name[name] for name in series), *states), 1, notes, warnings


def _number(name: str, cell: str, worth: float, *, decimal_comma: bool) -> float:
    """The number in a cell in SI units; a state as 1 or 0; NaN if it has none."""
    if name in ("armed", "landed"):
        return STATES.get(cell.strip().lower(), np.nan)
    try:
        return worth * decimal(cell.replace(",", ".") if decimal_comma else cell)
    except ValueError:
        return np.nan


# What the drone did


def _finished(
    path: Path,
    format: str,
    samples: Columns,
    packs: int,
    notes: Sequence[str],
    warnings: Sequence[str],
) -> FlightLog:
    """The log with its phases; refused if it has no current or ends before it begins."""
    source, warned = label(path), [*warnings]
    current_A = samples.current_A
    known = np.isfinite(samples.time_s) & np.isfinite(current_A)
    for sign in csv.UNKNOWN["current"]:
        known &= ~np.isclose(current_A, sign, rtol=csv.ROUNDED_UNIT, atol=0.0)
    known &= np.all(np.abs([samples.time_s, current_A]) < csv.LARGEST, axis=0)
    samples = samples.only(known)
    latest_s = np.maximum.accumulate(samples.time_s)
    moves_on = samples.time_s > np.append(-np.inf, latest_s[:-1])
    if (count := int(np.sum(~known))) and known.any():
        warned.append(f"{count} of {plural(len(known), 'sample')} have no current")
    if count := int(np.sum(~moves_on)):
        warned.append(f"{count} of {plural(len(known), 'sample')} come later than they say")
    samples = samples.only(moves_on)
    current_A = samples.current_A
    if len(current_A) < 3 or not np.any(np.abs(current_A) > 0.0):
        words = "has no current: a sensor must measure it, and the autopilot must log it"
        few = "; ".join([f"has {plural(len(known), 'sample')}", *notes])
        raise refusal(path, words if len(known) > 2 else few)
    if np.sum(current_A) < 0.0:
        samples = samples._replace(current_A=-current_A)
        notes = [*notes, "the current is negative while discharging; its sign is turned"]
    samples = samples._replace(time_s=samples.time_s - samples.time_s[0])
    phase, reason = _phases(samples)
    armed, landed = int(samples.armed[-1]), int(samples.landed[-1])
    if armed != 0 and (landed == 0 or (landed < 0 and armed == 1)):
        warned.append(IN_THE_AIR)
    if not np.isfinite(samples.speed_m_s).any():
        warned.append("there are no speeds: hover and flight cannot be told apart")
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
        *(source, format, samples, phase, reason, packs, heads),
        tuple(f"{source}: {words}" for words in warned),
    )


def _phases(samples: Columns) -> tuple[npt.NDArray[np.str_], npt.NDArray[np.str_]]:
    """What the drone does at each sample, and why a sample is left out."""
    time_s, current_A, _, speed_m_s, climb_m_s, _, armed, landed = samples
    climb = np.abs(np.nan_to_num(climb_m_s))
    usual_A = float(np.percentile(current_A[current_A > 0.0], USUAL))
    off = np.where(armed < 0, current_A < IDLE * usual_A, armed == 0)
    down = np.where(landed < 0, off | (current_A < AFLOAT * usual_A), landed == 1)
    slow = (speed_m_s < STILL_m_s) & (climb < LEVEL_m_s)
    level = climb <= np.maximum(LEVEL_m_s, LEVEL_SLOPE * np.nan_to_num(speed_m_s))
    hovers = np.zeros(len(time_s), bool)
    for run in _runs(slow & ~off & ~down):
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
    return np.where(taken, reason, OTHER), np.where(taken, "", reason)


def _runs(chosen: Booleans) -> Iterator[npt.NDArray[np.intp]]:
    """The places of every run of chosen samples."""
    cuts = np.flatnonzero(np.diff(chosen)) + 1
    for run in np.split(np.arange(len(chosen)), cuts):
        if len(run) and chosen[run[0]]:
            yield run
