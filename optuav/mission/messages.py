"""Words of messages: allowed values, names that may have been meant, values and numbers as text."""

import datetime
import difflib
import reprlib
from collections.abc import Iterable, Iterator, Sequence
from decimal import Decimal
from functools import cache
from numbers import Integral
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel

from optuav.errors import Fault, InputError
from optuav.mission.flight_model import forms, table_keys
from optuav.mission.schema import Allowed, MissionSection, Number, OneOf

LONGEST_TEXT = 60
DIGITS = 15  # Decimal digits that every float holds


def allowed(model: type[BaseModel], key: str) -> str:
    """What a value may be, from the type of its field: ``"a number, 0 <= x < 1 [-]"``."""
    return next(described(model, key)).words


def number(name: str) -> Number | None:
    """Unit and range of a key of the mission by its dotted name; None if it is no number."""
    table, _, key = name.partition(".")
    form = table_keys(table).get(key)
    return None if form is None else _number(form, key)


@cache
def _number(form: type[MissionSection], key: str) -> Number | None:
    whole = next(described(form, key), None)
    return whole if isinstance(whole, Number) else None


def described(model: type[BaseModel], key: str) -> Iterator[Allowed | Number | OneOf]:
    """What the type of a field says of its values, then of the components of a vector."""
    field = model.model_fields[key]
    of_options = (getattr(each, "__metadata__", ()) for each in get_args(field.annotation))
    for item in (*field.metadata, *(item for items in of_options for item in items)):
        if isinstance(item, Allowed | Number | OneOf):
            yield item


def table(name: str) -> str:
    """What a table of the mission has to be: for example ``"a table [wind]"``."""
    first = forms(name)[0]
    needed = [key for key, field in first.model_fields.items() if field.is_required()]
    content = f" with {', '.join(needed)}" if needed and name != "flight" else ""
    return f"a table [[{name}]]{content}" if name == "buildings" else f"a table [{name}]{content}"


def nearest(key: str, known: Iterable[str]) -> str:
    """Words that suggest the known key most like this one; empty if none is like it.

    Keys of one table are compared by their names alone: as a whole, all of them are alike.
    """
    if len(key) > LONGEST_TEXT:
        return ""
    table, dot, name = key.rpartition(".")
    inside = [each for each in known if dot and each.startswith(f"{table}.")]
    beside = [each.removeprefix(f"{table}.") for each in inside]
    if like := difflib.get_close_matches(name, beside, n=1):
        return f"; did you mean '{table}.{like[0]}'?"
    like = difflib.get_close_matches(key, {*known} - {*inside, table}, n=1)
    return f"; did you mean '{like[0]}'?" if like else ""


def no_building(stated: str, names: Sequence[str]) -> str:
    """Words for a building that is none of the mission's, by its name or a key of the mission."""
    known = f"are: {listed(names) or 'none'}"
    if names and stated.startswith("buildings["):
        return f"the mission's buildings [0] to [{len(names) - 1}] {known}"
    table = "buildings." if stated.startswith("buildings.") else ""
    return f"the mission's buildings {known}{nearest(stated, [table + name for name in names])}"


def misfits(*stated: tuple[str, object, Number]) -> Iterator[Fault]:
    """Which options are not such numbers, by name and value; a whole one has to be integral."""
    for option, value, number in stated:
        if not number.accepts(value) or (number.whole and not isinstance(value, Integral)):
            yield Fault(option, shown(value), number.words)


def unknown(option: str, value: object, allowed: Sequence[str]) -> Fault:
    """A value that is none of those allowed, with the nearest of them."""
    hint = nearest(value, allowed) if isinstance(value, str) else ""
    words = "one of" if len(allowed) > 1 else "must be"
    return Fault(option, shown(value), f"{words} {', '.join(allowed)}{hint}")


def listed(names: Sequence[str]) -> str:
    """The first ten names."""
    return ", ".join(names[:10]) + (", …" if len(names) > 10 else "")


def counted(count: int, noun: str) -> str:
    """A number of things: ``"2 numbers"``."""
    return f"{count} {noun}{'s' * (count != 1)}"


def written_out(value: float) -> str:
    """A number with all its digits and no power of ten; rounding errors are not digits."""
    return f"{Decimal(f'{value:.{DIGITS}g}'):f}"


def path_of(stated: Any) -> Path:
    """A path; refused if it is none."""
    if not isinstance(stated, str | Path):
        raise InputError([Fault("", shown(stated), "a path")])
    return Path(stated)


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
