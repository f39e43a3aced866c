"""Fig. 7: hover time against the charge that must be left, for several rotor speeds."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from optuav import plots
from optuav.mission import Mission
from optuav.paper.curves.settings import LEAST_SOC, SPEED_SHARES
from optuav.paper.reproduce.exhibit import (
    Exhibit,
    LeftOut,
    caption,
    deadline,
    heading,
    is_papers,
    stem,
)
from optuav.paper.reproduce.perspectives import COUNTED
from optuav.paper.reproduce.plans import SEARCHED, is_searched, no_plan, solve


def least_charge(mission: Mission) -> Iterator[Exhibit | LeftOut]:
    """One curve a rotor speed; regime loads know none and have a single curve."""
    for perspective in COUNTED:
        if is_searched(mission, perspective):
            yield LeftOut(f"perspective {perspective}", SEARCHED)
            continue
        records: list[dict[str, Any]] = [
            {
                "max_speed_rad_s": speed,
                "min_soc_percent": 100.0 * least,
                "hover_time_s": plan.hover_time_s if plan else math.nan,
                "route": " > ".join(plan.route) if plan else "",
            }
            for speed, changes in _speeds(mission).items()
            for least in _least(mission)
            for plan in (
                solve(
                    mission.replace({**changes, "limits.min_soc": least}), perspective=perspective
                ),
            )
        ]
        if not any(math.isfinite(each["hover_time_s"]) for each in records):
            lost = solve(mission, perspective=perspective)
            yield no_plan(lost, f"perspective {perspective}")
            continue
        curves: dict[float | None, list[dict[str, Any]]] = {}
        for each in records:
            curves.setdefault(each["max_speed_rad_s"], []).append(each)
        lines = [
            plots.Line(
                f"$v_{{max}}$ = {speed:g} rad/s" if speed else "loads by regime",
                [each["min_soc_percent"] for each in curve],
                [each["hover_time_s"] for each in curve],
                "o",
            )
            for speed, curve in curves.items()
        ]
        yield Exhibit(
            f"least-charge.{stem(mission)}.{perspective}",
            caption(
                mission,
                "Maximal hover time against the charge that must be left",
                "Fig. 7",
                *([] if mission.flight.model == "rotors" else ["loads by regime, without v_max"]),
                f"perspective {perspective}",
                deadline(mission),
            ),
            plots.curves(
                lines,
                title=f"{heading(mission)}: hover time and charge left, {perspective}",
                x_label="charge that must be left $η_0$ [%]",
                y_label="hover time Δ [s]",
            ),
            records,
            tuple(_falls(mission, records)),
        )


def _speeds(mission: Mission) -> Mapping[float | None, dict[str, float]]:
    if mission.flight.model != "rotors" or mission.rotor is None:
        return {None: {}}
    own = mission.rotor.max_speed_rad_s
    return {round(share * own, 6): {"rotor.max_speed_rad_s": share * own} for share in SPEED_SHARES}


def _least(mission: Mission) -> tuple[float, ...]:
    if is_papers(mission):
        return LEAST_SOC
    own = mission.limits.min_soc
    return tuple(each for each in (own, own + 0.05, own + 0.1) if each < 1.0)


def _falls(mission: Mission, records: list[dict[str, Any]]) -> Iterator[str]:
    rotors = mission.flight.model == "rotors"
    own = round(mission.rotor.max_speed_rad_s, 6) if rotors and mission.rotor else None
    hovers = [
        (each["min_soc_percent"], each["hover_time_s"])
        for each in records
        if each["max_speed_rad_s"] == own
    ]
    lost = [least for least, hover_s in hovers if math.isnan(hover_s)]
    hovers = hovers[: len(hovers) - len(lost)]  # more charge left is never easier
    if lost:
        speed = " at the mission's own v_max" if own else ""
        yield f"From η0 = {lost[0]:g} % on there is no plan{speed}."
    if len(hovers) < 2:
        return
    first = hovers[0][1]
    if all(math.isclose(hover_s, first, rel_tol=1e-6) for _, hover_s in hovers):
        yield f"Δ = {first:.2f} s for every η0, which is not what ends the hover."
        return
    falls = ", ".join(
        f"{100.0 * (1.0 - hover_s / first):.2f} % at η0 = {least:g} %"
        for least, hover_s in hovers[1:]
    )
    yield f"From η0 = {hovers[0][0]:g} % on, Δ = {first:.2f} s falls by {falls}."
