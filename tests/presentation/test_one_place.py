"""Numbers for people have their digits from `optuav.presentation.numbers`, nowhere else."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
OF_NUMBER = re.compile(r"[,_z]|(^|\d)[eEfFgGn%]$")
"""A format spec that chooses digits, unlike a width, a side, a longest text or a date."""
IN_BRACES = re.compile(r"\{\w*:[^{}]*[eEfFgGn%]\}")
ALLOWED = {
    "optuav/presentation/numbers.py": "the one place",
    "optuav/export/waypoints.py": "numbers of a file for autopilots",
    "optuav/plan/display.py": "coordinates within SVG [pixel]",
    "optuav/plots/style.py": "ticks of axes, whose digits fit their steps",
    "optuav/paper/ledger.py": "two digits more than the paper prints, in files too",
}
"""Files that may choose digits, and why."""


def texts_of(expression: ast.expr) -> list[str]:
    """The texts of an expression."""
    return [str(node.value) for node in ast.walk(expression) if isinstance(node, ast.Constant)]


def chosen(tree: ast.Module) -> Iterator[str]:
    """Format specs that choose digits: in f-strings, and in texts that are formatted."""
    for node in ast.walk(tree):
        match node:
            case ast.FormattedValue(format_spec=ast.JoinedStr() as spec):
                parts = (
                    part.value if isinstance(part, ast.Constant) else 0 for part in spec.values
                )
                if OF_NUMBER.search("".join(map(str, parts))):
                    yield f"line {node.lineno}: {ast.unparse(node.value)}"
            case ast.Attribute(value=ast.Constant(value=str(text)), attr="format"):
                if IN_BRACES.search(text):
                    yield f"line {node.lineno}: {text}"
            case ast.Call(func=ast.Name("format"), args=[value, spec]):
                if OF_NUMBER.search(" ".join(texts_of(spec))):
                    yield f"line {node.lineno}: {ast.unparse(value)}"


@pytest.mark.parametrize(
    ("line", "count"),
    [
        ('f"{x:.2f} s"', 1),
        ('f"{x:g}"', 1),
        ('f"{x:.{digits}g}"', 1),
        ('f"{x:,}"', 1),
        ('"{:.3f} s".format', 1),
        ('format(x, ".10g")', 1),
        ('format(x, form or ".10g")', 1),
        ('format(x, ">12")', 0),
        ('f"{x:>12}"', 0),
        ('f"{x!r:.60}"', 0),
        ('f"{x:%Y-%m-%d %H:%M}"', 0),
        ('"{} s".format(x)', 0),
    ],
)
def test_digits_are_recognised(line: str, count: int) -> None:
    """Specs of numbers count; those of texts and dates do not."""
    assert len([*chosen(ast.parse(line))]) == count


def test_digits_are_chosen_in_one_place() -> None:
    """Other files call its functions, so that a quantity has the same digits wherever it stands."""
    specs = {
        path.relative_to(ROOT).as_posix(): [*chosen(ast.parse(path.read_text("utf-8")))]
        for base in ("optuav", "formulations")
        for path in (ROOT / base).rglob("*.py")
    }
    choosing = {name: written for name, written in specs.items() if written}
    assert {name: choosing[name] for name in choosing.keys() - ALLOWED.keys()} == {}
    assert ALLOWED.keys() - choosing.keys() == set()  # An exception without need
