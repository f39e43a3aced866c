"""Hypothesis profiles, the tests that run only when asked for, and what campaigns have counted."""

from __future__ import annotations

import pytest
from hypothesis import settings
from hypothesis.internal import conjecture

# The same examples on every machine, so that what passes here passes in CI; soak draws afresh.
settings.register_profile("default", deadline=None, derandomize=True, max_examples=50)
settings.register_profile(
    "soak", deadline=None, derandomize=False, max_examples=10_000, print_blob=True
)
settings.load_profile("default")


def pytest_sessionstart() -> None:
    """Draw no constants from the modules that happen to be loaded.

    With them the examples of a test depend on which tests ran before it in the same worker.
    Hypothesis has no public way to say so; where its names have changed, a test tells.
    """
    providers = getattr(conjecture, "providers", None)
    if settings().derandomize and hasattr(providers, "Constants"):
        providers._get_local_constants = providers.Constants


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--soak", action="store_true", help="run the tests marked soak as well")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Slow tests first, so that none of them is left to one worker at the end."""
    items.sort(key=lambda item: item.get_closest_marker("slow") is None)
    if config.getoption("--soak") or "soak" in config.getoption("-m"):
        return
    skip = pytest.mark.skip(reason="a soak test: give --soak")
    for item in items:
        if item.get_closest_marker("soak"):
            item.add_marker(skip)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Tell what tests recorded as ``count``, one line each."""
    for outcome in ("passed", "failed"):
        for report in terminalreporter.getreports(outcome):
            for name, words in report.user_properties:
                if name == "count":
                    terminalreporter.write_line(f"{report.nodeid}: {words}")
