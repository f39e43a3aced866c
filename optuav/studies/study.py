"""A study file: a mission with ranges of its keys, and the scenarios that they make."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, TypeAlias

import numpy as np
from pydantic import BaseModel, ValidationError

from formulations.formulation import Formulation
from formulations.p1 import P1
from formulations.soc import AVAILABLE
from optuav.arrays import Floats
from optuav.errors import Fault, InputError, refuse
from optuav.mission import Mission, load_all, shipped
from optuav.mission.files import STANDARD, label, read_toml
from optuav.mission.messages import allowed, misfits, nearest, shown
from optuav.mission.schema import Allowed, Number
from optuav.options import Perspective
from optuav.solving.question import ASKED, checked_question, perspectives_of, problem_of
from optuav.studies.samples import COUNT, SEED, sobol
from optuav.studies.scenarios import MOST, ROW, scenarios, values_of
from optuav.studies.uncertainty import FINITE, Spread, spreads

Document: TypeAlias = dict[str, Any]

PART = Number("-", ge=1, le=1e6, whole=True)
MOST_PARTS = 100_000
RANGE = "a list of numbers, or a table such as { low = 600, high = 1800, count = 41 }"
NAMED = 'a problem such as "P1" or { name = "P4", building = "b1" }'


class StudyFile(BaseModel, extra="forbid", strict=True, allow_inf_nan=False):
    """A study file as it is stated."""

    mission: Annotated[str, Allowed("a shipped mission's name, or a path")] = "paper"
    problem: Annotated[str | Document, Allowed(NAMED)] = "P1"
    perspective: Annotated[str | list[str], Allowed(ASKED)] = AVAILABLE
    grid: Annotated[Document, Allowed("a table [grid] of keys")] = {}
    paired: Annotated[Document, Allowed("a table [paired] of keys")] = {}
    samples: Annotated[Document, Allowed("a table [samples] of keys")] = {}
    scenarios_per_part: Annotated[int, PART] = 100_000
    output: Annotated[str, Allowed("the path of a directory")] = ""


@dataclass(frozen=True)
class Study:
    """Rows of values that are stated or drawn, each with every combination of a grid.

    The last key of the grid varies fastest, the row slowest.
    """

    mission: Mission
    problem: Formulation
    perspective: Perspective | list[Perspective]
    grid: Mapping[str, Floats]
    paired: Mapping[str, Floats]
    spreads: tuple[Spread, ...]
    rows: int  # 1 where none are stated or drawn
    seed: int
    scenarios_per_part: int
    output: Path
    document: Document  # All that decides the answers, as plain data

    @property
    def perspectives(self) -> list[Perspective]:
        """The perspectives of every scenario."""
        return [self.perspective] if isinstance(self.perspective, str) else self.perspective

    @property
    def sizes(self) -> dict[str, int]:
        """Number of values along every dimension."""
        rows = {ROW: self.rows} if self.paired or self.spreads else {}
        return rows | {key: len(values) for key, values in self.grid.items()}

    @property
    def scenarios(self) -> int:
        """Number of scenarios."""
        return math.prod(self.sizes.values())

    @property
    def parts(self) -> int:
        """Number of parts."""
        return -(-self.scenarios // self.scenarios_per_part)

    @property
    def is_drawable(self) -> bool:
        """Whether the scenarios are a grid of one or two keys with several values each."""
        return ROW not in self.sizes and len(self.grid) < 3 and min(self.sizes.values()) > 1

    def part(self, number: int) -> range:
        """The scenarios of a part by number."""
        return range(self.scenarios)[number * self.scenarios_per_part :][: self.scenarios_per_part]

    def values(self, scenarios: range) -> dict[str, Floats]:
        """The values by key of consecutive scenarios."""
        sizes = self.rows, *map(len, self.grid.values())
        row, *places = np.unravel_index(np.arange(scenarios.start, scenarios.stop), sizes)
        found = {key: values[row] for key, values in self.paired.items()}
        if self.spreads:
            start, stop = int(row[0]), int(row[-1]) + 1
            shares = sobol(len(self.spreads), self.seed, start, stop - start)
            for spread, column in zip(self.spreads, shares.T, strict=True):
                drawn = spread.columns(spread.at(column))
                found |= {key: values[row - start] for key, values in drawn}
        pairs = zip(self.grid.items(), places, strict=True)
        return found | {key: values[place] for (key, values), place in pairs}


def read_study(path: Path) -> Study:
    """Read a study file, or refuse it with all its faults."""
    faults = list[Fault]()
    stated = _stated(read_toml(path), faults)
    with _collected(faults):
        study = _study(stated, path, faults)
    refuse(replace(each, source=each.source or label(path)) for each in dict.fromkeys(faults))
    return study


def _stated(document: Document, faults: list[Fault]) -> StudyFile:
    """The file without the keys whose values are not allowed, which are added to the faults."""
    try:
        return StudyFile.model_validate(document)
    except ValidationError as error:
        keys = dict.fromkeys(str(each["loc"][0]) for each in error.errors(include_url=False))
    known = StudyFile.model_fields
    for key in keys:
        words = allowed(StudyFile, key) if key in known else f"unknown key{nearest(key, known)}"
        faults.append(Fault(key, shown(document.pop(key)), words))
    return StudyFile.model_validate(document)


def _study(stated: StudyFile, path: Path, faults: list[Fault]) -> Study:
    """The study that a file states; what is wrong with it is added to the faults."""
    perspective: Any = stated.perspective  # Whether there is such a one is judged below
    problem: Formulation = P1()
    asked = perspectives_of(perspective, faults)
    if not (stated.grid or stated.paired or stated.samples):
        faults.append(Fault("grid", "", "keys with values here, in [paired] or in [samples]"))
    if stated.paired and stated.samples:
        faults.append(Fault("samples", "", "either [samples] or [paired]"))
    if path == STANDARD and not stated.output:
        faults.append(Fault("output", "", "is missing; the path of a directory"))
    fields = {"name": stated.problem} if isinstance(stated.problem, str) else {**stated.problem}
    with _collected(faults):
        problem = problem_of(fields.pop("name", "P1"), **fields)
    ranges = {name: _ranges(name, getattr(stated, name), faults) for name in ("grid", "paired")}
    named = stated.mission in shipped()
    loaded = load_all(stated.mission if named else path.parent / stated.mission, faults)
    if not loaded:
        for name, content in ranges.items():
            with _collected(faults, name):
                values_of(content, wrong := list[Fault](), paired=name == "paired")
                refuse(wrong)
        if stated.samples:
            with _collected(faults, "samples"):
                _samples(None, stated.samples)
        refuse(faults)
    mission = loaded[0]
    values: dict[str, Mapping[str, Floats]] = {"grid": {}, "paired": {}}
    for each in asked:
        with _collected(faults):
            checked_question(mission, problem, each)
    for name in values:
        with _collected(faults, name):
            values[name] = scenarios(mission, ranges[name], paired=name == "paired").values
    rows, seed, drawn = max([1, *map(len, values["paired"].values())]), 0, tuple[Spread, ...]()
    if stated.samples:
        with _collected(faults, "samples"):
            rows, seed, drawn = _samples(mission, stated.samples)
    study = Study(
        mission=mission,
        problem=problem,
        perspective=perspective,
        **values,
        spreads=drawn,
        rows=rows,
        seed=seed,
        scenarios_per_part=stated.scenarios_per_part,
        output=path.parent / (stated.output or path.stem),
        document={**stated.model_dump(exclude={"output"}), "mission": mission.to_dict()},
    )
    keys = Counter(each.name for spread in drawn for each in (spread.key, *spread.along))
    keys.update([*study.paired, *study.grid])
    faults += [Fault(key, "", "in one of the tables only") for key in keys if keys[key] > 1]
    if study.scenarios > MOST:
        faults.append(Fault("grid", f"{study.scenarios} scenarios", f"at most {MOST}"))
    elif study.parts > MOST_PARTS:
        least = -(-study.scenarios // MOST_PARTS)
        words = f"at least {least}, which makes {MOST_PARTS} parts"
        faults.append(Fault("scenarios_per_part", shown(stated.scenarios_per_part), words))
    elif not faults:
        scenarios(mission, study.values(range(1)), paired=True)  # What goes together
    return study


def _ranges(table: str, stated: Document, faults: list[Fault]) -> dict[str, Any]:
    """Values by dotted key, those of tables at equal distances; others are for a batch to judge."""
    found = dict[str, Any]()
    for key, values in _dotted(stated):
        if key in found:
            faults.append(Fault(f"{table}.{key}", "", "stated once"))
        elif not isinstance(values, dict):
            found[key] = values
        elif values.keys() == {"low", "high", "count"} and (
            COUNT.accepts(count := values["count"])
            and FINITE.accepts(low := values["low"])
            and FINITE.accepts(high := values["high"])
            and low < high
        ):
            found[key] = np.linspace(low, high, int(count))
        else:
            faults.append(Fault(f"{table}.{key}", shown(values), RANGE))
    return found


def _dotted(stated: Document) -> Iterator[tuple[str, object]]:
    """Keys with their values, those of inner tables by dotted names."""
    for name, content in stated.items():
        if isinstance(content, dict) and "." not in name:
            yield from ((f"{name}.{key}", values) for key, values in content.items())
        else:
            yield name, content


def _samples(mission: Mission | None, stated: Document) -> tuple[int, int, tuple[Spread, ...]]:
    """Number of samples, their seed, and how their keys are spread."""
    spread, faults = {**stated}, list[Fault]()
    count, seed = spread.pop("count", None), spread.pop("seed", 0)
    faults += misfits(("count", count, COUNT), ("seed", seed, SEED))
    found = tuple[Spread, ...]()
    with _collected(faults):
        found = spreads(mission, spread) if mission else ()
    if not spread:
        faults.append(Fault("samples", "", "at least one key with its distribution"))
    refuse(faults)
    return int(count or 1), seed, found


@contextmanager
def _collected(faults: list[Fault], table: str = "") -> Iterator[None]:
    """Add the faults of keys of a table to others, in place of an error."""
    try:
        yield
    except InputError as error:
        for each in error.faults:
            outside = each.source or each.key in ("", table)
            key = each.key if outside or not table else f"{table}.{each.key}"
            faults.append(replace(each, key=key))
