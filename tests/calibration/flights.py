"""A flight of known loads, as PX4, ArduPilot and AirData would log it."""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from optuav.arrays import Floats

STEP_s, VOLTAGE_V = 0.2, 22.0
HOVER_A, FLIGHT_A, CLIMB_A, REST_A, GROUND_A = 20.0, 26.0, 35.0, 0.5, 3.0
ACCELERATION, CAP = 2.0, 10.0


class Flown(NamedTuple):
    """Samples of a flight, and the states of the drone."""

    time_s: Floats
    current_A: Floats
    speed_m_s: Floats
    climb_m_s: Floats
    armed: Floats
    landed: Floats


def flown() -> Flown:
    """10 s off, 6 s on the ground, a climb, hovers and legs of 300 m by turns, a descent, off."""
    leg_s = 300.0 / CAP + CAP / ACCELERATION
    parts = [
        (10.0, REST_A, 0.0, 0.0, 0.0, 1.0),
        (6.0, GROUND_A, 0.0, 0.0, 1.0, 1.0),
        (8.0, CLIMB_A, 0.0, 3.0, 1.0, 0.0),
        (40.0, HOVER_A, 0.0, 0.0, 1.0, 0.0),
        (leg_s, FLIGHT_A, CAP, 0.0, 1.0, 0.0),
        (40.0, HOVER_A, 0.0, 0.0, 1.0, 0.0),
        (leg_s, FLIGHT_A, CAP, 0.0, 1.0, 0.0),
        (40.0, HOVER_A, 0.0, 0.0, 1.0, 0.0),
        (12.0, HOVER_A, 0.0, -2.0, 1.0, 0.0),
        (10.0, REST_A, 0.0, 0.0, 0.0, 1.0),
    ]
    rows, start_s = list[tuple[float, ...]](), 0.0
    for span_s, current_A, peak, climb, armed, landed in parts:
        for now_s in np.arange(0.0, span_s - 1e-9, STEP_s):
            ramp = ACCELERATION * min(now_s, span_s - now_s)
            rows.append((start_s + now_s, current_A, min(peak, ramp), climb, armed, landed))
        start_s += span_s
    return Flown(*np.array(rows).T)


def ulog(file: Path, log: Flown, *, parts: int = 1, states_from_s: float = 0.0) -> Path:
    """A ULog that pyulog's writer wrote; of `parts` packs side by side that share the current.

    States are in it from some time on.
    """
    pyulog = pytest.importorskip("pyulog")
    raw = file.with_suffix(".raw")
    raw.write_bytes(b"".join(_ulog(log, parts, states_from_s)))
    pyulog.ULog(str(raw)).write_ulog(str(file))
    return file


def _ulog(log: Flown, parts: int, states_from_s: float) -> Iterator[bytes]:
    """A file of ULog 1, by its specification."""
    layouts = {
        "battery_status": ("float voltage_v;float current_a;float remaining;", "<Qfff"),
        "vehicle_local_position": ("float vx;float vy;float vz;", "<Qfff"),
        "actuator_armed": ("bool armed;", "<QB"),
        "vehicle_land_detected": ("bool landed;", "<QB"),
    }

    def message(kind: bytes, body: bytes) -> bytes:
        return struct.pack("<HB", len(body), kind[0]) + body

    yield b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 1_000_000)
    yield message(b"B", bytes(40))
    for name, (fields, _) in layouts.items():
        yield message(b"F", f"{name}:uint64_t timestamp;{fields}".encode())
    numbers = [(name, 0) for name in layouts] + [("battery_status", n) for n in range(1, parts)]
    for number, (name, instance) in enumerate(numbers):
        yield message(b"A", struct.pack("<BH", instance, number) + name.encode())
    for time_s, amps, speed, climb, armed, landed in zip(*log, strict=True):
        rows: Mapping[str, tuple[float, ...]] = {
            "battery_status": (VOLTAGE_V, amps / parts, 0.8),
            "vehicle_local_position": (0.6 * speed, 0.8 * speed, -climb),
            "actuator_armed": (int(armed),),
            "vehicle_land_detected": (int(landed),),
        }
        for number, (name, _) in enumerate(numbers):
            if layouts[name][1] == "<QB" and time_s < states_from_s:
                continue
            body = struct.pack(layouts[name][1], 1_000_000 + round(1e6 * time_s), *rows[name])
            yield message(b"D", struct.pack("<H", number) + body)


