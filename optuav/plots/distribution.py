"""Distribution of a figure over many scenarios: histogram and cumulative distribution."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import cycle
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes

from optuav.arrays import Floats
from optuav.errors import Fault, InputError
from optuav.mission.messages import plural, unknown
from optuav.plots import style
from optuav.plots.charts import DASHES, LINES
from optuav.plots.sweeps import InDirectory, answered
from optuav.plots.uncertainty import draw_without_plan

if TYPE_CHECKING:
    import xarray

MOST_BINS = 40


@style.applied()
def distribution(
    found: xarray.Dataset | InDirectory | str | Path,
    variable: str = "hover_time_s",
    *,
    figure: style.AnyFigure | None = None,
) -> Sequence[Axes]:
    """Draw the histogram and the cumulative distribution of a variable over all scenarios.

    Perspectives are lines of their own. Shares refer to all scenarios: those without a plan are a
    bar at the left, and the cumulative distribution begins with them.

    Parameters
    ----------
    found
        As `optuav.batch` and `optuav.open_sweep` return it, or the directory of a sweep.
    variable
        The name of one of its times and charges.
    figure
        Where to draw; on a page of its own by default.

    Returns
    -------
    The axes of histogram and cumulative distribution, with shares in % over values in the unit of
    the variable.

    Raises
    ------
    InputError
        If the dataset is not such an answer, has no such variable, or no scenario has a plan.

    Examples
    --------
    >>> import optuav
    >>> answers = optuav.batch("paper", {"limits.deadline_s": [10, 900, 1200]})
    >>> histogram, cumulative = optuav.plots.distribution(answers)
    >>> histogram.get_legend().get_texts()[0].get_text()
    'available: no plan in 1 of 3'
    """
    found = answered(found)
    variables = [str(name) for name, values in found.data_vars.items() if values.dtype.kind == "f"]
    if variable not in variables:
        raise InputError([unknown("variable", variable, variables)])
    values = found[variable]
    if "perspective" not in values.dims:
        values = values.expand_dims(perspective=[found.attrs["perspective"]])
    if values.isnull().all():
        raise InputError([Fault("found", variable, "must have a plan in at least one scenario")])
    axes = style.Panels((figure or style.page(4.6)).subplots(2, 1, sharex=True))
    histogram, cumulative = axes
    names = values.perspective.values.tolist()
    bins = min(MOST_BINS, 2 + math.isqrt(values.size // len(names)))
    edges = np.histogram_bin_edges(values.to_numpy()[values.notnull().to_numpy()], bins)
    # The first are the widest, so that they are seen beneath others.
    widths = np.linspace(1.2 + 0.7 * (len(names) - 1), 1.2, len(names)).tolist()
    planned, looks = list[Floats](), list[style.Look]()
    for name, width, colour, dashes in zip(names, widths, cycle(LINES), cycle(DASHES)):
        row = values.sel(perspective=name).to_numpy().ravel()
        there = np.sort(row[np.isfinite(row)])
        none = f": no plan in {len(row) - len(there)} of {len(row)}" * (len(there) < len(row))
        look: style.Look = {"color": colour, "linestyle": dashes, "linewidth": width}
        look["label"] = f"{name}{none}"
        histogram.stairs(100.0 / len(row) * np.histogram(there, edges)[0], edges, **look)
        planned.append(there)
        looks.append(look)
    count, begin = len(row), None
    without = [1.0 - len(there) / count for there in planned]
    if any(without):
        shares = [(share, look["color"]) for share, look in zip(without, looks, strict=True)]
        begin = draw_without_plan(histogram, shares, (edges[0], edges[-1]))
    for there, none_share, look in zip(planned, without, looks, strict=True):
        if len(there):
            upto = 100.0 * (none_share + np.arange(len(there) + 1) / count)
            at = [there[0] if begin is None else begin, *there]
            cumulative.step(at, upto, where="post", **look)
    histogram.set(ylabel="share of scenarios [%]", ylim=(0.0, None))
    least = ", or no plan" * any(without)
    cumulative.set(ylabel=f"share up to a value{least} [%]", ylim=(0.0, 104.0))
    cumulative.set(xlabel=f"{values.attrs['long_name']} [{values.attrs['units']}]")
    rows = -(-len(names) // 2)
    words = f"{values.attrs['long_name']} in {plural(count, 'scenario')}"
    histogram.set_title(style.titled(found.attrs["mission"], words), pad=4.0 + 14.0 * rows)
    style.legend_above(histogram, min(2, len(names)))
    for ax in axes:
        ax.yaxis.grid(True, linewidth=0.4, color=style.PALE)
    style.group_thousands(*axes)
    style.settle(histogram)
    return axes
