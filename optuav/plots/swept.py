"""Hover times of a sweep over one key or two."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes

from optuav.errors import Fault, InputError
from optuav.plots import style
from optuav.plots.charts import Line, curves
from optuav.plots.heat import heat_map

if TYPE_CHECKING:
    import xarray

HOVER = "longest hover Δ [s]"
ROWS = ("scenario",)  # Dimension of rows of values


def swept(found: xarray.Dataset) -> Iterator[tuple[str, Axes]]:
    """Draw the hover times of a dataset over one key or two, one of them in rows at most.

    Over one key they are a line for each perspective, over two a map with contours for each of
    them; hatched, or left out, where there is no plan.

    Parameters
    ----------
    found
        As `optuav.batch` and `optuav.open_sweep` return it.

    Returns
    -------
    iterator of tuple
        Names of pictures with their axes.

    Raises
    ------
    InputError
        If the dataset has other dimensions, or a key with a single value.

    Examples
    --------
    >>> import optuav
    >>> found = optuav.batch("paper", {"limits.deadline_s": [600, 900, 1200]})
    >>> [(name, ax.get_xlabel()) for name, ax in optuav.plots.swept(found)]
    [('hover.png', 'limits.deadline_s [s]')]
    """
    rows = [name for name, each in getattr(found, "coords", {}).items() if each.dims == ROWS]
    if len(rows) == 1:
        found = found.swap_dims(dict.fromkeys(ROWS, rows[0]))
    hover_s, known = getattr(found, "hover_time_s", None), getattr(found, "attrs", {})
    keys = [name for name in getattr(hover_s, "dims", ()) if name != "perspective"]
    several = [each for each in keys if len(np.unique(found[each])) > 1]
    drawable = [each for each in several if "units" in found[each].attrs]
    if len(drawable) not in (1, 2) or drawable != keys or "mission" not in known:
        words = "a dataset of one mission over one key or two, of several values each"
        raise InputError([Fault("found", ", ".join(map(str, keys)), words)])
    for key in keys:
        found = found.sortby(key).drop_duplicates(key)
    hover_s = found.hover_time_s
    if "perspective" not in hover_s.dims:
        hover_s = hover_s.expand_dims(perspective=[found.attrs["perspective"]])
    units = [found[key].attrs["units"] for key in keys]
    labels = [
        f"{key} [{'-' if unit == '1' else unit}]" for key, unit in zip(keys, units, strict=True)
    ]
    across, *upwards = labels
    town, names = style.printed(found.attrs["mission"]), hover_s.perspective.values.tolist()
    if not upwards:
        lines = [Line(name, found[keys[0]], hover_s.sel(perspective=name)) for name in names]
        none = bool(hover_s.isnull().all())
        yield (
            "hover.png",
            curves(lines, title=town, x_label=across, y_label=HOVER, y_from_zero=none),
        )
        return
    for name in names:
        table = hover_s.sel(perspective=name).transpose(keys[1], keys[0])
        yield (
            f"hover-{name}.png",
            heat_map(
                found[keys[0]],
                found[keys[1]],
                table,
                title=f"{town}, perspective {name}",
                x_label=across,
                y_label=upwards[0],
                label=HOVER,
            ),
        )
