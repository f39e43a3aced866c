"""Loads, acceleration and speed cap from flight logs: values, and intervals that hold the truth."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from itertools import accumulate
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

import optuav
from optuav.arrays import Floats
from optuav.calibration.regimes import correlation_of_neighbours, mean_over_time
from optuav.errors import InputError

DATA = Path(__file__).parents[2] / "examples" / "data"
TRUE = {
    "acceleration_m_s2": 2.5,
    "max_speed_m_s": 12.0,
    "flight_current_A": 26.0,
    "hover_current_A": 21.0,
    "rest_current_A": 0.4,
    "charge_current_A": 3.4,
}


def log(path: Path, *, legs_m: tuple[float, ...] = (300.0, 300.0), header: str = "") -> Path:
    """A log without noise: rest, then a leg and a hover by turns; cap 10 m/s, 2 m/s²."""
    lines = [header or "time_s,current_A,voltage_V,speed_m_s"]
    course = [(10.0, 0.5, 0.0)]
    for leg_m in legs_m:
        peak = min(10.0, (2.0 * leg_m) ** 0.5)
        course += [(leg_m / peak + peak / 2.0, 30.0, peak), (40.0, 20.0, 0.0)]
    start_s, now_s = 0.0, 0.0
    for duration_s, current_A, peak in course:
        while now_s < start_s + duration_s:
            ramp_s = min(now_s - start_s, start_s + duration_s - now_s)
            lines.append(f"{now_s:.2f},{current_A},20,{min(peak, 2.0 * ramp_s):.4f}")
            now_s += 0.25
        start_s += duration_s
    path.write_text("\n".join(lines), "utf-8")
    return path


def test_recovers_the_truth_of_the_example() -> None:
    """Within 3 %, all but one of six inside its interval, and that one hardly out of it.

    How often intervals hold the truth is counted in the tests of their coverage.
    """
    found = optuav.fit_regimes([DATA / "flight_log.csv"])
    inside = 0
    for each in found.values:
        true = TRUE.get(each.key.removeprefix("flight."))
        if true is not None:
            assert each.value == pytest.approx(true, rel=0.03), each.key
            assert each.interval is not None
            reach = 0.5 * (each.interval.high - each.interval.low)
            assert abs(each.value - true) <= 1.5 * reach, each.key
            inside += each.interval.low <= true <= each.interval.high
    assert inside >= 5
    assert found.warnings == ()


def test_powers_are_the_means_of_the_products() -> None:
    """Not products of means; computed here from the file."""
    found = optuav.fit_regimes([DATA / "flight_log.csv"]).changes
    rows = [
        line.split(",") for line in (DATA / "flight_log.csv").read_text("utf-8").splitlines()[3:]
    ]
    hover_W = [float(i) * float(e) for _, i, e, _, phase in rows if phase == "hover"]
    assert found["flight.hover_power_W"] == pytest.approx(np.mean(hover_W), rel=1e-6)


def test_speeds_give_the_phases_where_the_log_has_none(tmp_path: Path) -> None:
    """Current and speed, as in the log; the edges of a leg below 1 m/s count as hover."""
    found = optuav.fit_regimes([log(tmp_path / "log.csv")])
    assert found.changes["flight.model"] == "regimes"
    for key, true in {
        "acceleration_m_s2": 2.0,
        "max_speed_m_s": 10.0,
        "flight_current_A": 30.0,
        "flight_power_W": 600.0,
        "rest_power_W": 10.0,
    }.items():
        assert found.changes[f"flight.{key}"] == pytest.approx(true, rel=5e-3), key
    assert found.changes["flight.hover_current_A"] == pytest.approx(20.0, rel=0.02)


def test_a_rest_that_draws_next_to_nothing_is_stated_as_nothing(tmp_path: Path) -> None:
    """Where the sensor's noise takes the mean below 0, which no mission may state."""
    noise = np.random.default_rng(0).normal(0.0, 0.02, 60)
    noise -= noise.mean() + 0.001
    rows = [f"{k},{a:.6f},15,rest" for k, a in enumerate(noise)]
    rows += [f"{60 + k},{20.0 + 0.1 * (k % 3)},15,hover" for k in range(60)]
    path = tmp_path / "log.csv"
    path.write_text("\n".join(["time_s,current_A,voltage_V,phase", *rows]), "utf-8")
    found = optuav.fit_regimes([path])
    assert found.changes["flight.rest_current_A"] == found.changes["flight.rest_power_W"] == 0.0
    stated = [words for words in found.warnings if "0 is used" in words]
    assert [words.partition(" = ")[0] for words in stated] == [
        "flight.rest_current_A",
        "flight.rest_power_W",
    ]


