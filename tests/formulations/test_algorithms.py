"""Algorithms 1 and 2 as printed, on tables and choices small enough to fill in by hand."""

from __future__ import annotations

import numpy as np
import pytest

from formulations.algorithms import Choice, algorithm1, algorithm2, best_pair
from optuav.solving.ranking import best


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


@pytest.mark.parametrize(
    ("direct_s", "resting_s", "choice"),
    [
        pytest.param(690.0, [(678.0, 3.0), (719.0, 392.0)], Choice(719.0, 392.0, 1), id="rest"),
        pytest.param(690.0, [(678.0, 3.0), None], Choice(690.0, None, None), id="direct"),
        pytest.param(690.0, [None, None], Choice(690.0, None, None), id="no rest possible"),
        pytest.param(690.0, [], Choice(690.0, None, None), id="no building"),
        pytest.param(1.0, [(9.0, 2.0), (9.0, 1.0)], Choice(9.0, 2.0, 0), id="first building"),
    ],
)
def test_printed_algorithm(
    direct_s: float, resting_s: list[tuple[float, float] | None], choice: Choice
) -> None:
    assert algorithm2(direct_s, resting_s) == choice


def test_printed_algorithm_rests_on_a_tie_and_ours_does_not() -> None:
    """The printed lines keep the direct flight only if it is longer; the tie rule takes the
    shorter mission, which is the direct flight: it needs no time to rest."""
    direct_s, resting_s = 690.0, [(690.0, 1.0), (690.0, 2.0)]
    assert algorithm2(direct_s, resting_s) == Choice(690.0, 1.0, 0)
    flight_s = [76.0, 80.0, 80.0]
    mission_s = [766.0, 771.0, 772.0]
    assert [sum(times) for times in zip(flight_s, [690.0] * 3, [0, 1, 2], strict=True)] == mission_s
    assert best([690.0] * 3, mission_s, [0, 1, 1]) == 0
