"""Algorithm 2: what the printed lines choose, and what the tie rule chooses."""

from __future__ import annotations

import math

import pytest

from formulations.algorithm2 import Choice, algorithm2_as_printed, best

NAN = math.nan


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
    assert algorithm2_as_printed(direct_s, resting_s) == choice


def test_printed_algorithm_rests_on_a_tie_and_ours_does_not() -> None:
    """The printed lines keep the direct flight only if it is longer; the tie rule takes the
    shorter mission, which is the direct flight: it needs no time to rest."""
    direct_s, resting_s = 690.0, [(690.0, 1.0), (690.0, 2.0)]
    assert algorithm2_as_printed(direct_s, resting_s) == Choice(690.0, 1.0, 0)
    flight_s = [76.0, 80.0, 80.0]
    mission_s = [766.0, 771.0, 772.0]
    assert [sum(times) for times in zip(flight_s, [690.0] * 3, [0, 1, 2], strict=True)] == mission_s
    assert best([690.0] * 3, mission_s, [0, 1, 1]) == 0


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


@pytest.mark.parametrize("hover_s", [[], [NAN], [NAN, NAN]])
def test_no_plan_at_all(hover_s: list[float]) -> None:
    assert best(hover_s, hover_s, [0] * len(hover_s)) is None
