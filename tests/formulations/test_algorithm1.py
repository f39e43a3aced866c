"""Algorithm 1 as printed, on tables small enough to fill in by hand."""

from __future__ import annotations

import numpy as np
import pytest

from formulations.algorithm1 import algorithm1, best_pair


def soc_end(hover_s: float, rest_s: float) -> float:
    """1/4 is left after 3 s of hovering, and a second of rest is worth a second of hovering."""
    return 1.0 - 0.25 * (hover_s - rest_s)


def test_tables_by_hand() -> None:
    """Rows are T' = 1, 2, 3, columns Δ; T' + Δ ≤ 4 and Δ − T' ≤ 1."""
    hover, rest = algorithm1(soc_end, 4.9, 0.75)
    np.testing.assert_array_equal(
        hover, [[1.0, 2.0, 0.0, 0.0], [1.0, 2.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.0] * 4]
    )
    np.testing.assert_array_equal(
        rest, [[1.0, 1.0, 0.0, 0.0], [2.0, 2.0, 0.0, 0.0], [3.0, 0.0, 0.0, 0.0], [0.0] * 4]
    )


def test_longest_hover_with_the_shortest_rest() -> None:
    """Δ = 2 s can be had with 1 s or 2 s of rest."""
    assert best_pair(algorithm1(soc_end, 4.9, 0.75)) == (2.0, 1.0)


def test_times_are_multiples_of_the_slot() -> None:
    """Half-second slots: Δ = 2.5 s and T' = 1.5 s fill 4 s; Δ − T' = 1."""
    assert best_pair(algorithm1(soc_end, 4.0, 0.75, 0.5)) == (2.5, 1.5)


@pytest.mark.parametrize("time_left_s", [-5.0, 0.0, 0.9, 1.0, 1.9])
def test_less_than_two_slots_hold_no_pair(time_left_s: float) -> None:
    assert best_pair(algorithm1(soc_end, time_left_s, 0.75)) is None


def test_no_pair_may_be_feasible() -> None:
    assert best_pair(algorithm1(soc_end, 9.0, 99.0)) is None


def test_limits_that_are_met_exactly_count() -> None:
    """Rounding below a billionth neither loses a slot nor a state of charge."""
    hover, _ = algorithm1(lambda hover, rest: 0.3 - 1e-10, 3.0 - 1e-10, 0.3)
    assert hover.shape == (3, 3)
    assert np.count_nonzero(hover) == 3