def test_short_legs_show_no_cap(tmp_path: Path) -> None:
    found = optuav.fit_regimes([log(tmp_path / "log.csv", legs_m=(20.0, 30.0))])
    assert "flight.max_speed_m_s" not in found.changes
    assert "no leg is long enough" in found.warnings[0]
    assert found.changes["flight.acceleration_m_s2"] == pytest.approx(2.0, rel=0.02)


def test_errors_of_the_speed_are_no_cap(tmp_path: Path) -> None:
    """Legs too short for it, of which no sample is at the peak: a cap tells of errors alone."""
    random, capped = np.random.default_rng(4), 0
    for _ in range(10):
        header, *rows = log(tmp_path / "log.csv", legs_m=(44.0,) * 4).read_text().splitlines()
        cells = [row.rpartition(",") for row in rows]
        rows = [f"{a},{abs(float(v) + 0.15 * random.standard_normal()):.4f}" for a, _, v in cells]
        (tmp_path / "log.csv").write_text("\n".join([header, *rows]), "utf-8")
        capped += "flight.max_speed_m_s" in optuav.fit_regimes([tmp_path / "log.csv"]).changes
    assert capped <= 1


def test_legs_at_different_speeds_have_no_one_acceleration_and_cap(tmp_path: Path) -> None:
    """Legs of 35 s at 3 to 18 m/s, sped up at 2 m/s²: neither is fitted, and a warning says why."""
    rows, start_s = ["time_s,current_A,voltage_V,speed_m_s"], 0.0
    for cap_m_s in (3.0, 6.0, 9.0, 12.0, 15.0, 18.0):
        for now_s in np.arange(0.0, 50.0, 0.2):
            speed_m_s = max(0.0, min(cap_m_s, 2.0 * now_s, 2.0 * (35.0 - now_s)))
            rows.append(f"{start_s + now_s:.1f},20,22,{speed_m_s:.3f}")
        start_s += 50.0
    (tmp_path / "log.csv").write_text("\n".join(rows))
    found = optuav.fit_regimes(tmp_path / "log.csv")
    assert not {"flight.acceleration_m_s2", "flight.max_speed_m_s"} & found.changes.keys()
    assert any("for legs at different speeds use rotary-wing" in each for each in found.warnings)


def test_several_logs_are_one_sample(tmp_path: Path) -> None:
    one, two = log(tmp_path / "one.csv"), log(tmp_path / "two.csv", legs_m=(400.0,))
    found = optuav.fit_regimes([one, two])
    assert "3 legs" in found.data
    assert found.changes["flight.max_speed_m_s"] == pytest.approx(10.0, rel=1e-3)


def test_without_speeds_there_is_no_acceleration(tmp_path: Path) -> None:
    file = tmp_path / "log.csv"
    rows = [f"{n},{20 + n % 2},400,{'hover' if n < 30 else 'flight'}" for n in range(60)]
    file.write_text("\n".join(["time_s,current_A,power_W,phase", *rows]))
    found = optuav.fit_regimes([file])
    assert "acceleration_m_s2 is missing" in found.warnings[0]
    assert found.changes["flight.hover_current_A"] == 20.5


