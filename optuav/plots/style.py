"""What all pictures share: colours, type, pages, and names made fit to print."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import AbstractContextManager
from functools import cache
from typing import Any

import matplotlib.style
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties, findfont, get_font
from matplotlib.ticker import FuncFormatter

from optuav.errors import Fault, InputError

BLACK = "#000000"
ORANGE = "#E69F00"
SKY = "#56B4E9"
GREEN = "#009E73"
YELLOW = "#F0E442"
BLUE = "#0072B2"
VERMILLION = "#D55E00"
PURPLE = "#CC79A7"
GREY = "#7F7F7F"
PALE = "#D9D9D9"
"""The palette of Okabe and Ito, which colour-blind readers can tell apart, and two greys."""

KINDS = {"flight": BLUE, "hover": GREEN, "rest": ORANGE}
"""Colour of every kind of phase."""

FONT = "DejaVu Sans"
RC: dict[str, Any] = {
    "font.family": FONT,
    "font.size": 8.0,
    "axes.titlesize": 8.5,
    "axes.titlelocation": "left",
    "axes.labelsize": 8.0,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.formatter.useoffset": False,
    "xtick.labelsize": 7.5,
    "ytick.labelsize": 7.5,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "legend.fontsize": 7.5,
    "legend.frameon": False,
    "lines.linewidth": 1.4,
    "hatch.linewidth": 0.5,
    "svg.hashsalt": "optuav",
}

DOTS_PER_INCH = 200
LONGEST_NAME = 24


def styled() -> AbstractContextManager[None]:
    """The look of the pictures, whatever matplotlib is set to; the user's settings come back."""
    return matplotlib.style.context(["default", RC])


def page(width_in: float, height_in: float) -> Figure:
    """An empty figure without a window [inch]."""
    return Figure(figsize=(width_in, height_in), dpi=DOTS_PER_INCH, layout="constrained")


def printed(name: str) -> str:
    """A name as a picture shows it: not too long, no mathematics, only letters of the font."""
    short = name if len(name) <= LONGEST_NAME else f"{name[: LONGEST_NAME - 1]}…"
    known = "".join(letter if ord(letter) in _letters() else "□" for letter in short)
    return known.replace("$", r"\$")


@cache
def _letters() -> frozenset[int]:
    return frozenset(get_font(findfont(FontProperties(family=FONT))).get_charmap())


def group_thousands(*axes: Axes) -> None:
    """Set the thousands of long tick labels apart, on both axes."""
    for ax in axes:
        ax.xaxis.set_major_formatter(FuncFormatter(_grouped))
        ax.yaxis.set_major_formatter(FuncFormatter(_grouped))


def _grouped(value: float, _position: float | None) -> str:
    separator = "," if abs(value) >= 1e4 else ""
    text = f"{value:{separator}.10g}"
    return text.replace(",", "\N{THIN SPACE}").replace("-", "\N{MINUS SIGN}")


def margins(
    values: Iterable[float], share: float = 0.05, least: float = 1.0
) -> tuple[float, float]:
    """Limits of an axis that leave some room around values, at least `least` wide."""
    low, high = min(values := list(values)), max(values)
    room = max(share * (high - low), 0.5 * (least - (high - low)))
    return low - room, high + room


def need_panels(axes: object, kind: type[tuple[Any, ...]]) -> None:
    """Refuse axes that are not the panels a picture draws on.

    Raises
    ------
    InputError
        Naming what is needed.
    """
    if axes is not None and not isinstance(axes, kind):
        panels = ", ".join(kind._fields)  # type: ignore[attr-defined]
        words = f"{kind.__name__}({panels}) with matplotlib axes, as the function returns it"
        raise InputError([Fault("axes", type(axes).__name__, words)])
