"""``optuav sweep``: what it says, draws and refuses."""

from __future__ import annotations

import io
import json
import sys
from pathlib import Path

import pytest
from rich.console import Console

import optuav
from optuav.cli import output as bar
from tests.cli.run import refused, run, words

STUDY = """
perspective = ["battery", "available"]
scenarios_per_part = 4
grid.limits.deadline_s = [600, 900]
grid.battery.capacity_As = [30_000, 36_000, 42_000]
"""
HOVER_S = {
    name: [
        optuav.solve(
            optuav.load("paper").replace({"limits.deadline_s": s, "battery.capacity_As": c}),
            perspective=name,
        ).hover_time_s
        for s in (600, 900)
        for c in (30_000, 36_000, 42_000)
    ]
    for name in ("battery", "available")
}


@pytest.fixture
def study(tmp_path: Path) -> Path:
    """Six scenarios in two parts."""
    file = tmp_path / "sizes.toml"
    file.write_text(STUDY)
    return file


def test_it_says_what_is_done_and_what_was_there(study: Path) -> None:
    first = run("sweep", str(study))
    assert first.code == 0
    directory = study.with_suffix("")
    battery, available = (
        f"Plans {name} 6 Hover {name} {min(values):.2f} to {max(values):.2f} s"
        for name, values in HOVER_S.items()
    )
    assert words(first.out) == words(
        f"Scenarios 6 Parts 2 Directory {directory} {battery} {available}"
    )
    (directory / "part-000001.parquet").unlink()
    assert "Parts        2, 1 of them from before" in run("sweep", str(study)).out
    again = json.loads(run("sweep", str(study), "--json").out)
    assert again.pop("elapsed_s") >= 0.0
    for name, ends in again.pop("hover_time_s").items():
        assert [ends["shortest"], ends["longest"]] == pytest.approx(
            [min(HOVER_S[name]), max(HOVER_S[name])], abs=1e-9
        )
    assert again.pop("hash") == json.loads((directory / "manifest.json").read_text())["hash"]
    assert again == {
        **{"kind": "optuav sweep", "directory": str(directory)},
        **{"scenarios": 6, "parts": 2, "kept": 2, "plans": {"battery": 6, "available": 6}},
        "without_plan": {"battery": 0, "available": 0},
        "pictures": [],
        "reasons": {"battery": {}, "available": {}},
    }


def test_scenarios_without_a_plan_are_counted_with_their_reasons(study: Path) -> None:
    """For each perspective, as they are in the parts."""
    study.write_text(STUDY.replace("[600, 900]", "[60, 900]").replace("42_000", "3_000"))
    said = json.loads(run("sweep", str(study), "--json").out)
    found = optuav.open_sweep(study.with_suffix(""))
    words = found.reason.attrs["words"].splitlines()
    for name in ("battery", "available"):
        of_one = found.sel(perspective=name)
        assert said["plans"][name] == of_one.hover_time_s.notnull().sum()
        assert said["without_plan"][name] == of_one.hover_time_s.isnull().sum() >= 3
        numbers = of_one.reason.values.ravel()
        expected = {words[each]: int((numbers == each).sum()) for each in {*numbers} - {0}}
        assert said["reasons"][name] == expected
    assert "3 without: the shortest flight" in run("sweep", str(study)).out


def test_what_is_broken_is_replaced_unasked(study: Path) -> None:
    """The files are the sweep's own: no --force is needed for a part that a disk has spoilt."""
    run("sweep", str(study))
    part = study.with_suffix("") / "part-000001.parquet"
    whole = part.read_bytes()
    part.write_bytes(b"x" * len(whole))
    assert "2, 1 of them from before" in run("sweep", str(study), "--resume").out
    assert part.read_bytes() == whole
    assert "from before" not in run("sweep", str(study), "--no-resume").out


