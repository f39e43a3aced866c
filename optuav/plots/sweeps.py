"""Hover times over up to three keys: lines where a key has few values, maps where all have many."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize

import optuav
from optuav.errors import Fault, InputError, shown
from optuav.options import LONGEST_HOVER
from optuav.plots import style
from optuav.plots.charts import Line, curves
from optuav.plots.heat import BELOW, COLOURS, LONGEST_HOVER_LABEL, heat_map, without_value
from optuav.presentation.keys import axis_of, unit_of, words_of

if TYPE_CHECKING:
    import xarray

HOVER = "hover Δ [s]"
FEW = 3  # Most values of a key that has a line for each of them
MOST_DOTS = 12  # Most values of a line that has a dot for each of them
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

    Over one key they are a line for each perspective. Over two they are a map with contours for
    each perspective, or lines if a key has two or three values. Over three they are a panel for
    each value of the key that has fewest, 12 of them at most. Points without a plan are hatched on
    maps, and left out of lines.

    Parameters
    ----------
    found
        As `optuav.batch` and `optuav.open_sweep` return it, or the directory of a sweep.
    ax
        Where to draw, if there is a single picture without panels; by default every picture has a
        page of its own.

    Returns
    -------
    tuple of tuple
        Names of pictures with their axes.

    Raises
    ------
    InputError
        If the dataset has other dimensions, or a key with a single value; or if there are axes for
        several pictures.

    Examples
    --------
    >>> import optuav
    >>> answers = optuav.batch("paper", {"limits.deadline_s": [600, 900, 1200]})
    >>> [(name, ax.get_xlabel()) for name, ax in optuav.plots.swept(answers)]
    [('hover.png', 'deadline [s]')]
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


@dataclass(frozen=True)
class _Sweep:
    """Hover times [s] by perspective over keys, and the words for both."""

    mission: str
    measure: str  # With its unit
    units: Mapping[str, str]
    hover_s: Mapping[str, xarray.DataArray]

    def axis(self, key: str) -> str:
        """The label of the axis of a key."""
        return axis_of(key, self.units[key])

    def title(self, keys: Sequence[str], *more: str) -> str:
        """What is shown over the words of keys."""
        over = " and ".join(words_of(key, self.units[key]) for key in keys)
        measure = self.measure.partition(" Δ")[0]
        return style.titled(self.mission, f"{measure} by {over}", *more)

    def value(self, key: str, value: float) -> str:
        """A key at a value, such as ``deadline 600 s``."""
        unit = unit_of(self.units[key])
        return f"{words_of(key, self.units[key])} {style.grouped(value)} {unit}".removesuffix(" -")


def _drawn(found: xarray.Dataset, ax: Axes | None) -> Iterator[tuple[str, Axes]]:
    """Name and axes of one picture after the other."""
    sweep, keys = _checked(found)
    several = len(keys) == 3 or (len(keys) == 2 and len(sweep.hover_s) > 1)
    if ax is not None and several:
        raise InputError([Fault("ax", "", "must be left out: this dataset has several pictures")])
    if len(keys) == 1:
        lines = [_line(name, keys[0], values) for name, values in sweep.hover_s.items()]
        one = [style.perspective(*sweep.hover_s)] if len(lines) == 1 else []
        yield "hover.png", _lines(sweep, keys[0], lines, sweep.title(keys, *one), ax)
        return
    for name, values in sweep.hover_s.items():
        draw: Callable[..., Axes] = _multiples if len(keys) == 3 else _single
        yield f"hover-{name}.png", draw(sweep, keys, values, style.perspective(name), ax)


def _checked(found: xarray.Dataset) -> tuple[_Sweep, list[str]]:
    """What is swept, and the keys over which it is."""
    rows = [
        name for name, coordinate in getattr(found, "coords", {}).items() if coordinate.dims == ROWS
    ]
    if len(rows) == 1:
        found = found.swap_dims(dict.fromkeys(ROWS, rows[0]))
    hover_s, attributes = getattr(found, "hover_time_s", None), getattr(found, "attrs", {})
    keys = [str(name) for name in getattr(hover_s, "dims", ()) if name != "perspective"]
    stated_keys = [key for key in keys if "units" in found[key].attrs]
    several = [key for key in stated_keys if len(np.unique(found[key])) > 1]
    if (
        len(keys) not in (1, 2, 3)
        or several != keys
        or not attributes.keys() >= {"mission", "problem"}
    ):
        words = "a dataset of one mission over up to three keys, of several values each"
        raise InputError([Fault("found", ", ".join(keys), words)])
    found = found.sortby(keys).drop_duplicates(keys)
    hover_s = found.hover_time_s
    if "perspective" not in hover_s.dims:
        hover_s = hover_s.expand_dims(perspective=[found.attrs["perspective"]])
    names = hover_s.perspective.values.tolist()
    longest = attributes["problem"].partition("(")[0] in LONGEST_HOVER
    sweep = _Sweep(
        mission=attributes["mission"],
        measure=LONGEST_HOVER_LABEL if longest else HOVER,
        units={key: found[key].attrs["units"] for key in keys},
        hover_s={name: hover_s.sel(perspective=name) for name in names},
    )
    return sweep, keys


def _few(values: xarray.DataArray, keys: Sequence[str]) -> bool:
    """Return whether one of two keys has so few values that lines show them best."""
    return min(values.sizes[key] for key in keys) <= FEW


def _by_size(values: xarray.DataArray, keys: Sequence[str]) -> tuple[str, str]:
    """Return the key that goes across and the one that has a line for each value."""
    across, of_lines = sorted(keys, key=lambda key: -values.sizes[key])
    return across, of_lines


def _line(label: str, across: str, values: xarray.DataArray) -> Line:
    """A line over a key, with dots where there are few."""
    return Line(label, values[across], values, "o" if values.size <= MOST_DOTS else "")


def _lines(sweep: _Sweep, across: str, lines: Sequence[Line], title: str, ax: Axes | None) -> Axes:
    """Draw lines over a key; empty axes say that there is no plan."""
    none = not any(np.isfinite(np.asarray(line.y, dtype=float)).any() for line in lines)
    x_label, y_label = sweep.axis(across), sweep.measure
    ax = curves(lines, title=title, x_label=x_label, y_label=y_label, y_from_zero=none, ax=ax)
    if none:
        style.annotate_beside(ax, "no plan", (0.5, 0.5), (0.0, 0.0), xycoords="axes fraction")
    return ax


def _single(
    sweep: _Sweep, keys: Sequence[str], values: xarray.DataArray, rule: str, ax: Axes | None
) -> Axes:
    """Draw one perspective over two keys."""
    title = sweep.title(keys, rule)
    if _few(values, keys):
        across, of_lines = _by_size(values, keys)
        at = [(value, values.sel({of_lines: value})) for value in values[of_lines].values.tolist()]
        lines = [_line(sweep.value(of_lines, value), across, row) for value, row in at]
        return _lines(sweep, across, lines, title, ax)
    first, second = keys
    table, labels = values.transpose(second, first).to_numpy(), [*map(sweep.axis, keys)]
    x, y = (values[key].to_numpy() for key in keys)
    return heat_map(x, y, table, (labels[0], labels[1], sweep.measure), title, ax)


@style.applied()
def _multiples(
    sweep: _Sweep, keys: Sequence[str], values: xarray.DataArray, rule: str, _: None
) -> Axes:
    """Draw one perspective over three keys, in a panel for each value of the one with fewest."""
    apart = min(keys, key=lambda key: values.sizes[key])
    shown = [key for key in keys if key != apart]
    total = values.sizes[apart]
    count = min(MOST_PANELS, total)
    chosen = values.isel({apart: np.linspace(0, total - 1, count).round().astype(int)})
    columns = 2 if count == 4 else min(count, PANELS_ACROSS)
    page = style.page(1.05 + 2.0 * -(-count // columns))
    grid = page.subplots(-(-count // columns), columns, sharex=True, sharey=True, squeeze=False)
    panels: list[Axes] = [*grid.flat[:count]]
    for ax in grid.flat[count:]:
        ax.remove()
    some = f", {count} of {total}" * (count < total)
    page.suptitle(
        f"{sweep.title(shown, rule)}\none panel per value of {sweep.axis(apart)}{some}",
        x=0.01,
        ha="left",
        fontsize="medium",
    )
    tables = [chosen.sel({apart: value}) for value in chosen[apart].values.tolist()]
    draw = _line_panels if _few(values, shown) else _map_panels
    across, upwards = draw(sweep, shown, panels, tables)
    page.supxlabel(across, fontsize="medium")
    upwards = upwards if len(upwards) < LONG_LABEL else upwards.replace(" [", "\n[")
    page.supylabel(upwards, fontsize="medium")
    for ax, table in zip(panels, tables, strict=True):
        ax.set_title(sweep.value(apart, float(table[apart])), pad=6.0)
        ax.tick_params(labelbottom=ax in panels[-columns:])
    style.settle(panels[0])
    return panels[0]


def _line_panels(
    sweep: _Sweep, keys: Sequence[str], panels: Sequence[Axes], tables: Sequence[xarray.DataArray]
) -> tuple[str, str]:
    """Draw lines in every panel, with one legend; the labels of both axes."""
    across, of_lines = _by_size(tables[0], keys)
    drawn_values = np.concatenate([table.to_numpy().ravel() for table in tables])
    limits = style.margins(drawn_values[np.isfinite(drawn_values)].tolist() or [0.0])
    for ax, table in zip(panels, tables, strict=True):
        rows = [table.sel({of_lines: value}) for value in table[of_lines].values.tolist()]
        lines = [_line(sweep.value(of_lines, float(row[of_lines])), across, row) for row in rows]
        curves(lines, title="", x_label="", y_label="", y_from_zero=True, ax=ax)
        entries = ax.get_legend_handles_labels()[0]
        for entry, line in zip(entries, lines, strict=True):
            entry.set_label(line.label)  # Others lie on each other in another panel
        ax.legend().remove()
        ax.set(xlabel="", ylabel="", ylim=limits)
    style.root(panels[0]).legend(handles=entries, loc="outside right upper")
    return sweep.axis(across), sweep.measure


def _map_panels(
    sweep: _Sweep, keys: Sequence[str], panels: Sequence[Axes], tables: Sequence[xarray.DataArray]
) -> tuple[str, str]:
    """Draw maps in every panel on one scale; the labels of both axes."""
    page, (first, second) = style.root(panels[0]), keys
    grids = [table.transpose(second, first).to_numpy() for table in tables]
    is_finite = np.isfinite(grids)
    low, high = (np.nanmin(grids), np.nanmax(grids)) if is_finite.any() else (0.0, 1.0)
    scale = Normalize(float(low), float(high))
    bar = page.colorbar(ScalarMappable(scale, COLOURS), ax=panels, label=sweep.measure, shrink=0.9)
    bar.outline.set_linewidth(0.4)
    if not is_finite.all():
        page.legend(handles=[without_value("no plan")], **BELOW)
    x, y = (tables[0][key].to_numpy() for key in keys)
    for ax, grid in zip(panels, grids, strict=True):
        heat_map(x, y, grid, ("", "", ""), " ", ax, scale)
    return sweep.axis(first), sweep.axis(second)
