"""From a stated document to a valid mission, or to all that is wrong with it at once."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from typing import TypeVar

from pydantic import BaseModel, ValidationError

from optuav.errors import Fault, InputError
from optuav.mission.messages import (
    Breach,
    Document,
    Key,
    StatedMission,
    allowed,
    keys_of,
    nearest,
    table,
)
from optuav.mission.schema import (
    RATE_PER_MINUTE,
    REGIME_KEYS,
    SCHEMA,
    SECTIONS,
    BatteryPacks,
    Laser,
    RegimeFlight,
)

KEYS = {
    name: {*section.model_fields, *({"flow_rate_per_min"} if name == "battery" else ())}
    for name, section in SECTIONS.items()
}
"""The keys that a file may state, by table."""

RESERVED_NAMES = ("origin", "hover", "destination")
MOST_SUGGESTIONS = 50

_HOME = {key: f"{name}.{key}" for name, keys in KEYS.items() if name != "buildings" for key in keys}
_RATE: Key = ("battery", "flow_rate_per_s")
_RATE_PER_MINUTE: Key = ("battery", "flow_rate_per_min")
_ATTENUATION = ("visibility_km", "attenuation_per_km")
_CHARGING = ("charge_current_A", "charge_power_W")

AnyModel = TypeVar("AnyModel", bound=BaseModel)


def validate(
    model: type[AnyModel],
    stated: StatedMission,
    faults: Collection[Fault] = (),
    *,
    whole: bool = True,
) -> AnyModel:
    """The mission that was stated, or an `InputError` with every fault, known ones among them.

    Where not the `whole` statement could be read, nothing counts as missing, and the rules that
    bind several keys are not judged.
    """
    breaches: list[Breach] = []
    try:
        mission = model.model_validate(stated.document)
        if not faults:
            return mission
    except ValidationError as error:
        breaches += _breaches(model, error, stated)
        if whole:
            breaches += rules(stated.document, _valid_part(stated.document, breaches))
        else:
            breaches = [breach for breach in breaches if stated.holds(breach.key)]
    raise InputError([*faults, *stated.faults(breaches)])


def format_breaches(document: Document) -> list[Breach]:
    """Whether a document states the version of its format, and one that can be read."""
    words = f"{SCHEMA}, the version of this format"
    if "schema" not in document:
        return [Breach(("schema",), f"is missing; {words}")]
    schema = document["schema"]
    return [] if type(schema) is int and schema == SCHEMA else [Breach(("schema",), words)]


def _breaches(
    model: type[BaseModel], error: ValidationError, stated: StatedMission
) -> Iterator[Breach]:
    """Pydantic's errors by key and in our words; what the rules said is left to the rules."""
    suggestions = 0
    for detail in error.errors(include_url=False, include_context=False, include_input=False):
        key = _key(detail["loc"])
        if not key or (key == _RATE and stated.holds(_RATE_PER_MINUTE)):
            continue
        if detail["type"] in ("extra_forbidden", "invalid_key"):
            suggestions += 1
            known = _known(model, key) if suggestions <= MOST_SUGGESTIONS else ()
            yield Breach(key, _unknown(key, known, stated))
        elif stated.holds(key):
            yield Breach(key, _words(model, key))
        else:
            yield stated.missing(key, _words(model, key))


def _key(location: tuple[int | str, ...]) -> Key:
    """Where pydantic found an error: no finer than a key, without its tag of the flight model."""
    if location[:1] == ("flight",):
        return ("flight", *location[2:3])
    return location[:3] if location[:1] == ("buildings",) else location[:2]


def _words(model: type[BaseModel], key: Key) -> str:
    name = str(key[0])
    if name not in SECTIONS or key == ("buildings",):
        return allowed(model, name)
    return allowed(SECTIONS[name], str(key[-1])) if key[-1] in KEYS[name] else table(name)


def _known(model: type[BaseModel], key: Key) -> Iterable[str]:
    return {*model.model_fields, "schema", "extends"} if len(key) == 1 else KEYS[str(key[0])]


def _unknown(key: Key, known: Iterable[str], stated: StatedMission) -> str:
    name = str(key[-1])
    if key == _RATE_PER_MINUTE:
        both = stated.holds(_RATE)
        return "either flow_rate_per_s or flow_rate_per_min" if both else RATE_PER_MINUTE.words
    if key == ("extends",):
        return "only in a mission file"
    if key[0] == "flight" and name in REGIME_KEYS:
        return 'only with flight.model = "regimes"'
    if name in _HOME:
        return f"unknown key; did you mean '{_HOME[name]}'?"
    return f"unknown key{nearest(name, known)}"


def _valid_part(document: Document, breaches: Iterable[Breach]) -> Document:
    """The document without what is in breach; a building in breach as a whole stays, empty."""
    faulty = {key for key, _ in breaches}

    def valid(table: object, *place: str | int) -> Document:
        if place in faulty or not isinstance(table, dict):
            return {}
        return {key: value for key, value in table.items() if (*place, key) not in faulty}

    tables = {name: valid(table, name) for name, table in document.items() if name != "buildings"}
    buildings = () if ("buildings",) in faulty else document.get("buildings", ())
    return tables | {"buildings": [valid(item, "buildings", n) for n, item in enumerate(buildings)]}


