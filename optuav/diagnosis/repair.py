"""The smallest single changes of a mission that make an infeasible question feasible."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Generator, Hashable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, fields, replace
from functools import partial
from typing import Any, Literal, TypeAlias

import numpy as np

from formulations.formulation import Formulation
from optuav.arrays import Booleans, Floats, Values
from optuav.engines import bracket, grid
from optuav.engines.linear_form import slot_ranges
from optuav.engines.registry import MOST_UNKNOWNS
from optuav.errors import InputError, SolverError, for_console
from optuav.mission import Mission
from optuav.mission.keys import Key, as_stated, stated_keys
from optuav.mission.messages import shown
from optuav.modelling import Model, NotAffineError
from optuav.modelling.check import evaluated, holding
from optuav.modelling.classify import traits
from optuav.modelling.forms import NotExponentialError, excess
from optuav.network.graph import Graph
from optuav.network.network import Network
from optuav.network.variants import as_variants
from optuav.plan import Plan
from optuav.presentation.numbers import typed
from optuav.solving import Program, formulate, solve
from optuav.solving.best_plans import impossible
from optuav.solving.device_routes import network_for
from optuav.solving.longest import ITINERARIES_AT_ONCE
from optuav.solving.question import PROBLEM_NAMES, Question, checked_question, solve_model
from optuav.solving.route_models import declarations, permitted_routes
from optuav.status import Status

TABLES = ("limits", "battery", "body", "rotor", "laser", "link", "flight")
PLANNED = ["flight.obstacles", "limits.deadline_s", "limits.min_soc", "battery.packs"]
PLANNED += ["battery.capacity_As", "battery.charge_", "laser.power_W", "route.", "limits."]
PLANNED += ["link.transmit_power_W", "link.snr_threshold_dB", "body.mass_kg"]
"""Keys that a planner can change, the easiest first; other loads and physics come after."""
GIVEN = "link.noise_power_W"  # Nobody can change the noise: it comes last
WANTED = {"hover_time_s": "s"}
"""Options of the paper's problems that may be changed, with their units."""
LARGEST_FACTOR = 1e3  # Largest change that is tried, as a factor
CLOSE_ENOUGH = 0.1
"""Share of a value and of its change below which both are known well enough to round them."""
NEGLIGIBLE = 1e-9  # Share of a change that is as good as none
MOST_DIGITS = 8  # Digits that a small change may have; engines tell no smaller ones apart
TINY = 1e-300  # Replaces values nearer to 0, so that their digits are numbers
FINER = 6  # Digits that are added where the rounded value is not feasible

MOST_SLOTS, MOST_FAR = 2500, 500
"""Slots of an unknown that are tried one by one, and others, ever further apart, beyond them."""

Value: TypeAlias = float | bool | str | tuple[float, ...] | None
Case: TypeAlias = tuple[Question, Network]  # A question about the network of a mission


@dataclass(frozen=True)
class MissionQuestion:
    """A question that can be put to other missions as well."""

    mission: Mission
    stated: Question  # The slots of the mission are left out where it does not state its own
    graph: Graph | None = None  # A graph that was edited

    def program(self) -> Program:
        """The question declared."""
        return formulate(self.mission, graph=self.graph, **vars(self.stated))

    def solve(self) -> Plan:
        """The question answered, also where it cannot be declared."""
        return solve(self.mission, graph=self.graph, **vars(self.stated))

    def case(self, mission: Mission) -> Case:
        """The question about another mission and its network, without declarations."""
        question = checked_question(mission, **vars(self.stated))
        return question, network_for(mission, self.graph, question)

    def about(self, problem: Formulation) -> MissionQuestion:
        """The question with another problem."""
        return replace(self, stated=replace(self.stated, problem=problem))


