"""Files as they are written: whole or not at all, whatever fails and whatever is there."""

from __future__ import annotations

import errno
import io
import os
import stat
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from optuav.errors import InputError
from optuav.mission import files
from optuav.mission.files import read_text, write_files, write_text

fcntl = pytest.importorskip("fcntl")

CALLS = ("open", "write", "fsync", "fstat", "fchmod", "fchown", "unlink", "replace", "close")
closing = os.close
OLD, NEW = "old", "new " * 1000


class Dead(BaseException):
    """Stands for the end of the process: from here on nothing has an effect."""


class Faults:
    """Counts the calls to the system that write a file, and lets them fail from one on."""

    def __init__(self, patch: pytest.MonkeyPatch) -> None:
        self.made, self.first, self.error, self.last = 0, -1, OSError(), False
        for name in CALLS:
            patch.setattr(os, name, self.counted(getattr(os, name)))
        patch.setattr(fcntl, "flock", self.counted(fcntl.flock))

    def counted(self, call: Callable[..., Any]) -> Callable[..., Any]:
        def made(*given: Any, **options: Any) -> Any:
            number, self.made = self.made, self.made + 1
            fails = number == self.first or (self.last and number > self.first >= 0)
            if fails and call is not closing:
                raise self.error
            done = call(*given, **options)
            if fails:  # a file is closed even where that fails
                raise self.error
            return done

        return made


