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
from refresh import clone

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


if __name__ == "__main__":
    draw(DOCS / "pictures")
