"""A battery that can deliver: the available well never empty and never past full.

y1 ≥ 0 and y1 ≤ ωB at every moment hold if they hold at the end of every stretch of constant
current: while one discharges, y1 is least at an end of it and stays below ωB; while one charges,
y1 stays above 0 and is largest at an end. A leg is as many stretches as it has stages, and only
charges in the stays. Where charging tapers, nothing passes full.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import islice, repeat
from typing import Any, TypeAlias

from formulations.quantities import Quantities
from formulations.wells import levels
from optuav.modelling import Relation

Telling: TypeAlias = tuple[bool, bool]
"""Whether "not dry" and "not past full" at the end of a step tell what no other limit implies."""


def well_limits(
    given: Quantities, hover: Any, rest: Any, telling: Iterable[Telling] = repeat((True, True))
) -> Iterator[tuple[str, Relation]]:
    """What keeps y1/B within 0 and ω, with the moment of each, in order.

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
    for moment, (step, level), (dry, past_full) in ends:
        if dry or past_full:
            share = level.available_As / given.battery_As
        if dry:
            yield f"not dry {moment}", Relation(share, ">=", 0.0)
        if past_full and isinstance(step, str) and not given.tapers:
            yield f"not past full {moment}", Relation(share, "<=", given.available_fraction)


def moments(steps: Sequence[Any]) -> Iterator[str]:
    """The end of every step in words; flights and the stages of each are counted from 1."""
    flight, stage = 1, 0
    for step in steps:
        if isinstance(step, str):
            yield f"after the {step}"
            flight, stage = flight + 1, 0
        else:
            stage += 1
            yield f"after stage {stage} of flight {flight}"
