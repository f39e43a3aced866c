"""``optuav coverage``: what it prints and its exit codes."""

import json
from pathlib import Path

import pytest

from optuav.cli import main
from tests.wells import SLOW


def run(*arguments: str) -> int:
    """The exit code of the command."""
    with pytest.raises(SystemExit) as end:
        main(["coverage", *arguments])
    return int(end.value.code or 0)


OF_SLOW = [f"--set={key}={value}" for key, value in SLOW.items()]


def test_share_fleet_and_pads(capsys: pytest.CaptureFixture[str]) -> None:
    """One drone, a fleet, and what pads must deliver."""
    assert run("matrice350", *OF_SLOW) == 0
    assert "Share        25.41 %" in capsys.readouterr().out
    assert run("matrice350", "--share", "1", "--json") == 0
    assert json.loads(capsys.readouterr().out)["drones"] == 4
    assert run("matrice350", "--drones", "3", "--perspective", "battery") == 0
    assert "619 W" in capsys.readouterr().out


def test_pads_are_saved_and_printed_as_data_too(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """With --json, and in the file of --save: nothing that was asked for is left out."""
    file = tmp_path / "pads.json"
    asked = ("matrice350", "--drones", "3", "--perspective", "battery", "--save", str(file))
    assert run(*asked, "--json") == 0
    for text in (capsys.readouterr().out, file.read_text("utf-8")):
        found = json.loads(text)
        assert found["pad_drones"] == 3
        assert found["pad_power_W"] == pytest.approx(619, abs=0.5)
        assert found["pad_accepted"] is False


def test_drones_in_turns_and_their_pads(capsys: pytest.CaptureFixture[str]) -> None:
    """N times the share of one, up to all of the time; no pads beside an exchange of packs."""
    assert run("matrice350", *OF_SLOW, "--drones", "3") == 0
    assert "Turns of 3 drones cover 76.23 % of the time" in (out := capsys.readouterr().out)
    assert "Pads of 3 drones for 100 % of the time: 620.8 W on b4" in " ".join(out.split())
    assert run("matrice350", *OF_SLOW, "--drones", "3", "--overlap-s", "30") == 0
    out = capsys.readouterr().out  # 3 (1797.05 s - 30 s) of 7072.16 s
    assert "Turns of 3 drones cover 74.96 % of the time, 30 s of overlap" in out
    assert run("matrice350", "--drones", "2", "--swap-s", "120") == 0
    out = capsys.readouterr().out
    assert "Turns of 2 drones cover 100 % of the time" in out
    assert "Pads" not in out
    assert run("matrice350", *OF_SLOW, "--drones", "1") == 0
    out = capsys.readouterr().out
    assert "Turns of 1 drone cover 25.41 % of the time" in out
    assert "no pad is strong enough for 1 drone:" in out


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["paper", "--share", "0"], 2, "--share = 0.0: must be a number, 0 < x <= 1000"),
        (["paper", "--overlap-s", "900"], 2, "--overlap-s = 900.0: must be at most half"),
        (["matrice350", "--pad-power-W", "20"], 2, "--pad-power-W = 20.0: must exceed"),
        (["paper", "--drones", "0"], 2, "--drones = 0: must be a whole number"),
        (["paper", "--swap-s", "-1"], 2, "--swap-s = -1.0"),
        (["paper", "--swap-s", "60", "--drones", "0"], 2, "--drones = 0: must be a whole number"),
        (["paper", "--hours", "2", "--share", "1"], 2, "leave out --share and --horizon"),
        (["paper", "--dark-hover", "--horizon-hours", "2"], 2, "error: --dark-hover: must be left"),
        (["paper", "--horizon-hours", "0"], 2, "--horizon-hours = 0.0: must be a number"),
        (["paper", "--hours", "2", "--drones", "1"], 1, "1 drone cannot cover 2 h"),
        (["paper", "--set", "battery.capacity_As=1000"], 1, "no building allows a hover"),
    ],
)
def test_bad_input_ends_with_one_error(
    arguments: list[str], code: int, words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """No traceback."""
    assert run(*arguments) == code
    assert words in " ".join(capsys.readouterr().err.split())


def test_an_endless_hover_is_valid_json(capsys: pytest.CaptureFixture[str]) -> None:
    """Strict JSON has no infinity."""
    strong = ["--set", "laser.power_W=1e6", "--set", "battery.charge_current_A=900"]
    assert run("paper", *strong, "--json") == 0

    def refuse(name: str) -> None:
        raise ValueError(name)

    assert json.loads(capsys.readouterr().out, parse_constant=refuse)["share"] == 1.0


def test_a_day_and_an_event(capsys: pytest.CaptureFixture[str]) -> None:
    """--horizon-hours and --hours, alone, together and with what asks for a fleet."""
    assert run("paper", "--horizon-hours", "8") == 0
    assert "3277.31 s of at most 3305.80 s" in capsys.readouterr().out
    assert run("matrice350", "--hours", "2") == 0
    assert "Drones       3" in (out := capsys.readouterr().out)
    assert "on b4; take off 39.26 s before a hover" in out
    assert run("matrice350", "--hours", "2", "--drones", "4") == 0
    assert run("matrice350", "--hours", "2", "--drones", "2") == 1
    assert "at least 3" in capsys.readouterr().err
    assert run("paper", "--horizon-hours", "8", "--drones", "3") == 2
    assert "--horizon-hours" in capsys.readouterr().err
    assert run("paper", "--hours", "8", "--share", "1") == 2
    assert run("paper", "--horizon-hours", "0.01") == 1
    assert run("paper", "--hours", "0") == 2
