"""From a stated document to a valid mission, or to all that is wrong with it at once."""

from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple, TypeAlias, TypeVar

from pydantic import BaseModel, ValidationError

from optuav import tables
from optuav.errors import Fault, InputError, safe_name
from optuav.fields import RATE_PER_MINUTE
from optuav.flight.model import BENDING, BENT, FLIGHTS, FlightModel
from optuav.laser.beam import BEAM, BEAMS, Beam
from optuav.laser.fits import Laser
from optuav.mission.buildings import RESERVED_NAMES, Buildings, misnamed, misshapen
from optuav.mission.forms import CHOICES, LISTS, SCHEMA, SECTIONS, SINGLE, TABLES, table_keys
from optuav.mission.messages import first_ten, nearest, range_in_words, shown, table
from optuav.presentation.numbers import figure, short

Document: TypeAlias = dict[str, Any]  # Tables and values by name, as a TOML file gives them

Key: TypeAlias = tuple[str | int, ...]
"""The place of a value: ``("limits", "min_soc")``, ``("buildings", 2, "position_m")``."""

MOST_SUGGESTIONS = 50
MOST_TURNS = 20_000  # Pack changes by the clock until the deadline; simulating one takes some 60 µs
START_ROUNDING = 1e-6  # Share of the capacity that wells of [start] may miss their limits by
WHOLE_SHARE = 1e-9  # By how much shares of devices may miss 1
UNKNOWN = object()  # Stands for a value that is missing or not allowed by itself: no rule judges it

_RATE: Key = ("battery", "flow_rate_per_s")
_RATE_PER_MINUTE: Key = ("battery", "flow_rate_per_min")

AnyModel = TypeVar("AnyModel", bound=BaseModel)


class Breach(NamedTuple):
    """A key whose value is not allowed, and what would be."""

    key: Key
    allowed: str


@dataclass(frozen=True)
class StatedMission:
    """A mission as it was stated, valid or not."""

    document: Document
    # The file that stated a key, a table or (by the empty key) anything else.
    sources: Mapping[Key, str] = field(default_factory=dict)
    # Keys of the mission underneath, each with the dotted key whose new value displaces it.
    displaced: Mapping[Key, str] = field(default_factory=dict)

    def faults(self, breaches: Iterable[Breach]) -> list[Fault]:
        """One fault for each key: its first breach with dotted key, value and source."""
        first: dict[Key, str] = {}
        for key, words in breaches:
            first.setdefault(key, words)
        faults, source = list[Fault](), self.sources.get
        for key, words in first.items():
            value = self._shown(key)
            file = source(key[:2]) or source(key[:1]) or source((), "")
            faults.append(Fault(self._dotted(key), value, words, file))
        return faults

    def _shown(self, key: Key) -> str:
        """The value of a key as text; empty without one, of devices their number."""
        value = self.value(key)
        if key == ("devices",) and isinstance(value, list | tuple) and value:
            return f"{len(value)} tables"
        return "" if value is UNKNOWN else shown(value)

    def value(self, key: Key) -> object:
        """Return the value stated for a key, or UNKNOWN."""
        value: object = self.document
        for part in key:
            if isinstance(value, dict):
                value = value.get(part, UNKNOWN)
            elif isinstance(value, Buildings) and isinstance(part, int):
                value = value.row(part)
            elif isinstance(value, list | tuple) and isinstance(part, int):
                value = value[part]
            else:
                return UNKNOWN
        return value

    def _dotted(self, key: Key) -> str:
        """The key as a person writes it; an item goes by its name where no other has it."""
        if key[0] not in LISTS or len(key) == 1:
            return ".".join(map(safe_name, key))
        name = self._names[key[0]].get(key[1])
        item = f"{key[0]}[{key[1]}]" if name is None else f"{key[0]}.{name}"
        return ".".join([item, *map(safe_name, key[2:])])

    @cached_property
    def _names(self) -> dict[str | int, dict[str | int, str]]:
        """Names that only one building or device has, by its place in its list."""
        by_list = dict[str | int, dict[str | int, str]]()
        for key in LISTS:
            names = [x if isinstance(x, str) else "" for x in names_of(self.document.get(key, ()))]
            uses = Counter(names)
            by_list[key] = {
                n: x for n, x in enumerate(names) if x and uses[x] == 1 and x == safe_name(x)
            }
        return by_list


