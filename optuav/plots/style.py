"""Style of all pictures: colours, fonts, pages, legends, bands, and labels beside points."""

import io
import itertools
import re
from base64 import b64encode
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from threading import RLock
from typing import Any, NamedTuple, TypeAlias

import matplotlib.style
import numpy as np
import numpy.typing as npt
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.font_manager import FontProperties, findfont, get_font
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke
from matplotlib.text import Annotation
from matplotlib.ticker import FuncFormatter, MaxNLocator
from matplotlib.transforms import Bbox, Transform
from matplotlib.typing import LineStyleType

from optuav.arrays import Booleans, Floats
from optuav.judge import Replay
from optuav.judge.flight_plan import FlightPlan, kind_of
from optuav.looks import LOOKS, PHASES, SERIES
from optuav.presentation import markup
from optuav.presentation.numbers import minus

BLACK = "black"
BLUE, GREEN, ORANGE = PHASES.values()
SKY, PINK, GREY, PALE, DARK = SERIES
LASER, YELLOW = (LOOKS[role].light for role in ("laser", "optimum"))

WORDS = {"direct": "Direct path", "traj1": "Traj. 1", "traj2": "Traj. 2", "optimal": "Optimal"}
"""Names of the trajectories as the paper prints them."""

DASHED: LineStyleType = (0.0, (4.0, 2.0))
DOTTED: LineStyleType = (0.0, (1.0, 1.0))
DASH_DOT: LineStyleType = (0.0, (6.0, 1.2, 1.5, 1.2))
DASHES: tuple[LineStyleType, ...] = ("-", (0.0, (5.0, 1.5)), (0.0, (2.0, 1.0)), DASH_DOT)
"""Dashes of several lines in one picture, so that no two differ only in colour."""
FONT = "DejaVu Sans"
SETTINGS = ("default", Path(__file__).with_name("optuav.mplstyle"))
WIDTH_IN = 7.2
DOTS_PER_INCH = 200
LEGEND_PT, NAMES_PT = 20.0, 16.0
"""Room for one line of a legend, or for names, between axes and title [pt]."""
LINE_PT, UPRIGHT_PT, ABOVE_PT = 9.0, 9.0, 6.0
"""Distance of upright names from each other, from their points, and from a title above them."""
LONGEST_NAME = 24
MOST_TICKS = 8
TINT = 0.15
TIME = "time since take-off $t$ [s]"

POINTS_PER_INCH, PIXELS_PER_INCH = 72.0, 100.0
NEAR = (4.0, 8.0)
FAR = (14.0, 22.0, 32.0, 44.0, 58.0, 74.0, 92.0, 112.0)
"""Distances of a label from its point [pt]; far ones get a line to it."""
DIRECTIONS = ((1, 1), (1, -1), (-1, 1), (-1, -1), (1, 0), (-1, 0), (0, 1), (0, -1))
BETWEEN = ((2, 1), (2, -1), (-2, 1), (-2, -1), (1, 2), (1, -2), (-1, 2), (-1, -2))
"""More directions of far labels, for where there is much around."""
CLEARANCE = 1.5  # Least distance between two labels [pt]
STRONG, FAINT = 1.0, 4.0  # Distance of the dots that stand for a line [pt]
MOST_DOTS = 4000  # Most dots along a line
OUTSIDE, ON_PLACE, OBLIQUE, PER_POINT = 1000.0, 100.0, 20.0, 0.5
"""Costs of leaving the axes, of the place of another label, of a direction between those of near
labels, and of each point of distance; a dot that is covered costs 1."""
FARTHER = 1.5  # How much farther than its own point the others must be from a label without a line
MARKER = 4.0  # Distance of a label from places of others [pt]
LEADER_DOTS = 100  # Dots that stand for the line to a label
MOST_COVERED = 2  # Most dots that a label covers which is not needed
LEADER = {"arrowstyle": "-", "linewidth": 0.6, "color": DARK, "shrinkA": 0.0, "shrinkB": 2.0}

