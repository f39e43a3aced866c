"""Make the three cards of the home page: ``python docs/make_cards.py FILE``.

Each has a picture of an answer that is computed here: a flight and a town, seen at a slant, and the
turns of a fleet.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from itertools import pairwise
from math import cos, radians, sin, sqrt
from pathlib import Path

import signs

import optuav
from optuav.arrays import Floats
from optuav.looks import variables
from optuav.mission import Mission
from optuav.network.map_extent import scene
from optuav.network.network import build_network

BASE = 132.0
"""Height of the nearest point of a scene in its picture [px]."""
DAY_LEFT, DAY_RIGHT, DAY_TOP, DAY_STEP, DAY_HEIGHT = 30.0, 384.0, 16.0, 29.0, 16.0
"""Frame of the bars of a fleet, the way from one to the next, and their height [px]."""
PICTURE = '<svg viewBox="0 0 400 150" role="img" aria-label="{told}">\n{marks}\n</svg>'
CARD = """\
<a class="card {name}" href="{page}">
{picture}
<div><h3>{title}</h3><p>{words}</p></div>
</a>
"""
STYLE = """
.cards .card {{
  background: var(--panel); border: 1px solid var(--line); border-radius: 12px; color: var(--ink);
  display: block; overflow: hidden; text-decoration: none;
}}
.card:is(:hover, :focus-visible) {{border-color: var(--laser)}}
.card svg {{border-bottom: 1px solid var(--line); display: block; height: auto; width: 100%}}
.card h3 {{font-size: 17px; line-height: 1.4; margin: 0 0 2px}}
.card div {{padding: 10px 16px 12px}}
.card p {{color: var(--muted); font-size: 15px; line-height: 1.45; margin: 0}}
.card text {{fill: var(--ink); font-size: 13px}}
.card .soft {{fill: var(--muted); font-size: 12px}}
.card .on-bar {{font-size: 12px; font-weight: 600; text-anchor: middle}}
.card .on-hover {{fill: var(--on-dark)}}
.card .on-rest {{fill: var(--edge)}}
.card .end {{text-anchor: end}}
.card .middle {{text-anchor: middle}}
.card .wall {{fill: color-mix(in srgb, var(--muted) 45%, var(--panel))}}
.card .top {{fill: color-mix(in srgb, var(--muted) 70%, var(--panel))}}
.card .lit {{fill: var(--rest)}}
.card .reach {{fill: var(--hover); fill-opacity: 0.16}}
.card .way {{stroke-width: 3}}
.town .beam {{stroke-width: 1.5}}
.card .at {{fill: var(--hover)}}
{signs}
"""

View = Callable[[float, float, float], tuple[float, float]]


def _view(
    at_px: tuple[float, float],
    px_per_m: float,
    slant: float,
    spot_m: tuple[float, float] = (0.0, 0.0),
    heading_deg: float = 0.0,
) -> View:
    """Where a point [m] is in a picture [px] of which a spot on the ground is at a place.

    Who looks at it has this heading; a slant of 1 is from above.
    """
    upright, turn = sqrt(1.0 - slant**2), radians(heading_deg)

    def seen(east_m: float, north_m: float, up_m: float) -> tuple[float, float]:
        east_m, north_m = east_m - spot_m[0], north_m - spot_m[1]
        right_m = east_m * cos(turn) - north_m * sin(turn)
        ahead_m = east_m * sin(turn) + north_m * cos(turn)
        return (
            at_px[0] + px_per_m * right_m,
            at_px[1] - px_per_m * (slant * ahead_m + upright * up_m),
        )

    return seen


def _corners(points: list[tuple[float, float]]) -> str:
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in points)


def _block(ring_m: Floats, roof_m: float, seen: View, kind: str) -> str:
    """A building: the walls that look south, and its roof."""
    ends = [*ring_m.tolist(), ring_m[0].tolist()]
    shape = "".join(
        f'<polygon class="wall" points="'
        f'{_corners([seen(*a, 0.0), seen(*b, 0.0), seen(*b, roof_m), seen(*a, roof_m)])}"/>'
        for a, b in pairwise(ends)
    )
    return (
        shape + f'<polygon class="{kind}" points="{_corners([seen(*p, roof_m) for p in ends])}"/>'
    )


def _blocks(mission: Mission, seen: View, lit: set[str]) -> str:
    """All buildings, the farthest first, roofs of these names coloured."""
    rings = sorted(
        zip(scene(mission).rings, mission.buildings, strict=True),
        key=lambda pair: max(seen(*corner, 0.0)[1] for corner in pair[0].tolist()),
    )
    return "\n".join(
        _block(ring_m, building.position_m[2], seen, "lit" if building.name in lit else "top")
        for ring_m, building in rings
    )


def flight() -> str:
    """The best plan of the mission `paper`."""
    plan = optuav.solve("paper")
    mission, laser = plan.mission, plan.mission.laser
    assert laser is not None
    view = scene(mission)
    seen = _view((60.0, BASE), 0.14, 0.27)
    places = dict(zip(plan.route, view.positions(plan.route).tolist(), strict=True))
    (roof,) = (stop.at for stop in plan.stops if stop.kind == "rest")
    (hover_x, hover_y), (roof_x, roof_y) = seen(*places["hover"]), seen(*places[roof])
    first_x, last_x = seen(*places["origin"])[0], seen(*places["destination"])[0]
    device_x, device_y = seen(*mission.link.device_m)
    rim_x, _ = seen(mission.link.device_m[0] + view.disc_radii_m[0], *mission.link.device_m[1:])
    _, rim_y = seen(0.0, mission.link.device_m[1] + view.disc_radii_m[0], mission.link.device_m[2])
    east_m, north_m, _ = laser.position_m
    at = seen(east_m, north_m, 0.0)
    radii = f'rx="{rim_x - device_x:.1f}" ry="{device_y - rim_y:.1f}"'
    hover, rest = f"hover {plan.hover_time_s:.0f} s", f"rest {plan.rest_time_s:.0f} s"
    marks = [
        f'<ellipse class="reach" cx="{device_x:.1f}" cy="{device_y:.1f}" {radii}/>',
        _blocks(mission, seen, {roof}),
        signs.line("beam", at, (roof_x, roof_y)),
        signs.line("way", *(seen(*places[name]) for name in plan.route)),
        signs.laser(at[0], at[1]),
        signs.device(device_x, device_y),
        f'<circle class="at" cx="{hover_x:.1f}" cy="{hover_y:.1f}" r="6"/>',
        f'<rect class="roof" x="{roof_x - 6:.1f}" y="{roof_y - 6:.1f}" width="12" height="12"/>',
        signs.text(hover_x - 14, hover_y + 2, hover, "end"),
        signs.text(roof_x + 14, roof_y + 4, rest),
        signs.text(first_x, BASE + 13, "origin", "soft middle"),
        signs.text(last_x, BASE + 13, "destination", "soft middle"),
        signs.text(at[0] + 15, at[1] + 8, "laser", "soft"),
        signs.text(device_x + 14, device_y + 4, "device", "soft"),
    ]
    told = (
        f"A drone flies from the origin to hover near a device for {plan.hover_time_s:.0f} s, "
        f"rests for {plan.rest_time_s:.0f} s on a roof, where a laser charges it, and flies on."
    )
    return PICTURE.format(told=told, marks="\n".join(marks))


def day() -> str:
    """The smallest fleet that covers all of the time over `relay-today`."""
    fleet = optuav.coverage("relay-today").fleet()
    period_s = fleet.starts_every_s * fleet.drones
    marks = list[str]()
    for number, row in enumerate(fleet.rows):
        top = DAY_TOP + DAY_STEP * number
        leg_s = row["flight_s"] / 2.0
        lasting = [("flight", leg_s), ("hover", row["hover_s"]), ("flight", leg_s)]
        lasting.append(("rest", row["rest_s"] + row["wait_s"]))
        marks.append(signs.text(DAY_LEFT - 16, top + 13, str(number + 1)))
        at_s = row["offset_s"] - period_s
        while at_s < period_s:
            for kind, duration_s in lasting:
                first_s, last_s = max(0.0, at_s), min(period_s, at_s + duration_s)
                if last_s > first_s:
                    x, width = (
                        (DAY_RIGHT - DAY_LEFT) * s / period_s for s in (first_s, last_s - first_s)
                    )
                    marks.append(
                        f'<rect x="{DAY_LEFT + x:.1f}" y="{top}" width="{max(width, 1.5):.1f}" '
                        f'height="{DAY_HEIGHT}" style="fill: var(--{kind})"/>'
                    )
                    if number == 0 and kind != "flight":
                        middle = DAY_LEFT + x + width / 2.0
                        marks.append(signs.text(middle, top + 12.5, kind, f"on-bar on-{kind}"))
                at_s += duration_s
    hours = f"{period_s / 3600.0:.1f} h"
    below = DAY_TOP + DAY_STEP * fleet.drones + 10
    marks.append(signs.text(DAY_LEFT, below, f"{fleet.drones} drones take turns: no gap", "soft"))
    marks.append(signs.text(DAY_RIGHT, below, f"one cycle: {hours}", "soft end"))
    told = (
        f"A bar for each of {fleet.drones} drones over {hours}: while one hovers, the others rest, "
        "and every moment is covered."
    )
    return PICTURE.format(told=told, marks="\n".join(marks))


def town() -> str:
    """Roofs of `relay-today` that its laser sees."""
    mission = optuav.load("relay-today")
    assert mission.laser is not None
    places = build_network(mission).places
    roofs = [
        (name, position_m)
        for name, position_m, sight in zip(
            places.names, places.position_m.tolist(), places.laser_sight, strict=True
        )
        if sight and name in {building.name for building in mission.buildings}
    ]
    east_m, north_m, up_m = mission.laser.position_m
    seen = _view((190.0, BASE), 0.56, 0.34, (east_m, north_m), 60.0)
    at = seen(east_m, north_m, up_m)
    marks = [
        _blocks(mission, seen, {name for name, _ in roofs}),
        *(signs.line("beam", at, seen(*position_m)) for _, position_m in roofs),
        signs.laser(*at),
        signs.text(at[0] + 15, at[1] + 8, "laser", "soft"),
    ]
    told = f"{len(roofs)} of {len(mission.buildings)} roofs of a town are in sight of its laser."
    words = f"{len(roofs)} of {len(mission.buildings)} roofs in sight"
    marks.append(signs.text(388.0, 143.0, words, "soft end"))
    return PICTURE.format(told=told, marks="\n".join(marks))


def page() -> str:
    """The cards as HTML."""
    cards = (
        ("flight", "first-plan.html", flight(), "One flight",
         "How long can it hover, and where does it rest?"),
        ("day", "coverage.html", day(), "A day",
         "How many drones do I need, with a laser, a pad, a cable or fresh packs?"),
        ("town", "city.html", town(), "A town",
         "Which roofs does a laser see, and where should lasers stand?"),
    )  # fmt: skip
    style = variables(".cards") + STYLE.format(
        signs="".join(f".card {rule}\n" for rule in signs.STYLE.strip().splitlines())
    )
    drawn = "".join(
        CARD.format(name=name, page=to, picture=picture, title=title, words=words)
        for name, to, picture, title, words in cards
    )
    return f'<div class="cards">\n<style>{style}</style>\n{drawn}</div>\n'


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(page(), "utf-8")
