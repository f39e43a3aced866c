"""The commented mission file to start from."""

from __future__ import annotations

import itertools
import tomllib
from pathlib import Path

import pytest
from hypothesis import given
from pydantic import BaseModel

import optuav
from optuav.mission import Mission
from optuav.mission.template import template
from tests.examples import few
from tests.mission.strategies import NAMES, missions


def loaded(text: str, directory: Path) -> Mission:
    path = directory / "mission.toml"
    path.write_text(text, encoding="utf-8")
    return optuav.load(path)


@pytest.mark.campaign
@few(15, most=1000)
@given(mission=missions(), name=NAMES)
def test_a_template_is_the_mission_with_another_name(
    mission: Mission, name: str, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """Every value survives to the last digit, in any flight model, with any names."""
    again = loaded(template(mission, name), tmp_path_factory.getbasetemp())
    assert again == mission.replace({"name": name, "description": ""})


@pytest.mark.parametrize("name", ["paper", "paper-table2", "matrice350"])
def test_every_key_is_explained(name: str) -> None:
    """Each key of each table stands under its description, those that are not set as comments."""
    mission = optuav.load(name)
    text = template(mission, "mine")
    lines = text.splitlines()
    tables = [getattr(mission, key) for key in Mission.model_fields]
    for table in (each for each in tables if isinstance(each, BaseModel)):
        for key, field in type(table).model_fields.items():
            stated = f"{key} = " if getattr(table, key) is not None else f"# {key} ="
            assert field.description
            wanted = f"# {field.description.splitlines()[-1]}"
            assert any(
                above == wanted and below.startswith(stated)
                for above, below in itertools.pairwise(lines)
            ), key
    assert text.endswith("\n")
    assert "None" not in text


def test_optional_tables_that_are_not_there_stay_away(tmp_path: Path) -> None:
    """No laser, no buildings: the file says nothing of them and can be read."""
    bare = optuav.load("paper").replace({"laser": None, "buildings": []})
    text = template(bare, "bare")
    assert {"laser", "buildings"}.isdisjoint(tomllib.loads(text))
    assert loaded(text, tmp_path).buildings == ()


def test_only_the_first_building_is_explained() -> None:
    """The others are short."""
    text = template(optuav.load("paper"), "mine")
    assert text.count("[[buildings]]") == 10
    assert text.count("# Where the UAV rests") == 1


def test_numbers_look_as_a_person_writes_them() -> None:
    """Whole numbers without a point, arrays on one line."""
    lines = template(optuav.load("paper"), "mine").splitlines()
    assert "deadline_s = 1200" in lines
    assert "device_m = [1000, 3000, 0]" in lines
    assert "min_soc = 0.05" in lines
    assert 'name = "mine"' in lines
