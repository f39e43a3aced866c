"""The labelled table: the same rows in every form, and examples that run."""

from __future__ import annotations

import csv
import io
import json

import numpy as np
import pytest

import optuav
from optuav.studies.results import Results
from optuav.studies.uncertainty import Chances


@pytest.fixture
def table() -> Results:
    """Two rows by hand, one without a value."""
    rows = (
        {"name": "one", "time_s": 1.5, "route": ("a", "b"), "why": ("x",)},
        {"name": "two", "time_s": None, "route": (), "why": ()},
    )
    units = {"name": "", "time_s": "s", "route": ""}
    facts = {"shares": {0.25: np.float64(3.0)}, "names": ("p", "q")}
    mission = optuav.load("paper")
    return Results("by hand", mission, facts, units, rows, lambda *_: ["text"], lambda _: [])


def test_records_have_the_columns_and_nothing_else(table: Results) -> None:
    assert table.records() == [
        {"name": "one", "time_s": 1.5, "route": "a > b"},
        {"name": "two", "time_s": None, "route": ""},
    ]


def test_csv_and_frame_hold_the_records(table: Results) -> None:
    first, second = csv.DictReader(io.StringIO(table.to_csv()))
    assert first == {"name": "one", "time_s": "1.5", "route": "a > b"}
    assert second == {"name": "two", "time_s": "", "route": ""}
    pytest.importorskip("pandas")
    frame = table.to_frame()
    assert list(frame.columns) == ["name", "time_s", "route"]
    assert frame.time_s[0] == 1.5


def test_plain_data_hold_everything_and_are_json(table: Results) -> None:
    data = table.to_dict()
    assert json.loads(json.dumps(data, allow_nan=False)) == data
    assert data["shares"] == {"0.25": 3.0}
    assert data["names"] == ["p", "q"]
    assert data["rows"][0] == {"name": "one", "time_s": 1.5, "route": ["a", "b"], "why": ["x"]}
    assert data["units"]["time_s"] == "s"
    assert data["mission"] == table.mission.to_dict()


def test_single_samples_stay_out_of_plain_data(table: Results) -> None:
    """They may be millions."""
    share = Chances(1, 0, ("k",), True, 2.0, {0.5: 2.0}, 0.0, {}, None, None, np.array([2.0]))
    found = Results("by hand", table.mission, {"of": share}, {}, (), table.show, table.draw)
    assert found.to_dict()["of"]["mean_s"] == 2.0
    assert "hover_times_s" not in found.to_dict()["of"]


def test_a_table_without_rows_keeps_its_columns(table: Results) -> None:
    found = Results("by hand", table.mission, {}, table.units, (), table.show, table.draw)
    assert found.to_csv() == "name,time_s,route\n"
    assert str(found) == "text"
    assert found.plot() == {}
