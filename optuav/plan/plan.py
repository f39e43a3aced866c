"""A plan, the answer to a problem over a mission, and its file in JSON."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal, Self, TypeAlias

from pydantic import (
    ConfigDict,
    GetPydanticSchema,
    StrictBool,
    ValidationError,
    model_validator,
)
from pydantic_core import core_schema, to_jsonable_python

from optuav.errors import Fault, InputError, NoPlanError, collected, printed, refuse, safe_name
from optuav.fields import Record, Slot
from optuav.flight.model import CruisingModel, FlightModel
from optuav.frames import DataFrame, frame, without_rounding
from optuav.mission import Mission, load
from optuav.mission.files import ending_of, label, parse_json, read_text, seen_from, write_text
from optuav.mission.messages import path_of, several, shown, worded
from optuav.network.places import ENDS
from optuav.network.timeline import Figure, Phase, Text, Words, carry, steps
from optuav.physics.kibam import time_to_empty, time_to_full
from optuav.plan.summary import TABLE, summary
from optuav.status import Status

SCHEMA = 1
KIND = "optuav plan"
LARGEST_BYTES = 32_000_000
MOST_PHASES = 10_000

DERIVED = (
    *("hover_time_s", "rest_time_s", "flight_time_s", "mission_time_s", "peak_speed_m_s"),
    *("runs_dry_s", "overfull_s", "route", "stops", "warnings"),
)
"""Figures that a file repeats for its readers; they follow from the phases, which decide."""

CANNOT = "this plan cannot be flown: "
"""Start of a note on why the simulation of a plan failed, where its warnings do not say so."""
ROUNDING = 1e-6  # Share of the capacity by which the judge lets a well pass its limit [-]

OBJECTIVE = ("objective", "objective_unit", "bound")
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
        Name of a place: ``"hover"``, a building's, ``"origin"`` or ``"destination"``; or, in an
        itinerary, another point to hover at, (x, y, z) [m], each up to 1e6.
    kind
        ``"rest"`` or ``"hover"``.
    duration_s
        For how long [s], 0 to 1e7.
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


class Plan(Record):
    """The answer to a problem over a mission.

    Without a plan, `status` and `reasons` say so, and every time or state raises
    `NoPlanError`. An existing plan is true.

    Parameters
    ----------
    mission
        The mission.
    problem, trajectory, building, order, perspective
        The question: names of the problem, of the trajectory, of the building to rest on, of the
        order of rest and hover (None where nothing was stated), and of the perspective.
    slot_s
        Length of the slots [s], 0.001 to 1e7; None for continuous times.
    engine, proof
        The engine, and how it knows that its answer is right.
    status
        Status of the problem as stated.
    binding
        Labels of the constraints that hold with equality; from the grid, of those that a slot more
        or less of a time would violate.
    reasons
        Reasons for no plan; empty with a plan.
    notes
        Remarks on the answer.
    phases
        Phases in order; empty without a plan.
    soc
        State of charge at the end by perspective [-]; None without a plan.
    flyable
        Whether the plan passed its simulation; None without a plan or a simulation.
    objective, objective_unit, bound
        Value of the problem's objective, for P1, P3 and P4 the hover time; its unit if one was
        declared; and, where the answer is not proved, a proved bound if one is known. None if
        missing, as in a plan without phases or in an older file.

    Examples
    --------
    >>> import optuav
    >>> plan = optuav.solve("paper", "P3", perspective="available")
    >>> print(f"{plan.hover_time_s:.2f} s of {plan.mission_time_s:.2f} s")
    577.52 s of 653.32 s
    >>> plan.route, plan.flyable
    (('origin', 'hover', 'destination'), True)
    """

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

    @model_validator(mode="after")
    def _is_whole(self) -> Self:
        """Refuse parts that do not fit together."""
        faults, answered = [], self.status.has_answer
        if bool(self.phases) != answered or (self.soc is not None) != answered:
            with_or_without = "needs" if answered else "has no"
            faults = [f"a plan that is {self.status.value} {with_or_without} phases and soc"]
        here, named = None, {end for p in self.phases for end in (p.start_place, p.end_place)}
        known = {*ENDS, *named.intersection(self.mission.buildings.names)}
        for number, phase in enumerate(self.phases):
            ends = dict.fromkeys((phase.start_place, phase.end_place))
            strange = (name for name in ends if name not in known)
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

    __str__ = printed(summary)

    @printed
    def __repr__(self) -> str:
        hover = f", Δ = {self.hover_time_s:.2f} s" if self else ""
        question = f"{self.problem}, perspective {self.perspective}"
        return f"<Plan for {self.mission.name!r}: {question}, {self.status.value}{hover}>"

    def _repr_html_(self) -> str:
        from optuav.plan.display import html

        return html(self)

    @property
    def hover_time_s(self) -> float:
        """Δ [s]."""
        return sum((p.duration_s for p in self._existing() if p.kind == "hover"), 0.0)

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
        if self.mission.battery.takes_turns:
            return carry(self.mission, self._existing()).ended_s
        return self._first_crossing_s(full=False)

    @property
    def overfull_s(self) -> float | None:
        """When charging first drives the available well past full [s]; None if it never does.

        Where packs take turns, and where charging tapers, a full pack takes no more than it holds.
        """
        battery = self.mission.battery
        refuses = battery.takes_turns or battery.charging == "taper"
        return None if self._existing() and refuses else self._first_crossing_s(full=True)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences on why the battery cannot fly the plan; empty if it can."""
        sentences, turns = [], self.mission.battery.takes_turns
        if (dry_s := self.runs_dry_s) is not None:
            what = "no pack is left to fly on" if turns else "the available well runs dry"
            sentences.append(f"{what} at {dry_s:.2f} s: this plan cannot be flown")
        if (full_s := self.overfull_s) is not None:
            what = f"charging drives the available well past full at {full_s:.2f} s"
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
        kinds = [phase.kind for phase in self.phases]
        return self.engine == "search" or kinds.count("rest") > 1 or kinds.count("hover") > 1

    def _existing(self) -> tuple[Phase, ...]:
        if not self.phases:
            why = "; ".join(self.reasons) or self.proof
            raise NoPlanError(f"there is no plan ({self.status.value}): {why}")
        return self.phases

    def _first_crossing_s(self, *, full: bool) -> float | None:
        """When y1 first rises above ωB, or else falls below 0 [s]; a stage's end is the extreme."""
        pool, time_to = self.mission.pool, time_to_full if full else time_to_empty
        charged = steps(self.mission, self._existing())
        for _, start_s, (current_A, duration_s), before, after in charged:
            level = after.available_As / pool.capacity_As
            if level > pool.available_fraction + ROUNDING if full else level < -ROUNDING:
                return float(start_s + min(time_to(pool, before, current_A), duration_s))
        return None

    @printed
    def summary(self) -> str:
        """The plan as an aligned block of text."""
        return summary(self)

    def to_dict(self) -> dict[str, Any]:
        """The plan as plain data: strings, numbers, lists, dicts and None.

        It has the fields of the plan with its mission inside; times and route are repeated for the
        reader, None without a plan. If the mission's buildings come from a table, only those that
        the plan uses are inside, beside its path and hash.
        """
        return self._data(Path())

    def _data(self, file: Path) -> dict[str, Any]:
        """The plan as plain data, which names a table by its path from the folder of a file."""
        unstated = {name for name in OBJECTIVE if getattr(self, name) in (None, "")}
        data = self.model_dump(mode="json", exclude={"mission", *unstated})
        phases, mission = data.pop("phases"), self.mission
        derived = {name: getattr(self, name) if self else None for name in DERIVED}
        data = {"schema": SCHEMA, "kind": KIND, **data, **to_jsonable_python(derived)}
        # Files of plans without bent ways and chosen speeds are as they always were.
        rare = {"waypoints_m", "speeds_m_s"}
        data["phases"] = [{k: v for k, v in e.items() if v or k not in rare} for e in phases]
        if source := mission.buildings.source:
            from optuav.plan.used import used_buildings

            data[TABLE] = {**asdict(source), "path": seen_from(file, source.path)}
            mission = mission.model_copy(update={"buildings": used_buildings(self)})
        return {**data, "mission": mission.to_dict()}

    def save(self, path: str | Path) -> Path:
        """Write the plan as JSON, whole or not at all; `optuav.load_plan` reads it back.

        The suffix is .json or none; an existing file is replaced. `InputError` if the suffix is
        another, or the directory is missing or cannot be written to.
        """
        file = path_of(path)
        ending_of(file, ".json", "")
        text = json.dumps(self._data(file), indent=2, ensure_ascii=False, allow_nan=False)
        write_text(file, text + "\n")
        return file

    def export(self, path: str | Path, *, force: bool = False) -> Path:
        """Write where the plan flies, hovers and rests on Earth; needs pyproj.

        Parameters
        ----------
        path
            The file; its suffix decides the format. .kml and .geojson hold lines and points at
            altitudes above mean sea level, z + ``earth.altitude_m``. .plan (QGroundControl) and
            .waypoints (MAVLink's text, "QGC WPL 110") hold commands at altitudes above home, which
            is the origin: a change of speed before each leg, a hover as a loiter with its time, a
            rest as a landing, a delay and a take-off. An existing file is replaced.
        force
            Whether to export a plan that cannot be flown, or was not simulated; the file says why.

        Returns
        -------
        Path
            The file that was written. It says that no autopilot has flown the plan.

        Raises
        ------
        InputError
            If the suffix is another, the mission states neither ``crs`` nor ``[earth]``, the
            reference system is unknown or not in metres, the plan cannot be flown, or the file
            cannot be written.
        NoPlanError
            Without a plan.

        Examples
        --------
        >>> import optuav, tempfile
        >>> place = {"earth.latitude_deg": 52.5, "earth.longitude_deg": 13.4}
        >>> plan = optuav.solve(optuav.load("paper").replace(place))
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     plan.export(f"{folder}/paper.waypoints").read_text().splitlines()[0]
        'QGC WPL 110'
        """
        from optuav.plan.export import export

        return export(self, path, force=force)

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


