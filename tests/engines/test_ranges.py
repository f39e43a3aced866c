"""How many slots fit under a bound."""

from __future__ import annotations

import pytest

from optuav.engines.linear_form import last_slot, slot_ranges
from optuav.modelling import Model


def test_a_bound_infinitely_far_below_leaves_no_slot() -> None:
    """A rest that costs 2e-313 A, found by the campaign: its bound overflows, and none fits."""
    model = Model("overflow")
    hover = model.variable("hover", "Δ", unit="s", first_slot=1, upper=100.0)
    rest = model.variable("rest", "T'", unit="s", first_slot=1)
    model.maximise(hover)
    model.subject_to("charge", 600.0 + 30.0 * hover + 2e-313 * rest <= 540.0)
    assert slot_ranges(model, {}, 0.5)["rest"] == (1, 0)


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
