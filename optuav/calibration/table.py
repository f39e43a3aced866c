"""Keys of a mission from a table of results: some are known, the others are fitted.

Each row of the table is a mission flown: a hover and a rest of known length on a known route. Its
flight time and the charge and energy that are left follow from the mission by the same phases as
a plan; the free keys are fitted to some of the table's numbers. A number that is stated as
a check is predicted only, or repeats one that was fitted: then it tests nothing.
"""

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import compress
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, get_args

import numpy as np
from pydantic import BaseModel, ValidationError

from optuav.arrays import Floats
from optuav.calibration.fit import Fit, Panel, Role, estimate, rounded
from optuav.errors import Fault, InputError, collected, refuse
from optuav.fields import Range
from optuav.mission import Mission, load, shipped
from optuav.mission.files import label, read_toml, resolve_from
from optuav.mission.messages import (
    error_words,
    nearest,
    no_building,
    number,
    paths_of,
    plural,
    shown,
)
from optuav.network import vehicle
from optuav.network.network import Network, build_network
from optuav.network.timeline import route_phases
from optuav.options import ORDERS, Order

Time = Literal["flight_time_s", "mission_time_s"]
Charge = Literal["battery_percent", "energy_percent", "adjusted_percent"]
Cell = Literal[Time, Charge, "flight_voltage_V", "hover_voltage_V"]
"""Quantities that a row may state: times, charge left by perspective, mean voltages."""
SYMBOLS_OF_UNITS = {"s": "s", "percent": "%", "V": "V"}
Positive = Annotated[float, Range("-", gt=0)]
Duration = Annotated[float, Range("s", ge=0)]
ROUNDED_STEP = 1.0 / math.sqrt(12.0)  # standard deviation of its error, in steps
IMPOSSIBLE = 1e9  # residual where a row cannot be flown, or no mission may have the values
DIGITS = 6  # decimals that decide if a number repeats
SCALES = (1.0, 0.5, 2.0)  # where the fit starts, as multiples of the stated values
WITHOUT_LASER = ("laser", "flight.charge_current_A", "flight.charge_power_W")


class FlownAs(BaseModel, extra="allow", strict=True, allow_inf_nan=False):
    """Keys that say how a row was flown; any other key is one of the mission."""

    hover_time_s: Duration = 0.0
    rest_time_s: Duration = 0.0
    building: str = ""
    order: Order = ORDERS[0]
    laser: bool = True

    @property
    def changes(self) -> dict[str, Any]:
        """Keys of the mission that differ in this row."""
        return _flat(self.model_extra or {}) | ({} if self.laser else dict.fromkeys(WITHOUT_LASER))


class ResultsRow(BaseModel, extra="forbid", strict=True, allow_inf_nan=False):
    """A row of the table: how it was flown, and its numbers."""

    name: str = ""
    given: FlownAs = FlownAs()
    fit: dict[Cell, float] = {}
    check: dict[Cell, float] = {}
    resolution: dict[Cell, Positive] = {}


class ResultsFile(BaseModel, extra="forbid", strict=True, allow_inf_nan=False):
    """A table of results with known and free values, keys dotted."""

    mission: str = "paper"
    known: dict[str, Any] = {}
    free: dict[str, Positive] = {}
    tied: dict[str, list[str]] = {}
    resolution: dict[Cell, Positive] = {}
    rows: list[ResultsRow] = []


class TableNumber(NamedTuple):
    """A number of the table, and whether it must be fitted."""

    row: str
    quantity: Cell
    observed: float
    resolution: float
    fits: bool


class ResultsTable(NamedTuple):
    """A table of results on a mission with everything that is known."""

    stated: ResultsFile
    mission: Mission
    base: str  # name or path of the mission that was extended
    numbers: tuple[TableNumber, ...]

    def with_values(self, values: Iterable[float]) -> Mission:
        """The mission with other values of the free keys."""
        free = dict(zip(self.stated.free, values, strict=True))
        return tie(self.mission.replace(free), self.stated.tied)

    def computed(self, values: Iterable[float]) -> Floats:
        """The numbers of the table as they follow from values of the free keys."""
        mission = self.with_values(values)
        networks, numbers = dict[str, Network](), list[float]()
        for row in self.stated.rows:
            changes = row.given.changes
            if repr(changes) not in networks:
                changed = mission.replace(changes) if changes else mission
                networks[repr(changes)] = build_network(tie(changed, self.stated.tied))
            figures = quantities(networks[repr(changes)], row.given)
            numbers += [figures[label] for label in (*row.fit, *row.check)]
        return np.array(numbers)


