"""Files that can be audited: saved plans, and itineraries in TOML."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal

from annotated_types import Len
from pydantic import Strict, ValidationError

from optuav.errors import Fault, InputError
from optuav.judge.itinerary import Itinerary, Stop
from optuav.mission import Mission, load, shipped
from optuav.mission.files import label, read_text
from optuav.mission.load import LARGEST_FILE, parse
from optuav.mission.messages import Breach, StatedMission, allowed, nearest, shown
from optuav.mission.schema import Allowed, Number
from optuav.mission.validation import format_breaches
from optuav.network.places import ENDS
from optuav.plan import Plan
from optuav.plan.file import LARGEST_BYTES, read_plan
from optuav.plan.phases import Record

MOST_STOPS = 10_000
"""Most stops that an itinerary may have."""


class StopTable(Record):
    """A table [[stops]]."""

    at: Annotated[str, Strict(), Allowed("the name of a place")]
    kind: Annotated[Literal["rest", "hover"], Allowed('"rest" or "hover"')]
    duration_s: Annotated[float, Number("s", ge=0, le=1e7)]


STOP = f"a table with {', '.join(StopTable.model_fields)}"


class ItineraryFile(Record):
    """An itinerary as its file states it."""

    mission: Annotated[
        str,
        Strict(),
        Len(1),
        Allowed("the name of a shipped mission, or a path relative to this file"),
    ]
    stops: Annotated[
        tuple[StopTable, ...],
        Len(0, MOST_STOPS),
        Allowed(f"tables [[stops]], each {STOP}; at most {MOST_STOPS}, or stops = []"),
    ]


def read(path: str | Path) -> tuple[Plan | Itinerary, dict[str, Any]]:
    """Read a saved plan (JSON) or an itinerary (TOML), told apart by name or by how they begin.

    Returns
    -------
    What the file says, and of a plan the data of the file, which repeat some figures.

    Raises
    ------
    InputError
        With everything that keeps the file from being either.
    """
    text = read_text(Path(path), LARGEST_BYTES)
    if Path(path).suffix == ".json" or text.lstrip().startswith("{"):
        return read_plan(path)
    return read_itinerary(path), {}


def read_itinerary(path: str | Path) -> Itinerary:
    """Read an itinerary.

    Parameters
    ----------
    path
        A TOML file with ``schema``, ``mission`` (the name of a shipped one, or a path relative to
        the file) and a table ``[[stops]]`` for every stay, in order: ``at``, ``kind`` (``"rest"``
        or ``"hover"``) and ``duration_s``.

    Raises
    ------
    InputError
        With everything that is wrong with the file, and with that of its mission.
    """
    file = Path(path)
    source = label(file)
    document = parse(read_text(file, LARGEST_FILE), file)
    statement = StatedMission(document, {(): source})
    breaches = format_breaches(document)
    stated = mission = None
    try:
        stated = ItineraryFile.model_validate({k: v for k, v in document.items() if k != "schema"})
    except ValidationError as error:
        breaches += _breaches(error, statement)
    faults = statement.faults(breaches)
    if not any(key == ("mission",) for key, _ in breaches):
        try:
            mission = _mission(document["mission"], file)
        except InputError as error:
            faults += error.faults
    if mission is not None:
        faults += _unknown_places(mission, document.get("stops"), source)
    if faults or stated is None or mission is None:
        raise InputError(faults)
    return Itinerary(
        mission, tuple(Stop(each.at, each.kind, each.duration_s) for each in stated.stops)
    )


def _breaches(error: ValidationError, statement: StatedMission) -> Iterator[Breach]:
    """Pydantic's errors by key and in our words."""
    for detail in error.errors(include_url=False, include_context=False, include_input=False):
        key = detail["loc"]
        name = str(key[-1])
        model = StopTable if len(key) == 3 else ItineraryFile
        if len(key) == 2:
            yield Breach(key, STOP)
        elif name not in model.model_fields:
            yield Breach(key, f"unknown key{nearest(name, model.model_fields)}")
        else:
            missing = "" if statement.holds(key) else "is missing; "
            yield Breach(key, f"{missing}{allowed(model, name)}")


def _mission(name: str, file: Path) -> Mission:
    """The mission of an itinerary; a file that cannot be read is a fault of the key."""
    try:
        return load(name if name in shipped() else file.parent / name)
    except InputError as error:
        raise InputError(
            each if each.key else Fault("mission", shown(name), each.allowed, label(file))
            for each in error.faults
        ) from None


def _unknown_places(mission: Mission, stops: Any, source: str) -> Iterator[Fault]:
    """Stops at places that the mission has not; what is no list of stops is told elsewhere."""
    known = (*ENDS, *(building.name for building in mission.buildings))
    for number, stop in enumerate(stops if isinstance(stops, list) else ()):
        at = stop.get("at") if isinstance(stop, dict) else None
        if isinstance(at, str) and at not in known:
            words = f"is no place of the mission {mission.name}{nearest(at, known)}"
            yield Fault(f"stops.{number}.at", shown(at), words, source)
