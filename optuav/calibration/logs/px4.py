"""ULog files of PX4, by pyulog."""

from __future__ import annotations

import io
from collections.abc import Mapping
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any

import numpy as np

from optuav.arrays import Floats
from optuav.calibration.logs.samples import CUT_OFF, Pack, Readings, Velocity, side_by_side
from optuav.mission.files import refusal

INSTALL = 'python -m pip install "optuav[logs]"'
DAMAGED = "is damaged, and parts after the damage may be missing; what could be read is used"


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
    try:
        nowhere = io.StringIO()
        with Recorded(io.FileIO(path)) as file, redirect_stdout(nowhere), redirect_stderr(nowhere):
            log = ULog(file, wanted)
    except Exception:  # pyulog raises errors of many kinds for damaged files
        raise refusal(path, "is a ULog of PX4 that is damaged or cut off") from None
    warnings = [DAMAGED] if log.file_corruption else []
    # A size that is damaged also makes the reader ask for more than there is.
    warnings += [CUT_OFF] if file.short and not log.file_corruption else []
    if lost_s := sum(dropout.duration for dropout in log.dropouts) / 1e3:
        warnings.append(f"the logger dropped out for {lost_s:.1f} s in all")
    messages: dict[str, list[Any]] = {name: [] for name in wanted}
    for of in sorted(log.data_list, key=lambda data: data.multi_id):
        messages[of.name].append({"t": of.data["timestamp"] / 1e6, **of.data})
    if not messages["battery_status"]:
        raise refusal(path, "has no battery_status: PX4 logged no battery")
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
    return Readings(*side_by_side(packs, velocity, states), warnings, log.file_corruption)


def _column(message: Mapping[str, Any], key: str) -> Floats:
    """A column of a message; NaN where this version of it has none."""
    return np.asarray(message.get(key, np.full(len(message["t"]), np.nan)), dtype=float)
