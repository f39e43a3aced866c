"""Endless cycles of one drone: known shares, brute force, periodic wells, refusals."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import optuav
from optuav.errors import InputError, NoPlanError
from optuav.looks import LOOKS
from optuav.physics.kibam import Stage
from tests.cycles import flown, random_visit
from tests.examples import few
from tests.wells import SLOW

SHIPPED = ["paper", "paper-table2", "paper-drag", "matrice350"]


@pytest.mark.parametrize(
    ("mission", "options", "share", "building"),
    [
        ("paper", {}, 0.09448002, "b9"),
        ("paper", {"perspective": "battery"}, 0.09565935, "b9"),
        (optuav.load("matrice350").replace(SLOW), {}, 0.25410123, "b4"),
    ],
)
def test_known_shares(mission: Any, options: Any, share: float, building: str) -> None:
    """The figures that independent code found."""
    found = optuav.coverage(mission, **options)
    assert found.share == pytest.approx(share, abs=5e-9)
    assert found.building == building
    if mission == "paper" and not options:
        assert (found.hover_s, found.rest_s) == pytest.approx((608.3315, 5787.025), abs=5e-4)


@pytest.mark.parametrize("mission", SHIPPED)
@pytest.mark.parametrize(
    "options", [{}, {"lit_hover": False}, {"pad_power_W": 300}, {"swap_s": 90}], ids=str
)
def test_the_judge_flies_every_cycle_to_the_same_wells(mission: str, options: Any) -> None:
    """One cycle is flyable; but for an exchange it ends with the wells it began with."""
    found = optuav.coverage(mission, **options)
    replay = optuav.replay(found.plan)
    assert replay.flyable, replay.violations
    assert replay.times_s["hover_time_s"] == pytest.approx(found.hover_s)
    trace, start = replay.trace, found.plan.mission.start
    assert start is not None
    size = found.plan.mission.battery.packs * found.plan.mission.battery.capacity_As
    swap_s = options.get("swap_s")
    if swap_s is None:
        ends = trace.available_As[-1, 0], trace.bound_As[-1, 0]
        assert ends == pytest.approx((start.available_As, start.bound_As), abs=1e-6 * size)
    period_s = replay.mission_time_s + (swap_s or 0.0)
    assert found.hover_s / period_s == pytest.approx(found.share, rel=1e-9)
    assert found.share <= found.bound <= found.share * 1.0095
    assert optuav.audit(found.plan.to_dict())


@few(12)
@given(st.integers(0, 10**6))
def test_no_other_cycle_covers_more(seed: int) -> None:
    """Brute force over hovers: those that pass in the wells' own equations are no longer."""
    rng = np.random.default_rng(seed)
    visit = random_visit(rng)
    battery, share = visit.battery, visit.battery.available_fraction
    if (longest_s := visit.longest_s) is None or longest_s < 1:
        return
    bound = visit.share(visit.most_s)
    for hover_s in [longest_s, *rng.uniform(0.0, 1.1, 8) * longest_s]:
        rest = Stage(visit.rest_A, visit.rest_s(hover_s))
        stages = [*visit.stages(hover_s), rest]
        wells = visit.wells(hover_s)
        ends = flown(visit, stages, wells)
        assert ends[-1] == pytest.approx(wells, abs=1e-6 * battery.capacity_As)
        assert max(y1 for y1, _ in ends) <= share * battery.capacity_As * (1 + 1e-9)
        passes = min(y1 for y1, _ in ends) >= 0 and sum(ends[-2]) >= visit.least_As
        if passes:
            assert hover_s <= longest_s * (1 + 1e-9)
            assert visit.share(hover_s) <= bound * (1 + 1e-12)
        else:
            assert hover_s > longest_s * (1 - 1e-9)


@few(10)
@given(st.integers(0, 10**6))
def test_mixed_cycles_are_no_better_by_charge(seed: int) -> None:
    """By charge, a cycle of several hovers on several buildings covers at most the best share."""
    rng = np.random.default_rng(seed)
    visits = [random_visit(rng, "battery") for _ in range(3)]
    first = visits[0]
    visits = [
        type(first)("b", first.battery, each.out, each.back, first.hover_A, each.rest_A,
                    first.least_As, "battery")
        for each in visits
    ]  # fmt: skip
    best = max(each.share(each.balanced_s) for each in visits if each.balanced_s > 0)
    for _ in range(20):
        some = [visits[k] for k in rng.integers(0, 3, 4)]
        hovers = [max(each.balanced_s, 0) * rng.uniform() for each in some]
        period = sum(each.period_s(h) for each, h in zip(some, hovers, strict=True))
        assert sum(hovers) / period <= best * (1 + 1e-12)


@pytest.mark.parametrize(
    ("mission", "share"), [("paper", 0.1021), ("paper-table2", 0.0831), ("matrice350", 0.2691)]
)
def test_free_flights_would_cover_the_published_limit(mission: str, share: float) -> None:
    """I_r/(I_r + I_h), with the roof that charges most."""
    assert optuav.coverage(mission).limit_share == pytest.approx(share, abs=5e-5)


