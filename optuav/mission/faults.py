"""What is wrong with a mission: breaches by key, and the faults that a person reads."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from functools import cached_property
from typing import Any, NamedTuple, TypeAlias

from optuav.errors import Fault
from optuav.mission.words import safe_name, shown

Key: TypeAlias = tuple[str | int, ...]
"""Where a value stands: ``("limits", "min_soc")``, ``("buildings", 2, "position_m")``."""

_NOTHING = object()


class Breach(NamedTuple):
    """A key whose value is not allowed, and what would be."""

    key: Key
    allowed: str


class Statement:
    """A mission as it was stated, sound or not.

    Parameters
    ----------
    document
        Tables and values by name, as a TOML file gives them.
    sources
        File in which a key, a table or (by the empty key) anything else was stated.
    displaced
        Keys that were stated underneath, each with the dotted key whose new value displaced it.
    """

    def __init__(
        self,
        document: Mapping[str, Any],
        sources: Mapping[Key, str] | None = None,
        displaced: Mapping[Key, str] | None = None,
    ) -> None:
        self.document = document
        self.sources = sources or {}
        self.displaced = displaced or {}

    def faults(self, breaches: Iterable[Breach]) -> list[Fault]:
        """One fault for each key: its first breach with dotted key, value and source."""
        first: dict[Key, str] = {}
        for key, allowed in breaches:
            first.setdefault(key, allowed)
        return [
            Fault(self._dotted(key), self._shown(key), allowed, self._source(key))
            for key, allowed in first.items()
        ]

    def holds(self, key: Key) -> bool:
        """Whether something is stated for the key."""
        return self._value(key) is not _NOTHING

    def missing(self, key: Key, allowed: str) -> Breach:
        """The breach of a key for which nothing is stated, or nothing any more."""
        by = self.displaced.get(key)
        why = f"; a new {by} displaces the old one, state both" if by else ""
        return Breach(key, f"is missing; {allowed}{why}")

    def _shown(self, key: Key) -> str:
        value = self._value(key)
        return "" if value is _NOTHING else shown(value)

    def _value(self, key: Key) -> Any:
        value: Any = self.document
        for part in key:
            if isinstance(value, dict):
                value = value.get(part, _NOTHING)
            elif isinstance(value, list | tuple) and isinstance(part, int):
                value = value[part]
            else:
                return _NOTHING
        return value

    def _source(self, key: Key) -> str:
        stated = self.sources.get
        return stated(key[:2]) or stated(key[:1]) or stated((), "")

    def _dotted(self, key: Key) -> str:
        """The key as a person writes it; a building goes by its name where that is its own."""
        if key[0] != "buildings" or len(key) == 1:
            return ".".join(safe_name(part) for part in key)
        name = self._names.get(key[1])
        building = f"buildings[{key[1]}]" if name is None else f"buildings.{name}"
        return ".".join([building, *(safe_name(part) for part in key[2:])])

    @cached_property
    def _names(self) -> dict[str | int, str]:
        """Names that tell a building from the others, by its place in the list."""
        names = {
            place: building["name"]
            for place, building in enumerate(self.document["buildings"])
            if isinstance(building, dict) and isinstance(building.get("name"), str)
        }
        uses = Counter(names.values())
        return {
            place: name
            for place, name in names.items()
            if uses[name] == 1 and name and name == safe_name(name)
        }
