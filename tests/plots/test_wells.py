"""The wells of several plans: bands that add up, and the moment at which they close."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest

pytest.importorskip("matplotlib")
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from scipy.integrate import solve_ivp

import optuav
from optuav import plots
from optuav.errors import InputError, NoPlanError
from optuav.looks import LOOKS
from optuav.plan.display import AVAILABLE, BOUND

CAPACITY_AS, SHARE, FLOW_PER_S = 72_000.0, 0.8, 4.5e-5


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
            assert thickness(ax, AVAILABLE, time_s) == pytest.approx(available, abs=60.0)
            assert thickness(ax, BOUND, time_s) == pytest.approx(bound, abs=60.0)


def test_the_moment_it_runs_dry_is_marked(drawn: Sequence[Axes]) -> None:
    """660.26 s, 13 366 A s bound (SPEC's check numbers); nothing where the battery lasts."""
    dots = [[line for line in ax.lines if line.get_marker() == "o"] for ax in drawn]
    ((dot,), none) = dots
    assert none == []
    (at,) = np.asarray(dot.get_xydata())
    assert at == pytest.approx((660.26, 13_366.0), abs=0.5)
    assert dot.get_color() == LOOKS["dry"].light
    (text,) = (each.get_text() for each in drawn[0].texts if "dry" in each.get_text())
    assert text == "dry at 660.3 s\n13\N{THIN SPACE}366 A s still bound"
    assert thickness(drawn[0], AVAILABLE, 660.26) < 200.0


def test_titles_say_which_can_be_flown(drawn: Sequence[Axes]) -> None:
    by_charge, lasting = (ax.get_title(loc="left") for ax in drawn)
    assert by_charge.endswith(": hover $Δ$ = 688.85 s, cannot be flown, perspective battery")
    assert lasting.endswith(": hover $Δ$ = 577.52 s, perspective available")


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
    with pytest.raises(
        InputError, match=r"plans = \[\]: must be a plan, the path of its file, or several"
    ):
        plots.wells([])
    late = plans[0].mission.replace({"limits.deadline_s": 10})
    with pytest.raises(NoPlanError):
        plots.wells([optuav.solve(late, perspective="battery")])


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


def course(plan: optuav.Plan) -> tuple[Any, Any, Any]:
    """Moments that are drawn [s], and both wells there [A s]."""
    (ax,) = plots.wells([plan])
    band = next(each for each in ax.collections if each.get_label() == "bound $y_2$")
    (line,) = (each for each in ax.lines if each.get_label() == "total $y_1 + y_2$")
    time_s, total_As = np.asarray(line.get_xydata()).T
    bound_As = np.asarray(band.get_paths()[0].vertices)[-2 : -2 - len(time_s) : -1, 1]
    return time_s, total_As - bound_As, bound_As


def test_the_course_follows_the_differential_equations(paper: optuav.Plan) -> None:
    """At the ends of the phases, by integration."""
    drawn_s, *drawn_As = course(paper)
    for time_s, wells in zip(*integrated(paper), strict=True):
        for level_As, each in zip(wells, drawn_As, strict=True):
            assert np.interp(time_s, drawn_s, each) == pytest.approx(level_As, abs=0.01)
    total_As = sum(drawn_As)
    assert total_As[0] == pytest.approx(CAPACITY_AS)
    assert total_As[-1] == pytest.approx(0.05 * CAPACITY_AS)


def test_the_course_is_exact_within_the_hover(paper: optuav.Plan) -> None:
    """Against eq (15) of the paper at every point drawn."""
    hover = next(phase for phase in paper.phases if phase.kind == "hover")
    time_s, available, bound = course(paper)
    inside = (time_s > hover.start_s) & (time_s < hover.end_s)
    y1, y2 = (np.interp(hover.start_s, time_s, each) for each in (available, bound))
    rate, current = FLOW_PER_S / (SHARE * (1 - SHARE)), hover.current_A
    passed = rate * (time_s[inside] - hover.start_s)
    expected = y1 * np.exp(-passed)
    expected += ((y1 + y2) * rate * SHARE + current) * (1 - np.exp(-passed)) / rate
    expected += current * SHARE * (passed - 1 + np.exp(-passed)) / rate
    assert inside.sum() > 50
    assert available[inside] == pytest.approx(expected, abs=1e-5)


def test_moments_are_marked_where_the_available_well_is_full_and_empty(paper: optuav.Plan) -> None:
    (ax,) = plots.wells([paper])
    words = {text.get_text().partition("\n")[0] for text in ax.texts}
    assert {"dry at 1095.5 s", "driven past full at 157.0 s", "rest, b1", "hover"} <= words
    time_s, available, _ = course(paper)
    for moment_s, level_As in ((paper.runs_dry_s, 0.0), (paper.overfull_s, SHARE * CAPACITY_AS)):
        assert moment_s is not None
        assert np.interp(moment_s, time_s, available) == pytest.approx(level_As, abs=1.0)


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


RARE = ("wells of one size", "an endless flow", "passed by")
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
    assert overlaps(plots.wells([plan])[0].figure) == []


def lines_of_the_reserve(ax: Axes) -> list[tuple[float, float]]:
    """Begin and end of the lines in the colour of the charge that must stay [s]."""
    drawn = [line for line in ax.lines if line.get_color() == LOOKS["charge"].light]
    return [(float(x[0]), float(x[-1])) for line in drawn for x in [np.asarray(line.get_xdata())]]


def test_the_line_of_the_reserve_says_where_it_holds() -> None:
    """Over the whole mission if it holds at every landing, else only at its end."""
    relay = optuav.load("relay-today")
    for keep_soc in ("end", "always"):
        plan = optuav.solve(relay.replace({"limits.keep_soc": keep_soc}))
        (ax,) = plots.wells(plan)
        ((begin_s, end_s),) = lines_of_the_reserve(ax)
        assert end_s == pytest.approx(plan.mission_time_s)
        assert begin_s == (0.0 if keep_soc == "always" else pytest.approx(0.94 * end_s))


def test_the_word_for_the_reserve_stands_at_the_end_of_its_line(
    overlaps: Callable[[Figure], list[tuple[str, str]]],
) -> None:
    """Of two plans the shorter one has it beside its own end, the longer one at the axis."""
    relay = optuav.load("relay-today").replace({"limits.keep_soc": "end"})
    pair = [optuav.solve(relay), optuav.solve(relay, perspective="battery")]
    short, _ = axes = plots.wells(pair)
    words = "to be kept: $η_0 B$"
    (word,) = (text for text in short.texts if text.get_text() == words)
    assert word.xy[0] == pytest.approx(pair[0].mission_time_s)  # type: ignore[attr-defined]
    sides = [axis.child_axes[0].get_yticklabels() for axis in axes]
    assert [words in [label.get_text() for label in side] for side in sides] == [False, True]
    assert overlaps(short.figure) == []


def test_a_landing_below_the_reserve_is_marked() -> None:
    """On b11 at 2430.10 s with 4.8 % of 42 336 A s, in orange; none where 20 % are kept."""
    relay = optuav.load("relay-today")
    (low,) = plots.wells(optuav.solve(relay.replace({"limits.keep_soc": "end"})))
    (dot,) = [line for line in low.lines if line.get_marker() == "o"]
    (at,) = np.asarray(dot.get_xydata())
    assert at == pytest.approx((2430.10, 2027.1), abs=0.1)
    assert dot.get_color() == LOOKS["dry"].light
    words = "below the reserve on the roof; allowed by keep_soc = end"
    assert words in [text.get_text() for text in low.texts]
    (kept,) = plots.wells(optuav.solve(relay))
    assert not any("reserve" in text.get_text() for text in kept.texts)
