"""The best plan of a single mission as a row of a batch, by `optuav.solve`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from formulations.p1 import P1
from formulations.soc import PAPER
from optuav.errors import InputError, SolverError
from optuav.mission import Mission
from optuav.network.network import build_network
from optuav.network.places import ENDS
from optuav.network.variants import Variants
from optuav.solving.best_plans import CODES, STATUSES, Best, best_plans
from optuav.solving.outcome import TIMES
from optuav.solving.question import Question
from optuav.solving.solve import solve
from optuav.status import Status


def best_alone(mission: Mission | InputError, question: Question) -> Best:
    """The best plan of a mission; none of one that contradicts itself. Of several rests, the first.

    Why there is none is that of the perspective battery with one stop, where it has none either.
    """
    best = Best.none(1)

    def without(status: Status, reason: str) -> Best:
        best.status[:], best.reason[:] = STATUSES.index(status), CODES[reason]
        return best

    if isinstance(mission, InputError):
        return without(Status.INFEASIBLE, "contradiction")
    try:
        plan = solve(mission, **vars(question))
    except SolverError:
        return without(Status.UNKNOWN, "unknown")
    if plan.status in (Status.UNBOUNDED, Status.UNKNOWN, Status.ERROR):
        return without(plan.status, plan.status.value)
    if not plan:
        deadline = {"limits.deadline_s": np.array([mission.limits.deadline_s])}
        alike = replace(question, problem=P1(), perspective="battery")
        simpler = best_plans(Variants(build_network(mission), deadline), alike)
        names = [*CODES]
        return without(plan.status, names[int(simpler.reason[0]) or CODES["together"]])
    best.status[:], best.reason[:] = STATUSES.index(plan.status), CODES["none"]
    for name in (*TIMES, "flight_time_s", "mission_time_s"):
        getattr(best, name)[:] = getattr(plan, name)
    for name in PAPER:
        getattr(best, f"soc_{name}")[:] = (plan.soc or {}).get(name, np.nan)
    best.route[:] = 0
    if rests := [place for place in plan.route if place not in ENDS]:
        number = mission.buildings.names.index(rests[0])
        hover_first = plan.route.index("hover") < plan.route.index(rests[0])
        best.route[:] = 2 * number + 1 + hover_first
    return best
