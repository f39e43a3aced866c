"""The longest hover of packs under a schedule, by simulation.

Which pack carries what depends on when each is empty, so that the end of a plan is no formula of Δ
and T', and no engine takes it. Here every pair of whole steps is tried, from the longest hover
down, and the best is looked at more closely. In slots that is exhaustive and a proof; in continuous
times it is none, as the set of feasible pairs may have any shape between the steps.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from optuav.arrays import Booleans, Floats
from optuav.errors import SolverError
from optuav.network.network import Network
from optuav.network.timeline import full_packs, pack_loads, route_phases
from optuav.physics.packs import Packs

STEP_S = 1.0
"""Steps of Δ and T' that are all tried."""

CLOSER = (0.1, 0.01, 0.001)
"""Ever smaller steps, as shares of the first, around the best pair."""

SLACK = 1e-9
"""Share of a step, and of the capacity, that rounding may take."""


class Longest(NamedTuple):
    """A route with its longest hover.

    Parameters
    ----------
    route
        Number of the itinerary.
    hover_time_s, rest_time_s
        Δ and T' [s].
    ended
        Why the search ended early, in words; empty if it came to its end.
    """

    route: int
    hover_time_s: float
    rest_time_s: float
    ended: str


class Clock:
    """When a search has to end, and whether that came.

    Parameters
    ----------
    limit_s
        Longest that it may take from now on [s]; None for no limit.
    """

    def __init__(self, limit_s: float | None) -> None:
        self.latest_s = math.inf if limit_s is None else time.monotonic() + limit_s
        self.ended = ""
        self._words = f"ended after {limit_s:g} s" if limit_s is not None else ""

    @property
    def is_late(self) -> bool:
        """Whether the search has to end; what asks does so."""
        if time.monotonic() > self.latest_s:
            self.ended = self._words
        return bool(self.ended)


def longest_hover(
    network: Network,
    choices: Sequence[tuple[int, bool]],
    slot_s: float | None = None,
    time_limit_s: float | None = None,
    fewer_routes: str = "",
) -> Longest | None:
    """Longest hover over some routes, and the smallest rest that it admits.

    Parameters
    ----------
    network
        Places, legs and itineraries.
    choices
        Numbers of itineraries in the order in which ties are broken, each with whether it may rest.
    slot_s
        Length of the slots [s]; None for continuous times.
    time_limit_s
        Longest that the search may take [s], after which the best so far counts; None for no limit.
    fewer_routes
        What to ask for where there is no time for so many, in words; empty if nothing.

    Returns
    -------
    None where no pair of steps is feasible.

    Raises
    ------
    SolverError
        If the time is over before any feasible pair was found.
    """
    step_s, least_s, clock = slot_s or STEP_S, 0.0, Clock(time_limit_s)
    ways = [_Way(network, route, rests, clock) for route, rests in choices]
    found: list[tuple[float, _Way, Floats]] = []
    searched = 0
    for way in ways:
        rests_s = way.rests_s(step_s, slots=slot_s is not None)
        hovers_s = way.longest_s(rests_s, step_s, least_s)
        if np.isfinite(hovers_s).any():
            best_s = float(np.nanmax(hovers_s))
            found.append((best_s, way, rests_s[hovers_s == best_s]))
            least_s = max(least_s, best_s - (0.0 if slot_s else step_s))
        searched += not clock.ended
    if not found and clock.ended:
        routes = f"{searched} of {len(ways)} routes were searched"
        if len(ways) == 1:
            routes = "the one route was not searched to its end"
        raise SolverError(
            f"the search by battery.schedule = {network.mission.battery.schedule!r} "
            f"{clock.ended}, the time limit, without a plan or proof that there is none: "
            f"{routes}, Δ and T' in steps of {step_s:g} s. Allow more time (time_limit_s), or ask "
            f"for less: longer slots (slot_s){fewer_routes and f', or {fewer_routes}'}"
        )
    if not found:
        return None
    if slot_s is None:
        found = [_closer(*each, step_s) for each in found if each[0] >= least_s]
    longest_s = max(each[0] for each in found)
    best = [
        (rest_s, way)
        for hover_s, way, rests_s in found
        if hover_s == longest_s
        for rest_s in [way.smallest_rest_s(hover_s, float(rests_s[0]), step_s, slots=bool(slot_s))]
    ]
    rest_s, way = min(best, key=lambda each: each[1].flight_time_s + each[0])
    return Longest(way.route, longest_s, rest_s, clock.ended)


def _closer(
    hover_s: float, way: _Way, rests_s: Floats, step_s: float
) -> tuple[float, _Way, Floats]:
    """The best pair in smaller steps: first all rests that were as good, then those nearby."""
    before_s = step_s
    for share in CLOSER:
        small_s = share * step_s
        for rows_s in (rests_s, way.near(float(rests_s[0]), before_s, small_s)):
            hovers_s = way.longest_s(rows_s, small_s, hover_s, hover_s + before_s)
            if np.isfinite(hovers_s).any():
                hover_s = float(np.nanmax(hovers_s))
                rests_s = rows_s[hovers_s == hover_s]
        before_s = small_s
    return hover_s, way, rests_s


