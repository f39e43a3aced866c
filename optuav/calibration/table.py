"""Keys of a mission from a table of results: some are known, the others are fitted.

Each row of the table is a mission flown: a hover and a rest of known length on a known route. Its
flight time and the charge and energy that are left follow from the mission by the same phases as
those of a plan; the free keys are fitted to some of the table's numbers. A number that is stated as
a check is predicted only, or repeats one that was fitted: then it tests nothing.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import compress
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias, TypeGuard

import numpy as np

from optuav.arrays import Floats
from optuav.calibration.fit import (
    Fit,
    Panel,
    Role,
    counted,
    rounded,
    undetermined,
    values_of,
)
from optuav.calibration.least_squares import estimate
from optuav.errors import Fault, InputError
from optuav.mission import Mission, load, shipped
from optuav.mission.files import label, read_toml
from optuav.mission.messages import nearest, number, shown
from optuav.network import vehicle
from optuav.network.network import Network, build_network
from optuav.network.timeline import route_phases
from optuav.options import ORDERS

Entries: TypeAlias = dict[str, Any]
"""A table of a TOML file, whose values are checked by rules."""

QUANTITIES = {
    "flight_time_s": "s",
    "mission_time_s": "s",
    "battery_percent": "%",
    "energy_percent": "%",
    "adjusted_percent": "%",
    "flight_voltage_V": "V",
    "hover_voltage_V": "V",
}
"""Quantities of a row with their units: times, what is left by perspective, mean voltages."""
LARGEST_FILE = 2_000_000
ROUNDING = 1.0 / math.sqrt(12.0)  # standard deviation of its error, in steps
IMPOSSIBLE = 1e9  # residual where a row cannot be flown, or no mission may have the values
EDGE = 1e-3  # relative distance from a value within which an edge has shaped it
DIGITS = 6  # decimals in which a repeated number is the same
SCALES = (1.0, 0.5, 2.0)  # where the fit starts, as multiples of the stated values
WITHOUT_LASER = ("laser", "flight.charge_current_A", "flight.charge_power_W")


class TableNumber(NamedTuple):
    """A number of the table, and whether it is to be fitted."""

    row: str
    quantity: str
    observed: float
    resolution: float
    fits: bool


class FlownRow(NamedTuple):
    """How a row was flown: its stay, and changed keys of the mission; and its numbers."""

    hover_time_s: float
    rest_time_s: float
    building: str
    order: str
    changes: Mapping[str, object]
    numbers: tuple[TableNumber, ...]


class ResultsTable(NamedTuple):
    """A table of results with what is known and what is free."""

    source: str
    mission: Mission  # with everything that is known, the free keys at their starting values
    base: str  # name or path of the mission that was extended
    known: Mapping[str, object]
    free: Mapping[str, float]
    tied: Mapping[str, tuple[str, ...]]  # keys that are products of others
    rows: tuple[FlownRow, ...]

    @property
    def numbers(self) -> tuple[TableNumber, ...]:
        """The numbers of all rows."""
        return tuple(each for row in self.rows for each in row.numbers)

    def with_values(self, values: Iterable[float]) -> Mission:
        """The mission with other values of the free keys."""
        return tie(self.mission.replace(dict(zip(self.free, values, strict=True))), self.tied)

    def computed(self, mission: Mission) -> Floats:
        """The numbers of the table as they follow from a mission."""
        networks, found = dict[str, Network](), list[float]()
        for row in self.rows:
            changes = repr(row.changes)
            if changes not in networks:
                changed = mission.replace(row.changes) if row.changes else mission
                networks[changes] = build_network(tie(changed, self.tied))
            values = quantities(networks[changes], row)
            found += [values[each.quantity] for each in row.numbers]
        return np.array(found)

    def tried(self, values: Floats) -> Floats:
        """The numbers of the table with values that perhaps no mission may have; NaN then."""
        try:
            return self.computed(self.with_values(values.tolist()))
        except InputError:
            return np.full(len(self.numbers), math.nan)


def fit_table(files: Iterable[str | Path]) -> Fit:
    """Fit keys of a mission to a table of results.

    Parameters
    ----------
    files
        One TOML file: ``mission`` (what is known, a shipped name or a path relative to the file),
        ``[known]`` (keys that differ), ``[free]`` (keys to be fitted with a value to start from),
        ``[tied]`` (keys that are products of others), ``[resolution]`` (by quantity, the step to
        which the table is rounded), and ``[[rows]]`` with ``name``, ``given`` (hover_time_s,
        rest_time_s, building, order, laser, or keys of the mission), ``fit`` and ``check``
        (numbers by quantity: ``flight_time_s``, ``mission_time_s``, ``battery_percent``,
        ``energy_percent``, ``adjusted_percent``, ``flight_voltage_V``, ``hover_voltage_V``).

    Returns
    -------
    Fit
        Intervals follow from the resolution, and from the residuals where those are larger. With
        warnings where the values do not meet the table, or a key has run to an edge beyond which
        no mission can be flown.

    Raises
    ------
    InputError
        With every fault of the file, if it has fewer numbers to fit than free keys, or if a row
        cannot be flown with the values found.

    Examples
    --------
    >>> import optuav, pathlib, tempfile
    >>> text = '''
    ... free.battery.capacity_As = 30000
    ... resolution.battery_percent = 0.01
    ... rows = [{ given.hover_time_s = 600, fit.battery_percent = 20 }]
    ... '''
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = pathlib.Path(folder) / "table.toml"
    ...     _ = file.write_text(text)
    ...     fit = optuav.fit_table([file])
    >>> fit.data
    '1 number of the table fitted by 1 free key, 0 predicted'
    """
    paths = [Path(file) for file in files]
    if len(paths) != 1:
        raise InputError("one file that states the table, what is known and what is free")
    table = read_table(paths[0])
    fits = np.array([each.fits for each in table.numbers])
    observed = np.array([each.observed for each in table.numbers])
    steps = ROUNDING * np.array([each.resolution for each in table.numbers])

    def residuals(values: Floats) -> Floats:
        left: Floats = ((table.tried(values) - observed) / steps)[fits]
        return np.nan_to_num(left, nan=IMPOSSIBLE)

    keys, count = tuple(table.free), int(fits.sum())
    starts = [tuple(scale * each for each in table.free.values()) for scale in SCALES]
    found = estimate(keys, residuals, starts, spread=1.0)
    mission = table.with_values(found.values.tolist())
    computed = table.computed(mission).tolist()
    pairs = list(zip(table.numbers, computed, strict=True))
    if unflown := {each.row for each, value in pairs if not math.isfinite(value)}:
        words = "a row that can be flown; none of the values tried can: start from others in [free]"
        raise InputError(
            Fault("rows", shown(name), words, table.source) for name in sorted(unflown)
        )
    roles, again = _roles(pairs)
    products = {
        key: rounded(value_of(mission, key))
        for key, factors in table.tied.items()
        if not set(factors) & set(found.undetermined)
    }
    fitted = counted(count, "number")
    repeated = f", {roles.count('repeat')} repeated" if "repeat" in roles else ""
    return Fit(
        "table",
        (str(paths[0]),),
        f"{fitted} of the table fitted by {counted(len(keys), 'free key')}{repeated}, "
        f"{roles.count('predicted')} predicted",
        values_of(found, keys, f"fitted to {fitted} of the table"),
        tuple(_panels(pairs, roles)),
        (*undetermined(found), *_missed(pairs), *again, *_at_an_edge(table, found.values)),
        settings={**table.known, **products},
        extends=table.base,
    )


def quantities(flown: Network, row: FlownRow) -> dict[str, float]:
    """Each of `QUANTITIES` for a row."""
    mission, names = flown.mission, [building.name for building in flown.mission.buildings]
    itinerary = 0
    if row.building:
        itinerary = 1 + 2 * names.index(row.building) + ORDERS.index(row.order)
    given, hover = mission.battery, vehicle.hover_load(mission)
    capacity_As = float(vehicle.pool(mission).capacity_As)
    nominal_J = capacity_As * given.nominal_voltage_V
    charge_As: dict[str, float] = {"flight": 0.0, "hover": 0.0, "rest": 0.0}
    energy_J, flight_s = dict(charge_As), 0.0
    for phase in route_phases(flown, itinerary, row.hover_time_s, row.rest_time_s):
        charge_As[phase.kind] += float(phase.charge_As)
        energy_J[phase.kind] += float(phase.energy_J)
        flight_s += float(phase.duration_s) if phase.kind == "flight" else 0.0
    flight_V, hover_V = energy_J["flight"] / charge_As["flight"], hover.power_W / hover.current_A
    hovering_J = hover.power_W * row.hover_time_s
    adjusted = (
        energy_J["flight"] / (given.flight_energy_J or capacity_As * flight_V)
        - hovering_J / (given.hover_energy_J or capacity_As * hover_V)
        + (energy_J["hover"] + hovering_J + energy_J["rest"]) / nominal_J
    )
    return {
        "flight_time_s": flight_s,
        "mission_time_s": flight_s + row.hover_time_s + row.rest_time_s,
        "battery_percent": 100.0 * (1.0 + sum(charge_As.values()) / capacity_As),
        "energy_percent": 100.0 * (1.0 + sum(energy_J.values()) / nominal_J),
        "adjusted_percent": 100.0 * (1.0 + adjusted),
        "flight_voltage_V": flight_V,
        "hover_voltage_V": hover_V,
    }


def value_of(mission: Mission, key: str) -> Any:
    """The value of a dotted key; None where the mission has none."""
    table, _, name = key.partition(".")
    return getattr(getattr(mission, table, None), name, None)


def tie(mission: Mission, tied: Mapping[str, tuple[str, ...]]) -> Mission:
    """The mission with its tied keys at the product of theirs."""
    factors = {key: [value_of(mission, each) for each in names] for key, names in tied.items()}
    products = {key: math.prod(each) for key, each in factors.items() if None not in each}
    return mission.replace(products) if products else mission


def _roles(pairs: Sequence[tuple[TableNumber, float]]) -> tuple[list[Role], list[str]]:
    """Whether each number is fitted, predicted, or repeats one that is fitted; and a warning."""
    keys = [(each.quantity, each.observed, round(value, DIGITS)) for each, value in pairs]
    fits = [each.fits for each, _ in pairs]
    fitted = set(compress(keys, fits))
    roles: list[Role] = [
        "fitted" if fit else "repeat" if key in fitted else "predicted"
        for key, fit in zip(keys, fits, strict=True)
    ]
    again = sum(fits) - len(fitted)
    words = (
        f"{counted(again, 'number')} to be fitted repeat{'s' * (again == 1)} another: state it as "
        "a check, or the intervals are too narrow"
    )
    return roles, [words] * bool(again)


def _missed(pairs: Sequence[tuple[TableNumber, float]]) -> Iterator[str]:
    """A warning if the values do not meet the table."""
    fitted = [(value - each.observed, each) for each, value in pairs if each.fits]
    steps = [abs(difference) / each.resolution for difference, each in fitted]
    missed = sum(each > 1.0 for each in steps)
    if missed:
        difference, worst = fitted[int(np.argmax(steps))]
        yield (
            f"the values do not meet the table: {missed} of {len(fitted)} numbers are missed by "
            f"more than their rounding, {worst.quantity} of {worst.row} by {difference:+.3g}"
        )


def _at_an_edge(table: ResultsTable, values: Floats) -> Iterator[str]:
    """A warning for each key that the fit has driven to where no mission can be flown."""
    for place, key in enumerate(table.free):
        for words, factor in (("less", 1.0 - EDGE), ("more", 1.0 + EDGE)):
            beyond = values.copy()
            beyond[place] *= factor
            if not np.isfinite(table.tried(beyond)).all():
                yield (
                    f"{key.rpartition('.')[2]} is at an edge: with a thousandth {words} of it the "
                    "rows cannot be flown, or it is out of its range"
                )


def _panels(pairs: Sequence[tuple[TableNumber, float]], roles: Sequence[Role]) -> Iterator[Panel]:
    for quantity, unit in QUANTITIES.items():
        own = [
            (each.observed, value, each.row, role)
            for (each, value), role in zip(pairs, roles, strict=True)
            if each.quantity == quantity
        ]
        if own:
            observed, computed, names, kinds = zip(*own, strict=True)
            words = quantity.rpartition("_")[0].replace("_", " ")
            yield Panel(words, unit, observed, computed, names, roles=kinds)


class Rule(NamedTuple):
    """What a value of the file may be, in words, and whether a value is such."""

    words: str
    keeps: Callable[[object], bool]


def _finite(value: object) -> TypeGuard[float]:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    return math.isfinite(value)


FINITE = Rule("a finite number", _finite)
POSITIVE = Rule("a number above 0", lambda value: _finite(value) and value > 0.0)
DURATION = Rule("0 or above [s]", lambda value: _finite(value) and value >= 0.0)
TEXT = Rule("a text", lambda value: isinstance(value, str))
TABLE = Rule("a table", lambda value: isinstance(value, dict))
FILE = {
    "mission": Rule("a shipped mission's name or a path relative to this file", TEXT.keeps),
    **dict.fromkeys(("known", "tied", "free", "resolution"), TABLE),
    "rows": Rule(
        "tables [[rows]] with name, given, fit, check",
        lambda value: isinstance(value, list) and all(map(TABLE.keeps, value)),
    ),
}
ROW = {"name": TEXT, **dict.fromkeys(("given", "fit", "check", "resolution"), TABLE)}
STAY = {
    "hover_time_s": DURATION,
    "rest_time_s": DURATION,
    "building": TEXT,
    "order": Rule(" or ".join(ORDERS), lambda value: value in ORDERS),
    "laser": Rule("true or false", lambda value: isinstance(value, bool)),
}
"""How a row was flown; any other key of `given` is one of the mission."""
USUAL_STAY = {"hover_time_s": 0.0, "rest_time_s": 0.0, "building": "", "order": ORDERS[0]}
CELLS, STEPS = dict.fromkeys(QUANTITIES, FINITE), dict.fromkeys(QUANTITIES, POSITIVE)
FACTORS = Rule(
    "a list of the keys whose product it is",
    lambda value: bool(value) and isinstance(value, list) and all(map(TEXT.keeps, value)),
)


def read_table(path: Path) -> ResultsTable:
    """Read a table of results.

    Raises
    ------
    InputError
        With every fault of the file.
    """
    return _Reader(label(path), path.parent).table(read_toml(path, LARGEST_FILE))


class _Reader:
    """Reads a table of results and collects its faults."""

    def __init__(self, source: str, directory: Path) -> None:
        self.source, self.directory = source, directory
        self.faults: list[Fault] = []

    def fault(self, key: str, value: object, allowed: str) -> None:
        self.faults.append(Fault(key, "" if value is None else shown(value), allowed, self.source))

    def take(self, place: str, table: Entries, rules: Mapping[str, Rule]) -> Entries:
        """The entries that keep their rules; every other is a fault."""
        found = {}
        for key, value in table.items():
            if key not in rules:
                words = f"unknown key{nearest(key, rules)}; known are {', '.join(rules)}"
                self.fault(f"{place}{key}", None, words)
            elif rules[key].keeps(value):
                found[key] = value
            else:
                self.fault(f"{place}{key}", value, rules[key].words)
        return found

    def table(self, document: Entries) -> ResultsTable:
        top = self.take("", document, FILE)
        known, free = _flat(top.get("known", {})), self.free(_flat(top.get("free", {})))
        tied = self.tied(_flat(top.get("tied", {})))
        steps = self.take("resolution.", top.get("resolution", {}), STEPS)
        if not document.get("rows"):
            self.fault("rows", None, FILE["rows"].words)
        stated = enumerate(top.get("rows", ()))
        rows = tuple(self.row(f"rows[{place}]", row, steps) for place, row in stated)
        numbers = [each for row in rows for each in row.numbers]
        base, mission = top.get("mission", "paper"), None
        if base not in shipped():
            base = str(self.directory / base)
        try:
            mission = tie(load(base).replace({**known, **free, **dict.fromkeys(tied, 1.0)}), tied)
            for place, row in enumerate(rows):
                self.try_row(f"rows[{place}].given", row, mission)
        except InputError as error:
            self.faults += [
                replace(each, source=each.source or self.source) for each in error.faults
            ]
        count = sum(each.fits for each in numbers)
        if count < len(free):
            words = f"as many numbers to fit as free keys: {len(free)}; there are {count}"
            self.fault("rows", None, words)
        unresolved = Counter(each.quantity for each in numbers if math.isnan(each.resolution))
        for quantity, count in unresolved.items():
            words = "the step to which the table is rounded, above 0"
            self.fault(f"resolution.{quantity}", None, f"{words}, for {counted(count, 'number')}")
        if self.faults or mission is None:
            raise InputError(self.faults)
        return ResultsTable(self.source, mission, base, known, free, tied, rows)

    def free(self, found: Entries) -> dict[str, float]:
        if not found:
            self.fault("free", None, "a table of keys to be fitted, with values to start from")
        kept = self.take("free.", found, dict.fromkeys(found, POSITIVE))
        for key in found:
            allowed = number(key)
            if allowed is not None and allowed.whole and kept.pop(key, None) is not None:
                words = "a key that may have any value in its range; whole numbers cannot be fitted"
                self.fault(f"free.{key}", found[key], words)
        return {key: float(value) for key, value in kept.items()}

    def tied(self, found: Entries) -> dict[str, tuple[str, ...]]:
        kept = self.take("tied.", found, dict.fromkeys(found, FACTORS))
        for key, names in kept.items():
            for each in names:
                if number(each) is None:
                    self.fault(f"tied.{key}", each, "products of keys that are numbers")
        return {key: tuple(names) for key, names in kept.items()}

    def row(self, place: str, stated: Entries, steps: Mapping[str, float]) -> FlownRow:
        parts = self.take(f"{place}.", stated, ROW)
        given, name = parts.get("given", {}), parts.get("name", place)
        stay: Entries = dict(USUAL_STAY)
        own = {key: given[key] for key in given if key in STAY}
        stay |= self.take(f"{place}.given.", own, STAY)
        changes = _flat({key: given[key] for key in given if key not in STAY})
        if not stay.pop("laser", True):
            changes |= dict.fromkeys(WITHOUT_LASER)
        if stay["rest_time_s"] and not stay["building"]:
            self.fault(f"{place}.given.building", None, "where it rested")
        own = self.take(f"{place}.resolution.", parts.get("resolution", {}), STEPS)
        steps = {**steps, **own}
        numbers = tuple(
            TableNumber(name, quantity, float(value), steps.get(quantity, math.nan), key == "fit")
            for key in ("fit", "check")
            for quantity, value in self.take(f"{place}.{key}.", parts.get(key, {}), CELLS).items()
        )
        return FlownRow(**stay, changes=changes, numbers=numbers)

    def try_row(self, place: str, row: FlownRow, mission: Mission) -> None:
        """Collect faults of the keys and the building of a row."""
        try:
            mission = mission.replace(row.changes)
        except InputError as error:
            self.faults += [
                replace(each, key=f"{place}.{each.key}", source=self.source)
                for each in error.faults
            ]
            if any(key.startswith("buildings") for key in row.changes):
                return
        names = [building.name for building in mission.buildings]
        if row.building and row.building not in names:
            words = f"a building of the mission{nearest(row.building, names)}"
            self.fault(f"{place}.building", row.building, words)


def _flat(table: Entries, before: str = "") -> Entries:
    """Tables within tables as dotted keys."""
    found: Entries = {}
    for key, value in table.items():
        if isinstance(value, dict):
            found |= _flat(value, f"{before}{key}.")
        else:
            found[f"{before}{key}"] = value
    return found
