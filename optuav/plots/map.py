"""The map: a mission with its plan, or several plans, from above and from the side."""

from __future__ import annotations

import itertools
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from optuav.errors import InputError
from optuav.mission import Mission
from optuav.plan import Plan, Stop
from optuav.plots.labels import Label, place, settle
from optuav.plots.scene import (
    Scene,
    draw_plan_view,
    drawn_sight_lines,
    extent,
    scene,
    scenery_labels,
)
from optuav.plots.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    SKY,
    VERMILLION,
    group_thousands,
    need_panels,
    page,
    printed,
    styled,
)
from optuav.plots.ways import Way, draw_from_above, draw_from_side, stop_look

SYMBOLS = {
    "origin": "origin $\\mathbf{w}_0$",
    "hover": "hover point $\\mathbf{w}_U$",
    "destination": "destination $\\mathbf{w}_F$",
}
WORDS = {
    "direct": "Direct path",
    "traj1": "Traj. 1",
    "traj2": "Traj. 2",
    "optimal": "Optimal",
}
"""Names of the trajectories as the paper prints them."""
LOOKS: tuple[dict[str, Any], ...] = (
    {"color": BLACK, "linestyle": "-"},
    {"color": SKY, "linestyle": (0.0, (5.0, 1.5))},
    {"color": ORANGE, "linestyle": (0.0, (2.0, 1.0))},
    {"color": BLUE, "linestyle": (0.0, (6.0, 1.2, 1.5, 1.2))},
    {"color": VERMILLION, "linestyle": (0.0, (1.0, 1.0))},
    {"color": GREEN, "linestyle": (0.0, (3.0, 3.0))},
)


class MapAxes(NamedTuple):
    """The two views of a map: from above, and from the side along the way."""

    plan: Axes
    height: Axes


def mission_map(subject: Plan | Mission, axes: MapAxes | None = None) -> MapAxes:
    """Draw where a mission takes place and, where there is a plan, its route and stops.

    Seen from above (x, y) with the coverage disc at the hover altitude, the ground device, the
    laser and its sight lines, and footprints; and from the side, height over the way. Without a
    plan the direct route is shown in grey.

    Parameters
    ----------
    subject
        A plan, a plan that says that there is none, or a mission.
    axes
        Where to draw; on a page of its own by default.
    """
    mission = subject if isinstance(subject, Mission) else subject.mission
    plan = subject if isinstance(subject, Plan) and subject else None
    with styled():
        shown = scene(mission)
        names = plan.route if plan else shown.direct
        look = {"color": BLUE} if plan else {"color": GREY, "linestyle": (0.0, (4.0, 2.0))}
        way = Way(names, shown.positions(names), plan.stops if plan else (), look)
        axes, legend = _page(shown, axes)
        entries = [*_way_entries(way, plan), *draw_plan_view(axes.plan, shown)]
        draw_from_above(axes.plan, shown, [way])
        entries.append(draw_from_side(axes.height, shown, [way]))
        axes.plan.set_title(_title(subject))
        _legend(legend, entries, "" if plan else _why(subject))
        _write(axes, [way], _plan_labels(shown, [way]))
    return axes


def trajectories(plans: Mapping[str, Plan], axes: MapAxes | None = None) -> MapAxes:
    """Draw the routes of several plans over one map, as the paper does for its four trajectories.

    Legs that several routes share lie side by side.

    Parameters
    ----------
    plans
        By name; the paper's are ``"direct"``, ``"traj1"``, ``"traj2"`` and ``"optimal"``. They
        take place on one map. A plan that says that there is none stands in the legend only.
    axes
        Where to draw; on a page of its own by default.

    Raises
    ------
    InputError
        If there are no plans, or they take place in different missions.
    """
    if not plans:
        raise InputError("a map of trajectories needs at least one plan")
    if len({_place(plan.mission) for plan in plans.values()}) > 1:
        raise InputError("the plans of one map have the same places: route, buildings, laser, link")
    with styled():
        shown = scene(next(iter(plans.values())).mission)
        looks = dict(zip(plans, itertools.cycle(LOOKS), strict=False))
        ways = [
            Way(plan.route, shown.positions(plan.route), plan.stops, looks[name])
            for name, plan in plans.items()
            if plan
        ]
        axes, legend = _page(shown, axes)
        entries = [_trajectory_entry(name, plan, looks[name]) for name, plan in plans.items()]
        entries += draw_plan_view(axes.plan, shown)
        draw_from_above(axes.plan, shown, ways)
        entries.append(draw_from_side(axes.height, shown, ways))
        counted = ", ".join(dict.fromkeys(plan.perspective for plan in plans.values()))
        axes.plan.set_title(
            f"{printed(shown.mission.name)}: trajectories in the perspective {counted}"
        )
        _legend(legend, entries)
        _write(axes, ways, _plan_labels(shown, ways, times=False))
    return axes


def _place(mission: Mission) -> tuple[Any, ...]:
    """What decides where a mission takes place."""
    limits = mission.limits
    reach = (mission.link, limits.outage_probability, limits.min_altitude_m)
    return (mission.route, mission.buildings, mission.laser, *reach)


