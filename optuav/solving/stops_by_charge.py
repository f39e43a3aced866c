"""Several stops by charge alone with η0 at every landing: one linear programme per sequence.

Resting where charging is best is not always enough then: charge may be needed before the UAV gets
there. A sequence has the stays as unknowns and one row per landing; counting only the end, with all
rests on the best building, bounds it from above.
"""

from __future__ import annotations

import time
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from optuav.arrays import Booleans, Floats, Integers
from optuav.network.legs import NO_LEG
from optuav.network.network import Network
from optuav.network.places import FIRST_BUILDING, HOVER
from optuav.network.timeline import stay_net
from optuav.network.variants import as_variants
from optuav.options import Perspective
from optuav.presentation.numbers import figure
from optuav.search.branch import TIE_S, SearchResult
from optuav.search.dual_simplex import dual_simplex
from optuav.search.plans import Stops
from optuav.solving.assemble import quantities
from optuav.solving.balance import affine_charge, balance, longest_by_balance

SEQUENCES_AT_ONCE = 1 << 12  # Sequences whose programmes are solved together


class _Sequences(NamedTuple):
    """Programmes Σ worth · t ≥ −spare and Σ t ≤ left in the stays t ≥ 0, one per sequence.

    Stays beyond the end of a sequence are worth nothing.
    """

    places: Integers  # (place, sequence), −1 beyond the end
    hovers: Booleans  # Whether a stop is a hover (stop, sequence)
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
    by_end = replace(network, mission=network.mission.replace({"limits.keep_soc": "end"}))
    bounds_s = longest_by_balance(balance(as_variants(by_end), perspective))[:, 0]
    sequences = _sequences(by_end, places, perspective)
    latest = time.monotonic() + (np.inf if time_limit_s is None else time_limit_s)
    hover_s, longest_s = np.full(len(bounds_s), -np.inf), -np.inf
    bound_s, ended = -np.inf, ""
    order = np.argsort(-bounds_s, kind="stable")
    order = order[bounds_s[order] >= 0.0]
    for first in range(0, len(order), SEQUENCES_AT_ONCE):
        some = order[first : first + SEQUENCES_AT_ONCE]
        some = some[bounds_s[some] >= longest_s - TIE_S]
        if not len(some):
            break
        if time_limit_s is not None and time.monotonic() > latest:
            bound_s, ended = float(bounds_s[some[0]]), f"ended after {figure(time_limit_s)} s"
            break
        hover_s[some] = _longest_hovers(sequences, some, longest_s - 2.0 * TIE_S)
        longest_s = max(longest_s, float(hover_s[some].max()))
    best = None
    if longest_s > -np.inf:
        number = int(np.flatnonzero(hover_s >= longest_s - TIE_S)[0])
        stays_s = _short_rests(sequences, number, float(hover_s[number]))
        hovered_s = float(stays_s[sequences.hovers[: len(stays_s), number]].sum())
        best = Stops(places[places[:, number] >= 0, number], stays_s, hovered_s, number)
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
        worth[stop] = np.where(at == HOVER, -drawn, np.where(at >= FIRST_BUILDING, gained, 0.0))
    left_s = np.broadcast_to(table.time_left, count)
    return _Sequences(places, places[1:-1] == HOVER, np.array(spare), worth, left_s)


def _longest_hovers(known: _Sequences, numbers: Integers, enough_s: float) -> Floats:
    """The longest hover of sequences [s]; −inf without any, or where it is no more than enough."""
    longest_s, hovers = np.full(len(numbers), -np.inf), known.hovers[:, numbers]
    for pattern in np.unique(hovers, axis=1).T:
        alike = (hovers == pattern[:, None]).all(axis=0)
        rows, limits = _programmes(known, numbers[alike])
        bounded = dual_simplex(rows, limits, pattern.astype(float), np.full(alike.sum(), enough_s))
        longest_s[alike] = np.where(bounded.complete, bounded.value, -np.inf)
    return longest_s


def _short_rests(known: _Sequences, number: int, hover_s: float) -> Floats:
    """The stays [s] of a sequence with a hover time and the least rest."""
    hovers = known.hovers[:, number]
    rows, limits = _programmes(known, np.array([number]))
    rows = np.concatenate([rows, -1.0 * hovers[None, :, None]])
    limits = np.concatenate([limits, [[-hover_s]]])
    worth = np.where(hovers, 0.0, -1.0)
    shortest = dual_simplex(rows, limits, worth, np.array([-np.inf]))
    return shortest.x[: (known.places[:, number] >= 0).sum() - 2, 0]


def _programmes(known: _Sequences, numbers: Integers) -> tuple[Floats, Floats]:
    """Rows and limits of sequences, the deadline first."""
    worth = known.worth[:, numbers]
    before = np.tri(len(worth) + 1, len(worth), -1)[:, :, None]  # Stays before each landing
    rows = np.concatenate([np.ones((1, *worth.shape)), -before * worth])
    return rows, np.vstack([known.left_s[numbers], known.spare[:, numbers]])
