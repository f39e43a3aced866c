"""Several stops by charge alone with η0 at every landing: one linear programme per sequence.

Resting where charging is best is not always enough then: charge may be needed before the UAV gets
there. A sequence has the stays as unknowns and one row per landing; counting only the end, with all
rests on the best building, bounds it from above.
"""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from optuav.arrays import Floats, Integers
from optuav.network.legs import NO_LEG
from optuav.network.network import Network
from optuav.network.places import FIRST_BUILDING, HOVER
from optuav.network.timeline import stay_net
from optuav.network.variants import as_variants
from optuav.options import Perspective
from optuav.search.branch import TIE_S, SearchResult
from optuav.search.plans import Stops
from optuav.silence import silent
from optuav.solving.assemble import quantities
from optuav.solving.balance import affine_charge, balance, longest_by_balance


class _Sequences(NamedTuple):
    """Programmes Σ worth · t ≥ −spare and Σ t ≤ left in the stays t ≥ 0, one per sequence."""

    places: Integers  # (place, sequence), −1 beyond the end
    spare: Floats  # After each leg, above η0 (leg, sequence) [-]
    worth: Floats  # Of a second of each stay (stop, sequence) [1/s]
    left_s: Floats


def longest_by_charge(
    network: Network, places: Integers, perspective: Perspective, time_limit_s: float | None
) -> SearchResult:
    """The sequence of stops with the longest hover, and its stays.

    The network has the sequences (place, sequence) as routes, in the order in which ties are
    broken, each with the rest on its best building.
    """
    best: Stops | None = None
    by_end = replace(network, mission=network.mission.replace({"limits.keep_soc": "end"}))
    bounds_s = longest_by_balance(balance(as_variants(by_end), perspective))[:, 0]
    known = _sequences(by_end, places, perspective)
    latest = time.monotonic() + (np.inf if time_limit_s is None else time_limit_s)
    longest_s, ended = -np.inf, ""
    order = np.argsort(-bounds_s, kind="stable")
    for number in order[bounds_s[order] >= 0.0].tolist():
        if bounds_s[number] < longest_s - TIE_S:
            break
        if time.monotonic() > latest:
            ended = f"ended after {time_limit_s:g} s"
            break
        if (stays_s := _longest_stays(known, number)) is None:
            continue
        of_sequence = places[places[:, number] >= 0, number]
        hover_s = float(stays_s[of_sequence[1:-1] == HOVER].sum())
        stops = Stops(of_sequence, stays_s, hover_s, number)
        longest_s = max(longest_s, hover_s)
        tied = best is not None and best.hover_s >= longest_s - TIE_S
        if best is None or not tied or (hover_s >= longest_s - TIE_S and number < best.rank):
            best = stops
    bound_s = float(bounds_s[number]) if ended else longest_s
    return SearchResult(best, max(bound_s, longest_s), ended)


def _sequences(network: Network, places: Integers, perspective: Perspective) -> _Sequences:
    """The programmes of all sequences."""
    count = places.shape[1]
    table = quantities(network, np.arange(count), steps=False)
    legs, all_legs = network.routes.legs.T, network.legs
    charge_As, energy_J = (np.append(x, 0.0) for x in (all_legs.charge_As, all_legs.energy_J))
    flown_As, flown_J = (np.cumsum(x[legs], axis=0) for x in (charge_As, energy_J))
    assert NO_LEG == -1  # The last entry: it draws nothing
    spare = [
        np.broadcast_to(
            affine_charge(replace(table, flight_charge_As=As, flight_energy_J=J), perspective)[0],
            count,
        )
        for As, J in zip(flown_As, flown_J, strict=True)
    ]
    buildings = np.arange(FIRST_BUILDING, len(network.places.names))
    net = stay_net(network, buildings)
    worth = np.zeros((len(places) - 2, count))
    for stop, at in enumerate(places[1:-1]):
        building = np.maximum(at - FIRST_BUILDING, 0)
        rest_A, rest_W = (
            x[building] if len(buildings) else np.zeros(count) for x in (net.current_A, net.power_W)
        )
        stay = replace(table, rest_current_A=rest_A, rest_received_W=rest_W)
        _, drawn, gained = affine_charge(stay, perspective)
        worth[stop] = np.where(at == HOVER, -drawn, gained)
    left_s = np.broadcast_to(table.time_left, count)
    return _Sequences(places, np.array(spare), worth, left_s)


def _longest_stays(known: _Sequences, number: int) -> Floats | None:
    """The stays [s] with the longest hover on one sequence, the rests short; None without any."""
    from scipy.optimize import linprog

    at = known.places[known.places[:, number] >= 0, number]
    hovers, stays = at[1:-1] == HOVER, len(at) - 2
    before = np.tri(stays + 1, stays, -1)  # Stays before each landing
    worth = known.worth[:stays, number]
    scale = np.abs(worth).max(initial=0.0) or 1.0
    rows = np.vstack([-before * worth / scale, np.ones(stays)])
    limits = np.append(known.spare[: stays + 1, number] / scale, known.left_s[number])
    with silent():
        longest: Any = linprog(-1.0 * hovers, A_ub=rows, b_ub=limits, method="highs")
        if longest.status != 0:
            return None
        held, hover_s = np.vstack([rows, -1.0 * hovers]), -float(longest.fun)
        shortest: Any = linprog(1.0 * ~hovers, A_ub=held, b_ub=[*limits, -hover_s], method="highs")
    stays_s: Floats = (shortest if shortest.status == 0 else longest).x
    return stays_s