def test_a_study_without_a_name_states_its_directory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """From the standard input."""
    monkeypatch.chdir(tmp_path)
    for text, code in ((STUDY, 2), (f'output = "found"\n{STUDY}', 0)):
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(text.encode())))
        assert run("sweep", "-").code == code
    assert [path.name for path in tmp_path.iterdir()] == ["found"]


NAMES = ("hover-available", "hover-battery")


def test_two_keys_are_a_map_for_each_perspective(
    study: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("optuav.plots.files.image", lambda *_: b"")  # drawn, not rendered
    said = run("sweep", str(study), "--plot", str(tmp_path / "pictures"))
    pictures = sorted((tmp_path / "pictures").iterdir())
    names = [f"{name}.{ending}" for name in NAMES for ending in ("pdf", "png", "svg")]
    assert [each.name for each in pictures] == names
    for name in NAMES:
        assert f"wrote {tmp_path / 'pictures' / name}.png, .svg, .pdf" in said.out
    again = run("sweep", str(study), "--plot", str(tmp_path / "pictures"), "--json")
    assert sorted(json.loads(again.out)["pictures"]) == [*map(str, pictures)]


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("samples = { count = 9, battery.capacity_As = { percent = 5 } }", "hover.png"),
        ("paired.battery.capacity_As = [42_000, 30_000, 36_000]", "hover.png"),
        (
            "paired.battery.capacity_As = [42_000, 30_000]\ngrid.limits.deadline_s = [600, 900]",
            "hover-available.png",
        ),
    ],
)
def test_a_key_of_rows_is_drawn_as_one_of_a_grid(
    text: str, name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """From the standard input, which is read once."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("optuav.plots.files.image", lambda *_: b"")  # drawn, not rendered
    text = f'output = "found"\n{text}'
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(text.encode())))
    assert run("sweep", "-", "--plot", "pictures").code == 0
    assert [each.name for each in (tmp_path / "pictures").glob("*.png")] == [name]


@pytest.mark.parametrize(
    "more",
    [
        "grid.link.transmit_power_W = [0.1, 0.2]\ngrid.limits.min_soc = [0.1, 0.2]",
        "samples = { count = 4, body.mass_kg = { percent = 5 }, laser.power_W = { percent = 5 } }",
        "grid.laser.power_W = [1000]",
    ],
)
def test_what_cannot_be_drawn_is_refused_before_it_is_computed(more: str, study: Path) -> None:
    """Four keys, two of samples with two others, and a key with a single value."""
    study.write_text(STUDY.replace("grid.battery", f"{more}\ngrid.battery"))
    said = refused("sweep", str(study), "--plot", str(study.with_name("pictures")))
    assert words(said) == (
        "error: --plot: goes with up to three keys, of several values each, one of them in [grid]"
    )
    assert not study.with_suffix("").exists()


def test_faults_are_said_at_once_by_the_names_of_the_options(study: Path) -> None:
    study.write_text(f"colour = 3\nproblem = 'P9'\n{STUDY}")
    said = refused("sweep", str(study))
    assert "colour = 3: unknown key" in said
    assert "problem = 'P9': must be one of" in said
    both = refused("sweep", str(study), "--workers", "0")
    assert "--workers = 0: must be a whole number" in both
    assert "colour = 3: unknown key" in both
    study.write_text(STUDY)
    said = refused("sweep", str(study), "--scheduler", "nonsense")
    assert "--scheduler = 'nonsense': must be the address of a Dask scheduler" in said


def test_a_bar_with_a_unit_shows_the_rate_and_the_time_left(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """What was done before counts as done, and not for the rate."""
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "120")
    monkeypatch.setattr(Console, "is_terminal", True)
    now_s = [100.0]
    monkeypatch.setattr("rich.console.monotonic", lambda: now_s[0])
    with bar.progress("scenarios") as progress:
        assert progress is not None
        for done in (5000, 5200, 5400):
            progress(done, 10_000, "parts")
            now_s[0] += 2.0
    said = capsys.readouterr().err
    assert "100 scenarios/s" in said
    assert "0:00:46" in said
