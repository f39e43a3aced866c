"""A mission that cannot be loaded hides no other fault, in Python and on the command line."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

import optuav
from optuav.errors import InputError
from tests.cli.run import run

BOX = {"drain": {"percent": 5}}
ASKED: dict[str, tuple[Callable[[], object], str]] = {
    "solve": (lambda: optuav.solve("nosuch", perspective="x"), "perspective"),
    "formulate": (lambda: optuav.formulate("nosuch", slot_s=-1), "slot_s"),
    "explain": (lambda: optuav.explain("nosuch", engine="x"), "engine"),
    "batch": (lambda: optuav.batch_arrays("nosuch", {}, perspective="x"), "perspective"),
    "problem": (lambda: optuav.batch_arrays("nosuch", {}, "P9"), "problem"),
    "compare": (lambda: optuav.compare("nosuch", by="x"), "by"),
    "sensitivity": (lambda: optuav.sensitivity("nosuch", samples=0), "samples"),
    "layouts": (lambda: optuav.layouts("nosuch", count=0), "count"),
    "coverage": (lambda: optuav.coverage("nosuch", swap_s=-1), "swap_s"),
    "size_fleet": (lambda: optuav.size_fleet("nosuch", share=-1), "share"),
    "robust": (lambda: optuav.robust("nosuch", BOX, samples=0), "samples"),
    "robust problem": (lambda: optuav.robust("nosuch", BOX, "P2"), "problem"),
    "map": (lambda: optuav.maps.device("nosuch", -1), "step_m"),
}


@pytest.mark.parametrize(("ask", "key"), ASKED.values(), ids=ASKED)
def test_in_python(ask: Callable[[], object], key: str) -> None:
    with pytest.raises(InputError) as refused:
        ask()
    assert [fault.key for fault in refused.value.faults if fault.key] == [key]
    assert sum("nosuch: there is no such file" in str(each) for each in refused.value.faults) == 1


@pytest.mark.parametrize(
    "words",
    [
        ("solve", "--perspective", "x"),
        ("solve", "--problem", "P9"),
        ("solve", "--problem", "P4"),
        ("solve", "--problem", "P3", "--order", "rest-first"),
        ("solve", "--problem", "mine.py:Least"),
        ("solve", "--set", "limits.min_soc"),
        ("solve", "--slot-s", "-1", "--set", "limits.min_soc=0.2"),
        ("explain", "--engine", "x"),
        ("formulate", "--perspective", "x"),
        ("compare", "--by", "x"),
        ("sensitivity", "--samples", "0"),
        ("coverage", "--swap-s", "-1"),
        ("size", "--share", "-1"),
        ("map", "--over", "x", "--step", "50"),
    ],
    ids=" ".join,
)
def test_on_the_command_line(
    words: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Both faults in one message."""
    monkeypatch.chdir(tmp_path)
    command, option, *_ = words
    done = run(command, "nosuch", *words[1:])
    assert (done.code, done.out) == (2, "")
    lines = done.err.splitlines()
    assert sum("nosuch: there is no such file" in line for line in lines) == 1
    named = "mine.py" if ".py" in words[-1] else "--building" if "P4" in words else option
    named = "--order" if "--order" in words else named
    assert any(line.removeprefix("error:").strip().startswith(named) for line in lines), done.err


def test_a_mission_whose_changes_are_refused_hides_none_either() -> None:
    done = run("solve", "paper", "--set", "limits.min_soc=2", "--perspective", "x")
    assert done.code == 2
    assert "limits.min_soc = 2" in done.err
    assert "--perspective = 'x'" in done.err
