"""What commands print and write: JSON, text and tables, names of files, and a progress bar."""

from __future__ import annotations

import json
import os
import sys
import textwrap
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import typer

from optuav.errors import Fault, InputError

if TYPE_CHECKING:
    from rich.console import RenderableType

    from optuav.studies.results import Results

WIDTH = 80
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


def check_places(save: Path | None, plot: Path | None, *endings: str) -> None:
    """Refuse files and directories that cannot be written to, before the work begins."""
    if save is not None:
        from optuav.mission.files import label, refusal

        if endings and save.suffix not in endings:
            words = f"a name that ends in {' or '.join(endings)}"
            raise InputError([Fault("--save", repr(str(save)), words)])
        if not save.parent.is_dir():
            raise refusal(save, f"there is no directory {label(save.parent)}")
    if plot is not None:
        from optuav import plots
        from optuav.mission.files import make_directory

        _ = plots.curves  # refused here where matplotlib is missing
        make_directory(plot)


def styled(text: str, style: str) -> str:
    """Text in a style, if it goes to a terminal that has some."""
    if not sys.stdout.isatty() or os.environ.get("NO_COLOR") or os.environ.get("TERM") == "dumb":
        return text
    weight, _, colour = style.partition(" ")
    return typer.style(text, fg=colour or None, **{weight: True})


def warning(words: str) -> str:
    """A paragraph that warns."""
    lines = textwrap.fill(f"warning: {words}", WIDTH)
    return lines.replace("warning:", styled("warning:", "bold yellow"), 1)


def deliver(
    data: Callable[[], object],
    shown: str | Iterable[RenderableType],
    *,
    as_json: bool,
    notes: Iterable[str] = (),
    written: Iterable[Path] = (),
) -> None:
    """Print an answer as JSON; or as text or tables, with notes and the names of files written.

    Where JSON is asked for, nothing is taken from `shown`.
    """
    if as_json:
        typer.echo(json.dumps(data(), indent=2, ensure_ascii=False))
        return
    # `typer.echo` would write UTF-8 where the console says that it reads ASCII.
    write = typer.echo if sys.stdout.isatty() else print
    if isinstance(shown, str):
        for line in shown.splitlines():
            style = STYLES.get(line.partition(" ")[0])
            write(styled(line, style) if style else line)
    else:
        from rich.console import Console

        from optuav.studies.results import as_text

        screen = Console(highlight=False)
        if not screen.is_terminal:
            typer.echo(as_text(shown))
        else:
            for piece in shown:
                screen.print(piece)
    for note in notes:
        write(note)
    for path in written:
        write(styled(f"wrote {path}", "dim"))


def deliver_results(found: Results, save: Path | None, plot: Path | None, *, as_json: bool) -> None:
    """Write the files that were asked for of a table of results, and print it."""
    written = []
    if save is not None:
        from optuav.mission.files import write_text

        text = json.dumps(found.to_dict(), indent=2, ensure_ascii=False)
        write_text(save, found.to_csv() if save.suffix == ".csv" else f"{text}\n")
        written.append(save)
    if plot is not None:
        written += found.save_pictures(plot)
    deliver(found.to_dict, found.show(found), as_json=as_json, written=written)


@contextmanager
def progress() -> Iterator[Progress | None]:
    """Show a bar while a command works; None where there is no terminal that can redraw a line.

    The function takes the number of steps done, that of all steps where it is known, and the name
    of the next one. The bar disappears when the work is done.
    """
    from rich.console import Console

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
