"""A problem of one's own on the command line: a class of a file, its fields, what breaks."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path

import pytest

import optuav
from tests.cli.run import refused, run
from tests.diagnosis.missions import only

MINE = '''
from dataclasses import dataclass
import optuav
from beside import WORTH

@dataclass(frozen=True)
class LeastLaser(optuav.Formulation):
    """Least energy of the laser for a wanted hover time."""

    wanted_hover_s: float
    worth: float = WORTH

    def declare(self, model, given):
        hover, rest = given.hover_and_rest(model)
        model.minimise(self.worth * given.laser_power_W * (hover + rest), unit="J")
        model.subject_to("wanted hover", hover >= self.wanted_hover_s, unit="s")
        model.subject_to("charge", given.soc_end(hover, rest) >= given.min_soc)
        given.keep_wells(model, "charge", hover, rest)
        given.keep_deadline(model, "deadline", hover, rest)

class Wrong(optuav.Formulation):
    """A name that nothing has."""

    def declare(self, model, given):
        model.maximise(given.lazer_power_W * model.variable("hover_time_s", "Δ", unit="s"))

class Half(optuav.Formulation):
    """No declare."""

class Longest(optuav.Formulation):
    """Longest hover for half the rest, with an __init__ of its own."""

    def __init__(self, share: float, /, worth: float = 1.0):
        self.share, self.worth = share, worth

    def declare(self, model, given):
        hover, rest = given.hover_and_rest(model)
        model.maximise(self.worth * hover, unit="s")
        model.subject_to("charge", given.soc_end(hover, self.share * rest) >= given.min_soc)
        given.keep_wells(model, "charge", hover, rest)
        given.keep_deadline(model, "deadline", hover, rest)

class Short(optuav.Formulation):
    """A declare that forgot the given quantities."""

    def declare(self, model):
        model.maximise(model.variable("hover_time_s", "Δ", unit="s"))
'''
COMMANDS = ("solve", "explain", "formulate")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the file, and one that it imports, in which commands are run."""
    (tmp_path / "mine.py").write_text(MINE, "utf-8")
    (tmp_path / "beside.py").write_text("WORTH = 1.0\n", "utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [*sys.path])
    monkeypatch.delitem(sys.modules, "beside", raising=False)
    return tmp_path


def test_solve_finds_what_python_finds(folder: Path) -> None:
    """220.37 s of rest for 700 s of hover at 1000 W; keys with a dot are the mission's."""
    own = ("--problem", "mine.py:LeastLaser", "--set", "wanted_hover_s=700", "--set", "worth=2")
    settings = ("--perspective", "battery", "--set", "limits.deadline_s=1100")
    done = run("solve", "paper", *own, *settings, "--json", "--save", "plan.json")
    assert done.code == 0, done.err
    found = json.loads(done.out)
    assert found["objective"] == pytest.approx(2.0 * 1000.0 * 920.368, rel=1e-6)
    assert (found["objective_unit"], found["problem"]) == ("J", "LeastLaser")
    assert optuav.load_plan("plan.json").objective == found["objective"]


def test_explain_and_formulate_take_it_too(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also with the options of problems; what would help is a command that can be run."""
    only(monkeypatch, "limits")
    own = ("--problem", "mine.py:LeastLaser", "--perspective", "battery", "--building", "b1")
    written = run("formulate", "paper", *own, "--set", "wanted_hover_s=700").out
    assert "laser.power_W  laser_power_W     1000" in written
    assert "Δ ≥ 700" in written
    none = run("solve", "paper", *own, "--set", "wanted_hover_s=7000")
    assert none.code == 1
    assert "--problem mine.py:LeastLaser" in none.out
    assert "--set wanted_hover_s=7000" in none.out
    explained = run("explain", "paper", *own, "--set", "wanted_hover_s=740")
    assert explained.code == 1
    assert "wanted_hover_s <= 7" in explained.out


def test_a_class_with_its_own_init_takes_its_arguments(folder: Path) -> None:
    """Like a dataclass its fields: as Python does, and one that has no default must be stated."""
    own = ("--problem", "mine.py:Longest", "--perspective", "battery", "--set", "worth=2")
    half, whole = (
        json.loads(run("solve", "paper", *own, "--set", f"share={share}", "--json").out)
        for share in (0.5, 1)
    )
    assert half["objective"] == 2.0 * half["hover_time_s"] < whole["objective"]
    assert whole["hover_time_s"] == pytest.approx(
        optuav.solve("paper", perspective="battery").hover_time_s
    )


TWICE = """
import optuav
class Twice(optuav.Formulation):
    def declare(self, model, given):
        model.maximise(model.variable("x", "x", unit="s"))
        for symbol in "yz":
            model.variable("x", symbol, unit="s")
"""
BROKEN = [
    (("mine.py:LeastLaser",), "wanted_hover_s: problem LeastLaser needs a value of this field"),
    (("mine.py:LeastLaser", "wanted=7"), "takes no wanted; did you mean 'wanted_hover_s'?"),
    (("mine.py:LeastLaser", "wanted_hover_s"), "--set = 'wanted_hover_s': must be KEY=VALUE"),
    (("mine.py:LeastLaser", "wanted_hover_s=x"), "wanted_hover_s = 'x': must be a number"),
    (("mine.py:LeastLaser", "wanted_hover_s=true"), "wanted_hover_s = True: must be a number"),
    (("mine.py:LeastLaser", "wanted_hover_s=7", "worth=[1]"), "worth = [1]: must be a number"),
    (("mine.py:LeastLasr",), "it has LeastLaser, Wrong, Longest, Short; did you mean 'LeastL"),
    (("mine.py:Longest",), "share: problem Longest needs a value of this field"),
    (
        ("mine.py:Longest", "share=x", "wort=1"),
        "share = 'x': must be a number\n       wort = 1: problem",
    ),
    (("mine.py:Short",), "--problem = Short: its declare must accept a model and the given"),
    (("mine.py:Half",), "--problem = 'mine.py:Half': the file has no class of this name"),
    (("mine.py:WORTH",), "--problem = 'mine.py:WORTH': the file has no class of this name"),
    (("mine.py:Wrong",), "mine.py, line 25: AttributeError: given has no 'lazer_power_W'; did you"),
    (("mine.py",), "--problem = 'mine.py': must be FILE.py:CLASS, such as mine.py:LeastLaser"),
    (("missing.py:Least",), "missing.py: there is no such file"),
    (("folder.py:Least",), "folder.py: is a directory, not a file"),
    (("pipe.py:Least",), "pipe.py: is no regular file"),
    (("latin.py:Least",), "latin.py: is not text in UTF-8"),
    (("long.py:Least",), "long.py: is larger than the 1 MB that are read"),
    (("half.py:Least",), "half.py, line 2: SyntaxError: "),
    (("null.py:Least",), "Error: source code string cannot contain null bytes"),
    (("deep.py:Least",), "deep.py, line 1: RecursionError: "),
    (("zero.py:Least",), "zero.py, line 2: ZeroDivisionError: division by zero"),
    (("ends.py:Least",), "ends.py: ended with SystemExit(0) while it ran"),
    (("twice.py:Twice",), "twice.py, line 7: the model has a variable 'x' already"),
    (("lacks.py:Least",), "lacks.py, line 1: ModuleNotFoundError: No module named 'nowhere_x'"),
]


@pytest.mark.parametrize(("stated", "words"), BROKEN, ids=[words for _, words in BROKEN])
def test_what_is_broken_is_one_error_without_a_traceback(
    folder: Path, stated: tuple[str, ...], words: str
) -> None:
    (folder / "folder.py").mkdir()
    os.mkfifo(folder / "pipe.py")
    (folder / "latin.py").write_bytes(b"\xff\xfe")
    (folder / "long.py").write_text("#" * 1_000_001)
    (folder / "half.py").write_text("\ndef half(:\n")
    (folder / "null.py").write_text("\0")
    (folder / "deep.py").write_text(".".join("a" * 100_000))
    (folder / "zero.py").write_text("\n1 / 0\n")
    (folder / "ends.py").write_text("import sys\nsys.exit(0)\n")
    (folder / "twice.py").write_text(TWICE)
    (folder / "lacks.py").write_text("import nowhere_x\n")
    problem, *settings = stated
    asked = [part for each in settings for part in ("--set", each)]
    for command in COMMANDS if len(stated) > 1 else COMMANDS[:1]:
        done = run(command, "paper", "--problem", problem, *asked)
        assert (done.code, done.out) == (2, "")
        assert words in done.err
        assert done.err.startswith("error: ")
        assert "Traceback" not in done.err


def test_a_null_byte_is_a_value_error_of_an_old_python(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Before 3.11.4 and 3.12, a SyntaxError since."""

    def refuse(*_: object) -> None:
        raise ValueError("source code string cannot contain null bytes")

    (folder / "null.py").write_text("\0")
    monkeypatch.setattr("optuav.cli.problem_file.compile", refuse, raising=False)
    assert refused("solve", "paper", "--problem", "null.py:Least") == (
        "error: null.py, line 1: ValueError: source code string cannot contain null bytes\n"
    )


def test_the_help_says_that_the_file_is_run() -> None:
    for command in COMMANDS:
        words = " ".join(run(command, "--help").out.replace("│", " ").split())
        assert "FILE.py:CLASS for your own" in words
        assert "with your rights: use only files that you trust" in words


def test_fields_of_problems_of_the_paper_are_options() -> None:
    """A key without a dot is the mission's, as before."""
    done = run("solve", "paper", "--problem", "P3", "--set", "wanted_hover_s=7")
    assert (done.code, "wanted_hover_s = 7: unknown key" in done.err) == (2, True)
