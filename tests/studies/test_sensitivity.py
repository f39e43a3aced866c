"""What matters most: single keys against solving again, samples against single missions."""

from __future__ import annotations

import functools
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import optuav
from optuav.errors import InputError
from optuav.mission.keys import stated_keys
from optuav.network.network import build_network
from optuav.network.variants import Variants
from optuav.studies import scenarios as machine
from optuav.studies.samples import Draws, independent, spreads, unstated
from optuav.studies.sensitivity import Effect, Sensitivity
from optuav.studies.uncertainty import Chances, FixedPlan, chances
from tests.several_devices import three
from tests.wells import SLOW

SIZE = {"battery": {"capacity_As": {"percent": 10}}, "limits": {"min_soc": {"percent": 50}}}


@functools.cache
def of(name: str, perspective: str = "available") -> Sensitivity:
    """Effects of the keys of a shipped mission, without samples."""
    return optuav.sensitivity(name, {}, perspective=perspective)


def effect(found: Sensitivity, key: str) -> Effect:
    return next(row for row in found.rows if row["key"] == key)


def chances_of(found: Sensitivity) -> Chances:
    assert isinstance(found.chances, Chances)
    return found.chances


def test_the_perspective_is_available_by_default() -> None:
    """As everywhere: the hover time is that of `solve` without a perspective."""
    found = of("paper")
    assert found.perspective == "available"
    assert found.hover_time_s == pytest.approx(optuav.solve("paper").hover_time_s)


def test_a_note_says_that_a_wavelength_holds_the_slopes(monkeypatch: pytest.MonkeyPatch) -> None:
    """A mission with another wavelength has to state them again."""
    monkeypatch.setattr("optuav.studies.sensitivity.MOST_ROWS", 24)
    text = "laser.wavelength_nm moves only the attenuation: slopes and offsets are held"
    assert text in str(of("matrice350"))
    assert text not in str(of("paper"))


def test_effects_of_single_keys_are_those_of_solving_again() -> None:
    """On `paper`, with the laser, the link and the rotors."""
    mission = optuav.load("paper")
    found = of("paper", "battery")
    keys = ("body.mass_kg", "rotor.max_speed_rad_s", "link.path_loss_exponent", "limits.min_soc")
    for key in (*keys, "laser.wavelength_nm", "limits.min_altitude_m"):
        each = effect(found, key)
        more: dict[str, Any] = {}
        if key == "laser.wavelength_nm" and mission.laser is not None:
            fits = ("emitter_slope", "emitter_offset_W", "receiver_slope", "receiver_offset_W")
            more = {f"laser.{name}": getattr(mission.laser, name) for name in fits}
        for value, hover_s in (
            (each["low"], each["hover_low_s"]),
            (each["high"], each["hover_high_s"]),
        ):
            plan = optuav.solve(mission.replace({key: value, **more}), perspective="battery")
            assert hover_s == pytest.approx(plan.hover_time_s, abs=1e-5), key


def test_the_largest_effect_comes_first_and_a_lost_plan_is_the_largest() -> None:
    """A device 300 m nearer puts b9 and b10 in the way of all routes of `paper`."""
    found = of("paper")
    first = found.rows[0]
    assert (first["key"], first["hover_low_s"]) == ("link.device_m[1]", None)
    assert not optuav.solve(
        optuav.load("paper").replace({"link.device_m": [1000, 2700, 0]}), perspective="battery"
    )
    swings = [each["swing_s"] for each in found.rows]
    assert swings == sorted(swings, reverse=True)


def wide(mission: optuav.Mission) -> dict[str, dict[str, Any]]:
    """Every number within 40 % of its value, the flow between the wells a hundredfold."""
    stated: dict[str, dict[str, Any]] = {}
    for key in stated_keys(mission).values():
        if key.whole or not key.now:
            continue
        share = 0.99 if key.name == "battery.flow_rate_per_s" else 0.4
        ends = sorted(key.now * (1.0 + part) for part in (-share, share))
        low, high = max(ends[0], key.low), min(ends[1], key.high)
        table, name = key.name.split(".", 1)
        stated.setdefault(table, {})[name] = {"low": low, "high": high}
    return stated


