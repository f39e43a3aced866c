"""Plans by sequential linear programming: known figures, the limits, and plans of other means."""

from __future__ import annotations

import numpy as np
import pytest

import optuav
from optuav.arrays import Floats
from optuav.network.network import build_network
from optuav.search.greedy import greedy
from optuav.search.plans import feasible, margins, steady_s
from optuav.search.sequence_bounds import bounded
from optuav.search.sequences import patterns, sequences
from optuav.search.sequential import improved
from optuav.search.terrain import Boxes, Terrain
from tests.search.test_search import terrain_of

NOTHING = np.array([-np.inf])


def along(known: Terrain, *names: str) -> Boxes:
    """The sequence of stops at these places."""
    numbers = [build_network(optuav.load("paper")).places.names.index(name) for name in names]
    places = np.array([0, *numbers, 2])[:, None]
    left_s = known.deadline_s - known.duration_s[places[:-1], places[1:]].sum(axis=0)
    return Boxes.whole(tuple(name == "hover" for name in names), places, np.array([0]), left_s)


def planned(known: Terrain, boxes: Boxes) -> Floats:
    """Stays (stop, box) from those of the bound, which the limits must allow."""
    stays_s = improved(known, boxes, bounded(known, boxes, NOTHING).stays_s)
    assert feasible(known, boxes, stays_s).all()
    return stays_s


@pytest.mark.parametrize(
    ("deadline_s", "names", "stays_s"),
    [
        (1200, ("b9", "hover", "b10"), (231.8, 605.456, 254.2)),
        (2400, ("hover", "b9", "hover"), (597.27, 1538.0, 145.56)),
    ],
)
def test_the_stays_of_the_specification(
    deadline_s: float, names: tuple[str, ...], stays_s: tuple[float, ...]
) -> None:
    """SPEC 3, which an exhaustive search of independent code found."""
    known = terrain_of(optuav.load("paper").replace({"limits.deadline_s": deadline_s}))
    found_s = planned(known, along(known, *names))[:, 0]
    assert found_s == pytest.approx(stays_s, abs=0.06)


def test_seven_stays_trade_rests_against_hovers() -> None:
    """Four hovers in four hours: longer than to the last moment, until full, and again."""
    known = terrain_of(optuav.load("paper").replace({"limits.deadline_s": 14_400.0}))
    visits = greedy(known, 3, 4)
    assert visits is not None
    boxes = along(known, *["hover", "b9"] * 3, "hover")
    assert boxes.places[:, 0].tolist() == visits.places.tolist()
    found_s = planned(known, boxes)
    hover_s = found_s[boxes.hovers].sum()
    assert hover_s > visits.hover_s + 10.0
    # No neighbour that keeps the limits hovers longer.
    chance = np.random.default_rng(0)
    near_s = np.maximum(
        found_s + chance.normal(0.0, 1.0, (7, 4000)) * 10.0 ** -chance.integers(0, 5), 0.0
    )
    many = boxes.take(np.zeros(4000, dtype=np.intp))
    holds = feasible(known, many, near_s)
    assert (near_s[boxes.hovers].sum(axis=0)[holds] <= hover_s + 1e-6).all()


@pytest.mark.parametrize("charging", ["constant", "taper"])
def test_where_nothing_flows_plans_reach_their_bounds(charging: str) -> None:
    """With k_F = 0 the programme is the problem: every sequence has its longest hover."""
    changes = {"battery.flow_rate_per_s": 0.0, "battery.charging": charging}
    known = terrain_of(optuav.load("paper").replace(changes))
    for pattern in patterns(2, 1):
        for boxes in sequences(known, pattern):
            found = bounded(known, boxes, np.full(len(boxes), -np.inf))
            exists = np.flatnonzero(found.hover_s > -np.inf)
            stays_s = improved(known, boxes.take(exists), found.stays_s[:, exists])
            assert feasible(known, boxes.take(exists), stays_s).all()
            hover_s = stays_s[boxes.hovers].sum(axis=0)
            assert hover_s == pytest.approx(found.hover_s[exists], abs=1e-7)


@pytest.mark.parametrize("rate_per_s", [0.0, 1e-4, 5e-3])
def test_both_parts_of_a_stay_that_tapers_are_the_whole(rate_per_s: float) -> None:
    """To constant current up to full and constant y1 from there on, KiBaM gives the same charge."""
    keys = {"battery.flow_rate_per_s": rate_per_s, "battery.charging": "taper"}
    known = terrain_of(optuav.load("paper").replace({**keys, "battery.capacity_As": 30_000.0}))
    chance, (boxes, *_) = np.random.default_rng(4), sequences(known, (False, True, False))
    boxes = boxes.take(chance.integers(0, len(boxes), 300))
    stays_s = chance.uniform(0.0, 900.0, boxes.low_s.shape) * np.array([[1.0], [0.2], [1.0]])
    first_s = steady_s(known, boxes.places, stays_s)
    whole = margins(known, boxes.places, stays_s)
    both = margins(known, boxes.places, first_s, stays_s - first_s)
    assert 30 < (first_s < stays_s).any(axis=0).sum() < 300
    assert (first_s[1] == stays_s[1]).all()
    assert both[-1] == pytest.approx(whole[-1], abs=1e-6)
    stages = len(known.leg_maps.charge_As)
    assert both[-1 - stages : -1] == pytest.approx(whole[-1 - stages : -1], abs=1e-6)
