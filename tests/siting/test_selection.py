"""The choice of sites against brute force, another formulation, and its own certificates."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy.optimize import Bounds, LinearConstraint, milp

from optuav.arrays import Floats
from optuav.siting.heuristics import (
    bound_by_site,
    greedy,
    interchange,
    multipliers,
    total,
    undominated,
)
from optuav.siting.selection import OBJECTIVES, Objective, best_sites

ENOUGH_S = 200.0
HOVERS = st.sampled_from([np.nan, 0.0, 100.0, 200.0, 200.0000001, 350.5, 1e-3, 1e4])


def objective_of(hover_s: Floats, sites: list[int], objective: Objective) -> float:
    """The objective by its definition, demand by demand."""
    reached = [max([0.0, *np.nan_to_num(row[sites]).tolist()]) for row in hover_s]
    if objective == "covered":
        return float(sum(t >= ENOUGH_S for t in reached))
    return min(reached) if objective == "worst" else sum(reached) / len(reached)


def brute_force(hover_s: Floats, count: int, objective: Objective) -> float:
    """The best of all choices."""
    sites = range(hover_s.shape[1])
    choices = itertools.combinations(sites, min(count, len(sites)))
    return max(objective_of(hover_s, list(each), objective) for each in choices)


def options(objective: Objective) -> dict[str, float]:
    return {"at_least_s": ENOUGH_S} if objective == "covered" else {}


@st.composite
def tables(draw: st.DrawFn) -> Floats:
    """Hover times of few demands and sites, many of them alike."""
    demands, sites = draw(st.integers(1, 8)), draw(st.integers(1, 6))
    rows = st.lists(HOVERS, min_size=sites, max_size=sites)
    return np.array(draw(st.lists(rows, min_size=demands, max_size=demands)))


@pytest.mark.campaign
@given(hover_s=tables(), count=st.integers(1, 4))
@example(hover_s=np.array([[np.nan]]), count=3)
@example(hover_s=np.array([[0.0, 0.0], [np.nan, 1e4]]), count=1)
def test_choice_is_the_best_of_all(hover_s: Floats, count: int) -> None:
    """Every objective reaches what brute force does, and its bound is no lower."""
    for objective in OBJECTIVES:
        best = brute_force(hover_s, count, objective)
        found = best_sites(hover_s, count, objective, **options(objective))
        assert objective_of(hover_s, [*found.sites], objective) == pytest.approx(best, rel=1e-6)
        assert found.value == pytest.approx(best, rel=1e-6, abs=2e-6)
        assert found.bound >= best * (1.0 - 1e-9) - 2e-6
        assert found.gap == 0.0
        assert len(found.sites) <= count
        assert found.greedy_value <= found.value + 1e-9


def city(demands: int, sites: int, seed: int) -> Floats:
    """Hover times that fall with the distance, with walls that hide a third."""
    chance = np.random.default_rng(seed)
    way = chance.random((demands, 1, 2)) - chance.random((1, sites, 2))
    hidden = chance.random((demands, sites)) < 0.3
    return np.where(hidden, np.nan, 900.0 * np.exp(-3.0 * np.linalg.norm(way, axis=2)))


@pytest.mark.soak
@pytest.mark.parametrize("seed", range(200))
def test_choice_of_a_city_is_the_best_of_all(seed: int) -> None:
    """At sizes where HiGHS is needed, with hover times that are all different and many alike."""
    chance = np.random.default_rng(seed)
    demands, sites, count = (int(chance.integers(*ends)) for ends in ((10, 60), (6, 14), (2, 5)))
    hover_s = city(demands, sites, seed)
    hover_s = hover_s if seed % 3 else np.round(hover_s, -2)
    for objective in OBJECTIVES:
        best = brute_force(hover_s, count, objective)
        found = best_sites(hover_s, count, objective, **options(objective))
        assert found.value == pytest.approx(best, rel=2e-6)
        assert found.bound >= best * (1.0 - 1e-9) - 1e-6
        assert found.gap == 0.0


def assigned(hover_s: Floats, count: int) -> float:
    """The best mean hover by the textbook's programme: x_ij ≤ y_j, one site a demand at most."""
    demands, sites = hover_s.shape
    worth = np.nan_to_num(hover_s)
    open_, each = np.eye(sites), np.eye(demands * sites)
    chosen = LinearConstraint(np.r_[np.ones(sites), np.zeros(demands * sites)], ub=count)
    linked = LinearConstraint(np.hstack([-np.tile(open_, (demands, 1)), each]), ub=0.0)
    shares = np.kron(np.eye(demands), np.ones(sites))
    single = LinearConstraint(np.hstack([np.zeros((demands, sites)), shares]), ub=1.0)
    whole = np.r_[np.ones(sites), np.zeros(demands * sites)]
    costs = -np.r_[np.zeros(sites), worth.ravel()]
    found = milp(
        costs, integrality=whole, bounds=Bounds(0.0, 1.0), constraints=[chosen, linked, single]
    )
    return float(-found.fun / demands)


