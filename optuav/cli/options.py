"""Options of the command line: the question that they state, and its mission."""

from __future__ import annotations

import inspect
import io
import re
import sys
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from contextvars import copy_context
from dataclasses import dataclass, is_dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from optuav.errors import Fault, InputError, collected, decimal, integer, refuse
from optuav.options import BatteryName, Perspective
from optuav.presentation.numbers import figure

if TYPE_CHECKING:
    from formulations.formulation import Formulation
    from optuav.mission import Mission

PATHS = (Path, Path | None, list[Path])
PARSERS: Mapping[Any, Callable[[str], Any]] = {
    **dict.fromkeys((float, float | None), decimal),
    **dict.fromkeys((int, int | None), integer),
    **dict.fromkeys(PATHS, str),  # made a path later: an empty text would be the current folder
}
"""Parser of an option, by the type of its parameter."""
SIMPLE: Mapping[str, tuple[tuple[type, ...], str]] = {
    **{"float": ((float, int), "a number"), "int": ((int,), "a whole number")},
    **{"str": ((str,), "a text"), "bool": ((bool,), "true or false")},
}
"""Types of values, and words for them, by the type of a field of your own problem."""
BESIDE = ("perspective", "slot_s", "engine", "time_limit_s")
"""Options that do not belong to the problem."""
OPPOSITE = {"lit_hover": "--dark-hover"}
"""Options that turn off an argument of the library, by its name."""
WRITTEN = {"save", "plot", "animate", "out", "file", "directory", "flights", "save_missions"}
"""Parameters that name a file or a directory to be written."""


@dataclass(frozen=True)
class ProblemOptions:
    """Options that state a problem and how charge and times count in it.

    The library, not the parser of the options, refuses unknown values: all faults at once.
    """

    problem: str = "P1"
    trajectory: str | None = None
    building: str | None = None
    order: str | None = None
    device_order: str | None = None
    hover_time_s: float | None = None
    hover_point: str | None = None
    speed: str | None = None
    perspective: Perspective = "available"
    slot_s: float | None = None

    def question(
        self, source: str, settings: Sequence[str] | None
    ) -> tuple[Mission, Formulation, dict[str, Any]]:
        """The mission, the problem and the options beside it; or all that is wrong with them.

        Settings without a dot are fields of a problem of your own.
        """
        from optuav.cli.problem_file import faults_named, problem_class
        from optuav.mission import Mission
        from optuav.solving import question

        values, settings, faults = dict(vars(self)), list(settings or ()), list[Fault]()
        if self.device_order is not None:
            values["device_order"] = tuple(x.strip() for x in self.device_order.split(","))
        kind: Any = values.pop("problem")
        options = {name: values.pop(name) for name in BESIDE if name in values}
        mission = problem = None
        if ".py" in kind or kind in question.OWN_PROBLEMS:
            keys = {setting: setting.partition("=")[0].strip() for setting in settings}
            own = [
                x for x in settings if "." not in keys[x] and keys[x] not in Mission.model_fields
            ]
            settings, file, kind = [x for x in settings if x not in own], kind, None
            with collected(faults), faults_named():
                kind = problem_class(file) if ".py" in file else file
                values |= values_of(own, faults)
                faults += misfits_of(kind, values)
        with collected(faults):
            mission = mission_of(source, settings)
        if kind is not None:
            with collected(faults), faults_named():
                problem = question.problem_of(kind, **values)
        if faults:
            with collected(faults):
                question.checked_question(mission, problem or "P1", **options)
        refuse(dict.fromkeys(faults))
        assert mission is not None
        assert problem is not None
        return mission, problem, options


@dataclass(frozen=True)
class SolveOptions(ProblemOptions):
    """A problem, who solves it and how long, and how many stops the search may try."""

    engine: str = "auto"
    time_limit_s: float | None = None
    stops: int | None = None
    hovers: int | None = None


