"""The application: its commands, and how errors become exit codes.

Exit codes: 0 yes; 1 no (there is no feasible plan, or the plan cannot be flown); 2 bad input;
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

from optuav.cli.audit import audit
from optuav.cli.calibrate import calibrate
from optuav.cli.explain import explain
from optuav.cli.formulate import formulate
from optuav.cli.missions import missions, validate
from optuav.cli.new import new
from optuav.cli.output import BAD_INPUT, FAILED
from optuav.cli.paper import ledger, reproduce
from optuav.cli.show import show
from optuav.cli.solve import solve
from optuav.cli.studies import compare, sensitivity
from optuav.errors import InputError, SolverError

COMMANDS = (
    *(solve, explain, audit, compare, reproduce, sensitivity, ledger, formulate, calibrate),
    *(show, validate, new, missions),
)

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
for command in COMMANDS:
    app.command()(command)


def _print_version(wanted: bool) -> None:
    if wanted:
        import optuav

        typer.echo(f"optuav {optuav.__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool,
        typer.Option("--version", help="Show the version.", is_eager=True, callback=_print_version),
    ] = False,
) -> None:
    """Take the options before the command."""


@cache
def program() -> Any:
    """All commands as one, put together at the first call."""
    return typer.main.get_command(app)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run a command and leave with its exit code."""
    if hasattr(signal, "SIGPIPE"):
        # A reader that has seen enough, as `| head`, ends the command without a message.
        signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")
    try:
        program()(args=None if arguments is None else list(arguments))
    except (InputError, SolverError) as error:
        screen = Console(stderr=True, highlight=False, soft_wrap=True)
        screen.print("error:", style="bold red", end=" ")
        indented = str(error).replace("\n", "\n       ")
        screen.print(indented, markup=False)
        sys.exit(BAD_INPUT if isinstance(error, InputError) else FAILED)
