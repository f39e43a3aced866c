"""Output of commands: JSON, text and tables, names of files, and a progress bar."""

from __future__ import annotations

import json
import os
import shlex
import sys
import textwrap
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from itertools import chain, groupby
from pathlib import Path
from typing import Any, TypeAlias

import typer

from optuav.errors import encodable, printable
from optuav.presentation.blocks import Blocks
from optuav.presentation.numbers import fixed
from optuav.presentation.text import as_text, filled, line_width

NO, BAD_INPUT, FAILED = 1, 2, 3
"""Exit codes: no feasible or flyable plan; bad input; an engine that failed or proved nothing."""
STYLES = {
    "error:": "bold red",
    "warning:": "bold yellow",
    **dict.fromkeys(("Answer", "Flyable", "All", "Longest", "Share"), "bold"),
    **dict.fromkeys(("NOT", "DISAGREE", "FAILED"), "bold red"),
    "FLYABLE": "bold green",
}
"""Styles of verdicts, the lines that begin so; of only a first word that ends in a colon."""

Progress: TypeAlias = Callable[[int, int | None, str], None]


def check_places(save: Path | None, plot: Path | None, *endings: str, file_only: str = "") -> None:
    """Refuse places that cannot be written to, before the work: a file, and a directory to plot.

    The file must have one of the endings, if there are any; the standard output needs none. Where
    `file_only` names the option, the content is not text and cannot go to the standard output.
    """
    if save is not None:
        from optuav.mission.files import STANDARD, check_place, ending_of

        if endings and (save != STANDARD or file_only):
            ending_of(save, *endings, name=file_only or "--save")
        check_place(save)
    if plot is not None:
        from optuav import plots
        from optuav.mission.files import refusal, refusals

        _ = plots.curves  # refused here where matplotlib is missing
        with refusals(plot, "made"):
            made = next(parent for parent in (plot, *plot.absolute().parents) if parent.exists())
        if not made.is_dir():
            raise refusal(plot, "is not a directory")
        if not os.access(made, os.W_OK):
            raise refusal(plot, "cannot be made or written to")


def say(text: str, style: str = "", *, error: bool = False, most: int | None = 80) -> None:
    """Write lines, those with certain first words in a style if a terminal shows it.

    Control characters are replaced. Lines longer than `most` are broken, see `line_width`; none if
    it is None, and of an error only those too wide for a narrow terminal.
    """
    stream = sys.stderr if error else sys.stdout
    if stream is None:
        return
    # `typer.echo` would write UTF-8 where the console says that it reads ASCII.
    write = typer.echo if (terminal := stream.isatty()) else print
    plain = os.environ.get("NO_COLOR") or os.environ.get("TERM") == "dumb" or not terminal
    lines = printable(encodable(text, stream), "\n").split("\n")
    if most:
        width = line_width(sys.maxsize if error else most)
        parts = (filled(line, width, below=2, whole=True) for line in lines)
        lines = [*chain.from_iterable(parts)]
    for line in lines:
        word = line.partition(" ")[0]
        weight, _, colour = (style or STYLES.get(word, "")).partition(" ")
        start = (word if word.endswith(":") else line) if weight and not plain else ""
        styled = typer.style(start, fg=colour or None, **{weight: True}) if start else ""
        write(styled + line[len(start) :], file=stream)


def command(*parts: Sequence[str]) -> str:
    """A command as a shell takes it, on several lines where it is long, each part on one."""
    words = (shlex.join(part).replace(" ", "\0") for part in parts)
    whole: dict[str, Any] = {"break_long_words": False, "break_on_hyphens": False}
    lines = textwrap.wrap(" ".join(words), line_width() - 2, subsequent_indent="  ", **whole)
    return " \\\n".join(lines).replace("\0", " ")


def deliver(
    data: Callable[[], object],
    shown: Blocks | str,
    *,
    as_json: bool,
    hint: str = "",
    written: Iterable[Path] = (),
) -> None:
    """Print an answer as JSON; or its blocks or text, with a command to copy, and files written.

    With JSON nothing is taken from `shown`; with a file on the standard output nothing else is
    printed.
    """
    if Path("-") in (written := [*written]):
        return
    if as_json:
        # Escapes signs outside ASCII, for any console.
        say(json.dumps(data(), indent=2), most=None)
        return
    say(shown if isinstance(shown, str) else as_text(shown), most=None)
    if hint:
        say(hint, most=None)
    for (folder, stem), paths in groupby(written, lambda path: (path.parent, path.stem)):
        endings = ", ".join(path.suffix for path in paths)
        say(f"wrote {folder / stem}{endings}", "dim", most=None)


@contextmanager
def progress(unit: str = "") -> Iterator[Progress | None]:
    """Show a bar while a command works; None without a terminal that can redraw a line.

    The function takes the number of steps done, the number of all steps if known, and the name
    of the next one. With the unit of the steps it shows the time left, and how many a second are
    done. The bar disappears when the work is done.
    """
    from rich.console import Console

    screen = Console(stderr=True)
    if not screen.is_terminal or screen.is_dumb_terminal:
        yield None
        return
    from rich.progress import (
        BarColumn,
        Progress,
        ProgressColumn,
        Task,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )
    from rich.text import Text

    class Rate(ProgressColumn):
        def render(self, task: Task) -> Text:
            return Text(f"{fixed(task.speed, 0)} {unit}/s" if task.speed else "")

    columns = [BarColumn(), TimeElapsedColumn(), TextColumn("{task.description}", markup=False)]
    columns[2:2] = [TextColumn("left"), TimeRemainingColumn(), Rate()] if unit else []
    with Progress(*columns, console=screen, transient=True, speed_estimate_period=600.0) as bar:
        task = bar.add_task("", total=None)

        def show(done: int, total: int | None, name: str) -> None:
            if unit and bar.tasks[0].total is None:  # Steps done before say nothing about the rate
                bar.reset(task, total=total, completed=done)
            bar.update(task, completed=done, total=total, description=name)

        yield show
