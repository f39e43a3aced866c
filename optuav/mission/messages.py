"""Words of messages: allowed values, names that may have been meant, values and numbers as text."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cache
from numbers import Integral
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel

from optuav.errors import Fault, InputError
from optuav.errors import nearest as nearest  # noqa: PLC0414
from optuav.errors import shown as shown  # noqa: PLC0414
from optuav.fields import Allowed, OneOf, Range
from optuav.mission.files import expand_home
from optuav.mission.forms import LISTS, forms
from optuav.presentation.numbers import short

TYPES = {
    "float_type": "a number",
    "finite_number": "a finite number",
    "string_type": "a string",
    "bool_type": "true or false",
    **dict.fromkeys(("tuple_type", "list_type"), "a list"),
    "dict_type": "an object",
    "dataclass_type": "an object",
    "missing": "is missing",
    **dict.fromkeys(("extra_forbidden", "unexpected_keyword_argument"), "unknown key"),
    "greater_than": "a number, x > {gt}",
    "less_than": "a number, x < {lt}",
    "greater_than_equal": "a number, x >= {ge}",
    "less_than_equal": "a number, x <= {le}",
    **dict.fromkeys(("literal_error", "enum"), "{expected}"),
    "too_short": "a list that is not empty",
    "value_error": "{error}",
}
"""Allowed values in words, by pydantic's name of the error."""


def error_words(detail: Mapping[str, Any]) -> str:
    """One of pydantic's errors in words."""
    limits = detail.get("ctx", {}).items()
    words = TYPES.get(detail["type"], "a value of another kind")
    return words.format(**{name: short(x) if isinstance(x, float) else x for name, x in limits})


def range_in_words(model: type[BaseModel], key: str) -> str:
    """Describe the allowed values of a field from its type: ``"a number, 0 <= x < 1 [-]"``."""
    return next(limits_of(model, key)).words


def number(name: str) -> Range | None:
    """Unit and range of a key of the mission by its dotted name; None if it is not a number."""
    table, _, key = name.partition(".")
    form = next((form for form in forms(table) if key in form.model_fields), None)
    return None if form is None else number_of(form, key)


@cache
def number_of(form: type[BaseModel], key: str) -> Range | None:
    """Unit and range of a field; None if it is not a number."""
    whole = next(limits_of(form, key), None)
    return whole if isinstance(whole, Range) else None


def limits_of(model: type[BaseModel], key: str) -> Iterator[Allowed | Range | OneOf]:
    """Yield the limits in the type of a field, then in the components of a vector."""
    field = model.model_fields[key]
    of_options = (getattr(argument, "__metadata__", ()) for argument in get_args(field.annotation))
    for item in (*field.metadata, *(item for items in of_options for item in items)):
        if isinstance(item, Allowed | Range | OneOf):
            yield item


def table(name: str) -> str:
    """Describe the table of the mission that is expected: for example ``"a table [wind]"``."""
    first = forms(name)[0]
    needed = [key for key, field in first.model_fields.items() if field.is_required()]
    content = f" with {', '.join(needed)}" if needed and name != "flight" else ""
    return f"a table [[{name}]]{content}" if name in LISTS else f"a table [{name}]{content}"


def no_building(name: str, names: Sequence[str]) -> str:
    """Words for a building that the mission does not have, by its name or a key of the mission."""
    return no_item("buildings", name, names)


def no_item(table: str, name: str, names: Sequence[str]) -> str:
    """Words for a building or a device that the mission does not have."""
    listed = f"are: {first_ten(names) or 'none'}"
    if names and name.startswith(f"{table}["):
        return f"the mission's {table} [0] to [{len(names) - 1}] {listed}"
    own = name.removeprefix(f"{table}.")
    alike = nearest(own.rpartition(".")[0] or own, names) or nearest(own, names)
    if name.startswith(f"{table}."):
        alike = alike.replace("'", f"'{table}.", 1)
    return f"the mission's {table} {listed}{alike}"


def misfits(*options: tuple[str, object, Range]) -> Iterator[Fault]:
    """Yield a fault for each option that is not such a number; a whole one must be integral."""
    for option, value, number in options:
        if not number.accepts(value) or (number.whole and not isinstance(value, Integral)):
            yield Fault(option, shown(value), number.words)


def unknown(option: str, value: object, allowed: Sequence[str]) -> Fault:
    """A value outside the allowed ones, with the nearest of them."""
    hint = nearest(value, allowed) if isinstance(value, str) else ""
    words = "one of" if len(allowed) > 1 else "must be"
    return Fault(option, shown(value), f"{words} {', '.join(allowed)}{hint}")


def unlisted(*options: tuple[str, object, Sequence[str]]) -> Iterator[Fault]:
    """Yield a fault for each option whose value, of whatever kind, is none of its choices."""
    for option, value, choices in options:
        if not isinstance(value, str | None) or value not in choices:
            yield unknown(option, value, choices)


def first_ten(names: Sequence[str]) -> str:
    """The first ten names."""
    return ", ".join(names[:10]) + (", …" if len(names) > 10 else "")


def plural(count: int, noun: str) -> str:
    """A number of things: ``"2 numbers"``."""
    return f"{count} {noun}{'s' * (count != 1)}"


def path_of(path: Any, name: str = "path", words: str = "a path") -> Path:
    """A path, see `expand_home`; refused if it is not one, or empty."""
    if not str(of_kind(name, path, str | Path, words)):
        raise InputError([Fault(name, shown(path), words)])
    return expand_home(path, name)


def paths_of(paths: Any, name: str) -> list[Path]:
    """One path or several as a list; refused if the list is empty."""
    return [path_of(path) for path in several(name, paths, str | Path, "a path, or several")]


def of_kind(name: str, value: Any, kind: Any, words: str) -> Any:
    """A value, refused with these words if it is of another kind."""
    if not isinstance(value, kind):
        raise InputError([Fault(name, shown(value), words)])
    return value


def several(name: str, one_or_more: Any, kind: Any, words: str, least: int = 1) -> list[Any]:
    """One value of a kind, or several, as a list; others and fewer are refused with these words."""
    table = isinstance(one_or_more, Mapping) or hasattr(
        one_or_more, "columns"
    )  # Would be its names
    single = table or isinstance(one_or_more, kind) or not isinstance(one_or_more, Iterable)
    values = [one_or_more] if single else [*one_or_more]
    if len(values) < least or not all(isinstance(value, kind) for value in values):
        raise InputError([Fault(name, shown(one_or_more), words)])
    return values
