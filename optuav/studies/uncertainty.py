"""The hover time under all uncertain values, and the hover of a fixed plan."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from formulations.p1 import P1
from formulations.soc import AVAILABLE
from optuav.arrays import Booleans, Floats
from optuav.errors import Fault, InputError
from optuav.mission import Mission
from optuav.modelling.check import evaluated
from optuav.network import vehicle
from optuav.network.network import Network, build_network
from optuav.network.routes import build_routes
from optuav.network.variants import Variants
from optuav.options import Perspective
from optuav.plan import Plan
from optuav.solving.assemble import quantities
from optuav.solving.question import checked_question
from optuav.status import SAME_S
from optuav.studies.batch import best_of
from optuav.studies.samples import Draws
from optuav.studies.scenarios import Scenarios

QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
LEGS, ALTITUDE = "legs and thrust", "altitude"
CONDITIONS = {
    "outage": "link",
    "state of charge": "charge left",
    "dry": "never dry",
    "past full": "never past full",
    "deadline": "deadline",
}
"""Limits of a fixed plan beside legs and altitude, by the kind of constraint of (P1)."""


@dataclass(frozen=True)
class FixedPlan:
    """A plan whose route, hover point and times [s] stay as they were planned."""

    # The mission with its hover point where the plan has it, and only the plan's itinerary.
    network: Network
    itinerary: int  # Number of that itinerary among all of the mission
    hover_time_s: float
    rest_time_s: float

    @classmethod
    def of(cls, plan: Plan, mission: Mission) -> FixedPlan:
        """Return the plan on a mission, or refuse one for other places or another route."""
        scene, other = (
            (one.route.origin_m, one.route.destination_m, devices_of(one), one.buildings)
            + ((one.laser.position_m,) if one.laser else ())
            for one in (plan.mission, mission)
        )
        if scene == other:
            points_m = [[*map(float, at)] for at in vehicle.hover_points_m(plan.mission)]
            keys = [f"devices[{k}].hover_m" for k in range(len(mission.devices))]
            keys = keys or ["route.hover_m"]
            network = build_network(mission.replace(dict(zip(keys, points_m, strict=True))))
            if mission.devices:
                flown = [name for name in plan.route if name in plan.hovers]
                order = [[device.name for device in mission.devices].index(x) for x in flown]
                routes = build_routes(network.legs, network.buildings, np.array([order]))
                network = replace(network, routes=routes)
            for number in range(len(network.routes)):
                if network.route_names(number) == plan.route:
                    only, times_s = network.only([number]), (plan.hover_time_s, plan.rest_time_s)
                    return cls(only, number, *times_s)
        words = "a plan over the places of this mission: the same origin, destination, device, "
        words += "laser and buildings, with one hover and at most one rest"
        raise InputError([Fault("plan", " → ".join(plan.route), words)])

    def conditions_held(
        self, variants: Variants, perspective: Perspective = AVAILABLE
    ) -> dict[str, Booleans]:
        """Return by condition the variants of the mission where the plan keeps it.

        Under ``"available"`` it can be flown where it keeps all of them.
        """
        variants_of_route = Variants(self.network, variants.columns)
        vars(variants_of_route)["coverage_radius_m"] = variants.coverage_radius_m
        numbers = np.arange(variants_of_route.count)
        rests = bool(self.network.routes.building[0] >= 0)
        values = quantities(variants_of_route, np.zeros_like(numbers), numbers, rests=rests)
        point = {"hover_time_s": self.hover_time_s}
        if rests:
            point["rest_time_s"] = self.rest_time_s
        names = (LEGS, *CONDITIONS.values(), ALTITUDE)
        kept = {name: np.ones(variants_of_route.count, bool) for name in names}
        kept[LEGS] &= variants_of_route.able[:, 0]
        for check in evaluated(P1().model(values, perspective), point):
            # A row without a kind bounds the altitude; or the ends, which all routes join.
            kept[CONDITIONS.get(check.constraint.kind, ALTITUDE)] &= check.satisfied
        return kept


def devices_of(mission: Mission) -> tuple[object, ...]:
    """Names and positions of the devices."""
    return tuple((device.name, device.position_m) for device in mission.served)


@dataclass(frozen=True)
class Chances:
    """Results over all samples of everything that is uncertain."""

    samples: int
    seed: int
    uncertain: tuple[str, ...]  # Keys that vary
    stated: bool  # Whether their spread was stated; else all are within 10 % of their values
    mean_s: float  # Mean hover time [s], with 0 for a sample without a plan, as in the quantiles
    # Hover times [s] that so large a share of the samples does not reach.
    quantiles_s: Mapping[float, float]
    no_plan: float  # Share of samples without a plan
    # Share of samples by the route of the best plan; the most frequent first.
    routes: Mapping[str, float]
    # Share of samples where the fixed plan keeps each condition, and where it keeps all of
    # them; None without a plan.
    kept: Mapping[str, float] | None
    flyable: float | None
    # Longest hover of each sample, at least the fixed plan's if that is feasible; 0 without.
    hover_times_s: Floats = field(repr=False, compare=False)


def chances(
    draws: Draws, perspective: Perspective, plan: FixedPlan | None, *, stated: bool
) -> Chances:
    """Return the results of the samples."""
    scenarios, samples = Scenarios(draws.mission, draws), draws.count
    question = checked_question(draws.mission, perspective=perspective)
    # Routes over several devices count by building and place of the rest, in any order of devices.
    roofs, places = draws.mission.buildings.names, 1 + len(draws.mission.served)
    hover_s, wins = np.empty(samples), np.zeros(1 + places * len(roofs), dtype=np.intp)
    kept, flyable = Counter[str](), 0
    for first, variants, (plans,) in best_of(scenarios, [question]):
        best_s, best = plans.hover_time_s, plans.route
        if plan is not None:
            conditions = plan.conditions_held(variants)
            kept.update({name: int(where.sum()) for name, where in conditions.items()})
            flyable += int(np.logical_and.reduce([*conditions.values()]).sum())
            if perspective != AVAILABLE:
                conditions = plan.conditions_held(variants, perspective)
            # The best plan's hover point moves with the reach of the radio, the fixed plan's stays:
            # where the best has no clear way or a longer one, the fixed plan may hover longer.
            better = np.logical_and.reduce([*conditions.values()])
            better &= ~(best_s >= plan.hover_time_s - SAME_S)
            best_s = np.where(better, plan.hover_time_s, best_s)
            best = np.where(better, plan.itinerary, best)
        hover_s[first : first + variants.count] = np.nan_to_num(best_s, nan=0.0)
        wins += np.bincount(best[~np.isnan(best_s)], minlength=len(wins))
    by_route = Counter[str]()
    for number, count in enumerate(wins.tolist()):
        by_route[f"by way of {roofs[(number - 1) // places]}" if number else "direct"] += count
    quantiles_s = np.quantile(hover_s, QUANTILES).tolist()
    return Chances(
        samples=samples,
        seed=draws.seed,
        uncertain=tuple(k.name for spread in draws.spreads for k in (spread.key, *spread.along)),
        stated=stated,
        mean_s=float(np.mean(hover_s)),
        quantiles_s=dict(zip(QUANTILES, quantiles_s, strict=True)),
        no_plan=(samples - int(wins.sum())) / samples,
        routes={name: count / samples for name, count in by_route.most_common() if count},
        kept={name: count / samples for name, count in kept.items()} or None,
        flyable=None if plan is None else flyable / samples,
        hover_times_s=hover_s,
    )
