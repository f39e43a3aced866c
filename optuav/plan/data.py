"""A plan as data: question, answer and phases, and the figures that follow from them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any, Literal, Self, TypeAlias

from pydantic import ConfigDict, GetPydanticSchema, StrictBool, model_validator
from pydantic_core import core_schema

from optuav.errors import NoPlanError
from optuav.fields import Record, Slot
from optuav.flight.model import CruisingModel, FlightModel
from optuav.frames import DataFrame, frame, without_rounding
from optuav.mission import Mission
from optuav.mission.messages import shown
from optuav.network.places import ends_of
from optuav.network.timeline import Figure, Phase, Text, Words, carry, steps
from optuav.physics.kibam import time_to_empty, time_to_full
from optuav.presentation.numbers import seconds
from optuav.status import Status

CANNOT = "this plan cannot be flown: "
"""Start of a note on why the simulation of a plan failed, where its warnings do not say so."""
JUDGE_TOLERANCE = 1e-6  # Tolerance, as a share of the capacity, of a limit or of a figure [-]

OBJECTIVE = ("objective", "objective_unit", "bound")
RARE = (*OBJECTIVE, "device_order")
"""Fields that a file has where they say something."""
COLUMNS = (
    *("kind", "start_place", "end_place", "start_s", "duration_s", "current_A", "power_W"),
    *("distance_m", "peak_speed_m_s", "edited"),
)
"""Attributes of a phase that are columns of a plan's table."""


ValidMission = Annotated[
    Mission, GetPydanticSchema(lambda *_: core_schema.is_instance_schema(Mission))
]
"""A mission as it is; pydantic's own `InstanceOf` builds the schema of all its tables again."""

Waypoints: TypeAlias = tuple[tuple[tuple[float, float, float], ...], ...]
"""Points (x, y, z) [m] by leg."""


@dataclass(frozen=True)
class Stop:
    """A stay at one place.

    Parameters
    ----------
    at
        Name of a place: ``"hover"`` or, of several devices, a device's; a building's, ``"origin"``
        or ``"destination"``; or, in an itinerary, another point to hover at, (x, y, z) [m], each up
        to 1e6.
    kind
        ``"rest"`` or ``"hover"``.
    duration_s
        Duration [s], 0 to 1e7.
    start_s
        Start, counted from take-off [s]; None in an itinerary, where it follows.

    Examples
    --------
    >>> import optuav
    >>> optuav.Stop("b9", "rest", 231.8).duration_s
    231.8
    >>> print(f"{optuav.solve('paper').stops[0].start_s:.2f} s")
    37.90 s
    """

    at: str | tuple[float, float, float]
    kind: Literal["rest", "hover"]
    duration_s: float
    start_s: float | None = None

    def __post_init__(self) -> None:
        stated: Any = self.at
        at = stated.tolist() if hasattr(stated, "tolist") else stated  # Of an array
        object.__setattr__(self, "at", tuple(at) if isinstance(at, list) else at)


