"""Certificates in few digits prove what those of all digits prove."""

from __future__ import annotations

from fractions import Fraction

import pytest

import optuav
from optuav.diagnosis.proving import certificates
from optuav.diagnosis.short import shortened, written
from tests.diagnosis.missions import PAPER


@pytest.mark.parametrize(
    ("change", "options"),
    [
        ({"limits.deadline_s": 50.0}, {"problem": "P3"}),
        ({"limits.deadline_s": 75.792}, {"problem": "P3"}),
        ({"limits.min_soc": 0.99}, {"problem": "P3"}),
        (
            {"limits.min_soc": 0.99, "limits.deadline_s": 300.0},
            {"problem": "P4", "building": "b9"},
        ),
    ],
)
def test_rows_say_less_and_still_contradict(
    change: dict[str, float], options: dict[str, str]
) -> None:
    """Hand-checkable: exact sum, every number short, every row implied by the mission's own."""
    program = optuav.formulate(PAPER.replace(change), perspective="battery", **options)
    part = program.parts[0]
    proofs = [*certificates(part.model, part.model.row(0))]
    assert proofs
    for proof in proofs:
        short = shortened(proof)
        assert short.holds()
        own = {(row.label, *row.coefficients): row for row in proof.rows}
        for row in short.rows:
            full = own[row.label, *row.coefficients]
            assert row.limit >= full.limit
            assert all(row.coefficients[s] <= a for s, a in full.coefficients.items())
            assert len(written(row.limit)) <= 12
            assert Fraction(written(row.multiplier).replace("−", "-")) == row.multiplier


def test_numbers_are_written_in_full_or_said_to_be_rounded() -> None:
    """A decimal that ends, a fraction, and one too long for either."""
    assert written(Fraction(-1, 8)) == "−0.125"
    assert written(Fraction(1, 3)) == "1/3"
    assert written(Fraction(10**15 + 1, 3**20)) == "≈286797"
