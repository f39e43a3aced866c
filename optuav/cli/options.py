"""Options and arguments that mean the same in every command, and what they state."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from optuav.errors import Fault, InputError
from optuav.mission import Mission, load

if TYPE_CHECKING:
    from formulations.formulation import Formulation

MissionArgument = Annotated[
    str, typer.Argument(metavar="MISSION", help="Name of a shipped mission, or a mission file.")
]
SetOption = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Change a key of the mission, as in limits.deadline_s=800; KEY= removes an optional "
        "one. May be repeated.",
    ),
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON instead of text.")]
SaveOption = Annotated[
    Path | None, typer.Option("--save", metavar="FILE", help="Write the plan as JSON.")
]
SaveTableOption = Annotated[
    Path | None,
    typer.Option("--save", metavar="FILE", help="Write every detail, as .csv or .json."),
]
PlotOption = Annotated[
    Path | None,
    typer.Option(
        "--plot", metavar="DIR", help="Write pictures into a directory (needs matplotlib)."
    ),
]

# Options of a question: some commands have defaults where others leave them out. Unknown words are
# refused by the library, which names every fault at once, and not by the parser of the options.
PROBLEM = typer.Option(help="P1, P2, P2-tight, P3 or P4.", show_default="P1")
TRAJECTORY = typer.Option(help="For P1 and P2: optimal, direct, traj1 or traj2.")
BUILDING = typer.Option(help="For P4: where to rest.")
ORDER = typer.Option(help="rest-first or hover-first; by default the better of both.")
PERSPECTIVE = typer.Option(
    help="available, battery, energy, adjusted or wells: how charge counts.",
    show_default="available",
    parser=str,
    metavar="<str>",
)
SLOT = typer.Option("--slot-s", help="Length of time slots in seconds; continuous by default.")
ENGINE = typer.Option(
    help="auto, closed-form, cvxpy, bracket, casadi or grid.", show_default="auto"
)
TIME_LIMIT = typer.Option("--time-limit-s", help="Longest search in seconds.")
HOVER_POINT = typer.Option(
    "--hover-point", help="w_U, or free: wherever hovering is longest.", show_default="w_U"
)
STOPS = typer.Option(help="Most rests, in any order over all buildings; with P1.", show_default="1")
HOVERS = typer.Option(help="Most pieces in which to hover; with P1.", show_default="1")


def mission_of(source: str, settings: Sequence[str] | None) -> Mission:
    """The mission of an argument, with the ``--set`` options applied.

    Raises
    ------
    InputError
        With everything that is wrong with the mission or the options.
    """
    mission = load(source)
    if not settings:
        return mission
    faults, values = [], {}
    for setting in settings:
        key, equals, text = setting.partition("=")
        if not equals or not key.strip():
            faults.append(Fault("--set", repr(setting), "KEY=VALUE"))
        else:
            values[key.strip()] = _value(text.strip())
    try:
        changed = mission.replace(values)
    except InputError as error:
        raise InputError([*faults, *error.faults]) from None
    if faults:
        raise InputError(faults)
    return changed


def _value(text: str) -> Any:
    """The value that TOML reads, else the text itself; None, which removes a key, for no text."""
    if not text:
        return None
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except (tomllib.TOMLDecodeError, RecursionError):
        return text


def problem_of(
    mission: Mission,
    name: str,
    fields: Mapping[str, Any],
    *,
    perspective: str,
    slot_s: float | None,
    engine: str = "auto",
    time_limit_s: float | None = None,
) -> Formulation:
    """The problem of a name with its fields; None for a field that is not stated.

    Raises
    ------
    InputError
        If there is no such problem; with everything that is wrong with the other options as well.
    """
    from optuav.solving import question

    try:
        return question.problem_of(name, **fields)
    except InputError as error:
        try:
            question.checked_question(mission, "P1", perspective, slot_s, engine, time_limit_s)
        except InputError as others:
            raise InputError([*error.faults, *others.faults]) from None
        raise