class _Way:
    """A route, over which hover and rest are tried."""

    def __init__(self, network: Network, route: int, rests: bool, clock: Clock) -> None:
        mission, table, self.clock = network.mission, network.routes, clock
        self.network, self.route, self.rests = network, route, rests
        self.flight_time_s = float(table.flight_time_s[route])
        self.kinds = [each.kind for each in route_phases(network, route, 0.0, 0.0)]
        self.at = self.kinds.index("hover")
        self.left_s = mission.limits.deadline_s - self.flight_time_s
        given = mission.battery
        self.capacity_As = given.packs * given.capacity_As
        self.spare_As = (1.0 - mission.limits.min_soc) * self.capacity_As
        self.spare_As -= float(table.flight_charge_As[route])
        self.least_As = (mission.limits.min_soc - SLACK) * self.capacity_As
        self.nets_A = {
            each.kind: float(each.stages[0].current_A)
            for each in route_phases(network, route, 0.0, 0.0)
            if each.kind != "flight"
        }

    def rests_s(self, step_s: float, *, slots: bool) -> Floats:
        """Rests to try [s]: every whole step up to the deadline; in slots, one at least."""
        if not self.rests:
            return np.zeros(1)
        last = int(np.floor(self.left_s / step_s + SLACK))
        found: Floats = step_s * np.arange(1.0 if slots else 0.0, last + 1.0)
        return found

    def near(self, rest_s: float, reach_s: float, step_s: float) -> Floats:
        """Rests around one [s]."""
        if not self.rests:
            return np.zeros(1)
        steps = round(reach_s / step_s)
        found = rest_s + step_s * np.arange(-steps, steps + 1.0)
        return found[(found >= 0.0) & (found <= self.left_s)]

    def longest_s(
        self, rests_s: Floats, step_s: float, least_s: float, most_s: float = np.inf
    ) -> Floats:
        """Longest hovers in whole steps for some rests [s]; NaN where shorter, or late.

        Tried from the top down: no longer than the packs hold out in the hover itself, than the
        deadline leaves, and than charge counting allows, which knows no charge that is refused.
        """
        found = np.full(len(rests_s), np.nan)
        if not len(rests_s) or self.clock.is_late:
            return found
        start = self._begun(rests_s)
        most = np.minimum(most_s, self._bound_s(rests_s))
        trial = start.take(np.arange(len(rests_s)))
        self._carry(trial, np.maximum(most, 0.0), rests_s, slice(self.at, self.at + 1))
        most = np.where(trial.exhausted, trial.clock_s - start.clock_s, most)
        hovers_s = step_s * np.floor(most / step_s + SLACK)
        open_ = (hovers_s >= least_s) & ~start.exhausted
        while open_.any() and not self.clock.is_late:
            rows = np.flatnonzero(open_)
            flown = self._flyable(start.take(rows), hovers_s[rows], rests_s[rows])
            found[rows[flown]] = hovers_s[rows[flown]]
            least_s = max(least_s, float(np.nanmax(found, initial=least_s)))
            hovers_s[rows[~flown]] -= step_s
            open_ &= np.isnan(found) & (hovers_s >= least_s - SLACK * step_s)
        return found

    def smallest_rest_s(
        self, hover_s: float, rest_s: float, step_s: float, *, slots: bool
    ) -> float:
        """The smallest of the rests tried with which a hover is feasible [s]; as it is, if late."""
        rows_s = self.rests_s(step_s, slots=slots)
        rows_s = np.append(rows_s[rows_s < rest_s], rest_s)
        for share in (1.0,) if slots else (1.0, *CLOSER):
            if self.clock.is_late:
                break
            hovers_s = np.full(len(rows_s), hover_s)
            flown = self._flyable(self._begun(rows_s), hovers_s, rows_s)
            rest_s = float(rows_s[flown][0])
            rows_s = np.append(self._below(rest_s, share * step_s), rest_s)
        return rest_s

    def _below(self, rest_s: float, reach_s: float) -> Floats:
        near = self.near(rest_s, reach_s, 0.1 * reach_s)
        return near[near < rest_s]

    def _bound_s(self, rests_s: Floats) -> Floats:
        """What deadline and charge counting leave for the hover [s]."""
        bound = self.left_s - rests_s
        if self.nets_A["hover"] < 0.0:
            spare_As = self.spare_As + self.nets_A.get("rest", 0.0) * rests_s
            bound = np.minimum(bound, spare_As / -self.nets_A["hover"])
        return bound

    def _flyable(self, start: Packs, hovers_s: Floats, rests_s: Floats) -> Booleans:
        """Whether packs at the hover point hold out to the end, and enough is left in all."""
        rows = np.flatnonzero(hovers_s + rests_s <= self.left_s + SLACK * STEP_S)
        before = self.at
        if self.kinds[-2] == "rest":
            # Until they rest, courses that hover equally long are one and the same.
            before = len(self.kinds) - 2
            once_s, same = np.unique(hovers_s[rows], return_inverse=True)
            start = start.take(np.zeros_like(once_s, dtype=np.intp))
            self._carry(start, once_s, rests_s, slice(self.at, before))
            rows, same = rows[~start.exhausted[same]], same[~start.exhausted[same]]
            start = start.take(same)
        else:
            start = start.take(rows)
        self._carry(start, hovers_s[rows], rests_s[rows], slice(before, None))
        left_As = start.wells.total_As.sum(axis=1)
        enough = np.zeros(len(hovers_s), dtype=bool)
        enough[rows] = ~start.exhausted & (left_As >= self.least_As)
        return enough

    def _begun(self, rests_s: Floats) -> Packs:
        """Packs that arrive at the hover point, one course a rest."""
        carried = full_packs(self.network.mission).take(np.zeros(len(rests_s), dtype=np.intp))
        self._carry(carried, np.zeros(1), rests_s, slice(0, self.at))
        return carried

    def _carry(self, carried: Packs, hovers_s: Floats, rests_s: Floats, which: slice) -> None:
        """Let packs carry some phases, with one hover and one rest [s] a course."""
        for each in route_phases(self.network, self.route, hovers_s, rests_s)[which]:
            carried.job(pack_loads(self.network.mission, each))
