"""The search without derivatives, on functions whose largest value is known."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from optuav.solving.maximise import Lengths, Point, maximise

LENGTHS, BOX = Lengths(first=3.0, rough=0.1, last=1e-8), np.array([[-5.0] * 3, [5.0] * 3])
START = Point(-np.inf, 0, np.full(3, 4.0))


def inside(points: Any) -> Any:
    """Points moved into a box."""
    return np.clip(points, *BOX)


def largest(values: Any, *starts: Point) -> Point:
    """The best point in the box."""
    return maximise(starts or (START,), values, LENGTHS, inside)


@pytest.mark.parametrize("power", [0.5, 1.0, 2.0])
@pytest.mark.parametrize("peak", [[1.0, -2.0, 0.5], [5.0, -5.0, 0.0]])
def test_cusps_and_corners(power: float, peak: list[float]) -> None:
    """A root, a cone and a square of the distance from a peak, in the box or on its border."""

    def values(_: int, points: Any, least: float) -> Any:
        return -(np.abs(points - peak).sum(axis=1) ** power)

    top = largest(values)
    assert top.value == pytest.approx(0.0, abs=1e-3)
    assert top.at == pytest.approx(peak, abs=1e-5)


def test_where_nothing_is_possible_beside_a_jump() -> None:
    """The peak lies on the border of what is possible."""

    def values(_: int, points: Any, least: float) -> Any:
        level = -np.linalg.norm(points, axis=1)
        return np.where(points[:, 0] >= 1.0, level, -np.inf)

    top = largest(values)
    assert top.value == pytest.approx(-1.0, abs=1e-6)
    assert top.at == pytest.approx([1.0, 0.0, 0.0], abs=2e-3)


def test_the_best_branch_wins_and_the_point_stays_the_same() -> None:
    """Branches are told apart, and no call depends on another."""

    def values(branch: int, points: Any, least: float) -> Any:
        return branch - np.linalg.norm(points - branch, axis=1)

    starts = [Point(-np.inf, branch, np.zeros(3)) for branch in (0, 2, 1)]
    top = largest(values, *starts)
    assert top.branch == 2
    assert top.at == pytest.approx([2.0] * 3, abs=1e-6)
    again = largest(values, *starts)
    assert (again.value, again.branch, *again.at) == (top.value, top.branch, *top.at)


def test_what_is_below_the_least_of_interest_may_be_left_out() -> None:
    """The least is the best so far: values below it change nothing."""
    lacking = 0

    def values(_: int, points: Any, least: float) -> Any:
        nonlocal lacking
        level = -np.linalg.norm(points - 1.0, axis=1)
        lacking += int((level < least).sum())
        return np.where(level < least, -np.inf, level)

    def whole(_: int, points: Any, least: float) -> Any:
        return -np.linalg.norm(points - 1.0, axis=1)

    few, every = largest(values), largest(whole)
    assert lacking
    assert (few.value, *few.at) == (every.value, *every.at)
