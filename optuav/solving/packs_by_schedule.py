"""The longest hover under ``available`` where packs take turns, found by simulation.

Which pack carries what depends on when each is empty, so the final state has no formula in Δ
and T', and no engine solves it. Pairs of whole steps are simulated from the longest hover down, and
the best pair is refined. In slots that is exhaustive, which is a proof. In continuous times it is
none, as the feasible pairs between the steps may form any shape.
"""

import math
import time
from collections.abc import Sequence
from copy import copy
from dataclasses import replace

import numpy as np

from optuav.arrays import Booleans, Floats
from optuav.engines.grid import axes
from optuav.engines.registry import AUTO
from optuav.errors import SolverError, refuse
from optuav.network import vehicle
from optuav.network.network import Network
from optuav.network.timeline import pack_loads, route_phases, starting_packs
from optuav.options import LONGEST_HOVER
from optuav.physics.packs import Packs
from optuav.plan import Plan
from optuav.presentation.numbers import figure
from optuav.solving.no_plan import plan_without, proof_of_none
from optuav.solving.question import Question, not_with
from optuav.solving.route_models import RouteModel
from optuav.solving.route_plan import AnswerFields, route_plan
from optuav.status import Status

ENGINE = "simulation"
STEP_S = 1.0  # step of Δ and T' [s] in continuous times
FINER = (0.1, 0.01, 0.001)
"""Steps of the refinement around the best pair, as shares of the first step."""
SLACK = 1e-9  # share of a step, and of the capacity, that rounding may take

PROOF_IN_SLOTS = "exhaustive: every pair of slots that could be better was simulated"
CONTINUOUS = (
    f"simulation on a grid of {figure(STEP_S)} s, refined to {figure(FINER[-1])} s around the "
    "best, not proved"
)


def packs_by_schedule(question: Question, network: Network, parts: Sequence[RouteModel]) -> Plan:
    """The plan with the longest hover that the packs deliver, then the shortest mission."""
    slot_s, schedule = question.slot_s, network.mission.battery.schedule
    words = f"under battery.schedule = {schedule!r} and perspective available"
    problem = ("problem", question.problem.name, LONGEST_HOVER)
    refuse(not_with(words, problem, ("engine", question.engine_name, (AUTO, "grid"))))
    step_s, clock = slot_s or STEP_S, _Clock(question.time_limit_s)
    entries = ((part, entry) for part in parts for entry in range(len(part.routes)))
    routes = [_Route(network, *entry, slot_s, clock) for entry in entries]
    routes.sort(key=lambda each: (each.number, each.part.rests))
    question, proof = replace(question, engine=ENGINE), PROOF_IN_SLOTS if slot_s else CONTINUOUS
    plans: list[tuple[float, Floats, _Route]] = []
    searched, least_s = 0, 0.0
    for route in routes:
        hovers_s = route.longest_s(route.rests_s, step_s, least_s)
        if np.isfinite(hovers_s).any():
            whole_s = float(np.nanmax(hovers_s))
            hover_s = min(whole_s, route.left_s)  # The deadline may cut the last slot short.
            plans.append((hover_s, route.rests_s[hovers_s == whole_s], route))
            least_s = max(least_s, hover_s - (0.0 if slot_s else step_s))
        searched += not clock.ended
    if not plans and not slot_s and not clock.ended and not (proof := _proof_of_none(parts)):
        raise SolverError(
            f"the search by battery.schedule = {schedule!r} found neither a plan nor proof that "
            f"none exists, Δ and T' in steps of {figure(step_s)} s; with slot_s it is exhaustive"
        )
    if not plans and clock.ended:
        fewer = ", or fewer routes (trajectory, order)" if len(routes) > 1 else ""
        raise SolverError(
            f"the search by battery.schedule = {schedule!r} {clock.ended}, the time limit, without "
            f"a plan or proof that none exists: {searched} of {len(routes)} routes were searched "
            f"to the end, Δ and T' in steps of {figure(step_s)} s. Allow more time (time_limit_s), "
            f"or ask for less: longer slots (slot_s){fewer}"
        )
    if not plans:
        why = (
            f"no pair of Δ and T' in steps of {figure(step_s)} s leaves a pack to fly on to the end"
        )
        return plan_without(question, network, Status.INFEASIBLE, proof, (why,))
    if not slot_s:
        plans = [pairs[2].refined(*pairs[:2]) for pairs in plans if pairs[0] >= least_s]
    hover_s = max(pairs[0] for pairs in plans)
    best = [(route, float(rests_s[0])) for each_s, rests_s, route in plans if each_s == hover_s]
    rested = [(route.smallest_rest_s(hover_s, rest_s), route) for route, rest_s in best]
    rest_s, route = min(rested, key=lambda each: each[1].flight_time_s + each[0])
    notes = [
        f"packs by schedule {schedule!r}: one flies while the laser charges another; charge that "
        "full packs refuse is lost; only the perspective battery counts that"
    ]
    if clock.ended:
        proof = f"simulation that {clock.ended}, not proved"
        longer = "there may be a longer hover, not all pairs were tried"
        notes.append(f"the search {clock.ended}; {longer}")
    status = Status.OPTIMAL if slot_s and not clock.ended else Status.FEASIBLE
    said: AnswerFields = {"engine": ENGINE, "proof": proof, "status": status, "notes": notes}
    return route_plan(question, network, route.number, (hover_s, rest_s), **said)


