"""Keys of a mission from the paper's results table, as `paper-table2` was recovered."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

import pytest

import optuav
from optuav.errors import InputError

FILE = Path(__file__).parents[2] / "examples" / "data" / "paper_table2.toml"
SPECIFIED = {
    "flight.acceleration_m_s2": "12.2349",
    "flight.flight_current_A": "93.658",
    "flight.flight_power_W": "1443.05",
    "flight.hover_current_A": "72.073",
    "flight.hover_power_W": "1032.82",
    "flight.charge_current_A": "5.992",
    "flight.charge_power_W": "66.515",
}
"""What the specification says was fitted, to its digits."""


@pytest.fixture(scope="module")
def found() -> optuav.Fit:
    return optuav.fit_table([FILE])


def test_recovers_the_specified_loads(found: optuav.Fit) -> None:
    """Every fitted number to the digits that are stated."""
    for key, stated in SPECIFIED.items():
        digits = len(stated.partition(".")[2])
        assert f"{found.changes[key]:.{digits}f}" == stated, key


def test_agrees_with_the_shipped_mission(found: optuav.Fit) -> None:
    """`paper` with the fragment is `paper-table2`, up to the digits that it was written with."""
    mission, shipped = optuav.load("paper").replace(found.changes), optuav.load("paper-table2")
    for key, value in shipped.flight.model_dump().items():
        own = getattr(mission.flight, key)
        assert own == (pytest.approx(value, rel=1e-4) if isinstance(value, float) else value), key
    assert mission.battery == shipped.battery


def test_predicts_the_cells_that_were_not_fitted(found: optuav.Fit) -> None:
    """Voltages and η3; and η2 = -0.27 where the paper prints -12.79."""
    cells = {
        (panel.quantity, name): (fitted, role)
        for panel in found.panels
        for name, fitted, role in zip(panel.names, panel.fitted, panel.roles, strict=True)
    }
    for quantity, name, value in (
        ("battery", "800 s, battery", 24.30),
        ("energy", "800 s, battery", -0.27),
        ("adjusted", "800 s, battery", 24.3),
        ("adjusted", "1200 s, energy", 28.3),
        ("adjusted", "1200 s, battery", 5.1),
        ("hover voltage", "text", 14.330),
        ("flight voltage", "text", 15.41),
    ):
        fitted, role = cells[quantity, name]
        digits = len(str(value).partition(".")[2])
        assert (round(fitted, digits), role) == (value, "predicted"), (quantity, name)


def test_what_is_fitted_is_met(found: optuav.Fit) -> None:
    """Six free keys and six numbers: nothing is left over, nor of what repeats one of them."""
    count = Counter[str]()
    for panel in found.panels:
        for observed, fitted, role in zip(panel.observed, panel.fitted, panel.roles, strict=True):
            count[role] += 1
            if role != "predicted":
                assert fitted == pytest.approx(observed, abs=1e-6)
    assert count == {"fitted": 6, "repeat": 9, "predicted": 12}
    assert found.data == ("6 numbers of the table fitted by 6 free keys, 9 repeated, 12 predicted")
    assert found.warnings == ()


def test_repeats_are_those_that_the_ledger_counts_as_fitted(found: optuav.Fit) -> None:
    """Table II has 14 cells that were used: five numbers of it, and where they stand again."""
    used = [
        (panel.quantity, name, observed)
        for panel in found.panels
        for name, observed, role in zip(panel.names, panel.observed, panel.roles, strict=True)
        if role != "predicted" and " s, " in name and "laser" not in name
    ]
    assert len(used) == 14
    for quantity, name, observed in used:
        assert (quantity, observed) in {
            ("flight time", 59.35),
            *(("battery", 28.31), ("energy", 5.01), ("battery", 5.09), ("energy", -25.58)),
        }, name


def test_a_number_that_is_fitted_again_is_doubted(tmp_path: Path) -> None:
    """Two rows of one flight time that are both to be fitted: one number, not two."""
    row = '[[rows]]\nname = "{0} s"\ngiven.hover_time_s = {0}\nfit.flight_time_s = 75.8\n'
    head = "free.body.mass_kg = 1.2\nresolution.flight_time_s = 0.1\n"
    file = tmp_path / "table.toml"
    file.write_text(head + row.format(600) + row.format(500), "utf-8")
    assert any(
        "1 number to be fitted repeats another" in x for x in optuav.fit_table([file]).warnings
    )


def test_intervals_follow_from_the_rounding(found: optuav.Fit) -> None:
    """T = 4 sqrt(d/a): the acceleration is as sure as a flight time rounded to 0.01 s."""
    value = next(each for each in found.values if each.key == "flight.acceleration_m_s2")
    deviation = 0.01 / 12.0**0.5
    reach = 2.0 * 1.959964 * deviation / 59.35 * 12.2349
    assert value.interval is not None
    assert value.interval.high - value.value == pytest.approx(reach, rel=1e-3)


def test_fragment_is_a_mission(found: optuav.Fit, tmp_path: Path) -> None:
    file = tmp_path / "recovered.toml"
    file.write_text(found.to_toml(file=file), "utf-8")
    plan = optuav.solve(optuav.load(file), "P3", slot_s=1, perspective="battery")
    assert plan.hover_time_s == 950.0


def test_free_keys_that_nothing_determines_are_named(tmp_path: Path) -> None:
    """Without the crossing of the figure, hover and charging current are not determined.

    The acceleration is known then, or there were fewer numbers than keys.
    """
    text = re.sub(r'\[\[rows\]\]\nname = "39 000.*?\n\n', "", FILE.read_text("utf-8"), flags=re.S)
    start = "[free]\nflight.acceleration_m_s2 = 10\n"
    text = text.replace(start, "flight.acceleration_m_s2 = 12.2349\n[free]\n")
    file = tmp_path / "table.toml"
    file.write_text(text, "utf-8")
    found = optuav.fit_table([file])
    (warning,) = found.warnings
    assert "hover_current_A" in warning
    assert "charge_current_A" in warning
    assert "acceleration_m_s2" not in warning


def test_keys_that_are_not_apart_are_stated_together(tmp_path: Path) -> None:
    """On top of any mission the fitted ones meet the table, with the tied one at their product."""
    text = re.sub(r'\[\[rows\]\]\nname = "39 000.*?\n\n', "", FILE.read_text("utf-8"), flags=re.S)
    start = "[free]\nflight.acceleration_m_s2 = 10\n"
    file = tmp_path / "table.toml"
    file.write_text(text.replace(start, "flight.acceleration_m_s2 = 12.2349\n[free]\n"), "utf-8")
    found = optuav.fit_table([file])
    unsure = [value.key for value in found.values if not value.determined]
    assert {"flight.hover_current_A", "flight.charge_current_A"} <= {*unsure} <= {*found.changes}
    charge_W = (
        found.changes["flight.charge_current_A"] * optuav.load("paper").battery.nominal_voltage_V
    )
    assert found.changes["flight.charge_power_W"] == pytest.approx(charge_W, rel=1e-6)
    (tmp_path / "new.toml").write_text(found.to_toml(file=tmp_path / "new.toml"), "utf-8")
    plan = optuav.solve(optuav.load(tmp_path / "new.toml"), "P3", slot_s=1, perspective="battery")
    assert plan.hover_time_s == 950.0


def test_all_faults_of_a_statement_at_once(tmp_path: Path) -> None:
    file = tmp_path / "table.toml"
    file.write_text(
        """