@dataclass(frozen=True)
class Repair:
    """A change of one key that makes the question feasible.

    Parameters
    ----------
    key
        Dotted key of the mission; of a component as ``wind.force_N[2]``; or the field of a
        formulation of one's own.
    now
        Its value, in the unit of the key, as are the others.
    comparison, value
        Feasible if key >= value, <= value, or (for a switch) == value, None if the key must be
        left out; rounded on the feasible side.
    up_to
        Where the feasible values end, if further on they do; None if they do not.
    resolution
        Last digit of the value: the value short of it by so much is infeasible. 0 for a switch.

    Examples
    --------
    >>> from optuav.diagnosis import Repair
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
        return abs(self.value - self.now) / max(abs(self.value), abs(self.now))

    @for_console
    def __str__(self) -> str:
        if self.value is None:
            return f"{self.key} left out"
        if self.comparison == "==" or not isinstance(self.value, int | float):
            return f"{self.key} = {shown(self.value)}"
        if self.up_to is None:
            return f"{self.key} {self.comparison} {typed(self.value)}"
        low, high = (self.value, self.up_to)[:: 1 if self.comparison == ">=" else -1]
        return f"{typed(low)} <= {self.key} <= {typed(high)}"

    @property
    def row(self) -> tuple[str, str]:
        """The change and the present value, as they are written."""
        if self.comparison == "==" or not isinstance(self.now, int | float):
            return str(self), f"now {shown(self.now)}"
        return str(self), f"now {typed(self.now)}"

    def to_dict(self) -> dict[str, object]:
        """Return plain data."""
        now = list(self.now) if isinstance(self.now, tuple) else self.now
        return {**vars(self), "now": now, "relative_size": self.size}


def repairs(question: MissionQuestion) -> tuple[Repair, ...]:
    """Single changes that make an infeasible question feasible, own numbers and `PLANNED` first.

    Each number of one's own formulation, each numeric key of `TABLES` and each component of the
    wind that is not 0 is moved up and down within its range, at most by a factor of 1000; blocked
    legs fly over buildings, or through them; a stated hover point is left out; and η0 is kept
    only at the end. Places are not moved. Every change is verified by solving: with its value there
    is an answer, with one digit less none exists. Among changes of equal rank the smallest comes
    first.
    """
    mission = question.mission
    if feasible([question.case(mission)])[0]:
        return ()
    keys = stated_keys(mission).items()
    moved = [*_own(question)]
    moved += (key for name, key in keys if name.partition(".")[0] in TABLES and "[" not in name)
    moved += (key for name, key in keys if name.startswith("wind.") and key.now)
    ways = [(key, sign) for key in moved for sign in (1, -1)]
    changes = [*_switched(question), *searched(ways, partial(_repaired, question)).values()]

    def rank(repair: Repair) -> tuple[bool, bool, list[bool], bool, float, str]:
        planned = [not repair.key.startswith(name) for name in PLANNED]
        last = repair.key == "limits.keep_soc"
        is_given = repair.key == GIVEN
        return "." in repair.key, is_given, planned, last, repair.size, repair.key

    return tuple(sorted(changes, key=rank))


def _switched(question: MissionQuestion) -> Iterator[Repair]:
    """Yield the first other value of each switch that repairs; for blocked legs each that does."""
    mission = question.mission
    switches: tuple[tuple[str, Value, tuple[str | None, ...]], ...] = (
        ("flight.obstacles", mission.flight.obstacle_rule, ("over", "ignore")),
        ("route.hover_m", mission.route.hover_m, (None,)),
        ("limits.keep_soc", mission.limits.keep_soc, ("end",)),
    )
    for name, now, values in switches:
        for value in values if now not in values[-1:] else ():
            if now != value and feasible([question.case(mission.replace({name: value}))])[0]:
                yield Repair(name, now, "==", value, None, 0.0)
                if name != "flight.obstacles":
                    break


def outward(key: Key, sign: int) -> Iterator[float]:
    """Values ever larger (1) or smaller (−1), to a thousandfold or the end of the range."""
    last = key.high if sign > 0 else key.low
    scale = abs(key.now) or 1e-6 * max(abs(key.low), abs(key.high))
    by_factor = key.low >= 0.0 and key.now != 0.0
    value = key.now
    for share, factor in (
        (0.2, 1.2),
        (1.0, 2.0),
        (10.0, 10.0),
        (100.0, 100.0),
        (LARGEST_FACTOR, LARGEST_FACTOR),
    ):
        step = key.now * factor**sign if by_factor else key.now + sign * share * scale
        before, value = value, sign * math.ceil(sign * step) if key.whole else step
        if sign * value >= sign * last:
            if last != key.now:
                yield last
            return
        if value != before:
            yield value


def _own(question: MissionQuestion) -> Iterator[Key]:
    """A wanted hover time, and the numbers of one's own formulation, whose ranges are not known."""
    problem = question.stated.problem
    of_paper = problem.name in PROBLEM_NAMES
    for option in fields(problem):
        now = None if of_paper and option.name not in WANTED else getattr(problem, option.name)
        if isinstance(now, int | float) and not isinstance(now, bool):
            far, whole = LARGEST_FACTOR * abs(now) or LARGEST_FACTOR, option.type in (int, "int")
            unit = WANTED.get(option.name, "") if of_paper else ""
            yield Key(option.name, now, 0.0 if now >= 0 else -far, far, whole, unit)


