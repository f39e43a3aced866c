"""The map shows the places, reach, sight and routes that the mission has."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

pytest.importorskip("matplotlib")
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle
from matplotlib.text import Text

import optuav
from optuav import plots
from optuav.errors import InputError
from optuav.looks import LOOKS
from optuav.network import vehicle
from optuav.physics import link
from optuav.plots import signs, style
from optuav.plots.animation import _still as still

TRAJECTORIES = ("direct", "traj1", "traj2", "optimal")
WALL = {"name": "wall", "position_m": [600, 150, 70], "footprint_m": [20, 200]}


def changed(**values: Any) -> optuav.Mission:
    """The mission `paper` with other values; two underscores stand for a dot."""
    return optuav.load("paper").replace({k.replace("__", "."): v for k, v in values.items()})


def scattered(count: int) -> list[dict[str, Any]]:
    """Buildings at random, but always the same, places."""
    random = np.random.default_rng(20)
    places = random.uniform((0.0, 100.0), (2000.0, 2300.0), (count, 2))
    return [
        {"name": f"house {k}", "position_m": [x, y, 60.0], "footprint_m": [20, 20]}
        for k, (x, y) in enumerate(places.tolist())
    ]


ODD = {
    "one polygon with an unprintable name": {
        "buildings": [
            {
                "name": "a $long$ name, 中文 and \\alpha^2 and more of it",
                "position_m": [600, 900, 60],
                "footprint_m": [[300, 800], [900, 800], [900, 1000], [600, 900], [300, 1000]],
            }
        ]
    },
    "out of reach": {"link__noise_power_W": 1.0},
    "round trip": {"route__destination_m": [0, 0, 50]},
    "wide, without footprints": {
        "route__destination_m": [20000, 0, 50],
        "link__device_m": [9000, 100, 0],
        "buildings": [{"name": "b", "position_m": [600, 900, 60]}],
    },
    "all at one point": {
        "route__destination_m": [0, 0, 50],
        "route__hover_m": [0, 0, 50],
        "link__device_m": [0, 0, 0],
        "laser__position_m": [0, 0, 0],
        "buildings": [],
    },
    "no laser and a reach beyond the map": {"laser": None, "link__noise_power_W": 1e-9},
}


RARE = ("round trip", "out of reach", "wide, without footprints", "all at one point")
"""Cases that are drawn in `make soak` alone, as the others draw most of what they do."""


@pytest.fixture(scope="module")
def drawn(paper: optuav.Plan) -> plots.MapAxes:
    """The map of the plan for `paper`."""
    return plots.mission_map(paper)


@pytest.mark.parametrize(
    "values",
    [
        pytest.param(values, id=name, marks=[pytest.mark.soak] * (name in RARE))
        for name, values in ODD.items()
    ],
)
def test_odd_missions_are_drawn_without_texts_on_each_other(
    values: dict[str, Any], overlaps: Callable[[Figure], list[tuple[str, str]]]
) -> None:
    figure = plots.mission_map(optuav.solve(changed(**values), perspective="battery")).plan.figure
    assert overlaps(figure) == []


@pytest.mark.parametrize("picture", ["map", "trajectories"])
@pytest.mark.parametrize("name", ["paper", pytest.param("matrice350", marks=pytest.mark.soak)])
def test_shipped_missions_are_drawn_without_texts_on_each_other(
    name: str,
    picture: str,
    drawn: plots.MapAxes,
    overlaps: Callable[[Figure], list[tuple[str, str]]],
) -> None:
    if (picture, name) == ("map", "paper"):
        axes = drawn
    elif picture == "map":
        axes = plots.mission_map(optuav.solve(name, perspective="battery"))
    else:
        axes = plots.trajectories(
            {
                t: optuav.solve(name, optuav.P1(trajectory=t), perspective="battery")
                for t in TRAJECTORIES
            }
        )
    assert overlaps(axes.plan.figure) == []
    labels = [words for ax in axes for words in (ax.get_xlabel(), ax.get_ylabel())]
    assert all(words.partition("\n")[0].endswith("[m]") for words in labels)


def test_many_buildings_are_all_drawn_and_those_of_the_plan_are_named(
    overlaps: Callable[[Figure], list[tuple[str, str]]],
) -> None:
    """A mission names as many as find room, a plan those that it uses."""
    mission = changed(buildings=scattered(60), flight__through_buildings=True)
    plan = optuav.solve(mission, perspective="battery")
    axes = plots.mission_map(plan)
    assert overlaps(axes.plan.figure) == []
    footprints = axes.plan.collections[-1]
    assert len(footprints.get_paths()) == 60
    used = {*plan.route} - {"origin", "hover", "destination"}
    assert {name for name in names(axes) if name.startswith("house")} == used
    alone = names(plots.mission_map(mission))
    assert 0 < sum(words.startswith("house") for words in alone) < 60


def names(axes: plots.MapAxes) -> list[str]:
    """First lines of the words on a map."""
    return [text.get_text().splitlines()[0] for text in axes.plan.texts if text.get_text()]


def test_a_label_keeps_off_the_place_of_another() -> None:
    """Where it lies least on lines is the end of a route."""
    ax = style.page(3.0).subplots()
    ax.set(xlim=(0.0, 100.0), ylim=(0.0, 100.0))
    style.settle(ax)
    crowd = [[(0.0, y), (49.0, y)] for y in range(0, 100, 2)]
    crowd += [[(0.0, y), (100.0, y)] for y in [*range(0, 48, 2), *range(54, 100, 2)]]
    places = {"a place that has a name": (50.0, 50.0), "end": (60.0, 51.0)}
    labels = [style.Label(words, at) for words, at in places.items()]
    style.place(ax, labels, crowd)
    style.root(ax).draw_without_rendering()
    end = ax.transData.transform(labels[1].at)
    assert not Text.get_window_extent(ax.texts[0]).contains(*end)  # Without its leading line


def test_a_mission_alone_shows_the_direct_route(paper: optuav.Plan) -> None:
    axes = plots.mission_map(paper.mission)
    hover = vehicle.hover_point_m(paper.mission)
    assert [leg.get_xydata().tolist() for leg in legs(axes)] == [
        [[0.0, 0.0], list(hover[:2])],
        [list(hover[:2]), [2000.0, 0.0]],
    ]


def test_a_plan_that_does_not_exist_says_why() -> None:
    plan = optuav.solve(changed(link__noise_power_W=1.0), perspective="battery")
    axes = plots.mission_map(plan)
    legend = axes.plan.figure.axes[-1].get_legend()
    assert "infeasible" in axes.plan.get_title(loc="left")
    assert legend.get_title().get_text().replace("\n", " ") == plan.reasons[0]


def test_the_rim_of_the_disc_has_the_outage_that_is_allowed(
    paper: optuav.Plan, drawn: plots.MapAxes
) -> None:
    (disc,) = [each for each in drawn.plan.patches if isinstance(each, Circle)]
    assert disc.center == (1000.0, 3000.0)
    distance_m = math.hypot(disc.radius, 50.0)
    outage = link.outage_probability(vehicle.channel(paper.mission), distance_m)
    assert outage == pytest.approx(1e-2, rel=1e-9)


def test_a_rim_far_beyond_the_map_is_not_drawn_where_it_is() -> None:
    """A radius of 5e15 m would be drawn in pieces without end; the disc covers all of the map."""
    axes = plots.mission_map(changed(link__noise_power_W=1e-30)).plan
    (disc,) = [each for each in axes.patches if isinstance(each, Circle)]
    corners_m = np.array(np.meshgrid(axes.get_xlim(), axes.get_ylim())).reshape(2, 4).T
    farthest_m = np.hypot(*(corners_m - disc.center).T).max()
    assert farthest_m < disc.radius < 1e4 * farthest_m


def test_only_the_sight_line_through_the_wall_is_blocked() -> None:
    mission = changed(laser__position_m=[1000, 0, 5])
    buildings = [building.model_dump() for building in mission.buildings]
    axes = plots.mission_map(mission.replace({"buildings": [*buildings, WALL]}))
    lines = {
        tuple(each.get_color()[0][:3]): each.get_segments()
        for each in axes.plan.collections
        if isinstance(each, LineCollection)
    }
    blocked = lines.pop(to_rgba(LOOKS["muted"].light)[:3])
    assert [segment.tolist() for segment in blocked] == [[[1000.0, 0.0], [50.0, 300.0]]]
    (clear,) = lines.values()
    assert len(clear) == 11


def test_the_way_from_the_side_has_the_lengths_and_heights_of_the_route(
    drawn: plots.MapAxes,
) -> None:
    (way,) = [line for line in drawn.height.lines if len(line.get_xdata()) == 4]
    first, second = math.hypot(50.0, 300.0), math.hypot(950.0, 2501.0152 - 300.0)
    third = math.hypot(1000.0, 2501.0152)
    assert way.get_xdata() == pytest.approx(np.cumsum([0.0, first, second, third]), abs=1e-3)
    assert list(way.get_ydata()) == [50.0, 60.0, 50.0, 50.0]
    assert {patch.get_height() for patch in drawn.height.patches[:2]} == {60.0}
    assert min(patch.get_x() for patch in drawn.height.patches[:2]) < first


def test_each_thing_has_its_sign_and_no_other(drawn: plots.MapAxes) -> None:
    """Those of the drawn home page: a triangle, a dot in a dashed ring, a dot and a square."""
    marks = [line for line in drawn.plan.lines if line.get_linestyle() == "None"]
    at = {tuple(np.ravel(line.get_xydata()[0]).round(3)): line for line in marks}
    expected = {
        (1000.0, 0.0): ("^", "laser"),
        (1000.0, 3000.0): (signs.SIGNS["device"].marker, "hover"),
        (1000.0, 2501.015): ("o", "hover"),
        (50.0, 300.0): ("s", "rest"),
    }
    for place, (marker, role) in expected.items():
        assert at[place].get_marker() is marker
        assert to_rgba(at[place].get_markerfacecolor()) == to_rgba(LOOKS[role].light)


def test_stops_are_named_with_their_times(drawn: plots.MapAxes) -> None:
    written = [text.get_text() for text in drawn.plan.texts]
    assert "b1\nrest 392.1 s\nfrom 14.5 s" in written
    assert "hover point $\\mathbf{w}_U$\nhover 719.5 s\nfrom 442.6 s" in written


@pytest.fixture(scope="module")
def beside(paper: optuav.Plan) -> plots.MapAxes:
    """Several plans on a map: one that does not exist, and two of one route."""
    nothing = optuav.solve(paper.mission.replace({"limits.deadline_s": 10}), perspective="battery")
    return plots.trajectories({"direct": nothing, "mine": paper, "optimal": paper})


def test_laying_out_again_moves_nothing(beside: plots.MapAxes) -> None:
    """Labels stand where they were placed, whoever draws the figure afterwards."""
    before = [ax.get_position().bounds for ax in beside]
    beside.plan.figure.draw_without_rendering()
    after = np.ravel([ax.get_position().bounds for ax in beside])
    assert after == pytest.approx(np.ravel(before), abs=2e-3)


def test_identical_routes_lie_side_by_side(beside: plots.MapAxes) -> None:
    flown = legs(beside)
    assert len(flown) == 6
    seen = [leg.get_transform().transform(leg.get_xydata()) for leg in flown]
    for one, other in zip(seen[:3], seen[3:], strict=True):
        apart = other - one
        along = one[1] - one[0]
        assert np.hypot(*apart.T) == pytest.approx(2.0 * beside.plan.figure.dpi / 72.0)
        assert apart @ along == pytest.approx(0.0, abs=1e-6)
    assert flown[0].get_color() != flown[3].get_color()


def test_trajectories_that_do_not_exist_stand_in_the_legend(beside: plots.MapAxes) -> None:
    words = [text.get_text() for text in beside.plan.figure.axes[-1].get_legend().get_texts()]
    assert words[:2] == [
        "Direct path: no plan (infeasible)",
        "mine by b1: Δ = 719.5 s, $T'$ = 392.1 s",
    ]


def test_trajectories_of_different_places_are_refused(paper: optuav.Plan) -> None:
    elsewhere = optuav.solve(
        paper.mission.replace({"link.device_m": [1000, 2800, 0]}), perspective="battery"
    )
    with pytest.raises(InputError, match="same places"):
        plots.trajectories({"one": paper, "two": elsewhere})
    with pytest.raises(InputError, match="at least one plan"):
        plots.trajectories({})


def legs(axes: plots.MapAxes) -> list[Line2D]:
    """The lines of legs on a map; signs have none."""
    lines = [line for line in axes.plan.lines if line.get_linestyle() != "None"]
    return [line for line in lines if len(line.get_xdata()) == 2]


def segments(axes: plots.MapAxes) -> list[list[tuple[float, ...]]]:
    """The lines of sight that a map shows, end by end."""
    lines = [each for each in axes.plan.collections if isinstance(each, LineCollection)]
    return [[*map(tuple, one)] for each in lines for one in each.get_segments()]


@pytest.mark.parametrize("count", [60, pytest.param(1200, marks=pytest.mark.soak)])
def test_in_a_town_only_the_sight_of_the_plan_is_drawn(drawn: plots.MapAxes, count: int) -> None:
    """The laser's lines to where the plan stays, in a town of any size; among ten houses all."""
    assert len(segments(drawn)) == 11
    mission = changed(buildings=scattered(count), flight__through_buildings=True)
    plan = optuav.solve(mission, perspective="battery")
    assert {stop.kind for stop in plan.stops} == {"hover", "rest"}
    axes = plots.mission_map(plan)
    roofs_m = {each.name: [*each.position_m[:2]] for each in mission.buildings}
    hover_m = [float(each) for each in vehicle.hover_point_m(mission)[:2]]
    at_m = [hover_m if stop.at == "hover" else roofs_m[stop.at] for stop in plan.stops]
    expected = [[(1000.0, 0.0), tuple(each)] for each in at_m]
    assert sorted(segments(axes)) == sorted(expected)


