"""What commands print and write: JSON, text and tables, names of files, and a progress bar."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import typer
from rich.console import Console, RenderableType
from rich.text import Text

from optuav.errors import Fault, InputError
from optuav.mission.files import label, make_directory, refusal, write_text

if TYPE_CHECKING:
    from optuav.studies.results import Results

NO, BAD_INPUT, FAILED = 1, 2, 3
"""Exit codes: no feasible or flyable plan; bad input; an engine that failed or proved nothing."""
STYLES = {
    **dict.fromkeys(("Hover", "Answer", "Violated", "Contradicted", "To"), "bold"),
    **dict.fromkeys(("Because", "NOT"), "bold red"),
    "Warning": "bold yellow",
    "FLYABLE:": "bold green",
}
"""Styles of lines by their first word."""

Progress: TypeAlias = Callable[[int, int | None, str], None]
Shown: TypeAlias = str | Callable[[int], Iterable[RenderableType]]


def check_places(save: Path | None, plot: Path | None, *endings: str) -> None:
    """Refuse files and directories that cannot be written to, before the work begins."""
    if save is not None:
        if endings and save.suffix not in endings:
            words = f"a name that ends in {' or '.join(endings)}"
            raise InputError([Fault("--save", repr(str(save)), words)])
        if not save.parent.is_dir():
            raise refusal(save, f"there is no directory {label(save.parent)}")
    if plot is not None:
        from optuav import plots

        _ = plots.curves  # refused here where matplotlib is missing
        make_directory(plot)


def deliver(
    data: Callable[[], object],
    shown: Shown,
    *,
    as_json: bool,
    notes: Iterable[Text] = (),
    written: Iterable[Path] = (),
) -> None:
    """Print an answer as JSON; or as text, with notes and the names of the files written.

    Parameters
    ----------
    data
        Returns what JSON shows.
    shown
        Text whose lines are no longer than 80 columns, or a function that returns pieces of text
        and tables for a screen of so many columns.
    """
    if as_json:
        typer.echo(json.dumps(data(), indent=2, ensure_ascii=False))
        return
    screen = Console(highlight=False)
    if isinstance(shown, str):
        for line in shown.splitlines():
            style = STYLES.get(line.partition(" ")[0], "")
            screen.print(Text(line, style=style), soft_wrap=True)
    elif screen.is_terminal:
        for piece in shown(screen.width):
            screen.print(piece)
    else:
        from optuav.studies.results import WIDTH, as_text

        typer.echo(as_text(shown(WIDTH)))
    for note in notes:
        screen.print(note, soft_wrap=True)
    for path in written:
        screen.print(f"wrote {path}", style="dim", markup=False, soft_wrap=True)


def deliver_results(found: Results, save: Path | None, plot: Path | None, *, as_json: bool) -> None:
    """Write the files that were asked for of a table of results, and print it."""
    written = []
    if save is not None:
        text = json.dumps(found.to_dict(), indent=2, ensure_ascii=False)
        write_text(save, found.to_csv() if save.suffix == ".csv" else f"{text}\n")
        written.append(save)
    if plot is not None:
        written += found.save_pictures(plot)
    deliver(found.to_dict, lambda _: found.tables(), as_json=as_json, written=written)


def warning(words: str) -> Text:
    """A line that warns."""
    return Text.assemble(("warning: ", "bold yellow"), words)


@contextmanager
def progress() -> Iterator[Progress | None]:
    """Show a bar while a command works; None where there is no terminal that can redraw a line.

    The function takes the number of steps done, that of all steps where it is known, and the name
    of the next one. The bar disappears when the work is done.
    """
    screen = Console(stderr=True)
    if not screen.is_terminal or screen.is_dumb_terminal:
        yield None
        return
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (BarColumn(), TimeElapsedColumn(), TextColumn("{task.description}", markup=False))
    with Progress(*columns, console=screen, transient=True) as bar:
        task = bar.add_task("", total=None)
        yield lambda done, total, name: bar.update(
            task, completed=done, total=total, description=name
        )
