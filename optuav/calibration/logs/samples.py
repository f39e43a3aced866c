"""Samples of a flight log, from what the messages of its batteries, its velocity and states say."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from optuav.arrays import Booleans, Floats

SAME_VOLTAGE = 0.1  # relative difference of the voltages of packs side by side
CUT_OFF = "is cut off; what could be read is used"


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


class Readings(NamedTuple):
    """Content of a log file: samples, packs whose currents are added, and sentences on both.

    In a file that is damaged any value may be wrong.
    """

    samples: Columns
    packs: int
    notes: Sequence[str]
    warnings: Sequence[str]
    damaged: bool = False


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


def in_order(time_s: Floats) -> Booleans:
    """The longest series of rows that are each later than the one before.

    So a time that is damaged costs its own row, and none of those after it.
    """
    chosen = np.ones(len(time_s), bool)
    if np.all(np.diff(time_s) > 0.0):
        return chosen
    # The last time of the best series of each length, its row, and the row before every row
    ends_s, rows, before = list[float](), list[int](), list[int]()
    for row, now_s in enumerate(time_s.tolist()):
        length = bisect_left(ends_s, now_s)
        before.append(rows[length - 1] if length else -1)
        if length == len(ends_s):
            ends_s.append(now_s)
            rows.append(row)
        elif now_s < ends_s[length]:
            ends_s[length], rows[length] = now_s, row
    chosen[:] = False
    row = rows[-1]
    while row >= 0:
        chosen[row] = True
        row = before[row]
    return chosen


def side_by_side(
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
            rows = in_order(other.time_s)
            current_A += np.interp(time_s, other.time_s[rows], other.current_A[rows])
            count += 1
    if count > 1:
        notes.append(f"the current is that of {count} batteries side by side")
    unknown = np.full(len(time_s), np.nan)
    speed_m_s = climb_m_s = unknown
    if velocity is not None:
        rows = in_order(velocity.time_s)
        at_s, *ways = (values[rows] for values in velocity)
        north, east, down = (np.interp(time_s, at_s, way) for way in ways)
        speed_m_s, climb_m_s = np.hypot(north, east), -down
    held = dict[str, npt.NDArray[np.int_]]()
    for key in ("armed", "landed"):
        held[key] = np.full(len(time_s), -1)
        if key in states:
            changes_s, values = states[key]
            rows = in_order(changes_s)
            before = np.searchsorted(changes_s[rows], time_s, side="right") - 1
            held[key] = values[rows][np.maximum(before, 0)]
    series = (time_s, current_A, first.voltage_V, speed_m_s, climb_m_s, first.charge)
    return Columns(*series, held["armed"], held["landed"]), count, notes
