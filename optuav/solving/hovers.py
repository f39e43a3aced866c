"""The longest hover of many itineraries at once, from arrays, under the perspective `available`."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import accumulate, chain, pairwise, zip_longest
from typing import Any, Literal, NamedTuple, TypeAlias

import numpy as np

from formulations.available import Telling, well_limits
from formulations.perspectives import AVAILABLE, PERSPECTIVES
from formulations.quantities import Quantities
from optuav.engines.arrays import Booleans, Floats
from optuav.engines.bracketing import largest, shortest
from optuav.engines.exponential_form import rows_of
from optuav.engines.sweeping import WIDTH_S
from optuav.errors import Fault, InputError
from optuav.modelling.exponential import CONSTANT, Exponential, unknown
from optuav.physics import battery

Leg: TypeAlias = Sequence[battery.Phase]
Stays: TypeAlias = Literal["hover", "rest-first", "hover-first"]
STAYS: Mapping[str, tuple[str, ...]] = {
    "hover": ("hover",),
    "rest-first": ("rest", "hover"),
    "hover-first": ("hover", "rest"),
}
AT_ONCE = 1 << 13
"""Itineraries worked on together: few enough to stay in the cache, and in bounded memory."""


class Hovers(NamedTuple):
    """Longest hovers, arrays with one entry an itinerary.

    Parameters
    ----------
    hover_time_s, rest_time_s
        Δ and T' [s]; NaN where no hover is possible. T' is admissible, the shortest if so asked.
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
    stays: Stays = "hover",
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
        of `optuav.physics.battery.Phase` (current [A], negative while it drains, and duration [s]).
    stays
        ``"hover"``, ``"rest-first"`` or ``"hover-first"``.
    deadline_s, min_soc
        T_max [s] and η0 [-].
    capacity_As, available_fraction, flow_rate_per_s
        B of all packs together [A s], ω [-] and k_F [1/s].
    hover_current_A, rest_current_A
        Net current drawn while hovering, and that charges while resting [A].
    shortest_rest
        Whether to find the shortest T' for each Δ, which takes about half as long again.

    Raises
    ------
    InputError
        If the number of legs does not fit the stays, shapes differ, or a figure is no number.
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
    figures = {name: _figure(value) for name, value in given.items()}
    flown = [[battery.Phase(*map(_figure, phase)) for phase in leg] for leg in legs]
    shape = _shape(flown, stays, figures)
    count = math.prod(shape)
    found = np.empty((3, count))
    for first in range(0, count, AT_ONCE):
        here = slice(first, min(first + AT_ONCE, count))
        cut = {name: _cut(each, here) for name, each in figures.items()}
        found[:, here] = _bracket(_legs(flown, here), STAYS[stays], cut, shortest_rest)
    return Hovers(*found.reshape(3, *shape))


def _figure(value: Any) -> Any:
    """A number, or an array of numbers."""
    array = np.asarray(value, dtype=float)
    return array if array.ndim else float(array)


def _cut(figure: Any, here: slice) -> Any:
    return figure if isinstance(figure, float) else figure.ravel()[here]


class _Legs(NamedTuple):
    """Currents [A] and durations [s] of all stages, one leg after another (stage, itinerary).

    Leg m is made of stages ends[m] to ends[m + 1].
    """

    current_A: Floats
    duration_s: Floats
    ends: Sequence[int]


def _legs(flown: Sequence[Leg], here: slice) -> _Legs:
    """The legs of some of the itineraries."""
    ends = list(accumulate(map(len, flown), initial=0))
    table = np.empty((2, ends[-1], here.stop - here.start))
    for stage, phase in enumerate(chain.from_iterable(flown)):
        for kind, figure in enumerate(phase):
            table[kind, stage] = _cut(figure, here)
    current_A, duration_s = table
    return _Legs(current_A, duration_s, ends)


