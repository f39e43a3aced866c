"""The numeric keys of missions: their units and ranges, and a mission's values."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from optuav.errors import Fault
from optuav.fields import COORDINATE, FORCE, RATE_PER_MINUTE, WIND_SPEED, Range
from optuav.mission.forms import SINGLE, table_keys
from optuav.mission.messages import nearest, number, number_of, shown
from optuav.mission.mission import Mission, unknown_names

VECTORS = {
    **dict.fromkeys(("route.origin_m", "route.destination_m", "route.hover_m"), (COORDINATE, 3)),
    **dict.fromkeys(("laser.position_m", "link.device_m"), (COORDINATE, 3)),
    "wind.force_N": (FORCE, 3),
    "wind.velocity_m_s": (WIND_SPEED, 2),
}
"""Keys with components: what each may be, and how many of them may vary."""
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


def numeric_keys() -> dict[str, Range]:
    """Ranges of all numeric keys of missions by name, components of places and forces by number."""
    numbers = {PER_MINUTE: RATE_PER_MINUTE}
    for table in SINGLE:
        for name, form in table_keys(table).items():
            if (allowed := number_of(form, name)) is not None:
                numbers[f"{table}.{name}"] = allowed
    for key, (allowed, axes) in VECTORS.items():
        numbers |= {f"{key}[{axis}]": allowed for axis in range(axes)}
    return numbers


def stated_keys(mission: Mission) -> dict[str, Key]:
    """The numeric keys that a mission states, by name; a bound that is excluded is approached."""
    stated_by_name = dict[str, Key]()
    for name, allowed in numeric_keys().items():
        if (now := stated_value(mission, name)) is not None:
            low, high = allowed.ge, allowed.le
            low = (allowed.gt or 0.0) + INSIDE if low is None else low
            high = (allowed.lt or 0.0) - INSIDE if high is None else high
            stated_by_name[name] = Key(name, now, low, high, allowed.whole, allowed.unit)
    return stated_by_name


def stated_value(mission: Mission, key: str) -> float | None:
    """A mission's own value of a numeric key; None where it states none."""
    table, _, name = key.partition(".")
    name, _, axis = name.partition("[")
    stated: Any = getattr(getattr(mission, table), name, None)
    found: float | None = stated[int(axis[0])] if axis and stated is not None else stated
    return found


def unknown_keys(keys: Iterable[str]) -> Iterator[Fault]:
    """A fault for each key that is not a numeric one of missions."""
    known = numeric_keys()
    words = "a numeric key of a mission, a place or force by component as link.device_m[0]"
    for key in keys:
        if key not in known:
            # Components of a vector are all alike: the first is suggested
            alike = [name for name in known if "[" in key or not name.endswith(("[1]", "[2]"))]
            yield Fault(key, "", f"{words}{nearest(key, alike)}")


def misfits_of_keys(values: Mapping[str, object]) -> Iterator[Fault]:
    """Yield keys that no mission has, and numbers out of range, without a mission."""
    yield from unknown_names(
        {key: value for key, value in values.items() if not key.startswith("buildings")}
    )
    known = numeric_keys()
    for key, value in values.items():
        if key in known and value is not None and not known[key].accepts(value):
            yield Fault(key, shown(value), known[key].words)


def keys_of_missing_tables(mission: Mission, keys: Collection[str]) -> Iterator[Fault]:
    """A fault for each numeric key whose table or place the mission does not state."""
    for key in keys:
        if missing := _missing(mission, key, keys):
            words = f"the mission has no {missing}, and this key is part of it"
            yield Fault(key, "", words)


def _missing(mission: Mission, key: str, keys: Collection[str]) -> str:
    """The table, or the place or force, that a mission would have to state before a key."""
    whole, _, axis = key.partition("[")
    table, _, name = whole.partition(".")
    if (section := getattr(mission, table)) is None:
        return "" if table == "start" else table
    if not axis or getattr(section, name) is not None:
        return ""
    return "" if all(f"{whole}[{k}]" in keys for k in range(3)) else whole


def quantity(mission: Mission, key: str) -> str:
    """A mission's own value of a numeric key with its unit, as text."""
    allowed = number(key)
    return f"{stated_value(mission, key):g} {allowed.unit if allowed else ''}"


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
