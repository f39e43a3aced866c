"""Many missions at once are solved as each of them alone."""

from __future__ import annotations

import itertools
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import linprog

import optuav
from optuav.arrays import Floats
from optuav.errors import InputError
from optuav.mission import Mission
from optuav.network.network import build_network
from optuav.network.places import FIRST_BUILDING, HOVER
from optuav.network.timeline import stay_net
from optuav.solving import best_plans, program
from optuav.solving.balance import longest_by_balance
from optuav.studies import batch as batching
from optuav.studies import scenarios as machine
from tests.several_devices import eight

PAPER = optuav.load("paper")
TIMES = ("hover_time_s", "rest_time_s", "flight_time_s", "mission_time_s")
SOC = ("battery", "energy", "adjusted")
LINEAR = ["battery", "energy", "adjusted"]


def drawn(mission: Mission, count: int, seed: int) -> dict[str, Floats]:
    """Sizes, limits, wells, places, light, link and loads, from hopeless to plenty."""
    draw, given = np.random.default_rng(seed), mission
    found = {
        "limits.deadline_s": draw.uniform(40.0, 3000.0, count),
        "limits.min_soc": draw.uniform(0.0, 0.4, count),
        "battery.capacity_As": given.battery.capacity_As * draw.uniform(0.15, 1.8, count),
        "battery.charge_current_A": given.battery.charge_current_A * draw.uniform(0.0, 4.0, count),
        "battery.available_fraction": draw.uniform(0.3, 0.98, count),
        "battery.flow_rate_per_s": 10.0 ** draw.uniform(-6.0, -3.3, count),
        "link.device_m[0]": given.link.device_m[0] + draw.uniform(-600.0, 600.0, count),
        "link.transmit_power_W": given.link.transmit_power_W * 10.0 ** draw.uniform(-2, 0.5, count),
    }
    if given.laser is not None:
        found["laser.power_W"] = given.laser.power_W * draw.uniform(0.0, 2.0, count)
        found["laser.position_m[1]"] = draw.uniform(-400.0, 400.0, count)
    if given.flight.model == "rotors":
        assert given.body is not None
        found["body.mass_kg"] = given.body.mass_kg * draw.uniform(0.7, 1.3, count)
        found["wind.force_N[0]"] = draw.uniform(-3.0, 3.0, count)
        found["wind.force_N[1]"] = draw.uniform(-1.0, 1.0, count)
    else:
        load_A = given.flight.hover_current_A
        found["flight.hover_current_A"] = load_A * draw.uniform(0.4, 1.4, count)
    return found


def alone(mission: Mission, values: dict[str, Floats], number: int) -> Mission:
    """One scenario, made by `Mission.replace`."""
    found: dict[str, Any] = {}
    for key, column in values.items():
        name, _, axis = key.partition("[")
        if not axis:
            found[name] = float(column[number])
            continue
        table, field = name.split(".")
        vector = found.setdefault(name, list(getattr(getattr(mission, table), field)))
        vector[int(axis[0])] = float(column[number])
    return mission.replace(found)


def assert_same(found: dict[str, Any], number: Any, plan: optuav.Plan) -> None:
    """One scenario of a batch against the plan of its mission."""
    cell = {name: found[name][number] for name in (*TIMES, "building", "order", "status", "proved")}
    reason = found["reason_words"][found["reason"][number]]
    assert found["status_words"][cell["status"]] == plan.status.value
    if not plan:
        assert np.isnan([cell[name] for name in TIMES]).all()
        assert (cell["building"], cell["order"], cell["proved"]) == (-1, 0, True)
        assert reason != "there is a plan"
        return
    assert reason == "there is a plan"
    for name in TIMES:
        assert cell[name] == pytest.approx(getattr(plan, name), rel=0, abs=1e-9), name
    assert plan.soc is not None
    for name in SOC:
        assert found[f"soc_{name}"][number] == pytest.approx(plan.soc[name], abs=1e-11)
    rests = [place for place in plan.route if place not in ("origin", "hover", "destination")]
    assert found["building_words"][cell["building"]] == (rests or ["none"])[0]
    order = "none"
    if rests:
        first = plan.route.index(rests[0]) < plan.route.index("hover")
        order = "rest-first" if first else "hover-first"
    assert found["order_words"][cell["order"]] == order


def assert_each_is_solved_alone(
    mission: Mission, count: int, seed: int, perspective: Any, problem: Any = "P1"
) -> int:
    """How many of the scenarios have a plan; every one is compared."""
    values = drawn(mission, count, seed)
    options: dict[str, Any] = {"perspective": perspective, "paired": True}
    found = optuav.batch_arrays(mission, values, problem, **options)
    for number in range(count):
        one = alone(mission, values, number)
        assert_same(found, number, optuav.solve(one, problem, perspective=perspective))
    return int(np.isfinite(found["hover_time_s"]).sum())


