"""The words of a fault: its key, its value, what is allowed there, what may have been meant."""

from __future__ import annotations

import datetime
import difflib
import reprlib
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from decimal import Decimal
from functools import cache, cached_property, lru_cache
from typing import Any, NamedTuple, TypeAlias, get_args

from pydantic import BaseModel

from optuav.errors import Fault
from optuav.mission.schema import SECTIONS, Allowed, Number

LONGEST_TEXT = 60
LONGEST_NAME = 200
DIGITS = 15
"""Decimal digits that every float holds."""
UNPRINTABLE = "\N{REPLACEMENT CHARACTER}"

Document: TypeAlias = dict[str, Any]
"""Tables and values by name, as a TOML file gives them."""

Key: TypeAlias = tuple[str | int, ...]
"""The place of a value: ``("limits", "min_soc")``, ``("buildings", 2, "position_m")``."""

_NOTHING = object()


class Breach(NamedTuple):
    """A key whose value is not allowed, and what would be."""

    key: Key
    allowed: str


class StatedMission:
    """A mission as it was stated, valid or not.

    The `sources` are the files in which a key, a table or (by the empty key) anything else was
    stated; `displaced` has keys of the mission underneath, each with the dotted key that displaces
    it by its new value.
    """

    def __init__(
        self,
        document: Document,
        sources: Mapping[Key, str] | None = None,
        displaced: Mapping[Key, str] | None = None,
    ) -> None:
        self.document = document
        self.sources = sources or {}
        self.displaced = displaced or {}

    def faults(self, breaches: Iterable[Breach]) -> list[Fault]:
        """One fault for each key: its first breach with dotted key, value and source."""
        first: dict[Key, str] = {}
        for key, words in breaches:
            first.setdefault(key, words)
        source = self.sources.get
        return [
            Fault(
                self._dotted(key),
                shown(value) if (value := self._value(key)) is not _NOTHING else "",
                words,
                source(key[:2]) or source(key[:1]) or source((), ""),
            )
            for key, words in first.items()
        ]

    def holds(self, key: Key) -> bool:
        """Whether something is stated for the key."""
        return self._value(key) is not _NOTHING

    def missing(self, key: Key, words: str) -> Breach:
        """The breach of a key for which nothing is stated, or nothing any more."""
        by = self.displaced.get(key)
        why = f"; a new {by} displaces the old one, state both" if by else ""
        return Breach(key, f"is missing; {words}{why}")

    def _value(self, key: Key) -> object:
        value: object = self.document
        for part in key:
            if isinstance(value, dict):
                value = value.get(part, _NOTHING)
            elif isinstance(value, list | tuple) and isinstance(part, int):
                value = value[part]
            else:
                return _NOTHING
        return value

    def _dotted(self, key: Key) -> str:
        """The key as a person writes it; a building goes by its name where no other has it."""
        if key[0] != "buildings" or len(key) == 1:
            return ".".join(safe_name(part) for part in key)
        name = self._names.get(key[1])
        building = f"buildings[{key[1]}]" if name is None else f"buildings.{name}"
        return ".".join([building, *(safe_name(part) for part in key[2:])])

    @cached_property
    def _names(self) -> dict[str | int, str]:
        """Names that only one building has, by its place in the list."""
        buildings = self.document["buildings"]
        assert isinstance(buildings, list | tuple)
        names: dict[str | int, str] = {
            place: building["name"]
            for place, building in enumerate(buildings)
            if isinstance(building, dict) and isinstance(building.get("name"), str)
        }
        uses = Counter(names.values())
        return {
            place: name
            for place, name in names.items()
            if uses[name] == 1 and name and name == safe_name(name)
        }


@cache
def allowed(model: type[BaseModel], key: str) -> str:
    """What a value may be, from the type of its field: ``"a number, 0 <= x < 1 [-]"``."""
    return next(_described(model, key)).words


