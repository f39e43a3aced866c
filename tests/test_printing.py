"""What is printed where the standard output lacks our letters, as on Windows into a file."""

from __future__ import annotations

import os
import subprocess
import sys
from types import SimpleNamespace
from typing import Any

import pytest

from optuav.errors import spelled

PROGRAM = """
import optuav
from optuav import exercises

paper = optuav.load("paper")
plan = optuav.solve(paper)
program = optuav.formulate(paper, "P3")
(answer,) = program.answers()
late = paper.replace({"limits.deadline_s": 60})
choice = optuav.route_choice(paper, perspective="battery")
print(paper, plan, program, answer, program.parts[0].model, choice, optuav.shipped(), sep="\\n")
checks = program.check({"hover_time_s": 700.0})
print(checks, checks[0], repr(plan), optuav.audit(plan), optuav.solve(late), sep="\\n")
print(optuav.explain(plan), optuav.explain(late), sep="\\n")
print(*optuav.replay(plan).events, sep="\\n")
print(optuav.compare(paper, by="perspective"), optuav.ledger("table1"), sep="\\n")
task = exercises.task("05.1")
print(task, exercises.check("05.1", task.model), exercises.check("01.1", 1.0), sep="\\n")
try:
    paper.replace({"limits.deadline_s": "≤ Δ"})
except optuav.InputError as error:
    print(error, error.faults[0], sep="\\n")
"""


@pytest.mark.parametrize("encoding", ["ascii", "cp1252"])
def test_every_object_prints_in_any_encoding(encoding: str) -> None:
    """No UnicodeEncodeError, and no sign that nobody could read."""
    places = {**os.environ, "PYTHONIOENCODING": encoding}
    command = [sys.executable, "-c", PROGRAM]
    ran = subprocess.run(command, env=places, capture_output=True, check=False)
    assert ran.stderr.decode() == ""
    text = ran.stdout.decode(encoding)
    assert "origin -> hover -> destination" in text
    assert "Delta" in text
    assert "?" not in text.replace("did you mean", "")


@pytest.mark.parametrize(
    ("encoding", "text"),
    [
        ("ascii", "origin -> b9: Delta <= 5.1 m s-1, omega = 3 * 10-3, lambda, a"),
        ("cp1252", "origin -> b9: Delta <= 5.1 m s-¹, omega = 3 · 10-³, lambda, ä"),
        ("utf-8", "origin → b9: Δ ≤ 5.1 m s⁻¹, ω = 3 · 10⁻³, λ, ä"),
    ],
)
def test_only_what_an_encoding_lacks_is_spelled(encoding: str, text: str) -> None:
    stream: Any = SimpleNamespace(encoding=encoding)
    assert spelled("origin → b9: Δ ≤ 5.1 m s⁻¹, ω = 3 · 10⁻³, λ, ä", stream) == text
