"""What the explorer answers: the known figures of `paper`, true curves, and faults in words."""

from __future__ import annotations

import json
import math
import tomllib
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import optuav
from optuav.errors import InputError
from optuav.explorer.answers import MOST_BUILDINGS, answers, refuse_many
from optuav.mission import Mission
from tests.diagnosis.missions import only
from tests.flight.test_flights import WINGED
from tests.several_devices import EIGHT, eight, plan_over_eight, three

BATTERY = {"perspective": "battery"}
HOVER_S, REST_S = 719.5399, 392.1438
"""The optimum of `paper` in the perspective battery, resting on b1 first."""
CAPACITY_As = 72_000.0
SECONDS = 10.0 / 87.9104  # Of hover that a second of rest charges: the ratio of both currents


@pytest.fixture(scope="module")
def paper() -> Mission:
    return optuav.load("paper")


@pytest.fixture(scope="module")
def by_battery(paper: Mission) -> dict[str, Any]:
    return answers(paper, BATTERY)


def fields(answer: dict[str, Any]) -> dict[str, np.ndarray]:
    """What constraints leave over in the plane (Δ, T'), by name."""
    plane = answer["plane"]
    shape = (plane["samples"], plane["samples"])
    return {e["short"]: np.reshape(e["excess"], shape) for e in plane["limits"]}


