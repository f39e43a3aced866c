"""Frames of an animation as a GIF in memory, small because all share one palette."""

from __future__ import annotations

import io
import itertools
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.animation import AbstractMovieWriter
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from optuav.plots.style import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, VERMILLION

COLOURS = 256
PALETTE = (BLACK, ORANGE, SKY, GREEN, BLUE, VERMILLION, PURPLE, GREY)
"""Colours that stay as they are, however little of the picture they fill."""


def drawn(figure: Figure) -> npt.NDArray[np.uint8]:
    """A figure that is laid out as an image (row, column, colour)."""
    before = figure.canvas
    canvas: Any = FigureCanvasAgg(figure)
    canvas.draw()
    figure.set_canvas(before)  # an animation draws on the figure's canvas too: once is enough
    return np.array(canvas.buffer_rgba())


class GifWriter(AbstractMovieWriter):
    """Keeps what does not move from frame to frame the same, which matplotlib's own does not.

    Parameters
    ----------
    fps
        Frames a second.
    """

    content = b""

    def setup(self, fig: Figure, outfile: Any, dpi: float | None = None) -> None:
        """Begin; nothing is written to the file."""
        self.figure, self.frames = fig, list[Image.Image]()

    def grab_frame(self, **_: Any) -> None:
        """Keep the figure as it is now."""
        self.frames.append(Image.fromarray(drawn(self.figure)).convert("RGB"))

    def finish(self) -> None:
        """Put the frames together, in the colours of three of them and of the house."""
        samples = [self.frames[at] for at in (0, len(self.frames) // 2, -1)]
        width, height = samples[0].size
        samples += [Image.new("RGB", (width, height // 8), colour) for colour in PALETTE]
        sheet = Image.new("RGB", (width, sum(each.height for each in samples)))
        tops = itertools.accumulate((each.height for each in samples), initial=0)
        for top, each in zip(tops, samples, strict=False):
            sheet.paste(each, (0, top))
        palette = sheet.quantize(COLOURS)
        first, *rest = (
            each.quantize(palette=palette, dither=Image.Dither.NONE) for each in self.frames
        )
        file = io.BytesIO()
        first.save(
            file,
            format="GIF",
            save_all=True,
            append_images=rest,
            duration=round(1000 / self.fps),
            loop=0,
        )
        self.content = file.getvalue()
