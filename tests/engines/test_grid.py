"""The exhaustive engine against the printed algorithm, against brute force, and by hand."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from itertools import chain
from typing import Any

import numpy as np
import pytest

import optuav
from formulations.algorithms import algorithm1, best_pair
from formulations.p3 import P3
from formulations.p4 import P4
from formulations.parameters import Quantities
from optuav.engines import grid
from optuav.errors import InputError, SolverError
from optuav.modelling import Model, Parameter
from optuav.physics.kibam import Battery, Stage
from optuav.status import Status
from tests.formulations.given import TABLE_II, quantities
from tests.wells import after

SocEnd = Callable[[float, float], float]


def through_phases(given: Quantities) -> SocEnd:
    """State of charge by the kinetic battery model: a leg, hovering, a leg, resting, a leg."""
    battery = Battery(given.packs * given.capacity_As, 0.7, 4.5e-5)
    leg = Stage(-given.flight_charge_As / given.flight_time_s, given.flight_time_s / 3.0)

    def soc_end(hover_s: float, rest_s: float) -> float:
        hover, rest = Stage(-given.hover_current_A, hover_s), Stage(given.rest_current_A, rest_s)
        wells = after(battery, battery.full, [leg, hover, leg, rest, leg])
        return float(wells.total_As / battery.capacity_As)

    return soc_end


def inlined(given: Quantities) -> SocEnd:
    """State of charge by counting the charge drawn."""

    def soc_end(hover_s: float, rest_s: float) -> float:
        drawn_As = given.flight_charge_As + given.hover_current_A * hover_s
        drawn_As -= given.rest_current_A * rest_s
        return float(1.0 - drawn_As / (given.packs * given.capacity_As))

    return soc_end


@pytest.mark.parametrize("soc_of", [through_phases, inlined])
@pytest.mark.parametrize(
    ("horizon_s", "slot_s"),
    [
        pytest.param(60.0, 1.0, id="whole slots"),
        pytest.param(59.99, 1.0, id="a slot cut short"),
        pytest.param(60.01, 1.0, id="a slot begun"),
        pytest.param(30.25, 0.5, id="half seconds"),
        pytest.param(100.0, 7.0, id="slots of 7 s"),
        pytest.param(98.0, 7.0, id="whole slots of 7 s"),
        pytest.param(6.9, 7.0, id="shorter than a slot"),
        pytest.param(7.0, 7.0, id="a single slot"),
        pytest.param(14.0, 7.0, id="one pair"),
        pytest.param(-3.0, 1.0, id="no time left"),
        pytest.param(0.3 * 3, 0.1, id="whole but for rounding"),
    ],
)
def test_every_cell_is_that_of_algorithm_1(
    soc_of: Callable[[Quantities], SocEnd], horizon_s: float, slot_s: float
) -> None:
    """Both tables of the printed double loop, cell for cell, and the pair chosen from them."""
    given = quantities(deadline_s=50.0 + horizon_s, capacity_As=260.0, hover_current_A=12.0)
    tables = algorithm1(soc_of(given), horizon_s, given.min_soc, slot_s)
    model = P4("b1").model(given, "battery")
    parameters = model.row(0)
    hover_s, rest_s = grid.axes(model, parameters, slot_s)
    points = {"hover_time_s": hover_s, "rest_time_s": rest_s[:, None]}
    kept = grid.cells(chain(*grid.tests(model, parameters)), points)
    np.testing.assert_allclose(np.where(kept, hover_s, 0.0), tables[0], rtol=1e-15)
    np.testing.assert_allclose(np.where(kept, rest_s[:, None], 0.0), tables[1], rtol=1e-15)
    found, pair = grid.solve(model, 1, slot_s=slot_s), best_pair(tables)
    if pair is None:
        assert found.statuses == [Status.INFEASIBLE]
    else:
        assert (found.values["hover_time_s"][0], found.values["rest_time_s"][0]) == pytest.approx(
            pair, rel=1e-15
        )


def test_tables_are_not_all_or_nothing() -> None:
    """The comparison above cuts through its tables: charge and deadline both exclude cells."""
    given = quantities(capacity_As=260.0, hover_current_A=12.0)
    hover_table, _ = algorithm1(inlined(given), 60.0, given.min_soc)
    below_diagonal = 59 * 60 // 2
    assert 0.3 * below_diagonal < np.count_nonzero(hover_table) < 0.9 * below_diagonal


@pytest.mark.parametrize(("deadline_s", "hover_s"), [(800.0, 740.65), (1200.0, 950.0)])
def test_direct_flight_of_table_ii(deadline_s: float, hover_s: float) -> None:
    """The paper's 740.65 s keeps the fraction of the horizon; its 950 s is whole slots."""
    model = P3().model(quantities(TABLE_II, deadline_s=deadline_s), "battery")
    assert grid.solve(model, 1, slot_s=1.0).values["hover_time_s"][0] == pytest.approx(
        hover_s, abs=1e-9
    )


