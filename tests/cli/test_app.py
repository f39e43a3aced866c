"""The application: help, commands that do not exist, and the process itself."""

from __future__ import annotations

import json
import os
import shlex
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

import optuav
from optuav.cli.app import COMMANDS as ALL
from optuav.presentation.text import line_width
from optuav.studies.compare import COMPARED_ENGINES
from tests.cli.run import Pipe, refused, run, widest, words
from tests.diagnosis.missions import only

COMMANDS = ("solve", "compare", "formulate", "show", "validate", "new", "missions")


def test_help_lists_every_command_and_the_exit_codes() -> None:
    found = run("--help")
    assert found.code == 0
    assert widest(found.out) <= 80
    codes = "Exit codes: 0 success, 1 there is no feasible plan or an audited plan cannot be flown"
    for said in (*COMMANDS, codes):
        assert said in words(found.out)


@pytest.mark.parametrize("command", ALL)
def test_every_command_has_help_in_80_columns(command: str) -> None:
    found = run(command, "--help")
    assert found.code == 0
    assert widest(found.out) <= 80
    assert run(command, "-h") == found


def test_the_help_of_compare_lists_the_engines_that_it_takes() -> None:
    linear, available = (",".join(COMPARED_ENGINES[each]) for each in ("battery", "available"))
    said = f"By default all: {available} in available, otherwise {linear}."
    assert said in words(run("compare", "--help").out)


@pytest.mark.parametrize(
    "asked",
    [
        ("solve", "paper", "--save", "plan.json"),
        ("solve", "paper", "--set", "limits.deadline_s=60"),
        ("explain", "paper", "--perspective", "battery"),
        ("explain", "paper", "--problem", "P3", "--set", "limits.deadline_s=60"),
        ("compare", "paper", "--by", "trajectory", "--perspective", "battery"),
        ("compare", "paper", "--slots", "60", "--engines", "closed-form,grid"),
        ("sensitivity", "paper", "--perspective", "battery", "--samples", "100"),
        ("audit", "plan.json"),
        ("show", "plan.json"),
        ("show", "matrice350"),
        ("validate", "paper", "--set", "limits.deadline_s=60"),
        ("formulate", "paper"),
        ("ledger", "text-e2", "table2-1-eta2"),
        ("calibrate", "rotor", str(Path(__file__).parents[2] / "examples" / "data" / "bench.csv")),
        ("missions",),
        ("new", "town.toml", "--force"),
        ("--help",),
        ("new", "--help"),
        ("new", "town.toml", "--from", "regimes", "--force"),
        ("solve", "nowhere"),
        ("calibrate", "x", "y.csv"),
    ],
    ids=" ".join,
)
def test_every_command_fits_into_the_columns_that_are_stated(
    asked: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Into 60 of them without the loss of a word that is there in 120."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(optuav, "explain", cache(optuav.explain))
    only(monkeypatch, "limits", "rotor")  # The longest key among them
    if "plan.json" in asked[1:2]:
        run("solve", "paper", "--save", "plan.json")
    narrow, wide = (run(*asked, columns=columns) for columns in (60, 120))
    assert narrow.code == wide.code
    for was, now in zip(wide[1:], narrow[1:], strict=True):
        assert widest(was) <= 120
        assert widest(now) <= 60
        assert {*was.split()} - {"\\"} == {*now.split()} - {"\\"}


@pytest.mark.parametrize(
    ("stated", "terminal", "width"),
    [
        (None, 0, 80),
        (None, 70, 70),
        (None, 100, 100),
        (None, 200, 120),
        ("100", 70, 100),
        ("40", 200, 60),
        ("0", 70, 70),
        ("soon", 0, 80),
        ("9" * 5000, 0, 80),
    ],
)
def test_the_width_is_that_of_columns_or_of_the_terminal(
    stated: str | None, terminal: int, width: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """From 60 to 120, and without both always the same; nonsense counts as not stated."""
    monkeypatch.setattr(sys, "__stdout__", sys.__stderr__)
    monkeypatch.setattr(os, "get_terminal_size", lambda _: os.terminal_size((terminal, 24)))
    if stated is not None:
        monkeypatch.setenv("COLUMNS", stated)
    assert line_width() == width


def test_version_is_that_of_the_package(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(vars(optuav), "__version__", "1.2.3")
    for more in ((), ("solve", "paper"), ("anything",)):
        found = run("--version", *more)
        assert (found.code, found.out) == (0, "optuav 1.2.3\n")


LOADED = """
import sys
from optuav.cli import main
try:
    main({arguments!r})
except SystemExit:
    pass
known = ("casadi", "cvxpy", "highspy", "matplotlib", "networkx", "numpy", "pandas", "pydantic",
         "rich", "scipy", "shapely")
print("loaded:", *(name for name in known if name in sys.modules))
"""


def test_a_command_loads_no_library_that_it_does_not_need() -> None:
    """In one process, from the command that needs least to the one that needs most."""
    needed = {
        ("--version",): set(),
        ("--help",): set(),
        ("missions",): set(),
        ("missions", "--json"): set(),
        ("solve", "--help"): set(),
        ("solve", "paper"): {"numpy", "pydantic"},
        ("show", "paper"): {"numpy", "pydantic"},
    }
    script = "".join(LOADED.format(arguments=list(arguments)) for arguments in needed)
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    lines = [line.split() for line in done.stdout.splitlines() if line.startswith("loaded:")]
    assert [set(names) for _, *names in lines] == list(needed.values())


def test_a_command_may_come_after_two_dashes() -> None:
    """As shells write it where options end: it is run, and not only listed."""
    assert run("--", "missions") == run("missions")


def test_without_a_command_there_is_help() -> None:
    found = run()
    assert found.code == 2
    assert found.err == run("--help").out


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("frobnicate",), "No such command 'frobnicate'"),
        (("solve",), "Missing argument 'MISSION'"),
        (("solve", "paper", "--sot-s", "1"), "No such option: --sot-s"),
        (("solve", "paper", "--slot-s", "soon"), "'--slot-s': 'soon' is not a number"),
        (("solve", "paper", "paper"), "unexpected extra argument"),
    ],
)
def test_what_the_shell_got_wrong_is_bad_input(arguments: tuple[str, ...], said: str) -> None:
    assert said in words(refused(*arguments))


