"""Fig. 8: hover time against battery size, with laser and without."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from optuav import plots
from optuav.mission import Mission
from optuav.studies.curves.battery_size import direct, pack_for, saturation, without_laser
from optuav.studies.reproduce.exhibit import (
    OURS,
    Exhibit,
    LeftOut,
    caption,
    deadline,
    heading,
    stem,
)
from optuav.studies.reproduce.perspectives import COUNTED
from optuav.studies.reproduce.plans import SEARCHED, is_searched, no_plan, solve

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
        ends = [pack for pack in (crossing, full) if pack is not None]
        packs_As = np.linspace(
            0.8 * own, max([1.15 * own, *(1.06 * end for end in ends)]), POINTS[perspective]
        )
        records = [
            {
                "pack_As": float(pack),
                "direct_without_laser_s": _hover_s(direct(dark, pack, perspective=perspective)),
                "direct_with_laser_s": _hover_s(direct(mission, pack, perspective=perspective)),
                "optimum_with_laser_and_own_pack_s": best.hover_time_s,
            }
            for pack in packs_As
        ]
        marks = [
            plots.Mark(at, words)
            for at, words in (
                (crossing, f"as long without laser: {crossing:.0f} A s" if crossing else ""),
                (full, f"ended by the deadline: {full:.0f} A s" if full else ""),
            )
            if at is not None
        ]
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
                [
                    plots.Line(
                        f"optimal, laser, $B_i$ = {own:g} A s",
                        packs_As,
                        [best.hover_time_s] * len(packs_As),
                    ),
                    plots.Line(
                        "direct, no laser",
                        packs_As,
                        [each["direct_without_laser_s"] for each in records],
                    ),
                    plots.Line(
                        "direct, laser", packs_As, [each["direct_with_laser_s"] for each in records]
                    ),
                ],
                title=f"{heading(mission)}: hover time and battery size, {perspective}",
                x_label="capacity of a pack $B_i$ [A s]",
                y_label="hover time Δ [s]",
                marks=marks,
            ),
            records,
            tuple(_findings(own, best.hover_time_s, crossing, full)),
        )


def _hover_s(plan: object) -> float:
    return float(plan.hover_time_s) if plan else math.nan  # type: ignore[attr-defined]


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
