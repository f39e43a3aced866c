"""What the explorer shows, as plain data: the page draws it and computes nothing."""

import json
import math
import re
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any, TypeAlias

import numpy as np

from formulations.soc import AVAILABLE, LABELS
from optuav.arrays import Floats
from optuav.diagnosis.explain import explain
from optuav.diagnosis.report import Explanation
from optuav.diagnosis.wording import name, sentence, signed, with_unit
from optuav.errors import Fault, InputError, SolverError
from optuav.explorer.state import OPTIONS, Control, State, controls
from optuav.mission import Mission
from optuav.mission.keys import now_of
from optuav.mission.mission import toml_of
from optuav.modelling import Constraint
from optuav.modelling.writer import Text
from optuav.network import vehicle
from optuav.network.places import DESTINATION, HOVER, ORIGIN
from optuav.network.scene import scene
from optuav.plan import Plan
from optuav.plan.display import levels, verdict
from optuav.plan.plane import constraint_name, cuts, feasible, limits, thinned, worth_seeing
from optuav.plan.summary import heading, outcome, remarks, times
from optuav.solving import Program, formulate
from optuav.solving.outcome import shortest_flight

SAMPLES = 61  # Of the plane along an axis
MOST_POINTS = 25  # Of its grid along an axis
WHOLE = 100_000  # The largest excess of a constraint in the plane, as whole numbers
MOST_BUILDINGS = 2_000
LACKING = 1e-8  # Share of the capacity by which the available well is below 0
MOST_MOMENTS = 400  # Of the wells over time
AXES = range(3)
SOLVE_S = 10.0  # Longest that an engine may take [s]

ANGLES = np.linspace(0.0, 2.0 * np.pi, 91)
RIM = np.stack([np.cos(ANGLES), np.sin(ANGLES)], axis=1)  # A circle of radius 1

Data: TypeAlias = dict[str, Any]


def answers(base: Mission, stated: object) -> Data:
    """What a page shows of a mission in a state: plain JSON; or ``faults``, in words."""
    return answered(base, stated)[0]


def answered(base: Mission, stated: object) -> tuple[Data, Plan | None]:
    """As `answers`, with the plan that is shown; None where there are faults."""
    number = stated.get("number") if isinstance(stated, Mapping) else None
    number = number if isinstance(number, int) else None  # JSON can ask for 1e999, and not answer
    try:
        return _answers(base, State.of(stated))
    except InputError as error:
        faults = [{"key": each.key, "words": str(each)} for each in error.faults]
    except SolverError as error:
        faults = [{"key": "", "words": str(error)}]
    return {"number": number, "faults": faults}, None


def refuse_many(mission: Mission) -> None:
    """Refuse a mission with more buildings than a page can draw."""
    if (count := len(mission.buildings)) > MOST_BUILDINGS:
        words = f"at most {MOST_BUILDINGS} are explored; optuav solve takes more"
        raise InputError([Fault("buildings", str(count), words)])


def _answers(base: Mission, state: State) -> tuple[Data, Plan]:
    """The answer to a state that is valid."""
    mission, problem = state.mission(base), state.question
    asked: Data = {"perspective": state.perspective, "time_limit_s": SOLVE_S}
    program = formulate(mission, problem, **asked)
    explained = _explained(program, state.repairs)
    plan = explained.plan
    notes = [("Note", each) for each in explained.notes if each not in plan.notes]
    files: dict[str | None, tuple[str, object]] = {
        "mission": ("toml", toml_of(mission.to_dict()) if state.file == "mission" else ""),
        "plan": ("json", json.dumps(plan.to_dict(), indent=2) if state.file == "plan" else ""),
    }
    found: Data = {
        "number": state.number,
        "name": mission.name,
        "controls": [_control(each, mission) for each in controls(base)],
        "options": {**OPTIONS, "building": mission.buildings.names},
        "verdict": {"text": verdict(plan), "good": bool(plan) and plan.flyable is not False},
        "facts": [*heading(plan), *_facts(plan), *remarks(plan), *notes],
        "map": _map(mission, plan),
        "wells": _wells(plan) if plan else None,
        "plane": _plane(program, plan),
        **_reasons(explained),
    }
    if state.file is not None:
        ending, text = files[state.file]
        stem = re.sub(r"[^\w.-]+", "-", mission.name).strip("-.") or "mission"
        found["file"] = {"name": f"{stem}.{ending}", "text": text}
    return found, plan