def process(*arguments: str, **options: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "optuav", *arguments]
    return subprocess.run(
        command, capture_output=True, text=True, encoding="utf-8", check=False, **options
    )  # type: ignore[call-overload, no-any-return]


def test_the_process_leaves_by_the_exit_code() -> None:
    found = process("solve", "paper", "--set", "limits.deadline_s=60")
    assert found.returncode == 1
    assert "INFEASIBLE" in found.stdout
    assert found.stderr == ""


def test_pictures_without_matplotlib_are_refused_in_one_sentence(tmp_path: Path) -> None:
    """A module that cannot be imported stands in for one that is not installed."""
    (tmp_path / "matplotlib.py").write_text("raise ImportError", "utf-8")
    path = os.pathsep.join([str(tmp_path), str(Path(optuav.__file__).parents[1])])
    for arguments in (("reproduce",), ("solve", "paper", "--plot", "plan")):
        found = process(*arguments, env={**os.environ, "PYTHONPATH": path}, cwd=tmp_path)
        assert found.returncode == 2
        words = "error: pictures need matplotlib, of the extra optuav[plot]; "
        words += 'in a clone of optuav: python -m pip install ".[plot]"\n'
        assert found.stderr == words
    assert [each.name for each in tmp_path.iterdir() if each.name != "__pycache__"] == [
        "matplotlib.py"
    ]


def test_a_reader_that_has_seen_enough_gets_no_traceback() -> None:
    """As ``optuav missions | head -1``."""
    command = [sys.executable, "-m", "optuav", "missions"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as running:
        assert running.stdout is not None
        assert running.stderr is not None
        running.stdout.close()
        assert running.stderr.read() == b""


def test_a_console_without_our_letters_gets_others() -> None:
    """As a Windows console, or LANG=C: no UnicodeEncodeError for Δ and →."""
    found = process("solve", "paper", "--problem", "P3", env={"PYTHONIOENCODING": "ascii"})
    assert found.returncode == 0
    assert "origin -> hover -> destination" in found.stdout


def test_the_command_is_the_library() -> None:
    """What the command shows is what Python gives."""
    assert run("solve", "paper").out.strip() == optuav.solve("paper").summary().strip()


def test_an_infeasible_mission_leads_to_its_explanation() -> None:
    """In text only: what reads JSON gets nothing else, and a plan needs no repair."""
    asked = ("solve", "paper", "--perspective", "battery")
    deadline = ("--set", "limits.deadline_s=70", "--set", "name=short trip")
    _, said, hint = run(*asked, *deadline).out.partition("What would make it feasible:\n")
    assert said
    command = shlex.split(hint.replace("\\\n", ""))
    assert command == ["optuav", "explain", "paper", *asked[2:], *deadline]
    assert "explain" not in run(*asked, *deadline, "--json").out
    assert "explain" not in run(*asked).out


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="the system has no full device")
def test_an_output_that_is_full_or_closed_is_one_sentence() -> None:
    """Whatever the command, without a traceback, and by exit code 2."""
    shell = f"{sys.executable} -m optuav"
    for line, said in (
        (f"{shell} missions --json > /dev/full", "cannot be written: No space left on device"),
        (f"{shell} missions >&-", "the standard output is closed"),
    ):
        found = subprocess.run(["sh", "-c", line], capture_output=True, text=True, check=False)
        assert found.returncode == 2
        assert found.stderr.count("\n") == 1
        assert said in found.stderr


SAID = {"SIGINT": (130, "", "\ninterrupted\n"), "SIGTERM": (143, "", "\nterminated\n")}


