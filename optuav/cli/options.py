"""Options and arguments that mean the same in every command, and what they state."""

from __future__ import annotations

import inspect
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from optuav.errors import Fault, InputError
from optuav.options import Perspective

if TYPE_CHECKING:
    from formulations.formulation import Formulation
    from optuav.mission import Mission

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


def perspectives(words: str, show_default: str | bool = True) -> Any:
    """An option that takes any word: the library refuses those that it does not know."""
    return typer.Option(help=words, parser=str, metavar="<str>", show_default=show_default)


@dataclass(frozen=True)
class Programme:
    """Options that state a problem and how charge and times count in it.

    What is not stated is None, and the library refuses what does not exist: it names every fault
    at once, which the parser of the options does not.
    """

    problem: Annotated[
        str | None, typer.Option(help="P1, P2, P2-tight, P3 or P4.", show_default="P1")
    ] = None
    trajectory: Annotated[
        str | None, typer.Option(help="For P1 and P2: optimal, direct, traj1 or traj2.")
    ] = None
    building: Annotated[str | None, typer.Option(help="For P4: where to rest.")] = None
    order: Annotated[
        str | None, typer.Option(help="rest-first or hover-first; by default the better of both.")
    ] = None
    hover_point: Annotated[
        str | None,
        typer.Option(help="w_U, or free: wherever hovering is longest.", show_default="w_U"),
    ] = None
    perspective: Annotated[
        Perspective | None,
        perspectives(
            "available, battery, energy, adjusted or wells: how charge counts.", "available"
        ),
    ] = None
    slot_s: Annotated[
        float | None, typer.Option(help="Length of time slots in seconds; continuous by default.")
    ] = None

    @property
    def options(self) -> dict[str, Any]:
        """What is stated beside the problem, or its default, by its name in the library."""
        return {"perspective": self.perspective or "available", "slot_s": self.slot_s}

    def problem_for(self, mission: Mission, **stops: Any) -> Formulation:
        """The problem that is stated; or an `InputError`, with faults of the other options too."""
        from optuav.solving import question

        names = ("trajectory", "building", "order", "hover_point")
        stated: dict[str, Any] = {name: getattr(self, name) for name in names}
        try:
            return question.problem_of(self.problem or "P1", **stated, **stops)
        except InputError as error:
            rest = {"engine": "auto", "time_limit_s": None, **self.options}
            try:
                question.checked_question(mission, "P1", **rest)
            except InputError as others:
                raise InputError([*error.faults, *others.faults]) from None
            raise


@dataclass(frozen=True)
class Question(Programme):
    """A problem, who solves it and how long, and how many stops the search may try."""

    engine: Annotated[
        str | None,
        typer.Option(
            help="auto, closed-form, cvxpy, bracket, casadi or grid.", show_default="auto"
        ),
    ] = None
    time_limit_s: Annotated[float | None, typer.Option(help="Longest search in seconds.")] = None
    stops: Annotated[
        int | None,
        typer.Option(
            help="Most rests, in any order over all buildings; with P1.", show_default="1"
        ),
    ] = None
    hovers: Annotated[
        int | None,
        typer.Option(help="Most pieces in which to hover; with P1.", show_default="1"),
    ] = None

    @property
    def options(self) -> dict[str, Any]:
        """What is stated beside the problem, or its default, by its name in the library."""
        who = {"engine": self.engine or "auto", "time_limit_s": self.time_limit_s}
        return {**super().options, **who}


def taking(
    record: Callable[..., Any], options: Sequence[inspect.Parameter] = ()
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """A decorator: the command's parameter `asked` is a record made of an option for each field."""
    parts = options or [*inspect.signature(record, eval_str=True).parameters.values()]

    def decorated(command: Callable[..., None]) -> Callable[..., None]:
        own = inspect.signature(command, eval_str=True).parameters

        @wraps(command)
        def run(**given: Any) -> None:
            asked = record(**{each.name: given.pop(each.name) for each in parts})
            command(asked=asked, **given)

        run.__signature__ = inspect.Signature(  # type: ignore[attr-defined]
            [each for name in own for each in (parts if name == "asked" else (own[name],))]
        )
        return run

    return decorated


def mission_of(source: str, settings: Sequence[str] | None) -> Mission:
    """The mission of an argument with ``--set`` applied, or an `InputError` with every fault."""
    from optuav.mission import load

    mission = load(source)
    if not settings:
        return mission
    faults, values = [], {}
    for setting in settings:
        key, equals, text = (part.strip() for part in setting.partition("="))
        if equals and key:
            values[key] = _value(text)
        else:
            faults.append(Fault("--set", repr(setting), "KEY=VALUE"))
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


def refuse_beside_plan(stated: Mapping[str, object]) -> None:
    """Refuse options that change the question, where the answer is a saved plan."""
    words = "goes with a mission, not with a saved plan"
    if faults := [
        Fault(f"--{name.replace('_', '-')}", "", words)
        for name, value in stated.items()
        if value is not None
    ]:
        raise InputError(faults)
