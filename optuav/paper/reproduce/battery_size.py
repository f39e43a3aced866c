"""Fig. 8: hover time against battery size, with laser and without."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from optuav import plots
from optuav.mission import Mission
from optuav.paper.curves.battery_size import direct, pack_for, saturation, without_laser
from optuav.paper.reproduce.exhibit import (
    OURS,
    Exhibit,
    LeftOut,
    caption,
    deadline,
    heading,
    stem,
)
from optuav.paper.reproduce.perspectives import COUNTED
from optuav.paper.reproduce.plans import SEARCHED, is_searched, no_plan, solve
from optuav.plan import Plan

POINTS = {"battery": 61, OURS: 25}


def battery_size(mission: Mission) -> Iterator[Exhibit | LeftOut]:
    """The direct path without laser by pack, and the optimum with laser and the mission's pack."""
    if mission.laser is None:
        yield LeftOut("", "the mission has no laser")
        return
    dark, own = without_laser(mission), mission.battery.capacity_As
    for perspective in COUNTED:
        if is_searched(mission, perspective):
            yield LeftOut(f"perspective {perspective}", SEARCHED)
            continue
        best = solve(mission, perspective=perspective)
        if not best:
            yield no_plan(best, f"perspective {perspective}")
            continue
        crossing = pack_for(dark, best.hover_time_s, perspective=perspective)
        full = saturation(dark, perspective=perspective)
        corners = (crossing, full, saturation(mission, perspective=perspective))
        last_As = max([1.15 * own, *(1.06 * end for end in (crossing, full) if end is not None)])
        packs_As = np.union1d(
            np.linspace(0.8 * own, last_As, POINTS[perspective]),
            [each for each in corners if each is not None and 0.8 * own < each < last_As],
        )
        records = [_record(mission, dark, best, float(pack), perspective) for pack in packs_As]
        yield Exhibit(
            f"battery-size.{stem(mission)}.{perspective}",
            caption(
                mission,
                "Maximal hover time against battery size",
                "Fig. 8",
                f"perspective {perspective}",
                deadline(mission),
            ),
            plots.curves(
                _lines(own, records),
                title=f"{heading(mission)}: hover time and battery size, {perspective}",
                x_label="capacity of a pack $B_i$ [A s]",
                y_label="hover time Δ [s]",
                marks=list(_marks(crossing, full)),
            ),
            records,
            tuple(_findings(own, best.hover_time_s, crossing, full)),
        )


def _record(
    mission: Mission, dark: Mission, best: Plan, pack_As: float, perspective: str
) -> dict[str, float]:
    """Hover times with one pack [s]: of the direct path without laser and with, and the optimum."""
    return {
        "pack_As": pack_As,
        "direct_without_laser_s": _hover_s(direct(dark, pack_As, perspective=perspective)),
        "direct_with_laser_s": _hover_s(direct(mission, pack_As, perspective=perspective)),
        "optimum_with_laser_and_own_pack_s": best.hover_time_s,
    }


def _hover_s(plan: Plan) -> float:
    return plan.hover_time_s if plan else math.nan


def _lines(own_As: float, records: Sequence[Mapping[str, float]]) -> list[plots.Line]:
    packs_As = [each["pack_As"] for each in records]
    return [
        plots.Line(name, packs_As, [each[column] for each in records])
        for name, column in (
            (f"optimal, laser, $B_i$ = {own_As:g} A s", "optimum_with_laser_and_own_pack_s"),
            ("direct, no laser", "direct_without_laser_s"),
            ("direct, laser", "direct_with_laser_s"),
        )
    ]


def _marks(crossing: float | None, full: float | None) -> Iterator[plots.Mark]:
    if crossing is not None:
        yield plots.Mark(crossing, f"as long without laser: {crossing:.0f} A s")
    if full is not None:
        yield plots.Mark(full, f"ended by the deadline: {full:.0f} A s")


def _findings(
    own_As: float, best_s: float, crossing: float | None, full: float | None
) -> Iterator[str]:
    if crossing is not None:
        yield (
            f"Without laser the direct path hovers {best_s:.2f} s, as the optimum does with it, "
            f"from {crossing:.0f} A s a pack on: the laser saves {crossing - own_As:.0f} A s, "
            f"{100.0 * (crossing / own_As - 1.0):.2f} % of the pack."
        )
    if full is not None:
        yield f"From {full:.0f} A s on the deadline ends the direct path without laser."
