"""Answers of the explorer as plain data: the page draws them and computes nothing."""

import json
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any, TypeAlias

import numpy as np

from formulations.soc import AVAILABLE, LABELS
from optuav.arrays import Floats
from optuav.diagnosis.explain import explain_plan
from optuav.diagnosis.in_words import (
    MAY_BE_IDLE,
    KeyWithoutEffect,
    curve,
    gain_figure,
    header,
    idle,
    key_of,
    price_words,
    symbol_and_value,
    verdict,
)
from optuav.diagnosis.report import Explanation
from optuav.errors import Fault, InputError, SolverError
from optuav.explorer.pictures import picture, pictures
from optuav.explorer.presets import presets
from optuav.explorer.slider_words import by_key, in_slider_words, repair_row
from optuav.explorer.state import Control, State, controls, device_keys, options_of
from optuav.mission import Mission
from optuav.mission.keys import stated_value
from optuav.mission.mission import toml_of
from optuav.network.map_extent import Scene, scene
from optuav.network.places import DESTINATION, ORIGIN
from optuav.plan import Plan
from optuav.plan.display import (
    Levels,
    LowLanding,
    low_landings,
    reserve_from_s,
    round_step,
    rounded_up,
    thinned,
    wells_over_plan,
)
from optuav.plan.plane import ROLES, SAMPLES, Plane
from optuav.plan.summary import facts
from optuav.presentation.numbers import percent
from optuav.solving import Program, formulate
from optuav.solving.program import route_model_of
from optuav.solving.route_plan import route_plan
from optuav.status import Status

MOST_STEPS = 16  # Steps along the longer side of a map
EMPTY = 1e-5  # Share of the capacity that counts as an empty well
MOST_BUILDINGS = 2_000
FEASIBLE_IF = "A plan becomes possible with any one of these changes"
SOLVE_S = 10.0  # Time limit of an engine [s]
HOUR_S = 3600.0

ANGLES = np.linspace(0.0, 2.0 * np.pi, 91)
RIM = np.stack([np.cos(ANGLES), np.sin(ANGLES)], axis=1)  # A circle of radius 1

Data: TypeAlias = dict[str, Any]
Rows: TypeAlias = Sequence[tuple[str, str]]


def answers(base: Mission, stated: object) -> Data:
    """Return a page's view of a mission in a state: plain JSON; or ``faults``, in words."""
    return answered(base, stated)[0]


def answered(base: Mission, stated: object) -> tuple[Data, Plan | None]:
    """Return `answers` and the plan that is shown; None where there are faults."""
    number = stated.get("number") if isinstance(stated, Mapping) else None
    number = number if isinstance(number, int) else None  # JSON can ask for 1e999, and not answer
    try:
        return _answers(base, State.of(stated))
    except InputError as error:
        faults = [{"key": fault.key, "words": str(fault)} for fault in error.faults]
    except SolverError as error:
        faults = [{"key": "", "words": str(error)}]
    return {"number": number, "faults": faults}, None


def refuse_many(mission: Mission) -> None:
    """Refuse a mission with more buildings than a page can draw."""
    if (count := len(mission.buildings)) > MOST_BUILDINGS:
        words = (
            f"the explorer accepts at most {MOST_BUILDINGS} buildings; optuav solve accepts more"
        )
        raise InputError([Fault("buildings", str(count), words)])


def _answers(base: Mission, state: State) -> tuple[Data, Plan]:
    """The answer to a state that is valid."""
    mission = state.mission(base)
    problem = state.question(mission)
    asked: Data = {"perspective": state.perspective, "time_limit_s": SOLVE_S}
    program = formulate(mission, problem, **asked)
    plan = program.solve()
    explained = explain_plan(program, plan) if plan or state.repairs else Explanation(plan)
    flight = plan if plan else _flight(program, plan)
    still = dict(idle(explained, program.network))
    notes = [("Note", note) for note in explained.notes if note not in plan.notes]
    found: Data = {
        "number": state.number,
        "name": mission.name,
        "controls": [_control(control, mission, still) for control in controls(base)],
        "options": options_of(mission),
        "presets": presets(base),
        "verdict": header(program, explained),
        "map": _map(mission, flight),
        "wells": _wells(flight, alone=not plan) if flight else None,
        "plane": _plane(program, plan, state.axes),
        "pictures": pictures(program.network),
        **_reasons(explained, [*facts(plan), *notes]),
    }
    if state.picture is not None:
        drawn = picture(state.picture, program, plan, state.building)
        why_none = in_slider_words(drawn.get("words", ""), mission)
        found["picture"] = drawn | ({"words": why_none} if why_none else {})
    if state.file is not None:
        as_toml = state.file == "mission"
        text = toml_of(mission.to_dict()) if as_toml else json.dumps(plan.to_dict(), indent=2)
        stem = re.sub(r"[^\w.-]+", "-", mission.name).strip("-.") or "mission"
        found["file"] = {"name": f"{stem}.{'toml' if as_toml else 'json'}", "text": text}
    return found, plan


