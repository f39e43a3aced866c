"""What libraries print by themselves never reaches the standard output, where answers go."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import optuav

PACKAGE = Path(optuav.__file__).parent
NOISE = "Running NOISE"
STAND_IN = f"""
import ctypes, highspy, os, scipy.optimize
puts = ctypes.CDLL(None).puts

def noisy(call):
    def louder(*given, **named):
        puts(b"{NOISE} through C, which buffers")
        os.write(1, b"{NOISE} to the descriptor\\n")
        open(os.environ["CALLS"], "a").write("called ")
        return call(*given, **named)
    return louder

highspy.Highs.__init__ = noisy(highspy.Highs.__init__)
scipy.optimize.milp = noisy(scipy.optimize.milp)
scipy.optimize.linprog = noisy(scipy.optimize.linprog)
"""
"""HiGHS as its release 1.16 is and louder, and SciPy's copy of it, which note that they ran."""
CALLS = {
    "pyomo": "optuav.solve('paper', 'P3', perspective='battery', engine=optuav.Pyomo())",
    "options of pyomo": "optuav.Pyomo(options={'mip_rel_gap': 0.0})",
    "event": "optuav.coverage('matrice350').event(2.0)",
}

pytestmark = pytest.mark.skipif(os.name != "posix", reason="the stand-in prints as POSIX's C does")


def printed(script: str) -> str:
    """What a script of its own process prints to a pipe."""
    asked = sys.executable, "-c", script
    return subprocess.run(asked, stdout=subprocess.PIPE, text=True, check=True).stdout


@pytest.fixture
def calls(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The stand-in in every process that is started, and the file in which it notes its calls."""
    (tmp_path / "sitecustomize.py").write_text(STAND_IN)
    places = [str(tmp_path), os.environ.get("PYTHONPATH", "")]
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, places)))
    monkeypatch.setenv("CALLS", str(tmp_path / "calls"))
    return tmp_path / "calls"


@pytest.mark.parametrize(
    "arguments",
    [
        "formulate paper --problem P3 --perspective battery --lp",
        "solve paper --problem P3 --perspective battery --engine cvxpy --json",
        "compare paper --perspective battery --engines closed-form,cvxpy --slots 60 --json",
    ],
)
def test_a_noisy_solver_does_not_reach_the_output_of_a_command(calls: Path, arguments: str) -> None:
    """Nor in the processes that a command starts."""
    said = printed(f"import sys, optuav.cli; sys.argv[1:] = {arguments.split()}; optuav.cli.main()")
    assert calls.exists(), "the stand-in never ran"
    assert NOISE not in said
    if "--json" in arguments:
        assert json.loads(said)
    else:
        assert said.startswith("\\ ")
        assert said.endswith("end\n")


@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS.keys())
def test_a_noisy_solver_does_not_reach_the_output_of_a_script(calls: Path, call: str) -> None:
    assert printed(f"import optuav\nprint('before')\n{call}\nprint('after')") == "before\nafter\n"
    assert calls.exists(), "the stand-in never ran"


def test_whoever_uses_highs_knows_silence() -> None:
    """Also SciPy's copy of it."""
    users = {
        path
        for path in PACKAGE.rglob("*.py")
        if "lessons" not in path.parts
        and re.search(r"import highspy|\b(linprog|milp)\(", path.read_text("utf-8"))
    }
    assert len(users) >= 4
    assert [path for path in users if "silent()" not in path.read_text("utf-8")] == []


def test_what_is_printed_before_and_after_keeps_its_order() -> None:
    """By Python and by C, each with a buffer of its own, and in the silence by Python."""
    said = printed(
        "import ctypes, os, sys; from optuav.silence import silent; C = ctypes.CDLL(None)\n"
        "print('1 Python', end=' '); sys.stdout.flush(); C.puts(b'2 C'); print('3 é', end=' ')\n"
        "with silent():\n"
        "    C.puts(b'no'); os.write(1, b'no'); print('4 é')\n"
        "    with silent():\n"
        "        C.puts(b'no')\n"
        "    os.write(1, b'no'); print('5')\n"
        "print('6'); sys.stdout.flush(); os.write(1, b'7\\n'); C.puts(b'8')"
    )
    assert said.split() == ["1", "Python", "2", "C", "3", "é", "4", "é", "5", "6", "7", "8"]


def test_threads_still_print() -> None:
    """Four threads go in and out of silence while one prints 4000 lines.

    A line that is being written when a silence begins may be lost, here one in some 100 000. Two
    threads that print lose lines by themselves (python/cpython issue 119506).
    """
    said = printed(
        """
import os, sys, threading
from optuav.silence import silent
before = os.fstat(1)
def solve():
    for _ in range(300):
        with silent():
            os.write(1, b"no\\n")
def talk():
    for number in range(4000):
        print(f"{number}\\n", end="")
sys.setswitchinterval(1e-5)
threads = [threading.Thread(target=solve) for _ in range(4)]
threads += [threading.Thread(target=talk)]
[thread.start() for thread in threads]
[thread.join() for thread in threads]
assert os.path.samestat(before, os.fstat(1)) and sys.stdout is sys.__stdout__
"""
    )
    heard = [int(word) for word in said.split()]
    assert len(set(heard)) == len(heard)
    assert 3990 <= len(heard) <= 4000
    assert set(heard) <= set(range(4000))


def test_an_error_ends_the_silence() -> None:
    said = printed(
        "import os; from optuav.silence import silent\n"
        "try:\n"
        "    with silent(): raise KeyError\n"
        "except KeyError: os.write(1, b'heard')"
    )
    assert said == "heard"


def test_a_stream_of_a_notebook_stays_in_its_place() -> None:
    """It does not write to the descriptor, so it needs no substitute."""
    said = printed(
        "import io, sys; from optuav.silence import silent; sys.stdout = io.StringIO()\n"
        "with silent(): print('cell')\n"
        "sys.__stdout__.write(sys.stdout.getvalue())"
    )
    assert said == "cell\n"


def test_a_process_without_standard_output_has_nothing_to_silence() -> None:
    printed(
        "import os, sys; os.close(1); from optuav.silence import silent\n"
        "with silent(): pass\n"
        "sys.stdout = None\n"
        "with silent(): pass"
    )
