"""A model in which an unknown levels out at two rates, in different constraints."""

from dataclasses import dataclass

import numpy as np
import pytest

import optuav
from optuav.errors import InputError


@dataclass(frozen=True)
class TwoRates(optuav.Formulation):
    """Two exponentials of the hover time, each in a constraint of its own."""

    def declare(self, model, given):  # type: ignore[no-untyped-def]
        """The second binds: exp(−0.05 Δ) ≥ 0.1 at Δ = 20 ln 10."""
        hover = model.variable("hover_time_s", "Δ", unit="s")
        given.keep_deadline(model, "deadline", hover)
        model.maximise(hover)
        model.subject_to("slow", np.exp(-0.01 * hover) >= 0.5)
        model.subject_to("fast", np.exp(-0.05 * hover) >= 0.1)


def test_the_bracket_refuses_two_rates_and_another_engine_answers() -> None:
    """It once took the last rate for both constraints, and called the wrong answer optimal."""
    program = optuav.formulate("paper", TwoRates(), perspective="battery")
    assert "bracket" not in program.engines
    assert program.solve().hover_time_s == pytest.approx(20.0 * np.log(10.0), abs=1e-5)
    with pytest.raises(InputError, match="two rates"):
        optuav.solve("paper", TwoRates(), perspective="battery", engine="bracket")
