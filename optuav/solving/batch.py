"""The longest hover of many itineraries at once, from arrays, under the perspective `available`."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import accumulate, chain, pairwise, zip_longest
from typing import Any, Literal, NamedTuple, TypeAlias, get_args

import numpy as np

from formulations.p1 import P1
from formulations.parameters import Quantities
from formulations.soc import AVAILABLE, PERSPECTIVES
from formulations.wells import Telling, well_limits
from optuav.arrays import Booleans, Floats, Integers
from optuav.engines.bracketing import WIDTH_S, largest, shortest
from optuav.engines.rows import Rows, rows_of
from optuav.errors import Fault, InputError
from optuav.mission.schema import Number
from optuav.modelling.kibam_form import CONSTANT, Exponential, unknown
from optuav.physics import kibam

Leg: TypeAlias = Sequence[kibam.Stage]
Stays: TypeAlias = Literal["hover", "rest-first", "hover-first"]
STAYS: Mapping[str, tuple[str, ...]] = {
    "hover": ("hover",),
    "rest-first": ("rest", "hover"),
    "hover-first": ("hover", "rest"),
}
AT_ONCE = 1 << 13
"""Routes worked on together: few enough to stay in the cache, and in bounded memory."""

CURRENT = Number("A", ge=-1e6, le=1e6)
FLYING = Number("A", ge=-1e6, le=0, note="; in flight nothing charges")
DURATION = Number("s", ge=0, le=1e7)
RANGES: Mapping[str, Number] = {
    "deadline_s": DURATION,
    "min_soc": Number("-", ge=0, le=1),
    "capacity_As": Number("A s", ge=1e-3, le=1e12),
    "available_fraction": Number("-", ge=1e-6, le=0.999999),
    "flow_rate_per_s": Number("1/s", ge=0, le=1e3),
    "hover_current_A": CURRENT,
    "rest_current_A": CURRENT,
}
"""Beyond these, which missions keep to as well, rounding may void what is proved."""


class Hovers(NamedTuple):
    """Longest hovers, arrays with one entry an itinerary.

    Parameters
    ----------
    hover_time_s, rest_time_s
        Δ and T' [s]; NaN where no hover is possible. T' is admissible, the shortest if so question.
    beyond_s
        No hover is longer than this [s]; −inf where it is proved that none is possible.
    """

    hover_time_s: Floats
    rest_time_s: Floats
    beyond_s: Floats

    @property
    def proved(self) -> Booleans:
        """Where the hover is the longest to within 1e-7 s, or proved impossible."""
        close = self.beyond_s - self.hover_time_s <= 10.0 * WIDTH_S
        return np.asarray(close | np.isneginf(self.beyond_s))


def longest_hovers(
    legs: Sequence[Leg],
    stays: Stays | Sequence[Stays] = "hover",
    *,
    deadline_s: Any,
    min_soc: Any,
    capacity_As: Any,
    available_fraction: Any,
    flow_rate_per_s: Any,
    hover_current_A: Any,
    rest_current_A: Any = 0.0,
    shortest_rest: bool = False,
) -> Hovers:
    """Longest hovers that the battery can deliver, each with its proof (engine bracket).

    From a full battery, 0 ≤ y1 ≤ ωB at every moment, η ≥ η0 at the end, all within the deadline.
    Charging is at constant current; where it tapers, `optuav.solve` answers.
    Every figure is a number, or an array of one shape for all: the itineraries, of one mission or
    of many.

    Parameters
    ----------
    legs
        What is flown before, between and after the stays: one leg more than stays, each a sequence
        of `optuav.physics.kibam.Stage` (current [A], −1e6 to 0, as in flight nothing charges, and
        duration [s], 0 to 1e7).
    stays
        ``"hover"``, ``"rest-first"`` or ``"hover-first"``, or one of these for each itinerary. Then
        there are three legs, of which one that only hovers flies the last two without a stop: the
        third may last 0 s. Where one name is given, no answer depends, to the last bit, on the
        others in the call; itineraries that are named one by one share more of their work.
    deadline_s, min_soc
        T_max [s], 0 to 1e7, and η0 [-], 0 to 1.
    capacity_As, available_fraction, flow_rate_per_s
        B of all packs together [A s], 1e-3 to 1e12, ω [-], 1e-6 to 0.999999, and k_F [1/s], 0 to
        1e3.
    hover_current_A, rest_current_A
        Net current drawn while hovering, and that charges while resting [A], up to 1e6 either way.
    shortest_rest
        Whether to find the shortest T' for each Δ, which takes about half as long again.

    Raises
    ------
    InputError
        With everything that is wrong: legs that do not go with the stays, shapes that differ,
        figures that are no numbers or out of range.
    """
    given = {
        "deadline_s": deadline_s,
        "min_soc": min_soc,
        "capacity_As": capacity_As,
        "available_fraction": available_fraction,
        "flow_rate_per_s": flow_rate_per_s,
        "hover_current_A": hover_current_A,
        "rest_current_A": rest_current_A,
    }
    figures, flown, order = _figures(given), _flown(legs), _order(stays)
    shape = _shape(flown, order, figures)
    count = math.prod(shape)
    found = np.empty((3, count))
    for first in range(0, count, AT_ONCE):
        here = slice(first, min(first + AT_ONCE, count))
        table, cut = _legs(flown, here), {name: _cut(each, here) for name, each in figures.items()}
        if not (_within(table.current_A, FLYING) and _within(table.duration_s, DURATION)):
            _refuse(flown, order, figures)
        found[:, here] = _bracket(table, _cut(order, here), cut, shortest_rest)
    return Hovers(*found.reshape(3, *shape))


def _bracket(legs: Legs, stays: Any, figures: Mapping[str, Any], shortest_rest: bool) -> Floats:
    """All in one order by groups that need the same rows; those in several share theirs."""
    found = np.empty((3, legs.duration_s.shape[1]))
    one_order = isinstance(stays, str)
    for some in alike(legs, figures, stays == "rest-first") if one_order else [slice(None)]:
        cut = {name: _cut(each, some) for name, each in figures.items()}
        found[:, some] = _bracket_alike(legs.take(some), _cut(stays, some), cut, shortest_rest)
    return found


def _bracket_alike(
    legs: Legs, stays: Any, figures: Mapping[str, Any], shortest_rest: bool
) -> Floats:
    rows, x_top = hover_rows(legs, figures, stays == "rest-first")
    y_top = np.where(stays == "hover", 0.0, x_top)
    found = largest(rows, x_top, y_top)
    rest_s = shortest(rows, found, y_top) if shortest_rest else found.y
    return np.stack([found.x, rest_s, found.beyond])


def _figures(given: Mapping[str, Any]) -> dict[str, Any]:
    figures, faults = {}, []
    for name, value in given.items():
        try:
            figures[name] = _figure(value)
        except (TypeError, ValueError):
            faults.append(Fault(name, repr(value)[:40], "a number, or an array of numbers"))
    if faults:
        raise InputError(faults)
    return figures


def _flown(legs: Sequence[Leg]) -> list[list[kibam.Stage]]:
    try:
        return [[kibam.Stage(*map(_figure, phase)) for phase in leg] for leg in legs]
    except (TypeError, ValueError):
        allowed = "legs, each a sequence of phases of two numbers or arrays: current and duration"
        raise InputError([Fault("legs", repr(legs)[:40], allowed)]) from None


def _order(stays: Any) -> Any:
    """A name, or an array of names."""
    try:
        order = np.asarray(stays, dtype=str)
    except ValueError:
        raise InputError(
            [Fault("stays", repr(stays)[:40], "a name, or an array of names")]
        ) from None
    return order if order.ndim else str(order)


def _figure(value: Any) -> Any:
    """A number, or an array of numbers."""
    array = np.asarray(value, dtype=float)
    return array if array.ndim else float(array)


def _cut(figure: Any, here: Any) -> Any:
    """A figure of some itineraries; what is no array holds for all."""
    return figure.ravel()[here] if isinstance(figure, np.ndarray) else figure


def _legs(flown: Sequence[Leg], here: slice) -> Legs:
    """The legs of some of the itineraries."""
    ends = list(accumulate(map(len, flown), initial=0))
    table = np.empty((2, ends[-1], here.stop - here.start))
    for stage, phase in enumerate(chain.from_iterable(flown)):
        for kind, figure in enumerate(phase):
            table[kind, stage] = _cut(figure, here)
    current_A, duration_s = table
    return Legs(current_A, duration_s, ends)


def _shape(flown: Sequence[Leg], stays: Any, figures: Mapping[str, Any]) -> tuple[int, ...]:
    """The one shape of all that are arrays."""
    stages = chain.from_iterable(chain.from_iterable(flown))
    arrays = (e for e in (stays, *figures.values(), *stages) if isinstance(e, np.ndarray))
    shapes: set[tuple[int, ...]] = {each.shape for each in arrays}
    one, *others = shapes or {()}
    sound = not others and 0 not in one and len(flown) == _legs_needed(stays)
    if not sound or not all(_within(each, RANGES[name]) for name, each in figures.items()):
        _refuse(flown, stays, figures)
    return one


def _legs_needed(stays: Any) -> int | None:
    """One more than stays; None if one of these is unknown."""
    if isinstance(stays, str):
        return len(STAYS[stays]) + 1 if stays in STAYS else None
    return 3 if np.isin(stays, list(STAYS)).all() else None


def _within(figure: Any, allowed: Number) -> bool:
    if isinstance(figure, float):
        return allowed.accepts(figure)
    return not figure.size or all(allowed.accepts(float(e)) for e in (figure.min(), figure.max()))


def _refuse(flown: Sequence[Leg], stays: Any, figures: Mapping[str, Any]) -> None:
    """Raise with everything that is wrong, if anything is."""
    faults = []
    if (needed := _legs_needed(stays)) is None:
        unknown = set(np.ravel(stays).tolist()) - STAYS.keys()
        faults.append(Fault("stays", ", ".join(sorted(unknown)), f"one of {', '.join(STAYS)}"))
    elif len(flown) != needed:
        which = repr(stays) if isinstance(stays, str) else "stays that are told one by one"
        faults.append(Fault("legs", f"{len(flown)} legs", f"{needed} go with {which}"))
    every = [*_named(flown, figures)]
    shapes = {"stays": stays, **{name: figure for name, figure, _ in every}}
    owners: dict[tuple[int, ...], str] = {}
    for name, array in shapes.items():
        if isinstance(array, np.ndarray):
            owners.setdefault(array.shape, name)
    if len(owners) > 1:
        told = ", ".join(f"{shape} of {name}" for shape, name in owners.items())
        faults.append(Fault("shapes", told, "one shape for all arrays"))
    for name, figure, allowed in every:
        if not _within(figure, allowed):
            first = next(e for e in np.ravel(figure).tolist() if not allowed.accepts(e))
            faults.append(Fault(name, f"{first:g}", allowed.words))
    if faults:
        raise InputError(faults)


def _named(flown: Sequence[Leg], figures: Mapping[str, Any]) -> Iterator[tuple[str, Any, Number]]:
    """Every figure with its name and what it may be."""
    for name, figure in figures.items():
        yield name, figure, RANGES[name]
    for number, leg in enumerate(flown, start=1):
        for stage, phase in enumerate(leg, start=1):
            where = f"of stage {stage} of leg {number}"
            yield f"legs: current {where}", phase.current_A, FLYING
            yield f"legs: duration {where}", phase.duration_s, DURATION


UNUSED = (
    "nominal_voltage_V",
    "flight_energy_J",
    "hover_power_W",
    "hover_received_W",
    "rest_received_W",
)
"""Quantities that this perspective does not speak of."""


class Legs(NamedTuple):
    """Currents [A] and durations [s] of all stages, one leg after another (stage, itinerary).

    Leg m is made of stages ends[m] to ends[m + 1].
    """

    current_A: Floats
    duration_s: Floats
    ends: Sequence[int]

    @property
    def rests(self) -> bool:
        """Whether there are two stays between the legs, so that one is a rest."""
        return len(self.ends) == 4

    def take(self, which: Any) -> Legs:
        """Those of some itineraries, by their numbers or a slice."""
        return Legs(self.current_A[:, which], self.duration_s[:, which], self.ends)


def alike(legs: Legs, figures: Mapping[str, Any], rest_first: bool) -> list[Integers | slice]:
    """Routes in groups that the same limits of the wells tell all about.

    So no answer depends on the itineraries that are worked on together. Parameters as for
    `hover_rows`, with one order of the stays for all.
    """
    count = legs.duration_s.shape[1]
    stays_A = np.array(
        [np.broadcast_to(each, count) for each in _stays_A(legs, figures, rest_first).values()]
    )
    currents_A = np.concatenate([legs.current_A, stays_A])
    told = np.concatenate([_falling(figures, currents_A), stays_A < 0.0, stays_A > 0.0])
    if (told == told[:, :1]).all():
        return [slice(None)]
    _, group = np.unique(told, axis=1, return_inverse=True)
    return [np.flatnonzero(group == number) for number in range(group.max() + 1)]


def hover_rows(
    legs: Legs, figures: Mapping[str, Any], rest_first: bool | Booleans
) -> tuple[Rows, Floats]:
    """What Δ and T', the x and y of the rows, have to satisfy, and the time left for them [s].

    Parameters
    ----------
    legs
        One more than stays, of which there are one or two.
    figures
        What `longest_hovers` takes, by name: numbers, or arrays with one entry an itinerary.
    rest_first
        Whether the rest comes before the hover, where there are both.
    """
    stays_A = _stays_A(legs, figures, rest_first)
    steps, telling = _steps(legs, stays_A, figures)
    unused: dict[str, Any] = dict.fromkeys(UNUSED, np.nan)
    given = Quantities(
        packs=1.0,
        flight_time_s=_sum(legs.duration_s),
        flight_charge_As=-_sum(legs.current_A * legs.duration_s),
        rests=legs.rests,
        steps=steps,
        **unused,
        **{
            **figures,
            "hover_current_A": -stays_A["hover"],
            "rest_current_A": stays_A.get("rest", figures["rest_current_A"]),
        },
    )
    hover, rest = unknown("hover"), unknown("rest") if legs.rests else None
    soc = PERSPECTIVES[AVAILABLE](given, hover, 0.0 if rest is None else rest)
    left_s = given.time_left
    forms = [left_s - (hover if rest is None else hover + rest), soc - given.min_soc]
    sizes = [left_s, 1.0]
    for each in well_limits(given, hover, rest, telling):
        limit = each.relation
        margin = limit.left - limit.right if limit.sense == ">=" else limit.right - limit.left
        forms.append(margin if isinstance(margin, Exponential) else Exponential({CONSTANT: margin}))
        sizes.append(1.0)
    reach_s = np.maximum(left_s, 0.0)
    rows = rows_of(forms, sizes, "hover", "rest" if legs.rests else None, len(reach_s), reach_s)
    return rows.mirrored(~np.asarray(rest_first)) if legs.rests else rows, reach_s


def _sum(stages: Floats) -> Floats:
    """Over the stages (stage, itinerary), one by one however many itineraries there are."""
    return sum(stages, np.zeros(stages.shape[1]))


def _stays_A(legs: Legs, figures: Mapping[str, Any], rest_first: bool | Booleans) -> dict[str, Any]:
    """A stay is to the wells a current [A] for a time: the one before the last is the rest here."""
    hover_A, rest_A = -figures["hover_current_A"], figures["rest_current_A"]
    if not legs.rests:
        return {"hover": hover_A}
    return {
        "rest": _either(rest_first, rest_A, hover_A),
        "hover": _either(rest_first, hover_A, rest_A),
    }


def _falling(figures: Mapping[str, Any], current_A: Any) -> Any:
    """Whether y1 falls all along a step of this current [A]."""
    return kibam.falls_throughout(_whole(figures), current_A)


def _whole(figures: Mapping[str, Any]) -> kibam.Battery:
    """All packs as one."""
    return kibam.Battery(
        figures["capacity_As"], figures["available_fraction"], figures["flow_rate_per_s"]
    )


def _either(which: bool | Booleans, one: Any, other: Any) -> Any:
    if isinstance(which, bool):
        return one if which else other
    return np.where(which, one, other)


def _steps(
    legs: Legs, stays_A: Mapping[str, Any], figures: Mapping[str, Any]
) -> tuple[tuple[Any, ...], list[Telling]]:
    """What happens on the way, and which limits of the wells the others do not imply.

    Where y1 falls all along what comes next, the end of that tells more: so phases of a leg are
    taken together, and before them there is no need to look. Who only drains does not pass full,
    who only charges does not run dry.
    """
    whole = _whole(figures)
    falling = _falling(figures, legs.current_A).all(axis=1).tolist()
    steps: list[Any] = []
    falls: list[bool] = []
    for (start, end), stay in zip_longest(pairwise(legs.ends), stays_A):
        starts = [k for k in range(start, end) if k == start or not falling[k]]
        for first, last in pairwise([*starts, end]):
            run = kibam.Stage(legs.current_A[first:last], legs.duration_s[first:last])
            steps.append(kibam.compose(whole, run))
            falls.append(falling[first])
        if stay:
            steps.append(stay)
            falls.append(bool(np.all(_falling(figures, stays_A[stay]))))
    telling = []
    for step, next_falls in zip(steps, [*falls[1:], False], strict=True):
        stay_A = stays_A[step] if isinstance(step, str) else None
        drains = stay_A is None or bool(np.any(stay_A < 0.0))
        charges = stay_A is not None and bool(np.any(stay_A > 0.0))
        telling.append((drains and not next_falls, charges))
    return tuple(steps), telling


def delivered(given: Quantities, count: int) -> Mapping[str, Floats]:
    """Δ and T' [s] by name, NaN where none are, under the perspective `available`.

    Parameters
    ----------
    given
        Quantities of itineraries that all stay in one order, with their steps.
    count
        How many there are.
    """
    if given.tapers:
        from optuav.engines import bracket

        return bracket.solve(P1().model(given, AVAILABLE), count).values
    found = longest_hovers(**arguments(given))
    return {"hover_time_s": found.hover_time_s, "rest_time_s": found.rest_time_s}


def arguments(given: Quantities) -> dict[str, Any]:
    """What `longest_hovers` takes, by name: legs between the stays, their order, and figures."""
    legs: list[list[Any]] = [[]]
    stays: list[str] = []
    for step in given.steps:
        if isinstance(step, str):
            stays.append(step)
            legs.append([])
        else:
            legs[-1].append(step)
    (order,) = (name for name in get_args(Stays) if STAYS[name] == tuple(stays))
    return {
        "legs": legs,
        "stays": order,
        "deadline_s": given.deadline_s,
        "min_soc": given.min_soc,
        "capacity_As": given.battery_As,
        "available_fraction": given.available_fraction,
        "flow_rate_per_s": given.flow_rate_per_s,
        "hover_current_A": given.hover_current_A,
        "rest_current_A": given.rest_current_A,
    }
