"""Fewer fits, for tests that do not need several starts."""

from __future__ import annotations

import pytest

from optuav.calibration import table


@pytest.fixture(autouse=True)
def fewer_fits(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """One start of a table instead of three, apart from fixtures of a module."""
    if not request.node.get_closest_marker("soak"):
        monkeypatch.setattr(table, "SCALES", (1.0,))
