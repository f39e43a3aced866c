"""What the tests of the explorer share."""

from __future__ import annotations

import shutil
import signal
import threading
from collections.abc import Callable, Iterator
from typing import Any

import pytest

import optuav
from optuav.explorer.server import Server

CHROMIUM = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), ""
)
EVIL = "<img src=x onerror=\"document.title='run'\">"
Open = Callable[..., Any]


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


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    if not CHROMIUM:
        pytest.skip("Chromium is not installed")
    playwright.expect.set_options(timeout=30_000)  # Of a machine that does other things too
    with playwright.sync_playwright() as running:
        # Its sandbox does not start for root, nor in many containers; the pages are our own.
        flags = ["--no-sandbox"]
        try:
            launched = running.chromium.launch(executable_path=CHROMIUM, args=flags)
        except playwright.Error as error:  # as for a user without a home
            pytest.skip(f"Chromium does not start here: {str(error).splitlines()[0]}")
        yield launched
        launched.close()


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    mission = optuav.load("paper").replace({"buildings.b7.name": EVIL, "name": f"{EVIL} paper"})
    with Server(mission) as server:
        threading.Thread(target=server.serve_forever, args=(0.01,), daemon=True).start()
        yield server.address
        server.shutdown()


@pytest.fixture(scope="module")
def idle_pages() -> list[Any]:
    """Pages that no test has open, at a blank address.

    A page that has been used opens in half the time of a new one, whose process is a new one too.
    """
    return []


@pytest.fixture
def open_page(browser: Any, address: str, idle_pages: list[Any]) -> Iterator[Open]:
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
        page = idle_pages.pop() if idle_pages else browser.new_page(reduced_motion="reduce")
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
    idle_pages.extend(pages)
    assert errors == []