@cache
def number(name: str) -> Number | None:
    """Unit and range of a key of the mission by its dotted name; None if it is no number."""
    table, _, key = name.partition(".")
    if key not in getattr(SECTIONS.get(table), "model_fields", ()):
        return None
    whole = next(_described(SECTIONS[table], key), None)
    return whole if isinstance(whole, Number) else None


def _described(model: type[BaseModel], key: str) -> Iterator[Allowed | Number]:
    """What the type of a field says of its values, then of the components of a vector."""
    field = model.model_fields[key]
    of_options = (getattr(each, "__metadata__", ()) for each in get_args(field.annotation))
    for item in (*field.metadata, *(item for items in of_options for item in items)):
        if isinstance(item, Allowed | Number):
            yield item


@cache
def table(name: str) -> str:
    """What a table of the mission has to be: for example ``"a table [wind]"``."""
    needed = [key for key, field in SECTIONS[name].model_fields.items() if field.is_required()]
    content = f" with {', '.join(needed)}" if needed and name != "flight" else ""
    return f"a table [[{name}]]{content}" if name == "buildings" else f"a table [{name}]{content}"


def nearest(key: str, known: Iterable[str]) -> str:
    """Words that suggest the known key most like this one; empty if none is like it.

    Keys of one table are compared by their names alone: as a whole, all of them are alike.
    """
    if len(key) > LONGEST_TEXT:
        return ""
    table, dot, name = key.rpartition(".")
    names = {each: each.removeprefix(f"{table}.") if dot else each for each in known}
    beside = [own for each, own in names.items() if own != each]
    if like := difflib.get_close_matches(name, beside, n=1):
        return f"; did you mean '{table}.{like[0]}'?"
    elsewhere = [each for each, own in names.items() if own == each != table]
    like = difflib.get_close_matches(key, elsewhere, n=1)
    return f"; did you mean '{like[0]}'?" if like else ""


def keys_of(table: object) -> Document:
    """The keys of a table with their values; none of what is no table."""
    return table if isinstance(table, dict) else {}


def listed(names: Sequence[str]) -> str:
    """The first ten names."""
    return ", ".join(names[:10]) + (", …" if len(names) > 10 else "")


def printable(text: str) -> str:
    """A key or a path without control characters, safe to print."""
    if text.isprintable():
        return text
    return "".join(letter if letter.isprintable() else UNPRINTABLE for letter in text)


def shortened(text: str) -> str:
    """The text, or the start of a very long one."""
    return text if len(text) <= LONGEST_NAME else f"{text[: LONGEST_NAME - 3]}..."


@lru_cache
def safe_name(part: str | int) -> str:
    """A part of a dotted key as it may be printed."""
    return shortened(printable(str(part)))


def written_out(value: float) -> str:
    """A number with all its digits and no power of ten; rounding errors are not digits."""
    return f"{Decimal(f'{value:.{DIGITS}g}'):f}"


def counted_in(slot_s: float | None) -> str:
    """How times are counted: in slots of a length [s], or continuously."""
    return "continuous times" if slot_s is None else f"slots of {written_out(slot_s)} s"


def shown(value: object, depth: int = 2) -> str:
    """A value of a mission as a short text."""
    match value:
        case float():
            return repr(float(value))
        case bool():
            return "true" if value else "false"
        case int() if value.bit_length() > 200:
            return f"an integer of {value.bit_length()} bits"
        case str() if len(value) > LONGEST_TEXT:
            return f"{value[:LONGEST_TEXT]!r}..."
        case int() | str():
            return repr(value)
        case dict():
            return "a table" if value else "an empty table"
        case list() | tuple() if depth == 0:
            return "[...]"
        case list() | tuple():
            items = [shown(item, depth - 1) for item in value[:4]]
            return f"[{', '.join(items + ['...'] * (len(value) > 4))}]"
        case datetime.date() | datetime.time():
            return value.isoformat()
        case _:
            return reprlib.repr(value)
