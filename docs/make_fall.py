"""Make the moving picture of the home page: ``python docs/make_fall.py FILE``.

The paper's optimum of the mission ``paper`` is replayed, and drawn as an SVG that CSS moves: the
drone on its way, both wells, and a line of time. Readers who ask for less motion see its end.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np

import optuav
from optuav.judge import Replay
from optuav.looks import colour

PLAYED_S = 11.0
"""How long the picture moves."""
FALLS, LANDS = 88.0, 95.0
"""When the drone begins and ends to fall [% of this time]."""
LEFT, RIGHT, GROUND, PX_PER_M = 24.0, 330.0, 226.0, 2.0
"""Frame of the scene [px], and its scale upwards."""
LASER = 100.0
"""Where the laser stands across the scene, which has one direction less than the world [px]."""
WELLS_LEFT, WELLS_WIDTH, FULL, PIPE = 368.0, 110.0, 130.0, 16.0
"""Left edge, common width and full height of the wells, and the gap that the pipe bridges [px]."""
TIME_LEFT, TIME_RIGHT, TIME_TOP = 14.0, 506.0, 272.0
"""Frame of the line of time [px]."""
PICTURE = """\
<figure class="fall">
<style>{style}</style>
<svg viewBox="0 52 520 256" role="img" aria-labelledby="fall-title">
<title id="fall-title">{title}</title>
<path class="ground" d="M{left} {ground}H{right}"/>
{buildings}
<path class="casing" d="{way}"/>
<path class="way" d="{way}"/>
<path class="device" d="M{hover_x} {ground}l-7 0 7 -12 7 12z"/>
<text x="{hover_x}" y="{below}" class="middle">device</text>
<path class="laser" d="M{laser} {ground}l-6 0 6 -10 6 10z"/>
<text x="{laser}" y="{below}" class="middle">laser</text>
{beams}
<g class="drone"><path d="M-21 -7H-9M9 -7H21M-15 -7V-1M15 -7V-1"/>
<rect x="-14" y="-3" width="28" height="8" rx="4"/></g>
<text x="{hover_x}" y="70" class="middle late dry">✕ falls at {dry_s:.0f} s</text>
{wells}
<text x="506" y="70" class="end late dry">{left_As} left</text>
{times}
<path class="now" d="M{dry_x} {time_top}v18"/>
<text x="{time_left}" y="{time_below}">0 s</text>
<text x="{time_right}" y="{time_below}" class="end">{end_s:.0f} s</text>
</svg>
<button type="button" onclick="for (const each of
this.parentNode.getAnimations({{subtree: true}})) {{ each.currentTime = 0; each.play() }}"
>Play again</button>
</figure>
"""
STYLE = """
.fall svg {{display: block; width: 100%; height: auto; overflow: visible}}
.fall text {{font-size: 14px; fill: currentColor}}
.fall .middle {{text-anchor: middle}}
.fall .end {{text-anchor: end}}
.fall text.dry {{fill: {dry}; font-weight: bold}}
.fall :is(.ground, .way, .vessel, .now) {{fill: none; stroke: currentColor; stroke-width: 1.5}}
.fall .casing {{fill: none; stroke: {casing}; stroke-width: 5}}
.fall .way {{stroke: {flight}; stroke-width: 2.5}}
.fall .building {{fill: {line}}}
.fall .device {{fill: {flies}}}
.fall .laser {{fill: {laser}}}
.fall .beam {{stroke: {laser}; stroke-width: 2; opacity: 0}}
.fall .drone {{fill: currentColor; stroke: currentColor; stroke-width: 2}}
.fall .available {{fill: {available}}}
.fall .bound {{fill: {bound}}}
.fall :is(.available, .bound) {{transform-box: fill-box; transform-origin: 50% 100%}}
.fall .now {{stroke-width: 3}}
{last}
@media (prefers-reduced-motion: no-preference) {{
.fall :is(.drone, .beam, .available, .bound, .now, .late) {{animation: {played:g}s linear both}}
{names}
}}
@media (prefers-reduced-motion: reduce) {{.fall button {{display: none}}}}
{frames}
"""


def page() -> str:
    """The picture as a figure of HTML."""
    plan = optuav.solve("paper", perspective="battery")
    replayed = optuav.replay(plan)
    dry_s = replayed.first_s("empty")
    assert dry_s is not None
    trace, battery = replayed.trace, replayed.mission.battery
    share, whole_As = battery.available_fraction, battery.packs * battery.capacity_As
    passed = np.append(0.0, np.hypot(*np.diff(trace.position_m.T[:2])).cumsum())
    total_m, end_s = float(passed[-1]), float(trace.time_s[-1])

    def across(distance_m: float) -> float:
        return LEFT + (RIGHT - LEFT) * distance_m / total_m

    def along(time_s: float) -> float:
        return TIME_LEFT + (TIME_RIGHT - TIME_LEFT) * time_s / end_s

    def now(values: np.ndarray, time_s: float) -> float:
        return float(np.interp(time_s, trace.time_s, values))

    moments_s = _moments_s(replayed, dry_s)
    height_m = trace.position_m[:, 2]
    places = [
        (across(now(passed, moment_s)), GROUND - PX_PER_M * now(height_m, moment_s))
        for moment_s in moments_s
    ]
    fills = {
        "available": trace.available_As[:, 0] / (share * whole_As),
        "bound": trace.bound_As[:, 0] / ((1.0 - share) * whole_As),
    }
    hover_x = places[-1][0]
    moved = {
        "drone": [f"translate({x:.1f}px, {y:.1f}px)" for x, y in places],
        **{
            name: [f"scaleY({max(0.0, now(level, moment)):.3f})" for moment in moments_s]
            for name, level in fills.items()
        },
        "now": [f"translateX({along(moment_s) - along(dry_s):.1f}px)" for moment_s in moments_s],
    }
    percent = [FALLS * moment_s / dry_s for moment_s in moments_s]
    frames = {name: [*zip(percent, steps, strict=True)] for name, steps in moved.items()}
    fallen = f"translate({hover_x:.1f}px, {GROUND - 3.0:.1f}px) rotate(160deg)"
    frames["drone"].append((LANDS, fallen))
    rests = [phase for phase in replayed.phases if phase.kind == "rest"]
    stays = [phase for phase in replayed.phases if phase.kind != "flight"]
    lit: dict[str, tuple[float, float]] = {
        phase.kind: (FALLS * phase.start_s / dry_s, FALLS * min(phase.end_s, dry_s) / dry_s)
        for phase in stays
    }
    return PICTURE.format(
        style=_style(frames, lit),
        title=f"The published optimum in motion. The drone rests on b1 and hovers. After "
        f"{dry_s:.0f} s its available well is empty and it falls, with charge left in the bound "
        "well.",
        left=LEFT,
        right=RIGHT,
        ground=GROUND,
        below=GROUND + 18.0,
        hover_x=f"{hover_x:.1f}",
        buildings="\n".join(
            _building(
                across(now(passed, phase.start_s)), phase.start.name, phase.start.position_m[2]
            )
            for phase in rests
        ),
        way="M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in dict.fromkeys(_way(replayed, across))),
        laser=LASER,
        beams="\n".join(
            f'<path class="beam {phase.kind}" d="M{LASER} {GROUND - 10.0}'
            f"L{across(now(passed, phase.start_s)):.1f} "
            f'{GROUND - PX_PER_M * phase.start.position_m[2] + 6.0}"/>'
            for phase in stays
        ),
        wells=_wells(share),
        left_As=f"{now(trace.bound_As[:, 0], dry_s):,.0f} A s".replace(",", "\u202f"),
        times="\n".join(
            _time(phase.kind, along(phase.start_s), along(phase.end_s)) for phase in replayed.phases
        ),
        dry_s=dry_s,
        dry_x=f"{along(dry_s):.1f}",
        end_s=end_s,
        time_top=TIME_TOP - 3.0,
        time_below=TIME_TOP + 32.0,
        time_left=TIME_LEFT,
        time_right=TIME_RIGHT,
    )


def _moments_s(replayed: Replay, dry_s: float) -> list[float]:
    """Moments [s] between which everything moves nearly evenly: four a phase, until the fall."""
    ends = [0.0, *(phase.end_s for phase in replayed.phases if phase.end_s < dry_s), dry_s]
    return [*dict.fromkeys(float(t) for a, b in pairwise(ends) for t in np.linspace(a, b, 5))]


def _way(replayed: Replay, across: Callable[[float], float]) -> Iterator[tuple[float, float]]:
    """Corners of the whole way in the picture."""
    distance_m = 0.0
    for phase in replayed.phases:
        if phase.kind == "flight":
            yield across(distance_m), GROUND - PX_PER_M * phase.start.position_m[2]
            distance_m += math.dist(phase.start.position_m[:2], phase.end.position_m[:2])
            yield across(distance_m), GROUND - PX_PER_M * phase.end.position_m[2]


def _building(x: float, name: str, roof_m: float) -> str:
    height = PX_PER_M * roof_m - 5.0
    return (
        f'<rect class="building" x="{x - 8.0:.1f}" y="{GROUND - height}" width="16" '
        f'height="{height}"/><text x="{x:.1f}" y="{GROUND + 18.0}" class="middle">{name}</text>'
    )


def _wells(share: float) -> str:
    """Both wells as vessels, wide as their shares of the capacity, and the pipe between them."""
    wide, top = share * WELLS_WIDTH, GROUND - FULL
    right = WELLS_LEFT + wide + PIPE
    return (
        "\n".join(
            (
                f'<rect class="{name}" x="{x:.1f}" y="{top}" width="{width:.1f}" height="{FULL}"/>'
                f'<path class="vessel" d="M{x:.1f} {top - 12.0}V{GROUND}h{width:.1f}V{top - 12.0}"'
                "/>"
                f'<text x="{x + width / 2.0:.1f}" y="{GROUND + 18.0}" class="middle">{name}</text>'
            )
            for name, x, width in (
                ("available", WELLS_LEFT, wide),
                ("bound", right, WELLS_WIDTH - wide),
            )
        )
        + f'\n<path class="vessel" d="M{WELLS_LEFT + wide:.1f} {GROUND - 6.0}h{PIPE}"/>'
    )


def _time(kind: str, first: float, last: float) -> str:
    bar = (
        f'<rect x="{first:.1f}" y="{TIME_TOP}" width="{last - first:.1f}" height="12" '
        f'style="fill: {colour(kind)}"/>'
    )
    if kind == "flight":
        return bar
    middle = (first + last) / 2.0
    return f'{bar}<text x="{middle:.1f}" y="{TIME_TOP - 7.0}" class="middle">{kind}</text>'


def _style(frames: dict[str, list[tuple[float, str]]], lit: dict[str, tuple[float, float]]) -> str:
    """Where everything is at the end, and before that if readers do not mind motion."""
    roles = ("dry", "flight", "line", "flies", "laser", "available", "bound", "casing")
    steps = {
        name: "\n".join(f"{at:.2f}% {{transform: {where}}}" for at, where in moves)
        for name, moves in frames.items()
    }
    # A fall begins slowly.
    steps["drone"] = steps["drone"].replace(
        f"{FALLS:.2f}% {{",
        f"{FALLS:.2f}% {{animation-timing-function: cubic-bezier(.5, 0, 1, .6); ",
    )
    for name, (first, last) in lit.items():
        dark = f"0%, {first:.2f}%, {last:.2f}%, 100% {{opacity: 0}}"
        steps[name] = f"{dark}\n{first + 0.1:.2f}%, {last - 0.1:.2f}% {{opacity: 1}}"
    steps["late"] = f"0%, {FALLS}% {{opacity: 0}}\n{FALLS + 2.0}% {{opacity: 1}}"
    return STYLE.format(
        **{name.replace("-", "_"): colour(name) for name in roles},
        played=PLAYED_S,
        last="\n".join(
            f".fall .{name} {{transform: {moves[-1][1]}}}" for name, moves in frames.items()
        ),
        names="\n".join(f".fall .{name} {{animation-name: fall-{name}}}" for name in steps),
        frames="\n".join(f"@keyframes fall-{name} {{\n{step}\n}}" for name, step in steps.items()),
    )


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(page(), "utf-8")
