"""A bar for a person at a terminal, and nothing for a pipe."""

from __future__ import annotations

import pytest

from optuav.cli import progress as bar


@pytest.mark.parametrize("terminal", [True, False])
def test_a_terminal_sees_progress_and_a_pipe_does_not(
    terminal: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(bar.Console, "is_terminal", terminal)
    with bar.progress() as progress:
        assert (progress is not None) is terminal
        if progress is not None:
            progress(1, 2, "P4 [bold] b1")
    shown = capsys.readouterr()
    assert shown.out == ""
    assert ("P4 [bold] b1" in shown.err) is terminal
