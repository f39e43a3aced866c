"""Files of solutions of the benchmark set, and the verdict of the simulation on each."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from optuav.errors import Fault, InputError
from optuav.frames import DataFrame, frame
from optuav.judge.benchmark import Asked, CheckedSolution, answers, checked
from optuav.judge.timeline import DURATION, STOP, stop_breaches
from optuav.mission import Mission, benchmark, load
from optuav.mission.files import label, parse_json, read_text
from optuav.mission.messages import nearest, path_of
from optuav.mission.validation import Breach, Document, StatedMission, format_breaches, keys_of
from optuav.plan import Stop
from optuav.plan.plan import LARGEST_BYTES
from optuav.presentation.blocks import Block, Facts, Heading
from optuav.presentation.numbers import seconds
from optuav.presentation.presented import Presented

KIND = "optuav solutions"
MOST_STOPS = 100  # More than any problem of the set allows
MOST_NAMED = 6  # Missions without a solution that are printed by name
KEYS = {
    "kind": f'"{KIND}"',
    "solutions": "a list of at least one object with mission, hover_s and stops, "
    "each for another question",
}
"""Keys of a file beside its schema."""
ENTRY = {
    "mission": "a mission of the set",
    "problem": "a problem that the set asks of this mission",
    "perspective": "a perspective that it asks about",
    "hover_s": f"{DURATION.words}; null without a plan",
    "stops": f"a list of at most {MOST_STOPS}, each {STOP}; null without a plan",
}
"""Keys of a solution."""
TIMES = ("hover", "claimed", "best_known", "bound")  # Times of a checked solution, without _s
USUAL = {"problem": "P1", "perspective": "available", "stops": ()}
"""Keys that may be left out."""


@dataclass(frozen=True)
class CheckedSolutions(Presented):
    """The verdict on a file of solutions; it is true where all of them hold.

    Parameters
    ----------
    source
        The file.
    solutions
        The check of each, in order: its ``verdict`` in words, its faults ``wrong`` (empty
        if it holds), and the hover time that is claimed and simulated, ``claimed_s`` and
        ``hover_s`` [s].
    missing
        Missions of the set without a solution.

    Examples
    --------
    >>> import json, optuav, tempfile
    >>> claim = {"mission": "set/link-far", "hover_s": None}
    >>> text = json.dumps({"schema": 1, "kind": "optuav solutions", "solutions": [claim]})
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = f"{folder}/claim.json"
    ...     with open(path, "w") as file:
    ...         _ = file.write(text)
    ...     checked = optuav.check_solutions(path)
    >>> checked.verdict, checked.solutions[0].verdict, len(checked.missing)
    ('1 of 1 solutions hold', 'holds, there is no plan', 199)
    """

    source: str
    solutions: tuple[CheckedSolution, ...]
    missing: tuple[str, ...]

    def __bool__(self) -> bool:
        return not any(solution.wrong for solution in self.solutions)

    def __repr__(self) -> str:
        return f"<CheckedSolutions of {self.source!r}: {self.verdict}>"

    def blocks(self) -> Iterator[Block]:
        """Yield the verdict on each solution, and missions without one."""
        yield Heading(f"{self.verdict}: {self.source}", good=bool(self))
        for solution in self.solutions:
            row = solution.to_dict()
            ends_s = {name.replace("_", " "): row[f"{name}_s"] for name in TIMES}
            question = f"{row['mission']}, {row['problem']}, {row['perspective']}"
            yield Heading(f"{question}: {solution.verdict}", good=not solution.wrong)
            times = [
                f"{name} {seconds(end_s, 3)}"
                for name, end_s in ends_s.items()
                if isinstance(end_s, int | float)
            ]
            facts = [("Times", ", ".join(times))] if times else []
            yield Facts([*facts, *(("Wrong", words) for words in solution.wrong)])
        if self.missing:
            more = len(self.missing) - MOST_NAMED
            names = ", ".join(self.missing[:MOST_NAMED])
            yield Facts([("Missing", f"{names}{f' and {more} more' * (more > 0)}")])

    @property
    def verdict(self) -> str:
        """Number of solutions that hold."""
        hold = sum(not solution.wrong for solution in self.solutions)
        return f"{hold} of {len(self.solutions)} solutions hold"

    def to_dict(self) -> dict[str, object]:
        """The verdict as plain data: strings, numbers, truth values, lists, dicts and None."""
        rows = [solution.to_dict() for solution in self.solutions]
        head = {"source": self.source, "all_hold": bool(self)}
        return {**head, "solutions": rows, "missing": [*self.missing]}

    def to_frame(self) -> DataFrame:
        """One row a solution; needs pandas."""
        rows = [solution.to_dict() for solution in self.solutions]
        return frame(rows, [*rows[0]] if rows else [*ENTRY])


def check_solutions(file: str | Path) -> CheckedSolutions:
    """Check solutions of the benchmark set by simulating each from its mission.

    Parameters
    ----------
    file
        A JSON file, up to 32 MB: an object with ``schema`` 1, ``kind`` ``"optuav solutions"`` and
        ``solutions``, a list of objects with the ``mission``, the ``problem`` (``"P1"`` if left
        out), the ``perspective`` (``"available"``), the hover time ``hover_s`` that is claimed, 0
        to 1e7 [s], and the ``stops`` in order, each with ``at``, ``kind`` and ``duration_s`` [s].
        A claim of no plan has ``hover_s`` null and no stops.

    Returns
    -------
    CheckedSolutions
        For each solution, whether it holds, why not, and how it compares with the best known.

    Raises
    ------
    InputError
        With everything that is wrong with the file, including unknown missions.

    Examples
    --------
    >>> import json, optuav, tempfile
    >>> stop = {"at": "hover", "kind": "hover", "duration_s": 577.5}
    >>> claim = {"mission": "set/deadline-1200", "problem": "P3", "hover_s": 577.5, "stops": [stop]}
    >>> text = json.dumps({"schema": 1, "kind": "optuav solutions", "solutions": [claim]})
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = f"{folder}/claim.json"
    ...     with open(path, "w") as file:
    ...         _ = file.write(text)
    ...     checked = optuav.check_solutions(path)
    >>> bool(checked), checked.solutions[0].verdict
    (True, 'holds, 0.024 s below the best known')
    """
    path = path_of(file, "file")
    source = label(path)
    document = parse_json(read_text(path, LARGEST_BYTES), source)
    if not isinstance(document, dict):
        raise InputError([Fault("", "", f'is not an object with "kind": "{KIND}"', source)])
    entries = document.get("solutions")
    named = [keys_of(x).get("mission") for x in entries] if isinstance(entries, list) else []
    of_set = {name for name in named if isinstance(name, str) and name in benchmark.recipes()}
    missions = {name: load(name) for name in of_set}
    breaches = [*format_breaches(document), *_breaches(document, missions)]
    if faults := StatedMission(document, {(): source}).faults(breaches):
        raise InputError(faults)
    checks = list[CheckedSolution]()
    for stated in ({**USUAL, **entry} for entry in document["solutions"]):
        stops = [Stop(**stop) for stop in stated["stops"] or ()]
        answer = answers()[_asked(stated)]
        checks.append(checked(missions[answer.mission], answer, stated["hover_s"], stops))
    missing = tuple(name for name in benchmark.recipes() if name not in of_set)
    return CheckedSolutions(source, tuple(checks), missing)


def _asked(stated: Document) -> Asked:
    return stated["mission"], stated["problem"], stated["perspective"]


def _breaches(document: Document, missions: dict[str, Mission]) -> Iterator[Breach]:
    """Yield the faults in the data of a file; missions that are not here are unknown."""
    for key in document:
        if key not in ("schema", *KEYS):
            yield Breach((key,), f"unknown key{nearest(key, KEYS)}")
    if document.get("kind") != KIND:
        yield Breach(("kind",), KEYS["kind"])
    entries = document.get("solutions")
    if not isinstance(entries, list) or not 0 < len(entries) <= len(answers()):
        yield Breach(("solutions",), KEYS["solutions"])
        return
    first = dict[Asked, int]()
    for number, entry in enumerate(entries):
        if not isinstance(entry, dict):
            yield Breach(("solutions", number), KEYS["solutions"])
            continue
        for breach in _breaches_of(entry, missions):
            yield Breach(("solutions", number, *breach.key), breach.allowed)
        try:
            earlier = first.setdefault(_asked({**USUAL, **entry}), number)
        except (KeyError, TypeError):  # the breaches tell of them
            continue
        if earlier != number:
            yield Breach(("solutions", number), f"solutions.{earlier} answers the same question")


def _breaches_of(entry: Document, missions: dict[str, Mission]) -> Iterator[Breach]:
    """Yield the faults of one solution."""
    complete = {**USUAL, **entry}
    yield from (
        Breach((key,), f"unknown key{nearest(key, ENTRY)}") for key in entry if key not in ENTRY
    )
    claim, name = complete.get("hover_s", ""), complete.get("mission")
    stops = () if complete["stops"] is None else complete["stops"]
    if claim is not None and not DURATION.accepts(claim):
        yield Breach(("hover_s",), ENTRY["hover_s"])
    mission = missions.get(name) if isinstance(name, str) else None
    fits = isinstance(stops, list | tuple) and len(stops) <= MOST_STOPS
    if not fits or bool(stops) is (claim is None):
        yield Breach(("stops",), ENTRY["stops"])
    elif stops:
        yield from stop_breaches(stops, mission)
    if mission is None:
        hint = nearest(name, benchmark.recipes()) if isinstance(name, str) else ""
        yield Breach(("mission",), ENTRY["mission"] + hint)
        return
    recipe = benchmark.recipe_of(mission.name)
    for option, taken in (("problem", recipe.problems), ("perspective", recipe.perspectives)):
        if complete[option] not in taken:
            yield Breach((option,), f"{ENTRY[option]}: {', '.join(taken)}")
