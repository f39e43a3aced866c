"""(P1) with the hover point free: where to hover as well as where to rest and how long."""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import chain
from typing import NoReturn

import numpy as np

from formulations.formulation import Given
from formulations.p1 import P1
from formulations.parameters import FROM_HOVER, QUANTITIES, TO_HOVER
from formulations.soc import PAPER
from optuav.arrays import Integers
from optuav.engines.registry import AUTO, Engine
from optuav.engines.solution import Solution
from optuav.errors import InputError, SolverError
from optuav.mission import Mission
from optuav.mission.beams import beam_of
from optuav.mission.flight_model import flight_of
from optuav.modelling import Model, Parameter
from optuav.network import vehicle
from optuav.network.legs import NO_LEG
from optuav.network.network import Network, build_network
from optuav.network.places import HOVER
from optuav.network.variants import stacked
from optuav.options import Perspective
from optuav.physics.kibam import Stage
from optuav.physics.quantity import Quantity, Vector, norm
from optuav.plan import Plan
from optuav.solving.assemble import quantities
from optuav.solving.hover_points import PointSearch, Region
from optuav.solving.outcome import best
from optuav.solving.parts import Part, allowed, groups
from optuav.solving.program import Program, declared_program
from optuav.solving.question import Question
from optuav.status import Status

REFUSED = (
    "hover_point = 'free' has no {}: use the mission of the plan that was found, whose "
    "route.hover_m is the point"
)
PROOF = "local: points all over the region, the best of them refined by ever smaller steps"
TRIED = "a feasible plan: the best of the hover points that were tried within the time limit"
LATE = "the search for a hover point did not end within the time limit"
DESCRIPTIONS = {
    "flight_time_s": "time of all legs, two of them to w and from w",
    "flight_charge_As": "charge drawn on all legs",
    "flight_energy_J": "energy drawn on all legs",
    "flight_voltage_V": "mean voltage on all legs",
    "hover_current_A": "current drawn at w, less the current from the laser there",
    "hover_received_W": "power received from the laser at w",
}
"""Printed in place of formulas in w that would fill a page."""


def free_program(question: Question, mission: Mission) -> "FreeProgram":
    """(P1) with the hover point free, declared for the routes that some point may make flyable."""
    fixed = replace(question, problem=replace(question.p1, hover_point="w_U"), engine=AUTO)
    at_mission = declared_program(replace(fixed, time_limit_s=None), build_network(mission))
    region, network, parts = Region(mission), at_mission.network, list[Part]()
    if region.low_m <= region.high_m and not np.isnan(vehicle.hover_load(mission).current_A):
        legs, table = network.routes.legs, network.legs
        apart = (table.start[legs] != HOVER) & (table.end[legs] != HOVER) & (legs != NO_LEG)
        usable = (table.flyable[legs] | ~apart).all(axis=1)
        opened = replace(network, routes=replace(network.routes, flyable=usable))
        reached = np.flatnonzero(allowed(stacked(opened), question.problem)[0])
        for group, rests in groups(
            opened.routes, reached, ordered=question.perspective not in PAPER
        ):
            which = reached[group]
            parts.append(Part(_declared(network, which, rests, question.perspective), which))
    return FreeProgram(
        question, network, tuple(parts), () if parts else at_mission.reasons, at_mission
    )


@dataclass(frozen=True)
class FreeProgram(Program):
    """A program whose hover point is unknown: print it, check points, or solve it."""

    own: Program  # The same with the hover point of the mission itself

    def solve(self) -> Plan:
        """The best plan found; locally optimal, and never worse than hovering at w_U."""
        begin, mission = time.monotonic(), self.network.mission
        stated_plan = self.own.solve()
        if not self.parts:
            return stated_plan
        others = [] if mission.route.hover_m is None else [None]
        routes = np.concatenate([part.routes for part in self.parts])
        # The plan at each point takes about as long as that at the mission's own.
        last_s = (1 + len(others)) * (time.monotonic() - begin)
        latest = begin + (self.question.time_limit_s or math.inf)
        search = PointSearch(self.question.perspective, mission, latest - last_s)
        points_m = search.best_m(routes)
        plans = [stated_plan] if stated_plan else []
        for hover_m in (*others, *points_m):
            moved = build_network(mission.replace({"route.hover_m": hover_m}))
            plan = declared_program(self.own.question, moved).solve()
            plans += [plan] if plan else []
        if not plans and search.ended:
            raise SolverError(f"{LATE}, without a plan or proof that none exists")
        if not plans:
            reasons = ("no hover point was found that has a plan", *stated_plan.reasons)
            return stated_plan.model_copy(update={"reasons": reasons})
        figures = [(plan.hover_time_s, plan.mission_time_s, len(plan.route)) for plan in plans]
        chosen = plans[best(*zip(*figures, strict=True)) or 0]
        notes = (_gain(chosen, stated_plan), *chosen.notes)
        known = {"proof": PROOF, "status": Status.LOCALLY_OPTIMAL, "notes": notes}
        if search.ended:
            known = {"proof": TRIED, "status": Status.FEASIBLE, "notes": (LATE, *notes)}
        return chosen.model_copy(update=known)

    def shadow_prices(self, solutions: Sequence[Solution] | None = None) -> NoReturn:
        """Refused: the plan's mission, which states the point found, has shadow prices."""
        raise InputError(REFUSED.format("shadow prices"))

    def compile(self, engine: str | Engine | None = None) -> NoReturn:
        """Refused: the models do not know which buildings are in the way."""
        raise InputError(REFUSED.format("compiled program"))


