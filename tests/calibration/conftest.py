"""Intervals by bootstrap of which all that counts is that they are there, or hold the truth."""

from __future__ import annotations

import pytest

from optuav.calibration import least_squares


@pytest.fixture(autouse=True)
def few_refits(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """A hundred, not four hundred, but where rates are counted at length."""
    if not request.node.get_closest_marker("soak"):
        monkeypatch.setattr(least_squares, "REPLICATES", 100)
