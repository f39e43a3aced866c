"""Studies of many scenarios, in parts that are whole or absent and outlive what makes them."""

from __future__ import annotations

import hashlib
import io
import json
import math
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, closing, contextmanager
from dataclasses import asdict, dataclass
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, BinaryIO, Literal

import numpy as np
from annotated_types import Interval, MinLen
from pydantic import BaseModel

import optuav
from formulations.soc import PERSPECTIVES
from optuav.errors import Fault, collected, refuse, require
from optuav.mission import files
from optuav.mission.forms import CHOICES
from optuav.mission.keys import range_of
from optuav.mission.messages import misfits, path_of, shown
from optuav.presentation.blocks import Block, Facts
from optuav.presentation.numbers import fixed, seconds
from optuav.presentation.presented import Presented
from optuav.solving.question import OWN_PROBLEMS, PROBLEM_NAMES, perspectives_of
from optuav.studies.batch import (
    CODED,
    LABELS,
    MEASURED,
    Solved,
    Variables,
    labelled,
    units,
    variables,
    words_of,
)
from optuav.studies.cluster import results
from optuav.studies.compare_methods import Progress
from optuav.studies.processes import WORKERS
from optuav.studies.scenarios import MOST_SCENARIOS, ROW, Scenarios
from optuav.studies.study import (
    MOST_PARTS,
    Document,
    StudyFile,
    SweepPlan,
    read_plan,
    stated_problem,
)

if TYPE_CHECKING:
    import xarray

KIND, FORMAT = "optuav sweep", 1
MANIFEST, PART = "manifest.json", "part-{:06}.parquet"
LARGEST_MANIFEST = 200_000_000  # bytes
NOT_OURS = "is damaged, or from another version of optuav"
LARGEST_HEAD, LARGEST_LINE = 1_000_000, 4_000
"""Most bytes of a part beside its lines, and of each of these: a number for every key and label."""
PACKAGES = ("optuav", "numpy", "scipy", "pyarrow")
"""On whose versions the bytes of a part depend."""
STAMP, HASH = b"optuav", 64
"""Key in the metadata of a part that names part and sweep, before so many digits."""


@dataclass(frozen=True)
class Swept(Presented):
    """Result of a sweep, and its place.

    Parameters
    ----------
    directory
        Where the parts are.
    hash
        Of the study, as in the manifest.
    scenarios, parts, kept
        Numbers of scenarios, of parts, and of parts that were there before.
    hover_time_s
        By perspective the ``shortest`` and the ``longest`` hover [s], if there is a plan.
    reasons
        By perspective how many scenarios have no plan, by why.

    Examples
    --------
    >>> import optuav, pathlib, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = pathlib.Path(folder) / "deadlines.toml"
    ...     _ = file.write_text("grid.limits.deadline_s = [10, 600, 900]")
    ...     done = optuav.sweep(file)
    >>> done.scenarios, done.parts, done.kept
    (3, 1, 0)
    >>> {name: round(hover_s, 2) for name, hover_s in done.hover_time_s["available"].items()}
    {'shortest': 524.21, 'longest': 591.57}
    """

    directory: Path
    hash: str
    scenarios: int
    parts: int
    kept: int
    hover_time_s: dict[str, dict[str, float]]
    reasons: dict[str, dict[str, int]]

    @property
    def plans(self) -> dict[str, int]:
        """By perspective how many scenarios have a plan."""
        return {name: self.scenarios - sum(why.values()) for name, why in self.reasons.items()}

    def blocks(self) -> Iterator[Block]:
        """Yield how many scenarios have a plan, why others have none, and the range of hovers."""
        yield Facts([*self._facts()], whole=True)

    def _facts(self) -> Iterator[tuple[str, str]]:
        yield "Scenarios", f"{self.scenarios}"
        yield "Parts", f"{self.parts}" + f", {self.kept} of them from before" * bool(self.kept)
        yield "Directory", f"{self.directory}"
        for name, reasons in self.reasons.items():
            why = [f"{count} without: {words}" for words, count in reasons.items()]
            yield "Plans", "; ".join([f"{name} {self.plans[name]}", *why])
            if ends := self.hover_time_s[name]:
                yield "Hover", f"{name} {fixed(ends['shortest'])} to {seconds(ends['longest'])}"

    def to_dict(self) -> dict[str, object]:
        """Return the figures as plain data, ready for JSON."""
        plans = self.plans
        return {
            "kind": KIND,
            **asdict(self),
            "directory": str(self.directory),
            "plans": plans,
            "without_plan": {name: self.scenarios - count for name, count in plans.items()},
        }


