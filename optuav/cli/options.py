"""Options of the command line: their words, the question that they state, and its mission."""

from __future__ import annotations

import inspect
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, is_dataclass
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

import typer

from optuav.errors import Fault, InputError
from optuav.options import Perspective

if TYPE_CHECKING:
    from formulations.formulation import Formulation
    from optuav.mission import Mission

Words: TypeAlias = Mapping[str, tuple[str, ...]]
"""By parameter, or command and parameter: an option's name and metavar, or an argument's metavar;
its help; the default that the help shows in place of None; the panel of the help."""

SHARED: Words = {
    "mission": ("MISSION", "Name of a shipped mission, or a mission file."),
    "settings": (
        "--set KEY=VALUE",
        "Change a key, as limits.deadline_s=800; KEY= removes an optional one. Repeatable.",
    ),
    "as_json": ("--json", "Print JSON instead of text."),
    "save": ("--save FILE", "Write every detail, as .csv or .json."),
    "plot": ("--plot DIR", "Write pictures into a directory (needs matplotlib)."),
    "problem": ("--problem", "P1, P2, P2-tight, P3 or P4.", "P1"),
    "trajectory": ("--trajectory", "For P1 and P2: optimal, direct, traj1 or traj2."),
    "building": ("--building", "For P4: where to rest."),
    "order": ("--order", "rest-first or hover-first; by default the better of both."),
    "hover_point": ("--hover-point", "w_U, or free: wherever hovering is longest.", "w_U"),
    "perspective": (
        "--perspective",
        "available, battery, energy, adjusted or wells: how charge counts.",
        "available",
    ),
    "slot_s": ("--slot-s", "Length of time slots in seconds; continuous by default."),
    "engine": ("--engine", "auto, closed-form, cvxpy, bracket, casadi or grid.", "auto"),
    "time_limit_s": ("--time-limit-s", "Longest search in seconds."),
    "stops": ("--stops", "Most rests, in any order over all buildings; with P1.", "1"),
    "hovers": ("--hovers", "Most pieces in which to hover; with P1.", "1"),
}

DEFAULTS = {"perspective": "available", "slot_s": None, "engine": "auto", "time_limit_s": None}
"""Options beside the problem, by their names in the library."""


@dataclass(frozen=True)
class ProblemOptions:
    """Options that state a problem and how charge and times count in it.

    What is not stated is None, and the library refuses what does not exist: it names every fault
    at once, which the parser of the options does not.
    """

    problem: str | None = None
    trajectory: str | None = None
    building: str | None = None
    order: str | None = None
    hover_point: str | None = None
    perspective: Perspective | None = None
    slot_s: float | None = None

    @property
    def options(self) -> dict[str, Any]:
        """What is stated beside the problem, or its default."""
        stated = ((name, getattr(self, name)) for name in DEFAULTS if hasattr(self, name))
        return {name: DEFAULTS[name] if value is None else value for name, value in stated}

    def problem_for(self, mission: Mission, **stops: Any) -> Formulation:
        """The problem that is stated; or an `InputError`, with faults of the other options too."""
        from optuav.solving import question

        names = ("trajectory", "building", "order", "hover_point")
        stated: dict[str, Any] = {name: getattr(self, name) for name in names}
        try:
            return question.problem_of(self.problem or "P1", **stated, **stops)
        except InputError as error:
            try:
                question.checked_question(mission, "P1", **{**DEFAULTS, **self.options})
            except InputError as others:
                raise InputError([*error.faults, *others.faults]) from None
            raise


@dataclass(frozen=True)
class SolveOptions(ProblemOptions):
    """A problem, who solves it and how long, and how many stops the search may try."""

    engine: str | None = None
    time_limit_s: float | None = None
    stops: int | None = None
    hovers: int | None = None


def command_of(name: str, function: Callable[..., None], words: Words) -> Callable[..., None]:
    """A function as typer takes it: an option or an argument for each parameter.

    A parameter that is a dataclass stands for an option for each of its fields.
    """
    own = inspect.signature(function, eval_str=True).parameters
    records: dict[str, Any] = {
        key: each.annotation for key, each in own.items() if is_dataclass(each.annotation)
    }
    fields = {
        key: inspect.signature(kind, eval_str=True).parameters for key, kind in records.items()
    }

    def run(**given: Any) -> None:
        for key, record in records.items():
            given[key] = record(**{field: given.pop(field) for field in fields[key]})
        function(**given)

    known = {**SHARED, **words}
    parts = [part for key in own for part in fields.get(key, {key: own[key]}).values()]
    for number, part in enumerate(parts):
        said = known.get(f"{name}.{part.name}") or known[part.name]
        parts[number] = part.replace(annotation=_annotated(part.annotation, *said))
    run.__doc__ = function.__doc__
    run.__signature__ = inspect.Signature(parts)  # type: ignore[attr-defined]
    return run


def _annotated(kind: Any, name: str, words: str, default: str = "", panel: str = "") -> Any:
    """The type of a parameter with what typer asks for."""
    # Any word passes for a perspective: the library refuses unknown ones.
    kind = {Perspective: str, Perspective | None: str | None}.get(kind, kind)
    flag, _, metavar = name.partition(" ")
    if not flag.startswith("--"):
        return Annotated[kind, typer.Argument(metavar=flag, help=words, case_sensitive=False)]
    shown: dict[str, Any] = {"show_default": default or True, "rich_help_panel": panel or None}
    return Annotated[kind, typer.Option(flag, metavar=metavar or None, help=words, **shown)]


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
