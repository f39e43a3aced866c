"""Fewer fits, for tests that need neither the last digits of a bootstrap nor several starts."""

from __future__ import annotations

import pytest

from optuav.calibration import least_squares, table


@pytest.fixture(autouse=True)
def fewer_fits(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """A hundred refits instead of four hundred, one start of a table instead of three.

    Not where rates are counted at length, nor in fixtures of a module.
    """
    if not request.node.get_closest_marker("soak"):
        monkeypatch.setattr(least_squares, "REPLICATES", 100)
        monkeypatch.setattr(table, "SCALES", (1.0,))
