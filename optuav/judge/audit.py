"""The verdict on any plan: a plan of ours, one edited by hand, or an itinerary in a file."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any, TypeGuard

from optuav.errors import Fault, InputError
from optuav.fields import LARGEST
from optuav.frames import DataFrame, frame
from optuav.judge.flight_plan import FlightPlan, Reached, is_flight, reached, read_flight
from optuav.judge.read import read
from optuav.judge.replay import MISMATCH, Judged, Replay, replay, same
from optuav.judge.timeline import Itinerary
from optuav.mission import Mission
from optuav.mission.messages import shown
from optuav.network import vehicle
from optuav.plan import Plan
from optuav.plan.data import JUDGE_TOLERANCE
from optuav.plan.plan import DERIVED
from optuav.plan.summary import unknown_buildings
from optuav.plan.trace import FlightEvent
from optuav.presentation.blocks import Block, Facts, Heading, Note, Table
from optuav.presentation.numbers import figure, fixed, percent, seconds

MOST_SHOWN = 20  # Largest number of items that are printed one by one


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
        yield from _items(self)
        yield from self.event_blocks()
        capacity_As = float(self.subject.mission.pool.capacity_As)
        size = figure(JUDGE_TOLERANCE * capacity_As, 3)
        share = f"{figure(JUDGE_TOLERANCE)} of the capacity ({size} A s)"
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
            "tolerance": JUDGE_TOLERANCE,
            "route": self.replay.route if self.replay else [],
            **(self.replay.times_s if self.replay else {}),
            "soc": dict(self.replay.soc) if self.replay else {},
            "events": [asdict(event) for event in self.events],
            **self._flight(),
        }

    def _flight(self) -> dict[str, object]:
        """Items, margin and notes of a flight plan; nothing for other plans."""
        if not isinstance(self.subject, FlightPlan):
            return {}
        along = _along(self)
        margin = along[-1].charge - self.subject.mission.limits.min_soc if along else None
        items = [row._asdict() for row in along]
        return {"items": items, "margin": margin, "notes": [*self.subject.notes]}


def audit(
    plan: Plan | Itinerary | Mapping[str, object] | str | Path,
    mission: Mission | str | Path | None = None,
) -> Audit:
    """Judge a plan by simulating it from its mission, see `optuav.replay`.

    The audit does not judge whether the plan is the best; of ``slot_s`` it checks only that every
    stay is whole slots.

    Parameters
    ----------
    plan
        A plan, an itinerary, or a file: a saved plan in JSON, whose figures are compared with the
        simulation, or an itinerary in TOML or JSON, which states ``schema = 1``, the ``mission``
        and its ``[[stops]]``. A dict with the content of such a file works too. Or a flight plan of
        a ground station: ``.plan``, ``.waypoints`` or ``.kml``.
    mission
        Only with a flight plan: the mission that provides the drone, its battery and limits, and
        the wind.

    Returns
    -------
    Audit
        The verdict, true if the plan can be flown, with the events that say why not.

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
    source, subject, data = subject_of(plan, mission)
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


def subject_of(
    plan: Plan | Itinerary | Mapping[str, object] | str | Path,
    mission: Mission | str | Path | None,
) -> tuple[str, Plan | Itinerary, Mapping[str, Any]]:
    """The name of what is audited, its plan or itinerary, and the data of a plan's file."""
    if mission is not None:
        if not isinstance(plan, str | Path) or (
            Path(plan).suffix.lower() in ("", ".json", ".toml") and not is_flight(plan)
        ):
            words = "goes with a flight plan only: a .plan, .waypoints or .kml, or QGC WPL text"
            raise InputError([Fault("mission", shown(mission), words)])
        return (*read_flight(plan, mission), {})
    if is_flight(plan):
        words = "is a flight plan: name the drone that flies it by mission, such as relay-today"
        raise InputError([Fault("", "", words, str(plan))])
    return read(plan)


def _along(judged: Audit) -> tuple[Reached, ...]:
    """The items of a flight plan, with what is in reach after each; empty for other plans."""
    subject, replayed = judged.subject, judged.replay
    if not isinstance(subject, FlightPlan) or replayed is None or replayed.course is None:
        return ()
    return reached(subject, replayed.phases, replayed.course)


def _margin(judged: Audit, along: Sequence[Reached]) -> Iterator[tuple[str, str]]:
    """The margin of a flight plan, and the last items from which places are in reach."""
    mission, least = judged.subject.mission, min(row.available for row in along)
    left, reserve = along[-1].charge, mission.limits.min_soc
    if mission.start is not None:
        begin_As = vehicle.start(mission).wells(mission.pool).total_As
        yield (
            "Take-off",
            f"with {percent(float(begin_As / mission.pool.capacity_As))} of the charge",
        )
    side = f"{percent(abs(left - reserve))} {'above' if left >= reserve else 'below'} the reserve"
    if abs(left - reserve) <= JUDGE_TOLERANCE:
        side = "at the reserve"
    well = f"available well at least {percent(least)} full"
    yield "Margin", f"{percent(left)} of the charge left, {side}; {well}"
    speed_m_s = math.hypot(*mission.wind.velocity_m_s)
    yield "Wind", f"{figure(speed_m_s)} m/s" + ("" if speed_m_s else ", none is stated")
    if along[0].home is None:
        return
    for place, rows in (
        ("home", [row for row in along if row.home]),
        ("a roof", [row for row in along if row.roof]),
    ):
        if place == "a roof" and not len(mission.buildings.names):
            continue
        if len(rows) == len(along):
            yield "In reach", f"{place} is, straight on, after every item"
        elif rows:
            which = f" ({rows[-1].roof})" if place == "a roof" else ""
            at = f"after {rows[-1].item}, at {seconds(rows[-1].end_s, 0)}"
            yield "In reach", f"{place}{which} is for the last time {at}"
        else:
            yield "In reach", f"{place} is after no item"


def _items(judged: Audit) -> Iterator[Block]:
    """The items of a flight plan as a table, and what the verdict assumes."""
    if not (along := _along(judged)):
        return
    assert isinstance(judged.subject, FlightPlan)
    yield Facts([*_margin(judged, along)])
    heads = ("item", "what", "until s", "charge %", "available %", "home", "roof")
    rows = list[list[str]]()
    shown_rows = [*along[:MOST_SHOWN], along[-1]] if len(along) > MOST_SHOWN + 1 else along
    for row in shown_rows:
        home = "?" if row.home is None else "yes" if row.home else "no"
        shares = (fixed(100.0 * share, 1) for share in (row.charge, row.available))
        rows.append([row.item, row.what, fixed(row.end_s, 1), *shares, home, row.roof or "–"])
    left_out = len(along) - len(shown_rows)
    below = [f"and {left_out} more before the last"] if left_out else []
    yield Table(heads, rows, words=2, last=2, longest=30, below=below)
    if judged.subject.notes:
        yield Heading("Notes")
        yield Note([*judged.subject.notes])


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
            words = (
                f"{here}: the file says {figure(stated, 10)}, its phases say {figure(follows, 10)}"
            )
            yield FlightEvent(MISMATCH, time_s, words, float(stated), float(follows))
    elif stated != follows:
        words = f"{here}: the file says {shown(stated)}, its phases say {shown(follows)}"
        yield FlightEvent(MISMATCH, time_s, words)


def _is_number(value: object) -> TypeGuard[float]:
    """Return whether a value can be computed with; JSON has integers that no float holds."""
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= LARGEST
