"""Linear programmes that bound boxes of plans: against HiGHS, and against plans that hold."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

import optuav
from optuav.arrays import Floats
from optuav.physics import kibam
from optuav.physics.kibam import Battery, Stage, Tilted, Wells
from optuav.search.bounds import enveloped
from optuav.search.dual_simplex import dual_simplex
from optuav.search.plans import slack
from optuav.search.sequence_bounds import bounded, programmes
from optuav.search.sequences import patterns, sequences
from optuav.search.terrain import Boxes, Flown, Pattern, Terrain
from optuav.search.tilt import Tilt
from tests.examples import few
from tests.search.test_search import small, terrain_of

CHARGING = st.sampled_from(["constant", "taper"])


@pytest.mark.parametrize("seed", range(6))
def test_many_programmes_at_once_are_those_of_highs(seed: int) -> None:
    """Optima, points and missing points, one by one; and every stopped value is a bound.

    The prices prove each by duality, or by a sum of rows that no point keeps.
    """
    random = np.random.default_rng(seed)
    rows = random.normal(size=(9, 4, 60)) * (random.random((9, 4, 60)) < 0.7)
    limits, worth = random.normal(0.5, 1.0, (9, 60)), np.array([0.0, 1.0, 1.0, -0.3])
    rows[0], limits[0] = 1.0, random.uniform(0.0, 5.0, 60)
    found = dual_simplex(rows, limits, worth, np.full(60, -np.inf))
    early = dual_simplex(rows, limits, worth, np.full(60, 1.0))
    some = 0
    for number in range(60):
        one = linprog(-worth, rows[..., number], limits[:, number], method="highs")
        if one.status == 2:
            assert found.value[number] == -np.inf
            assert not found.complete[number] or early.value[number] <= 1.0
            assert (rows[..., number].T @ found.prices[:, number] >= -1e-9).all()
            assert limits[:, number] @ found.prices[:, number] < 0.0
            continue
        some += 1
        assert found.complete[number]
        assert found.value[number] == pytest.approx(-one.fun, abs=1e-8)
        assert (found.prices[:, number] >= 0.0).all()
        assert (rows[..., number].T @ found.prices[:, number] >= worth - 1e-9).all()
        proved = limits[:, number] @ found.prices[:, number]
        assert proved == pytest.approx(-one.fun, abs=1e-8)
        assert worth @ found.x[:, number] == pytest.approx(-one.fun, abs=1e-8)
        assert (rows[..., number].T @ np.zeros(9) == 0.0).all()
        assert (found.x[:, number] @ rows[..., number].T <= limits[:, number] + 1e-8).all()
        assert early.value[number] >= -one.fun - 1e-9
        assert (
            early.value[number] == pytest.approx(-one.fun, abs=1e-8) or early.value[number] <= 1.0
        )
    assert 10 < some < 60


def boxes_around(
    known: Terrain, pattern: Pattern, chance: np.random.Generator
) -> tuple[Boxes, Floats]:
    """Random plans that the wells bear (stop, plan) [s], and random boxes that hold them."""
    (roots, *_) = sequences(known, pattern)
    roots = roots.take(chance.integers(0, len(roots), 400))
    longest_s = roots.high_s * chance.choice([0.0, 0.1, 0.6, 1.0], roots.high_s.shape)
    stays_s = longest_s * chance.random(roots.high_s.shape)
    flight_s = known.duration_s[roots.places[:-1], roots.places[1:]].sum(axis=0)
    bears = slack(known, roots.places, stays_s) >= 0.0
    bears &= flight_s + stays_s.sum(axis=0) <= known.deadline_s
    wide_s = 10.0 ** chance.uniform(-6.0, 3.5, (2, *stays_s.shape))
    whole = chance.random(len(roots)) < 0.2
    low_s = np.where(whole, 0.0, np.maximum(stays_s - wide_s[0], 0.0))
    high_s = np.where(whole, roots.high_s, np.minimum(stays_s + wide_s[1], roots.high_s))
    boxes = replace(roots, low_s=low_s, high_s=np.maximum(high_s, stays_s))
    return boxes.take(bears), stays_s[:, bears]


def wells_after_rests(known: Terrain, boxes: Boxes, stays_s: Floats) -> Floats:
    """y1 and y2 after the stays that may taper (2 x stop, plan), in seconds of the largest current.

    Stops where no plan charges have none.
    """
    current_A = known.stay_current_A[boxes.places[1:-1]]
    charging = [stop for stop in range(len(stays_s)) if (current_A[stop] > 0.0).any()]
    levels, step = np.zeros((len(charging), 2, len(boxes))), kibam.STEP_BY_CHARGING["taper"]
    for plan in range(len(boxes)):
        begin = Tilted(*map(float, known.charge_at(boxes.places[0])))
        wells = begin.wells(known.battery)
        for stop, leg in enumerate(itertools.pairwise(boxes.places[:-1, plan])):
            stages = zip(known.stage_currents_A, known.stage_durations_s, strict=True)
            for amps, duration_s in stages:
                wells = kibam.step(known.battery, wells, Stage(-amps[leg], duration_s[leg]))
            wells = step(known.battery, wells, Stage(current_A[stop, plan], stays_s[stop, plan]))
            if stop in charging:
                levels[charging.index(stop), :, plan] = wells
    return levels.reshape(-1, len(boxes)) / np.abs(known.stay_current_A).max()


@settings(few(8), deadline=None)
@given(small, st.sampled_from([*patterns(2, 2)][1:]), st.integers(0, 2**32 - 1))
def test_wells_after_rests_that_taper_lie_within_their_envelopes(
    keys: dict[str, float], pattern: Pattern, seed: int
) -> None:
    """Random plans that the wells bear, stepped through KiBaM, in random boxes around them."""
    changes = {**keys, "battery.charging": "taper", "limits.deadline_s": 1200.0}
    known = terrain_of(optuav.load("paper").replace(changes))
    boxes, stays_s = boxes_around(known, pattern, np.random.default_rng(seed))
    boxes, stays_s = boxes.take(slice(60)), stays_s[:, :60]
    if not len(boxes):
        return
    current_A = known.stay_current_A[boxes.places[1:-1]]
    charging = [stop for stop in range(len(pattern)) if (current_A[stop] > 0.0).any()]
    unit_A = np.abs(known.stay_current_A).max()
    levels_As = unit_A * wells_after_rests(known, boxes, stays_s).reshape(-1, 2, len(boxes))
    legs = Flown(*(table[-1][boxes.places[:-1], boxes.places[1:]] for table in known.leg_maps))
    envelopes = enveloped(known, boxes, legs)
    assert envelopes.alive.all()
    rounding_As = 1e-9 * known.battery.capacity_As
    for stop, wells_As in zip(charging, levels_As, strict=True):
        after = envelopes.after[stop]
        assert (wells_As <= np.array(after.most) + rounding_As).all()
        assert (wells_As >= np.array(after.least) - rounding_As).all()


@settings(few(8), deadline=None)
@given(small, st.sampled_from([*patterns(2, 2)]), CHARGING, st.integers(0, 2**32 - 1))
def test_no_row_excludes_a_plan(
    keys: dict[str, float], pattern: Pattern, charging: str, seed: int
) -> None:
    """Random plans that the wells bear keep all rows of random boxes around them, and no bound is
    below their hover time; with the reserve at every landing in half of them."""
    chance = np.random.default_rng(seed)
    always = {"limits.keep_soc": ("end", "always")[seed % 2], "battery.charging": charging}
    known = terrain_of(
        optuav.load("paper").replace({**keys, **always, "limits.deadline_s": 1200.0})
    )
    boxes, stays_s = boxes_around(known, pattern, chance)
    if not len(boxes):
        return
    if known.tapers:
        boxes, stays_s = boxes.take(slice(60)), stays_s[:, :60]
    rows, limits, tops = programmes(known, boxes)
    x = stays_s
    if known.tapers:
        x = np.vstack([x, wells_after_rests(known, boxes, x)])
    assert (x <= tops + 1e-6).all()
    scale = np.abs(rows).max(axis=1) + (np.abs(limits) / 1e4) + 1e-9
    assert (((rows * x).sum(axis=1) - limits) / scale <= 1e-6).all()
    hover_s = x[boxes.hovers].sum(axis=0)
    enough_s = np.full(len(boxes), -np.inf)
    assert (bounded(known, boxes, enough_s).hover_s >= hover_s - 1e-6).all()
    assert (bounded(known, boxes, hover_s - 1e-3).hover_s >= hover_s - 1e-6).all()


@pytest.mark.parametrize("rate_per_s", [0.0, 4.5e-5, 5e-3])
@pytest.mark.parametrize("width_s", [1e-3, 10.0, 1000.0])
def test_planes_stay_above_the_tilt_and_meet_it_in_small_boxes(
    rate_per_s: float, width_s: float
) -> None:
    """Against KiBaM stage by stage: a leg, a stay, a leg, a stay, at random times in the boxes."""
    random, count = np.random.default_rng(round(width_s)), 300
    battery = Battery(30_000.0, 0.4, rate_per_s)
    places = np.zeros((4, count), dtype=np.intp)
    low_s = random.uniform(0.0, 500.0, (2, count))
    high_s = low_s + width_s * random.random((2, count))
    boxes = Boxes.whole((True, False), places, np.arange(count), high_s[0])
    boxes = replace(boxes, low_s=low_s, high_s=high_s)
    stays_s = low_s + (high_s - low_s) * random.random((2, count))
    amps = np.array([-60.0, 30.0])[:, None] * np.ones(count)
    leg = Stage(-80.0, 25.0)
    wells, sure = battery.full, Tilt.at_start(np.zeros(count), 2)
    below = sure
    for stop in range(2):
        moved = kibam.shift(battery, leg)
        sure = sure.flown(moved.remaining, moved.tilted_As)
        below = below.flown(moved.remaining, -moved.tilted_As)
        wells = kibam.step(battery, wells, leg)
        sure = sure.stayed(battery, stop, amps[stop], low_s[stop], high_s[stop])
        below = below.stayed(battery, stop, -amps[stop], low_s[stop], high_s[stop])
        wells = kibam.step(battery, Wells(*wells), Stage(amps[stop], stays_s[stop]))
        tilt_As = wells.available_As - 0.4 * wells.total_As
        above_As = sure.height_As + (sure.slope_A * stays_s).sum(axis=0)
        below_As = -below.height_As - (below.slope_A * stays_s).sum(axis=0)
        assert (above_As >= tilt_As - 1e-6).all()
        assert (below_As <= tilt_As + 1e-6).all()
        assert (sure.least_As - 1e-6 <= tilt_As).all()
        assert (sure.most_As + 1e-6 >= tilt_As).all()
        assert (below.most_As + 1e-6 >= -tilt_As).all()
        if width_s < 1.0:
            assert above_As - below_As == pytest.approx(0.0, abs=1e-5)


def test_where_nothing_flows_the_programme_is_the_problem() -> None:
    """With k_F = 0 the longest hover on each sequence is the bound: its stays hold."""
    known = terrain_of(optuav.load("paper").replace({"battery.flow_rate_per_s": 0.0}))
    for pattern in patterns(2, 2):
        for boxes in sequences(known, pattern):
            found = bounded(known, boxes, np.full(len(boxes), -np.inf))
            exists = found.hover_s > -np.inf
            stays_s = found.stays_s[:, exists]
            assert (slack(known, boxes.places[:, exists], stays_s) >= -1e-4).all()
            hover_s = stays_s[boxes.hovers].sum(axis=0)
            assert found.hover_s[exists] == pytest.approx(hover_s, abs=1e-8)
