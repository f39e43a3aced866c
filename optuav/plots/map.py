"""The map: a mission with its plan, or several plans, from above and from the side."""

from __future__ import annotations

import math
import textwrap
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import chain, cycle, pairwise
from typing import NamedTuple

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from matplotlib.transforms import offset_copy

from optuav.arrays import Floats
from optuav.errors import InputError
from optuav.mission import Mission
from optuav.network.places import DESTINATION, HOVER, ORIGIN
from optuav.plan import Plan, Stop
from optuav.plots import style
from optuav.plots.scene import Scene, draw_plan_view, scene, scenery_labels, stop_look
from optuav.plots.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    SKY,
    VERMILLION,
    Label,
    Look,
    place,
    printed,
)

SYMBOLS = {
    "origin": "origin $\\mathbf{w}_0$",
    "hover": "hover point $\\mathbf{w}_U$",
    "destination": "destination $\\mathbf{w}_F$",
}
LOOKS: tuple[Look, ...] = (
    {"color": BLACK, "linestyle": "-"},
    {"color": SKY, "linestyle": (0.0, (5.0, 1.5))},
    {"color": ORANGE, "linestyle": (0.0, (2.0, 1.0))},
    {"color": BLUE, "linestyle": (0.0, (6.0, 1.2, 1.5, 1.2))},
    {"color": VERMILLION, "linestyle": (0.0, (1.0, 1.0))},
    {"color": GREEN, "linestyle": (0.0, (3.0, 3.0))},
)
SHIFT = 2.0  # Distance between legs that would lie on each other [pt]
ARROW_AT, ARROW_STEP = 0.56, 0.05
"""Where a leg shows its direction: past the middle, so that there and back do not meet; and how
much farther its neighbour does."""


class MapAxes(NamedTuple):
    """The two views of a map: from above, and from the side along the way."""

    plan: Axes
    height: Axes


class Way(NamedTuple):
    """A route as it is drawn: its places by name and position (place, 3) [m], stops and look."""

    names: tuple[str, ...]
    points: Floats
    stops: tuple[Stop, ...]
    look: Look

    @property
    def side(self) -> Floats:
        """Corners from the side (corner, 2): distance over ground and height [m]."""
        steps = np.hypot(*np.diff(self.points[:, :2], axis=0).T)
        return np.stack([np.concatenate([[0.0], np.cumsum(steps)]), self.points[:, 2]], axis=1)

    @property
    def legs(self) -> list[frozenset[tuple[float, ...]]]:
        """Both ends of every leg on the map [m], whichever way it is flown."""
        return [frozenset(map(tuple, ends)) for ends in pairwise(self.points[:, :2].tolist())]


def mission_map(subject: Plan | Mission) -> MapAxes:
    """Draw where a mission takes place and, where there is a plan, its route and stops.

    Seen from above (x, y) with the coverage disc at the hover altitude, the ground device, the
    laser and its sight lines, and footprints; and from the side, height over the way. Without a
    plan the direct route is shown in grey.

    Parameters
    ----------
    subject
        A plan, a plan that says that there is none, or a mission.

    Returns
    -------
    The axes, in m.

    Examples
    --------
    >>> import optuav
    >>> optuav.plots.mission_map(optuav.load("paper")).plan.get_title(loc="left")
    'paper'
    """
    mission = subject if isinstance(subject, Mission) else subject.mission
    plan = subject if isinstance(subject, Plan) and subject else None
    shown = scene(mission)
    ends = [k for k in (ORIGIN, HOVER, DESTINATION) if shown.places.exists[k]]
    names = plan.route if plan else tuple(shown.places.names[k] for k in ends)
    look: Look = {"color": BLUE} if plan else {"color": GREY, "linestyle": style.DASHED}
    way = Way(names, shown.positions(names), plan.stops if plan else (), look)
    reasons = subject.reasons[:3] if isinstance(subject, Plan) else ()
    why = "\n".join(textwrap.fill(reason.replace("$", r"\$"), 60) for reason in reasons)
    entries = _way_entries(way, plan)
    return _draw(shown, [way], entries, _title(subject), "" if plan else why)


def trajectories(plans: Mapping[str, Plan]) -> MapAxes:
    """Draw the routes of several plans over one map, as the paper does for its four trajectories.

    Legs that several routes share lie side by side.

    Parameters
    ----------
    plans
        By name; the paper's are ``"direct"``, ``"traj1"``, ``"traj2"`` and ``"optimal"``. They
        take place on one map. A plan that says that there is none stands in the legend only.

    Returns
    -------
    The axes, in m.

    Raises
    ------
    InputError
        If there are no plans, or they take place in different missions.

    Examples
    --------
    >>> import optuav
    >>> plans = {"direct": optuav.solve("paper", "P3"), "optimal": optuav.solve("paper")}
    >>> optuav.plots.trajectories(plans).plan.get_title(loc="left")
    'paper: trajectories in the perspective available'
    """
    if not plans:
        raise InputError("a map of trajectories needs at least one plan")
    if len({_site(plan.mission) for plan in plans.values()}) > 1:
        raise InputError("the plans of one map have the same places: route, buildings, laser, link")
    shown = scene(next(iter(plans.values())).mission)
    looks = dict(zip(plans, cycle(LOOKS), strict=False))
    ways = [
        Way(plan.route, shown.positions(plan.route), plan.stops, looks[name])
        for name, plan in plans.items()
        if plan
    ]
    perspectives = ", ".join(dict.fromkeys(plan.perspective for plan in plans.values()))
    title = f"{printed(shown.mission.name)}: trajectories in the perspective {perspectives}"
    entries = (_trajectory_entry(name, plan, looks[name]) for name, plan in plans.items())
    return _draw(shown, ways, entries, title, times=False)


