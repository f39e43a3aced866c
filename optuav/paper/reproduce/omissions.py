"""What the paper leaves out: plans that cannot be flown, readings that differ, speeds."""

from __future__ import annotations

from collections.abc import Iterator

from optuav import plots
from optuav.mission import Mission
from optuav.network import vehicle
from optuav.paper.reproduce.exhibit import OURS, Exhibit, LeftOut, heading, number, stem
from optuav.paper.reproduce.perspectives import deadlines_s
from optuav.paper.reproduce.plans import no_plan, solve, why
from optuav.plan import Plan
from optuav.plots.charge import course
from optuav.plots.files import modelled_leg


def runs_dry(mission: Mission) -> Iterator[Exhibit | LeftOut]:
    """The available well over the direct path, which η1 says nothing of."""
    plan = solve(mission, "P3", perspective="battery")
    if not plan:
        yield no_plan(plan)
        return
    level = 100.0 * plan.phases[-1].available_As[0] / float(vehicle.pool(mission).capacity_As)
    findings = [
        f"η1 = {100.0 * (plan.soc or {})['battery']:.2f} % is left, but the available well ends at "
        f"{number(level, 1)} % of the capacity."
    ]
    if plan.runs_dry_s is not None:
        findings.append(f"It is empty at {plan.runs_dry_s:.2f} s of {plan.mission_time_s:.2f} s.")
    kept = solve(mission, "P3", perspective=OURS)
    findings.append(
        f"With a well that lasts, Δ = {kept.hover_time_s:.2f} s."
        if kept
        else f"With a well that lasts there is no plan: {why(kept)}."
    )
    yield Exhibit(
        f"runs-dry.{stem(mission)}",
        f"The wells over the direct path of {mission.name}: Δ = {plan.hover_time_s:.2f} s",
        plots.battery(plan).wells,
        _course(plan),
        tuple(findings),
    )


def overcharges(mission: Mission) -> Iterator[Exhibit | LeftOut]:
    """Resting first charges a battery that is nearly full."""
    if not mission.buildings:
        yield LeftOut("", "the mission has no building to rest on")
        return
    plans = [
        solve(mission, "P4", building=each.name, order="rest-first", perspective="battery")
        for each in mission.buildings
    ]
    found = [plan for plan in plans if plan]
    if not found:
        yield no_plan(plans[0])
        return
    plan = max(found, key=lambda each: each.hover_time_s)
    pool = vehicle.pool(mission)
    highest = 100.0 * float(course(pool, plan).available_As.max() / pool.full.available_As)
    when = "" if plan.overfull_s is None else f", which is full from {plan.overfull_s:.2f} s on"
    yield Exhibit(
        f"overcharges.{stem(mission)}",
        f"The wells where {mission.name} rests first, on {plan.route[1]}: Δ = "
        f"{plan.hover_time_s:.2f} s, T' = {plan.rest_time_s:.2f} s",
        plots.battery(plan).wells,
        _course(plan),
        (f"Charging takes the available well to {highest:.1f} % of its full charge{when}.",),
    )


def _course(plan: Plan) -> list[dict[str, float]]:
    lived = course(vehicle.pool(plan.mission), plan)
    return [
        {"time_s": float(time_s), "available_As": float(available), "bound_As": float(bound)}
        for time_s, available, bound in zip(*lived, strict=True)
    ]


def second_problem(mission: Mission) -> Iterator[Exhibit | LeftOut]:
    """(P2) as printed asks for the shortest flight, and any Δ will do."""
    asked = mission.replace({"limits.deadline_s": deadlines_s(mission)[0]})
    plans = {
        problem: solve(asked, problem, perspective="battery")
        for problem in ("P1", "P2", "P2-tight")
    }
    found = {problem: plan for problem, plan in plans.items() if plan}
    if "P1" not in found:
        yield no_plan(plans["P1"])
        return
    words = {
        "P1": "(P1)\nlongest hover",
        "P2": "(P2) as printed\nleast $T_{fl} + T'$",
        "P2-tight": "(P2), whole\ndeadline used",
    }
    yield Exhibit(
        f"second-problem.{stem(mission)}",
        f"(P2) in its two readings beside (P1): {mission.name}, T_max = "
        f"{asked.limits.deadline_s:g} s",
        plots.bars(
            {words[problem]: plan.hover_time_s for problem, plan in found.items()},
            title=f"{heading(mission)}: hover time by problem",
            y_label="hover time Δ [s]",
        ),
        [
            {
                "problem": problem,
                "hover_time_s": plan.hover_time_s,
                "rest_time_s": plan.rest_time_s,
                "flight_time_s": plan.flight_time_s,
                "mission_time_s": plan.mission_time_s,
                "route": " > ".join(plan.route),
            }
            for problem, plan in found.items()
        ],
        (
            "The objective of (P2) as printed has no Δ: every feasible Δ is optimal, 0 included.",
            "P2-tight asks, as the text does, for Δ = T_max − T_fl − T': only plans that use the "
            "whole deadline are left.",
            "Hover: "
            + "; ".join(
                f"{problem} " + (f"{plan.hover_time_s:.2f} s" if plan else f"no plan, {why(plan)}")
                for problem, plan in plans.items()
            )
            + ".",
        ),
    )


def peak_speed(mission: Mission) -> Iterator[Exhibit | LeftOut]:
    """Speed over the first leg: nothing in the model slows the UAV down."""
    plan = solve(mission, "P3", perspective="battery")
    if not plan:
        yield no_plan(plan)
        return
    first = modelled_leg(plan)
    if first is None:
        yield LeftOut("", "the mission's legs are stated, not modelled")
        return
    legs = [phase for phase in plan.phases if phase.kind == "flight"]
    yield Exhibit(
        f"peak-speed.{stem(mission)}",
        f"The first leg of {mission.name}: speed, attitude and current",
        plots.leg(mission, first.start_place, first.end_place).speed,
        [
            {
                "from": leg.start_place,
                "to": leg.end_place,
                "distance_m": leg.distance_m,
                "duration_s": leg.duration_s,
                "peak_speed_m_s": leg.peak_speed_m_s,
            }
            for leg in legs
        ],
        (
            f"Peak speed {plan.peak_speed_m_s:.2f} m/s, {3.6 * plan.peak_speed_m_s:.0f} km/h: "
            "the legs know neither drag nor a largest speed"
            + (" but the mission's." if _capped(mission) else "."),
        ),
    )


def _capped(mission: Mission) -> bool:
    return mission.flight.model == "regimes" and mission.flight.max_speed_m_s is not None
