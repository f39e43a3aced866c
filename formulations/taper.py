"""Charging that tapers: a stay's current is constant until the available well is full.

The constant part of a stay of d seconds is the longest s ≤ d with y1(s) ≤ ωB; then y1 is held. An
engine that takes s as an unknown, and any s that keeps y1(s) ≤ ωB and does not charge faster than
the laser afterwards, (d − s)(I − I_held) ≥ 0, finds the same optimum: such a course charges at
currents up to I with y1 ≤ ωB, so the longest s leaves no less in either well
(`optuav.physics.charging`), and nothing that is asked of the wells later is harder with more.

*What falls and what rises.* y1 and y1 + y2 after any step fall with Δ and rise with T' where

- hovering drains, I_hv ≥ 0, resting does not, I_rest ≥ 0, and k_F Q_fl ≤ ω I_hv. Until the rest all
  draws, so the tilt z = y1 − ω(y1 + y2) is never positive: while one rests y1 and y never fall, as
  dy1/dt = I_rest − k'z. On legs z loses at most (1−ω) Q_fl, and while one hovers −k'z stays below
  the larger of k_F Q_fl/ω and (1−ω) I_hv, so y1 falls as well as y. Legs and a hover that drains
  keep the order of (y1, y); so after a rest that is longer all is as large. A hover that is longer
  leaves less in both wells (y2 falls as z ≤ 0), which a rest that tapers keeps, or less of y1 and y
  behind the rest, which the legs keep.

*What is never exceeded.* While Δ and T' are within ranges, no well holds more after a step than it
would if both had held as much as they can before it: the order of (y1, y2) is kept throughout.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from formulations.pool import pool
from formulations.quantities import Quantities
from optuav.modelling import Expression, Let, Relation
from optuav.modelling.expression import Call, Range, Trend, Variable
from optuav.modelling.longest import LongestPart
from optuav.physics import charging
from optuav.physics.kibam import Battery, Stage, Transition, Wells, along, step, transition


def tapered(whole: Battery, level: Wells, phase: Stage, stay: str) -> Wells:
    """Wells after a stay, in numbers or symbols."""
    current_A, time = phase
    if not isinstance(time, Expression):
        return charging.tapered(whole, level, phase)
    battery = whole.capacity_As, whole.available_fraction, whole.flow_rate_per_s
    steady = _steady_part(stay).of(time, current_A, *level, *battery)
    y1, y2 = step(whole, level, Stage(current_A, steady))
    turned = Wells(
        Let(f"available when the {stay} tapers", f"y1_{stay}", "A s", y1),
        Let(f"bound when the {stay} tapers", f"y2_{stay}", "A s", y2),
    )
    return charging.held(whole, turned, time - steady)


def _steady_part(stay: str) -> LongestPart:
    """The part of a stay at constant current."""

    def value(time: Any, current: Any, y1: Any, y2: Any, *battery: Any) -> Any:
        return charging.steady_time(Battery(*battery), Wells(y1, y2), Stage(current, time))

    def limits(share: Any, time: Any, current: Any, y1: Any, y2: Any, *battery: Any) -> Any:
        whole = Battery(*battery)
        end = step(whole, Wells(y1, y2), Stage(current, share * time))
        level = end.available_As / whole.capacity_As
        yield f"not past full in the {stay}", Relation(level, "<=", whole.available_fraction)
        spare = current - charging.holding_current(whole, end)
        yield (
            f"no faster than the laser in the {stay}",
            Relation((1.0 - share) * spare + _drains(current), ">=", 0.0),
        )

    return LongestPart(
        f"steady part of the {stay}",
        f"s_{stay}",
        f"steady_{stay}_share",
        f"time until y1 = ωB in the {stay}",
        value,
        limits,
        lambda time, current, *others: _drains(current),
    )


def _drains(current: Any) -> Any:
    """1 where a net current does not charge, and 0 where it does."""
    return np.heaviside(-current, 1.0)


def trends(given: Quantities, hover: Any, rest: Any) -> tuple[Trend, ...]:
    """How y1 and y1 + y2 after any step go with Δ and T', and where that is certain."""
    if not isinstance(hover, Variable):
        return ()
    drawn_A = given.hover_current_A
    drains = (
        Relation(drawn_A, ">=", 0.0),
        Relation(
            given.flow_rate_per_s * given.flight_charge_As,
            "<=",
            given.available_fraction * drawn_A,
        ),
    )
    if isinstance(rest, Variable):
        charges = Relation(given.rest_current_A, ">=", 0.0)
        return (Trend((hover.name,), (rest.name,), (*drains, charges)),)
    return (Trend((hover.name,), (), drains),)


def highest(given: Quantities, hover: Any, rest: Any) -> Iterator[Wells]:
    """What both wells hold at most after every step, in the ranges of Δ and T'.

    Nothing where charging does not taper, and for times that are numbers.
    """
    if not given.tapers or not isinstance(hover, Variable):
        return
    whole = pool(given)
    battery = whole.capacity_As, whole.available_fraction, whole.flow_rate_per_s
    stays = {"hover": (-given.hover_current_A, *Range.of(hover))}
    if isinstance(rest, Variable):
        stays["rest"] = (given.rest_current_A, *Range.of(rest))
    level: Any = whole.full
    for each in given.steps:
        if isinstance(each, str):
            wells = level.available_As, level.bound_As
            operands = (*wells, *stays[each], *battery)
            level = Wells(*(Call(well, operands) for well in (most_available, most_bound)))
        else:
            part = each if isinstance(each, Transition) else transition(whole, each)
            level = along(whole, level, part)
        yield level


def most_available(y1: Any, y2: Any, current: Any, least: Any, most: Any, *battery: Any) -> Any:
    """y1 at most after a stay from a least to a most time, in numbers."""
    return _most_after(y1, y2, current, least, most, *battery).available_As


def most_bound(y1: Any, y2: Any, current: Any, least: Any, most: Any, *battery: Any) -> Any:
    """y2 at most after a stay from a least to a most time, in numbers."""
    return _most_after(y1, y2, current, least, most, *battery).bound_As


def _most_after(y1: Any, y2: Any, current: Any, least: Any, most: Any, *battery: Any) -> Wells:
    return charging.most_tapered(Battery(*battery), Wells(y1, y2), current, least, most)
