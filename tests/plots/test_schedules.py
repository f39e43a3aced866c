"""The picture of packs by schedule shows what every pack holds, and who works when."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pytest

pytest.importorskip("matplotlib")
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure

import optuav
from optuav import plots
from optuav.errors import InputError
from optuav.plots.style import BLUE, PINK


@pytest.fixture(scope="module")
def plans() -> list[optuav.Plan]:
    """The direct route of `paper` in slots of 20 s, pooled and one pack after the other."""
    paper = optuav.load("paper")
    return [
        optuav.solve(
            paper.replace({"battery.schedule": name}), "P3", perspective="available", slot_s=20
        )
        for name in ("pooled", "sequential")
    ]


@pytest.fixture(scope="module")
def drawn(plans: list[optuav.Plan]) -> Sequence[Axes]:
    return plots.packs(plans)


def thick(ax: Axes, colour: str) -> np.ndarray:
    """Points (time, level) of the thick lines of a colour, in order."""
    return np.concatenate(
        [
            np.asarray(line.get_xydata())
            for line in ax.lines
            if to_rgba(line.get_color()) == to_rgba(colour)
            and line.get_linewidth() > 1.0
            and line.get_marker() == "None"
        ]
    )


def test_levels_at_the_ends_of_the_phases(plans: list[optuav.Plan], drawn: Sequence[Axes]) -> None:
    """As the plan tells them, in percent of a full well of one pack."""
    for number, colour in enumerate((BLUE, PINK)):
        points = thick(drawn[1], colour)
        for phase in plans[1].phases:
            at = np.abs(points[:, 0] - phase.end_s).argmin()
            level = 100.0 * phase.available_As[number] / (0.8 * 36_000.0)
            assert points[at, 1] == pytest.approx(level, abs=1e-6)


def test_pooled_packs_begin_full(drawn: Sequence[Axes]) -> None:
    """Their line is a share of both packs, and stays within the panel."""
    points = thick(drawn[0], BLUE)
    assert points[0, 1] == pytest.approx(100.0, abs=1e-9)
    assert points[:, 1].max() <= drawn[0].get_ylim()[1]


def test_a_panel_a_plan_and_a_line_a_pack(drawn: Sequence[Axes]) -> None:
    titles = [ax.get_title(loc="left").partition(",")[0] for ax in drawn]
    assert titles == ["paper: schedule pooled", "paper: schedule sequential"]
    assert thick(drawn[1], PINK).size
    with pytest.raises(ValueError, match="concatenate"):
        thick(drawn[0], PINK)


def test_a_plan_that_cannot_be_flown_is_called_so() -> None:
    paper = optuav.load("paper").replace({"battery.schedule": "sequential"})
    charge_only = optuav.solve(paper, "P3", perspective="battery")
    flyable = optuav.solve(paper, "P3", perspective="available", slot_s=50.0)
    titles = [ax.get_title(loc="left") for ax in plots.packs([charge_only, flyable])]
    assert [title.endswith(", cannot be flown") for title in titles] == [True, False]


def test_a_pack_seen_empty_is_marked_when_it_is(
    plans: list[optuav.Plan], drawn: Sequence[Axes]
) -> None:
    (dot,) = [line for line in drawn[1].lines if line.get_marker() == "o"]
    time_s = float(np.asarray(dot.get_xdata())[0])
    blue = thick(drawn[1], BLUE)
    assert np.interp(time_s, blue[:, 0], blue[:, 1]) == pytest.approx(0.0, abs=1e-6)
    assert blue[blue[:, 0] < time_s - 1.0, 1].min() > 0.0


def test_no_words_lie_on_others(
    drawn: Sequence[Axes], overlaps: Callable[[Figure], list[tuple[str, str]]]
) -> None:
    figure = drawn[0].get_figure(root=True)
    assert isinstance(figure, Figure)
    assert overlaps(figure) == []


def test_no_plan_at_all_is_refused() -> None:
    with pytest.raises(
        InputError, match=r"plans = \[\]: must be a plan, the path of its file, or several"
    ):
        plots.packs([])