@pytest.mark.parametrize(
    ("name", "changes", "perspective", "samples", "at_once"),
    [
        ("paper", {}, "available", 14, 7),
        ("paper", {}, "battery", 14, 7),
        ("paper", {"limits.deadline_s": 800}, "available", 14, 7),
        ("paper", {"battery.charging": "taper"}, "available", 5, 2),
        ("matrice350", {}, "available", 6, 1),
        ("matrice350", {}, "adjusted", 9, 1),
        *(
            pytest.param(*each, marks=pytest.mark.soak)
            for at_once in (1, 7, 100)
            for each in (
                ("paper", {}, "available", 500, at_once),
                ("paper", {}, "battery", 14, at_once),
                ("paper", {"limits.deadline_s": 800}, "available", 14, at_once),
                ("paper", {"battery.charging": "taper"}, "available", 5, at_once),
                ("matrice350", {}, "available", 200, at_once),
                ("matrice350", {}, "adjusted", 9, at_once),
            )
        ),
    ],
)
def test_samples_do_not_depend_on_how_many_are_computed_at_once(
    name: str, changes: dict[str, Any], perspective: str, samples: int, at_once: int
) -> None:
    """To the last bit, hover times and shares alike; and the first are those of a longer run.

    The keys are spread so far that some samples meet other limits of the battery than others, or
    have no plan.
    """
    whole = drawn_by(name, tuple(changes.items()), perspective, samples, 8192)
    again = drawn_by(name, tuple(changes.items()), perspective, samples, at_once)
    assert again == whole
    assert (again.hover_times_s == whole.hover_times_s).all()
    first = drawn_by(name, tuple(changes.items()), perspective, 5, 8192)
    assert (first.hover_times_s == whole.hover_times_s[:5]).all()


@functools.cache
def drawn_by(
    name: str, changes: tuple[tuple[str, Any], ...], perspective: str, count: int, at_once: int
) -> Chances:
    mission = optuav.load(name).replace(dict(changes))
    plan = FixedPlan.of(optuav.solve(mission, perspective=perspective), mission)
    draws = Draws(mission, spreads(mission, wide(mission)), count, 0, independent)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(machine, "ITINERARIES_AT_ONCE", at_once * len(build_network(mission).routes))
        return chances(draws, perspective, plan, stated=True)


def test_the_same_seed_gives_the_same_result() -> None:
    mission = optuav.load("paper").replace({"buildings": []})
    one, two, other = (optuav.sensitivity(mission, SIZE, samples=99, seed=s) for s in (1, 1, 2))
    assert one == two
    assert one.to_dict() == two.to_dict()
    assert chances_of(one).mean_s != chances_of(other).mean_s


def test_quantiles_of_a_single_uniform_key_by_hand() -> None:
    """Capacity alone, all charge used: hover time is uniform too, between its ends."""
    mission = optuav.load("paper-table2").replace(
        {
            "limits.deadline_s": 5000,
            "laser": None,
            "flight.charge_current_A": None,
            "flight.charge_power_W": None,
        }
    )
    stated = {"battery": {"capacity_As": {"percent": 10}}}
    found = optuav.sensitivity(mission, stated, perspective="battery", samples=8_000)
    hover_s, swing_s = found.hover_time_s, 0.1 * 0.95 * 72000 / 72.073
    for share, value_s in chances_of(found).quantiles_s.items():
        assert value_s == pytest.approx(hover_s + (2 * share - 1) * swing_s, abs=0.02 * swing_s)
    assert chances_of(found).routes == {"direct": 1.0}
    # The plan uses all charge: half of the samples have more. But it runs dry in all of them.
    kept = chances_of(found).kept
    assert kept is not None
    assert kept["charge left"] == pytest.approx(0.5, abs=0.02)
    assert kept["never dry"] == chances_of(found).flyable == 0.0


def test_without_a_statement_all_that_is_measured_is_uncertain() -> None:
    """Nothing of what is chosen; no whole number, no 0."""
    found = chances_of(optuav.sensitivity("matrice350", samples=10))
    assert not found.stated
    assert {key.partition(".")[0] for key in found.uncertain} == {
        *("battery", "laser", "link", "flight")
    }
    assert {"battery.packs", "laser.emitter_offset_W"}.isdisjoint(found.uncertain)