@pytest.mark.parametrize("there", ["nothing", "a file", "what a kill has left"])
@pytest.mark.parametrize("code", [errno.EIO, errno.ENOSPC, errno.EACCES])
def test_a_fault_at_any_call_leaves_the_old_file_or_the_new_one(
    there: str, code: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And nothing else in the folder; where nothing is said, the file is the new one."""
    path, left = tmp_path / "plan.json", tmp_path / files.TEMPORARY
    faults, failing, done = Faults(monkeypatch), 0, False
    while not done:
        for each in tmp_path.iterdir():
            each.unlink()
        if there != "nothing":
            path.write_text(OLD)
        if there == "what a kill has left":
            left.write_text("half")
        faults.made, faults.first, faults.error = 0, failing, OSError(code, os.strerror(code))
        said = ""
        try:
            write_text(path, NEW)
        except InputError as error:
            said = str(error)
        done, faults.first = faults.made <= failing, -1
        found = path.read_text() if path.exists() else "nothing"
        assert found == NEW or (said and found == (OLD if there != "nothing" else "nothing"))
        assert not said or os.strerror(code) in said
        others = [each for each in tmp_path.iterdir() if each != path]
        assert not others or (there == "what a kill has left" and others == [left])
        failing += 1
    assert failing > 8


@pytest.mark.parametrize("there", [True, False])
def test_a_kill_at_any_call_leaves_a_whole_file_and_the_next_write_clears_up(
    there: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "plan.json"
    faults, killed, done = Faults(monkeypatch), 0, False
    while not done:
        faults.first = -1
        path.unlink(missing_ok=True)
        if there:
            path.write_text(OLD)
        faults.made, faults.first, faults.error, faults.last = 0, killed, Dead(), True
        try:
            write_text(path, NEW)
            done = True
        except Dead:
            faults.first = -1
            content = path.read_text() if path.exists() else None
            assert content in (NEW, OLD if there else None)
        faults.first = -1
        write_text(path, NEW * 2)
        assert path.read_text() == NEW * 2
        assert list(tmp_path.iterdir()) == [path]
        killed += 1
    assert killed > 8


def test_data_and_folder_are_safe_before_the_file_has_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    synced = list[int]()
    real = os.fsync, os.replace

    def sync(number: int) -> None:
        synced.append(stat.S_IFMT(os.fstat(number).st_mode))
        real[0](number)

    def replace(old: Path, new: Path) -> None:
        assert synced == [stat.S_IFREG, stat.S_IFDIR]
        real[1](old, new)

    monkeypatch.setattr(os, "fsync", sync)
    monkeypatch.setattr(os, "replace", replace)
    write_text(tmp_path / "plan.json", NEW)


def test_mode_owner_and_links_stay(tmp_path: Path) -> None:
    """Of a file that others read, that two names lead to, and that a link leads to."""
    path, link, twin = tmp_path / "plan.json", tmp_path / "link", tmp_path / "twin"
    path.write_text(OLD)
    path.chmod(0o640)
    if os.geteuid() == 0:
        os.chown(path, 1234, 5678)
    before = path.stat()
    link.symlink_to(path)
    write_text(link, NEW)
    assert (link.is_symlink(), path.read_text()) == (True, NEW)
    after = path.stat()
    assert (after.st_mode, after.st_uid, after.st_gid) == (
        before.st_mode,
        before.st_uid,
        before.st_gid,
    )
    os.link(path, twin)
    write_text(path, OLD)
    assert twin.read_text() == OLD
    assert path.samefile(twin)
    assert {each.name for each in tmp_path.iterdir()} == {"plan.json", "link", "twin"}


def test_a_file_with_two_names_keeps_what_it_has_where_writing_fails(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It cannot be replaced, so what was there is put back."""
    path, real, failing = tmp_path / "plan.json", os.ftruncate, [True]
    path.write_text(OLD)
    os.link(path, tmp_path / "twin")

    def truncate(number: int, length: int) -> None:
        if failing.pop():
            failing.append(False)
            raise OSError(errno.EIO, "Input/output error")
        real(number, length)

    monkeypatch.setattr(os, "ftruncate", truncate)
    with pytest.raises(InputError, match="Input/output error"):
        write_text(path, NEW)
    assert path.read_text() == OLD


def test_a_device_and_a_pipe_are_written_to(tmp_path: Path) -> None:
    """They stay what they are."""
    write_text(Path("/dev/null"), NEW)
    assert stat.S_ISCHR(Path("/dev/null").stat().st_mode)
    pipe, read = tmp_path / "pipe", list[str]()
    os.mkfifo(pipe)
    reader = threading.Thread(target=lambda: read.append(pipe.read_text()))
    reader.start()
    write_text(pipe, NEW)
    reader.join(10.0)
    assert read == [NEW]
    assert stat.S_ISFIFO(pipe.stat().st_mode)


def test_a_read_only_file_stays(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Though its folder would let it be replaced; root may write everything: simulated."""
    path = tmp_path / "plan.json"
    path.write_text(OLD)
    monkeypatch.setattr(os, "access", lambda *_: False)
    with pytest.raises(InputError, match="cannot be written: Permission denied"):
        write_text(path, NEW)
    assert path.read_text() == OLD


def test_of_several_files_none_is_written_where_one_has_no_place(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="there is no directory"):
        write_files({tmp_path / "a": b"1", tmp_path / "no" / "b": b"2"})
    assert not list(tmp_path.iterdir())


def test_writers_of_one_folder_wait_for_one_another(tmp_path: Path) -> None:
    """Each of many files has one of the contents, whole."""
    path = tmp_path / "plan.json"
    texts = [str(number) * 10_000 for number in range(8)]
    threads = [threading.Thread(target=write_text, args=(path, text)) for text in texts]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert path.read_text() in texts
    assert list(tmp_path.iterdir()) == [path]


def test_a_dash_is_standard_input_and_output() -> None:
    code = """
from pathlib import Path
from optuav.mission.files import read_text, write_text
write_text(Path("-"), read_text(Path("-"), 100).upper())
"""
    done = subprocess.run(
        [sys.executable, "-c", code], input="a\u0394", capture_output=True, text=True, check=True
    )
    assert done.stdout == "A\u0394"


def test_an_output_that_takes_nothing_is_called_by_its_name(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def full() -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    output = io.TextIOWrapper(io.BytesIO())
    monkeypatch.setattr(output, "flush", full)
    monkeypatch.setattr(sys, "stdout", output)
    with pytest.raises(InputError, match=r"^standard output: cannot be written: No space left"):
        write_text(files.STANDARD, NEW)


def test_a_redirected_output_that_is_named_as_a_file_keeps_all(tmp_path: Path) -> None:
    """What is printed and what is saved go to the same file; neither replaces the other."""
    path = tmp_path / "out"
    code = "print('before', flush=True); from pathlib import Path; "
    code += f"from optuav.mission.files import write_text; write_text(Path({str(path)!r}), 'saved')"
    with path.open("w") as out:
        subprocess.run([sys.executable, "-c", code], stdout=out, check=True)
    assert read_text(path, 100) == "before\nsaved"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a = 1\na = 2\n", "line 2, column 6: a key or a table appears twice"),
        ("a = 1\n[b]\n[b]", "line 3, column 3: a key or a table appears twice"),
        ("a = ", "its end: this is neither a key nor a value"),
        ("a 1", "line 1, column 3: an equals sign is missing"),
        ("a = 1 b", "line 1, column 7: a new line is missing after the value"),
        ("a = [1", "its end: a bracket is not closed"),
        ("a = 'x", "its end: a text has no closing quote"),
        ('a = "\\q"', "line 1, column 8: a backslash begins no known escape"),
        ("[a", "its end: a bracket is not closed"),
    ],
)
def test_what_is_no_toml_is_told_in_our_words(text: str, words: str) -> None:
    with pytest.raises(InputError) as refusal:
        files.parse_toml(text, "x.toml")
    assert str(refusal.value) == f"x.toml: is not TOML: {words}"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "it is empty"),
        ("a", "line 1, column 1: this is neither a key nor a value"),
        ('{"a": [1,', "line 1, column 10: it ends within a value, as if it were cut off"),
        ("{'a': 1}", "line 1, column 2: a name in double quotes is missing"),
        ('{"a" 1}', "line 1, column 6: a colon is missing"),
        ('{"a": [1 2]}', "line 1, column 10: a comma or a closing bracket is missing"),
        ('{"a": 1}\n}', "line 2, column 1: the value has ended; delete the rest"),
        ('{"a": "x', "line 1, column 7: a text has no closing quote"),
        ('{"a": "\\q"}', "line 1, column 8: a backslash begins no known escape"),
        ('{"a": "\n"}', "line 1, column 8: a text has a control character"),
    ],
)
def test_what_is_no_json_is_told_in_our_words(text: str, words: str) -> None:
    with pytest.raises(InputError) as refusal:
        files.parse_json(text, "x.json")
    assert str(refusal.value) == f"x.json: is not JSON: {words}"
