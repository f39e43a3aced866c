"""A plan as a verdict, tables and a picture of its wells over time, for a notebook."""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import chain
from typing import TYPE_CHECKING, NamedTuple
from xml.etree.ElementTree import Element

import numpy as np

from optuav.markup import element, figure, folded, pairs, paragraph, shown, table
from optuav.network import vehicle
from optuav.network.timeline import carry
from optuav.physics.kibam import STEPS, Stage
from optuav.plan.summary import (
    EDITED,
    HEADINGS,
    LEGEND,
    figures,
    heading,
    outcome,
    remarks,
    times,
)

if TYPE_CHECKING:
    from optuav.arrays import Floats
    from optuav.plan.plan import Plan

WIDTH, HEIGHT = 440.0, 120.0  # Of the levels [px]
ABOVE, LEFT, BELOW, RIGHT = 20.0, 46.0, 54.0, 20.0  # Room around them [px]
KINDS = {"flight": "#0072b2", "hover": "#009e73", "rest": "#e69f00"}  # As in optuav.plots
BOUND, AVAILABLE, LACKING = "#56b4e9", "#0072b2", "#d55e00"
PIECES = 12  # Into which a stage is divided, as the wells do not change along straight lines
LETTER = 6.5  # About how wide a letter is [px]
MOST_TICKS = 6
ROUNDING = 1e-6  # Percent of the capacity


class Levels(NamedTuple):
    """Charge in both wells of all packs [A s] at moments [s], by which lines are drawn."""

    time_s: Floats
    available_As: Floats
    bound_As: Floats


def html(plan: Plan) -> str:
    """The plan as HTML."""
    verdict = f"{plan.problem}, {plan.status.value.replace('_', ' ')}"
    if not plan:
        return shown(
            paragraph(f"No plan: {verdict}", good=False), pairs(heading(plan)), *_notes(plan)
        )
    verdict = f"Hover {plan.hover_time_s:.2f} s ({verdict})"
    if plan.flyable is not None:
        verdict += ", can be flown" if plan.flyable else ", cannot be flown"
    rows = [
        (kind, f"{phase.start_place} → {phase.end_place}" if place else phase.end_place, *numbers)
        for phase, (kind, *numbers) in zip(plan.phases, figures(plan), strict=True)
        for place in [phase.kind == "flight"]
    ]
    stays = ((each.kind, each.start_s, each.duration_s) for each in plan.phases)
    legend = f"{LEGEND} {EDITED}" if any(each.edited for each in plan.phases) else LEGEND
    return shown(
        paragraph(verdict, good=plan.flyable is not False),
        picture(levels(plan), stays, vehicle.pool(plan.mission).capacity_As, plan.runs_dry_s),
        pairs((name, f"{time_s:.2f} s, {remark}") for name, time_s, remark in times(plan)),
        folded("Question and answer", pairs([*heading(plan), *outcome(plan)])),
        folded(f"Phases ({len(rows)})", table(HEADINGS, rows), paragraph(legend)),
        *_notes(plan),
    )


def _notes(plan: Plan) -> list[Element]:
    return [pairs(found)] if (found := remarks(plan)) else []


def levels(plan: Plan) -> Levels:
    """Both wells over a plan; of packs that take turns, when one of them changes its part."""
    found = list[tuple[float, float, float]]()
    if plan.mission.battery.takes_turns:
        for each in chain.from_iterable(carry(plan.mission, plan.phases).stretches):
            end_s = float(each.start_s[0] + each.duration_s[0])
            available_As, bound_As = (float(well[0].sum()) for well in each.wells)
            found.append((end_s, available_As, bound_As))
    else:
        end_s = 0.0
        pool, after = vehicle.pool(plan.mission), STEPS[plan.mission.battery.charging]
        wells = pool.full
        for current_A, duration_s in chain.from_iterable(each.net for each in plan.phases):
            piece = Stage(current_A, duration_s / PIECES)
            for _ in range(PIECES):
                wells = after(pool, wells, piece)
                end_s += piece.duration_s
                found.append((end_s, float(wells.available_As), float(wells.bound_As)))
    full = vehicle.pool(plan.mission).full
    return Levels(*np.array([(0.0, *map(float, full)), *found]).T)


