"""Random missions: physically sensible ones, and files that somebody has damaged."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import tomli_w
from hypothesis import strategies as st

import optuav.mission
from optuav.mission import Mission, shipped

Document = dict[str, Any]

SHIPPED_FILES = [
    (Path(optuav.mission.__file__).parent / "shipped" / f"{name}.toml").read_bytes()
    for name in shipped()
]
NAMES = st.text(
    st.characters(codec="utf-8", exclude_categories=["C", "Z"]), min_size=1, max_size=12
).filter(str.isprintable)
MAP = st.floats(-2000.0, 2000.0)


def around(value: float, factor: float = 2.0) -> st.SearchStrategy[float]:
    """Numbers near a positive one, on either side."""
    return st.floats(value / factor, value * factor)


def points(low_m: float, high_m: float) -> st.SearchStrategy[list[float]]:
    """Points [x, y, z] with a height between the two."""
    return st.tuples(MAP, MAP, st.floats(low_m, high_m)).map(list)


@st.composite
def rotors_and_bodies(draw: st.DrawFn) -> tuple[Document, Document]:
    """A rotor and a body that four such rotors lift with something to spare."""
    body = {
        "mass_kg": draw(around(1.3)),
        "gravity_m_s2": draw(st.sampled_from([9.8, 9.81, 3.71])),
        "arm_length_m": draw(around(0.175)),
        "inertia_x_kg_m2": draw(around(0.081)),
        "inertia_y_kg_m2": draw(around(0.081)),
        "inertia_z_kg_m2": draw(around(0.142)),
    }
    speed = draw(around(1060.0, 1.5))
    lift = draw(st.floats(1.3, 3.0)) * body["mass_kg"] * body["gravity_m_s2"] / (4 * speed**2)
    rotor = {
        "max_speed_rad_s": speed,
        "lift_coefficient_N_s2_rad2": lift,
        "friction_torque_Nm": draw(around(0.04)),
        "drag_coefficient_Nm_s2_rad2": lift * draw(around(5.9e-3)),
        "viscous_damping_Nm_s_rad": draw(st.floats(0.0, 4e-4)),
        "velocity_constant_rpm_V": draw(around(920.0)),
        "resistance_ohm": draw(st.floats(0.05, 0.4)),
        "inertia_kg_m2": draw(around(4e-5)),
    }
    return rotor, body


@st.composite
def flights(draw: st.DrawFn, laser: bool) -> Document:
    """Loads by regime, charging among them where there is a laser."""
    flight = {
        "model": "regimes",
        "through_buildings": draw(st.booleans()),
        "acceleration_m_s2": draw(around(6.0)),
        "flight_current_A": draw(around(90.0)),
        "flight_power_W": draw(around(1400.0)),
        "hover_current_A": draw(around(70.0)),
        "hover_power_W": draw(around(1000.0)),
    }
    if draw(st.booleans()):
        flight["max_speed_m_s"] = draw(around(20.0))
    if draw(st.booleans()):
        flight |= {"rest_current_A": draw(st.floats(0, 1)), "rest_power_W": draw(st.floats(0, 15))}
    if laser and draw(st.booleans()):
        flight |= {"charge_current_A": draw(around(6.0)), "charge_power_W": draw(around(66.0))}
    return flight


@st.composite
def lasers(draw: st.DrawFn) -> Document:
    """A laser at a wavelength with known coefficients or with its own."""
    laser: Document = {
        "position_m": draw(points(0.0, 60.0)),
        "power_W": draw(around(1000.0)),
        "wavelength_nm": draw(st.sampled_from([810, 1550.0, 1064])),
    }
    if laser["wavelength_nm"] == 1064 or draw(st.booleans()):
        laser |= {
            "emitter_slope": draw(around(0.4, 1.3)),
            "emitter_offset_W": draw(st.floats(-1.5, -0.5)),
            "receiver_slope": draw(around(0.5, 1.3)),
            "receiver_offset_W": draw(st.floats(-0.4, -0.1)),
        }
    attenuation = {"attenuation_per_km": draw(st.floats(0.0, 2.0))}
    return laser | draw(st.sampled_from([attenuation, {"visibility_km": draw(around(5.0, 10.0))}]))


@st.composite
def links(draw: st.DrawFn) -> Document:
    """A link that reaches some hundred metres: its noise follows from the distance."""
    transmit_W, exponent = draw(around(5.0)), draw(st.floats(2.0, 3.0))
    threshold_dB = draw(st.floats(-15.0, 5.0))
    reach_m = draw(st.floats(200.0, 1500.0))
    return {
        "device_m": draw(points(0.0, 20.0)),
        "noise_power_W": transmit_W * reach_m**-exponent / (2.5 * 10 ** (threshold_dB / 10)),
        "transmit_power_W": transmit_W,
        "transmit_voltage_V": draw(around(2.0)),
        "rice_factor": draw(st.floats(0.0, 40.0)),
        "snr_threshold_dB": threshold_dB,
        "path_loss_exponent": exponent,
    }


@st.composite
def batteries(draw: st.DrawFn) -> Document:
    """One to three packs."""
    rate = draw(st.floats(0.0, 1e-3))
    battery: Document = {
        "packs": draw(st.integers(1, 3)),
        "capacity_As": draw(around(36000.0)),
        "nominal_voltage_V": draw(around(11.1)),
        "available_fraction": draw(st.floats(0.1, 0.9)),
        "charge_current_A": draw(st.floats(0.0, 20.0)),
    }
    battery |= draw(
        st.sampled_from([{"flow_rate_per_s": rate}, {"flow_rate_per_min": rate * 60.0}])
    )
    if draw(st.booleans()):
        battery |= {"flight_energy_J": draw(around(1e6)), "hover_energy_J": draw(around(1e6))}
    return battery


@st.composite
def buildings(draw: st.DrawFn, most: int = 5) -> list[Document]:
    """Buildings with unlike names; footprints are sizes, regular polygons or left out."""
    reserved = ("origin", "hover", "destination")
    names = draw(
        st.lists(NAMES.filter(lambda name: name not in reserved), max_size=most, unique=True)
    )
    found = []
    for name in names:
        x, y, z = draw(points(10.0, 120.0))
        building: Document = {"name": name, "position_m": [x, y, z]}
        corners, radius_m = draw(st.integers(0, 8)), draw(st.floats(5.0, 50.0))
        if corners in (1, 2):
            building["footprint_m"] = [radius_m, corners * radius_m]
        elif corners:
            angles = [2 * math.pi * corner / corners for corner in range(corners)]
            building["footprint_m"] = [
                [x + radius_m * math.cos(angle), y + radius_m * math.sin(angle)] for angle in angles
            ]
        found.append(building)
    return found


@st.composite
def documents(draw: st.DrawFn, model: str | None = None, most_buildings: int = 5) -> Document:
    """A mission as a file states it.

    model
        Flight model; None for either.
    """
    model = model or draw(st.sampled_from(["rotors", "regimes"]))
    rotor, body = draw(rotors_and_bodies())
    document: Document = {
        "schema": 1,
        "name": draw(NAMES),
        "description": draw(st.text(st.characters(codec="utf-8"), max_size=30)),
        "route": {"origin_m": draw(points(0, 100)), "destination_m": draw(points(0, 100))},
        "limits": {
            "deadline_s": draw(st.floats(200.0, 3000.0)),
            "min_soc": draw(st.floats(0.0, 0.5)),
            "slot_s": draw(st.sampled_from([0.5, 1.0, 2.0, 7.0])),
            "outage_probability": draw(st.floats(1e-3, 0.2)),
            "min_altitude_m": draw(st.floats(20.0, 80.0)),
            "max_altitude_m": draw(st.floats(80.0, 150.0)),
        },
        "battery": draw(batteries()),
        "link": draw(links()),
        "buildings": draw(buildings(most_buildings)),
    }
    if draw(st.booleans()):
        document["route"]["hover_m"] = draw(points(50.0, 100.0))
    if draw(st.booleans()):
        document["laser"] = draw(lasers())
    if model == "regimes":
        document["flight"] = draw(flights(laser="laser" in document))
    if model == "rotors" or draw(st.booleans()):
        document |= {"rotor": rotor, "body": body}
    if model == "rotors" and draw(st.booleans()):
        gust = st.floats(-0.1, 0.1).map(lambda share: share * body["mass_kg"] * 9.8)
        document["wind"] = {"force_N": draw(st.lists(gust, min_size=3, max_size=3))}
    if draw(st.booleans()):
        document["crs"] = draw(NAMES)
    return document


def missions(model: str | None = None, most_buildings: int = 5) -> st.SearchStrategy[Mission]:
    """Missions of either flight model, or of the one named."""
    return documents(model, most_buildings).map(Mission.from_dict)


HOSTILE_VALUES = [
    *("nan", "-inf", "inf", "-1", "0", "1", "-0.0", "1e999", "1e-320", "10000000", "9" * 400),
    *(
        '""',
        '"text"',
        '"paper"',
        '"paper-table2"',
        '"origin"',
        '"b1"',
        '"\\u0000"',
        '"""\n"""',
        "''",
    ),
    *("true", "false", "[]", "[1]", "[[]]", "[1, 2, 3]", "[0, 0]", "[[0, 0], [1, 1], [0, 1]]"),
    *("[1, 'a', true]", "{}", "{ x = 1 }", "[{}]", "0xfff" + "f" * 300, "9" * 5000),
    *("2020-02-30", "2020-02-29", "07:32:00", "1979-05-27T07:32:00Z", '"regimes"', "[nan, 0, 0]"),
    *("[" * 300 + "]" * 300, "{a=" * 200 + "1" + "}" * 200, ".".join("a" * 40) + " = 1"),
]
TOKENS = [
    *(b"\x00", b"\xff", b"\xef\xbb\xbf", b"\r", b"\n", b"=", b"[", b"]", b'"', b"'", b"#", b"."),
    *(b"[[", b"]]", b"{", b"}", b",", b"\\", b"\xf0\x9f\x9a\x81", b"schema = 1\n", b"[limits]\n"),
    *(
        b"[[buildings]]\n",
        b"extends = 'paper'\n",
        b"[flight]\nmodel = 'regimes'\n",
        b"\xed\xa0\x80",
    ),
]


@st.composite
def mutated_toml(draw: st.DrawFn) -> bytes:
    """A mission file with one to six random injuries: to a few bytes, a line or a value."""
    random_files = documents(most_buildings=2).map(
        lambda document: tomli_w.dumps(document).encode()
    )
    content = draw(st.sampled_from(SHIPPED_FILES) | random_files)
    for _ in range(draw(st.integers(1, 6))):
        content = draw(st.sampled_from([damaged_bytes, damaged_line, swapped_value]))(draw, content)
    return content


def damaged_bytes(draw: st.DrawFn, content: bytes) -> bytes:
    """Some bytes deleted, doubled, or replaced by a token or by other bytes."""
    start = draw(st.integers(0, len(content)))
    end = start + draw(st.sampled_from([0, 1, 2, 5, 40]))
    instead = st.sampled_from([b"", content[start:end] * 2, *TOKENS]) | st.binary(max_size=3)
    return content[:start] + draw(instead) + content[end:]


def damaged_line(draw: st.DrawFn, content: bytes) -> bytes:
    """A line deleted, doubled or moved to another place."""
    lines = content.splitlines(keepends=True) or [b""]
    line = lines.pop(draw(st.integers(0, len(lines) - 1)))
    for _ in range(draw(st.integers(0, 2))):
        lines.insert(draw(st.integers(0, len(lines))), line)
    return b"".join(lines)


def swapped_value(draw: st.DrawFn, content: bytes) -> bytes:
    """The value of a key replaced by one that is hostile, or at least another."""
    lines = content.splitlines(keepends=True)
    places = [place for place, line in enumerate(lines) if b"=" in line]
    if not places:
        return content
    place = draw(st.sampled_from(places))
    key = lines[place].partition(b"=")[0]
    lines[place] = key + b"= " + draw(st.sampled_from(HOSTILE_VALUES)).encode() + b"\n"
    return b"".join(lines)
