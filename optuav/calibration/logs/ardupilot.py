"""DataFlash logs of ArduPilot, by pymavlink."""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any

import numpy as np

from optuav.calibration.logs.samples import CUT_OFF, Pack, Readings, Velocity, side_by_side
from optuav.mission.files import refusal

DAMAGED = "is a DataFlash log of ArduPilot that is damaged"
INSTALL = 'python -m pip install "optuav[logs]"'
BATTERIES = ("BAT", "CURR")
CORES = ("XKF1", "NKF1", "EKF1")
MESSAGES: Mapping[str, tuple[str, ...]] = {
    **dict.fromkeys(BATTERIES, ("Curr", "Volt", "RemPct")),
    **dict.fromkeys(CORES, ("VN", "VE", "VD")),
    **{"GPS": ("Spd", "VZ"), "EV": ("Id",)},
}
EVENTS = {"armed": (10, 11), "landed": (18, 28)}
"""Numbers of the events that turn a state on and off."""


def read(path: Path) -> Readings:
    """Samples at the moments of the battery's messages."""
    rows: dict[str, list[tuple[float, ...]]] = {}
    now_s, faults = 0.0, list[str]()
    for kind, values, codes in _messages(path, faults):
        if kind in CORES and values.get("C", values.get("I", 0)):
            continue
        try:
            if "TimeUS" in values:
                now_s = values["TimeUS"] / 1e6
            elif "TimeMS" in values and kind != "GPS":  # whose milliseconds are of a week
                now_s = values["TimeMS"] / 1e3
            # Firmware of before 2015 logs whole hundredths of amperes and volts.
            size = 0.01 if kind in BATTERIES and codes["Curr"] in "bBhHiI" else 1.0
            numbers = (size * float(values.get(name, np.nan)) for name in MESSAGES[kind])
            row = (now_s, *numbers)
        except (KeyError, TypeError, ValueError):  # A damaged format: texts in place of numbers
            raise refusal(path, DAMAGED) from None
        inst = values.get("Inst", values.get("Instance", 0))
        rows.setdefault(f"{kind}{inst}" if kind in BATTERIES else kind, []).append(row)
    found = {name: np.array(columns).T for name, columns in rows.items()}
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
    return Readings(*side_by_side(packs, velocity, states), faults)


def _messages(
    path: Path, faults: list[str]
) -> Iterator[tuple[str, Mapping[str, Any], Mapping[str, str]]]:
    """Yield kind, values and format codes of every message; add what is wrong with the file."""
    try:
        from pymavlink.DFReader import DFReader_binary
    except ImportError:
        words = f"is a DataFlash log of ArduPilot, which needs pymavlink: {INSTALL}"
        raise refusal(path, words) from None

    class Reader(DFReader_binary):  # type: ignore[misc]
        """Its own index, in Python: the one in C writes of damage to the terminal."""

        def init_arrays_fast(self, progress_callback: object = None) -> None:
            self.init_arrays(progress_callback)

    printed = io.StringIO()
    try:
        with redirect_stdout(printed), redirect_stderr(printed):
            reader = Reader(str(path))
            while (message := reader.recv_match(type=[*MESSAGES])) is not None:
                codes = dict(zip(message.fmt.columns, message.fmt.format, strict=False))
                yield message.get_type(), message.to_dict(), codes
            ends = (
                reader.formats[number].len + places[-1]
                for number, places in enumerate(reader.offsets)
                if places and number in reader.formats
            )
            short = max(ends, default=0) > reader.data_len
            reader.close()
    except Exception:  # pymavlink raises errors of many kinds for damaged files
        raise refusal(path, DAMAGED) from None
    faults += ["has damaged parts, which are skipped"] if printed.getvalue() else []
    faults += [CUT_OFF] if short else []
