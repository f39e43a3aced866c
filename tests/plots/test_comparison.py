"""Gaps and bars show their numbers, with no text on another."""

from __future__ import annotations

from collections.abc import Callable

import pytest

pytest.importorskip("matplotlib")
from matplotlib.figure import Figure

from optuav import plots

Overlaps = Callable[[Figure], list[tuple[str, str]]]


def test_bars_are_as_high_as_their_numbers() -> None:
    shown = [
        plots.Bar("battery", "direct", 688.848, 0.05),
        plots.Bar("energy", "direct", 524.628, 0.2505),
        plots.Bar("battery", "traj1", None, None),
        plots.Bar("energy", "traj1", 554.057, -0.1),
    ]
    axes = plots.choice_bars(shown, "paper", 0.05)
    assert [bar.get_height() for bar in axes.hover.patches] == [688.848, 524.628, 0.0, 554.057]
    assert [bar.get_height() for bar in axes.charge.patches] == [5.0, 25.05, 0.0, -10.0]
    words = [text.get_text() for text in axes.hover.texts]
    assert words == ["688.8", "524.6", "no\nplan", "554.1"]
    assert axes.charge.texts[-1].get_text() == "−10.0"
    assert axes.charge.get_ylim()[0] < -10.0
    colours = [bar.get_facecolor() for bar in axes.hover.patches]
    assert colours[0] == colours[2] != colours[1] == colours[3]
    assert axes.hover.get_ylabel() == "hover time Δ [s]"
    names = [label.get_text() for label in axes.charge.get_xticklabels()]
    assert names == ["direct", "traj1"]  # below every group its name, not its number


def test_bars_of_plans_that_cannot_be_flown_are_hatched(overlaps: Overlaps) -> None:
    """In all three charts of bars, with an entry in the legend."""
    shown = [
        plots.Bar("battery", "direct", 688.8, 0.05, False),
        plots.Bar("available", "direct", 577.5, 0.18),
    ]
    charts = [
        plots.choice_bars(shown, "paper", 0.05).hover,
        plots.hover_bars(shown, "paper"),
        plots.charge_bars(shown, "paper", 0.05),
        plots.bars({"a": 2.0, "b": 1.0}, title="t", y_label="y", hatched=["a"]),
    ]
    for ax in charts:
        assert [bool(bar.get_hatch()) for bar in ax.patches] == [True, False]
        assert ax.get_legend().get_texts()[-1].get_text() == "cannot be flown"
        assert overlaps(ax.figure) == []
    flown = plots.bars({"a": 2.0}, title="t", y_label="y")
    assert flown.get_legend() is None


@pytest.mark.parametrize("slots_s", [(1.0,), (0.001, 1e7), tuple(map(float, range(1, 13)))])
def test_gaps_have_no_text_on_text(slots_s: tuple[float, ...], overlaps: Overlaps) -> None:
    shown = [
        plots.Gap(kind, slot_s, share * slot_s, largest * slot_s if largest else None)
        for slot_s in slots_s
        for kind, share, largest in (("P1", 1.3, 2), ("P3", 0.0, 1), ("P4 rest-first", 7.5, None))
    ]
    ax = plots.slot_gaps(shown, "a mission $with$ a very long name indeed")
    assert overlaps(ax.figure) == []


@pytest.mark.parametrize("perspectives", [("battery",), ("battery", "energy", "adjusted")])
@pytest.mark.parametrize("trajectories", [("optimal",), ("direct", "traj1", "traj2", "optimal")])
def test_bars_have_no_text_on_text(
    perspectives: tuple[str, ...], trajectories: tuple[str, ...], overlaps: Overlaps
) -> None:
    shown = [plots.Bar(p, t, 12345.678, 1.0) for t in trajectories for p in perspectives]
    assert overlaps(plots.choice_bars(shown, "paper", 0.05).hover.figure) == []


@pytest.mark.parametrize("min_soc", [0.0, 0.05, 0.6])
def test_where_there_is_no_plan_the_words_lie_on_nothing(
    min_soc: float, overlaps: Overlaps
) -> None:
    """Four in a group, each by itself, and above the line of η0."""
    perspectives = ("battery", "energy", "adjusted", "available")
    shown = [plots.Bar(p, "direct", 4.2, 0.886) for p in perspectives]
    shown += [plots.Bar(p, t, None, None) for t in ("traj1", "traj2") for p in perspectives]
    shown += [plots.Bar(p, "optimal", 4.2, 0.886) for p in perspectives]
    axes = plots.choice_bars(shown, "paper", min_soc)
    figure = axes.charge.figure
    assert overlaps(figure) == []
    line_px = axes.charge.transData.transform((0.0, 100.0 * min_soc))[1]
    none = [text for text in axes.charge.texts if text.get_text() == "no\nplan"]
    assert len(none) == 8
    assert all(text.get_window_extent().y0 > line_px for text in none)
