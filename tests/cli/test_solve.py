"""``optuav solve``: good, infeasible, refused and unfinished."""

from __future__ import annotations

import io
import json
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
from matplotlib.figure import Figure

import optuav
from optuav.plots import files
from tests.cli.run import refused, run, widest, words
from tests.several_devices import eight


def test_a_plan() -> None:
    found = run("solve", "paper", "--perspective", "battery")
    assert found.code == 0
    assert "Hover         719.54 s   at hover" in found.out
    assert "Warning      the available well runs dry" in found.out
    assert widest(found.out) <= 80


def test_free_speeds() -> None:
    """Told with the times; refused in one line where legs have no speed to choose."""
    options = ("--problem", "P3", "--speed", "free", "--perspective", "battery")
    found = run("solve", "relay-today", *options)
    assert found.code == 0
    assert "2 legs, at 15.41, 15.42 m/s" in found.out
    explained = run("explain", "relay-today", *options)
    assert "a second less of flight is worth 0 A s of charge on every leg" in words(explained.out)
    assert "V_1" in run("formulate", "relay-today", *options).out
    assert "rotary-wing" in refused("solve", "paper", "--speed", "free")


LINEAR = ("--perspective", "battery")

FORMATS = ("pdf", "png", "svg")


@pytest.mark.parametrize(
    ("options", "hover_time_s"),
    [
        ([], 719.5398),
        (["--engine", "closed-form"], 719.5398),
        (["--engine", "cvxpy"], 719.5398),
        (["--engine", "cvxpy", "--solver", "CLARABEL"], 719.5398),
        (["--problem", "P3"], 688.8480),
        (["--problem", "P3", "--perspective", "energy"], 524.6284),
        (["--problem", "P3", "--perspective", "wells"], 688.8480),
        (["--problem", "P3", "--slot-s", "10"], 680.0),
        (["--problem", "P3", "--slot-s", "10", "--engine", "cvxpy"], 680.0),
        (["--problem", "P4", "--building", "b1", "--order", "hover-first"], 698.0762),
        (["--trajectory", "traj1"], 715.0477),
        (["--trajectory", "direct", "--hover-point", "free", "--set", "buildings=[]"], 688.8480),
        (["--problem", "P2-tight", "--set", "limits.deadline_s=800"], 678.69),
    ],
)
def test_options_reach_the_solver(options: list[str], hover_time_s: float) -> None:
    chosen = () if "--perspective" in options else ("--perspective", "battery")
    found = run("solve", "paper", *chosen, *options, "--json")
    assert found.code == 0
    assert json.loads(found.out)["hover_time_s"] == pytest.approx(hover_time_s, abs=5e-3)


def test_the_default_is_a_plan_that_can_be_flown() -> None:
    found = run("solve", "paper", "--json")
    plan = json.loads(found.out)
    assert (plan["perspective"], plan["flyable"]) == ("available", True)
    assert plan["hover_time_s"] == pytest.approx(597.270, abs=5e-4)


def test_settings_are_repeated_and_typed() -> None:
    """Numbers, lists, text without quotes, and an optional table that is removed."""
    found = run(
        *("solve", "paper", "--json", "--set", "limits.deadline_s=800", "--set", "laser="),
        *("--set", "route.hover_m=[1000, 2510, 60]", "--set", "name=short trip"),
    )
    assert found.code == 0
    mission = json.loads(found.out)["mission"]
    assert mission["limits"]["deadline_s"] == 800
    assert mission["route"]["hover_m"] == [1000, 2510, 60]
    assert mission["name"] == "short trip"
    assert mission.get("laser") is None


