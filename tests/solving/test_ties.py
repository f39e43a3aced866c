"""The tie rule: longest hover, then shortest mission, then fewest stops, then order."""

from __future__ import annotations

import math

import numpy as np
import pytest

from optuav.solving.ranking import best, tied

NAN = math.nan


@pytest.mark.parametrize(
    ("hover_s", "mission_s", "stops", "number"),
    [
        pytest.param([5, 7, 6], [1, 9, 1], [0, 1, 0], 1, id="longest hover"),
        pytest.param([7, 7], [9, 8], [0, 1], 1, id="then the shortest mission"),
        pytest.param([7, 7], [9, 9], [1, 0], 1, id="then the fewest stops"),
        pytest.param([7, 7, 7], [9, 9, 9], [1, 1, 1], 0, id="then the earliest"),
        pytest.param([7, 7 + 0.9e-6], [8, 9], [1, 1], 0, id="hover within a microsecond"),
        pytest.param([7, 7 + 1.1e-6], [8, 9], [1, 1], 1, id="hover beyond a microsecond"),
        pytest.param([7, 7], [9 + 0.9e-6, 9], [0, 1], 0, id="mission within a microsecond"),
        pytest.param([7, 7], [9 + 1.1e-6, 9], [0, 1], 1, id="mission beyond a microsecond"),
        pytest.param([NAN, 3, NAN], [NAN, 9, 1], [0, 2, 0], 1, id="what has no plan is left out"),
        pytest.param([0.0, NAN], [76, NAN], [0, 1], 0, id="hovering for no time is a plan"),
        pytest.param([5, 7], [1, 9], [0, 0], 1, id="a worse plan's short mission counts nothing"),
    ],
)
def test_tie_rule(
    hover_s: list[float], mission_s: list[float], stops: list[int], number: int
) -> None:
    """Longest hover, then shortest mission, then fewest stops, then order; times to 1e-6 s."""
    assert best(hover_s, mission_s, stops) == number


def test_scores_tie_by_what_the_best_of_them_says() -> None:
    """In any unit; what a worse one says counts nothing."""
    assert best([7e-9, 7.0000001e-9], [8, 9], [1, 1], ties=1e-15) == 0
    assert best([7e-9, 7.1e-9], [8, 9], [1, 1], ties=[1.0, 1e-15]) == 1
    groups, figures = np.array([0, 0, 1, 1, 1]), np.array([5e-9, 6e-9, 3e9, 3e9 + 1.0, 4e9])
    assert tied(groups, figures, np.array([1e-15, 9.0, 10.0, 0.0, 9e9])).tolist() == [0, 2, 3]


@pytest.mark.parametrize("hover_s", [[], [NAN], [NAN, NAN]])
def test_no_plan_at_all(hover_s: list[float]) -> None:
    assert best(hover_s, hover_s, [0] * len(hover_s)) is None