def test_no_flow_between_wells_leaves_the_bound_well_alone() -> None:
    """With k_F = 0 the hover is (min(ωB, F) − Q)/I_h, and continuous with small k_F."""
    mission = optuav.load("paper").replace({"battery.flow_rate_per_s": 0.0})
    found = optuav.coverage(mission)
    assert found.visit is not None
    drawn = found.visit.hover_A
    expected = (min(0.8 * 72_000, 0.95 * 72_000) - found.visit.flight_As) / drawn
    assert found.hover_s == pytest.approx(expected, rel=1e-12)
    assert optuav.replay(found.plan).flyable
    near = optuav.coverage(mission.replace({"battery.flow_rate_per_s": 1e-12}))
    assert near.hover_s == pytest.approx(expected, rel=1e-5)


def test_a_laser_that_gives_more_than_hovering_draws_never_lets_it_land() -> None:
    """Share 1 in words, and no plan."""
    strong = {"laser.power_W": 1e6, "battery.charge_current_A": 900}
    found = optuav.coverage(optuav.load("paper").replace(strong))
    assert (found.share, found.building) == (1.0, None)
    assert "hovers without end" in str(found)
    with pytest.raises(NoPlanError, match="gives more than hovering draws"):
        found.plan  # noqa: B018
    assert found.plot() == {}


def test_the_table_the_picture_and_the_page() -> None:
    """Phases in order with the wells at their ends; a picture; HTML; plain data."""
    found = optuav.coverage("paper")
    assert [row["kind"] for row in found.rows] == ["flight", "hover", "flight", "rest"]
    assert sum(found.to_frame()["duration_s"]) == pytest.approx(found.period_s)
    assert found.rows[2]["available_As"] == 0.0  # The longest hover lands as the well is empty
    (ax,) = found.plot()["cycle.png"].axes
    wells = {line.get_label(): line.get_color() for line in ax.get_lines()}
    assert wells == {f"{well} well": LOOKS[well].light for well in ("available", "bound")}
    assert "b9" in found._repr_html_()
    assert found.to_dict()["share"] == found.share


@pytest.mark.parametrize(
    ("changes", "options", "words"),
    [
        (
            {},
            {"perspective": "energy"},
            "perspective = 'energy': must be one of available, battery",
        ),
        ({}, {"swap_s": 0}, "swap_s = 0: must be a number, 0 < x <= 1e7"),
        ({}, {"pad_power_W": -5}, "pad_power_W = -5"),
        ({}, {"swap_s": 10, "pad_power_W": 5}, "pad_power_W = 5: must be left out beside swap_s"),
        ({}, {"lit_hover": "no"}, "lit_hover = 'no': must be True or False"),
        ({"battery.schedule": "round-robin"}, {}, "battery.schedule = 'round-robin': "),
        ({"buildings": []}, {}, "the mission has 0 buildings"),
        ({"laser": None}, {}, "laser: nothing charges"),
    ],
)
def test_bad_input_is_one_clear_error(changes: Any, options: Any, words: str) -> None:
    """Key, value and allowed range."""
    with pytest.raises(InputError) as refusal:
        optuav.coverage(optuav.load("paper").replace(changes), **options)
    assert words in str(refusal.value)


@pytest.mark.parametrize(
    ("changes", "options", "words"),
    [
        ({}, {"pad_power_W": 20}, "pad_power_W = 20: must exceed the 20.14 W that"),
        ({"laser.power_W": 100}, {}, r"laser.power_W = 100: gives 0\.\d+ A .* draws 0.45 A"),
        ({"battery.charge_current_A": 0.4}, {}, "charge_current_A = 0.4: must exceed the 0.45 A"),
        ({"battery.charge_current_A": 0.4}, {"pad_power_W": 99}, "charge_current_A = 0.4: must"),
        ({"battery.charge_current_A": 0.4, "laser": None}, {"pad_power_W": 9}, "_W = 9: must"),
    ],
)
def test_a_charger_that_is_too_weak_is_named(changes: Any, options: Any, words: str) -> None:
    """By hand: at rest `matrice350` draws 0.45 A, with a battery of 44.76 V that is 20.14 W."""
    with pytest.raises(InputError, match=words):
        optuav.coverage(optuav.load("matrice350").replace(changes), **options)


def test_a_pad_just_strong_enough_charges() -> None:
    """The limit that the refusal names is the limit."""
    assert 0.0 < optuav.coverage("matrice350", pad_power_W=20.2).share < 0.001


def test_without_enough_charge_there_is_no_cycle() -> None:
    """A battery that the legs empty."""
    with pytest.raises(NoPlanError, match="no building allows a hover"):
        optuav.coverage(optuav.load("paper").replace({"battery.capacity_As": 1000}))
