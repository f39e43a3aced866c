"""The verdict on any plan: a plan of ours, one edited by hand, or an itinerary in a file."""

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import TypeGuard

from optuav.fields import LARGEST
from optuav.frames import DataFrame, frame
from optuav.judge.course import TOLERANCE
from optuav.judge.read import read
from optuav.judge.replay import MISMATCH, Judged, Replay, replay, same
from optuav.judge.timeline import Itinerary
from optuav.mission.messages import shown
from optuav.plan import Plan
from optuav.plan.plan import DERIVED
from optuav.plan.summary import unknown_buildings
from optuav.plan.trace import FlightEvent
from optuav.presentation.blocks import Block, Facts, Heading


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

    def __repr__(self) -> str:
        return f"<Audit of {self.source!r}: {self.verdict}>"

    def blocks(self) -> Iterator[Block]:
        """Yield the verdict, route and times, the wells, the events, and the tolerance."""
        yield Heading(f"{self.verdict}: {self.source}", good=self.flyable)
        if self.replay:
            yield from self.replay.flight_blocks()
        yield from self.event_blocks()
        capacity_As = float(self.subject.mission.pool.capacity_As)
        share = f"{TOLERANCE:g} of the capacity ({TOLERANCE * capacity_As:.3g} A s)"
        yield Facts([("Tolerance", f"{share}, of a limit, or of a figure")])

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
    >>> verdict = optuav.audit(shorter)
    >>> bool(verdict)
    True
    >>> print(str(verdict).splitlines()[2])
    Times        mission 653.29 s, hover 577.50 s, rest 0.00 s, flight 75.79 s
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
