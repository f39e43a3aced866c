"""Flight logs from files: what is drawn over time, and what the UAV does meanwhile."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from optuav.arrays import Floats
from optuav.calibration.data import Column, Table, check_record, read
from optuav.errors import Fault, InputError
from optuav.mission.words import nearest

COLUMNS = (
    Column("time", "time"),
    Column("current", "current"),
    Column("voltage", "voltage", needed=False),
    Column("power", "power", needed=False),
    Column("speed", "speed", needed=False),
    Column("phase", "text", needed=False),
)
PHASES = ("flight", "hover", "rest", "charge", "other")
"""What the column ``phase`` may say; "charge" is a rest in the laser's light."""
LEAST_SAMPLES = 10
STILL_m_s = 1.0
"""Speed below which an airborne UAV hovers, where the log has no phases."""
IDLE = 0.1
"""Share of the median current of all samples in the air below which the rotors stand."""


@dataclass(frozen=True)
class Log:
    """A flight log: arrays with one entry a sample, SI units.

    Parameters
    ----------
    time_s, current_A, power_W
        When, and what is drawn; positive while discharging.
    speed_m_s
        Or None.
    phase
        One of `PHASES` a sample.
    """

    time_s: Floats
    current_A: Floats
    power_W: Floats
    speed_m_s: Floats | None
    phase: npt.NDArray[np.str_]


def read_log(path: Path) -> Log:
    """The log in a CSV file.

    Raises
    ------
    InputError
        With every fault of the file.
    """
    table = read(path, COLUMNS, LEAST_SAMPLES)
    check_record(table)
    numbers, faults = table.numbers, list[Fault]()
    if ("voltage" in numbers) == ("power" in numbers):
        words = "one of the columns voltage and power, with their units"
        faults.append(Fault("", "", words, table.source))
    if "speed" not in numbers and "phase" not in table.texts:
        words = "a column phase, or one of speed with its unit, to tell flight from hover"
        faults.append(Fault("", "", words, table.source))
    faults += _faults_of_cells(table)
    if faults:
        raise InputError(faults)
    current_A, speed_m_s = numbers["current"], numbers.get("speed")
    power_W = numbers["power"] if "power" in numbers else current_A * numbers["voltage"]
    if "phase" in table.texts:
        phase = np.array(table.texts["phase"])
    else:
        assert speed_m_s is not None
        idle = current_A < IDLE * np.median(current_A[current_A > 0.0])
        phase = np.where(idle, "rest", np.where(speed_m_s < STILL_m_s, "hover", "flight"))
    return Log(numbers["time"], current_A, power_W, speed_m_s, phase)


def _faults_of_cells(table: Table) -> Iterator[Fault]:
    for row, phase in enumerate(table.texts.get("phase", ())):
        if phase not in PHASES:
            yield table.fault(row, "phase", phase, f"{', '.join(PHASES)}{nearest(phase, PHASES)}")
    for name, values in table.numbers.items():
        if name == "speed":
            yield from table.faults(values < 0.0, name, "0 or above")
        if name == "voltage":
            yield from table.faults(values <= 0.0, name, "above 0")
    if not np.max(table.numbers["current"]) > 0.0:
        largest = float(np.max(table.numbers["current"]))
        yield table.fault(0, "current", largest, "some current above 0: positive is discharge")
