"""``optuav lessons``: all of the course in a folder, or nothing."""

from __future__ import annotations

import errno
import json
import os
from pathlib import Path

import pytest

from tests.cli.run import refused, run
from tests.exercises.worked import ROOT, editions

LESSONS = sorted((ROOT / "examples").glob("*.py"))


def test_notebooks_and_their_data_are_copied(tmp_path: Path) -> None:
    folder = tmp_path / "course" / "mine"
    said = run("lessons", str(folder))
    assert (said.code, said.err) == (0, "")
    assert said.out.startswith(f"wrote {len(LESSONS)} notebooks and their data into {folder}; next")
    assert [path.stem for path in sorted(folder.glob("*.ipynb"))] == [p.stem for p in LESSONS]
    for path in folder.glob("*.ipynb"):
        assert json.loads(path.read_text("utf-8"))["nbformat"] == 4
    for path in (folder / "data").iterdir():
        assert path.read_bytes() == (ROOT / "examples" / "data" / path.name).read_bytes()
    assert (folder / "data" / "lifetimes.csv").exists()


def test_scripts_are_the_lessons_without_solutions(tmp_path: Path) -> None:
    """Cell by cell; blank lines between cells may differ."""
    assert run("lessons", str(tmp_path), "--scripts").code == 0
    assert not [*tmp_path.glob("*.ipynb")]
    for path in LESSONS:
        stated = editions().without_solutions(path.read_text("utf-8"))
        copied = (tmp_path / path.name).read_text("utf-8")
        assert editions().cells(copied) == editions().cells(stated)
        assert copied.partition("# %%")[0] == stated.partition("# %%")[0]
        compile(copied, path.name, "exec")


def test_nothing_is_overwritten(tmp_path: Path) -> None:
    """All files that stand in the way are listed, and none is written; --force replaces them."""
    names = (LESSONS[0].with_suffix(".ipynb").name, "data/lifetimes.csv")
    (tmp_path / "data").mkdir()
    for name in names:
        (tmp_path / name).write_text("my own work")
    said = refused("lessons", str(tmp_path))
    assert all(f"{tmp_path / name}: exists already" in said for name in names)
    assert {path.read_text() for path in tmp_path.rglob("*.*") if path.is_file()} == {"my own work"}
    assert run("lessons", str(tmp_path), "--force").code == 0
    assert "my own work" not in (tmp_path / names[0]).read_text("utf-8")


def test_a_copy_that_fails_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the disk is full before the last file is written."""
    replace, count = os.replace, 0

    def full(*places: str) -> None:
        nonlocal count
        count += 1
        if count > 5:
            raise OSError(errno.ENOSPC, "No space left on device")
        replace(*places)

    monkeypatch.setattr(os, "replace", full)
    said = refused("lessons", str(tmp_path / "a" / "b"))
    assert "No space left on device" in said
    assert not (tmp_path / "a").exists()


def test_a_place_that_is_a_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "course").write_text("")
    assert "is not a directory" in refused("lessons", str(tmp_path / "course"))
