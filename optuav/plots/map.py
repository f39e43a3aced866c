"""The map: a mission with its plan, or several plans, from above and from the side."""

from __future__ import annotations

import math
import textwrap
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import chain, cycle, pairwise
from operator import attrgetter
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Rectangle
from matplotlib.transforms import offset_copy
from matplotlib.typing import LineStyleType

from optuav.arrays import Booleans, Floats
from optuav.errors import InputError
from optuav.looks import LOOKS
from optuav.mission import Mission
from optuav.mission.messages import of_kind
from optuav.network.map_extent import Scene, scene
from optuav.network.places import DESTINATION, ORIGIN
from optuav.plan import Plan, Stop, load_plan, load_subject
from optuav.plan.data import Waypoints
from optuav.plots import signs, style
from optuav.plots.style import BLACK, BLUE, DARK, GREEN, GREY, ORANGE, PINK, SKY, Look
from optuav.presentation.numbers import seconds

SYMBOLS = {
    "origin": "origin $\\mathbf{w}_0$",
    "hover": "hover point $\\mathbf{w}_U$",
    "destination": "destination $\\mathbf{w}_F$",
}
COLOURS = (BLACK, SKY, ORANGE, BLUE, PINK, GREEN)
DASHES = (*style.DASHES, style.DOTTED, (0.0, (3.0, 3.0)))
"""Looks of several routes; no two differ only in colour."""
REACH = ("link", "limits.outage_probability", "limits.min_altitude_m")
SITE = attrgetter("route", "devices", "buildings", "laser", *REACH)
"""The part of a mission that decides where it takes place."""
SHIFT = 2.0  # Distance between legs that would lie on each other [pt]
ARROW_AT, ARROW_STEP = 0.56, 0.05
"""Place of a leg's arrow: past the middle, so that there and back do not meet; and how
much farther its neighbour does."""
SPARSE: LineStyleType = (0.0, (1.0, 4.0))  # Dots of a line of sight that is blocked
FAR = 100.0  # Most sizes of the map for drawing a rim: one far off has billions of pieces
FEW = 30
"""Most buildings for drawing all sight lines and the points on roofs, and most devices for all
names."""
MOST_TIMED = 4
"""Most devices whose labels state the hover over each, and that all have names in height."""
MOST_NAMED = 400  # Most buildings whose walls labels avoid, and that have names without a plan


class MapAxes(NamedTuple):
    """The two views of a map [m].

    Parameters
    ----------
    plan, height
        From above, x and y; and from the side, altitude over the way.

    Examples
    --------
    >>> import optuav
    >>> optuav.plots.mission_map(optuav.load("paper")).plan.get_xlabel()
    'x [m]'
    """

    plan: Axes
    height: Axes

    def _repr_png_(self) -> style.Shown:
        return style.picture_of(self)


class Way(NamedTuple):
    """A route as it is drawn: its points (point, 3) [m], stops and look."""

    names: tuple[str, ...]  # Names of places; empty for waypoints
    points: Floats
    stops: tuple[Stop, ...]
    look: Look

    @classmethod
    def bent(
        cls,
        names: Sequence[str],
        points: Floats,
        waypoints_m: Waypoints,
        stops: tuple[Stop, ...],
        look: Look,
    ) -> Way:
        """Return the way by places and by the waypoints of each of its legs."""
        named = [(names[0], points[0])]
        for name, point, by in zip(names[1:], points[1:], waypoints_m, strict=True):
            named += [*(("", np.array(at)) for at in by), (name, point)]
        names_at, at = zip(*named, strict=True)
        return cls(names_at, np.array(at), stops, look)

    @property
    def side(self) -> Floats:
        """Corners from the side (corner, 2): distance over ground and altitude [m]."""
        steps = np.hypot(*np.diff(self.points[:, :2], axis=0).T)
        return np.stack([np.concatenate([[0.0], np.cumsum(steps)]), self.points[:, 2]], axis=1)

    @property
    def legs(self) -> list[frozenset[tuple[float, ...]]]:
        """Both ends of every leg on the map [m], whichever way it is flown."""
        return [frozenset(map(tuple, ends)) for ends in pairwise(self.points[:, :2].tolist())]


