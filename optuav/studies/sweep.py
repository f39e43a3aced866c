"""Studies of many scenarios, in parts that are whole or absent and outlive what makes them."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Sequence
from contextlib import closing
from contextvars import copy_context
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from optuav.arrays import Floats
from optuav.errors import Fault, refuse, require
from optuav.mission import files
from optuav.mission.messages import path_of, shown
from optuav.studies.batch import Solved, labelled, tables, words_of
from optuav.studies.cluster import results
from optuav.studies.methods import Progress
from optuav.studies.parts import is_whole, part_of, read_part
from optuav.studies.processes import worker_faults
from optuav.studies.scenarios import ROW
from optuav.studies.study import Document, Study, read_study

if TYPE_CHECKING:
    import xarray

KIND, FORMAT = "optuav sweep", 1
MANIFEST, PART = "manifest.json", "part-{:06}.parquet"
LARGEST_MANIFEST = 200_000_000  # bytes
PACKAGES = ("optuav", "numpy", "scipy", "pyarrow")
"""On whose versions the bytes of a part depend."""


class Swept(NamedTuple):
    """What a sweep has done, and where."""

    directory: Path
    scenarios: int
    parts: int
    kept: int  # Parts that were there before
    reasons: dict[str, dict[str, int]]  # By perspective the scenarios without a plan, and why


def sweep(
    study: str | Path,
    *,
    workers: int = 1,
    scheduler: str | None = None,
    progress: Progress | None = None,
) -> Swept:
    r"""Find the best plans of all scenarios of a study, in parts of which none is computed twice.

    Parameters
    ----------
    study
        Path of a study file in TOML: ``mission`` (a shipped name, or a path relative to the file),
        ``problem``, ``perspective`` (one or a list), and values of numeric keys: in ``[grid]`` with
        all combinations, in ``[paired]`` row by row, each a list or ``{ low = 600, high = 1800,
        count = 41 }``; in ``[samples]`` distributions as for `optuav.samples`, with ``count`` and
        ``seed`` of a Sobol sequence. Rows and samples go with every combination of the grid.
        ``scenarios_per_part`` is 100 000 and ``output``, the directory of the parts, the file's
        name without its ending where they are not stated.
    workers
        Number of processes of this machine that share the work, 1 to 1000.
    scheduler
        Address of a Dask scheduler, whose workers do the work instead; without `workers`.
    progress
        Called with the number of scenarios done, that of all, and words.

    Returns
    -------
    Swept
        ``directory``, the number of ``scenarios`` and of ``parts``, how many parts were ``kept``
        from before, and by perspective for what ``reasons`` how many scenarios have no plan.

    Raises
    ------
    InputError
        With all faults of the study; if the directory holds another study, or parts that were made
        by other versions of the packages; if a file cannot be written, no scheduler answers, or
        pyarrow or distributed is missing.
    SolverError
        If an engine returns points that violate a constraint, or the scheduler or every worker is
        lost. Parts that are done stay: called again, the sweep goes on from there.

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
    require("pyarrow", "sweeps")
    faults = [*worker_faults(workers)]
    if scheduler is not None and workers != 1:
        words = "not with a scheduler, which has workers of its own"
        faults.append(Fault("workers", shown(workers), words))
    refuse(faults)
    stated = read_study(path_of(study))
    manifest, directory = _manifest(stated), stated.output
    begun = _is_begun(directory, manifest)
    paths = [directory / PART.format(number) for number in range(stated.parts)]
    left = [n for n, path in enumerate(paths) if not is_whole(path, manifest["hash"], n)]
    kept = stated.parts - len(left)
    done = stated.scenarios - sum(len(stated.part(number)) for number in left)
    call = partial(_part, stated, manifest["hash"], manifest["versions"])
    context = copy_context()
    context.run(files.only_ours.set, False)  # Broken parts, and those of another run, are replaced

    def say(parts: int) -> None:
        if progress is not None:
            progress(done, stated.scenarios, f"{parts} of {stated.parts} parts")

    with closing(results(call, left, workers, scheduler)) as found:
        if not begun:
            files.make_directory(directory)
            files.write_text(directory / MANIFEST, json.dumps(manifest, indent=1) + "\n")
        say(kept)
        for parts, (number, content) in enumerate(found, kept + 1):
            context.run(files.write_files, {paths[number]: content})
            done += len(stated.part(number))
            say(parts)
    return Swept(directory, stated.scenarios, stated.parts, kept, _reasons(paths, stated))