def rules(stated: Document, valid: Document) -> Iterator[Breach]:
    """Breaches of the rules that bind several keys.

    The valid document lacks the values that are not allowed by themselves, and has every building;
    a rule is not judged where it needs a value that is missing there.
    """
    limits = keys_of(valid.get("limits"))
    low, high = limits.get("min_altitude_m"), limits.get("max_altitude_m")
    if low is not None and high is not None and low > high:
        yield Breach(("limits", "max_altitude_m"), f"a number, x >= min_altitude_m = {low:g} [m]")
    yield from _battery(keys_of(stated.get("battery")), keys_of(valid.get("battery")))
    if isinstance(stated.get("laser"), dict):
        yield from _laser(stated["laser"])
    if isinstance(stated.get("flight", {}), dict):
        yield from _flight(stated, valid)
    yield from _names(valid.get("buildings", ()))
    yield from _footprints(valid.get("buildings", ()))


def _battery(stated: Document, valid: Document) -> Iterator[Breach]:
    if "schedule" in stated and "schedule" not in valid:
        return
    if valid.get("schedule", "pooled") != "alternating":
        if "period_s" in stated:
            yield Breach(("battery", "period_s"), 'goes with schedule = "alternating" only')
    elif "period_s" not in stated:
        words = f'{allowed(BatteryPacks, "period_s")}, needed by schedule = "alternating"'
        yield Breach(("battery", "period_s"), f"is missing; {words}")


def _laser(laser: Document) -> Iterator[Breach]:
    stated = [key for key in _ATTENUATION if key in laser]
    if len(stated) == 2:
        yield Breach(("laser", stated[0]), f"either {' or '.join(stated)}, not both")
    if not stated:
        words = allowed(Laser, "attenuation_per_km")
        yield Breach(
            ("laser", "attenuation_per_km"), f"is missing; {words}; or state visibility_km"
        )


def _flight(stated: Document, valid: Document) -> Iterator[Breach]:
    flight = keys_of(stated.get("flight"))
    model = keys_of(valid.get("flight")).get("model") if "model" in flight else "rotors"
    if model == "rotors":
        for name in ("rotor", "body"):
            if name not in stated:
                words = f'{table(name)}, needed by flight.model = "rotors"'
                yield Breach((name,), f"is missing; {words}")
    elif model == "regimes":
        charging = [key for key in _CHARGING if key in flight]
        for key in set(_CHARGING).difference(charging) if charging else ():
            words = f"{allowed(RegimeFlight, key)}, stated together with {charging[0]}"
            yield Breach(("flight", key), f"is missing; {words}")
        if charging and "laser" not in stated:
            words = f"{table('laser')}, needed by flight.{charging[0]}"
            yield Breach(("laser",), f"is missing; {words}")
        if any(keys_of(valid.get("wind")).get("force_N", ())):
            yield Breach(("wind", "force_N"), '[0, 0, 0] with flight.model = "regimes"')


def _names(buildings: Sequence[Document]) -> Iterator[Breach]:
    first: dict[str, int] = {}
    for place, building in enumerate(buildings):
        name = building.get("name")
        if name in RESERVED_NAMES:
            words = f"a name other than {', '.join(RESERVED_NAMES)}"
            yield Breach(("buildings", place, "name"), words)
        elif name is not None and first.setdefault(name, place) != place:
            words = f"a name of its own; buildings[{first[name]}] has this one"
            yield Breach(("buildings", place, "name"), words)


def _footprints(buildings: Sequence[Document]) -> Iterator[Breach]:
    """Judge all polygons at once; a size needs no judging, its centre is the position."""
    rings = {
        place: _open(building["footprint_m"])
        for place, building in enumerate(buildings)
        if isinstance(building.get("footprint_m", (0,))[0], list | tuple)
    }
    if not rings:
        return
    import numpy as np
    import shapely

    closable = [place for place, ring in rings.items() if len(ring) >= 3]
    corners = np.array([corner for place in closable for corner in rings[place]], dtype=float)
    ring_of = np.repeat(np.arange(len(closable)), [len(rings[place]) for place in closable])
    lines = shapely.linearrings(corners.reshape(-1, 2), indices=ring_of)
    polygons = np.asarray(shapely.polygons(lines), dtype=object)
    proper = shapely.is_valid(polygons) & (shapely.area(polygons) > 0)
    simple = {closable[n]: polygons[n] for n in np.flatnonzero(proper)}
    placed = [place for place in simple if "position_m" in buildings[place]]
    points = np.array([buildings[place]["position_m"] for place in placed], dtype=float)
    inside = shapely.intersects_xy([simple[n] for n in placed], *points.reshape(-1, 3).T[:2])
    outside = {placed[n] for n in np.flatnonzero(~inside)}
    for place in rings:
        if place not in simple:
            words = "a polygon with an area, whose edges meet at its corners only"
            yield Breach(("buildings", place, "footprint_m"), words)
        elif place in outside:
            words = "a polygon that contains x and y of position_m"
            yield Breach(("buildings", place, "footprint_m"), words)


def _open(ring: Sequence[Sequence[float]]) -> Sequence[Sequence[float]]:
    """The corners without those at the end that repeat the first."""
    corners = list(ring)
    while len(corners) > 1 and corners[-1] == corners[0]:
        corners.pop()
    return corners