AnyFigure: TypeAlias = Figure | SubFigure
Shown: TypeAlias = tuple[bytes, dict[str, int | str]] | None  # A PNG, its width and title
Look: TypeAlias = dict[str, Any]  # Properties of a line or marker, by matplotlib's names
LABEL: Look = {"ha": "left", "va": "bottom", "linespacing": 1.1, "annotation_clip": False}
POINTS_PER_PIXEL = 0.6  # Width of a line in a picture and in the explorer's page
HALO: Look = {"path_effects": [withStroke(linewidth=2.5, foreground="white")]}
CASING, SOLID = 3.0, {"dash_offset": 0.0, "dash_list": None}
"""How much wider the casing of a line is [px], and a line without dashes."""
LABEL |= {**HALO, "zorder": 10}
_ONE_AT_A_TIME = RLock()


@contextmanager
def applied() -> Iterator[None]:
    """The look of the pictures, for a block or a function; threads draw one after the other."""
    with _ONE_AT_A_TIME, matplotlib.style.context([*SETTINGS]):
        yield


class ShownAxes(Axes):
    """Axes that a notebook shows as the picture they belong to."""

    def _repr_png_(self) -> Shown:
        return picture_of(self)


class Page(Figure):
    """A figure without a window, which a notebook shows, also where it has its axes."""

    def add_subplot(self, *args: Any, **options: Any) -> Any:
        """Add axes that show themselves in a notebook."""
        return super().add_subplot(*args, **{"axes_class": ShownAxes, **options})

    def _repr_png_(self) -> Shown:
        return picture_of(self.axes[0]) if self.axes else None


class Panels(tuple[Any, ...]):
    """Axes of one picture, or tuples of them, which a notebook shows as the picture."""

    def _repr_png_(self) -> Shown:
        return picture_of(self)


class Pictures(tuple[tuple[str, Axes], ...]):
    """Names of pictures with axes of each, which a notebook shows one below the other."""

    def _repr_html_(self) -> str:
        return gallery((name, root(ax)) for name, ax in self)


class Figures(dict[str, Figure]):
    """Figures by name, which a notebook shows one below the other."""

    def _repr_html_(self) -> str:
        return gallery(self.items())


def gallery(figures: Iterable[tuple[str, Figure]]) -> str:
    """Return figures as HTML, with their titles or names for readers who do not see them."""
    look = f"display: block; width: 100%; max-width: {round(PIXELS_PER_INCH * WIDTH_IN)}px"
    images = []
    for name, figure in figures:
        titles = ((ax.get_title(loc="left").strip(), ax.get_ylabel()) for ax in figure.axes)
        words = "; ".join(dict.fromkeys(filter(None, itertools.chain(*titles)))) or name
        source = f"data:image/png;base64,{b64encode(image(figure, format='png')).decode()}"
        images.append(markup.element("img", alt=words, src=source, style=look))
    return markup.page(*images)


def page(height_in: float, width_in: float = WIDTH_IN) -> Page:
    """An empty figure without a window [inch]."""
    return Page(figsize=(width_in, height_in), dpi=DOTS_PER_INCH, layout="constrained")


def picture_of(drawn: Any) -> Shown:
    """The picture of axes, or of the first of several, with its width; None if not on a `Page`.

    A drawing in a user's own figure is shown with that figure.
    """
    while isinstance(drawn, tuple):
        drawn = drawn[0]
    figure = root(drawn)
    if not isinstance(figure, Page):
        return None
    width = round(PIXELS_PER_INCH * figure.get_figwidth())
    return image(figure, format="png"), {"width": width, "alt": drawn.get_title(loc="left")}


def image(figure: Figure, **options: Any) -> bytes:
    """A figure as the content of a file, with options as `Figure.savefig` takes them."""
    content = io.BytesIO()
    if isinstance(figure, Page):
        figure.set_layout_engine("none")  # the picture is laid out already
    with applied():
        figure.savefig(content, dpi=figure.dpi, **options)
    return content.getvalue()


def titled(subject: str, *words: str) -> str:
    """A title: what the picture is of, such as a mission, then what it shows, and by which rule.

    Words that begin with a line break stand on a line of their own.
    """
    return f"{drawable(subject)}: {', '.join(words)}".replace(", \n", ",\n")


