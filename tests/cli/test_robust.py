"""``optuav robust``: what it prints and its exit codes."""

import json
from pathlib import Path

import pytest

from optuav.cli import main


def run(*arguments: str) -> int:
    """The exit code of the command."""
    with pytest.raises(SystemExit) as end:
        main(["robust", *arguments])
    return int(end.value.code or 0)


def test_a_box_from_a_file(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    """As text and as JSON, for P1 and P4; 1 where nothing holds, 2 for bad input."""
    box = tmp_path / "box.toml"
    box.write_text("drain = { percent = 5 }\ncharge = { percent = 10 }\n", "utf-8")
    assert run("paper", str(box)) == 0
    assert "555.81 s" in capsys.readouterr().out
    chosen = ("--problem", "P4", "--building", "b9", "--order", "hover-first", "--json")
    assert run("paper", str(box), *chosen) == 0
    assert json.loads(capsys.readouterr().out)["hover_s"] == pytest.approx(555.810, abs=5e-4)
    box.write_text("drain = { low = 0.5, high = 20 }\n", "utf-8")
    assert run("paper", str(box)) == 1
    assert "whole box" in capsys.readouterr().err
    box.write_text("drain = { percent = -1 }\n", "utf-8")
    assert run("paper", str(box)) == 2
    assert run("paper", str(tmp_path / "none.toml")) == 2
    assert "Traceback" not in capsys.readouterr().err
