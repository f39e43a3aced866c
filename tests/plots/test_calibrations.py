"""Pictures of calibrations show what was observed and what is left over; no text on another."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("matplotlib")
from matplotlib.figure import Figure

import optuav
from optuav import plots
from optuav.calibration import Fit, Panel, Value
from optuav.calibration.fit import ConfidenceInterval
from optuav.calibration.logs import measurements
from optuav.calibration.logs.read import flight_log_in
from optuav.errors import InputError
from optuav.looks import PHASES
from tests.calibration import flights

DATA = Path(__file__).parents[2] / "examples" / "data"

Overlaps = Callable[[Figure], list[tuple[str, str]]]


TWO = "k10-a.bin", "k10-b.bin"
LAG = Value("lag_s", 33711.7, "of wells", ConfidenceInterval(24763.4, 45909.7))


def fit(*panels: Panel) -> Fit:
    return Fit("kibam", ("a file $with$ a very long name indeed.csv",), "a few", (), panels)


def named(observed: tuple[float, ...], fitted: tuple[float, ...]) -> Panel:
    names = tuple(f"load {number}" for number in range(len(observed)))
    return Panel("lifetime", "s", observed, fitted, names=names)


def test_named_observations_and_what_is_left_over() -> None:
    """Rings at the observed values, dots at the fitted ones, bars of their difference."""
    (axes,) = plots.fit(fit(named((100.0, 120.0, 130.0), (101.0, 118.0, 130.0))))
    rings, dots, *_ = axes.values.lines
    assert rings.get_xdata().tolist() == [100.0, 120.0, 130.0]
    assert dots.get_xdata().tolist() == [101.0, 118.0, 130.0]
    assert [bar.get_width() for bar in axes.residuals.patches] == [1.0, -2.0, 0.0]
    assert [text.get_text() for text in axes.values.get_yticklabels()] == [
        "load 0",
        "load 1",
        "load 2",
    ]
    assert axes.values.get_xlabel() == "lifetime [s]"


def test_predictions_and_repeats_have_colours_of_their_own() -> None:
    panel = Panel(
        *("battery", "%", (1.0, 1.0, 2.0), (1.0, 1.0, 3.0)),
        names=("a", "b", "c"),
        roles=("fitted", "repeat", "predicted"),
    )
    (axes,) = plots.fit(fit(panel))
    colours = [line.get_color() for line in axes.values.lines[1:4]]
    assert len(set(colours)) == 3
    legend = axes.values.get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()] == [
        *("observed", "fitted", "repeat", "predicted")
    ]


def test_the_line_of_means_breaks_between_phases() -> None:
    """From one regime to the next there is no load in between."""
    panel = Panel(
        "current",
        "A",
        (1.0, 1.0, 5.0, 5.0, 1.0),
        (1.0, 1.0, 5.0, 5.0, 1.0),
        at=(0.0, 1.0, 2.0, 3.0, 4.0),
        at_words="time [s]",
        groups=("rest", "rest", "hover", "hover", "rest"),
    )
    (axes,) = plots.fit(fit(panel))
    lines = [line for line in axes.values.lines if line.get_linestyle() == "-"]
    assert [line.get_ydata().tolist() for line in lines] == [[1.0, 1.0], [5.0, 5.0], [1.0]]


@pytest.mark.parametrize(
    "found",
    [
        fit(named((1.0, 1e6), (2.0, 1e6))),
        replace(fit(named((500.0, 3400.0), (510.0, 3400.0))), sources=TWO, lag=LAG),
        pytest.param(fit(named((59.35,), (59.35,))), marks=pytest.mark.soak),
        fit(named(tuple(np.linspace(5.0, 50.0, 30)), tuple(np.linspace(5.0, 52.0, 30)))),
        fit(named((-12.79, 5.01), (-0.27, 5.01)), named((0.0,), (0.0,))),
    ],
)
def test_no_text_on_text(found: Fit, overlaps: Overlaps) -> None:
    figure = plots.fit(found)[0].values.get_figure(root=True)
    assert isinstance(figure, Figure)
    assert overlaps(figure) == []


@pytest.mark.parametrize(
    ("calibrate", "name"),
    [
        pytest.param(optuav.fit_regimes, "flight_log.csv", marks=pytest.mark.soak),
        (optuav.fit_rotor, "bench.csv"),
    ],
)
def test_examples_have_no_text_on_text(
    calibrate: Callable[[list[Path]], Fit], name: str, overlaps: Overlaps
) -> None:
    figure = plots.fit(calibrate([DATA / name]))[0].values.get_figure(root=True)
    assert isinstance(figure, Figure)
    assert overlaps(figure) == []


def test_a_power_that_fits_is_drawn_between_the_speeds_of_the_log(tmp_path: Path) -> None:
    """A smooth curve, by the formula of Y. Zeng, J. Xu, R. Zhang, 2019, and no polygon."""

    def power_W(speed_m_s: float) -> float:
        ratio = 0.5 * (speed_m_s / 4.03) ** 2
        lift = 88.63 * np.sqrt(np.sqrt(1.0 + ratio**2) - ratio)
        return float(79.86 * (1.0 + 3.0 * (speed_m_s / 120.0) ** 2) + lift + 0.0092 * speed_m_s**3)

    rows = [f"{speed},{power_W(speed)}" for speed in range(0, 25, 4)]
    file = tmp_path / "log.csv"
    file.write_text("\n".join(["speed_m_s,power_W", *rows]))
    (axes,) = plots.fit(optuav.fit_rotary_wing(file))
    (line,) = [line for line in axes.values.lines if line.get_label() == "fitted"]
    speeds = np.arange(2.0, 24.0, 4.0)
    drawn = np.interp(speeds, *map(np.asarray, line.get_data()))
    assert drawn.tolist() == pytest.approx([power_W(speed) for speed in speeds], rel=1e-3)


def test_samples_that_a_fit_leaves_out_are_grey(tmp_path: Path) -> None:
    """Speeding up is flight, but not steady: no power over speed comes from it."""
    log = flight_log_in(flights.airdata(tmp_path / "a.csv", flights.flown()), {})
    assert log is not None
    _, used = measurements.steady(log)
    dots = [
        line for line in plots.flight_log(used).speed.lines if len(np.asarray(line.get_xdata()))
    ]
    speeds = {line.get_color(): np.asarray(line.get_ydata()) for line in dots}
    assert speeds[PHASES["flight"]].min() > flights.CAP - 1.5
    assert speeds[plots.style.PALE].max() > 0.5 * flights.CAP
    assert PHASES["rest"] not in speeds


def test_nothing_to_draw_is_told() -> None:
    with pytest.raises(InputError, match="nothing to draw"):
        plots.fit(optuav.fit_rotor([DATA / "propeller.csv"]))
