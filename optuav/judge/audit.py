"""The verdict on any plan: a plan of ours, one edited by hand, or an itinerary in a file."""

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import TypeGuard

from optuav.errors import printable, printed
from optuav.fields import LARGEST
from optuav.frames import DataFrame, frame
from optuav.judge.course import TOLERANCE
from optuav.judge.read import read
from optuav.judge.replay import MISMATCH, Judged, Replay, replay, same
from optuav.judge.timeline import Itinerary
from optuav.mission.messages import shown
from optuav.plan import Plan
from optuav.plan.plan import DERIVED
from optuav.plan.summary import unknown_buildings, wrapped
from optuav.plan.trace import FlightEvent

MOST_SHOWN = 20  # Largest number of events that are printed one by one


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
        Its simulation; None without a plan to simulate.
    events
        Events and faults, in order of time.

    Examples
    --------
    >>> import optuav
    >>> verdict = optuav.audit(optuav.solve("paper", "P3", perspective="battery"))
    >>> bool(verdict), verdict.verdict, [event.kind for event in verdict.violations]
    (False, 'NOT FLYABLE', ['empty'])
    """

    source: str
    subject: Plan | Itinerary
    replay: Replay | None
    events: tuple[FlightEvent, ...]

    @property
    def contradicted(self) -> bool:
        """True if the plan states a figure or a verdict that its simulation does not give."""
        return any(event.kind == MISMATCH for event in self.events)

    def __bool__(self) -> bool:
        return self.flyable

    __str__ = printed(lambda self: "\n".join(_lines(self)))

    def __repr__(self) -> str:
        return f"<Audit of {self.source!r}: {self.verdict}>"

    def _repr_html_(self) -> str:
        more = self.replay._pictured() if self.replay else []
        return self._html(f"{self.verdict}: {self.source}", *more)

    def to_frame(self) -> DataFrame:
        """The events, a row each, with columns as the fields of `FlightEvent`; needs pandas."""
        return frame(map(asdict, self.events), [field.name for field in fields(FlightEvent)])

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

    The audit does not judge whether the plan is the best; of ``slot_s`` it checks only that every
    stay is whole slots.

    Parameters
    ----------
    plan
        A plan, an itinerary, or a file: a saved plan in JSON, whose figures are compared with the
        simulation, or an itinerary in TOML or JSON, which states ``schema = 1``, the ``mission``
        and its ``[[stops]]``. A dict with the content of such a file also works.

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
    >>> verdict = optuav.audit(shorter)
    >>> bool(verdict)
    True
    >>> print(str(verdict).splitlines()[2])
    Times      mission 653.29 s, hover 577.50 s, rest 0.00 s, flight 75.79 s
    """
    source, subject, data = read(plan)
    if isinstance(subject, Plan) and not subject:
        why = "; ".join(subject.reasons) or subject.proof
        words = f"there is no plan ({subject.status.value}): {why}"
        return Audit(source, subject, None, (FlightEvent("no plan", 0.0, words),))
    replayed = replay(subject)
    events = list(replayed.events)
    if words := unknown_buildings(subject.mission):
        events.insert(0, FlightEvent("unknown", 0.0, words, violation=False))
    if isinstance(subject, Plan):
        follows = subject.to_dict()
        # Warnings repeat figures in sentences, which another version may put otherwise.
        for name in (key for key in DERIVED if key in data and key != "warnings"):
            events += _contradictions(name, data[name], follows[name], replayed.mission_time_s)
    return Audit(source, subject, replayed, tuple(events))


def _contradictions(
    here: str, stated: object, follows: object, time_s: float
) -> Iterator[FlightEvent]:
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
            yield FlightEvent(MISMATCH, time_s, words, float(stated), float(follows))
    elif stated != follows:
        words = f"{here}: the file says {shown(stated)}, its phases say {shown(follows)}"
        yield FlightEvent(MISMATCH, time_s, words)


def _is_number(value: object) -> TypeGuard[float]:
    """Return whether a value can be computed with; JSON has integers that no float holds."""
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
    capacity_As = float(mission.pool.capacity_As)
    yield ""
    share = f"{TOLERANCE:g} of the capacity ({TOLERANCE * capacity_As:.3g} A s)"
    yield f"Tolerance  {share}, of a limit, or of a figure"