def perspective(*names: str) -> str:
    """One perspective or several as the last words of a title."""
    return f"perspective{'s' * (len(names) > 1)} {' and '.join(names)}"


def drawable(name: str) -> str:
    """A name as a picture shows it: not too long, no mathematics, only letters of the font."""
    short = name if len(name) <= LONGEST_NAME else f"{name[: LONGEST_NAME - 1]}…"
    letters = "".join(letter if ord(letter) in _letters() else "□" for letter in short)
    return letters.replace("$", r"\$")


@cache
def _letters() -> frozenset[int]:
    """The letters of the font by their codes."""
    return frozenset(get_font(findfont(FontProperties(family=FONT))).get_charmap())


def group_thousands(*axes: Axes) -> None:
    """Set the thousands of long tick labels apart, on both axes."""
    for ax in axes:
        for axis in (ax.xaxis, ax.yaxis):
            axis.set_major_formatter(FuncFormatter(lambda value, _: grouped(value)))


def grouped(value: float) -> str:
    """A number as a label, its thousands set apart if it is long."""
    text = minus(f"{value:{',' if abs(value) >= 1e4 else ''}.10g}")
    return re.sub(r"e\+?(\D?)0*", r"e\1", text).replace(",", "\N{THIN SPACE}")


def thin_ticks(ax: Axes) -> None:
    """Leave fewer numbers along settled axes while two of them touch."""
    for count in range(MOST_TICKS, 0, -1):
        low, high = sorted(ax.get_xlim())
        shown = [tick for tick in ax.xaxis.get_major_ticks() if low <= tick.get_loc() <= high]
        boxes = [tick.label1.get_window_extent().padded(CLEARANCE) for tick in shown]
        if not any(one.overlaps(other) for one, other in itertools.pairwise(boxes)):
            return
        ax.xaxis.set_major_locator(MaxNLocator(count, steps=[1, 2, 2.5, 5, 10]))


def margins(
    values: Iterable[float], share: float = 0.05, least: float = 1.0
) -> tuple[float, float]:
    """Limits of an axis that leave some room around values, at least `least` wide."""
    low, high = min(values := list(values)), max(values)
    room = max(share * (high - low), 0.5 * (least - (high - low)))
    return low - room, high + room


def legend_above(ax: Axes, columns: int, handles: Sequence[Artist] = ()) -> None:
    """Put a legend between axes and title; of all labelled artists unless handles are given."""
    shown = handles or ax.get_legend_handles_labels()[0]
    above: Look = {"loc": "lower left", "bbox_to_anchor": (0.0, 1.0), "borderaxespad": 0.2}
    ax.legend(handles=shown, ncols=columns, **above)


def entry(
    label: str, colour: str, linewidth: float = 1.4, linestyle: LineStyleType = "-"
) -> Line2D:
    """The entry of a line in a legend."""
    return Line2D([], [], color=colour, linewidth=linewidth, linestyle=linestyle, label=label)


def limit(role: str, *, cased: bool = False) -> Look:
    """Colour and line of a limit, as in `optuav.looks`; with a casing it reads on any fill."""
    colour, _, width, dash, rounded = LOOKS[role]
    dashes: LineStyleType = (0.0, tuple(length / width for length in dash)) if dash else "-"
    look: Look = {"color": colour, "linestyle": dashes, "linewidth": POINTS_PER_PIXEL * width}
    if cased:
        wide = POINTS_PER_PIXEL * (width + CASING)
        look["path_effects"] = [withStroke(linewidth=wide, foreground="white", dashes=SOLID)]
    return {**look, "dash_capstyle": "round" if rounded else "butt"}


def root(ax: Axes) -> Figure:
    """The figure that axes belong to."""
    figure = ax.get_figure(root=True)
    assert isinstance(figure, Figure)
    return figure


def settle(ax: Axes) -> None:
    """Give all axes of the figure their final place, which labels depend on."""
    figure = root(ax)
    if engine := figure.get_layout_engine():
        engine.execute(figure)
    for axis in figure.axes:
        axis.apply_aspect()