def names_of(stated: object) -> list[Any]:
    """The names of buildings or devices as they are stated, whatever they are."""
    if isinstance(stated, Buildings):
        return [*stated.names]
    listed = stated if isinstance(stated, list | tuple) else ()
    return [keys_of(table).get("name") for table in listed]


def keys_in_file(table: str) -> set[str]:
    """The keys that a file may state in a table."""
    return {*table_keys(table), *({"flow_rate_per_min"} if table == "battery" else ())}


def dotted_keys() -> Iterator[str]:
    """The keys that a file may state outside the lists of devices and buildings."""
    for name in SINGLE:
        yield from (f"{name}.{key}" for key in keys_in_file(name))


def keys_of(table: object) -> Document:
    """The keys of a table with their values; none for other values."""
    return table if isinstance(table, dict) else {}


def validate(
    model: type[AnyModel],
    stated_mission: StatedMission,
    faults: Collection[Fault] = (),
    *,
    whole: bool = True,
) -> AnyModel:
    """The mission that was stated, or an `InputError` with every fault, known ones among them.

    Unless the `whole` statement was read, missing keys and rules of several keys are not judged.
    """
    breaches: list[Breach] = []
    try:
        mission = model.model_validate(stated_mission.document)
        if not faults:
            return mission
    except ValidationError as error:
        breaches += breaches_of(model, error, stated_mission)
        if whole and SECTIONS.keys() <= model.model_fields.keys():
            breaches += rules(mask_faulty(stated_mission.document, {key for key, _ in breaches}))
            # Of a table that has no place in the mission, nothing is missing.
            refused = {key for key, _ in breaches if len(key) == 1}
            breaches = [
                breach
                for breach in breaches
                if len(breach.key) == 1
                or breach.key[:1] not in refused
                or stated_mission.value(breach.key) is not UNKNOWN
            ]
        elif not whole:
            breaches = [
                breach for breach in breaches if stated_mission.value(breach.key) is not UNKNOWN
            ]
    raise InputError([*faults, *stated_mission.faults(breaches)])


def format_breaches(document: Document) -> list[Breach]:
    """Faults of the format version that a document states."""
    words = f"{SCHEMA}, the version of this format"
    if "schema" not in document:
        return [Breach(("schema",), f"is missing: add the line schema = {words}")]
    version = document["schema"]
    return [] if type(version) is int and version == SCHEMA else [Breach(("schema",), words)]


def breaches_of(
    model: type[BaseModel], error: ValidationError, stated_mission: StatedMission
) -> Iterator[Breach]:
    """Pydantic's errors by key and in our words; the rules report their own."""
    suggestions = 0
    for detail in error.errors(include_url=False, include_context=False, include_input=False):
        location = detail["loc"]  # Finer than a key, inside its value
        key = location[: 3 if location[:1] and location[0] in LISTS else 2]
        if not key or (key == _RATE and stated_mission.value(_RATE_PER_MINUTE) is not UNKNOWN):
            continue
        if detail["type"] in ("extra_forbidden", "invalid_key"):
            suggestions += 1
            yield Breach(
                key, _unknown(key, model, stated_mission, suggests=suggestions <= MOST_SUGGESTIONS)
            )
            continue
        name, last = str(key[0]), str(key[-1])
        if name not in TABLES or (len(key) == 1 and name in LISTS):
            words = range_in_words(model, name)
        else:
            form = table_keys(name).get(last)
            words = range_in_words(form, last) if form else table(name)
        if stated_mission.value(key) is UNKNOWN:
            if (choice := CHOICES.get(name)) and choice.is_misspelt(
                stated_mission.document.get(name)
            ):
                continue  # Nobody knows what the form that is meant lacks
            by = stated_mission.displaced.get(key)
            why = f"; a new {by} replaces the old one; set both" if by else ""
            words = f"is missing; {words}{why}"
        yield Breach(key, words)