Plans: TypeAlias = Plan | str | Path | Sequence[Plan | str | Path]
"""One plan or several, also by the paths of their files."""


def load_plan(source: Plan | str | Path) -> Plan:
    """Read a plan that `Plan.save` wrote; the round trip is exact.

    Parameters
    ----------
    source
        Path of a JSON file, up to 32 MB; a plan is returned unchanged.

    Returns
    -------
    Plan
        The plan, its mission inside. `flyable` comes from the file: `optuav.replay` simulates it.
        A table of buildings that the file names is read where it is there; or else the plan's
        mission has only the buildings that the plan uses.

    Raises
    ------
    InputError
        With everything that is wrong with the file, or if its table of buildings is another one.

    Examples
    --------
    >>> import optuav, tempfile
    >>> plan = optuav.solve("paper", "P3", perspective="available")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     _ = plan.save(f"{folder}/plan.json")
    ...     optuav.load_plan(f"{folder}/plan.json") == plan
    True
    """
    if isinstance(source, Plan):
        return source
    path = path_of(source, "plan", "a plan, or the path of its file")
    plan, data = parse_plan(read_text(path, LARGEST_BYTES), label(path), path.parent)
    refuse_contradictions(plan, data, label(path))
    return plan


def refuse_contradictions(plan: Plan, data: Mapping[str, Any], source: str) -> None:
    """Refuse the data of a file whose repeated figures contradict its phases."""
    follows = plan.to_dict() if data else {}
    refuse(
        Fault(name, shown(data[name]), f"{shown(follows[name])} follows from the phases", source)
        for name in DERIVED
        if name in data and data[name] != follows[name]
    )