def picture(
    course: Levels,
    phases: Iterable[tuple[str, float, float]],
    capacity_As: float,
    dry_s: float | None = None,
) -> Element:
    """Both wells over time as an inline SVG: bound below available, in % of the capacity.

    Above them the phases: kind, start and duration [s].
    """
    end_s = max(float(course.time_s[-1]), 1e-9)
    bound, total = (
        100.0 * each / capacity_As
        for each in (course.bound_As, course.bound_As + course.available_As)
    )
    lacking = total < bound - ROUNDING
    low, high = min(0.0, float(total.min())), max(100.0, float(total.max()))

    def x(time_s: float) -> float:
        return LEFT + WIDTH * min(time_s, end_s) / end_s

    def y(percent: float) -> float:
        return ABOVE + HEIGHT * (high - percent) / (high - low)

    def area(colour: str, under: Floats, over: Floats) -> Element:
        there, back = zip(course.time_s, over, strict=True), zip(course.time_s, under, strict=True)
        points = (f"{x(t):.1f},{y(p):.1f}" for t, p in (*there, *reversed([*back])))
        return element("polygon", points=" ".join(points), fill=colour, fill_opacity="0.85")

    drawn = [area(BOUND, np.zeros_like(bound), bound)]
    drawn.append(area(AVAILABLE, bound, np.maximum(total, bound)))
    if lacking.any():
        drawn.append(area(LACKING, np.minimum(total, bound), bound))
    for percent in (0.0, 50.0, 100.0):
        drawn += _line(LEFT, y(percent), LEFT + WIDTH, y(percent), opacity="0.4")
        drawn.append(_words(f"{percent:.0f} %", LEFT - 4.0, y(percent) + 4.0, "end"))
    for kind, start_s, duration_s in phases:
        start, wide = x(start_s), x(start_s + duration_s) - x(start_s)
        place = {"x": f"{start:.1f}", "y": f"{ABOVE - 5.0:.1f}", "width": f"{wide:.1f}"}
        drawn.append(element("rect", **place, height="4", fill=KINDS[kind]))
        if wide > LETTER * len(kind):
            drawn.append(_words(kind, start + wide / 2.0, ABOVE - 8.0, "middle"))
    bottom = ABOVE + HEIGHT
    for time_s in ticks(end_s):
        drawn += _line(x(time_s), bottom, x(time_s), bottom + 4.0)
        drawn.append(_words(figure(time_s), x(time_s), bottom + 16.0, "middle"))
    drawn.append(_words("s", LEFT + WIDTH + RIGHT, bottom + 16.0, "end"))
    if dry_s is not None:
        drawn += _line(x(dry_s), ABOVE, x(dry_s), bottom, stroke_width="1.5")
    at = LEFT
    for colour, words in ((AVAILABLE, "available y₁"), (BOUND, "bound y₂"), (LACKING, "not there")):
        if colour != LACKING or lacking.any():
            drawn.append(_swatch(colour, at, bottom + 28.0))
            drawn.append(_words(words, at + 14.0, bottom + 37.0, "start"))
            at += 14.0 + LETTER * (len(words) + 3)
    if dry_s is not None:
        drawn.append(_words(f"dry at {dry_s:.1f} s", LEFT + WIDTH, bottom + 37.0, "end"))
    box = f"0 0 {LEFT + WIDTH + RIGHT:g} {ABOVE + HEIGHT + BELOW - 8.0:g}"
    named = "Charge in both wells over time"
    look = {"viewBox": box, "role": "img", "aria_label": named, "font_size": "12"}
    return element("svg", *drawn, fill="currentColor", **look)


def ticks(end_s: float) -> list[float]:
    """Round moments from 0 on [s], at most `MOST_TICKS` steps."""
    size = 10.0 ** math.floor(math.log10(end_s / MOST_TICKS))
    step = next(size * each for each in (1, 2, 5, 10, 20) if end_s / (size * each) <= MOST_TICKS)
    return [step * number for number in range(int(end_s / step) + 1)]


def _line(x1: float, y1: float, x2: float, y2: float, **look: str) -> list[Element]:
    ends = {"x1": f"{x1:.1f}", "y1": f"{y1:.1f}", "x2": f"{x2:.1f}", "y2": f"{y2:.1f}"}
    return [element("line", stroke="currentColor", **ends, **look)]


def _swatch(colour: str, x: float, y: float) -> Element:
    return element("rect", x=f"{x:.1f}", y=f"{y:.1f}", width="10", height="10", fill=colour)


def _words(text: str, x: float, y: float, anchor: str) -> Element:
    return element("text", text, x=f"{x:.1f}", y=f"{y:.1f}", text_anchor=anchor)
