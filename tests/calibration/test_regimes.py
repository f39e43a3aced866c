"""Loads, acceleration and speed cap from flight logs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import optuav
from optuav.calibration import Fit, Value
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


def test_speeds_tell_the_phases_where_the_log_does_not(tmp_path: Path) -> None:
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
    told = [words for words in found.warnings if "0 is stated" in words]
    assert [words.partition(" = ")[0] for words in told] == [
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
    random, told = np.random.default_rng(4), 0
    for _ in range(40):
        header, *rows = log(tmp_path / "log.csv", legs_m=(44.0,) * 4).read_text().splitlines()
        cells = [row.rpartition(",") for row in rows]
        rows = [f"{a},{abs(float(v) + 0.15 * random.standard_normal()):.4f}" for a, _, v in cells]
        (tmp_path / "log.csv").write_text("\n".join([header, *rows]), "utf-8")
        told += "flight.max_speed_m_s" in optuav.fit_regimes([tmp_path / "log.csv"]).changes
    assert told <= 2


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
        ("time_s,current_A,voltage_V,speed_m_s", "{n},20,20,-3", "0 or above"),
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
            "hover_power_W, .* = 0: a number, 1e-6",
        ),
    ],
)
def test_logs_that_do_not_do(header: str, row: str, words: str, tmp_path: Path) -> None:
    file = tmp_path / "log.csv"
    file.write_text("\n".join([header, *(row.format(n=n, sign="-" * (n % 2)) for n in range(20))]))
    with pytest.raises(InputError, match=words):
        optuav.fit_regimes([file])


def test_units_that_the_header_does_not_tell_are_doubted(tmp_path: Path) -> None:
    """Milliamperes and millivolts under A and V: each has its warning, also in the fragment."""
    file = tmp_path / "log.csv"
    rows = [f"{n},{20_000 + n % 2},{22_000},{'hover' if n < 30 else 'flight'}" for n in range(60)]
    file.write_text("\n".join(["time_s,current_A,voltage_V,phase", *rows]))
    found = optuav.fit_regimes([file])
    for phase in ("hover", "flight"):
        for words in (f"the current in {phase} is 2000", f"the voltage in {phase} is 22000 V"):
            assert any(words in warning for warning in found.warnings), words
    assert "# Warning: the current in hover" in found.to_toml()


def test_loads_are_doubted_that_the_battery_hardly_holds(tmp_path: Path) -> None:
    """Milliamperes that could be amperes: 800 A are 160 C for 5 A h, and 27 C for 30 A h."""
    file = tmp_path / "log.csv"
    rows = [f"{n},{800 + n % 2},22,hover" for n in range(20)]
    file.write_text("\n".join(["time_s,current_A,voltage_V,phase", *rows]))
    found = optuav.fit_regimes([file])
    paper = optuav.load("paper").replace({"battery.packs": 1})
    small, large = (paper.replace({"battery.capacity_As": 3600.0 * Ah}) for Ah in (5, 30))
    (words,) = set(found.beside(small).warnings) - set(found.warnings)
    assert words.startswith("hover_current_A = 800.5 would empty the full battery of the mission ")
    assert "paper, 18000 A s, in 22.5 s: look at the units" in words
    assert f"# Warning: {words}" in found.beside(small).to_toml()
    assert found.beside(large) == found


def test_a_battery_that_was_found_counts_before_that_of_the_mission() -> None:
    """Where one fit tells capacity and load, the mission's own capacity is none of the values."""
    values = tuple(
        Value(key, value, "known")
        for key, value in (("battery.capacity_As", 1e6), ("flight.hover_current_A", 800.0))
    )
    found = Fit("table", (), "", values, ())
    tiny = optuav.load("paper").replace({"battery.capacity_As": 100.0})
    assert found.beside(tiny).warnings == ()