@style.applied()
def mission_map(
    subject: Plan | Mission | str | Path, *, figure: style.AnyFigure | None = None
) -> MapAxes:
    """Draw where a mission takes place and, where there is a plan, its route and stops.

    From above: the coverage disc at the hover altitude, the ground device, the laser and its sight
    lines, and footprints. Without a plan the direct route is shown in grey.

    Parameters
    ----------
    subject
        A plan, a plan without phases, or a mission; also by its name or path.
    figure
        Where to draw; on a page of its own by default.

    Returns
    -------
    The axes, in m.

    Examples
    --------
    >>> import optuav
    >>> optuav.plots.mission_map(optuav.load("paper")).plan.get_title(loc="left")
    'paper'
    """
    subject = load_subject(subject)
    mission = subject if isinstance(subject, Mission) else subject.mission
    shown, title, why = scene(mission), style.drawable(mission.name), ""
    on_the_way = ORIGIN, *shown.places.hovers.tolist(), DESTINATION
    ends = [k for k in on_the_way if shown.places.exists[k]]
    names, stops = tuple(shown.places.names[k] for k in ends), tuple[Stop, ...]()
    look: Look = {"color": GREY, "linestyle": style.DASHED}
    entries = [Line2D([], [], label="direct route (no plan)", **look)]
    by: Waypoints = ((),) * (len(names) - 1)
    if isinstance(subject, Plan):
        words = [f"plan by {style.drawable(subject.problem)}"]
        words += [style.drawable(subject.trajectory)] if subject.trajectory else []
        words.append(style.perspective(subject.perspective))
        title = style.titled(title, *words)
        if subject:
            names, stops, look = subject.route, subject.stops, {"color": BLUE}
            by, entries = subject.waypoints_m, [*_plan_entries(subject, look)]
        else:
            title += f", no plan ({subject.status.value})"
            reasons = (reason.replace("$", r"\$") for reason in subject.reasons[:3])
            why = "\n".join(textwrap.fill(reason, 60) for reason in reasons)
    way = Way.bent(names, shown.positions(names), by, stops, look)
    return _draw(shown, [way], entries, title, why, figure=figure)


@style.applied()
def trajectories(
    plans: Mapping[str, Plan | str | Path], *, figure: style.AnyFigure | None = None
) -> MapAxes:
    """Draw the routes of several plans over one map, as the paper does for its four trajectories.

    Legs that several routes share lie side by side.

    Parameters
    ----------
    plans
        Plans, or the paths of their files, by name; the paper's are ``"direct"``, ``"traj1"``,
        ``"traj2"`` and ``"optimal"``. They take place on one map. A plan that says that there is
        none stands in the legend only.
    figure
        Where to draw; on a page of its own by default.

    Returns
    -------
    The axes, in m.

    Raises
    ------
    InputError
        Without a plan, or if they take place in different missions.

    Examples
    --------
    >>> import optuav
    >>> plans = {"direct": optuav.solve("paper", "P3"), "optimal": optuav.solve("paper")}
    >>> optuav.plots.trajectories(plans).plan.get_title(loc="left")
    'paper: trajectories, perspective available'
    """
    if not of_kind("plans", plans, Mapping, "plans by name, in a dict"):
        raise InputError("a map of trajectories needs at least one plan")
    loaded = {name: load_plan(plan) for name, plan in plans.items()}
    if len({SITE(plan.mission) for plan in loaded.values()}) > 1:
        raise InputError("the plans of one map have the same places: route, buildings, laser, link")
    shown = scene(next(iter(loaded.values())).mission)
    ways, entries = list[Way](), list[Artist]()
    for (name, plan), colour, dashes in zip(
        loaded.items(), cycle(COLOURS), cycle(DASHES), strict=False
    ):
        look: Look = {"color": colour, "linestyle": dashes}
        label = style.WORDS.get(name, style.drawable(name))
        if plan:
            places = plan.route, shown.positions(plan.route), plan.waypoints_m
            ways.append(Way.bent(*places, plan.stops, look))
            rests = [style.drawable(str(stop.at)) for stop in plan.stops if stop.kind == "rest"]
            label += (
                f"{' by ' + ', '.join(rests) if rests else ''}: Δ = {seconds(plan.hover_time_s, 1)}"
            )
            label += f", $T'$ = {seconds(plan.rest_time_s, 1)}" if rests else ""
        else:
            label += f": no plan ({plan.status.value})"
        entries.append(Line2D([], [], label=label, **look))
    perspectives = dict.fromkeys(plan.perspective for plan in loaded.values())
    title = style.titled(shown.mission.name, "trajectories", style.perspective(*perspectives))
    return _draw(shown, ways, entries, title, times=False, figure=figure)


