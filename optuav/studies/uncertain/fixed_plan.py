"""Whether a plan that was made beforehand can still be flown when the world differs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from formulations.p1 import P1
from formulations.perspectives import AVAILABLE
from optuav.arrays import Booleans
from optuav.errors import Fault, InputError
from optuav.mission import Mission
from optuav.modelling.check import evaluated
from optuav.network import vehicle
from optuav.network.places import ENDS, HOVER
from optuav.plan import Plan
from optuav.studies.uncertain.ensemble import Base, Ensemble

PLAN = "a plan over the places of this mission"
LEGS = "legs and thrust"
CONDITIONS = {
    LEGS: "",
    "link": "outage",
    "charge left": "state of charge",
    "never dry": "dry",
    "never past full": "past full",
    "deadline": "deadline",
}
"""What a plan has to keep, and the kind of those constraints of (P1)."""


class Judged(NamedTuple):
    """A fixed plan in many variants; all arrays have one entry a variant.

    Parameters
    ----------
    kept
        Which of the `CONDITIONS` are kept.
    flyable
        Whether all of them are.
    feasible
        Whether it is a feasible plan in the perspective that was asked for.
    """

    kept: dict[str, Booleans]
    flyable: Booleans
    feasible: Booleans


@dataclass(frozen=True)
class FixedPlan:
    """Places, order and times that are flown as they were planned.

    Parameters
    ----------
    base
        The mission with its hover point where the plan has it, and the plan's itinerary alone.
    itinerary
        Number of that itinerary among all of the mission.
    hover_time_s, rest_time_s
        Its times [s].
    """

    base: Base
    itinerary: int
    hover_time_s: float
    rest_time_s: float

    @classmethod
    def of(cls, plan: Plan, mission: Mission) -> FixedPlan:
        """The plan on a mission, which has the same places.

        Raises
        ------
        InputError
            If the plan was made for other places, or its route is none of the mission.
        """
        made_for, here = _scene(plan.mission), _scene(mission)
        if moved := [words for words in here if made_for[words] != here[words]]:
            told = f"{PLAN}, not with another {' or '.join(moved)}"
            raise InputError([Fault("plan", " → ".join(plan.route), told)])
        place_m = [float(each) for each in vehicle.hover_point_m(plan.mission)]
        base = Base.of(mission.replace({"route.hover_m": place_m}))
        routes, names = base.worked_out.routes, base.worked_out.places.names
        for number, building in enumerate(routes.building.tolist()):
            stops = [ENDS[HOVER]] if building < 0 else [names[len(ENDS) + building], ENDS[HOVER]]
            if building >= 0 and not routes.rest_first[number]:
                stops.reverse()
            if tuple(stops) == tuple(plan.route[1:-1]):
                return cls(base.only(number), number, plan.hover_time_s, plan.rest_time_s)
        told = f"{PLAN}, with one hover and at most one rest"
        raise InputError([Fault("plan", " → ".join(plan.route), told)])

    def judged(self, variants: Ensemble, perspective: str) -> Judged:
        """The plan in every variant of the mission, which is solved in a perspective."""
        ensemble = Ensemble(self.base, variants.columns, variants.coverage_radius_m)
        every = np.arange(ensemble.count)
        rests = bool(self.base.worked_out.routes.building[0] >= 0)
        given = ensemble.quantities(every, np.zeros_like(every), rests=rests, steps=True)
        point = {"hover_time_s": self.hover_time_s}
        if rests:
            point["rest_time_s"] = self.rest_time_s
        able = ensemble.flyable & np.isfinite(ensemble.hover_load.current_A)
        legs = np.broadcast_to(able[:, 0], ensemble.count)
        kept = {name: np.ones(ensemble.count, bool) for name in CONDITIONS} | {LEGS: legs}
        for row in evaluated(P1.model(given, AVAILABLE), point):
            for name, kind in CONDITIONS.items():
                if kind and row.constraint.kind == kind:
                    kept[name] &= row.satisfied
        flyable = np.logical_and.reduce(list(kept.values()))
        feasible = flyable
        if perspective != AVAILABLE:
            feasible = legs
            for row in evaluated(P1.model(given, perspective), point):
                feasible = feasible & row.satisfied
        return Judged(kept, flyable, feasible)


def _scene(mission: Mission) -> dict[str, Any]:
    """What a plan takes for granted when it is flown elsewhere, by its name in words."""
    laser = mission.laser
    return {
        "origin": mission.route.origin_m,
        "destination": mission.route.destination_m,
        "device": mission.link.device_m,
        "place of the laser": laser and laser.position_m,
        "set of buildings": mission.buildings,
    }
