"""Scenarios of a mission: values by key, in a grid or row by row, as columns of its variants."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from optuav.arrays import Floats, Integers
from optuav.errors import Fault, InputError, refuse
from optuav.mission import Mission
from optuav.mission.messages import nearest, number, shown
from optuav.mission.schema import CONVERSIONS, RATE_PER_MINUTE, SECTIONS, Number
from optuav.network.variants import Columns

VECTORS = {
    **dict.fromkeys(("route.origin_m", "route.destination_m", "route.hover_m"), "m"),
    **{"laser.position_m": "m", "link.device_m": "m", "wind.force_N": "N"},
}
"""Keys with three components, each at most 1e6 either way, and their units."""
PER_MINUTE, PER_SECOND = "battery.flow_rate_per_min", "battery.flow_rate_per_s"
WAVELENGTH, COEFFICIENTS = "laser.wavelength_nm", tuple(CONVERSIONS[810])
SIZES, ENERGIES = ("packs", "capacity_As"), ("flight_energy_J", "hover_energy_J")
BOUND = {"limits.min_altitude_m", "limits.max_altitude_m", "limits.deadline_s", "battery.period_s"}
"""Keys whose values may contradict each other in some scenarios and not in others."""
MOST = 10**9
ROW = "scenario"


def numeric_keys() -> dict[str, Number]:
    """Ranges of all numeric keys of missions by name, components of places and forces by number."""
    found = {PER_MINUTE: RATE_PER_MINUTE}
    for table, section in SECTIONS.items():
        for name in section.model_fields if table != "buildings" else ():
            if (allowed := number(key := f"{table}.{name}")) is not None:
                found[key] = allowed
    for key, unit in VECTORS.items():
        found |= {f"{key}[{axis}]": Number(unit, ge=-1e6, le=1e6) for axis in range(3)}
    return found


@dataclass(frozen=True)
class Scenarios:
    """A mission with values of some keys, every combination of them or row by row."""

    mission: Mission
    values: Mapping[str, Floats]  # Of every key
    paired: bool

    @cached_property
    def sizes(self) -> dict[str, int]:
        """Number of scenarios along every dimension, by its name."""
        lengths = {key: len(values) for key, values in self.values.items()}
        if not self.paired:
            return lengths
        return {ROW: next(iter(lengths.values()), 1)}

    @property
    def count(self) -> int:
        """Number of scenarios."""
        return int(np.prod([*self.sizes.values()], dtype=object)) if self.sizes else 1

    @cached_property
    def base(self) -> Mission:
        """The mission with what it does not state itself of the keys."""
        here = {key: values for key, values in self._first().items() if self._now(key) is None}
        return self.mission.replace(here)

    def stated(self, first: int, count: int) -> dict[str, Floats]:
        """Values by key of some scenarios; the last key varies fastest."""
        if self.paired:
            return {key: values[first : first + count] for key, values in self.values.items()}
        numbers: Integers = np.arange(first, first + count)
        where = np.unravel_index(numbers, tuple(self.sizes.values())) if self.sizes else ()
        pairs = zip(self.values.items(), where, strict=True)
        return {key: values[index] for (key, values), index in pairs}

    def columns(self, first: int, count: int) -> Columns:
        """The same with what `Mission.replace` displaces, for the variants of `base`."""
        found = self.stated(first, count)
        if not found:
            return {"limits.deadline_s": np.full(count, self.mission.limits.deadline_s)}
        if PER_MINUTE in found:
            found[PER_SECOND] = found.pop(PER_MINUTE) / 60.0
        laser, battery = self.mission.laser, self.mission.battery
        if laser and WAVELENGTH in found and f"laser.{COEFFICIENTS[0]}" not in found:
            same = found[WAVELENGTH] == laser.wavelength_nm
            known, which = np.unique(found[WAVELENGTH], return_inverse=True)
            for name in COEFFICIENTS:
                own = getattr(laser, name)
                table = [CONVERSIONS.get(each, {}).get(name, own) for each in known.tolist()]
                found[f"laser.{name}"] = np.where(same, own, np.array(table)[which])
        sizes = [key for name in SIZES if (key := f"battery.{name}") in found]
        for name in ENERGIES if sizes else ():
            stated_J, key = getattr(battery, name), f"battery.{name}"
            if stated_J is not None and key not in found:
                same = np.logical_and.reduce([found[key] == self._now(key) for key in sizes])
                if same.any():
                    found[key] = np.where(same, stated_J, np.nan)
        return found

    def missions(self, first: int, count: int) -> Iterator[Mission | InputError]:
        """Every scenario as a mission of its own, or what is wrong with it."""
        columns = self.stated(first, count)
        for row in range(count):
            try:
                yield self.mission.replace(
                    self._whole({key: float(values[row]) for key, values in columns.items()})
                )
            except InputError as error:
                yield error

    def _now(self, key: str) -> float | None:
        """The mission's own value of a key."""
        table, _, name = key.partition(".")
        name, _, axis = name.partition("[")
        found = getattr(getattr(self.mission, table), name, None)
        return found if found is None or not axis else found[int(axis[0])]

    def _first(self) -> dict[str, object]:
        """The first scenario as `Mission.replace` takes it, without what may contradict itself."""
        first = {key: float(values[0]) for key, values in self.values.items()}
        apart = {key for key in first if key in BOUND and self._now(key) is not None}
        return self._whole({key: value for key, value in first.items() if key not in apart})

    def _whole(self, values: Mapping[str, float]) -> dict[str, object]:
        """Values with components as vectors, and whole numbers as such."""
        found: dict[str, object] = {}
        for key, value in values.items():
            name, _, axis = key.partition("[")
            if not axis:
                allowed = number(key)
                found[key] = int(value) if allowed and allowed.whole else value
                continue
            table, _, field = name.partition(".")
            vector = found.setdefault(name, list(getattr(getattr(self.mission, table), field)))
            assert isinstance(vector, list)
            vector[int(axis[0])] = value
        return found