def load_plans(stated: Plans, name: str = "plans", least: int = 1) -> list[Plan]:
    """Load one plan or several with `load_plan`."""
    words = "a plan, the path of its file, or several of these"
    return [load_plan(plan) for plan in several(name, stated, Plan | str | Path, words, least)]


def load_subject(source: Plan | Mission | str | Path) -> Plan | Mission:
    """A plan, also by the path of its .json file, or else a mission as `optuav.load` takes it."""
    if isinstance(source, str | Path) and Path(source).suffix == ".json":
        return load_plan(source)
    return source if isinstance(source, Plan) else load(source)


def parse_plan(text: str, source: str, folder: Path) -> tuple[Plan, dict[str, Any]]:
    """A plan and the data of its file, whose repeated figures may contradict the plan.

    A table of buildings is looked for from a folder.

    Raises `InputError` with everything that keeps the text from being a plan.
    """
    data = parse_json(text, source)
    if not isinstance(data, dict) or "kind" not in data:
        raise InputError([Fault("", "", f'is not a plan: "kind": "{KIND}" is missing', source)])
    if data["kind"] != KIND:
        raise InputError([Fault("kind", shown(data["kind"]), f'"{KIND}"', source)])
    if data.get("schema") != SCHEMA:
        value = shown(data["schema"]) if "schema" in data else ""
        words = f"{SCHEMA} is the only version that is read"
        raise InputError([Fault("schema", value, words, source)])
    if isinstance(phases := data.get("phases"), list) and len(phases) > MOST_PHASES:
        raise InputError([Fault("phases", "", f"a list of at most {MOST_PHASES}", source)])
    fields = {k: v for k, v in data.items() if k not in ("schema", "kind", TABLE, *DERIVED)}
    of_mission, of_table = list[Fault](), list[Fault]()
    if "mission" in data:
        fields["mission"] = None
        with collected(of_mission):
            fields["mission"] = Mission.from_dict(data["mission"])
    if TABLE in data and isinstance(mission := fields.get("mission"), Mission):
        from optuav.plan.used import with_table

        with collected(of_table):
            table = with_table(mission.buildings, data[TABLE], folder)
            fields["mission"] = mission.replace({"buildings": table})
    faults = [replace(each, key=f"mission.{each.key}".rstrip(".")) for each in of_mission]
    faults += [each if each.key else Fault(TABLE, "", str(each)) for each in of_table]
    faults = [replace(each, source=source) for each in faults]
    try:
        plan = Plan.model_validate(fields)
    except ValidationError as error:
        known = bool(faults)  # Of a mission that is refused, nothing else is said
        faults += (e for e in _record_faults(error, source) if not known or e.key != "mission")
    refuse(faults)
    return plan, data


def _record_faults(error: ValidationError, source: str) -> Iterator[Fault]:
    """Return the faults of a plan's data by dotted key; of a list only its wrong entries."""
    details = error.errors(include_url=False)
    above = {detail["loc"][:depth] for detail in details for depth in range(1, len(detail["loc"]))}
    for detail in details:
        if detail["loc"] in above:
            continue
        key = ".".join(safe_name(part) for part in detail["loc"])
        value = "" if detail["type"] == "missing" or not key else shown(detail["input"])
        yield Fault(key, value, worded(detail), source)
