"""What the constraints of the paper's problems limit is data, which other modules rely on."""

from __future__ import annotations

import pytest

import optuav
from formulations.formulation import Formulation
from formulations.p1 import P1
from formulations.p2 import P2
from formulations.p3 import P3
from formulations.p4 import P4
from optuav.modelling.check import relations

LIMITS = {"state of charge", "dry", "past full", "deadline"}


@pytest.mark.parametrize("problem", [P1(), P2(), P3(), P4("b1")], ids=str)
def test_limits_of_a_flight_are_stated_by_kind(problem: Formulation) -> None:
    """With a rest and without: then the deadline is the upper bound of the hover time."""
    for part in optuav.formulate("paper", problem).parts:
        stated = [*relations(part.model)]
        assert {each.kind for each in stated} >= LIMITS
        wells = [each for each in stated if each.kind in ("dry", "past full")]
        assert all(each.step is not None for each in wells)
        assert all(each.step is None for each in stated if each not in wells)
