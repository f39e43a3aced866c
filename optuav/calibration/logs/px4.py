"""ULog files of PX4, by pyulog."""

from __future__ import annotations

import io
import re
import struct
from collections.abc import Iterable, Mapping
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any

import numpy as np

from optuav.arrays import Floats
from optuav.calibration.logs.samples import CUT_OFF, Pack, Readings, Velocity, side_by_side
from optuav.mission.files import refusal
from optuav.presentation.numbers import percent, seconds

INSTALL = 'python -m pip install "optuav[logs]"'
DAMAGED = "is damaged; what could be read is used"
START, HEAD = 16, struct.Struct("<HB")  # first message; size of what follows a head, and kind
KINDS, SUBSCRIBED, DATA = range(ord("A"), ord("Z") + 1), ord("A"), ord("D")
SKIPPED = ord("Z")  # a kind that no writer uses and every reader skips
LARGEST_SKIPPED = 9000  # bytes of a message that pyulog does not take for damage


class Recorded(io.BufferedReader):
    """A file that notes whether it ended within what was last read from it."""

    short = False

    def read(self, size: int | None = -1, /) -> bytes:
        """Read as always, and note whether less was left than is asked for."""
        content = super().read(size)
        # After the last whole message pyulog asks for the 3 bytes of a head and gets none.
        self.short = len(content) < (size or 0) and not (size == 3 and not content)
        return content


def read(path: Path) -> Readings:
    """Samples at the moments of the battery's messages."""
    try:
        from pyulog import ULog
    except ImportError:
        raise refusal(path, f"is a ULog of PX4, which needs pyulog: {INSTALL}") from None
    wanted = ["battery_status", "vehicle_local_position", "vehicle_gps_position", "sensor_gps"]
    wanted += ["actuator_armed", "vehicle_land_detected"]
    content, damaged = _mended(path.read_bytes())
    try:
        nowhere = io.StringIO()
        with (
            Recorded(io.BytesIO(content)) as file,
            redirect_stdout(nowhere),
            redirect_stderr(nowhere),
        ):
            log = ULog(file, wanted)
    except Exception:  # pyulog raises errors of many kinds for damaged files
        raise refusal(path, "is a ULog of PX4 that is damaged or cut off") from None
    warnings = []
    if damaged:
        share = percent(damaged / len(content))
        warnings.append(f"has damaged parts: {share} of the file is skipped, and more may be wrong")
    elif log.file_corruption:
        warnings.append(DAMAGED)
    warnings += [CUT_OFF] if file.short else []
    if lost_s := sum(dropout.duration for dropout in log.dropouts) / 1e3:
        warnings.append(f"the logger dropped out for {seconds(lost_s, 1)} in all")
    messages: dict[str, list[Any]] = {name: [] for name in wanted}
    for of in sorted(log.data_list, key=lambda data: data.multi_id):
        messages[of.name].append({"t": of.data["timestamp"] / 1e6, **of.data})
    if not messages["battery_status"]:
        words = "has no battery_status: PX4 logged no battery"
        raise refusal(path, "; ".join([words, *warnings]))
    packs = [
        Pack(of["t"], _column(of, "current_a"), _column(of, "voltage_v"), _column(of, "remaining"))
        for of in messages["battery_status"]
    ]
    velocity = None
    if found := messages["vehicle_local_position"]:
        velocity = Velocity(found[0]["t"], *(_column(found[0], key) for key in ("vx", "vy", "vz")))
    elif found := [*messages["vehicle_gps_position"], *messages["sensor_gps"]]:
        keys = ("vel_n_m_s", "vel_e_m_s", "vel_d_m_s")
        velocity = Velocity(found[0]["t"], *(_column(found[0], key) for key in keys))
    states = {
        key: (found[0]["t"], found[0][key].astype(int))
        for name, key in (("actuator_armed", "armed"), ("vehicle_land_detected", "landed"))
        if (found := messages[name])
    }
    return Readings(*side_by_side(packs, velocity, states), warnings, bool(warnings))


def _mended(content: bytes) -> tuple[bytes, int]:
    """A log with its damaged parts made messages to skip, so that places stay, and their bytes.

    pyulog believes the size of every message, so one wrong size may cost all that follows. Here a
    message is whole if another one begins at its end; data must be of a subscription that is known,
    and of the size of its first ones.
    """
    sizes, mended, place, damaged = dict[bytes, int](), bytearray(), START, 0

    def end_of(start: int) -> int:
        """The end of the message that begins here; 0 if none does."""
        if start + HEAD.size > len(content):
            return 0
        size, kind = HEAD.unpack_from(content, start)
        body = start + HEAD.size
        wrong = kind == DATA and sizes.get(content[body : body + 2]) not in (0, size)
        return 0 if kind not in KINDS or not size or wrong else body + size

    def whole(start: int) -> int:
        """The end of the message if it is whole, else 0."""
        end, body = end_of(start), start + HEAD.size
        if end and content[start + 2] == SUBSCRIBED:
            sizes.setdefault(content[body + 1 : body + 3], 0)  # of a size that is not known yet
        if not (end == len(content) or (end and end_of(end))):
            return 0
        if content[start + 2] == DATA:
            sizes[content[body : body + 2]] = end - body
        return end

    def places_after(start: int) -> Iterable[int]:
        """Where a message may begin after damage: data only, once sizes of data are known."""
        least = start + HEAD.size + 1
        if not any(sizes.values()):
            return range(least, len(content))
        return (match.start() - 2 for match in re.compile(b"D").finditer(content, least + 2))

    while place < len(content):
        if end := whole(place):
            place = end
            continue
        after = next(filter(whole, places_after(place)), None)
        if after is None:  # The last message, which is cut off
            break
        mended = mended or bytearray(content)
        damaged += after - place
        while place < after:
            left = after - place
            size = left if left <= LARGEST_SKIPPED else min(LARGEST_SKIPPED, left - HEAD.size - 1)
            HEAD.pack_into(mended, place, size - HEAD.size, SKIPPED)
            place += size
    return bytes(mended) if mended else content, damaged


def _column(message: Mapping[str, Any], key: str) -> Floats:
    """A column of a message; NaN where this version of it has none."""
    return np.asarray(message.get(key, np.full(len(message["t"]), np.nan)), dtype=float)
