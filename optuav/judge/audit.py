"""The verdict on any plan: ours, edited by hand, or somebody else's."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from optuav.judge.figures import MISMATCH
from optuav.judge.itinerary import Itinerary
from optuav.judge.reading import read
from optuav.judge.replay import Replay, replay
from optuav.judge.tolerance import TOLERANCE, same
from optuav.mission.files import label
from optuav.mission.messages import printable, shown
from optuav.network import vehicle
from optuav.plan import Plan
from optuav.plan.file import DERIVED, to_dict
from optuav.plan.phases import LARGEST
from optuav.plan.trace import Event

MOST_SHOWN = 20
"""Events that are told one by one."""

WORDS = ("warnings",)
"""What a plan's file repeats in words, which may be put otherwise."""


@dataclass(frozen=True)
class Audit:
    """A verdict; it is true where the plan can be flown.

    Parameters
    ----------
    source
        The file, or the name of the mission.
    subject
        What was judged.
    replay
        Its simulation; None where there is no plan to simulate.
    events
        What happens and what is wrong, in order of time.
    """

    source: str
    subject: Plan | Itinerary
    replay: Replay | None
    events: tuple[Event, ...]

    @property
    def violations(self) -> tuple[Event, ...]:
        """What keeps the plan from being flown as it stands."""
        return tuple(event for event in self.events if event.violation)

    @property
    def flyable(self) -> bool:
        """The verdict."""
        return not self.violations

    def __bool__(self) -> bool:
        return self.flyable

    def __str__(self) -> str:
        return "\n".join(_lines(self))

    def to_dict(self) -> dict[str, Any]:
        """The audit as plain data: strings, numbers, truth values, lists, dicts and None."""
        return {
            "source": self.source,
            "mission": self.subject.mission.name,
            "flyable": self.flyable,
            "tolerance": TOLERANCE,
            "route": _route(self.replay),
            **{f"{name}_time_s": time_s for name, time_s in _times(self.replay)},
            "soc": dict(self.replay.soc) if self.replay else {},
            "events": [asdict(event) for event in self.events],
        }


def audit(plan: Plan | Itinerary | str | Path) -> Audit:
    """Judge a plan by simulating it from its mission, see `optuav.replay`.

    Whether it is the best is not judged: of ``slot_s`` only that every stay is in whole slots.

    Parameters
    ----------
    plan
        A plan, an itinerary, or a file: a saved plan (JSON), whose figures are compared with the
        simulation, or an itinerary in TOML, which states ``schema = 1``, the ``mission`` and its
        ``[[stops]]``.

    Returns
    -------
    Audit
        The verdict, true where the plan can be flown; with the events that say why not.

    Raises
    ------
    InputError
        With everything that keeps a file from being read.
    """
    if isinstance(plan, Plan | Itinerary):
        return _judged(printable(plan.mission.name), plan, {})
    return _judged(label(Path(plan)), *read(plan))


def _judged(source: str, subject: Plan | Itinerary, data: Mapping[str, Any]) -> Audit:
    if isinstance(subject, Plan) and not subject:
        why = "; ".join(subject.reasons) or subject.proof
        words = f"there is no plan ({subject.status.value}): {why}"
        return Audit(source, subject, None, (Event("no plan", 0.0, words),))
    replayed = replay(subject)
    events = list(replayed.events)
    if isinstance(subject, Plan):
        follows = to_dict(subject)
        for name in (each for each in DERIVED if each in data and each not in WORDS):
            events += _contradictions(name, data[name], follows[name], replayed.mission_time_s)
    return Audit(source, subject, replayed, tuple(events))


def _contradictions(here: str, stated: Any, follows: Any, time_s: float) -> Iterator[Event]:
    """Figures that a file repeats and that do not follow from its phases."""
    if isinstance(stated, dict) and isinstance(follows, dict) and stated.keys() == follows.keys():
        for key in follows:
            yield from _contradictions(f"{here}.{key}", stated[key], follows[key], time_s)
    elif isinstance(stated, list) and isinstance(follows, list) and len(stated) == len(follows):
        for number, pair in enumerate(zip(stated, follows, strict=True)):
            yield from _contradictions(f"{here}[{number}]", *pair, time_s)
    elif _number(stated) and _number(follows):
        if not same(stated, follows):
            words = f"{here}: the file says {stated:.10g}, its phases say {follows:.10g}"
            yield Event(MISMATCH, time_s, words, float(stated), float(follows))
    elif stated != follows:
        words = f"{here}: the file says {shown(stated)}, its phases say {shown(follows)}"
        yield Event(MISMATCH, time_s, words)


def _number(value: Any) -> bool:
    """Whether it can be computed with; JSON has integers that no float holds."""
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return is_number and abs(value) <= LARGEST


def _route(replayed: Replay | None) -> list[str]:
    if replayed is None or not replayed.phases:
        return []
    flights = [phase for phase in replayed.phases if phase.kind == "flight"]
    return [replayed.phases[0].start.name, *(phase.end.name for phase in flights)]


def _times(replayed: Replay | None) -> Iterator[tuple[str, float]]:
    if replayed is not None and replayed.phases:
        yield "mission", replayed.mission_time_s
        for kind in ("hover", "rest", "flight"):
            yield kind, replayed.time_s(kind)


def _lines(judged: Audit) -> Iterator[str]:
    mission = judged.subject.mission
    yield f"{'FLYABLE' if judged else 'NOT FLYABLE'}: {judged.source}"
    if judged.replay is not None and judged.replay.phases:
        times = ", ".join(f"{name} {time_s:.2f} s" for name, time_s in _times(judged.replay))
        soc = ", ".join(f"{name} {100 * level:.2f} %" for name, level in judged.replay.soc.items())
        yield f"Route      {printable(' → '.join(_route(judged.replay)))}"
        yield f"Times      {times}"
        yield f"Charge     {soc} left"
    for heading, events in (
        ("Violated", [event for event in judged.violations if event.kind != MISMATCH]),
        ("Contradicted", [event for event in judged.violations if event.kind == MISMATCH]),
        ("To know", [event for event in judged.events if not event.violation]),
    ):
        if events:
            yield ""
            yield heading
        yield from (printable(str(event)) for event in events[:MOST_SHOWN])
        if len(events) > MOST_SHOWN:
            yield f"and {len(events) - MOST_SHOWN} more"
    capacity_As = float(vehicle.pool(mission).capacity_As)
    yield ""
    share = f"{TOLERANCE:g} of the capacity ({TOLERANCE * capacity_As:.3g} A s)"
    yield f"Tolerance  {share}, of a limit, or of a figure"
