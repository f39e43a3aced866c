"""The smallest single changes of a mission that make an infeasible question feasible."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal, NamedTuple, TypeAlias

from formulations.formulation import Formulation
from optuav.diagnosis.feasible import feasible
from optuav.diagnosis.keys import Key, keys, moved, wind_components
from optuav.diagnosis.question import MissionQuestion, Subject, question_of
from optuav.engines.registry import Engine
from optuav.errors import InputError, SolverError
from optuav.mission.messages import shown
from optuav.options import Perspective, ProblemName

if TYPE_CHECKING:
    from optuav.network.graph import Graph

WRITTEN = ".15g"
"""Every digit of a rounded value: a shorter one may not repair."""
NEAR = 0.1
"""Share of a value and of its change below which both are known well enough to round them."""
NEGLIGIBLE = 1e-9
"""Share of a change that is as good as none."""
MOST_DIGITS = 8
"""Digits that a small change may have; engines tell no smaller ones apart."""
TINY = 1e-300
"""Replaces what is nearer to 0, so that its digits are numbers."""
FINER = 6
"""Digits that are added where the rounded value is not feasible."""

Value: TypeAlias = float | bool | tuple[float, ...] | None


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
        Last digit of the value: the value short of it by so much is infeasible. 0 for a switch.

    Examples
    --------
    >>> repair = Repair("limits.deadline_s", 60.0, ">=", 75.8, None, 0.1)
    >>> print(repair, round(repair.size, 2))
    limits.deadline_s >= 75.8 0.21
    """

    key: str
    now: Value
    comparison: Literal[">=", "<=", "=="]
    value: Value
    up_to: float | None
    resolution: float

    @property
    def size(self) -> float:
        """The change as a share of the larger of the two values; 1 for a switch."""
        if not isinstance(self.value, int | float) or not isinstance(self.now, int | float):
            return 1.0
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
        low, high = (self.value, self.up_to)[:: 1 if self.comparison == ">=" else -1]
        return f"{low:{WRITTEN}} <= {self.key} <= {high:{WRITTEN}}"

    @property
    def now_text(self) -> str:
        """The present value as it is written."""
        return shown(self.now) if self.comparison == "==" else f"{self.now:{WRITTEN}}"

    def to_dict(self) -> dict[str, object]:
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
    subject: Subject,
    /,
    problem: Formulation | ProblemName | None = None,
    *,
    perspective: Perspective | None = None,
    slot_s: float | None = None,
    engine: str | Engine | None = None,
    graph: Graph | None = None,
    time_limit_s: float | None = None,
) -> tuple[Repair, ...]:
    """Single changes that make an infeasible question feasible, the smallest first.

    Each numeric key of limits, battery, body, rotor, laser, link and flight, and each component of
    the wind that is not 0, is moved up and down within its range, at most a thousandfold,
    everything else held; flight through buildings is allowed, and a stated hover point is left out.
    Places are not moved. Changes that no value achieves, and those that break another rule of
    missions, are left out. Every change was verified by solving again: with the value that is
    offered there is an answer, with one digit less there is none. Where packs take turns, which is
    simulated and not declared, none are sought.

    Parameters
    ----------
    subject
        What `optuav.formulate` or `optuav.solve` returned, or a mission as they take it.
    problem, perspective, slot_s, engine, graph, time_limit_s
        With a mission only: as for `optuav.formulate`. None for its defaults.

    Returns
    -------
    tuple of Repair
        Sorted by relative size of the change; empty if the question is feasible already.

    Raises
    ------
    InputError
        As `optuav.formulate`, or if a plan does not record its question.

    Examples
    --------
    >>> repairs("paper")
    ()
    """
    return repairs_of(
        question_of(subject, problem, perspective, slot_s, engine, graph, time_limit_s)
    )


def repairs_of(question: MissionQuestion) -> tuple[Repair, ...]:
    """As `repairs`, for a question that is known."""
    if question.takes_turns or feasible([question.case()])[0]:
        return ()
    found = [*_moved(question), *_switched(question)]
    return tuple(sorted(found, key=lambda each: (each.size, each.key)))


def _switched(question: MissionQuestion) -> Iterator[Repair]:
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


def _moved(question: MissionQuestion) -> Iterator[Repair]:
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


def _judge(question: MissionQuestion) -> Judge:
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


