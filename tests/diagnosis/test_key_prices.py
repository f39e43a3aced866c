"""What a percent of the keys of a flight model, a beam or the drag brings."""

import math

import pytest

import optuav
from optuav.mission import Mission
from tests.wells import SLOW


def hover_s(mission: Mission, key: str, factor: float) -> float:
    """The longest hover [s] by a solve of its own."""
    table, name = key.split(".")
    now = getattr(getattr(mission, table), name)
    return optuav.solve(mission.replace({key: factor * now})).hover_time_s


@pytest.mark.parametrize("name", ["relay-today", "matrice350", "paper-drag"])
def test_a_percent_brings_what_a_mission_that_is_changed_by_hand_brings(name: str) -> None:
    mission = optuav.load(name)
    explained = optuav.explain(mission)
    assert explained.key_prices
    for row in explained.key_prices[::2]:
        for factor, change in ((0.99, row.less), (1.01, row.more)):
            gain_s = hover_s(mission, row.key, factor) - explained.plan.hover_time_s
            assert gain_s == pytest.approx(change, abs=2e-3), row.key


def test_the_keys_that_matter_most_come_first_and_print() -> None:
    explained = optuav.explain(optuav.load("relay-today").replace(SLOW))
    sizes = [row.size for row in explained.key_prices]
    assert sizes == sorted(sizes, reverse=True)
    assert explained.key_prices[0].key == "flight.efficiency"
    text = " ".join(str(explained).split())
    assert "One percent s of hover by a percent of a key" in text
    assert "+38.1" in text


def test_the_papers_own_models_have_no_such_keys() -> None:
    assert optuav.explain("paper").key_prices == ()


def test_a_percent_that_makes_no_mission_is_told() -> None:
    mission = optuav.load("relay-today").replace({"receiver.optics_efficiency": 1.0})
    rows = {row.key: row for row in optuav.explain(mission).key_prices}
    assert math.isnan(rows["receiver.optics_efficiency"].more)
    assert rows["receiver.optics_efficiency"].less < 0.0


def test_a_percent_that_leaves_no_plan_costs_all() -> None:
    mission = optuav.load("relay-today").replace({"laser": None, "receiver": None})
    none, some = 0.001, 0.696  # Efficiencies without and with a plan
    while some > 1.005 * none:
        middle = math.sqrt(none * some)
        if optuav.solve(mission.replace({"flight.efficiency": middle})):
            some = middle
        else:
            none = middle
    rows = optuav.explain(mission.replace({"flight.efficiency": some})).key_prices
    assert {row.key: row.less for row in rows}["flight.efficiency"] == -math.inf