def _shape(legs: Sequence[Leg], stays: str, figures: Mapping[str, Any]) -> tuple[int, ...]:
    """The one shape of all figures that are arrays; every fault at once."""
    faults = []
    if stays not in STAYS:
        faults.append(Fault("stays", repr(stays), f"one of {', '.join(STAYS)}"))
    elif len(legs) != len(STAYS[stays]) + 1:
        needed = len(STAYS[stays]) + 1
        faults.append(Fault("legs", f"{len(legs)} legs", f"{needed} go with {stays!r}"))
    every = dict(figures)
    for number, leg in enumerate(legs, start=1):
        for stage, phase in enumerate(leg, start=1):
            every[f"legs: current of stage {stage} of leg {number}"] = phase.current_A
            every[f"legs: duration of stage {stage} of leg {number}"] = phase.duration_s
    shapes = dict.fromkeys(each.shape for each in every.values() if not isinstance(each, float))
    if len(shapes) > 1:
        faults.append(Fault("shapes", ", ".join(map(str, shapes)), "one shape for all arrays"))
    faults += [
        Fault(name, "NaN", "a number")
        for name, each in every.items()
        if math.isnan(each if isinstance(each, float) else np.vdot(each, each))
    ]
    if faults:
        raise InputError(faults)
    return next(iter(shapes), ())


def _bracket(
    legs: _Legs, stays: Sequence[str], figures: Mapping[str, Any], shortest_rest: bool
) -> Floats:
    unused: dict[str, Any] = dict.fromkeys(UNUSED, np.nan)
    steps, telling = _steps(legs, stays, figures)
    given = Quantities(
        packs=1.0,
        flight_time_s=legs.duration_s.sum(axis=0),
        flight_charge_As=-(legs.current_A * legs.duration_s).sum(axis=0),
        rests="rest" in stays,
        steps=steps,
        **figures,
        **unused,
    )
    left_s = given.time_left
    hover, rest = unknown("hover"), unknown("rest") if given.rests else None
    stayed = hover if rest is None else hover + rest
    soc = PERSPECTIVES[AVAILABLE](given, hover, 0.0 if rest is None else rest)
    forms, sizes = [left_s - stayed, soc - given.min_soc], [left_s, 1.0]
    for _, limit in well_limits(given, hover, rest, telling):
        margin = limit.left - limit.right if limit.sense == ">=" else limit.right - limit.left
        forms.append(margin if isinstance(margin, Exponential) else Exponential({CONSTANT: margin}))
        sizes.append(1.0)
    x_top = np.maximum(left_s, 0.0)
    rows = rows_of(forms, sizes, "hover", "rest" if given.rests else None, len(x_top), x_top)
    y_top = x_top if given.rests else np.zeros(len(x_top))
    found = largest(rows, x_top, y_top)
    rest_s = shortest(rows, found, y_top) if shortest_rest else found.y
    return np.stack([found.x, rest_s, found.beyond])


UNUSED = (
    "nominal_voltage_V",
    "flight_energy_J",
    "hover_power_W",
    "hover_received_W",
    "rest_received_W",
)
"""Quantities that this perspective does not speak of."""


def _steps(
    legs: _Legs, stays: Sequence[str], figures: Mapping[str, Any]
) -> tuple[tuple[Any, ...], list[Telling]]:
    """What happens on the way, and which limits of the wells the others do not imply.

    Where y1 falls all along what comes next, the end of that tells more: so phases of a leg are
    taken together, and before them there is no need to look. Who only drains does not pass full,
    who only charges does not run dry.
    """
    whole = battery.Battery(
        figures["capacity_As"], figures["available_fraction"], figures["flow_rate_per_s"]
    )
    current_A = {"hover": -figures["hover_current_A"], "rest": figures["rest_current_A"]}
    falling = battery.falls_throughout(whole, legs.current_A).all(axis=1).tolist()
    steps: list[Any] = []
    falls: list[bool] = []
    for (start, end), stay in zip_longest(pairwise(legs.ends), stays):
        starts = [k for k in range(start, end) if k == start or not falling[k]]
        for first, last in pairwise([*starts, end]):
            run = battery.Phase(legs.current_A[first:last], legs.duration_s[first:last])
            steps.append(battery.compose(whole, run))
            falls.append(falling[first])
        if stay:
            steps.append(stay)
            falls.append(bool(np.all(battery.falls_throughout(whole, current_A[stay]))))
    telling = []
    for step, next_falls in zip(steps, [*falls[1:], False], strict=True):
        stay_A = current_A[step] if isinstance(step, str) else None
        drains = stay_A is None or bool(np.any(stay_A < 0.0))
        charges = stay_A is not None and bool(np.any(stay_A > 0.0))
        telling.append((drains and not next_falls, charges))
    return tuple(steps), telling