def _flight(program: Program, none: Plan) -> Plan | None:
    """The shortest flight without a stay, to show why there is no plan; None without a route."""
    if not program.parts:
        return None
    part, entry = route_model_of(program, none)
    route = int(part.routes[entry])
    asked, network, feasible = program.question, program.network, Status.FEASIBLE
    flight = route_plan(
        asked, network, route, (0.0, 0.0), engine="", proof=none.proof, status=feasible
    )
    return flight.model_copy(update={"flyable": not flight.warnings})


def _control(control: Control, mission: Mission, still: Mapping[str, KeyWithoutEffect]) -> Data:
    """A control with its value, the whole vector of a component, and what changes nothing."""
    value: Any = stated_value(mission, control.key)
    whole = None if control.axis is None else [*value]
    value = value if whole is None else whole[control.axis or 0]
    idle = still[control.key]._asdict() if control.key in still else None
    always = mission.limits.keep_soc == "always" if control.key == "limits.min_soc" else None
    kept = control.key in MAY_BE_IDLE  # Room for the words on it
    entries = {"value": value, "whole": whole, "idle": idle, "kept": kept, "always": always}
    return {**asdict(control), **entries}


def _map(mission: Mission, plan: Plan | None) -> Data:
    """The places of a mission [m], the reach of laser and links, and the route with its stops.

    Each device has the key that moves it, the place where the UAV hovers over it, and the rim of
    the disc that its link reaches.
    """
    shown = scene(mission)
    places, laser = shown.places, mission.laser
    lit = places.laser_sight
    lines_m, clear = shown.sight_lines()
    ends = {
        places.names[place]: _rounded(places.position_m[place]) for place in (ORIGIN, DESTINATION)
    }
    step_m = round_step(float(np.ptp(shown.corners_m, axis=0).max()) or 1.0, MOST_STEPS)
    low, high = shown.corners_m / step_m
    discs = zip(mission.served, device_keys(mission), shown.disc_radii_m, strict=True)
    return {
        "bounds": _rounded(shown.corners_m),
        "window": _rounded(step_m * np.stack([np.floor(low), np.ceil(high)])),
        "buildings": [
            {
                "name": places.names[place],
                "at": _rounded(places.position_m[place]),
                "ring": _rounded(ring),
                "lit": bool(lit[place]),
            }
            for place, ring in zip(places.buildings, shown.rings, strict=True)
        ],
        "sight": [
            {"line": _rounded(line), "clear": bool(sees)}
            for line, sees in zip(lines_m, clear, strict=True)
        ],
        **ends,
        "hovers": [
            {"name": places.names[place], "at": _rounded(places.position_m[place])}
            for place in places.hovers[places.exists[places.hovers]].tolist()
        ],
        "devices": [
            {
                "name": device.name if mission.devices else "device",
                "place": device.name,
                "key": key,
                "at": _rounded(np.array(device.position_m)),
                "rim": _rim(device.position_m, radius_m),
            }
            for device, key, radius_m in discs
        ],
        "laser": None if laser is None else [*laser.position_m],
        "route": _rounded(_points_m(shown, plan)) if plan else None,
        "stops": [asdict(stop) for stop in plan.stops] if plan else [],
    }


def _rim(device_m: Sequence[float], radius_m: float) -> Any:
    """The rim of a disc on the map [m]; None if there is none."""
    return _rounded(np.array(device_m[:2]) + radius_m * RIM) if math.isfinite(radius_m) else None


def _points_m(shown: Scene, plan: Plan) -> Floats:
    """Places and waypoints of a plan (point, 3) [m] in order."""
    origin_m, *ends_m = shown.positions(plan.route)
    legs = zip(plan.waypoints_m, ends_m, strict=True)
    return np.array([origin_m, *(at for by, end_m in legs for at in (*by, end_m))])


def _wells(plan: Plan, *, alone: bool) -> Data:
    """Charge in both wells over time, the phases, and the levels that matter [s], [Ah].

    A flight that is drawn alone, as there is no plan, ends where it falls.
    """
    course, (dry_s, overfull_s) = thinned(wells_over_plan(plan)), plan.limits_passed_s()
    if alone and dry_s is not None:  # Nothing flies on from there
        before = course.time_s < dry_s
        ends = (np.interp(dry_s, course.time_s, values) for values in course)
        course = Levels(*(np.append(v[before], end) for v, end in zip(course, ends, strict=True)))
    time_s, available_As, bound_As = course
    total_As, deadline_s = bound_As + available_As, plan.mission.limits.deadline_s
    mission, full_As = plan.mission, float(plan.mission.pool.capacity_As)
    end_s, end_As = plan.mission_time_s, float(total_As[-1])
    least_As, said = mission.limits.min_soc * full_As, verdict(plan)
    low = low_landings(plan)
    if alone:
        lacks = dry_s is None and end_As < least_As
        low = [LowLanding(end_s, end_As, "less than must remain")] if lacks else []
    return {
        "alone": alone,
        "event": said.event,
        "reason": said.reason,
        "time_s": _rounded(time_s, 3),
        "bound_Ah": _rounded(bound_As / HOUR_S, 5),
        "total_Ah": _rounded(total_As / HOUR_S, 5),
        "upper_Ah": _rounded(np.maximum(total_As, bound_As) / HOUR_S, 5),
        "least": percent(mission.limits.min_soc),
        "deadline_s": deadline_s,
        "spare_s": deadline_s - plan.mission_time_s,
        "empty_s": [e.end_s for e in plan.phases if sum(e.available_As) < EMPTY * full_As],
        "axes": [
            rounded_up(max(0.0 if alone else deadline_s, plan.mission_time_s)),
            rounded_up(1.1 * full_As / HOUR_S),
        ],
        "full_Ah": full_As / HOUR_S,
        "least_Ah": least_As / HOUR_S,
        "always": mission.limits.keep_soc == "always",
        "holds_s": [reserve_from_s(mission, end_s), end_s],
        "low": [
            {"time_s": time_s, "charge_Ah": charge_As / HOUR_S, "words": words}
            for time_s, charge_As, words in low
        ],
        "phases": [
            {
                "kind": e.kind,
                "at": e.end_place,
                "by": _rounded(np.array(e.waypoints_m)),
                "start_s": e.start_s,
                "end_s": e.end_s,
            }
            for e in plan.phases
        ],
        "dry_s": dry_s,
        "overfull_s": overfull_s,
    }


