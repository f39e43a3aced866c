"""Heat maps show every value in its place, and contours at round numbers."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("matplotlib")
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from optuav import plots
from optuav.plots.heat import contour_levels, heat_map

Overlaps = Callable[[Figure], list[tuple[str, str]]]
X, Y = np.array([0.0, 10.0, 20.0, 30.0]), np.array([5.0, 6.0, 9.0])


WORDS = ("x [m]", "y [m]", "Δ [s]"), "hover"


def drawn(values: np.ndarray, x: np.ndarray = X) -> Axes:
    return heat_map(x, Y, values, *WORDS)


def contours(ax: Axes) -> list[np.ndarray]:
    """Corners of the contours."""
    paths = [path for each in ax.collections for path in each.get_paths()]
    return [path.vertices for path in paths if len(path.vertices)]


def test_contours_run_where_the_values_are(overlaps: Overlaps) -> None:
    """Of the plane 4 x, the contour of 20 is at x = 5, of 100 at x = 25; axes end at values."""
    ax = drawn(np.tile(4.0 * X, (3, 1)))
    assert contour_levels(np.array([0.0, 120.0, np.nan])) == [20.0, 40.0, 60.0, 80.0, 100.0]
    at = sorted({round(float(x), 6) for each in contours(ax) for x in each[:, 0]})
    assert at == [5.0, 10.0, 15.0, 20.0, 25.0]
    assert ax.get_xlim() == (0.0, 30.0)
    assert ax.get_ylim() == (5.0, 9.0)
    assert overlaps(ax.figure) == []


def test_every_value_is_in_its_cell() -> None:
    """First row at the bottom, though the cells are not evenly spaced."""
    values = np.arange(12.0).reshape(3, 4)
    (image,) = drawn(values, X**2).images
    assert np.array_equal(image.get_array(), values)


def test_cells_without_a_value_are_hatched(overlaps: Overlaps) -> None:
    """No contour runs through them, nor where all have one value, nor where none has any."""
    values = np.tile(4.0 * X, (3, 1))
    values[:, 0] = np.nan
    ax = drawn(values)
    assert [bool(each.get_hatch()) for each in ax.patches] == [True]
    assert min(float(each[:, 0].min()) for each in contours(ax)) >= 10.0
    for same in (np.full((3, 4), 7.0), np.full((3, 4), np.nan)):
        ax = drawn(same)
        assert not contours(ax)
    assert overlaps(ax.figure) == []


def test_where_contours_crowd_none_is_named() -> None:
    """At a jump several run side by side; beside it each has its name."""
    values = np.tile(np.r_[np.zeros(20), np.linspace(0.0, 100.0, 21) ** 2 / 100.0], (30, 1))
    values[:, :20] += 100.0
    ax = heat_map(np.arange(41.0), np.arange(30.0), values, *WORDS)
    named = [each for each in ax.texts if each.get_text()]
    assert named
    jump = ax.transData.transform([(19.0, 0.0), (20.0, 0.0)])[:, 0]
    for each in named:
        box = each.get_window_extent()
        assert box.x1 < jump[0] or box.x0 > jump[1]


def test_a_cell_or_two_have_no_contour_of_their_own() -> None:
    """It would be a diamond around a square; larger patches keep theirs."""
    values, at = np.zeros((20, 20)), np.arange(20.0)
    values[3, 3] = values[15, 4] = values[15, 5] = 100.0
    assert not contours(heat_map(at, at, values, *WORDS))
    values[8:13, 8:13] = 100.0
    corners = np.concatenate(contours(heat_map(at, at, values, *WORDS)))
    assert corners.min() > 7.0
    assert corners.max() < 13.0


def test_no_name_of_a_contour_is_cut() -> None:
    """The contour of 20 runs along the lower edge, where half of its name would be outside."""
    values = np.tile(19.7 + np.arange(100.0)[:, None], (1, 40))
    ax = heat_map(np.arange(40.0), np.arange(100.0), values, *WORDS)
    assert {"40", "60"} <= {each.get_text() for each in ax.texts}
    for each in ax.texts:
        box = each.get_window_extent()
        assert ax.bbox.y0 <= box.y0 < box.y1 <= ax.bbox.y1


def test_the_same_values_are_the_same_bytes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("optuav.plots.style.DOTS_PER_INCH", 20)
    values = np.sin(np.arange(12.0)).reshape(3, 4)
    first, second = (plots.save(drawn(values), tmp_path / name) for name in ("a.png", "b.png"))
    assert first.read_bytes() == second.read_bytes()
