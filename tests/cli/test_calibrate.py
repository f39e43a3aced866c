"""``optuav calibrate`` shows values, writes a mission and a picture, and refuses bad data."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import optuav
from tests.cli.run import Ran, refused, run, widest

DATA = Path(__file__).parents[2] / "examples" / "data"
EXAMPLES = {
    "kibam": "lifetimes.csv",
    "regimes": "flight_log.csv",
    "rotor": "bench.csv",
    "table": "paper_table2.toml",
}
Fitted = tuple[str, Ran, Path]


@pytest.fixture(scope="module", params=EXAMPLES)
def fitted(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Fitted:
    """Each kind with its example, a mission and a picture, fitted once, a table from one start."""
    pytest.importorskip("matplotlib")
    folder = tmp_path_factory.mktemp(request.param)
    places = ("--save", str(folder / "new.toml"), "--plot", str(folder / "pictures" / "k"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("optuav.calibration.table.SCALES", (1.0,))
        ran = run("calibrate", request.param, str(DATA / EXAMPLES[request.param]), *places)
    return request.param, ran, folder


def test_values_mission_and_picture(fitted: Fitted) -> None:
    """Each kind: a table of 80 columns, a mission that loads and has the values, a picture."""
    kind, ran, folder = fitted
    assert ran.code == 0
    table = ran.out.partition("\noptuav solve")[0]
    assert widest(table) <= 80
    assert "…" not in table
    assert (folder / "pictures" / "k" / "fit.png").stat().st_size > 10_000
    mission = optuav.load(folder / "new.toml")
    command = ran.out.partition("optuav solve MISSION ")[2].replace("\\\n", "")
    settings = command.splitlines()[0].split("--set ")[1:]
    for setting in settings:
        key, _, value = setting.strip().partition("=")
        section, _, name = key.partition(".")
        own = getattr(getattr(mission, section), name)
        assert str(own) == value or own == float(value), key
    assert len(settings) >= 3
    command = [part for each in settings for part in ("--set", each.strip())]
    used = run("show", "matrice350" if kind == "regimes" else "paper", *command)
    assert used.code == 0, used.err  # The command that is printed can be used.
    if kind == "table":
        asked = ("--problem", "P3", "--slot-s", "1", "--perspective", "battery")
        assert "Hover         950.00 s" in run("solve", "paper", *asked, *command).out


def test_extends_another_mission(tmp_path: Path) -> None:
    """A path is told relative to the file that is written."""
    (tmp_path / "below").mkdir()
    base, file = tmp_path / "base.toml", tmp_path / "below" / "new.toml"
    base.write_text('schema = 1\nextends = "paper"\nlimits.deadline_s = 777\n')
    ran = run(
        "calibrate",
        "rotor",
        str(DATA / "propeller.csv"),
        *("--extends", str(base), "--save", str(file)),
    )
    assert ran.code == 0
    assert 'extends = "../base.toml"' in file.read_text("utf-8")
    assert optuav.load(file).limits.deadline_s == 777


STEADY = ("0,168.9", "4,149.1", "8,129.9", "10,126.3", "12,127.2", "16,145.0", "20,179.4")


@pytest.mark.parametrize(
    ("kind", "base", "words"),
    [
        ("rotary-wing", "paper", "flight.climb_speed_m_s: is missing"),
        ("rotary-wing", "matrice350", "body: is missing; a table [body]"),
        ("regimes", "paper", "flight.acceleration_m_s2: is missing"),
        ("rotor", "relay-today", "rotor = a table: not with flight.model"),
    ],
)
def test_a_mission_that_would_not_load_is_not_written(
    kind: str, base: str, words: str, tmp_path: Path
) -> None:
    """Exit code 2, every fault with both that it comes from, the fit that it cost, and no file."""
    data, file = tmp_path / "data.csv", tmp_path / "new.toml"
    data.write_text("\n".join(["speed_m_s,power_W", *STEADY, "24,231.3"]), "utf-8")
    if kind == "regimes":
        rows = [f"{n},{20 + n % 2},22,{('hover', 'flight')[n // 20]}" for n in range(40)]
        data.write_text("\n".join(["time_s,current_A,voltage_V,phase", *rows]), "utf-8")
    if kind == "rotor":
        data = DATA / "propeller.csv"
    ran = run("calibrate", kind, str(data), "--extends", base, "--save", str(file))
    told = ran.err
    assert ran.code == 2
    assert ran.out.startswith(f"{kind}: ")
    assert "wrote" not in ran.out
    assert f"values from {data} on top of '{base}': {words}" in told
    allowed = "a mission on which these values load"
    if kind != "rotor":  # A fit of another model than that of the mission
        new = f"as optuav new FILE --from {kind} writes"
        allowed = f"a mission with flight.model = '{kind}', {new}"
    assert f"--extends = '{base}': must be {allowed}; nothing is written" in told
    assert not file.exists()
    assert run("calibrate", kind, str(data), "--extends", base).code == 0


def test_loads_without_an_acceleration_extend_a_mission_that_has_one(tmp_path: Path) -> None:
    """Most logs have no leg from standing to standing at one speed."""
    data, file = tmp_path / "data.csv", tmp_path / "new.toml"
    rows = [f"{n},{20 + n % 2},22,{('hover', 'flight')[n // 20]}" for n in range(40)]
    data.write_text("\n".join(["time_s,current_A,voltage_V,phase", *rows]), "utf-8")
    assert run("calibrate", "regimes", str(data), "--save", str(file)).code == 0
    assert optuav.load(file).flight.hover_current_A == 20.5


def test_all_faults_are_told_at_once(tmp_path: Path) -> None:
    """Of the place to write to, the mission, every name of a column, and every file."""
    log = tmp_path / "a.csv"
    log.write_text("time(millisecond),current(A)\n0,1\n100,1\n200,1\n")
    places = "--save", str(tmp_path / "none" / "x.toml"), "--plot", str(log)
    names = "--column", "Q=ZZ", "--column", "P=current_A"
    told = refused("calibrate", "regimes", str(log), "b.csv", *places, *names, "--extends", "nope")
    for words in (
        *("there is no directory", "is not a directory", "nope: there is no such file"),
        *("--column = 'Q'", "--column = 'ZZ'", "--column = 'P'", "b.csv: there is no such file"),
    ):
        assert words in told


def test_json_has_everything() -> None:
    told = json.loads(run("calibrate", "rotor", str(DATA / "bench.csv"), "--json").out)
    assert told["kind"] == "rotor"
    assert len(told["values"]) == 7
    assert len(told["panels"][0]["observed"]) == 28


def test_a_battery_states_the_hover_of_the_mission_it_extends() -> None:
    """The hover of the fit lies between those of the batteries at the edge of its region."""
    arguments = "calibrate", "kibam", str(DATA / "lipo.csv")
    told = json.loads(run(*arguments, "--extends", "paper", "--json").out)
    fitted = optuav.load("paper").replace(optuav.fit_kibam(DATA / "lipo.csv").changes)
    hover_s = told["hover_time_s"]
    assert hover_s["value"] == optuav.solve(fitted).hover_time_s
    assert hover_s["low"] < hover_s["value"] < hover_s["high"]
    assert hover_s["high"] / hover_s["low"] < 1.1
    words = run(*arguments, "--extends", "paper", "--never-longer").out
    assert "never longer than measured, less 1 %" in words
    assert "paper hovers 681." in words
    assert "hover" not in run(*arguments).out


def test_only_a_battery_is_never_longer() -> None:
    words = refused("calibrate", "rotor", str(DATA / "bench.csv"), "--never-longer")
    assert "--never-longer: requires KIND kibam, not rotor" in words


def test_a_mission_without_a_plan_does_not_cost_the_fit(tmp_path: Path) -> None:
    """A cell of 0.07 Ah flies nothing: the values are printed and saved, and a line says why."""
    data, file = tmp_path / "small.csv", tmp_path / "new.toml"
    data.write_text("load,current_A,lifetime_s\na,0.25,729.6\nb,0.5,271.8\nc,0.1,2279.5\n")
    arguments = "calibrate", "kibam", str(data), "--extends", "matrice350"
    ran = run(*arguments, "--save", str(file))
    assert ran.code == 0
    assert "capacity_As                       259." in ran.out
    assert "matrice350 with these values: there is no plan (infeasible): " in ran.out
    assert optuav.load(file).battery.capacity_As == pytest.approx(259.0915)
    told = json.loads(run(*arguments, "--json").out)
    assert "hover_time_s" not in told
    assert told["extends"] == "matrice350"


def test_never_longer_has_an_edge_and_a_hover_with_its_interval() -> None:
    """The edge of the plain fit, with as much less capacity as the fit itself."""
    arguments = "calibrate", "kibam", str(DATA / "lipo.csv"), "--extends", "paper", "--json"
    plain = json.loads(run(*arguments).out)
    told = json.loads(run(*arguments, "--never-longer").out)
    value, low, high = told["hover_time_s"].values()
    assert low < value < high
    by_key = {each["key"]: each["value"] for each in told["values"]}
    least, most = (f(each["battery.capacity_As"] for each in told["edge"]) for f in (min, max))
    assert least < by_key["battery.capacity_As"] < most
    own = max(each["battery.capacity_As"] for each in plain["edge"])
    assert most < 0.991 * own


def test_the_lag_is_shown_as_no_key() -> None:
    """It has a formula in place of a name that a mission would refuse."""
    ran = run("calibrate", "kibam", str(DATA / "lipo.csv"))
    assert "lag (1−ω)²/k_F [s], not a key" in ran.out
    assert "lag_s" not in ran.out


def test_data_that_tell_too_little_are_an_answer(tmp_path: Path) -> None:
    """A warning, no settings, exit code 0, and a mission file that changes nothing."""
    data, file = tmp_path / "one.csv", tmp_path / "new.toml"
    data.write_text("load,current_A,lifetime_s\na,1,100\nb,1,101\nc,1,99\n")
    ran = run("calibrate", "kibam", str(data), "--save", str(file))
    assert ran.code == 0
    assert "not determined" in ran.out
    assert "warning: the data cannot tell" in ran.out
    assert "warning: nothing is determined: a mission keeps its own battery" in ran.out
    assert "# Warning: nothing is determined: a mission keeps" in file.read_text("utf-8")
    assert max(map(len, file.read_text("utf-8").splitlines())) <= 100
    assert "--set" not in ran.out
    assert optuav.load(file).battery == optuav.load("paper").battery


def test_lifetimes_of_no_battery_leave_a_question_mark(tmp_path: Path) -> None:
    """Longer lifetimes at larger currents: no value is stated, and the warning says why."""
    rows = ["load,current_A,lifetime_s", *(f"{n},{n},{100 * n}" for n in range(1, 5))]
    (tmp_path / "odd.csv").write_text("\n".join(rows), "utf-8")
    found = run("calibrate", "kibam", str(tmp_path / "odd.csv"))
    assert found.code == 0
    assert "capacity_As                        ?  not determined" in found.out
    assert "no kinetic battery lasts like that" in found.out + found.err


@pytest.mark.parametrize("kind", ["kibam", "regimes", "rotor"])
def test_a_file_and_its_copy_are_refused(kind: str, tmp_path: Path) -> None:
    """Twice the same measurements would halve the squares of all intervals."""
    file, copy = DATA / EXAMPLES[kind], tmp_path / "copy.csv"
    assert "name each measurement once" in refused("calibrate", kind, str(file), str(file))
    copy.write_bytes(file.read_bytes())
    assert "has the content of" in refused("calibrate", kind, str(file), str(copy))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("kibam", "missing.csv"), "there is no such file"),
        (("rotor", str(DATA / "bench.csv"), "--extends", "papper"), "did you mean 'paper'"),
        (("table", str(DATA / "lifetimes.csv")), "is not TOML"),
        (("table", str(DATA / "paper_table2.toml"), "b.toml"), "one file"),
        (("regimes", str(DATA / "bench.csv")), "there is no column time_s"),
    ],
)
def test_bad_input_leaves_by_2(arguments: tuple[str, ...], words: str) -> None:
    assert words in refused("calibrate", *arguments)


def test_a_mission_file_is_not_overwritten(tmp_path: Path) -> None:
    """As `optuav new`: whoever edited it keeps it."""
    file = tmp_path / "mine.toml"
    file.write_text("# mine", "utf-8")
    told = refused("calibrate", "rotor", str(DATA / "propeller.csv"), "--save", str(file))
    assert "exists already; name a new file" in told
    assert file.read_text("utf-8") == "# mine"