mision = "paper"
[known]
flight.model = "regimes"
[free]
flight.acceleration_m_s2 = -1
flight.flight_curent_A = 3
[tied]
flight.charge_power_W = 3
flight.charge_current_A = ["wind.force_N", "flight.nope"]
[resolution]
flight_time = 1
[[rows]]
given = { hover_time_s = -5, laser = 3, rest_time_s = 4 }
fit = { battery_percent = "much", flight_time_s = 3, flight_tim = "x" }
""",
        "utf-8",
    )
    with pytest.raises(InputError) as caught:
        optuav.fit_table([file])
    text = "\n".join(map(str, caught.value.faults))
    for words in (
        "mision = 'paper': unknown key; did you mean 'mission'?",
        "fit.flight_tim = 'x': must be a number",
        "free.flight.acceleration_m_s2 = -1: must be a number, x > 0",
        "flight.flight_curent_A",
        "tied.flight.charge_power_W = 3: must be a list",
        "tied.flight.charge_current_A = 'wind.force_N': must be products of keys that are numbers",
        "tied.flight.charge_current_A = 'flight.nope': must be products",
        "resolution.flight_time = 1: must be 'flight_time_s', 'mission_time_s'",
        "hover_time_s = -5: must be a number, x >= 0",
        "laser = 3: must be true or false",
        "given.building: is missing: where the drone rested",
        "fit.battery_percent = 'much': must be a number",
        "resolution.flight_time_s: must be the step",
    ):
        assert words in text, words


def faults_of(file: Path, text: str) -> list[str]:
    file.write_text(text, "utf-8")
    with pytest.raises(InputError) as caught:
        optuav.fit_table([file])
    return [str(fault).removeprefix(f"{file}: ") for fault in caught.value.faults]


def test_rows_are_tried_on_the_mission(tmp_path: Path) -> None:
    """Their keys and buildings are refused beside their other faults."""
    text = """