def dataflash(file: Path, log: Flown, *, old: bool = False) -> Path:
    """A DataFlash log that pymavlink packed; an old one has milliseconds and whole hundredths."""
    reader = pytest.importorskip("pymavlink.DFReader")
    time, battery = ("I", "hh") if old else ("Q", "ff")
    clock = "TimeMS" if old else "TimeUS"
    layouts = [
        (128, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns"),
        (129, "CURR" if old else "BAT", f"{time}{battery}", f"{clock},Volt,Curr"),
        (130, "EKF1" if old else "XKF1", f"{time}fff", f"{clock},VN,VE,VD"),
        (131, "EV", f"{time}B", f"{clock},Id"),
    ]
    formats = {}
    for number, name, codes, columns in layouts:
        size = 3 + struct.calcsize("<" + "".join(reader.FORMAT_TO_STRUCT[c][0] for c in codes))
        formats[name] = reader.DFFormat(number, name.encode(), size, codes, columns), size
    packed = []

    def write(name: str, *values: object) -> None:
        form, _ = formats[name]
        packed.append(reader.DFMessage(form, list(values), False, None).get_msgbuf())

    for number, name, codes, columns in layouts:
        write("FMT", number, formats[name][1], name, codes, columns)
    before = (0.0, 1.0)
    for time_s, amps, speed, climb, armed, landed in zip(*log, strict=True):
        now = round(time_s * (1e3 if old else 1e6))
        size = 100 if old else 1
        for old_state, new, on, off in zip(
            before, (armed, landed), (10, 18), (11, 28), strict=True
        ):
            if new != old_state:
                write("EV", now, on if new else off)
        before = (armed, landed)
        pair = [size * VOLTAGE_V, size * amps]
        write(layouts[1][1], now, *(map(round, pair) if old else pair))
        write(layouts[2][1], now, 0.6 * speed, -0.8 * speed, -climb)
    file.write_bytes(b"".join(packed))
    return file


AIRDATA = (
    "time(millisecond),datetime(utc),latitude,speed(mph), zSpeed(mph),voltage(v),battery_percent,"
    "current(A),isMotorOn,isOnGround,message"
)
FLIGHT_READER = (
    "CUSTOM.date [local];OSD.flyTime;OSD.flyTime [s];OSD.hSpeed [km/h];OSD.zSpeed [km/h];"
    "BATTERY.voltage [V];BATTERY.chargeLevel [%];BATTERY.current [A];OSD.isMotorOn;OSD.groundOrSky"
)


def airdata(file: Path, log: Flown) -> Path:
    """The log as AirData writes it: miles per hour, blanks before an English heading."""
    rows = [AIRDATA]
    for time_s, amps, speed, climb, armed, landed in zip(*log, strict=True):
        figures = f"{speed / 0.44704:.6f},{-climb / 0.44704:.6f},{VOLTAGE_V},80,{amps}"
        states = f"{bool(armed)},{bool(landed)}"
        rows.append(f"{round(1000 * time_s)},2026-05-01 10:00:00,52.5,{figures},{states},")
    file.write_text("\n".join(rows))
    return file


def semicolons(file: Path, log: Flown) -> Path:
    """The log as a decoder of DJI's records writes it where a comma is decimal; current below 0."""
    rows = ["sep=;", FLIGHT_READER]
    for time_s, amps, speed, climb, armed, landed in zip(*log, strict=True):
        figures = f"{time_s:.1f};{3.6 * speed:.6f};{-3.6 * climb:.6f};{VOLTAGE_V};80;{-amps}"
        states = f"{str(bool(armed)).upper()};{'Ground' if landed else 'Sky'}"
        rows.append(f"1/5/2026;0m {time_s:.1f}s;{figures};{states}")
    text = "\n".join(rows).replace(".", ",").replace("OSD,", "OSD.").replace("BATTERY,", "BATTERY.")
    file.write_text(text.replace("CUSTOM,", "CUSTOM."))
    return file


def own_names(file: Path, log: Flown) -> Path:
    """The log with columns of its owner's names."""
    rows = ["Clock,Amps,Volts,Ground speed,Up,Armed,Down"]
    rows += [
        f"{t:.1f},{amps},{VOLTAGE_V},{speed:.6f},{climb},{armed:.0f},{landed:.0f}"
        for t, amps, speed, climb, armed, landed in zip(*log, strict=True)
    ]
    file.write_text("\n".join(rows))
    return file


OWN_NAMES = {
    **{"Clock": "time_s", "Amps": "current_A", "Volts": "voltage_V", "Ground speed": "speed_m_s"},
    **{"Up": "climb_m_s", "Armed": "isMotorOn", "Down": "isOnGround"},
}