def sweep(
    study: Mapping[str, object] | str | Path,
    *,
    workers: int = 1,
    scheduler: str | None = None,
    resume: bool = True,
    progress: Progress | None = None,
) -> Swept:
    r"""Find the best plans of all scenarios of a study, in parts that a new run keeps.

    Parameters
    ----------
    study
        Path of a study file in TOML, or its tables as a dict with the key ``output``. Keys are
        ``mission`` (a shipped name, or a path relative to the file), ``problem``, ``perspective``
        (one or a list), ``engine`` (a name, by default ``"auto"``), and values of numeric keys: in
        ``[grid]`` with all combinations, in ``[paired]`` row by row, each a list or ``{ low = 600,
        high = 1800, count = 41 }``; in ``[samples]`` distributions as for `optuav.samples`, with
        ``count`` and ``seed`` of a Sobol sequence. Rows and samples go with every combination of
        the grid. By default, ``scenarios_per_part`` is 100 000, and ``output``, the directory of
        the parts, is the file's name without its ending.
    workers
        Number of processes of this machine that share the work, 1 to 1000.
    scheduler
        Address of a Dask scheduler, whose workers do the work instead; without `workers`.
    resume
        Whether to keep parts that exist and are whole; otherwise all parts are computed again.
    progress
        Callback for progress: receives the number of scenarios done, their total, and words.

    Returns
    -------
    Swept
        The work done and its directory, and for each perspective the shortest and longest hover and
        the reasons for scenarios without a plan: see `optuav.studies.sweep.Swept`.

    Raises
    ------
    InputError
        With all faults of the study; if the directory holds another study, or parts that were made
        by other versions of the packages; if a file cannot be written, no scheduler answers, or
        pyarrow or distributed is missing.
    SolverError
        If an engine returns points that violate a constraint, or the scheduler or every worker is
        lost. Finished parts stay, and the same call resumes the sweep.

    Examples
    --------
    >>> import optuav, pathlib, tempfile
    >>> text = "scenarios_per_part = 2\ngrid.limits.deadline_s = [600, 900, 1200]"
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = pathlib.Path(folder) / "deadlines.toml"
    ...     _ = file.write_text(text)
    ...     optuav.sweep(file).parts, optuav.sweep(file).kept
    (2, 2)
    """
    checked = study if isinstance(study, Mapping) else path_of(study, "study", "a path, or a dict")
    plan = planned(checked, workers, scheduler)
    return run(plan, workers, scheduler, resume, progress)


def planned(study: Path | Mapping[str, object], workers: int, scheduler: str | None) -> SweepPlan:
    """Return the plan of a study, refused with all faults of the study and its workers."""
    require("pyarrow", "sweeps")
    faults = [*misfits(("workers", workers, WORKERS))]
    if scheduler is not None and workers != 1:
        words = "cannot be combined with a scheduler, which has workers of its own"
        faults.append(Fault("workers", shown(workers), words))
    with collected(faults):
        plan = read_plan(study)
    refuse(faults)
    return plan