def _control(control: Control, mission: Mission) -> Data:
    """A control with its value in a mission, and with the whole vector of a component."""
    key = control.key if control.axis is None else f"{control.key}[{control.axis}]"
    whole = None if control.axis is None else [now_of(mission, f"{control.key}[{k}]") for k in AXES]
    return {**asdict(control), "value": now_of(mission, key), "whole": whole}


def _explained(program: Program, repairs: bool) -> Explanation:
    """The plan with what binds and prices; what is to be repaired only if it is asked for."""
    plan = program.solve()
    return explain(program) if plan or repairs else Explanation(plan)


def _facts(plan: Plan) -> list[tuple[str, str]]:
    """Times, route, charge and what binds, in words."""
    if not plan:
        return []
    taken = ((name, f"{time_s:.2f} s, {words}") for name, time_s, words in times(plan))
    return [*taken, *outcome(plan)]


def _map(mission: Mission, plan: Plan) -> Data:
    """The places of a mission [m], the reach of laser and link, and the route with its stops."""
    shown = scene(mission)
    places, laser = shown.places, mission.laser
    corners_m, count = mission.buildings.outlines()
    rings = np.split(corners_m, np.cumsum(count))[:-1]
    lit, current_A = places.laser_sight, places.charge_current_A
    lines_m, clear = shown.sight_lines()
    ends = {places.names[each]: _listed(places.position_m[each]) for each in (ORIGIN, DESTINATION)}
    hover = places.position_m[HOVER] if places.exists[HOVER] else None
    radius_m, device_m = shown.disc_radius_m, np.array(mission.link.device_m)
    return {
        "bounds": _listed(shown.corners_m),
        "buildings": [
            {
                "name": places.names[place],
                "at": _listed(places.position_m[place]),
                "ring": _listed(ring),
                "lit": bool(lit[place]),
                "current_A": round(float(current_A[place]), 3),
            }
            for place, ring in zip(places.buildings, rings, strict=True)
        ],
        "sight": [
            {"line": _listed(line), "clear": bool(sees)}
            for line, sees in zip(lines_m, clear, strict=True)
        ],
        **ends,
        "hover": None if hover is None else _listed(hover),
        "device": _listed(device_m),
        "radius_m": round(radius_m, 3) if math.isfinite(radius_m) else None,
        "rim": _listed(device_m[:2] + radius_m * RIM) if math.isfinite(radius_m) else None,
        "laser": None if laser is None else [*laser.position_m],
        "route": _listed(shown.positions(plan.route)) if plan else None,
        "stops": [asdict(each) for each in plan.stops] if plan else [],
    }


def _wells(plan: Plan) -> Data:
    """Charge in both wells over time, the phases, and the levels that matter [s], [A s]."""
    course = levels(plan)
    every = 1 + len(course.time_s) // MOST_MOMENTS
    time_s, available_As, bound_As = (np.append(each[:-1:every], each[-1]) for each in course)
    total_As = bound_As + available_As
    mission, full_As = plan.mission, float(vehicle.pool(plan.mission).capacity_As)
    return {
        "time_s": _listed(time_s, 3),
        "bound_As": _listed(bound_As, 1),
        "total_As": _listed(total_As, 1),
        "upper_As": _listed(np.maximum(total_As, bound_As), 1),
        "lacks": bool((available_As < -LACKING * full_As).any()),
        "full_As": full_As,
        "least_As": mission.limits.min_soc * full_As,
        "phases": [
            {"kind": e.kind, "at": e.end_place, "start_s": e.start_s, "end_s": e.end_s}
            for e in plan.phases
        ],
        "dry_s": plan.runs_dry_s,
        "overfull_s": plan.overfull_s,
    }