def _draw(
    shown: Scene,
    ways: Sequence[Way],
    entries: Iterable[Artist],
    title: str,
    heading: str = "",
    *,
    times: bool = True,
    figure: style.AnyFigure | None = None,
) -> MapAxes:
    """Draw both views with the ways, a legend under a heading, and labels."""
    width_m, depth_m = np.diff(shown.corners_m, axis=0)[0]
    if depth_m >= width_m:  # the page has the shape of the map
        height_in = min(5.4, max(4.5, 0.9 + 3.0 * depth_m / width_m))
        columns, page = 1, figure or style.page(height_in)
        cells = page.subplot_mosaic("AB;AC", width_ratios=(1.0, 0.95))
    else:
        columns, depth_in = 3, max(1.6, 6.2 * depth_m / width_m)
        ratios, page = (depth_in, 1.6, 0.7), figure or style.page(depth_in + 3.0)
        cells = page.subplot_mosaic("A;B;C", height_ratios=ratios)
    axes, legend = MapAxes(cells["A"], cells["B"]), cells["C"]
    legend.set_axis_off()
    handles = [*entries, *draw_plan_view(axes.plan, shown, ways)]
    clear = draw_from_above(axes.plan, shown, ways)
    handles.append(_draw_from_side(axes.height, shown, ways))
    axes.plan.set_title(title)
    room: Look = {"labelspacing": 0.6, "columnspacing": 1.4, "loc": "upper left", "ncols": columns}
    legend.legend(handles=handles, title=heading, title_fontsize=7.5, alignment="left", **room)
    style.group_thousands(*axes)
    style.settle(axes.plan)
    flat = [way.points[:, :2] for way in ways]
    walls = [np.concatenate([ring, ring[:1]]) for ring in shown.rings if len(ring)]
    faint = [*_sight(shown, ways)[0], *links(shown), *(walls if len(walls) <= MOST_NAMED else ())]
    style.place(axes.plan, plan_labels(shown, ways, times=times), flat, faint, clear)
    _name_from_side(axes.height, shown, ways)
    return axes


def _name_from_side(ax: Axes, shown: Scene, ways: Sequence[Way]) -> None:
    """Name every place of the ways once, and many devices upright."""
    corners = {
        name: (at[0], at[1])
        for way in reversed(ways)
        for name, at in zip(way.names, way.side.tolist(), strict=True)
        if name
    }
    devices = [device.name for device in shown.mission.devices if device.name in corners]
    lines = [way.side for way in ways]
    if len(devices) > MOST_TIMED:
        lines += _name_upright(ax, {name: corners.pop(name) for name in devices})
    words = {name: symbol.rpartition(" ")[2] for name, symbol in SYMBOLS.items()}
    short = [style.Label(words.get(n) or style.drawable(n), at) for n, at in corners.items()]
    style.place(ax, short, lines)


def _name_upright(ax: Axes, points: Mapping[str, tuple[float, float]]) -> Iterator[Floats]:
    """Name points upright, above or below all of them; a line (2, 2) along each name."""
    names = sorted(points, key=points.__getitem__)
    at = np.array([points[name] for name in names])
    (low, high), altitudes = ax.get_ylim(), at[:, 1]
    above = high - altitudes.max() > altitudes.min() - low
    offset_pt = style.UPRIGHT_PT if above else -style.UPRIGHT_PT
    words = [style.drawable(name) for name in names]
    for text in style.upright(ax, words, at, ax.transData, offset_pt):
        box = text.get_window_extent()
        middle_px = [(0.5 * (box.x0 + box.x1), y_px) for y_px in box.intervaly]
        yield ax.transData.inverted().transform(middle_px)