def run(
    plan: SweepPlan,
    workers: int,
    scheduler: str | None,
    resume: bool,
    progress: Progress | None,
) -> Swept:
    """Solve the parts of a plan that are still missing; see `sweep`."""
    manifest, directory, count = _manifest(plan), plan.output, plan.scenarios.count
    begun, stamp = _is_begun(directory, manifest), manifest["hash"]
    stored = SweepParts(directory, stamp, count, plan.scenarios_per_part, len(plan.questions))
    # All parts are checked: a file from elsewhere is refused before anything is computed.
    left = [n for n in range(plan.parts) if not stored.is_whole(n) or not resume]
    kept, done = plan.parts - len(left), count - sum(len(plan.part(n)) for n in left)
    call = partial(part_of, plan, stamp, manifest["versions"])
    tell = progress or (lambda *_: None)
    with closing(results(call, left, workers, scheduler)) as found:
        if not begun:
            files.make_directory(directory)
            text = json.dumps(manifest, indent=1) + "\n"
            files.write_own(directory / MANIFEST, text.encode())
        tell(done, count, f"{kept} of {plan.parts} parts")
        for parts, (number, content) in enumerate(found, kept + 1):
            files.write_own(stored.path(number), content)
            done += len(plan.part(number))
            tell(done, count, f"{parts} of {plan.parts} parts")
    return Swept(directory, stamp, count, plan.parts, kept, *_summary(stored, plan.perspectives))


def open_sweep(path: Swept | str | Path) -> xarray.Dataset:
    """Read a finished sweep.

    Parameters
    ----------
    path
        The directory of its parts, or what `optuav.sweep` returned.

    Returns
    -------
    xarray.Dataset
        With the variables, units and words of `optuav.batch`, and dimensions: one per key of the
        grid, before them ``"scenario"`` for rows and samples, and ``"perspective"`` if there are
        several.

    Raises
    ------
    InputError
        If the sweep or a part of it is missing or damaged, or xarray or pyarrow is missing.

    Examples
    --------
    >>> import optuav, pathlib, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = pathlib.Path(folder) / "deadlines.toml"
    ...     _ = file.write_text("grid.limits.deadline_s = [600, 900, 1200]")
    ...     results = optuav.open_sweep(optuav.sweep(file))
    >>> results.hover_time_s.values.round(1).tolist()
    [524.2, 591.6, 597.3]
    """
    require("pyarrow", "sweeps")
    require("xarray", "labelled datasets")
    directory = path.directory if isinstance(path, Swept) else path_of(path)
    about = _read_manifest(directory)
    study, grid, perspectives = about.study, about.grid, about.study.perspective
    town, *buildings = about.names
    facts = {"mission": town, "problem": repr(stated_problem(study.problem))}
    labels = {} if isinstance(perspectives, str) else {"perspective": perspectives}
    facts |= {"perspective": perspectives} if isinstance(perspectives, str) else {}
    rows = {ROW: about.rows} if about.rows else {}
    shape = {key: len(names) for key, names in labels.items()} | rows
    shape |= {key: len(values) for key, values in grid.items()}
    side, per_row = shape.get("perspective", 1), math.prod(map(len, grid.values()))
    stored = SweepParts(directory, about.hash, about.scenarios, study.scenarios_per_part, side)
    missing = sum(not stored.is_whole(number) for number in range(stored.count))
    if missing:
        words = f"is not finished: {missing} of {stored.count} parts are missing or damaged"
        raise files.refusal(directory, f"{words}; optuav sweep goes on with it")
    columns = stored.read(
        range(stored.count), {"perspective": [*PERSPECTIVES], **words_of(buildings, between=True)}
    )
    taken = {*LABELS, "perspective"}
    if not taken <= columns.keys() or None in map(range_of, columns.keys() - taken):
        raise files.refusal(directory, NOT_OURS)
    # A part has one line for each perspective of each scenario.
    values = {
        name: columns.pop(name).reshape(-1, side).T.reshape([*shape.values()]) for name in LABELS
    }
    keys = {
        key: column[:: side * per_row] for key, column in columns.items() if key != "perspective"
    }
    keys |= {key: np.array(stated) for key, stated in grid.items()}
    return labelled(Solved(labels, keys, shape, values, [*buildings, "none"], facts))


