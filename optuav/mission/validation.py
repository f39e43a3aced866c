"""From a stated document to a valid mission, or to all that is wrong with it at once."""

from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple, TypeAlias, TypeVar

from pydantic import BaseModel, ValidationError

from optuav.errors import Fault, InputError, safe_name
from optuav.mission import schema
from optuav.mission.messages import allowed, nearest, shown, table
from optuav.mission.schema import RATE_PER_MINUTE, REGIME_KEYS, SCHEMA, SECTIONS

Document: TypeAlias = dict[str, Any]  # Tables and values by name, as a TOML file gives them

Key: TypeAlias = tuple[str | int, ...]
"""The place of a value: ``("limits", "min_soc")``, ``("buildings", 2, "position_m")``."""

KEYS = {
    name: {*section.model_fields, *({"flow_rate_per_min"} if name == "battery" else ())}
    for name, section in SECTIONS.items()
}
"""The keys that a file may state, by table."""

RESERVED_NAMES = ("origin", "hover", "destination")
MOST_SUGGESTIONS = 50
MOST_TURNS = 20_000  # Of packs by the clock, up to the deadline: each is simulated, in some 60 µs
UNKNOWN = object()  # Stands for a value that is missing or not allowed by itself: no rule judges it

DOTTED = [f"{name}.{key}" for name, keys in KEYS.items() if name != "buildings" for key in keys]
_HOME = {key.partition(".")[2]: key for key in DOTTED}
_RATE: Key = ("battery", "flow_rate_per_s")
_RATE_PER_MINUTE: Key = ("battery", "flow_rate_per_min")
_CHARGING = ("charge_current_A", "charge_power_W")

AnyModel = TypeVar("AnyModel", bound=BaseModel)


class Breach(NamedTuple):
    """A key whose value is not allowed, and what would be."""

    key: Key
    allowed: str


@dataclass(frozen=True)
class StatedMission:
    """A mission as it was stated, valid or not."""

    document: Document
    # The file in which a key, a table or (by the empty key) anything else was stated.
    sources: Mapping[Key, str] = field(default_factory=dict)
    # Keys of the mission underneath, each with the dotted key whose new value displaces it.
    displaced: Mapping[Key, str] = field(default_factory=dict)

    def faults(self, breaches: Iterable[Breach]) -> list[Fault]:
        """One fault for each key: its first breach with dotted key, value and source."""
        first: dict[Key, str] = {}
        for key, words in breaches:
            first.setdefault(key, words)
        found, source = list[Fault](), self.sources.get
        for key, words in first.items():
            value = "" if self.value(key) is UNKNOWN else shown(self.value(key))
            file = source(key[:2]) or source(key[:1]) or source((), "")
            found.append(Fault(self._dotted(key), value, words, file))
        return found

    def value(self, key: Key) -> object:
        """What is stated for a key, or UNKNOWN."""
        value: object = self.document
        for part in key:
            if isinstance(value, dict):
                value = value.get(part, UNKNOWN)
            elif isinstance(value, list | tuple) and isinstance(part, int):
                value = value[part]
            else:
                return UNKNOWN
        return value

    def _dotted(self, key: Key) -> str:
        """The key as a person writes it; a building goes by its name where no other has it."""
        if key[0] != "buildings" or len(key) == 1:
            return ".".join(map(safe_name, key))
        name = self._names.get(key[1])
        building = f"buildings[{key[1]}]" if name is None else f"buildings.{name}"
        return ".".join([building, *map(safe_name, key[2:])])

    @cached_property
    def _names(self) -> dict[str | int, str]:
        """Names that only one building has, by its place in the list."""
        stated = [keys_of(building).get("name") for building in self.document["buildings"]]
        names = [name if isinstance(name, str) else "" for name in stated]
        uses = Counter(names)
        return {n: x for n, x in enumerate(names) if x and uses[x] == 1 and x == safe_name(x)}


def keys_of(table: object) -> Document:
    """The keys of a table with their values; none of what is no table."""
    return table if isinstance(table, dict) else {}


