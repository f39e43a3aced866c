"""(P1) with the hover point free: where to hover as well as where to rest and how long."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NoReturn

import numpy as np

from formulations.p1 import P1
from optuav.engines.prices import ShadowPrice
from optuav.engines.registry import Engine
from optuav.errors import InputError
from optuav.mission import Mission
from optuav.network import vehicle
from optuav.network.network import build_network
from optuav.physics.quantity import Vector
from optuav.plan import Plan
from optuav.solving.declare import declared_program
from optuav.solving.hover_search import OpenRoutes, Region, best_points, open_routes
from optuav.solving.plans import Part, best
from optuav.solving.program import Program
from optuav.solving.question import AUTO, Question
from optuav.status import Status

PROOF = "local: points all over the region, the best of them refined by ever smaller steps"


@dataclass(frozen=True)
class FreeProgram(Program):
    """A program whose hover point is unknown: print it, check points, or solve it.

    Parameters
    ----------
    own
        The program with the hover point of the mission itself.
    routes
        The itineraries with their hover point open, one entry a part.
    """

    own: Program
    routes: tuple[OpenRoutes, ...]

    def solve(self) -> Plan:
        """The best plan found; locally optimal, and never worse than hovering at w_U.

        Raises
        ------
        SolverError
            If the time limit passes.
        """
        own = self.own.solve()
        if not self.parts:
            return own
        found = best_points(self.routes, self.question, self.network, Region.of(own.mission))
        points_m = [(each.routes.index[each.entry], each.point_m) for each in found]
        points_m.sort(key=lambda each: int(each[0]))
        plans = [own, *(self._plan_at(tuple(point_m.tolist())) for _, point_m in points_m)]
        if own.mission.route.hover_m is not None:
            plans.append(self._plan_at(None))
        plans = [plan for plan in plans if plan]
        if not plans:
            return own.model_copy(
                update={"reasons": ("no hover point was found that has a plan", *own.reasons)}
            )
        chosen = best(
            [plan.hover_time_s for plan in plans],
            [plan.mission_time_s for plan in plans],
            [len(plan.route) - 3 for plan in plans],
        )
        assert chosen is not None
        plan = plans[chosen]
        notes = (_gain(plan, own), *plan.notes)
        local = {"proof": PROOF, "status": Status.LOCALLY_OPTIMAL, "notes": notes}
        return plan.model_copy(update=local)

    def _plan_at(self, hover_m: Vector | None) -> Plan:
        """The best plan with a given hover point; None for w_U."""
        mission = self.network.mission.replace({"route.hover_m": hover_m})
        return declared_program(_held(self.question), build_network(mission)).solve()

    def shadow_prices(self) -> dict[str, ShadowPrice]:
        """Refused: a free hover point has no prices of its own.

        Raises
        ------
        InputError
            Always; the plan's mission, which states the point found, has shadow prices.
        """
        self._refuse("shadow prices")

    def compile(self, engine: str | Engine | None = None) -> NoReturn:
        """Refused: what is in sight of the hover point is no part of the models.

        Raises
        ------
        InputError
            Always.
        """
        self._refuse("compile")

    def _refuse(self, what: str) -> NoReturn:
        raise InputError(
            f"{what}: not with hover_point = 'free'; ask it of the mission of the plan that was "
            "found, whose route.hover_m is the point"
        )


def _gain(plan: Plan, own: Plan) -> str:
    """By how much a plan is better than that of the mission's own hover point, in words."""
    hover_m = plan.mission.route.hover_m
    name = "w_U" if own.mission.route.hover_m is None else "route.hover_m"
    if plan is own:
        return f"hover point free: none was found that is better than {name}"
    point = "w_U" if hover_m is None else "({:.3f}, {:.3f}, {:.3f}) m".format(*hover_m)
    if not own:
        return f"hover point free: {point}; at {name} there is no plan"
    more_s = plan.hover_time_s - own.hover_time_s
    return f"hover point free: {point} gives {more_s:.4f} s more than {name}"


def _held(asked: Question) -> Question:
    """The same question with the hover point where the mission has it."""
    assert isinstance(asked.problem, P1)
    problem = replace(asked.problem, hover_point="w_U")
    return replace(asked, problem=problem, engine=AUTO, time_limit_s=None)


def free_program(asked: Question, mission: Mission) -> FreeProgram:
    """Declare (P1) with the hover point free: a part for the direct route, one with a rest."""
    own = declared_program(_held(asked), build_network(mission))
    region = Region.of(mission)
    if region.low_m > region.high_m or np.isnan(vehicle.hover_load(mission).current_A):
        return FreeProgram(asked, own.network, (), own.reasons, own, ())
    routes = open_routes(asked, own.network)
    parts = tuple(Part(each.free.model(asked.perspective), each.index) for each in routes)
    reasons = own.reasons if not parts else ()
    return FreeProgram(asked, own.network, parts, reasons, own, routes)
