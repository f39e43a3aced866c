"""Moving pictures that a notebook shows."""

from __future__ import annotations

import io
from base64 import b64encode
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from tempfile import TemporaryDirectory

from PIL import Image, ImageSequence

import optuav
from optuav.plots.animation import gif


@dataclass(frozen=True)
class Movie:
    """A GIF, and words for readers who do not see it; its end stands still if they ask for that."""

    gif: bytes
    words: str

    def _repr_html_(self) -> str:
        *_, last = ImageSequence.Iterator(Image.open(io.BytesIO(self.gif)))
        still = io.BytesIO()
        last.convert("RGB").save(still, "png")
        moving, end = (b64encode(data).decode() for data in (self.gif, still.getvalue()))
        look = f"display: block; width: 100%; max-width: {last.width}px"
        return (
            '<picture><source media="(prefers-reduced-motion: reduce)" '
            f'srcset="data:image/png;base64,{end}">'
            f'<img alt="{escape(self.words)}" style="{look}" src="data:image/gif;base64,{moving}">'
            "</picture>"
        )


def flight(plan: optuav.Plan) -> Movie:
    """Return a plan in motion: the map, and the wells as they are emptied."""
    with TemporaryDirectory() as directory:
        file = optuav.plots.save_animation(plan, Path(directory) / "flight.gif")
        return Movie(file.read_bytes(), f"The plan by {' → '.join(plan.route)} in motion")


def movie(frames: Sequence[Image.Image], words: str, kept: Sequence[str] = ()) -> Movie:
    """Return frames as a movie that repeats; white and the colours to be kept stay exact."""
    return Movie(gif(frames, kept), words)
