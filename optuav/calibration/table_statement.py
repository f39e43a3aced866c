"""A table of results as a file states it: how each row was flown, what is known, what is free."""

from __future__ import annotations

import math
import tomllib
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from optuav.calibration.flown import QUANTITIES, STAY
from optuav.errors import Fault, InputError
from optuav.mission import Mission, load, shipped
from optuav.mission.files import label, read_text, refusal
from optuav.mission.words import nearest, number, shown
from optuav.network.routes import ORDERS

LARGEST_FILE = 2_000_000
WITHOUT_LASER = ("laser", "flight.charge_current_A", "flight.charge_power_W")
TOP = ("mission", "known", "tied", "free", "resolution", "rows")


@dataclass(frozen=True)
class Cell:
    """A number of the table."""

    row: str
    quantity: str
    observed: float
    resolution: float
    fits: bool


@dataclass(frozen=True)
class Row:
    """A row of the table: how it was flown, changed keys of the mission, and what it tells."""

    name: str
    stay: Mapping[str, Any]
    changes: Mapping[str, Any]
    cells: tuple[Cell, ...]


@dataclass(frozen=True)
class Statement:
    """A table with what is known and what is free.

    Parameters
    ----------
    source
        The file, fit to print.
    mission
        With everything that is known, the free keys at their starting values.
    base
        Name or path of the mission that was extended, and the keys that were stated on top of it.
    free
        Starting value by key.
    tied
        Keys that are the product of others.
    """

    source: str
    mission: Mission
    base: str
    known: Mapping[str, Any]
    free: Mapping[str, float]
    tied: Mapping[str, tuple[str, ...]]
    rows: tuple[Row, ...]

    def with_values(self, values: Iterable[float]) -> Mission:
        """The mission with other values of the free keys."""
        return tie(self.mission.replace(dict(zip(self.free, values, strict=True))), self.tied)


def value_of(mission: Mission, key: str) -> Any:
    """The value of a dotted key."""
    table, _, name = key.partition(".")
    return getattr(getattr(mission, table, None), name, None)


def tie(mission: Mission, tied: Mapping[str, tuple[str, ...]]) -> Mission:
    """The mission with its tied keys at the product of theirs."""
    factors = {key: [value_of(mission, each) for each in names] for key, names in tied.items()}
    products = {key: math.prod(each) for key, each in factors.items() if None not in each}
    return mission.replace(products) if products else mission


def read_statement(path: Path) -> Statement:
    """The file, with every fault of it at once."""
    try:
        document = tomllib.loads(read_text(path, LARGEST_FILE))
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise refusal(path, f"is not TOML: {error}") from None
    return _Reader(label(path), path.parent, document).statement()