def test_without_a_plan_the_text_says_so() -> None:
    mission = optuav.load("paper").replace({"limits.deadline_s": 60})
    found = optuav.sensitivity(mission, {"limits": {"min_soc": {"percent": 10}}}, samples=50)
    assert found.hover_time_s == 0.0
    assert found.plan_hover_time_s is None
    assert chances_of(found).no_plan == 1.0
    assert chances_of(found).flyable is None
    assert "no plan 100 %" in str(found)
    text = str(found)
    assert "The mission has no plan" in text
    assert "Longest hover" not in text
    assert "Less than" not in text


# The plan that is held fixed


def test_a_plan_that_the_battery_cannot_deliver_is_never_flyable() -> None:
    """The optimum of `paper` runs dry and is charged past full; that of `matrice350` is neither."""
    for name, expected in (("paper", False), ("matrice350", True)):
        mission = optuav.load(name)
        mission = mission.replace(SLOW) if name == "matrice350" else mission
        fixed = FixedPlan.of(optuav.solve(mission, perspective="battery"), mission)
        columns = {"battery.capacity_As": np.array([mission.battery.capacity_As])}
        kept = fixed.conditions_held(Variants(build_network(mission), columns))
        assert kept["never dry"][0] == expected
        assert kept["never past full"][0] == expected
        for condition in ("legs and thrust", "link", "charge left", "deadline"):
            assert kept[condition][0], condition


def test_a_fixed_plan_is_flyable_where_the_replay_says_so() -> None:
    """Sample by sample, with another battery, air, load and speed; both verdicts occur."""
    mission = optuav.load("matrice350").replace({**SLOW, "limits.deadline_s": 3100})
    plan = optuav.solve(
        mission.replace({"limits.deadline_s": 3000, "limits.min_soc": 0.23}), perspective="battery"
    )
    stated = {
        "battery": {"capacity_As": {"percent": 6}, "flow_rate_per_s": {"percent": 50}},
        "flight": {"hover_current_A": {"percent": 3}, "max_speed_m_s": {"percent": 20}},
        "laser": {"visibility_km": {"percent": 30}},
        "limits": {"min_altitude_m": {"low": 55, "high": 61}},
    }
    columns = Draws(mission, spreads(mission, stated), 40, 5, independent).values(0, 40)
    variants = Variants(build_network(mission), columns)
    flyable = np.logical_and.reduce(
        [*FixedPlan.of(plan, mission).conditions_held(variants).values()]
    )
    where = [float(each) for each in optuav.graph(mission).nodes["hover"]["position_m"]]
    for number in range(40):
        values = {key: float(column[number]) for key, column in columns.items()}
        changed = mission.replace({**values, "route.hover_m": where})
        replayed = optuav.replay(plan.model_copy(update={"mission": changed}))
        limits = {event.kind for event in replayed.violations}
        assert flyable[number] == (not limits - {"mismatch"}), limits
    assert 0.2 < flyable.mean() < 0.8


@pytest.mark.parametrize(
    "changes",
    [
        {"buildings.b1.name": "tower"},
        {"route.destination_m": [1900, 0, 50]},
        {"link.device_m": [900, 3000, 0]},
        {"laser.position_m": [10, 0, 0]},
    ],
)
def test_a_plan_over_other_places_is_refused(changes: dict[str, Any]) -> None:
    """Its legs and its hover point are those of the mission that it was made for."""
    plan = optuav.solve(optuav.load("paper").replace(changes))
    assert plan
    with pytest.raises(InputError, match="the same origin, destination, device, laser and"):
        optuav.sensitivity("paper", {}, plan=plan)