def _site(mission: Mission) -> tuple[object, ...]:
    """The part of a mission that decides where it takes place."""
    limits = mission.limits
    reach = (mission.link, limits.outage_probability, limits.min_altitude_m)
    return (mission.route, mission.buildings, mission.laser, *reach)


@style.applied()
def _draw(
    shown: Scene,
    ways: Sequence[Way],
    entries: Iterable[Artist],
    title: str,
    heading: str = "",
    *,
    times: bool = True,
) -> MapAxes:
    """Draw both views with the ways, a legend under a heading, and labels."""
    axes, legend = _page(shown)
    handles = [*entries, *draw_plan_view(axes.plan, shown)]
    draw_from_above(axes.plan, shown, ways)
    handles.append(_draw_from_side(axes.height, shown, ways))
    axes.plan.set_title(title)
    columns = 3 if legend.get_position().width > 0.6 else 1
    room: Look = {"labelspacing": 0.6, "columnspacing": 1.4, "loc": "upper left", "ncols": columns}
    legend.legend(handles=handles, title=heading, title_fontsize=7.5, alignment="left", **room)
    style.group_thousands(*axes)
    style.settle(axes.plan)
    flat = [way.points[:, :2] for way in ways]
    place(axes.plan, plan_labels(shown, ways, times=times), flat, shown.sight_lines[0])
    place(axes.height, _height_labels(ways), [way.side for way in ways])
    return axes


def _page(shown: Scene) -> tuple[MapAxes, Axes]:
    """Axes on a page of the shape of the map, and those that get the legend."""
    width_m, depth_m = np.diff(shown.corners_m, axis=0)[0]
    if depth_m >= width_m:
        cells = style.page(5.4).subplot_mosaic(
            [["plan", "height"], ["plan", "legend"]], width_ratios=(1.0, 0.95)
        )
    else:
        depth_in = max(1.6, 6.2 * depth_m / width_m)
        cells = style.page(depth_in + 3.0).subplot_mosaic(
            [["plan"], ["height"], ["legend"]], height_ratios=(depth_in, 1.6, 0.7)
        )
    cells["legend"].set_axis_off()
    return MapAxes(cells["plan"], cells["height"]), cells["legend"]


def _title(subject: Plan | Mission) -> str:
    """The question of a plan, and its answer if there is none."""
    if isinstance(subject, Mission):
        return printed(subject.name)
    words = [subject.problem, subject.trajectory, subject.perspective]
    question = ", ".join(printed(word) for word in words if word)
    answer = "" if subject else f": no plan ({subject.status.value})"
    return f"{printed(subject.mission.name)}: {question}{answer}"


def _way_entries(way: Way, plan: Plan | None) -> Iterator[Artist]:
    """Entries of the legend for a way and the stays of its plan."""
    if plan is None:
        yield Line2D([], [], label="direct route (no plan)", **way.look)
        return
    flown = f"route, $T_\\mathrm{{fl}}$ = {plan.flight_time_s:.1f} s"
    yield Line2D([], [], label=flown, **way.look)
    kinds = (("hover", "Δ", plan.hover_time_s), ("rest", "$T'$", plan.rest_time_s))
    for kind, symbol, total_s in kinds:
        if any(stop.kind == kind for stop in way.stops):
            look: Look = {**stop_look(kind, True), "linestyle": ""}
            yield Line2D([], [], label=f"{kind}, {symbol} = {total_s:.1f} s", **look)


def _trajectory_entry(name: str, plan: Plan, look: Look) -> Artist:
    """The entry of the legend for one of several plans."""
    label = style.WORDS.get(name, printed(name))
    if plan:
        rests = [printed(stop.at) for stop in plan.stops if stop.kind == "rest"]
        label += f"{' by ' + ', '.join(rests) if rests else ''}: Δ = {plan.hover_time_s:.1f} s"
        label += f", $T'$ = {plan.rest_time_s:.1f} s" if rests else ""
    else:
        label += f": no plan ({plan.status.value})"
    return Line2D([], [], label=label, **look)