def _unknown(
    key: Key, model: type[BaseModel], stated_mission: StatedMission, *, suggests: bool
) -> str:
    """Return the words on a key that no table has, or that has no meaning here."""
    name = str(key[-1])
    if key == _RATE_PER_MINUTE:
        both = stated_mission.value(_RATE) is not UNKNOWN
        return "either flow_rate_per_s or flow_rate_per_min" if both else RATE_PER_MINUTE.words
    if key in (("extends",), ("buildings_file",), ("devices_file",)):
        return "only in a mission file"
    if choice := CHOICES.get(str(key[0])):
        if models := choice.models_with(name):
            words = " or ".join(f'"{model}"' for model in models)
            return f"only with {key[0]}.{choice.key} = {words}"
        if choice.plain and name in choice.plain.model_fields:
            return f"only without {key[0]}.{choice.key}"
    for home in dotted_keys():
        if home.endswith(f".{name}"):
            return f"unknown key; did you mean '{home}'?"
    of_file = {*model.model_fields, "schema", "extends", "buildings_file", "devices_file"}
    keys = of_file if len(key) == 1 else keys_in_file(str(key[0]))
    return f"unknown key{nearest(name, keys) if suggests else ''}"


def mask_faulty(value: Any, faulty: Collection[Key], place: Key = ()) -> Any:
    """The document with UNKNOWN in place of faulty values."""
    if place in faulty:
        return UNKNOWN
    if isinstance(value, dict):
        return {key: mask_faulty(item, faulty, (*place, key)) for key, item in value.items()}
    if len(place) == 1 and place[0] in LISTS and isinstance(value, list | tuple):
        return [mask_faulty(item, faulty, (*place, number)) for number, item in enumerate(value)]
    return value


def rules(document: Document) -> Iterator[Breach]:
    """Breaches of the rules that bind several keys, of a document without None."""
    limits, battery = keys_of(document.get("limits")), keys_of(document.get("battery"))
    low, high = (limits.get(f"{end}_altitude_m", UNKNOWN) for end in ("min", "max"))
    if UNKNOWN not in (low, high) and low > high:
        yield Breach(
            ("limits", "max_altitude_m"), f"a number, x >= min_altitude_m = {short(low)} [m]"
        )
    schedule = battery.get("schedule", "pooled")
    if schedule == "alternating" and "period_s" not in battery:
        words = (
            f'{range_in_words(tables.BatteryPacks, "period_s")}, needed by schedule = "alternating"'
        )
        yield Breach(("battery", "period_s"), f"is missing; {words}")
    elif schedule not in ("alternating", UNKNOWN) and "period_s" in battery:
        yield Breach(("battery", "period_s"), 'goes with schedule = "alternating" only')
    deadline_s, period_s = limits.get("deadline_s", UNKNOWN), battery.get("period_s", UNKNOWN)
    if UNKNOWN not in (deadline_s, period_s) and period_s < (least_s := deadline_s / MOST_TURNS):
        words = f"a number, x >= limits.deadline_s / {MOST_TURNS} = {short(least_s)} [s]"
        yield Breach(("battery", "period_s"), f"{words}, as every turn is simulated")
    yield from _rules_of_start(keys_of(document.get("start")), battery)
    if isinstance(laser := document.get("laser"), dict):
        twins = [key for key in ("visibility_km", "attenuation_per_km") if key in laser]
        if len(twins) == 2:
            yield Breach(("laser", twins[0]), f"either {' or '.join(twins)}, not both")
        elif not twins:
            words = f"{range_in_words(Laser, 'attenuation_per_km')}; or set visibility_km"
            yield Breach(("laser", "attenuation_per_km"), f"is missing; {words}")
        if (beam := laser.get("beam")) in [*BEAMS]:
            yield from _rules_of_model(document, BEAMS[beam], f'laser.beam = "{beam}"')
    if "receiver" in document and laser is not UNKNOWN and "beam" not in keys_of(laser):
        words = "; without [laser], remove [receiver] too" * (laser is None)
        yield Breach(("receiver",), f"only with laser.beam = {BEAM.listed}{words}")
    origin = {"latitude_deg", "longitude_deg"} & keys_of(document.get("earth")).keys()
    if origin and document.get("crs"):
        yield from (Breach(("earth", key), "not beside crs") for key in sorted(origin))
    elif len(origin) == 1 and document["earth"][min(origin)] is not UNKNOWN:
        (other,) = {"latitude_deg", "longitude_deg"} - origin
        words = f"is missing; {range_in_words(tables.Earth, other)}, needed beside {min(origin)}"
        yield Breach(("earth", other), words)
    if isinstance(flight := document.get("flight", {}), dict):
        name, flight = flight.get("model", "rotors"), {"model": "rotors", **flight}
        if name in [*FLIGHTS]:
            by = f'flight.model = "{name}"'
            yield from _rules_of_model({**document, "flight": flight}, FLIGHTS[name], by)
        yield from _rules_of_ways(flight)
    yield from _rules_of_devices(document)
    yield from rules_of_buildings(document)


