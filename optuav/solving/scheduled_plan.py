"""Perspective `available` where packs take turns: from the simulated search to a plan."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from optuav.errors import Fault, InputError
from optuav.network.network import Network
from optuav.plan import Plan
from optuav.solving.plans import Part, plan_for, plan_without, planned_phases, soc_at_end
from optuav.solving.question import AUTO, Question
from optuav.solving.scheduled import CLOSER, STEP_S, longest_hover
from optuav.status import Status

ENGINE = "simulation"
PROBLEMS = ("P1", "P3", "P4")
"""Problems that ask for the longest hover, which is what is searched for."""

IN_SLOTS = "exhaustive: every pair of slots that could be better was simulated"
CONTINUOUS = (
    f"simulation on a grid of {STEP_S:g} s, refined to {CLOSER[-1]:g} s around the best, not proved"
)

TURNS = (
    "packs by schedule {!r}: one flies while the laser charges another; what full packs refuse is "
    "lost, and only battery tells so"
)


def scheduled_plan(asked: Question, network: Network, parts: Sequence[Part]) -> Plan:
    """The longest hover that the packs can deliver under the mission's schedule.

    Raises
    ------
    InputError
        If the question is one that only pooled packs can be asked.
    SolverError
        If the time limit passes before there is any plan.
    """
    _refuse(asked, network)
    choices = sorted(
        (int(route), any(each.name == "rest_time_s" for each in part.model.variables))
        for part in parts
        for route in part.routes
    )
    asked = replace(asked, engine=ENGINE)
    proof = CONTINUOUS if asked.slot_s is None else IN_SLOTS
    fewer = _fewer_routes(asked) if len(choices) > 1 else ""
    found = longest_hover(network, choices, asked.slot_s, asked.time_limit_s, fewer)
    if found is None:
        step_s = asked.slot_s or STEP_S
        why = (f"no pair of Δ and T' in steps of {step_s:g} s leaves a pack to fly on to the end",)
        return plan_without(asked, network, Status.INFEASIBLE, proof, why)
    route, hover_s, rest_s, ended = found
    notes = [TURNS.format(network.mission.battery.schedule)]
    if ended:
        proof = f"simulation that {ended}, not proved"
        notes.append(f"the search {ended}; there may be a longer hover, not all pairs were tried")
    flown = planned_phases(network, route, hover_s, rest_s)
    return plan_for(
        asked,
        network,
        engine=ENGINE,
        proof=proof,
        status=Status.FEASIBLE if asked.slot_s is None or ended else Status.OPTIMAL,
        notes=tuple(notes),
        phases=flown,
        soc=soc_at_end(network, route, flown, hover_s, rest_s),
    )


def _fewer_routes(asked: Question) -> str:
    """What to ask for to have fewer of the routes, in words; empty if nothing is left."""
    if asked.trajectory == "optimal":
        return "one trajectory"
    return "one order" if asked.order is None else ""


def _refuse(asked: Question, network: Network) -> None:
    schedule, faults = network.mission.battery.schedule, []
    words = f"under battery.schedule = {schedule!r} and perspective available"
    if asked.problem.name not in PROBLEMS:
        faults.append(Fault("problem", asked.problem.name, f"{', '.join(PROBLEMS)} {words}"))
    if asked.engine_name not in (AUTO, "grid"):
        faults.append(
            Fault("engine", repr(asked.engine_name), f"{AUTO} {words}: plans are simulated")
        )
    if faults:
        raise InputError(faults)
