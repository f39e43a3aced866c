"""Take the picture of the explorer: ``python docs/make_screenshot.py``; Chromium is needed.

Take it again after a change of the explorer's page.
"""

from __future__ import annotations

import shutil
import threading
from pathlib import Path

from playwright.sync_api import sync_playwright

import optuav
from optuav.explorer.server import Server

FILE = Path(__file__).parent / "_static" / "explorer.png"
SIZE = {"width": 1400, "height": 900}


def take() -> None:
    """Open the explorer on the mission `paper`, wait for its answer, and write the picture."""
    with Server(optuav.load("paper")) as server, sync_playwright() as running:
        threading.Thread(target=server.serve_forever, args=(0.01,), daemon=True).start()
        found = running.chromium.launch(
            executable_path=shutil.which("chromium"), args=["--no-sandbox"]
        )
        page = found.new_page(viewport=SIZE, color_scheme="light", reduced_motion="reduce")
        page.goto(server.address)
        page.wait_for_load_state("networkidle")
        page.screenshot(path=FILE)
        found.close()
        server.shutdown()


if __name__ == "__main__":
    take()
