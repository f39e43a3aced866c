"""The trace of a simulated plan: a table over time, and events at their moments."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from optuav.arrays import Floats, Integers
from optuav.errors import for_console
from optuav.frames import DataFrame, frame, without_rounding
from optuav.presentation.numbers import figure, seconds, with_unit

Texts = npt.NDArray[np.str_]
APART = ("time_s", "position_m", "available_As", "bound_As", "soc")
"""Fields of a trace that are not columns of its table as they are."""
STATED = "mismatch", "state of charge", "below reserve"
"""Kinds of events whose words state value and limit."""


@dataclass(frozen=True)
class FlightEvent:
    """Something that happens during a mission, or that a plan gets wrong.

    Parameters
    ----------
    kind
        Of a violation ``"empty"``, ``"full"``, ``"deadline"``, ``"state of charge"``,
        ``"altitude"``, ``"coverage"``, ``"building"``, ``"clearance"``, ``"speed"``, ``"ends"``,
        ``"no roof"``, ``"impossible"``, ``"mismatch"``, ``"no plan"``, or with several devices
        ``"device"``, ``"share"`` or ``"rests"``; of other events ``"no sight"``,
        ``"below reserve"``, ``"peak speed"``, ``"no drag"``, ``"stated"``, ``"unknown"`` (buildings
        of a table that is not here), ``"pack empty"`` or ``"pack full"``.
    time_s, words
        Moment, counted from take-off [s], and what happens, for a person.
    value, limit, unit, value_s
        The figure, the limit that it breaks and the unit of both; the moment of the figure [s]
        where that differs from `time_s`. None if missing.
    violation
        Whether the plan cannot be flown because of it.

    Examples
    --------
    >>> import optuav
    >>> (event,) = optuav.replay(optuav.solve("paper", "P3", perspective="battery")).violations
    >>> event.kind, round(event.time_s, 1), event.words
    ('empty', 660.3, 'the available well runs dry')
    """

    kind: str
    time_s: float
    words: str
    value: float | None = None
    limit: float | None = None
    unit: str = ""
    violation: bool = True
    value_s: float | None = None

    @for_console
    def __str__(self) -> str:
        return f"{seconds(self.time_s):>12}  {self.words}{self.value_and_limit}"

    @property
    def value_and_limit(self) -> str:
        """Value and limit as text; empty without a value, and where the words state them."""
        if self.value is None or self.kind in STATED:
            return ""
        if self.limit is None:
            return f": {with_unit(self.value, self.unit)}"
        when = "" if self.value_s is None else f" at {seconds(self.value_s)}"
        sense = "at least" if self.value < self.limit else "at most"
        return f": {figure(self.value)}{when}, {sense} {with_unit(self.limit, self.unit)}"


@dataclass(frozen=True)
class Trace:
    """A mission over time: arrays with one entry per moment, both ends of each stage among them.

    Parameters
    ----------
    time_s
        Since take-off [s], never falling; two equal moments part a stage from the next.
    position_m, speed_m_s
        (moment, 3) [m], and along the path [m/s]: the rate of change of the position.
    pitch_rad, roll_rad
        Attitude [rad]; NaN where the flight model has none.
    kind, stage, phase, start_place, end_place
        ``"flight"``, ``"hover"`` or ``"rest"``; the stage of a leg; number of the phase, from 0;
        names of places.
    current_A, power_W, received_power_W, voltage_V
        Net, into the battery [A], [W]; the power from the laser [W]; the voltage that the
        current is drawn at [V], the nominal one where none is.
    available_As, bound_As, soc
        (moment, pack) charge in the wells [A s], pooled packs count as one; state of charge by
        perspective [-].

    Examples
    --------
    >>> import optuav
    >>> trace = optuav.replay(optuav.solve("paper", "P3")).trace
    >>> len(trace), trace.position_m.shape, round(float(trace.speed_m_s.max()), 1)
    (715, (715, 3), 154.9)
    """

    time_s: Floats
    position_m: Floats
    speed_m_s: Floats
    pitch_rad: Floats
    roll_rad: Floats
    kind: Texts
    stage: Texts
    phase: Integers
    start_place: Texts
    end_place: Texts
    current_A: Floats
    power_W: Floats
    received_power_W: Floats
    voltage_V: Floats
    available_As: Floats
    bound_As: Floats
    soc: Mapping[str, Floats]

    def __len__(self) -> int:
        return len(self.time_s)

    def to_frame(self) -> DataFrame:
        """One row per moment; needs pandas (``python -m pip install pandas``).

        Columns are the fields, vectors by component: ``x_m``, ``y_m``, ``z_m``, the wells summed
        over the packs as ``available_As`` and ``bound_As``, where there are several also
        ``available_1_As`` and so on, and ``soc_battery``, ``soc_energy``, ``soc_adjusted``.
        Rounding is shown as 0: numbers below 1e-9 of the largest of their column, or of 1.
        """
        columns: dict[str, npt.NDArray[np.generic]] = {"time_s": self.time_s}
        columns |= dict(zip(("x_m", "y_m", "z_m"), self.position_m.T, strict=True))
        columns |= {
            name: getattr(self, name) for name in self.__dataclass_fields__ if name not in APART
        }
        for name in ("available", "bound"):
            wells = without_rounding(getattr(self, f"{name}_As"), self.bound_As[0].sum())
            columns[f"{name}_As"] = wells.sum(axis=1)
            if wells.shape[1] > 1:
                columns |= {f"{name}_{k}_As": well for k, well in enumerate(wells.T, start=1)}
        columns |= {f"soc_{name}": level for name, level in self.soc.items()}
        for name, column in columns.items():
            if column.dtype.kind == "f":
                size = np.nanmax(np.abs(column), initial=1.0)
                columns[name] = without_rounding(column, float(size))
        return frame(columns)