class PlanData(Record):
    """The data of a `Plan`. True where there is a plan."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    mission: ValidMission
    problem: str
    trajectory: str | None
    building: str | None
    order: str | None
    perspective: str
    slot_s: Slot | None
    engine: str
    proof: str
    status: Status
    binding: Words = ()
    reasons: Words = ()
    notes: Words = ()
    phases: tuple[Phase, ...] = ()
    soc: dict[str, Figure] | None = None
    flyable: StrictBool | None = None
    objective: Figure | None = None
    objective_unit: Text = ""
    bound: Figure | None = None
    device_order: tuple[Text, ...] | None = None

    @model_validator(mode="after")
    def _is_whole(self) -> Self:
        """Refuse parts that do not fit together."""
        faults, answered = [], self.status.has_answer
        if bool(self.phases) != answered or (self.soc is not None) != answered:
            with_or_without = "needs" if answered else "has no"
            faults = [f"with status {self.status.value}, a plan {with_or_without} phases and soc"]
        here, named = None, {end for p in self.phases for end in (p.start_place, p.end_place)}
        existing = {*ends_of(self.mission), *named.intersection(self.mission.buildings.names)}
        for number, phase in enumerate(self.phases):
            ends = dict.fromkeys((phase.start_place, phase.end_place))
            strange = (name for name in ends if name not in existing)
            wrong = [f": {name!r} is not a place of the mission" for name in strange]
            if here not in (None, phase.start_place):
                wrong.append(" begins elsewhere than the one before it ends")
            if phase.kind != "flight" and len(ends) > 1:
                wrong.append(f": a {phase.kind} ends where it begins")
            if phase.kind != "flight" and phase.waypoints_m:
                wrong.append(f": a {phase.kind} has no waypoints_m")
            if phase.speeds_m_s:
                wrong += _wrong_speeds(phase, self.mission.flight_model)
            if len(phase.available_As) != len(phase.bound_As):
                wrong.append(": available_As and bound_As need one entry a pack")
            faults += [f"phases[{number}]{words}" for words in wrong]
            here = phase.end_place
        if self.phases and all(phase.kind != "flight" for phase in self.phases):
            faults.append("phases: at least one is a flight")
        if faults:
            raise ValueError("; ".join(faults))
        return self

    def __bool__(self) -> bool:
        return bool(self.phases)

    @property
    def hover_time_s(self) -> float:
        """Δ [s]."""
        return sum((p.duration_s for p in self._existing() if p.kind == "hover"), 0.0)

    @property
    def hovers(self) -> dict[str, float]:
        """Hover time by device, in flight order [s]; of one device by its place, "hover"."""
        hovers_s = dict[str, float]()
        for phase in self._existing():
            if phase.kind == "hover":
                at = phase.end_place
                hovers_s[at] = hovers_s.get(at, 0.0) + phase.duration_s
        return hovers_s

    @property
    def rest_time_s(self) -> float:
        """T' [s]."""
        return sum((p.duration_s for p in self._existing() if p.kind == "rest"), 0.0)

    @property
    def flight_time_s(self) -> float:
        """T_fl [s]."""
        return sum((p.duration_s for p in self._existing() if p.kind == "flight"), 0.0)

    @property
    def mission_time_s(self) -> float:
        """T = T_fl + Δ + T' [s]."""
        return self.flight_time_s + self.hover_time_s + self.rest_time_s

    @property
    def route(self) -> tuple[str, ...]:
        """Names of the places in flight order."""
        flights = [phase for phase in self._existing() if phase.kind == "flight"]
        return (flights[0].start_place, *(phase.end_place for phase in flights))

    @property
    def waypoints_m(self) -> Waypoints:
        """Points (x, y, z) [m] along each leg, in order; none for a straight one."""
        return tuple(phase.waypoints_m for phase in self._existing() if phase.kind == "flight")

    @property
    def speeds_m_s(self) -> tuple[tuple[float, ...], ...]:
        """Speeds of each leg between its waypoints [m/s], in order; none where not sought."""
        return tuple(phase.speeds_m_s for phase in self._existing() if phase.kind == "flight")

    @property
    def stops(self) -> tuple[Stop, ...]:
        """Hovers and rests in order; a stop with T' = 0 is passed by."""
        return tuple(
            Stop(phase.end_place, phase.kind, phase.duration_s, phase.start_s)
            for phase in self._existing()
            if phase.kind != "flight"
        )

    @property
    def peak_speed_m_s(self) -> float:
        """Largest speed on any leg [m/s]."""
        return max(phase.peak_speed_m_s for phase in self._existing())

    @property
    def runs_dry_s(self) -> float | None:
        """When the available well is empty, or no pack is left to fly on [s]; None if never."""
        return self.limits_passed_s()[0]

    @property
    def overfull_s(self) -> float | None:
        """When charging first drives the available well past full [s]; None if it never does.

        Where packs take turns, and where charging tapers, a full pack takes no more than it holds.
        """
        return self.limits_passed_s()[1]

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences on why the battery cannot fly the plan; empty if it can."""
        sentences, turns = [], self.mission.battery.takes_turns
        dry_s, full_s = self.limits_passed_s()
        if dry_s is not None:
            what = "no pack is left to fly on" if turns else "the available well runs dry"
            sentences.append(f"{what} at {seconds(dry_s)}: this plan cannot be flown")
        if full_s is not None:
            what = f"charging drives the available well past full at {seconds(full_s)}"
            sentences.append(f"{what}: the battery would take less than the plan counts on")
        return tuple(sentences)

    @property
    def faults(self) -> tuple[str, ...]:
        """Reasons why the plan cannot be flown: its warnings, and notes on its simulation."""
        notes = (note.removeprefix(CANNOT) for note in self.notes if note.startswith(CANNOT))
        return (*self.warnings, *notes)

    @property
    def has_several_stops(self) -> bool:
        """True if it has, or was asked for with, several rests or several hovers."""
        kinds, hovers = [phase.kind for phase in self.phases], len(self.mission.served)
        return self.engine == "search" or kinds.count("rest") > 1 or kinds.count("hover") > hovers

    def _existing(self) -> tuple[Phase, ...]:
        if not self.phases:
            why = "; ".join(self.reasons) or self.proof
            raise NoPlanError(f"there is no plan ({self.status.value}): {why}")
        return self.phases

    def limits_passed_s(self) -> tuple[float | None, float | None]:
        """Both `runs_dry_s` and `overfull_s`, of which one flight through the wells tells both."""
        phases, battery = self._existing(), self.mission.battery
        if battery.takes_turns:
            return carry(self.mission, phases).ended_s, None
        pool, dry_s, full_s = self.mission.pool, None, None
        # y1 is extreme at the end of a stage.
        for _, start_s, (current_A, duration_s), before, after in steps(self.mission, phases):
            level = after.available_As / pool.capacity_As
            if dry_s is None and level < -JUDGE_TOLERANCE:
                dry_s = float(start_s + min(time_to_empty(pool, before, current_A), duration_s))
            if full_s is None and level > pool.available_fraction + JUDGE_TOLERANCE:
                full_s = float(start_s + min(time_to_full(pool, before, current_A), duration_s))
        return dry_s, None if battery.charging == "taper" else full_s

    def to_frame(self) -> DataFrame:
        """One row per phase, in order; needs pandas (``python -m pip install pandas``).

        Columns are the attributes of `Phase`, mean current [A] and power [W] into the battery, and
        the charge in the wells at its end, ``available_As`` and ``bound_As``, summed over the packs
        [A s], 0 where less than 1e-9 of the capacity is left. Without a plan, the table has no
        rows. Its ``attrs`` have `objective`, `objective_unit` and `bound`.
        """
        table = {name: [getattr(phase, name) for phase in self.phases] for name in COLUMNS}
        for name in ("available_As", "bound_As"):
            level_As = [sum(getattr(phase, name)) for phase in self.phases]
            table[name] = without_rounding(level_As, self.mission.battery.capacity_As).tolist()
        rows = frame(table)
        rows.attrs |= {name: getattr(self, name) for name in OBJECTIVE}
        return rows


def _wrong_speeds(phase: Phase, flight: FlightModel) -> Iterator[str]:
    """Yield the faults of the speeds that a phase states."""
    if phase.kind != "flight":
        yield f": a {phase.kind} has no speeds_m_s"
    elif not isinstance(flight, CruisingModel):
        yield f": legs of flight.model {shown(flight.name)} have no speeds_m_s"
    elif len(phase.speeds_m_s) != 1 + len(phase.waypoints_m):
        yield ": speeds_m_s needs one entry before each waypoint and one after the last"
