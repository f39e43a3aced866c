"""Pictures of comparisons as files."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from optuav import plots
from optuav.plots.files import save_figures
from optuav.solving import formulate, solve
from optuav.studies.choices import Choices
from optuav.studies.comparison import Comparison, Row
from optuav.studies.schedules import Schedules

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from optuav.plots.comparison import Gap


def save_comparison(found: Comparison, directory: str | Path) -> list[Path]:
    """Write the pictures of a comparison; see `Comparison.save_pictures`."""
    return save_figures(_figures(found), Path(directory))


def save_choices(found: Choices, directory: str | Path) -> list[Path]:
    """Write the picture of choices; see `Choices.save_pictures`."""
    shown = [
        plots.Bar(
            row.perspective,
            row.trajectory,
            row.hover_time_s,
            (row.soc or {}).get("battery"),
            row.flyable is not False,
        )
        for row in found.rows
    ]
    axes = plots.choice_bars(shown, found.mission.name, found.mission.limits.min_soc)
    return save_figures([("choices.png", axes.hover.get_figure(root=True))], Path(directory))


def save_schedules(found: Schedules, directory: str | Path) -> list[Path]:
    """Write the picture of packs by schedule; see `Schedules.save_pictures`."""
    shown = [plan for plan in found.plans if plan]
    if not shown:
        return []
    first, *_ = plots.packs(shown)
    return save_figures([("packs.png", first.get_figure(root=True))], Path(directory))


def _figures(found: Comparison) -> Iterator[tuple[str, Figure | None]]:
    gaps = list(_gaps(found))
    if gaps:
        drawn = plots.slot_gaps(gaps, found.mission.name)
        yield "gaps.png", drawn.get_figure(root=True)
    rests = [row for row in found.rows if row.problem == "P4" and _hover_time_s(row) is not None]
    if rests:
        yield "plane.png", _plane(found, max(rests, key=lambda row: _hover_time_s(row) or 0.0))


def _gaps(found: Comparison) -> Iterator[Gap]:
    """One gap a programme and length of slot."""
    for row in found.rows:
        kind = f"{row.problem} {row.order}" if row.order else row.problem
        by_slot = {cell.method.slot_s: cell for cell in reversed(row.cells)}
        for slot_s, cell in sorted((s, cell) for s, cell in by_slot.items() if s is not None):
            if cell.gap_s is not None:
                yield plots.Gap(kind, slot_s, cell.gap_s, cell.largest_gap_s)


def _hover_time_s(row: Row) -> float | None:
    return row.cells[0].hover_time_s if row.cells else None


def _plane(found: Comparison, row: Row) -> Figure | None:
    """The plane of a (P4) with its optimum, and that in the longest slots that admit one."""
    asked: dict[str, Any] = {"building": row.building, "order": row.order}
    asked["perspective"] = found.perspective
    slots_s = [
        cell.method.slot_s
        for cell in row.cells
        if cell.method.slot_s is not None and cell.hover_time_s is not None
    ]
    slot_s = max(slots_s, default=found.mission.limits.slot_s)
    (part,) = formulate(found.mission, "P4", **asked).parts
    plans = [solve(found.mission, "P4", slot_s=each, **asked) for each in (None, slot_s)]
    drawn = plots.plane(part.model, part.model.row(0), plans, slot_s=slot_s)
    return drawn.get_figure(root=True)
