"""How far whole slots can keep a hover time below the best one in continuous times.

Let (Δ, T') be best in continuous times, and H the horizon that a deadline leaves them. If neither a
shorter hover nor a longer rest can break any other constraint, ⌊Δ⌋ and the slots that are left for
the rest are feasible as well: at most one slot is lost, less than two where H is no whole number
of slots. Without a rest less than one slot is lost.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from optuav.engines.ranges import TOLERANCE
from optuav.modelling import Model, affine

HOVER, REST = "hover_time_s", "rest_time_s"


class Bound(NamedTuple):
    """What the theory says of a length of slot.

    Parameters
    ----------
    slots
        Δ in continuous times less Δ in slots is at least 0 and at most so many slots; None where
        the theory says nothing but that it is at least 0.
    words
        Why it says so, for a reader.
    """

    slots: int | None
    words: str


def bound(model: Model, parameters: Mapping[str, Any], slot_s: float) -> Bound:
    """The bound for a linear model that maximises the hover time.

    Parameters
    ----------
    model
        A model with the unknowns ``hover_time_s`` and, where there is a rest, ``rest_time_s``.
    parameters
        Values of its parameters for one itinerary.
    slot_s
        Length of a slot [s], > 0.
    """
    rests = any(variable.name == REST for variable in model.variables)
    slots, words = 1, "whole slots" if rests else "no rest"
    for constraint in model.constraints:
        relation = constraint.relation
        excess = affine(relation.left, parameters).plus(affine(relation.right, parameters), -1.0)
        excess = excess.times(-1.0) if relation.sense == ">=" else excess
        by_hover, by_rest = (float(excess.coefficients.get(name, 0.0)) for name in (HOVER, REST))
        if relation.sense == "==":
            return Bound(None, f"{constraint.label} is an equality")
        if by_hover >= 0.0 >= by_rest:
            continue
        if by_hover != by_rest or by_hover < 0.0:
            what = "a shorter hover" if by_hover < 0.0 else "a longer rest"
            return Bound(None, f"{what} can break {constraint.label}")
        horizon_slots = -float(excess.constant) / by_hover / slot_s
        if abs(horizon_slots - round(horizon_slots)) > TOLERANCE * max(1.0, horizon_slots):
            slots, words = 2, "the horizon is not a whole number of slots"
    return Bound(slots, words)