@pytest.mark.parametrize(
    ("setting", "ours"),
    [
        ("link.device_m=[600,450,0]", "devices.market.position_m"),
        ("route.hover_m=[1,2,80]", "devices.market.hover_m"),
    ],
)
def test_a_key_of_one_device_does_not_drop_several(setting: str, ours: str) -> None:
    """Unless the list is dropped beside it."""
    refused = run("solve", "three-sensors", "--set", setting)
    assert refused.code == 2
    assert "the mission has market, quay, school" in refused.err
    assert f"set {ours}, or drop these devices with --set devices=" in refused.err
    dropped = ("--set", "devices=", "--set", "link.device_m=[600,450,0]", "--set", setting)
    assert run("show", "three-sensors", *dropped).code == 0


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        (["limits.deadline_s=60"], "the flight takes 75.79 s"),
        (["body.mass_kg=50"], "the UAV cannot fly"),
        (["laser=", "limits.min_soc=0.95"], "charge left: "),
    ],
)
def test_infeasible_is_an_honest_no(settings: list[str], said: str) -> None:
    asked = ("solve", "paper", *(part for each in settings for part in ("--set", each)))
    found = run(*asked)
    assert found.code == 1
    assert "INFEASIBLE" in found.out
    assert said in words(found.out)
    assert widest(found.out) <= 80
    as_json = run(*asked, "--json")
    assert as_json.code == 1
    answer = json.loads(as_json.out)
    assert answer["status"] == "infeasible"
    assert answer["hover_time_s"] is None
    assert answer["reasons"]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("nowhere",), "nowhere: there is no such file; shipped missions are matrice350"),
        (("paper", "--problem", "P9"), "problem = 'P9': must be one of P1, P2, P2-tight, P3, P4"),
        (("paper", "--problem", "P4"), "--building: problem P4 needs the name of a building"),
        (("paper", "--problem", "P4", "--building", "b99"), "the mission's buildings are: b1"),
        (("paper", "--problem", "P3", "--order", "rest-first"), "problem P3 takes no order"),
        (("paper", "--perspective", "hopeful"), "perspective = 'hopeful'"),
        (
            ("paper", "--engine", "ouija"),
            "engine = 'ouija': must be one of auto, closed-form, cvxpy",
        ),
        (("paper", "--engine", "closed-form", "--slot-s", "1", *LINEAR), "only continuous times"),
        (("paper", "--engine", "cvxpy", "--perspective", "wells"), "'P1.b state of charge' is not"),
        (
            ("paper", "--engine", "cvxpy", "--solver", "ABACUS", *LINEAR),
            "--solver = 'ABACUS': must be one of CVXPY's solvers",
        ),
        (("paper", "--slot-s", "0"), "--slot-s = 0.0"),
        (("paper", "--slot-s", "nan"), "--slot-s = nan"),
        (("paper", "--slot-s", "1e-9"), "--slot-s = 1e-09"),
        (("paper", "--hover-point", "fre"), "--hover-point = 'fre': must be one of w_U, free"),
        (("paper", "--time-limit-s", "-1"), "--time-limit-s = -1.0"),
        (("paper", "--set", "limits.deadline_s"), "--set = 'limits.deadline_s': must be KEY=VALUE"),
        (
            ("paper", "--set", "limits.deadlin_s=1"),
            "unknown key; did you mean 'limits.deadline_s'?",
        ),
        (
            ("paper", "--set", "limits.deadline_s=soon"),
            "limits.deadline_s = 'soon': must be a number",
        ),
        (("paper", "--set", "limits.deadline_s=-1"), "limits.deadline_s = -1"),
        (("paper", "--set", "wind.force_N=[nan, 0, 0]"), "wind.force_N"),
        (("paper", "--set", f"name={'[' * 5000}"), "name"),
        (("paper", "--save", "no/such/folder/plan.json"), "there is no directory"),
        (("paper", "--save", "."), ".: is a directory, not a file"),
    ],
)
def test_bad_input_is_refused_in_words(
    arguments: tuple[str, ...], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert said in refused("solve", *arguments)
    assert list(tmp_path.iterdir()) == []


def test_all_faults_are_listed_at_once() -> None:
    found = refused("solve", "paper", "--trajectory", "x", "--order", "up", "--slot-s", "0")
    assert found.startswith("error: --order")
    assert [line[:7] for line in found.splitlines()[1:]] == ["       "] * 2
    found = refused("solve", "paper", "--problem", "P9", "--perspective", "x", "--slot-s", "0")
    assert [line.split()[0] for line in found.removeprefix("error:").splitlines()] == [
        *("--problem", "--perspective", "--slot-s")
    ]


@pytest.mark.parametrize("engine", ["grid", "casadi"])
def test_an_engine_that_does_not_finish_has_its_own_exit_code(engine: str) -> None:
    slots = ["--slot-s", "0.01"] if engine == "grid" else []
    found = run("solve", "paper", "--engine", engine, *slots, "--time-limit-s", "1e-6")
    assert found.code == 3
    assert found.out == ""
    assert "within the time limit" in found.err


def test_a_saved_plan_is_the_plan(tmp_path: Path) -> None:
    path = tmp_path / "plan.json"
    found = run("solve", "paper", "--save", str(path))
    assert found.code == 0
    assert f"wrote {path}" in found.out.replace("\n", "")
    assert optuav.load_plan(path) == optuav.solve("paper")
    as_json = run("solve", "paper", "--save", str(path), "--json")
    assert json.loads(as_json.out) == json.loads(path.read_text("utf-8"))


@pytest.mark.slow
def test_pictures_go_into_a_new_directory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("matplotlib")
    folder = tmp_path / "new" / "pictures"
    asked = ("solve", "paper", "--problem", "P3", "--plot", str(folder))
    counts: list[int] = []
    empty = Figure().subplots()
    for name in ("mission_map", "leg"):
        monkeypatch.setattr(files, name, lambda *_: SimpleNamespace(plan=empty, speed=empty))
    monkeypatch.setattr(files, "image", lambda ax, _: counts.append(len(ax.figure.axes)) or b"")
    for perspective in ("energy", "available"):
        found = run(*asked, "--perspective", perspective)
        assert found.code == 0
        assert found.out.count("wrote ") == 3
    names = [f"{name}.{ending}" for name in ("leg", "map", "wells") for ending in FORMATS]
    assert sorted(path.name for path in folder.iterdir()) == names
    # In each format the plan, and but for energy the one in the other perspective
    assert counts[12] > counts[3] >= 1


def test_pictures_over_many_devices_have_no_plan_to_compare_with(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The wells are not asked about eight devices in any order; plan and pictures are written."""
    pytest.importorskip("matplotlib")
    others: list[object] = []
    monkeypatch.setattr("optuav.plots.save_pictures", lambda *drawn: others.extend(drawn[2]) or [])
    mission, plan = eight().save(tmp_path / "eight.toml"), tmp_path / "plan.json"
    asked = ("solve", str(mission), *LINEAR, "--save", str(plan), "--plot", str(tmp_path))
    assert run(*asked).code == 0
    assert plan.exists()
    assert others == []


def test_pictures_cannot_go_where_a_file_is(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    (tmp_path / "file").write_text("", "utf-8")
    assert "is not a directory" in refused("solve", "paper", "--plot", str(tmp_path / "file"))


def test_several_stops() -> None:
    """SPEC 3: 605.456 s; numbers out of range are refused together."""
    found = run("solve", "paper", "--perspective", "available", "--stops", "2")
    assert found.code == 0
    assert "231.82 s at b9, 254.21 s at b10" in found.out
    assert widest(found.out) <= 80
    told = refused("solve", "paper", "--stops", "-1", "--hovers", "0")
    assert "stops = -1" in told
    assert "--hovers = 0" in told


def test_a_plan_in_motion(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Written where there is a plan; where there is none, nothing is."""
    pytest.importorskip("matplotlib")
    monkeypatch.setattr("optuav.plots.animation.FRAMES", 3)
    monkeypatch.setattr("optuav.plots.animation.HELD", 1)
    file = tmp_path / "mission.gif"
    asked = ("solve", "paper", "--problem", "P3", "--perspective", "available")
    found = run(*asked, "--animate", str(file), "--set", "limits.deadline_s=10")
    assert found.code == 1
    assert "is not written: there is no plan to show" in found.err
    assert not file.exists()
    found = run(*asked, "--animate", str(file))
    assert found.code == 0
    assert file.read_bytes().startswith(b"GIF89a")
    assert f"wrote {file}" in found.out.replace("\n", "")


@pytest.mark.parametrize("name", ["mission.png", "mission", "gif"])
def test_an_animation_is_a_gif_by_name(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Refused before anything is solved, rather than a GIF under the name of something else."""
    monkeypatch.setattr(optuav, "solve", None)
    told = refused("solve", "paper", "--animate", str(tmp_path / name))
    assert "error: --animate = " in told
    assert "a name that ends in .gif" in told
    assert list(tmp_path.iterdir()) == []


def test_what_optuav_has_not_written_is_replaced_by_force_only(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A plan of ours is replaced; a letter, and a picture by others, stay and end the command."""
    monkeypatch.chdir(tmp_path)
    quick = ("solve", "paper", "--perspective", "battery", "--save")
    letter, mine = Path("letter.json"), Path("plan.json")
    letter.write_text("Dear reader")
    for _ in range(2):
        assert run(*quick, "plan.json").code == 0
    assert "letter.json: is not from optuav and stays" in refused(*quick, "letter.json")
    assert letter.read_text() == "Dear reader"
    assert run(*quick, "letter.json", "--force").code == 0
    assert letter.read_text() == mine.read_text()


@pytest.mark.parametrize(
    "command",
    [
        ("compare", "paper", "--by", "trajectory", "--perspective", "battery", "--save", "x.csv"),
        ("formulate", "paper", "--lp", "--perspective", "battery", "--save", "x.lp"),
        ("show", "paper", "--plot", "."),
    ],
)
def test_each_kind_of_file_is_known_as_our_own(
    command: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It may be written again, and one of the same name by others may not."""
    monkeypatch.chdir(tmp_path)
    empty = SimpleNamespace(plan=Figure().subplots())  # in place of a map
    monkeypatch.setattr(files, "mission_map", lambda *_: empty)
    assert run(*command).code == 0
    assert run(*command).code == 0
    for written in [*tmp_path.iterdir()]:
        content, marked = written.read_bytes(), written.suffix in (".png", ".svg", ".pdf")
        theirs = content.replace(b"optuav", b"other!") if marked else b"1,2\n"
        written.write_bytes(theirs)
        assert "is not from optuav" in refused(*command)
        assert written.read_bytes() == theirs
        assert run(*command, "--force").code == 0
        assert written.read_bytes() == content


def test_a_mission_from_standard_input_and_a_plan_to_standard_output(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """As in a pipe; nothing but the plan is printed."""
    text = b'schema = 1\nextends = "paper"\n[limits]\ndeadline_s = 800\n'
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(text)))
    found = json.loads(run("solve", "-", "--perspective", "battery", "--save", "-").out)
    assert found["kind"] == "optuav plan"
    assert found["mission"]["name"] == "mission"
    assert found["mission"]["limits"]["deadline_s"] == 800


def test_explain_believes_no_plan_that_its_simulation_contradicts(tmp_path: Path) -> None:
    """An embedded deadline that was edited makes the saved plan late."""
    path = tmp_path / "plan.json"
    run("solve", "paper", "--save", str(path))
    saved = json.loads(path.read_text("utf-8"))
    saved["mission"]["limits"]["deadline_s"] = 800.0
    path.write_text(json.dumps(saved), "utf-8")
    assert "its simulation contradicts this plan: optuav show" in refused("explain", str(path))


@pytest.mark.parametrize(
    ("arguments", "ending"),
    [
        (["solve", "paper", "--save", "r.kml"], ".json"),
        (["solve", "paper", "--save", "r.csv"], ".json"),
        (["solve", "paper", "--animate", "r.mp4"], ".gif"),
        (["new", "r.json"], ".toml"),
        (["formulate", "paper", "--save", "r.pdf"], ".txt, .tex, .lp, .mps, .nl, .gms or .bar"),
        (["formulate", "paper", "--lp", "--save", "r.mps"], ".lp"),
        (["calibrate", "kibam", "r.csv", "--save", "r.json"], ".toml"),
    ],
)
def test_a_suffix_of_another_format_is_refused(
    arguments: list[str], ending: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Before the work begins; no file holds what its name does not say."""
    monkeypatch.chdir(tmp_path)
    assert f": must be a name that ends in {ending}\n" in refused(*arguments)
    assert not any(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("name", "start"),
    [("r.LP", "\\"), ("r.mps", "*"), ("r.tex", "% "), ("r.txt", "1 of 2"), ("r", "1 of 2")],
)
def test_a_suffix_decides_the_form_of_a_problem(name: str, start: str, tmp_path: Path) -> None:
    """As the option of that form would; without a suffix it is text."""
    file = tmp_path / name
    run("formulate", "paper", "--perspective", "battery", "--save", str(file))
    assert file.read_text("utf-8").startswith(start)