class _Reader:
    """Reads a statement and gathers its faults."""

    def __init__(self, source: str, directory: Path, document: dict[str, Any]) -> None:
        self.source, self.directory, self.document = source, directory, document
        self.faults: list[Fault] = []
        self.unresolved = Counter[str]()

    def fault(self, key: str, value: object, allowed: str) -> None:
        self.faults.append(Fault(key, "" if value is None else shown(value), allowed, self.source))

    def statement(self) -> Statement:
        for key in self.document.keys() - set(TOP):
            self.fault(key, None, f"unknown key{nearest(key, TOP)}; known are {', '.join(TOP)}")
        known, free = _flat(self.table("known")), self.free()
        tied, resolution = self.tied(), self.resolution("resolution", self.table("resolution"))
        rows = self.rows(resolution)
        base, place = self.base()
        keys = {**known, **free, **dict.fromkeys(tied, 1.0)}
        mission = None if base is None else self.mission(base, keys, tied)
        if base is not None:
            for index, row in enumerate(rows):
                self.try_row(f"rows[{index}].given", row, mission, base, keys)
        cells = [cell for row in rows for cell in row.cells if cell.fits]
        if len(cells) < len(free):
            words = f"as many numbers to fit as free keys: {len(free)}; there are {len(cells)}"
            self.fault("rows", None, words)
        for quantity, count in self.unresolved.items():
            words = "the step to which the table is rounded, above 0"
            self.fault(f"resolution.{quantity}", None, f"{words}, for {_numbers(count)}")
        if self.faults or mission is None:
            raise InputError(self.faults)
        return Statement(self.source, mission, place, known, free, tied, tuple(rows))

    def try_row(
        self, where: str, row: Row, mission: Mission | None, base: Mission, keys: Mapping[str, Any]
    ) -> None:
        """Tell of keys and a building of a row that the mission does not have.

        Where the mission itself has faults, the row is tried on what was extended, and of the
        faults those of its own keys are told.
        """
        flown: Mission | None = None
        try:
            if mission is None:
                base.replace({**keys, **row.changes})
            else:
                flown = mission.replace(row.changes)
        except InputError as error:
            self.faults += [
                Fault(f"{where}.{fault.key}", fault.value, fault.allowed, self.source)
                for fault in error.faults
                if mission is not None or fault.key in row.changes
            ]
        if flown is None and any(key.startswith("buildings") for key in (*keys, *row.changes)):
            return
        names = [building.name for building in (flown or base).buildings]
        if row.stay["building"] and row.stay["building"] not in names:
            words = f"a building of the mission{nearest(str(row.stay['building']), names)}"
            self.fault(f"{where}.building", row.stay["building"], words)

    def table(self, name: str) -> dict[str, Any]:
        value = self.document.get(name, {})
        if not isinstance(value, dict):
            self.fault(name, value, f"a table [{name}]")
            return {}
        return value

    def number(self, key: str, value: object, *, positive: bool = False) -> bool:
        if isinstance(value, int | float) and not isinstance(value, bool):
            sound = math.isfinite(value) and (value > 0.0 or not positive)
        else:
            sound = False
        if not sound:
            self.fault(key, value, "a number above 0" if positive else "a finite number")
        return sound

    def free(self) -> dict[str, float]:
        found = _flat(self.table("free"))
        if not found:
            self.fault("free", None, "a table of keys to be fitted, with values to start from")
        free = {}
        for key, value in found.items():
            allowed = number(key)
            if allowed is not None and allowed.whole:
                words = "a key that may have any value in its range; whole numbers cannot be fitted"
                self.fault(f"free.{key}", value, words)
            elif self.number(f"free.{key}", value, positive=True):
                free[key] = float(value)
        return free

    def tied(self) -> dict[str, tuple[str, ...]]:
        found = {}
        for key, names in _flat(self.table("tied")).items():
            if isinstance(names, list) and names and all(isinstance(each, str) for each in names):
                found[key] = tuple(names)
                for each in names:
                    if number(each) is None:
                        self.fault(f"tied.{key}", each, "products of keys that are numbers")
            else:
                self.fault(f"tied.{key}", names, "a list of the keys whose product it is")
        return found

    def resolution(self, where: str, steps: Mapping[str, Any]) -> dict[str, float]:
        for key in steps.keys() - QUANTITIES.keys():
            self.fault(f"{where}.{key}", None, _unknown_quantity(key))
        return {
            key: float(value)
            for key, value in steps.items()
            if key in QUANTITIES and self.number(f"{where}.{key}", value, positive=True)
        }

    def rows(self, resolution: Mapping[str, float]) -> list[Row]:
        rows = self.document.get("rows")
        if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
            self.fault("rows", None, "tables [[rows]] with name, given, fit, check")
            return []
        return [self.row(f"rows[{n}]", row, resolution) for n, row in enumerate(rows)]

    def row(self, where: str, row: dict[str, Any], resolution: Mapping[str, float]) -> Row:
        parts = ("name", "given", "fit", "check", "resolution")
        for key in row.keys() - set(parts):
            self.fault(f"{where}.{key}", None, f"unknown key{nearest(key, parts)}")
        for key in parts[1:]:
            if not isinstance(row.get(key, {}), dict):
                self.fault(f"{where}.{key}", row[key], "a table")
        name = str(row.get("name", where))
        tables = {key: row[key] if isinstance(row.get(key), dict) else {} for key in parts[1:]}
        resolution = {**resolution, **self.resolution(f"{where}.resolution", tables["resolution"])}
        cells = []
        for key in ("fit", "check"):
            for quantity, value in tables[key].items():
                if quantity not in QUANTITIES:
                    self.fault(f"{where}.{key}.{quantity}", None, _unknown_quantity(quantity))
                elif self.number(f"{where}.{key}.{quantity}", value):
                    if quantity not in resolution:
                        self.unresolved[quantity] += 1
                    step = resolution.get(quantity, 1.0)
                    cells.append(Cell(name, quantity, float(value), step, key == "fit"))
        stay = {**STAY, **{key: tables["given"][key] for key in STAY if key in tables["given"]}}
        self.check_stay(f"{where}.given", stay)
        changes = {key: tables["given"][key] for key in tables["given"] if key not in STAY}
        if stay["laser"] is False:
            changes |= dict.fromkeys(WITHOUT_LASER)
        return Row(name, stay, _flat(changes), tuple(cells))

    def check_stay(self, where: str, stay: Mapping[str, Any]) -> None:
        for key in ("hover_time_s", "rest_time_s"):
            if self.number(f"{where}.{key}", stay[key]) and stay[key] < 0.0:
                self.fault(f"{where}.{key}", stay[key], "0 or above [s]")
        if stay["order"] not in ORDERS:
            self.fault(f"{where}.order", stay["order"], " or ".join(ORDERS))
        if not isinstance(stay["laser"], bool):
            self.fault(f"{where}.laser", stay["laser"], "true or false")
        if stay["rest_time_s"] and not stay["building"]:
            self.fault(f"{where}.building", None, "where it rested")

    def base(self) -> tuple[Mission | None, str]:
        """The mission that is extended, and its name or path."""
        name = self.document.get("mission", "paper")
        if not isinstance(name, str):
            self.fault("mission", name, "a shipped mission's name or a path relative to this file")
            return None, ""
        place = name if name in shipped() else str(self.directory / name)
        try:
            return load(place), place
        except InputError as error:
            self.faults += error.faults
            return None, place

    def mission(
        self, base: Mission, keys: Mapping[str, Any], tied: Mapping[str, tuple[str, ...]]
    ) -> Mission | None:
        """With all that is stated."""
        try:
            return tie(base.replace(keys), tied)
        except InputError as error:
            self.faults += [
                Fault(each.key, each.value, each.allowed, each.source or self.source)
                for each in error.faults
            ]
            return None


def _unknown_quantity(name: str) -> str:
    return f"unknown quantity{nearest(name, QUANTITIES)}; known are {', '.join(QUANTITIES)}"


def _numbers(count: int) -> str:
    return f"{count} number{'s' * (count > 1)}"


def _flat(table: Mapping[str, Any], before: str = "") -> dict[str, Any]:
    """Tables within tables as dotted keys."""
    found: dict[str, Any] = {}
    for key, value in table.items():
        if isinstance(value, dict):
            found |= _flat(value, f"{before}{key}.")
        else:
            found[f"{before}{key}"] = value
    return found
