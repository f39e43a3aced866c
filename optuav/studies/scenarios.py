"""Scenarios of a mission: values by key, row by row and in a grid, as columns of its variants."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from optuav.arrays import Floats, plain
from optuav.errors import Fault, InputError, refuse
from optuav.fields import Range
from optuav.laser.fits import CONVERSIONS, Laser
from optuav.mission import Mission
from optuav.mission.buildings import Buildings
from optuav.mission.keys import (
    BOUND,
    PER_MINUTE,
    PER_SECOND,
    as_stated,
    keys_of_missing_tables,
    range_of,
    stated_value,
    unknown_keys,
)
from optuav.mission.messages import shown
from optuav.network.network import Network, build_network
from optuav.network.variants import Columns, Variants
from optuav.presentation.numbers import typed
from optuav.studies.samples import COEFFICIENTS, WAVELENGTH, Draws, dotted

OF_ENERGIES = ("battery.packs", "battery.capacity_As")
OF_WELLS = (*OF_ENERGIES, "battery.available_fraction")
DISPLACED: Mapping[str, tuple[str, ...]] = {
    **dict.fromkeys(("battery.flight_energy_J", "battery.hover_energy_J"), OF_ENERGIES),
    **dict.fromkeys(("start.available_As", "start.bound_As"), OF_WELLS),
}
"""Keys that a new value of others displaces."""
MOST_SCENARIOS = 10**9
ROW = "scenario"
ITINERARIES_AT_ONCE = 1 << 17
"""Itineraries computed together: few enough to stay in the cache. No result depends on it."""
HELD_BYTES = 31 << 20
"""Size of a block whose release lets glibc keep as much memory from then on, rather than return it
after every chunk and fetch its pages again for the next, which takes a third of the time."""


@dataclass(frozen=True)
class Scenarios:
    """Variants of a mission: rows of values, stated or drawn, with every combination of a grid.

    The last key of the grid varies fastest, the row slowest.
    """

    mission: Mission
    rows: Mapping[str, Floats] | Draws | None = None
    grid: Mapping[str, Floats] = field(default_factory=dict)
    towns: tuple[Buildings, ...] = ()  # Buildings by row; without any, the mission's own

    @cached_property
    def row_count(self) -> int:
        """Number of rows; 1 without any."""
        if isinstance(self.rows, Draws):
            return self.rows.count
        return max([1, len(self.towns), *map(len, (self.rows or {}).values())])

    @cached_property
    def sizes(self) -> dict[str, int]:
        """Number of scenarios along every dimension, by its name."""
        rows = {} if self.rows is None and not self.towns else {ROW: self.row_count}
        return rows | {key: len(values) for key, values in self.grid.items()}

    @cached_property
    def count(self) -> int:
        """Number of scenarios."""
        return math.prod(self.sizes.values())

    @cached_property
    def base(self) -> Mission:
        """The mission completed with the keys that it does not state itself."""
        first, mission = self._first(), self.mission
        return mission.replace(
            {key: first[key] for key in first if stated_value(mission, key) is None}
        )

    @cached_property
    def network(self) -> Network:
        """The network of `base`."""
        return build_network(self.base)

    def values_by_key(self, first: int, count: int) -> dict[str, Floats]:
        """Values by key of some scenarios."""
        sizes = self.row_count, *map(len, self.grid.values())
        row, *places = np.unravel_index(np.arange(first, first + count), sizes)
        start, stop = int(row[0]), int(row[-1]) + 1
        if isinstance(self.rows, Draws):
            drawn = self.rows.values(start, stop - start)
        else:
            drawn = {key: values[start:stop] for key, values in (self.rows or {}).items()}
        if not self.grid:
            return drawn
        drawn = {key: values[row - start] for key, values in drawn.items()}
        pairs = zip(self.grid.items(), places, strict=True)
        return drawn | {key: values[place] for (key, values), place in pairs}

    def variants(self, few: Network | None = None) -> Iterator[tuple[int, Variants]]:
        """All of them, some at a time, with the number of the first; of few routes on demand."""
        np.empty(HELD_BYTES, np.uint8)
        network = few or self.network
        variants, at_once = None, max(1, ITINERARIES_AT_ONCE // len(network.routes))
        if self.towns:  # Whole towns
            per_town = self.count // len(self.towns)
            at_once = per_town * max(1, at_once // per_town)
        for first in range(0, self.count, at_once):
            columns = self.columns(first, min(at_once, self.count - first))
            if self.towns:
                rows = slice(first // per_town, (first + at_once) // per_town)
                variants = Variants(network, columns, towns=self.towns[rows])
            else:
                variants = variants.others(columns) if variants else Variants(network, columns)
            yield first, variants

    def columns(self, first: int, count: int) -> Columns:
        """The same with what `Mission.replace` displaces, for the variants of `base`."""
        mission, laser = self.mission, self.mission.laser
        columns = self.values_by_key(first, count)
        if not columns:
            return {"limits.deadline_s": np.full(count, mission.limits.deadline_s)}
        if PER_MINUTE in columns:
            columns[PER_SECOND] = columns.pop(PER_MINUTE) / 60.0
        held = f"laser.{COEFFICIENTS[0]}" in columns
        if isinstance(laser, Laser) and WAVELENGTH in columns and not held:
            same = columns[WAVELENGTH] == laser.wavelength_nm
            wavelengths, which = np.unique(columns[WAVELENGTH], return_inverse=True)
            for name in COEFFICIENTS:
                coefficient = getattr(laser, name)
                table = [
                    CONVERSIONS.get(λ, {}).get(name, coefficient) for λ in wavelengths.tolist()
                ]
                columns[f"laser.{name}"] = np.where(same, coefficient, np.array(table)[which])
        for key, sizes in DISPLACED.items():
            value, changed = (
                stated_value(mission, key),
                [size for size in sizes if size in columns],
            )
            if value is not None and key not in columns and changed:
                same = np.logical_and.reduce(
                    [columns[e] == stated_value(mission, e) for e in changed]
                )
                columns[key] = np.where(same, value, np.nan)
        return columns

    def missions(self, first: int, count: int) -> Iterator[Mission | InputError]:
        """Yield every scenario as a mission of its own, or its error."""
        columns, mission = self.values_by_key(first, count), self.mission
        for row in range(count):
            try:
                values = {key: float(column[row]) for key, column in columns.items()}
                if self.towns:
                    town = self.towns[(first + row) * len(self.towns) // self.count]
                    mission = mission.model_copy(update={"buildings": town})
                yield mission.replace(as_stated(mission, values))
            except InputError as error:
                yield error

    def _first(self, *, seen: bool = False) -> dict[str, object]:
        """The first scenario as `Mission.replace` takes it, without what may contradict itself.

        To be `seen` by a rule that refuses a key unless it is 0, another value stands for 0.
        """
        first = {key: float(values[0]) for key, values in self.values_by_key(0, 1).items()}
        if seen and not isinstance(self.rows, Draws):
            for key, values in {**(self.rows or {}), **self.grid}.items():
                first[key] = first[key] or float(values[np.abs(values).argmax()])
        apart = {
            key for key in first if key in BOUND and stated_value(self.mission, key) is not None
        }
        return as_stated(self.mission, {key: first[key] for key in first if key not in apart})


def check(found: Scenarios) -> None:
    """Refuse scenarios that are too many, or not of their mission."""
    if found.count > MOST_SCENARIOS:
        refuse([Fault("", f"{found.count} scenarios", f"at most {MOST_SCENARIOS}")])
    values, mission = found.values_by_key(0, 1), found.mission
    refuse(keys_of_missing_tables(mission, values))
    if values:
        _refuse_wavelengths(found)
        mission.replace(first := found._first())
        if (seen := found._first(seen=True)) != first:
            mission.replace(seen)


def values_of(
    ranges: object, faults: list[Fault], *, paired: bool, missions: Sequence[Mission] = ()
) -> dict[str, Floats]:
    """Return values by key; append their faults for any mission to `faults`.

    Those of a key that is unknown name the devices of the first mission.
    """
    if not isinstance(ranges, Mapping):
        faults.append(Fault("ranges", shown(ranges), "values by key in a dict"))
        return {}
    values = dict[str, Floats]()
    values_by_key = dict(dotted(ranges))
    faults += unknown_keys(values_by_key, next(iter(missions), None))
    of_keys = ((key, range_of(key)) for key in values_by_key)
    for key, allowed in ((key, allowed) for key, allowed in of_keys if allowed is not None):
        values[key], fault = _column(key, values_by_key[key], allowed)
        faults += [fault] if fault else []
    lengths = {len(value) for value in values.values()}
    if paired and len(lengths) > 1:
        words = ", ".join(f"{len(column)} of {key}" for key, column in values.items())
        faults.append(Fault("paired", words, "one length for all keys"))
    return values


def _column(key: str, stated: object, allowed: Range) -> tuple[Floats, Fault | None]:
    """Return the values of a key, and their fault."""
    words = f"a list or an array, each {allowed.words}"
    try:
        column = plain(stated)
        if column.dtype.kind not in "iuf" or column.ndim != 1 or not len(column):
            raise ValueError
    except ValueError:
        return np.zeros(1), Fault(key, shown(stated), words)
    column = column.astype(float)
    ends = column[[column.argmin(), column.argmax()]].tolist()
    broken = [end for end in ends if not allowed.accepts(end)]
    if allowed.whole and not broken:
        broken = column[column % 1 != 0].tolist()
    return column, Fault(key, typed(broken[0]), words) if broken else None


def _refuse_wavelengths(found: Scenarios) -> None:
    """Refuse wavelengths without a known or stated conversion."""
    stated_rows = {} if isinstance(found.rows, Draws) else found.rows or {}
    values, laser = {**stated_rows, **found.grid}, found.mission.laser
    coefficients = [name for name in COEFFICIENTS if f"laser.{name}" in values]
    if WAVELENGTH not in values or not isinstance(laser, Laser):
        return
    fixed = [*CONVERSIONS, laser.wavelength_nm]
    unknown = [λ for λ in values[WAVELENGTH].tolist() if λ not in fixed]
    if len(coefficients) < len(COEFFICIENTS) and (coefficients or unknown):
        value = ", ".join(coefficients) or typed(unknown[0])
        words = (
            f"must come with all of {', '.join(COEFFICIENTS)}, or none of them and 810 or 1550 nm"
        )
        refuse([Fault(WAVELENGTH, value, words)])