@pytest.mark.parametrize("perspective", ["available", "battery", "adjusted"])
def test_no_sample_hovers_less_than_a_fixed_plan_that_is_flyable_in_it(perspective: str) -> None:
    """With more reach the hover point moves until b9 and b10 bar all ways; the plan's stays put."""
    mission = optuav.load("paper")
    plan = optuav.solve(mission)
    spread = {"link": {"path_loss_exponent": {"percent": 10}}}
    found = chances_of(
        optuav.sensitivity(mission, spread, perspective=perspective, plan=plan, samples=400)
    )
    assert found.flyable is not None
    assert 0.0 < found.flyable < 1.0
    hovered = found.hover_times_s >= plan.hover_time_s - 1e-6
    assert hovered.mean() >= found.flyable - 1e-12
    assert found.no_plan + found.flyable <= 1.0 + 1e-12
    assert found.no_plan + sum(found.routes.values()) == pytest.approx(1.0)


# What it looks like


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"samples": 0}, "samples = 0: must be a whole number"),
        ({"samples": 1.5}, "samples = 1.5: must be a whole number"),
        ({"seed": -1}, "seed = -1: must be a whole number"),
        ({"perspective": "wells"}, "perspective = 'wells': must be one of battery"),
        ({"uncertainty": {"body": {"mass": {"percent": 1}}}}, "did you mean 'body.mass_kg'"),
    ],
)
def test_arguments_that_are_refused(arguments: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError) as caught:
        optuav.sensitivity("paper", **arguments)
    assert words in str(caught.value)