def _gain(plan: Plan, own: Plan) -> str:
    """Note how much longer a plan hovers than one at the mission's own hover point."""
    hover_m = plan.mission.route.hover_m
    name = "w_U" if own.mission.route.hover_m is None else "route.hover_m"
    if plan is own:
        return f"hover point free: none was found that is better than {name}"
    point = "w_U" if hover_m is None else "({:.3f}, {:.3f}, {:.3f}) m".format(*hover_m)
    more_s = plan.hover_time_s - own.hover_time_s if own else 0.0
    gain = f" gives {more_s:.4f} s more than {name}" if own else f"; at {name} no plan exists"
    return f"hover point free: {point}{gain}"


def _declared(network: Network, which: Integers, rests: bool, perspective: Perspective) -> Model:
    """(P1) over w, which is taken to be in sight of the laser, Δ and T' for some routes."""
    mission, table, legs = network.mission, network.legs, network.routes.legs[which]
    beam = mission.laser and beam_of(mission)
    if why := flight_of(mission).needs_numbers or (beam and beam.needs_numbers):
        raise InputError(f"the program of a free hover point cannot be declared: {why}")
    flown = legs != NO_LEG
    to_w, from_w = (flown & (ends[legs] == HOVER) for ends in (table.end, table.start))
    other = flown & ~to_w & ~from_w
    known = replace(
        quantities(network, which, rests=rests, hover_open=True),
        flight_time_s=np.where(other, table.duration_s[legs], 0.0).sum(axis=1),
        flight_charge_As=np.where(other, table.charge_As[legs], 0.0).sum(axis=1),
        flight_energy_J=np.where(other, table.energy_J[legs], 0.0).sum(axis=1),
        hover_current_A=float(vehicle.hover_load(mission).current_A),
        hover_received_W=0.0,
    )
    model = Model("P1 with the hover point free: longest hover within reach of the device")
    w = [
        model.variable(f"hover_{axis}_m", f"{axis}_w", unit="m", lower=-math.inf) for axis in "xyz"
    ]
    values, places = Given.of(known, perspective), network.places.position_m
    before, after = (
        [
            Parameter(f"{name}_{axis}_m", f"{axis}_{name[0]}", "m", value)
            for axis, value in zip("xyz", places[end].T, strict=True)
        ]
        for name, end in (("before", table.start[legs[to_w]]), ("after", table.end[legs[from_w]]))
    )
    flight = flight_of(mission)
    arriving, leaving = flight.leg(_way(before, w)), flight.leg(_way(w, after))
    stages: dict[object, list[Stage | str]] = {
        name: [Stage(-i, t) for i, t in zip(leg.currents_A, leg.durations_s, strict=True)]
        for name, leg in ((TO_HOVER, arriving), (FROM_HOVER, leaving))
    }
    steps = [stages.get(s, [s]) if isinstance(s, str) else [s] for s in values.steps]
    charge_As = known.flight_charge_As + (arriving.charge_As + leaving.charge_As)
    energy_J = known.flight_energy_J + (arriving.energy_J + leaving.energy_J)
    at_w: dict[str, Quantity] = {
        "flight_time_s": known.flight_time_s + (arriving.duration_s + leaving.duration_s),
        "flight_charge_As": charge_As,
        "flight_energy_J": energy_J,
        "flight_voltage_V": energy_J / charge_As,
        "hover_distance_m": norm(_way(mission.link.device_m, w)),
        "hover_altitude_m": w[2],
    }
    if mission.laser is not None:
        lit = vehicle.charging(mission, (w[0], w[1], w[2]))
        at_w["hover_current_A"] = known.hover_current_A - lit.current_A
        at_w["hover_received_W"] = lit.power_W
    named: dict[str, Quantity] = {
        quantity.name: model.let(
            quantity.name,
            at_w[quantity.name],
            symbol=quantity.metadata["symbol"],
            unit=quantity.metadata["unit"],
            words=DESCRIPTIONS.get(quantity.name, ""),
        )
        for quantity in QUANTITIES
        if quantity.name in at_w
    }
    P1().declare(model, replace(values, **named, steps=list(chain.from_iterable(steps))))
    return model


def _way(start: Sequence[Quantity], end: Sequence[Quantity]) -> Vector:
    """The displacement from one point to another [m]."""
    return (end[0] - start[0], end[1] - start[1], end[2] - start[2])
