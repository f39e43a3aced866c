"""Figs. 3 to 6: hover time and charge left by perspective and trajectory."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from formulations.perspectives import PAPER
from optuav import plots
from optuav.mission import Mission
from optuav.paper.curves.settings import DEADLINES_S
from optuav.paper.reproduce.exhibit import (
    OURS,
    Exhibit,
    LeftOut,
    caption,
    deadline,
    heading,
    is_papers,
    percent,
    stem,
)
from optuav.paper.reproduce.plans import grounded, no_plan, solve, why
from optuav.plan import Plan
from optuav.plots.comparison import Bar
from optuav.plots.style import WORDS

TRAJECTORIES = ("direct", "traj1", "traj2", "optimal")
COUNTED = ("battery", OURS)
"""How charge is counted in the studies that the paper makes in one perspective."""
FIGURES = {800.0: ("Fig. 3", "Fig. 4"), 1200.0: ("Fig. 5", "Fig. 6")}


def deadlines_s(mission: Mission) -> Sequence[float]:
    """The paper's deadlines for its missions, a mission's own otherwise [s]."""
    return DEADLINES_S if is_papers(mission) else (mission.limits.deadline_s,)


def by_perspective(mission: Mission) -> Iterator[Exhibit | LeftOut]:
    """Two pictures a deadline, as in the paper: hover time, and charge left."""
    for deadline_s in deadlines_s(mission):
        asked = mission.replace({"limits.deadline_s": deadline_s})
        plans = [
            (perspective, name, solve(asked, trajectory=name, perspective=perspective))
            for perspective in (*PAPER, OURS)
            for name in TRAJECTORIES
        ]
        if not any(plan for *_, plan in plans):
            yield no_plan(plans[-1][-1], deadline(asked))
            continue
        shown = [
            Bar(
                perspective,
                name,
                plan.hover_time_s,
                (plan.soc or {})["battery"],
                plan.flyable is not False,
            )
            if plan
            else Bar(perspective, name, None, None)
            for perspective, name, plan in plans
        ]
        records = [
            {
                "perspective": perspective,
                "trajectory": name,
                "hover_time_s": plan.hover_time_s,
                "rest_time_s": plan.rest_time_s,
                "mission_time_s": plan.mission_time_s,
                "eta1_percent": percent((plan.soc or {})["battery"]),
                "route": " > ".join(plan.route),
                "runs_dry_s": plan.runs_dry_s,
                "overfull_s": plan.overfull_s,
            }
            for perspective, name, plan in plans
            if plan
        ]
        words = f"{heading(mission)}, T_max = {deadline_s:g} s"
        hover, charge = FIGURES.get(deadline_s, ("", ""))
        name = f"{stem(mission)}.{deadline_s:g}s"
        yield Exhibit(
            f"hover-time.{name}",
            caption(
                asked, "Maximal hover time by perspective and trajectory", hover, deadline(asked)
            ),
            plots.hover_bars(shown, f"Hover time: {words.replace('T_max', '$T_{max}$')}"),
            records,
            (
                *_findings(shown, plans),
                *grounded([plan for *_, plan in plans if plan], "bars"),
                *_missing(plans),
            ),
        )
        yield Exhibit(
            f"charge-left.{name}",
            caption(
                asked,
                "Charge left at the end by perspective and trajectory",
                charge,
                deadline(asked),
            ),
            plots.charge_bars(
                shown,
                f"Charge left: {words.replace('T_max', '$T_{max}$')}",
                mission.limits.min_soc,
            ),
            records,
        )


def _findings(shown: Sequence[Bar], plans: Sequence[tuple[str, str, Plan]]) -> Iterator[str]:
    routes = {
        perspective: " → ".join(plan.route)
        for perspective, name, plan in plans
        if plan and name == "optimal"
    }
    for perspective in dict.fromkeys(each.perspective for each in shown):
        own = {
            each.trajectory: each.hover_time_s
            for each in shown
            if each.perspective == perspective and each.hover_time_s is not None
        }
        if "optimal" in own:
            best = [
                WORDS[name]
                for name, hover_s in own.items()
                if name != "optimal" and hover_s >= own["optimal"] - 1e-6
            ]
            by = " and ".join(best) or routes[perspective]
            yield f"{perspective}: {own['optimal']:.2f} s by {by}."


def _missing(plans: Sequence[tuple[str, str, Plan]]) -> Iterator[str]:
    lost: dict[tuple[str, str], list[str]] = {}
    for perspective, name, plan in plans:
        if not plan:
            lost.setdefault((WORDS[name], why(plan)), []).append(perspective)
    for (name, reason), perspectives in lost.items():
        yield f"No plan by {name}, {', '.join(perspectives)}: {reason}."
