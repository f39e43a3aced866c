"""Flight logs of PX4, ArduPilot and DJI give the loads that were flown, or say what is missing.

The files are written by pyulog and by pymavlink's packer, or by hand after AirData's exports.
"""

from __future__ import annotations

import struct
import sys
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import optuav
from optuav.errors import InputError
from tests.calibration import flights
from tests.calibration.flights import Flown, flown
from tests.cli.run import refused, run

Writer = Callable[[Path, Flown], Path]


def old_dataflash(file: Path, log: Flown) -> Path:
    return flights.dataflash(file, log, old=True)


def two_packs(file: Path, log: Flown) -> Path:
    return flights.ulog(file, log, parts=2)


WRITERS: dict[str, tuple[Writer, Mapping[str, str]]] = {
    "log.ulg": (flights.ulog, {}),
    "packs.ulg": (two_packs, {}),
    "log.bin": (flights.dataflash, {}),
    "old.bin": (old_dataflash, {}),
    "airdata.csv": (flights.airdata, {}),
    "semicolons.csv": (flights.semicolons, {}),
    "own.csv": (flights.own_names, flights.OWN_NAMES),
}


@pytest.mark.parametrize("name", WRITERS)
def test_every_format_gives_the_loads_that_were_flown(tmp_path: Path, name: str) -> None:
    """Hover, legs and rest are told apart by states, speeds and climbs; others are left out."""
    write, columns = WRITERS[name]
    found = optuav.fit_regimes(write(tmp_path / name, flown()), columns=columns)
    for key, true in {
        "hover_current_A": flights.HOVER_A,
        "hover_power_W": flights.HOVER_A * flights.VOLTAGE_V,
        "flight_current_A": flights.FLIGHT_A,
        "rest_current_A": flights.REST_A,
        "acceleration_m_s2": flights.ACCELERATION,
        "max_speed_m_s": flights.CAP,
    }.items():
        assert found.changes[f"flight.{key}"] == pytest.approx(true, rel=5e-3), key
    assert not found.warnings
    (log,) = found.logs
    climbs = log.samples.climb_m_s
    assert (climbs.max(), climbs.min()) == pytest.approx((3.0, -2.0), rel=1e-4)  # up is positive
    spans = {why: log.step_s[log.reason == why].sum() for why in set(log.reason.tolist())}
    assert spans["on the ground with rotors on"] == pytest.approx(6.0, abs=0.5)
    assert spans["of climbs and descents"] == pytest.approx(20.0, abs=1.0)
    used, left = found.notes[-2:]
    total_s = log.step_s.sum()
    share = 100.0 * log.step_s[log.phase != "other"].sum() / total_s
    assert f"{share:.0f} % of {total_s:.0f} s are used" in used
    assert "20 s of climbs and descents, 6 s on the ground with rotors on" in left


@pytest.mark.parametrize("name", ["log.ulg", "log.bin", "airdata.csv"])
def test_steady_flight_gives_points_of_power_over_speed(tmp_path: Path, name: str) -> None:
    """Ten hovers and legs at known speeds: mean power of each, and none of speeding up."""
    rows, start_s, power_of = list[tuple[float, ...]](), 0.0, dict[float, float]()
    for speed in (0.0, 2.0, 4.0, 6.0, 8.0, 10.0, 12.0, 14.0, 16.0, 18.0):
        power_of[speed] = 400.0 - 20.0 * speed + 1.5 * speed**2
        for now_s in np.arange(0.0, 20.0, 0.2):
            over = 100.0 if now_s < 1.0 else 0.0  # speeding up
            at = max(speed - 2.0 * max(0.0, 1.0 - now_s), 0.0)
            amps = (power_of[speed] + over) / flights.VOLTAGE_V
            rows.append((start_s + now_s, amps, at, 0.0, 1.0, 0.0))
        start_s += 20.0
    file = WRITERS[name][0](tmp_path / name, Flown(*np.array(rows).T))
    found = optuav.fit_rotary_wing(file)
    (panel,) = found.panels
    for speed, power_W in power_of.items():
        near = [y for x, y in zip(panel.at, panel.observed, strict=True) if abs(x - speed) < 0.3]
        assert len(near) >= 3, speed
        assert np.median(near) == pytest.approx(power_W, rel=0.01), speed
    assert any("over ground" in words for words in found.warnings)
    assert any("are steady" in words for words in found.notes)


