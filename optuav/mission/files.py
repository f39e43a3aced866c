"""Text files, read and written whole; what is wrong with one is raised as an `InputError`."""

from __future__ import annotations

import contextlib
import os
import re
import stat
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from optuav.errors import Fault, InputError
from optuav.mission.messages import printable, safe_name

# tomllib's time grows with the square of the parts of a dotted key.
_PART = r"""(?>[\w-]+|"[^"\n]*"|'[^'\n]*')[ \t]*"""
_DEEP_KEY = re.compile(rf"(?<![\w-])(?>{_PART}\.[ \t]*){{32}}", re.ASCII)


def label(path: Path) -> str:
    """The path as a fault shows it."""
    return printable(str(path))


def refusal(path: Path, words: str) -> InputError:
    """What is wrong with a file as a whole."""
    return InputError([Fault("", "", words, label(path))])


def read_text(path: Path, limit: int, *, hint: str = "") -> str:
    """The text of a regular file in UTF-8, with or without a byte-order mark, up to `limit` bytes.

    The hint is added where there is no such file.
    """
    with refusals(path, "read"):
        try:
            kind = path.stat().st_mode
        except FileNotFoundError:
            raise refusal(path, f"there is no such file{hint}") from None
        if not stat.S_ISREG(kind):
            what = "a directory, not a file" if stat.S_ISDIR(kind) else "not a regular file"
            raise refusal(path, f"is {what}")
        with path.open("rb") as file:
            content = file.read(limit + 1)
    if len(content) > limit:
        raise refusal(path, f"is larger than the {limit / 1e6:g} MB that are read")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        words = f"is not text in UTF-8: byte 0x{error.object[error.start]:02x} at {error.start}"
        raise refusal(path, words) from None


def read_toml(path: Path, limit: int, *, hint: str = "") -> dict[str, Any]:
    """The tables of a TOML file, see `read_text`; refused if they are nested too deeply."""
    text = read_text(path, limit, hint=hint)
    if _DEEP_KEY.search(text):
        raise refusal(path, "has a dotted name of more than 32 parts")
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise refusal(path, "is nested too deeply") from None
    except ValueError as error:
        if '"kind": "optuav plan"' in text[:1000]:
            raise refusal(path, "is a saved plan; optuav show and optuav audit take it") from None
        raise refusal(path, f"is not TOML: {safe_name(str(error))}") from None


def must_be_new(path: Path) -> None:
    """Refuse a name that is taken, for a file that people go on to edit."""
    with refusals(path, "written"):
        if path.exists():
            raise refusal(path, "exists already; name a new file")


def write_text(path: Path, text: str) -> None:
    """Write a text file in UTF-8, see `write_bytes`."""
    write_bytes(path, text.encode("utf-8"))


def write_bytes(path: Path, content: bytes) -> None:
    """Write all of a file, or leave what was there; a link is followed."""
    with refusals(path, "written"):
        target = Path(os.path.realpath(path))
        if target.is_dir():
            raise refusal(path, "is a directory, not a file")
        if not target.parent.is_dir():
            raise refusal(path, f"there is no directory {label(target.parent)}")
        temporary = target.with_name(f".{os.urandom(8).hex()}.tmp")
        try:
            with temporary.open("xb") as file:
                file.write(content)
            os.replace(temporary, target)
        finally:
            with contextlib.suppress(OSError):
                temporary.unlink(missing_ok=True)


def make_directory(path: Path) -> None:
    """Make a directory where there is none."""
    with refusals(path, "made"):
        path.mkdir(parents=True, exist_ok=True)


@contextlib.contextmanager
def refusals(path: Path, done: str) -> Iterator[None]:
    """Turn the system's errors into an `InputError`."""
    try:
        yield
    except InputError:
        raise
    except FileExistsError:
        raise refusal(path, "is not a directory") from None
    except OSError as error:
        raise refusal(path, f"cannot be {done}: {error.strerror}") from None
    except ValueError:
        raise refusal(path, "is not a possible path") from None