def _plan_entries(plan: Plan, look: Look) -> Iterator[Line2D]:
    """Entries of the legend for the route of a plan and its stays."""
    flown = f"route, $T_\\mathrm{{fl}}$ = {seconds(plan.flight_time_s, 1)}"
    yield Line2D([], [], label=flown, **look)
    kinds = (("hover", "Δ", plan.hover_time_s), ("rest", "$T'$", plan.rest_time_s))
    for kind, symbol, total_s in kinds:
        if any(stop.kind == kind for stop in plan.stops):
            yield Line2D(
                [], [], label=f"{kind}, {symbol} = {seconds(total_s, 1)}", **signs.look(kind)
            )


def plan_labels(shown: Scene, ways: Sequence[Way], *, times: bool) -> list[style.Label]:
    """Places of the ways with their stops, then the scenery; roofs where nothing is planned.

    The stays over several devices stand at the devices, which a line joins to their hover points.
    """
    mission = shown.mission
    timed = times and len(mission.devices) <= MOST_TIMED
    stops = [stop for way in ways for stop in way.stops] if times else []
    labels, devices = [], {device.name for device in mission.devices}
    for name, (x, y, _) in _places(shown, ways).items():
        if name not in devices:
            lines = [SYMBOLS.get(name) or style.drawable(name), *_stays(stops, name)]
            labels.append(style.Label("\n".join(lines), (x, y)))
    written = {label.at for label in labels}
    scenery = list[style.Label]()
    for device, (x, y, _) in zip(mission.served, shown.devices_m.tolist(), strict=True):
        lines = ["device $\\mathbf{w}_u$"]
        if mission.devices:
            lines = [style.drawable(device.name), *_stays(stops if timed else [], device.name)]
        scenery.append(style.Label("\n".join(lines), (x, y), needed=len(devices) <= FEW))
    if mission.laser is not None:
        scenery.append(style.Label("laser $\\mathbf{w}_s$", mission.laser.position_m[:2]))
    # A plan names the roofs that it uses; without one, all names help to choose.
    named = not any(way.stops for way in ways) and len(mission.buildings) <= MOST_NAMED
    for building in mission.buildings if named else ():
        name, at = style.drawable(building.name), building.position_m[:2]
        scenery.append(style.Label(name, at, needed=False, colour=DARK, size=6.5))
    return labels + [label for label in scenery if tuple(label.at) not in written]


def _stays(stops: Sequence[Stop], name: str) -> Iterator[str]:
    """Words for the stops at a place, for its label."""
    for stop in (candidate for candidate in stops if candidate.at == name):
        assert stop.start_s is not None
        stay = f"{stop.kind} {seconds(stop.duration_s, 1)}\nfrom {seconds(stop.start_s, 1)}"
        yield stay if stop.duration_s > 0.0 else "passes by"


def _places(shown: Scene, ways: Sequence[Way]) -> dict[str, list[float]]:
    """Positions [m] of both ends, first as they leave labels least room, and of places of ways."""
    ends = ("origin", "destination")
    at_m = dict(zip(ends, shown.positions(ends).tolist(), strict=True))
    for way in ways:
        named = zip(way.names, way.points.tolist(), strict=True)
        at_m |= {name: at for name, at in named if name}
    return at_m


def _sight(shown: Scene, ways: Sequence[Way]) -> tuple[Floats, Booleans]:
    """The lines of sight to draw, and which are clear: in a town only from the ways."""
    return shown.sight_lines({name for way in ways for name in way.names}, FEW)


def draw_from_above(ax: Axes, shown: Scene, ways: Sequence[Way]) -> list[Floats]:
    """Draw ways, legs that several of them share side by side, and stops.

    Points that labels keep clear of [m]: arrows and stops.
    """
    points, at = list[Floats](), _places(shown, ways)
    users, before = Counter(chain.from_iterable(way.legs for way in ways)), Counter[object]()
    for way in ways:
        for leg, ends in zip(way.legs, pairwise(way.points[:, :2]), strict=True):
            shift = before[leg] - (users[leg] - 1) / 2
            points += _draw_leg(ax, np.array(ends), shift, way.look)
            before[leg] += 1
        for stop in way.stops:
            x, y, _ = at[str(stop.at)]
            signs.put(ax, stop.kind, (x, y), hollow=stop.duration_s <= 0.0)
            points.append(np.array([x, y]))
    signs.put(ax, "end", [at["origin"], at["destination"]])
    return points


