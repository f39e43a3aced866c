"""Bars show their numbers, with no text on another."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

pytest.importorskip("matplotlib")
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from optuav import plots
from optuav.errors import InputError
from optuav.plots import Bar, Mark

Overlaps = Callable[[Figure], list[tuple[str, str]]]


def chart(shown: list[Bar], level: Mark | None = None) -> Axes:
    return plots.bars(shown, title="paper", y_label="Δ [s]", level=level)


def test_bars_are_as_high_as_their_numbers() -> None:
    values = {("direct", "battery"): 688.848, ("direct", "energy"): 524.628}
    values |= {("traj1", "battery"): None, ("traj1", "energy"): -10.0}
    ax = chart([Bar(*names, value) for names, value in values.items()])
    assert [bar.get_height() for bar in ax.patches] == [688.848, 524.628, 0.0, -10.0]
    words = [text.get_text() for text in ax.texts]
    assert words == ["688.8", "524.6", "no\nplan", "−10.0"]
    assert ax.get_ylim()[0] < -10.0
    colours = [bar.get_facecolor() for bar in ax.patches]
    assert colours[0] == colours[2] != colours[1] == colours[3]
    names = [label.get_text() for label in ax.get_xticklabels()]
    assert names == ["direct", "traj1"]  # below every group its name, not its number


def test_bars_of_another_name_are_refused() -> None:
    """With the names that there are, and the nearest of them."""
    with pytest.raises(InputError, match=r"name = 'batery': must be one of battery, .*battery"):
        plots.bars([Bar("a", "batery", 1.0)], title="t", y_label="Δ [s]")


def test_bars_of_plans_that_cannot_be_flown_are_hatched(overlaps: Overlaps) -> None:
    """With an entry in the legend, which bars that need no other have for this alone."""
    shown = [Bar("battery", "direct", 688.8, False), Bar("available", "direct", 577.5)]
    charts = [
        chart(shown),
        chart(shown, Mark(60.0, "least")),
        chart([each._replace(name="") for each in shown]),
    ]
    for ax in charts:
        assert [bool(bar.get_hatch()) for bar in ax.patches] == [True, False]
        assert ax.get_legend().get_texts()[-1].get_text() == "cannot be flown"
        assert overlaps(ax.figure) == []
    assert chart([Bar("a", "", 2.0)]).get_legend() is None


@pytest.mark.parametrize("perspectives", [("battery",), ("battery", "energy", "adjusted")])
@pytest.mark.parametrize("trajectories", [("optimal",), ("direct", "traj1", "traj2", "optimal")])
def test_bars_have_no_text_on_text(
    perspectives: tuple[str, ...], trajectories: tuple[str, ...], overlaps: Overlaps
) -> None:
    shown = [Bar(t, p, 12345.678) for t in trajectories for p in perspectives]
    assert overlaps(chart(shown, Mark(5.0, "least, $η_0$")).figure) == []


@pytest.mark.parametrize("min_soc", [0.0, 0.6])
def test_where_there_is_no_plan_the_words_lie_on_nothing(
    min_soc: float, overlaps: Overlaps
) -> None:
    """Four in a group, each by itself, and above the line of η0."""
    perspectives = ("battery", "energy", "adjusted", "available")
    values = {"direct": 88.6, "traj1": None, "traj2": None, "optimal": 88.6}
    shown = [Bar(name, p, value) for name, value in values.items() for p in perspectives]
    charge = chart(shown, Mark(100.0 * min_soc, "least, $η_0$"))
    assert overlaps(charge.figure) == []
    line_px = charge.transData.transform((0.0, 100.0 * min_soc))[1]
    none = [text for text in charge.texts if text.get_text() == "no\nplan"]
    assert len(none) == 8
    assert all(text.get_window_extent().y0 > line_px for text in none)


def test_files_are_the_same_bytes(tmp_path: Path) -> None:
    ax = chart([Bar("battery", "direct", 688.8, False)])
    first, second = (plots.save(ax, tmp_path / name) for name in ("a.png", "b.png"))
    assert first.read_bytes() == second.read_bytes()


def test_curves_without_a_finite_value_and_of_no_known_well_are_refused() -> None:
    line = plots.Line("lost", [0.0, 1.0], [float("nan"), float("inf")])
    with pytest.raises(InputError, match="nothing to draw"):
        plots.curves([line], title="", x_label="", y_label="")
    with pytest.raises(InputError, match="well = 'bund': must be one of available, bound"):
        plots.curves([line._replace(well="bund")], title="", x_label="", y_label="")


def test_lines_that_lie_on_each_other_are_told_apart() -> None:
    """By widths where they share a stretch, and in words where one lies wholly on another."""
    x = [0.0, 1.0, 2.0, 3.0]
    shown = [
        plots.Line("all", x, [0.0, 1.0, 2.0, 3.0]),
        plots.Line("same", x, [0.0, 1.0, 2.0, 3.0]),
        plots.Line("begins alike", x, [0.0, 1.0, 1.0, 1.0]),
    ]
    drawn = plots.curves(shown, title="t", x_label="x", y_label="y").lines
    widths = [line.get_linewidth() for line in drawn]
    assert widths == sorted(widths, reverse=True)
    assert len({*widths}) == 3
    assert [line.get_label() for line in drawn] == ["all", "same, as all", "begins alike"]
    apart = [shown[0], plots.Line("crosses", x, [3.0, 2.0, 1.0, 0.0])]
    drawn = plots.curves(apart, title="t", x_label="x", y_label="y").lines
    assert len({line.get_linewidth() for line in drawn}) == 1