def open_sweep(path: str | Path) -> xarray.Dataset:
    """Read a finished sweep.

    Parameters
    ----------
    path
        The directory of its parts.

    Returns
    -------
    xarray.Dataset
        With the variables, units and words of `optuav.batch`, and its dimensions: one a key of the
        grid, before them ``"scenario"`` for rows and samples, and ``"perspective"`` if there are
        several.

    Raises
    ------
    InputError
        If there is no sweep, parts of it are missing or damaged, or xarray or pyarrow is missing.

    Examples
    --------
    >>> import optuav, pathlib, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = pathlib.Path(folder) / "deadlines.toml"
    ...     _ = file.write_text("grid.limits.deadline_s = [600, 900, 1200]")
    ...     found = optuav.open_sweep(optuav.sweep(file).directory)
    >>> found.hover_time_s.values.round(1).tolist()
    [524.2, 591.6, 597.3]
    """
    require("pyarrow", "sweeps")
    require("xarray", "labelled datasets")
    directory = path_of(path)
    about = _read_manifest(directory)
    study, grid = about["study"], about["grid"]
    asked, at_once = study["perspective"], study["scenarios_per_part"]
    rows = {ROW: about["rows"]} if about["rows"] else {}
    sizes = {**rows, **{key: len(values) for key, values in grid.items()}}
    count, per_row = math.prod(sizes.values()), math.prod(map(len, grid.values()))
    paths = [directory / PART.format(number) for number in range(-(-count // at_once))]
    missing = sum(not is_whole(each, about["hash"], n) for n, each in enumerate(paths))
    if missing:
        words = f"is not finished: {missing} of {len(paths)} parts are missing"
        raise files.refusal(directory, f"{words}; optuav sweep goes on with it")
    several = {} if isinstance(asked, str) else {"perspective": len(asked)}
    buildings = [each["name"] for each in study["mission"].get("buildings", ())]
    side = several.get("perspective", 1)  # Rows of a part for each scenario
    known, values = words_of(buildings), tables(side * count)
    of_rows: dict[str, list[Floats]] = {}
    for number, each in enumerate(paths):
        first = number * at_once
        some = slice(first, min(first + at_once, count))
        for name, column in read_part(each, known).items():
            if name in values:
                values[name].reshape(side, count)[:, some] = column.reshape(-1, side).T
            elif name not in grid:
                begin = -first % per_row * side  # Where a row begins
                of_rows.setdefault(name, []).append(column[begin :: per_row * side])
    keys = {key: np.concatenate(parts) for key, parts in of_rows.items()}
    keys |= {key: np.array(stated) for key, stated in grid.items()}
    found = Solved(keys, several | sizes, values, [*buildings, "none"])
    return labelled(found, study["mission"]["name"], asked)


def _part(study: Study, stamp: str, versions: dict[str, str], number: int) -> bytes:
    """A part, refused where it would be made by other versions than the sweep."""
    _refuse_others(versions, "a worker")
    return part_of(study, stamp, number)


def _manifest(study: Study) -> Document:
    """What is kept beside the parts of a study."""
    stated = {
        "rows": study.rows if ROW in study.sizes else None,
        "grid": {key: values.tolist() for key, values in study.grid.items()},
        "study": study.document,
    }
    versions = {package: version(package) for package in PACKAGES}
    head = {"kind": KIND, "format": FORMAT, "hash": _hash(stated), "versions": versions}
    return {**head, **stated}


def _hash(manifest: Document) -> str:
    """What tells a study with its scenarios from every other."""
    stated = [manifest[name] for name in ("rows", "grid", "study")]
    return hashlib.sha256(json.dumps(stated).encode()).hexdigest()


def _is_begun(directory: Path, manifest: Document) -> bool:
    """Whether a directory holds this sweep, or nothing; anything else is refused."""
    with files.refusals(directory, "read"):
        there = {each.name for each in directory.iterdir()} if directory.is_dir() else set()
    if MANIFEST in there:
        found = _read_manifest(directory)
        if found["hash"] != manifest["hash"]:
            words = "holds the parts of another study: state another output, or delete it"
            raise files.refusal(directory, words)
        _refuse_others(found["versions"], files.label(directory / MANIFEST))
    elif there - {files.TEMPORARY}:
        raise files.refusal(directory, "is not empty, and holds no sweep: state another output")
    return MANIFEST in there


def _read_manifest(directory: Path) -> Document:
    """The manifest of a sweep."""
    path = directory / MANIFEST
    text = files.read_text(path, LARGEST_MANIFEST)
    found: Document = files.parse_json(text, files.label(path), LARGEST_MANIFEST)
    known = isinstance(found, dict) and (found.get("kind"), found.get("format")) == (KIND, FORMAT)
    if not known or not {"hash", "versions", "rows", "grid", "study"} <= found.keys():
        raise files.refusal(path, "is no manifest of a sweep of this version")
    named = isinstance(found["versions"], dict) and found["versions"].keys() == {*PACKAGES}
    if not named or found["hash"] != _hash(found):
        raise files.refusal(path, "is damaged: its content is not that of its hash")
    return found


def _reasons(paths: Sequence[Path], study: Study) -> dict[str, dict[str, int]]:
    """By perspective how many scenarios have no plan, by their reasons."""
    words, asked = words_of([])["reason"], study.perspectives
    counts = np.zeros((len(asked), len(words)), dtype=int)
    for path in paths:
        reasons = read_part(path, {"reason": words}, ["reason"])["reason"].reshape(-1, len(asked))
        counts += [np.bincount(each, minlength=len(words)) for each in reasons.T]
    pairs = [zip(words[1:], each[1:], strict=True) for each in counts.tolist()]  # The first: none
    return {name: {w: n for w, n in each if n} for name, each in zip(asked, pairs, strict=True)}


def _refuse_others(versions: dict[str, str], source: str) -> None:
    """Refuse packages that are not of the stated versions."""
    words = "with which the sweep was begun: install it, or state another output"
    refuse(
        Fault(package, now, f"{stated}, {words}", source)
        for package, stated in versions.items()
        if (now := version(package)) != stated
    )
