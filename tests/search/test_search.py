"""The search over stops, against the specification and against trying everything."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import replace

import networkx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import optuav
from optuav.arrays import Floats
from optuav.mission import Mission
from optuav.network.network import build_network
from optuav.network.one_stop import all_legs
from optuav.physics import kibam
from optuav.search import branch
from optuav.search.bounds import possible
from optuav.search.branch import TIE_S, SearchResult, search
from optuav.search.plans import slack
from optuav.search.sequences import patterns, sequences
from optuav.search.terrain import Boxes, Pattern, Terrain, least_sums
from optuav.solving.several_stops import terrain
from tests.examples import few
from tests.wells import SLOW


def terrain_of(mission: Mission) -> Terrain:
    network = build_network(mission)
    return terrain(replace(network, legs=all_legs(network)))


def names(mission: Mission, found: SearchResult) -> list[str]:
    assert found.stops is not None
    return [build_network(mission).places.names[place] for place in found.stops.places]


@pytest.mark.parametrize("seed", range(4))
def test_the_least_sums_over_legs_are_those_of_dijkstra(seed: int) -> None:
    """Both ways differ, half of the legs cannot be flown, and some places cannot be reached."""
    rng = np.random.default_rng(seed)
    figures = np.where(
        rng.random((12, 12)) < 0.5 + 0.1 * seed, np.inf, rng.uniform(1, 99, (12, 12))
    )
    legs = networkx.DiGraph()
    legs.add_nodes_from(range(12))
    legs.add_weighted_edges_from((i, j, figures[i, j]) for i, j in np.argwhere(figures < np.inf))
    known = networkx.single_source_dijkstra_path_length(legs, 3)
    expected = [known.get(place, np.inf) for place in range(12)]
    assert least_sums(figures, 3) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("deadline_s", "rests", "hovers", "way", "stays_s"),
    [
        (1200, 1, 1, "hover b9", (597.270, None)),
        (1200, 2, 1, "b9 hover b10", (231.8, 605.456, 254.2)),
        (1200, 1, 2, "hover b9 hover", (597.27, 481.86, 1.71)),
        (2400, 1, 2, "hover b9 hover", (597.27, 1538, 145.56)),
    ],
)
def test_check_numbers_of_the_specification(
    deadline_s: float, rests: int, hovers: int, way: str, stays_s: tuple[float | None, ...]
) -> None:
    """SPEC 3: 597.270, 605.456, 598.976 and 742.834 s, where and for how long, with proof."""
    mission = optuav.load("paper").replace({"limits.deadline_s": deadline_s})
    found = search(terrain_of(mission), rests, hovers)
    assert found.stops is not None
    assert not found.ended
    assert found.stops.hover_s <= found.bound_s <= found.stops.hover_s + 2.0 * TIE_S
    assert names(mission, found) == ["origin", *way.split(), "destination"]
    for stay_s, expected_s in zip(found.stops.stays_s, stays_s, strict=True):
        if expected_s is not None:
            decimals = len(str(expected_s).partition(".")[2])
            assert stay_s == pytest.approx(expected_s, abs=0.51 * 10.0**-decimals)
    total_s = {(1, 1): 597.270, (2, 1): 605.456, (1, 2): 598.976 if deadline_s < 2000 else 742.834}
    assert found.stops.hover_s == pytest.approx(total_s[rests, hovers], abs=5e-4)


def test_a_single_hover_without_rest_is_p3() -> None:
    """SPEC 4: 577.524 s."""
    found = search(terrain_of(optuav.load("paper")), 0, 1)
    assert found.stops is not None
    assert found.stops.hover_s == pytest.approx(577.524, abs=5e-4)


def test_patterns_are_all_orders_without_hovers_in_a_row() -> None:
    """Short ones first, and resting early first among them."""
    shown = ["".join("H" if hover else "r" for hover in each) for each in patterns(2, 2)]
    assert shown == [
        *("H", "rH", "Hr", "rrH", "rHr", "Hrr", "HrH", "rHrH", "HrrH", "HrHr"),
    ]


class Simulated:
    """A mission of few places, flown second by second through `battery.step`."""

    def __init__(self, known: Terrain) -> None:
        self.known = known

    def lowest_and_fullest(self, places: list[int], stays_s: list[float]) -> Iterator[float]:
        """Margins of a plan that must not be negative [A s]."""
        known, pool = self.known, self.known.battery
        wells = pool.full
        for stop, (start, end) in enumerate(itertools.pairwise(places)):
            steps = list(
                zip(
                    -known.stage_currents_A[:, start, end],
                    known.stage_durations_s[:, start, end],
                    strict=True,
                )
            )
            if stop < len(stays_s):
                steps.append((known.stay_current_A[end], stays_s[stop]))
            for current_A, duration_s in steps:
                for _ in range(4):
                    wells = kibam.step(pool, wells, kibam.Stage(current_A, duration_s / 4))
                    yield float(wells.available_As)
                    yield float(pool.full.available_As - wells.available_As)
        yield float(wells.total_As) - known.least_charge_As

    def holds(self, places: list[int], stays_s: list[float]) -> bool:
        known = self.known
        flight_s = sum(known.duration_s[way] for way in itertools.pairwise(places))
        if flight_s + sum(stays_s) > known.deadline_s:
            return False
        return min(self.lowest_and_fullest(places, stays_s)) >= -1e-6


def tried_all(known: Terrain, rests: int, hovers: int, step_s: float) -> float:
    """Longest hover of all plans whose stays are multiples of a step [s]; −inf without one."""
    simulated, longest_s = Simulated(known), -np.inf
    buildings = range(3, len(known.duration_s))
    for pattern in patterns(rests, hovers):
        choices = [[1] if hover else buildings for hover in pattern]
        for stops in itertools.product(*choices):
            places = [0, *stops, 2]
            flight_s = sum(known.duration_s[way] for way in itertools.pairwise(places))
            if not flight_s <= known.deadline_s:
                continue
            slots = np.arange(0.0, known.deadline_s - flight_s + 1e-9, step_s).tolist()
            for stays_s in itertools.product(slots, repeat=len(pattern)):
                hover_s = sum(t for t, hover in zip(stays_s, pattern, strict=True) if hover)
                if hover_s > longest_s and simulated.holds(places, list(stays_s)):
                    longest_s = hover_s
    return longest_s


small = st.fixed_dictionaries(
    {
        "limits.deadline_s": st.sampled_from([300.0, 600.0]),
        "limits.min_soc": st.sampled_from([0.05, 0.5, 0.9]),
        "battery.charge_current_A": st.sampled_from([0.0, 6.0, 60.0, 150.0]),
        "battery.available_fraction": st.sampled_from([0.09, 0.3, 0.8]),
        "battery.flow_rate_per_s": st.sampled_from([0.0, 4.5e-5, 3e-4, 1e-2]),
        "battery.capacity_As": st.sampled_from([9000.0, 15000.0]),
        "laser.power_W": st.just(20000.0),
    }
)


@settings(few(3), deadline=None)
@given(small, st.sampled_from([(1, 1), (2, 1), (1, 2)]))
def test_no_plan_of_a_grid_hovers_longer(keys: dict[str, float], most: tuple[int, int]) -> None:
    """All sequences and all multiples of 60 s, simulated: none beats the bound, and the plan that
    was found holds in the same simulation. Charging past full and dry wells included."""
    mission = optuav.load("paper")
    mission = mission.replace({**keys, "buildings": mission.buildings[7:9]})
    known = terrain_of(mission)
    found = search(known, *most)
    assert tried_all(known, *most, step_s=60.0) <= found.bound_s
    if found.stops is not None:
        stops = found.stops
        assert Simulated(known).holds(stops.places.tolist(), stops.stays_s.tolist())
        assert found.bound_s >= stops.hover_s
        hovered_s = stops.stays_s[stops.places[1:-1] == 1].sum()
        assert hovered_s == pytest.approx(stops.hover_s, abs=1e-9)
        if not found.ended:
            assert found.bound_s <= stops.hover_s + 2.0 * TIE_S


def test_a_fine_grid_comes_as_close_as_its_step() -> None:
    """One building, rests before and after hovering: multiples of 5 s come within two steps."""
    mission = optuav.load("paper")
    mission = mission.replace(
        {
            "buildings": mission.buildings[8:9],
            "battery.capacity_As": 6000.0,
            "limits.deadline_s": 200.0,
        }
    )
    known = terrain_of(mission)
    found = search(known, 2, 1)
    assert found.stops is not None
    grid_s = tried_all(known, 2, 1, step_s=5.0)
    assert found.stops.hover_s - 10.0 <= grid_s <= found.bound_s


def test_a_terrain_is_the_mission_in_arrays() -> None:
    """No leg where none can be flown, currents net into the battery, charge to be left."""
    known = terrain_of(optuav.load("paper"))
    assert known.duration_s[0, 1] == pytest.approx(37.8961, abs=5e-5)
    assert np.isinf(known.duration_s.diagonal()).all()
    assert known.stay_current_A[1] == pytest.approx(-87.91, abs=5e-3)
    assert known.least_charge_As == pytest.approx(3600.0)


@settings(few(6), deadline=None)
@given(
    small,
    st.sampled_from([*patterns(2, 2)]),
    st.sampled_from(["constant", "taper"]),
    st.integers(0, 2**32 - 1),
)
def test_no_rule_drops_a_plan(
    keys: dict[str, float], pattern: Pattern, charging: str, seed: int
) -> None:
    """Random plans that the wells bear, in random boxes around them: asked for no more than their
    own hover time, every box is kept, and cut so that it still holds the plan."""
    changes = {**keys, "limits.deadline_s": 1200.0, "battery.charging": charging}
    known = terrain_of(optuav.load("paper").replace(changes))
    chance = np.random.default_rng(seed)
    (roots, *_) = sequences(known, pattern)
    roots = roots.take(chance.integers(0, len(roots), 400))
    longest_s = roots.high_s * chance.choice([0.0, 0.1, 0.6, 1.0], roots.high_s.shape)
    stays_s = longest_s * chance.random(roots.high_s.shape)
    flight_s = known.duration_s[roots.places[:-1], roots.places[1:]].sum(axis=0)
    bears = slack(known, roots.places, stays_s) >= 0.0
    bears &= flight_s + stays_s.sum(axis=0) <= known.deadline_s
    wide_s = 10.0 ** chance.uniform(-6.0, 2.5, (2, *stays_s.shape))
    boxes = replace(
        roots,
        rank=np.arange(len(roots)),
        low_s=np.maximum(stays_s - wide_s[0], 0.0),
        high_s=stays_s + wide_s[1],
    ).take(bears)
    held_s, hovers = stays_s[:, bears], boxes.hovers
    shares = chance.choice([0.5, 0.99, 1.0], len(boxes))
    left = possible(known, boxes, held_s[hovers].sum(axis=0) * shares - 1e-9)
    assert len(left) == len(boxes)
    order = left.rank.searchsorted(np.flatnonzero(bears))
    rounding_s = 1e-6
    assert (left.low_s[:, order] <= held_s + rounding_s).all()
    assert (left.high_s[:, order] >= held_s - rounding_s).all()


@settings(few(6), deadline=None)
@given(
    small,
    st.sampled_from([each for each in patterns(3, 2) if 1 < len(each) < 5]),
    st.sampled_from(["constant", "taper"]),
    st.integers(0, 2**32 - 1),
)
def test_no_part_of_a_sequence_is_ruled_out_that_a_plan_has(
    keys: dict[str, float], pattern: Pattern, charging: str, seed: int
) -> None:
    """Random plans that the wells bear: asked for no more than their own hover time, sequences
    chosen building by building hold theirs, each once and in the time that they leave."""
    changes = {**keys, "limits.deadline_s": 1200.0, "battery.charging": charging}
    mission = optuav.load("paper")
    known = terrain_of(mission.replace({**changes, "buildings": mission.buildings[:6]}))
    chance = np.random.default_rng(seed)
    (roots,) = sequences(known, pattern)
    count = 6 ** (len(pattern) - sum(pattern))
    assert len(set(roots.rank.tolist())) == len(roots) <= count
    some = roots.take(chance.integers(0, len(roots), 1000))
    longest_s = some.high_s * chance.choice([0.0, 0.1, 0.6, 1.0], some.high_s.shape)
    stays_s = longest_s * chance.random(some.high_s.shape)
    bears = (slack(known, some.places, stays_s) >= 0.0) & (stays_s.sum(axis=0) <= some.high_s[0])
    hover_s = np.where(bears, stays_s[some.hovers].sum(axis=0), -1.0)
    for plan in np.argsort(-hover_s)[:5]:
        least_s = float(hover_s[plan])
        if least_s >= 0.0:
            parts = [*sequences(known, pattern, lambda least_s=least_s: least_s - 1e-9)]
            ranks = np.concatenate([each.rank for each in parts])
            assert np.isin(some.rank[plan], ranks)
            assert len(np.unique(ranks)) == len(ranks)


def test_stops_far_from_the_hover_are_chosen_last(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of the 3000 sequences of four stops, a fraction is bounded as a whole."""
    bounded = []

    def counted(known: Terrain, boxes: Boxes, hover_s: Floats) -> Boxes:
        bounded.append(len(boxes))
        return possible(known, boxes, hover_s)

    known = terrain_of(optuav.load("paper"))
    least = search(known, 2, 1).bound_s
    monkeypatch.setattr(branch, "possible", counted)
    found = search(known, 3, 1)
    assert found.stops is not None
    assert found.stops.hover_s == pytest.approx(605.456, abs=5e-4)
    assert found.bound_s == pytest.approx(least, abs=1e-6)
    assert sum(bounded) < 4 * 10**3