def test_a_discharge_is_one_from_full_to_empty(tmp_path: Path) -> None:
    """Lifetimes of logs are those of the same records in our own columns; others are refused."""
    logs, records = list[Path](), list[Path]()
    for number, amps in enumerate((5.0, 10.0, 20.0)):
        time_s = np.arange(0.0, 3600.0 * 9.0 / amps - 40.0 + number, 10.0)
        left = np.linspace(100.0, 5.0, len(time_s))
        rows = [f"{1000 * t:.0f},{amps},{p:.1f}" for t, p in zip(time_s, left, strict=True)]
        logs.append(tmp_path / f"{number}.csv")
        logs[-1].write_text("\n".join(["time(millisecond),current(A),battery_percent", *rows]))
        records.append(tmp_path / f"own-{number}.csv")
        records[-1].write_text("\n".join(["time_s,current_A", *(f"{t},{amps}" for t in time_s)]))
    assert optuav.fit_kibam(logs).changes == optuav.fit_kibam(records).changes
    short = tmp_path / "short.csv"
    short.write_text("\n".join(logs[0].read_text().splitlines()[:100]))
    with pytest.raises(InputError, match=r"to at most 15 % of the charge; the log goes from 100 %"):
        optuav.fit_kibam([*logs, short])


CAPACITY_As, AVAILABLE, RATE_per_s = 9000.0, 0.6, 0.016
LAG_s = (1.0 - AVAILABLE) / (AVAILABLE * RATE_per_s)
BEFORE, AFTER = (
    ((20.0, flights.REST_A, 0.0), (6.0, flights.GROUND_A, 1.0)),
    (
        (5.0, flights.GROUND_A, 1.0),
        (60.0, flights.REST_A, 0.0),
    ),
)
"""Span [s], current [A] and armed state on the ground, before take-off and after landing."""


def until_empty(current_A: float) -> Flown:
    """A hover until the available well is empty, between times on the ground.

    With d the difference of the wells' heights, d' = I/ω - k' d and the upper height is
    y - (1 - ω) d, y the charge left: J. F. Manwell, J. G. McGowan, Solar Energy, 1993.
    """
    rows, left_As, apart_As = list[tuple[float, ...]](), CAPACITY_As, 0.0
    fades = np.exp(-RATE_per_s * flights.STEP_s)

    def step(amps: float, armed: float, landed: float) -> bool:
        nonlocal left_As, apart_As
        rows.append((len(rows) * flights.STEP_s, amps, 0.0, 0.0, armed, landed))
        left_As -= amps * flights.STEP_s
        settled_As = amps / (AVAILABLE * RATE_per_s)
        apart_As = settled_As + (apart_As - settled_As) * fades
        return left_As > (1.0 - AVAILABLE) * apart_As

    for span_s, amps, armed in BEFORE:
        for _ in range(round(span_s / flights.STEP_s)):
            step(amps, armed, 1.0)
    while step(current_A, 1.0, 0.0):
        pass
    for span_s, amps, armed in AFTER:
        for _ in range(round(span_s / flights.STEP_s)):
            step(amps, armed, 1.0)
    return Flown(*np.array(rows).T)


def without_states(file: Path, log: Flown) -> Path:
    """As AirData exports it: the current alone tells when the drone has landed."""
    flights.airdata(file, log)
    heads = ("isMotorOn", "a"), ("isOnGround", "b"), ("battery_percent", "c")
    text = file.read_text()
    for old, new in heads:
        text = text.replace(old, new, 1)
    file.write_text(text)
    return file


