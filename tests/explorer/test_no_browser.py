"""Where Chromium is there but does not start, the tests of the page say so, and none fails."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")


@pytest.mark.skipif(os.name != "posix", reason="the stand-in for Chromium is a shell script")
def test_a_browser_that_does_not_start_skips_all_its_tests(tmp_path: Path) -> None:
    """As in a long TMPDIR; no loop of Playwright is left open, which would fail the next test."""
    (tmp_path / "chromium").write_text("#!/bin/sh\nexit 1\n")
    (tmp_path / "chromium").chmod(0o755)
    place = f"{tmp_path}{os.pathsep}{os.environ['PATH']}"
    test = "tests/explorer/test_browser.py::test_{}"
    names = (
        "every_slider_moves_its_key_and_the_plan",
        "a_touch_drags_a_point_through_its_answers",
    )
    asked = ["-m", "pytest", "-q", "-n0", "-p", "no:cacheprovider", *map(test.format, names)]
    ran = subprocess.run(
        [sys.executable, *asked],
        cwd=Path(__file__).parents[2],
        env=os.environ | {"PATH": place},
        capture_output=True,
        text=True,
        check=False,
    )
    assert "2 skipped" in ran.stdout
    assert "Chromium does not start here: " in ran.stdout
    assert (ran.returncode, "error" in ran.stdout.splitlines()[-1]) == (0, False)
