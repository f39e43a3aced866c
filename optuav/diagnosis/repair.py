"""The smallest single changes of a mission that make an infeasible question feasible."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from formulations.formulation import Formulation
from optuav.diagnosis.asked import Asked, asked, with_problem
from optuav.diagnosis.feasible import feasible
from optuav.diagnosis.keys import Key, keys, moved, wind_components
from optuav.diagnosis.search import Asking, Found, search
from optuav.errors import InputError, SolverError
from optuav.mission import Mission
from optuav.mission.messages import shown
from optuav.options import ProblemName
from optuav.plan import Plan
from optuav.solving import Program

WRITTEN = ".15g"
"""Every digit of a rounded value: the next shorter one may not repair."""


@dataclass(frozen=True)
class Repair:
    """A change of one key that makes the question feasible.

    Parameters
    ----------
    key
        Dotted key of the mission; of a component as ``wind.force_N[2]``.
    now
        Its value.
    comparison, value
        Feasible if key >= value, <= value, or (for a switch) == value, None if the key is to be
        left out; rounded on the feasible side.
    up_to
        Where the feasible values end, if further on they do; None if they do not.
    resolution
        Digit to which it is rounded: the value short of it by so much is infeasible. 0 for a
        switch.
    """

    key: str
    now: Any
    comparison: Literal[">=", "<=", "=="]
    value: Any
    up_to: float | None
    resolution: float

    @property
    def size(self) -> float:
        """The change as a share of the larger of the two values; 1 for a switch."""
        if self.comparison == "==":
            return 1.0
        return float(abs(self.value - self.now) / max(abs(self.value), abs(self.now)))

    def __str__(self) -> str:
        if self.value is None:
            return f"{self.key} left out"
        if self.comparison == "==":
            return f"{self.key} = {shown(self.value)}"
        if self.up_to is None:
            return f"{self.key} {self.comparison} {self.value:{WRITTEN}}"
        low, high = sorted((self.value, self.up_to))
        return f"{low:{WRITTEN}} <= {self.key} <= {high:{WRITTEN}}"

    def to_dict(self) -> dict[str, Any]:
        """As plain data."""
        return {
            "key": self.key,
            "now": list(self.now) if isinstance(self.now, tuple) else self.now,
            "comparison": self.comparison,
            "value": self.value,
            "up_to": self.up_to,
            "relative_size": self.size,
        }


def repairs(
    subject: Program | Plan | Mission | str | Path,
    /,
    problem: Formulation | ProblemName | None = None,
    **options: Any,
) -> tuple[Repair, ...]:
    """Single changes that make an infeasible question feasible, the smallest first.

    Each numeric key of limits, battery, body, rotor, laser, link and flight, and each component of
    the wind that blows, is moved up and down within its range, at most a thousandfold, everything
    else held; flight through buildings is allowed, and a hover point that is stated is left out.
    Places are not moved. Changes that no value achieves,
    and those that break another rule of missions, are left out. Every change was verified by
    solving again: with the value that is offered there is an answer, with one digit less there is
    none. Where packs take turns, which no declaration knows of, none are looked for.

    Parameters
    ----------
    subject
        What `optuav.formulate` or `optuav.solve` returned, or a mission as they take it.
    problem
        With a mission: as for `optuav.formulate`.
    **options
        The others of `optuav.formulate`, with a mission.

    Returns
    -------
    Sorted by relative size of the change; empty if the question is feasible as it is.

    Raises
    ------
    InputError
        As `optuav.formulate`, or if a plan does not tell its question.
    """
    return repairs_of(asked(subject, with_problem(problem, options)))


def repairs_of(question: Asked) -> tuple[Repair, ...]:
    """As `repairs`, for a question that is known."""
    if question.takes_turns or feasible([question.case()])[0]:
        return ()
    found = [*_moved(question), *_switched(question)]
    return tuple(sorted(found, key=lambda each: (each.size, each.key)))


def _switched(question: Asked) -> Iterator[Repair]:
    """Flight through buildings, and the hover point of the link in place of a stated one."""
    mission = question.mission
    for key, value in (("flight.through_buildings", True), ("route.hover_m", None)):
        table, name = key.split(".")
        now = getattr(getattr(mission, table), name)
        if now != value and feasible([question.case(mission.replace({key: value}))])[0]:
            yield Repair(key, now, "==", value, None, 0.0)


Direction = tuple[Key, int]
Judge = Callable[[Sequence[tuple[Key, float]]], list[bool]]
"""Which values of keys repair."""


def _moved(question: Asked) -> Iterator[Repair]:
    """The nearest values of all keys, in both directions."""
    stated = (*keys(question.mission), *wind_components(question.mission))
    ways = [(key, sign) for key in stated for sign in (1, -1)]
    for (key, sign), found in searched(ways, _judge(question)).items():
        yield Repair(
            key=key.name,
            now=key.now,
            comparison=">=" if sign > 0 else "<=",
            value=int(found.value) if key.whole else found.value,
            up_to=found.up_to,
            resolution=found.resolution,
        )


def searched(ways: Sequence[Direction], judge: Judge) -> dict[Direction, Found]:
    """What the searches in some directions find; in every round all their values are judged."""
    asking: dict[Direction, Asking] = {way: search(*way) for way in ways}
    values = {way: next(each) for way, each in asking.items()}
    known: dict[tuple[Key, float], bool] = {}
    found: dict[Direction, Found] = {}
    while values:
        trials = dict.fromkeys((key, v) for (key, _), some in values.items() for v in some)
        if new := [trial for trial in trials if trial not in known]:
            known.update(zip(new, judge(new), strict=True))
        for way, some in list(values.items()):
            try:
                values[way] = asking[way].send([known[way[0], value] for value in some])
            except StopIteration as end:
                del values[way]
                if end.value is not None:
                    found[way] = end.value
    return found


def _judge(question: Asked) -> Judge:
    """Which values make the question feasible; one that breaks a rule of missions does not."""

    def judge(trials: Sequence[tuple[Key, float]]) -> list[bool]:
        repairs, cases = [False] * len(trials), {}
        for number, (key, value) in enumerate(trials):
            try:
                cases[number] = question.case(moved(question.mission, key, value))
            except (InputError, SolverError):
                continue
        for number, repaired in zip(cases, feasible([*cases.values()]), strict=True):
            repairs[number] = repaired
        return repairs

    return judge