@pytest.mark.parametrize("write", [flights.dataflash, without_states])
def test_a_log_that_goes_on_after_landing_gives_the_battery(tmp_path: Path, write: Writer) -> None:
    """A battery that recovers on the ground is not taken for one that lasts longer.

    Before the take-off it rests, and the rest does not come again in a lifetime that is fitted.
    """
    files = [
        write(tmp_path / f"{amps}.log", until_empty(amps)) for amps in (10.0, 20.0, 35.0, 60.0)
    ]
    found = optuav.fit_kibam(files)
    values = {value.key: value.value for value in found.values}
    assert values["battery.capacity_As"] == pytest.approx(CAPACITY_As, rel=0.005)
    assert values["battery.available_fraction"] == pytest.approx(AVAILABLE, rel=0.02)
    assert found.lag is not None
    assert found.lag.value == pytest.approx(LAG_s, rel=0.02)
    assert not found.warnings
    (panel,) = found.panels
    assert panel.fitted == pytest.approx(panel.observed, abs=0.5)
    after_s = sum(span_s for span_s, *_ in AFTER)
    words = [note for note in found.notes if f"{after_s:.1f} s after it are left out" in note]
    assert len(words) == len(files)
    for log in found.logs:
        span_s = log.samples.time_s[-1] - log.samples.time_s[log.used][-1]
        assert span_s == pytest.approx(after_s, abs=0.1)


def test_a_gap_in_a_discharge_is_told(tmp_path: Path) -> None:
    """The current that a logger lost is charge that the fit can only guess."""
    files = list[Path]()
    for amps in (10.0, 20.0, 35.0, 60.0):
        log = until_empty(amps)
        keep = (log.time_s < 49.9) | (log.time_s > 62.1) | (amps != 20.0)
        files.append(flights.dataflash(tmp_path / f"{amps}.bin", Flown(*(c[keep] for c in log))))
    (warning,) = optuav.fit_kibam(files).warnings
    assert warning.startswith(f"{files[1]}: in gaps of 12.4 s in all the log has no current")


def test_the_current_tells_the_ground_where_no_state_does(tmp_path: Path) -> None:
    """As in AirData's own exports: rotors that idle at 3 A of 20 A are no hover."""
    file = flights.airdata(tmp_path / "a.csv", flown())
    file.write_text(file.read_text().replace("isMotorOn,isOnGround", "a,b"))
    found = optuav.fit_regimes(file)
    assert found.changes["flight.hover_current_A"] == pytest.approx(flights.HOVER_A, rel=0.01)
    assert found.changes["flight.rest_current_A"] == pytest.approx(flights.REST_A, rel=1e-6)
    (log,) = found.logs
    ground_s = log.step_s[log.reason == "on the ground with rotors on"].sum()
    assert ground_s == pytest.approx(6.0, abs=0.5)


@pytest.mark.parametrize("write", [flights.ulog, flights.dataflash])
def test_rotors_that_carry_nothing_are_no_hover(tmp_path: Path, write: Writer) -> None:
    """Autopilots say "in the air" with the first turn of the rotors: here 6 s at 3 A of 20 A."""
    file = write(tmp_path / "log", flown()._replace(landed=1.0 - flown().armed))
    found = optuav.fit_regimes(file)
    assert found.changes["flight.hover_current_A"] == pytest.approx(flights.HOVER_A, rel=0.01)
    (log,) = found.logs
    ground_s = log.step_s[log.reason == "on the ground with rotors on"].sum()
    assert ground_s == pytest.approx(6.0, abs=0.5)


def test_a_first_state_that_comes_late_held_before_in_px4(tmp_path: Path) -> None:
    """PX4 repeats its states, so that the first one says nothing of a change."""
    log = flown()
    keep = (log.time_s > 24.0) & (log.time_s < 64.0)
    file = flights.ulog(tmp_path / "a.ulg", Flown(*(c[keep] for c in log)), states_from_s=30.0)
    found = optuav.fit_regimes(file)
    assert set(found.logs[0].phase.tolist()) == {"hover"}


