"""Make the maps of the slides: ``python docs/make_map.py FILE``.

Each is an SVG with few and large labels, to be read from the back of a room, with north up as on
all maps: the mission, or routes of plans of it.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

import signs

import optuav
from optuav.looks import variables
from optuav.network.map_extent import scene

PX_PER_M = 0.125
LEFT, BOTTOM = 66.0, 446.0
"""Origin of the map in the picture [px]."""
INSIDE = {"b9": (3.0, -8.0, "name"), "b10": (-3.0, -8.0, "name end")}
"""Where names of roofs beside the way stand, right and down of them [px]."""
PICTURE = """\
<style>
{variables}
.mission {{display: block; margin: auto; max-width: 100%; min-height: 0}}
.mission text {{font-size: 17px; fill: currentColor}}
.mission .name {{font-size: 13px}}
.mission .middle {{text-anchor: middle}}
.mission .end {{text-anchor: end}}
.mission .reach {{fill: var(--hover); fill-opacity: 0.16}}
.mission .dashed {{fill: none; stroke: currentColor; stroke-dasharray: 9 5; stroke-width: 2.5}}
.mission .spot {{fill: currentColor}}
{signs}
.mission .beam {{stroke-width: 1.2}}
.mission .second {{stroke-dasharray: 12 5}}
</style>
<svg class="mission" viewBox="0 0 390 476" role="img" aria-label="{told}">
{marks}
</svg>
"""


def plans() -> str:
    """Return the map with both plans of the slides."""
    judged = {"plan A": "battery", "plan B": "available"}
    best = {name: optuav.solve("paper", perspective=each) for name, each in judged.items()}
    return page({name: plan.route for name, plan in best.items()})


def page(routes: Mapping[str, Sequence[str]] | None = None) -> str:
    """Return the map as an SVG of HTML: of the direct route and all roofs, or of routes by name."""
    mission = optuav.load("paper")
    seen = scene(mission)
    roofs = [building.name for building in mission.buildings]
    named = (routes or {}).items()
    rests = {roof: name for name, route in named for roof in route if roof in roofs}
    names = ["origin", "hover", "destination", *roofs]
    assert mission.laser is not None
    spots = {"device": mission.link.device_m, "laser": mission.laser.position_m}
    spots |= dict(zip(names, seen.positions(names).tolist(), strict=True))
    at = {
        name: (LEFT + PX_PER_M * east_m, BOTTOM - PX_PER_M * north_m)
        for name, (east_m, north_m, _) in spots.items()
    }

    def spot(name: str, radius_px: float, kind: str) -> str:
        x, y = at[name]
        return f'<circle class="{kind}" cx="{x:.1f}" cy="{y:.1f}" r="{radius_px:.1f}"/>'

    def label(name: str, right: float, down: float, words: str = "", kind: str = "") -> str:
        x, y = at[name]
        return signs.text(x + right, y + down, words or name, kind)

    def beside(roof: str) -> str:
        """Its name on the side that is away from the laser, unless the way is there."""
        away = 1.0 if at[roof][0] > at["laser"][0] else -1.0
        right, down, kind = 8.0 * away, 5.0, "name" if away > 0.0 else "name end"
        if roof in rests:
            return label(roof, 2.5 * right, down, rests[roof], kind.removeprefix("name"))
        right, down, kind = INSIDE.get(roof, (right, down, kind))
        return label(roof, right, down, kind=kind)

    def square(roof: str) -> str:
        x, y = at[roof]
        return f'<rect class="roof" x="{x - 7:.1f}" y="{y - 7:.1f}" width="14" height="14"/>'

    ways = [*routes.values()] if routes else [["origin", "hover", "destination"]]
    looks = ("way", "way second") if routes else ("dashed",)
    marks = [
        spot("device", PX_PER_M * seen.disc_radii_m[0], "reach"),
        *(signs.line("beam", at["laser"], at[place]) for place in (rests or (*roofs, "hover"))),
        *(
            signs.line(look, *(at[place] for place in way))
            for look, way in zip(looks, ways, strict=True)
        ),
        *(spot(roof, 4.0, "spot") + beside(roof) for roof in roofs),
        *(square(roof) for roof in rests),
        *(spot(end, 6.0, "spot") for end in ("origin", "hover", "destination")),
        signs.device(*at["device"]),
        signs.laser(*at["laser"]),
        label("device", 16.0, 5.0),
        label("laser", 0.0, 28.0, kind="middle"),
        label("hover", 14.0, 6.0, "hover point"),
        label("origin", 0.0, 26.0, kind="middle"),
        label("destination", 0.0, 26.0, kind="middle"),
    ]
    style = "".join(f".mission {rule}\n" for rule in signs.STYLE.strip().splitlines())
    told = "Map of the mission, north up: origin, destination, hover point, device, laser, roofs"
    told += "".join(f", {name} by {roof}" for roof, name in rests.items())
    drawn = "\n".join(marks)
    return PICTURE.format(told=told, variables=variables(".mission"), signs=style, marks=drawn)


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(page(), "utf-8")
