"""The battery's picture shows the wells that the kinetic battery model gives."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

pytest.importorskip("matplotlib")
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.patches import StepPatch

import optuav
from optuav import plots
from optuav.errors import NoPlanError
from optuav.plots.style import BLACK, BLUE, SKY, VERMILLION

CAPACITY_AS, SHARE, FLOW_PER_S = 72_000.0, 0.8, 4.5e-5


@pytest.fixture(scope="module")
def drawn(paper: optuav.Plan) -> plots.BatteryAxes:
    """The picture of the plan for `paper`."""
    return plots.battery(paper)


def curve(ax: Axes, colour: str) -> np.ndarray[Any, Any]:
    """Points (time, charge) of the longest line of a colour."""
    lines = [line for line in ax.lines if to_rgba(line.get_color()) == to_rgba(colour)]
    return np.asarray(max(lines, key=lambda each: len(each.get_xdata())).get_xydata())


def integrated(plan: optuav.Plan) -> tuple[list[float], list[list[float]]]:
    """Ends of the phases [s] and wells there [A s], from the differential equations."""
    state, time_s, states, times = [SHARE * CAPACITY_AS, (1 - SHARE) * CAPACITY_AS], 0.0, [], []
    for phase in plan.phases:
        for stage in phase.stages:

            def rates(_: float, y: Any, current: float = stage.current_A) -> list[float]:
                flow = FLOW_PER_S * (y[1] / (1 - SHARE) - y[0] / SHARE)
                return [current + flow, -flow]

            solved = solve_ivp(rates, (0.0, stage.duration_s), state, rtol=1e-10, atol=1e-6)
            state, time_s = solved.y[:, -1].tolist(), time_s + stage.duration_s
        times.append(time_s)
        states.append(state)
    return times, states


def test_wells_follow_the_differential_equations(
    paper: optuav.Plan, drawn: plots.BatteryAxes
) -> None:
    times, states = integrated(paper)
    available, bound, total = (curve(drawn.wells, colour) for colour in (BLUE, SKY, BLACK))
    for time_s, (y1, y2) in zip(times, states, strict=True):
        assert np.interp(time_s, *available.T) == pytest.approx(y1, abs=0.01)
        assert np.interp(time_s, *bound.T) == pytest.approx(y2, abs=0.01)
        assert np.interp(time_s, *total.T) == pytest.approx(y1 + y2, abs=0.01)


def test_the_curve_is_exact_within_the_hover(paper: optuav.Plan, drawn: plots.BatteryAxes) -> None:
    """Against eq (15) of the paper at every point drawn."""
    hover = next(phase for phase in paper.phases if phase.kind == "hover")
    available, bound = curve(drawn.wells, BLUE), curve(drawn.wells, SKY)
    inside = (available[:, 0] > hover.start_s) & (available[:, 0] < hover.end_s)
    y1, y2 = (np.interp(hover.start_s, *each.T) for each in (available, bound))
    rate, current = FLOW_PER_S / (SHARE * (1 - SHARE)), hover.current_A
    passed = rate * (available[inside, 0] - hover.start_s)
    expected = y1 * np.exp(-passed)
    expected += ((y1 + y2) * rate * SHARE + current) * (1 - np.exp(-passed)) / rate
    expected += current * SHARE * (passed - 1 + np.exp(-passed)) / rate
    assert inside.sum() > 50
    assert available[inside, 1] == pytest.approx(expected, abs=1e-5)


def test_full_and_empty_are_marked(drawn: plots.BatteryAxes) -> None:
    levels = {line.get_ydata()[0] for line in drawn.wells.lines if len(line.get_xdata()) == 2}
    assert {0.0, SHARE * CAPACITY_AS} <= levels
    assert min(abs(level - (1 - SHARE) * CAPACITY_AS) for level in levels) < 1e-6


def test_moments_are_marked_on_the_curve(paper: optuav.Plan, drawn: plots.BatteryAxes) -> None:
    marks = {
        (float(line.get_xdata()[0]), float(line.get_ydata()[0]))
        for line in drawn.wells.lines
        if line.get_color() == VERMILLION and len(line.get_xdata()) == 1
    }
    assert marks == {(paper.runs_dry_s, 0.0), (paper.overfull_s, SHARE * CAPACITY_AS)}
    for time_s, level in marks:
        on_curve = np.interp(time_s, *curve(drawn.wells, BLUE).T)
        assert on_curve == pytest.approx(level, abs=1.0)
    words = {text.get_text() for text in drawn.wells.texts}
    assert {"runs dry at 1095.5 s", "driven past full at 157.0 s"} <= words


def test_the_current_integrates_to_what_the_wells_lose(drawn: plots.BatteryAxes) -> None:
    (steps,) = [each for each in drawn.current.patches if isinstance(each, StepPatch)]
    currents, edges, _ = steps.get_data()
    total = curve(drawn.wells, BLACK)
    assert total[0, 1] == pytest.approx(CAPACITY_AS)
    assert currents @ np.diff(edges) == pytest.approx(total[-1, 1] - total[0, 1])
    assert total[-1, 1] == pytest.approx(0.05 * CAPACITY_AS)


def test_bands_are_the_phases(paper: optuav.Plan, drawn: plots.BatteryAxes) -> None:
    bands = [patch for patch in drawn.current.patches if not isinstance(patch, StepPatch)]
    edges = [(patch.get_x(), patch.get_x() + patch.get_width()) for patch in bands]
    starts = np.cumsum([0.0, *(phase.duration_s for phase in paper.phases)])
    assert np.ravel(edges) == pytest.approx(np.repeat(starts, 2)[1:-1])
    words = [text.get_text() for text in drawn.wells.texts]
    assert {"rest, b1", "hover"} <= set(words)


ODD: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "wells of one size": ({"battery.available_fraction": 0.5}, {}),
    "a tiny available well": ({"battery.available_fraction": 0.02}, {}),
    "passed by": ({"laser": None}, {"problem": optuav.P4("b9")}),
    "an endless flow": ({"battery.flow_rate_per_s": 100.0}, {}),
    "a large battery, a long rest": (
        {"battery.capacity_As": 2e8, "limits.deadline_s": 9e6, "battery.charge_current_A": 9e3},
        {},
    ),
}


RARE = ("wells of one size", "an endless flow")
"""Cases that are drawn in `make soak` alone, as the others draw most of what they do."""


@pytest.mark.parametrize(
    ("values", "options"),
    [
        pytest.param(*case, id=name, marks=[pytest.mark.soak] * (name in RARE))
        for name, case in ODD.items()
    ],
)
def test_odd_batteries_are_drawn_without_texts_on_each_other(
    values: dict[str, Any],
    options: dict[str, Any],
    paper: optuav.Plan,
    overlaps: Callable[[Figure], list[tuple[str, str]]],
) -> None:
    plan = optuav.solve(paper.mission.replace(values), **{"perspective": "battery", **options})
    assert overlaps(plots.battery(plan).wells.figure) == []


def test_shipped_missions_are_drawn_without_texts_on_each_other(
    drawn: plots.BatteryAxes,
    table2: optuav.Plan,
    overlaps: Callable[[Figure], list[tuple[str, str]]],
) -> None:
    assert overlaps(drawn.wells.figure) == []
    assert overlaps(plots.battery(table2).wells.figure) == []
    assert drawn.wells.get_ylabel().endswith("[A s]")
    assert drawn.current.get_ylabel().endswith("[A]")
    assert drawn.current.get_xlabel().endswith("[s]")


def test_a_plan_that_does_not_exist_has_no_battery(paper: optuav.Plan) -> None:
    nothing = optuav.solve(paper.mission.replace({"limits.deadline_s": 10}), perspective="battery")
    with pytest.raises(NoPlanError):
        plots.battery(nothing)