def command_of(name: str, function: Callable[..., None]) -> Callable[..., None]:
    """A function as typer takes it: an option or an argument for each parameter.

    A dataclass stands for an option for each of its fields, and ``**numbers`` for those of a
    drone's datasheets. The help comes from ``words.toml``.
    """
    parameters = inspect.signature(function, eval_str=True).parameters
    kinds = {key: parameter.annotation for key, parameter in parameters.items()}
    records: dict[str, Any] = {key: kind for key, kind in kinds.items() if is_dataclass(kind)}
    own_fields: dict[str, Any] = {
        key: inspect.signature(kind, eval_str=True).parameters for key, kind in records.items()
    }
    own_fields["numbers"], helps = _of_datasheets() if "numbers" in parameters else ({}, {})

    def run(force: bool | None = None, **given: Any) -> None:
        texts = {part.name: given[part.name] for part in parts if part.annotation in PATHS}
        given |= _paths({name: text for name, text in texts.items() if text is not None})
        for key, record in records.items():
            given[key] = record(**{field: given.pop(field) for field in own_fields[key]})
        context = copy_context()
        if force is not None:  # else nothing is written
            from optuav.mission.files import keep_foreign_files

            context.run(keep_foreign_files.set, not force)
            if "force" in parameters:
                given["force"] = force
        context.run(function, **given)

    words = tomllib.loads(Path(__file__).with_name("words.toml").read_text("utf-8"))
    known: dict[str, Any] = words["all"] | words.get(name, {})
    parts = [
        part for key in parameters for part in own_fields.get(key, {key: parameters[key]}).values()
    ]
    if WRITTEN & {part.name for part in parts} and "force" not in parameters:
        parts.append(keyword_only("force", bool, False))
    run.__doc__ = function.__doc__
    options = [_option(part, known.get(part.name) or helps[part.name]) for part in parts]
    run.__signature__ = inspect.Signature(options)  # type: ignore[attr-defined]
    return run


def _option(part: inspect.Parameter, said: Any) -> inspect.Parameter:
    """A parameter as an option or an argument, with what ``words.toml`` says of it."""
    if isinstance(said, str):
        said = [f"--{part.name.replace('_', '-')}", said]
    flag, help, default = [*said, ""][:3]
    flag, _, metavar = flag.partition(" ")
    parser = PARSERS.get(part.annotation)
    option: Any = typer.Argument(metavar=flag, help=help, case_sensitive=False, parser=parser)
    if flag.startswith("--"):
        shown: Any = default or True
        place: Any = {"metavar": metavar or (parser and parser.__name__.upper())}
        option = typer.Option(flag, help=help, show_default=shown, parser=parser, **place)
    # Any word passes for a perspective: the library refuses unknown ones.
    any_word: Any = {Perspective: str, Perspective | None: str | None}
    kind = any_word.get(part.annotation, part.annotation)
    return part.replace(annotation=Annotated[kind, option])


def _paths(given: Mapping[str, str | list[str]]) -> dict[str, Any]:
    """The texts of options as paths; or a refusal with all faults."""
    if not given:  # Commands without a path start faster
        return {}
    from optuav.mission.messages import path_of

    paths, faults = dict[str, Any](), list[Fault]()
    for key, text in given.items():
        several = text if isinstance(text, list) else [text]  # Old releases of typer give a path
        with collected(faults):
            found = [path_of(one, key) for one in several]
            paths[key] = found if several is text else found[0]
    refuse(faults)
    return paths


def keyword_only(name: str, kind: Any, default: Any) -> inspect.Parameter:
    """A parameter that is stated by its name."""
    only = inspect.Parameter.KEYWORD_ONLY
    return inspect.Parameter(name, only, default=default, annotation=kind)


def _of_datasheets() -> tuple[dict[str, inspect.Parameter], dict[str, str]]:
    """Parameters for the numbers of drones' datasheets, and their help, by name."""
    from optuav.mission.template import Datasheet, RotorDatasheet

    parameters, helps = dict[str, inspect.Parameter](), dict[str, str]()
    for form in (Datasheet, RotorDatasheet):
        for key, field in form.model_fields.items():
            kinds = {int: int | None, BatteryName: BatteryName | None}
            kind: Any = kinds.get(field.annotation, float | None)
            parameters[key] = keyword_only(key, kind, None)
            usual = field.get_default()
            known = f" {figure(usual)} if left out." if isinstance(usual, int | float) else ""
            helps[key] = form.descriptions()[key] + known
    return parameters, helps


