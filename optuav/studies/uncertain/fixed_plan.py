"""Whether a plan that was made beforehand can still be flown when the world differs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from formulations.p1 import P1
from formulations.perspectives import AVAILABLE
from optuav.engines.arrays import Booleans
from optuav.errors import Fault, InputError
from optuav.mission import Mission, vehicle
from optuav.mission.places import ENDS, HOVER
from optuav.modelling import check
from optuav.plan import Plan
from optuav.studies.uncertain.ensemble import Base, Ensemble

CONDITIONS = {
    "legs and thrust": (),
    "link": ("P1.a",),
    "charge left": ("P1.b state of charge",),
    "never dry": ("P1.b not dry",),
    "never past full": ("P1.b not past full",),
    "deadline": ("P1.d",),
}
"""What a plan has to keep, and the constraints of (P1) by the beginning of their labels."""


@dataclass(frozen=True)
class FixedPlan:
    """Places, order and times that are flown as they were planned.

    Parameters
    ----------
    base
        The mission with its hover point where the plan has it, and the plan's itinerary alone.
    hover_time_s, rest_time_s
        Its times [s].
    """

    base: Base
    hover_time_s: float
    rest_time_s: float

    @classmethod
    def of(cls, plan: Plan, mission: Mission) -> FixedPlan:
        """The plan on a mission, which has the same places.

        Raises
        ------
        InputError
            If the plan's route is none of the mission.
        """
        place_m = [float(each) for each in vehicle.hover_point_m(plan.mission)]
        base = Base.of(mission.replace({"route.hover_m": place_m}))
        routes, names = base.worked_out.itineraries, base.worked_out.places.names
        for number, building in enumerate(routes.building.tolist()):
            stops = [ENDS[HOVER]] if building < 0 else [names[len(ENDS) + building], ENDS[HOVER]]
            if building >= 0 and not routes.rest_first[number]:
                stops.reverse()
            if tuple(stops) == tuple(plan.route[1:-1]):
                return cls(base.only(number), plan.hover_time_s, plan.rest_time_s)
        words = "a plan over the places of this mission, with one hover and at most one rest"
        raise InputError([Fault("plan", " → ".join(plan.route), words)])

    def kept(self, variants: Ensemble) -> dict[str, Booleans]:
        """Which conditions are kept, in every variant of the mission."""
        ensemble = Ensemble(self.base, variants.columns, variants.coverage_radius_m)
        every = np.arange(ensemble.count)
        route = np.zeros_like(every)
        rests = bool(self.base.worked_out.itineraries.building[0] >= 0)
        given = ensemble.quantities(every, route, rests=rests, steps=True)
        point = {"hover_time_s": self.hover_time_s}
        if rests:
            point["rest_time_s"] = self.rest_time_s
        able = ensemble.flyable & np.isfinite(ensemble.hover_load.current_A)
        kept = {
            name: np.broadcast_to(able[:, 0] if not labels else True, ensemble.count).copy()
            for name, labels in CONDITIONS.items()
        }
        for row in check(P1.model(given, AVAILABLE), point):
            for name, labels in CONDITIONS.items():
                if labels and row.label.startswith(labels):
                    kept[name] &= row.satisfied
        return kept
