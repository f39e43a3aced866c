"""The application: its commands, and how errors become exit codes."""

import atexit
import gc
import io
import os
import signal
import sys
from collections.abc import Sequence
from functools import cache
from importlib import import_module
from keyword import iskeyword
from typing import Annotated, Any

import typer

from optuav.cli.options import OPPOSITE, by_flags, command_of
from optuav.cli.output import BAD_INPUT, FAILED, NO, say
from optuav.cli.problem_file import faults_named
from optuav.errors import InputError, NoPlanError, SolverError
from optuav.plugins import read_plugins
from optuav.presentation.text import WIDEST_COLUMNS

COMMANDS = {
    **dict.fromkeys(("solve", "explain", "audit", "export"), "solve"),
    **{"compare": "compare", "reproduce": "paper", "sensitivity": "uncertainty"},
    **{"ledger": "paper", "formulate": "solve", "calibrate": "calibrate"},
    **dict.fromkeys(("show", "validate", "new", "missions"), "missions"),
    **{"power": "power", "coverage": "service", "size": "service", "return": "service"},
    **{"robust": "uncertainty", "city": "city", "map": "map", "place": "place"},
    **{"sweep": "sweep", "explore": "explore", "lessons": "lessons"},
    "check-solutions": "benchmark",
}
"""Every command, in the order of the help, with the module that has its function."""
USAGE_ERROR: Any = typer.BadParameter.__base__  # of any wrong command line; it has no public name


def _stand_in(
    version: Annotated[bool, typer.Option("--version", help="Show the version.")] = False,
) -> None:
    """Stand for a command in the list of all, and for the options before it; neither is run."""


@cache
def program(name: str | None = None) -> Any:
    """One command with its options; or the list of all commands, each with its first line."""
    settings: dict[str, Any] = {
        "help_option_names": ["-h", "--help"],
        # An option --help that is given or not, never None, needs no pydantic to read it.
        "default_map": {"help": False},
        "max_content_width": WIDEST_COLUMNS,
    }
    app = typer.Typer(
        help="Optimise missions of laser-charged drones, with proof, and check their plans.",
        epilog="Exit codes: 0 success, 1 there is no feasible plan or an audited plan cannot be "
        "flown, 2 bad input, 3 an engine failed or did not prove its answer in time.",
        no_args_is_help=True,
        add_completion=False,
        pretty_exceptions_enable=False,
        rich_markup_mode=None,
        context_settings=settings,
    )
    if name is None:
        app.callback()(_stand_in)
    for command in COMMANDS if name is None else [name]:
        module = import_module(f"optuav.cli.{COMMANDS[command]}")
        function = getattr(module, command.replace("-", "_") + "_" * iskeyword(command))
        line, *_ = str(function.__doc__).splitlines()
        run = _stand_in if name is None else command_of(command, function)
        app.command(command, short_help=line, context_settings=settings)(run)
    return typer.main.get_command(app)


def run(arguments: Sequence[str] | None = None) -> None:
    """Run a command and leave with its exit code."""
    if sys.stdout is None:
        say("error: the standard output is closed", error=True)
        sys.exit(BAD_INPUT)
    if hasattr(signal, "SIGPIPE"):
        # A reader that has seen enough, such as `| head`, ends the command without a message.
        signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")
    if arguments is None:
        # The process is ours, and short as a rule. To search its memory for garbage now and at
        # its end, and its packages for plugins of pydantic, would take a quarter of its time.
        gc.set_threshold(100_000)
        atexit.register(gc.freeze)
        os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    words_given = sys.argv[1:] if arguments is None else list(arguments)
    if words_given[:1] == ["--"]:
        del words_given[0]
    if words_given[:1] == ["--version"]:
        import optuav

        say(f"optuav {optuav.__version__}")
        return
    name = words_given[0] if words_given and words_given[0] in COMMANDS else None
    try:
        try:
            with faults_named():
                if name is not None:
                    read_plugins()
                called = f"optuav {name or ''}".rstrip()
                rest = words_given[1:] if name else words_given
                code = program(name)(rest, called, standalone_mode=False)
            sys.exit(code)
        finally:
            sys.stdout.flush()
    except (USAGE_ERROR, typer.Abort, InputError, NoPlanError, SolverError, OSError) as error:
        words, code = _failure(error, name)
        say(words, error=True)
        sys.exit(code)


def _failure(error: Any, name: str | None) -> tuple[str, int]:
    """Words of an error and its exit code; in an input error, options by their names."""
    if isinstance(error, typer.Abort):
        return "\nerror: the input ended before all questions were answered", BAD_INPUT
    if isinstance(error, NoPlanError):
        return str(error), NO
    if isinstance(error, InputError) and name is not None:
        params = program(name).params
        flags = OPPOSITE | {
            param.name: param.opts[0] for param in params if param.opts[0][0] == "-"
        }
        faults = (fault if fault.source else by_flags(fault, flags) for fault in error.faults)
        error = InputError(faults)
    if isinstance(error, InputError | SolverError):
        indented = str(error).replace("\n", "\n       ")
        return f"error: {indented}", BAD_INPUT if isinstance(error, InputError) else FAILED
    if isinstance(error, OSError):
        # Files are written elsewhere. Pending output must not fail again at the end.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return f"error: the output cannot be written: {error.strerror}", BAD_INPUT
    error.show(written := io.StringIO())
    # A parser of a value raises a ValueError, and a library prints its name as well.
    words = written.getvalue().replace(": Value error, ", ": ")
    return words.removesuffix("\n").expandtabs(2), BAD_INPUT