@pytest.mark.parametrize(
    ("horizon_s", "charge_s", "expected_s"),
    [
        (740.65, 950.7, 740.65),
        (740.65, 741.0, 740.65),
        (740.65, 740.9, 740.0),
        (740.65, 740.65, 740.0),
        (740.65, 740.3, 740.0),
        (740.65, 739.9, 739.0),
        (740.0, 740.0, 740.0),
        (740.0, 900.0, 740.0),
        (0.4, 0.9, 0.0),
        (0.4, 1.0, 0.4),
        (0.0, 5.0, 0.0),
        (5.0, 0.0, 0.0),
    ],
)
def test_direct_flight_takes_whole_slots_of_charge(
    horizon_s: float, charge_s: float, expected_s: float
) -> None:
    """min(T_max − T_fl, ⌊charge limit⌋), the charge limit before, in and after the last slot."""
    found = grid.solve(P3().model(hovering(horizon_s, charge_s), "battery"), 1, slot_s=1.0)
    assert found.values["hover_time_s"][0] == pytest.approx(expected_s, abs=1e-9)


def hovering(horizon_s: float, charge_s: float) -> Quantities:
    """Time and charge, at 1 A, for so many seconds."""
    return quantities(
        deadline_s=50.0 + horizon_s,
        min_soc=0.0,
        hover_current_A=1.0,
        flight_charge_As=1000.0 - charge_s,
    )


@pytest.mark.parametrize(("horizon_s", "charge_s"), [(-0.5, 100.0), (100.0, -0.5)])
def test_direct_flight_without_time_or_charge(horizon_s: float, charge_s: float) -> None:
    """Half a second short of a flight without hovering is infeasible, not Δ = 0."""
    found = grid.solve(P3().model(hovering(horizon_s, charge_s), "battery"), 1, slot_s=1.0)
    assert found.statuses == [Status.INFEASIBLE]
    assert np.isnan(found.values["hover_time_s"][0])


def test_shortest_rest_of_the_longest_hover() -> None:
    """Of 150 s, at 10 A from 800 A s and 5 A for each second of rest, 103.3 s can be hovered;
    103 s need 46 s of rest, although 47 s are left."""
    found = grid.solve(P4("b1").model(quantities(), "battery"), 1, slot_s=1.0)
    assert found.point(0) == {"hover_time_s": 103.0, "rest_time_s": 46.0}


def test_binding_constraints_are_those_that_the_next_slot_would_break() -> None:
    """Another second of hover lacks charge; with charge in plenty it lacks time."""
    labels = grid.solve(P4("b1").model(quantities(), "battery"), 1, slot_s=1.0).binding_labels(0)
    assert labels == ("P4.a state of charge",)
    labels = grid.solve(
        P4("b1").model(quantities(capacity_As=5000.0), "battery"), 1, slot_s=1.0
    ).binding_labels(0)
    assert labels == ("P4.b deadline",)
    model = Model("test")
    x = model.variable("x", "x", unit="s", upper=9.0)
    model.minimise(x)
    model.subject_to("least", x >= 3.5)
    found = grid.solve(model, 1, slot_s=1.0)
    assert (found.point(0), found.binding_labels(0)) == ({"x": 4.0}, ("least",))


def test_several_programmes_are_solved_one_by_one() -> None:
    """Feasible and infeasible ones side by side, each as it would be alone."""
    deadlines = np.array([200.0, 51.5, 120.0, 10.0])
    found = grid.solve(P4("b1").model(quantities(deadline_s=deadlines), "battery"), 4, slot_s=1.0)
    for k, deadline in enumerate(deadlines):
        alone = grid.solve(
            P4("b1").model(quantities(deadline_s=float(deadline)), "battery"), 1, slot_s=1.0
        )
        assert found.statuses[k] == alone.statuses[0]
        for name, values in alone.values.items():
            np.testing.assert_array_equal(found.values[name][k], values[0])
    assert [status is Status.OPTIMAL for status in found.statuses] == [True, False, True, False]


