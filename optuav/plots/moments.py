"""Names of the limits of the available well in a picture: where it is empty, or full."""

from __future__ import annotations

from collections.abc import Sequence

from formulations.available import StepEnd
from optuav.modelling import Constraint
from optuav.plots.style import printed

REACHED = {"dry": "empty", "past full": "full"}


def in_words(constraint: Constraint, route: Sequence[str]) -> str:
    """The label of a constraint; for one of the wells, what happens where it binds.

    Parameters
    ----------
    constraint
        As declared.
    route
        Names of the places in the order in which they are reached; empty if they are not known.
    """
    moment = constraint.moment
    if constraint.kind not in REACHED or not isinstance(moment, StepEnd):
        return constraint.label
    well = f"available well {REACHED[constraint.kind]}"
    if moment.stay:
        return f"{well} {moment}"
    end = f"to {printed(route[moment.flight])}" if route else f"{moment.flight}"
    if moment.lands:
        return f"{well}, end of flight {end}"
    return f"{well}, stage {moment.stage} of flight {end}"