def test_a_gap_is_left_out_with_its_neighbours(tmp_path: Path) -> None:
    """A log that stops for 10 s in a hover keeps its loads, and no sample stands for the gap."""
    log = flown()
    keep = (log.time_s < 40.0) | (log.time_s > 50.0)
    found = optuav.fit_regimes(flights.airdata(tmp_path / "a.csv", Flown(*(c[keep] for c in log))))
    assert found.changes["flight.hover_current_A"] == pytest.approx(flights.HOVER_A, rel=0.01)
    assert found.logs[0].step_s.max() < 1.0
    assert (found.logs[0].reason == "beside gaps in the log").sum() == 2


def test_cells_that_are_blank_or_repeat_a_time_are_counted(tmp_path: Path) -> None:
    file = flights.airdata(tmp_path / "a.csv", flown())
    head, first, *rest = file.read_text().splitlines()
    blank = ",".join([""] * (head.count(",") + 1)).replace(",,", ",x,", 1)
    file.write_text("\n".join([head, first, first, blank, *rest]))
    found = optuav.fit_regimes(file)
    words = "1 without time or current and 1 whose time does not move on"
    assert any(words in note for note in found.notes)


@pytest.mark.parametrize("name", ["log.ulg", "log.bin"])
@pytest.mark.parametrize("share", [0.0005, 0.01, 0.3, 0.9])
def test_a_log_that_is_cut_off_is_read_or_refused(tmp_path: Path, name: str, share: float) -> None:
    """As after a crash; loads of a cut log are those of the whole one as far as they are there."""
    file = WRITERS[name][0](tmp_path / name, flown())
    content = file.read_bytes()
    file.write_bytes(content[: int(share * len(content))])
    try:
        found = optuav.fit_regimes(file)
    except InputError:
        assert share < 0.3
    else:
        assert found.changes["flight.hover_current_A"] == pytest.approx(flights.HOVER_A, rel=0.01)
        assert any("ends in the air" in each for each in found.warnings)


@pytest.mark.parametrize("name", ["log.ulg", "log.bin"])
def test_a_log_that_ends_within_a_message_is_called_cut_off(tmp_path: Path, name: str) -> None:
    """The last bytes are missing, after the landing: the cut is all that there is to warn of."""
    file = WRITERS[name][0](tmp_path / name, flown())
    whole = file.read_bytes()
    file.write_bytes(whole[:-2])
    (warning,) = optuav.fit_regimes(file).warnings
    assert warning == f"{file}: is cut off; what could be read is used"


def test_a_dataflash_log_is_read_beyond_its_damage(tmp_path: Path) -> None:
    """Wrong kinds, headers and formats of messages cost these, and none of those after them."""
    file = flights.dataflash(tmp_path / "log.bin", flown())
    whole = file.read_bytes()
    places = [n for n in range(1000, len(whole)) if whole[n : n + 2] == b"\xa3\x95"][::97]
    spoilt, kinds = bytearray(whole), (0x7F, 0x81, 0x82, 0x83, 0x80)
    for number, place in enumerate(places):
        spoilt[place + number % 3] = kinds[number % len(kinds)]
    file.write_bytes(spoilt)
    found = optuav.fit_regimes(file)
    (log,) = found.logs
    assert len(log.samples.time_s) > 0.97 * len(flown().time_s)
    assert log.samples.time_s[-1] == pytest.approx(flown().time_s[-1], abs=1.0)
    assert found.changes["flight.hover_current_A"] == pytest.approx(flights.HOVER_A, rel=0.01)
    assert found.changes["flight.flight_current_A"] == pytest.approx(flights.FLIGHT_A, rel=0.01)
    (words,) = [words for words in found.warnings if "has damaged parts" in words]
    share = float(words.partition("parts: ")[2].partition(" %")[0])
    assert 0.2 < share < 3.0
    assert not any("ends in the air" in words for words in found.warnings)


