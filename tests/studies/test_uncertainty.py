"""What is uncertain: read in words, drawn from what was stated."""

from __future__ import annotations

import ast
import math
import re
import tomllib
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import optuav
from optuav.arrays import Floats
from optuav.errors import InputError
from optuav.studies.samples import Draws, Spread, independent, spreads

PAPER = optuav.load("paper")


def drawn(
    uncertain: tuple[Spread, ...], seed: int, first: int, count: int, mission: Any = PAPER
) -> dict[str, Floats]:
    """Samples as a sensitivity draws them."""
    return Draws(mission, uncertain, first + count, seed, independent).values(first, count)


def one(form: dict[str, Any]) -> Any:
    (found,) = spreads(PAPER, {"body": {"mass_kg": form}})
    return found


def test_quantiles_of_the_distributions() -> None:
    """By hand: a quarter of the way; sqrt(1/8) and sqrt(1/2) of a triangle; one deviation."""
    share = np.array([0.125, 0.25, 0.5])
    even = one({"low": 1.0, "high": 2.0})
    assert even.at(share) == pytest.approx([1.125, 1.25, 1.5])
    leaning = one({"low": 1.0, "likely": 1.5, "high": 2.0})
    assert leaning.at(share) == pytest.approx([1.25, 1 + math.sqrt(0.125), 1.5])
    normal = one({"deviation": 0.1})
    assert normal.at(np.array([0.5, 0.8413447460685429])) == pytest.approx([1.3, 1.4])
    percent = one({"percent": 10})
    assert (percent.low, percent.high) == pytest.approx((1.17, 1.43))


def test_a_triangle_may_lean_on_an_end() -> None:
    """The most likely value at an end: a density that falls from it."""
    assert one({"low": 1.0, "likely": 1.0, "high": 2.0}).at(np.array([0.75])) == pytest.approx(
        [1.5]
    )
    assert one({"low": 1.0, "likely": 2.0, "high": 2.0}).at(np.array([0.25])) == pytest.approx(
        [1.5]
    )


def test_a_normal_distribution_keeps_to_what_is_allowed() -> None:
    """A share of the capacity is above 0 and below 1, however wide its spread."""
    (found,) = spreads(PAPER, {"battery": {"available_fraction": {"deviation": 5.0}}})
    values = found.at(np.linspace(0.0, 1.0, 101))
    assert values.min() >= 1e-6
    assert values.max() <= 0.999999
    assert (np.diff(values) > 0).all()


def test_draws_do_not_depend_on_how_many_are_drawn_at_once_or_beside_them() -> None:
    both = spreads(
        PAPER, {"body": {"mass_kg": {"percent": 5}}, "limits": {"min_soc": {"percent": 9}}}
    )
    whole = drawn(both, 7, 0, 100)
    parts = [drawn(both[:1], 7, first, 25)["body.mass_kg"] for first in (0, 25, 50, 75)]
    assert (np.concatenate(parts) == whole["body.mass_kg"]).all()
    assert (drawn(both, 8, 0, 100)["body.mass_kg"] != whole["body.mass_kg"]).all()


def test_draws_follow_the_distribution_and_one_another_not() -> None:
    """Mean and spread of a uniform distribution to 1 %, correlation below 1 %."""
    both = spreads(
        PAPER, {"body": {"mass_kg": {"percent": 5}}, "limits": {"min_soc": {"percent": 9}}}
    )
    mass, soc = drawn(both, 0, 0, 100_000).values()
    assert mass.mean() == pytest.approx(1.3, rel=1e-3)
    assert mass.std() == pytest.approx(0.13 / math.sqrt(12), rel=1e-2)
    assert abs(np.corrcoef(mass, soc)[0, 1]) < 0.01


def test_keys_along_change_by_the_same_factor() -> None:
    mission = optuav.load("matrice350")
    form = {"low": 1000, "high": 1150, "along": ["flight.hover_current_A"]}
    found = drawn(spreads(mission, {"flight": {"hover_power_W": form}}), 0, 0, 50, mission)
    factor = found["flight.hover_power_W"] / 1103.5
    assert found["flight.hover_current_A"] == pytest.approx(24.65 * factor)


