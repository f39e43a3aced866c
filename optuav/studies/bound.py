"""The bound of the theory on the hover time that is lost to whole slots."""

from __future__ import annotations

from typing import NamedTuple

from optuav.engines.ranges import TOLERANCE
from optuav.modelling import Model
from optuav.modelling.affine import excess
from optuav.studies.results import Row

HOVER, REST = "hover_time_s", "rest_time_s"


class SlotBound(NamedTuple):
    """What the theory says about a length of slot.

    Parameters
    ----------
    slots
        Δ in continuous times less Δ in slots is between 0 and so many slots; None if the theory
        only says that it is at least 0.
    words
        Why, for a reader.
    """

    slots: int | None
    words: str


def bound(model: Model, parameters: Row, slot_s: float) -> SlotBound:
    """Return the bound for a linear model that maximises the hover time.

    Let (Δ, T') be the optimum in continuous times, and H the horizon that the deadline leaves. If
    neither a shorter hover nor a longer rest can break any other constraint, ⌊Δ⌋ slots of hover and
    the remaining slots of rest are feasible as well: at most one slot is lost, or less than two if
    H is not a whole number of slots. Without a rest less than one slot is lost.

    Parameters
    ----------
    model
        A model with the unknown ``hover_time_s`` and, if there is a rest, ``rest_time_s``.
    parameters
        Values of its parameters for one itinerary.
    slot_s
        Length of a slot [s], > 0.
    """
    rests = any(variable.name == REST for variable in model.variables)
    slots, words = 1, "whole slots" if rests else "no rest"
    for constraint in model.constraints:
        relation = constraint.relation
        form = excess(relation, parameters)[0].times(relation.signs[0])
        by_hover, by_rest = (float(form.coefficients.get(name, 0.0)) for name in (HOVER, REST))
        if relation.sense == "==":
            return SlotBound(None, f"{constraint.label} is an equality")
        if by_hover >= 0.0 >= by_rest:
            continue
        if by_hover != by_rest or by_hover < 0.0:
            what = "a shorter hover" if by_hover < 0.0 else "a longer rest"
            return SlotBound(None, f"{what} can break {constraint.label}")
        horizon_slots = -float(form.constant) / by_hover / slot_s
        if abs(horizon_slots - round(horizon_slots)) > TOLERANCE * max(1.0, horizon_slots):
            slots, words = 2, "the horizon is not a whole number of slots"
    return SlotBound(slots, words)
