"""Values of a mission: what is allowed, and that whatever else is refused, all at once."""

from __future__ import annotations

import copy
import math
import pickle
from pathlib import Path
from typing import Any, get_args

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

import optuav.mission
from optuav.errors import InputError
from optuav.flight.regimes import RegimeFlight
from optuav.laser.fits import Laser
from optuav.mission import Mission, load
from optuav.mission.validation import MOST_TURNS
from optuav.options import Charging
from optuav.physics import kibam
from optuav.tables import BatteryPacks, Building, RouteEnds
from tests.examples import few
from tests.mission.strategies import documents, missions

NOT_NUMBERS = [math.nan, math.inf, -math.inf, "1", True, [1], {}, 10**400, b"1", 1j]
REGIMES = {
    "model": "regimes",
    "acceleration_m_s2": 5,
    "flight_current_A": 90,
    "flight_power_W": 1400,
    "hover_current_A": 70,
    "hover_power_W": 1000,
}

POSITIVE = [
    "limits.deadline_s",
    "limits.slot_s",
    "limits.outage_probability",
    "battery.packs",
    "battery.capacity_As",
    "battery.nominal_voltage_V",
    "battery.available_fraction",
    "rotor.max_speed_rad_s",
    "rotor.lift_coefficient_N_s2_rad2",
    "rotor.drag_coefficient_Nm_s2_rad2",
    "rotor.velocity_constant_rpm_V",
    "body.mass_kg",
    "body.gravity_m_s2",
    "body.arm_length_m",
    "body.inertia_x_kg_m2",
    "laser.wavelength_nm",
    "laser.emitter_slope",
    "link.noise_power_W",
    "link.transmit_power_W",
    "link.transmit_voltage_V",
    "link.path_loss_exponent",
]
"""Keys for which zero is meaningless."""

NOT_NEGATIVE = [
    "limits.min_soc",
    "limits.min_altitude_m",
    "battery.flow_rate_per_s",
    "battery.charge_current_A",
    "rotor.friction_torque_Nm",
    "rotor.viscous_damping_Nm_s_rad",
    "rotor.resistance_ohm",
    "rotor.inertia_kg_m2",
    "laser.power_W",
    "laser.attenuation_per_km",
    "link.rice_factor",
]
"""Keys for which zero is a value like another."""

ANY_SIGN = ["laser.emitter_offset_W", "laser.receiver_offset_W", "link.snr_threshold_dB"]

LARGEST = [
    ("limits.deadline_s", 1e7),
    ("battery.capacity_As", 1e9),
    ("battery.packs", 1000),
    ("link.rice_factor", 1e4),
    ("body.mass_kg", 1e6),
]


@pytest.fixture
def document() -> dict[str, Any]:
    """A sound mission as plain data, to spoil."""
    return load("paper").to_dict()


def spoilt(document: dict[str, Any], changes: dict[str, object]) -> dict[str, Any]:
    """The document with other values by table and key; None removes the key."""
    changed = copy.deepcopy(document)
    for dotted, value in changes.items():
        table, _, key = dotted.rpartition(".")
        place = changed.setdefault(table, {}) if table else changed
        if value is None:
            del place[key]
        else:
            place[key] = value
    return changed


def faults(document: object) -> dict[str, str]:
    """What is said to be allowed, by key."""
    with pytest.raises(InputError) as caught:
        Mission.from_dict(document)  # type: ignore[arg-type]
    assert len({fault.key for fault in caught.value.faults}) == len(caught.value.faults)
    return {fault.key: fault.allowed for fault in caught.value.faults}


def mission_or_error(document: dict[str, Any]) -> Mission | InputError:
    """What `from_dict` makes of a document."""
    try:
        return Mission.from_dict(document)
    except InputError as error:
        return error


def accepted(document: dict[str, Any], changes: dict[str, object]) -> Mission:
    return Mission.from_dict(spoilt(document, changes))


# Single values


@pytest.mark.parametrize("key", POSITIVE + NOT_NEGATIVE + ANY_SIGN)
def test_what_is_no_number_is_refused(document: dict[str, Any], key: str) -> None:
    """No coercion: neither strings nor truth values, nor what is not finite."""
    for value in NOT_NUMBERS:
        assert faults(spoilt(document, {key: value})).keys() == {key}


