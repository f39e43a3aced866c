"""The verdict on any plan: a plan of ours, one edited by hand, or an itinerary in a file."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import TypeGuard

from optuav.errors import Fault, InputError, printable, printed
from optuav.frames import DataFrame, frame
from optuav.judge.course import TOLERANCE
from optuav.judge.replay import MISMATCH, Judged, Replay, replay, same
from optuav.judge.timeline import STOP, Itinerary, stop_breaches
from optuav.mission import Mission, load, shipped
from optuav.mission.files import beside, label, parse_json, parse_toml, read_text
from optuav.mission.load import is_name
from optuav.mission.messages import nearest, shown
from optuav.mission.schema import LARGEST
from optuav.mission.validation import Breach, Document, StatedMission, format_breaches
from optuav.network import vehicle
from optuav.plan import Plan, Stop
from optuav.plan.plan import DERIVED, KIND, LARGEST_BYTES, parse_plan
from optuav.plan.summary import unknown_buildings, wrapped
from optuav.plan.trace import Event

MOST_SHOWN = 20  # Largest number of events that are printed one by one

MOST_STOPS = 10_000  # Largest number of stops of an itinerary

KEYS = {
    "mission": "the name of a shipped mission, a path relative to this file, or a whole mission",
    "stops": f"tables [[stops]], each {STOP}; at most {MOST_STOPS}, or stops = []",
}
"""What the file of an itinerary states beside its schema."""


@dataclass(frozen=True)
class Audit(Judged):
    """A verdict on a plan; it is true where the plan can be flown.

    Parameters
    ----------
    source
        The file, or the name of the mission.
    subject
        The plan or itinerary.
    replay
        Its simulation; None where there is no plan to simulate.
    events
        What happens and what is wrong, in order of time.

    Examples
    --------
    >>> import optuav
    >>> found = optuav.audit(optuav.solve("paper", "P3", perspective="battery"))
    >>> bool(found), found.verdict, [event.kind for event in found.violations]
    (False, 'NOT FLYABLE', ['empty'])
    """

    source: str
    subject: Plan | Itinerary
    replay: Replay | None
    events: tuple[Event, ...]

    @property
    def contradicted(self) -> bool:
        """Whether the plan states a figure or a verdict that its simulation does not give."""
        return any(event.kind == MISMATCH for event in self.events)

    def __bool__(self) -> bool:
        return self.flyable

    __str__ = printed(lambda self: "\n".join(_lines(self)))

    def __repr__(self) -> str:
        return f"<Audit of {self.source!r}: {self.verdict}>"

    def _repr_html_(self) -> str:
        from optuav.judge.display import html

        return html(self, self.replay, f"{self.verdict}: {self.source}")

    def to_frame(self) -> DataFrame:
        """The events, one row each; needs pandas.

        Returns
        -------
        Columns as the attributes of `Event`.
        """
        return frame(map(asdict, self.events), [each.name for each in fields(Event)])

    def to_dict(self) -> dict[str, object]:
        """The audit as plain data: strings, numbers, truth values, lists, dicts and None."""
        return {
            "source": self.source,
            "mission": self.subject.mission.name,
            "flyable": self.flyable,
            "tolerance": TOLERANCE,
            "route": self.replay.route if self.replay else [],
            **(self.replay.times_s if self.replay else {}),
            "soc": dict(self.replay.soc) if self.replay else {},
            "events": [asdict(event) for event in self.events],
        }


def audit(plan: Plan | Itinerary | Mapping[str, object] | str | Path) -> Audit:
    """Judge a plan by simulating it from its mission, see `optuav.replay`.

    Whether the plan is the best is not judged; of ``slot_s`` only that every stay is whole slots.

    Parameters
    ----------
    plan
        A plan, an itinerary, or a file: a saved plan in JSON, whose figures are compared with the
        simulation, or an itinerary in TOML or JSON, which states ``schema = 1``, the ``mission``
        and its ``[[stops]]``. A dict with the content of such a file does as well.

    Returns
    -------
    Audit
        The verdict, true where the plan can be flown; with the events that say why not.

    Raises
    ------
    InputError
        With everything that keeps a file from being read.

    Examples
    --------
    >>> import optuav
    >>> shorter = optuav.Itinerary(optuav.load("paper"), (optuav.Stop("hover", "hover", 577.5),))
    >>> found = optuav.audit(shorter)
    >>> bool(found)
    True
    >>> print(str(found).splitlines()[2])
    Times      mission 653.29 s, hover 577.50 s, rest 0.00 s, flight 75.79 s
    """
    if isinstance(plan, Plan | Itinerary):
        return _judged(printable(plan.mission.name), plan, {})
    if isinstance(plan, Mapping):
        document, here = {**plan}, Path()
        if document.get("kind") == KIND:
            return _judged("a dict", *parse_plan(json.dumps(document, default=str), "a dict", here))
        return _judged("a dict", _itinerary(document, here, "a dict"), {})
    if not isinstance(plan, str | Path):
        words = "a Plan, an Itinerary of a mission and its stops, a dict, or the path of a file"
        raise InputError([Fault("plan", shown(plan), words)])
    file, source = Path(plan), label(Path(plan))
    known = "; it is a shipped mission, optuav solve takes it" if str(plan) in shipped() else ""
    text = read_text(file, LARGEST_BYTES, hint=known)
    if file.suffix != ".json" and not text.lstrip().startswith("{"):
        return _judged(source, _itinerary(parse_toml(text, source), file.parent, source), {})
    stated = None if KIND in text else parse_json(text, source)
    if isinstance(stated, dict) and "stops" in stated and "phases" not in stated:
        return _judged(source, _itinerary(stated, file.parent, source), {})
    return _judged(source, *parse_plan(text, source, file.parent))


def _judged(source: str, subject: Plan | Itinerary, data: Mapping[str, object]) -> Audit:
    if isinstance(subject, Plan) and not subject:
        why = "; ".join(subject.reasons) or subject.proof
        words = f"there is no plan ({subject.status.value}): {why}"
        return Audit(source, subject, None, (Event("no plan", 0.0, words),))
    replayed = replay(subject)
    events = list(replayed.events)
    if words := unknown_buildings(subject.mission):
        events.insert(0, Event("unknown", 0.0, words, violation=False))
    if isinstance(subject, Plan):
        follows = subject.to_dict()
        # Warnings repeat figures in sentences, which another version may put otherwise.
        for name in (each for each in DERIVED if each in data and each != "warnings"):
            events += _contradictions(name, data[name], follows[name], replayed.mission_time_s)
    return Audit(source, subject, replayed, tuple(events))


def _contradictions(here: str, stated: object, follows: object, time_s: float) -> Iterator[Event]:
    """Figures that a file repeats and that do not follow from its phases."""
    if isinstance(stated, dict) and isinstance(follows, dict) and stated.keys() == follows.keys():
        for key in follows:
            yield from _contradictions(f"{here}.{key}", stated[key], follows[key], time_s)
    elif isinstance(stated, list) and isinstance(follows, list) and len(stated) == len(follows):
        for number, pair in enumerate(zip(stated, follows, strict=True)):
            yield from _contradictions(f"{here}[{number}]", *pair, time_s)
    elif _is_number(stated) and _is_number(follows):
        if not same(stated, follows):
            words = f"{here}: the file says {stated:.10g}, its phases say {follows:.10g}"
            yield Event(MISMATCH, time_s, words, float(stated), float(follows))
    elif stated != follows:
        words = f"{here}: the file says {shown(stated)}, its phases say {shown(follows)}"
        yield Event(MISMATCH, time_s, words)


def _is_number(value: object) -> TypeGuard[float]:
    """Whether it can be computed with; JSON has integers that no float holds."""
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= LARGEST


def _lines(judged: Audit) -> Iterator[str]:
    mission = judged.subject.mission
    yield f"{judged.verdict}: {judged.source}"
    for heading, words in judged.replay.facts if judged.replay else ():
        yield f"{heading:11}{printable(words)}"
    for heading, events in judged.by_kind.items():
        if events:
            yield ""
            yield heading
        for event in events[:MOST_SHOWN]:
            start = f"{event.time_s:10.2f} s  "
            yield from wrapped("", event.words + event.figures, start, len(start))
        if len(events) > MOST_SHOWN:
            yield f"and {len(events) - MOST_SHOWN} more"
    capacity_As = float(vehicle.pool(mission).capacity_As)
    yield ""
    share = f"{TOLERANCE:g} of the capacity ({TOLERANCE * capacity_As:.3g} A s)"
    yield f"Tolerance  {share}, of a limit, or of a figure"


def _itinerary(document: Document, folder: Path, source: str) -> Itinerary:
    """The itinerary that a document states, or an `InputError` with all faults."""
    if not KEYS.keys() & document.keys() and {"extends", "limits", "route"} & document.keys():
        words = "is a mission, not an itinerary; optuav solve and validate take it"
        raise InputError([Fault("", "", words, source)])
    name, stops = document.get("mission"), document.get("stops", ())
    faults, breaches, mission = list[Fault](), format_breaches(document), None
    for key in {**KEYS, **document}:
        if key not in ("schema", *KEYS):
            breaches.append(Breach((key,), f"unknown key{nearest(key, KEYS)}"))
        elif key in KEYS and key not in document:
            breaches.append(Breach((key,), f"is missing; {KEYS[key]}"))
    if isinstance(name, str | dict) and name:
        try:
            if isinstance(name, dict):
                mission = Mission.from_dict(name)
            else:
                mission = load(name if is_name(name) else beside(folder, name))
        except InputError as error:
            # That there is no such file is a fault of the key, what is wrong in it its own.
            faults += (
                replace(each, key=f"mission.{each.key}", source=source)
                if isinstance(name, dict)
                else each
                if each.key
                else Fault("mission", shown(name), each.allowed, source)
                for each in error.faults
            )
    else:
        breaches.append(Breach(("mission",), KEYS["mission"]))
    if isinstance(stops, list) and len(stops) <= MOST_STOPS:
        breaches += stop_breaches(stops, mission)
    else:
        breaches.append(Breach(("stops",), KEYS["stops"]))
    faults = [*StatedMission(document, {(): source}).faults(breaches), *faults]
    if faults or mission is None:
        raise InputError(faults)
    return Itinerary(mission, tuple(Stop(**each) for each in stops))
