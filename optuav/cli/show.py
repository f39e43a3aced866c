"""``optuav show``: a mission with its derived values, or a saved plan."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from dataclasses import asdict
from pathlib import Path

import typer
from pydantic import BaseModel
from rich.console import Console
from rich.table import Table
from rich.text import Text

from optuav.cli.options import JsonOption, MissionArgument, PlotOption, SetOption, mission_of
from optuav.cli.output import deliver
from optuav.errors import Fault, InputError
from optuav.mission import Mission
from optuav.network.derived import BuildingFigures, Figure, building_figures, derived
from optuav.plan import load_plan

NO = 1


def show(
    mission: MissionArgument,
    settings: SetOption = None,
    as_json: JsonOption = False,
    plot: PlotOption = None,
) -> None:
    """Show a mission with units and derived values, or a saved plan (a .json file).

    Exit code 1 if the saved answer is that there is no feasible plan.
    """
    if Path(mission).suffix == ".json":
        if settings:
            raise InputError([Fault("--set", "", "goes with a mission, not with a saved plan")])
        plan = load_plan(mission)
        deliver(plan, as_json=as_json, save=None, plot=plot)
        if not plan:
            raise typer.Exit(NO)
        return
    shown = mission_of(mission, settings)
    figures = derived(shown)
    if as_json:
        values = {each.name: {"value": each.value, "unit": each.unit} for each in figures}
        buildings = [asdict(each) for each in building_figures(shown)]
        answer = {"mission": shown.to_dict(), "derived": values, "buildings": buildings}
        typer.echo(json.dumps(answer, indent=2, ensure_ascii=False))
    else:
        _print(shown, figures)
    if plot is not None:
        from optuav.plots import save_pictures

        for path in save_pictures(shown, plot):
            typer.echo(f"wrote {path}", err=as_json)


def _print(mission: Mission, figures: tuple[Figure, ...]) -> None:
    screen = Console(highlight=False, soft_wrap=True)
    screen.print(f"{mission.name}  {mission.description}".rstrip(), markup=False, soft_wrap=False)
    for name in type(mission).model_fields:
        section = getattr(mission, name)
        if isinstance(section, BaseModel):
            screen.print(f"\n[{name}]", style="bold", markup=False)
            screen.print(_grid(_settings(section)))
    screen.print("\nderived", style="bold")
    screen.print(_grid((each.name, each.text, each.unit) for each in figures))
    if mission.buildings:
        screen.print("\n[[buildings]]", style="bold", markup=False)
        screen.print(_buildings(building_figures(mission)))


def _buildings(figures: Iterable[BuildingFigures]) -> Table:
    table = Table(box=None, pad_edge=False, header_style="")
    for heading in ("name", "position m", "footprint m", "received W"):
        table.add_column(heading, justify="right" if heading == "received W" else "left")
    for heading in ("T_fl s rest first", "hover first"):
        table.add_column(heading, justify="right")
    for each in figures:
        size = each.footprint_m
        corners = size is not None and isinstance(size[0], tuple)
        table.add_row(
            Text(each.name),
            " ".join(f"{x:g}" for x in each.position_m),
            "" if size is None else f"{len(size)} corners" if corners else _sides(size),
            f"{each.received_power_W:.1f}" if each.laser_sight else "no sight",
            *("-" if s is None else f"{s:.2f}" for s in (each.rest_first_s, each.hover_first_s)),
        )
    return table


def _sides(size: Iterable[object]) -> str:
    return " × ".join(_text(side) for side in size)


def _settings(section: BaseModel) -> Iterator[tuple[str, str, str]]:
    for key, value in section.model_dump(exclude_none=True).items():
        name, unit = _named(key)
        yield name, _text(value), unit


UNITS = {
    "As": "A s",
    "rad_s": "rad/s",
    "m_s": "m/s",
    "m_s2": "m/s²",
    "kg_m2": "kg m²",
    "per_s": "1/s",
    "per_km": "1/km",
    "rpm_V": "rpm/V",
    "Nm": "N m",
    "Nm_s_rad": "N m s/rad",
    "N_s2_rad2": "N s²/rad²",
    "Nm_s2_rad2": "N m s²/rad²",
    "ohm": "Ω",
    **{unit: unit for unit in ("s", "m", "V", "A", "W", "J", "N", "kg", "km", "nm", "dB")},
}
"""Suffixes of keys, and how a reader writes the unit."""


def _named(key: str) -> tuple[str, str]:
    """A key and its unit, from the longest suffix that is one."""
    parts = key.split("_")
    for first in range(1, len(parts)):
        suffix = "_".join(parts[first:])
        if suffix in UNITS:
            return key, UNITS[suffix]
    return key, ""


def _text(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, tuple):
        return "(" + ", ".join(_text(each) for each in value) + ")"
    return str(value)


def _grid(rows: Iterable[tuple[str, str, str]]) -> Table:
    table = Table(box=None, show_header=False, pad_edge=False, padding=(0, 2, 0, 0))
    table.add_column(min_width=30, overflow="fold")
    table.add_column(overflow="fold")
    table.add_column(no_wrap=True)
    for row in rows:
        table.add_row(*(Text(cell) for cell in row))
    return table