def test_what_firmware_writes_wrong_is_no_damage(tmp_path: Path) -> None:
    """Logs of 2014 leave a column out of the format of formats; BAR3 of 2018 is 4 bytes longer."""
    file = flights.dataflash(tmp_path / "log.bin", flown())
    columns = b"Type,Length,Name,Format"
    whole = file.read_bytes().replace(columns + b",Columns", columns + bytes(8))
    names = struct.pack("4s16s64s", b"BAR3", b"QffcfI", b"TimeUS,Alt,Press,Temp,CRt,SMS")
    barometer = b"\xa3\x95\x80" + bytes((199, 33)) + names + b"\xa3\x95" + bytes((199, *range(30)))
    file.write_bytes(whole[:89] + barometer + whole[89:])
    (log,) = optuav.fit_regimes(file).logs
    assert not log.warnings
    assert len(log.samples.time_s) > 0.97 * len(flown().time_s)


def test_a_ulog_is_read_beyond_its_damage(tmp_path: Path) -> None:
    """Sizes that are wrong, by which a reader skips a part of the file, cost their own message."""
    file = flights.ulog(tmp_path / "log.ulg", flown())
    whole = file.read_bytes()
    spoilt, place, number = bytearray(whole), 16, 0
    while place < len(whole):
        size = int.from_bytes(whole[place : place + 2], "little")
        number += 1
        if number % 97 == 0 and whole[place + 2] == ord("D"):
            spoilt[place + 1] = 7 + number % 200  # 1792 bytes or more
        place += 3 + size
    file.write_bytes(spoilt)
    found = optuav.fit_regimes(file)
    (log,) = found.logs
    assert len(log.samples.time_s) > 0.95 * len(flown().time_s)
    assert found.changes["flight.hover_current_A"] == pytest.approx(flights.HOVER_A, rel=0.01)
    assert found.changes["flight.flight_current_A"] == pytest.approx(flights.FLIGHT_A, rel=0.01)
    assert any("has damaged parts" in words for words in found.warnings)
    assert not any("cut off" in words or "ends in" in words for words in found.warnings)


@pytest.mark.parametrize("value", [1e30, -1e5, 1e9])
def test_values_that_no_drone_has_are_left_out_of_a_damaged_log(
    tmp_path: Path, value: float
) -> None:
    log = flown()
    amps = np.where(np.arange(len(log.time_s)) % 50 == 7, value, log.current_A)
    file = flights.dataflash(tmp_path / "log.bin", log._replace(current_A=amps))
    spoilt = bytearray(file.read_bytes())
    spoilt[spoilt.rindex(b"\xa3\x95")] = 0
    file.write_bytes(spoilt + bytes(600))
    found = optuav.fit_regimes(file)
    assert found.changes["flight.hover_current_A"] == pytest.approx(flights.HOVER_A, rel=0.01)
    of = "have no current" if value == 1e30 else "currents: above 2000 A, which no UAV has"
    assert any(of in words for words in (*found.warnings, *found.notes))


@pytest.mark.parametrize("write", [flights.ulog, flights.dataflash, flights.airdata])
def test_a_wild_value_does_not_spoil_a_fit(tmp_path: Path, write: Writer) -> None:
    """One current of 9999 A in level flight; many such values would be those of another unit."""
    log = flown()
    place = int(np.argmax(log.speed_m_s))
    amps, times = log.current_A.copy(), 1000.0 * log.current_A
    amps[place] = 9999.0
    found = optuav.fit_regimes(write(tmp_path / "log", log._replace(current_A=amps)))
    assert found.changes["flight.flight_current_A"] == pytest.approx(flights.FLIGHT_A, rel=0.01)
    assert any(f"1 of {len(amps)} currents: above 2000 A" in note for note in found.notes)
    assert not any("largest current" in words for words in found.warnings)
    found = optuav.fit_regimes(write(tmp_path / "log", log._replace(current_A=times)))
    assert any("the largest current" in words for words in found.warnings)
    assert not any("above 2000 A" in note for note in found.notes)


