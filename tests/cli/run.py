"""Runs a command as the shell would, in this process."""

from __future__ import annotations

import io
import re
import signal
import sys
from typing import NamedTuple

import pytest

from optuav.cli import main

WIDTH = 80


class Ran(NamedTuple):
    """What a command left behind."""

    code: int
    out: str
    err: str


class Pipe(io.TextIOWrapper):
    """A standard stream that is no terminal."""

    def __init__(self) -> None:
        super().__init__(io.BytesIO(), "utf-8", write_through=True)

    @property
    def text(self) -> str:
        buffer = self.buffer
        assert isinstance(buffer, io.BytesIO)
        return buffer.getvalue().decode("utf-8")


def run(*arguments: str, columns: int | None = None, warns: bool = False) -> Ran:
    """Run ``optuav`` with arguments, its streams piped, COLUMNS stated or not.

    Whatever the command and the answer, it leaves by an exit code of the four that are documented,
    shows no traceback and colours nothing. Only a command that `warns`, as its output is a file,
    writes to the error stream what is no error.
    """
    out, err = Pipe(), Pipe()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "stdout", out)
        patch.setattr(sys, "stderr", err)
        # The handler that `main` sets for a broken pipe would end the tests.
        patch.setattr(signal, "signal", lambda *_: None)
        for name in ("COLUMNS", "FORCE_COLOR", "CLICOLOR_FORCE", "TTY_COMPATIBLE"):
            patch.delenv(name, raising=False)
        if columns is not None:
            patch.setenv("COLUMNS", str(columns))
        try:
            main(list(arguments))
            code = 0
        except SystemExit as left:
            code = int(left.code or 0)
    found = Ran(code, out.text, err.text)
    assert code in (0, 1, 2, 3)
    assert "\x1b" not in found.out + found.err
    assert "Traceback" not in found.out + found.err
    assert (code >= 1 or warns) >= bool(found.err), "what is no error goes to the standard output"
    return found


def words(text: str) -> str:
    """A text as one line, without the frames around it."""
    return " ".join(re.sub("[╭╮╰╯─│]", " ", text).split())


def widest(text: str) -> int:
    """Length of the longest line."""
    return max(map(len, text.splitlines()), default=0)


def refused(*arguments: str) -> str:
    """The words with which a command refuses its input."""
    found = run(*arguments)
    assert found.code == 2
    assert found.out == ""
    return found.err
