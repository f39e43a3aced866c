"""Pictures of several devices: each has its disc, name and hover, and none hides another."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from matplotlib.collections import LineCollection
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from matplotlib.text import Annotation, Text
from matplotlib.transforms import Bbox
from PIL import Image

import optuav
from optuav import plots
from optuav.plots import style
from optuav.plots.animation import _still as still
from optuav.plots.animation import frames
from optuav.plots.style import GREEN, applied
from tests.several_devices import (
    CLOSE,
    EIGHT,
    THREE,
    plan_over_close,
    plan_over_eight,
    plan_over_three,
)

Overlaps = Callable[[Figure], list[tuple[str, str]]]
CASES = [
    pytest.param(plan_over_three, THREE, id="three"),
    pytest.param(plan_over_eight, EIGHT, id="eight"),
]


@pytest.mark.parametrize(("make", "devices"), CASES)
@pytest.mark.parametrize("planned", [True, False])
def test_the_map_has_every_device_with_its_disc_and_name(
    make: Callable[[], optuav.Plan],
    devices: dict[str, tuple[int, int, int]],
    planned: bool,
    overlaps: Overlaps,
) -> None:
    """Discs lie around the devices, of one radius as all hover at 50 m; one entry names them."""
    plan = make()
    axes = plots.mission_map(plan if planned else plan.mission)
    figure = axes.plan.figure
    assert isinstance(figure, Figure)
    discs = [each for each in axes.plan.get_children() if isinstance(each, Circle)]
    assert [disc.center for disc in discs] == [at_m[:2] for at_m in devices.values()]
    assert len({round(disc.radius, 9) for disc in discs}) == 1
    (signs,) = [line for line in axes.plan.lines if line.get_label() == "ground devices"]
    assert signs.get_xydata().tolist() == [[*at_m[:2]] for at_m in devices.values()]
    written = [text.get_text().splitlines()[0] for text in axes.plan.texts if text.get_text()]
    assert {*devices} <= {*written}
    legend = [ax.get_legend() for ax in figure.axes if ax.get_legend()]
    entries = [text.get_text() for text in legend[0].get_texts()]
    assert entries.count("coverage at the hover altitude") == 1
    assert overlaps(figure) == []


def test_a_line_joins_each_device_to_the_point_where_it_is_served() -> None:
    """By the check numbers of w_U, and by no line in a mission with one device."""
    points_m = {"west": (496.2356, 2110.3833), "north": (1000, 2501.0152)}
    points_m["east"] = (1582.3933, 1915.0727)

    def joined(subject: optuav.Plan) -> list[Any]:
        drawn = plots.mission_map(subject).plan.collections
        lines = [each for each in drawn if isinstance(each, LineCollection)]
        green = [each for each in lines if GREEN in map(_hex, each.get_colors())]
        return [line for each in green for line in each.get_segments()]

    lines = joined(plan_over_three())
    assert len(lines) == len(THREE)
    for (device_m, hover_m), name in zip(lines, THREE, strict=True):
        assert tuple(device_m) == THREE[name][:2]
        assert tuple(hover_m) == pytest.approx(points_m[name], abs=1e-4)
    assert joined(optuav.solve("paper", "P3")) == []


def _hex(colour: Any) -> str:
    return to_hex(colour).upper()


def test_the_hovers_stand_at_their_devices_where_there_are_few() -> None:
    """A third of Δ over each, from when its leg ends; of eight devices only their names."""
    plan = plan_over_three()
    labels = [text.get_text() for text in plots.mission_map(plan).plan.texts]
    third_s = 647.331326 / 3
    for stop in (stop for stop in plan.stops if stop.kind == "hover"):
        words = f"{stop.at}\nhover {third_s:.1f} s\nfrom {stop.start_s:.1f} s"
        assert words in labels
    of_eight = [text.get_text() for text in plots.mission_map(plan_over_eight()).plan.texts]
    assert {*EIGHT} <= {*of_eight}


@pytest.mark.parametrize(("make", "devices"), CASES)
@pytest.mark.parametrize("picture", ["wells", "profile", "animation"])
def test_every_hover_has_a_band_that_names_its_device(
    picture: str,
    make: Callable[[], optuav.Plan],
    devices: dict[str, tuple[int, int, int]],
    overlaps: Overlaps,
) -> None:
    """Each name is written once, over the time of its hover, however narrow the bands are."""
    plan = make()
    if picture == "animation":
        with applied():
            axes = still(optuav.replay(plan))[0].axes[1]
    else:
        axes = plots.wells(plan)[0] if picture == "wells" else plots.profile(plan).altitude
    figure = axes.figure
    assert isinstance(figure, Figure)
    named = {text.get_text().removeprefix("hover, "): text for text in _annotations(axes)}
    for stop in (stop for stop in plan.stops if stop.kind == "hover"):
        time_s, _ = named.pop(str(stop.at)).xy
        assert stop.start_s < time_s < stop.start_s + stop.duration_s
    assert not {*devices} & {*named}
    assert overlaps(figure) == []


@pytest.mark.parametrize(
    ("make", "devices"), [*CASES, pytest.param(plan_over_close, CLOSE, id="close")]
)
def test_altitudes_have_every_name_at_its_own_dot(
    make: Callable[[], optuav.Plan], devices: dict[str, tuple[int, int, int]]
) -> None:
    """By the distance flown to it; a name without a line to its dot is nearer to it than to others.

    Upright names stand in the order of the hovers.
    """
    plan = make()
    points = {phase.end.name: phase.end.position_m for phase in optuav.replay(plan).phases}
    points["origin"] = plan.mission.route.origin_m
    on_the_way = [points[name] for name in plan.route]
    steps_m = [math.dist(a[:2], b[:2]) for a, b in itertools.pairwise(on_the_way)]
    along_m = dict(zip(plan.route, itertools.accumulate(steps_m, initial=0.0), strict=True))
    ax = plots.mission_map(plan).height
    ax.figure.draw_without_rendering()
    dots = {name: (along_m[name], points[name][2]) for name in plan.route[1:-1]}
    named = {text.get_text(): text for text in _annotations(ax)}
    assert {*dots} <= {*named}
    for name, dot in dots.items():
        assert named[name].xy == pytest.approx(dot, abs=1e-6)
        if named[name].arrow_patch is None:
            box = Text.get_window_extent(named[name])
            away = {other: _distance(box, ax.transData.transform(at)) for other, at in dots.items()}
            assert min(away, key=away.__getitem__) == name
    upright = [named[name] for name in plan.route[1:-1] if named[name].get_rotation() == 90.0]
    assert bool(upright) == (len(devices) > 4)
    at_px = [Text.get_window_extent(text).x0 for text in upright]
    assert at_px == sorted(at_px)


@pytest.mark.parametrize(("make", "devices"), CASES)
def test_the_map_is_not_much_higher_than_its_discs_and_places(
    make: Callable[[], optuav.Plan], devices: dict[str, tuple[int, int, int]]
) -> None:
    """Both ends are at y = 0 m, and the northernmost disc ends 500 m north of its device."""
    low_m, high_m = plots.mission_map(make()).plan.get_ylim()
    north_m = max(at_m[1] for at_m in devices.values()) + math.sqrt(501.484**2 - 50.0**2)
    assert low_m < 0.0 < north_m < high_m
    assert high_m - low_m < 1.25 * north_m


def test_upright_names_keep_their_order_and_distance_and_are_left_out_as_a_whole() -> None:
    """Points that lie together push their names apart, at both ends of the axes too."""
    figure = Figure((4.0, 2.0), dpi=72)
    ax = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    ax.set(xlim=(0.0, 288.0), ylim=(0.0, 1.0))
    for points in ([0.0, 1.0, 2.0, 150.0, 287.0, 288.0], [144.0] * 33):
        at = np.array([(x, 0.5) for x in points])
        texts = style.upright(ax, [f"n{k}" for k in range(len(at))], at, ax.transData, 9.0)
        assert [text.xy for text in texts] == [tuple(point) for point in at.tolist()]
        steps = np.diff([point[0] + text.xyann[0] for point, text in zip(at, texts, strict=True)])
        assert steps.min() > 9.0 - 1e-9
    free = style.upright(ax, ["a", "b"], np.array([(50.0, 0.5), (60.0, 0.5)]), ax.transData, 9.0)
    assert [text.xyann for text in free] == [(0.0, 9.0)] * 2
    at = np.full((34, 2), 0.5)
    assert style.upright(ax, [f"n{k}" for k in range(34)], at, ax.transData, 9.0) == []


def _annotations(ax: Any) -> list[Annotation]:
    return [text for text in ax.texts if isinstance(text, Annotation)]


def _distance(box: Bbox, point: tuple[float, float]) -> float:
    """Distance of a point from a box [px]."""
    x, y = np.clip(point, box.min, box.max)
    return math.dist((x, y), point)


def test_the_animation_tells_over_which_device_the_drone_hovers() -> None:
    """The frame in a hover over one device differs from that over the next by its title too."""
    replayed = optuav.replay(plan_over_three())
    hovers = [phase for phase in replayed.phases if phase.kind == "hover"]
    moments_s = [phase.start_s + 1.0 for phase in hovers]
    images = [*frames(replayed, moments_s)][: len(hovers)]
    heads = [image.crop((0, 0, image.width // 2, 30)) for image in images]
    inks = [(np.asarray(head.convert("L")) < 128).sum() for head in heads]
    assert min(inks) > 0
    assert len({head.tobytes() for head in heads}) == len(hovers)
    assert all(isinstance(image, Image.Image) for image in images)


def test_one_picture_has_plans_over_the_same_devices_only() -> None:
    plan = plan_over_three()
    moved = plan.mission.replace({"devices.west.position_m": [420, 2600, 0]})
    other = optuav.solve(moved, "P3")
    plots.trajectories({"best": plan, "direct": optuav.solve(plan.mission, "P3")})
    with pytest.raises(optuav.InputError, match="have the same places"):
        plots.trajectories({"best": plan, "moved": other})


def test_a_hover_map_names_the_devices_and_the_one_that_moves() -> None:
    mission = plan_over_three().mission
    found = optuav.maps.device(mission, 500, device="west", bounds=(0, 2000, 500, 3000))
    ax = plots.hover_map(mission, found)
    assert "device west anywhere at z = 0 m" in ax.get_title(loc="left")
    assert [text.get_text() for text in ax.texts if text.get_text() in THREE] == ["west"]
