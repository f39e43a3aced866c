"""What the battery of a mission delivers, by the tests' own wells: an oracle for `available`.

It knows the phases of a mission, and no formulation and no engine.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from optuav.network.network import Network
from optuav.network.timeline import route_phases
from tests.kibam import Floats, Kibam

AT_ONCE_S = 1e-9
"""What a deadline is missed by in rounding [s]."""


def slack(network: Network, route: int, hover_s: Floats, rest_s: Any, looks: int = 1) -> Any:
    """By how much charge is within its limits, as a share of the capacity; −1 after the deadline.

    Parameters
    ----------
    network, route
        The mission's places and legs, and the number of an itinerary.
    hover_s, rest_s
        Δ and T' [s]; arrays of times side by side.
    looks
        How often to look at y1 in every phase of constant current, at equal distances.
    """
    mission = network.mission
    battery, deadline_s = mission.battery, mission.limits.deadline_s
    capacity_As, share = battery.packs * battery.capacity_As, battery.available_fraction
    wells, used_s = Kibam(capacity_As, share, battery.flow_rate_per_s), 0.0
    landed: Any = np.inf
    for phase in route_phases(network, route, hover_s, rest_s):
        for current_A, duration_s in phase.net:
            if battery.charging == "taper" and current_A > 0.0:
                wells.taper(current_A, duration_s)
            else:
                wells.spend(current_A, duration_s, looks)
            used_s = used_s + duration_s
        if phase.kind == "flight" and mission.limits.keep_soc == "always":
            landed = np.minimum(landed, wells.soc - mission.limits.min_soc)
    # Rounding may leave a well that is held full past it, from which a leg starts.
    past = 1e-12 if battery.charging == "taper" else 0.0
    spare = np.minimum(wells.least, share - wells.most + past)
    spare = np.minimum(np.minimum(spare, landed), wells.soc - mission.limits.min_soc)
    return np.where(used_s <= deadline_s * (1.0 + 1e-11) + AT_ONCE_S, spare, -1.0)


def longer(beyond_s: float, horizon_s: float, margin_s: float) -> Floats:
    """Hover times longer than what none should exceed, close to it and far from it [s]."""
    start_s = beyond_s + margin_s if beyond_s > -np.inf else 0.0
    steps_s = [np.geomspace(1e-6, 1.0, 20), np.linspace(0.0, 1.0, 60)]
    return start_s + max(horizon_s - start_s, margin_s) * np.unique(np.concatenate(steps_s))


def rests(near_s: Sequence[float], horizon_s: float) -> Floats:
    """Rest times from 0 to the horizon [s], dense at both ends and around some of them."""
    shares = np.geomspace(1e-6, 1.0, 30)
    found = [np.linspace(0.0, 1.0, 60), shares, 1.0 - shares]
    for each in near_s:
        found += [
            each / horizon_s + shares,
            each / horizon_s - shares,
            np.array([each / horizon_s]),
        ]
    every = horizon_s * np.concatenate(found)
    return np.unique(every[(every >= 0.0) & (every <= horizon_s)])
