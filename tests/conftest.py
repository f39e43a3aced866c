"""Hypothesis profiles, the tests that run only when asked for, and what campaigns have counted."""

from __future__ import annotations

import gc
import os
import zlib
from collections.abc import Generator
from typing import Any

import pytest
from hypothesis import is_hypothesis_test, seed, settings
from hypothesis.internal import conjecture

from tests.examples import SUITE

# Texts have the width that they have without it; pytest-xdist sets it.
os.environ.pop("COLUMNS", None)
settings.register_profile("default", deadline=None, derandomize=True, max_examples=SUITE)
settings.register_profile(
    "soak",
    deadline=None,
    derandomize=False,
    max_examples=int(os.environ.get("EXAMPLES", "500")),
    print_blob=True,
)
settings.load_profile("default")


def pytest_sessionstart() -> None:
    """Draw no constants from the modules that happen to be loaded.

    With them the examples of a test depend on which tests ran before it in the same worker.
    Hypothesis has no public way to say so; a test fails where its names have changed.
    """
    providers = getattr(conjecture, "providers", None)
    if settings().derandomize and hasattr(providers, "Constants"):
        providers._get_local_constants = providers.Constants


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Seed the examples of a test by its name, so that what passes here passes in CI.

    Hypothesis would seed them by the test's source as Python's tokenizer reads it, which differs
    between Python 3.11 and 3.12 in f-strings. Examples still differ with the version of Hypothesis,
    and those of text with Python's tables of Unicode. The profile soak draws afresh.
    """
    test = getattr(item, "obj", None)
    if settings().derandomize and is_hypothesis_test(test):
        seed(zlib.crc32(item.nodeid.encode()))(test)


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--soak", action="store_true", help="run the tests marked soak as well")


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Slow tests first, so that none of them is left to one worker at the end; no soak tests."""
    items.sort(key=lambda item: item.get_closest_marker("slow") is None)
    if config.getoption("--soak") or "soak" in config.getoption("-m"):
        return
    soak = [item for item in items if item.get_closest_marker("soak")]
    if len(soak) == len(items):  # A soak test that is asked for by name says what it waits for.
        for item in soak:
            item.add_marker(pytest.mark.skip(reason="a soak test: give --soak"))
        return
    items[:] = [item for item in items if not item.get_closest_marker("soak")]
    config.hook.pytest_deselected(items=soak)


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, Any, Any]:
    """What is imported and collected stays: the garbage collector need not look at it."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.collect()
        gc.freeze()
        gc.enable()


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Print what tests recorded as ``count``, one line each."""
    for outcome in ("passed", "failed"):
        for report in terminalreporter.getreports(outcome):
            for name, words in report.user_properties:
                if name == "count":
                    terminalreporter.write_line(f"{report.nodeid}: {words}")