@pytest.mark.parametrize(
    ("document", "key", "words"),
    [
        ({"body": {"mass_kg": 3}}, "body.mass_kg", "a table such as"),
        ({"body": {"mass_kg": {"low": 1}}}, "body.mass_kg", "a table such as"),
        ({"body": {"mass_kg": {"low": 1, "high": math.nan}}}, "body.mass_kg", "a table such as"),
        ({"body": {"mass_kg": {"low": True, "high": 2}}}, "body.mass_kg", "a table such as"),
        ({"body": {"mass_kg": {"low": 2, "high": 1}}}, "body.mass_kg", "low < high"),
        ({"body": {"mass_kg": {"low": 1, "likely": 3, "high": 2}}}, "body.mass_kg", "low < high"),
        ({"body": {"mass_kg": {"low": -1, "high": 2}}}, "body.mass_kg", "within 1e-6"),
        ({"body": {"mass_kg": {"percent": 200}}}, "body.mass_kg", "within 1e-6"),
        ({"body": {"mass_kg": {"percent": -5}}}, "body.mass_kg", "low < high"),
        ({"wind": {"force_N[0]": {"percent": 5}}}, "wind.force_N[0]", "low < high"),
        (
            {"wind": {"force_N": {"percent": 5}}},
            "wind.force_N",
            "by component as link.device_m[0]",
        ),
        ({"body": {"mass_kg": {"deviation": 0}}}, "body.mass_kg", "low < high"),
        ({"body": {"mas_kg": {"percent": 1}}}, "body.mas_kg", "did you mean 'body.mass_kg'"),
        ({"battery": {"packs": {"percent": 1}}}, "battery.packs", "whole number"),
        (
            {"laser": {"visibility_km": {"percent": 1}}},
            "laser.visibility_km",
            "the mission does not set it: set low and high",
        ),
        ({"buildings": {"b1": {}}}, "buildings.b1", "a numeric key of a mission"),
        ({"body": 3}, "body", "a numeric key of a mission"),
        (
            {"body": {"mass_kg": {"percent": 1, "along": ["body.mass"]}}},
            "body.mass",
            "did you mean 'body.mass_kg'",
        ),
        (
            {"body": {"mass_kg": {"percent": 1, "along": "body.mass_kg"}}},
            "body.mass_kg.along",
            "a list of keys",
        ),
        (
            {"body": {"mass_kg": {"percent": 1, "along": ["body.mass_kg"]}}},
            "body.mass_kg",
            "varies once",
        ),
        (
            {"wind": {"force_N[0]": {"low": 0, "high": 1, "along": ["body.mass_kg"]}}},
            "wind.force_N[0].along",
            "must not vary along with 0",
        ),
    ],
)
def test_what_cannot_be_spread_is_refused(document: Any, key: str, words: str) -> None:
    with pytest.raises(InputError) as caught:
        spreads(PAPER, document)
    (fault,) = caught.value.faults
    assert fault.key == key
    assert words in fault.allowed


@pytest.mark.parametrize("key", ["battery.nope", "flight.nope", "flight.hover_power_W"])
def test_nothing_is_suggested_where_nothing_is_like_it(key: str) -> None:
    """Neither another key of the table, nor one of another table."""
    table, _, name = key.partition(".")
    with pytest.raises(InputError) as caught:
        spreads(PAPER, {table: {name: {"percent": 1}}})
    assert "did you mean" not in str(caught.value)


def test_what_was_stated_is_shown() -> None:
    with pytest.raises(
        InputError, match=r"body.mass_kg = \{ low = 2, high = 1 \}: must have low <"
    ):
        spreads(PAPER, {"body": {"mass_kg": {"low": 2, "high": 1}}})


def test_all_faults_of_a_file_are_reported_at_once(tmp_path: Path) -> None:
    path = tmp_path / "sure.toml"
    path.write_text("[body]\nmass_kg = 3\n[battery]\npacks = { percent = 3 }\n", "utf-8")
    with pytest.raises(InputError) as caught:
        spreads(PAPER, path)
    assert [fault.key for fault in caught.value.faults] == ["body.mass_kg", "battery.packs"]
    assert all(fault.source.endswith("sure.toml") for fault in caught.value.faults)


@pytest.mark.parametrize("content", [b"[body", b"\xff", None])
def test_a_file_that_cannot_be_read_is_refused(tmp_path: Path, content: bytes | None) -> None:
    path = tmp_path / "sure.toml"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(InputError, match=r"sure\.toml"):
        spreads(PAPER, path)


# What is stated about `matrice350`

ROOT = Path(__file__).parents[2]
LINE = re.compile(r"^(\w+) = .*?# (.*)$", re.MULTILINE)
RANGE = re.compile(r"([\d.e-]+)(?: [(\[][^)\]]*[)\]])? to ([\d.e-]+)")


def ranges() -> dict[str, tuple[float, float]]:
    """Ranges by key, as the comments of the mission have them."""
    text = files("optuav.mission").joinpath("shipped", "matrice350.toml").read_text("utf-8")
    matches = {key: RANGE.search(comment) for key, comment in LINE.findall(text)}
    found = {key: (float(each[1]), float(each[2])) for key, each in matches.items() if each}
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
        if isinstance(each, ast.Assign) and ast.unparse(each.targets[0]) == "ranges"
    )
    return ast.literal_eval(stated)


@pytest.mark.parametrize("read", [of_the_page, of_the_lesson])
def test_page_and_lesson_take_their_ranges_from_the_mission(read: Any) -> None:
    """Every key of both, to the digits that are written; most likely is what the mission states."""
    expected, mission = ranges(), optuav.load("matrice350")
    for table, stated in read().items():
        for key, spread in stated.items():
            ends = (spread["low"], spread["high"])
            assert ends == pytest.approx(expected[key], rel=3e-4), key
            if "likely" in spread and key != "capacity_As":  # the mission flies new packs
                assert spread["likely"] == getattr(getattr(mission, table), key)