Trial: TypeAlias = tuple[Key, float]
Direction: TypeAlias = tuple[Key, int]
Search: TypeAlias = Generator[list[float], list[bool], Repair | None]
"""Yields values, receives whether each of them repairs, and returns the repair."""


def _repaired(question: MissionQuestion, trials: Sequence[Trial]) -> list[bool]:
    """Return which values make the question feasible; a refused one does not."""
    repaired, cases, mission = [False] * len(trials), {}, question.mission
    for place, (key, value) in enumerate(trials):
        with suppress(ValueError, SolverError):  # as a formulation of one's own may raise it
            if "." in key.name:
                changes = as_stated(mission, {key.name: value})
                cases[place] = question.case(mission.replace(changes))
            else:
                own: Any = {key.name: int(value) if key.whole else value}
                changed = question.about(replace(question.stated.problem, **own))
                repaired[place] = feasible([changed.case(mission)])[0]
    for place, answered in zip(cases, feasible([*cases.values()]), strict=True):
        repaired[place] = answered
    return repaired


def searched(
    ways: Sequence[Direction], judge: Callable[[Sequence[Trial]], list[bool]]
) -> dict[Direction, Repair]:
    """Run searches in some directions together; every round judges all their values at once."""
    searches: dict[Direction, Search] = {way: search(*way) for way in ways}
    values = {way: next(search) for way, search in searches.items()}
    works, by_direction = dict[Trial, bool](), dict[Direction, Repair]()
    while values:
        trials = dict.fromkeys((key, v) for (key, _), some in values.items() for v in some)
        if new := [trial for trial in trials if trial not in works]:
            works.update(zip(new, judge(new), strict=True))
        for way, some in list(values.items()):
            try:
                values[way] = searches[way].send([works[way[0], value] for value in some])
            except StopIteration as end:
                del values[way]
                if end.value is not None:
                    by_direction[way] = end.value
    return by_direction


def search(key: Key, sign: int) -> Search:
    """The nearest value of a key, upwards (1) or downwards (−1), that repairs, and where they end.

    Ever larger changes are tried, then the gap before the nearest that repairs is halved. What
    repairs only between two values tried is missed.
    """
    values = [*outward(key, sign)]
    repair = yield values
    if not any(repair):
        return None
    place = repair.index(True)
    nearest = yield from _edge(key, sign, (key.now, *values)[place], values[place])
    if nearest is None:
        return None
    value, digit = nearest
    further, end = [value, *outward(replace(key, now=value), sign)], None
    repair = yield further
    if not all(repair):
        bad = repair.index(False)
        end = yield from _edge(key, -sign, further[bad], further[bad - 1])
    value, up_to = int(value) if key.whole else value, end[0] if end else None
    return Repair(key.name, key.now, ">=" if sign > 0 else "<=", value, up_to, 10.0**digit)


def _edge(
    key: Key, sign: int, bad: float, good: float
) -> Generator[list[float], list[bool], tuple[float, int] | None]:
    """The first value that repairs on the way from a bad to a good one, and its last digit.

    It is rounded towards the good one, to three digits, two of the change, or finer until it
    repairs; None if no rounded value does.
    """

    def decimal(count: int, digit: int) -> float:
        return float(f"{sign * count}e{digit}")

    while not key.whole:
        change = abs(good - key.now)
        size = min(change, abs(good)) if good else NEGLIGIBLE * change
        far = bad * good > 0.0 and max(abs(bad), abs(good)) > 4.0 * min(abs(bad), abs(good))
        # The geometric mean of values far apart, the arithmetic mean of others.
        middle = math.copysign(math.sqrt(bad * good), bad) if far else 0.5 * (bad + good)
        if abs(good - bad) <= CLOSE_ENOUGH * size or middle in (bad, good):
            break
        (repairs,) = yield [middle]
        bad, good = (bad, middle) if repairs else (middle, good)
    for digit in _digits(key, bad, good):
        unit = 10.0**digit
        low, high = math.floor(sign * bad / unit), math.ceil(sign * good / unit)
        (repairs,) = yield [decimal(high, digit)]
        if not repairs:
            continue
        while high - low > 1:
            middle_count = (low + high) // 2
            (repairs,) = yield [decimal(middle_count, digit)]
            low, high = (low, middle_count) if repairs else (middle_count, high)
        while sign * low * unit > sign * key.now:
            (repairs,) = yield [decimal(low, digit)]
            if not repairs:
                break
            low, high = low - 1, low
        return decimal(high, digit), digit
    return None


