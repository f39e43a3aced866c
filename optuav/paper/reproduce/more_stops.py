"""What the paper leaves out: one rest and one hover in one piece are not always enough."""

from __future__ import annotations

from collections.abc import Iterator

from optuav import plots
from optuav.mission import Mission
from optuav.paper.reproduce.exhibit import OURS, Exhibit, LeftOut, caption, heading, stem
from optuav.paper.reproduce.plans import SEARCHED, is_searched, no_plan, solve, why
from optuav.plan import Plan

WAYS = {"one rest, one hover": (1, 1), "two rests": (2, 1), "two hovers": (1, 2)}
"""Most rests and most hovers."""
TIMES = (1.0, 2.0)
"""Deadlines over the mission's own."""


def more_stops(mission: Mission) -> Iterator[Exhibit | LeftOut]:
    """The longest hover with two rests, and in two pieces, in which the available well lasts."""
    if is_searched(mission, OURS):
        yield LeftOut("", SEARCHED)
        return
    asked = {
        (times * mission.limits.deadline_s, words): best(
            mission, words, times * mission.limits.deadline_s
        )
        for times in TIMES
        for words in WAYS
    }
    plans = {key: plan for key, plan in asked.items() if plan}
    if not plans:
        yield no_plan(next(iter(asked.values())))
        return
    yield Exhibit(
        f"more-stops.{stem(mission)}",
        caption(mission, "The longest hover with more stops, perspective available", ""),
        plots.bars(
            {
                f"{words},\n$T_{{max}}$ = {deadline_s:g} s": plan.hover_time_s
                for (deadline_s, words), plan in plans.items()
            },
            title=f"{heading(mission)}: more rests, and hovering in pieces",
            y_label="hover time Δ [s]",
        ),
        [
            {
                "deadline_s": deadline_s,
                "most": words,
                "hover_time_s": plan.hover_time_s,
                "rest_time_s": plan.rest_time_s,
                "route": " > ".join(plan.route),
                "stays": "; ".join(_stays(plan)),
            }
            for (deadline_s, words), plan in plans.items()
        ],
        tuple(
            f"T_max = {deadline_s:g} s, {words}: "
            + (
                f"{plan.hover_time_s:.3f} s; {', '.join(_stays(plan))}."
                if plan
                else f"no plan, {why(plan)}."
            )
            for (deadline_s, words), plan in asked.items()
        ),
    )


def best(mission: Mission, words: str, deadline_s: float) -> Plan:
    """The best plan of one of the `WAYS` under a deadline [s]."""
    stops, hovers = WAYS[words]
    asked = mission.replace({"limits.deadline_s": deadline_s})
    return solve(asked, perspective=OURS, stops=stops, hovers=hovers)


def _stays(plan: Plan) -> list[str]:
    return [
        f"{stop.kind if stop.kind == stop.at else f'{stop.kind} {stop.at}'} {stop.duration_s:.2f} s"
        for stop in plan.stops
    ]
