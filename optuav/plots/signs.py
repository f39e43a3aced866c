"""Signs: one for each thing, the same in all pictures, as on the site and in the explorer."""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.path import Path
from matplotlib.patheffects import withStroke

from optuav.arrays import Floats
from optuav.looks import LOOKS
from optuav.plots.style import Look

RING, DOT = (0.82, 1.0), 0.5  # Radii of the ring of a device, inside and outside, and of its dot
DASHES, DASH = 8, 0.58  # Dashes of the ring, and the share of each that is drawn
CORNERS = 24  # Corners of a circle
ROTOR, ARM = 0.34, 0.62  # Radius of a rotor, and its distance from the middle of a drone each way
CASED = [
    withStroke(linewidth=3.4, foreground="white"),
    withStroke(linewidth=1.1, foreground=LOOKS["edge"].light),
]
"""Both edges of a sign on colours, so that it reads on dark and on light ones."""
Outline: TypeAlias = tuple[Floats, bool]  # Its corners (corner, 2), and whether it is closed


def _path(*outlines: Outline) -> Path:
    """A path of several outlines."""
    corners, codes = list[Floats](), list[np.uint8]()
    for points, closed in outlines:
        ends = [points, points[:1]] if closed else [points]
        corners += ends
        codes += [Path.MOVETO] + [Path.LINETO] * (len(points) - 1) + [Path.CLOSEPOLY] * closed
    return Path(np.concatenate(corners), codes)


def _arc(radius: float, begin: float, end: float) -> Floats:
    """Corners of an arc, from and to an angle in turns."""
    angle = 2.0 * np.pi * np.linspace(begin, end, 2 + round(CORNERS * abs(end - begin)))
    return radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def _circle(radius: float, at: tuple[float, float] = (0.0, 0.0)) -> Outline:
    """A circle as an outline."""
    return _arc(radius, 0.0, 1.0)[:-1] + np.array(at), True


def _dashes() -> list[Outline]:
    """The dashes of a ring as outlines."""
    inside, outside = RING
    begins = [(k / DASHES, (k + DASH) / DASHES) for k in range(DASHES)]
    arcs = [(_arc(outside, a, b), _arc(inside, b, a)) for a, b in begins]
    return [(np.concatenate(arc), True) for arc in arcs]


def _drone() -> Path:
    """A drone from above: two arms and four rotors, to be drawn as lines."""
    corners = [(x, y) for x in (-ARM, ARM) for y in (-ARM, ARM)]
    arms = [(np.array([corners[k], corners[3 - k]]), False) for k in (0, 1)]
    return _path(*arms, *(_circle(ROTOR, corner) for corner in corners))


class Sign(NamedTuple):
    """The sign of a thing.

    Parameters
    ----------
    role
        The role of its colour in `optuav.looks`.
    marker, hollow
        Its shape, for matplotlib, and that of one that is absent or only possible.
    size_pt
        Its size [pt].
    edge
        The role of its edge; none by default.
    """

    role: str
    marker: str | Path
    size_pt: float
    hollow: str | Path = ""
    edge: str = ""


SIGNS = {
    "laser": Sign("laser", "^", 8.0),
    "device": Sign("hover", _path(_circle(DOT), *_dashes()), 11.0, _path(*_dashes())),
    "hover": Sign("hover", "o", 6.5),
    "rest": Sign("rest", "s", 6.5),
    "end": Sign("ink", "D", 4.5),  # Of a route
    "roof": Sign("muted", "s", 2.0),
    "optimum": Sign("optimum", "*", 11.0, edge="edge"),
    "drone": Sign("ink", _drone(), 15.0),
}
"""Signs by name of the thing."""


def look(thing: str, *, hollow: bool = False, cased: bool = False) -> Look:
    """The look of a thing's sign, hollow where it is absent; cased it reads on any fill."""
    role, marker, size_pt, other, edge = SIGNS[thing]
    colour, is_drawn = LOOKS[role].light, thing == "drone"
    inside = "none" if is_drawn else "white" if hollow and not other else colour
    shown: Look = {"marker": (hollow and other) or marker, "markersize": size_pt}
    shown |= {"markerfacecolor": inside, "markeredgecolor": LOOKS[edge].light if edge else colour}
    shown |= {"markeredgewidth": 1.6 if is_drawn else 0.0 if inside == colour and not edge else 0.9}
    return {**shown, "linestyle": "", **({"path_effects": CASED} if cased else {})}


def put(
    ax: Axes,
    thing: str,
    at: npt.ArrayLike,
    label: str = "",
    *,
    hollow: bool = False,
    cased: bool = False,
    **more: object,
) -> list[Line2D]:
    """Put the sign of a thing at points (2,) or (point, 2) or with a height; the legend's entry.

    There is no entry without points or words.
    """
    points = np.atleast_2d(np.asarray(at, dtype=float))[:, :2]
    options: Look = {"zorder": 6, **look(thing, hollow=hollow, cased=cased), **more}
    if label:
        options["label"] = label
    drawn = ax.plot(*points.T, **options) if points.size else []
    return drawn if label else []
