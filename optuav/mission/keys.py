"""The numeric keys of missions: their units and ranges, and a mission's values."""

from __future__ import annotations

import difflib
import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import product
from typing import Any

from optuav.errors import Fault
from optuav.fields import COORDINATE, FORCE, RATE_PER_MINUTE, WIND_SPEED, Range
from optuav.mission.forms import SINGLE, table_keys
from optuav.mission.messages import nearest, no_item, number, number_of, shown
from optuav.mission.mission import Mission, unknown_names
from optuav.presentation.numbers import with_unit

VECTORS = {
    **dict.fromkeys(("route.origin_m", "route.destination_m", "route.hover_m"), (COORDINATE, 3)),
    **dict.fromkeys(("laser.position_m", "link.device_m"), (COORDINATE, 3)),
    "wind.force_N": (FORCE, 3),
    "wind.velocity_m_s": (WIND_SPEED, 2),
}
"""Keys with components: what each may be, and how many of them may vary."""
PLACES = ("position_m", "hover_m")
OF_DEVICE = re.compile(rf"devices\.(.+)\.({'|'.join(PLACES)})\[([012])\]")
"""Keys of the places of several devices, by name, and their components."""
PER_MINUTE, PER_SECOND = "battery.flow_rate_per_min", "battery.flow_rate_per_s"
"""One rate: missions hold it per second."""
BOUND = {"limits.min_altitude_m", "limits.max_altitude_m", "limits.deadline_s", "battery.period_s"}
"""Keys whose values may contradict each other in some scenarios and not in others."""
INSIDE = 1e-9  # Distance of the outermost value from a bound that is excluded


@dataclass(frozen=True)
class Key:
    """A numeric key that a mission states."""

    name: str  # Dotted; of a component as ``wind.force_N[2]``
    now: float
    low: float
    high: float
    whole: bool  # Whether only whole numbers are allowed
    unit: str  # As its range states it; ``"-"`` for a ratio


def range_of(key: str) -> Range | None:
    """The range of a numeric key of missions; of a place of a device, whatever its name."""
    return COORDINATE if OF_DEVICE.fullmatch(key) else numeric_keys().get(key)


def numeric_keys(mission: Mission | None = None) -> dict[str, Range]:
    """Ranges of all numeric keys of missions by name, components of places and forces by number.

    Of a mission with several devices also those of their places.
    """
    numbers = {PER_MINUTE: RATE_PER_MINUTE}
    for table in SINGLE:
        for name, form in table_keys(table).items():
            if (allowed := number_of(form, name)) is not None:
                numbers[f"{table}.{name}"] = allowed
    for key, (allowed, axes) in VECTORS.items():
        numbers |= {f"{key}[{axis}]": allowed for axis in range(axes)}
    for device in mission.devices if mission else ():
        for name, axis in product(PLACES, range(3)):
            numbers[f"devices.{device.name}.{name}[{axis}]"] = COORDINATE
    return numbers


def stated_keys(mission: Mission) -> dict[str, Key]:
    """The numeric keys that a mission states, by name; a bound that is excluded is approached."""
    stated_by_name = dict[str, Key]()
    for name, allowed in numeric_keys(mission).items():
        if (now := stated_value(mission, name)) is not None:
            low, high = allowed.ge, allowed.le
            low = (allowed.gt or 0.0) + INSIDE if low is None else low
            high = (allowed.lt or 0.0) - INSIDE if high is None else high
            stated_by_name[name] = Key(name, now, low, high, allowed.whole, allowed.unit)
    return stated_by_name


def stated_value(mission: Mission, key: str) -> float | None:
    """A mission's own value of a numeric key; None where it states none."""
    if of_device := OF_DEVICE.fullmatch(key):
        name, place, number = of_device.groups()
        devices = [device for device in mission.devices if device.name == name]
        at_m = getattr(devices[0], place) if devices else None
        return None if at_m is None else float(at_m[int(number)])
    table, _, name = key.partition(".")
    name, _, axis = name.partition("[")
    stated: Any = getattr(getattr(mission, table), name, None)
    found: float | None = stated[int(axis[0])] if axis and stated is not None else stated
    return found