def test_packs_that_take_turns_are_not_taken_for_pooled_ones(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """On these the longest hover takes a search of seconds, for every sample."""
    mission = optuav.load("paper").replace({"battery.schedule": "sequential", "battery.packs": 2})
    with pytest.raises(InputError, match=r"battery\.schedule = 'sequential': must be pooled, or"):
        optuav.sensitivity(mission)
    limits = [each for each in unstated(mission) if each.key.name.startswith("limits.")]
    monkeypatch.setattr("optuav.studies.sensitivity.unstated", lambda _: limits)
    found = optuav.sensitivity(mission, {}, perspective="battery")
    row = effect(found, "limits.deadline_s")
    changed = mission.replace({"limits.deadline_s": row["low"]})
    expected = optuav.solve(changed, perspective="battery").hover_time_s
    assert row["hover_low_s"] == pytest.approx(expected, abs=1e-9)


def test_small_effects_are_shown_as_less_than_the_last_digit(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Not as "-0.000"; and keys that hardly move the hover time are left out."""
    monkeypatch.setattr("optuav.studies.sensitivity.MOST_ROWS", 40)
    wide = {"limits": {"min_altitude_m": {"low": 20, "high": 80}}}
    text = str(optuav.sensitivity("paper", wide, samples=10))
    assert not re.search(r"[+-]0\.000\b", text)
    assert "<0.001" in text
    assert "route.origin_m[2]" not in text


def test_ends_of_ranges_are_written_as_they_are_meant() -> None:
    found = of("paper")
    assert "link.device_m[1],m,3000.0,2700.0,3300.0," in found.to_csv()
    (device,) = (line for line in str(found).splitlines() if line.startswith("link.device_m[1]"))
    assert "±10 %" in device
    uneven = {"battery.capacity_As": {"low": 30_000, "high": 40_000}}
    assert "30000 to 40000" in str(optuav.sensitivity("paper", uneven))


def test_data_can_be_written_and_tables_fit_a_screen() -> None:
    found = optuav.sensitivity("matrice350", samples=20)
    data = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    assert data["kind"] == "optuav sensitivity"
    assert len(data["rows"]) == len(found.rows) == len(found.to_csv().splitlines()) - 1
    assert max(map(len, str(found).splitlines())) <= 80


# Elasticities


@pytest.fixture(scope="module")
def direct() -> Sensitivity:
    """`paper-table2` with time to spare and no laser: hovers until the charge is used."""
    mission = optuav.load("paper-table2").replace(
        {
            "laser": None,
            "flight.charge_current_A": None,
            "flight.charge_power_W": None,
            "limits.deadline_s": 5000,
        }
    )
    return optuav.sensitivity(mission, {}, perspective="battery")


@pytest.mark.parametrize(
    ("name", "key"),
    [
        ("paper", "battery.capacity_As"),
        ("paper", "battery.flow_rate_per_s"),
        ("paper", "rotor.max_speed_rad_s"),
        ("paper-table2", "battery.available_fraction"),
        ("paper-table2", "flight.hover_current_A"),
        ("paper-table2", "flight.acceleration_m_s2"),
        ("matrice350", "flight.max_speed_m_s"),
        ("matrice350", "laser.visibility_km"),
    ],
)
def test_exact_elasticities_of_a_battery_that_must_not_run_dry(name: str, key: str) -> None:
    """Rates at the value are those of solving again, 0.1 % to either side."""
    mission = optuav.load(name)
    now = effect(of(name), key)
    less, more = (
        optuav.solve(mission.replace({key: now["now"] * (1 + step)})) for step in (-1e-3, 1e-3)
    )
    assert less.route == more.route
    measured = (more.hover_time_s - less.hover_time_s) / (more.hover_time_s + less.hover_time_s)
    assert now["local_elasticity"] == pytest.approx(1e3 * measured, rel=1e-3)


def test_elasticities_of_a_direct_flight_by_hand(direct: Sensitivity) -> None:
    """Δ = ((1 − η0) B − I_fl T_fl)/I_hv, with B = 72 000 As and the recovered loads."""
    usable_As, flight_As, hover_A = 0.95 * 72000, 93.658 * 59.35, 72.073
    hover_s = (usable_As - flight_As) / hover_A
    assert direct.hover_time_s == pytest.approx(hover_s, rel=1e-4)
    size = effect(direct, "battery.capacity_As")
    assert size["local_elasticity"] == pytest.approx(usable_As / (hover_A * hover_s), rel=1e-4)
    assert size["elasticity"] == pytest.approx(size["local_elasticity"], rel=1e-9)
    assert size["hover_low_s"] == pytest.approx((0.9 * usable_As - flight_As) / hover_A, rel=1e-4)
    load = effect(direct, "flight.hover_current_A")
    assert load["local_elasticity"] == pytest.approx(-1.0, abs=1e-6)
    assert load["elasticity"] == pytest.approx(-1.0 / 0.99, rel=1e-6)  # mean of 1/1.1 and 1/0.9
    assert effect(direct, "limits.deadline_s")["local_elasticity"] == 0.0


def test_measured_and_exact_agree_where_nothing_bends(direct: Sensitivity) -> None:
    """Within a tenth of the value, to a fifth of the elasticity at worst; most far closer."""
    for each in direct.rows:
        measured, exact = each["elasticity"], each["local_elasticity"]
        if measured is not None and exact is not None and abs(exact) > 0.01:
            assert measured == pytest.approx(exact, rel=0.2), each["key"]


def test_a_kink_has_no_elasticity() -> None:
    """Where charge and deadline end the hover together, more time brings nothing, less costs."""
    mission = optuav.load("paper-table2").replace(
        {
            "laser": None,
            "flight.charge_current_A": None,
            "flight.charge_power_W": None,
            "limits.deadline_s": 5000,
        }
    )
    plan = optuav.solve(mission, perspective="battery")
    both = mission.replace({"limits.deadline_s": plan.mission_time_s})
    found = effect(optuav.sensitivity(both, {}, perspective="battery"), "limits.deadline_s")
    assert found["local_elasticity"] is None
    share = plan.mission_time_s / plan.hover_time_s
    assert found["local_less"] == pytest.approx(share, rel=1e-6)  # a second less costs a second
    assert found["local_more"] == 0.0
    assert found["hover_high_s"] == pytest.approx(plan.hover_time_s)
    assert found["hover_low_s"] == pytest.approx(plan.hover_time_s - 0.1 * plan.mission_time_s)


@pytest.mark.parametrize("perspective", ["available", "battery"])
@pytest.mark.parametrize("axis", ["link.device_m[0]", "route.destination_m[0]"])
def test_tied_itineraries_have_the_rates_of_solving_again_on_either_side(
    perspective: str, axis: str
) -> None:
    """`paper` is symmetric: moved to one side, one of two roofs is the best, to the other side the
    other one. Above, the hover time is that of the route that gains more, or loses less."""
    mission, (key, _) = optuav.load("paper"), axis.split("[")
    table, name = key.split(".")
    now, *rest = getattr(getattr(mission, table), name)
    here, less, more = (
        optuav.solve(mission.replace({key: [now + step, *rest]}), perspective=perspective)
        for step in (0.0, -1e-4 * now, 1e-4 * now)
    )
    assert less.route != more.route
    below, above = (
        (end.hover_time_s / here.hover_time_s - 1.0) / step
        for end, step in ((less, -1e-4), (more, 1e-4))
    )
    assert below < above - 5e-4
    found = of("paper", perspective)
    each = effect(found, axis)
    assert each["local_less"] == pytest.approx(below, rel=5e-3)
    assert each["local_more"] == pytest.approx(above, rel=5e-3)
    assert each["local_elasticity"] is None
    assert {"local_less": each["local_less"], "local_more": each["local_more"]}.items() <= next(
        row for row in found.to_dict()["rows"] if row["key"] == axis
    ).items()


def test_both_sides_of_a_kink_are_shown_below_the_table(monkeypatch: pytest.MonkeyPatch) -> None:
    """With its rates below and above the value, on a row that would have no room for two."""
    monkeypatch.setattr("optuav.studies.sensitivity.MOST_ROWS", 24)
    text = " ".join(str(of("paper")).split())
    assert "−0.001 kink" in text
    assert "Local on either side: link.device_m[0] −0.012 below, +0.003 above;" in text


@settings(max_examples=2, deadline=None)
@given(
    aside_m=st.floats(20.0, 60.0) | st.floats(-60.0, -20.0),
    mass_kg=st.floats(1.2, 1.32),
    perspective=st.sampled_from(["available", "battery"]),
)
def test_without_a_tie_both_sides_are_the_same(
    aside_m: float, mass_kg: float, perspective: str
) -> None:
    """Off the axis of `paper` one itinerary is the best: its rates are those of solving again."""
    device_m = [1000.0 + aside_m, 3000.0, 0.0]
    mission = optuav.load("paper").replace({"link.device_m": device_m, "body.mass_kg": mass_kg})
    found = optuav.sensitivity(mission, {}, perspective=perspective, samples=1)
    assert not [
        each["key"]
        for each in found.rows
        if each["local_less"] != each["local_more"] and each["local_elasticity"] is None
    ]
    each = effect(found, "link.device_m[0]")
    hover_s = [
        optuav.solve(
            mission.replace({"link.device_m": [device_m[0] + step, *device_m[1:]]}),
            perspective=perspective,
        ).hover_time_s
        for step in (-0.5, 0.5)
    ]
    rate = (hover_s[1] - hover_s[0]) * device_m[0] / found.hover_time_s
    assert each["local_elasticity"] == pytest.approx(rate, rel=1e-3, abs=1e-6)


def test_an_end_of_a_range_is_no_kink() -> None:
    """At ε = 0.99995 no step of 0.01 % is left above: the rate is that of the other side."""
    far = optuav.load("paper").replace({"limits.outage_probability": 0.99995})
    found = optuav.sensitivity(far, samples=10)
    each = effect(found, "limits.outage_probability")
    assert (each["local_more"], each["has_kink"], each["at_end"]) == (None, False, True)
    assert each["local_elasticity"] == each["local_less"]
    text = str(
        optuav.sensitivity(
            far, {"limits": {"outage_probability": {"low": 0.5, "high": 0.99999}}}, samples=1
        )
    )
    assert "below, – above, the end of the range" in " ".join(text.split())


def test_a_curve_is_no_kink() -> None:
    """Where differences of second order leave a rest, as for the path loss at a far reach."""
    far = optuav.load("paper").replace({"limits.outage_probability": 0.99995})
    each = effect(optuav.sensitivity(far, samples=10), "link.path_loss_exponent")
    assert not each["has_kink"]
    assert each["local_less"] == pytest.approx(each["local_more"], rel=0.01)


def test_gravity_varies_only_where_it_is_stated() -> None:
    """It is known; and ten keys are shown, of all that are written to files."""
    found = of("paper")
    assert "body.gravity_m_s2" not in {row["key"] for row in found.rows}
    assert "body.gravity_m_s2" not in optuav.sensitivity("paper", samples=1).chances.uncertain
    assert f"and {len(found.rows) - 10} more with smaller effects" in str(found)
    stated = {"body": {"gravity_m_s2": {"percent": 1}}}
    found = optuav.sensitivity("paper", stated, samples=10)
    assert found.chances.uncertain == ("body.gravity_m_s2",)


def test_the_mean_says_that_a_sample_without_a_plan_counts_as_none() -> None:
    """Both means: of all samples, and of those with a plan."""
    spread = {"limits": {"deadline_s": {"low": 40, "high": 200}}}
    found = optuav.sensitivity("paper", spread, samples=200)
    times_s = found.chances.hover_times_s
    flown = times_s[times_s > 0.0]
    assert 20 < len(flown) < 200
    words = f"mean {times_s.mean():.1f} s with 0 s for no plan, {flown.mean():.1f} s where there"
    assert words in " ".join(str(found).split())
    assert "1 key at once, as specified: 200 samples" in str(found)


def test_a_plan_without_an_answer_is_refused() -> None:
    """It is not replaced by the mission's own best plan."""
    none = optuav.solve(optuav.load("paper").replace({"limits.deadline_s": 20}))
    with pytest.raises(InputError, match="plan = infeasible"):
        optuav.sensitivity("paper", plan=none, samples=10)


def test_a_key_that_the_mission_does_not_state_needs_a_range() -> None:
    """As of `batch`: haze, at 15 km in the mission that is studied, or at its likely value."""
    haze = {"laser.visibility_km": {"low": 10.0, "high": 20.0}}
    found = optuav.sensitivity("paper", haze, perspective="battery", samples=16)
    (row,) = [each for each in found.rows if each["key"] == "laser.visibility_km"]
    swept = optuav.batch_arrays(
        "paper", {"laser.visibility_km": [10.0, 15.0, 20.0]}, perspective="battery"
    )["hover_time_s"]
    ours = row["hover_low_s"], found.hover_time_s, row["hover_high_s"]
    assert ours == pytest.approx(swept.tolist(), rel=1e-9)
    assert row["now"] == 15.0
    likely = {"laser.visibility_km": {"low": 10.0, "likely": 12.0, "high": 20.0}}
    again = optuav.sensitivity("paper", likely, perspective="battery", samples=16)
    assert {r["now"] for r in again.rows if r["key"] == "laser.visibility_km"} == {12.0}
    assert optuav.samples("paper", haze, 4)["laser.visibility_km"].shape == (4,)
    for form in ({"percent": 5}, {"deviation": 1.0}):
        with pytest.raises(optuav.InputError, match="does not set it: set low and high"):
            optuav.sensitivity("paper", {"laser.visibility_km": form}, samples=8)
    with pytest.raises(optuav.InputError, match="only with flight"):
        optuav.sensitivity("paper", {"flight.tip_speed_m_s": {"low": 1, "high": 2}}, samples=8)


def test_a_place_of_one_of_several_devices_is_a_key() -> None:
    """Its ends are solved with the device there, and the others' keys are listed too."""
    key = "devices.west.position_m[0]"
    found = optuav.sensitivity(three(), {key: {"low": 300, "high": 500}}, samples=4)
    rows = {row["key"]: row for row in found.to_frame().to_dict("records")}
    for x, hover_s in ((300, rows[key]["hover_low_s"]), (500, rows[key]["hover_high_s"])):
        moved = three().replace({"devices.west.position_m": [x, 2600, 0]})
        assert hover_s == pytest.approx(optuav.solve(moved).hover_time_s)
    assert {"devices.north.position_m[1]", "devices.east.position_m[0]"} <= rows.keys()


@pytest.mark.parametrize(
    "text",
    [
        '[devices.west]\n"position_m[0]" = { low = 300, high = 500 }\n',
        '[devices]\nwest = { "position_m[0]" = { low = 300, high = 500 } }\n',
        '[devices.west."position_m[0]"]\nlow = 300\nhigh = 500\n',
    ],
)
def test_a_table_of_a_device_is_its_dotted_keys(tmp_path: Path, text: str) -> None:
    """So it is for the tables of a mission."""
    (tmp_path / "uncertainty.toml").write_text(text, "utf-8")
    of_table = spreads(three(), tmp_path / "uncertainty.toml")
    assert of_table == spreads(three(), {"devices.west.position_m[0]": {"low": 300, "high": 500}})
