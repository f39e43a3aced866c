"""Signs of the site's own drawings: drone, laser and device, each at a place [px] in an SVG."""

from __future__ import annotations

DRONE = (
    '<path d="M-13 -4H13M-13 -4V-8M13 -4V-8M-20 -8H-6M6 -8H20"/>'
    '<rect x="-8" y="-5" width="16" height="9" rx="3"/>'
)
"""A drone with two rotors, some 40 px wide, whose class or group colours it."""
STYLE = """
.drone path {fill: none; stroke: currentColor; stroke-linecap: round; stroke-width: 2.4}
.drone rect {fill: currentColor}
.laser {fill: var(--laser)}
.device {fill: var(--hover)}
.ring {fill: none; stroke: var(--hover); stroke-dasharray: 3 3; stroke-width: 1.5}
.roof {fill: var(--rest)}
.way {fill: none; stroke: var(--flight); stroke-linejoin: round; stroke-width: 2.5}
.beam {fill: none; stroke: var(--laser); stroke-dasharray: 2 4; stroke-width: 2}
"""
"""Looks of the signs and lines, by the colours of `optuav.looks`; for a style of its own scope."""


def laser(x: float, y: float) -> str:
    """A triangle whose middle is the place."""
    return f'<path class="laser" d="M{x - 9:.1f} {y + 9:.1f}l9 -18 9 18z"/>'


def device(x: float, y: float) -> str:
    """A dot in a dashed ring."""
    at = f'cx="{x:.1f}" cy="{y:.1f}"'
    return f'<circle class="device" {at} r="5"/><circle class="ring" {at} r="9"/>'


def text(x: float, y: float, words: str, kind: str = "") -> str:
    """Words that begin at a place, or as the class says."""
    about = f' class="{kind}"' if kind else ""
    return f'<text x="{x:.1f}" y="{y:.1f}"{about}>{words}</text>'


def line(kind: str, *corners: tuple[float, float]) -> str:
    """A line through corners [px]."""
    points = "L".join(f"{x:.1f} {y:.1f}" for x, y in corners)
    return f'<path class="{kind}" d="M{points}"/>'
