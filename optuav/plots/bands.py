"""Coloured bands over stretches of time, named above the axes where there is room."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from matplotlib.axes import Axes
from matplotlib.patches import Patch

TINT = 0.15
NAMES_PT = 16.0
"""Room for the names between axes and title [pt]."""


class Band(NamedTuple):
    """A stretch of time [s], and words for it, the first that fits being taken."""

    begin_s: float
    end_s: float
    colour: str
    words: tuple[str, ...]


def draw_bands(axes: Sequence[Axes], bands: Sequence[Band]) -> None:
    """Draw bands on axes that share their time; name them above the first.

    Their limits are final, and their place is settled.
    """
    for band in bands:
        for ax in axes:
            ax.axvspan(band.begin_s, band.end_s, color=band.colour, alpha=TINT, linewidth=0.0)
    top = axes[0]
    for band in bands:
        ends = [(band.begin_s, 0.0), (band.end_s, 0.0)]
        left, right = top.transData.transform(ends)[:, 0]
        for words in band.words:
            text = top.annotate(
                words,
                (0.5 * (band.begin_s + band.end_s), 1.0),
                (0.0, 3.0),
                xycoords=("data", "axes fraction"),
                textcoords="offset points",
                ha="center",
                va="bottom",
                fontsize=7.5,
            )
            text.set_in_layout(False)
            if text.get_window_extent().width <= right - left:
                break
            text.remove()


def swatch(colour: str, label: str) -> Patch:
    """What a legend shows for a band."""
    return Patch(color=colour, alpha=2.0 * TINT, linewidth=0.0, label=label)