def fit_table(files: str | Path | Iterable[str | Path]) -> Fit:
    """Fit keys of a mission to a table of results.

    Parameters
    ----------
    files
        One TOML file: ``mission`` (known values, a shipped name or a path relative to the file),
        ``[known]`` (keys that differ), ``[free]`` (keys to be fitted with a value to start from),
        ``[tied]`` (keys that are products of others), ``[resolution]`` (by quantity, the step to
        which the table is rounded), and ``[[rows]]`` with ``name``, ``given`` (hover_time_s,
        rest_time_s, building, order, laser, or keys of the mission), ``fit`` and ``check``
        (numbers by quantity: ``flight_time_s``, ``mission_time_s``, ``battery_percent``,
        ``energy_percent``, ``adjusted_percent``, ``flight_voltage_V``, ``hover_voltage_V``).

    Returns
    -------
    Fit
        The fit, whose intervals follow from the resolution, or from the residuals if these are
        larger. It has a warning if the values do not meet the table.

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
    paths = paths_of(files, "files")
    if len(paths) != 1:
        raise InputError("one file with the table, the known values and the free ones")
    table = read_table(paths[0])
    fits = np.array([printed.fits for printed in table.numbers])
    observed = np.array([printed.observed for printed in table.numbers])
    steps = ROUNDED_STEP * np.array([printed.resolution for printed in table.numbers])

    def residuals(values: Floats) -> Floats:
        try:
            left: Floats = ((table.computed(values.tolist()) - observed) / steps)[fits]
        except InputError:  # no mission may have these values
            left = np.full(int(fits.sum()), math.nan)
        return np.nan_to_num(left, nan=IMPOSSIBLE)

    free, tied = table.stated.free, table.stated.tied
    starts = [[scale * value for value in free.values()] for scale in SCALES]
    estimated = estimate(tuple(free), residuals, starts, spread=1.0)
    mission = table.with_values(estimated.values.tolist())
    computed = table.computed(estimated.values.tolist()).tolist()
    pairs = list(zip(table.numbers, computed, strict=True))
    unflown = {number.row for number, value in pairs if not math.isfinite(value)}
    words = "a row that can be flown; none of the values tried can: start from others in [free]"
    refuse(Fault("rows", shown(name), words, label(paths[0])) for name in sorted(unflown))
    keys = [(number.quantity, number.observed, round(value, DIGITS)) for number, value in pairs]
    different, count = set(compress(keys, fits)), int(fits.sum())
    roles: list[Role] = [
        "fitted" if fit else "repeat" if key in different else "predicted"
        for key, fit in zip(keys, fits, strict=True)
    ]
    warnings = [*estimated.warnings]
    if missed := sum(n.fits and abs(value - n.observed) > n.resolution for n, value in pairs):
        words = f"{missed} of {count} numbers are missed by more than their rounding"
        warnings.append(f"the values do not meet the table: {words}")
    if again := count - len(different):
        repeat = f"{plural(again, 'number')} to be fitted repeat{'s' * (again == 1)} another"
        warnings.append(f"{repeat}: use it as a check, or the intervals are too narrow")
    values = estimated.values_for_mission(f"fitted to {plural(count, 'number')} of the table")
    sure = [key for key in tied if any(value.stated for value in values)]
    settings = {**table.stated.known, **{key: rounded(value_of(mission, key)) for key in sure}}
    fitted, predicted = plural(count, "number"), f"{roles.count('predicted')} predicted"
    repeated = f", {roles.count('repeat')} repeated" if "repeat" in roles else ""
    data = f"{fitted} of the table fitted by {plural(len(free), 'free key')}{repeated}, {predicted}"
    parts = data, values, tuple(_panels(pairs, roles)), tuple(warnings)
    return Fit("table", (str(paths[0]),), *parts, settings=settings, extends=table.base)


def quantities(flown: Network, row: FlownAs) -> dict[Cell, float]:
    """All that a row may state."""
    mission, names = flown.mission, flown.mission.buildings.names
    itinerary = 0
    if row.building:
        itinerary = 1 + 2 * names.index(row.building) + ORDERS.index(row.order)
    battery, hover = mission.battery, vehicle.hover_load(mission)
    capacity_As = float(mission.pool.capacity_As)
    nominal_J = capacity_As * battery.nominal_voltage_V
    kinds = ("flight", "hover", "rest")
    charge_As, energy_J, time_s = (dict.fromkeys(kinds, 0.0) for _ in range(3))
    for phase in route_phases(flown, itinerary, row.hover_time_s, row.rest_time_s):
        charge_As[phase.kind] += float(phase.charge_As)
        energy_J[phase.kind] += float(phase.energy_J)
        time_s[phase.kind] += float(phase.duration_s)
    flight_V, hover_V = energy_J["flight"] / charge_As["flight"], hover.power_W / hover.current_A
    hovering_J = hover.power_W * row.hover_time_s
    adjusted = (
        energy_J["flight"] / (battery.flight_energy_J or capacity_As * flight_V)
        - hovering_J / (battery.hover_energy_J or capacity_As * hover_V)
        + (energy_J["hover"] + hovering_J + energy_J["rest"]) / nominal_J
    )
    return {
        "flight_time_s": time_s["flight"],
        "mission_time_s": sum(time_s.values()),
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


def tie(mission: Mission, tied: Mapping[str, Sequence[str]]) -> Mission:
    """The mission with its tied keys at the product of theirs."""
    factors = {key: [value_of(mission, name) for name in names] for key, names in tied.items()}
    products = {key: math.prod(parts) for key, parts in factors.items() if None not in parts}
    return mission.replace(products) if products else mission


def _panels(pairs: Sequence[tuple[TableNumber, float]], roles: Sequence[Role]) -> Iterator[Panel]:
    """One panel a quantity that the table has."""
    rows = [(printed, value, role) for (printed, value), role in zip(pairs, roles, strict=True)]
    for quantity in get_args(Cell):
        seen = [(n.observed, x, n.row, role) for n, x, role in rows if n.quantity == quantity]
        if seen:
            words, _, unit = quantity.rpartition("_")
            observed, computed, names, kinds = zip(*seen, strict=True)
            heads = words.replace("_", " "), SYMBOLS_OF_UNITS[unit]
            yield Panel(*heads, observed, computed, names, roles=kinds)


def read_table(path: Path) -> ResultsTable:
    """Read a table of results, or refuse it with every fault of the file."""
    source = label(path)
    document = read_toml(path)
    for key in ("known", "free", "tied"):
        if isinstance(document.get(key), dict):
            document[key] = _flat(document[key])
    content, faults = _valid(document)
    free, tied = content.free, content.tied
    if not free:
        faults.append(Fault("free", "", "a table of keys to be fitted, with values to start from"))
    for key in [key for key in free if (allowed := number(key)) is not None and allowed.whole]:
        words = "a key that may have any value in its range; whole numbers cannot be fitted"
        faults.append(Fault(f"free.{key}", shown(free.pop(key)), words))
    for key, names in tied.items():
        words = "products of keys that are numbers"
        unknown = (label for label in names if number(label) is None)
        faults += [Fault(f"tied.{key}", shown(label), words) for label in unknown]
    if not content.rows:
        faults.append(Fault("rows", "", "tables [[rows]] with name, given, fit, check"))
    base, mission = content.mission, None
    base = base if base in shipped() else str(resolve_from(path.parent, base))
    with collected(faults):
        changes = {**content.known, **free, **dict.fromkeys(tied, 1.0)}
        mission = tie(load(base).replace(changes), tied)
    numbers = list[TableNumber]()
    for place, row in enumerate(content.rows):
        faults += _faults_of_row(f"rows[{place}].given", row.given, mission)
        name, steps = row.name or f"rows[{place}]", {**content.resolution, **row.resolution}
        for cells, fits in ((row.fit, True), (row.check, False)):
            for cell, observed in cells.items():
                step = steps.get(cell, math.nan)
                numbers.append(TableNumber(name, cell, observed, step, fits))
    if (count := sum(number.fits for number in numbers)) < len(free):
        words = f"as many numbers to fit as free keys: {len(free)}; there are {count}"
        faults.append(Fault("rows", "", words))
    unresolved = Counter(number.quantity for number in numbers if math.isnan(number.resolution))
    for quantity, count in unresolved.items():
        words = f"the step to which the table is rounded, above 0, for {plural(count, 'number')}"
        faults.append(Fault(f"resolution.{quantity}", "", words))
    if faults or mission is None:
        raise InputError(replace(fault, source=fault.source or source) for fault in faults)
    return ResultsTable(content, mission, base, tuple(numbers))


def _valid(document: dict[str, Any]) -> tuple[ResultsFile, list[Fault]]:
    """The file without the entries that break a rule, and a fault for each of these."""
    try:
        return ResultsFile.model_validate(document), []
    except ValidationError as error:
        errors = error.errors(include_url=False)
    details = {
        tuple(part for part in detail["loc"] if part != "[key]"): detail for detail in errors
    }
    faults = []
    for (*place, last), detail in reversed(details.items()):  # or places in lists would move
        table: Any = document
        for part in place:
            table = table[part]
        value, words = shown(table.pop(last)), error_words(detail)
        if detail["type"] == "extra_forbidden":
            keys = (ResultsRow if place else ResultsFile).model_fields
            words = f"unknown key{nearest(str(last), keys)}"
        parts = (f"[{part}]" if isinstance(part, int) else f".{part}" for part in (*place, last))
        faults.append(Fault("".join(parts)[1:], value, words))
    return _valid(document)[0], faults[::-1]


def _faults_of_row(place: str, row: FlownAs, mission: Mission | None) -> Iterator[Fault]:
    """Yield the faults of the keys and the building of a row."""
    if row.rest_time_s and not row.building:
        yield Fault(f"{place}.building", "", "is missing: where the drone rested")
    if mission is None:
        return
    try:
        mission = mission.replace(row.changes)
    except InputError as error:
        yield from (replace(fault, key=f"{place}.{fault.key}", source="") for fault in error.faults)
        if any(key.startswith("buildings") for key in row.changes):
            return
    names = mission.buildings.names
    if row.building and row.building not in names:
        yield Fault(f"{place}.building", shown(row.building), no_building(row.building, names))


def _flat(table: Mapping[str, Any], before: str = "") -> dict[str, Any]:
    """Tables within tables as dotted keys."""
    found: dict[str, Any] = {}
    for key, value in table.items():
        name = f"{before}{key}"
        found |= _flat(value, f"{name}.") if isinstance(value, dict) else {name: value}
    return found
