"""Silence of libraries, whose words would mix with answers on the standard output."""

import ctypes
import io
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from threading import Lock
from typing import Any, TextIO

STANDARD = 1  # The descriptor to which libraries in C write


class _Output:
    """The standard output of the process while libraries are at work, in one thread or many."""

    def __init__(self) -> None:
        self.lock, self.within = Lock(), 0
        self.kept: int | None = None  # A copy of the descriptor; threads may write to it later
        self.replaced: TextIO | None = None
        self.beside: TextIO | None = None

    def shut(self) -> None:
        """Let the descriptor lead nowhere; Python prints to a copy of it."""
        _flush()
        self.kept = os.dup(STANDARD) if self.kept is None else os.dup2(STANDARD, self.kept, False)
        if _writes_there(stream := sys.stdout):
            self.replaced = stream
            self.beside = _beside(self.kept, stream.encoding, stream.errors)
            sys.stdout = self.beside  # First, so that no thread writes to a stream that is shut
            stream.flush()
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, STANDARD)
        os.close(nowhere)

    def reopen(self) -> None:
        """Let the descriptor lead where it led before."""
        assert self.kept is not None
        _flush()
        os.dup2(self.kept, STANDARD)
        if self.beside is not None and sys.stdout is self.beside:
            sys.stdout = self.replaced
        self.replaced = self.beside = None


_output = _Output()


@contextmanager
def silent() -> Iterator[None]:
    """Discard what libraries write to the standard output by themselves, in C.

    An option of the library is better where there is one; HiGHS greets before it takes any. What
    Python prints meanwhile in other threads still appears, but for streams that were taken from
    `sys.stdout` before, such as those of loggers, and for a write that another thread has begun
    when the silence begins.
    """
    if not _is_open():
        yield
        return
    with _output.lock:
        if not _output.within:
            _output.shut()
        _output.within += 1
    try:
        yield
    finally:
        with _output.lock:
            _output.within -= 1
            if not _output.within:
                _output.reopen()


def _is_open() -> bool:
    """Return whether the process has a standard output."""
    try:
        os.fstat(STANDARD)
    except OSError:
        return False
    return True


def _writes_there(stream: TextIO | None) -> bool:
    """Return whether a stream writes to the descriptor; a notebook's or a test's does not."""
    try:
        return stream is not None and stream.fileno() == STANDARD
    except (AttributeError, OSError, ValueError):
        return False


@cache
def _beside(descriptor: int, encoding: str, errors: str | None) -> TextIO:
    """A stream to a descriptor, as Python's own under -u.

    It lives on, as Python's `print` may write to it in another thread when it is replaced.
    """
    raw: Any = io.FileIO(descriptor, "w", closefd=False)
    return io.TextIOWrapper(raw, encoding, errors, write_through=True)


def _flush() -> None:
    """Write what C has buffered for the standard output."""
    if sys.platform == "win32":
        ctypes.CDLL("ucrtbase").fflush(None)
        return
    library = ctypes.CDLL(None)
    name = "__stdoutp" if sys.platform == "darwin" else "stdout"
    library.fflush(ctypes.c_void_p.in_dll(library, name))