def test_fragment_is_a_mission(tmp_path: Path) -> None:
    """On top of a shipped mission it solves."""
    file = tmp_path / "drone.toml"
    file.write_text(optuav.fit_regimes([DATA / "flight_log.csv"]).to_toml(file=file), "utf-8")
    mission = optuav.load(file)
    assert mission.flight.model == "regimes"
    assert mission.flight.max_speed_m_s == pytest.approx(12.0, rel=0.01)
    assert optuav.solve(mission, "P3", perspective="battery").hover_time_s > 0.0


@pytest.mark.parametrize(
    ("header", "row", "words"),
    [
        ("time_s,current_A,speed_m_s", "{n},20,0", "one of the columns voltage and power"),
        ("time_s,current_A,voltage_V,power_W,speed_m_s", "{n},20,1,20,0", "one of the columns"),
        ("time_s,current_A,voltage_V", "{n},20,20", "a column phase, or one of speed"),
        ("time_s,current_A,voltage_V,phase", "{n},20,20,hoover", "did you mean 'hover'"),
        ("time_s,current_A,voltage_V,speed_m_s", "{n},20,20,-3", "x >= 0"),
        ("time_s,current_A,voltage_V,speed_m_s", "{n},-20,20,3", "positive is discharge"),
        ("time_s,current_A,voltage_V,phase", "{n},20,20,other", "flight or of hover"),
        (
            "time_s,current_A,voltage_V,speed_m_s",
            "{n},{sign}20,20,0",
            "rest_current_A, mean at rest = -20: .* x <= 1e6",
        ),
        (
            "time_s,current_A,voltage_V,phase",
            "{n},20,0,hover",
            "lines 2 to 21: voltage = 0",
        ),
        (
            "time_s,current_A,power_W,phase",
            "{n},20,0,hover",
            "hover_power_W, .* = 0: must be a number, 1e-6",
        ),
    ],
)
def test_logs_that_do_not_do(header: str, row: str, words: str, tmp_path: Path) -> None:
    file = tmp_path / "log.csv"
    file.write_text("\n".join([header, *(row.format(n=n, sign="-" * (n % 2)) for n in range(20))]))
    with pytest.raises(InputError, match=words):
        optuav.fit_regimes([file])


def test_wrong_units_are_doubted(tmp_path: Path) -> None:
    """Milliamperes and millivolts under A and V: each has its warning, also in the fragment."""
    file = tmp_path / "log.csv"
    rows = [f"{n},{20_000 + n % 2},{22_000},{'hover' if n < 30 else 'flight'}" for n in range(60)]
    file.write_text("\n".join(["time_s,current_A,voltage_V,phase", *rows]))
    found = optuav.fit_regimes([file])
    for words in ("the largest current is 20001 A", "the largest voltage is 22000 V"):
        assert any(words in warning for warning in found.warnings), words
    rows = [f"{n},20,0.44,{'hover' if n < 30 else 'flight'}" for n in range(60)]
    file.write_text("\n".join(["time_s,current_A,power_W,phase", *rows]))
    assert any("perhaps power_W is in kW" in words for words in optuav.fit_regimes([file]).warnings)
    assert "# Warning: the largest current" in found.to_toml()


def with_unknown(
    path: Path, column: str, value: str, *, rest_A: float = 0.4, header: str = ""
) -> Path:
    """Hover at 15 A and 22 V, flight at 20 A, rest; in hover, 100 lines of 200 are unknown."""
    random, rows = np.random.default_rng(6), list[str]()
    for n in range(500):
        phase, mean_A = ("hover", 15.0) if n < 200 else ("flight", 20.0)
        phase, mean_A = (phase, mean_A) if n < 400 else ("rest", rest_A)
        cells = {"current": f"{mean_A + 0.1 * random.standard_normal():.4f}", "voltage": "22.0"}
        cells |= {column: value} if 50 <= n < 150 else {}
        rows.append(f"{n},{cells['current']},{cells['voltage']},{phase}")
    head = header or "time_s,current_A,voltage_V,phase"
    path.write_text("\n".join([head, *rows]), "utf-8")
    return path