@pytest.mark.parametrize("key", POSITIVE)
def test_zero_is_refused_where_it_is_meaningless(document: dict[str, Any], key: str) -> None:
    for value in (0, 0.0, -1, -1e-300):
        assert faults(spoilt(document, {key: value})).keys() == {key}


@pytest.mark.parametrize("key", NOT_NEGATIVE)
def test_zero_is_accepted_where_it_is_a_value(document: dict[str, Any], key: str) -> None:
    table, _, name = key.partition(".")
    assert getattr(getattr(accepted(document, {key: 0}), table), name) == 0.0
    assert faults(spoilt(document, {key: -1e-12})).keys() == {key}


@pytest.mark.parametrize("key", ANY_SIGN)
def test_either_sign_is_accepted(document: dict[str, Any], key: str) -> None:
    for value in (-3, 0, 3):
        accepted(document, {key: value})


@pytest.mark.parametrize(("key", "largest"), LARGEST)
def test_ranges_are_finite(document: dict[str, Any], key: str, largest: float) -> None:
    """Nothing may be so large that powers of it overflow."""
    accepted(document, {key: largest})
    assert faults(spoilt(document, {key: largest * 1.01})).keys() == {key}
    assert faults(spoilt(document, {key: 1e300})).keys() == {key}


@pytest.mark.parametrize(
    ("key", "words"),
    [
        ("limits.min_soc", "a number, 0 <= x < 1 [-]"),
        ("limits.deadline_s", "a number, 0 < x <= 1e7 [s]"),
        ("limits.outage_probability", "a number, 1e-12 <= x < 1 [-]"),
        ("battery.packs", "a whole number, 1 <= x <= 1000 [-]"),
        ("battery.flow_rate_per_s", "a number, 0 <= x <= 1000 [1/s]; or set flow_rate_per_min"),
        ("link.snr_threshold_dB", "a number, |x| <= 200 [dB]"),
        ("route.origin_m", "three numbers [x, y, z], each |x| <= 1e6 [m]"),
    ],
)
def test_words_of_a_range(document: dict[str, Any], key: str, words: str) -> None:
    """Range and unit; a key that is missing says what it would have to be."""
    assert faults(spoilt(document, {key: "x"})) == {key: words}
    assert faults(spoilt(document, {key: None})) == {key: f"is missing; {words}"}


def test_shares_stay_below_one(document: dict[str, Any]) -> None:
    """A full battery at the end, a well that has it all, an outage that is certain."""
    for key in ("min_soc", "outage_probability"):
        assert faults(spoilt(document, {f"limits.{key}": 1})).keys() == {f"limits.{key}"}
    assert faults(spoilt(document, {"battery.available_fraction": 1})).keys() == {
        "battery.available_fraction"
    }


def test_whole_numbers_are_fine_as_numbers(document: dict[str, Any]) -> None:
    """And become floats, so that equal missions are equal; a number of packs stays whole."""
    mission = accepted(document, {"limits.deadline_s": 900, "route.origin_m": [1, 2, 3]})
    assert repr(mission.limits.deadline_s) == "900.0"
    assert repr(mission.route.origin_m) == "(1.0, 2.0, 3.0)"
    assert repr(mission.battery.packs) == "2"
    assert faults(spoilt(document, {"battery.packs": 2.0})).keys() == {"battery.packs"}


@pytest.mark.parametrize(
    "position", [[1, 2], [1, 2, 3, 4], [1, 2, "3"], [1, 2, True], [1, 2, None], "123", {1, 2, 3}]
)
def test_a_position_has_three_numbers(document: dict[str, Any], position: object) -> None:
    """Whatever of them is wrong, it is one fault of the position; a set has no order."""
    assert faults(spoilt(document, {"link.device_m": position})).keys() == {"link.device_m"}


# Several values


def test_the_altitude_band_is_ordered(document: dict[str, Any]) -> None:
    """A band may be a single height, but not upside down."""
    accepted(document, {"limits.min_altitude_m": 100})
    assert faults(spoilt(document, {"limits.min_altitude_m": 100.1})) == {
        "limits.max_altitude_m": "a number, x >= min_altitude_m = 100.1 [m]"
    }


