"""Every public name explains itself by an example, which `make doctest` runs."""

from __future__ import annotations

import inspect

import pytest

import optuav

NAMES = [name for name in optuav.__all__ if name not in ("__version__", "plots")]


@pytest.mark.parametrize("name", NAMES)
def test_a_public_name_has_an_example(name: str) -> None:
    """Its own docstring, not an inherited one, holds at least one line that runs."""
    assert ">>> " in inspect.cleandoc(getattr(optuav, name).__doc__ or "")