@pytest.mark.parametrize(
    ("column", "value", "words"),
    [
        ("current", "-1", "their current is -1 A, which means unknown"),
        ("current", "-1.000", "their current is -1 A, which means unknown"),
        ("current", "-0.01", "their current is -0.01 A, which means unknown"),
        ("current", "655.35", "their current is 655.35 A, which means unknown"),
        ("voltage", "65.535", "their voltage is 65.535 V, which means unknown"),
        ("voltage", "-1", "their voltage is -1 V, which means unknown"),
        ("voltage", "-0.001", "their voltage is -0.001 V, which means unknown"),
    ],
)
def test_values_that_mean_unknown_are_left_out_and_counted(
    column: str, value: str, words: str, tmp_path: Path
) -> None:
    """Averaged, 100 of 200 lines at -1 A would make 7 A of 15 A, at 655.35 A 335 A."""
    found = optuav.fit_regimes([with_unknown(tmp_path / "log.csv", column, value, rest_A=5.0)])
    assert found.changes["flight.hover_current_A"] == pytest.approx(15.0, rel=0.005)
    assert found.changes["flight.hover_power_W"] == pytest.approx(330.0, rel=0.005)
    (told,) = [each for each in found.warnings if "unknown" in each]
    assert told.endswith(f"log.csv: 100 of 500 lines are left out: {words}")
    assert f" Warning: {told}" in found.to_toml().replace("\n# ", " ")  # wrapped


def test_a_voltage_of_65535_millivolts_is_unknown(tmp_path: Path) -> None:
    file = with_unknown(tmp_path / "log.csv", "voltage", "65535")
    rows = file.read_text().replace(",22.0,", ",22000,").splitlines()
    file.write_text("\n".join(["time_s,current_A,voltage_mV,phase", *rows[1:]]), "utf-8")
    found = optuav.fit_regimes([file])
    assert found.changes["flight.hover_power_W"] == pytest.approx(330.0, rel=0.005)


@pytest.mark.parametrize("value", ["-1", "65535"])
@pytest.mark.parametrize("column", ["current", "voltage"])
def test_values_of_a_column_s_own_unit_are_unknown(column: str, value: str, tmp_path: Path) -> None:
    """In mA and mV too, where they had made 7.5 A of 15 A, or refused the log."""
    file = with_unknown(tmp_path / "log.csv", column, value, rest_A=5.0)
    rows = [row.split(",") for row in file.read_text().splitlines()[1:]]
    places = {"current": 1, "voltage": 2}.values()
    for place, row in itertools.product(places, rows):
        row[place] = row[place] if row[place] == value else f"{1e3 * float(row[place]):.6g}"
    lines = ["time_s,current_mA,voltage_mV,phase", *map(",".join, rows)]
    file.write_text("\n".join(lines), "utf-8")
    found = optuav.fit_regimes([file])
    assert found.changes["flight.hover_current_A"] == pytest.approx(15.0, rel=0.005)
    assert found.changes["flight.hover_power_W"] == pytest.approx(330.0, rel=0.005)
    (told,) = [words for words in found.warnings if "unknown" in words]
    assert "100 of 500 lines are left out" in told


def test_left_out_lines_weigh_as_before(tmp_path: Path) -> None:
    """The lines beside a gap stand for their own time, not for that of the gap."""
    file = with_unknown(tmp_path / "log.csv", "current", "-1")
    lines = file.read_text().splitlines()
    seen = [float(row.split(",")[1]) for row in (*lines[1:51], *lines[151:201])]
    found = optuav.fit_regimes([file]).changes
    assert found["flight.hover_current_A"] == pytest.approx(np.mean(seen), rel=1e-6)