def annotate_beside(
    ax: Axes, words: str, at: tuple[float, float], offset_pt: tuple[float, float], **look: Any
) -> Annotation:
    """Write words beside a point, on the side of the offset; they leave the layout as it is."""
    x, y = (int(np.sign(shift_pt)) for shift_pt in offset_pt)
    sides: Look = {"ha": ("center", "left", "right")[x], "va": ("center", "bottom", "top")[y]}
    look = {**sides, "fontsize": 7.0, "textcoords": "offset points", **look}
    text = ax.annotate(words, at, offset_pt, **look)
    text.set_in_layout(False)
    return text


def upright(
    ax: Axes, names: Sequence[str], at: Floats, coordinates: Transform, offset_pt: float
) -> list[Annotation]:
    """Write names upright beside points (n, 2) from left to right, joined to them by lines.

    They are above the points by the offset, or below by a negative one. None is written where all
    together are too wide.
    """
    x_px, pixels = coordinates.transform(at)[:, 0], root(ax).dpi / POINTS_PER_INCH
    left, right = ax.get_window_extent().intervalx
    steps = LINE_PT * pixels * np.arange(len(names))
    if not len(names) or steps[-1] > right - left:
        return []
    # The mean of names that only give way to the right and of names that only give way to the left.
    free = x_px - steps
    moved = np.maximum.accumulate(free) + np.minimum.accumulate(free[::-1])[::-1]
    shifts_pt = (np.clip(0.5 * moved, left, right - steps[-1]) + steps - x_px) / pixels
    above = offset_pt > 0.0
    look: Look = {"rotation": 90.0, "ha": "center", "va": "bottom" if above else "top", **HALO}
    look |= {"arrowprops": {**LEADER, "relpos": (0.5, 0.0 if above else 1.0)}, "zorder": 10}
    look |= {"xycoords": coordinates, "annotation_clip": False}
    return [
        annotate_beside(ax, name, point, (shift_pt, offset_pt), **look)
        for name, point, shift_pt in zip(names, at.tolist(), shifts_pt.tolist(), strict=True)
    ]


class Band(NamedTuple):
    """A stretch of time [s], and names for it; the first that fits is written.

    Where none fits and one is required, the places of all bands are written upright.
    """

    begin_s: float
    end_s: float
    colour: str
    names: tuple[str, ...]
    place: str = ""
    required: bool = False


def phase_bands(replayed: Replay) -> list[Band]:
    """The bands of the phases; that of a rest or of one of several hovers names its place."""
    served = {device.name for device in replayed.mission.devices}
    bands, by_items = list[Band](), isinstance(replayed.subject, FlightPlan)
    for phase in replayed.phases:
        kind, place = kind_of(phase) if by_items else phase.kind, drawable(phase.end.name)
        stretch = phase.start_s, phase.end_s, PHASES[phase.kind]
        if phase.kind == "hover" and phase.end.name in served:
            bands.append(Band(*stretch, (f"hover, {place}", place), place, required=True))
        elif phase.kind == "rest":
            bands.append(Band(*stretch, (f"rest, {place}", "rest"), place))
        else:
            bands.append(Band(*stretch, (kind,)))
    return bands


def draw_bands(axes: Sequence[Axes], bands: Sequence[Band]) -> float:
    """Draw bands on settled axes that share their time, with names above the first.

    Names that stand upright raise its title, and a page with it; the room below the title [pt].
    """
    top, room_pt = axes[0], NAMES_PT
    for band in bands:
        for ax in axes:
            ax.axvspan(band.begin_s, band.end_s, color=band.colour, alpha=TINT, linewidth=0.0)
    written = [_write_within(top, band) for band in bands]
    if any(band.required and not text for text, band in zip(written, bands, strict=True)):
        for text in filter(None, written):
            text.remove()
        named = [band for band in bands if band.place]
        at = np.array([(0.5 * (band.begin_s + band.end_s), 1.0) for band in named])
        places, above = [band.place for band in named], top.get_xaxis_transform()
        texts = upright(top, places, at, above, UPRIGHT_PT)
        if texts:
            high_px = max(text.get_window_extent().y1 for text in texts) - top.bbox.y1
            room_pt = high_px * POINTS_PER_INCH / root(top).dpi + ABOVE_PT
            _raise_title(top, room_pt)
    return room_pt


