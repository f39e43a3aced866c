"""Buildings as columns: the same values, faults and files as buildings one by one."""

from __future__ import annotations

import math
import pickle
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

import optuav
from optuav import fields
from optuav.fields import MOST_ITEMS
from optuav.mission import Mission, building_columns
from optuav.mission.building_columns import of_polygons
from optuav.mission.buildings import Buildings
from tests.mission.strategies import buildings as listings

PAPER = optuav.load("paper")
NAN = float("nan")


def faults_of(mission: Mission, **columns: Any) -> list[str]:
    """What `with_buildings` says of columns; nothing where it takes them."""
    try:
        mission.with_buildings(columns)
    except optuav.InputError as error:
        return sorted(map(str, error.faults))
    return []


def faults_of_rows(mission: Mission, rows: list[dict[str, Any]]) -> list[str]:
    """What `replace` says of the same buildings as tables."""
    try:
        mission.replace({"buildings": rows})
    except optuav.InputError as error:
        return sorted(map(str, error.faults))
    return []


@given(listed=listings())
def test_a_table_holds_what_was_stated(listed: list[dict[str, Any]]) -> None:
    """Every value comes back, one by one, in slices, in columns, and pickled."""
    mission = PAPER.replace({"buildings": listed})
    table = mission.buildings
    assert mission.to_dict()["buildings"] == listed
    assert [each.model_dump(mode="json", exclude_none=True) for each in table] == listed
    assert table.names == tuple(each["name"] for each in listed)
    assert table.roof_m.tolist() == [list(each["position_m"]) for each in listed]
    assert [*table[1:]] == [*table][1:]
    assert [*table[::-1]] == [*table][::-1]
    again = pickle.loads(pickle.dumps(mission))
    assert again == mission
    assert hash(again) == hash(mission)
    if listed:
        assert table[-1] == table[len(table) - 1]
        assert mission.replace({"buildings": table[1:]}) != mission


def test_buildings_differ_by_any_value() -> None:
    """Equality is by content; -0.0 is 0.0, as it is to Python."""
    shapes = [[4.0, 4.0], [4.0, 5.0], [[0, 0], [9, 0], [9, 9], [0, 9]], None]
    rows = [
        {"name": name, "position_m": [x, 2.0, 3.0], **({"footprint_m": shape} if shape else {})}
        for name in ("a", "b")
        for x in (1.0, 2.0)
        for shape in shapes
    ]
    tables = [PAPER.replace({"buildings": [row]}).buildings for row in rows]
    twins = [PAPER.replace({"buildings": [row]}).buildings for row in rows]
    for number, table in enumerate(tables):
        assert [each for each, twin in enumerate(twins) if twin == table] == [number]
        assert hash(twins[number]) == hash(table)
    low, high = (
        PAPER.replace({"buildings": [{"name": "a", "position_m": [x, 0, 0]}]}) for x in (0.0, -0.0)
    )
    assert low == high
    assert hash(low) == hash(high)
    assert Buildings() != ()


@given(data=st.data())
@example(data=None)
def test_columns_have_the_faults_of_rows(data: st.DataObject | None) -> None:
    """Whatever stands in the cells, as lists or as arrays, and where there are several faults."""
    if data is None:
        rows = [
            ("a", 0.0, 0.0, NAN, 0.0, 0.0),
            ("a", 1, 2, 3, NAN, NAN),
            ("hover", 1, 2, -1, 4, NAN),
        ]
    else:
        number = st.sampled_from([0.0, 1, -1.0, 5, 2e6, NAN, math.inf, 1e-4, 0, -0.0])
        odd = st.sampled_from([None, True, "3", 10**400, np.float32(2.5), [1.0]])
        cell = number if data.draw(st.booleans()) else number | odd
        name = st.sampled_from(["a", "b", "c", "origin", "", "x" * 201, "\n", None, 3])
        row = st.tuples(name, cell, cell, cell, cell, cell)
        rows = data.draw(st.lists(row, max_size=5))
    names = ("name", "x_m", "y_m", "z_m", "width_m", "depth_m")
    columns: dict[str, Any] = dict(zip(names, map(list, zip(*rows, strict=True)), strict=False))
    columns = columns or {key: [] for key in names}
    stated = []
    for name, *at, width, depth in rows:
        plain = [each.tolist() if isinstance(each, np.generic) else each for each in at]
        stated.append({"name": name, "position_m": plain})
        size = [each.tolist() if isinstance(each, np.generic) else each for each in (width, depth)]
        if not all(each is None or str(each) == "nan" for each in size):
            stated[-1]["footprint_m"] = size
    stated = [{key: each for key, each in row.items() if each is not None} for row in stated]
    expected = faults_of_rows(PAPER, stated)
    assert faults_of(PAPER, **columns) == expected
    kinds = {type(each) for row in rows for each in row[1:]}
    if kinds <= {float}:
        arrays = {key: np.array(each, float) for key, each in columns.items() if key != "name"}
        assert faults_of(PAPER, name=columns["name"], **arrays) == expected
    if not expected:
        assert PAPER.with_buildings(columns) == PAPER.replace({"buildings": stated})


