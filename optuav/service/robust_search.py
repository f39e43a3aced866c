"""The search for the longest hover that keeps all limits in a box of uncertain numbers."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from formulations.formulation import Formulation, Given
from formulations.parameters import Quantities
from formulations.soc import AVAILABLE, PERSPECTIVES, soc_on_landing, well_limits, wells_after_steps
from optuav.arrays import Booleans, Floats, Integers
from optuav.engines.solution import Solution
from optuav.modelling import Model
from optuav.network.network import Network
from optuav.network.variants import Variants
from optuav.physics.kibam import Stage
from optuav.physics.quantity import Quantity
from optuav.service.uncertainty_box import Box, Points, corners_of, points_within
from optuav.solving.assemble import quantities, subset, table_entries
from optuav.solving.balance import TIMES
from optuav.solving.question import Question, solve_model
from optuav.solving.ranking import best
from optuav.solving.route_models import routes_by_kind
from optuav.solving.route_plan import AnswerFields
from optuav.status import SAME_S

SHARE_HALVINGS = 10  # Halvings of the share of the box that a chance needs
KEPT = 1e-9  # Share of the capacity, or of the deadline, that rounding may take
SOUGHT = 20_000  # Points of a box among which a worse one than the corners is sought
POINTS_ABOUT_WORST, ZOOMS = 100, 20  # Points about the worst one, in ever smaller parts of the box
MOST_ADDITIONS = 12  # Times that points inside the box are added to the corners


class RobustTimes(NamedTuple):
    """A robust plan: its route, its times [s], and how they are known."""

    route: int
    hover_s: float
    rest_s: float
    how: AnswerFields  # Engine, status and proof


@dataclass(frozen=True, kw_only=True, eq=False)
class RobustHover(Formulation):
    """Longest hover within limits that hold at all points."""

    emptiest: tuple[Quantities, ...]
    fullest: tuple[Quantities, ...]

    def declare(self, model: Model, given: Given) -> None:
        """State charge, dry and deadline at the emptiest points, past full at the fullest."""
        hover, rest = given.hover_and_rest(model)
        model.maximise(hover)
        for number, corner in enumerate(self.emptiest, start=1):
            left = PERSPECTIVES[given.perspective](corner, hover, rest) >= corner.min_soc
            model.subject_to(f"charge, corner {number}", left, kind="state of charge")
            for flight, landing in enumerate(corner.landings, start=1):
                if not landing.stays:
                    continue  # Known before, see `Search._problem`
                soc = soc_on_landing(corner, given.perspective, landing, hover, rest)
                label = f"charge, corner {number}, flight {flight}"
                model.subject_to(label, soc >= corner.min_soc, kind="state of charge")
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
class Search:
    """The search for the longest hover that keeps all limits in a box, over routes of a network."""

    question: Question
    network: Network

    def holding(self, routes: Integers, box: Box) -> tuple[RobustTimes | None, dict[int, float]]:
        """The longest hover on some routes that holds in a box, and upper bounds by route [s].

        The worst point of some keys, such as positions, is not a corner. Where samples find points
        within at which the plan fails, the worst of them are declared beside the corners, again
        and again.
        """
        points = corners = corners_of(self.network.mission, box)
        for _ in range(MOST_ADDITIONS):
            plan, bounds_s = self._longest(routes, points, corners)
            worst = None if plan is None or not box.spreads else self._worst(plan, box)
            if worst is None:
                return plan, bounds_s
            points = points.and_at(worst)
        return None, bounds_s

    def by_chance(
        self, routes: Integers, box: Box, trials: Points, most_failures: int
    ) -> tuple[float, RobustTimes | None]:
        """The smallest share of the reach whose plan fails few enough trials, and the plan."""
        chosen: tuple[float, RobustTimes | None] = (1.0, None)
        low, high, share, bounds_s = 0.0, 1.0, 1.0, dict.fromkeys(routes.tolist(), np.inf)
        for _ in range(SHARE_HALVINGS + 1):
            plan, found_s = self.holding(np.array([*bounds_s]), box.shrunk(share))
            if plan is None or np.count_nonzero(~self.holds_at(plan, trials)) <= most_failures:
                high, chosen = share, chosen if plan is None else (share, plan)
            else:
                low, bounds_s = share, found_s
            if chosen[1] is not None:  # Hovers grow as the box shrinks, to the bounds at most
                longest_s = chosen[1].hover_s - SAME_S
                bounds_s = {k: bound_s for k, bound_s in bounds_s.items() if bound_s >= longest_s}
            if low == high:
                break
            share = 0.5 * (low + high)
        return chosen

    def holds_at(self, plan: RobustTimes, points: Points) -> Booleans:
        """Return at which points the plan keeps every limit."""
        return np.asarray((self._margins(plan, points) >= -KEPT).all(axis=0))

    def _margins(self, plan: RobustTimes, points: Points) -> Floats:
        """Distance to charge, deadline, dry and past full (limit, point); −inf without flight."""
        times_s = plan.hover_s, plan.rest_s
        tables, able = _along(self.network, plan.route, points)
        emptiest, fullest = tables[0], tables[-1]
        soc = PERSPECTIVES[self.question.perspective](emptiest, *times_s)
        late = (sum(times_s) - emptiest.time_left) / emptiest.deadline_s
        margins = [soc - emptiest.min_soc, -late]
        for landing in emptiest.landings:
            soc = soc_on_landing(emptiest, self.question.perspective, landing, *times_s)
            margins.append(soc - emptiest.min_soc)
        if self.question.perspective == AVAILABLE:
            shares = [
                wells.available_As / emptiest.battery_As
                for wells in wells_after_steps(emptiest, *times_s)
            ]
            margins.append(np.min(np.broadcast_arrays(*shares), axis=0))
            for step, wells in zip(
                fullest.steps, wells_after_steps(fullest, *times_s), strict=True
            ):
                if isinstance(step, str):
                    above = wells.available_As / fullest.battery_As
                    margins.append(fullest.available_fraction - above)
        return np.where(able, np.stack(np.broadcast_arrays(*margins, able)[:-1]), -np.inf)

    def _worst(self, plan: RobustTimes, box: Box) -> Points | None:
        """The worst point for each limit that fails somewhere in a box; None if none is found."""
        rng, mission = np.random.default_rng(0), self.network.mission
        shares = rng.random((SOUGHT, len(box.spreads)))
        shares[0] = box.nearest  # Often no corner, and the plan is flown there
        margins = self._margins(plan, points_within(mission, box, shares))
        failing = margins.min(axis=1) < -KEPT
        if not failing.any():
            return None
        worst = shares[margins.argmin(axis=1)[failing]]
        for reach in 0.5 ** np.arange(1, ZOOMS):
            steps = reach * rng.uniform(-1.0, 1.0, (POINTS_ABOUT_WORST, *worst.shape))
            steps[0] = 0.0
            near = np.clip(worst + steps, 0.0, 1.0)
            points = points_within(mission, box, near.reshape(-1, len(box.spreads)))
            margins = self._margins(plan, points)[failing].reshape(
                len(worst), POINTS_ABOUT_WORST, len(worst)
            )
            least = margins[range(len(worst)), :, range(len(worst))].argmin(axis=1)
            worst = near[least, range(len(worst))]
        return points_within(mission, box, worst)

    def _longest(
        self, routes: Integers, points: Points, corners: Points
    ) -> tuple[RobustTimes | None, dict[int, float]]:
        """The longest hover on some routes that holds at all points, and bounds by route [s]."""
        plans, longest_s = list[RobustTimes](), 0.0
        # Where the wells level out at uncertain rates, other points have rates of no pair of levels
        relaxed = [*self._relaxed(routes, points if points.levels == 1 else corners)]
        for bound_s, candidate in sorted(relaxed, key=lambda pair: -pair[0]):
            if bound_s < longest_s - SAME_S:
                break
            robust = self.holds_at(candidate, points).all()
            plan = candidate if robust else self._at_all_levels(candidate.route, points)
            if plan is not None:
                plans.append(plan)
                longest_s = max(longest_s, plan.hover_s)
        plans.sort(key=lambda plan: plan.route)
        of_plans = self.network.routes.take([plan.route for plan in plans])
        hovers_s = np.array([plan.hover_s for plan in plans])
        totals_s = hovers_s + [plan.rest_s for plan in plans] + of_plans.flight_time_s
        winner = best(hovers_s, totals_s, of_plans.building >= 0)
        bounds_s = {candidate.route: bound_s for bound_s, candidate in relaxed}
        return None if winner is None else plans[winner], bounds_s

    def _relaxed(self, routes: Integers, points: Points) -> Iterator[tuple[float, RobustTimes]]:
        """By route in the same order: a hover that no robust plan exceeds [s], and its plan.

        Each pair of levels of ω and k_F is a programme of its own, which bounds the hover. The plan
        of the lowest bound is robust if it keeps the limits at the other levels too, which is the
        rule. Routes without a plan are left out.
        """
        variants = Variants(self.network, points.columns)
        for group, _ in routes_by_kind(self.network.routes, routes, ordered=True):
            alike = routes[group]
            model, able = self._problem(variants, alike, points, points.levels * len(alike))
            solution = solve_model(model, able.size, self.question)
            bounds_s = solution.objective if solution.beyond is None else solution.beyond
            bounds_s = np.where(able & (bounds_s >= 0.0), bounds_s, -np.inf)
            level = bounds_s.reshape(points.levels, len(alike)).argmin(axis=0)
            for number, route in enumerate(alike.tolist()):
                programme = int(level[number]) * len(alike) + number
                if bounds_s[programme] >= 0.0:
                    yield float(bounds_s[programme]), _times(route, solution, programme)

    def _at_all_levels(self, route: int, points: Points) -> RobustTimes | None:
        """The longest robust hover on a route from a programme with all points; None for none."""
        variants = Variants(self.network, points.columns)
        model, able = self._problem(variants, np.array([route]), points, 1)
        solution = solve_model(model, 1, self.question)
        if not able.all() or not solution.status.has_answer:
            return None
        solution.verify()
        return _times(route, solution)

    def _problem(
        self, variants: Variants, routes: Integers, points: Points, programmes: int
    ) -> tuple[Model, Booleans]:
        """The robust problem of routes in the same order, and which programmes can be flown.

        A programme per route, for as many levels as there are programmes; the other points are
        constraints.
        """
        tables, able = quantities_at(variants, routes, points)
        emptiest, perspective = tables[0], self.question.perspective
        for landing in (stage for stage in emptiest.landings if not stage.stays):
            left = soc_on_landing(emptiest, perspective, landing, 0.0, 0.0)
            able = able & (left >= emptiest.min_soc - KEPT)
        size = points.count * len(routes)
        # Numbers rather than arrays of one entry: engines for one programme take no others.
        numbers = range(size) if programmes == 1 else range(0, size, programmes)
        which = [k if programmes == 1 else slice(k, k + programmes) for k in numbers]
        corners = (tuple(subset(table, part) for part in which) for table in tables)
        rests = bool(self.network.routes.building[routes[0]] >= 0)
        shared = np.tile(routes, programmes // len(routes))
        table = quantities(self.network, shared, rests=rests, steps=False)
        flown = np.asarray(np.reshape(able, (-1, programmes)).all(axis=0))
        fewest, most = corners
        return RobustHover(emptiest=fewest, fullest=most).model(table, perspective), flown


@lru_cache(maxsize=4)
def _along(network: Network, route: int, points: Points) -> tuple[tuple[Quantities, ...], Booleans]:
    """Figures of a route alone, kept for the next times that are tried on it."""
    return quantities_at(Variants(network.only([route]), points.columns), np.array([0]), points)


def quantities_at(
    variants: Variants, routes: Integers, points: Points
) -> tuple[tuple[Quantities, ...], Booleans]:
    """Figures for each pair of factors, all routes at a point after each other.

    The second value says where the legs can be flown, the link holds and the altitude is allowed.
    All routes are direct, or all go by way of a building.
    """
    which = np.tile(routes, variants.count)
    point = np.arange(variants.count).repeat(len(routes))
    all_routes = variants.network.routes
    table = quantities(variants, which, point, rests=bool(all_routes.building[routes[0]] >= 0))
    resting = variants.mission.flight_model.rest()
    hover_A, rest_A = (
        table_entries(flow.current_A, point, np.zeros_like(which))
        for flow in (variants.hover_load, resting)
    )
    able = np.broadcast_to(variants.able, (variants.count, len(all_routes)))[point, which]
    reached = np.asarray(table.hover_distance_m <= table.coverage_radius_m * (1.0 + KEPT))
    able = able & np.asarray(table.min_altitude_m <= table.hover_altitude_m)
    able = able & np.asarray(table.hover_altitude_m <= table.max_altitude_m)
    scaled = (_scaled(table, hover_A, rest_A, *factors) for factors in points.factors)
    return tuple(scaled), able & reached


def _scaled(
    table: Quantities, hover_A: Quantity, rest_A: Quantity, drain: Quantity, charge: Quantity
) -> Quantities:
    """Figures with the drawn and the charging currents multiplied."""
    steps = tuple(
        step if isinstance(step, str) else Stage(drain * step.current_A, step.duration_s)
        for step in table.steps
    )
    landings = tuple(x._replace(charge_As=drain * x.charge_As) for x in table.landings)
    return replace(
        table,
        steps=steps,
        landings=landings,
        flight_charge_As=drain * table.flight_charge_As,
        hover_current_A=drain * hover_A - charge * (hover_A - table.hover_current_A),
        rest_current_A=charge * (table.rest_current_A + rest_A) - drain * rest_A,
    )


def _times(route: int, solution: Solution, programme: int = 0) -> RobustTimes:
    """The times of an answer on a route; NaN where there is none."""
    hover_s, rest_s = (
        float(np.maximum(0.0, solution.values[name][programme])) if name in solution.values else 0.0
        for name in TIMES
    )
    proof = f"corners of the box: {solution.proof}"
    how: AnswerFields = {
        "engine": solution.engine,
        "status": solution.statuses[programme],
        "proof": proof,
    }
    return RobustTimes(route, hover_s, rest_s, how)
