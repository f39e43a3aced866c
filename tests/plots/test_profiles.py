"""Altitude, speed and power over a replayed plan."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

pytest.importorskip("matplotlib")
from matplotlib.figure import Figure

import optuav
from optuav import NoPlanError, plots
from optuav.judge import Itinerary, Stop
from optuav.looks import LOOKS
from optuav.plots.style import BLACK

Overlaps = Callable[[Figure], list[tuple[str, str]]]


def figure(axes: plots.ProfileAxes) -> Figure:
    drawn = axes.power.get_figure(root=True)
    assert isinstance(drawn, Figure)
    return drawn


def test_curves_are_those_of_the_mission(paper: optuav.Plan) -> None:
    """Roof, hover and ends at their heights, the peak speed, hover power into the battery."""
    axes = plots.profile(optuav.replay(paper))
    (altitude,) = [line for line in axes.altitude.lines if line.get_color() == BLACK]
    heights = np.interp([0.0, 200.0, 800.0, 1200.0], *altitude.get_data())
    assert heights == pytest.approx([50.0, 60.0, 50.0, 50.0])
    (speed,) = axes.speed.lines
    assert np.nanmax(speed.get_ydata()) == pytest.approx(154.89, abs=0.01)
    power = [line for line in axes.power.lines if line.get_color() == BLACK][-1]
    assert np.interp([200.0, 800.0], *power.get_data()) == pytest.approx(
        [111.0, 111.0 - 1310.994 - 5.0], abs=1e-3
    )


def test_violations_are_marked(paper: optuav.Plan, overlaps: Overlaps) -> None:
    replayed = optuav.replay(paper)
    axes = plots.profile(replayed)
    colours = {LOOKS[role].light for role in ("dry", "overfull")}
    marks = [line for line in axes.altitude.lines if line.get_color() in colours]
    moments = [float(line.get_xdata()[0]) for line in marks]
    assert moments == [event.time_s for event in replayed.violations]
    assert {"dry at 1095.5 s", "driven past full at 157.0 s"} <= {
        text.get_text() for text in axes.altitude.texts
    }
    assert overlaps(figure(axes)) == []


@pytest.mark.parametrize(
    "stops",
    [
        pytest.param((), marks=pytest.mark.soak),
        (Stop("b1", "hover", 0.0),),
        pytest.param(
            tuple(Stop(f"b{1 + k % 10}", "rest", 20.0) for k in range(12)),
            marks=pytest.mark.soak,
        ),
        (Stop("b9", "rest", 1e7), Stop("b10", "hover", 1e7)),
    ],
    ids=["a flight", "passing by", "many stops", "much too long"],
)
def test_odd_itineraries(stops: tuple[Stop, ...], overlaps: Overlaps) -> None:
    axes = plots.profile(optuav.replay(Itinerary(optuav.load("paper"), stops)))
    assert overlaps(figure(axes)) == []


def test_what_cannot_be_drawn_is_refused() -> None:
    heavy = optuav.load("paper").replace({"body.mass_kg": 2.0})
    with pytest.raises(NoPlanError):
        plots.profile(optuav.replay(Itinerary(heavy, ())))
