"""What is said to be uncertain about `matrice350` is what its comments tell."""

from __future__ import annotations

import ast
import re
import tomllib
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest

import optuav

ROOT = Path(__file__).parents[2]
LINE = re.compile(r"^(\w+) = .*?# (.*)$", re.MULTILINE)
RANGE = re.compile(r"([\d.e-]+)(?: [(\[][^)\]]*[)\]])? to ([\d.e-]+)")


def ranges() -> dict[str, tuple[float, float]]:
    """Ranges by key, as the comments of the mission have them."""
    text = files("optuav.mission").joinpath("shipped", "matrice350.toml").read_text("utf-8")
    told = {key: RANGE.search(comment) for key, comment in LINE.findall(text)}
    found = {key: (float(each[1]), float(each[2])) for key, each in told.items() if each}
    voltage_V = optuav.load("matrice350").battery.nominal_voltage_V
    low_W, high_W = found["hover_power_W"]
    return found | {"hover_current_A": (low_W / voltage_V, high_W / voltage_V)}


def of_the_page() -> Any:
    """The file of docs/sensitivity.md."""
    page = (ROOT / "docs" / "sensitivity.md").read_text("utf-8")
    (block,) = re.findall(r"^```toml\n# sure.toml\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)
    return tomllib.loads(block)


def of_the_lesson() -> Any:
    """What lesson 20 states."""
    lesson = ast.parse((ROOT / "examples" / "20_what_matters_most.py").read_text("utf-8"))
    (stated,) = (
        each.value
        for each in lesson.body
        if isinstance(each, ast.Assign) and ast.unparse(each.targets[0]) == "stated"
    )
    return ast.literal_eval(stated)


@pytest.mark.parametrize("read", [of_the_page, of_the_lesson])
def test_page_and_lesson_take_their_ranges_from_the_mission(read: Any) -> None:
    """Every key of both, to the digits that are written; most likely is what the mission states."""
    told, mission = ranges(), optuav.load("matrice350")
    for table, stated in read().items():
        for key, spread in stated.items():
            ends = (spread["low"], spread["high"])
            assert ends == pytest.approx(told[key], rel=3e-4), key
            if "likely" in spread and key != "capacity_As":  # the mission flies new packs
                assert spread["likely"] == getattr(getattr(mission, table), key)