@pytest.mark.skipif(sys.platform == "win32", reason="signals are sent as POSIX has them")
@pytest.mark.parametrize(
    ("arguments", "begun", "after_s", "sent"),
    [
        (("sensitivity", "paper"), "sys", 0.1, "SIGINT"),  # while it imports
        # CasADi swallows it.
        (
            ("solve", "paper", "--engine", "casadi", "--problem", "P2-tight"),
            "casadi",
            0.3,
            "SIGINT",
        ),
        (("compare", "paper"), "multiprocessing.popen_spawn_posix", 0.3, "SIGTERM"),  # in processes
    ],
)
def test_control_c_and_sigterm_end_a_command_at_once(
    arguments: tuple[str, ...], begun: str, after_s: float, sent: str, tmp_path: Path
) -> None:
    """By exit code 130 or 143, in one line, and what is half written goes; no semaphore leaks.

    The interrupt comes some time after a module is imported.
    """
    script = f"""
import os, pathlib, signal, sys, threading, time
signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored in the background of a shell
import optuav.cli
from optuav.mission import files
half = pathlib.Path("half"); half.touch(); files.unfinished.add(half)
def interrupt():
    while {begun!r} not in sys.modules:
        time.sleep(0.01)
    time.sleep({after_s})
    os.kill(os.getpid(), signal.{sent})
threading.Thread(target=interrupt, daemon=True).start()
sys.argv = ["optuav", *{arguments!r}]
optuav.cli.main()
"""
    found = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=False, cwd=tmp_path
    )
    assert (found.returncode, found.stdout, found.stderr) == SAID[sent]
    assert not list(tmp_path.iterdir())


def test_json_is_plain_ascii() -> None:
    """Any console shows it, and what it shows can be read back."""
    found = run("solve", "paper", "--perspective", "battery", "--json").out
    assert found.isascii()
    assert json.loads(found)["notes"] == list(optuav.solve("paper", perspective="battery").notes)


ESCAPE = "\x1b[31m\x1b]0;title\x07"


def test_what_a_file_says_does_not_steer_the_terminal(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Escapes in a description, in the texts of a plan, and in a cell are shown as letters.

    On a terminal too, where our own colours are escapes of another kind.
    """
    monkeypatch.chdir(tmp_path)
    plan = optuav.solve("paper", perspective="battery").to_dict()
    plan |= {"notes": [ESCAPE], "proof": ESCAPE, "engine": ESCAPE}
    Path("plan.json").write_text(json.dumps(plan))
    Path("cell.csv").write_text(
        f"load,current_A,lifetime_s\n{ESCAPE},1,900\nb,2,400\nc,4,{ESCAPE}\n"
    )
    described = ("--set", f'description="{ESCAPE}"'.replace("\x1b", "\\u001b").replace("\x07", ""))
    shown = "\N{REPLACEMENT CHARACTER}[31m"
    commands = [
        ("show", "paper", *described),
        ("show", "plan.json"),
        ("calibrate", "kibam", "cell.csv"),
    ]
    for terminal in (False, True):
        monkeypatch.setattr(Pipe, "isatty", lambda _, terminal=terminal: terminal)
        monkeypatch.setenv("TERM", "dumb")
        for command in commands:
            found = run(*command)  # which looks for escapes
            assert shown in found.out + found.err


def test_a_refused_command_makes_no_folder(tmp_path: Path) -> None:
    folder = tmp_path / "new" / "pictures"
    assert "min_soc" in refused(
        "solve", "paper", "--set", "limits.min_soc=2", "--plot", str(folder)
    )
    assert not list(tmp_path.iterdir())


def test_an_own_module_of_the_name_formulations_is_named(tmp_path: Path) -> None:
    """It hides our package from Python, where it lies in the working folder."""
    own = tmp_path / "formulations.py"
    own.write_text("x = 1\n")
    code = "import sys; sys.path.insert(0, ''); import optuav"
    found = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False, cwd=tmp_path
    )
    assert f"{own} is found as 'formulations', and hides the package" in found.stderr


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        (["stops=2"], "--set stops=2: not a key of the mission; use the option --stops 2"),
        (["building=b1"], "--set building=b1: not a key of the mission; use the option --build"),
        (["hover_point="], "--set hover_point=: not a key of the mission; use the option --hove"),
        (["stps=2"], "stps = 2: unknown key"),
    ],
)
def test_a_setting_that_is_an_option_is_named_as_written(settings: list[str], words: str) -> None:
    """Rather than as the option that was not stated."""
    asked = [part for each in settings for part in ("--set", each)]
    assert run("solve", "paper", *asked).err.startswith(f"error: {words}")


def test_a_latitude_out_of_range_is_one_error() -> None:
    """Beside it, the longitude is not asked for; without a fault it is."""
    (line,) = run("show", "paper", "--set", "earth.latitude_deg=91").err.splitlines()
    assert line == "error: earth.latitude_deg = 91: must be a number, |x| <= 90 [deg]"
    assert (
        "earth.longitude_deg: is missing"
        in run("show", "paper", "--set", "earth.latitude_deg=9").err
    )