def part_of(plan: SweepPlan, stamp: str, versions: Mapping[str, str], number: int) -> bytes:
    """A part of a study as a file, the same bytes wherever it is made by the same packages.

    Perspectives vary faster than scenarios. Numbers of words are stored as these words.
    """
    import pyarrow as pa
    from pyarrow import parquet

    _refuse_others(versions, "a worker")
    part, perspectives, whole = plan.part(number), plan.perspectives, plan.scenarios
    keys, names = whole.values_by_key(part.start, len(part)), whole.mission.buildings.names
    values = variables([Scenarios(whole.mission, keys)], [plan.questions], names)
    words = {
        "perspective": [*map(str, perspectives)],
        **words_of([*names], between=bool(whole.mission.devices)),
    }
    columns: dict[str, Any] = {
        key: np.repeat(column, len(perspectives)) for key, column in keys.items()
    }
    columns["perspective"] = np.tile(np.arange(len(perspectives), dtype=np.int8), len(part))
    columns |= {name: values[name][:, 0].T.ravel() for name in LABELS}  # No building is null
    for name, choices in words.items():
        numbers = pa.array(columns[name], mask=columns[name] < 0)
        columns[name] = pa.DictionaryArray.from_arrays(numbers, pa.array(choices, pa.string()))
    table, unit_of = pa.table(columns), units(keys) | {name: LABELS[name][1] for name in MEASURED}
    fields = [
        field.with_metadata({"units": unit_of[field.name]}) if field.name in unit_of else field
        for field in table.schema
    ]
    mark, content = f"{stamp} {number} ", io.BytesIO()
    # Options that the library might default differently one day are given.
    parquet.write_table(
        table.cast(pa.schema(fields, {STAMP: mark + HASH * "0"})),
        content,
        version="2.6",
        compression="zstd",
        compression_level=1,
        use_dictionary=[*whole.grid, *words],
        use_byte_stream_split=[name for name in (*keys, *MEASURED) if name not in whole.grid],
        row_group_size=table.num_rows,
        data_page_size=1 << 20,
        write_page_checksum=True,
    )
    return _sealed(content.getvalue(), mark)


def _sealed(content: bytes, mark: str) -> bytes:
    """A part with the hash of its other bytes behind a mark."""
    start = content.rfind(mark.encode()) + len(mark)
    head, tail = content[:start], content[start + HASH :]
    return b"".join([head, hashlib.sha256(head + tail).hexdigest().encode(), tail])