def _draw_leg(ax: Axes, ends: Floats, shift: float, look: Look) -> list[Floats]:
    """Draw a leg, moved aside to its left or right as seen from its lesser end; its arrow [m]."""
    (x, y), length = np.subtract(*sorted(ends.tolist(), reverse=True)), math.dist(*ends)
    if length == 0.0:
        return []
    aside = SHIFT * shift / length
    moved = offset_copy(ax.transData, style.root(ax), -y * aside, x * aside, units="points")
    ax.plot(*ends.T, transform=moved, zorder=3, **look)
    at = ARROW_AT + ARROW_STEP * shift
    tail, head = (ends[0] + share * (ends[1] - ends[0]) for share in (at - 0.02, at))
    arrow = {"arrowstyle": "-|>", "color": look["color"], "linewidth": 0.0, "mutation_scale": 12.0}
    arrow |= {"shrinkA": 0.0, "shrinkB": 0.0}
    ax.annotate("", head, tail, xycoords=moved, textcoords=moved, arrowprops=arrow)
    return [head]


def _draw_from_side(ax: Axes, shown: Scene, ways: Sequence[Way]) -> Artist:
    """Draw altitudes along the ways, each a little above the last; the legend's entry."""
    limits = shown.mission.limits
    highest_m = max(1.0, limits.min_altitude_m)
    lowest_m = farthest_m = 0.0
    for rank, way in enumerate(ways):
        along_m, z = way.side.T
        above = SHIFT * (rank - (len(ways) - 1) / 2)
        raised = offset_copy(ax.transData, style.root(ax), 0.0, above, units="points")
        ax.plot(along_m, z, transform=raised, zorder=3, **way.look)
        for name, *at in zip(way.names, along_m, z, strict=True):
            for stop in (candidate for candidate in way.stops if candidate.at == name):
                hollow = stop.duration_s <= 0.0
                signs.put(ax, stop.kind, at, hollow=hollow, transform=raised)
        for low_m, high_m, roof_m in _buildings_along(shown, way):
            ax.add_patch(Rectangle((low_m, 0.0), high_m - low_m, roof_m, color=style.PALE, lw=0.8))
            highest_m = max(highest_m, roof_m)
        lowest_m, highest_m = min(lowest_m, *z), max(highest_m, *z)
        farthest_m = max(farthest_m, along_m[-1])
    aside = "\n(lines side by side)" if len(ways) > 1 else ""
    along = f"distance over ground along the route [m]{aside}"
    ax.set(xlim=style.margins([0.0, farthest_m]), xlabel=along)
    ax.set(ylim=(lowest_m, lowest_m + 1.35 * (highest_m - lowest_m)), ylabel="altitude $z$ [m]")
    span: Look = {"facecolor": f"{GREEN}1F", "hatch": "....", "edgecolor": f"{GREEN}40"}
    span |= {"linewidth": 0.0, "label": "altitudes for hovering"}
    return ax.axhspan(limits.min_altitude_m, limits.max_altitude_m, **span)


def _buildings_along(shown: Scene, way: Way) -> Iterator[tuple[float, float, float]]:
    """Return where a way is over a footprint, from and to [m] over ground, and the roof [m]."""
    import shapely

    footprints, roofs_m = shown.obstacles.polygons, shown.obstacles.roof_m
    for (start, end), begin_m in zip(pairwise(way.points[:, :2]), way.side[:, 0], strict=False):
        if (start == end).all():
            continue
        line = shapely.LineString([start, end])
        for number in np.flatnonzero(shapely.intersects(footprints, line)):
            common = shapely.intersection(line, footprints[number])
            for part in shapely.get_parts(common):
                along = [begin_m + math.dist(start, point) for point in part.coords]
                yield float(min(along)), float(max(along)), float(roofs_m[number])