free.body.mass_kg = 1
resolution.battery_percent = 0.1
[[rows]]
given = { hover_time_s = -5, bogus = 3 }
fit = { battery_percent = 90 }
[[rows]]
given = { building = "b77", rest_time_s = 3, battery.capacity_As = -3 }
"""
    assert faults_of(tmp_path / "table.toml", text) == [
        "rows[0].given.hover_time_s = -5: must be a number, x >= 0",
        "rows[0].given.bogus = 3: unknown key",
        "rows[1].given.battery.capacity_As = -3: must be a number, 0.001 <= x <= 1e9 [A s]",
        "rows[1].given.building = 'b77': the mission's buildings are: "
        f"{', '.join(f'b{k}' for k in range(1, 11))}; did you mean 'b7'?",
    ]


def test_faults_of_the_mission_and_of_the_rows_come_together(tmp_path: Path) -> None:
    text = """
known.flight.model = "regimes"
free.flight.acceleration_m_s2 = 10
resolution.battery_percent = 0.1
[[rows]]
given = { hover_time_s = -5 }
fit = { battery_percent = 90 }
"""
    first, *rest = faults_of(tmp_path / "table.toml", text)
    assert first == "rows[0].given.hover_time_s = -5: must be a number, x >= 0"
    assert any(words.startswith("flight.hover_power_W: is missing") for words in rest)


def test_whole_numbers_cannot_be_free(tmp_path: Path) -> None:
    """Least squares move a value by little and little; two packs are no 2.0."""
    row = "[[rows]]\ngiven.hover_time_s = 600\nfit.battery_percent = 20\n"
    text = f"free.battery.packs = 2\nresolution.battery_percent = 0.1\n{row}"
    (words,) = faults_of(tmp_path / "table.toml", text)
    assert words.startswith("free.battery.packs = 2.0: must be a key that may have any value")
    assert words.endswith("whole numbers cannot be fitted")


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ('building = "b99", rest_time_s = 3', "the mission's buildings are: b1, b2"),
        ("battery.capacity = 3", "unknown key"),
    ],
)
def test_rows_that_the_mission_does_not_know(given: str, words: str, tmp_path: Path) -> None:
    file = tmp_path / "table.toml"
    file.write_text(
        f"""
[free]
body.mass_kg = 1
[resolution]
battery_percent = 0.1
[[rows]]
given = {{ hover_time_s = 5, {given} }}
fit = {{ battery_percent = 90 }}
""",
        "utf-8",
    )
    with pytest.raises(InputError, match=words):
        optuav.fit_table([file])


def test_rows_may_state_vectors_and_buildings(tmp_path: Path) -> None:
    """`given` takes any key of the mission: the mass, from what two flights in wind leave over."""
    winds = ([0.5, 0, 0], [0, 1, 0])
    rows = []
    for wind in winds:
        flown = {"wind.force_N": wind, "buildings": [{"name": "a", "position_m": [10, 10, 3]}]}
        mission = optuav.load("paper").replace({"body.mass_kg": 1.35, **flown})
        plan = optuav.solve(mission, "P3", perspective="battery")
        assert plan.soc is not None
        rows.append(
            f"""
