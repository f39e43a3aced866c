"""The application: its commands, and how errors become exit codes.

Exit codes: 0 yes; 1 no (there is no feasible plan, or an audited plan cannot be flown); 2 bad
input; 3 an engine failed or did not prove its answer in time.
"""

from __future__ import annotations

import signal
import sys
from collections.abc import Sequence
from functools import cache
from importlib import import_module
from typing import Annotated, Any

import typer

from optuav.cli.options import command_of
from optuav.cli.output import BAD_INPUT, FAILED, styled
from optuav.errors import InputError, SolverError

COMMANDS = {
    **dict.fromkeys(("solve", "explain", "audit"), "solve"),
    **dict.fromkeys(("compare", "reproduce", "sensitivity", "ledger"), "studies"),
    **{"formulate": "solve", "calibrate": "calibrate"},
    **dict.fromkeys(("show", "validate", "new", "missions"), "missions"),
}
"""Every command, in the order of the help, with the module that has its function."""


def _options(
    version: Annotated[bool, typer.Option("--version", help="Show the version.")] = False,
) -> None:
    """Take the options before the command, which `main` has answered."""


@cache
def program(first: str | None = None) -> Any:
    """All commands as one; where the first argument names one, that one alone is loaded."""
    app = typer.Typer(
        name="optuav",
        help="Missions of laser-charged drones: modelled, solved with proof, and checked.",
        epilog="Exit codes: 0 yes, 1 there is no feasible plan or an audited plan cannot be flown, "
        "2 bad input, 3 an engine failed or did not prove its answer in time.",
        no_args_is_help=True,
        add_completion=False,
        pretty_exceptions_enable=False,
        context_settings={"help_option_names": ["-h", "--help"]},
    )
    app.callback()(_options)
    wanted = COMMANDS if first not in COMMANDS else [first]
    for name in wanted:
        module = import_module(f"optuav.cli.{COMMANDS[name]}")
        app.command(name)(command_of(name, getattr(module, name), module.WORDS))
    return typer.main.get_command(app)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run a command and leave with its exit code."""
    if hasattr(signal, "SIGPIPE"):
        # A reader that has seen enough, as `| head`, ends the command without a message.
        signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")
    given = sys.argv[1:] if arguments is None else list(arguments)
    if given[:1] == ["--version"]:
        import optuav

        typer.echo(f"optuav {optuav.__version__}")
        return
    try:
        program(*given[:1])(args=given)
    except (InputError, SolverError) as error:
        indented = str(error).replace("\n", "\n       ")
        typer.echo(f"{styled('error:', 'bold red')} {indented}", err=True)
        sys.exit(BAD_INPUT if isinstance(error, InputError) else FAILED)