def validate(
    model: type[AnyModel],
    stated: StatedMission,
    faults: Collection[Fault] = (),
    *,
    whole: bool = True,
) -> AnyModel:
    """The mission that was stated, or an `InputError` with every fault, known ones among them.

    Unless the `whole` statement was read, missing keys and rules of several keys are not judged.
    """
    breaches: list[Breach] = []
    try:
        mission = model.model_validate(stated.document)
        if not faults:
            return mission
    except ValidationError as error:
        breaches += breaches_of(model, error, stated)
        if whole and SECTIONS.keys() <= model.model_fields.keys():
            breaches += rules(_without(stated.document, {key for key, _ in breaches}))
        elif not whole:
            breaches = [each for each in breaches if stated.value(each.key) is not UNKNOWN]
    raise InputError([*faults, *stated.faults(breaches)])


def format_breaches(document: Document) -> list[Breach]:
    """Whether a document states the version of its format, and one that can be read."""
    words = f"{SCHEMA}, the version of this format"
    if "schema" not in document:
        return [Breach(("schema",), f"is missing; {words}")]
    stated = document["schema"]
    return [] if type(stated) is int and stated == SCHEMA else [Breach(("schema",), words)]


def breaches_of(
    model: type[BaseModel], error: ValidationError, stated: StatedMission
) -> Iterator[Breach]:
    """Pydantic's errors by key and in our words; what the rules said is left to the rules."""
    suggestions = 0
    for detail in error.errors(include_url=False, include_context=False, include_input=False):
        key = _key(detail["loc"])
        if not key or (key == _RATE and stated.value(_RATE_PER_MINUTE) is not UNKNOWN):
            continue
        name = str(key[0])
        if detail["type"] in ("extra_forbidden", "invalid_key"):
            suggestions += 1
            known = {*model.model_fields, "schema", "extends"} if len(key) == 1 else KEYS[name]
            likely = known if suggestions <= MOST_SUGGESTIONS else ()
            yield Breach(key, _unknown(key, likely, stated))
            continue
        if name not in SECTIONS or key == ("buildings",):
            words = allowed(model, name)
        else:
            words = allowed(SECTIONS[name], str(key[-1])) if key[-1] in KEYS[name] else table(name)
        if stated.value(key) is UNKNOWN:
            by = stated.displaced.get(key)
            why = f"; a new {by} displaces the old one, state both" if by else ""
            words = f"is missing; {words}{why}"
        yield Breach(key, words)


def _key(location: tuple[int | str, ...]) -> Key:
    """Where pydantic found an error: no finer than a key, without its tag of the flight model."""
    if location[:1] == ("flight",):
        return ("flight", *location[2:3])
    return location[:3] if location[:1] == ("buildings",) else location[:2]


def _unknown(key: Key, known: Iterable[str], stated: StatedMission) -> str:
    """What is said of a key that no table has, or that has no meaning here."""
    name = str(key[-1])
    if key == _RATE_PER_MINUTE:
        both = stated.value(_RATE) is not UNKNOWN
        return "either flow_rate_per_s or flow_rate_per_min" if both else RATE_PER_MINUTE.words
    if key == ("extends",):
        return "only in a mission file"
    if key[0] == "flight" and name in REGIME_KEYS:
        return 'only with flight.model = "regimes"'
    if name in _HOME:
        return f"unknown key; did you mean '{_HOME[name]}'?"
    return f"unknown key{nearest(name, known)}"


def _without(value: Any, faulty: Collection[Key], place: Key = ()) -> Any:
    """The document with UNKNOWN in the place of what is in breach."""
    if place in faulty:
        return UNKNOWN
    if isinstance(value, dict):
        return {key: _without(each, faulty, (*place, key)) for key, each in value.items()}
    if place == ("buildings",):
        return [_without(each, faulty, (*place, number)) for number, each in enumerate(value)]
    return value