def missions() -> list[Mission]:
    """Both flight models, with the laser and without."""
    found = [optuav.load(name) for name in ("paper", "paper-table2", "matrice350")]
    off = {"flight.charge_current_A": None, "flight.charge_power_W": None}
    dark = [{"laser": None} | (off if each.flight.model == "regimes" else {}) for each in found]
    return found + [each.replace(gone) for each, gone in zip(found, dark, strict=True)]


@pytest.mark.parametrize(
    ("number", "perspective"),
    [
        *itertools.product(range(6), ("wells", "available")),
        *((number, LINEAR[number % 3]) for number in range(6)),  # The soak has all
    ],
)
def test_scenarios_are_those_of_solve(number: int, perspective: str) -> None:
    """To 1e-9 s with the same tie rule, both orders of the stays, some without a plan."""
    with_plan = assert_each_is_solved_alone(missions()[number], 7, number, perspective)
    assert 0 < with_plan < 7


PROBLEMS = [
    ("P3", "available"),
    ("P3", "energy"),
    (optuav.P4("b3"), "available"),
    (optuav.P4("b2", order="hover-first"), "battery"),
    (optuav.P1(trajectory="traj1"), "available"),
    (optuav.P1(trajectory="traj2"), "adjusted"),
    (optuav.P1(trajectory="optimal", order="rest-first"), "available"),
    ("P2", "battery"),
    ("P2-tight", "energy"),
    ("P2-tight", "available"),
]


@pytest.mark.parametrize(("problem", "perspective"), PROBLEMS)
def test_every_problem_is_that_of_solve(problem: Any, perspective: str) -> None:
    """Those that engines take as arrays, and those that are solved one by one."""
    count = 1 if problem == "P2-tight" else 8
    assert_each_is_solved_alone(PAPER, count, 11, perspective, problem)


@pytest.mark.soak
@pytest.mark.parametrize("perspective", [*LINEAR, "wells", "available"])
@pytest.mark.parametrize("number", range(6))
def test_ten_thousand_scenarios_are_those_of_solve(number: int, perspective: str) -> None:
    """30 times 340, over all perspectives and missions, each with draws of its own."""
    seed = 100 + 10 * number + len(perspective)
    assert 0 < assert_each_is_solved_alone(missions()[number], 340, seed, perspective) < 340


@pytest.mark.parametrize(
    "changes", [{"battery.charging": "taper"}, {"flight.through_buildings": True}]
)
def test_words_of_a_mission_count_as_well(changes: dict[str, Any]) -> None:
    """Tapered charging, whose charge is that of the simulation, and flights through buildings."""
    mission = PAPER.replace(changes)
    for perspective in ("battery", "available"):
        assert_each_is_solved_alone(mission, 6, 5, perspective)


def test_packs_that_take_turns_are_solved_one_by_one() -> None:
    """Two packs, one after the other."""
    mission = PAPER.replace({"battery.schedule": "sequential"})
    values = {"limits.deadline_s": np.array([60.0, 900.0])}
    found = optuav.batch_arrays(mission, values, "P3")
    for number in range(2):
        assert_same(found, number, optuav.solve(alone(mission, values, number), "P3"))


@dataclass(frozen=True)
class LeastRest(optuav.Formulation):
    """Least rest for a wanted hover time."""

    wanted_hover_s: float = 650.0

    def declare(self, model: Any, given: Any) -> None:
        """State it."""
        hover, rest = given.hover_and_rest(model)
        model.minimise(rest)
        model.subject_to("wanted hover", hover >= self.wanted_hover_s, unit="s")
        model.subject_to("charge", given.soc_end(hover, rest) >= given.min_soc)
        given.keep_wells(model, "charge", hover, rest)
        given.keep_deadline(model, "deadline", hover, rest)


def test_a_formulation_of_ones_own_is_answered_too() -> None:
    """A user's problem, to be minimised, in which some scenarios have no answer."""
    values = {"battery.capacity_As": np.array([20e3, 33e3, 35e3, 40e3])}
    found = optuav.batch_arrays(PAPER, values, LeastRest(), perspective="battery")
    for number in range(4):
        one = alone(PAPER, values, number)
        plan = optuav.solve(one, LeastRest(), perspective="battery")
        assert_same(found, number, plan)
    assert np.isnan(found["hover_time_s"]).any()


