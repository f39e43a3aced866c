"""The judge imports nothing that declares or solves."""

from __future__ import annotations

import ast
from pathlib import Path

import optuav.judge

ALLOWED = (
    "optuav.arrays",
    "optuav.errors",
    "optuav.fields",
    "optuav.flight",
    "optuav.frames",
    "optuav.judge",
    "optuav.presentation",
    "optuav.mission",
    "optuav.network.obstacles",
    "optuav.network.places",
    "optuav.network.prisms",
    "optuav.network.vehicle",
    "optuav.network.ways",
    "optuav.options",
    "optuav.physics",
    "optuav.plan",
    "optuav.presentation.text",
)


def imported(file: Path) -> set[str]:
    """Names of the package that a file imports, late imports included."""
    nodes = list(ast.walk(ast.parse(file.read_text("utf-8"))))
    plain = {name.name for node in nodes if isinstance(node, ast.Import) for name in node.names}
    from_modules = {
        f"{node.module}.{name.name}"
        for node in nodes
        if isinstance(node, ast.ImportFrom)
        for name in node.names
    }
    return {
        name for name in plain | from_modules if name.split(".")[0] in ("optuav", "formulations")
    }


def test_the_judge_imports_nothing_that_solves() -> None:
    """Of the network only places, obstacles, ways and the vehicle: no legs, routes or timeline."""
    files = list(Path(optuav.judge.__path__[0]).glob("*.py"))
    names = set().union(*map(imported, files))
    assert "optuav.physics.kibam" in names
    assert [name for name in sorted(names) if not name.startswith(ALLOWED)] == []
