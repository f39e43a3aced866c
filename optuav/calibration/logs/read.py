"""Flight logs of PX4, ArduPilot and DJI, recognised by their content.

Formats: ULog 1 (PX4), DataFlash (ArduPilot), and CSV as AirData and programs that decode DJI's
records write it. Speeds in all of these are over the ground.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from optuav.calibration.logs import ardupilot, csv_of_others, px4
from optuav.calibration.logs.flight_log import FlightLog, flight_log
from optuav.errors import Fault, InputError
from optuav.mission.files import STANDARD, label, opened, refusal
from optuav.mission.formats import named

LARGEST_LOG = 1_000_000_000  # bytes
ULOG, DATAFLASH = b"ULog\x01\x12\x35", b"\xa3\x95\x80"
OF_LOGS = "a log is a ULog (.ulg), a DataFlash (.bin) or a CSV"


def flight_log_in(path: Path, columns: Mapping[str, str]) -> FlightLog | None:
    """The flight log in a file; None if the file is a CSV with the headings of optuav."""
    if path == STANDARD:
        return None
    with opened(path, LARGEST_LOG) as file:
        head = file.read(4096)
    if head.startswith(ULOG):
        if columns:
            raise _no_columns(path)
        return flight_log(path, "ULog of PX4", px4.read(path))
    if head.startswith(DATAFLASH):
        if columns:
            raise _no_columns(path)
        return flight_log(path, "DataFlash log of ArduPilot", ardupilot.read(path))
    if what := named(head):
        advice = what.advice or OF_LOGS
        raise refusal(path, f"is {what.name}; {advice}")
    if path.suffix.lower() == ".txt" and path.stem.startswith("DJIFlightRecord"):
        words = "is a record of DJI in its own code; AirData and other programs make a CSV of it"
        raise refusal(path, words)
    if b"\0" in head:
        raise refusal(path, f"is not text and of no known format; {OF_LOGS}")
    if (readings := csv_of_others.read(path, columns)) is None:
        return None
    return flight_log(path, "CSV" if columns else "CSV of AirData or DJI", readings)


def _no_columns(path: Path) -> InputError:
    return InputError([Fault("columns", "", "goes with a CSV file", label(path))])
