"""The application: its commands, and how errors become exit codes.

Exit codes: 0 yes; 1 an honest no (there is no feasible plan, or it cannot be flown); 2 bad input;
3 an engine failed or did not prove its answer in time.
"""

from __future__ import annotations

import signal
import sys
from collections.abc import Sequence
from functools import cache
from typing import Annotated, Any

import typer
from rich.console import Console

from optuav.cli import (
    audit,
    calibrate,
    compare,
    explain,
    formulate,
    ledger,
    missions,
    new,
    reproduce,
    sensitivity,
    show,
    solve,
    validate,
)
from optuav.errors import InputError, SolverError

BAD_INPUT, ENGINE_FAILED = 2, 3

app = typer.Typer(
    name="optuav",
    help="Missions of laser-charged drones: modelled, solved with proof, and checked.",
    epilog="Exit codes: 0 yes, 1 there is no feasible plan or it cannot be flown, 2 bad input, "
    "3 an engine failed or did not prove its answer in time.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _say_version(asked: bool) -> None:
    if asked:
        import optuav

        typer.echo(f"optuav {optuav.__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool,
        typer.Option("--version", help="Show the version.", is_eager=True, callback=_say_version),
    ] = False,
) -> None:
    """Take what stands before the command."""


for command in (
    solve.solve,
    explain.explain,
    audit.audit,
    compare.compare,
    reproduce.reproduce,
    sensitivity.sensitivity,
    ledger.ledger,
    formulate.formulate,
    calibrate.calibrate,
    show.show,
    validate.validate,
    new.new,
    missions.missions,
):
    app.command()(command)


@cache
def program() -> Any:
    """All commands as one, put together at the first call."""
    return typer.main.get_command(app)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run a command and leave with its exit code."""
    if hasattr(signal, "SIGPIPE"):
        # A reader that has seen enough, as `| head`, ends the command without a word.
        signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")
    screen = Console(stderr=True, highlight=False, soft_wrap=True)
    try:
        program()(args=None if arguments is None else list(arguments))
    except InputError as error:
        screen.print("error:", style="bold red", end=" ")
        screen.print(str(error).replace("\n", "\n       "), markup=False)
        sys.exit(BAD_INPUT)
    except SolverError as error:
        screen.print("error:", style="bold red", end=" ")
        screen.print(str(error), markup=False)
        sys.exit(ENGINE_FAILED)
