"""A commented mission file to start from, written from the mission's own descriptions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import tomli_w
from pydantic import BaseModel

from optuav.mission.schema import Mission
from optuav.mission.sections import Building


def template(mission: Mission, name: str, remarks: Sequence[str] = ()) -> str:
    """A mission as a TOML file in which every key is explained.

    Parameters
    ----------
    mission
        Whose values to start from.
    name
        Name of the new mission.
    remarks
        Lines about its values, for the head of the file.

    Returns
    -------
    Text of the file; keys that are not set stand there as comments.
    """
    lines = [
        "# A mission for optuav. Change what differs in yours; `optuav validate` checks the file.",
        "# Lengths in metres, ground at z = 0; every key carries its unit as a suffix.",
        *(f"# {remark}" for remark in remarks),
        "",
        f"schema = {mission.to_dict()['schema']}",
        *_entry("name", name),
        *_entry("description", ""),
    ]
    for key in Mission.model_fields:
        table = getattr(mission, key)
        if isinstance(table, BaseModel):
            lines += ["", f"[{key}]", *_table(table)]
    for building in mission.buildings:
        lines += ["", "[[buildings]]"]
        explained = building == mission.buildings[0]
        lines += _table(building) if explained else _bare(building)
    return "\n".join(lines) + "\n"


def _table(table: BaseModel) -> Iterator[str]:
    values = table.model_dump(mode="json")
    for key, field in type(table).model_fields.items():
        for line in (field.description or "").splitlines():
            yield f"# {line}"
        if values[key] is None:
            yield f"# {key} ="
        else:
            yield from _entry(key, values[key])


def _bare(building: Building) -> Iterator[str]:
    for key, value in building.model_dump(mode="json", exclude_none=True).items():
        yield from _entry(key, value)


def _entry(key: str, value: Any) -> list[str]:
    return [f"{key} = {_text(value)}"]


def _text(value: Any) -> str:
    """A value as TOML writes it; a whole number as one."""
    if isinstance(value, list):
        return f"[{', '.join(_text(each) for each in value)}]"
    if isinstance(value, float) and value.is_integer() and abs(value) < 1e9:
        value = int(value)
    return tomli_w.dumps({"x": value}).partition("=")[2].strip()
