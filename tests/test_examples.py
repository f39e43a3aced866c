"""The examples run, teach, and print what they computed."""

from __future__ import annotations

import ast
import io
import os
import re
import runpy
import subprocess
import sys
import warnings
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))
NUMBER = re.compile(r"(?<![\w.])\d+(?:\.\d+)?(?![\w.])")

LONG = ("16_two_packs", "20_what_matters_most", "27_on_a_cluster")
"""Examples that take long, over packs, samples and clusters that have tests of their own."""

pytestmark = pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)


@pytest.fixture
def tree(example: Path) -> ast.Module:
    return ast.parse(example.read_text("utf-8"))


@pytest.mark.slow
def test_runs_without_warnings(
    example: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """In a folder of its own, in which it leaves nothing behind, and on a console without Greek."""
    if example.stem in LONG:
        pytest.skip("runs in make soak, in a process of its own")
    monkeypatch.chdir(tmp_path)
    console = io.TextIOWrapper(io.BytesIO(), "cp1252")
    monkeypatch.setattr(sys, "stdout", console)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        runpy.run_path(str(example), run_name="__main__")
    console.seek(0)
    printed = console.read()
    assert capsys.readouterr().err == ""
    assert len(printed.splitlines()) >= 5
    assert list(tmp_path.iterdir()) == []


@pytest.mark.soak
def test_runs_in_a_process_of_its_own(example: Path, tmp_path: Path) -> None:
    """Nothing that another example loaded or set is needed, and no warning comes at the start.

    Its console has no Greek either.
    """
    done = subprocess.run(
        [sys.executable, "-W", "error", str(example)],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT), "PYTHONIOENCODING": "cp1252"},
        capture_output=True,
        text=True,
        encoding="cp1252",
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")


def test_is_short_and_in_cells(example: Path) -> None:
    text = example.read_text("utf-8")
    assert len(text.splitlines()) < 130
    assert text.count("\n# %%\n") >= 3
    assert text.startswith("# %% [markdown]\n# # ")


def test_says_what_is_learnt(example: Path) -> None:
    """Before the first line of code, as a list of what the reader can do afterwards."""
    head, _, _ = example.read_text("utf-8").partition("# %%\n")
    assert "**Learning intentions.** After this page you can" in head
    assert len(re.findall(r"^# - ", head, re.MULTILINE)) >= 3


def test_checks_itself(example: Path, tree: ast.Module) -> None:
    assert sum(isinstance(node, ast.Assert) for node in ast.walk(tree)) >= 8


def texts(node: ast.AST) -> Iterator[str]:
    """Texts that stand in an expression as they are; how a number is formatted is none of them."""
    if isinstance(node, ast.FormattedValue):
        yield from texts(node.value)
    elif isinstance(node, ast.Constant) and isinstance(node.value, str):
        yield node.value
    else:
        for child in ast.iter_child_nodes(node):
            yield from texts(child)


def test_prints_no_number_that_it_did_not_compute(example: Path, tree: ast.Module) -> None:
    """Neither in the texts that are printed nor as an argument of print."""
    calls = [node for node in ast.walk(tree) if isinstance(node, ast.Call)]
    printed = [each for call in calls if ast.unparse(call.func) == "print" for each in call.args]
    assert printed
    assert [text for each in printed for text in texts(each) if NUMBER.search(text)] == []
    bare = [each for each in printed if isinstance(each, ast.Constant)]
    assert all(isinstance(each.value, str) for each in bare)
