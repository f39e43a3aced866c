"""A judged plan for a notebook: the verdict, the faults, and its wells over time."""

from __future__ import annotations

from typing import TYPE_CHECKING
from xml.etree.ElementTree import Element

from optuav.markup import folded, pairs, paragraph, shown
from optuav.network import vehicle
from optuav.plan.display import Levels, picture

if TYPE_CHECKING:
    from optuav.judge.replay import Judged, Replay


def html(judged: Judged, replayed: Replay | None, verdict: str) -> str:
    """The verdict as HTML, violations first."""
    parts = [paragraph(verdict, good=judged.flyable)]
    for heading, events in judged.by_kind.items():
        rows = [(f"{e.time_s:.2f}\N{NO-BREAK SPACE}s", e.words + e.figures) for e in events]
        if rows:
            is_open = heading != "To know"
            parts.append(folded(f"{heading} ({len(rows)})", pairs(rows), is_open=is_open))
    if replayed is not None and replayed.phases:
        parts += [_wells(replayed)] if replayed.mission_time_s else []
        parts.append(pairs(replayed.facts))
    return shown(*parts)


def _wells(replayed: Replay) -> Element:
    """The wells over the trace."""
    trace, stays = replayed.trace, replayed.phases
    levels = Levels(trace.time_s, trace.available_As.sum(axis=1), trace.bound_As.sum(axis=1))
    phases = ((stay.kind, stay.start_s, stay.end_s - stay.start_s) for stay in stays)
    capacity_As = float(vehicle.pool(replayed.mission).capacity_As)
    return picture(levels, phases, capacity_As, replayed.first_s("empty"))
