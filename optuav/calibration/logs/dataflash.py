"""Messages of DataFlash files, by pymavlink, also on both sides of damaged parts."""

from __future__ import annotations

import io
import struct
from collections.abc import Iterable, Iterator, Mapping
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any, TypeAlias

from pymavlink.DFReader import DFReader_binary

from optuav.calibration.logs.samples import CUT_OFF
from optuav.mission.files import refusal
from optuav.presentation.numbers import percent

DAMAGED = "is a DataFlash log of ArduPilot that is damaged"
HEADER, FORMAT = b"\xa3\x95", 0x80  # of every message, and the number of those on formats
MOST_PADDING = 528  # bytes after the last message that are no damage, by pymavlink

Message: TypeAlias = tuple[str, Mapping[str, Any], Mapping[str, str]]
"""Kind, values and format codes, both by the names of columns."""


def messages(path: Path, kinds: Iterable[str], faults: list[str]) -> Iterator[Message]:
    """Yield the messages of some kinds in order; add what is wrong with the file to the faults."""
    nowhere, wanted = io.StringIO(), [*kinds]
    with redirect_stdout(nowhere), redirect_stderr(nowhere):
        reader = Reader(str(path))
        reader.write_index()
        while message := _next_message(reader, wanted, path):
            yield message
        reader.close()
    if reader.damaged_bytes:
        share = percent(reader.damaged_bytes / reader.data_len)
        faults.append(f"has damaged parts: {share} of the file is skipped, and more may be wrong")
    faults += [CUT_OFF] if reader.is_cut_off else []


def _next_message(reader: Reader, kinds: list[str], path: Path) -> Message | None:
    """The next message of some kinds; None after the last one."""
    try:
        if (message := reader.recv_match(type=kinds)) is None:
            return None
        codes = dict(zip(message.fmt.columns, message.fmt.format, strict=False))
        return message.get_type(), message.to_dict(), codes
    except Exception:  # pymavlink raises errors of many kinds for damaged files
        raise refusal(path, DAMAGED) from None


class Reader(DFReader_binary):  # type: ignore[misc]
    """A reader whose index goes on after damage, where pymavlink's ends at the first one."""

    damaged_bytes, is_cut_off = 0, False  # bytes that are skipped; whether the last message is

    def init_clock(self) -> None:
        """None: times are those of the messages, and a damaged GPS would stop the reader."""

    def init_arrays(self, progress_callback: object = None) -> None:
        """None: the index is written later, so that its own faults are not named damage."""

    init_arrays_fast = init_arrays

    def write_index(self) -> None:
        """Note where the messages of every kind are."""
        self.offsets: list[list[int]] = [[] for _ in range(256)]
        self.name_to_id, self.id_to_name = dict[str, int](), dict[int, str]()
        self.sizes = {number: form.len for number, form in self.formats.items()}
        place = 0
        while 0 <= (start := self.data_map.find(HEADER, place)) < self.data_len - len(HEADER):
            self.damaged_bytes += start - place
            place = self._note_message(start)
        rest = self.data_len - place
        self.damaged_bytes += rest if rest >= MOST_PADDING else 0
        self.counts = [*map(len, self.offsets)]
        self._count = sum(self.counts)
        self.offset = 0

    def _note_message(self, start: int) -> int:
        """Note the message that begins here if it is whole; where the next may begin."""
        kind = self.data_map[start + len(HEADER)]
        size = self.sizes.get(kind, 0)
        end, after = start + size, self.data_map.find(HEADER, start + max(size, 1))
        if end > self.data_len and self.data_map.find(HEADER, start + 1) < 0:
            self.is_cut_off = True
            return int(self.data_len)
        # Whole, if another one follows at once; the last one, if none follows at all.
        if not size or end > self.data_len or after not in (end, -1):
            self.damaged_bytes += len(HEADER)
            return start + len(HEADER)
        self.offsets[kind].append(start)
        if kind == FORMAT:
            self._note_format(start)
        return int(end)

    def _note_format(self, start: int) -> None:
        """Note the size and the columns that a message gives a kind."""
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
