"""Every public name explains itself by an example, and examples print what they show."""

from __future__ import annotations

import doctest
import importlib
import inspect
from pathlib import Path

import pytest

import optuav

NAMES = [name for name in optuav.__all__ if name not in ("__version__", "city", "plots")]
ROOT = Path(__file__).parents[1]
MODULES = [
    ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
    for package in ("optuav", "formulations")
    for path in sorted((ROOT / package).rglob("*.py"))
    if ">>> " in path.read_text("utf-8")
]


@pytest.mark.parametrize("name", NAMES)
def test_a_public_name_has_an_example(name: str) -> None:
    """Its own docstring, not an inherited one, holds at least one line that runs."""
    assert ">>> " in inspect.cleandoc(getattr(optuav, name).__doc__ or "")


@pytest.mark.parametrize("module", MODULES)
def test_examples_print_what_they_show(module: str) -> None:
    """All of a module: of names that users call, and of those that only the house calls."""
    tried = doctest.testmod(importlib.import_module(module))
    assert tried.attempted > 0
    assert tried.failed == 0