def test_one_flow_rate(document: dict[str, Any]) -> None:
    """Per second or per minute; the mission has it per second."""
    none = spoilt(document, {"battery.flow_rate_per_s": None})
    mission = accepted(none, {"battery.flow_rate_per_min": 0.3})
    assert mission.battery.flow_rate_per_s == 0.005
    words = "a number, 0 <= x <= 60000 [1/min]"
    for value in (-1, "1", math.nan, 6e4 + 1, True):
        assert faults(spoilt(none, {"battery.flow_rate_per_min": value})) == {
            "battery.flow_rate_per_min": words
        }
    both = faults(spoilt(document, {"battery.flow_rate_per_min": 0.3}))
    assert both == {"battery.flow_rate_per_min": "either flow_rate_per_s or flow_rate_per_min"}


def test_one_attenuation(document: dict[str, Any]) -> None:
    """The number itself or the visibility that it follows from."""
    none = spoilt(document, {"laser.attenuation_per_km": None})
    assert faults(none) == {
        "laser.attenuation_per_km": "is missing; a number, 0 <= x <= 10000 [1/km]; "
        "or set visibility_km"
    }
    assert accepted(none, {"laser.visibility_km": 3}).laser is not None
    assert faults(spoilt(document, {"laser.visibility_km": 3})) == {
        "laser.visibility_km": "either visibility_km or attenuation_per_km, not both"
    }


@pytest.mark.parametrize(
    ("wavelength_nm", "coefficients"),
    [(810, (0.445, -0.75, 0.5414, -0.2313)), (1550.0, (0.34, -1.1, 0.5434, -0.2761))],
)
def test_coefficients_follow_from_a_known_wavelength(
    document: dict[str, Any], wavelength_nm: float, coefficients: tuple[float, ...]
) -> None:
    """All four or none are stated; at another wavelength all four."""
    names = ["emitter_slope", "emitter_offset_W", "receiver_slope", "receiver_offset_W"]
    keys = [f"laser.{name}" for name in names]
    none = spoilt(document, dict.fromkeys(keys, None) | {"laser.wavelength_nm": wavelength_nm})
    laser = Mission.from_dict(none).laser
    assert laser is not None
    assert tuple(getattr(laser, name) for name in names) == coefficients
    assert faults(spoilt(none, {keys[0]: 0.5})).keys() == set(keys[1:])
    assert faults(spoilt(none, {"laser.wavelength_nm": 900})).keys() == set(keys)


def test_rotors_need_rotor_and_body(document: dict[str, Any]) -> None:
    """Unless the loads are stated by regime; then both may be there and are not used."""
    bare = {key: value for key, value in document.items() if key not in ("rotor", "body")}
    assert faults(bare).keys() == {"rotor", "body"}
    regimes = Mission.from_dict(bare | {"flight": REGIMES})
    assert regimes.rotor is None
    assert Mission.from_dict(document | {"flight": REGIMES}).body is not None


def test_regimes_need_their_loads(document: dict[str, Any]) -> None:
    for key in REGIMES.keys() - {"model"}:
        flight = {name: value for name, value in REGIMES.items() if name != key}
        assert faults(document | {"flight": flight}).keys() == {f"flight.{key}"}


def test_loads_by_regime_are_refused_with_rotors(document: dict[str, Any]) -> None:
    """A load that would be ignored is a mistake, with the model stated or by default."""
    for model in ({"model": "rotors"}, {}):
        flight = {**REGIMES, **model} if model else {"acceleration_m_s2": 5}
        expected = {f"flight.{key}" for key in flight.keys() - {"model"}}
        found = faults(document | {"flight": flight})
        assert found.keys() == expected
        assert all(
            words.startswith('only with flight.model = "regimes"') for words in found.values()
        )


def test_a_misspelt_model_is_judged_by_its_keys(document: dict[str, Any]) -> None:
    """The keys that go with the model that was meant are no faults of their own."""
    found = faults(document | {"flight": {**REGIMES, "model": "regime"}})
    words = '"rotors" or "regimes" or "rotary-wing", or one that is registered first'
    assert found == {"flight.model": words}
    assert faults(document | {"flight": {"model": "rotor"}}) == found


