"""A plan in words: an aligned block that a person understands."""

from __future__ import annotations

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
        for remark in remarks:
            lines += ["", *_wrapped(mark, remark)]
    return "\n".join(lines)


def _wrapped(label: str, text: str) -> list[str]:
    return textwrap.wrap(
        text,
        WIDTH,
        initial_indent=f"{label:<{LABEL}}",
        subsequent_indent=" " * LABEL,
        break_on_hyphens=False,
    )


def _head(plan: Plan) -> Iterator[str]:
    trajectory = f", trajectory {plan.trajectory}" if plan.trajectory else ""
    slots = f"slots of {plan.slot_s:g} s" if plan.slot_s else "continuous times"
    yield from _wrapped("Mission", plan.mission.name)
    yield from _wrapped("Problem", f"{plan.problem}{trajectory}, {plan.perspective}, {slots}")
    if plan:
        yield from _wrapped("Answer", f"{plan.status.value} ({plan.proof})")
    else:
        yield from _wrapped("Answer", f"{plan.status.value.upper()} ({plan.proof})")
        for reason in plan.reasons:
            yield from _wrapped("Because", reason)


def _times(plan: Plan) -> Iterator[str]:
    left_s = plan.mission.limits.deadline_s - plan.mission_time_s
    yield f"{'Hover':<{LABEL}}{plan.hover_time_s:10.2f} s   {_where(plan, 'hover')}"
    yield f"{'Rest':<{LABEL}}{plan.rest_time_s:10.2f} s   {_where(plan, 'rest')}"
    yield (
        f"{'Flight':<{LABEL}}{plan.flight_time_s:10.2f} s   "
        f"{len(plan.route) - 1} legs, up to {plan.peak_speed_m_s:.1f} m/s"
    )
    yield (
        f"{'Mission':<{LABEL}}{plan.mission_time_s:10.2f} s   "
        f"{abs(left_s):.2f} s {'before' if left_s >= -1e-6 else 'AFTER'} the deadline"
    )
    yield from _wrapped("Route", " → ".join(plan.route))
    levels = ", ".join(f"{name} {100 * level:.2f} %" for name, level in plan.soc.items())
    yield from _wrapped("Charge left", levels)
    if plan.binding:
        yield from _wrapped("Binding", "; ".join(plan.binding))


def _where(plan: Plan, kind: str) -> str:
    stops = [stop for stop in plan.stops if stop.kind == kind]
    if not stops:
        return "none"
    return ", ".join(
        f"at {stop.at}, from {stop.start_s:.2f} s" if stop.duration_s else f"passes by {stop.at}"
        for stop in stops
    )


HEADINGS = ("what", "where", "start s", "for s", "A", "W", "avail. %", "bound %")


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


def _pairs(row: Iterable[str], widths: Iterable[int]) -> Iterator[tuple[int, tuple[str, int]]]:
    return enumerate(zip(row, widths, strict=True))


def _place(phase: Phase) -> str:
    if phase.kind != "flight":
        return phase.end_place
    edited = " (edited)" if phase.edited else ""
    return f"{phase.start_place} → {phase.end_place}{edited}"