def test_climbs_that_a_log_does_not_tell_are_said_to_count(tmp_path: Path) -> None:
    """Without them, climbs on the spot are hover."""
    file = flights.airdata(tmp_path / "a.csv", flown())
    words = "there is no speed up or down: climbs and descents count as hover or level flight"
    assert not any(words in warning for warning in optuav.fit_regimes(file).warnings)
    file.write_text(file.read_text().replace("zSpeed", "ignored"))
    assert any(words in warning for warning in optuav.fit_regimes(file).warnings)


def with_decimal_commas(file: Path, lines: slice) -> Path:
    """A log whose last column has decimal commas that nothing quotes."""
    head = "time(millisecond),speed(mph),zSpeed(mph),battery_percent,voltage(v),current(A)"
    rows = [f"{1000 * n},0,0,90,22.2,18.5" for n in range(200)]
    rows[lines] = [row.replace("18.5", "18,5") for row in rows[lines]]
    file.write_text("\n".join([head, *rows]))
    return file


def test_a_line_with_more_cells_than_headings_is_not_read(tmp_path: Path) -> None:
    """Its cells may belong to other columns: 18 A of 18.5 A, or 0 A of the voltage's decimals."""
    found = optuav.fit_regimes(with_decimal_commas(tmp_path / "a.csv", slice(20, 60)))
    assert found.changes["flight.hover_current_A"] == pytest.approx(18.5, rel=1e-9)
    assert any("40 of 200 lines are not read: 40 with more cells" in x for x in found.notes)
    told = refused(
        *("calibrate", "regimes", str(with_decimal_commas(tmp_path / "b.csv", slice(0, 200))))
    )
    assert "has 200 lines with more cells than its 6 headings: decimal commas go with" in told


def test_separators_at_the_ends_of_lines_are_no_cells(tmp_path: Path) -> None:
    file = with_decimal_commas(tmp_path / "a.csv", slice(0, 0))
    head, *rows = file.read_text().splitlines()
    file.write_text("\n".join([head, *(f"{row},," for row in rows)]))
    assert optuav.fit_regimes(file).changes["flight.hover_current_A"] == pytest.approx(18.5)


@pytest.mark.parametrize("write", [flights.dataflash, flights.airdata])
def test_a_wrong_time_costs_its_own_sample(tmp_path: Path, write: Writer) -> None:
    """A moment a year ahead, early in the log, does not make all that follow late."""
    log, place = flown(), 200
    time_s = log.time_s.copy()
    time_s[place] += 3e7
    found = optuav.fit_regimes(write(tmp_path / "log", log._replace(time_s=time_s)))
    assert len(found.logs[0].samples.time_s) == len(time_s) - 1
    assert found.changes["flight.max_speed_m_s"] == pytest.approx(flights.CAP, rel=5e-3)


def test_a_csv_that_is_cut_off_within_a_line_is_called_so(tmp_path: Path) -> None:
    """The number at its end may be the beginning of one: 20 A of 200."""
    file = flights.airdata(tmp_path / "a.csv", flown())
    text = file.read_text()
    file.write_text(text[: text.rindex(",True,") - 1])
    found = optuav.fit_regimes(file)
    assert found.warnings == (f"{file}: is cut off; what could be read is used",)
    assert len(found.logs[0].samples.time_s) == len(flown().time_s) - 1


def test_a_heading_of_two_columns_is_refused(tmp_path: Path) -> None:
    file = flights.airdata(tmp_path / "a.csv", flown())
    file.write_text(file.read_text().replace("latitude", "Speed(mph)", 1))
    with pytest.raises(InputError, match=r"'Speed\(mph\)': must be the heading of one column"):
        optuav.fit_regimes(file)


