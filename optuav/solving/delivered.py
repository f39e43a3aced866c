"""The longest hovers that the battery can deliver, from the quantities of many itineraries."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, get_args

from formulations.p1 import P1
from formulations.parameters import Quantities
from formulations.soc import AVAILABLE
from optuav.arrays import Floats
from optuav.solving.hovers import STAYS, Stays, longest_hovers


def delivered(given: Quantities, count: int) -> Mapping[str, Floats]:
    """Δ and T' [s] by name, NaN where none are, under the perspective `available`.

    Parameters
    ----------
    given
        Quantities of itineraries that all stay in one order, with their steps.
    count
        How many there are.
    """
    if given.tapers:
        from optuav.engines import bracket

        return bracket.solve(P1().model(given, AVAILABLE), count).values
    found = longest_hovers(**arguments(given))
    return {"hover_time_s": found.hover_time_s, "rest_time_s": found.rest_time_s}


def arguments(given: Quantities) -> dict[str, Any]:
    """What `longest_hovers` takes, by name: legs between the stays, their order, and figures."""
    legs: list[list[Any]] = [[]]
    stays: list[str] = []
    for step in given.steps:
        if isinstance(step, str):
            stays.append(step)
            legs.append([])
        else:
            legs[-1].append(step)
    (order,) = (name for name in get_args(Stays) if STAYS[name] == tuple(stays))
    return {
        "legs": legs,
        "stays": order,
        "deadline_s": given.deadline_s,
        "min_soc": given.min_soc,
        "capacity_As": given.battery_As,
        "available_fraction": given.available_fraction,
        "flow_rate_per_s": given.flow_rate_per_s,
        "hover_current_A": given.hover_current_A,
        "rest_current_A": given.rest_current_A,
    }
