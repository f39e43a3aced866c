"""``optuav show``, ``validate``, ``new`` and ``missions``: what speaks of missions and plans."""

from __future__ import annotations

import io
import json
import sys
from pathlib import Path

import pytest

import optuav
from tests.cli.run import refused, run, widest
from tests.cli.run import words as said


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder to work in."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


# missions


def test_missions_are_listed() -> None:
    found = run("missions")
    assert found.code == 0
    assert widest(found.out) <= 80
    assert [line.split()[0] for line in found.out.splitlines() if not line.startswith(" ")] == [
        *("mission", "matrice350", "paper", "paper-drag", "paper-table2", "relay-today"),
        "three-sensors",
    ]
    rows = json.loads(run("missions", "--json").out)
    assert [row["name"] for row in rows] == list(optuav.shipped())


# show


@pytest.mark.parametrize("mission", ["paper", "paper-table2", "matrice350"])
def test_a_mission_is_shown_with_derived_values(mission: str) -> None:
    found = run("show", mission)
    assert found.code == 0
    assert widest(found.out) <= 80
    for words in ("[limits]", "deadline_s", "[[buildings]]", "derived"):
        assert words in found.out
    data = json.loads(run("show", mission, "--json").out)
    assert data["mission"]["name"] == mission
    assert all(set(each) == {"value", "unit"} for each in data["derived"].values())


def test_settings_change_what_is_shown() -> None:
    data = json.loads(run("show", "paper", "--set", "limits.deadline_s=99", "--json").out)
    assert data["mission"]["limits"]["deadline_s"] == 99


def test_a_plan_is_shown_as_solve_shows_it() -> None:
    run("solve", "paper", "--save", "plan.json")
    assert run("show", "plan.json").out == run("solve", "paper").out
    assert json.loads(run("show", "plan.json", "--json").out)["kind"] == "optuav plan"