def times(answer: dict[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    """Hover and rest times of the samples of the plane [s]."""
    plane = answer["plane"]
    y, x = (np.linspace(*plane[name], plane["samples"]) for name in ("hover_s", "rest_s"))
    return y[:, None], x[None]


@pytest.mark.parametrize(
    ("state", "hover_s"),
    [
        ({}, 597.270),
        (BATTERY, 719.540),
        ({"problem": "P3"}, 577.524),
        ({**BATTERY, "problem": "P3"}, 688.848),
        ({"building": "b9", "order": "hover-first"}, 597.270),
        ({**BATTERY, "changes": {"limits.deadline_s": 800}}, 688.848),
    ],
)
def test_answers_are_the_known_ones(paper: Mission, state: dict[str, Any], hover_s: float) -> None:
    """Those that the publication's parameters give, printed and in the picture of the wells."""
    found = answers(paper, state)
    assert found["verdict"]["text"].startswith(f"{hover_s:.2f} s of hover")
    stays = [e for e in found["wells"]["phases"] if e["kind"] == "hover"]
    assert sum(e["end_s"] - e["start_s"] for e in stays) == pytest.approx(hover_s, abs=1e-3)
    assert found["plane"]["best"][1] == pytest.approx(hover_s, abs=1e-3)


def test_curves_are_where_the_limits_are(by_battery: dict[str, Any]) -> None:
    """Deadline and charge meet at the optimum; the deadline is a straight line through it."""
    hover_s, rest_s = times(by_battery)
    found = fields(by_battery)
    deadline = found["deadline"]
    spare_s = HOVER_S + REST_S - hover_s - rest_s
    assert (np.sign(deadline) == np.sign(spare_s))[np.abs(spare_s) > 1.0].all()
    # Linear: where one falls to 0 follows from any two samples along Δ.
    charge = found["charge left"].astype(float)
    across = int(np.abs(rest_s - REST_S).argmin())
    column, upward = charge[:, across], hover_s[:, 0]
    zero_s = np.interp(0.0, column[::-1], upward[::-1])
    gained_s = (rest_s[0, across] - REST_S) * SECONDS
    assert zero_s - gained_s == pytest.approx(HOVER_S, abs=0.2)


def test_the_grid_is_feasible_below_all_curves(by_battery: dict[str, Any]) -> None:
    """Its points are judged one by one, apart from the curves."""
    grid, best = by_battery["plane"]["grid"], by_battery["plane"]["best"]
    y, x = np.meshgrid(grid["hover_s"], grid["rest_s"], indexing="ij")
    below = (x + y <= HOVER_S + REST_S) & (y <= HOVER_S + (x - REST_S) * SECONDS)
    assert (np.array(grid["feasible"]) == below).all()
    assert below.any()
    assert not below.all()
    assert best == pytest.approx((REST_S, HOVER_S), abs=1e-3)


def test_wells_are_those_of_the_known_plan(by_battery: dict[str, Any]) -> None:
    """The plan of the perspective battery takes what is not there: −13 % of B at its end."""
    wells = by_battery["wells"]
    available = np.subtract(wells["total_Ah"], wells["bound_Ah"])
    assert 3600.0 * available[0] == pytest.approx(0.8 * CAPACITY_As)
    assert 3600.0 * available[-1] / CAPACITY_As == pytest.approx(-0.13, abs=0.005)
    assert 3600.0 * wells["total_Ah"][-1] == pytest.approx(0.05 * CAPACITY_As, rel=1e-4)
    assert 0.0 < wells["overfull_s"] < wells["dry_s"] < wells["time_s"][-1]
    assert not by_battery["verdict"]["good"]


def test_limits_have_words_roles_and_symbols(paper: Mission, by_battery: dict[str, Any]) -> None:
    """Those of a person: no label of a constraint, and for a well when it is empty."""
    said = [(e["role"], e["words"]) for e in by_battery["plane"]["limits"] if e["words"]]
    assert said == [("charge", "charge left: 5 %"), ("deadline", "deadline: 1200 s")]
    found = answers(paper, {})["plane"]["limits"]
    assert [(e["role"], e["short"]) for e in found if e["words"]] == [
        ("dry", "empty at b10"),
        ("overfull", "too full after the rest"),
        ("dry", "empty at the end"),
        ("deadline", "deadline"),
    ]
    assert {e["symbol"] for e in found} == {"y₁ ≥ 0", "y₁ ≤ ωB", "Δ + T′ ≤ T_max − T_fl"}


@pytest.mark.parametrize(
    ("state", "words"),
    [
        ({}, "597.27 s of hover; ✓ flies"),
        (BATTERY, "719.54 s of hover promised; ✕ falls at 1095 s: the available well is empty"),
        (
            {"perspective": "energy"},
            "559.34 s of hover promised; ✕ overfills at 157 s: the available well is full and "
            "accepts less than the plan assumes",
        ),
        (
            {"changes": {"limits.deadline_s": 60.0}},
            "✕ no plan: the deadline is shorter than the flight",
        ),
        (
            {"changes": {"battery.capacity_As": 3000.0}},
            "✕ no plan: the battery is too small even for the flight",
        ),
        (
            {"changes": {"link.device_m": [1000, 3000, 900]}},
            "✕ no plan: the device is out of reach: its link covers 501.484 m, but hovering at "
            "the lowest altitude of 50 m means 850 m at least",
        ),
    ],
)
def test_the_verdict_has_its_reason(paper: Mission, state: dict[str, Any], words: str) -> None:
    """In one sentence without a symbol or a key: it flies, falls, overfills, or there is none."""
    assert answers(paper, state)["verdict"]["text"] == words


@pytest.mark.parametrize(
    ("state", "words"),
    [
        ({}, "The available well binds, the deadline does not."),
        (BATTERY, "Charge and deadline bind."),
        ({**BATTERY, "problem": "P3"}, "Charge binds, the deadline does not."),
        ({"problem": "P2"}, "Neither charge nor the deadline binds."),
        (
            {"changes": {"limits.deadline_s": 300.0}},
            "The deadline binds, charge does not.",
        ),
    ],
)
def test_what_binds_is_said_in_words(paper: Mission, state: dict[str, Any], words: str) -> None:
    assert answers(paper, state)["verdict"]["binds"] == words


@pytest.mark.parametrize(
    ("state", "key"),
    [
        ({}, "limits.deadline_s"),
        ({}, "limits.min_soc"),
        (BATTERY, "laser.power_W"),
        ({**BATTERY, "changes": {"laser.power_W": 500}}, "battery.charge_current_A"),
    ],
)
def test_where_a_control_changes_nothing_the_answer_is_the_same(
    paper: Mission, state: dict[str, Any], key: str
) -> None:
    """Solved again at both ends of the stretch that the page hatches, and at its middle."""
    found = answers(paper, state)
    (control,) = (each for each in found["controls"] if each["key"] == key)
    idle = control["idle"]
    high = control["high"] if idle["high"] is None else idle["high"]
    for value in np.linspace(idle["low"], high, 3).tolist():
        changes = {**state.get("changes", {}), key: value * (1.0 + 1e-9) if value < high else value}
        again = answers(paper, {**state, "changes": changes})["verdict"]
        assert again["hover_s"] == pytest.approx(found["verdict"]["hover_s"], abs=1e-3), value


def test_axes_are_round_and_stay_where_they_are_asked_to(paper: Mission) -> None:
    """At whole steps of 1, 2 or 5; stated ends hold whatever the deadline."""
    found = answers(paper, {})
    assert (found["plane"]["rest_s"][1], found["plane"]["hover_s"][1]) == (1200.0, 1200.0)
    assert (found["wells"]["axes"], found["map"]["window"]) == (
        [1200.0, 25.0],
        [[0.0, 0.0], [2000.0, 3500.0]],
    )
    held = answers(paper, {"axes": [900, 1500], "changes": {"limits.deadline_s": 220}})["plane"]
    assert (held["rest_s"][1], held["hover_s"][1]) == (900.0, 1500.0)
    assert held["round_s"][1] < 400.0
    for axes in ([1], [1, 2, 3], [0, 1], "ab", [1, "2"], {"a": 1}, [1, 1e300]):
        assert [e["key"] for e in answers(paper, {"axes": axes})["faults"]] == ["axes"], axes


@pytest.mark.parametrize("name", ["paper", "paper-table2", "matrice350"])
def test_presets_are_answered(name: str) -> None:
    """Each as a state that the page may start from, which shows what it promises."""
    mission = optuav.load(name)
    known = {e["short"]: answers(mission, e["state"]) for e in answers(mission, {})["presets"]}
    assert not any("faults" in each for each in known.values())
    assert next(iter(known)) == "Mission"
    falls = name != "matrice350"
    assert (optuav.solve(mission, perspective="battery").runs_dry_s is not None) == falls
    assert ("Fall" in known) == falls
    if falls:
        assert known["Fall"]["verdict"]["event"].startswith("falls at ")
    assert not known["Small battery"]["verdict"]["promise"]
    if name == "paper":
        assert known["Fall"]["verdict"]["event"] == "falls at 1095 s"
        assert known["Kink"]["plane"]["best"][0] == pytest.approx(0.0, abs=0.05)
        assert known["Kink"]["plane"]["rests"]
        # Both limits that meet there are drawn, and a gain of nothing is not told
        roles = [each["role"] for each in known["Kink"]["plane"]["limits"]]
        assert {"charge", "deadline"} <= {*roles}
        assert " 0.00 s" not in known["Kink"]["verdict"]["worth"]
        assert known["Laser"]["verdict"]["hover_s"] < known["Fall"]["verdict"]["hover_s"]


def test_the_map_shows_the_reach_of_the_link(paper: Mission) -> None:
    found = answers(paper, {})["map"]
    (hover,), (device,) = found["hovers"], found["devices"]
    assert hover["name"] == device["place"] == "hover"
    assert hover["at"] == pytest.approx((1000.0, 2501.0152, 50.0), abs=1e-3)
    assert (device["name"], device["key"]) == ("device", "link.device_m")
    rim = np.subtract(device["rim"], device["at"][:2])
    assert np.hypot(*rim.T) == pytest.approx(math.sqrt(501.4836**2 - 50.0**2), abs=1e-2)
    assert found["route"][0] == [0.0, 0.0, 50.0]
    assert {e["name"] for e in found["buildings"] if e["lit"]} == {f"b{k}" for k in range(1, 11)}


def test_several_devices_are_shown_and_moved_one_by_one() -> None:
    """Each has its key and its rim; hover points and the best plan are those of the spec."""
    found = answers(three(), {})
    points_m = {"west": (496.2356, 2110.3833), "north": (1000.0, 2501.0152)}
    points_m["east"] = (1582.3933, 1915.0727)
    assert {e["name"] for e in found["map"]["hovers"]} == {*points_m}
    for hover in found["map"]["hovers"]:
        assert hover["at"][:2] == pytest.approx(points_m[hover["name"]], abs=1e-3)
    for device in found["map"]["devices"]:
        assert device["key"] == f"devices.{device['name']}.position_m"
        assert device["place"] == device["name"]
        rim = np.subtract(device["rim"], device["at"][:2])
        assert np.hypot(*rim.T) == pytest.approx(math.sqrt(501.4836**2 - 50.0**2), abs=1e-2)
    assert found["verdict"]["hover_s"] == pytest.approx(647.331326, abs=1e-5)
    words = "Hover over east and north, then rest 1016.5 s at b9, then hover over west."
    assert found["verdict"]["route"] == words
    assert found["verdict"]["binds"] == "Deadline and available well bind."
    moved = answers(three(), {"changes": {"devices.west.position_m": [500, 2500, 0]}})
    apart = optuav.solve(three().replace({"devices.west.position_m": [500, 2500, 0]}))
    assert moved["verdict"]["hover_s"] == pytest.approx(apart.hover_time_s)


def test_options_are_those_of_the_devices(paper: Mission) -> None:
    """A rest between needs several devices, and the paper's two routes need one."""
    several, one = answers(three(), {})["options"], answers(paper, {})["options"]
    assert "between" in several["order"]
    assert "between" not in one["order"]
    assert {*one["trajectory"]} - {*several["trajectory"]} == {"traj1", "traj2"}
    (fault,) = answers(paper, {"order": "between"})["faults"]
    assert fault["words"].startswith("order = 'between': must be one of rest-first, hover-first")
    for key in ("link.device_m", "devices.nord.position_m"):
        (fault,) = answers(three(), {"changes": {key: [0, 0, 0]}})["faults"]
        assert fault["key"] == key


def test_presets_over_several_devices_have_answers() -> None:
    for preset in answers(three(), {})["presets"]:
        assert not answers(three(), preset["state"]).get("faults")


def test_too_many_devices_are_flown_over_in_the_order_of_the_file() -> None:
    """As their orders cannot all be compared; no state of the page names one."""
    found = answers(eight(), {})
    assert found["verdict"]["hover_s"] == pytest.approx(plan_over_eight().hover_time_s)
    flown = [name for name in found["plane"]["route"] if name in EIGHT]
    assert flown == [*EIGHT]


def test_words_of_trips_and_of_what_changes_nothing(paper: Mission) -> None:
    """A trip has its time, not 0 s of hover; no rest of 0.0 s; sentences, not heads of tables."""
    trip = answers(paper, {"problem": "P2"})
    assert trip["verdict"]["promise"] == "75.79 s of travel"  # Of the direct flight alone
    still = {e["key"]: e["idle"]["words"] for e in answers(paper, {})["controls"] if e["idle"]}
    assert still["limits.deadline_s"] == "the plan ends then"
    kink = next(e for e in answers(paper, {})["presets"] if e["short"] == "Kink")["state"]
    assert "0.0 s" not in answers(paper, kink)["verdict"]["route"]


def test_controls_of_a_rotary_wing_move_its_own_wind() -> None:
    """Its wind is a velocity; the force of other flight models stays 0."""
    state = {"changes": {"wind.velocity_m_s": [3.0, -2.0, 0.0]}}
    found = answers(WINGED, state)["controls"]
    winds = [each for each in found if each["key"].startswith("wind")]
    assert [(each["key"], each["value"]) for each in winds] == [
        ("wind.velocity_m_s", 3.0),
        ("wind.velocity_m_s", -2.0),
    ]
    assert all(each["whole"] == [3.0, -2.0, 0.0] for each in winds)


def test_without_a_plan_the_flight_is_shown_on_which_the_well_dries(paper: Mission) -> None:
    """The moment is that of the judge; and of a flight that is only late, by how much."""
    small = paper.replace({"battery.capacity_As": 1800.0})
    found = answers(paper, {"changes": {"battery.capacity_As": 1800.0}})
    judged = optuav.replay(optuav.Itinerary(small, optuav.Stop("hover", "hover", 0.0)))
    assert found["verdict"]["event"] == "no plan"
    assert found["wells"]["dry_s"] == pytest.approx(judged.first_s("empty"))
    assert found["wells"]["event"] == f"falls at {judged.first_s('empty'):.0f} s"
    assert found["wells"]["alone"]
    assert len(found["map"]["route"]) == 3
    late = answers(paper, {"changes": {"limits.deadline_s": 60.0}})["wells"]
    assert late["spare_s"] == pytest.approx(60.0 - judged.mission_time_s)
    assert late["dry_s"] is None
    assert not answers(paper, {})["wells"]["alone"]
    walled = {"changes": {"link.device_m": [1000, 9000, 0]}}  # No route can be flown
    assert answers(paper, walled)["wells"] is None


@pytest.mark.parametrize(
    ("name", "key", "unit", "seen"),
    [
        ("paper", "battery.capacity_As", "Ah", 10.0),  # 36 000 A s
        ("relay-today", "laser.jitter_rad", "µrad", 10.0),
        ("paper", "limits.min_soc", "%", 5.0),
        ("paper", "limits.deadline_s", "s", 1200.0),
    ],
)
def test_units_are_those_that_a_person_reads(name: str, key: str, unit: str, seen: float) -> None:
    """With round steps in them; what a change states stays in the unit of its key."""
    mission = optuav.load(name)
    (control,) = (each for each in answers(mission, {})["controls"] if each["key"] == key)
    assert control["unit"] == unit
    assert control["value"] / control["scale"] == pytest.approx(seen)
    step = f"{control['step'] / control['scale']:.9e}"
    assert float(step.partition("e")[0]) in (1.0, 2.0, 5.0)
    moved = answers(mission, {"changes": {key: control["low"] + 20 * control["step"]}})
    (after,) = (each for each in moved["controls"] if each["key"] == key)
    assert after["value"] == control["low"] + 20 * control["step"]


def test_a_faulty_state_is_refused_with_all_that_is_wrong(paper: Mission) -> None:
    """By key, so that the page can mark its field; and never with an exception."""
    changes = {"limits.min_soc": 2, "limits.deadline_s": "x", "route.origin_m": [0, 0, 0]}
    found = answers(paper, {"changes": changes, "number": 7})
    assert {e["key"] for e in found["faults"]} == changes.keys()
    assert found["number"] == 7
    for state in (
        *(None, [], {"changes": 3}, {"perspective": "none"}, {"perspective": ["battery"]}),
        *({"building": "b99"}, {"building": 3}, {"other": 1}, {"number": "x"}),
        *({"trajectory": "direct", "order": "rest-first"}, {"problem": "P3", "order": "x"}),
        {"changes": {"link.device_m": [0, 0]}},
        {"changes": {"link.device_m": None}},
        {"changes": {"buildings.b1.position_m": "here"}},
        {"changes": {"buildings.b11.position_m": [0, 0, 0]}},
        {"changes": {"buildings_file": "/etc/passwd"}},
    ):
        assert [*answers(paper, state)] == ["number", "faults"], state


def test_without_a_plan_reasons_stand_and_repairs_when_asked(
    paper: Mission, monkeypatch: pytest.MonkeyPatch
) -> None:
    """To seek repairs takes a second: it is left to a click."""
    only(monkeypatch, "limits")
    late = {"changes": {"limits.deadline_s": 60.0}, "problem": "P3"}
    found = answers(paper, late)
    assert found["verdict"]["event"] == "no plan"
    reasons, _ = found["tables"]
    assert "75.79 s, longer than the deadline of 60 s" in reasons["lines"][0]
    assert (found["repairable"], found["plane"]["best"]) == (True, None)
    assert [max(e["excess"]) < 0 for e in found["plane"]["limits"]] == [True]
    repaired = answers(paper, {**late, "repairs": True})
    assert ("deadline ≥ 75.8 s", "now 60 s") in repaired["tables"][0]["rows"]
    assert not repaired["repairable"]


def test_repairs_are_in_the_words_and_units_of_the_sliders(
    paper: Mission, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The slider of the capacity has ampere-hours, its key ampere-seconds; no key stands anywhere.

    Such a change is rounded to where a plan is possible.
    """
    only(monkeypatch, "battery")
    small = {"changes": {"battery.capacity_As": 1800.0}, "repairs": True, "picture": "day"}
    found = answers(paper, small)
    repairs, reasons, *_ = found["tables"]
    (capacity, now), *others = repairs["rows"]
    assert (capacity, now) == ("capacity of a pack ≥ 1.07 Ah", "now 0.5 Ah")
    assert ("number of packs ≥ 5", "now 2") in others
    enough = {"changes": {"battery.capacity_As": 3600.0 * 1.07}}
    assert answers(paper, enough)["verdict"]["good"]
    assert reasons["lines"][0].startswith("charge left: −117.86 % ≥ 5 % does not hold at ")
    assert "capacity of a pack: 0.5 Ah, charge left: 5 %" in found["picture"]["words"]


def test_every_answer_is_json(paper: Mission) -> None:
    """Without NaN, whatever is missing: laser, reach, buildings, rotors, room for a grid."""
    for mission, state in (
        (paper.replace({"laser": None}), {}),
        (paper.replace({"link.device_m": [1000, 3000, 900]}), {}),
        (paper.replace({"buildings": []}), {"perspective": "energy"}),
        (optuav.load("paper-table2"), {"problem": "P2", **BATTERY}),
        (paper.replace({"limits.slot_s": 0.001, "limits.deadline_s": 1e7}), BATTERY),
        (paper, {"changes": {"wind.force_N": [0, 0, -20]}}),
    ):
        assert "faults" not in json.loads(json.dumps(answers(mission, state), allow_nan=False))


def test_without_a_laser_nothing_of_it_is_to_be_set(paper: Mission) -> None:
    dark = paper.replace({"laser": None})
    keys = {each["key"] for each in answers(dark, {})["controls"]}
    assert keys == {"limits.deadline_s", "limits.min_soc", "battery.capacity_As", "wind.force_N"}
    moved = answers(dark, {"changes": {"laser.position_m": [0, 0, 0]}})
    assert [each["key"] for each in moved["faults"]] == ["laser.position_m"]


def test_a_roof_takes_its_walls_along(paper: Mission) -> None:
    """Also where they are a polygon on the map, which has to hold the roof's place."""
    corners = [[40, 290], [60, 290], [50, 320]]
    walled = paper.replace({"buildings.b1.footprint_m": corners})
    found = answers(walled, {"changes": {"buildings.b1.position_m": [150, 280, 60]}})
    (ring,) = [e["ring"] for e in found["map"]["buildings"] if e["name"] == "b1"]
    assert ring == [[140.0, 270.0], [160.0, 270.0], [150.0, 300.0]]


def test_files_hold_what_is_shown(paper: Mission, tmp_path: Path) -> None:
    state = {"changes": {"limits.deadline_s": 900.0, "laser.position_m": [900, 0, 50]}, **BATTERY}
    mission, plan = (
        answers(paper, {**state, "file": name})["file"] for name in ("mission", "plan")
    )
    assert (mission["name"], plan["name"]) == ("paper.toml", "paper.json")
    changed = paper.replace(state["changes"])
    assert Mission.from_dict(tomllib.loads(mission["text"])) == changed
    (tmp_path / "plan.json").write_text(plan["text"], "utf-8")
    assert optuav.load_plan(tmp_path / "plan.json").mission == changed


def test_figures_have_no_rounding_errors(paper: Mission) -> None:
    """A well that is empty at the end of a flight is at 0, not at −4e−13."""
    limits, *_ = answers(paper, {})["tables"]
    assert [row[3] for row in limits["rows"] if row[-1] == "binds"] == ["0 % ≥ 0 %"] * 2


def test_no_warning_comes_from_far_off_the_plane(paper: Mission) -> None:
    """Wells that level out within seconds have exponentials that overflow there."""
    quick = paper.replace({"battery.flow_rate_per_s": 1.0})
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert "faults" not in answers(quick, {})


def test_names_of_files_are_no_paths(paper: Mission) -> None:
    named = paper.replace({"name": "../<b>/x"})
    assert answers(named, {"file": "plan"})["file"]["name"] == "b-x.json"


def test_sliders_reach_as_far_as_their_keys_allow(paper: Mission) -> None:
    """Both ends of every slider are values that the mission takes."""
    for control in answers(paper, {})["controls"]:
        for value in (control["low"], control["high"]):
            stated = value
            if control["whole"]:
                stated = [*control["whole"]]
                stated[control["axis"]] = value
            assert "faults" not in answers(paper, {"changes": {control["key"]: stated}, **BATTERY})


def test_more_buildings_than_a_page_draws_are_refused(paper: Mission) -> None:
    count = MOST_BUILDINGS + 1
    columns = {"name": [f"r{k}" for k in range(count)], "x_m": range(count)}
    town = paper.with_buildings({**columns, "y_m": [9e3] * count, "z_m": [9.0] * count})
    with pytest.raises(InputError, match="at most 2000"):
        refuse_many(town)


def test_a_switch_says_where_the_charge_must_stay() -> None:
    """It stands beside the slider of η0, and its state is a change of the mission."""
    relay = optuav.load("relay-today")
    kept, low = (
        answers(relay, {"changes": {"limits.keep_soc": each}}) for each in ("always", "end")
    )
    for found, always in ((kept, True), (low, False)):
        switches = {each["key"]: each["always"] for each in found["controls"]}
        assert switches.pop("limits.min_soc") is always
        assert set(switches.values()) == {None}
        assert found["wells"]["always"] is always
    assert kept["wells"]["low"] == []
    begin_s, end_s = kept["wells"]["holds_s"]
    assert (begin_s, end_s) == (0.0, pytest.approx(kept["wells"]["phases"][-1]["end_s"]))
    begin_s, end_s = low["wells"]["holds_s"]
    assert begin_s == pytest.approx(0.94 * end_s)
    (landing,) = low["wells"]["low"]
    assert landing["words"] == "below the reserve on the roof; allowed by keep_soc = end"
    assert 3600.0 * landing["charge_Ah"] == pytest.approx(2027.1, abs=0.1)
    assert answers(relay, {"changes": {"limits.keep_soc": "roof"}})["faults"]
