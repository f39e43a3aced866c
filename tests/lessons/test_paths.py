"""The reading paths of the page of lessons hold what their lessons need."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "lessons.md").read_text("utf-8")
ROW = re.compile(r"^\| (\w\d) \| .*? \| \d+ \| (.*?) \|", re.MULTILINE)
PATH = re.compile(r"^\| [a-z][^|]* \| (01, [^|]*) \|$", re.MULTILINE)


def listed(text: str) -> set[str]:
    """Numbers of lessons, where \"05 to 07\" are three."""
    found = set[str]()
    for part in filter(None, text.split(", ")):
        first, _, last = part.partition(" to ")
        found |= {f"{each:02}" for each in range(int(first), int(last) + 1)} if last else {first}
    return found


def test_paths_hold_what_their_lessons_need() -> None:
    after = {number: listed(needed) for number, needed in ROW.findall(PAGE)}
    paths = [listed(path) for path in PATH.findall(PAGE)]
    assert (len(after), len(paths)) == (37, 8)
    missing = [(number, after[number] - path) for path in paths for number in sorted(path)]
    assert [each for each in missing if each[1]] == []