def _plane(program: Program, plan: Plan) -> Data:
    """The plane of the chosen route, or of the shortest flight; or ``words`` on why there is none.

    What a constraint leaves over is in whole numbers, by row of Δ from below: 0 on its curve.
    """
    mission, network = program.network.mission, program.network
    if program.question.perspective == AVAILABLE and mission.battery.takes_turns:
        return {"words": "Packs that take turns are simulated: there is no plane."}
    if not program.parts:
        return {"words": "No route can be flown: there is no plane."}
    number, entry = _chosen(program, plan) if plan else shortest_flight(network, program.parts)
    part = program.parts[number]
    model, row, route = part.model, part.model.row(entry), part.routes[entry]
    marked = [(plan.rest_time_s, plan.hover_time_s)] if plan else []
    try:
        counted = worth_seeing(model, row, mission.limits.slot_s, marked, SAMPLES)
    except InputError as error:
        return {"words": str(error)}
    ends = [limits(values_s, [p[1 - k] for p in marked]) for k, values_s in enumerate(counted)]
    y, x = (np.linspace(*each, SAMPLES) for each in ends)
    (upward_s, across_s), one_of = thinned(counted, MOST_POINTS)
    way = network.route_names(int(route))
    found = [*cuts(model, row, x, y)]
    names = [constraint_name(each.constraint, way) for each in found]
    return {
        "route": way,
        "chosen": bool(plan),
        "rests": len(model.variables) > 1,
        "hover_s": ends[0],
        "rest_s": ends[1],
        "samples": SAMPLES,
        "constraints": [
            {
                "name": label
                if names.count(label) == 1
                else f"{label}: {_stated(each.constraint)}",
                "forbids": each.forbids,
                "holds_nowhere": float(each.excess.max()) < 0.0,
                "excess": _whole(each.excess),
            }
            for each, label in zip(found, names, strict=True)
        ],
        "grid": {
            "slot_s": mission.limits.slot_s,
            "one_of": one_of,
            "hover_s": _listed(upward_s),
            "rest_s": _listed(across_s),
            "feasible": feasible(model, row, upward_s, across_s).astype(int).tolist(),
        },
        "best": marked[0] if marked else None,
    }


def _stated(constraint: Constraint) -> str:
    """A constraint as it is declared, where its label alone does not tell it from others."""
    notation = Text()
    return notation.write(constraint.relation).replace(notation.after, " ")


def _chosen(program: Program, plan: Plan) -> tuple[int, int]:
    """Part and entry of the route of a plan."""
    return next(
        (number, entry)
        for number, part in enumerate(program.parts)
        for entry, route in enumerate(part.routes.tolist())
        if program.network.route_names(route) == plan.route
    )


def _reasons(explained: Explanation) -> Data:
    """What binds and what it is worth; or why there is no plan, and what would make one."""
    sides = [e for e in explained.constraints if e.binds or e.kind not in LABELS]
    worth = [e for e in explained.prices if e.matters]
    return {
        "constraints": [
            {
                "label": each.label,
                "statement": each.statement,
                "figures": each.figures,
                "spare": "binds" if each.binds else with_unit(each.slack, each.unit),
                "binds": each.binds,
            }
            for each in sorted(sides, key=lambda side: not side.binds)
        ],
        "prices": [
            {
                "key": name(each),
                "value": f"{each.symbol} = {with_unit(each.value, each.unit)}",
                "less": signed(each.less),
                "more": signed(each.more),
                "words": sentence(explained, each) if each.solved_again else "",
            }
            for each in worth
        ],
        "objective": explained.objective,
        "reasons": explained.plan.reasons,
        "repairs": [each.row for each in explained.repairs],
    }


def _whole(excess: Floats) -> list[int]:
    """Numbers as whole ones, the largest as `WHOLE`; what is no number counts as not held."""
    known = np.where(np.isfinite(excess), excess, np.where(excess > 0.0, 1e300, -1e300))
    finite = np.abs(excess[np.isfinite(excess)]).max(initial=0.0) or 1.0
    scaled = np.clip(known / finite, -1.0, 1.0) * WHOLE
    whole: list[int] = np.rint(scaled).astype(int).ravel().tolist()
    return whole


def _listed(values: Floats, digits: int = 3) -> Any:
    """Numbers of an array as lists, rounded."""
    return np.round(values, digits).tolist()