def plan_labels(shown: Scene, ways: Sequence[Way], *, times: bool) -> list[Label]:
    """Names of the places of the ways with their stops, then the scenery's."""
    names = list(dict.fromkeys(name for way in ways for name in way.names))
    names += [name for name in ("origin", "destination") if name not in names]
    stops = [stop for way in ways for stop in way.stops] if times else []
    labels = []
    for name, (x, y, _) in zip(names, shown.positions(names).tolist(), strict=True):
        lines = [SYMBOLS.get(name) or printed(name)]
        for stop in (each for each in stops if each.at == name):
            stay = f"{stop.kind} {stop.duration_s:.1f} s\nfrom {stop.start_s:.1f} s"
            lines.append(stay if stop.duration_s > 0.0 else "passes by")
        labels.append(Label("\n".join(lines), (x, y)))
    written = {label.at for label in labels}
    return labels + [label for label in scenery_labels(shown) if tuple(label.at) not in written]


def _height_labels(ways: Sequence[Way]) -> list[Label]:
    """Every place of the ways once."""
    corners = {
        name: (at[0], at[1])
        for way in reversed(ways)
        for name, at in zip(way.names, way.side.tolist(), strict=True)
    }
    short = {name: words.rpartition(" ")[2] for name, words in SYMBOLS.items()}
    return [Label(short.get(name) or printed(name), at) for name, at in corners.items()]


def draw_from_above(ax: Axes, shown: Scene, ways: Sequence[Way]) -> None:
    """Draw ways on the map, legs that several of them share side by side, and their stops."""
    users, before = Counter(chain.from_iterable(way.legs for way in ways)), Counter[object]()
    for way in ways:
        for leg, ends in zip(way.legs, pairwise(way.points[:, :2]), strict=True):
            _draw_leg(ax, np.array(ends), before[leg] - (users[leg] - 1) / 2, way.look)
            before[leg] += 1
        for stop in way.stops:
            x, y, _ = shown.positions([stop.at])[0]
            ax.plot(x, y, zorder=6, **stop_look(stop.kind, stop.duration_s > 0.0))
    for x, y, _ in shown.positions(["origin", "destination"]):
        ax.plot(x, y, "D", color=BLACK, markersize=4, zorder=6)


def _draw_leg(ax: Axes, ends: Floats, shift: float, look: Look) -> None:
    """Draw a leg on the map, moved aside to its left or right as seen from its lesser end."""
    (x, y), length = np.subtract(*sorted(ends.tolist(), reverse=True)), math.dist(*ends)
    if length == 0.0:
        return
    aside = SHIFT * shift / length
    moved = offset_copy(ax.transData, style.root(ax), -y * aside, x * aside, units="points")
    ax.plot(*ends.T, transform=moved, zorder=3, **look)
    at = ARROW_AT + ARROW_STEP * shift
    tail, head = (ends[0] + share * (ends[1] - ends[0]) for share in (at - 0.02, at))
    arrow = {"arrowstyle": "-|>", "color": look["color"], "linewidth": 0.0, "mutation_scale": 12.0}
    arrow |= {"shrinkA": 0.0, "shrinkB": 0.0}
    ax.annotate("", head, tail, xycoords=moved, textcoords=moved, arrowprops=arrow)


def _draw_from_side(ax: Axes, shown: Scene, ways: Sequence[Way]) -> Artist:
    """Draw heights along the ways, one a little above the other; the legend's entry."""
    limits = shown.mission.limits
    highest_m = max(1.0, limits.min_altitude_m)
    lowest_m = farthest_m = 0.0
    for rank, way in enumerate(ways):
        along_m, z = way.side.T
        above = SHIFT * (rank - (len(ways) - 1) / 2)
        raised = offset_copy(ax.transData, style.root(ax), 0.0, above, units="points")
        ax.plot(along_m, z, transform=raised, zorder=3, **way.look)
        for name, *at in zip(way.names, along_m, z, strict=True):
            for stop in (each for each in way.stops if each.at == name):
                look = stop_look(stop.kind, stop.duration_s > 0.0)
                ax.plot(*at, transform=raised, zorder=6, **look)
        for low_m, high_m, roof_m in _buildings_along(shown, way):
            ax.add_patch(Rectangle((low_m, 0.0), high_m - low_m, roof_m, color=style.PALE, lw=0.8))
            highest_m = max(highest_m, roof_m)
        lowest_m, highest_m = min(lowest_m, *z), max(highest_m, *z)
        farthest_m = max(farthest_m, along_m[-1])
    aside = "\n(lines side by side)" if len(ways) > 1 else ""
    along = f"distance over ground along the way [m]{aside}"
    ax.set(xlim=style.margins([0.0, farthest_m]), xlabel=along)
    ax.set(ylim=(lowest_m, lowest_m + 1.35 * (highest_m - lowest_m)), ylabel="height z [m]")
    return ax.axhspan(
        limits.min_altitude_m,
        limits.max_altitude_m,
        facecolor=f"{GREEN}1F",
        hatch="....",
        edgecolor=f"{GREEN}40",
        linewidth=0.0,
        label="altitudes for hovering",
    )


def _buildings_along(shown: Scene, way: Way) -> Iterator[tuple[float, float, float]]:
    """Where a way is over a footprint, from and to [m] over ground, and the roof [m]."""
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