def test_missing_number_spoils_its_own_programme_only() -> None:
    """A leg that cannot be flown has no time: an error there, not a search without deadline."""
    times = np.array([50.0, math.nan])
    for formulation in (P3(), P4("b1")):
        found = grid.solve(
            formulation.model(quantities(flight_time_s=times), "battery"), 2, slot_s=1.0
        )
        assert found.statuses == [Status.OPTIMAL, Status.ERROR]
        assert np.isnan(found.objective[1])


@pytest.mark.parametrize("cells", [1, 7, 100, 1000])
@pytest.mark.parametrize("formulation", [P3(), P4("b1")])
def test_answer_does_not_depend_on_the_size_of_blocks(
    monkeypatch: pytest.MonkeyPatch, formulation: P4, cells: int
) -> None:
    """Ties across the border of two blocks as well."""
    changes: tuple[dict[str, float], ...] = (
        {},
        {"deadline_s": 180.65},
        {"rest_current_A": 0.0},
        {"capacity_As": 5000.0},
    )
    models = [formulation.model(quantities(**each), "battery") for each in changes]
    whole = [grid.solve(model, 1, slot_s=1.0).point(0) for model in models]
    monkeypatch.setattr(grid, "CELLS_AT_ONCE", cells)
    assert [grid.solve(model, 1, slot_s=1.0).point(0) for model in models] == whole


def test_no_block_is_larger_than_allowed() -> None:
    """Memory is bounded, and the blocks together hold every cell that can be feasible once."""
    model = P4("b1").model(quantities(), "battery")
    seen = []
    for points in grid._blocks(model, grid.axes(model, model.row(0), 1.0), 500):
        hover, rest = np.broadcast_arrays(points["hover_time_s"], points["rest_time_s"])
        assert hover.size <= 500
        seen += list(zip(hover.ravel(), rest.ravel(), strict=True))
    assert len(set(seen)) == len(seen)
    assert set(seen) >= {
        (float(hover), float(rest))
        for hover, rest in itertools.product(range(1, 150), repeat=2)
        if hover + rest <= 150
    }


def test_of_what_the_next_slot_would_break_the_first_of_each_kind_is_named() -> None:
    """A slot that is far too long, with 89 % of the charge left; one less would be no hover."""
    plan = optuav.solve("paper", slot_s=1e4)
    assert plan.hover_time_s == 0.0
    kinds = ("state of charge", "not dry after the hover")
    assert plan.binding == (*(f"P1.b {kind}" for kind in kinds), "P1.d hover time")
    said = "Next slot would break state of charge; not dry after the hover; hover time"
    assert said in " ".join(plan.summary().split())


def test_more_cells_than_anyone_waits_for_need_a_time_limit() -> None:
    """Refused with their number before the first is tried; the limit ends what it admits."""
    asked: dict[str, Any] = {"slot_s": 1e-3, "perspective": "battery"}
    with pytest.raises(InputError, match=r"slot_s = 0\.001: longer slots, .* make 1\.2\de\+12"):
        optuav.solve("paper", P4("b1"), **asked)
    with pytest.raises(SolverError, match=r"saw \S+ of 1\.2\de\+12 cells within the time limit"):
        optuav.solve("paper", P4("b1"), **asked, time_limit_s=1e-6)


def test_cells_are_counted_while_they_are_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(grid, "CELLS_AT_ONCE", 1000)
    seen: list[tuple[int, int]] = []
    engine = grid.Grid(lambda tried, count: seen.append((tried, count)))
    engine.solve(P4("b1").model(quantities(), "battery"), 1, slot_s=1.0)
    assert len(seen) > 10
    assert seen == sorted(seen)
    assert {count for _, count in seen} == {(seen[-1][1])}
    assert seen[-1][0] < seen[-1][1]


def test_passed_time_limit_is_an_error() -> None:
    """What was not searched to its end has no answer."""
    with pytest.raises(SolverError, match="time limit"):
        grid.solve(P4("b1").model(quantities(), "battery"), 1, slot_s=1.0, time_limit_s=1e-9)


