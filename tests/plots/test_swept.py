"""Pictures of sweeps: each value where its keys are."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

import optuav
from optuav import plots
from optuav.errors import InputError
from optuav.plots import sweeps


def test_lines_go_over_the_key_in_its_order() -> None:
    """One for each perspective, with gaps where there is no plan; a value counts once."""
    deadlines_s = [1200.0, 600.0, 60.0, 600.0]
    names = ["battery", "available"]
    found = optuav.batch("paper", {"limits.deadline_s": deadlines_s}, perspective=names)
    ((name, ax),) = plots.swept(found)
    assert name == "hover.png"
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("deadline [s]", "longest hover Δ [s]")
    for line, perspective in zip(ax.get_lines(), names, strict=True):
        assert line.get_label() == perspective
        hover_s = found.hover_time_s.sel(perspective=perspective).values
        np.testing.assert_array_equal(line.get_xdata(), [60.0, 600.0, 1200.0])
        np.testing.assert_array_equal(line.get_ydata(), hover_s[[2, 1, 0]])


def test_rows_of_one_key_are_drawn_as_a_grid_of_it() -> None:
    found = optuav.batch("paper", {"limits.deadline_s": [1200.0, 600.0]}, paired=True)
    ((name, ax),) = plots.swept(found)
    (line,) = ax.get_lines()
    assert (name, ax.get_xlabel()) == ("hover.png", "deadline [s]")
    np.testing.assert_array_equal(line.get_xdata(), [600.0, 1200.0])
    np.testing.assert_array_equal(line.get_ydata(), found.hover_time_s.values[::-1])


def test_maps_have_the_first_key_across_and_the_second_upwards() -> None:
    fractions, deadlines_s = [0.6, 0.4, 0.5, 0.45], [600, 700, 800, 900]
    keys = {"battery.available_fraction": fractions, "limits.deadline_s": deadlines_s}
    found = optuav.batch("paper", keys)
    ((name, ax),) = plots.swept(found)
    assert name == "hover-available.png"
    assert ax.get_xlabel() == "battery available fraction [-]"
    assert ax.get_ylabel() == "deadline [s]"
    shown = np.asarray(ax.images[0].get_array() if ax.images else ax.collections[0].get_array())
    expected = found.hover_time_s.values[[1, 3, 2, 0]].T
    np.testing.assert_array_equal(shown.reshape(expected.shape), expected)


def test_three_keys_are_small_multiples_on_one_scale(monkeypatch: pytest.MonkeyPatch) -> None:
    """One panel a value of the key that has fewest, with all other values on its axes."""
    assert sweeps.MOST_PANELS == 12
    keys = {
        "limits.deadline_s": [20.0, 600.0, 700.0, 900.0],
        "limits.min_soc": [0.1, 0.3],
        "battery.capacity_As": [20_000.0, 30_000.0, 36_000.0, 40_000.0],
    }
    found = optuav.batch("paper", keys)
    ((name, first),) = plots.swept(found)
    assert name == "hover-available.png"
    panels = [ax for ax in first.figure.axes if ax.get_title(loc="left")]
    assert [ax.get_title(loc="left") for ax in panels] == [
        "least state of charge 0.1",
        "least state of charge 0.3",
    ]
    assert "one panel per value of least state of charge [-]" in first.figure.get_suptitle()
    (scale,) = {ax.images[0].get_clim() for ax in panels}
    values = found.hover_time_s.values
    assert scale == pytest.approx((np.nanmin(values), np.nanmax(values)))
    for number, ax in enumerate(panels):
        drawn = np.asarray(ax.images[0].get_array()).reshape(4, 4)
        np.testing.assert_array_equal(drawn, values[:, number].T)
    assert [text.get_text() for text in first.figure.legends[0].get_texts()] == ["no plan"]
    monkeypatch.setattr(sweeps, "MOST_PANELS", 1)
    ((_, first),) = plots.swept(found)
    assert [ax.get_title(loc="left") for ax in first.figure.axes[:1]] == [
        "least state of charge 0.1"
    ]
    assert "[-], 1 of 2" in first.figure.get_suptitle()


LONG = "rotor.drag_coefficient_Nm_s2_rad2"
SMALL = np.linspace(2.2e-8, 2.7e-8, 5)


@pytest.mark.parametrize(
    "keys",
    [
        pytest.param(
            {
                "limits.deadline_s": [600.0, 800.0, 1000.0, 1200.0],
                "battery.capacity_As": [30_000.0, 36_000.0, 42_000.0],
                "laser.power_W": [500.0, 1000.0, 2000.0],
            },
            marks=pytest.mark.soak,
        ),
        {LONG: SMALL, "laser.power_W": [500.0, 1000.0, 2000.0], "limits.deadline_s": [600, 900]},
        pytest.param(
            {
                "laser.power_W": [5e5, 1e6, 2e6, 1e7],
                LONG: SMALL,
                "battery.capacity_As": [3e4, 4e4, 5e4],
            },
            marks=pytest.mark.soak,
        ),
        pytest.param(
            {
                "laser.power_W": [5e2, 1e3, 2e3, 4e3],
                "limits.min_soc": [0.1, 0.15, 0.3, 0.4],
                LONG: SMALL[:3],
            },
            marks=pytest.mark.soak,
        ),
        pytest.param(
            {
                LONG: SMALL,
                "limits.deadline_s": np.linspace(60, 1200, 7),
                "limits.min_soc": np.linspace(0, 0.9, 5),
            },
            marks=pytest.mark.soak,
        ),
        {LONG: [2.2345678e-8, 2.2345679e-8, 2.23456795e-8], "laser.power_W": [500.0, 1e3]},
    ],
)
def test_no_text_on_text(keys: dict[str, Any], overlaps: Callable[[Figure], list[Any]]) -> None:
    """Of small multiples, and of one picture with small numbers on its axis."""
    ((_, ax),) = plots.swept(optuav.batch("paper", keys))
    assert overlaps(ax.figure) == []
    for panel in ax.figure.axes:
        boxes = [text.get_window_extent() for text in panel.texts]  # Names of contours
        assert all(panel.bbox.x0 <= box.x0 <= box.x1 <= panel.bbox.x1 for box in boxes)
        assert all(panel.bbox.y0 <= box.y0 <= box.y1 <= panel.bbox.y1 for box in boxes)


def test_few_values_of_a_key_are_lines_and_not_a_map() -> None:
    """One per value of the key that has two or three, over the other."""
    keys = {"limits.min_soc": [0.1, 0.3], "limits.deadline_s": [300, 600, 900, 1200, 1500]}
    found = optuav.batch("paper", keys)
    ((name, ax),) = plots.swept(found)
    assert (name, ax.get_xlabel()) == ("hover-available.png", "deadline [s]")
    assert not ax.images
    labels = [line.get_label() for line in ax.get_lines()]
    assert labels == ["least state of charge 0.1", "least state of charge 0.3"]
    for line, hover_s in zip(ax.get_lines(), found.hover_time_s.values, strict=True):
        np.testing.assert_array_equal(line.get_xdata(), keys["limits.deadline_s"])
        np.testing.assert_array_equal(line.get_ydata(), hover_s)
    panels = {**keys, "battery.capacity_As": [30_000, 40_000]}
    ((_, first),) = plots.swept(optuav.batch("paper", panels))
    drawn = [ax for ax in first.figure.axes if ax.get_title(loc="left")]
    assert [len(ax.get_lines()) for ax in drawn] == [2, 2]
    assert len({ax.get_ylim() for ax in drawn}) == 1


def test_a_hover_that_is_not_the_longest_is_not_called_so() -> None:
    """P2 asks for the most charge."""
    found = optuav.batch("paper", {"limits.deadline_s": [600, 700]}, "P2")
    ((_, ax),) = plots.swept(found)
    assert ax.get_ylabel() == "hover Δ [s]"


def test_places_without_a_plan_are_named_in_a_legend() -> None:
    fractions = [0.4, 0.5, 0.6, 0.7]
    keys = {"battery.available_fraction": fractions, "limits.deadline_s": [20, 600, 700, 800]}
    ((_, ax),) = plots.swept(optuav.batch("paper", keys))
    (legend,) = ax.figure.legends
    assert [text.get_text() for text in legend.get_texts()] == ["no plan"]


def test_one_map_is_drawn_on_given_axes_and_several_are_refused() -> None:
    """As on its own page; nothing is drawn on the axes of others."""
    four = [30_000, 35_000, 40_000, 45_000]
    grid = {"limits.deadline_s": [600, 700, 800, 900], "battery.capacity_As": four}
    left, right = Figure().subplots(1, 2)
    ((name, ax),) = plots.swept(optuav.batch("paper", grid), ax=right)
    ((own_name, own),) = plots.swept(optuav.batch("paper", grid))
    assert ax is right
    assert name == own_name
    assert [ax.get_xlabel(), ax.get_ylabel()] == [own.get_xlabel(), own.get_ylabel()]
    np.testing.assert_array_equal(ax.images[0].get_array(), own.images[0].get_array())
    maps = optuav.batch("paper", grid, perspective=["battery", "available"])
    panels = optuav.batch("paper", {**grid, "limits.min_soc": [0.1, 0.2]})
    for several in (maps, panels):
        with pytest.raises(InputError, match=r"ax: must be left out: .* several pictures"):
            plots.swept(several, ax=left)
    assert not left.has_data()


def test_nothing_to_draw_is_drawn_over_what_was_swept() -> None:
    found = optuav.batch("paper", {"limits.deadline_s": [10, 20]})
    ((_, ax),) = plots.swept(found)
    assert ax.get_xlim() == pytest.approx((9.5, 20.5))
    assert "no plan" in [text.get_text() for text in ax.texts]
    assert np.isnan(np.asarray(ax.get_lines()[0].get_ydata(), dtype=float)).all()
    grid = {"limits.deadline_s": [10, 20], "battery.capacity_As": [30_000, 40_000]}
    assert len([*plots.swept(optuav.batch("paper", grid))]) == 1


@pytest.mark.parametrize(
    ("mission", "ranges", "options"),
    [
        ("paper", {}, {}),
        ("paper", {"limits.deadline_s": [600]}, {}),
        ("paper", {"limits.deadline_s": [6, 7], "laser.power_W": [1, 2]}, {"paired": True}),
        (["paper", "paper-table2"], {"limits.deadline_s": [600, 700]}, {}),
        (
            "paper",
            {
                "limits.deadline_s": [6, 7],
                "laser.power_W": [1, 2],
                "body.mass_kg": [1, 2],
                "limits.min_soc": [0.1, 0.2],
            },
            {},
        ),
    ],
)
def test_other_dimensions_are_refused(mission: Any, ranges: Any, options: Any) -> None:
    for found in (
        optuav.batch(mission, ranges, **options),
        optuav.batch_arrays(mission, ranges, **options),
    ):
        with pytest.raises(InputError, match="a dataset of one mission"):
            [*plots.swept(found)]
