"""The order of the code that no linter checks: no circles, and no two classes of one name."""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import networkx

ROOT = Path(__file__).resolve().parents[1]
FILES = {
    ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): path
    for base in ("optuav", "formulations")
    for path in (ROOT / base).rglob("*.py")
}


def imports(tree: ast.AST) -> Iterator[str]:
    """Modules of ours that a tree imports, within functions and for type checkers too."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module:
            inner = {f"{node.module}.{alias.name}" for alias in node.names} & FILES.keys()
            yield from inner or FILES.keys() & {node.module}


def test_nothing_imports_in_a_circle() -> None:
    """Not even late, or for types alone."""
    graph = networkx.DiGraph()
    for name, path in FILES.items():
        found = imports(ast.parse(path.read_text("utf-8")))
        graph.add_edges_from((name, other) for other in found)
    circles = [sorted(names) for names in networkx.strongly_connected_components(graph)]
    assert [names for names in circles if len(names) > 1] == []


def test_no_two_classes_have_one_name() -> None:
    """A reader who searches for a class finds one."""
    names = Counter(
        node.name
        for path in FILES.values()
        for node in ast.walk(ast.parse(path.read_text("utf-8")))
        if isinstance(node, ast.ClassDef)
    )
    assert {name: count for name, count in names.items() if count > 1} == {}