@pytest.mark.parametrize("seed", range(3))
def test_no_line_to_a_label_crosses_another_label(seed: int) -> None:
    """Where lines of a crowd leave labels no room beside their points."""
    ax, draw = style.page(4.0).subplots(), np.random.default_rng(seed)
    ax.set(xlim=(0.0, 100.0), ylim=(0.0, 100.0))
    style.settle(ax)
    crowd = [[(20.0, y), (80.0, y)] for y in range(20, 80, 2)]
    places = draw.uniform(30.0, 70.0, (5, 2)).tolist()
    labels = [
        style.Label(f"a place {k}\nof which much is said", tuple(at)) for k, at in enumerate(places)
    ]
    style.place(ax, labels, crowd)
    style.root(ax).draw_without_rendering()
    boxes = [Text.get_window_extent(text) for text in ax.texts]
    crossed = 0
    for number, text in enumerate(ax.texts):
        anchor, box = ax.transData.transform(text.xy), boxes[number]
        line = np.linspace(anchor, [(box.x0 + box.x1) / 2, (box.y0 + box.y1) / 2], 500)
        others = [each for k, each in enumerate(boxes) if k != number and text.arrow_patch]
        crossed += sum(any(each.contains(*dot) for dot in line) for each in others)
    assert crossed == 0


def test_an_animation_shows_a_point_that_has_no_name() -> None:
    """A hover point of an itinerary is drawn and named by where it is."""
    stop = optuav.judge.Stop((900.0, 2600.0, 60.0), "hover", 30.0)
    replayed = optuav.replay(optuav.Itinerary(optuav.load("paper"), (stop,)))
    figure, _ = still(replayed)
    written = [text.get_text().partition("\n")[0] for text in figure.axes[0].texts]
    assert "(900, 2600, 60)" in written