@pytest.mark.parametrize("count", [1, 3, 5])
def test_mean_is_that_of_the_assignment_programme(count: int) -> None:
    """A formulation that shares nothing with ours, at sizes where rows have to be added."""
    hover_s = city(40, 20, seed=count)
    found = best_sites(hover_s, count)
    assert found.value == pytest.approx(assigned(hover_s, count), rel=1e-6)
    assert found.gap == 0.0


def test_multipliers_prove_a_low_bound() -> None:
    """Σ u + the largest Σ (h − u)⁺ bounds every choice: recomputed from the levels alone."""
    worth, ones = np.nan_to_num(city(60, 30, seed=0)), np.ones(60)
    levels, met = multipliers(worth, ones, 4, greedy(worth, ones, 4))
    by_site = [sum(max(h - u, 0.0) for h, u in zip(c, levels, strict=True)) for c in worth.T]
    proved = levels.sum() + sum(sorted(by_site)[-4:])
    assert bound_by_site(worth, ones, 4, levels).max() == pytest.approx(proved, rel=1e-6)
    assert total(worth, ones, met[0]) <= proved <= 1.02 * total(worth, ones, met[0])


@given(levels=st.lists(st.floats(0.0, 1e3), min_size=12, max_size=12), count=st.integers(1, 3))
def test_any_levels_are_a_bound(levels: list[float], count: int) -> None:
    """The certificate asks nothing of how its levels were found."""
    hover_s = np.nan_to_num(city(12, 8, seed=5))
    best = 12.0 * brute_force(hover_s, count, "mean")
    assert bound_by_site(hover_s, np.ones(12), count, np.array(levels)).max() >= best - 1e-6


def test_greedy_falls_into_the_trap_and_the_choice_does_not() -> None:
    """The middle covers most at once; the two sides cover everything."""
    middle = [[300.0, 300.0, np.nan]] * 3
    sides = [[np.nan, 300.0, 300.0]] * 3 + [[300.0, np.nan, np.nan], [np.nan, np.nan, 300.0]]
    hover_s = np.array(middle + sides)
    found = best_sites(hover_s, 2, "covered", at_least_s=300.0)
    assert (found.greedy_sites[0], found.greedy_value) == (1, 7.0)
    assert (found.sites, found.value, found.bound) == ((0, 2), 8.0, 8.0)


def test_worst_serves_the_one_far_away() -> None:
    """The mean would leave it; what is left of the lasers goes where the mean gains most."""
    near = [[500.0, 400.0, 100.0, 450.0]] * 9
    hover_s = np.array([*near, [50.0, 60.0, 300.0, 40.0]])
    assert best_sites(hover_s, 1).sites == (0,)
    assert best_sites(hover_s, 1, "worst").sites == (2,)
    two = best_sites(hover_s, 2, "worst")
    assert (two.sites, two.value, two.bound) == ((0, 2), 300.0, 300.0)


@pytest.mark.parametrize("objective", OBJECTIVES)
def test_no_time_leaves_a_gap_that_is_true(objective: Objective) -> None:
    """Cut off at once, the bound still holds, and a larger gap is told."""
    hover_s = city(30, 12, seed=3)
    best = brute_force(hover_s, 3, objective)
    found = best_sites(hover_s, 3, objective, time_limit_s=1e-9, **options(objective))
    assert found.value - 1e-6 <= best <= found.bound + 1e-6
    assert found.gap == pytest.approx(max(0.0, found.bound / found.value - 1.0), abs=1e-6)