def test_charging_by_regime_needs_both_and_a_laser(document: dict[str, Any]) -> None:
    """Current and power go together, and light comes from somewhere."""
    for key, other in (("current_A", "power_W"), ("power_W", "current_A")):
        flight = {**REGIMES, f"charge_{key}": 5}
        assert faults(document | {"flight": flight}).keys() == {f"flight.charge_{other}"}
    flight = {**REGIMES, "charge_current_A": 5, "charge_power_W": 60}
    assert Mission.from_dict(document | {"flight": flight})
    dark = {key: value for key, value in document.items() if key != "laser"}
    assert faults(dark | {"flight": flight}).keys() == {"laser"}
    assert Mission.from_dict(dark | {"flight": REGIMES}).laser is None


def test_wind_has_no_meaning_for_regimes(document: dict[str, Any]) -> None:
    """It is refused, not ignored; calm is fine."""
    assert Mission.from_dict(document | {"flight": REGIMES, "wind": {"force_N": [0, 0, 0]}})
    windy = document | {"flight": REGIMES, "wind": {"force_N": [0, 0, -1]}}
    assert faults(windy) == {"wind.force_N": '[0, 0, 0] with flight.model = "regimes"'}


# Buildings


def with_buildings(document: dict[str, Any], *buildings: dict[str, Any]) -> dict[str, Any]:
    return document | {"buildings": list(buildings)}


def building(name: str = "b", **other: object) -> dict[str, Any]:
    return {"name": name, "position_m": [0, 0, 10]} | other


def test_names_of_buildings(document: dict[str, Any]) -> None:
    """Each its own, none that of a place of the route; told by number where the name fails."""
    names = ["b", "origin", "c", "b", "hover", "destination", "", "Origin", "b"]
    found = faults(with_buildings(document, *(building(name) for name in names)))
    assert found.keys() == {f"buildings[{place}].name" for place in (3, 6, 8)} | {
        "buildings.origin.name",
        "buildings.hover.name",
        "buildings.destination.name",
    }
    assert found["buildings[8].name"] == "a name of its own; buildings[0] has this one"
    listed = with_buildings(document, building() | {"name": ["b"]}, building("b"))
    assert faults(listed).keys() == {"buildings[0].name"}


def test_a_building_stands_on_the_ground(document: dict[str, Any]) -> None:
    """Its roof is not below z = 0; ends of the route and the device may be, in a valley."""
    accepted(document, {"link.device_m": [0, 0, -5]})
    found = faults(with_buildings(document, building(position_m=[0, 0, -1])))
    assert found.keys() == {"buildings.b.position_m"}


@pytest.mark.parametrize(
    "footprint",
    [
        [4, 0.5],
        [[-1, -1], [1, -1], [0, 1]],
        [[-1, -1], [1, -1], [0, 1], [-1, -1]],
        [[0, 1], [1, -1], [-1, -1]],
        [[0, 0], [1, 0], [1, 1]],
        [[0, 0], [0, 0], [2, 0], [2, 2]],
        [[-1, -1], [3, -1], [3, 3], [2, 3], [2, 0.5], [-1, 0.5]],
    ],
    ids=str,
)
def test_footprints(document: dict[str, Any], footprint: list[Any]) -> None:
    """Sizes and polygons, closed or not, either way round, with the position at a corner."""
    mission = Mission.from_dict(with_buildings(document, building(footprint_m=footprint)))
    assert mission.to_dict()["buildings"][0]["footprint_m"] == footprint