def rules(document: Document) -> Iterator[Breach]:
    """Breaches of the rules that bind several keys, of a document without None."""
    limits, battery = keys_of(document.get("limits")), keys_of(document.get("battery"))
    low, high = (limits.get(f"{end}_altitude_m", UNKNOWN) for end in ("min", "max"))
    if UNKNOWN not in (low, high) and low > high:
        yield Breach(("limits", "max_altitude_m"), f"a number, x >= min_altitude_m = {low:g} [m]")
    schedule = battery.get("schedule", "pooled")
    if schedule == "alternating" and "period_s" not in battery:
        words = f'{allowed(schema.BatteryPacks, "period_s")}, needed by schedule = "alternating"'
        yield Breach(("battery", "period_s"), f"is missing; {words}")
    elif schedule not in ("alternating", UNKNOWN) and "period_s" in battery:
        yield Breach(("battery", "period_s"), 'goes with schedule = "alternating" only')
    deadline_s, period_s = limits.get("deadline_s", UNKNOWN), battery.get("period_s", UNKNOWN)
    if UNKNOWN not in (deadline_s, period_s) and period_s < (least_s := deadline_s / MOST_TURNS):
        words = f"a number, x >= limits.deadline_s / {MOST_TURNS} = {least_s:g} [s]"
        yield Breach(("battery", "period_s"), f"{words}, as every turn is simulated")
    if isinstance(laser := document.get("laser"), dict):
        twins = [key for key in ("visibility_km", "attenuation_per_km") if key in laser]
        if len(twins) == 2:
            yield Breach(("laser", twins[0]), f"either {' or '.join(twins)}, not both")
        elif not twins:
            words = f"{allowed(schema.Laser, 'attenuation_per_km')}; or state visibility_km"
            yield Breach(("laser", "attenuation_per_km"), f"is missing; {words}")
    if isinstance(flight := document.get("flight", {}), dict):
        # What a flight model needs of other tables, and what has no meaning with it.
        model, needed = flight.get("model", "rotors"), dict[str, str]()
        if model == "rotors":
            needed = dict.fromkeys(("rotor", "body"), 'model = "rotors"')
        elif model == "regimes":
            if charging := [key for key in _CHARGING if key in flight]:
                needed = {"laser": charging[0]}
                for key in {*_CHARGING}.difference(charging):
                    words = f"is missing; {allowed(schema.RegimeFlight, key)}, stated together"
                    yield Breach(("flight", key), f"{words} with {charging[0]}")
            force = keys_of(document.get("wind")).get("force_N", UNKNOWN)
            if force is not UNKNOWN and any(force):
                yield Breach(("wind", "force_N"), '[0, 0, 0] with flight.model = "regimes"')
        for name, by in needed.items():
            if name not in document:
                yield Breach((name,), f"is missing; {table(name)}, needed by flight.{by}")
    if buildings := document.get("buildings"):
        yield from _buildings([] if buildings is UNKNOWN else list(map(keys_of, buildings)))


def _buildings(buildings: Sequence[Document]) -> Iterator[Breach]:
    """Names that a building may not have, and polygons that are no footprints."""
    first, rings = dict[str, int](), dict[int, Sequence[Sequence[float]]]()
    for place, building in enumerate(buildings):
        name, footprint = building.get("name", UNKNOWN), building.get("footprint_m")
        if name in RESERVED_NAMES:
            words = f"a name other than {', '.join(RESERVED_NAMES)}"
            yield Breach(("buildings", place, "name"), words)
        elif name is not UNKNOWN and first.setdefault(name, place) != place:
            words = f"a name of its own; buildings[{first[name]}] has this one"
            yield Breach(("buildings", place, "name"), words)
        # A size needs no judging: its centre is the position.
        if isinstance(footprint, list | tuple) and isinstance(footprint[0], list | tuple):
            rings[place] = footprint
    if not rings:
        return
    import numpy as np
    import shapely

    corners = np.array([corner for ring in rings.values() for corner in ring], dtype=float)
    ring_of = np.repeat(np.arange(len(rings)), [len(ring) for ring in rings.values()])
    polygons = np.asarray(shapely.polygons(shapely.linearrings(corners, indices=ring_of)))
    proper = np.asarray(shapely.is_valid(polygons) & (shapely.area(polygons) > 0))
    for place, polygon, is_proper in zip(rings, polygons, proper, strict=True):
        at = buildings[place].get("position_m", UNKNOWN)
        if not is_proper:
            words = "a polygon with an area, whose edges meet at its corners only"
        elif at is not UNKNOWN and not shapely.intersects_xy(polygon, *at[:2]):
            words = "a polygon that contains x and y of position_m"
        else:
            continue
        yield Breach(("buildings", place, "footprint_m"), words)