def mission_of(source: str, settings: Sequence[str] | None) -> Mission:
    """The mission of an argument with ``--set`` applied, or an `InputError` with every fault.

    Without text the key is removed.
    """
    from optuav.mission import load
    from optuav.mission.keys import misfits_of_keys

    mission, faults = None, list[Fault]()
    values = values_of(settings or (), faults)
    with collected(faults):
        mission = load(source)
    with collected(faults):
        if mission is None:
            faults += misfits_of_keys(values)
        elif ambiguous := [*_faults_of_one_device(mission, values)]:
            faults += ambiguous
        elif values:
            mission = mission.replace(values)
    options = vars(SolveOptions())
    refuse(
        _with_value_as_typed(fault, values) if fault.key in options else fault for fault in faults
    )
    assert mission is not None
    return mission


def _faults_of_one_device(mission: Mission, values: Mapping[str, Any]) -> Iterator[Fault]:
    """Keys of a single device that would silently drop the devices of a mission."""
    from optuav.mission.messages import shown
    from optuav.mission.mission import ONE_DEVICE

    names = [device.name for device in mission.devices]
    for table, key in ONE_DEVICE if names and "devices" not in values else ():
        if (value := values.get(f"{table}.{key}")) is not None:
            ours = "position_m" if key == "device_m" else key
            words = f"is for one device, and the mission has {', '.join(names[:8])}: set devices."
            words += f"{names[0]}.{ours}, or drop these devices with --set devices="
            yield Fault(f"{table}.{key}", shown(value), words)


def _with_value_as_typed(fault: Fault, values: Mapping[str, Any]) -> Fault:
    """The fault of a setting that is an option by itself."""
    value, flag = values[fault.key], fault.key.replace("_", "-")
    text = "" if value is None else str(value)
    words = f"not a key of the mission; use the option --{flag} {text}".rstrip()
    return Fault("", f"--set {fault.key}={text}", words)


def values_of(settings: Sequence[str], faults: list[Fault]) -> dict[str, Any]:
    """Return the values of ``--set`` by key: what TOML reads, else the text; None without text."""
    from optuav.mission.files import parse_toml

    values = dict[str, Any]()
    for setting in settings:
        key, equals, text = (part.strip() for part in setting.partition("="))
        if not (equals and key):
            faults.append(Fault("--set", repr(setting), "KEY=VALUE"))
            continue
        values[key] = text or None
        with suppress(InputError):
            if (found := parse_toml(f"value = {text}")).keys() == {"value"}:
                values[key] = found["value"]
    return values


def misfits_of(problem: type[Formulation] | str, values: Mapping[str, Any]) -> Iterator[Fault]:
    """Values of a problem's fields that are not a number, whole number, text or truth value."""
    from optuav.solving.question import OWN_PROBLEMS, arguments_of

    own: Any = OWN_PROBLEMS[problem] if isinstance(problem, str) else problem
    for name, field in arguments_of(own if isinstance(own, type) else type(own)).items():
        value, kind = values.get(name), getattr(field.annotation, "__name__", field.annotation)
        types, words = SIMPLE.get(str(kind), ((), ""))
        if value is not None and types and type(value) not in types:
            yield Fault(name, repr(value), words)


def is_plan(source: str, stated: Iterable[str]) -> bool:
    """Return whether an argument is a saved plan: a .json file, or JSON from the standard input.

    Stated options, which change the question, are refused beside one.
    """
    is_saved = Path(source).suffix == ".json"
    if source == "-" and sys.stdin is not None:
        stream = sys.stdin.buffer
        is_saved = isinstance(stream, io.BufferedReader) and stream.peek(1).lstrip()[:1] == b"{"
    words = "goes with a mission, not with a saved plan"
    options = sorted(stated) if is_saved else []
    refuse(Fault(f"--{name.replace('_', '-')}", "", words) for name in options)
    return is_saved


def by_flags(fault: Fault, flags: Mapping[str, str], names: str = r"\w+_\w+") -> Fault:
    """The fault with options in place of the library's names of them, which a pattern finds."""
    words = re.sub(names, lambda found: flags.get(found[0], found[0]), fault.allowed)
    return replace(fault, key=flags.get(fault.key, fault.key), allowed=words)


def number_or_text(text: str | None) -> float | str | None:
    """The number that an option states, or its text, which the library refuses with its range."""
    with suppress(ValueError):
        return None if text is None else decimal(text)
    return text


def numbers_in(text: str) -> tuple[float, ...]:
    """Numbers between commas; none if one of them is not a number."""
    with suppress(ValueError):
        return tuple(decimal(part.strip()) for part in text.split(","))
    return ()
