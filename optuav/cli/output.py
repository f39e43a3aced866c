"""Plans on the screen and in files."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import typer
from rich.console import Console
from rich.text import Text

from optuav.plan import Plan

STYLES = {"Warning": "bold yellow", "Because": "bold red", "Hover": "bold", "Answer": "bold"}


def deliver(
    plan: Plan,
    *,
    as_json: bool,
    save: Path | None,
    plot: Path | None,
    beside: Sequence[Plan] = (),
    animate: Path | None = None,
) -> None:
    """Print a plan, and write what was asked for, with pictures of the plans beside it."""
    if save is not None:
        plan.save(save)
    pictures = draw(plan, plot, beside) if plot is not None else []
    if animate is not None and plan:
        pictures.append(moving(plan, animate))
    elif animate is not None:
        typer.echo(f"{animate} is not written: there is no plan to show", err=True)
    if as_json:
        typer.echo(json.dumps(plan.to_dict(), indent=2, ensure_ascii=False))
        return
    screen = Console(highlight=False, soft_wrap=True)
    for line in plan.summary().splitlines():
        word = line.partition(" ")[0]
        screen.print(Text(line, style=STYLES.get(word, "")))
    for path in ([save] if save else []) + pictures:
        screen.print(f"wrote {path}", style="dim")


def draw(plan: Plan, directory: Path, beside: Sequence[Plan] = ()) -> list[Path]:
    """Write the pictures of a plan into a directory, which is made if it is missing."""
    from optuav.plots import save_pictures

    return save_pictures(plan, directory, beside)


def moving(plan: Plan, file: Path) -> Path:
    """Write the plan in motion, as the judge simulates it."""
    from optuav.judge import replay
    from optuav.plots import save_animation

    return save_animation(replay(plan), file)