def _digits(key: Key, bad: float, good: float) -> range:
    """Decimal places of the last digit, the coarsest first."""
    if key.whole:
        return range(1)
    first = math.floor(math.log10(abs(good - key.now))) - 1
    if good:
        leading = math.floor(math.log10(max(min(abs(good), abs(bad) or math.inf), TINY)))
        first = min(max(first, leading - MOST_DIGITS + 1), leading - 2)
    return range(first, first - FINER, -1)


def feasible(cases: Sequence[Case]) -> list[bool]:
    """Return for each case whether some route has feasible times.

    Exact for programmes in one or two unknowns that are linear or of the wells of a battery, in
    slots too if there are up to two thousand; of more slots those near feasible times are tried, so
    a no is not certain. For other programmes the engine is asked.
    """
    answers, alike = [False] * len(cases), dict[Hashable, list[int]]()
    for place, (question, network) in enumerate(cases):
        has_point = network.mission.route.hover_m is not None
        alike.setdefault((question, has_point), []).append(place)
    for places in alike.values():
        question, network = cases[places[0]]
        at_once = max(1, ITINERARIES_AT_ONCE // len(network.routes))
        for some in (places[k : k + at_once] for k in range(0, len(places), at_once)):
            for k in np.flatnonzero(_feasible(question, *(cases[place][1] for place in some))):
                answers[some[k]] = True
    return answers


def _feasible(question: Question, *networks: Network) -> Booleans:
    """Return which missions with the same buildings have a route with feasible times."""
    variants, slot_s = as_variants(*networks), question.slot_s
    able = permitted_routes(variants, question.problem, impossible(variants) == 0)
    answers = np.zeros(len(networks), bool)
    for part, variant in declarations(question, variants, able):
        model = part.model
        possible = _continuous(question, model, len(variant))
        if slot_s is not None:
            possible &= _meetable(model, slot_s)
        for entry in np.flatnonzero(possible).tolist():
            if not answers[place := variant[entry]]:
                answers[place] = slot_s is None or _in_slots(model, model.row(entry), slot_s)
    return answers


def _continuous(question: Question, model: Model, count: int) -> Booleans:
    """Return which routes have feasible times, whole slots or not; evaluated outside the engine."""
    if len(model.variables) <= MOST_UNKNOWNS and not traits(model).integer:
        with suppress(NotExponentialError, InputError):
            rows = evaluated(model, bracket.some_point(model, count)[0])
            holds = np.broadcast_arrays(*(row.satisfied for row in rows))
            return np.asarray(np.logical_and.reduce(holds))
    try:
        statuses = solve_model(model, count, question).statuses
    except SolverError:
        return np.zeros(count, bool)
    return np.array([status.has_answer or status is Status.UNBOUNDED for status in statuses])


def _meetable(model: Model, slot_s: float) -> Booleans:
    """Test whether whole slots can add up to the required sums of unknowns, by programme."""
    possible = np.array(True)
    relations = (constraint.relation for constraint in model.constraints)
    for relation in (candidate for candidate in relations if candidate.sense == "=="):
        with suppress(NotAffineError):
            form, _ = excess(relation, {})
            if all(np.all(coefficient == 1.0) for coefficient in form.coefficients.values()):
                nearest_s = slot_s * np.round(form.constant / slot_s)
                possible = possible & holding("==", nearest_s, form.constant)
    return possible


def _in_slots(model: Model, parameters: Values, slot_s: float) -> bool:
    """Return whether some whole slots are feasible, by the tests of the grid engine."""
    axes, ranges, times_s = [], slot_ranges(model, parameters, slot_s), dict[str, Floats]()
    if any(last - first >= MOST_SLOTS for first, last in ranges.values()):
        with suppress(NotExponentialError, InputError):
            times_s = bracket.some_point(model, 1, parameters)[0]
    for name, (first, last) in ranges.items():
        count = last - first + 1.0
        far = np.floor(np.geomspace(1.0, max(count, 1.0), MOST_FAR)) - 1.0
        # Those around times that are feasible, whole slots or not.
        here = np.round(np.nan_to_num(times_s.get(name, 0.0)) / slot_s) - first - MOST_SLOTS // 2
        near = np.clip(here, 0.0, max(count - MOST_SLOTS, 0.0)) + np.arange(MOST_SLOTS)
        slots = np.union1d(near[near < count], far[far < count])
        axes.append(slot_s * (first + slots))
    points = dict(zip(ranges, np.ix_(*axes), strict=True))
    return bool(grid.cells(itertools.chain(*grid.tests(model, parameters)), points).any())