def test_a_charge_of_one_ampere_is_a_measurement(tmp_path: Path) -> None:
    """Exactly −1 A in the laser's light; a sensor that is off by a little measures −0.01 A."""
    rows = [f"{n},{20 + n % 2},22,hover" for n in range(30)]
    rows += [f"{n},-1,22,charge" for n in range(30, 60)]
    rows += [f"{n},{(-0.01, -0.02, 0.33)[n % 3]},22,rest" for n in range(60, 90)]
    file = tmp_path / "log.csv"
    file.write_text("\n".join(["time_s,current_A,voltage_V,phase", *rows]), "utf-8")
    found = optuav.fit_regimes([file])
    values = {value.key: value.value for value in found.values}
    assert values["flight.charge_current_A"] == pytest.approx(1.1, abs=1e-9)
    assert not any("unknown" in words for words in found.warnings)


def test_a_log_of_unknown_values_only_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "log.csv"
    rows = [f"{n},{20 if n < 5 else 655.35},22,hover" for n in range(30)]
    file.write_text("\n".join(["time_s,current_A,voltage_V,phase", *rows]), "utf-8")
    with pytest.raises(InputError, match=r"at least 10 lines of known values.*25 of 30 lines"):
        optuav.fit_regimes([file])


RECORDS = 400


def records(count: int, alike: float) -> Iterator[Floats]:
    """Records about 0 whose neighbours have a given correlation."""
    random = np.random.default_rng(3)
    for _ in range(RECORDS):
        drawn = random.standard_normal(count)
        drawn[0] /= (1.0 - alike**2) ** 0.5
        yield np.array(list(accumulate(drawn, lambda old, new: alike * old + new)))


@pytest.mark.parametrize(("count", "alike"), [(20, 0.0), (120, 0.8), (300, 0.8), (1000, 0.95)])
def test_means_cover_at_their_nominal_rate(count: int, alike: float) -> None:
    """95 %, where four standard deviations of 400 records are 4.4 %."""
    inside = 0
    for record in records(count, alike):
        _, interval = mean_over_time(record, np.full(count, 0.5))
        inside += interval.low <= 0.0 <= interval.high
    assert inside / RECORDS == pytest.approx(0.95, abs=0.0436)


def test_short_records_that_wander_slowly_cover_less() -> None:
    """As the page on calibration says: 60 samples of which neighbours correlate by 0.9."""
    means = [mean_over_time(record, np.full(60, 0.5)) for record in records(60, 0.9)]
    inside = np.mean([interval.low <= 0.0 <= interval.high for _, interval in means])
    assert 0.8 < inside < 0.92


@pytest.mark.parametrize("alike", [0.0, 0.5, 0.8])
def test_short_records_do_not_hide_how_alike_neighbours_are(alike: float) -> None:
    """Of 40 samples it comes out 0.1 (at 0.5) to 0.15 (at 0.8) too small if nothing is done."""
    assert np.mean(
        [correlation_of_neighbours(record) for record in records(40, alike)]
    ) == pytest.approx(max(alike, 0.06), abs=0.055)


def test_a_voltage_that_sags_does_not_wander() -> None:
    """20 to 22 over a minute: the interval is that of independent samples."""
    record = 20.0 + 2.0 * np.arange(60) / 59.0 + np.random.default_rng(0).normal(0.0, 0.05, 60)
    _, (low, high) = mean_over_time(record, np.ones(60))
    assert (low, high) == pytest.approx((20.85, 21.15), abs=0.1)


def test_a_record_of_one_value_has_no_width() -> None:
    assert mean_over_time(np.full(12, 3.0), np.ones(12)) == (3.0, (3.0, 3.0))


def test_steps_weigh() -> None:
    """A sample that stands for twice the time counts twice."""
    values, steps_s = np.arange(10.0), np.array([*np.ones(9), 2.0])
    mean, _ = mean_over_time(values, steps_s)
    assert mean == pytest.approx((45.0 + 9.0) / 11.0)


COURSE = (("rest", 30.0), ("flight", None), ("hover", 150.0), ("flight", None), ("charge", 60.0))