def _rules_of_devices(document: Document) -> Iterator[Breach]:
    """One device or a list of them, with names of their own and shares of the whole."""
    link, route = (document.get(name, UNKNOWN) for name in ("link", "route"))
    if "devices" not in document:
        if isinstance(link, dict) and "device_m" not in link:
            words = range_in_words(tables.Link, "device_m")
            yield Breach(("link", "device_m"), f"is missing; {words}; or set [[devices]]")
        return
    for table_of, key in ((link, ("link", "device_m")), (route, ("route", "hover_m"))):
        if key[1] in keys_of(table_of):
            yield Breach(key, "not beside [[devices]], where each device has its own")
    if not isinstance(listed := document["devices"], list | tuple):
        return
    devices, buildings = [*map(keys_of, listed)], document.get("buildings", ())
    taken = dict.fromkeys(RESERVED_NAMES, f"a name other than {', '.join(RESERVED_NAMES)}")
    of_buildings = {*names_of(buildings)}
    for number, device in enumerate(devices):
        if not isinstance(name := device.get("name"), str):
            continue
        if name in taken:
            yield Breach(("devices", number, "name"), taken[name])
        elif name in of_buildings:
            yield Breach(("devices", number, "name"), "a name that no building has")
        elif "," in name or name != name.strip():
            words = "a name without commas, and without blanks at its ends, as device_order"
            yield Breach(("devices", number, "name"), f"{words} lists names with commas")
        taken.setdefault(name, f"a name of its own; devices[{number}] has this one")
    shares = [device.get("share") for device in devices]
    if known := [share for share in shares if share is not None]:
        for number, share in enumerate(shares):
            if share is None:
                words = range_in_words(tables.Device, "share")
                words = f"is missing; {words}, as other devices have one"
                yield Breach(("devices", number, "share"), words)
        total = sum(share for share in known if share is not UNKNOWN)
        if len(known) == len(shares) and UNKNOWN not in known and abs(total - 1.0) > WHOLE_SHARE:
            pairs = zip(devices, known, strict=True)
            words_of = (f"{figure(share, 10)} of {device.get('name')}" for device, share in pairs)
            words = f"must have shares that add up to 1; {first_ten([*words_of])} make "
            yield Breach(("devices",), words + figure(total, 10))