@pytest.mark.parametrize("command", ["show", "explain"])
def test_a_plan_from_the_standard_input_is_taken(
    command: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As from a pipe; a mission from there is still one."""
    run("solve", "paper", "--perspective", "battery", "--save", "plan.json")
    for file in ("plan.json", "town.toml"):
        if file == "town.toml":
            run("new", file)
        wanted = run(command, file)
        with Path(file).open(encoding="utf-8") as stream:
            monkeypatch.setattr(sys, "stdin", stream)
            assert run(command, "-").out.replace("optuav explain -", "") == wanted.out.replace(
                f"optuav explain {file}", ""
            )


def test_a_shown_plan_is_simulated_again(folder: Path) -> None:
    """A file whose mission was changed by hand is not believed, and what differs is said."""
    run("solve", "paper", "--save", "plan.json")
    text = (folder / "plan.json").read_text("utf-8")
    assert text.count('"deadline_s": 1200.0') == 1
    edited = text.replace('"deadline_s": 1200.0', '"deadline_s": 700.0')
    (folder / "plan.json").write_text(edited, "utf-8")
    found = run("show", "plan.json")
    assert found.code == 1
    assert "Flyable      NO, as its simulation shows" in found.out
    assert "the deadline passes before the mission ends" in found.out
    assert "flyable: the plan says that it can be flown, it cannot" in found.out
    assert json.loads(run("show", "plan.json", "--json").out)["flyable"] is False


def test_an_infeasible_plan_is_shown() -> None:
    run("solve", "paper", "--set", "limits.deadline_s=60", "--save", "plan.json")
    found = run("show", "plan.json")
    assert found.code == 1
    assert "INFEASIBLE" in found.out


def test_pictures_of_a_mission_and_of_a_plan(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("matplotlib")
    monkeypatch.setattr("optuav.plots.files.image", lambda *_: b"")  # drawn, not rendered
    assert run("show", "paper", "--plot", "mission").code == 0
    names = sorted(path.name for path in (folder / "mission").iterdir())
    assert names == ["map.pdf", "map.png", "map.svg"]
    run("solve", "paper", "--set", "limits.deadline_s=60", "--save", "plan.json")
    assert "wrote plan/map.png" in run("show", "plan.json", "--plot", "plan").out


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (None, "there is no such file"),
        ("", "is not JSON"),
        ("[1, 2", "is not JSON"),
        ("[]", "is not a plan"),
        ("{}", "is not a plan"),
        ('{"kind": "optuav plan", "schema": 99}', "schema"),
        ('{"kind": "optuav plan", "schema": 1}', "mission"),
        ("[" * 100_000, "JSON"),
        ('{"kind": "optuav plan", "schema": 1, "slot_s": NaN}', ""),
    ],
)
def test_a_broken_plan_is_refused(folder: Path, content: str | None, words: str) -> None:
    if content is not None:
        (folder / "plan.json").write_text(content, "utf-8")
    assert words in refused("show", "plan.json")


def test_a_file_of_another_kind_is_called_by_its_name(folder: Path) -> None:
    """With the command that takes it, and without faults of a schema that is not its own."""
    run("solve", "paper", "--save", "plan.json")
    run("new", "town.toml")
    text = 'schema = 1\nmission = "paper"\nstops = []\n'
    (folder / "stops.toml").write_text(text, "utf-8")
    (folder / "own.toml").write_text('schema = 1\nextends = "stops.toml"\n', "utf-8")
    plan = "is a saved plan: use optuav show or optuav audit"
    itinerary = "is an itinerary, not a mission: use optuav audit"
    for command in ("solve", "validate"):
        assert refused(command, "plan.json") == f"error: plan.json: {plan}\n"
        assert refused(command, "stops.toml") == f"error: stops.toml: {itinerary}\n"
    assert itinerary in refused("show", "own.toml")
    for file, words in {
        "town.toml": "is a mission, not a saved plan: use optuav solve or validate",
        "own.toml": "is a mission, not a saved plan: use optuav solve or validate",
        "stops.toml": "is an itinerary, not a saved plan: use optuav audit",
    }.items():
        told = refused("sensitivity", "paper", "--plan", file)
        assert told == f"error: {file}: {words}\n"
    words = "is a mission, not an itinerary: use optuav solve or validate"
    assert refused("audit", "town.toml") == f"error: town.toml: {words}\n"


def test_a_plan_takes_no_settings() -> None:
    run("solve", "paper", "--save", "plan.json")
    words = refused("show", "plan.json", "--set", "limits.deadline_s=1")
    assert "goes with a mission, not with a saved plan" in words


# validate and new


def test_a_new_mission_is_in_order_and_has_the_values_that_it_starts_from() -> None:
    made = run("new", "hill.toml", "--from", "paper-table2")
    assert made.code == 0
    assert "optuav validate hill.toml" in made.out
    checked = run("validate", "hill.toml")
    assert checked.code == 0
    assert "in order" in checked.out
    assert widest(checked.out) <= 80
    hill, table2 = optuav.load("hill.toml"), optuav.load("paper-table2")
    assert (
        optuav.solve(hill, perspective="battery").hover_time_s
        == optuav.solve(table2, perspective="battery").hover_time_s
    )
    assert json.loads(run("validate", "hill.toml", "--json").out)["valid"] is True


def test_a_new_mission_takes_the_wells_of_a_battery_by_name() -> None:
    """Of a mission and of a datasheet, whose own are those of LiPo."""
    assert run("new", "a.toml", "--battery", "liion").code == 0
    assert optuav.load("a.toml").battery.flow_rate_per_s == 0.0027
    assert optuav.load("a.toml").battery.capacity_As == 36_000.0
    sheet = ("--from", "regimes", *SHEET)
    assert run("new", "b.toml", *sheet).code == 0
    assert optuav.load("b.toml").battery.available_fraction == 0.2
    assert run("new", "c.toml", *sheet, "--battery", "paper").code == 0
    assert optuav.load("c.toml").battery.available_fraction == 0.8
    assert "'nimh' is not one of" in refused("new", "d.toml", "--battery", "nimh")


def test_a_new_mission_on_the_standard_output_is_called_mission() -> None:
    assert 'name = "mission"' in run("new", "-").out


@pytest.mark.parametrize(
    ("file", "source", "words"),
    [
        ("old.toml", "paper", "exists already"),
        ("no/where.toml", "paper", "there is no directory"),
        (".", "paper", "exists already"),
        ("new.toml", "nowhere", "there is no such file"),
    ],
)
def test_a_mission_that_cannot_be_made(folder: Path, file: str, source: str, words: str) -> None:
    (folder / "old.toml").write_text("mine", "utf-8")
    assert words in refused("new", file, "--from", source)
    assert (folder / "old.toml").read_text("utf-8") == "mine"
    assert [path.name for path in folder.iterdir()] == ["old.toml"]


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "schema"),
        (b"\xff\xfe\x00", "is not text in UTF-8"),
        (b"schema = 1\n[limits\n", "is not TOML"),
        (b"schema = 2\n", "schema"),
        (b'schema = 1\nextends = "nowhere"\n', "extends"),
        (b'schema = 1\nextends = "mission.toml"\n', "does not lead back"),
        (b'schema = 1\nextends = "paper"\n[limits]\ndeadlin_s = 1\n', "did you mean 'deadline_s'?"),
        (b'schema = 1\nextends = "paper"\n[limits]\nmin_soc = 2\n', "limits.min_soc = 2"),
        (b'schema = 1\nextends = "paper"\n[[buildings]]\nname = "hover"\n', "buildings"),
    ],
)
def test_a_broken_mission_is_refused(folder: Path, content: bytes, words: str) -> None:
    (folder / "mission.toml").write_bytes(content)
    assert words in refused("validate", "mission.toml")
    assert words in refused("solve", "mission.toml")


def test_a_folder_is_no_mission(folder: Path) -> None:
    assert "is a directory, not a file" in refused("validate", str(folder))


def test_what_is_in_order_but_cannot_fly_is_told() -> None:
    found = run("validate", "paper", "--set", "body.mass_kg=50")
    assert found.code == 0
    assert "warning:" in found.out
    assert json.loads(run("validate", "paper", "--set", "body.mass_kg=50", "--json").out)[
        "warnings"
    ]


def test_a_mission_without_a_plan_is_in_order_and_warned_of() -> None:
    for setting, why in {
        "limits.deadline_s=60": "the flight takes 75.79 s, longer than limits.deadline_s",
        "battery.capacity_As=100": "charge left",
    }.items():
        found = run("validate", "paper", "--set", setting)
        assert found.code == 0
        assert f"no plan can be flown: {why}" in said(found.out)


SHEET = (
    *("--mass-kg", "4", "--packs", "2", "--cells", "10", "--capacity-mAh", "6000"),
    *("--hover-min", "36", "--cruise-speed-m-s", "10"),
)


def test_a_mission_from_a_datasheet_validates_and_solves() -> None:
    """Its head tells what it was made of."""
    assert run("new", "mine.toml", "--from", "regimes", *SHEET).code == 0
    assert run("validate", "mine.toml").code == 0
    assert run("solve", "mine.toml").code == 0
    text = Path("mine.toml").read_text("utf-8")
    assert "# hover_min = 36\n" in text
    assert "# reserve_percent = 20\n" in text
    mission = optuav.load("mine.toml")
    assert mission.flight.model == "regimes"
    assert mission.flight.hover_current_A == pytest.approx(20.0)


def types(monkeypatch: pytest.MonkeyPatch, *lines: str) -> None:
    """A person at a terminal who types these lines."""
    terminal = io.StringIO("\n".join(lines) + "\n")
    monkeypatch.setattr(terminal, "isatty", lambda: True)
    monkeypatch.setattr("sys.stdin", terminal)


def test_a_terminal_is_asked_for_what_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    """A wrong answer is asked for again; an empty one takes the default."""
    types(monkeypatch, "many", "-1", "", "2", "10", "6000", "10", "", "", "36", "")
    made = run("new", "asked.toml", "--from", "regimes", "--mass-kg", "4")
    assert made.code == 0
    assert made.out.count("Mass carried in addition") == 3
    assert "0 <= x <= 1000 [kg]" in made.out
    assert run("new", "stated.toml", "--from", "regimes", *SHEET).code == 0
    asked, stated = (Path(f"{name}.toml").read_text("utf-8") for name in ("asked", "stated"))
    assert asked.replace('"asked"', '"stated"').replace("# cruise_min = 36\n", "") == stated


def test_a_terminal_asks_for_no_time_where_power_is_stated(monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither for that of hovering nor for that of cruising, which draws the same power."""
    types(monkeypatch, "6", "", "", "6", "22000", "9", "", "")
    made = run("new", "mine.toml", "--from", "regimes", "--hover-power-W", "900")
    assert made.code == 0
    assert "[min]" not in made.out
    flight = optuav.load("mine.toml").flight
    assert flight.flight_current_A == flight.hover_current_A == pytest.approx(900 / 22.2, abs=1e-4)


def test_an_input_that_ends_is_bad_input(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ctrl-D at a question: exit code 2 and a sentence of its own, and nothing is written."""
    types(monkeypatch, "6")
    made = run("new", "mine.toml", "--from", "regimes")
    assert made.code == 2
    assert made.err.endswith("\nerror: the input ended before all questions were answered\n")
    assert not Path("mine.toml").exists()


def test_power_in_watts_stands_for_a_time_and_what_is_assumed_is_said() -> None:
    """Six cells of 3.7 V with 22 Ah hold 488.4 Wh: 32.56 min at 900 W."""
    sheet = ("--mass-kg", "6", "--cells", "6", "--capacity-mAh", "22000", "--cruise-speed-m-s", "9")
    made = run("new", "mine.toml", "--from", "regimes", *sheet, "--hover-power-W", "900")
    assert made.code == 0
    assert "laser (5000 W) come from the mission matrice350" in said(made.out)
    flight = optuav.load("mine.toml").flight
    assert flight.model == "regimes"
    assert flight.hover_power_W == pytest.approx(900, abs=0.01)
    assert flight.flight_current_A == pytest.approx(22.0 / (32.56 / 60), rel=1e-5)
    both = refused("new", "w.toml", "--from", "regimes", *SHEET, "--hover-power-W", "900")
    assert "--hover-power-W = 900.0: must be either --hover-power-W or --hover-min" in both
    text = Path("mine.toml").read_text("utf-8")
    assert "# hover_power_W = 900\n" in text, "what was stated"
    assert "# hover_min" not in text


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--from", "regimes", *SHEET[2:]), "--mass-kg: is missing; a number"),
        (("--from", "regimes", *SHEET[:8]), "or set --hover-power-W\n"),
        (
            ("--from", "regimes", *SHEET, "--payload-kg", "-1"),
            "--payload-kg = -1.0: must be a number",
        ),
        (
            ("--from", "regimes", *SHEET, "--laser-power-W", "nan"),
            "--laser-power-W = nan: must be a number",
        ),
        (SHEET[:2], "--mass-kg = 4: goes with --from regimes"),
    ],
)
def test_a_datasheet_that_is_refused(arguments: tuple[str, ...], words: str) -> None:
    """In words, and nothing is written."""
    assert words in refused("new", "mine.toml", *arguments)
    assert not Path("mine.toml").exists()


def test_a_power_out_of_range_is_the_only_fault() -> None:
    """The time in whose place it stands is not missing."""
    asked = (*SHEET[:8], *SHEET[10:], "--hover-power-W", "1e9")
    told = refused("new", "mine.toml", "--from", "regimes", *asked)
    assert told == "error: --hover-power-W = 1000000000.0: must be a number, 1 <= x <= 1e6 [W]\n"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (
            "solve nope --set limits.deadline_s=-4 --stops -1",
            ["nope: there is no such file", "limits.deadline_s = -4", "--stops = -1"],
        ),
        ("solve nope --set foo.bar=1", ["nope: there is no such file", "foo.bar = 1: unknown key"]),
        (
            "coverage nope --share -1 --drones 0",
            ["nope: there is no such file", "--share = -1.0", "--drones = 0"],
        ),
        (
            "calibrate kibam nope.csv --extends nope",
            ["nope: there is no such file", "nope.csv: there is no such file"],
        ),
        (
            "robust nope nope.toml --chance 2",
            ["nope: there is no such file", "nope.toml: there is no such file", "--chance = 2.0"],
        ),
        ("power nope --save x.bar", ["nope: there is no such file", "--save = 'x.bar'"]),
        ("export nope.json x.foo", ["nope.json: there is no such file", "FILE = 'x.foo'"]),
        (
            "coverage nope --set foo.bar=1 --save x.bar",
            ["nope: there is no such file", "foo.bar = 1: unknown key", "--save = 'x.bar'"],
        ),
    ],
)
def test_a_missing_mission_hides_no_other_fault(arguments: str, words: list[str]) -> None:
    """Of settings, places to write to and options; each is told once."""
    found = run(*arguments.split())
    assert found.code == 2
    assert [found.err.count(each) for each in words] == [1] * len(words)
