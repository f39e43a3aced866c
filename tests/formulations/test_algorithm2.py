"""Algorithm 2: what the printed lines choose, and what the tie rule chooses."""

from __future__ import annotations

import pytest

from formulations.algorithm2 import Choice, algorithm2
from optuav.solving.plans import best


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
