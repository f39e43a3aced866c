"""Distributions: shares of all scenarios, with those without a plan said apart."""

from __future__ import annotations

import numpy as np
import pytest

import optuav
from optuav import plots
from optuav.errors import InputError
from optuav.plots.charts import DASHES, LINES

DEADLINES = {"limits.deadline_s": [10.0, 20.0, 600.0, 900.0, 1200.0]}


def test_shares_are_those_of_all_scenarios() -> None:
    """Counted by hand: two of five have no plan: a bar, and where the curve begins."""
    found = optuav.batch("paper", DEADLINES)
    histogram, cumulative = plots.distribution(found)
    bars, none = histogram.patches
    assert bars.get_data().values.sum() == pytest.approx(60.0)
    assert none.get_height() == pytest.approx(40.0)
    assert none.get_x() + none.get_width() < bars.get_data().edges[0]
    (curve,) = cumulative.lines
    assert curve.get_ydata()[0] == pytest.approx(40.0)
    hover_s = found.hover_time_s.values[2:]
    for place, share in zip(np.sort(hover_s), (60.0, 80.0, 100.0), strict=True):
        assert np.max(curve.get_ydata()[curve.get_xdata() <= place]) == pytest.approx(share)
    (words,) = histogram.get_legend().get_texts()
    assert words.get_text() == "available: no plan in 2 of 5"
    assert cumulative.get_xlabel().endswith("[s]")


def test_every_perspective_is_told_by_more_than_its_colour() -> None:
    """By dashes too, and by its width where one line lies on another."""
    named = ["battery", "adjusted", "available"]
    found = optuav.batch("paper", DEADLINES, perspective=named)
    _, cumulative = plots.distribution(found, "mission_time_s")
    lines = cumulative.lines
    assert [each.get_label().partition(":")[0] for each in lines] == named
    assert [each.get_color() for each in lines] == list(LINES[:3])
    assert len({str(dashes) for dashes in DASHES[:3]}) == 3
    widths = [each.get_linewidth() for each in lines]
    assert widths == sorted(widths, reverse=True)
    assert len({*widths}) == 3


def test_curves_are_drawn_over_the_grid() -> None:
    """Wide lines would look double beneath it."""
    for ax in plots.distribution(optuav.batch("paper", DEADLINES)):
        assert {line.get_visible() for line in ax.yaxis.get_gridlines()} == {True}
        assert ax.yaxis.get_zorder() < min(each.get_zorder() for each in [*ax.lines, *ax.patches])


def test_any_number_of_a_batch_is_drawn() -> None:
    found = optuav.batch("paper", DEADLINES)
    for name, each in found.data_vars.items():
        if each.dtype.kind == "f" and each.notnull().any():
            assert plots.distribution(found, str(name))[0].patches
    same = optuav.batch("paper", {"limits.deadline_s": [1200.0, 1200.0]})
    assert plots.distribution(same)[1].lines


@pytest.mark.parametrize(
    ("variable", "words"),
    [("hover_time", "did you mean 'hover_time_s'"), ("building", "one of hover_time_s"), (3, "3:")],
)
def test_a_variable_that_is_no_number_is_refused(variable: str, words: str) -> None:
    with pytest.raises(InputError, match=f"variable = .*{words}"):
        plots.distribution(optuav.batch("paper", DEADLINES), variable)


def test_without_any_plan_there_is_nothing_to_draw() -> None:
    with pytest.raises(InputError, match="must have a plan in at least one scenario"):
        plots.distribution(optuav.batch("paper", {"limits.deadline_s": [1.0, 2.0]}))
