"""A battery as two vessels of water, joined by a thin pipe at their floors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.patches import Polygon, Rectangle
from PIL import Image

import optuav
from optuav.exercises.helpers.movies import Movie, movie
from optuav.looks import LOOKS
from optuav.physics.kibam import Battery, Stage, Wells, step
from optuav.presentation.numbers import amperes, fixed

AVAILABLE, BOUND, STREAM, INK = (LOOKS[role].light for role in ("available", "bound", "dry", "ink"))
GAP, THICK = 0.16, 0.035  # Length and height of the pipe, in widths and heights of the whole
FRAMES, HELD = 60, 12  # Moments of a movie, and how long the last of them stays


def _valve(ax: Axes, x: float, is_open: bool) -> None:
    """Draw a valve: two triangles, filled if it is closed."""
    wide, high = 0.035, 0.05
    for side in (-1.0, 1.0):
        corners = [(x, THICK / 2)] + [(x + side * wide, THICK / 2 + up) for up in (-high, high)]
        ax.add_patch(Polygon(corners, facecolor="white" if is_open else INK, edgecolor=INK))


def draw(ax: Axes, battery: Battery, wells: Wells, drawn_A: float, title: str) -> None:
    """Draw the two vessels to scale: widths ω and 1 − ω, the height of a full one B."""
    ω, capacity_As = float(battery.available_fraction), float(battery.capacity_As)
    right = ω + GAP
    vessels = ((0.0, ω, wells.available_As, AVAILABLE), (right, 1.0 - ω, wells.bound_As, BOUND))
    for left, width, charge_As, colour in vessels:
        height = max(0.0, float(charge_As) / (width * capacity_As))
        ax.add_patch(Rectangle((left, 0.0), width, height, color=colour, linewidth=0.0))
        walls = [left, left, left + width, left + width], [1.1, 0.0, 0.0, 1.1]
        ax.plot(*walls, color=INK, linewidth=1.5, solid_joinstyle="miter")
        words = f"{fixed(max(0.0, float(charge_As)), 0)} A s"
        ax.text(left + width / 2, 1.13, words, ha="center", fontsize=8, color=INK)
    ax.add_patch(Rectangle((ω, 0.0), GAP, THICK, facecolor=BOUND, edgecolor=INK, linewidth=0.8))
    ax.add_patch(Rectangle((-0.2, 0.0), 0.2, THICK, facecolor=AVAILABLE, edgecolor=INK, lw=0.8))
    _valve(ax, ω + GAP / 2, is_open=True)
    _valve(ax, -0.08, is_open=drawn_A > 0.0)
    if drawn_A > 0.0:
        ax.plot([-0.2, -0.2], [THICK, -0.2], color=STREAM, linewidth=3.0, linestyle=(0, (2, 1)))
    tap = amperes(drawn_A) if drawn_A > 0.0 else "tap closed"
    ax.text(-0.24, -0.1, tap, ha="right", va="center", fontsize=8, color=INK)
    ax.plot([-0.1, 1.0 + GAP + 0.08], [1.0, 1.0], color=INK, linewidth=0.6, linestyle=(0, (4, 3)))
    ax.text(1.0 + GAP + 0.1, 1.0, "full", va="center", fontsize=8, color=INK)
    for middle, name in ((ω / 2, "available"), (right + (1.0 - ω) / 2, "bound")):
        ax.text(middle, -0.05, name, ha="center", va="top", fontsize=8, color=INK)
    ax.set(xlim=(-0.62, 1.36), ylim=(-0.25, 1.3))
    ax.set_title(title)
    ax.set_axis_off()


def vessels(states: Mapping[str, tuple[Battery, Wells, float]]) -> object:
    """Draw batteries side by side: by title, the battery, its wells and the current drawn [A]."""
    with optuav.plots.style.applied():
        figure = optuav.plots.style.page(2.4)
        axes = figure.subplots(1, len(states), squeeze=False)[0]
        for ax, (title, (battery, wells, drawn_A)) in zip(axes, states.items(), strict=True):
            draw(ax, battery, wells, drawn_A, title)
    return optuav.plots.style.Panels(axes)


def moving(battery: Battery, load: Sequence[tuple[float, float]]) -> Movie:
    """Return the two vessels in motion, from full, under currents drawn [A] for durations [s]."""
    ends_s = np.cumsum([duration_s for _, duration_s in load])
    images = []
    for moment_s in np.linspace(0.0, ends_s[-1], FRAMES):
        wells, left_s = battery.full, float(moment_s)
        for drawn_A, duration_s in load:
            wells = step(battery, wells, Stage(-drawn_A, min(left_s, duration_s)))
            if (left_s := left_s - duration_s) <= 0.0:
                break
        with optuav.plots.style.applied():
            figure = optuav.plots.style.page(2.6, 4.2)
            figure.set_dpi(120)
            draw(
                figure.subplots(), battery, wells, drawn_A, f"after {fixed(moment_s / 60.0, 1)} min"
            )
            canvas: Any = FigureCanvasAgg(figure)  # Without types
            canvas.draw()
        images.append(Image.fromarray(np.array(canvas.buffer_rgba())).convert("RGB"))
    images += [images[-1]] * HELD
    return movie(images, "Two joined vessels, emptied and left alone in turn", (STREAM,))
