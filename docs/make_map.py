"""Make the map of the mission on a slide: ``python docs/make_map.py FILE``.

It is an SVG with few and large labels, to be read from the back of a room. North points to the
right, because a slide is wide.
"""

from __future__ import annotations

import sys
from pathlib import Path

import optuav
from optuav.looks import colour
from optuav.network.map_extent import scene

PX_PER_M = 0.135
LEFT, BOTTOM = 112.0, 290.0
"""Origin of the map in the picture [px]."""
BESIDE = {"b7": (-8.0, 18.0), "b8": (-8.0, -9.0), "b9": (-8.0, -9.0), "b10": (-12.0, 18.0)}
"""Where words are off the lines [px], other than right of their roof."""
PICTURE = """\
<style>
.mission {{display: block; flex: 1 1 auto; margin: auto; max-width: 100%; min-height: 0}}
.mission text {{font-size: 17px; fill: currentColor; text-anchor: middle}}
.mission .roof + text {{font-size: 13px; text-anchor: start}}
.mission .reach {{fill: {flies}; fill-opacity: 0.15; stroke: {flies}; stroke-width: 2}}
.mission .way {{fill: none; stroke: currentColor; stroke-width: 2.5; stroke-dasharray: 9 5}}
.mission .beam {{stroke: {laser}; stroke-width: 1}}
.mission .device {{fill: {flies}}}
.mission .laser {{fill: {laser}}}
.mission :is(.roof, .end) {{fill: currentColor}}
</style>
<svg class="mission" viewBox="0 0 610 304" role="img" aria-label="Map of the mission: origin,
destination, hover point, device, laser and ten roofs">
{marks}
</svg>
"""


def page() -> str:
    """Return the map as an SVG of HTML."""
    mission = optuav.load("paper")
    seen = scene(mission)
    roofs = [building.name for building in mission.buildings]
    names = ["origin", "hover", "destination", *roofs]
    spots = {"device": mission.link.device_m, "laser": mission.laser.position_m}
    spots |= dict(zip(names, seen.positions(names), strict=True))
    at = {
        name: (LEFT + PX_PER_M * north_m, BOTTOM - PX_PER_M * east_m)
        for name, (east_m, north_m, _) in spots.items()
    }

    def circle(name: str, kind: str, radius_px: float) -> str:
        x, y = at[name]
        return f'<circle class="{kind}" cx="{x:.1f}" cy="{y:.1f}" r="{radius_px:.1f}"/>'

    def line(kind: str, *places: str) -> str:
        corners = " ".join("{:.1f},{:.1f}".format(*at[place]) for place in places)
        return f'<polyline class="{kind}" points="{corners}"/>'

    def label(name: str, right: float, down: float, words: str = "") -> str:
        x, y = at[name]
        return f'<text x="{x + right:.1f}" y="{y + down:.1f}">{words or name}</text>'

    marks = [
        circle("device", "reach", PX_PER_M * seen.disc_radius_m),
        *(line("beam", "laser", place) for place in (*roofs, "hover")),
        line("way", "origin", "hover", "destination"),
        *(circle(roof, "roof", 4.0) + label(roof, *BESIDE.get(roof, (8.0, 5.0))) for roof in roofs),
        *(circle(end, "end", 6.0) for end in ("origin", "hover", "destination")),
        *(circle(spot, spot, 8.0) for spot in ("device", "laser")),
        label("device", 0.0, 28.0),
        label("laser", -36.0, 6.0),
        label("hover", -46.0, -46.0, "hover point"),
        label("origin", -38.0, 6.0),
        label("destination", -58.0, 6.0),
    ]
    return PICTURE.format(marks="\n".join(marks), flies=colour("flies"), laser=colour("laser"))


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(page(), "utf-8")
