"""Draw the pictures of the pages by the code of the gallery: ``python docs/make_pictures.py``.

Draw them again after a change of the plots; matplotlib is needed. The picture that a link to the
site shows is drawn too.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from refresh import clone

import optuav
from optuav.looks import LOOKS
from optuav.plots.style import Page

DOCS = Path(__file__).parent
BLOCK = re.compile(r"\(pictures/([\w-]+)\.png\)\n\n```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)
DOTS_PER_INCH = 110
"""Resolution of a picture on the page of optuav; another figure has its own."""


def pictures() -> Iterator[tuple[str, Axes]]:
    """Name of every picture, and one of its axes: what its block calls ``picture``."""
    names: dict[str, Any] = {}
    with clone():
        for name, code in BLOCK.findall((DOCS / "gallery.md").read_text("utf-8")):
            exec(compile(code, f"gallery.md, {name}", "exec"), names)
            drawn = names["picture"]
            yield name, drawn if isinstance(drawn, Axes) else drawn[0]


def draw(directory: Path) -> None:
    """Write all pictures into a directory."""
    for name, ax in pictures():
        figure = ax.get_figure(root=True)
        assert figure is not None
        dpi = DOTS_PER_INCH if isinstance(figure, Page) else figure.dpi
        figure.savefig(directory / f"{name}.png", dpi=dpi, metadata={"Software": None})


def preview() -> Figure:
    """The picture of a link to the site, 1200 by 630 pixels: its sentence, and both plans."""
    plans = [optuav.solve("paper", perspective=each) for each in ("battery", "available")]
    falls, flies = map(optuav.replay, plans)
    figure = Figure((10.0, 5.25), dpi=120, layout="constrained")
    left, right = figure.subfigures(1, 2, width_ratios=(2.0, 3.0))
    optuav.plots.wells(plans, figure=right)
    for height, size, role, words in (
        (0.86, 25, "ink", "Keep a drone\nin the air\nwith a laser\non the ground"),
        (0.38, 12, "ink", "A published optimum"),
        (0.32, 16, "dry", f"✕ falls at {falls.first_s('empty'):.0f} s"),
        (0.22, 12, "ink", "optuav's plan"),
        (0.16, 16, "flies", f"✓ lands at {flies.trace.time_s[-1]:.0f} s"),
    ):
        left.text(
            *(0.1, height, words),
            color=LOOKS[role].light,
            fontsize=size,
            fontweight="bold" if size > 12 else "normal",
            linespacing=1.25,
            verticalalignment="top",
        )
    return figure


if __name__ == "__main__":
    draw(DOCS / "pictures")
    preview().savefig(DOCS / "_static" / "preview.png", metadata={"Software": None})