def curved(lower: float = 0.0) -> Model:
    """Unknowns up to 20, a nonlinear constraint, a linear one and a curved objective with ties."""
    model = Model("test")
    x = model.variable("x", "x", unit="s", lower=lower, upper=20.0)
    y = model.variable("y", "y", unit="s", upper=Parameter("p", "p", "s", 20.0))
    model.maximise(np.minimum(x * y, 40.0))
    model.prefer_small(x + y)
    model.prefer_small(x)
    model.subject_to("curved", np.exp(0.1 * x) + np.exp(0.2 * y) <= 9.0)
    model.subject_to("straight", x - 2.0 * y >= -14.5)
    return model


@pytest.mark.parametrize("lower", [0.0, 5.2])
@pytest.mark.parametrize("slot_s", [0.5, 1.0, 3.0])
def test_nonlinear_programme_is_searched_as_well(lower: float, slot_s: float) -> None:
    """Every cell looked at in plain Python: same value, same preferred point."""
    stops = [slot_s * k for k in range(int(20.0 / slot_s) + 2)]
    feasible = [
        (min(x * y, 40.0), -(x + y), -x)
        for x, y in itertools.product(stops, repeat=2)
        if lower <= x <= 20.0 and y <= 20.0
        if math.exp(0.1 * x) + math.exp(0.2 * y) <= 9.0 and x - 2.0 * y >= -14.5
    ]
    value, total, x = max(feasible)
    found = grid.solve(curved(lower), 1, slot_s=slot_s)
    assert found.objective[0] == value
    assert found.point(0) == {"x": -x, "y": x - total}


def test_slots_below_a_lower_bound_are_not_searched() -> None:
    """The smallest x of at least 5.2 in whole seconds is 6; exactly whole bounds count."""
    for lower, expected in ((5.2, 6.0), (5.0, 5.0), (-2.5, -2.0)):
        model = Model("test")
        x = model.variable("x", "x", unit="s", lower=lower, upper=20.0, first_slot=-9)
        model.minimise(x)
        found = grid.solve(model, 1, slot_s=1.0)
        assert found.point(0) == {"x": expected}


@pytest.mark.parametrize("turned", [False, True])
def test_equations_bound_the_search(turned: bool) -> None:
    """x + y = 12 keeps both unknowns finite, whichever side it is written on."""
    model = Model("test")
    x, y = (model.variable(name, name, unit="s") for name in ("x", "y"))
    model.maximise(x - 3.0 * y)
    if turned:
        model.subject_to("sum", 12.0 - y == x)
    else:
        model.subject_to("sum", x + y == 12.0)
    model.subject_to("share", 2.0 * y >= x)
    assert grid.solve(model, 1, slot_s=1.0).point(0) == {"x": 8.0, "y": 4.0}


def test_cells_without_a_value_are_passed_over() -> None:
    """An objective that is not defined everywhere is maximised where it is."""
    model = Model("test")
    x = model.variable("x", "x", unit="s", upper=9.0)
    model.maximise(np.sqrt(5.0 - x) + 2.0 * x)
    assert grid.solve(model, 1, slot_s=1.0).point(0) == {"x": 5.0}
    nowhere = Model("test")
    x = nowhere.variable("x", "x", unit="s", upper=9.0)
    nowhere.maximise(np.sqrt(-1.0 - x))
    assert grid.solve(nowhere, 1, slot_s=1.0).statuses == [Status.INFEASIBLE]


def test_what_it_does_not_take_is_refused_in_words() -> None:
    """Too many unknowns, or an unknown that nothing stops."""
    model = Model("test")
    x, y, z = (model.variable(name, name, unit="s") for name in "xyz")
    model.maximise(x)
    model.subject_to("sum", x + y + z <= 9.0)
    with pytest.raises(ValueError, match="one or two unknowns, the model has 3"):
        grid.solve(model, 1, slot_s=1.0)
    model = Model("test")
    model.maximise(model.variable("x", "x'", unit="s"))
    with pytest.raises(ValueError, match="upper bound on x'"):
        grid.solve(model, 1, slot_s=1.0)
    model = Model("test")
    model.maximise(model.variable("x", "x'", unit="s", lower=-math.inf, upper=0.0))
    with pytest.raises(ValueError, match="lower bound on x'"):
        grid.solve(model, 1, slot_s=1.0)
