"""``optuav return``: what it prints and its exit codes."""

import json
from pathlib import Path

import pytest

from optuav.cli import main


def run(*arguments: str) -> int:
    """The exit code of the command."""
    with pytest.raises(SystemExit) as end:
        main(["return", *arguments])
    return int(end.value.code or 0)


def test_moments_are_printed_saved_and_drawn(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """As text, as JSON, as a table and as a picture."""
    assert run("paper") == 0
    assert "577.52" in capsys.readouterr().out
    assert run("paper", "--json") == 0
    assert json.loads(capsys.readouterr().out)["rows"][0]["place"] == "destination"
    assert run("paper", "--save", str(tmp_path / "r.csv"), "--plot", str(tmp_path)) == 0
    assert (tmp_path / "r.csv").read_text("utf-8").startswith("place,flight_s,dry_s")
    assert (tmp_path / "return.png").stat().st_size > 0


def test_exit_codes(capsys: pytest.CaptureFixture[str]) -> None:
    """1 where no hover point is reached, 2 for bad input, each with one clear line."""
    empty = ("--set", "start.available_As=100", "--set", "start.bound_As=14400")
    assert run("paper", *empty) == 1
    assert "runs dry before" in capsys.readouterr().err
    assert run("nowhere") == 2
    assert run("paper", "--save", "r.png") == 2
    assert "Traceback" not in capsys.readouterr().err