@pytest.mark.parametrize("name", ["log.ulg", "log.bin"])
def test_damaged_logs_raise_no_other_error(tmp_path: Path, name: str) -> None:
    """A hundred files with some bytes replaced, from a fixed seed."""
    file = WRITERS[name][0](tmp_path / name, flown())
    content, draw = file.read_bytes(), np.random.default_rng(7)
    for _ in range(40):
        spoilt = bytearray(content)
        for place in draw.integers(8, len(content), 30):
            spoilt[place] = int(draw.integers(256))
        file.write_bytes(spoilt)
        try:
            optuav.fit_regimes(file)
        except InputError:
            continue


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"PAR1" + bytes(50), "is a Parquet file"),
        (b"%PDF-1.7 x", "is a PDF"),
        (bytes(8) + b"\xfd" + bytes(40), "is a telemetry log of MAVLink"),
        (b'{"fileType": "Plan"}', "is a plan of QGroundControl"),
        (b"QGC WPL 110\n", "is a text of waypoints"),
        (b"FMT, 128, 89, FMT, BBnNZ, Type,Length\n", "is a flight log of ArduPilot in text"),
        (b"<html><body>404</body></html>", "is a web page"),
        (b"ULog\x01\x12\x35\x01" + bytes(8), "ULog of PX4|no battery_status"),
        (b"time(millisecond),speed(mph)\n0,1\n", "no column of the current"),
        (
            b"Clock,Amps\n0,1\n",
            "has no heading that is known: 'Clock', 'Amps'; use --column OLD=NEW",
        ),
        (
            b"time(millisecond),current(A),voltage(v),speed(furlong/h)\n0,1,2,3\n",
            r"'speed\(furlong/h\)': must be in one of m/s, mps, km/h",
        ),
        (b"\0" * 5000, "is not text and of no known format; a log is a ULog"),
        (b"time(millisecond),current(A)\n0,0\n1,0\n2,0\n3,0", "has no current"),
        (
            b"time(millisecond),current(A)\n0,x\n1,y\n",
            "has 0 samples; 2 of 2 lines are not read: 2 with",
        ),
        (b"time(millisecond),current(A)\n0,9\n1,9\n2,9\n3,9", "has no voltage, which is needed"),
    ],
)
def test_other_files_are_named(tmp_path: Path, content: bytes, words: str) -> None:
    file = tmp_path / "file.log"
    file.write_bytes(content)
    with pytest.raises(InputError, match=words):
        optuav.fit_regimes(file)


def test_a_log_without_steady_speeds_says_what_it_has(tmp_path: Path) -> None:
    """Hovers only: the refusal has the share that is steady, and what is left out."""
    log = flown()
    keep = (log.time_s > 24.0) & (log.time_s < 64.0)
    file = flights.airdata(tmp_path / "a.csv", Flown(*(column[keep] for column in log)))
    with pytest.raises(InputError, match=r"there are 1; .*100 % of 40 s are steady"):
        optuav.fit_rotary_wing(file)


def test_a_log_without_speeds_says_so_where_it_is_refused(tmp_path: Path) -> None:
    rows = [f"{100 * n},20,22" for n in range(50)]
    file = tmp_path / "a.csv"
    file.write_text("\n".join(["time(millisecond),current(A),voltage(v)", *rows]))
    with pytest.raises(InputError, match="there are no speeds: hover and flight cannot be told"):
        optuav.fit_regimes(file)


def test_a_record_of_dji_in_its_own_code_is_named(tmp_path: Path) -> None:
    file = tmp_path / "DJIFlightRecord_2026-05-01.txt"
    file.write_bytes(bytes(range(256)))
    with pytest.raises(InputError, match="is a record of DJI in its own code"):
        optuav.fit_regimes(file)


