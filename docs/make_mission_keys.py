"""Write the tables of keys in mission-keys.md from the models that check a mission file.

Run it from anywhere after a change of the models: ``python docs/make_mission_keys.py``.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from pydantic.fields import FieldInfo

from optuav.fields import RATE_PER_MINUTE, MissionSection
from optuav.flight.model import FlightTable
from optuav.flight.rotors import Rotors
from optuav.laser.beam import LaserTable
from optuav.laser.fits import CONVERSIONS
from optuav.mission import Mission
from optuav.mission.forms import CHOICES, LISTS, TABLES, KeyedForms, forms
from optuav.mission.messages import range_in_words

PAGE = Path(__file__).parent / "mission-keys.md"
START, END = "<!-- keys: written by make_mission_keys.py -->\n", "<!-- end of keys -->\n"

HEAD = ("| key | meaning | allowed values | if left out |", "|---|---|---|---|")
INSTEAD = {
    "flow_rate_per_s": "set flow_rate_per_min",
    "visibility_km": "set attenuation_per_km",
    "attenuation_per_km": "set visibility_km",
    **dict.fromkeys(CONVERSIONS[810], "by the wavelength"),
    **dict.fromkeys(("radius_m", "cell_efficiency"), 'required by "gaussian"'),
    "area_m2": 'required by "divergence"',
    "device_m": "set [[devices]]",
    **{key.removeprefix("body."): "required by rotors" for key in Rotors.needs if "." in key},
}
"""What holds where a key is left out whose field has no default that tells."""

PER_MINUTE = (
    "flow_rate_per_min",
    "The same rate per minute [1/min].",
    RATE_PER_MINUTE.words,
    "set flow_rate_per_s",
)

Row = tuple[str, str, str, str]


def rows(model: type[MissionSection], keys: Iterable[str]) -> Iterator[Row]:
    """Key, meaning, range and default of some fields."""
    for key in keys:
        field = model.model_fields[key]
        default = INSTEAD.get(key) or left_out(field)
        if model is Mission and key == "name":
            default = "the file's name"
        yield key, " ".join(model.descriptions()[key].split()), range_in_words(model, key), default


def left_out(field: FieldInfo) -> str:
    """What holds where a file does not state the key."""
    if field.is_required():
        return "required"
    return "–" if field.default is None else f"`{json.dumps(plain(field.default))}`"


def plain(value: Any) -> Any:
    """A tuple as the list that TOML has for it."""
    return list(value) if isinstance(value, tuple) else value


def summary(model: type[MissionSection]) -> str:
    """What a table is for, in a line."""
    return (model.__doc__ or "").partition("\n")[0]


def table(listed: Iterable[Row]) -> Iterator[str]:
    """Lines of a Markdown table."""
    yield from HEAD
    for key, *cells in listed:
        yield "| " + " | ".join([f"`{key}`", *(cell.replace("|", r"\|") for cell in cells)]) + " |"


def sections() -> Iterator[str]:
    """Lines of all tables of a mission file."""
    yield from (
        "## The file itself",
        "",
        *table(rows(Mission, ("name", "description", "crs"))),
        "",
    )
    for name in TABLES:
        model = FlightTable if name == "flight" else forms(name)[0]
        title = f"[[{name}]]" if name in LISTS else f"[{name}]"
        yield from (f"## {title}", "", summary(model), "")
        if choice := CHOICES.get(name):
            yield from choices(choice, FlightTable if name == "flight" else LaserTable)
            continue
        listed = list(rows(model, model.model_fields))
        if name == "battery":
            rate = next(place for place, row in enumerate(listed) if row[0] == "flow_rate_per_s")
            listed.insert(rate + 1, PER_MINUTE)
        yield from (*table(listed), "")


def choices(choice: KeyedForms, shared: type[MissionSection]) -> Iterator[str]:
    """Lines of the tables of all forms, each without what those before it have."""
    known = dict[str, Row]()
    names = [*([""] if choice.plain else []), *choice.models]
    for name, form in zip(names, choice.forms(), strict=True):
        own = {row[0]: row for row in rows(form, form.model_fields)}
        told = [key for key in own if key in known and key in shared.model_fields]
        again = [key for key in own if key not in told and known.get(key) == own[key]]
        keys = [key for key in own if key not in (*told, *again)]
        _, _, what = summary(form).partition(" with ")
        if known:
            yield f'Only with `{choice.key} = "{name}"`, {what[:-1]}:'
            yield ""
        yield from (*table(rows(form, keys)), "")
        if again:
            yield f"It also has {', '.join(f'`{key}`' for key in again)}, as above."
            yield ""
        known |= own


def page() -> str:
    """The page with its tables written anew."""
    before, _, rest = PAGE.read_text("utf-8").partition(START)
    _, _, after = rest.partition(END)
    return before + START + "\n" + "\n".join(sections()) + "\n" + END + after


if __name__ == "__main__":
    PAGE.write_text(page(), "utf-8")
