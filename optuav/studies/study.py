"""A study file: a mission with ranges of its keys, and the scenarios that they make."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, TypeAlias

import numpy as np
from annotated_types import MinLen
from pydantic import BaseModel, ValidationError
from pydantic_core import to_jsonable_python

from formulations.formulation import Formulation
from formulations.p1 import P1
from formulations.soc import AVAILABLE
from optuav.engines.registry import AUTO
from optuav.errors import Fault, collected, refuse
from optuav.fields import Allowed, Range
from optuav.mission import Mission, load_all
from optuav.mission.files import STANDARD, label, read_toml, resolve_from
from optuav.mission.load import is_name
from optuav.mission.messages import misfits, nearest, range_in_words, shown
from optuav.options import Perspective
from optuav.solving import formulate
from optuav.solving.question import (
    ASKED,
    Question,
    checked_question,
    perspectives_of,
    problem_of,
    unknown_engine,
)
from optuav.studies.samples import COUNT, FINITE, SEED, Draws, Spread, dotted, sobol, spreads
from optuav.studies.scenarios import Scenarios, check, values_of

Document: TypeAlias = dict[str, Any]

PART = Range("-", ge=1, le=1e6, whole=True)
MOST_PARTS = 100_000
RANGE = "a list of numbers, or a table such as { low = 600, high = 1800, count = 41 }"
NAMED = 'a problem such as "P1" or { name = "P4", building = "b1" }'
TABLES = ("grid", "paired", "samples")


class StudyFile(BaseModel, extra="forbid", strict=True, allow_inf_nan=False):
    """A study file as it is stated."""

    mission: Annotated[str, Allowed("a shipped mission's name, or a path")] = "paper"
    problem: Annotated[str | Document, Allowed(NAMED)] = "P1"
    perspective: Annotated[str | list[str], Allowed(ASKED)] = AVAILABLE
    engine: Annotated[str, Allowed("the name of an engine")] = AUTO
    grid: Annotated[Document, Allowed("a table [grid] of keys")] = {}
    paired: Annotated[Document, Allowed("a table [paired] of keys")] = {}
    samples: Annotated[Document, Allowed("a table [samples] of keys")] = {}
    scenarios_per_part: Annotated[int, PART] = 100_000
    output: Annotated[str, MinLen(1), Allowed("the path of a directory")] = ""


@dataclass(frozen=True)
class SweepPlan:
    """Content of a study file: its scenarios in parts, and the questions about each."""

    scenarios: Scenarios
    questions: list[Question]  # One a perspective
    scenarios_per_part: int
    output: Path
    document: Document  # All that decides the answers, as plain data

    @property
    def perspectives(self) -> list[Perspective]:
        """The perspectives of every scenario."""
        return [question.perspective for question in self.questions]

    @property
    def parts(self) -> int:
        """Number of parts."""
        return -(-self.scenarios.count // self.scenarios_per_part)

    @property
    def is_drawable(self) -> bool:
        """True for up to three keys with several values each, at most one of them of rows."""
        keys, grid = len(self.scenarios.values_by_key(0, 1)), len(self.scenarios.grid)
        return keys < 4 and keys - grid < 2 and min(self.scenarios.sizes.values()) > 1

    def part(self, number: int) -> range:
        """The scenarios of a part by number."""
        numbers = range(self.scenarios.count)
        return numbers[number * self.scenarios_per_part :][: self.scenarios_per_part]


def read_plan(study: Path | Mapping[str, object]) -> SweepPlan:
    """Read a study from its file or its tables, or refuse it with all its faults."""
    faults, path, source = list[Fault](), Path(), "study"
    if isinstance(study, Path):
        path, source, document = study, label(study), read_toml(study)
    else:
        document = to_jsonable_python({**study}, fallback=_as_list)
    study_file = _stated(document, faults)
    with collected(faults):
        plan = _plan(study_file, path, faults)
    stated_in = dict.fromkeys(("count", "seed"), "samples")
    stated_in |= {key: name for name in TABLES for key, _ in dotted(getattr(study_file, name))}
    refuse(_placed(fault, stated_in, source) for fault in dict.fromkeys(faults))
    return plan


def _as_list(values: Any) -> Any:
    """The values of an array; of anything else words that no key allows."""
    return values.tolist() if hasattr(values, "tolist") else shown(values)


def _placed(fault: Fault, stated_in: Mapping[str, str], file: str) -> Fault:
    """A fault with the table of its key, and the file."""
    if fault.source:
        return fault
    table = stated_in.get(fault.key.removesuffix(".along"))
    return replace(fault, key=f"{table}.{fault.key}" if table else fault.key, source=file)


def _stated(document: Document, faults: list[Fault]) -> StudyFile:
    """The file without the keys whose values are not allowed, which are added to the faults."""
    try:
        return StudyFile.model_validate(document)
    except ValidationError as error:
        keys = dict.fromkeys(
            str(error_line["loc"][0]) for error_line in error.errors(include_url=False)
        )
    fields = StudyFile.model_fields
    for key in keys:
        words = (
            range_in_words(StudyFile, key)
            if key in fields
            else f"unknown key{nearest(key, fields)}"
        )
        faults.append(Fault(key, shown(document.pop(key)), words))
    return StudyFile.model_validate(document)


def _plan(study: StudyFile, path: Path, faults: list[Fault]) -> SweepPlan:
    """Return the plan that a file states; its faults are added to `faults`, or raised."""
    problem: Formulation = P1()
    perspectives = perspectives_of(study.perspective, faults)
    faults += unknown_engine(study.engine)
    if not (study.grid or study.paired or study.samples):
        faults.append(Fault("grid", "", "must have values, or [paired] or [samples]"))
    if study.paired and study.samples:
        faults.append(Fault("samples", "", "either [samples] or [paired]"))
    if path in (STANDARD, Path()) and not study.output:
        faults.append(Fault("output", "", "is missing; it must be the path of a directory"))
    with collected(faults):
        problem = stated_problem(study.problem)
    wrong = list[Fault]()  # What forbids to look at scenarios
    named, source = is_name(study.mission), study.mission
    loaded = load_all(source if named else resolve_from(path.parent, source, "mission"), wrong)
    grid = values_of(_ranges(study.grid, wrong), wrong, paired=False, missions=loaded)
    paired = values_of(_ranges(study.paired, wrong), wrong, paired=True, missions=loaded)
    spread, drawn = {**study.samples}, tuple[Spread, ...]()
    count, seed = spread.pop("count", 1), spread.pop("seed", 0)
    if study.samples:
        wrong += misfits(("count", count, COUNT), ("seed", seed, SEED))
        if "count" not in study.samples:
            wrong.append(Fault("count", "", COUNT.words))
        if not spread:
            wrong.append(Fault("samples", "", "at least one key with its distribution"))
    questions = list[Question]()
    for mission in loaded:
        with collected(wrong):
            drawn = spreads(mission, spread)
        for perspective in perspectives:
            with collected(faults):
                questions.append(_question(mission, problem, perspective, study.engine))
    keys = Counter(key.name for spread_of in drawn for key in (spread_of.key, *spread_of.along))
    keys.update([*paired, *grid])
    wrong += [Fault(key, "", "in one of the tables only") for key in keys if keys[key] > 1]
    refuse([*faults, *wrong] if wrong else ())
    (mission,) = loaded
    # The hash of a study that leaves the choice of engines open is that of versions without it.
    unstated = {"output", *(["engine"] if study.engine == AUTO else [])}
    rows = Draws(mission, drawn, int(count), seed, sobol) if drawn else paired or None
    plan = SweepPlan(
        Scenarios(mission, rows, grid),
        questions,
        study.scenarios_per_part,
        resolve_from(path.parent, study.output or path.stem, "output"),
        {**study.model_dump(exclude=unstated), "mission": mission.to_dict()},
    )
    check(plan.scenarios)
    if plan.parts > MOST_PARTS:
        least = -(-plan.scenarios.count // MOST_PARTS)
        words = f"at least {least}, which makes {MOST_PARTS} parts"
        faults.append(Fault("scenarios_per_part", shown(study.scenarios_per_part), words))
    return plan


def _question(
    mission: Mission, problem: Formulation, perspective: Perspective, engine: str
) -> Question:
    """The question of a perspective; refused also if the engine does not take its models."""
    question = checked_question(mission, problem, perspective, engine=engine)
    if engine != AUTO:
        formulate(mission, problem, perspective=perspective, engine=engine)
    return replace(question, slot_s=None)  # The grid takes that of each scenario


def stated_problem(problem: str | Document) -> Formulation:
    """The problem of a study file; refused with all faults."""
    fields = {"name": problem} if isinstance(problem, str) else {**problem}
    return problem_of(fields.pop("name", "P1"), **fields)


def _ranges(tables: Document, faults: list[Fault]) -> dict[str, Any]:
    """Values by dotted key; tables give equal distances, and a batch judges other forms."""
    ranges = dict[str, Any]()
    for key, values in dotted(tables):
        if key in ranges:
            faults.append(Fault(key, "", "must be set once"))
        elif not isinstance(values, dict):
            ranges[key] = values
        elif values.keys() == {"low", "high", "count"} and (
            COUNT.accepts(count := values["count"])
            and FINITE.accepts(low := values["low"])
            and FINITE.accepts(high := values["high"])
            and low < high
        ):
            ranges[key] = np.linspace(low, high, int(count))
        else:
            faults.append(Fault(key, shown(values), RANGE))
    return ranges
