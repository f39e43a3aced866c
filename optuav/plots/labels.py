"""Labels beside points, placed one after the other away from other labels and from lines."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.patheffects import withStroke
from matplotlib.text import Annotation
from matplotlib.transforms import Bbox

from optuav.arrays import Floats
from optuav.plots.style import GREY, VERMILLION, Look, beside, root

POINTS_PER_INCH = 72.0
NEAR = (4.0, 8.0)
FAR = (14.0, 22.0, 32.0, 44.0, 58.0, 74.0, 92.0, 112.0)
"""Distances of a label from its point [pt]; far ones get a line to it."""
DIRECTIONS = ((1, 1), (1, -1), (-1, 1), (-1, -1), (1, 0), (-1, 0), (0, 1), (0, -1))
CLEARANCE = 1.5
"""Least distance between two labels [pt]."""
STRONG, FAINT = 1.0, 4.0
"""Distance of the dots that stand for a line [pt]."""
MOST_DOTS = 4000
"""Most dots along a line."""
OUTSIDE, PER_POINT = 1000.0, 0.5
"""Costs of leaving the axes, and of each point of distance; a covered dot costs 1."""
MOST_COVERED = 2
"""Most dots that a label covers which is not needed."""
LEADER = {"arrowstyle": "-", "linewidth": 0.4, "color": GREY, "shrinkA": 0.0, "shrinkB": 2.0}


@dataclass(frozen=True)
class Label:
    """A text [pt] that belongs to a point in the data's coordinates.

    One that is not needed is left out where there is little room.
    """

    text: str
    at: tuple[float, float]
    needed: bool = True
    colour: str = "black"
    size: float = 7.5


def place(
    ax: Axes,
    labels: Sequence[Label],
    lines: Iterable[npt.ArrayLike] = (),
    faint: Iterable[npt.ArrayLike] = (),
) -> None:
    """Write labels beside their points, needed ones first, away from each other and from lines.

    Limits and place of the axes are final. Lines are arrays (n, 2) of corners in the data's
    coordinates; faint ones are avoided less strictly.
    """
    pixels = root(ax).dpi / POINTS_PER_INCH
    points = [[label.at] for label in labels]
    spaced = ((lines, STRONG * pixels), ([*faint, *points], FAINT * pixels))
    dots = np.concatenate(
        [np.empty((0, 2)), *(_dots(ax, line, gap) for found, gap in spaced for line in found)]
    )
    taken: list[Bbox] = []
    for label in sorted(labels, key=lambda each: not each.needed):
        text = _write(ax, label, (0.0, 0.0), far=False)
        size = text.get_window_extent()
        text.remove()
        spots = []
        for cost, far, box in _spots(ax, label, size, pixels):
            padded = box.padded(CLEARANCE * pixels)
            if not any(padded.overlaps(other) for other in taken):
                covered = int(((dots >= box.min) & (dots <= box.max)).all(axis=1).sum())
                if covered <= MOST_COVERED or label.needed:
                    spots.append((cost + covered, far, box))
        if spots:
            _, far, box = min(spots, key=lambda each: each[0])
            offset_pt = ((box.x0 - size.x0) / pixels, (box.y0 - size.y0) / pixels)
            _write(ax, label, offset_pt, far=far)
            taken.append(box)


def mark(
    ax: Axes,
    events: Iterable[tuple[str, float, float]],
    lines: Iterable[npt.ArrayLike],
    faint: Iterable[npt.ArrayLike] = (),
) -> None:
    """Draw dots at events (words, x, y) where a limit is passed, with their words beside them."""
    labels = [Label(words, (x, y), colour=VERMILLION) for words, x, y in events]
    for label in labels:
        ax.plot(*label.at, "o", color=VERMILLION, markersize=4.5, clip_on=False, zorder=5)
    place(ax, labels, lines, faint)


def _write(ax: Axes, label: Label, offset_pt: tuple[float, float], *, far: bool) -> Annotation:
    """Write a label at an offset, with a line to its point if it is far."""
    look: Look = {"ha": "left", "va": "bottom", "color": label.colour, "fontsize": label.size}
    look |= {"path_effects": [withStroke(linewidth=2.0, foreground="white")], "zorder": 10}
    look |= {"arrowprops": LEADER if far else None, "annotation_clip": False, "linespacing": 1.1}
    return beside(ax, label.text, label.at, offset_pt, **look)


def _spots(ax: Axes, label: Label, size: Bbox, pixels: float) -> Iterator[tuple[float, bool, Bbox]]:
    """Places around a label's point, inside the axes unless it is needed: cost, if far, box."""
    frame, anchor = ax.get_window_extent(), ax.transData.transform(label.at)
    for ring, (x, y) in itertools.product((*NEAR, *FAR) if label.needed else NEAR, DIRECTIONS):
        reach = ring * pixels / math.hypot(x, y)
        left = anchor[0] + x * reach + (x - 1) * size.width / 2
        low = anchor[1] + y * reach + (y - 1) * size.height / 2
        inside = frame.x0 <= left <= frame.x1 - size.width and (
            frame.y0 <= low <= frame.y1 - size.height
        )
        if inside or label.needed:
            box = Bbox.from_bounds(left, low, size.width, size.height)
            yield PER_POINT * ring + OUTSIDE * (not inside), ring in FAR, box


def _dots(ax: Axes, line: npt.ArrayLike, spacing: float) -> Floats:
    """Dots [px] along a line, its corners among them, about a spacing apart."""
    corners = ax.transData.transform(np.asarray(line, dtype=float))
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(corners, axis=0).T))])
    count = min(MOST_DOTS, int(along[-1] / spacing))
    at = np.union1d(np.linspace(0.0, along[-1], count + 1), along)
    return np.stack([np.interp(at, along, each) for each in corners.T], axis=1)