@pytest.mark.parametrize(
    ("name", "perspective"),
    [
        *(("paper", perspective) for perspective in ("battery", "available", "wells")),
        ("matrice350", "available"),
        *(
            pytest.param("matrice350", perspective, marks=pytest.mark.soak)
            for perspective in ("battery", "wells")
        ),
    ],
)
def test_no_bit_depends_on_the_chunk(
    name: str, perspective: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One scenario at a time, three, or all: where link and places vary, and where they do not."""
    mission, count = optuav.load(name), 8
    values = drawn(mission, count, 7)
    draw = np.random.default_rng(8)
    values["link.rice_factor"] = draw.uniform(0.0, 60.0, count)
    values["limits.outage_probability"] = 10.0 ** draw.uniform(-6.0, -0.5, count)
    routes = 1 + 2 * len(mission.buildings)
    for keys in (list(values), ["limits.deadline_s"], ["link.rice_factor", "limits.min_soc"]):
        own, found = {key: values[key] for key in keys}, []
        for at_once in (1, 3, 1000):
            monkeypatch.setattr(machine, "ITINERARIES_AT_ONCE", at_once * routes)
            found.append(optuav.batch_arrays(mission, own, perspective=perspective, paired=True))
        for column in found[0].keys() - {key for key in found[0] if key.endswith("_words")}:
            assert len({each[column].tobytes() for each in found}) == 1, column


def test_a_grid_has_an_axis_a_key_and_one_for_perspectives() -> None:
    """All combinations, the last key varying fastest, each at its place."""
    ranges = {"limits.deadline_s": [800, 1200], "battery.capacity_As": [30e3, 36e3, 42e3]}
    found = optuav.batch_arrays(PAPER, ranges, perspective=["battery", "available"])
    assert found["hover_time_s"].shape == (2, 2, 3)
    for place, perspective in enumerate(("battery", "available")):
        for i, deadline_s in enumerate(ranges["limits.deadline_s"]):
            for k, capacity_As in enumerate(ranges["battery.capacity_As"]):
                one = {"limits.deadline_s": deadline_s, "battery.capacity_As": capacity_As}
                plan = optuav.solve(PAPER.replace(one), perspective=perspective)
                assert_same(found, (place, i, k), plan)


def test_known_values_of_the_paper() -> None:
    """Check numbers: 719.54 s counted at the end, 597.27 s where the battery never runs dry."""
    found = optuav.batch_arrays(PAPER, {}, perspective=["battery", "available"])
    assert found["hover_time_s"] == pytest.approx([719.5399, 597.270], abs=5e-4)
    assert found["rest_time_s"][0] == pytest.approx(392.1438, abs=5e-4)


@pytest.mark.parametrize("perspective", LINEAR)
def test_a_rest_that_charges_next_to_nothing_is_none(perspective: Any) -> None:
    """Light for 1e-9 A to 1e-3 A, on a given building: as long a rest as `solve` finds best."""
    values = {"battery.charge_current_A": 10.0 ** np.arange(-12.0, -2.0)}
    problem = optuav.P4("b1", order="rest-first")
    found = optuav.batch_arrays(PAPER, values, problem, perspective=perspective)
    for number in range(len(values["battery.charge_current_A"])):
        plan = optuav.solve(alone(PAPER, values, number), problem, perspective=perspective)
        assert found["hover_time_s"][number] == pytest.approx(plan.hover_time_s, rel=0, abs=1e-8)
        assert found["rest_time_s"][number] == pytest.approx(plan.rest_time_s, rel=1e-6, abs=1e-6)


def test_values_displace_what_replace_displaces() -> None:
    """Energies where the size changes, coefficients where the wavelength does, the visibility."""
    table2 = optuav.load("paper-table2")
    cases: list[tuple[Mission, dict[str, Any], str]] = [
        (table2, {"battery.capacity_As": np.array([36e3, 36e3 + 1e-3, 40e3])}, "adjusted"),
        (PAPER, {"laser.wavelength_nm": np.array([810.0, 1550.0])}, "energy"),
        (PAPER, {"laser.visibility_km": np.array([0.4, 3.0])}, "battery"),
        (PAPER, {"battery.flow_rate_per_min": np.array([1e-3, 1e-2])}, "available"),
        (PAPER, {"battery.packs": np.array([1, 3])}, "available"),
    ]
    for mission, values, perspective in cases:
        found = optuav.batch_arrays(mission, values, perspective=perspective)
        (key,) = values
        for number, value in enumerate(values[key].tolist()):
            plan = optuav.solve(mission.replace({key: value}), perspective=perspective)
            assert_same(found, number, plan)


REASONS: list[tuple[dict[str, Any], dict[str, list[float]], str]] = [
    ({}, {"limits.deadline_s": [20]}, "longer than limits.deadline_s"),
    ({"limits.deadline_s": 300}, {"battery.capacity_As": [1000]}, "does not hold the charge"),
    ({}, {"battery.available_fraction": [0.05]}, "runs dry"),
    ({}, {"body.mass_kg": [9]}, "cannot fly"),
    ({}, {"link.transmit_power_W": [1e-4]}, "out of reach of the hover point"),
    ({"route.hover_m": [1000, 2600, 60]}, {"link.device_m[1]": [5000]}, "out of reach"),
    ({"route.hover_m": [1000, 2600, 60]}, {"limits.min_altitude_m": [70]}, "outside limits.min"),
    ({}, {"limits.min_altitude_m": [101]}, "contradict each other"),
]


@pytest.mark.parametrize(("changes", "values", "words"), REASONS)
def test_why_there_is_no_plan(
    changes: dict[str, Any], values: dict[str, list[float]], words: str
) -> None:
    """Each reason, at a mission that has it for sure; the rest of the row is empty."""
    found = optuav.batch_arrays(PAPER.replace(changes), values)
    assert words in found["reason_words"][found["reason"][0]]
    assert np.isnan(found["hover_time_s"][0])
    assert found["status_words"][found["status"][0]] == "infeasible"


@pytest.mark.parametrize(
    ("key", "values", "word"),
    [("limits.deadline_s", [50.0, 2400.0], "together"), ("body.mass_kg", [50.0, 3.0], "fly")],
)
def test_rows_without_a_plan_over_many_devices_have_a_reason(
    key: str, values: list[float], word: str
) -> None:
    """In any order of eight devices; the first row ended the batch with an error."""
    found = optuav.batch_arrays(eight(), {key: values}, perspective="battery")
    assert word in found["reason_words"][found["reason"][0]]
    assert np.isnan(found["hover_time_s"][0])


def test_all_faults_of_the_ranges_come_at_once() -> None:
    """Unknown keys with the nearest one, words, ranges, whole numbers, empty and uneven ranges."""
    ranges: dict[str, Any] = {
        "limits.dedline_s": [1],
        "limits.min_soc": [0.1, 2.0],
        "battery.packs": [1.5],
        "battery.schedule": ["pooled"],
        "limits.deadline_s": [],
        "battery.capacity_As": [np.nan],
        "link.device_m": [[0, 0, 0]],
        "laser.power_W": [[1.0], [2.0]],
    }
    with pytest.raises(InputError) as caught:
        optuav.batch_arrays(PAPER, ranges, perspective=["battery", "none"], paired=True)
    faults = {fault.key: str(fault) for fault in caught.value.faults}
    assert faults.keys() >= {*ranges, "perspective"}
    assert "limits.deadline_s" in faults["limits.dedline_s"]
    assert "0 <= x < 1" in faults["limits.min_soc"]
    assert "whole number" in faults["battery.packs"]


@pytest.mark.parametrize(
    ("ranges", "words"),
    [
        ({"laser.wavelength_nm": [900.0]}, "810 or 1550"),
        ({"laser.visibility_km": [3.0], "laser.attenuation_per_km": [0.1]}, "not both"),
        ({"route.hover_m[0]": [900.0]}, "has no route.hover_m"),
        ({"flight.hover_current_A": [80.0]}, "regimes"),
    ],
)
def test_what_no_mission_could_state_is_refused(ranges: dict[str, Any], words: str) -> None:
    """Before anything is solved."""
    with pytest.raises(InputError, match=words):
        optuav.batch_arrays(PAPER, ranges)


def test_a_place_may_be_stated_by_its_components() -> None:
    """Where the mission has none, as a hover point."""
    places_m = [[1000.0, 2600.0, 50.0], [1100.0, 2500.0, 60.0]]
    ranges = {f"route.hover_m[{k}]": column for k, column in enumerate(np.transpose(places_m))}
    found = optuav.batch_arrays(PAPER, ranges, paired=True)
    for number, place_m in enumerate(places_m):
        assert_same(found, number, optuav.solve(PAPER.replace({"route.hover_m": place_m})))


def test_a_key_of_a_table_that_is_missing_is_one_fault() -> None:
    """Rather than one for every other key of a laser."""
    with pytest.raises(InputError) as caught:
        optuav.batch_arrays(PAPER.replace({"laser": None}), {"laser.power_W": [900.0]})
    (fault,) = caught.value.faults
    assert str(fault).startswith("laser.power_W: the mission has no laser")


def test_rows_that_belong_together_have_one_length() -> None:
    """Three deadlines and two sizes are no rows."""
    ranges = {"limits.deadline_s": [1, 2, 3], "limits.min_soc": [0.1, 0.2]}
    with pytest.raises(InputError, match="one length for all keys"):
        optuav.batch_arrays(PAPER, ranges, paired=True)


def test_several_missions_are_an_axis() -> None:
    """Towns with other buildings, each of them solved alone; names are shared."""
    towns = optuav.layouts(PAPER, 4, buildings=6, seed=3)
    found = optuav.batch_arrays(towns, {"limits.deadline_s": [700, 1200]}, perspective="battery")
    assert found["hover_time_s"].shape == (4, 2)
    for number, town in enumerate(towns):
        plan = optuav.solve(town, perspective="battery")
        assert_same(found, (number, 1), plan)


def test_layouts_are_positions_of_the_buildings() -> None:
    """Each is solved as the mission whose buildings stand there with their footprints."""
    yard = [[-30.0, -30.0], [30.0, -30.0], [0.0, 40.0]]
    rows = [{"name": "b1", "position_m": [50.0, 300.0, 60.0], "footprint_m": [40.0, 40.0]}]
    corners = [[x + 1000.0, y + 1500.0] for x, y in yard]
    rows += [{"name": "b2", "position_m": [1000.0, 1500.0, 90.0], "footprint_m": corners}]
    mission = PAPER.replace({"buildings": rows})
    by_m = np.random.default_rng(4).uniform(-90.0, 90.0, (3, 2, 3)) * [1.0, 1.0, 0.1]
    roofs_m = mission.buildings.roof_m + by_m
    ranges = {"limits.deadline_s": [700, 1200], "buildings": roofs_m}
    found = optuav.batch_arrays(mission, ranges, perspective="battery")
    assert found["hover_time_s"].shape == (3, 2)
    np.testing.assert_array_equal(found["buildings"], roofs_m)
    for number, layout_m in enumerate(roofs_m.tolist()):
        moved = [{**row, "position_m": place} for row, place in zip(rows, layout_m, strict=True)]
        x, y = by_m[number, 1, :2]
        moved[1]["footprint_m"] = [[a + x, b + y] for a, b in corners]
        plan = optuav.solve(mission.replace({"buildings": moved}), perspective="battery")
        assert_same(found, (number, 1), plan)
    pytest.importorskip("xarray")
    assert optuav.batch(mission, ranges).hover_time_s.dims == ("layout", "limits.deadline_s")


MASKED = np.ma.masked_array([600.0, 900.0], [False, True])
HIDDEN: dict[str, tuple[Callable[[], object], str]] = {
    "key": (lambda: optuav.batch_arrays("paper", {"limits.deadline_s": MASKED}), "limits.deadline"),
    "whole": (
        lambda: optuav.batch_arrays(
            "paper", {"battery.packs": np.ma.masked_array([1, 2], [True, False])}
        ),
        "battery.packs",
    ),
    "layouts": (
        lambda: optuav.batch_arrays(
            "paper", {"buildings": np.ma.masked_equal(np.full((1, 10, 3), 50.0), 50.0)}
        ),
        "position_m",
    ),
    "buildings": (
        lambda: PAPER.with_buildings(
            {"name": ["a", "b"], "x_m": MASKED, "y_m": [1, 2], "z_m": [3, 4]}
        ),
        "position_m",
    ),
    "sites": (
        lambda: optuav.place_laser(PAPER, np.ma.masked_equal([[1.0, 2.0, 3.0]], 2.0)),
        "cand",
    ),
    "compiled": (
        lambda: (
            optuav.formulate(PAPER, optuav.P4("b1", order="rest-first"))
            .compile()
            .solve(deadline_s=MASKED[1:])
        ),
        "deadline_s",
    ),
}


@pytest.mark.parametrize(("ask", "key"), HIDDEN.values(), ids=HIDDEN)
def test_masked_values_are_refused(ask: Callable[[], object], key: str) -> None:
    """A masked value is none: what stands behind the mask is not solved."""
    with pytest.raises(InputError, match=key):
        ask()
    unmasked = {"limits.deadline_s": np.ma.masked_array([600.0, 900.0])}
    found = optuav.batch_arrays("paper", unmasked)["hover_time_s"]
    plain = optuav.batch_arrays("paper", {"limits.deadline_s": [600.0, 900.0]})["hover_time_s"]
    np.testing.assert_array_equal(found, plain)


def test_layouts_and_missions_are_paired_with_rows() -> None:
    """Each has the values of its own place, where there are as many of both."""
    deadlines_s = [700.0, 900.0, 1200.0]
    by_m = np.random.default_rng(5).uniform(-90.0, 90.0, (3, 10, 1)) * [1.0, 1.0, 0.0]
    roofs_m = PAPER.buildings.roof_m + by_m
    rows = [each.model_dump() for each in PAPER.buildings]
    towns = []
    for layout_m in roofs_m.tolist():
        moved = [{**row, "position_m": m} for row, m in zip(rows, layout_m, strict=True)]
        towns.append(PAPER.replace({"buildings": moved}))
    ranges = {"limits.deadline_s": deadlines_s}
    options: Any = {"perspective": ["battery", "available"], "paired": True}
    for found in (
        optuav.batch_arrays(towns, ranges, **options),
        optuav.batch_arrays(PAPER, {**ranges, "buildings": roofs_m}, **options),
    ):
        assert found["hover_time_s"].shape == (2, 3)
        for number, (town, deadline_s) in enumerate(zip(towns, deadlines_s, strict=True)):
            plan = optuav.solve(town.replace({"limits.deadline_s": deadline_s}))
            assert_same(found, (1, number), plan)
    alone = optuav.batch_arrays(PAPER, {"buildings": roofs_m}, paired=True)
    assert alone["hover_time_s"].shape == (3,)
    with pytest.raises(
        InputError, match="paired = 2 missions, 3 values of each key: must be one mission"
    ):
        optuav.batch_arrays(towns[:2], ranges, paired=True)
    pytest.importorskip("xarray")
    labelled = optuav.batch(PAPER, {**ranges, "buildings": roofs_m}, paired=True)
    assert labelled.hover_time_s.dims == labelled["limits.deadline_s"].dims == ("scenario",)
    assert labelled["buildings"].dims == ("scenario", "roof", "axis")
    assert "mission" not in optuav.batch(towns, ranges, paired=True).attrs


def test_faults_of_all_arguments_are_said_at_once() -> None:
    """Of missions that cannot be read too, and of what has another type."""
    with pytest.raises(InputError) as caught:
        optuav.batch_arrays(["papr", PAPER, "papyr"], {"nosuch.key": [1]}, perspective="foo")  # type: ignore
    said = str(caught.value)
    for words in (
        "papr: ",
        "papyr: ",
        "nosuch.key: must be a numeric key",
        "perspective = 'foo': must be one of",
    ):
        assert said.count(words) == 1
    with pytest.raises(InputError) as caught:
        optuav.batch_arrays("nosuch", {"x": [1]}, perspective="foo")  # type: ignore
    assert [fault.key for fault in caught.value.faults] == ["", "perspective", "x"]


@pytest.mark.parametrize(
    ("mission", "perspective", "words"),
    [
        (3, "battery", "3: must be a shipped mission's name"),
        (None, "battery", "None: must be a shipped mission's name"),
        ({"limits.deadline_s": [1]}, "battery", "a table: must be a shipped mission's name"),
        ("paper", 3, "perspective = 3: must be one of"),
        ("paper", [["battery"]], "perspective = .* one of"),
        ("paper", ["battery", "battery"], "a list of different ones"),
    ],
)
def test_other_types_are_refused(mission: Any, perspective: Any, words: str) -> None:
    with pytest.raises(InputError, match=words):
        optuav.batch_arrays(mission, {}, perspective=perspective)
    with pytest.raises(InputError, match="paired = 'x': must be true or false"):
        optuav.batch_arrays(mission, {}, perspective=perspective, paired="x")  # type: ignore[arg-type]


@pytest.mark.parametrize("roofs_m", [1.0, [[1, 2, 3]], np.zeros((0, 10, 3)), np.zeros((1, 9, 3))])
def test_layouts_of_other_shapes_are_refused(roofs_m: Any) -> None:
    """With what else is wrong; a building where none may stand is named with its layout."""
    with pytest.raises(InputError) as caught:
        optuav.batch_arrays(PAPER, {"buildings": roofs_m, "limits.dedline_s": [1]})
    assert [fault.key for fault in caught.value.faults] == ["buildings", "limits.dedline_s"]
    with pytest.raises(
        InputError, match="buildings: must be layouts of one mission, not of several"
    ):
        optuav.batch_arrays([PAPER, PAPER], {"buildings": roofs_m})
    with pytest.raises(InputError, match=r"layout 0: buildings\.b1"):
        optuav.batch_arrays(PAPER, {"buildings": [np.full((10, 3), 1e7)]})
    with pytest.raises(InputError, match="and 9 more in this layout") as caught:
        optuav.batch_arrays(PAPER, {"buildings": np.full((3, 10, 3), np.nan)})
    keys = [fault.key for fault in caught.value.faults]
    assert [key.partition(":")[0] for key in keys] == ["layout 0", "layout 1", "layout 2"]


def test_a_dataset_is_labelled_by_conventions() -> None:
    """Dimensions, coordinates with units, flags with their meanings; and it can be written."""
    xarray = pytest.importorskip("xarray")
    ranges = {"limits.deadline_s": [60, 800, 1200], "limits.min_soc": [0.05, 0.1]}
    found = optuav.batch(PAPER, ranges, perspective=["battery", "available"])
    assert isinstance(found, xarray.Dataset)
    assert dict(found.sizes) == {"perspective": 2, "limits.deadline_s": 3, "limits.min_soc": 2}
    assert found["limits.deadline_s"].attrs["units"] == found.hover_time_s.attrs["units"] == "s"
    assert found["limits.min_soc"].attrs["units"] == "1"
    cell = found.sel({"limits.deadline_s": 60, "limits.min_soc": 0.1, "perspective": "battery"})
    assert cell.hover_time_s.isnull()
    meanings = found.reason.attrs["flag_meanings"].split()
    assert len(meanings) == len(found.reason.attrs["flag_values"])
    assert meanings[int(cell.reason)] == "late"
    words = found.building.attrs["words"].splitlines()
    assert words[int(found.building[0, 2, 0])] == "b1"
    assert found.building.attrs["flag_values"][-1] == -1
    arrays = optuav.batch_arrays(PAPER, ranges, perspective=["battery", "available"])
    for name in found.data_vars:
        np.testing.assert_array_equal(found[name].values, arrays[str(name)])
    paired = optuav.batch(PAPER, {"limits.deadline_s": [800, 1200]}, paired=True)
    assert paired.hover_time_s.dims == ("scenario",)
    assert paired.attrs["perspective"] == "available"
    for each in found.data_vars.values():
        assert each.attrs["long_name"]


def test_a_dataset_says_what_it_is_of(tmp_path: Path) -> None:
    """The names of missions, wherever they come from, and the problem with all its options."""
    pytest.importorskip("xarray")
    ranges, problem = {"limits.deadline_s": [800, 1200]}, optuav.P4("b3", order="rest-first")
    PAPER.save(tmp_path / "own.toml")
    for mission in ("paper", PAPER, tmp_path / "own.toml"):
        found = optuav.batch(mission, ranges, problem)
        assert found.attrs["mission"] == "paper"
        assert found.attrs["problem"] == "P4(building='b3', order='rest-first', speed='mission')"
    both = optuav.batch(["paper", "paper-table2"], ranges, paired=True)
    assert both.mission_name.values.tolist() == ["paper", "paper-table2"]
    assert both.mission.dims == both.mission_name.dims == ("scenario",)
    assert "mission" not in both.attrs
    assert optuav.batch(["paper", "matrice350"], {}).mission_name.dims == ("mission",)


def test_missions_of_one_name_have_labels_of_their_own() -> None:
    """A number each, by which one is selected and tables are joined; several share a name."""
    pytest.importorskip("xarray")
    towns = [*optuav.layouts("paper", 4, buildings=3, seed=1), optuav.load("matrice350")]
    found = optuav.batch(towns, {"limits.deadline_s": [800, 1200]}, perspective="battery")
    assert found.indexes["mission"].tolist() == [0, 1, 2, 3, 4]
    assert found.mission_name.values.tolist() == ["paper"] * 4 + ["matrice350"]
    for number, town in enumerate(towns):
        one = found.hover_time_s.sel({"mission": number, "limits.deadline_s": 1200})
        alone = town.replace({"limits.deadline_s": 1200})
        assert float(one) == pytest.approx(optuav.solve(alone, perspective="battery").hover_time_s)
    named = found.set_xindex("mission_name").sel(mission_name="matrice350")
    assert int(named.mission) == 4
    assert found.to_dataframe().index.is_unique


def test_without_xarray_one_sentence_says_so() -> None:
    """In a process in which it cannot be imported; the arrays are there without it."""
    program = (
        "import sys; sys.modules['xarray'] = None\n"
        "import optuav\n"
        "ranges = {'limits.deadline_s': [1200]}\n"
        "print(optuav.batch_arrays('paper', ranges)['hover_time_s'].round(2))\n"
        "try:\n    optuav.batch('paper', ranges)\n"
        "except optuav.InputError as error:\n    print(error)\n"
    )
    run = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, timeout=60
    )
    assert run.stdout.splitlines() == [
        "[597.27]",
        "labelled datasets need xarray, of the extra optuav[batch]; "
        'in a clone of optuav: python -m pip install ".[batch]"',
    ]


HOVERING_CHARGES = {"laser.power_W": 50_000.0, "battery.charge_current_A": 100.0}


def longest_by_linprog(mission: Mission) -> float:
    """Δ in the perspective battery [s]: each route as a linear programme over Δ and T'."""
    network, battery = build_network(mission), mission.battery
    usable_As = (1.0 - mission.limits.min_soc) * battery.packs * battery.capacity_As
    hover_A, longest_s = float(stay_net(network, HOVER).current_A), -np.inf
    for route in np.flatnonzero(network.routes.flyable).tolist():
        building = int(network.routes.building[route])
        rest_A = 0.0
        if building >= 0:
            rest_A = float(stay_net(network, FIRST_BUILDING + np.array([building])).current_A[0])
        drawn_As = network.routes.flight_charge_As[route]
        left_s = mission.limits.deadline_s - network.routes.flight_time_s[route]
        found = linprog(
            [-1.0, 0.0],
            A_ub=[[-hover_A, -rest_A], [1.0, 1.0]],
            b_ub=[usable_As - drawn_As, left_s],
        )
        longest_s = max(longest_s, -found.fun) if found.success else longest_s
    return longest_s


def test_flights_that_need_a_rest_where_hovering_charges_less() -> None:
    """Hovering gains 2 A and resting 100 A: without a rest the flights lack charge."""
    mission, capacity_As = PAPER.replace(HOVERING_CHARGES), [36_000.0, 2_880.0, 1_800.0]
    found = optuav.batch_arrays(
        mission, {"battery.capacity_As": capacity_As}, perspective=["battery", "available"]
    )
    assert found["hover_time_s"][0] == pytest.approx([1124.208, 1098.698, 1077.740], abs=5e-4)
    for number, each in enumerate(capacity_As):
        one = mission.replace({"battery.capacity_As": each})
        assert found["hover_time_s"][0, number] == pytest.approx(longest_by_linprog(one), abs=1e-6)
        for row, perspective in enumerate(("battery", "available")):
            plan = optuav.solve(one, perspective=perspective)
            assert_same(found, (row, number), plan)
    plan = optuav.solve(mission.replace({"battery.capacity_As": 2_880.0}))
    moment = "promises 1098.70 s of hover; that plan would run dry and fall at 1192.95 s"
    assert any(note.endswith(moment) for note in plan.notes)


def test_where_charging_tapers_a_batch_has_the_word_of_solve() -> None:
    """A gap of 1e-7 to 1e-6 s: proved in both, or in neither."""
    mission = optuav.load("matrice350").replace(
        {
            "battery.charging": "taper",
            "battery.capacity_As": 9974.0,
            "battery.charge_current_A": 77.87,
            "battery.flow_rate_per_s": 0.0007363,
            "battery.available_fraction": 0.951,
            "limits.min_soc": 0.125,
        }
    )
    plan = optuav.solve(mission.replace({"limits.deadline_s": 2853.2}))
    assert_same(optuav.batch_arrays(mission, {"limits.deadline_s": [2853.2]}), 0, plan)
    assert ("none is longer" in plan.proof) == (plan.status == "optimal")


def test_one_scenario_that_fails_its_check_takes_no_other_with_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Times that are too long for one of three scenarios: that one is an error, and says so."""

    def too_long(*balance: Any) -> Any:
        found = longest_by_balance(*balance).copy()
        if found.ndim == 2:  # (route, scenario)
            found[:, 1] += 5.0
        return found

    ranges = {"limits.deadline_s": [800.0, 900.0, 1200.0]}
    right = optuav.batch_arrays("paper", ranges, perspective="battery")
    monkeypatch.setattr(best_plans, "longest_by_balance", too_long)
    found = optuav.batch_arrays("paper", ranges, perspective="battery")
    assert found["status_words"][found["status"]].tolist() == ["optimal", "error", "optimal"]
    assert "violate a constraint" in found["reason_words"][found["reason"][1]]
    assert not found["proved"][1]
    assert np.isnan(found["hover_time_s"][1])
    assert found["hover_time_s"][::2].tolist() == right["hover_time_s"][::2].tolist()


@pytest.mark.parametrize("raises", [True, False])
def test_an_engine_that_fails_in_one_scenario_fails_in_no_other(
    raises: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An engine that raises, or returns times that violate the deadline, where it is 900 s."""
    known = best_plans.solve_model

    def failing(model: Any, count: int, question: Any, values: Any = None) -> Any:
        stated = values or {name: each.value for name, each in model.given.items()}
        struck = np.broadcast_to(np.asarray(stated["deadline_s"]) == 900.0, count)
        if struck.any() and raises:
            raise optuav.SolverError("the engine failed")
        found = known(model, count, question, values)
        longer = {name: times + 1e4 * struck for name, times in found.values.items()}
        return replace(found, values=longer)

    ranges = {"limits.deadline_s": [800.0, 900.0, 1200.0]}
    right = optuav.batch_arrays("paper", ranges, "P2", perspective="battery")
    for module in (best_plans, program):
        monkeypatch.setattr(module, "solve_model", failing)
    found = optuav.batch_arrays("paper", ranges, "P2", perspective="battery")
    failed = "unknown" if raises else "error"
    assert found["status_words"][found["status"]].tolist() == ["optimal", failed, "optimal"]
    assert np.isnan(found["hover_time_s"][1])
    assert found["hover_time_s"][::2].tolist() == right["hover_time_s"][::2].tolist()


@pytest.mark.parametrize("perspective", ["battery", "available"])
@pytest.mark.parametrize("at_once", [1, pytest.param(100, marks=pytest.mark.soak), 1 << 17])
def test_towns_are_solved_as_if_each_were_alone(
    perspective: Any, at_once: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whether they follow one another or not, some at a time, with several values or one each."""
    drawn = optuav.layouts("paper", 6, buildings=5, size_m=150.0, seed=4)
    others = [drawn[0].replace({"body.mass_kg": 1.4}), drawn[1].replace({"buildings.r2": None})]
    towns = [*drawn[:3], *others, *drawn[3:], drawn[0].replace({"name": "again"})]
    ranges = {"limits.deadline_s": [120.0, 900.0, 1200.0], "body.mass_kg": [1.2, 1.35]}
    own = {key: np.linspace(values[0], values[-1], len(towns)) for key, values in ranges.items()}
    monkeypatch.setattr(machine, "ITINERARIES_AT_ONCE", at_once)
    monkeypatch.setattr(batching, "ITINERARIES_AT_ONCE", at_once)
    options: dict[str, Any] = {"perspective": perspective}
    grid = optuav.batch_arrays(towns, ranges, **options)
    paired = optuav.batch_arrays(towns, own, paired=True, **options)
    stacked = machine.Scenarios(towns[0], {}, {}, tuple(each.buildings for each in drawn))
    assert [*stacked.missions(1, 4)] == drawn[1:5]
    for number, town in enumerate(towns):
        one = {key: values[[number]] for key, values in own.items()}
        alone = optuav.batch_arrays(town, ranges, **options)
        alone_too = optuav.batch_arrays(town, one, paired=True, **options)
        for name in ("hover_time_s", "rest_time_s", "flight_time_s", "status", "reason", "order"):
            np.testing.assert_array_equal(grid[name][number], alone[name], err_msg=name)
            np.testing.assert_array_equal(paired[name][[number]], alone_too[name], err_msg=name)
        by_name = grid["building_words"][grid["building"][number]]
        np.testing.assert_array_equal(by_name, alone["building_words"][alone["building"]])


def test_keys_may_be_in_tables_as_those_of_a_sensitivity() -> None:
    """One way to write keys for both; a key that is no text is refused in words."""
    dotted = optuav.batch_arrays(PAPER, {"limits.deadline_s": [900.0, 1200.0]})
    nested = optuav.batch_arrays(PAPER, {"limits": {"deadline_s": [900.0, 1200.0]}})
    np.testing.assert_array_equal(dotted["hover_time_s"], nested["hover_time_s"])
    with pytest.raises(InputError, match="1: must be a numeric key of a mission"):
        optuav.batch_arrays(PAPER, {1: [2.0]})  # type: ignore[dict-item]