def scenarios(mission: Mission, ranges: Mapping[str, object], *, paired: bool) -> Scenarios:
    """Scenarios of a mission, or all that is wrong with the ranges."""
    faults = list[Fault]()
    values = values_of(ranges, faults, paired=paired)
    for key in values:
        table, _, name = key.partition(".")
        if "[" in name and getattr(getattr(mission, table), name.partition("[")[0], None) is None:
            words = f"the mission states no {key.partition('[')[0]}, of which this is a component"
            faults.append(Fault(key, "", words))
    refuse(faults)
    found = Scenarios(mission, values, paired)
    if found.count > MOST:
        refuse([Fault("ranges", f"{found.count} scenarios", f"at most {MOST}")])
    if values:
        _refuse_wavelengths(found)
        mission.replace(found._first())
    return found


def values_of(ranges: object, faults: list[Fault], *, paired: bool) -> dict[str, Floats]:
    """Values by key; what is wrong with them for any mission is among the faults."""
    if not isinstance(ranges, Mapping):
        faults.append(Fault("ranges", shown(ranges), "values by key in a dict"))
        return {}
    known, values = numeric_keys(), dict[str, Floats]()
    for key, stated in ranges.items():
        if key not in known:
            words = "a numeric key of a mission, a place or force by component as link.device_m[0]"
            faults.append(Fault(str(key), "", f"{words}{nearest(str(key), known)}"))
            continue
        values[key], fault = _column(key, stated, known[key])
        faults += [fault] if fault else []
    lengths = {len(each) for each in values.values()}
    if paired and len(lengths) > 1:
        words = ", ".join(f"{len(each)} of {key}" for key, each in values.items())
        faults.append(Fault("paired", words, "one length for all keys"))
    return values


def _column(key: str, stated: object, allowed: Number) -> tuple[Floats, Fault | None]:
    """The values of a key, and what is wrong with them."""
    words = f"a list or an array, each {allowed.words}"
    try:
        column = np.asarray(stated)
        if column.dtype.kind not in "iuf" or column.ndim != 1 or not len(column):
            raise ValueError
    except ValueError:
        return np.zeros(1), Fault(key, shown(stated), words)
    column = column.astype(float)
    ends = column[[column.argmin(), column.argmax()]].tolist()
    broken = [each for each in ends if not allowed.accepts(each)]
    if allowed.whole and not broken:
        broken = column[column % 1 != 0].tolist()
    return column, Fault(key, f"{broken[0]:g}", words) if broken else None


def _refuse_wavelengths(found: Scenarios) -> None:
    """Refuse wavelengths for which no conversion is known or stated."""
    values, laser = found.values, found.mission.laser
    stated = [name for name in COEFFICIENTS if f"laser.{name}" in values]
    if WAVELENGTH not in values or laser is None or len(stated) == len(COEFFICIENTS):
        return
    known = [*CONVERSIONS, laser.wavelength_nm]
    unknown = [each for each in values[WAVELENGTH].tolist() if each not in known]
    if stated or unknown:
        value = ", ".join(stated) or f"{unknown[0]:g}"
        words = f"with all of {', '.join(COEFFICIENTS)}, or none of them and 810 or 1550 nm"
        refuse([Fault(WAVELENGTH, value, words)])
