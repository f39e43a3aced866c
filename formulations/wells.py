"""The two wells of the battery along an itinerary, by [1] eqs (11)-(16), and their limits.

y1 ≥ 0 and y1 ≤ ωB hold at every moment if they hold at the end of every stage of constant current:
while a stage discharges, y1 is least at one of its ends and stays below ωB; while it charges, y1
stays above 0 and is largest at an end. Legs never charge. Where charging tapers, y1 never passes
ωB.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import zip_longest
from typing import Any, NamedTuple

from formulations.parameters import Quantities
from optuav.modelling import Expression, Let, Relation
from optuav.modelling.expression import Bounded, Call, Indexed, Operand
from optuav.physics import charging, kibam
from optuav.physics.kibam import Battery, Stage, Wells

LABELS = {"dry": "not dry", "past full": "not past full"}
"""What the limits of the available well are called, by kind."""


def state_of_charge_of_wells(given: Quantities, hover: Operand, rest: Operand) -> Operand:
    """(y1 + y2)/B after all steps of the itinerary, from a full battery."""
    *_, (_, last) = levels(given, hover, rest)
    return kibam.state_of_charge(pool(given), last)


def levels(given: Quantities, hover: Operand, rest: Operand) -> Sequence[tuple[Operand, Wells]]:
    """Every step of the itinerary with the wells after it, from a full battery.

    The same times give the same trees, so that several constraints share them.
    """
    known = given.known_levels
    if not any(h is hover and r is rest for h, r, _ in known):
        known.append((hover, rest, list(_levels(given, hover, rest))))
    return next(steps for h, r, steps in known if h is hover and r is rest)


def _levels(given: Quantities, hover: Operand, rest: Operand) -> Iterator[tuple[Operand, Wells]]:
    whole = pool(given)
    stays = {
        "hover": Stage(-given.hover_current_A, hover),
        "rest": Stage(given.rest_current_A, rest),
    }
    level: Operand = whole.full
    for number, step in enumerate(given.steps, start=1):
        stage = stays[step] if isinstance(step, str) else step
        words = ""
        if isinstance(step, str) and given.tapers:
            level = _tapered(whole, level, stage, step)
            words = f"after the {step}, whose current tapers once y1 = ωB"
        elif isinstance(stage, kibam.Transition):
            level = kibam.along(whole, level, stage)
        else:
            level = kibam.along(whole, level, kibam.transition(whole, stage))
            words = "" if isinstance(step, str) else "by eqs (15)-(16), a stage of flight"
        level = _named(level, number, words)
        yield step, level


def _named(level: Wells, number: int, words: str) -> Wells:
    """Names for the wells after a step, else each step would multiply the printed problem.

    The words, unless empty, are printed instead of the expression that a name stands for.
    """
    if not isinstance(level.total_As, Expression):
        return level
    y1, y2 = (Indexed(symbol, number) for symbol in ("y1", "y2"))
    return Wells(
        Let(f"available after step {number}", y1, "A s", level.available_As, words),
        Let(f"bound after step {number}", y2, "A s", level.bound_As, words),
    )


@dataclass(frozen=True)
class _Pool(Battery):
    """All packs as one battery, the rate at which its wells level out known by a name."""

    @cached_property
    def rate_per_s(self) -> Operand:
        """k' [1/s]; a number stays one."""
        rate = super().rate_per_s
        return Let("levelling rate", "k'", "1/s", rate) if isinstance(rate, Expression) else rate


def pool(given: Quantities) -> Battery:
    """All packs of an itinerary as one battery."""
    return _Pool(given.battery_As, given.available_fraction, given.flow_rate_per_s)


def _tapered(whole: Battery, level: Wells, stage: Stage, stay: str) -> Wells:
    """Wells after a stay in which charging tapers, in numbers or symbols.

    At constant current throughout, neither well would hold less (`optuav.physics.charging`), and
    both would hold the same if y1 stayed below ωB. That, and what they hold when full, bounds what
    a stay leaves in a form that engines take.
    """
    if not isinstance(stage.duration_s, Expression):
        return charging.tapered(whole, level, stage)
    constant, full = kibam.step(whole, level, stage), whole.full
    battery = whole.capacity_As, whole.available_fraction, whole.flow_rate_per_s
    operands = constant.available_As, full.available_As, *level, *stage, *battery
    words = f"the {stay} that tapers"
    available, bound = (
        Call(Bounded(words, value), (well, most, *operands))
        for value, well, most in zip((_tapered_y1, _tapered_y2), constant, full, strict=True)
    )
    return Wells(available, bound)


def _tapered_wells(
    y1: Operand, y2: Operand, current: Operand, time: Operand, *battery: Operand
) -> Wells:
    return charging.tapered(Battery(*battery), Wells(y1, y2), Stage(current, time))


def _tapered_y1(*operands: Operand) -> Operand:
    return _tapered_wells(*operands).available_As


def _tapered_y2(*operands: Operand) -> Operand:
    return _tapered_wells(*operands).bound_As


class StepEnd(NamedTuple):
    """The end of a step of an itinerary.

    Parameters
    ----------
    flight
        Number of the flight, from 1; of the one before where the step is a stay.
    stage
        Number of the stage in its flight, from 1; 0 for a stay.
    stay
        ``"hover"`` or ``"rest"``; empty for a stage of flight.
    lands
        Whether a flight ends.
    """

    flight: int
    stage: int
    stay: str
    lands: bool

    def __str__(self) -> str:
        if self.stay:
            return f"after the {self.stay}"
        return f"after stage {self.stage} of flight {self.flight}"


class WellLimit(NamedTuple):
    """A limit of the available well at the end of a step, see `Constraint` for its fields."""

    kind: str
    step: int
    moment: StepEnd
    relation: Relation


def well_limits(given: Quantities, hover: Operand, rest: Operand) -> Iterator[WellLimit]:
    """Limits that keep y1/B within 0 and ω, in order.

    Parameters
    ----------
    given
        Quantities of the itinerary, with its steps.
    hover, rest
        Δ and T' [s].
    """
    ends = zip(moments(given.steps), levels(given, hover, rest), strict=True)
    for number, (moment, (step, level)) in enumerate(ends):
        share = level.available_As / given.battery_As
        yield WellLimit("dry", number, moment, Relation(share, ">=", 0.0))
        if isinstance(step, str) and not given.tapers:
            below = Relation(share, "<=", given.available_fraction)
            yield WellLimit("past full", number, moment, below)


def moments(steps: Sequence[Any]) -> Iterator[StepEnd]:
    """The end of every step; flights and the stages of each are counted from 1."""
    flight, stage = 1, 0
    for step, following in zip_longest(steps, steps[1:], fillvalue=""):
        if isinstance(step, str):
            yield StepEnd(flight, 0, step, lands=False)
            flight, stage = flight + 1, 0
        else:
            stage += 1
            yield StepEnd(flight, stage, "", lands=isinstance(following, str))
