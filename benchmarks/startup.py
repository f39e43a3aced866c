"""Starting: the import, and the command line against what it cannot do without."""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
from resource import RUSAGE_CHILDREN, getrusage

from benchmarks.timing import Row

NEEDED = """
import numpy, pydantic, typer.main
class Model(pydantic.BaseModel):
    figure: float
"""
REPEATS = 9
TARGETS = {"solve paper": 3.0, "--help": 1.2, "--version": 1.2, "missions": 1.2}
"""Most time of a command over that of `import numpy`."""


def run() -> list[Row]:
    """Whole processes, in turn."""
    processes = {
        "nothing": ["-c", "pass"],
        "import optuav": ["-c", "import optuav"],
        "import numpy": ["-c", "import numpy"],
        "needed": ["-c", NEEDED],
        **{command: ["-m", "optuav", *command.split()] for command in TARGETS},
    }
    rounds = [{name: process_s(each) for name, each in processes.items()} for _ in range(REPEATS)]
    median = {name: statistics.median(each[name] for each in rounds) for name in processes}
    extra_s = median["import optuav"] - median["nothing"]
    solved, numpy = median["solve paper"], median["import numpy"]
    return [
        Row("import optuav over bare Python / 0.2 s", extra_s, 0.2, at_most=1.0),
        Row("optuav solve paper / the imports it needs", solved, median["needed"], at_most=1.3),
        *(
            Row(f"optuav {command} / import numpy", median[command], numpy, at_most=most)
            for command, most in TARGETS.items()
        ),
    ]


def process_s(arguments: list[str]) -> float:
    """CPU time of a process [s], with the bytecode of all modules at hand."""
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
    before = getrusage(RUSAGE_CHILDREN)
    command = [sys.executable, *arguments]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, env=environment)
    after = getrusage(RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime
