"""The longest hover of many itineraries at once, from arrays, under the perspective `available`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, Literal, NamedTuple, TypeAlias

import numpy as np

from formulations.available import well_limits
from formulations.perspectives import AVAILABLE, PERSPECTIVES
from formulations.pool import pool
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
    figures = {name: np.asarray(value, dtype=float) for name, value in given.items()}
    flown = [
        [battery.Phase(*(np.asarray(each, dtype=float) for each in phase)) for phase in leg]
        for leg in legs
    ]
    shape = _shape(flown, stays, figures)
    count = int(np.prod(shape, dtype=int))
    found = np.empty((3, count))
    for first in range(0, count, AT_ONCE):
        here = slice(first, min(first + AT_ONCE, count))
        cut = {name: _cut(each, here) for name, each in figures.items()}
        parts = [[battery.Phase(*(_cut(v, here) for v in phase)) for phase in leg] for leg in flown]
        found[:, here] = _bracket(parts, STAYS[stays], cut, here.stop - first, shortest_rest)
    return Hovers(*found.reshape(3, *shape))


def _cut(figure: Floats, here: slice) -> Any:
    return figure.ravel()[here] if figure.ndim else float(figure)


def _shape(legs: Sequence[Leg], stays: str, figures: Mapping[str, Floats]) -> tuple[int, ...]:
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
            every[f"legs: current of stage {stage} of leg {number}"] = np.asarray(phase.current_A)
            every[f"legs: duration of stage {stage} of leg {number}"] = np.asarray(phase.duration_s)
    shapes = dict.fromkeys(each.shape for each in every.values() if each.ndim)
    if len(shapes) > 1:
        faults.append(Fault("shapes", ", ".join(map(str, shapes)), "one shape for all arrays"))
    faults += [
        Fault(name, "NaN", "a number") for name, each in every.items() if np.isnan(each).any()
    ]
    if faults:
        raise InputError(faults)
    return next(iter(shapes), ())


def _bracket(
    legs: Sequence[Leg],
    stays: Sequence[str],
    figures: Mapping[str, Any],
    count: int,
    shortest_rest: bool,
) -> Floats:
    phases = [phase for leg in legs for phase in leg]
    flight_s = sum(phase.duration_s for phase in phases)
    charge_As = -sum(phase.current_A * phase.duration_s for phase in phases)
    unused: dict[str, Any] = dict.fromkeys(UNUSED, np.nan)
    given = Quantities(
        packs=1.0,
        flight_time_s=flight_s,
        flight_charge_As=charge_As,
        rests="rest" in stays,
        **figures,
        **unused,
    )
    given = _with_steps(given, legs, stays)
    hover, rest = unknown("hover"), unknown("rest") if given.rests else None
    forms, sizes = [], []
    stayed = hover if rest is None else hover + rest
    forms.append(given.time_left - stayed)
    sizes.append(given.time_left)
    forms.append(
        PERSPECTIVES[AVAILABLE](given, hover, 0.0 if rest is None else rest) - given.min_soc
    )
    sizes.append(1.0)
    for _, limit in well_limits(given, hover, rest):
        margin = limit.left - limit.right if limit.sense == ">=" else limit.right - limit.left
        forms.append(margin if isinstance(margin, Exponential) else Exponential({CONSTANT: margin}))
        sizes.append(1.0)
    x_top = np.broadcast_to(np.maximum(given.time_left, 0.0), count).astype(float)
    rows = rows_of(forms, sizes, "hover", "rest" if given.rests else None, count, x_top)
    y_top = x_top if given.rests else np.zeros(count)
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


def _with_steps(given: Quantities, legs: Sequence[Leg], stays: Sequence[str]) -> Quantities:
    """Legs as stretches at whose ends alone the available well has to be looked at."""
    whole = pool(given)
    steps: list[Any] = []
    for leg, stay in zip(legs, (*stays, None), strict=True):
        steps += [battery.compose(whole, run) for run in _falling_runs(whole, leg)]
        steps += [stay] if stay else []
    return replace(given, steps=tuple(steps))


def _falling_runs(whole: battery.Battery, leg: Leg) -> Iterator[list[battery.Phase]]:
    """The leg cut where y1 may rise again, so that within a run it is least at the end."""
    run: list[battery.Phase] = []
    for phase in leg:
        if run and not np.all(battery.falls_throughout(whole, phase.current_A)):
            yield run
            run = []
        run.append(phase)
    if run:
        yield run
