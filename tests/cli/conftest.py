"""Pictures that commands write have fewer dots; what they look like is tested in `tests/plots`."""

from __future__ import annotations

from importlib.util import find_spec

import pytest


@pytest.fixture(autouse=True)
def fewer_dots(monkeypatch: pytest.MonkeyPatch) -> None:
    if find_spec("matplotlib"):
        monkeypatch.setattr("optuav.plots.style.DOTS_PER_INCH", 40)
