"""A plan, the answer to a problem over a mission, and its file in JSON."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, TypeAlias

from pydantic import ValidationError
from pydantic_core import to_jsonable_python

from optuav.errors import Fault, InputError, collected, for_console, refuse, safe_name
from optuav.mission import Mission, load
from optuav.mission.files import ending_of, label, parse_json, read_text, relative_to, write_text
from optuav.mission.formats import HEAD, named
from optuav.mission.messages import error_words, path_of, several, shown
from optuav.plan.data import RARE, PlanData
from optuav.plan.summary import TABLE, blocks
from optuav.presentation.blocks import Block
from optuav.presentation.numbers import seconds
from optuav.presentation.presented import Presented

SCHEMA = 1
KIND = "optuav plan"
LARGEST_BYTES = 32_000_000
MOST_PHASES = 10_000

DERIVED = (
    *("hover_time_s", "rest_time_s", "flight_time_s", "mission_time_s", "peak_speed_m_s"),
    *("runs_dry_s", "overfull_s", "route", "stops", "warnings"),
)
"""Figures that a file repeats for its readers; they follow from the phases, which decide."""


class Plan(Presented, PlanData):
    """The answer to a problem over a mission.

    Without a plan, `status` and `reasons` say why, and every time or state raises `NoPlanError`. An
    existing plan is true in a Boolean test.

    Parameters
    ----------
    mission
        The mission.
    problem, trajectory, building, order, perspective
        The question: names of the problem, of the trajectory, of the building to rest on, of the
        order of rest and hover (None for those left open), and of the perspective.
    slot_s
        Length of the slots [s], 0.001 to 1e7; None for continuous times.
    engine, proof
        The engine, and the proof of its answer.
    status
        Status of the problem as stated.
    binding
        Labels of the constraints that hold with equality; from the grid, of the constraints that
        one slot more or less of a time would violate.
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
        declared; and, if the answer is not proved, a proved bound if one is known. None if missing,
        for example in a plan without phases or in an older file.
    device_order
        Names of several devices in the requested order; None if no order was requested.

    Examples
    --------
    >>> import optuav
    >>> plan = optuav.solve("paper", "P3", perspective="available")
    >>> print(f"{plan.hover_time_s:.2f} s of {plan.mission_time_s:.2f} s")
    577.52 s of 653.32 s
    >>> plan.route, plan.flyable
    (('origin', 'hover', 'destination'), True)
    """

    @for_console
    def __repr__(self) -> str:
        hover = f", Δ = {seconds(self.hover_time_s)}" if self else ""
        question = f"{self.problem}, perspective {self.perspective}"
        return f"<Plan for {self.mission.name!r}: {question}, {self.status.value}{hover}>"

    def blocks(self) -> Iterator[Block]:
        """Yield question and answer, times, a picture of the wells, phases and remarks."""
        return blocks(self)

    def summary(self) -> str:
        """The plan as an aligned block of text."""
        return str(self)

    def to_dict(self) -> dict[str, object]:
        """The plan as plain data: strings, numbers, lists, dicts and None.

        It has the fields of the plan with its mission inside; times and route are repeated for the
        reader, None without a plan. If the mission's buildings come from a table, only those that
        the plan uses are inside, beside its path and hash.
        """
        return self._data(Path())

    def _data(self, file: Path) -> dict[str, object]:
        """The plan as plain data, which names a table by its path from the folder of a file."""
        unstated = {name for name in RARE if getattr(self, name) in (None, "")}
        data = self.model_dump(mode="json", exclude={"mission", *unstated})
        phases, mission = data.pop("phases"), self.mission
        derived = {name: getattr(self, name) if self else None for name in DERIVED}
        data = {"schema": SCHEMA, "kind": KIND, **data, **to_jsonable_python(derived)}
        # Files of plans without bent ways and chosen speeds are as they always were.
        rare = {"waypoints_m", "speeds_m_s"}
        data["phases"] = [{k: v for k, v in e.items() if v or k not in rare} for e in phases]
        if source := mission.buildings.source:
            from optuav.plan.used_buildings import used_buildings

            data[TABLE] = {**asdict(source), "path": relative_to(file, source.path)}
            mission = mission.model_copy(update={"buildings": used_buildings(self)})
        return {**data, "mission": mission.to_dict()}

    def save(self, path: str | Path) -> Path:
        """Write the plan as JSON, whole or not at all; `optuav.load_plan` reads it back.

        The suffix is .json or none; an existing file is replaced. Raises `InputError` for another
        suffix, or if the directory is missing or cannot be written to.
        """
        file = path_of(path)
        ending_of(file, ".json", "")
        text = json.dumps(self._data(file), indent=2, ensure_ascii=False, allow_nan=False)
        write_text(file, text + "\n")
        return file

    def export(
        self, path: str | Path, *, climb_m: float | None = None, force: bool = False
    ) -> tuple[Path, ...]:
        """Write where the plan flies, hovers and rests on Earth; needs pyproj.

        Parameters
        ----------
        path
            The file; its suffix decides the format. .kml and .geojson hold lines and points: KML at
            altitudes above mean sea level, z + ``earth.altitude_m``, GeoJSON above the ellipsoid,
            or without heights if pyproj has no geoid. .plan (QGroundControl) and .waypoints
            (MAVLink's text, "QGC WPL 110") hold one flight each, from a take-off to the next
            landing: of a plan with rests, ``hill.plan`` becomes ``hill-1.plan``, ``hill-2.plan``
            and so on. Heights are relative to the take-off place of the file, its home. Notes of
            ``hill.waypoints`` stand in ``hill.txt``. Existing files are replaced.
        climb_m
            Height of every take-off above its place, and of the approach to every landing, > 0 and
            up to 1000 [m]; None for 12. For .plan and .waypoints.
        force
            Whether to export a plan that was not simulated or cannot be flown, for example because
            climbs empty its battery; the file says why.

        Returns
        -------
        tuple of Path
            The files that were written. They say that no autopilot has flown the plan, and what
            climbs and descents add to it.

        Raises
        ------
        InputError
            If the suffix is another, the climb is out of range or stated for a map, the mission
            states neither ``crs`` nor ``[earth]``, the reference system is unknown or not in
            metres, the plan cannot be flown, or a file cannot be written.
        NoPlanError
            Without a plan.

        Examples
        --------
        >>> import optuav, tempfile
        >>> place = {"earth.latitude_deg": 52.5, "earth.longitude_deg": 13.4}
        >>> plan = optuav.solve(optuav.load("matrice350").replace(place))
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     [path.name for path in plan.export(f"{folder}/hill.plan")]
        ['hill-1.plan', 'hill-2.plan']
        """
        from optuav.plan.export import export

        return export(self, path, climb_m=climb_m, force=force)


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
        If the file names a table of buildings, `load_plan` reads it if it exists; otherwise the
        plan's mission has only the buildings that the plan uses.

    Raises
    ------
    InputError
        With everything that is wrong with the file, or if its table of buildings has changed.

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
        Fault(
            name,
            shown(data[name]),
            f"must be {shown(follows[name])}, as follows from the phases",
            source,
        )
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
        if what := named(text[:HEAD].encode()):
            words, _, advice = what.words.partition("; ")
            sentence = f"is {words}, not a saved plan{advice and '; '}{advice}"
            raise InputError([Fault("", "", sentence, source)])
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
        from optuav.plan.used_buildings import with_table

        with collected(of_table):
            table = with_table(mission.buildings, data[TABLE], folder)
            fields["mission"] = mission.replace({"buildings": table})
    faults = [replace(fault, key=f"mission.{fault.key}".rstrip(".")) for fault in of_mission]
    faults += [fault if fault.key else Fault(TABLE, "", str(fault)) for fault in of_table]
    faults = [replace(fault, source=source) for fault in faults]
    try:
        plan = Plan.model_validate(fields)
    except ValidationError as error:
        refused = bool(faults)  # Of a mission that is refused, nothing else is said
        faults += (e for e in _record_faults(error, source) if not refused or e.key != "mission")
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
        yield Fault(key, value, error_words(detail), source)
