"""Plans that hold for every value of uncertain numbers within a box, and what that costs."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from formulations.formulation import Formulation, Given
from formulations.parameters import Quantities
from formulations.soc import AVAILABLE, PERSPECTIVES, levels, well_limits
from optuav.arrays import Booleans, Integers
from optuav.engines.solution import Solution
from optuav.errors import Fault, InputError, NoPlanError, collected, printable, refuse
from optuav.mission import Mission, load
from optuav.mission.flight_model import flight_of
from optuav.mission.messages import misfits, shown, unknown
from optuav.mission.schema import Number
from optuav.modelling import Model
from optuav.network import vehicle
from optuav.network.network import Network
from optuav.network.variants import stacked
from optuav.options import Perspective, ProblemName
from optuav.physics.kibam import Stage
from optuav.plan import Plan
from optuav.plan.summary import tabulated
from optuav.service.box import Box, Corners, Points, box_of, corners_of, samples_of
from optuav.service.checks import flyable_network
from optuav.solving import solve
from optuav.solving.assemble import entries, figures, quantities, table_entries
from optuav.solving.balance import TIMES
from optuav.solving.outcome import best, replayed, route_plan
from optuav.solving.parts import allowed, groups
from optuav.solving.question import Question, answer, checked_question
from optuav.status import SAME_S
from optuav.studies.results import Pictures, Results, ResultsWithFacts
from optuav.studies.samples import SEED, completed

SAMPLES = Number("-", ge=1, le=1e6, whole=True)
CHANCE = Number("-", gt=0.0, lt=1.0)
HALVINGS = 10  # Halvings of the share of the box that a chance needs
KEPT = 1e-9  # Share of the capacity, or of the deadline, that rounding may take
PROBLEMS_TAKEN = ("P1", "P3", "P4")
UNITS = {"number": "", "low": "", "high": "", "gain_s": "s"}


class RobustTimes(NamedTuple):
    """A robust plan: its route, its times [s], and how they are known."""

    route: int
    hover_s: float
    rest_s: float
    how: dict[str, Any]  # Engine, status and proof


@dataclass(frozen=True)
class RobustPlan(ResultsWithFacts):
    """A plan that holds within a box, one row per uncertain number.

    Parameters
    ----------
    hover_s, rest_s, route
        Times of the plan [s], and its places.
    nominal_hover_s, price_s
        Longest hover if every number is as the mission states it, and the hover that doubt costs
        [s].
    corners, samples, flyable
        Number of corners that the plan is declared for; number of samples of the box that were
        flown, and the share of them in which the plan keeps every limit.
    reach_share
        The plan is declared for a box about the same middle with this share of the reach to either
        side; 1 without a chance.
    risk_bound, confidence
        Upper bound on the share of the box in which the plan fails, and its confidence.
    """

    plan: Plan = field(kw_only=True, repr=False)  # Flown with the numbers of the mission

    @property
    def doubt_costs_s(self) -> dict[str, float]:
        """Hover gained on the route if a number were certain [s], by number; the largest first."""
        return {row["number"]: row["gain_s"] for row in self.rows}


def robust(
    mission: Mission | str | Path,
    uncertainty: Mapping[str, object] | str | Path,
    problem: Formulation | ProblemName = "P1",
    *,
    perspective: Perspective = AVAILABLE,
    chance: float | None = None,
    confidence: float = 0.99,
    samples: int = 20_000,
    seed: int = 0,
) -> RobustPlan:
    """Find the plan with the longest hover that can be flown wherever the numbers lie in a box.

    y1(t) − ωB is the integral of the current over a positive kernel. For fixed times a plan is
    therefore worst for dry wells and for charge with the most drawn and the least charged, and
    worst for overfull ones with the least drawn and the most charged. Limits are declared for these
    two at every corner of the keys, and also for the least wind and for five values each of ω and
    k_F, in which the wells are not monotone. The route, the hover point and the times are the same
    for all. Samples of the whole box then check what corners alone do not prove.

    Parameters
    ----------
    mission
        A mission, or its name or path; its packs are pooled and charge at constant current.
    uncertainty
        Ranges of keys as `sensitivity` takes them, as a dict or a TOML file; and of two factors,
        ``drain`` on every current that is drawn and ``charge`` on the charging current after its
        cap, each as ``{ percent = 5 }`` or ``{ low = 0.9, high = 1.2 }``. A ``deviation`` has as
        its box the range that samples are drawn from.
    problem
        ``"P1"``, ``"P3"``, or an instance of `P1`, `P3` or `P4` with one rest and hover.
    perspective
        ``"available"``, or ``"battery"``, which counts charge alone.
    chance
        The share of the box in which the plan must hold, between 0 and 1; by default the whole
        box. The plan is then declared for the smallest part of the box, about its middle, with
        which so few samples fail that the chance is met with the confidence (an order statistic,
        as the plans of larger parts hold in more of the box).
    confidence
        Of the chance, and of the bound on the risk; between 0 and 1.
    samples, seed
        How many samples of the box check the plan, 1 to 1e6, and their seed, 0 to 2**63. As many
        others find the part of the box for a chance.

    Returns
    -------
    RobustPlan
        Its times, its price, the share of samples that it survives, ``plan``, and one row per
        number: the hover gained on the same route [s] if that number were certain. Where the box
        does not hold the numbers of the mission itself, ``plan.flyable`` may be false.

    Raises
    ------
    InputError
        If an argument is out of range, the box has more than 128 corners, or the samples are too
        few for the chance (459 for 99 % at a confidence of 99 %).
    NoPlanError
        If no plan holds in the whole box, or with the chance.

    Examples
    --------
    >>> import optuav
    >>> box = {"drain": {"percent": 5}, "charge": {"percent": 10}}
    >>> robust = optuav.robust("paper", box)
    >>> f"{robust.hover_s:.3f} s, {robust.price_s:.1f} s less than without doubt"
    '555.810 s, 41.5 s less than without doubt'
    """
    faults = [*misfits(("samples", samples, SAMPLES), ("seed", seed, SEED))]
    faults += misfits(("confidence", confidence, CHANCE))
    if chance is not None:
        faults += misfits(("chance", chance, CHANCE))
        if not faults and _most_failures(int(samples), chance, confidence) < 0:
            least = math.ceil(math.log1p(-confidence) / math.log(chance))
            words = f"at least {least} for a chance of {chance:g} at a confidence of {confidence:g}"
            faults.append(Fault("samples", shown(samples), words))
    if perspective not in (AVAILABLE, "battery"):
        faults.append(unknown("perspective", perspective, (AVAILABLE, "battery")))
    with collected(faults):
        loaded = load(mission)
        for name, only in (("schedule", "pooled"), ("charging", "constant")):
            if (now := getattr(loaded.battery, name)) != only:
                faults.append(Fault(f"battery.{name}", shown(now), f"must be {only!r} here"))
        box = box_of(loaded, uncertainty)
    refuse(faults)
    loaded = completed(loaded, box.spreads)
    question = checked_question(loaded, problem, perspective)
    several = question.several or question.speed_free or question.p1.hover_point != "w_U"
    if question.problem.name not in PROBLEMS_TAKEN or several:
        words = (
            f"must be {', '.join(PROBLEMS_TAKEN)} with one rest, one hover, w_U and stated speeds"
        )
        raise InputError([Fault("problem", question.problem.name, words)])
    hover_m = [float(coordinate) for coordinate in vehicle.hover_point_m(loaded)]
    nominal = solve(loaded, question.problem, perspective=perspective)
    if not all(map(math.isfinite, hover_m)) or not nominal:
        raise NoPlanError(f"no plan even without doubt: {'; '.join(nominal.reasons)}")
    network = flyable_network(loaded.replace({"route.hover_m": hover_m}))
    count, search, share = int(samples), _Search(question, network), 1.0
    routes = np.flatnonzero(allowed(stacked(network), question.problem)[0])
    if chance is None:
        times = search.best(routes, box)
    else:
        trials = samples_of(network, box, count, count, int(seed))
        most = _most_failures(count, chance, confidence)
        share, times = search.by_chance(routes, box, trials, most)
    if times is None:
        where = "in the whole box" if chance is None else f"with a chance of {chance:g}"
        repair = "state smaller ranges"
        table = figures(corners_of(network, box).emptiest.variants)
        if np.any(table.hover_distance_m > table.coverage_radius_m * (1.0 + KEPT)):
            repair = "the link does not reach the hover point at some corners: state route.hover_m "
            repair += "nearer to link.device_m"
        raise NoPlanError(f"optuav found no plan that holds {where}: {repair}")
    kept = search.kept(times, samples_of(network, box, 0, count, int(seed)))
    box = box.shrunk(share) if share < 1.0 else box
    route, hover_s, rest_s, how = times
    plan = route_plan(question, network, route, (hover_s, rest_s), **how)
    plan = replayed(plan, must_fly=box.holds_now)
    facts = {
        "hover_s": hover_s,
        "rest_s": rest_s,
        "route": tuple(plan.route),
        "nominal_hover_s": nominal.hover_time_s,
        "price_s": nominal.hover_time_s - hover_s,
        "corners": corners_of(network, box).size,
        "samples": count,
        "flyable": float(kept.mean()),
        "chance": chance,
        "reach_share": share,
        "confidence": confidence,
        "risk_bound": _risk_bound(count, int(np.count_nonzero(~kept)), confidence),
    }
    rows = list[dict[str, Any]]()
    for name, ends in box.numbers.items():
        certain = search.best(np.array([route]), box.without(name))
        gain_s = 0.0 if certain is None else certain.hover_s - hover_s
        rows.append(dict(zip(UNITS, (name, *ends, gain_s), strict=True)))
    rows.sort(key=lambda row: -row["gain_s"])
    return RobustPlan("optuav robust", loaded, facts, UNITS, tuple(rows), _show, _draw, plan=plan)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Robust(Formulation):
    """Longest hover within limits that hold at all corners."""

    emptiest: tuple[Quantities, ...]
    fullest: tuple[Quantities, ...]

    def declare(self, model: Model, given: Given) -> None:
        """State charge, dry and deadline at the emptiest corners, past full at the fullest."""
        hover, rest = given.hover_and_rest(model)
        model.maximise(hover)
        for number, corner in enumerate(self.emptiest, start=1):
            left = PERSPECTIVES[given.perspective](corner, hover, rest) >= corner.min_soc
            model.subject_to(f"charge, corner {number}", left, kind="state of charge")
            in_time = hover + rest <= corner.time_left
            model.subject_to(f"deadline, corner {number}", in_time, unit="s", kind="deadline")
        if given.perspective != AVAILABLE:
            return
        for kind, corners in (("dry", self.emptiest), ("past full", self.fullest)):
            for number, corner in enumerate(corners, start=1):
                for limit in well_limits(corner, hover, rest):
                    if limit.kind == kind:
                        label = f"{kind}, corner {number}, step {limit.step + 1}"
                        model.subject_to(label, limit.relation, kind=kind)


@dataclass(frozen=True, eq=False)
class _Search:
    """The search for the longest hover that keeps all limits in a box, over routes of a network."""

    question: Question
    network: Network

    def best(self, routes: Integers, box: Box) -> RobustTimes | None:
        """The robust plan with the longest hover over some routes; None for none."""
        plans, longest_s, corners = list[RobustTimes](), 0.0, corners_of(self.network, box)
        ordered = groups(self.network.routes, routes, ordered=True)
        relaxed = [pair for group, _ in ordered for pair in self._relaxed(routes[group], corners)]
        for bound_s, candidate in sorted(relaxed, key=lambda pair: -pair[0]):
            if bound_s < longest_s - SAME_S:
                break
            robust = all(self.kept(candidate, points).all() for points in corners[:2])
            plan = candidate if robust else self._at_all_corners(candidate.route, corners)
            if plan is not None:
                plans.append(plan)
                longest_s = max(longest_s, plan.hover_s)
        plans.sort(key=lambda plan: plan.route)
        of_plans = self.network.routes.take([plan.route for plan in plans])
        hovers_s = np.array([plan.hover_s for plan in plans])
        totals_s = hovers_s + [plan.rest_s for plan in plans] + of_plans.flight_time_s
        winner = best(hovers_s, totals_s, of_plans.building >= 0)
        return None if winner is None else plans[winner]

    def _relaxed(self, routes: Integers, corners: Corners) -> Iterator[tuple[float, RobustTimes]]:
        """By route in the same order: a hover that no robust plan exceeds [s], and its plan.

        Each pair of levels of ω and k_F is a programme of its own, which bounds the hover. The plan
        of the lowest bound is robust if it keeps the limits at the other levels too, which is the
        rule. Routes without a plan are left out.
        """
        model, able = self._problem(routes, corners, corners.levels * len(routes))
        solution = answer(model, able.size, self.question)
        bounds_s = solution.objective if solution.beyond is None else solution.beyond
        bounds_s = np.where(able & (bounds_s >= 0.0), bounds_s, -np.inf)
        worst = bounds_s.reshape(corners.levels, len(routes)).argmin(axis=0)
        for number, (level, route) in enumerate(zip(worst.tolist(), routes.tolist(), strict=True)):
            programme = level * len(routes) + number
            if bounds_s[programme] >= 0.0:
                yield float(bounds_s[programme]), _times(route, solution, programme)

    def _at_all_corners(self, route: int, corners: Corners) -> RobustTimes | None:
        """The longest robust hover on a route from a programme with all corners; None for none."""
        model, able = self._problem(np.array([route]), corners, 1)
        solution = answer(model, 1, self.question)
        if not able.all() or not solution.status.has_answer:
            return None
        solution.verify()
        return _times(route, solution)

    def _problem(
        self, routes: Integers, corners: Corners, programmes: int
    ) -> tuple[Model, Booleans]:
        """The robust problem of routes in the same order, and which programmes can be flown.

        A programme per route, for as many levels as there are programmes; the other corners are
        constraints.
        """
        emptiest, fullest = (self.figures(points, routes) for points in corners[:2])
        size = corners.size * len(routes)
        # Numbers rather than arrays of one entry: engines for one programme take no others.
        numbers = range(size) if programmes == 1 else range(0, size, programmes)
        which = [k if programmes == 1 else slice(k, k + programmes) for k in numbers]
        problem = _Robust(
            emptiest=tuple(entries(emptiest[0], corner) for corner in which),
            fullest=tuple(entries(fullest[0], corner) for corner in which),
        )
        rests = bool(self.network.routes.building[routes[0]] >= 0)
        shared = np.tile(routes, programmes // len(routes))
        table = quantities(self.network, shared, rests=rests, steps=False)
        able = np.asarray(np.reshape(emptiest[1], (-1, programmes)).all(axis=0))
        return problem.model(table, self.question.perspective), able

    def figures(self, points: Points, routes: Integers) -> tuple[Quantities, Booleans]:
        """Figures with currents multiplied, all routes at a point after each other.

        The second array says where the legs can be flown, the link holds and the altitude is
        allowed. All routes are direct, or all go by way of a building.
        """
        (variants, drain, charge), all_routes = points, self.network.routes
        which, point = (
            np.tile(routes, variants.count),
            np.arange(variants.count).repeat(len(routes)),
        )
        rests = bool(all_routes.building[routes[0]] >= 0)
        table = quantities(variants, which, point, rests=rests)
        resting = flight_of(variants.mission).rest()
        hover_A, rest_A = (
            table_entries(flow.current_A, point, np.zeros_like(which))
            for flow in (variants.hover_load, resting)
        )
        able = np.broadcast_to(variants.able, (variants.count, len(all_routes)))[point, which]
        reached = np.asarray(table.hover_distance_m <= table.coverage_radius_m * (1.0 + KEPT))
        above = np.asarray(table.min_altitude_m <= table.hover_altitude_m)
        below = np.asarray(table.hover_altitude_m <= table.max_altitude_m)
        steps = tuple(
            step if isinstance(step, str) else Stage(drain * step.current_A, step.duration_s)
            for step in table.steps
        )
        received_A = hover_A - table.hover_current_A
        scaled = replace(
            table,
            steps=steps,
            flight_charge_As=drain * table.flight_charge_As,
            hover_current_A=drain * hover_A - charge * received_A,
            rest_current_A=charge * (table.rest_current_A + rest_A) - drain * rest_A,
        )
        return scaled, able & reached & above & below

    def by_chance(
        self, routes: Integers, box: Box, trials: Points, most_failures: int
    ) -> tuple[float, RobustTimes | None]:
        """The smallest share of the reach whose plan fails few enough trials, and the plan."""
        chosen: tuple[float, RobustTimes | None] = (1.0, None)
        low, high, share = 0.0, 1.0, 1.0
        for _ in range(HALVINGS + 1):
            plan = self.best(routes, box.shrunk(share))
            enough = plan is not None and (
                np.count_nonzero(~self.kept(plan, trials)) <= most_failures
            )
            if enough:
                chosen = share, plan
            if enough or plan is None:
                high = share
            else:
                low = share
            if low == high:  # Samples of a deviation reach past its box
                break
            share = 0.5 * (low + high)
        return chosen

    def kept(self, plan: RobustTimes, points: Points) -> Booleans:
        """At which points the plan keeps every limit."""
        times_s = plan.hover_s, plan.rest_s
        table, kept = self.figures(points, np.array([plan.route]))
        left = PERSPECTIVES[self.question.perspective](table, *times_s)
        kept = kept & np.asarray(left >= table.min_soc - KEPT)
        kept &= np.asarray(sum(times_s) <= table.time_left + KEPT * table.deadline_s)
        if self.question.perspective == AVAILABLE:
            for step, wells in zip(table.steps, levels(table, *times_s), strict=True):
                share = wells.available_As / table.battery_As
                kept &= np.asarray(share >= -KEPT)
                if isinstance(step, str):
                    kept &= np.asarray(share <= table.available_fraction + KEPT)
        return np.asarray(kept, dtype=bool)


def _times(route: int, solution: Solution, programme: int = 0) -> RobustTimes:
    """The times of an answer on a route; NaN where there is none."""
    hover_s, rest_s = (
        float(np.maximum(0.0, solution.values[name][programme])) if name in solution.values else 0.0
        for name in TIMES
    )
    proof = f"corners of the box: {solution.proof}"
    how = {"engine": solution.engine, "status": solution.statuses[programme], "proof": proof}
    return RobustTimes(route, hover_s, rest_s, how)


def _most_failures(samples: int, chance: float, confidence: float) -> int:
    """The largest k with P(Bin(n, 1 − chance) ≤ k) ≤ 1 − confidence."""
    from scipy import special

    below = special.bdtr(np.arange(samples), samples, 1.0 - chance)
    return int(np.count_nonzero(below <= 1.0 - confidence)) - 1


def _risk_bound(samples: int, failures: int, confidence: float) -> float:
    """Upper end of the one-sided interval of Clopper and Pearson for the share that fails."""
    from scipy import special

    if failures == samples:
        return 1.0
    return float(special.betaincinv(failures + 1, samples - failures, confidence))


def _show(robust: Results) -> Iterator[str]:
    facts = robust.facts
    yield f"Robust plan: {printable(robust.mission.name)}"
    yield f"Route       {' → '.join(map(printable, facts['route']))}"
    yield f"Hover       {facts['hover_s']:.3f} s, rest {facts['rest_s']:.3f} s"
    nominal = f"{facts['nominal_hover_s']:.3f} s without doubt"
    yield f"Price       {facts['price_s']:.3f} s of hover: {nominal}"
    part = "" if facts["chance"] is None else f" at {facts['reach_share']:.1%} of its reach"
    held = f"{facts['flyable']:.2%} of {facts['samples']} samples of the box"
    yield f"Holds       at {2 * facts['corners']} corners{part}, and in {held}"
    sure = f"with a confidence of {facts['confidence']:g}"
    yield f"Risk        at most {facts['risk_bound']:.2%} of the box, {sure}\n"
    lines = [["if this were certain", "low", "high", "hover gained [s]"]]
    for row in robust.rows:
        lines.append([row["number"], f"{row['low']:g}", f"{row['high']:g}", f"{row['gain_s']:.3f}"])
    yield from tabulated(lines, longest=34)


def _draw(robust: Results) -> Pictures:
    """Both wells of the plan with the numbers of the mission."""
    from optuav import plots

    assert isinstance(robust, RobustPlan)
    yield "robust.png", plots.wells(robust.plan)[0]