class Flight(NamedTuple):
    """How long the legs are, how often the log is written, how far its speeds are off.

    And which part of its error the current keeps from one sample to the next.
    """

    leg_m: float
    step_s: float
    error_m_s: float
    wander: float = 0.0


LONG, SHORT = Flight(1500.0, 1.0, 0.15), Flight(420.0, 0.5, 0.15)
WANDERING = SHORT._replace(step_s=0.25, wander=0.8)


def written(path: Path, flight: Flight, random: np.random.Generator) -> Path:
    """A log of two legs, speeds with errors of their own and currents too."""
    leg_s = flight.leg_m / 12.0 + 12.0 / 2.5
    lasts_s = np.array([leg_s if duration is None else duration for _, duration in COURSE])
    ends_s = np.cumsum(lasts_s)
    time_s = np.arange(random.uniform(0.0, flight.step_s), ends_s[-1], flight.step_s)
    piece = np.searchsorted(ends_s, time_s, side="right")
    phase = [COURSE[number][0] for number in piece]
    left_s = ends_s[piece] - time_s
    climb = 2.5 * np.minimum(left_s, lasts_s[piece] - left_s)
    flies = np.array([each == "flight" for each in phase])
    speed_m_s = np.where(flies, np.minimum(climb, 12.0), 0.0)
    speed_m_s = np.abs(speed_m_s + flight.error_m_s * random.standard_normal(len(time_s)))
    means_A = {"rest": 0.4, "flight": 26.0, "hover": 21.0, "charge": 0.4 - 3.4}
    current_A = np.array([means_A[each] for each in phase]) * (
        1.0 + errors(random, len(time_s), flight.wander)
    )
    rows = zip(time_s, current_A, speed_m_s, phase, strict=True)
    lines = [f"{t:.3f},{i:.5f},23,{v:.4f},{word}" for t, i, v, word in rows]
    path.write_text("\n".join(["time_s,current_A,voltage_V,speed_m_s,phase", *lines]), "utf-8")
    return path


def errors(random: np.random.Generator, count: int, wander: float) -> Floats:
    """Of the currents, relative: 2 % that change by the sample, or wander."""
    drawn = 0.02 * random.standard_normal(count)
    drawn[0] /= (1.0 - wander**2) ** 0.5
    return np.array(list(accumulate(drawn, lambda error, more: wander * error + more)))


def covered(flight: Flight, runs: int, seed: int, tmp_path: Path) -> dict[str, int]:
    """How often each interval holds the truth."""
    random, counts = np.random.default_rng(seed), dict.fromkeys(TRUE, 0)
    for _ in range(runs):
        found = optuav.fit_regimes([written(tmp_path / "log.csv", flight, random)])
        values = {each.key.removeprefix("flight."): each for each in found.values}
        for key, true in TRUE.items():
            interval = values[key].interval
            assert interval is not None
            counts[key] += interval.low <= true <= interval.high
    return counts


@pytest.mark.parametrize("flight", [LONG, pytest.param(WANDERING, marks=pytest.mark.soak)])
def test_intervals_cover_the_truth(flight: Flight, tmp_path: Path) -> None:
    """Of 8 logs; so few as to fail come once in thousand times at a rate of 95 %."""
    from scipy.stats import binom

    for key, count in covered(flight, 8, 5, tmp_path).items():
        assert count >= binom.ppf(1e-3, 8, 0.95), (key, count)


@pytest.mark.soak
@pytest.mark.parametrize(
    "flight", [LONG, SHORT, WANDERING, Flight(420.0, 0.1, 0.3), Flight(200.0, 0.25, 0.1)]
)
def test_intervals_cover_at_their_nominal_rate(flight: Flight, tmp_path: Path) -> None:
    """95 % within what 400 logs can tell: four standard deviations are 4.4 %."""
    for key, count in covered(flight, 400, 11, tmp_path).items():
        assert count / 400 == pytest.approx(0.95, abs=0.0436), key
