"""Maps of hover times show the site and the best point, with no text on another."""

from __future__ import annotations

from collections.abc import Callable

import pytest

pytest.importorskip("matplotlib")
pytest.importorskip("xarray")
from matplotlib.figure import Figure

import optuav
from optuav import plots

Overlaps = Callable[[Figure], list[tuple[str, str]]]
PAPER = optuav.load("paper")


def entries(figure: Figure) -> list[str]:
    (legend,) = figure.legends
    return [text.get_text() for text in legend.get_texts()]


@pytest.mark.parametrize(
    "over", ["device", "hover_point", pytest.param("laser", marks=pytest.mark.soak)]
)
def test_nothing_lies_on_anything(over: str, overlaps: Overlaps) -> None:
    found = getattr(optuav.maps, over)(PAPER, 100)
    ax = plots.hover_map(PAPER, found)
    assert overlaps(ax.figure) == []
    x, y, _ = found.attrs["best_m"]
    assert f"at ({x:g}, {y:g}) m" in " ".join(entries(ax.figure)).replace("\N{MINUS SIGN}", "-")


def test_what_is_outside_the_map_is_not_in_its_legend(overlaps: Overlaps) -> None:
    """A narrow strip around the device, where all have no plan but some."""
    found = optuav.maps.hover_point(PAPER, 50, bounds=(900, 2850, 1100, 3400))
    ax = plots.hover_map(PAPER, found)
    names = entries(ax.figure)
    assert names[0] == "ground device"
    assert names[-1] == "no plan"
    assert not {"building", "laser", "origin and destination"} & {*names}
    assert overlaps(ax.figure) == []


def test_a_map_without_any_plan_is_drawn(overlaps: Overlaps) -> None:
    late = PAPER.replace({"limits.deadline_s": 30})
    ax = plots.hover_map(late, optuav.maps.laser(late, 200, bounds=(-500, -100, 2500, 100)))
    assert entries(ax.figure)[-1] == "no plan"
    assert overlaps(ax.figure) == []


def test_a_mission_may_be_named_and_what_is_no_map_is_refused() -> None:
    ax = plots.hover_map("paper", optuav.maps.laser(PAPER, 1000))
    assert (
        ax.get_title(loc="left")
        == "paper: longest hover, laser anywhere at z = 50 m,\nperspective available"
    )
    with pytest.raises(optuav.InputError, match="a map, as the functions of"):
        plots.hover_map("paper", 3)  # type: ignore[arg-type]
    with pytest.raises(optuav.InputError, match="a map, as the functions of"):
        plots.hover_map("paper", optuav.maps.laser(PAPER, 1000)[:1])