def _rules_of_start(start: Document, battery: Document) -> Iterator[Breach]:
    """Wells without each other, beside a state of charge, or beyond their sizes."""
    wells = start.keys() & {"available_As", "bound_As"}
    if wells and "soc" in start:
        yield Breach(("start", "soc"), "either soc, or available_As and bound_As")
    if len(wells) == 1:
        (lacking,) = {"available_As", "bound_As"} - wells
        words = f"{range_in_words(tables.Start, lacking)}, needed beside {min(wells)}"
        yield Breach(("start", lacking), f"is missing; {words}")
    figures = [battery.get(key, UNKNOWN) for key in ("packs", "capacity_As", "available_fraction")]
    if UNKNOWN in figures:
        return
    packs, capacity_As, share = figures
    sizes = {"available_As": share, "bound_As": 1.0 - share}
    for key in sorted(wells):
        size_As, rounding_As = (packs * capacity_As * x for x in (sizes[key], START_ROUNDING))
        value = start[key]
        if value is not UNKNOWN and not -rounding_As <= value <= size_As + rounding_As:
            yield Breach(
                ("start", key), f"a number, 0 <= x <= {figure(size_As, 10)} [A s], the full well"
            )


def _rules_of_model(
    document: Document, model: type[FlightModel] | type[Beam], by: str
) -> Iterator[Breach]:
    """Yield faults if a model misses other tables, or refuses their keys."""
    for needed in model.needs:
        name, _, key = needed.partition(".")
        if not key and name not in document:
            yield Breach((name,), f"is missing; {table(name)}, needed by {by}")
        elif key and isinstance(own := document.get(name), dict) and key not in own:
            words = range_in_words(table_keys(name)[key], key)
            yield Breach((name, key), f"is missing; {words}, needed by {by}")
    for refused in model.refuses:
        name, *parts = refused.split(".")
        value, default = document.get(name), None
        if parts:
            value = keys_of(value).get(parts[0])
            default = table_keys(name)[parts[0]].model_fields[parts[0]].default
        if isinstance(value, list | tuple) and any(value):
            yield Breach((name, *parts), f"{[0] * len(value)} with {by}")
        elif not isinstance(value, list | tuple) and value not in (None, default, UNKNOWN):
            yield Breach((name, *parts), f"not with {by}")
    for (name, *parts), words in model.breaches(document):
        expected = ""
        if not parts and name not in document:
            expected = f"is missing; {table(name)}, "
        elif parts and parts[0] not in keys_of(document.get(name)):
            expected = f"is missing; {range_in_words(table_keys(name)[parts[0]], parts[0])}, "
        yield Breach((name, *parts), expected + words)


def _rules_of_ways(flight: Document) -> Iterator[Breach]:
    """Yield faults where keys of blocked legs do not go together."""
    rule = flight.get("obstacles")
    if rule and "through_buildings" in flight:
        yield Breach(("flight", "through_buildings"), "either obstacles or through_buildings")
    for key in () if rule in (*BENT, UNKNOWN) else BENDING:
        if key in flight:
            words = " or ".join(f'"{choice}"' for choice in BENT)
            yield Breach(("flight", key), f"goes with obstacles = {words} only")


def rules_of_buildings(document: Document) -> Iterator[Breach]:
    """Names that a building may not have, and polygons that are not footprints."""
    listed = document.get("buildings", ())
    if isinstance(listed, Buildings):
        for number, key, words in listed.breaches:
            yield Breach(("buildings", number, key), words)
        return
    buildings = [] if listed is UNKNOWN else [*map(keys_of, listed)]
    names = [building.get("name") for building in buildings]
    for number, words in misnamed(x if isinstance(x, str) else None for x in names):
        yield Breach(("buildings", number, "name"), words)
    rings: dict[int, Sequence[Sequence[float]]] = {}
    for number, building in enumerate(buildings):
        footprint = building.get("footprint_m")
        # A size needs no judging: its centre is the position.
        if isinstance(footprint, list | tuple) and isinstance(footprint[0], list | tuple):
            rings[number] = footprint
    if not rings:
        return
    import numpy as np

    corners_m = np.array([corner for ring in rings.values() for corner in ring], dtype=float)
    count, at_m = np.array([*map(len, rings.values())]), np.full((len(rings), 2), np.nan)
    for place, number in enumerate(rings):
        if (at := buildings[number].get("position_m", UNKNOWN)) is not UNKNOWN:
            at_m[place] = at[:2]
    numbers = [*rings]
    for ring, words in misshapen(corners_m, count, at_m):
        yield Breach(("buildings", numbers[ring], "footprint_m"), words)
