"""Hover times over one key or two, and any quantity over two others as colours with contours."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colorbar import Colorbar
from matplotlib.colors import Normalize
from matplotlib.patches import Patch, Rectangle
from matplotlib.patheffects import withStroke
from matplotlib.text import Text
from matplotlib.ticker import MaxNLocator
from matplotlib.transforms import Bbox

import optuav
from optuav.arrays import Floats
from optuav.errors import Fault, InputError, shown
from optuav.options import LONGEST_HOVER
from optuav.plots import style
from optuav.plots.charts import Line, curves
from optuav.plots.style import BLACK, GREY, Look

if TYPE_CHECKING:
    import xarray

COLOURS = "viridis"  # Brightness keeps its order for colour-blind readers
MOST_CONTOURS = 8
CLOSE_PT = 2.5  # Distance of two contours below which they are one thick line
NONE: Look = {"facecolor": "white", "edgecolor": GREY, "hatch": "////", "linewidth": 0.0}
"""The look of places without a value."""
HOVER = "hover Δ [s]"
LONGEST = f"longest {HOVER}"
BELOW: Look = {"loc": "outside lower left", "ncols": 3}  # Place of a legend
MOST_PANELS, PANELS_ACROSS = 12, 3  # Size of small multiples
LONG_LABEL = 40  # Characters of a label that is as long as a row of them is high
ROWS = ("scenario",)  # Dimension of rows of values


class InDirectory(Protocol):
    """What is kept in a directory, such as a sweep."""

    @property
    def directory(self) -> Path: ...  # noqa: D102


def swept(
    found: xarray.Dataset | InDirectory | str | Path, *, ax: Axes | None = None
) -> style.Pictures:
    """Draw the hover times of a dataset over up to three keys, one of them in rows at most.

    Over one key they are a line for each perspective, over two a map with contours for each of
    them, and over three a map for each value of the key that has fewest, 12 of them at most;
    hatched, or left out, without a plan.

    Parameters
    ----------
    found
        As `optuav.batch` and `optuav.open_sweep` return it, or the directory of a sweep.
    ax
        Where to draw lines, or the map of a single perspective; by default every picture has a page
        of its own.

    Returns
    -------
    tuple of tuple
        Names of pictures with their axes.

    Raises
    ------
    InputError
        If the dataset has other dimensions, or a key with a single value; or if there are axes for
        several maps.

    Examples
    --------
    >>> import optuav
    >>> answers = optuav.batch("paper", {"limits.deadline_s": [600, 900, 1200]})
    >>> [(name, ax.get_xlabel()) for name, ax in optuav.plots.swept(answers)]
    [('hover.png', 'limits.deadline_s [s]')]
    """
    return style.Pictures(_drawn(answered(found), ax))


def answered(found: xarray.Dataset | InDirectory | str | Path) -> xarray.Dataset:
    """The dataset of a batch, or of a sweep by its directory; refused otherwise."""
    place: Any = getattr(found, "directory", found)
    if isinstance(place, str | Path):
        opened: xarray.Dataset = optuav.open_sweep(place)
        return opened
    if not {"mission", "problem"} <= {*getattr(found, "attrs", ())}:
        words = "a dataset of one mission, as optuav.batch returns it, or the directory of a sweep"
        raise InputError([Fault("found", shown(found), words)])
    answers: xarray.Dataset = place
    return answers


def _drawn(found: xarray.Dataset, ax: Axes | None) -> Iterator[tuple[str, Axes]]:
    """Name and axes of one picture after the other."""
    rows = [name for name, each in getattr(found, "coords", {}).items() if each.dims == ROWS]
    if len(rows) == 1:
        found = found.swap_dims(dict.fromkeys(ROWS, rows[0]))
    hover_s, known = getattr(found, "hover_time_s", None), getattr(found, "attrs", {})
    keys = [name for name in getattr(hover_s, "dims", ()) if name != "perspective"]
    stated_keys = [key for key in keys if "units" in found[key].attrs]
    several = [key for key in stated_keys if len(np.unique(found[key])) > 1]
    if len(keys) not in (1, 2, 3) or several != keys or not known.keys() >= {"mission", "problem"}:
        words = "a dataset of one mission over up to three keys, of several values each"
        raise InputError([Fault("found", ", ".join(map(str, keys)), words)])
    found = found.sortby(keys).drop_duplicates(keys)
    hover_s = found.hover_time_s
    if "perspective" not in hover_s.dims:
        hover_s = hover_s.expand_dims(perspective=[found.attrs["perspective"]])
    town, units = style.drawable(known["mission"]), {key: found[key].attrs["units"] for key in keys}
    longest = known["problem"].partition("(")[0] in LONGEST_HOVER
    words = LONGEST if longest else HOVER
    perspectives = hover_s.perspective.values.tolist()
    by_perspective = {name: hover_s.sel(perspective=name) for name in perspectives}
    if len(keys) == 1:
        across = f"{keys[0]} [{bracketed(units[keys[0]])}]"
        lines = [Line(name, found[keys[0]], values) for name, values in by_perspective.items()]
        none = bool(hover_s.isnull().all())
        ax = curves(lines, title=town, x_label=across, y_label=words, y_from_zero=none, ax=ax)
        if none:
            style.beside(ax, "no plan", (0.5, 0.5), (0.0, 0.0), xycoords="axes fraction")
        yield "hover.png", ax
        return
    if ax is not None and (len(keys) == 3 or len(perspectives) > 1):
        raise InputError([Fault("ax", "", "must be left out: this dataset has several maps")])
    few = min(keys, key=lambda key: found.sizes[key]) if len(keys) == 3 else None
    first, second = (key for key in keys if key != few)
    names = [f"{key} [{bracketed(units[key])}]" for key in (first, second)]
    labels = (names[0], names[1], words)
    x, y = (found[key].to_numpy() for key in (first, second))
    for name, values in by_perspective.items():
        title = f"{town}, perspective {name}"
        if few is None:
            table = values.transpose(second, first).to_numpy()
            yield f"hover-{name}.png", heat_map(x, y, table, labels, title, ax)
        else:
            tables = values.transpose(few, second, first)
            heading = f"{title}\none panel per value of {few} [{bracketed(units[few])}]"
            yield f"hover-{name}.png", _multiples(x, y, tables, labels, heading)


def bracketed(unit: str) -> str:
    """A unit as it stands beside a quantity."""
    return "-" if unit == "1" else unit


@style.applied()
def _multiples(
    x: Floats, y: Floats, tables: xarray.DataArray, labels: tuple[str, str, str], title: str
) -> Axes:
    """Draw maps beside each other, one per value of the first key of the tables, on one scale."""
    count = min(MOST_PANELS, len(tables))
    chosen = tables[np.linspace(0, len(tables) - 1, count).round().astype(int)]
    columns, known = 2 if count == 4 else min(count, PANELS_ACROSS), np.isfinite(chosen.to_numpy())
    page = style.page(1.05 + 2.0 * -(-count // columns))
    grid = page.subplots(-(-count // columns), columns, sharex=True, sharey=True, squeeze=False)
    panels: list[Axes] = [*grid.flat[:count]]
    for ax in grid.flat[count:]:
        ax.remove()
    scale = Normalize(float(chosen.min()), float(chosen.max())) if known.any() else Normalize(0, 1)
    bar = page.colorbar(ScalarMappable(scale, COLOURS), ax=panels, label=labels[2], shrink=0.9)
    bar.outline.set_linewidth(0.4)
    if not known.all():
        page.legend(handles=[without_value("no plan")], **BELOW)
    counted_words = f", {count} of {len(tables)}" * (count < len(tables))
    page.suptitle(f"{title}{counted_words}", x=0.01, ha="left", fontsize="medium")
    page.supxlabel(labels[0], fontsize="medium")
    upwards = labels[1] if len(labels[1]) < LONG_LABEL else labels[1].replace(" [", "\n[")
    page.supylabel(upwards, fontsize="medium")
    for ax, table in zip(panels, chosen, strict=True):
        heading = style.grouped(float(table[tables.dims[0]]))
        heat_map(x, y, table.to_numpy(), ("", "", ""), heading, ax, scale)
        ax.tick_params(labelbottom=ax in panels[-columns:])
    style.settle(panels[0])
    return panels[0]


@style.applied()
def heat_map(
    x: Floats,
    y: Floats,
    values: Floats,
    labels: tuple[str, str, str],
    title: str,
    ax: Axes | None = None,
    scale: Normalize | None = None,
) -> Axes:
    """Draw a quantity over two others as colours, with contours at round values.

    The values (y, x) are hatched where NaN; x and y grow, as the middles of cells. On a page of its
    own, or with a scale of colours, which has its bar elsewhere, the axes end at the first and last
    of them, as what lies beyond may not be allowed.
    """
    known, columns, rows = np.isfinite(values), _edges(x), _edges(y)
    own = ax is None or scale is not None
    ends = (x[[0, -1]], y[[0, -1]]) if own else (columns[[0, -1]], rows[[0, -1]])
    if ax is None:
        ax = style.page(4.4).subplots()
        if not known.all():
            style.root(ax).legend(handles=[without_value("no plan")], **BELOW)
    ax.set(title=title, xlabel=labels[0], ylabel=labels[1])
    if not known.all():
        corner, size = (columns[0], rows[0]), (columns[-1] - columns[0], rows[-1] - rows[0])
        ax.add_patch(Rectangle(corner, *size, zorder=0.5, **NONE))
    shown = ax.pcolorfast(columns, rows, np.ma.masked_invalid(values), cmap=COLOURS, norm=scale)
    shown.set_zorder(0.8)
    ax.set(xlim=ends[0], ylim=ends[1])
    bars = list[Colorbar]()
    if known.any() and scale is None:
        bars = [style.root(ax).colorbar(shown, ax=ax, label=labels[2], shrink=0.9)]
        bars[0].outline.set_linewidth(0.4)
    style.group_thousands(ax)
    style.settle(ax)
    style.thin_ticks(ax)
    ends_of = values if scale is None else np.array([scale.vmin, scale.vmax], dtype=float)
    low, high = values[known].min(initial=np.inf), values[known].max(initial=-np.inf)
    if levels := [level for level in contour_levels(ends_of) if low < level < high]:
        for bar, level in product(bars, levels):
            bar.ax.axhline(level, color=BLACK, linewidth=0.5)
        smooth = _without_jumps(ax, x, y, values, levels)
        lines = ax.contour(x, y, smooth, levels, colors=BLACK, linewidths=0.5)
        parts = zip(map(_named, levels), lines.allsegs, strict=True)
        drawn = {name: np.concatenate(each) for name, each in parts if each}
        marks = [np.asarray(line.get_xydata()) for line in ax.lines]
        drawn["marks"] = np.concatenate([np.empty((0, 2)), *marks])
        ways = {name: ax.transData.transform(each) for name, each in drawn.items()}
        _keep(ax.clabel(lines, fmt=_named, fontsize=6.5, inline=False), ways, ax.bbox)
    return ax


def _without_jumps(
    ax: Axes, x: Floats, y: Floats, values: Floats, levels: Sequence[float]
) -> Floats:
    """Values without those beside a jump, where the contours of several levels would be one."""
    rank = np.where(np.isfinite(values), np.searchsorted(levels, values), np.nan)
    steep = np.zeros(values.shape, dtype=bool)
    places_px = ax.transData.transform(np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2))
    places_pt = places_px.reshape(*values.shape, 2) * style.POINTS_PER_INCH / style.root(ax).dpi
    for axis in (0, 1):
        step_pt = np.abs(np.diff(places_pt, axis=axis)).sum(axis=-1)
        crossed = np.abs(np.diff(rank, axis=axis))
        jumps = (crossed > 1.0) & (crossed * CLOSE_PT > step_pt)
        first, second = ((slice(None),) * axis + (part,) for part in (np.s_[:-1], np.s_[1:]))
        steep[first] |= jumps
        steep[second] |= jumps
    return np.ma.masked_array(values, steep)


def _named(level: float) -> str:
    """The name of a contour."""
    return style.minus(f"{level:.10g}")


def _keep(names: Iterable[Text], ways: Mapping[str, Floats], frame: Bbox) -> None:
    """Keep the names in a frame that lie on no other and no way of anything else [px]."""
    taken = list[Bbox]()
    for text in names:
        text.set_path_effects([withStroke(linewidth=1.5, foreground="white")])
        box = text.get_window_extent()
        others = [way for name, way in ways.items() if name != text.get_text()]
        crossed = any(((box.min <= way) & (way <= box.max)).all(axis=1).any() for way in others)
        cut = not (frame.contains(*box.min) and frame.contains(*box.max))
        if cut or crossed or any(box.overlaps(other) for other in taken):
            text.remove()
        else:
            taken.append(box)


def without_value(label: str) -> Patch:
    """The entry of places without a value in a legend."""
    return Patch(label=label, **NONE)


def contour_levels(values: Floats) -> list[float]:
    """Round values between the smallest and the largest, for contours."""
    known = values[np.isfinite(values)]
    if not len(known):
        return []
    low, high = float(known.min()), float(known.max())
    steps = MaxNLocator(MOST_CONTOURS, steps=[1, 2, 5, 10]).tick_values(low, high)
    return [level for step in steps if low < (level := float(f"{step:.10g}")) < high]


def _edges(middles: Floats) -> Floats:
    """The borders of cells around their middles."""
    between = 0.5 * (middles[1:] + middles[:-1])
    ends = 2.0 * middles[[0, -1]] - between[[0, -1]]
    return np.concatenate([ends[:1], between, ends[1:]])
