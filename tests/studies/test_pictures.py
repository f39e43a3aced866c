"""Pictures of comparisons show the numbers of their tables, with nothing on anything else."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

matplotlib = pytest.importorskip("matplotlib")

import optuav  # noqa: E402
from optuav import plots  # noqa: E402

SLOTS_S = (1.0, 10.0, 60.0)


def small(**values: Any) -> optuav.Mission:
    mission = optuav.load("paper")
    kept = [each.model_dump() for each in mission.buildings if each.name == "b1"]
    return mission.replace({"buildings": kept} | values)


@pytest.fixture(scope="module")
def paper() -> optuav.studies.Comparison:
    return optuav.compare(small(), slots=SLOTS_S, engines=("grid",))


def test_files_of_a_comparison(paper: optuav.studies.Comparison, tmp_path: Path) -> None:
    written = paper.save_pictures(tmp_path / "new")
    assert [path.name for path in written] == ["gaps.png", "plane.png"]
    again = paper.save_pictures(tmp_path / "again")
    for one, other in zip(written, again, strict=True):
        assert one.read_bytes() == other.read_bytes()
        assert one.read_bytes().startswith(b"\x89PNG")


def test_without_slots_or_rests_there_is_less_to_draw(tmp_path: Path) -> None:
    direct = optuav.load("paper").replace({"buildings": []})
    assert optuav.compare(direct, slots=(), engines=()).save_pictures(tmp_path) == []
    late = optuav.compare(small(**{"limits.deadline_s": 60}), slots=(10.0,), engines=("grid",))
    assert late.save_pictures(tmp_path) == []


def test_files_of_choices(tmp_path: Path) -> None:
    written = optuav.compare_by("paper").save_pictures(tmp_path)
    assert [path.name for path in written] == ["choices.png"]


def test_gaps_are_drawn_in_slots_below_their_bound(paper: optuav.studies.Comparison) -> None:
    shown = [
        plots.Gap(row.name.removesuffix(" b1"), cell.method.slot_s, cell.gap_s, cell.largest_gap_s)
        for row, cell in paper.cells
        if row.problem in ("P1", "P3") and cell.method.slot_s and cell.gap_s is not None
    ]
    ax = plots.slot_gaps(shown, "paper")
    (p3,) = [line for line in ax.lines if line.get_label() == "P3"]
    assert p3.get_ydata().tolist() == pytest.approx([0.848, 0.8848, 28.848 / 60.0], abs=1e-4)
    levels = sorted({line.get_ydata()[0] for line in ax.lines if len(line.get_ydata()) == 2})
    assert levels == [0.0, 1.0, 2.0]
    labels = [text.get_text() for text in ax.get_xticklabels()]
    assert labels == ["1 s\nP1 loses 0.54 s", "10 s\nP1 loses 9.54 s", "60 s\nP1 loses 59.5 s"]
    assert ax.get_ylabel().endswith("[slots]")