def unknown_keys(keys: Iterable[str], mission: Mission | None = None) -> Iterator[Fault]:
    """A fault for each key that is not a numeric one of missions, or of a mission's devices."""
    ranges = numeric_keys()
    words = "a numeric key of a mission, a place or force by component as link.device_m[0]"
    for key in keys:
        if key.startswith("devices"):
            if not OF_DEVICE.fullmatch(key):
                yield Fault(key, "", _words_of_device(key, mission))
        elif key not in ranges:
            # Components of a vector are all alike: the first is suggested
            alike = [name for name in ranges if "[" in key or not name.endswith(("[1]", "[2]"))]
            yield Fault(key, "", f"{words}{nearest(key, alike)}")


def _words_of_device(key: str, mission: Mission | None) -> str:
    """What a key of a device must be, and what is most like it."""
    device, _, field = key.partition("[")[0].rpartition(".")
    places = " or ".join(f"devices.NAME.{place}[k]" for place in PLACES)
    words = f"must be {places}, k = 0 to 2"
    if field == "share":
        return f"{words}; shares cannot vary one by one, as they add up to 1"
    names = [one.name for one in mission.devices] if mission else []
    if names and device.startswith("devices.") and device.removeprefix("devices.") not in names:
        return f"{words}; {no_item('devices', device, names)}"
    like = difflib.get_close_matches(field, PLACES, n=1) if device.startswith("devices.") else ()
    return f"{words}; did you mean '{device}.{like[0]}[0]'?" if like else words


def misfits_of_keys(values: Mapping[str, object]) -> Iterator[Fault]:
    """Yield keys that no mission has, and numbers out of range, without a mission."""
    yield from unknown_names(
        {key: x for key, x in values.items() if not key.startswith(("buildings", "devices."))}
    )
    for key, value in values.items():
        allowed = range_of(key)
        if allowed is not None and value is not None and not allowed.accepts(value):
            yield Fault(key, shown(value), allowed.words)


def keys_of_missing_tables(mission: Mission, keys: Collection[str]) -> Iterator[Fault]:
    """A fault for each numeric key whose table or place the mission does not state."""
    for key in keys:
        if missing := _missing(mission, key, keys):
            yield Fault(key, "", missing)


def _missing(mission: Mission, key: str, keys: Collection[str]) -> str:
    """Words on what a mission would have to state before a key; empty where nothing is missing."""
    whole, _, axis = key.partition("[")
    if of_device := OF_DEVICE.fullmatch(key):
        names = [device.name for device in mission.devices]
        if of_device[1] not in names:
            return no_item("devices", f"devices.{of_device[1]}", names)
        if stated_value(mission, key) is not None or all(f"{whole}[{k}]" in keys for k in range(3)):
            return ""
        return f"is a key only where the mission sets {whole}; it does not, and computes the place"
    table, _, name = whole.partition(".")
    words = "the mission has no {}, and this key is part of it"
    if (section := getattr(mission, table)) is None:
        return "" if table == "start" else words.format(table)
    if not axis or getattr(section, name) is not None:
        return ""
    return "" if all(f"{whole}[{k}]" in keys for k in range(3)) else words.format(whole)


def quantity(mission: Mission, key: str) -> str:
    """A mission's own value of a numeric key with its unit, as text."""
    allowed, value = number(key) or range_of(key), stated_value(mission, key)
    assert value is not None
    return with_unit(value, allowed.unit if allowed else "")


def as_stated(mission: Mission, values: Mapping[str, float]) -> dict[str, Any]:
    """Values of numeric keys for `Mission.replace`: whole vectors, whole numbers."""
    values_by_key = dict[str, Any]()
    for key, value in values.items():
        name, _, axis = key.partition("[")
        if axis:
            whole = values_by_key.setdefault(
                name, [stated_value(mission, f"{name}[{k}]") for k in range(3)]
            )
            whole[int(axis[0])] = value
        else:
            allowed = number(key)
            values_by_key[key] = int(value) if allowed and allowed.whole else value
    return values_by_key
