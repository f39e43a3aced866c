"""Starting: the import, and the command line against what it cannot do without."""

from __future__ import annotations

import statistics
import subprocess
import sys
import time

from benchmarks.timing import Row

NEEDED = """
import numpy, pydantic, shapely, typer.main
class Model(pydantic.BaseModel):
    figure: float
"""
REPEATS = 9


def run() -> list[Row]:
    """Whole processes, in turn."""
    imported, bare = _interleaved(["-c", "import optuav"], ["-c", "pass"])
    solved, needed = _interleaved(["-m", "optuav", "solve", "paper"], ["-c", NEEDED])
    extra_s = imported - bare
    return [
        Row("import optuav over bare Python / 0.2 s", extra_s, 0.2, at_most=1.0),
        Row("optuav solve paper / the imports it needs", solved, needed, at_most=1.3),
    ]


def _interleaved(ours: list[str], other: list[str]) -> tuple[float, float]:
    pairs = [(_process_s(ours), _process_s(other)) for _ in range(REPEATS + 1)][1:]
    return statistics.median(a for a, _ in pairs), statistics.median(b for _, b in pairs)


def _process_s(arguments: list[str]) -> float:
    begin = time.perf_counter()
    subprocess.run([sys.executable, *arguments], check=True, stdout=subprocess.DEVNULL)
    return time.perf_counter() - begin
