"""State of charge through both wells, step by step: [1] eqs (11)-(16) in Δ and T'.

The same problems as with charge balance, and the same optimum, since y1 + y2 changes by I t
whatever the wells do; but smooth in Δ and T', for engines that take such models.
"""

from __future__ import annotations

from typing import Any

from formulations.quantities import Quantities
from optuav.physics import battery


def wells(given: Quantities, hover: Any, rest: Any) -> Any:
    """(y1 + y2)/B after the steps of the itinerary, from a full battery."""
    pool = battery.Battery(given.battery_As, given.available_fraction, given.flow_rate_per_s)
    stays = {
        "hover": battery.Phase(-given.hover_current_A, hover),
        "rest": battery.Phase(given.rest_current_A, rest),
    }
    phases = [stays[step] if isinstance(step, str) else step for step in given.steps]
    return battery.state_of_charge(pool, battery.after(pool, pool.full, phases))
