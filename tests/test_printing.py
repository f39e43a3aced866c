"""What is printed where the standard output lacks our letters, as on Windows into a file."""

from __future__ import annotations

import io
import os
import subprocess
import sys
from types import SimpleNamespace
from typing import Any

import pytest

import optuav
from optuav.errors import encodable
from optuav.presentation.blocks import Table
from optuav.presentation.text import as_text, lined_up

PROGRAM = """
import sys

import optuav
from optuav import exercises
from optuav.diagnosis import repair

repair.TABLES = ("limits", "link")  # More would take seconds
paper = optuav.load("paper")
plan = optuav.solve(paper)
program = optuav.formulate(paper, "P3")
(answer,) = program.answers()
late = paper.replace({"limits.deadline_s": 60})
choice = optuav.route_choice(paper, perspective="battery")
checks = program.check({"hover_time_s": 700.0})
whys = optuav.explain(plan), optuav.explain(late, "P3")
siting = optuav.place_laser([paper, paper], [[1000, 0, 50], [0, 0, 50]], lasers=2)
compared = optuav.compare(paper, by="perspective")
task = exercises.task("07.1")
grades = exercises.check("07.1", {}), exercises.check("02.1", 1.0)
ledger, table = optuav.ledger(), optuav.ledger("table1")
for encoding in sys.argv[1:]:
    sys.stdout.reconfigure(encoding=encoding)
    print(paper, plan, program, answer, program.parts[0].model, choice, optuav.shipped(), sep="\\n")
    print(checks, checks[0], repr(plan), optuav.audit(plan), optuav.solve(late), sep="\\n")
    print(*whys, *optuav.replay(plan).events, sep="\\n")
    print(paper.summary(), plan.summary(), sep="\\n")
    print(ledger.summary, ledger.details, table, sep="\\n")
    print(siting, siting.summary(), compared, task, *grades, sep="\\n")
    try:
        paper.replace({"limits.deadline_s": "≤ Δ"})
    except optuav.InputError as error:
        print(error, error.faults[0], sep="\\n")
    print("~~~", flush=True)
"""


def test_every_object_prints_in_any_encoding() -> None:
    """No UnicodeEncodeError, and no sign that nobody could read."""
    encodings = ("ascii", "cp1252")
    command = [sys.executable, "-c", PROGRAM, *encodings]
    ran = subprocess.run(command, capture_output=True, check=False)
    assert ran.stderr.decode() == ""
    *printed, rest = ran.stdout.split(f"~~~{os.linesep}".encode())
    assert rest == b""
    for encoding, content in zip(encodings, printed, strict=True):
        text = content.decode(encoding)
        assert "origin -> hover -> destination" in text
        assert "Delta" in text
        assert "?" not in text.replace("did you mean", ""), encoding


@pytest.mark.parametrize("encoding", ["ascii", "cp1252", "utf-8"])
def test_columns_stay_aligned(encoding: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of tables of plans, models and explanations: cells are padded as they are shown."""
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(io.BytesIO(), encoding))
    rows = [("a → b", "Δ…", "1"), ("c", "d", "22"), ("e…" * 20, "f", "3")]
    words = as_text([Table(rows[0], rows[1:], words=2)]).splitlines()
    assert len({len(line) for line in words}) == 1
    lines = zip(lined_up(rows, 200), rows, strict=True)
    assert len({line.rindex(row[2]) for line, row in lines}) == 1
    plan = optuav.solve("paper")
    _, _, timeline, *_ = str(plan).split("\n\n")
    first, *others = timeline.splitlines()
    flights = [line for line in others if line.startswith("flight")]
    end = first.index("start s") + len("start s")
    assert len(flights) == 3
    for line in flights:
        assert line[:end].split()[-1].replace(".", "").isdigit()
        assert line[end : end + 2] == "  "
    _, _, where = str(optuav.formulate("paper", "P3")).partition("where\n")
    keys = {"deadline_s", "min_soc", "packs", "capacity_As"}
    assert (
        len({line.index(key) for line in where.splitlines() for key in keys & {*line.split()}}) == 1
    )


@pytest.mark.parametrize(
    ("encoding", "text"),
    [
        ("ascii", "origin -> b9: Delta <= 5.1 m s-1, omega = 3 * 10-3, lambda, a"),
        ("cp1252", "origin -> b9: Delta <= 5.1 m s-¹, omega = 3 · 10-³, lambda, ä"),
        ("utf-8", "origin → b9: Δ ≤ 5.1 m s⁻¹, ω = 3 · 10⁻³, λ, ä"),
    ],
)
def test_only_what_an_encoding_lacks_becomes_plain(encoding: str, text: str) -> None:
    stream: Any = SimpleNamespace(encoding=encoding)
    assert encodable("origin → b9: Δ ≤ 5.1 m s⁻¹, ω = 3 · 10⁻³, λ, ä", stream) == text