def _write_within(ax: Axes, band: Band) -> Annotation | None:
    """Write the first name of a band that fits above it; None if there is none."""
    at, look = (0.5 * (band.begin_s + band.end_s), 1.0), {"xycoords": ax.get_xaxis_transform()}
    left, right = ax.transData.transform([(band.begin_s, 0.0), (band.end_s, 0.0)])[:, 0]
    for name in band.names:
        text = annotate_beside(ax, name, at, (0.0, 3.0), fontsize=7.5, **look)
        if text.get_window_extent().width <= right - left:
            return text
        text.remove()
    return None


def _raise_title(ax: Axes, room_pt: float) -> None:
    """Leave room between axes and title, by which a page grows, and settle the axes again."""
    figure = root(ax)
    if isinstance(figure, Page):
        more_in = (room_pt - NAMES_PT) / POINTS_PER_INCH
        figure.set_figheight(figure.get_figheight() + more_in)
    ax.set_title(ax.get_title(loc="left"), pad=room_pt)
    settle(ax)


def swatch(colour: str, label: str) -> Patch:
    """The entry of a band in a legend."""
    return Patch(color=colour, alpha=2.0 * TINT, linewidth=0.0, label=label)


def swatches(kinds: Iterable[str]) -> list[Patch]:
    """The entries of the kinds of phases that occur."""
    return [swatch(PHASES[kind], kind) for kind in dict.fromkeys(map(str, kinds))]


@dataclass(frozen=True)
class Label:
    """A text [pt] that belongs to a point in the data's coordinates.

    One that is not needed is left out where there is little room.
    """

    text: str
    at: tuple[float, float]
    needed: bool = True
    colour: str = "black"
    size: float = 7.5


def place(
    ax: Axes,
    labels: Sequence[Label],
    lines: Iterable[npt.ArrayLike] = (),
    faint: Iterable[npt.ArrayLike] = (),
    clear: Iterable[npt.ArrayLike] = (),
) -> None:
    """Write labels beside their points, needed ones first, away from each other and from lines.

    Limits and place of the axes are final. Lines are arrays (n, 2) of corners in the data's
    coordinates; faint ones are avoided less strictly. Labels keep clear of points (2,).
    """
    pixels = root(ax).dpi / POINTS_PER_INCH
    dotted = [_dots(ax, line, STRONG * pixels) for line in lines]
    weak = (*faint, *([label.at] for label in labels))
    dotted += [_dots(ax, line, FAINT * pixels) for line in weak]
    dots = np.concatenate([np.empty((0, 2)), *dotted])
    places = np.array([*clear, *(label.at for label in labels if label.needed)]).reshape(-1, 2)
    points = ax.transData.transform(np.array([label.at for label in labels]).reshape(-1, 2))
    taken, leaders = np.empty((0, 2, 2)), np.empty((0, 2))
    for label in sorted(labels, key=lambda each: not each.needed):
        look: Look = {**LABEL, "color": label.colour, "fontsize": label.size}
        text = annotate_beside(ax, label.text, label.at, (0.0, 0.0), **look)
        size, anchor = text.get_window_extent(), ax.transData.transform(label.at)
        text.remove()
        others = ax.transData.transform(places[(places != label.at).any(axis=1)])
        costs, far, boxes = _spots(ax, label, size, pixels)
        padded = _grown(boxes, CLEARANCE * pixels)
        covered = _within(boxes, dots) + ON_PLACE * (_within(padded, leaders) > 0)
        covered += ON_PLACE * _within(_grown(boxes, MARKER * pixels), others)
        lines_to = np.linspace(anchor, boxes.mean(axis=1), LEADER_DOTS, axis=1)
        crossing = [_within(taken, line).any() for line in lines_to[far]]
        covered[far] += ON_PLACE * np.array(crossing, dtype=bool)
        covered[~far] += ON_PLACE * _ambiguous(boxes[~far], anchor, points)
        apart = (padded[:, None, 0] > taken[:, 1]) | (padded[:, None, 1] < taken[:, 0])
        free = np.all(np.any(apart, axis=2), axis=1)
        fits = free & (label.needed | (covered <= MOST_COVERED))
        if fits.any():
            best = int(np.argmin(np.where(fits, costs + covered, np.inf)))
            x_px, y_px = boxes[best, 0] - size.min
            look["arrowprops"] = {**LEADER, **HALO} if far[best] else None
            annotate_beside(ax, label.text, label.at, (x_px / pixels, y_px / pixels), **look)
            taken = np.concatenate([taken, boxes[best : best + 1]])
            if far[best]:
                leaders = np.concatenate([leaders, lines_to[best]])