[[rows]]
given.hover_time_s = {plan.hover_time_s!r}
given.wind.force_N = {wind}
given.buildings = [{{ name = "a", position_m = [10, 10, 3] }}]
fit.battery_percent = {100.0 * plan.soc["battery"]!r}
"""
        )
    file = tmp_path / "table.toml"
    head = "free.body.mass_kg = 1.2\nresolution.battery_percent = 1e-6\n"
    file.write_text(head + "".join(rows), "utf-8")
    assert optuav.fit_table([file]).changes["body.mass_kg"] == pytest.approx(1.35, rel=1e-6)


def test_a_row_that_cannot_be_flown_is_refused(tmp_path: Path) -> None:
    """In a gale no capacity helps, and nothing is proposed."""
    file = tmp_path / "table.toml"
    file.write_text(
        """
[free]
battery.capacity_As = 30000
[resolution]
battery_percent = 0.01
[[rows]]
name = "calm"
given = { hover_time_s = 600 }
fit = { battery_percent = 20 }
[[rows]]
name = "gale"
given = { hover_time_s = 600, wind.force_N = [50, 0, 0] }
fit = { battery_percent = 50 }
""",
        "utf-8",
    )
    with pytest.raises(
        InputError, match="rows = 'gale': must be a row that can be flown"
    ) as caught:
        optuav.fit_table([file])
    assert len(caught.value.faults) == 1


def test_a_table_that_cannot_be_met_is_doubted(tmp_path: Path) -> None:
    """No mass leaves -300 %; the heaviest that flies comes closest."""
    file = tmp_path / "table.toml"
    rows = "".join(
        f"""
[[rows]]
name = "{name}"
given = {{ hover_time_s = {hover_s} }}
fit = {{ battery_percent = {left} }}
"""
        for name, hover_s, left in (("long", 600, -300), ("short", 500, -200))
    )
    head = "free.body.mass_kg = 1.0\nresolution.battery_percent = 0.01\n"
    file.write_text(head + rows, "utf-8")
    found = optuav.fit_table([file])
    (missed,) = found.warnings
    assert "2 of 2 numbers are missed by more than their rounding" in missed
    assert found.data == "2 numbers of the table fitted by 1 free key, 0 predicted"


def test_one_missing_resolution_is_one_fault(tmp_path: Path) -> None:
    """With a count of the numbers that need it, and no suggestion where no key is like it."""
    file = tmp_path / "table.toml"
    row = "[[rows]]\ngiven.hover_time_s = 600\nfit.battery_percent = 20\n"
    file.write_text(f"free.flight.nope = 3\n{4 * row}", "utf-8")
    with pytest.raises(InputError) as caught:
        optuav.fit_table([file])
    key, resolution = (str(fault).removeprefix(f"{file}: ") for fault in caught.value.faults)
    assert key == "flight.nope = 3.0: unknown key"
    assert resolution.startswith("resolution.battery_percent: must be the step")
    assert resolution.endswith("for 4 numbers")


def test_rests_and_other_keys_may_be_free(tmp_path: Path) -> None:
    """The mass of a rotor mission, from what a plan with a rest leaves in its battery."""
    mission = optuav.load("paper").replace({"body.mass_kg": 1.35})
    plan = optuav.solve(mission, optuav.P4("b1", order="rest-first"), perspective="battery")
    assert plan.soc is not None
    file = tmp_path / "table.toml"
    file.write_text(
        f"""
[free]
body.mass_kg = 1.2
[resolution]
battery_percent = 1e-6
energy_percent = 1
adjusted_percent = 1
[[rows]]
given.hover_time_s = {plan.hover_time_s!r}
given.rest_time_s = {plan.rest_time_s!r}
given.building = "b1"
fit.battery_percent = {100.0 * plan.soc["battery"]!r}
check.energy_percent = {100.0 * plan.soc["energy"]!r}
check.adjusted_percent = {100.0 * plan.soc["adjusted"]!r}
""",
        "utf-8",
    )
    found = optuav.fit_table([file])
    assert found.changes["body.mass_kg"] == pytest.approx(1.35, rel=1e-6)
    for panel in found.panels:
        assert panel.fitted == pytest.approx(panel.observed, abs=1e-4), panel.quantity
