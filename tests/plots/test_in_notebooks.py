"""Pictures show themselves, and are drawn into the axes and figures of others."""

from __future__ import annotations

import inspect
import struct
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure

import optuav
from optuav import plots
from optuav.calibration import FlightLog, Panel
from optuav.plots.style import Page

PNG = b"\x89PNG\r\n\x1a\n"
TEXTS = {"title": "t", "x_label": "x [s]", "y_label": "y [s]"}


@cache
def plan() -> optuav.Plan:
    return optuav.solve("paper")


@cache
def batched() -> Any:
    return optuav.batch("paper", {"limits.deadline_s": [600, 900]})


def a_plane(**where: Any) -> Any:
    model = optuav.formulate("paper", optuav.P4("b1", order="rest-first")).parts[0].model
    return plots.plane(model, model.row(0), slot_s=50.0, **where)


def a_siting() -> optuav.Siting:
    return optuav.place_laser("paper", [[1000, 0, 50], [1000, 2000, 50]], refine=False)


def a_fit() -> optuav.Fit:
    panel = Panel("lifetime", "s", (100.0, 120.0), (101.0, 118.0), names=("1 A", "2 A"))
    return optuav.Fit("kibam", ("cell.csv",), "2 loads", (), (panel,))


@cache
def a_log() -> FlightLog:
    rows = [f"{100 * n},{-18},{22.2},{0},{90}" for n in range(200)]
    heads = "time(millisecond),current(A),voltage(v),speed(mph),battery_percent"
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "flight.csv"
        file.write_text("\n".join([heads, *rows]), "utf-8")
        return optuav.fit_regimes(file).logs[0]


def a_batch() -> Any:
    return optuav.batch("paper", {"limits.deadline_s": [300.0, 600.0, 900.0, 1200.0]})


def by_turns() -> optuav.Plan:
    mission = optuav.load("paper").replace({"battery.schedule": "sequential"})
    return optuav.solve(mission, "P3", slot_s=50.0)


ONE_PANEL: dict[str, Callable[..., Any]] = {
    "bars": lambda **ax: plots.bars([plots.Bar("a", "", 1.0)], title="t", y_label="y", **ax),
    "curves": lambda **ax: plots.curves([plots.Line("a", [0, 1], [0, 1])], **TEXTS, **ax),
    "fleet_turns": lambda **ax: plots.fleet_turns(
        [plots.Turn(0.0, 80.0, 900.0, 800.0, 20.0)], title="t", **ax
    ),
    "hover_map": lambda **ax: plots.hover_map("paper", optuav.maps.laser("paper", 1000), **ax),
    "plane": a_plane,
    "sites": lambda **ax: plots.sites(a_siting(), **ax),
    "swept": lambda **ax: plots.swept(batched(), **ax)[0][1],
}
SEVERAL_PANELS: dict[str, Callable[..., Any]] = {
    "distribution": lambda **figure: plots.distribution(a_batch(), "hover_time_s", **figure),
    "fit": lambda **figure: plots.fit(a_fit(), **figure),
    "flight_log": lambda **figure: plots.flight_log(a_log(), **figure),
    "leg": lambda **figure: plots.leg(optuav.load("paper"), "origin", "b1", **figure),
    "mission_map": lambda **figure: plots.mission_map(plan(), **figure),
    "packs": lambda **figure: plots.packs([by_turns()], **figure),
    "profile": lambda **figure: plots.profile(optuav.replay(plan()), **figure),
    "trajectories": lambda **figure: plots.trajectories({"optimal": plan()}, **figure),
    "wells": lambda **figure: plots.wells([plan()], **figure),
}
EVERY = ONE_PANEL | SEVERAL_PANELS


def axes_of(drawn: Any) -> list[Axes]:
    """All axes that a function returns."""
    if isinstance(drawn, Axes):
        return [drawn]
    return [each for some in drawn if some is not None for each in axes_of(some)]


def test_no_picture_is_missing_here() -> None:
    """A function that takes axes or a figure, or returns axes, is in one of the tables."""
    functions = {n: f for n in plots.__all__ if inspect.isfunction(f := getattr(plots, n))}
    drawing = {name for name in functions if not name.startswith("save")}
    assert drawing == EVERY.keys()
    for name in EVERY:
        takes = inspect.signature(functions[name]).parameters
        assert ("ax" if name in ONE_PANEL else "figure") in takes


@cache
def alone(name: str) -> Any:
    """A picture on its own page."""
    return EVERY[name]()


@pytest.mark.parametrize("name", EVERY)
def test_a_picture_shows_itself(name: str) -> None:
    """What is returned, its single axes and the figure."""
    first = axes_of(alone(name))[0]
    assert isinstance(first.figure, Page)
    assert all(hasattr(each, "_repr_png_") for each in (alone(name), first, first.figure))


@pytest.mark.parametrize("name", ["bars", "wells"])
def test_a_picture_is_shown_as_a_sharp_png(name: str) -> None:
    """Of twice the width at which it is shown; the same for its axes and its figure."""
    content, shown = alone(name)._repr_png_()
    assert content.startswith(PNG)
    width, _ = struct.unpack(">II", content[16:24])
    assert abs(width - 2 * shown["width"]) <= 1
    first = axes_of(alone(name))[0]
    assert first._repr_png_() == first.figure._repr_png_()  # type: ignore[attr-defined, union-attr]


@pytest.mark.parametrize("name", ONE_PANEL)
def test_one_panel_is_drawn_on_given_axes(name: str) -> None:
    """On those alone, with the same words, and shown with their own figure only."""
    figure = Figure(layout="constrained")
    left, right = figure.subplots(1, 2)
    drawn = ONE_PANEL[name](ax=right)
    assert drawn is right
    assert not left.has_data()
    assert figure.legends == []
    own = alone(name)
    assert (drawn.get_xlabel(), drawn.get_ylabel()) == (own.get_xlabel(), own.get_ylabel())
    assert not hasattr(drawn, "_repr_png_")
    figure.draw_without_rendering()


@pytest.mark.parametrize(
    ("name", "within"), [("profile", False), *((name, True) for name in SEVERAL_PANELS)]
)
def test_several_panels_are_drawn_into_a_given_figure(name: str, within: bool) -> None:
    """Into that alone; the figure keeps its size and shows itself, not its axes."""
    figure = Figure(figsize=(9.0, 6.0), layout="constrained")
    into: Figure | SubFigure = figure
    if within:
        into, other = figure.subfigures(2, 1)
    drawn = SEVERAL_PANELS[name](figure=into)
    assert {each.get_figure() for each in axes_of(drawn)} == {into}
    assert drawn._repr_png_() is None
    assert tuple(figure.get_size_inches()) == (9.0, 6.0)
    assert not within or other.legends == []
    titles = [each.get_title(loc="left") for each in axes_of(drawn)]
    assert titles == [each.get_title(loc="left") for each in axes_of(alone(name))]
    figure.draw_without_rendering()


def test_pictures_by_name_show_themselves() -> None:
    """Of a sweep and of a comparison, each with words for readers who do not see it."""
    for found, words in (
        (
            plots.swept(batched()),
            "paper: longest hover by deadline, perspective available; longest hover Δ [s]",
        ),
        (
            optuav.compare("paper", by="trajectory").plot(),
            "paper: longest hover by trajectory and perspective; hover time Δ [s]",
        ),
    ):
        page = found._repr_html_()
        assert page.count("<img ") == 1
        assert f'alt="{words}"' in page
        assert "data:image/png;base64,iVBORw0KGgo" in page
