"""The longest hover of many routes at once, from arrays, under the perspective `available`."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import fields
from typing import Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from formulations.parameters import QUANTITIES, Hover, Landing, Quantities
from formulations.soc import AVAILABLE, PERSPECTIVES, WellLimit, soc_on_landing, well_limits
from optuav.arrays import Booleans, Floats, plain
from optuav.engines.bracket import bracket_largest, rows_and_tops, shortest
from optuav.engines.rows import Rows, StatedForm
from optuav.errors import Fault, refuse, shown
from optuav.fields import Range
from optuav.mission.messages import unlisted
from optuav.mission.validation import WHOLE_SHARE
from optuav.modelling.forms import CONSTANT, Exponential
from optuav.options import KEEP_SOC, KeepSoc
from optuav.physics.kibam import Battery, Stage, falls_throughout
from optuav.physics.quantity import Quantity
from optuav.presentation.numbers import typed
from optuav.solving.assemble import subset
from optuav.status import SAME_S

ITINERARIES_AT_ONCE = 1 << 13
"""Itineraries solved together: few enough to stay in the cache, and in bounded memory."""
CURRENT, DURATION = Range("A", ge=-1e6, le=1e6), Range("s", ge=0, le=1e7)
SHARE = Range("-", gt=0, le=1)
FLYING = Range("A", ge=-1e6, le=0, note="; in flight nothing charges")
RANGES = {
    "deadline_s": DURATION,
    "min_soc": Range("-", ge=0, le=1),
    "capacity_As": Range("A s", ge=1e-3, le=1e12),
    "available_fraction": Range("-", ge=1e-6, le=0.999999),
    "flow_rate_per_s": Range("1/s", ge=0, le=1e3),
    "hover_current_A": CURRENT,
    "rest_current_A": CURRENT,
}
"""Beyond these bounds, which also hold for missions, rounding may void the proofs."""


class Hovers(NamedTuple):
    """Longest hovers, arrays with one entry per route.

    Parameters
    ----------
    hover_time_s, rest_time_s
        Δ [s], NaN if no hover is possible, and a T' [s] that allows it, the shortest if that
        was asked for.
    beyond_s
        No hover is longer [s]; −inf where it is proved that none is possible.

    Examples
    --------
    >>> import numpy as np
    >>> from optuav.solving.longest import Hovers
    >>> Hovers(np.array([577.5]), np.array([0.0]), np.array([580.0])).proved.tolist()
    [False]
    """

    hover_time_s: Floats
    rest_time_s: Floats
    beyond_s: Floats

    @property
    def proved(self) -> Booleans:
        """Routes whose hover is the longest to within 1e-6 s, or proved impossible."""
        close = self.beyond_s - self.hover_time_s <= SAME_S
        return np.asarray(close | np.isneginf(self.beyond_s))


def longest_hovers(
    steps: Sequence[Stage | Literal["hover", "rest"] | tuple[Literal["hover"], float]],
    *,
    battery: Battery,
    deadline_s: npt.ArrayLike,
    min_soc: npt.ArrayLike,
    hover_current_A: npt.ArrayLike,
    rest_current_A: npt.ArrayLike = 0.0,
    shortest_rest: bool = False,
    keep_soc: KeepSoc = "end",
) -> Hovers:
    """Longest hovers that the battery can deliver, each with its proof (engine bracket).

    From a full kinetic battery [1]_, 0 ≤ y1 ≤ ωB at every moment, η = (y1 + y2)/B ≥ η0 at the end
    ([2]_ eqs (15), (16) and (19)), all within the deadline; charging is at constant current. Every
    figure is a number, or an array of one shape for all routes. To the last bit, no answer depends
    on the other routes of the call.

    Parameters
    ----------
    steps
        What happens on the way, in order: an `optuav.physics.kibam.Stage` for each stage of flight
        (current [A], −1e6 to 0, as in flight nothing charges, and duration [s], 0 to 1e7),
        ``"hover"`` once, and ``"rest"`` at most once. Several hovers, as over several devices, are
        ``("hover", share)`` with shares of Δ, each > 0, that add up to 1.
    battery
        All packs together, an `optuav.physics.kibam.Battery` with B [A s], 1e-3 to 1e12, ω [-],
        1e-6 to 0.999999, and k_F [1/s], 0 to 1e3.
    deadline_s, min_soc
        T_max [s], 0 to 1e7, and η0 [-], 0 to 1.
    hover_current_A, rest_current_A
        Net current that hovering draws, and net current that charges during a rest [A], up to 1e6
        either way.
    shortest_rest
        Whether to find the shortest T' for each Δ, which takes about 1.5 times as long.
    keep_soc
        When η0 must be left: ``"end"``, or ``"always"`` for the end of every flight.

    Returns
    -------
    Hovers
        Arrays of the shape of the figures; see `optuav.solving.longest.Hovers`.

    Raises
    ------
    InputError
        With every fault: steps of another form, shapes that differ, and figures that are not
        numbers or out of range.

    References
    ----------
    .. [1] J. F. Manwell, J. G. McGowan, "Lead acid battery storage model for hybrid energy
       systems", Solar Energy, 1993.
    .. [2] W. Jaafar, H. Yanikomeroglu, "Dynamics of laser-charged UAVs: a battery perspective",
       IEEE Internet of Things Journal, 2021. That 0 ≤ y1 ≤ ωB must hold is not in it.

    Examples
    --------
    >>> import numpy as np
    >>> import optuav
    >>> from optuav.physics.kibam import Battery, Stage
    >>> flight, two = Stage(-90.0, 60.0), Battery(np.array([60_000.0, 72_000.0]), 0.8, 4.5e-5)
    >>> limits = {"deadline_s": 1200.0, "min_soc": 0.05}
    >>> hovers = optuav.longest_hovers(
    ...     [flight, "hover", flight], battery=two, hover_current_A=88.0, **limits
    ... )
    >>> hovers.hover_time_s.round(2).tolist(), hovers.proved.tolist()
    ([430.88, 543.51], [True, True])
    """
    faults, shapes = list[Fault](), dict[tuple[int, ...], str]()

    def read(name: str, value: npt.ArrayLike, allowed: Range) -> Any:
        """Return the figure as an array; append its faults to `faults`."""
        try:
            figure = plain(value).astype(float)
        except (TypeError, ValueError):
            faults.append(Fault(name, shown(value)[:40], "a number, or an array of numbers"))
            return np.nan
        ends = (float(figure.min()), float(figure.max())) if figure.size else ()
        if not all(map(allowed.accepts, ends)):
            first = next(
                number for number in figure.ravel().tolist() if not allowed.accepts(number)
            )
            faults.append(Fault(name, typed(first), allowed.words))
        if not figure.ndim:
            return float(figure)
        shapes.setdefault(figure.shape, name)
        return figure.ravel()

    on_the_way, shares = list[Stage | str](), list[float]()
    for number, step in enumerate(steps, start=1):
        if isinstance(step, Stage):
            current_A = read(f"steps: current of step {number}", step.current_A, FLYING)
            duration_s = read(f"steps: duration of step {number}", step.duration_s, DURATION)
            on_the_way.append(Stage(current_A, duration_s))
        elif isinstance(step, tuple) and len(step) == 2 and step[0] == "hover":
            shares.append(read(f"steps: share of step {number}", step[1], SHARE))
            on_the_way.append("hover")
        else:
            on_the_way.append(step if isinstance(step, str) else shown(step))
    stays = [step for step in on_the_way if not isinstance(step, Stage)]
    rests, hovers_s = stays.count("rest"), stays.count("hover")
    whole = abs(sum(shares) - 1.0) <= WHOLE_SHARE if shares else hovers_s == 1
    alike = len(shares) in (0, hovers_s) and rests <= 1
    if not (whole and alike and rests + hovers_s == len(stays)):
        words = 'stages of flight, one "hover" and at most one "rest"'
        words += '; or shares of the hover, as ("hover", 0.5), that add up to 1'
        faults.append(Fault("steps", shown(stays)[:40], words))
    figures_given = {"hover_current_A": hover_current_A, "rest_current_A": rest_current_A}
    of_battery = {field.name: getattr(battery, field.name) for field in fields(Battery)}
    figures_given |= {"deadline_s": deadline_s, "min_soc": min_soc, **of_battery}
    figures = {name: read(name, value, RANGES[name]) for name, value in figures_given.items()}
    if len(shapes) > 1:
        words = ", ".join(f"{shape} of {name}" for shape, name in shapes.items())
        faults.append(Fault("shapes", words, "one shape for all arrays"))
    faults += unlisted(("keep_soc", keep_soc, KEEP_SOC))
    refuse(faults)
    flown = [step for step in on_the_way if isinstance(step, Stage)]
    figures |= {
        "packs": 1.0,
        "flight_time_s": sum((stage.duration_s for stage in flown), 0.0),
        "flight_charge_As": -sum((stage.current_A * stage.duration_s for stage in flown), 0.0),
    }
    figures = {q.name: None if q.default is None else np.nan for q in QUANTITIES} | figures
    landings = tuple(_landings(on_the_way)) if keep_soc == "always" else ()
    drawn_A = figures["hover_current_A"]
    values = Quantities(
        **figures,
        rests="rest" in stays,
        steps=tuple(on_the_way),
        landings=landings,
        hovers=tuple(Hover(share, drawn_A, math.nan) for share in shares),
    )
    shape = next(iter(shapes), ())
    hovers = longest(values, math.prod(shape), shortest_rest=shortest_rest)
    return Hovers(*(times_s.reshape(shape) for times_s in hovers))


def _landings(steps: Sequence[Stage | str]) -> Iterator[Landing]:
    """The ends of all flights but the last."""
    charge_As, stays = 0.0, tuple[str, ...]()
    for number, step in enumerate(steps):
        if isinstance(step, Stage):
            charge_As = charge_As - step.current_A * step.duration_s
            continue
        yield Landing(charge_As, math.nan, stays, number - 1)
        stays = (*stays, step)


def longest(
    given: Quantities, count: int, *, shortest_rest: bool = False, least_s: Quantity = 0.0
) -> Hovers:
    """Longest hovers of itineraries that stay in one order, at constant current.

    Those that can be shown without much ado to be shorter than the least of interest are left out.
    """
    if count > ITINERARIES_AT_ONCE:
        pieces, least_of_all_s = [], np.broadcast_to(least_s, count)
        for batch in np.split(
            np.arange(count), range(ITINERARIES_AT_ONCE, count, ITINERARIES_AT_ONCE)
        ):
            values, least_s = subset(given, slice(batch[0], batch[-1] + 1)), least_of_all_s[batch]
            pieces.append(longest(values, len(batch), shortest_rest=shortest_rest, least_s=least_s))
        return Hovers(*map(np.concatenate, zip(*pieces, strict=True)))
    rows, x_top, y_top = _rows(given, count)
    x, y, beyond = bracketed = bracket_largest(rows, x_top, y_top, least=least_s)
    return Hovers(x, shortest(rows, bracketed, y_top) if shortest_rest else y, beyond)


def shortest_rests(given: Quantities, count: int, hover_s: float) -> Floats:
    """The shortest T' of itineraries for a hover time [s], NaN where there is none."""
    rests_s = np.full(count, np.nan)
    for batch in np.split(np.arange(count), range(ITINERARIES_AT_ONCE, count, ITINERARIES_AT_ONCE)):
        part = given if len(batch) == count else subset(given, slice(batch[0], batch[-1] + 1))
        rows, x_top, y_top = _rows(part, len(batch))
        hovers_s = np.full(len(batch), hover_s)
        found_s = rows.at_x(hovers_s).end(y_top, smallest=True)
        rests_s[batch] = np.where(hovers_s <= x_top, found_s, np.nan)
    return rests_s