class RepairingValues(NamedTuple):
    """Values of a key that repair."""

    value: float  # The nearest one, rounded on the feasible side
    up_to: float | None  # Where they end, if further on they do
    resolution: float  # Last digit of the value: short of it by so much is infeasible


Search: TypeAlias = Generator[list[float], list[bool], RepairingValues | None]
"""Yields values, is sent whether each of them repairs, and returns what was found."""
Edging: TypeAlias = Generator[list[float], list[bool], tuple[float, int] | None]


def searched(ways: Sequence[Direction], judge: Judge) -> dict[Direction, RepairingValues]:
    """What the searches in some directions find; in every round all their values are judged."""
    searches: dict[Direction, Search] = {way: search(*way) for way in ways}
    values = {way: next(each) for way, each in searches.items()}
    known: dict[tuple[Key, float], bool] = {}
    found: dict[Direction, RepairingValues] = {}
    while values:
        trials = dict.fromkeys((key, v) for (key, _), some in values.items() for v in some)
        if new := [trial for trial in trials if trial not in known]:
            known.update(zip(new, judge(new), strict=True))
        for way, some in list(values.items()):
            try:
                values[way] = searches[way].send([known[way[0], value] for value in some])
            except StopIteration as end:
                del values[way]
                if end.value is not None:
                    found[way] = end.value
    return found


def search(key: Key, sign: int) -> Search:
    """The nearest value of a key, upwards (1) or downwards (−1), that repairs, and where they end.

    Values further and further away are tried first, then the gap before the nearest of them that
    repairs is halved. What repairs only between two values that were tried is missed.
    """
    values = [*key.further(sign)]
    repair = yield values
    if not any(repair):
        return None
    place = repair.index(True)
    nearest = yield from _edge(key, sign, (key.now, *values)[place], values[place])
    if nearest is None:
        return None
    value, digit = nearest
    further = [value, *replace(key, now=value).further(sign)]
    repair = yield further
    end = None
    if not all(repair):
        bad = repair.index(False)
        end = yield from _edge(key, -sign, further[bad], further[bad - 1])
    return RepairingValues(value, end[0] if end else None, 10.0**digit)


def _edge(key: Key, sign: int, bad: float, good: float) -> Edging:
    """The first value that repairs on the way from a bad to a good one, and its last digit.

    It is rounded away from the bad one, to three digits of itself and two of the change or finer
    where the rounded value does not repair; None if no rounded value does.
    """
    while not key.whole and abs(good - bad) > NEAR * _size(key, good):
        middle = _between(bad, good)
        if middle in (bad, good):
            break
        (repairs,) = yield [middle]
        bad, good = (bad, middle) if repairs else (middle, good)
    for digit in _digits(key, bad, good):
        unit = 10.0**digit
        low, high = math.floor(sign * bad / unit), math.ceil(sign * good / unit)
        (repairs,) = yield [_decimal(sign * high, digit)]
        if not repairs:
            continue
        while high - low > 1:
            middle = (low + high) // 2
            (repairs,) = yield [_decimal(sign * middle, digit)]
            low, high = (low, middle) if repairs else (middle, high)
        while sign * low * unit > sign * key.now:
            (repairs,) = yield [_decimal(sign * low, digit)]
            if not repairs:
                break
            low, high = low - 1, low
        return _decimal(sign * high, digit), digit
    return None


def _size(key: Key, value: float) -> float:
    """The smaller of a value and its distance from the present one; of zero, what is negligible."""
    change = abs(value - key.now)
    return min(change, abs(value)) if value else NEGLIGIBLE * change


def _between(one: float, other: float) -> float:
    """The geometric mean of values far apart, the arithmetic mean of others."""
    far = one * other > 0.0 and max(abs(one), abs(other)) > 4.0 * min(abs(one), abs(other))
    return math.copysign(math.sqrt(one * other), one) if far else 0.5 * (one + other)


def _digits(key: Key, bad: float, good: float) -> range:
    """Decimal places of the last digit, the coarsest first."""
    if key.whole:
        return range(1)
    first = math.floor(math.log10(abs(good - key.now))) - 1
    if good:
        leading = math.floor(math.log10(max(min(abs(good), abs(bad) or math.inf), TINY)))
        first = min(max(first, leading - MOST_DIGITS + 1), leading - 2)
    return range(first, first - FINER, -1)


def _decimal(count: int, digit: int) -> float:
    """count · 10^digit as it is written."""
    return float(f"{count}e{digit}")
