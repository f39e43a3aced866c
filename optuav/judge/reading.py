"""Files that can be audited: saved plans, and itineraries in TOML."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, StrictStr, ValidationError

from optuav.errors import Fault, InputError
from optuav.judge.itinerary import Itinerary, Stop
from optuav.mission import Mission, load, shipped
from optuav.mission.faults import Statement
from optuav.mission.files import label, read_text
from optuav.mission.load import LARGEST_FILE, parse
from optuav.mission.places import ENDS
from optuav.mission.validate import format_breaches
from optuav.mission.words import nearest, shown
from optuav.plan import Plan
from optuav.plan.file import LARGEST_BYTES, read_plan, record_faults
from optuav.plan.phases import Amount, Record

MOST_STOPS = 10_000
"""Most stops that an itinerary may have."""


class StopTable(Record):
    """A table [[stops]]."""

    at: StrictStr
    kind: Literal["rest", "hover"]
    duration_s: Amount


class ItineraryFile(Record):
    """An itinerary as its file states it."""

    mission: StrictStr
    stops: Annotated[tuple[StopTable, ...], Field(max_length=MOST_STOPS)]


def read(path: str | Path) -> tuple[Plan | Itinerary, dict[str, Any]]:
    """Read a saved plan (JSON) or an itinerary (TOML), told apart by how they begin.

    Returns
    -------
    What the file says, and of a plan the data of the file, which repeat some figures.

    Raises
    ------
    InputError
        With everything that keeps the file from being either.
    """
    if read_text(Path(path), LARGEST_BYTES).lstrip().startswith("{"):
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
    faults = Statement(document, {(): source}).faults(format_breaches(document))
    document.pop("schema", None)
    stated = None
    try:
        stated = ItineraryFile.model_validate(document)
    except ValidationError as error:
        faults += record_faults(error, source)
    mission = None
    if isinstance(document.get("mission"), str):
        try:
            mission = _mission(document["mission"], file.parent)
        except InputError as error:
            faults += error.faults
    if mission is not None:
        faults += _unknown_places(mission, document.get("stops"), source)
    if faults or stated is None or mission is None:
        raise InputError(faults)
    return Itinerary(
        mission, tuple(Stop(each.at, each.kind, each.duration_s) for each in stated.stops)
    )


def _mission(name: str, directory: Path) -> Mission:
    return load(name if name in shipped() else directory / name)


def _unknown_places(mission: Mission, stops: Any, source: str) -> Iterator[Fault]:
    """Stops at places that the mission has not; what is no list of stops is told elsewhere."""
    known = (*ENDS, *(building.name for building in mission.buildings))
    for number, stop in enumerate(stops if isinstance(stops, list) else ()):
        at = stop.get("at") if isinstance(stop, dict) else None
        if isinstance(at, str) and at not in known:
            words = f"is no place of the mission {mission.name}{nearest(at, known)}"
            yield Fault(f"stops.{number}.at", shown(at), words, source)
