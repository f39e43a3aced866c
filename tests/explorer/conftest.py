"""What the tests of the explorer share."""

from __future__ import annotations

import shutil
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from functools import cache
from pathlib import Path
from typing import Any

import pytest

import optuav
from optuav.explorer.server import Server

CHROMIUM = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), ""
)
EVIL = "<img src=x onerror=\"document.title='run'\">"
Open = Callable[..., Any]
STARTED = ExitStack()
"""The browser and the server, as long as tests of this folder follow one another."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the tests that open the page in a browser."""
    for item in items:
        if "browser" in getattr(item, "fixturenames", ()):
            item.add_marker(pytest.mark.page)


@pytest.fixture(scope="module", autouse=True)
def broken_pipes_are_errors() -> Iterator[None]:
    """As in a fresh process; commands that other tests run in this one may end it by a signal."""
    if not hasattr(signal, "SIGPIPE"):
        yield
        return
    before = signal.signal(signal.SIGPIPE, signal.SIG_IGN)
    yield
    signal.signal(signal.SIGPIPE, before)


@pytest.hookimpl(trylast=True)
def pytest_runtest_teardown(nextitem: pytest.Item | None) -> None:
    """Close the browser and the server after the last of the tests of this folder in a row.

    They take seconds to start. A browser that is left open is in the way of other event loops.
    """
    if nextitem is None or nextitem.path.parent != Path(__file__).parent:
        STARTED.close()


@cache
def launched() -> Any:
    """The browser of all tests in a row; where it does not start, why, for all tests to come."""
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    if not CHROMIUM:
        return "Chromium is not installed"
    playwright.expect.set_options(timeout=30_000)  # Of a machine that does other things too
    with ExitStack() as started:  # A loop that is left open fails every later start
        # Its sandbox does not start for root, nor in many containers; the pages are our own.
        flags = ["--no-sandbox"]
        try:
            running = started.enter_context(playwright.sync_playwright())
            found = running.chromium.launch(executable_path=CHROMIUM, args=flags)
        except Exception as error:  # A long TMPDIR, no home, or a library is missing
            return f"Chromium does not start here: {str(error).splitlines()[0]}"
        started.callback(found.close)
        STARTED.push(started.pop_all())
        STARTED.callback(launched.cache_clear)
    return found


@cache
def served() -> str:
    """The address of the server of all tests in a row."""
    STARTED.callback(served.cache_clear)
    mission = optuav.load("paper").replace({"buildings.b7.name": EVIL, "name": f"{EVIL} paper"})
    server = STARTED.enter_context(Server(mission))
    threading.Thread(target=server.serve_forever, args=(0.01,), daemon=True).start()
    STARTED.callback(server.shutdown)
    return server.address


@pytest.fixture
def browser() -> Any:
    found = launched()
    if isinstance(found, str):
        pytest.skip(found)
    return found


@pytest.fixture
def address() -> str:
    return served()


@cache
def idle_pages() -> list[Any]:
    """Pages that no test has open, at a blank address.

    A page that has been used opens in half the time of a new one, whose process is a new one too.
    """
    STARTED.callback(idle_pages.cache_clear)
    return []


@pytest.fixture
def open_page(browser: Any, address: str) -> Iterator[Open]:
    """A function that opens the page; no page may have reported an error."""
    pages, errors = [], []

    def heard(message: Any) -> None:
        if message.type == "error":
            errors.append(message.text)

    def raised(error: Any) -> None:
        errors.append(str(error))

    def opened(
        width: int = 1400, scheme: str = "light", fragment: str = "", height: int = 900
    ) -> Any:
        page = idle_pages().pop() if idle_pages() else browser.new_page(reduced_motion="reduce")
        pages.append(page)
        page.on("console", heard)
        page.on("pageerror", raised)
        page.set_viewport_size({"width": width, "height": height})
        page.emulate_media(color_scheme=scheme)
        page.goto(address + fragment)
        page.locator("figure svg[role=img]").first.wait_for()
        return page

    yield opened
    for page in pages:
        page.mouse.up()  # As a test that failed may have left it
        page.mouse.move(0, 0)
        page.goto("about:blank")
        page.remove_listener("console", heard)
        page.remove_listener("pageerror", raised)
    idle_pages().extend(pages)
    assert errors == []