@pytest.mark.parametrize(("most", "at_once"), [(1, 1), (40, 7)])
def test_no_sequence_is_lost_where_few_are_planned(
    most: int, at_once: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Boxes find the plans that were not made before them: 742.834 s and 605.456 s."""
    monkeypatch.setattr(branch, "MOST_PLANS", most)
    monkeypatch.setattr(branch, "PLANS_AT_ONCE", at_once)
    for deadline_s, hovers, hover_s in ((2400, 2, 742.834), (1200, 1, 605.456)):
        mission = optuav.load("paper").replace({"limits.deadline_s": deadline_s})
        found = search(terrain_of(mission), 2, hovers)
        assert found.stops is not None
        assert found.stops.hover_s == pytest.approx(hover_s, abs=5e-4)
        assert found.bound_s <= found.stops.hover_s + 2.0 * TIE_S


def test_a_last_rest_may_lift_the_charge() -> None:
    """Before a rest, less than min_soc may be left: only the end of the flight must have it."""
    mission = optuav.load("matrice350").replace(SLOW)
    once = optuav.solve(mission)
    assert once.route == ("origin", "hover", "b5", "destination")
    low = once.phases[2]  # Landed on b5
    left_As = low.available_As[0] + low.bound_As[0]
    pool_As = mission.battery.packs * mission.battery.capacity_As
    assert left_As < mission.limits.min_soc * pool_As
    twice = optuav.solve(mission, optuav.P1(stops=1, hovers=2))
    assert twice.hover_time_s >= once.hover_time_s - 1e-6