def _plane(program: Program, plan: Plan, axes: Sequence[float]) -> Data:
    """The plane of the chosen route, or of the shortest flight; or ``words`` on why none exists.

    Its axes end at stated times, rest and hover [s], or at round ones.
    """
    mission = program.network.mission
    if program.question.perspective == AVAILABLE and mission.battery.takes_turns:
        return {"words": "No diagram of times: packs that take turns are only simulated."}
    if not program.parts:
        return {"words": "No diagram of times: no route can be flown."}
    part, entry = route_model_of(program, plan)
    model, way = part.model, program.network.route_names(int(part.routes[entry]))
    marked = [(plan.rest_time_s, plan.hover_time_s)] if plan else []
    try:
        shown = Plane(model, model.row(entry)).sampled(mission.limits, marked, axes[::-1])
    except InputError as error:
        return {"words": str(error)}
    return {
        "route": way,
        "chosen": bool(plan),
        "rests": len(model.variables) > 1,
        "hover_s": shown.ends_s[0],
        "rest_s": shown.ends_s[1],
        "round_s": shown.round_s[::-1],
        "samples": SAMPLES,
        "limits": [
            {**words._asdict(), "forbids": cut.forbids, "excess": cut.whole}
            for cut in shown.cuts
            if (words := curve(cut.constraint, way, mission)).role != "bounds"
        ],
        "grid": {
            "hover_s": _rounded(shown.grid_s[0]),
            "rest_s": _rounded(shown.grid_s[1]),
            "feasible": shown.feasible.astype(int).tolist(),
        },
        "best": marked[0] if marked else None,
    }


def _reasons(explained: Explanation, facts: Rows) -> Data:
    """Limits that bind; and tables: changes that give a plan, why there is none, limits, proof."""
    sides = [e for e in explained.constraints if e.binds or e.kind not in LABELS]
    limits = sorted(sides, key=lambda side: not side.binds)
    rows = [(e.words, e.label, e.statement, e.both_sides, e.spare) for e in limits]
    prices = [price for price in explained.prices if price.matters]
    steps = [price_words(explained, price) for price in prices if price.solved_again]
    mission, sliders = explained.plan.mission, by_key(explained.plan.mission)
    reasons = [in_slider_words(reason, mission) for reason in explained.plan.reasons]
    ranked = sorted(explained.repairs, key=lambda repair: repair.key not in sliders)
    repairs = [repair_row(repair, sliders.get(repair.key)) for repair in ranked]
    worth = (
        f"Gain: {explained.objective} per unit of a parameter, as a slope, with the others fixed"
    )
    tables: list[Data] = [
        {"title": FEASIBLE_IF, "rows": repairs},
        {"title": "Why there is no plan", "lines": reasons},
        {
            "title": "Limits; y1_k is the charge in the available well after step k",
            "heads": ["limit", "constraint", "as stated", "in numbers", "to spare"],
            "rows": rows,
        },
        {
            "title": worth,
            "heads": ["parameter", "value", "less", "more"],
            "rows": [
                (
                    key_of(price),
                    symbol_and_value(price),
                    gain_figure(price.less),
                    gain_figure(price.more),
                )
                for price in prices
            ],
            "note": "For whole steps, solved again:" if steps else "",
            "lines": steps,
        },
        {"title": "Question, answer and proof", "rows": facts},
    ]
    binding = [(ROLES.get(e.kind, "bounds"), e.words) for e in limits if e.binds]
    return {
        "binding": [{"role": role, "words": words} for role, words in binding],
        "tables": [table for table in tables if table.get("rows") or table.get("lines")],
        "repairable": bool(reasons) and not repairs,
    }


def _rounded(values: Floats, digits: int = 3) -> Any:
    """Numbers of an array as lists, rounded."""
    return np.round(values, digits).tolist()
