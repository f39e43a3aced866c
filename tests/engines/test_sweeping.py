"""Slivers: charge asks for a long rest, the available well for a short one; both nearly meet."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import optuav
from optuav.arrays import Floats
from optuav.engines import bracket
from optuav.engines.bracket import WIDTH_S
from optuav.engines.rows import Rows, levelled
from optuav.physics import kibam
from optuav.solving.assemble import quantities
from optuav.solving.program import Program


def sliver(min_soc: float) -> Program:
    mission = optuav.load("paper").replace({"limits.min_soc": min_soc})
    return optuav.formulate(mission, optuav.P4("b2", order="hover-first"))


def scanned(program: Program, hovers_s: np.ndarray) -> np.ndarray:
    """Least margin of y1/B within 0 and ω, resting as long as the charge at the end asks for."""
    (part,) = program.parts
    given = quantities(program.network, part.routes)
    drawn_As = given.flight_charge_As + given.hover_current_A * hovers_s
    missing_As = drawn_As - (1.0 - given.min_soc) * given.battery_As
    rests_s = np.maximum(missing_As / given.rest_current_A, 0.0)
    whole = kibam.Battery(given.battery_As, given.available_fraction, given.flow_rate_per_s)
    level, margin = whole.full, np.where(hovers_s + rests_s <= given.time_left, np.inf, -np.inf)
    for step in given.steps:
        phase = {
            "hover": kibam.Stage(-given.hover_current_A, hovers_s),
            "rest": kibam.Stage(given.rest_current_A, rests_s),
        }.get(step if isinstance(step, str) else "", step)
        level = kibam.step(whole, level, phase)
        share = level.available_As / given.battery_As
        margin = np.minimum(margin, np.minimum(share, given.available_fraction - share))
    return np.asarray(margin)


@pytest.mark.parametrize("min_soc", [0.97, 0.975, 0.976, 0.977])
def test_the_end_of_a_sliver_is_closed_in_upon(min_soc: float) -> None:
    """A point is found next to what a scan by the physics alone finds, with proof beyond it."""
    program = sliver(min_soc)
    (part,) = program.parts
    solution = bracket.solve(part.model, 1)
    (hover_s,) = solution.values["hover_time_s"]
    assert solution.beyond is not None
    assert 0.0 <= solution.beyond[0] - hover_s <= WIDTH_S
    assert scanned(program, np.array([hover_s - 1e-4]))[0] >= 0.0
    assert (scanned(program, np.linspace(hover_s + 1e-4, hover_s + 300.0, 30_000)) < 0.0).all()


@pytest.mark.parametrize("min_soc", [0.9785, 0.98, 0.99])
def test_where_the_sliver_has_closed_there_is_proof_of_it(min_soc: float) -> None:
    program = sliver(min_soc)
    (part,) = program.parts
    assert (scanned(program, np.linspace(0.0, 1100.0, 100_000)) < 0.0).all()
    solution = bracket.solve(part.model, 1)
    assert solution.beyond is not None
    assert np.isneginf(solution.beyond[0])


def random_rows(rng: np.random.Generator, count: int, size: int) -> tuple[Rows, Floats, Floats]:
    """Rows whose terms are alike up to the tops of x and y, and these tops."""
    rate = 10.0 ** rng.uniform(-4, -1, count)
    x_top, y_top = 10.0 ** rng.uniform(0, 4, (2, count))
    V, W = levelled(rate, x_top), levelled(rate, y_top)
    largest = np.array([np.ones(count), x_top, V, y_top, W, V * W])
    return Rows(rng.normal(size=(6, size, count)) / largest[:, None], rate, rate), x_top, y_top


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.soak)])
def test_a_box_that_holds_a_point_is_never_shown_to_be_empty(seed: int) -> None:
    """Random rows that leave little room about a point, in boxes of any size around its x."""
    rng, count = np.random.default_rng(seed), 400_000 if seed else 4000
    rows, x_top, y_top = random_rows(rng, count, 3)
    x, y = rng.random((2, count)) * (x_top, y_top)
    rows.weights[0] += 10.0 ** rng.uniform(-6, -2, (3, count)) - rows.at(x, y)
    assert (rows.at(x, y) >= 0.0).all()
    size = 10.0 ** rng.uniform(-3, 0, count) * x_top
    low = np.maximum(x - rng.random(count) * size, 0.0)
    high = np.maximum(x, np.minimum(low + size, x_top))
    _, rising, sinking = rows.trends(x_top, y_top)
    rising &= ~sinking
    assert not bracket._empty(rows, rising, low, high, y_top).any()
    rows.weights[0] -= 0.05  # Now there is proof for many boxes
    assert bracket._empty(rows, rising, low, high, y_top).mean() > 0.4


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.soak)])
def test_the_sum_of_two_rows_nowhere_exceeds_its_bound(seed: int) -> None:
    """Weights leave no slope in y where the rising row begins to hold; at ends and in between."""
    rng, count = np.random.default_rng(seed), 400_000 if seed else 100_000
    rows, x_top, y_top = random_rows(rng, count, 2)
    x = rng.uniform(0.1, 0.5, count) * x_top
    reach = 10.0 ** rng.uniform(-2, 0, count) * x
    _, rising, _ = rows.trends(x_top, y_top)
    bound = bracket._most(rows, rising, x, reach, np.stack([0.0 * y_top, y_top]), y_top)
    bounded = np.isfinite(bound) & rising[0] & ~rising[1]
    assert np.count_nonzero(bounded) > 0.02 * count
    y = Rows(rows.weights[:, :1], *rows[1:]).at_x(x).end(y_top, smallest=True)
    _, d, e = rows.at_x(x).weights
    rise, fall = d + e * np.exp(-rows.rate_y_per_s * y)
    scale = np.abs(rows.weights[:, 0]).max(axis=0) * np.abs(rise) + np.abs(fall)
    ends = [*itertools.product((-1.0, 0.0, 1.0), (0.0, 0.1, 1.0))]
    for across, up in [*ends, *rng.uniform((-1.0, 0.0), 1.0, (40, 2))]:
        one, other = rows.at(x + across * reach, up * y_top)
        beyond = rise * other - fall * one - bound
        assert (beyond <= 1e-9 * scale)[bounded].all()
