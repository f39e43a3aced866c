"""The picture of a leg shows the flight model: laws of motion hold for what is drawn."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

pytest.importorskip("matplotlib")
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import optuav
from optuav import plots
from optuav.errors import InputError

Found = Callable[[Figure], list[tuple[str, str]]]


@pytest.fixture(scope="module")
def drawn(paper: optuav.Plan) -> plots.LegAxes:
    """The leg from the origin to w_U of `paper`; SPEC gives its numbers."""
    return plots.leg(paper.mission, "origin", "hover")


def lines(ax: Axes, style: str = "-") -> list[np.ndarray[Any, Any]]:
    """Points of the lines of a style, without what stands in the legend only."""
    found = [np.asarray(line.get_xydata()) for line in ax.lines if line.get_linestyle() == style]
    return [points for points in found if len(points)]


def area(points: np.ndarray[Any, Any]) -> float:
    """Integral under a line."""
    return float(np.trapezoid(points[:, 1], points[:, 0]))


def test_speed_integrates_to_the_distance(drawn: plots.LegAxes) -> None:
    assert sum(map(area, lines(drawn.speed))) == pytest.approx(np.hypot(1000, 2501.0152), rel=1e-6)


def test_the_frozen_turn_keeps_the_peak_speed(drawn: plots.LegAxes) -> None:
    (dotted,) = lines(drawn.speed, ":")
    assert dotted[:, 1] == pytest.approx(154.89, abs=0.005)
    assert np.max(np.concatenate(lines(drawn.speed))[:, 1]) == pytest.approx(154.89, abs=0.005)
    words = [text.get_text() for text in drawn.speed.get_legend().get_texts()]
    assert "stage 3: position frozen,\nspeed kept for stage 4" in words


def test_current_integrates_to_the_charge_of_the_leg(drawn: plots.LegAxes) -> None:
    (current,) = lines(drawn.current)
    flying = current[current[:, 0] < 37.8961 + 1e-3]
    assert area(flying) == pytest.approx(3921.555, abs=0.05)
    assert current[-1, 1] == pytest.approx(4 * 23.2276, abs=5e-4)


def test_attitude_starts_and_ends_level(drawn: plots.LegAxes) -> None:
    assert drawn.attitude is not None
    for line in drawn.attitude.lines:
        assert line.get_ydata()[0] == pytest.approx(0.0, abs=1e-9)
        assert line.get_ydata()[-1] == pytest.approx(0.0, abs=1e-9)
    pitch, roll = (np.asarray(line.get_ydata()) for line in drawn.attitude.lines)
    # Flying to +x and more to +y: thrust tilts to both, most in roll.
    assert roll.max() > pitch.max() > 0.0 > pitch.min() > roll.min()


def test_bands_are_the_stages(drawn: plots.LegAxes) -> None:
    widths = [patch.get_width() for patch in drawn.speed.patches]
    assert len(widths) == 6
    assert sum(widths[:5]) == pytest.approx(37.8961, abs=5e-5)
    assert widths[0] + widths[2] + widths[4] == pytest.approx(3.1165, abs=5e-5)
    for left, right in itertools.pairwise(drawn.speed.patches):
        assert left.get_x() + left.get_width() == pytest.approx(right.get_x())


@pytest.mark.parametrize("cap", [None, 20.0], ids=["no cap", "cap reached"])
def test_a_leg_of_constant_load_is_a_trapezoid(table2: optuav.Plan, cap: float | None) -> None:
    mission = table2.mission.replace({"flight.max_speed_m_s": cap})
    axes = plots.leg(mission, "origin", "hover")
    (speed,), (current,) = lines(axes.speed), lines(axes.current)
    assert axes.attitude is None
    assert area(speed) == pytest.approx(np.hypot(1000, 2501.0152), rel=1e-6)
    assert (speed[1, 1] - speed[0, 1]) / (speed[1, 0] - speed[0, 0]) == pytest.approx(12.2349)
    assert (current[:, 1] == 93.658).all()
    assert (
        current[-1, 0] == speed[-1, 0] == pytest.approx(29.675 if cap is None else 136.31, abs=0.01)
    )


ODD: dict[str, tuple[dict[str, Any], str, str]] = {
    "wind": ({"wind.force_N": [3, -2, 1]}, "origin", "b3"),
    "straight up": ({"route.destination_m": [0, 0, 250]}, "origin", "destination"),
    "very far": ({"route.destination_m": [900_000, 0, 50]}, "origin", "destination"),
    "a millimetre": ({"route.destination_m": [0.001, 0, 50]}, "origin", "destination"),
}


RARE = ("wind", "very far", "straight up")
"""Cases that are drawn in `make soak` alone, as the others draw most of what they do."""


@pytest.mark.parametrize(
    ("values", "start", "end"),
    [
        pytest.param(*case, id=name, marks=[pytest.mark.soak] * (name in RARE))
        for name, case in ODD.items()
    ],
)
def test_odd_legs_are_drawn_without_texts_on_each_other(
    values: dict[str, Any], start: str, end: str, paper: optuav.Plan, overlaps: Found
) -> None:
    axes = plots.leg(paper.mission.replace(values), start, end)
    assert overlaps(axes.speed.figure) == []


def test_shipped_missions_are_drawn_without_texts_on_each_other(
    drawn: plots.LegAxes, table2: optuav.Plan, overlaps: Found
) -> None:
    assert overlaps(drawn.speed.figure) == []
    assert overlaps(plots.leg(table2.mission, "origin", "b1").speed.figure) == []
    assert [ax.get_ylabel()[-5:] for ax in drawn if ax is not None] == ["[m/s]", "e [°]", "t [A]"]
    assert drawn.current.get_xlabel().endswith("[s]")


def test_legs_that_do_not_exist_are_refused(paper: optuav.Plan) -> None:
    with pytest.raises(InputError, match=r"start = 'b11'.*\n.*end = 'home'"):
        plots.leg(paper.mission, "b11", "home")
    with pytest.raises(InputError, match="no length"):
        plots.leg(paper.mission, "b1", "b1")
    with pytest.raises(InputError, match="no hover point"):
        plots.leg(paper.mission.replace({"link.noise_power_W": 1.0}), "origin", "hover")
    with pytest.raises(InputError, match="weight and wind"):
        plots.leg(paper.mission.replace({"body.mass_kg": 9.0}), "origin", "b1")