def draw_plan_view(ax: Axes, shown: Scene, ways: Sequence[Way] = ()) -> list[Artist]:
    """Draw the scenery from above, and set the limits; entries of the legend."""
    entries = list[Artist]()
    ax.set_aspect("equal", adjustable="datalim")
    ax.margins(0.0)
    ax.update_datalim(np.transpose([style.margins(values) for values in shown.corners_m.T]))
    discs = zip(shown.devices_m.tolist(), shown.disc_radii_m.tolist(), strict=True)
    for (x, y, _), reach_m in discs:
        if math.isfinite(reach_m):
            radius_m = min(reach_m, FAR * float(np.abs(shown.corners_m - (x, y)).max()))
            fill: Look = {"facecolor": f"{GREEN}26", "edgecolor": GREEN, "linewidth": 0.8}
            disc = Circle((x, y), radius_m, label="coverage at the hover altitude", **fill)
            ax.add_artist(disc)  # unlike a patch, it does not move the limits
            entries[:] = [disc]
    entries += _draw_links(ax, shown)
    lines, sight = _sight(shown, ways)
    light = style.limit("laser")
    looks: tuple[tuple[bool, str, LineStyleType, str], ...] = (
        (False, LOOKS["muted"].light, SPARSE, "blocked sight line"),
        (True, light["color"], light["linestyle"], "clear sight line of the laser"),
    )
    for clear, colour, dashes, words in looks:
        if (sight == clear).any():
            look: Look = {"colors": colour, "linestyles": [dashes], "linewidths": 0.8}
            look["zorder"] = 1.5
            ax.add_collection(LineCollection([*lines[sight == clear]], **look), autolim=False)
            entries.append(style.entry(words, colour, 1.0, dashes))
    entries += draw_site(ax, shown, {"facecolor": style.PALE, "edgecolor": GREY})
    ax.set(xlabel="x [m]", ylabel="y [m]")
    return entries


def links(shown: Scene) -> Floats:
    """Lines (line, 2, 2) on the map from several devices to the hover points in their reach [m]."""
    hovers_m = shown.places.position_m[shown.places.hovers, :2]
    lines = np.stack([shown.devices_m[:, :2], hovers_m], axis=1)
    return lines[np.isfinite(lines).all(axis=(1, 2)) & bool(shown.mission.devices)]


def _draw_links(ax: Axes, shown: Scene) -> list[Artist]:
    """Draw which hover point serves which of several devices; the legend's entry."""
    lines = links(shown)
    if not len(lines):
        return []
    look: Look = {"linestyles": [style.DASHED], "linewidths": 0.9, "zorder": 1.6}
    ax.add_collection(LineCollection([*lines], colors=GREEN, **look), autolim=False)
    return [style.entry("device and its hover point", GREEN, 0.9, style.DASHED)]


def draw_site(ax: Axes, shown: Scene, walls: Look, *, cased: bool = False) -> list[Artist]:
    """Draw footprints, roofs, the device and the laser from above; entries of the legend."""
    mission, entries = shown.mission, draw_buildings(ax, shown, walls)
    above: Look = {"cased": cased, "zorder": 4}
    word = f"ground device{'s' * (len(mission.served) > 1)}"
    entries += signs.put(ax, "device", shown.devices_m, word, **above)
    if mission.laser is not None:
        entries += signs.put(ax, "laser", mission.laser.position_m, "laser", **above)
    return entries


def draw_buildings(ax: Axes, shown: Scene, walls: Look) -> list[Artist]:
    """Draw footprints and roofs from above; entries of the legend."""
    rings, few = shown.rings, len(shown.mission.buildings) <= FEW
    width_pt = 0.6 if few else 0.3 if len(rings) <= MOST_NAMED else 0.1
    look: Look = {"linewidth": width_pt, "zorder": 2, **walls}
    footprints = PolyCollection([*filter(len, rings)], label="building", **look)
    ax.add_collection(footprints, autolim=False)
    dotted = np.array([few or not len(ring) for ring in rings], dtype=bool)
    roofs_m = shown.places.position_m[shown.places.buildings][dotted]
    signs.put(ax, "roof", roofs_m, zorder=2.1)
    return [footprints] if rings else []
