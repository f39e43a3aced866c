"""``optuav new``: a commented mission file to start from."""

from __future__ import annotations

import math
import sys
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.markup import escape

from optuav.errors import Fault, InputError
from optuav.mission import Mission, load
from optuav.mission.files import must_be_new, write_text
from optuav.mission.template import Datasheet, template

REGIMES = "regimes"


def _number(key: str) -> Any:
    """The option that states a number of the datasheet."""
    field = Datasheet.model_fields[key]
    known = not field.is_required() and field.default is not None
    default = f" {field.default:g} if left out." if known else ""
    return typer.Option(
        f"--{key.replace('_', '-')}",
        help=escape(f"{field.description}{default}"),
        rich_help_panel=f"With --from {REGIMES}; what is missing is asked for on a terminal",
    )


def new(
    context: typer.Context,
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The file to write.")],
    source: Annotated[
        str,
        typer.Option(
            "--from",
            metavar="MISSION",
            help=f"Whose values to start from; {REGIMES} for your own drone's datasheet.",
        ),
    ] = "paper",
    mass_kg: Annotated[float | None, _number("mass_kg")] = None,
    payload_kg: Annotated[float | None, _number("payload_kg")] = None,
    packs: Annotated[int | None, _number("packs")] = None,
    cells: Annotated[int | None, _number("cells")] = None,
    capacity_mAh: Annotated[float | None, _number("capacity_mAh")] = None,
    hover_min: Annotated[float | None, _number("hover_min")] = None,
    cruise_min: Annotated[float | None, _number("cruise_min")] = None,
    cruise_speed_m_s: Annotated[float | None, _number("cruise_speed_m_s")] = None,
    reserve_percent: Annotated[float | None, _number("reserve_percent")] = None,
    laser_power_W: Annotated[float | None, _number("laser_power_W")] = None,
) -> None:
    """Write a mission file in which every key is explained."""
    stated = {name: context.params[name] for name in Datasheet.model_fields}
    must_be_new(file)
    mission, remarks = _start(source, stated)
    write_text(file, template(mission, file.stem, remarks))
    Console(highlight=False, soft_wrap=True).print(
        f"wrote {file}; next: optuav validate {file}", markup=False
    )


def _start(source: str, stated: dict[str, Any]) -> tuple[Mission, tuple[str, ...]]:
    """The mission to start from, and remarks on its source for its file."""
    if source == REGIMES:
        if sys.stdin.isatty() and Datasheet.faults(stated):
            stated = _prompted(stated)
        sheet = Datasheet.of(stated)
        return sheet.mission(), sheet.remarks()
    faults = [
        Fault(name, f"{value:g}", f"goes with --from {REGIMES}")
        for name, value in stated.items()
        if value is not None
    ]
    if faults:
        raise InputError(faults)
    return load(source), ()


def _prompted(stated: dict[str, Any]) -> dict[str, Any]:
    """The stated numbers; a person at the terminal gives the others."""
    answers = dict(stated)
    for name, field in Datasheet.model_fields.items():
        if answers[name] is None:
            default = answers["hover_min"] if name == "cruise_min" else field.get_default()
            answers[name] = typer.prompt(
                (field.description or name).rstrip("."),
                default=None if field.is_required() else default,
                value_proc=partial(_answer, name),
            )
    return answers


def _answer(name: str, text: Any) -> float:
    """A number that the datasheet takes; the prompt repeats after anything else."""
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    value = int(number) if number.is_integer() else number
    for fault in Datasheet.faults({name: value}):
        if fault.key == name:
            raise typer.BadParameter(fault.allowed)
    return value
