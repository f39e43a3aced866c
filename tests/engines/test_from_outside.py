"""Engines of users: what they return is looked at before it becomes a plan."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

import optuav
from optuav.engines.closed_form import ClosedForm
from optuav.engines.solution import Solution
from optuav.errors import SolverError
from optuav.modelling import Model


@dataclass(frozen=True)
class Changed(ClosedForm):
    """The closed form with its solution changed."""

    change: Callable[[Solution], Any]
    name: str = "changed"

    def solve(  # type: ignore[override]
        self, model: Model, programmes: int, *_: object, **__: object
    ) -> Solution:
        found: Solution = self.change(ClosedForm().solve(model, programmes))
        return found


def test_the_objective_is_that_of_the_values_whatever_an_engine_says() -> None:
    """With the sign turned the shortest hover would be chosen; b1 gives SPEC's 719.540 s."""
    wrong: list[Callable[[Solution], Any]] = [
        lambda found: replace(found, objective=-found.objective),
        lambda found: replace(found, objective=found.objective + np.nan),
    ]
    for change in wrong:
        options = {"engine": Changed(change), "perspective": "battery"}
        assert optuav.solve("paper", **options).hover_time_s == pytest.approx(719.540, abs=1e-3)
        again = optuav.formulate("paper", **options).compile().solve()
        assert again.objective[0] == pytest.approx(719.540, abs=1e-3)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda found: None, "returned None, not a Solution"),
        (lambda found: replace(found, values={}), r"values\['hover_time_s'\] must be \d+ numbers"),
        (lambda found: replace(found, statuses=found.statuses[:-1]), "statuses must be"),
        (lambda found: replace(found, statuses=["optimal"] * len(found.statuses)), "Status"),
        (
            lambda found: replace(found, values={k: v + np.nan for k, v in found.values.items()}),
            "returned values that are not numbers",
        ),
    ],
)
def test_what_is_no_answer_to_the_model_is_an_error_in_words(
    change: Callable[[Solution], Any], words: str
) -> None:
    options = {"engine": Changed(change), "perspective": "battery"}
    with pytest.raises(SolverError, match=f"engine changed .*{words}"):
        optuav.solve("paper", **options)
    with pytest.raises(SolverError, match=f"engine changed .*{words}"):
        optuav.formulate("paper", **options).compile().solve()


@pytest.mark.parametrize("name", ["", "auto", "closed-form"])
def test_an_engine_needs_a_name_of_its_own(name: str) -> None:
    with pytest.raises(optuav.InputError, match=f"engine = '{name}': must be a name of its own"):
        optuav.solve(
            "paper", "P3", perspective="battery", engine=Changed(lambda found: found, name)
        )


def test_a_plan_of_an_engine_that_is_not_registered_cannot_be_explained() -> None:
    plan = optuav.solve("paper", "P3", perspective="battery", engine=Changed(lambda found: found))
    with pytest.raises(
        optuav.InputError, match="engine changed is not known by its name: register"
    ):
        optuav.explain(plan)