@pytest.mark.parametrize(
    ("footprint", "words"),
    [
        ([4], "a size [x, y]"),
        ([4, 0], "a size [x, y]"),
        ([4, -4], "a size [x, y]"),
        ([4, 4, 4], "a size [x, y]"),
        ([4, math.nan], "a size [x, y]"),
        ([], "a size [x, y]"),
        ("4x4", "a size [x, y]"),
        ([[0, 0], [1, 1]], "a size [x, y]"),
        ([[0, 0], [1, 1], [1]], "a size [x, y]"),
        ([[0, 0], [1, 1], 1], "a size [x, y]"),
        ([[0, 0], [1, 1], [0, "1"]], "a size [x, y]"),
        ([[-1, -1], [1, 1], [1, -1], [-1, 1]], "a polygon with an area"),
        ([[0, 0], [1, 1], [2, 2]], "a polygon with an area"),
        ([[0, 0], [1, 1], [0, 0]], "a polygon with an area"),
        ([[0, 0], [0, 0], [0, 0]], "a polygon with an area"),
        ([[1, 1], [2, 1], [2, 2]], "a polygon that contains x and y of position_m"),
        ([[-1, -1], [1, -1], [1, 1], [0.5, 1], [0.5, -0.5], [-1, -0.5]], "a polygon that contains"),
    ],
    ids=str,
)
def test_impossible_footprints(document: dict[str, Any], footprint: Any, words: str) -> None:
    """Neither a size nor a polygon; edges that cross; no area; the UAV rests beside it."""
    found = faults(
        with_buildings(document, building("a"), building(footprint_m=footprint), building("c"))
    )
    assert found.keys() == {"buildings.b.footprint_m"}
    assert found["buildings.b.footprint_m"].startswith(words)


# All at once


SPOILT: dict[str, object] = {
    "route.origin_m": [1, 2],
    "limits.deadline_s": -1,
    "limits.min_soc": 1,
    "limits.colour": "red",
    "battery.packs": 0,
    "battery.flow_rate_per_min": 1,
    "rotor.max_speed_rad_s": "fast",
    "body.mass_kg": math.nan,
    "laser.visibility_km": 5,
    "laser.power_W": math.inf,
    "link.device_m": None,
    "link.rice_factor": True,
    "wind.force_N": [0, 0],
    "flight.model": "wings",
    "surprise": 1,
    "schema": 3,
    "name": "",
}


@given(keys=st.sets(st.sampled_from(sorted(SPOILT)), min_size=1))
def test_every_fault_is_listed(keys: set[str]) -> None:
    """Any choice of mistakes, in one table or in many, is reported in full and nothing else is."""
    document = load("paper").to_dict()
    assert faults(spoilt(document, {key: SPOILT[key] for key in keys})).keys() == keys


def test_rules_are_judged_beside_other_faults(document: dict[str, Any]) -> None:
    """What ties values together is checked even where single values are wrong."""
    changes: dict[str, object] = {
        "limits.min_altitude_m": 200,
        "limits.min_soc": 7,
        "laser.visibility_km": 5,
        "laser.power_W": -1,
    }
    wrong = spoilt(document, changes)
    wrong["buildings"] = [
        building("b"),
        building("b", position_m=[0, 0, -1]),
        building("c", footprint_m=[[0, 0], [1, 1], [2, 2]], colour="red"),
    ]
    del wrong["rotor"]
    assert faults(wrong).keys() == {
        "limits.max_altitude_m",
        "limits.min_soc",
        "laser.visibility_km",
        "laser.power_W",
        "buildings[1].name",
        "buildings[1].position_m",
        "buildings.c.footprint_m",
        "buildings.c.colour",
        "rotor",
    }


ANYTHING = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text() | st.dates() | st.binary(),
    lambda inner: (
        st.lists(inner, max_size=4) | st.dictionaries(st.text() | st.integers(), inner, max_size=4)
    ),
    max_leaves=8,
)


@pytest.mark.campaign
@few(10, most=1000)
@given(data=st.data(), document=documents(most_buildings=2))
def test_anything_in_any_place(data: st.DataObject, document: dict[str, Any]) -> None:
    """Python's data are as hostile as a file: one error in words, or a mission."""
    tables = [table for table in document.values() if isinstance(table, dict)]
    table = data.draw(st.sampled_from([document, *tables, *document["buildings"]]))
    key = data.draw(st.sampled_from(sorted(table)) | st.text())
    table[key] = data.draw(ANYTHING)
    outcome = mission_or_error(document)
    if isinstance(outcome, Mission):
        assert Mission.from_dict(outcome.to_dict()) == outcome
    else:
        assert outcome.faults
        assert all(line.isprintable() for line in str(outcome).split("\n"))