def mark(
    ax: Axes,
    events: Iterable[tuple[str, float, float, str]],
    lines: Iterable[npt.ArrayLike],
    faint: Iterable[npt.ArrayLike] = (),
) -> None:
    """Draw dots at events where a limit is passed, with words: words, x, y, role of the limit."""
    labels = [Label(words, (x, y), colour=LOOKS[role].light) for words, x, y, role in events]
    for label in labels:
        ax.plot(*label.at, "o", color=label.colour, markersize=4.5, clip_on=False, zorder=5)
    place(ax, labels, lines, faint)


def _spots(ax: Axes, label: Label, size: Bbox, pixels: float) -> tuple[Floats, Booleans, Floats]:
    """Costs of places around a label's point, which are far, and boxes (spot, low or high, 2) [px].

    They are inside the axes unless the label is needed.
    """
    frame, anchor = ax.get_window_extent(), ax.transData.transform(label.at)
    extent = np.array(size.size)
    spots = [*itertools.product(NEAR, DIRECTIONS)]
    spots += [*itertools.product(FAR, (*DIRECTIONS, *BETWEEN))] if label.needed else []
    rings, ways = (np.array(column) for column in zip(*spots, strict=True))
    reach = (rings * pixels / np.hypot(*ways.T))[:, None]
    low = anchor + ways * reach + (np.sign(ways) - 1) * extent / 2
    inner = frame.padded(-CLEARANCE * pixels)
    inside = ((low >= inner.min) & (low <= inner.max - extent)).all(axis=1)
    boxes, kept = np.stack([low, low + extent], axis=1), inside | label.needed
    costs = PER_POINT * rings + OUTSIDE * ~inside + OBLIQUE * (np.abs(ways) > 1).any(axis=1)
    return costs[kept], np.isin(rings, FAR)[kept], boxes[kept]


def _grown(boxes: Floats, by: float) -> Floats:
    """Boxes (box, low or high, 2) with a margin around them."""
    return boxes + by * np.array([[-1.0], [1.0]])


def _within(boxes: Floats, points: Floats) -> Floats:
    """Count the points (n, 2) [px] in each box (box, low or high, 2)."""
    low, high = boxes[:, 0, None], boxes[:, 1, None]
    inside = ((points >= low) & (points <= high)).all(axis=2)
    return np.asarray(inside.sum(axis=1, dtype=float))


def _ambiguous(boxes: Floats, anchor: Floats, points: Floats) -> Booleans:
    """Whether a label in each box would be read as that of a point other than its anchor [px]."""
    low, high = boxes[:, 0, None], boxes[:, 1, None]
    away = np.linalg.norm(np.maximum(0.0, np.maximum(low - points, points - high)), axis=2)
    own = (np.abs(points - anchor) < 1.0).all(axis=1)
    nearest = away[:, ~own].min(axis=1, initial=np.inf)
    return np.asarray(nearest < FARTHER * away[:, own].max(axis=1))


def _dots(ax: Axes, line: npt.ArrayLike, spacing: float) -> Floats:
    """Dots [px] along a line, its corners among them, about a spacing apart."""
    corners = ax.transData.transform(np.asarray(line, dtype=float))
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(corners, axis=0).T))])
    count = min(MOST_DOTS, int(along[-1] / spacing))
    at = np.union1d(np.linspace(0.0, along[-1], count + 1), along)
    return np.stack([np.interp(at, along, coordinate) for coordinate in corners.T], axis=1)
