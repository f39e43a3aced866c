"""Wells of kinds of cells: their lags, and how quickly they settle."""

from __future__ import annotations

import pytest

from optuav.options import BATTERIES
from optuav.physics.cells import CELLS
from optuav.physics.packs import lifetime


def test_there_are_wells_for_each_name() -> None:
    assert tuple(CELLS) == BATTERIES


@pytest.mark.parametrize(
    ("name", "lag_s", "settling_s"),
    [("lipo", 120.0, 30.0), ("liion", 300.0, 33.3), ("paper", 888.9, 3555.6)],
)
def test_lags_are_those_of_the_specification(name: str, lag_s: float, settling_s: float) -> None:
    """And a constant current that has settled the wells lasts B/I less the lag."""
    wells = CELLS[name]  # type: ignore[index]
    share, flow = wells.available_fraction, wells.flow_rate_per_s
    assert wells.lag_s == pytest.approx(lag_s, rel=1e-3)
    assert share * (1.0 - share) / flow == pytest.approx(settling_s, rel=2e-3)
    capacity_As, current_A = 36_000.0, 36_000.0 / (8.0 * settling_s + lag_s)
    battery = {"available_fraction": share, "flow_rate_per_s": flow}
    lasts_s = lifetime([(current_A, 1.0)], capacity_As=capacity_As, **battery)
    assert lasts_s == pytest.approx(capacity_As / current_A - lag_s, rel=1e-3)
