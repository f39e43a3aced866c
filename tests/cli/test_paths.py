"""Paths in arguments and options: ``~`` is the home, and an unknown user is refused in words."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from tests.cli.run import refused, run
from tests.cli.test_own_problem import MINE

SITE = ("--origin", "0,0,0", "--destination", "9,9,9", "--device", "5,5,5", "--laser", "5,5,5")
LOG = Path(__file__).parents[2] / "optuav" / "lessons" / "data" / "propeller.csv"
SHORT = ("--problem", "P3", "--perspective", "battery")
COMMANDS = [
    ("solve", "{}/mission.toml", *SHORT),
    ("solve", "paper", *SHORT, "--save", "{}/plan.json"),
    ("formulate", "paper", "--problem", "{}/mine.py:LeastLaser", "--set", "wanted_hover_s=400"),
    ("audit", "{}/plan.json", "--plot", "{}/audit.png"),
    ("formulate", "paper", *SHORT, "--save", "{}/p3.lp"),
    ("new", "{}/mission.toml"),
    ("calibrate", "rotor", "{}/log.csv", "--save", "{}/fit.toml"),
    ("solve", "paper", *SHORT, "--plot", "{}/pictures"),
    ("show", "{}/plan.json"),
    ("explain", "{}/plan.json"),
    ("compare", "paper", "--save", "{}/compared.csv"),
    ("sweep", "{}/study.toml"),
    ("check-solutions", "{}/solutions.json"),
    ("lessons", "{}/lessons"),
    ("city", "{}/town.geojson", *SITE, "--save", "{}/town.toml"),
    ("reproduce", "--only", "table1", "--out", "{}/reproduced"),
    ("map", "paper", "--over", "device", "--step", "900", "--save", "{}/map.tif"),
]
HERE = ("solve", "new", "formulate", "lessons")


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A home beside an empty working directory."""
    (tmp_path / "home").mkdir()
    (tmp_path / "here").mkdir()
    (tmp_path / "home" / "mine.py").write_text(MINE, "utf-8")
    (tmp_path / "home" / "beside.py").write_text("WORTH = 1.0\n", "utf-8")
    (tmp_path / "home" / "log.csv").write_bytes(LOG.read_bytes())
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.chdir(tmp_path / "here")
    return tmp_path / "home"


def test_a_tilde_is_the_home(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where a command reads and where it writes; nothing is made where it is run."""
    monkeypatch.setattr("optuav.plots.files.image", lambda *_: b"")  # drawn, not rendered
    run("new", str(home / "mission.toml"))
    for line in COMMANDS[:9]:
        asked = [part.format("~") for part in line]
        done = run(*asked, *(["--force"] if line[0] == "new" else []))
        assert done.code in (0, 1), (line, done.err)
    assert not [*Path().iterdir()]
    made = {"plan.json", "audit.png", "p3.lp", "mission.toml", "fit.toml"}
    assert made <= {path.name for path in home.iterdir()}


@pytest.mark.parametrize("line", COMMANDS, ids=" ".join)
def test_an_unknown_user_is_refused(line: tuple[str, ...], home: Path) -> None:
    """And no directory of that name is made."""
    asked = [part.format("~nobody-here") for part in line]
    assert "there is no user 'nobody-here'; give the whole path" in refused(*asked)
    assert not [*Path().iterdir()]


@pytest.mark.parametrize(
    "line",
    [
        ("solve", "paper", *SHORT, "--plot"),
        ("solve", "paper", *SHORT, "--save"),
        ("audit", "plan.json", "--plot"),
        ("reproduce", "--only", "table2", "--out"),
        ("calibrate", "rotor", str(LOG)),
        ("lessons",),
        ("sweep",),
    ],
    ids=" ".join,
)
def test_an_empty_path_is_not_the_current_folder(line: tuple[str, ...], home: Path) -> None:
    """Read or written, the last option or argument is named, and nothing is made."""
    names = {"calibrate": "files", "lessons": "directory", "sweep": "study"}
    name = names.get(line[0], line[-1])
    assert refused(*line, "") == f"error: {name} = '': must be a path\n"
    assert not [*Path().iterdir()]


@pytest.mark.parametrize(
    ("line", "work"),
    [
        (("solve", "paper", "--save", "~/a.json"), "optuav.solve"),
        (("calibrate", "rotor", "~/log.csv", "--save", "~/a.toml"), "optuav.calibration.fit_rotor"),
        (("new", "~/a.toml"), "optuav.mission.template.template"),
    ],
)
def test_a_place_that_may_not_be_written_to_is_refused_before_the_work(
    line: tuple[str, ...], work: str, home: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A new file in a locked folder; root may write everything: simulated."""
    monkeypatch.setattr(work, lambda *_, **__: pytest.fail("done before"))
    monkeypatch.setattr(os, "access", lambda path, _: Path(path) != home)
    assert "a." in (words := refused(*line))
    assert words.endswith("cannot be written: Permission denied\n")


def test_a_folder_whose_name_is_too_long_is_named(home: Path) -> None:
    words = f"{'n' * 300}: cannot be made: File name too long"
    assert words in refused("solve", "paper", "--plot", "n" * 300)


@pytest.mark.parametrize(
    ("line", "name"),
    [
        (("solve", "paper", "--animate"), "--animate"),
        (("audit", "plan.json", "--plot"), "--plot"),
        (("export", "plan.json"), "FILE"),
        (("map", "paper", "--over", "device", "--step", "900", "--save"), "--save"),
    ],
)
def test_what_is_no_text_is_not_printed(line: tuple[str, ...], name: str) -> None:
    assert f"{name} = '-': must be a name that ends in ." in refused(*line, "-")


@pytest.mark.parametrize(
    ("command", "faults"),
    [
        ("place nope --lasers 0 --candidates grid", ("nope", "--lasers = 0")),
        ("export nope.json x.plan --climb-m 0", ("nope.json", "--climb-m = 0")),
        ("robust nope nope.toml --problem P9", ("nope:", "nope.toml", "--problem = 'P9'")),
        ("audit nope.plan --mission nope", ("nope.plan", "nope: there is no such file; shipped")),
    ],
)
def test_a_missing_file_hides_no_other_fault(command: str, faults: tuple[str, ...]) -> None:
    """A user mends all faults at once."""
    told = refused(*command.split())
    assert all(fault in told for fault in faults)
