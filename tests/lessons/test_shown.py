"""Cells show objects: hardly any line of a lesson formats text."""

from __future__ import annotations

import ast
from pathlib import Path

ROOT = Path(__file__).parents[2]
LESSONS = sorted((ROOT / "examples").glob("*.py"))


def spanned(node: ast.expr) -> set[int]:
    return set(range(node.lineno, (node.end_lineno or node.lineno) + 1))


def formatting(code: str) -> tuple[int, int]:
    """How many lines of code print or format, and how many there are; no comments or blanks."""
    lines = {
        number
        for number, line in enumerate(code.splitlines(), 1)
        if line.strip() and not line.lstrip().startswith("#")
    }
    found = set[int]()
    for node in ast.walk(ast.parse(code)):
        if isinstance(node, ast.FormattedValue) and node.format_spec:
            found |= spanned(node)
        if isinstance(node, ast.Call) and ast.unparse(node.func) in ("print", "format"):
            found |= spanned(node)
    return len(found & lines), len(lines)


def test_counts_lines_that_format() -> None:
    code = 'print(\n    1,\n)\n# print(2)\nx = f"{1:.2f}"\n\ny = f"{x}"\nz = {"a": 1}\n'
    assert formatting(code) == (4, 6)


def test_at_most_a_tenth_of_the_code_formats() -> None:
    """Before the exercises, over the course."""
    bodies = (path.read_text("utf-8").partition("# ## Exercises")[0] for path in LESSONS)
    counts = {path.stem: formatting(body) for path, body in zip(LESSONS, bodies, strict=True)}
    formatted, lines = map(sum, zip(*counts.values(), strict=True))
    assert formatted <= 0.1 * lines, counts
