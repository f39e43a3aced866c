"""From a stated document to a sound mission, or to all that is wrong with it at once."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from optuav.errors import Fault, InputError
from optuav.mission.faults import Breach, Key, Statement
from optuav.mission.quantities import RATE_PER_MINUTE
from optuav.mission.rules import rules
from optuav.mission.sections import REGIME_KEYS, SCHEMA, SECTIONS
from optuav.mission.words import allowed, nearest, table

KEYS = {
    name: {*section.model_fields, *({"flow_rate_per_min"} if name == "battery" else ())}
    for name, section in SECTIONS.items()
}
"""The keys that a file may state, by table."""

MOST_SUGGESTIONS = 50

_HOME = {key: f"{name}.{key}" for name, keys in KEYS.items() if name != "buildings" for key in keys}
_RATE: Key = ("battery", "flow_rate_per_s")
_RATE_PER_MINUTE: Key = ("battery", "flow_rate_per_min")

AnyMission = TypeVar("AnyMission", bound=BaseModel)


def validate(
    model: type[AnyMission],
    statement: Statement,
    faults: Collection[Fault] = (),
    *,
    whole: bool = True,
) -> AnyMission:
    """Make a mission of what was stated.

    Parameters
    ----------
    model
        The class of the mission.
    statement
        What was stated and where.
    faults
        What is known to be wrong already.
    whole
        False if a part of the statement could not be read: then nothing counts as missing, and
        the rules that bind several keys are not judged.

    Returns
    -------
    Mission
        The mission.

    Raises
    ------
    InputError
        With every fault.
    """
    breaches: list[Breach] = []
    try:
        mission = model.model_validate(statement.document)
        if not faults:
            return mission
    except ValidationError as error:
        breaches += _breaches(model, error, statement)
        if whole:
            breaches += rules(statement.document, _sound(statement.document, breaches))
        else:
            breaches = [breach for breach in breaches if statement.holds(breach.key)]
    raise InputError([*faults, *statement.faults(breaches)])


def format_breaches(document: Mapping[str, Any]) -> list[Breach]:
    """Whether a document states the version of its format, and one that can be read."""
    words = f"{SCHEMA}, the version of this format"
    if "schema" not in document:
        return [Breach(("schema",), f"is missing; {words}")]
    schema = document["schema"]
    return [] if type(schema) is int and schema == SCHEMA else [Breach(("schema",), words)]


def _breaches(
    model: type[BaseModel], error: ValidationError, statement: Statement
) -> Iterator[Breach]:
    """Pydantic's errors by key and in our words; what the rules said is left to the rules."""
    suggestions = 0
    for detail in error.errors(include_url=False, include_context=False, include_input=False):
        key = _key(detail["loc"])
        if not key or (key == _RATE and statement.holds(_RATE_PER_MINUTE)):
            continue
        if detail["type"] in ("extra_forbidden", "invalid_key"):
            suggestions += 1
            known = _known(model, key) if suggestions <= MOST_SUGGESTIONS else ()
            yield Breach(key, _unknown(key, known, statement))
        elif statement.holds(key):
            yield Breach(key, _words(model, key))
        else:
            yield statement.missing(key, _words(model, key))


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
    if len(key) == 1:
        return {*model.model_fields, "schema", "extends"}
    return KEYS[str(key[0])]


def _unknown(key: Key, known: Iterable[str], statement: Statement) -> str:
    name = str(key[-1])
    if key == _RATE_PER_MINUTE:
        both = statement.holds(_RATE)
        return "either flow_rate_per_s or flow_rate_per_min" if both else RATE_PER_MINUTE.words
    if key == ("extends",):
        return "only in a mission file"
    if key[0] == "flight" and name in REGIME_KEYS:
        return 'only with flight.model = "regimes"'
    if name in _HOME:
        return f"unknown key; did you mean '{_HOME[name]}'?"
    return f"unknown key{nearest(name, known)}"


def _sound(document: Mapping[str, Any], breaches: Iterable[Breach]) -> dict[str, Any]:
    """The document without what is in breach; a building in breach as a whole stays, empty."""
    faulty = {key for key, _ in breaches}

    def sound(table: Any, *place: str | int) -> dict[str, Any]:
        if place in faulty or not isinstance(table, dict):
            return {}
        return {key: value for key, value in table.items() if (*place, key) not in faulty}

    tables = {name: sound(table, name) for name, table in document.items() if name != "buildings"}
    buildings = document.get("buildings", ())
    if ("buildings",) in faulty:
        buildings = ()
    return tables | {"buildings": [sound(item, "buildings", n) for n, item in enumerate(buildings)]}
