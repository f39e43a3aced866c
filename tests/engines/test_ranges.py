"""How many slots fit under a bound."""

from __future__ import annotations

import pytest

from optuav.engines.ranges import last_slot


@pytest.mark.parametrize(
    ("bound_s", "slot_s", "whole", "begun"),
    [
        (740.65, 1.0, 740, 741),
        (740.0, 1.0, 740, 740),
        (0.3 * 3, 0.1, 9, 9),
        (740.0 - 1e-8, 1.0, 740, 740),
        (740.0 + 1e-8, 1.0, 740, 740),
        (20.0, 7.0, 2, 3),
        (0.4, 1.0, 0, 1),
        (0.0, 1.0, 0, 0),
        (-0.5, 1.0, -1, -1),
        (-2.5, 1.0, -3, -3),
        (-2.0, 1.0, -2, -2),
    ],
)
def test_last_slot_up_to_a_bound(bound_s: float, slot_s: float, whole: int, begun: int) -> None:
    """Rounding neither loses a slot nor begins one; below zero none is begun."""
    assert last_slot(bound_s, slot_s, begun=False) == whole
    assert last_slot(bound_s, slot_s, begun=True) == begun