@dataclass(frozen=True)
class SweepParts:
    """The files of a sweep: some scenarios each, with a line for each of so many perspectives."""

    directory: Path
    stamp: str
    scenarios: int
    per_part: int
    side: int

    @property
    def count(self) -> int:
        """Number of parts."""
        return -(-self.scenarios // self.per_part)

    def path(self, number: int) -> Path:
        """The file of a part."""
        return self.directory / PART.format(number)

    def is_whole(self, number: int) -> bool:
        """Return whether a part is complete, to the last byte."""
        path, mark = self.path(number), f"{self.stamp} {number} "
        if not os.path.lexists(path):
            return False
        with self._opened(number) as file:
            content = file.read()
        return mark.encode() in content and content == _sealed(content, mark)

    def read(
        self,
        numbers: Iterable[int],
        words: Mapping[str, Sequence[str]],
        columns: list[str] | None = None,
    ) -> Variables:
        """The columns of parts, all or some; of words their places among all words, −1 for none."""
        import pyarrow as pa
        from pyarrow import parquet

        tables, solved = [], Variables()
        for number in numbers:
            with self._opened(number) as file, _damaged(self.path(number)):
                part = parquet.ParquetFile(file)
                if part.metadata.num_rows != self._lines(number):  # Before memory is asked for them
                    raise ValueError
                # A thread of Arrow that holds the Python file while Python ends would abort it
                # (apache/arrow issues 34314, 45017).
                tables.append(part.read(columns=columns, use_threads=False))
        with _damaged(self.directory):
            whole = pa.concat_tables(tables)
            for name, column in zip(whole.column_names, whole.itercolumns(), strict=True):
                if name not in words:
                    solved[name] = column.to_numpy()
                    if solved[name].dtype.kind not in "biuf":
                        raise ValueError
                    continue
                if not pa.types.is_dictionary(column.type):
                    raise ValueError
                coded = column.unify_dictionaries().combine_chunks()
                place = {word: number for number, word in enumerate(words[name])}
                places = [*(place[word] for word in coded.dictionary.to_pylist()), -1]
                kind = CODED.get(name, np.int8)
                solved[name] = np.array(places, kind).take(coded.indices.fill_null(-1))
        return solved

    def _lines(self, number: int) -> int:
        return self.side * min(self.per_part, self.scenarios - number * self.per_part)

    def _opened(self, number: int) -> AbstractContextManager[BinaryIO]:
        largest = LARGEST_HEAD + LARGEST_LINE * self._lines(number)
        return files.opened(self.path(number), largest, own=True)


@contextmanager
def _damaged(path: Path, words: str = NOT_OURS) -> Iterator[None]:
    """Refuse a file whose content no sweep writes."""
    import pyarrow as pa

    try:
        yield
    except (OSError, KeyError, TypeError, ValueError, pa.ArrowException):
        raise files.refusal(path, words) from None


def _manifest(plan: SweepPlan) -> Document:
    """Return the manifest kept beside the parts of a study."""
    scenarios = plan.scenarios
    content = {
        "rows": scenarios.sizes.get(ROW),
        "grid": {key: values.tolist() for key, values in scenarios.grid.items()},
        "study": plan.document,
    }
    versions = {package: _version(package) for package in PACKAGES}
    head = {"kind": KIND, "format": FORMAT, "hash": _hash(content), "versions": versions}
    return {**head, **content}


def _version(package: str) -> str:
    """The version of a package, also of optuav where it is not installed."""
    return optuav.__version__ if package == "optuav" else version(package)


def _hash(manifest: Document) -> str:
    """Return the data that tell a study with its scenarios from every other."""
    identity = [manifest[name] for name in ("rows", "grid", "study")]
    return hashlib.sha256(json.dumps(identity).encode()).hexdigest()


def _is_begun(directory: Path, manifest: Document) -> bool:
    """Return whether a directory holds parts of this sweep; refuse anything else."""
    with files.refusals(directory, "read"):
        there = {entry.name for entry in directory.iterdir()} if directory.is_dir() else set()
    if MANIFEST in there:
        manifest_there = _read_manifest(directory)
        if not there - {MANIFEST, files.TEMPORARY}:
            return False
        if manifest_there.hash != manifest["hash"]:
            words = "contains the parts of another study: set another output, or delete it"
            raise files.refusal(directory, words)
        _refuse_others(manifest_there.versions, files.label(directory / MANIFEST))
    elif there - {files.TEMPORARY}:
        raise files.refusal(directory, "is not empty, and contains no sweep: set another output")
    return MANIFEST in there


class SweptStudy(StudyFile):
    """The study of a manifest, with its mission inside."""

    mission: Document  # type: ignore[assignment]


class Manifest(BaseModel, extra="forbid", strict=True, allow_inf_nan=False):
    """Read the manifest beside the parts of a sweep."""

    kind: Literal["optuav sweep"]
    format: Literal[1]
    hash: str
    versions: dict[str, str]
    rows: Annotated[int, Interval(ge=1)] | None
    grid: dict[str, Annotated[list[float], MinLen(1)]]
    study: SweptStudy

    @property
    def names(self) -> list[str]:
        """Names of the mission, and of its buildings."""
        mission = self.study.mission
        return [str(table["name"]) for table in (mission, *mission.get("buildings", ()))]

    @property
    def scenarios(self) -> int:
        """Number of scenarios."""
        return (self.rows or 1) * math.prod(map(len, self.grid.values()))


def _read_manifest(directory: Path) -> Manifest:
    """The manifest of a sweep."""
    path = directory / MANIFEST
    with files.opened(path, LARGEST_MANIFEST, own=True) as file:
        if files.MARK not in file.read(files.HEAD):
            words = "is not from optuav and stays: it is not a manifest of a sweep"
            raise files.refusal(path, f"{words}; choose another directory")
    text = files.read_text(path, LARGEST_MANIFEST, own=True)
    document = files.parse_json(text, files.label(path), LARGEST_MANIFEST)
    kind_and_format = isinstance(document, dict) and (document.get("kind"), document.get("format"))
    if kind_and_format != (KIND, FORMAT):
        raise files.refusal(path, "is not a manifest of a sweep of this version")
    with _damaged(path, "is damaged: its content does not match its hash"):
        manifest = Manifest.model_validate(document)
        if manifest.hash != _hash(document):
            raise ValueError
    _refuse_unregistered(path, manifest)
    with _damaged(path, "is damaged: no sweep writes such a manifest"):
        perspectives_of(manifest.study.perspective, faults := list[Fault]())
        stated_problem(manifest.study.problem)
        parts = -(-manifest.scenarios // manifest.study.scenarios_per_part)
        if (
            faults
            or not (manifest.scenarios <= MOST_SCENARIOS and parts <= MOST_PARTS)
            or None in map(range_of, manifest.grid)
            or manifest.versions.keys() != {*PACKAGES}
            or not manifest.names
        ):
            raise ValueError
    return manifest


def _refuse_unregistered(path: Path, manifest: Manifest) -> None:
    """Refuse a sweep over keys, or of a problem, that nothing in this process has registered."""
    problem = manifest.study.problem
    name = problem if isinstance(problem, str) else problem.get("name", "P1")
    own = [key for key in manifest.grid if key.partition(".")[0] in CHOICES]
    missing = [f"no key {key}" for key in own if range_of(key) is None]
    missing += [f"no problem {name}"] * (name not in (*PROBLEM_NAMES, *OWN_PROBLEMS))
    if missing:
        words = "here: import the package that registers what the sweep needs"
        raise files.refusal(path, f"{' and '.join(missing)} {words}")


def _summary(stored: SweepParts, asked: Sequence[str]) -> tuple[Document, Document]:
    """By perspective the shortest and the longest hover, and why how many have no plan."""
    words = words_of([])["reason"]
    counts = np.zeros((len(asked), len(words)), dtype=int)
    shortest_s, longest_s = np.full((2, len(asked)), np.nan)
    for number in range(stored.count):
        part = stored.read([number], {"reason": words}, ["reason", "hover_time_s"])
        reasons, hover_s = (part[n].reshape(-1, len(asked)) for n in ("reason", "hover_time_s"))
        counts += [np.bincount(codes, minlength=len(words)) for codes in reasons.T]
        shortest_s = np.fmin(shortest_s, np.fmin.reduce(hover_s))
        longest_s = np.fmax(longest_s, np.fmax.reduce(hover_s))
    ends = {
        name: {} if np.isnan(low_s) else {"shortest": float(low_s), "longest": float(high_s)}
        for name, low_s, high_s in zip(asked, shortest_s, longest_s, strict=True)
    }
    pairs = [zip(words[1:], count[1:], strict=True) for count in counts.tolist()]  # The first: none
    why = {
        name: {w: n for w, n in counts_by_reason if n}
        for name, counts_by_reason in zip(asked, pairs, strict=True)
    }
    return ends, why


def _refuse_others(versions: Mapping[str, str], source: str) -> None:
    """Refuse packages that are not of the stated versions."""
    words = "the version that began the sweep: install it, or set another output"
    refuse(
        Fault(package, now, f"{stated}, {words}", source)
        for package, stated in versions.items()
        if (now := _version(package)) != stated
    )