def test_a_gap_that_is_enough_is_kept() -> None:
    hover_s = city(200, 60, seed=4)
    for gap in (0.1, 0.01):
        found = best_sites(hover_s, 4, gap=gap)
        assert found.gap <= gap
    assert best_sites(hover_s, 4).value <= found.bound + 1e-6


def test_no_bound_is_above_what_all_sites_together_reach() -> None:
    """Also where a wide gap ends the search at once."""
    hover_s = city(300, 150, seed=2)
    found = best_sites(hover_s, 20, "covered", at_least_s=494.0, gap=0.1)
    assert found.bound <= (np.nan_to_num(hover_s) >= 494.0).any(axis=1).sum()


def test_alike_demands_weigh_as_often_as_they_come() -> None:
    """Three of one kind outweigh two of the other, merged or not."""
    hover_s = np.array([[100.0, 0.0]] * 3 + [[0.0, 120.0]] * 2)
    found = best_sites(hover_s, 1)
    assert (found.sites, found.value) == ((0,), 60.0)


def test_neither_order_nor_last_bits_of_hover_times_matter() -> None:
    """Of sites that differ by rounding alone the first is taken, on any processor."""
    hover_s = np.full((5, 3), 700.0)
    for site in range(3):
        shaken = hover_s.copy()
        shaken[:, site] *= 1.0 + 1e-14
        assert best_sites(shaken, 1).sites == (0,)
    table = city(30, 12, seed=6)
    shuffled = table[np.random.default_rng(0).permutation(30)]
    assert best_sites(shuffled, 3).sites == best_sites(table, 3).sites


@given(hover_s=tables())
def test_dominated_sites_are_those_with_a_better_one(hover_s: Floats) -> None:
    """Each that is dropped has one that is kept and as good everywhere; no kept one has."""
    worth = np.nan_to_num(hover_s)
    kept = undominated(worth)
    for site in range(worth.shape[1]):
        others = [k for k in np.flatnonzero(kept).tolist() if k != site]
        as_good = any((worth[:, k] >= worth[:, site]).all() for k in others)
        assert as_good != kept[site] or not worth[:, site].any()


@pytest.mark.parametrize("seed", range(3))
def test_no_single_exchange_gains(seed: int) -> None:
    """What `interchange` returns is as good as all choices that differ in one site."""
    worth = np.nan_to_num(city(25, 10, seed))
    weights = np.arange(1.0, 26.0)
    found = interchange(worth, weights, greedy(worth, weights, 3))
    value = weights @ worth[:, list(found)].max(axis=1)
    for place, site in itertools.product(range(3), range(10)):
        other = [*found]
        other[place] = site
        assert weights @ worth[:, other].max(axis=1) <= value * (1.0 + 1e-8)


@given(hover_s=tables(), count=st.integers(1, 4), objective=st.sampled_from(OBJECTIVES))
@example(np.array([[9.0, 10, 0, 0], [8.0, 0, 9, 0], [7.0, 0, 0, 8]]), 4, "mean")
def test_no_site_is_kept_that_serves_nobody(
    hover_s: Floats, count: int, objective: Objective
) -> None:
    """Without any one of the sites, some demand gets less; the first that greed takes may be it."""
    sites = [*best_sites(hover_s, count, objective, **options(objective)).sites]
    reached = np.nan_to_num(hover_s)
    if objective == "covered":
        reached = (reached >= ENOUGH_S).astype(float)
    for site in sites:
        others = reached[:, [each for each in sites if each != site]].max(axis=1, initial=0.0)
        assert (others < reached[:, sites].max(axis=1) - 1e-7).any()


@given(hover_s=tables(), count=st.integers(1, 4), objective=st.sampled_from(OBJECTIVES))
def test_as_many_are_alike_as_brute_force_exchanges(
    hover_s: Floats, count: int, objective: Objective
) -> None:
    """A candidate in place of a site counts if the objective is the same by its definition."""
    found = best_sites(hover_s, count, objective, **options(objective))
    others = {*range(hover_s.shape[1])} - {*found.sites}
    for site, alike in zip(found.sites, found.alike, strict=True):
        kept = [each for each in found.sites if each != site]
        exchanged = [objective_of(hover_s, [*kept, each], objective) for each in others]
        assert alike == sum(each == pytest.approx(found.value, abs=1e-6) for each in exchanged)
