"""What a formulation is given counts a rest that is a number, as it counts one that is unknown."""

from __future__ import annotations

import pytest

from formulations.formulation import Given
from optuav.modelling import Model, check
from tests.formulations.given import quantities


def test_a_rest_of_fixed_length_takes_time_and_charges() -> None:
    """30 s of rest: 1000 A s less 100 in flight and 10 x 60 in hover, and 5 x 30 back."""
    given, model = Given.of(quantities(), "battery"), Model("fixed rest")
    hover = model.variable("hover_time_s", "Δ", unit="s")
    model.maximise(hover)
    model.subject_to("charge", given.soc_end(hover, 30.0) >= given.min_soc)
    given.keep_deadline(model, "deadline", hover, 30.0)
    charge, deadline = list(check(model, {"hover_time_s": 60.0}))[:2]
    assert charge.left == pytest.approx(0.45)
    assert (deadline.left, deadline.right) == pytest.approx((90.0, 150.0))
