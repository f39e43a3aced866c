"""Solutions: no value without an answer, no answer that was not evaluated again."""

from __future__ import annotations

import numpy as np
import pytest

from optuav.engines.solution import Solution, Status, verify
from optuav.errors import SolverError
from optuav.modelling import Model, Parameter


def two_answers(x: float) -> Solution:
    """A value, and a programme without one."""
    return Solution(
        engine="test",
        proof="none",
        statuses=[Status.OPTIMAL, Status.INFEASIBLE],
        objective=np.array([x, np.nan]),
        values={"x": np.array([x, np.nan])},
        binding={"limit": np.array([True, False]), "other": np.array([False, False])},
    )


def limited() -> Model:
    """x at most 3 in the first programme, at most 4 in the second."""
    model = Model("test")
    x = model.variable("x", "x", unit="s")
    model.subject_to("limit", x <= Parameter("p", "p", "s", np.array([3.0, 4.0])))
    return model


@pytest.mark.parametrize("status", list(Status))
def test_which_statuses_have_values(status: Status) -> None:
    assert status.has_answer == (status.value in ("optimal", "locally_optimal", "feasible"))


def test_value_of_a_failed_solve_cannot_be_read() -> None:
    """NaN must not travel on as a time."""
    assert two_answers(3.0).point(0) == {"x": 3.0}
    with pytest.raises(SolverError, match="infeasible"):
        two_answers(3.0).point(1)


def test_labels_of_what_binds() -> None:
    assert two_answers(3.0).binding_labels(0) == ("limit",)
    assert two_answers(3.0).binding_labels(1) == ()


def test_answers_are_evaluated_again_with_their_own_parameters() -> None:
    """3 is feasible in the first programme, 3.5 only in the second, NaN nowhere."""
    verify(limited(), two_answers(3.0), 0)
    for wrong, excess in ((3.5, "0.5"), (np.nan, "nan"), (-1.0, "1")):
        with pytest.raises(SolverError, match=f"by {excess}"):
            verify(limited(), two_answers(wrong), 0)
