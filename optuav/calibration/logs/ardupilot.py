"""DataFlash logs of ArduPilot, by pymavlink."""

from __future__ import annotations

import io
import struct
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
HEADER, FORMAT = b"\xa3\x95", 0x80  # of every message, and the number of those on formats
MOST_PADDING = 528  # bytes after the last message that are no damage, by pymavlink
EVENTS = {"armed": (10, 11), "landed": (18, 28)}
"""Numbers of the events that turn a state on and off."""


def read(path: Path) -> Readings:
    """Samples at the moments of the battery's messages."""
    rows: dict[str, list[tuple[float, ...]]] = {}
    now_s, faults, broken = 0.0, list[str](), set[str]()
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
        except (KeyError, TypeError, ValueError):  # No such column, texts in place of numbers
            broken.add(kind)
            continue
        inst = values.get("Inst", values.get("Instance", 0))
        rows.setdefault(f"{kind}{inst}" if kind in BATTERIES else kind, []).append(row)
    found = {name: np.array(columns).T for name, columns in rows.items()}
    batteries = [name for kind in BATTERIES for name in sorted(found) if name[:-1] == kind]
    faults += [f"the format of {kind} is damaged: it is not read" for kind in sorted(broken)]
    if not batteries and broken:
        raise refusal(path, "; ".join([DAMAGED, *faults]))
    if not batteries:
        words = "has no BAT or CURR messages: ArduPilot logged no battery"
        raise refusal(path, "; ".join([words, *faults]))
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
    return Readings(*side_by_side(packs, velocity, states), faults, bool(faults))


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
        """With an index that goes on after damage, where pymavlink's ends at the first one."""

        damaged, short = 0, False  # bytes that are skipped; whether the last message is cut off

        def init_clock(self) -> None:
            """None: times are those of the messages, and a damaged GPS would stop the reader."""

        def init_arrays(self, progress_callback: object = None) -> None:
            """None: the index is written below, so that its own faults are not named damage."""

        init_arrays_fast = init_arrays

        def write_index(self) -> None:
            """Note where the messages of every kind are."""
            self.offsets: list[list[int]] = [[] for _ in range(256)]
            self.name_to_id, self.id_to_name = dict[str, int](), dict[int, str]()
            self.sizes = {number: form.len for number, form in self.formats.items()}
            place = 0
            while 0 <= (start := self.data_map.find(HEADER, place)) < self.data_len - len(HEADER):
                self.damaged += start - place
                kind = self.data_map[start + len(HEADER)]
                size = self.sizes.get(kind, 0)
                end, after = start + size, self.data_map.find(HEADER, start + max(size, 1))
                if end > self.data_len and self.data_map.find(HEADER, start + 1) < 0:
                    self.short, place = True, self.data_len
                    break
                # Whole, if another one follows at once; the last one, if none follows at all.
                if size and end <= self.data_len and after in (end, -1):
                    self._index(kind, start)
                    place = end
                else:
                    place = start + len(HEADER)
                    self.damaged += len(HEADER)
            rest = self.data_len - place
            self.damaged += rest if rest >= MOST_PADDING else 0
            self.counts = [*map(len, self.offsets)]
            self._count = sum(self.counts)
            self.offset = 0

        def _index(self, kind: int, start: int) -> None:
            """Note where a message is, and the size and the columns that a format gives a kind."""
            self.offsets[kind].append(start)
            if kind != FORMAT:
                return
            number, size = self.data_map[start + 3 : start + 5]
            before = self.formats.get(number)
            self.offset, self.remaining = start, self.data_len - start
            self._parse_next()
            form = self.formats.get(number)
            whole = form is not None and struct.calcsize(form.msg_struct) + 3 == form.len == size
            # A number keeps its format: another one is that of a number that is damaged.
            if whole and (not before or before.columns == form.columns):
                self.name_to_id[form.name], self.id_to_name[number] = number, form.name
                self.sizes[number] = size
                return
            # Whole logs, too, have formats that do not fit their size: no columns, but a size.
            self.formats.pop(number, None)
            self.formats |= {number: before} if before else {}
            self.sizes.setdefault(number, size)

    def following() -> tuple[str, Mapping[str, Any], Mapping[str, str]] | None:
        """The next message of those that are wanted."""
        try:
            if (message := reader.recv_match(type=[*MESSAGES])) is None:
                return None
            codes = dict(zip(message.fmt.columns, message.fmt.format, strict=False))
            return message.get_type(), message.to_dict(), codes
        except Exception:  # pymavlink raises errors of many kinds for damaged files
            raise refusal(path, DAMAGED) from None

    nowhere = io.StringIO()
    with redirect_stdout(nowhere), redirect_stderr(nowhere):
        reader = Reader(str(path))
        reader.write_index()
        yield from iter(following, None)
        reader.close()
    if reader.damaged:
        share = f"{100.0 * reader.damaged / reader.data_len:.2g} %"
        faults.append(f"has damaged parts: {share} of the file is skipped, and more may be wrong")
    faults += [CUT_OFF] if reader.short else []
