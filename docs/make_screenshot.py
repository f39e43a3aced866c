"""Take the pictures of the explorer and of the site's preview; Chromium is needed.

Run ``python docs/make_screenshot.py`` again after a change of the explorer's page or of the films.
"""

from __future__ import annotations

import shutil
import threading
from pathlib import Path

from make_films import standalone
from playwright.sync_api import sync_playwright

import optuav
from optuav.explorer.server import Server

STATIC = Path(__file__).parent / "_static"
EXPLORER_PX = {"width": 1400, "height": 900}
PREVIEW_PX = {"width": 1200, "height": 630}
PREVIEW = """\
<style>
body {{color: #1a1a1a; font-family: system-ui, "DejaVu Sans", sans-serif; margin: 0}}
h1 {{font-size: 54px; margin: 20px 0 12px; text-align: center}}
div {{margin: auto; width: 1040px}}
</style>
<h1>Keep a drone in the air with a laser</h1>
<div>{films}</div>
"""
"""The picture of a link to the site: what it is about, and the films standing still."""


def take() -> None:
    """Write the explorer's picture, on the mission `paper`, and the preview."""
    with Server(optuav.load("paper")) as server, sync_playwright() as running:
        threading.Thread(target=server.serve_forever, args=(0.01,), daemon=True).start()
        found = running.chromium.launch(
            executable_path=shutil.which("chromium"), args=["--no-sandbox"]
        )
        page = found.new_page(viewport=EXPLORER_PX, color_scheme="light", reduced_motion="reduce")
        page.goto(server.address)
        page.wait_for_load_state("networkidle")
        page.screenshot(path=STATIC / "explorer.png")
        page.set_viewport_size(PREVIEW_PX)
        page.set_content(PREVIEW.format(films=standalone()))
        page.screenshot(path=STATIC / "preview.png")
        found.close()
        server.shutdown()


if __name__ == "__main__":
    take()
