"""A plan in words: an aligned block that a person understands."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterable, Iterator

from optuav.mission import vehicle
from optuav.plan.plan import Phase, Plan

WIDTH = 80
LABEL = 13


def summary(plan: Plan) -> str:
    """The plan as text of at most 80 columns."""
    lines = [*_head(plan)]
    if plan:
        lines += ["", *_times(plan), "", *_timeline(plan)]
    for mark, remarks in (("Warning", plan.warnings if plan else ()), ("Note", plan.notes)):
        if remarks:
            lines.append("")
        for remark in remarks:
            lines += _wrapped(mark, remark)
    return "\n".join(lines)


NUMBER_AND_UNIT = re.compile(r"(?<=\d) (?=(?:s|m|N|A|W|J|%|m/s|A s)\b|%)")


def _wrapped(label: str, text: str) -> list[str]:
    """A labelled paragraph; a number keeps its unit on its line."""
    lines = textwrap.wrap(
        NUMBER_AND_UNIT.sub("\N{NO-BREAK SPACE}", text),
        WIDTH,
        initial_indent=f"{label:<{LABEL}}",
        subsequent_indent=" " * LABEL,
        break_on_hyphens=False,
    )
    return [line.replace("\N{NO-BREAK SPACE}", " ") for line in lines]


def _head(plan: Plan) -> Iterator[str]:
    asked = [
        plan.problem,
        f"trajectory {plan.trajectory}" if plan.trajectory else "",
        f"building {plan.building}" if plan.building else "",
        plan.order or "",
        f"perspective {plan.perspective}",
        f"slots of {plan.slot_s:g} s" if plan.slot_s else "continuous times",
    ]
    yield from _wrapped("Mission", plan.mission.name)
    yield from _wrapped("Problem", ", ".join(each for each in asked if each))
    if plan:
        yield from _wrapped("Answer", f"{plan.status.value} ({plan.proof})")
    else:
        yield from _wrapped("Answer", f"{plan.status.value.upper()} ({plan.proof})")
        for reason in plan.reasons:
            yield from _wrapped("Because", reason)


def _times(plan: Plan) -> Iterator[str]:
    yield f"{'Hover':<{LABEL}}{plan.hover_time_s:10.2f} s   {_where(plan, 'hover')}"
    if any(stop.kind == "rest" for stop in plan.stops):
        yield f"{'Rest':<{LABEL}}{plan.rest_time_s:10.2f} s   {_where(plan, 'rest')}"
    yield (
        f"{'Flight':<{LABEL}}{plan.flight_time_s:10.2f} s   "
        f"{len(plan.route) - 1} legs, up to {plan.peak_speed_m_s:.1f} m/s"
    )
    yield f"{'Mission':<{LABEL}}{plan.mission_time_s:10.2f} s   {_deadline(plan)}"
    yield from _wrapped("Route", " → ".join(plan.route))
    levels = ", ".join(f"{name} {100 * level:.2f} %" for name, level in (plan.soc or {}).items())
    yield from _wrapped("Charge left", f"of the battery, by perspective: {levels}")
    if plan.binding:
        yield from _wrapped("Binding", "; ".join(plan.binding))


def _deadline(plan: Plan) -> str:
    left_s = plan.mission.limits.deadline_s - plan.mission_time_s
    if abs(left_s) < 0.005:
        return "exactly at the deadline"
    return f"{abs(left_s):.2f} s {'before' if left_s > 0.0 else 'AFTER'} the deadline"


def _where(plan: Plan, kind: str) -> str:
    stops = [stop for stop in plan.stops if stop.kind == kind]
    return ", ".join(
        f"at {stop.at}, from {stop.start_s:.2f} s" if stop.duration_s else f"passes by {stop.at}"
        for stop in stops
    )


HEADINGS = ("what", "where", "start s", "for s", "A", "W", "avail. %", "bound %")
LEGEND = "A, W: mean into the battery. avail., bound: fill of the wells at the end."


def _timeline(plan: Plan) -> Iterator[str]:
    full = vehicle.pool(plan.mission).full
    rows = [
        (
            phase.kind,
            _place(phase),
            f"{phase.start_s:.2f}",
            f"{phase.duration_s:.2f}",
            f"{phase.current_A:+.2f}",
            f"{phase.power_W:+.0f}",
            f"{100 * sum(phase.available_As) / full.available_As:.1f}",
            f"{100 * sum(phase.bound_As) / full.bound_As:.1f}",
        )
        for phase in plan.phases
    ]
    widths = [max(len(row[k]) for row in [HEADINGS, *rows]) for k in range(len(HEADINGS))]
    for row in [HEADINGS, *rows]:
        cells = [
            f"{text:<{w}}" if k < 2 else f"{text:>{w}}" for k, (text, w) in _pairs(row, widths)
        ]
        yield "  ".join(cells).rstrip()
    yield LEGEND


def _pairs(row: Iterable[str], widths: Iterable[int]) -> Iterator[tuple[int, tuple[str, int]]]:
    return enumerate(zip(row, widths, strict=True))


def _place(phase: Phase) -> str:
    if phase.kind != "flight":
        return phase.end_place
    edited = " (edited)" if phase.edited else ""
    return f"{phase.start_place} → {phase.end_place}{edited}"