def _proof_of_none(parts: Sequence[RouteModel]) -> str:
    """Return the proof that no times are feasible; empty without one.

    The wells of pooled packs that may be past full hold no less than the wells of packs in turns.
    """
    pooled = []
    for part in parts:
        model = copy(part.model)
        model.constraints = [
            constraint for constraint in model.constraints if constraint.kind != "past full"
        ]
        pooled.append(RouteModel(model, part.routes))
    proof = proof_of_none(pooled)
    return f"{proof}, even if the packs were pooled" if proof else ""


class _Clock:
    """The time limit of a search, and in words whether it was found to have passed."""

    def __init__(self, limit_s: float | None) -> None:
        self.limit_s, self.ended = limit_s or math.inf, ""
        self.latest = time.monotonic() + self.limit_s

    def is_late(self) -> bool:
        """Return whether the time limit has passed, and record it in `ended`."""
        if time.monotonic() > self.latest:
            self.ended = f"ended after {figure(self.limit_s)} s"
        return bool(self.ended)


class _Route:
    """Simulate pairs of hover and rest on a route."""

    def __init__(
        self, network: Network, part: RouteModel, entry: int, slot_s: float | None, clock: _Clock
    ) -> None:
        mission, battery = network.mission, network.mission.battery
        self.network, self.part, self.clock = network, part, clock
        self.step_s, self.slots = slot_s or STEP_S, slot_s is not None
        self.number = number = int(part.routes[entry])
        phases = route_phases(network, number, 0.0, 0.0)
        self.hover = [phase.kind for phase in phases].index("hover")
        self.net_A = {phase.kind: float(phase.stages[0].current_A) for phase in phases}
        self.flight_time_s = float(network.routes.flight_time_s[number])
        self.left_s = mission.limits.deadline_s - self.flight_time_s
        if slot_s:  # The limits of pooled packs bound what packs in turns deliver.
            limited = math.isfinite(clock.limit_s)
            steps_s = axes(part.model, part.model.row(entry), slot_s, limited=limited)
        else:
            last = math.floor(self.left_s / STEP_S + SLACK)
            steps_s = [STEP_S * np.arange(last + 1.0)] * (1 + part.rests)
        hovers_s, self.rests_s = [*steps_s, np.zeros(1)][:2]
        self.least_s = hovers_s.min(initial=math.inf)
        self.longest_stay_s = hovers_s.max(initial=self.left_s)
        capacity_As = float(mission.pool.capacity_As)
        self.least_As = (mission.limits.min_soc - SLACK) * capacity_As
        self.always = mission.limits.keep_soc == "always"
        share = vehicle.start(mission).total_As / mission.pool.capacity_As
        self.spare_As = (share - mission.limits.min_soc) * capacity_As
        self.spare_As -= float(network.routes.flight_charge_As[number])
        # Between the two wells of a pack no more than k_F B flows, either way.
        self.flow_A = capacity_As * battery.flow_rate_per_s
        (load,) = pack_loads(mission, phases[self.hover])
        self.fastest_A = load.draw_A + self.flow_A
        self.rounding_As = SLACK * capacity_As

    def near(self, rest_s: float, reach_s: float, step_s: float) -> Floats:
        """Rests around one [s], in steps."""
        if not self.part.rests:
            return np.zeros(1)
        steps = round(reach_s / step_s)
        rests_s = rest_s + step_s * np.arange(-steps, steps + 1.0)
        return rests_s[(rests_s >= 0.0) & (rests_s <= self.left_s)]

    def longest_s(
        self, rests_s: Floats, step_s: float, least_s: float, most_s: float = math.inf
    ) -> Floats:
        """Longest hovers in whole steps for some rests [s]; NaN where shorter than `least_s`."""
        # Simulated from the top down: from the time left by the deadline, the balance of charge,
        # which ignores refused charge, and the endurance of the packs in the hover itself and after
        # it. That balance is for given rests, where `balance.by_balance` seeks the best rest.
        longest_s = np.full(len(rests_s), np.nan)
        if not len(rests_s) or self.clock.is_late():
            return longest_s
        (start, kept), least_s = self._at_hover(rests_s), max(least_s, self.least_s)
        most = np.minimum(most_s, self.longest_stay_s - rests_s)
        if self.net_A["hover"] < 0.0:
            spare_As = self.spare_As + self.net_A.get("rest", 0.0) * rests_s
            most = np.minimum(most, spare_As / -self.net_A["hover"])
        trial = start.take(np.arange(len(rests_s)))
        self._carry(trial, np.maximum(most, 0.0), rests_s, slice(self.hover, self.hover + 1))
        most = np.where(trial.exhausted, trial.clock_s - start.clock_s, most)
        # A hover that ends earlier leaves more, by no more than drains within that time.
        left_As = np.where(trial.in_service, trial.wells.available_As, 0.0).sum(axis=1)
        short_As = self._needed_As(rests_s) - left_As
        most = np.where(short_As > 0.0, most - short_As / self.fastest_A, most)
        steps = np.floor(most / step_s + SLACK)
        hovers_s = step_s * steps
        open_ = (hovers_s >= least_s) & ~start.exhausted & kept
        while open_.any() and not self.clock.is_late():
            rows = np.flatnonzero(open_)
            flown = self._flyable(start.take(rows), hovers_s[rows], rests_s[rows])
            longest_s[rows[flown]] = hovers_s[rows[flown]]
            least_s = max(least_s, float(np.nanmax(longest_s, initial=least_s)))
            steps[rows[~flown]] -= 1.0
            hovers_s = step_s * steps
            open_ &= np.isnan(longest_s) & (hovers_s >= least_s - SLACK * step_s)
        return longest_s

    def refined(self, hover_s: float, rests_s: Floats) -> "tuple[float, Floats, _Route]":
        """The best Δ in finer steps [s], the rests that allow it [s], and this route."""
        before_s = self.step_s
        for share in FINER:
            step_s = share * self.step_s
            for tried_s in (rests_s, self.near(float(rests_s[0]), before_s, step_s)):
                hovers_s = self.longest_s(tried_s, step_s, hover_s, hover_s + before_s)
                if np.isfinite(hovers_s).any():
                    hover_s = float(np.nanmax(hovers_s))
                    rests_s = tried_s[hovers_s == hover_s]
            before_s = step_s
        return hover_s, rests_s, self

    def smallest_rest_s(self, hover_s: float, rest_s: float) -> float:
        """The smallest of the rests tried that allows a hover [s]; `rest_s` itself if late."""
        tried_s = self.rests_s
        for share in (1.0,) if self.slots else (1.0, *FINER):
            if self.clock.is_late():
                break
            tried_s = np.append(tried_s[tried_s < rest_s], rest_s)
            start, kept = self._at_hover(tried_s)
            flown = kept & self._flyable(start, np.full(len(tried_s), hover_s), tried_s)
            rest_s = min(tried_s[flown].tolist(), default=rest_s)
            reach_s = share * self.step_s
            tried_s = self.near(rest_s, reach_s, 0.1 * reach_s)
        return rest_s

    def _flyable(self, start: Packs, hovers_s: Floats, rests_s: Floats) -> Booleans:
        """Return whether packs at the hover point last to the end with enough charge left.

        A slot that the deadline cuts short must be affordable whole as well. False if late.
        """
        enough = np.asarray(hovers_s + rests_s <= self.longest_stay_s + SLACK * STEP_S)
        for most_s in {self.longest_stay_s, self.left_s}:
            rows = np.flatnonzero(enough)
            packs = start.take(rows)
            stays_s = np.minimum(hovers_s[rows], most_s)
            kept = self._carry(packs, stays_s, rests_s[rows], slice(self.hover, None))
            kept &= packs.wells.total_As.sum(axis=1) >= self.least_As
            enough[rows] = ~packs.exhausted & kept & (not self.clock.ended)
        return enough

    def _needed_As(self, rests_s: Floats) -> Floats:
        """Charge that the available wells in service hold at least after a hover [A s].

        Until the end, whatever the schedule: the charge drawn, less the most that the laser and the
        bound wells can add meanwhile. A pack leaves the service with none.
        """
        taken = most = np.zeros_like(rests_s)
        for phase in route_phases(self.network, self.number, 0.0, rests_s)[self.hover + 1 :]:
            for load in pack_loads(self.network.mission, phase):
                taken = taken + (load.draw_A - load.charge_A - self.flow_A) * load.duration_s
                most = np.maximum(most, taken)
        return most - self.rounding_As

    def _at_hover(self, rests_s: Floats) -> tuple[Packs, Booleans]:
        """Packs that arrive at the hover point, one course a rest, and whether all landings hold.

        See `_carry`.
        """
        packs = starting_packs(self.network.mission).take(np.zeros(len(rests_s), dtype=np.intp))
        kept = self._carry(packs, np.zeros(1), rests_s, slice(0, self.hover))
        return packs, kept

    def _carry(self, packs: Packs, hovers_s: Floats, rests_s: Floats, which: slice) -> Booleans:
        """Let packs carry some phases, with one hover and one rest [s] a course.

        Returns whether they land with enough charge wherever the mission says so.
        """
        kept = np.ones(len(packs.exhausted), bool)
        for phase in route_phases(self.network, self.number, hovers_s, rests_s)[which]:
            for _ in packs.stretches(pack_loads(self.network.mission, phase)):
                if self.clock.is_late():
                    return kept
            if self.always and phase.kind == "flight":
                kept &= packs.wells.total_As.sum(axis=1) >= self.least_As
        return kept
