"""The tornado, and how hover times are spread."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

import optuav
from optuav.plots import uncertainty


def swing(
    key: str, low_s: float | None, high_s: float | None, own_s: float = 100.0
) -> dict[str, Any]:
    """A row of the sensitivity table, of a mission that hovers so long itself."""
    largest_s = max(abs((end_s or 0.0) - own_s) for end_s in (low_s, high_s))
    ends = {"low": 0.9, "high": 1.1, "hover_low_s": low_s, "hover_high_s": high_s, "unit": "-"}
    return {"key": key, **ends, "swing_s": largest_s}


def test_bars_reach_from_the_hover_time_to_the_ends() -> None:
    """One to either side a key, the largest at the top; a lost plan reaches the edge."""
    shown = [
        swing("a.big", 80.0, 125.0),
        swing("b.lost", None, 101.0),
        swing("c.none", 100.0, 100.0),
    ]
    ax = uncertainty.tornado(shown, 100.0, "mine")
    assert [label.get_text() for label in ax.get_yticklabels()] == ["a big [-]", "b lost [-]"]
    bars = [bar for bar in ax.patches if bar.get_width()]
    ends = sorted(bar.get_x() + bar.get_width() for bar in bars)
    assert ends[0] < ax.get_xlim()[0]
    assert ends[1:] == pytest.approx([80.0, 101.0, 125.0])
    assert {bar.get_x() for bar in bars} == {100.0}


def test_ends_on_the_same_side_share_their_words() -> None:
    """As where a device moves out of the way to either side; the shorter bar stays to be seen."""
    ax = uncertainty.tornado([swing("a.key", 103.0, 110.0)], 100.0, "mine")
    assert [text.get_text() for text in ax.texts] == ["0.9 and 1.1"]
    drawn = sorted(ax.patches, key=lambda bar: bar.get_zorder())
    assert [bar.get_width() for bar in drawn if bar.get_width()] == [10.0, 3.0]


def test_many_keys_are_cut_and_counted() -> None:
    shown = [swing(f"table.key{k}", 100.0 - 1.0 / (k + 1), 101.0) for k in range(30)]
    ax = uncertainty.tornado(shown, 100.0, "mine")
    assert len(ax.get_yticklabels()) == 20
    assert "10 more keys" in ax.get_xlabel()


def test_a_mission_that_nothing_moves_can_be_drawn() -> None:
    assert uncertainty.tornado([], 100.0, "mine").get_yticklabels() == []
    assert uncertainty.tornado([swing("a.key", None, None, 0.0)], 0.0, "mine") is not None


def test_hover_times_are_shares_of_all_samples() -> None:
    """Also of those without a plan, which are a bar of their own, left of all others."""
    times_s = np.concatenate([np.linspace(100.0, 200.0, 75), np.zeros(25)])
    ax = uncertainty.hover_times(times_s, "mine", fixed_s=150.0)
    assert sum(bar.get_height() for bar in ax.patches[:60]) == pytest.approx(75.0)
    none = ax.patches[60]
    assert none.get_height() == pytest.approx(25.0)
    assert none.get_x() + none.get_width() < 100.0
    assert [text.get_text() for text in ax.texts] == ["25 %\nno plan"]
    assert min(ax.get_xticks()) >= 100.0  # No number beside the bar of no plan
    assert ax.get_title(loc="left") == "mine: longest hover in 100 samples"
    assert uncertainty.hover_times(np.zeros(5), "mine") is not None
    assert uncertainty.hover_times(np.full(5, 3.0), "mine") is not None


def test_long_words_at_the_longest_bars_have_room(
    overlaps: Callable[[Figure], list[tuple[str, str]]],
) -> None:
    """Between the bars and the keys on the left, and the edge of the page on the right."""
    ends = {"low": -1.235e-5, "high": 23285.0}
    rows = [swing("a.long_key", 103.0, 110.0) | ends, swing("b.long_key", 90.0, 97.0) | ends]
    figure = uncertainty.tornado([*rows, swing("c.lost", None, 100.0)], 100.0, "mine").figure
    assert isinstance(figure, Figure)
    assert overlaps(figure) == []


@pytest.mark.parametrize("found", ["made up", pytest.param("matrice350", marks=pytest.mark.soak)])
def test_no_text_lies_on_another(
    found: str, overlaps: Callable[[Figure], list[tuple[str, str]]]
) -> None:
    if found == "made up":
        sizes = np.geomspace(60.0, 0.01, 24).tolist()
        rows = [
            swing(f"rotor.drag_coefficient_Nm_s2_rad{k}", 597 - s, 597 + s, 597.0)
            for k, s in enumerate(sizes)
        ]
        rows = [swing("link.device_m[1]", None, 590.0, 597.0), *rows]
    else:
        rows = [dict(row) for row in optuav.sensitivity(found, {}).rows]
    times_s = 597.0 * np.random.default_rng(1).normal(1.0, 0.2, 500).clip(min=0.0)
    for ax in (
        uncertainty.tornado(rows, 597.0, "paper"),
        uncertainty.hover_times(times_s, "paper", fixed_s=540.0),
    ):
        figure = ax.get_figure(root=True)
        assert figure is not None
        assert overlaps(figure) == []
