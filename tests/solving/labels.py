"""The longest hover over several devices by labels (T, Q) over sets of devices [1]_.

Written apart from the package, for a state of charge that is affine in the times: of two ways over
the same devices to the same last place, by way of the same roof, one that takes no less time and no
less charge cannot lead to a longer hover.

References
----------
.. [1] M. Held, R. M. Karp, "A dynamic programming approach to sequencing problems", Journal of the
   Society for Industrial and Applied Mathematics, 1962.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

Label = tuple[float, float]  # Time [s] and charge [A s] of the legs so far


def longest_hover(
    graph: Any,
    devices: Sequence[str],
    charging_A: Mapping[str, float],
    hover_A: float,
    spare_As: float,
    deadline_s: float,
) -> float:
    """The longest Δ [s] on a graph, −∞ for none.

    With the current into the battery on each roof, the mean net current that hovering draws, and
    the charge that may be drawn.
    """
    legs = {
        ends: (figures["duration_s"], figures["charge_As"])
        for *ends_of, figures in graph.edges(data=True)
        for ends in [tuple(ends_of)]
    }
    whole, best_s = (1 << len(devices)) - 1, -math.inf
    # By devices behind, last place and roof behind, or none
    fronts: dict[tuple[int, str, str], list[Label]] = {(0, "origin", ""): [(0.0, 0.0)]}
    while fronts:
        ahead: dict[tuple[int, str, str], list[Label]] = {}
        for (done, last, roof), labels in fronts.items():
            steps = [
                (done | 1 << k, name, roof) for k, name in enumerate(devices) if not done >> k & 1
            ]
            steps += [(done, name, name) for name in charging_A if not roof]
            for state in steps:
                if leg := legs.get((last, state[1])):
                    for time_s, charge_As in labels:
                        added = time_s + leg[0], charge_As + leg[1]
                        ahead[state] = front([*ahead.get(state, []), added])
            if done == whole and (leg := legs.get((last, "destination"))):
                gain_A = charging_A.get(roof, 0.0)
                for time_s, charge_As in labels:
                    left_s = deadline_s - time_s - leg[0]
                    left_As = spare_As - charge_As - leg[1]
                    best_s = max(best_s, on_route(left_s, left_As, hover_A, gain_A))
        fronts = ahead
    return best_s


def front(labels: list[Label]) -> list[Label]:
    """The labels that no other is as good as in both."""
    kept: list[Label] = []
    for label in sorted(set(labels)):
        if not kept or label[1] < kept[-1][1]:
            kept.append(label)
    return kept


def on_route(left_s: float, left_As: float, hover_A: float, gain_A: float) -> float:
    """The longest Δ on a route by charge and deadline, with a net current that charges or none."""
    gain_A = max(gain_A, 0.0)
    if left_s < 0.0 or left_As + gain_A * left_s < 0.0:
        return -math.inf
    if hover_A <= 0.0:
        assert left_As >= 0.0, "hovering that charges first needs a rest: not covered here"
        return left_s
    return min(left_s, (left_As + gain_A * left_s) / (hover_A + gain_A))
