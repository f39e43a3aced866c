"""A progress bar at a terminal that can redraw a line, and nothing elsewhere."""

from __future__ import annotations

import contextlib
import signal

import pytest
from rich.console import Console

from optuav.cli import main
from optuav.cli import output as bar


@pytest.mark.parametrize(("terminal", "kind"), [(True, "xterm"), (True, "dumb"), (False, "xterm")])
def test_a_terminal_sees_progress_and_a_pipe_does_not(
    terminal: bool, kind: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("TERM", kind)
    monkeypatch.setattr(Console, "is_terminal", terminal)
    shows = terminal and kind != "dumb"
    with bar.progress() as progress:
        assert (progress is not None) is shows
        if progress is not None:
            progress(1, 2, "P4 [bold] b1")
    shown = capsys.readouterr()
    assert shown.out == ""
    assert ("P4 [bold] b1" in shown.err) is shows


@pytest.mark.parametrize(
    "words",
    [
        ("ledger", "text-e1"),
        ("coverage", "matrice350", "--hours", "1"),
        ("solve", "paper", "--hover-point", "free", "--set", "buildings=[]"),
    ],
)
def test_what_may_take_seconds_shows_a_bar(
    words: tuple[str, ...], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The moving bar hides the cursor, as nothing else does."""
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(Console, "is_terminal", True)
    monkeypatch.setattr(signal, "signal", lambda *_: None)
    with contextlib.suppress(SystemExit):
        main([*words])
    assert "\x1b[?25l" in capsys.readouterr().err
