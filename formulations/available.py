"""A battery that can deliver: the available well never empty and never past full.

y1 ≥ 0 and y1 ≤ ωB at every moment hold if they hold at the end of every stretch of constant
current: while one discharges, y1 is least at an end of it and stays below ωB; while one charges,
y1 stays above 0 and is largest at an end. A leg is as many stretches as it has stages, and only
charges in the stays. Where charging tapers, nothing passes full.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import islice, repeat, zip_longest
from typing import Any, NamedTuple, TypeAlias

from formulations.quantities import Quantities
from formulations.wells import levels
from optuav.modelling import Relation

Telling: TypeAlias = tuple[bool, bool]
"""Whether the limits of `LABELS` at the end of a step exclude what no other limit does."""
LABELS = {"dry": "not dry", "past full": "not past full"}
"""What the limits of the available well are called, by kind."""


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


def well_limits(
    given: Quantities, hover: Any, rest: Any, telling: Iterable[Telling] = repeat((True, True))
) -> Iterator[WellLimit]:
    """What keeps y1/B within 0 and ω, in order.

    Parameters
    ----------
    given
        Quantities of the itinerary, with its steps.
    hover, rest
        Δ and T' [s]; the latter None where the itinerary does not rest.
    telling
        Which of them to state, step by step.
    """
    told = islice(telling, len(given.steps))
    ends = zip(moments(given.steps), levels(given, hover, rest), told, strict=True)
    for number, (moment, (step, level), (dry, past_full)) in enumerate(ends):
        if dry or past_full:
            share = level.available_As / given.battery_As
        if dry:
            yield WellLimit("dry", number, moment, Relation(share, ">=", 0.0))
        if past_full and isinstance(step, str) and not given.tapers:
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