RINGS = {
    "square": [[0, 0], [9, 0], [9, 9], [0, 9]],
    "far off": [[50, 50], [59, 50], [59, 59], [50, 59]],
    "crossed": [[0, 0], [9, 9], [9, 0], [0, 9]],
    "flat": [[0, 0], [9, 0], [5, 0]],
    "of two": [[0, 0], [9, 9]],
    "beyond": [[0, 0], [2e6, 0], [9, 9]],
    "nowhere": [[0, 0], [NAN, 0], [9, 9]],
}


@pytest.mark.parametrize("kinds", [*((each,) for each in RINGS), *pairwise(RINGS), tuple(RINGS)])
def test_polygons_of_arrays_have_the_faults_of_rows(kinds: Sequence[str]) -> None:
    rings = [RINGS[each] for each in kinds]
    roofs = [[5.0, 1.0, 9.0]] * len(rings)
    rows = [
        {"name": name, "position_m": at, "footprint_m": [[float(x), float(y)] for x, y in ring]}
        for name, at, ring in zip(kinds, roofs, rings, strict=True)
    ]
    corners = np.array([corner for ring in rings for corner in ring], float)
    columns = kinds, np.array(roofs), corners, np.array([*map(len, rings)])
    if expected := faults_of_rows(PAPER, rows):
        with pytest.raises(optuav.InputError) as caught:
            of_polygons(*columns)
        assert sorted(map(str, caught.value.faults)) == expected
    else:
        assert of_polygons(*columns) == PAPER.replace({"buildings": rows}).buildings


def test_columns_may_be_longer_than_lists() -> None:
    count = MOST_ITEMS + 3
    columns = {"name": map(str, range(count)), "x_m": np.arange(count) / 1000.0}
    columns |= {"y_m": np.zeros(count), "z_m": np.ones(count)}
    mission = PAPER.with_buildings(columns)
    assert len(mission.buildings) == count
    assert mission.replace({"limits.deadline_s": 900}).buildings is mission.buildings


def test_single_buildings_of_a_long_table_are_replaced(monkeypatch: pytest.MonkeyPatch) -> None:
    columns = {"name": [*"abcdefgh"], "x_m": range(8), "y_m": [0.0] * 8, "z_m": [1.0] * 8}
    mission = PAPER.with_buildings(columns)
    for module in (building_columns, fields):
        monkeypatch.setattr(module, "MOST_ITEMS", 3)
    lower = mission.replace({"buildings.d.position_m": [0, 0, 5], "buildings.e": None})
    assert lower.buildings.names == tuple("abcdfgh")
    assert lower.buildings[3].position_m == (0.0, 0.0, 5.0)
    with pytest.raises(optuav.InputError, match=r"buildings\.d\.position_m = 3"):
        mission.replace({"buildings.d.position_m": 3})


def test_a_fault_in_a_long_table_is_found_by_its_number(monkeypatch: pytest.MonkeyPatch) -> None:
    """Rows are judged a part at a time; names are compared with all others."""
    monkeypatch.setattr(building_columns, "MOST_ITEMS", 3)
    columns = {"name": [*"abcdefgb"], "x_m": range(8), "y_m": [0.0] * 8, "z_m": [1.0] * 8}
    columns["z_m"] = [1.0] * 5 + [NAN, 1.0, 1.0]
    assert faults_of(PAPER, **columns) == [
        "buildings.f.position_m = [5, 0.0, nan]: must be three numbers [x, y, z], |x| and |y| "
        "<= 1e6, 0 <= z <= 1e6 [m]",
        "buildings[7].name = 'b': must be a name of its own; buildings[1] has this one",
    ]


def test_arrays_of_buildings_are_read_only() -> None:
    with pytest.raises(ValueError, match="read-only"):
        PAPER.buildings.roof_m[0] = 0.0
