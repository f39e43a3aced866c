"""The wells of several plans: bands that add up, and the moment at which they close."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pytest

pytest.importorskip("matplotlib")
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure

import optuav
from optuav import plots
from optuav.errors import InputError, NoPlanError
from optuav.plots.style import BLUE, SKY, VERMILLION


@pytest.fixture(scope="module")
def plans() -> list[optuav.Plan]:
    """The direct route of `paper`: by charge alone, and so that the battery lasts."""
    return [
        optuav.solve("paper", "P3", perspective=perspective)
        for perspective in ("battery", "available")
    ]


@pytest.fixture(scope="module")
def drawn(plans: list[optuav.Plan]) -> Sequence[Axes]:
    return plots.wells(plans)


def thickness(ax: Axes, colour: str, time_s: float) -> float:
    """How thick the band of a colour is at a moment [A s]."""
    (band,) = (
        each
        for each in ax.collections
        if isinstance(each, PolyCollection)
        and len(each.get_facecolor())
        and to_rgba(each.get_facecolor()[0]) == to_rgba(colour)
    )
    corners = np.asarray(band.get_paths()[0].vertices)
    near = np.abs(corners[:, 0] - time_s)
    heights = corners[near <= near.min() + 1e-9, 1]
    return float(heights.max() - heights.min())


def test_bands_are_the_wells_of_the_replay(plans: list[optuav.Plan], drawn: Sequence[Axes]) -> None:
    """At the ends of the phases, as the independent judge finds them."""
    for plan, ax in zip(plans, drawn, strict=True):
        trace = optuav.replay(plan).trace
        hover = next(phase for phase in plan.phases if phase.kind == "hover")
        for time_s in (hover.start_s, 0.5 * (hover.start_s + hover.end_s)):
            available, bound = (
                np.interp(time_s, trace.time_s, well[:, 0])
                for well in (trace.available_As, trace.bound_As)
            )
            assert thickness(ax, BLUE, time_s) == pytest.approx(available, abs=60.0)
            assert thickness(ax, SKY, time_s) == pytest.approx(bound, abs=60.0)


def test_the_moment_it_runs_dry_is_marked(drawn: Sequence[Axes]) -> None:
    """660.26 s, 13 366 A s bound (SPEC's check numbers); nothing where the battery lasts."""
    dots = [[line for line in ax.lines if line.get_marker() == "o"] for ax in drawn]
    ((dot,), none) = dots
    assert none == []
    (at,) = np.asarray(dot.get_xydata())
    assert at == pytest.approx((660.26, 13_366.0), abs=0.5)
    assert dot.get_color() == VERMILLION
    (text,) = (each.get_text() for each in drawn[0].texts if "dry" in each.get_text())
    assert text == "dry at 660.3 s\n13\N{THIN SPACE}366 A s still bound"
    assert thickness(drawn[0], BLUE, 660.26) < 200.0


def test_what_is_driven_past_full_is_marked() -> None:
    rested = optuav.solve("paper", perspective="battery")
    (ax,) = plots.wells([rested])
    assert "driven past full at 157.0 s" in [text.get_text() for text in ax.texts]


def test_titles_say_which_can_be_flown(drawn: Sequence[Axes]) -> None:
    by_charge, lasting = (ax.get_title(loc="left") for ax in drawn)
    assert by_charge.endswith("perspective battery: hover $Δ$ = 688.85 s, cannot be flown")
    assert lasting.endswith("perspective available: hover $Δ$ = 577.52 s")


def test_no_words_lie_on_others(
    drawn: Sequence[Axes], overlaps: Callable[[Figure], list[tuple[str, str]]]
) -> None:
    rested = [
        optuav.solve("paper", perspective=perspective) for perspective in ("battery", "available")
    ]
    for ax in (drawn[0], plots.wells(rested)[0]):
        figure = ax.get_figure(root=True)
        assert isinstance(figure, Figure)
        assert overlaps(figure) == []


def test_what_cannot_be_drawn_is_refused(plans: list[optuav.Plan]) -> None:
    with pytest.raises(InputError, match="no plan to draw"):
        plots.wells([])
    late = plans[0].mission.replace({"limits.deadline_s": 10})
    with pytest.raises(NoPlanError):
        plots.wells([optuav.solve(late, perspective="battery")])