@pytest.mark.parametrize("junk", [None, 3, "paper", [], [("schema", 1)]])
def test_what_is_no_dict_is_no_mission(junk: object) -> None:
    assert faults(junk) == {"": "a mission as a dict"}


def test_odd_dicts(document: dict[str, Any]) -> None:
    """Keys that are no strings, dicts that hold themselves, strings without an encoding."""
    assert faults(document | {3: 1, "limits": document["limits"] | {None: 1}}).keys() == {
        "3",
        "limits.None",
    }
    loop: dict[str, Any] = {}
    loop["wind"] = loop
    assert faults(document | loop).keys() == {"wind.wind"}
    assert faults(document | {"name": "\ud800"}).keys() == {"name"}


def test_none_counts_as_not_stated(document: dict[str, Any]) -> None:
    """As in JSON, where an optional key may be null."""
    document["route"]["hover_m"] = None
    document["buildings"][0]["footprint_m"] = None
    document["description"] = None
    document["wind"] = None
    mission = Mission.from_dict(document)
    assert mission.description == ""
    assert mission.buildings[0].footprint_m is None


# Values that stay


@pytest.mark.campaign
@few(10, most=1000)
@given(mission=missions())
def test_missions_are_values(mission: Mission) -> None:
    """Frozen, equal to their copies, of the same hash, different where a value differs."""
    twin = Mission.from_dict(copy.deepcopy(mission.to_dict()))
    assert twin == mission
    assert hash(twin) == hash(mission)
    assert pickle.loads(pickle.dumps(mission)) == mission
    assert mission.replace({"limits.deadline_s": mission.limits.deadline_s + 1}) != mission
    with pytest.raises(ValidationError, match="frozen"):
        mission.limits.deadline_s = 3.0  # type: ignore[misc]
    with pytest.raises(ValidationError, match="frozen"):
        mission.name = "other"  # type: ignore[misc]


@pytest.mark.campaign
@few(10, most=1000)
@given(document=documents())
def test_a_document_is_not_changed_by_reading_it(document: dict[str, Any]) -> None:
    before = copy.deepcopy(document)
    Mission.from_dict(document).replace({"limits.deadline_s": 5})
    assert document == before


def test_the_constructor_judges_as_well(document: dict[str, Any]) -> None:
    """Parts can be put together in Python; rules between them hold there too."""
    paper = Mission.from_dict(document)
    parts = {name: getattr(paper, name) for name in Mission.model_fields}
    assert Mission(**parts) == paper
    regimes = RegimeFlight.model_validate(REGIMES)
    assert Mission(**parts | {"flight": regimes}).flight == regimes
    twins = (Building(name="b", position_m=(0, 0, 1)), Building(name="b", position_m=(1, 0, 1)))
    with pytest.raises(ValidationError, match="a name of its own"):
        Mission(**parts | {"buildings": twins})
    with pytest.raises(ValidationError, match="either visibility_km or attenuation_per_km"):
        Mission(**parts | {"laser": paper.laser.model_copy(update={"visibility_km": 3.0})})
    with pytest.raises(ValidationError):
        RouteEnds(origin_m=(0, 0, "0"), destination_m=(0, 0, 0))  # type: ignore[arg-type]


def test_every_key_is_explained() -> None:
    """Editors, templates and `show` take their words from the models: unit and meaning."""
    for section in (BatteryPacks, Laser, Building, RegimeFlight, RouteEnds):
        for key in section.model_fields:
            description = section.descriptions()[key]
            quantity = key.rpartition("_")[2] in {"m", "A", "W", "V", "J", "As", "km", "nm", "s"}
            assert not quantity or "[" in description, key


def test_shipped_directory_holds_missions_only() -> None:
    directory = Path(optuav.mission.__file__).parent / "shipped"
    assert {path.suffix for path in directory.iterdir()} == {".toml"}


def test_every_charging_has_its_physics() -> None:
    assert {*get_args(Charging)} == kibam.STEP_BY_CHARGING.keys()


def test_the_least_period_is_documented() -> None:
    """Where the key is described, as the error states it."""
    assert f">= deadline_s / {MOST_TURNS}." in BatteryPacks.descriptions()["period_s"]
