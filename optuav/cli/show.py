"""``optuav show``: a mission with its derived values, or a saved plan."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import typer
from pydantic import BaseModel
from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from optuav.cli.options import JsonOption, MissionArgument, PlotOption, SetOption, mission_of
from optuav.cli.output import NO, check_places, deliver
from optuav.errors import Fault, InputError
from optuav.mission import Mission

if TYPE_CHECKING:
    from optuav.network.derived import BuildingFigures, Figure

UNIT = re.compile(r"\[([^]]+)\]")


def show(
    mission: MissionArgument,
    settings: SetOption = None,
    as_json: JsonOption = False,
    plot: PlotOption = None,
) -> None:
    """Show a mission with units and derived values, or a saved plan (a .json file).

    Exit code 1 if the saved answer is that there is no feasible plan.
    """
    check_places(None, plot)
    if Path(mission).suffix == ".json":
        _show_plan(mission, settings, as_json=as_json, plot=plot)
        return
    from optuav.network.derived import building_figures, derived

    shown = mission_of(mission, settings)
    figures, buildings = derived(shown), building_figures(shown)
    written = []
    if plot is not None:
        from optuav.plots import save_pictures

        written = save_pictures(shown, plot)
    deliver(
        lambda: {
            "mission": shown.to_dict(),
            "derived": {each.name: {"value": each.value, "unit": each.unit} for each in figures},
            "buildings": [asdict(each) for each in buildings],
        },
        lambda _: _pieces(shown, figures, buildings),
        as_json=as_json,
        written=written,
    )


def _show_plan(file: str, settings: list[str] | None, *, as_json: bool, plot: Path | None) -> None:
    if settings:
        raise InputError([Fault("--set", "", "goes with a mission, not with a saved plan")])
    from optuav.plan import load_plan

    plan = load_plan(file)
    written = []
    if plot is not None:
        from optuav.plots import save_pictures

        written = save_pictures(plan, plot)
    deliver(plan.to_dict, plan.summary(), as_json=as_json, written=written)
    if not plan:
        raise typer.Exit(NO)


def _pieces(
    mission: Mission, figures: Iterable[Figure], buildings: Iterable[BuildingFigures]
) -> Iterator[RenderableType]:
    """The mission's tables, and what follows from them."""
    yield Text(f"{mission.name}  {mission.description}".rstrip())
    for name in type(mission).model_fields:
        section = getattr(mission, name)
        if isinstance(section, BaseModel):
            yield Text(f"\n[{name}]", style="bold")
            yield _lines(_settings(section))
    yield Text("\nderived", style="bold")
    yield _lines((each.name, each.text, each.unit) for each in figures)
    if mission.buildings:
        yield Text("\n[[buildings]]", style="bold")
        yield _buildings(buildings)


def _settings(section: BaseModel) -> Iterator[tuple[str, str, str]]:
    """Key, value and unit; descriptions of keys have units and names of tables in brackets."""
    for key, value in section.model_dump(exclude_none=True).items():
        named = UNIT.findall(type(section).model_fields[key].description or "")
        units = [each for each in named if each != "-" and each not in Mission.model_fields]
        yield key, _text(value), units[0] if units else ""


def _text(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, tuple):
        return "(" + ", ".join(_text(each) for each in value) + ")"
    return str(value)


def _lines(rows: Iterable[tuple[str, str, str]]) -> Table:
    """Name, value and unit, a line each."""
    table = Table(box=None, show_header=False, pad_edge=False, padding=(0, 2, 0, 0))
    table.add_column(min_width=30, overflow="fold")
    table.add_column(overflow="fold")
    table.add_column(no_wrap=True)
    for row in rows:
        table.add_row(*(Text(cell) for cell in row))
    return table


def _buildings(figures: Iterable[BuildingFigures]) -> Table:
    table = Table(box=None, pad_edge=False, header_style="")
    for heading in ("name", "position m", "footprint m"):
        table.add_column(heading)
    for heading in ("received W", "T_fl s rest first", "hover first"):
        table.add_column(heading, justify="right")
    for each in figures:
        table.add_row(
            Text(each.name),
            " ".join(f"{x:g}" for x in each.position_m),
            _footprint(each.footprint_m),
            f"{each.received_power_W:.1f}" if each.laser_sight else "no sight",
            *("-" if s is None else f"{s:.2f}" for s in (each.rest_first_s, each.hover_first_s)),
        )
    return table


def _footprint(size: tuple[object, ...] | None) -> str:
    """The sides of a rectangle, or how many corners a polygon has."""
    if size is None:
        return ""
    return f"{len(size)} corners" if isinstance(size[0], tuple) else " × ".join(map(_text, size))