def _page(shown: Scene, axes: MapAxes | None) -> tuple[MapAxes, Axes]:
    """The axes, and those that get the legend; a page of its own has the shape of the map."""
    need_panels(axes, MapAxes)
    if axes is not None:
        return axes, axes.height
    width_m, depth_m = np.diff(extent(shown), axis=0)[0]
    if depth_m >= width_m:
        figure = page(7.2, 5.4)
        grid = figure.add_gridspec(2, 2, width_ratios=(1.0, 0.95), height_ratios=(1.0, 1.0))
        cells = (grid[:, 0], grid[0, 1], grid[1, 1])
    else:
        depth_in = max(1.6, 6.2 * depth_m / width_m)
        figure = page(7.2, depth_in + 3.0)
        grid = figure.add_gridspec(3, 1, height_ratios=(depth_in, 1.6, 0.7))
        cells = (grid[0, 0], grid[1, 0], grid[2, 0])
    plan, height, legend = (figure.add_subplot(cell) for cell in cells)
    legend.set_axis_off()
    return MapAxes(plan, height), legend


def _legend(home: Axes, entries: Sequence[Artist], heading: str = "") -> None:
    style: dict[str, Any] = {"title": heading, "alignment": "left", "title_fontsize": 7.5}
    if home.axison:
        style |= {"loc": "upper center", "bbox_to_anchor": (0.5, -0.22), "ncols": 3}
    else:
        wide = home.get_position().width > 0.6
        style |= {"loc": "upper left", "ncols": 3 if wide else 1, "labelspacing": 0.6}
        style |= {"columnspacing": 1.4}
    home.legend(handles=entries, **style)


def _title(subject: Plan | Mission) -> str:
    if isinstance(subject, Mission):
        return printed(subject.name)
    words = [subject.problem, subject.trajectory, subject.perspective]
    asked = ", ".join(printed(word) for word in words if word)
    answer = "" if subject else f": no plan ({subject.status.value})"
    return f"{printed(subject.mission.name)}: {asked}{answer}"


def _why(subject: Plan | Mission) -> str:
    reasons = subject.reasons if isinstance(subject, Plan) else ()
    return "\n".join(textwrap.fill(reason.replace("$", r"\$"), 60) for reason in reasons[:3])


def _way_entries(way: Way, plan: Plan | None) -> Iterator[Artist]:
    if plan is None:
        yield Line2D([], [], label="direct route (no plan)", **way.look)
        return
    yield Line2D(
        [], [], label=f"route, $T_\\mathrm{{fl}}$ = {plan.flight_time_s:.1f} s", **way.look
    )
    for kind, symbol, total_s in (
        ("hover", "Δ", plan.hover_time_s),
        ("rest", "$T'$", plan.rest_time_s),
    ):
        if any(stop.kind == kind for stop in way.stops):
            label = f"{kind}, {symbol} = {total_s:.1f} s"
            yield Line2D([], [], linestyle="", label=label, **stop_look(kind, True))


def _trajectory_entry(name: str, plan: Plan, look: Mapping[str, Any]) -> Artist:
    label = WORDS.get(name, printed(name))
    if plan:
        by_way = [printed(stop.at) for stop in plan.stops if stop.kind == "rest"]
        label += f"{' by ' + ', '.join(by_way) if by_way else ''}: Δ = {plan.hover_time_s:.1f} s"
        label += f", $T'$ = {plan.rest_time_s:.1f} s" if by_way else ""
    else:
        label += f": no plan ({plan.status.value})"
    return Line2D([], [], label=label, **look)


def _plan_labels(shown: Scene, ways: Sequence[Way], *, times: bool = True) -> list[Label]:
    """Names of the places of the ways with their stops, then the scenery's."""
    names = list(dict.fromkeys(name for way in ways for name in way.names))
    names += [name for name in ("origin", "destination") if name not in names]
    points = shown.positions(names)
    stops = [stop for way in ways for stop in way.stops] if times else []
    labels = []
    for name, (x, y, _) in zip(names, points, strict=True):
        lines = [SYMBOLS.get(name) or printed(name)]
        lines += [_stay(stop) for stop in stops if stop.at == name]
        labels.append(Label("\n".join(lines), (x, y)))
    written = {label.at for label in labels}
    return labels + [label for label in scenery_labels(shown) if tuple(label.at) not in written]


def _stay(stop: Stop) -> str:
    if stop.duration_s == 0.0:
        return "passes by"
    return f"{stop.kind} {stop.duration_s:.1f} s\nfrom {stop.start_s:.1f} s"


def _height_labels(ways: Sequence[Way]) -> list[Label]:
    """Every place of the ways once."""
    corners = {
        name: (at[0], at[1])
        for way in reversed(ways)
        for name, at in zip(way.names, way.side.tolist(), strict=True)
    }
    short = {name: words.rpartition(" ")[2] for name, words in SYMBOLS.items()}
    return [Label(short.get(name) or printed(name), at) for name, at in corners.items()]


def _write(axes: MapAxes, ways: Sequence[Way], labels: Sequence[Label]) -> None:
    flat = [np.array(way.points)[:, :2] for way in ways]
    group_thousands(*axes)
    settle(axes.plan)
    place(axes.plan, labels, flat, drawn_sight_lines(axes.plan))
    place(axes.height, _height_labels(ways), [way.side for way in ways])