def _rows(given: Quantities, count: int) -> tuple[Rows, Floats, Floats]:
    """The rows of all limits of itineraries, and how far both times can go [s]."""
    # The limits of (P1) go to the physics as forms rather than being declared as a model,
    # which takes four times as long for a few itineraries.
    names = ("hover", "rest") if given.rests else ("hover",)
    times = [Exponential({frozenset({(name, "time")}): 1.0}) for name in names]
    hover, rest = times if given.rests else (*times, None)
    soc = PERSPECTIVES[AVAILABLE](given, hover, 0.0 if rest is None else rest)
    # Forms that must be ≥ 0, with the size of the right side in a model.
    limits = [(soc - given.min_soc, given.min_soc)]
    for landing in given.landings:
        soc = soc_on_landing(given, AVAILABLE, landing, hover, 0.0 if rest is None else rest)
        limits.append((soc - given.min_soc, given.min_soc))
    for limit in well_limits(given, hover, rest):
        # Infinite where it is not needed, so that no answer depends on the others.
        if np.any(needed := _needed(given, limit)):
            left, right = limit.relation.sides
            margin = left - right if limit.kind == "dry" else right - left
            margin = margin if np.all(needed) else margin + np.where(needed, 0.0, np.inf)
            limits.append((margin, right))
    left_s = given.time_left
    limits.append((left_s - (hover if rest is None else hover + rest), np.abs(left_s)))
    sized = [
        StatedForm(e if isinstance(e, Exponential) else Exponential({CONSTANT: e}), size)
        for e, size in limits
    ]
    rows, (x_top, y_top), _ = rows_and_tops(sized, names, count)
    return rows, x_top, y_top


def _needed(given: Quantities, limit: WellLimit) -> Booleans:
    """Return where a limit of the available well excludes points that no other limit excludes."""
    # A well that only drains does not pass full, and one that only charges does not run dry; where
    # it falls all along the next step, the limit at its end is tighter.
    stays_A = {"hover": -given.hover_current_A, "rest": given.rest_current_A}
    after = given.steps[limit.step : limit.step + 2]
    own_A, *next_A = (
        stays_A[e] if isinstance(e, str) else getattr(e, "current_A", -np.inf) for e in after
    )
    if limit.kind == "past full":
        return np.asarray(own_A > 0.0)
    needed = np.asarray(own_A <= 0.0)
    pool = Battery(given.battery_As, given.available_fraction, given.flow_rate_per_s)
    return needed & np.logical_not(falls_throughout(pool, next_A[0])) if next_A else needed
