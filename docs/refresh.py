"""Bring the pages up to date: ``python docs/refresh.py``.

Every block of a page is run, in order, in a temporary folder, and what it prints is written into
the page; tables that are made from the code are written too. ``make_pictures.py`` draws pictures.
"""

from __future__ import annotations

import os
import re
import shlex
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import chdir, contextmanager, redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any
from unittest.mock import patch

import make_mission_keys
import make_tables

from optuav.cli import main
from optuav.registration import EVERY_KIND

DOCS = Path(__file__).parent
PAGES = (DOCS.parent / "README.md", *sorted(DOCS.glob("*.md")))
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
COMMAND = re.compile(r"^\$ ((?:.*\\\n)*.*\n)((?:(?!\$ ).*\n)*)", re.MULTILINE)


class Reader:
    """Runs the blocks of a page in order, and keeps what they printed until it is shown.

    A block in ``toml`` or ``csv`` is a file, its name in the first line; ``python`` and ``text``
    are a script and what it prints; ``console`` has commands with what they print; ``sh`` commands
    that succeed.
    """

    def __init__(self) -> None:
        self.names: dict[str, Any] = {}
        self.code = 0
        self.unseen = ""

    def block(self, fence: re.Match[str]) -> str:
        """A block with what it shows now."""
        language, body = fence.groups()
        assert language == "text" or not self.unseen, f"not shown: {self.unseen}"
        return f"```{language}\n{getattr(self, language)(body)}```"

    def toml(self, body: str) -> str:
        name = body.partition("\n")[0].removeprefix("# ")
        Path(name).write_text(body, "utf-8")
        return body

    csv = toml

    def python(self, body: str) -> str:
        printed = StringIO()
        with redirect_stdout(printed), redirect_stderr(printed):
            exec(compile(body, "page", "exec", dont_inherit=True), self.names)
        self.unseen = _stripped(printed.getvalue())
        return body

    def text(self, body: str) -> str:
        assert self.unseen, f"nothing prints this: {body}"
        shown, self.unseen = self.unseen, ""
        return shown

    def sh(self, body: str) -> str:
        for line in body.splitlines():
            self.run(line)
            assert self.code == 0, line
        return body

    def console(self, body: str) -> str:
        return COMMAND.sub(lambda command: f"$ {command[1]}{self.run(command[1].strip())}", body)

    def run(self, line: str) -> str:
        """What a command prints."""
        if line == "echo $?":
            return f"{self.code}\n"
        name, *arguments = shlex.split(line.replace("\\\n", ""))
        assert name == "optuav", line
        printed = StringIO()
        self.code = 0
        with redirect_stdout(printed), redirect_stderr(printed):
            try:
                main(arguments)
            except SystemExit as exit_:
                self.code = int(exit_.code or 0)
        return _stripped(printed.getvalue())


def _stripped(text: str) -> str:
    return "".join(f"{line.rstrip()}\n" for line in text.splitlines())


@contextmanager
def clone() -> Iterator[None]:
    """A temporary working folder, with the data of the lessons where a clone has them."""
    with tempfile.TemporaryDirectory() as folder, chdir(folder):
        shutil.copytree(DOCS.parent / "examples" / "data", Path("examples", "data"))
        yield


def refreshed(page: Path) -> str:
    """A page as it should be."""
    text = page.read_text("utf-8")
    if page == make_mission_keys.PAGE:
        text = make_mission_keys.page()
    text = make_tables.written(text)
    reader = Reader()
    with clone(), patch.dict(os.environ):
        os.environ.pop("COLUMNS", None)
        text = BLOCK.sub(reader.block, text)
    for kind in EVERY_KIND:
        for name in kind.registered():
            kind.take_out(name)
    assert not reader.unseen, f"not shown: {reader.unseen}"
    return text


if __name__ == "__main__":
    for page in PAGES:
        text = refreshed(page)
        if text != page.read_text("utf-8"):
            page.write_text(text, "utf-8")
            print(f"changed {page.name}")