def test_without_their_libraries_logs_name_the_extra(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for start, library in ((b"ULog\x01\x12\x35\x01", "pyulog"), (b"\xa3\x95\x80\x80", "pymavlink")):
        monkeypatch.setitem(sys.modules, library, None)
        monkeypatch.setitem(sys.modules, f"{library}.DFReader", None)
        monkeypatch.delitem(sys.modules, "optuav.calibration.logs.dataflash", raising=False)
        (tmp_path / "log").write_bytes(start)
        with pytest.raises(InputError, match=rf"needs {library}: .*optuav\[logs\]"):
            optuav.fit_regimes(tmp_path / "log")


def test_the_command_reads_columns_by_their_names_and_draws_the_log(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    file = flights.own_names(tmp_path / "own.csv", flown())
    pairs = [
        part for old, new in flights.OWN_NAMES.items() for part in ("--column", f"{old}={new}")
    ]
    ran = run("calibrate", "regimes", str(file), *pairs, "--plot", str(tmp_path / "pictures"))
    assert ran.code == 0, ran.err
    assert "hover_current_A" in ran.out
    assert "are used (52 % hover" in ran.out
    assert (tmp_path / "pictures" / "log.png").stat().st_size > 10_000
    assert (tmp_path / "pictures" / "fit.png").exists()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("regimes", "--column", "Amps"), "--column = 'Amps': must be OLD=NEW"),
        (
            ("regimes", "--column", "Amps=time_s", "--column", "Amps=current_A"),
            "--column = 'Amps=current_A': names 'Amps' a second time",
        ),
        (
            ("regimes", "--column", "Amps=current_A", "--column", "Volts=current_A"),
            "--column = 'Volts': names current_A a second time",
        ),
        (("regimes", "--column", "Amp=current_A"), "did you mean 'Amps'"),
        (("regimes", "--column", "Amps=current"), "there is no column of the time"),
        (("regimes", "--column", "Amps=thrust_N"), "'thrust_N': must be one of time_s, current_A"),
        (("rotor", "--column", "Amps=current_A"), "--column: requires KIND kibam, regimes"),
    ],
)
def test_wrong_columns_are_refused(tmp_path: Path, options: tuple[str, ...], words: str) -> None:
    kind, *more = options
    file = flights.own_names(tmp_path / "own.csv", flown())
    told = refused("calibrate", kind, str(file), *more)
    assert words in told
    assert told.count("--column =") <= 1  # One mistake is one error


def test_a_column_that_is_named_comes_before_one_that_is_known(tmp_path: Path) -> None:
    """AirData's own current is replaced by that of another sensor."""
    file = flights.airdata(tmp_path / "a.csv", flown())
    head, *rows = file.read_text().splitlines()
    doubled = [f"{row},{2.0 * float(row.split(',')[7])}" for row in rows]
    file.write_text("\n".join([f"{head},shunt", *doubled]))
    found = optuav.fit_regimes(file, columns={"shunt": "current_A"})
    assert found.changes["flight.hover_current_A"] == pytest.approx(2.0 * flights.HOVER_A, rel=0.01)


def test_a_log_that_is_named_twice_is_refused(tmp_path: Path) -> None:
    first = flights.airdata(tmp_path / "a.csv", flown())
    second = tmp_path / "b.csv"
    second.write_bytes(first.read_bytes())
    with pytest.raises(InputError, match=r"has the content of .*a\.csv"):
        optuav.fit_regimes([first, second])


def test_plain_data_of_a_fit_leave_the_log_out(tmp_path: Path) -> None:
    """JSON holds the notes, not a million samples; a fragment names what was left out."""
    found = optuav.fit_regimes(flights.airdata(tmp_path / "a.csv", flown()))
    assert "logs" not in found.to_dict()
    assert found.to_dict()["notes"] == found.notes
    assert "of climbs and descents" in found.to_toml().replace("\n# ", " ")
    assert replace(found, logs=()).changes == found.changes
