"""Axes of charts."""

from __future__ import annotations

from collections.abc import Iterable

from matplotlib.axes import Axes

import optuav


def logarithmic(ax: Axes, values: Iterable[float]) -> Axes:
    """Return axes with logarithmic scales and room for values > 0 along y."""
    values = list(values)
    with optuav.plots.style.applied():
        ax.set(xscale="log", yscale="log", ylim=(0.3 * min(values), 3.0 * max(values)))
        optuav.plots.style.settle(ax)
    return ax
