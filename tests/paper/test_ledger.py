"""The ledger: no verdict is kinder than the printed digits allow, and Table II adds up."""

from __future__ import annotations

import csv
import inspect
import io
import math
import shlex
from decimal import Decimal
from typing import Any

import pytest

import optuav
from optuav.paper import ledger, table2
from optuav.paper.ledger import STATEMENTS, Entry, Ledger, PaperStatement, Verdict, agrees, fits
from optuav.paper.table2 import admitted, loads_exist
from tests.cli.run import refused, run

MATCHING = {Verdict.MATCHED, Verdict.CUT, Verdict.RECOVERED, Verdict.FITTED}


@pytest.fixture(scope="module")
def found() -> Ledger:
    return optuav.ledger()


@pytest.fixture(scope="module")
def by_name(found: Ledger) -> dict[str, Entry]:
    return {entry.statement.name: entry for entry in found.entries}


def entry(stated: str, value: float | None, *, limit: bool = False) -> Entry:
    """An entry of one value by the printed parameters."""
    paper = PaperStatement(name="n", place="p", what="w", stated=stated, how="h", limit=limit)
    return Entry(paper, value, None)


@pytest.mark.parametrize(
    ("stated", "value", "same"),
    [
        ("28.30", 28.3049, True),
        ("28.30", 28.3052, False),
        ("28.3", 28.3052, True),
        ("36000", 36000.4, True),
        ("36000", 36000.6, False),
        ("3.8305e-6", 3.83047e-6, True),
        ("3.8305e-6", 3.83044e-6, False),
        ("-12.79", -12.7949, True),
        ("740.65", 740.6500594089558, True),
    ],
)
def test_a_number_matches_at_its_printed_digits_only(stated: str, value: float, same: bool) -> None:
    assert agrees(stated, value) is same


@pytest.mark.parametrize(("value", "same"), [(11.5791, True), (11.5801, False), (11.5699, False)])
def test_a_limit_may_be_cut_and_the_verdict_says_so(value: float, same: bool) -> None:
    """11.58 N could not be held where 11.5791 N is the most."""
    for sign, stated in ((1.0, "11.57"), (-1.0, "-11.57")):
        verdict = entry(stated, sign * value, limit=True).verdict
        assert (verdict is Verdict.CUT) is same
        assert entry(stated, sign * value).verdict is not Verdict.CUT
    assert entry("11.58", 11.5791, limit=True).verdict is Verdict.MATCHED


def test_nothing_matches_outside_its_digits(found: Ledger) -> None:
    """Half a unit of the last digit, or one unit inside a limit, by other arithmetic."""
    compared = 0
    for entry in found.entries:
        stated = entry.statement
        values = [each for each in (entry.printed, entry.recovered) if isinstance(each, float)]
        if entry.verdict not in MATCHING or not values:
            continue
        unit = 10.0 ** int(Decimal(stated.stated).as_tuple().exponent)
        allowed = unit * (1.0 if entry.verdict is Verdict.CUT else 0.5) * (1.0 + 1e-9)
        assert min(abs(value - float(stated.stated)) for value in values) <= allowed, stated.name
        compared += 1
    assert compared > 45


def test_every_number_has_a_name_a_place_and_a_reason_where_it_fails(found: Ledger) -> None:
    names = [entry.statement.name for entry in found.entries]
    assert len(set(names)) == len(names) > 70
    for entry in found.entries:
        assert entry.statement.place
        assert entry.statement.how
        assert entry.verdict in MATCHING or entry.reason, entry.statement.name


def test_no_verdict_is_left_open(found: Ledger) -> None:
    """Whatever does not match is either impossible in the paper itself, or cannot be decided."""
    assert Verdict.DIFFERS not in found.counts
    assert sum(found.counts.values()) == len(found.entries)


PRINTED = {
    "route.origin_m": (0, 0, 50),
    "route.destination_m": (2000, 0, 50),
    "laser.position_m": (1000, 0, 50),
    "link.device_m": (1000, 3000, 0),
    "limits.slot_s": 1,
    "battery.packs": 2,
    "battery.capacity_As": 36000,
    "battery.nominal_voltage_V": 11.1,
    "link.path_loss_exponent": 2,
    "link.rice_factor": 20,
    "link.noise_power_W": 1e-4,
    "link.snr_threshold_dB": -11,
    "limits.outage_probability": 1e-2,
    "limits.min_altitude_m": 50,
    "limits.max_altitude_m": 100,
    "rotor.max_speed_rad_s": 1060,
    "body.mass_kg": 1.3,
    "laser.emitter_slope": 0.34,
    "laser.emitter_offset_W": -1.1,
    "laser.receiver_slope": 0.5434,
    "laser.receiver_offset_W": -0.2761,
    "laser.wavelength_nm": 1550,
    "link.transmit_power_W": 5,
    "rotor.friction_torque_Nm": 0.04,
    "rotor.resistance_ohm": 0.2,
    "rotor.velocity_constant_rpm_V": 920,
    "battery.available_fraction": 0.8,
    "battery.charge_current_A": 10,
    "rotor.viscous_damping_Nm_s_rad": 2e-4,
    "link.transmit_voltage_V": 1,
    "rotor.inertia_kg_m2": 4.1904e-5,
    "battery.flow_rate_per_s": 4.5e-5,
}


def test_the_missions_have_the_printed_settings() -> None:
    """Section V and Table I."""
    for mission in (optuav.load("paper"), optuav.load("paper-table2")):
        for key, printed in PRINTED.items():
            section, _, name = key.partition(".")
            assert getattr(getattr(mission, section), name) == printed, key
        assert len(mission.buildings) == 10
        assert {each.position_m[2] for each in mission.buildings} == {60, 80, 100}


def test_every_computation_is_used_and_every_name_exists() -> None:
    """By the file of the statements, which names them."""
    named = {known[0] for each in STATEMENTS for known in (each.compute, each.room) if known}
    functions = inspect.getmembers(ledger, inspect.isfunction)
    public = {
        name
        for name, each in functions
        if each.__module__ == ledger.__name__ and not name.startswith("_")
    }
    assert named == (public | ledger.FORMULAS.keys()) - {"agrees", "fits", "ledger"}


@pytest.mark.parametrize(
    ("name", "verdict"),
    [
        ("eq5-c9", Verdict.CONTRADICTS),
        ("eq25-signs", Verdict.CONTRADICTS),
        ("text-e1", Verdict.MATCHED),
        ("text-e2", Verdict.CONTRADICTS),
        ("text-voltage-hover", Verdict.RECOVERED),
        ("text-voltage-flight", Verdict.RECOVERED),
        ("fig3-best", Verdict.RECOVERED),
        ("fig5-best", Verdict.MATCHED),
        ("fig7-drop-10", Verdict.RECOVERED),
        ("fig7-drop-15", Verdict.RECOVERED),
        ("fig7-speed", Verdict.MATCHED),
        ("fig7-energy", Verdict.UNDECIDED),
        ("model-altitude", Verdict.MATCHED),
        ("fig8-optimum", Verdict.UNDECIDED),
        ("fig8-crossing", Verdict.FITTED),
        ("fig8-saturation", Verdict.UNDECIDED),
        ("fig9-limit-x-plus", Verdict.CUT),
        ("fig9-limit-z-plus", Verdict.CUT),
        ("fig9-limit-z-minus", Verdict.CONTRADICTS),
        ("fig10-efficiency", Verdict.UNDECIDED),
    ],
)
def test_verdicts_on_the_results(by_name: dict[str, Entry], name: str, verdict: Verdict) -> None:
    assert by_name[name].verdict is verdict


def test_table_2_has_24_cells_that_match_2_at_an_edge_and_4_that_cannot(found: Ledger) -> None:
    """In every row Δ or T follows from the fitted 59.35 s; eight states of charge were fitted."""
    of_table = found.table2
    verdicts = [cell.verdict for cell in of_table]
    assert len(of_table) == 30
    assert verdicts.count(Verdict.FITTED) == 6 + 8
    assert verdicts.count(Verdict.RECOVERED) == 10
    assert verdicts.count(Verdict.WITHIN) == 2
    contradicted = [c.statement.stated for c in of_table if c.verdict is Verdict.CONTRADICTS]
    assert contradicted == ["-12.79", "-12.79", "11.71", "33.17"]


def test_two_cells_miss_their_last_digit(by_name: dict[str, Entry]) -> None:
    """28.3052 and 5.0849 by the shipped loads, where 28.30 and 5.09 are printed."""
    for name, exact in (("table2-2-eta3", 28.3052), ("table2-6-eta3", 5.0849)):
        assert by_name[name].verdict is Verdict.WITHIN
        assert by_name[name].recovered == pytest.approx(exact, abs=5e-5)


def test_loads_nearby_show_all_cells_but_four() -> None:
    """By hand: a direct path of 59.35 s, and the shipped loads but for two powers."""
    flight_W, hover_W = table2.TABLE["show_all"].values()
    flight_s = 59.34994
    for eta, hover_s, stated in table2.CONSISTENT:
        spent = {
            1: (93.658 * flight_s + (72.073 - 5.992) * hover_s) / 72000.0,
            2: (flight_W * flight_s + (hover_W - 66.515) * hover_s) / 799200.0,
            3: flight_W * flight_s / 1108800.0
            + hover_W * hover_s / 1031760.0
            - 66.515 * hover_s / 799200.0,
        }[eta]
        assert f"{100.0 * (1.0 - spent):.2f}" == stated, (eta, hover_s)


def test_one_set_of_loads_shows_all_cells_but_four() -> None:
    """Each of the four makes the linear programme infeasible, whichever Δ it is read at."""
    assert loads_exist(table2.CONSISTENT)
    for number, hover_s, stated in (
        (2, 740.65, "-12.79"),
        (2, 741.0, "-12.79"),
        (3, 950.0, "11.71"),
        (3, 697.0, "33.17"),
    ):
        assert not loads_exist((*table2.CONSISTENT, (number, hover_s, stated)))


def test_a_line_through_two_cells_bounds_the_third() -> None:
    """η2 at Δ = 740.65 s, by hand: between its values at 697 and 950 s, rounding included."""
    low, high = admitted(2, 740.65)
    share = 43.65 / 253.0
    by_hand = [(1.0 - share) * 5.01 + share * -25.58 + 0.005 * sign for sign in (-1.0, 1.0)]
    assert by_hand[0] - 1e-9 <= low <= high <= by_hand[1] + 1e-9
    assert not fits("-12.79", (low, high))


def test_the_fit_has_as_many_parameters_as_numbers() -> None:
    """So only the cells that were not fitted test it."""
    assert len(table2.TABLE["free_parameters"]) == table2.TABLE["different_numbers"] == 6


def test_the_printed_columns_are_those_of_the_table(by_name: dict[str, Entry]) -> None:
    """T − Δ is one flight time in all six rows, and η stands after Δ in whole slots."""
    for row in range(1, 7):
        hover, mission, *charges = (
            by_name[f"table2-{row}-{each}"].statement
            for each in ("hover", "mission", "eta1", "eta2", "eta3")
        )
        assert math.isclose(float(mission.stated) - float(hover.stated), 59.35, abs_tol=1e-9)
        whole_s = math.ceil(float(hover.stated))
        assert [each.compute[1:] for each in charges] == [[1, whole_s], [2, whole_s], [3, whole_s]]
        assert hover.compute[1:] == mission.compute[1:]


def test_a_chosen_entry_is_the_same_as_in_the_whole(by_name: dict[str, Entry]) -> None:
    (alone,) = optuav.ledger(["fig8-crossing"]).entries
    whole = by_name["fig8-crossing"]
    assert (alone.printed, alone.recovered) == (whole.printed, whole.recovered)


def test_a_whole_name_chooses_one_entry_and_a_beginning_all() -> None:
    """`fig8-saving` is an entry, and the beginning of another."""
    for name, number in (("fig8-saving", 1), ("fig8-sav", 2)):
        assert len(optuav.ledger([name]).entries) == number
        assert optuav.ledger(name) == optuav.ledger([name])


@pytest.mark.parametrize(
    ("stated", "number"), [("1e-4", True), ("-12.79", True), ("rises", False), ("1 + √2", False)]
)
def test_findings_in_words_are_counted_apart(stated: str, number: bool) -> None:
    assert entry(stated, None).statement.is_number is number
    words = "0 of them in words" if number else "1 of them in words"
    assert words in Ledger((entry(stated, None),)).summary


def test_commands_run() -> None:
    """Each entry's own command exists; the ledger's takes the name of every entry."""
    commands = {each.command for each in STATEMENTS if each.command}
    for command in sorted(commands):
        program, *arguments = shlex.split(command)
        assert program == "optuav"
        assert run(*arguments).code == 0
    assert "verdict      used in the fit" in run("ledger", "fig8-crossing").out


def test_command_line(found: Ledger) -> None:
    """A summary by default, every entry on request."""
    summary = run("ledger").out
    assert summary.startswith("73 statements of the paper, 14 of them in words")
    words = " ".join(summary.split())
    assert " text-e2 1032036 J 1031760 1031760 " in words
    assert " fig7-energy rises does not always rise – " in words
    assert "text-e1" not in summary
    assert "verdict      matched" not in summary
    details = run("ledger", "--details").out
    assert all(f"{each.statement.name}  " in details for each in found.entries)
    assert len(summary.splitlines()) < 50 < len(details.splitlines())
    for text in (summary, details):
        assert "`paper-table2` has recovered parameters: loads fitted" in " ".join(text.split())
    assert "optuav ledger fig7-energy" not in details  # which is what its reader just ran
    unknown = refused("ledger", "nosuch")
    assert (
        "name = 'nosuch': must be the name of an entry, or a beginning of names: source, eq5"
        in unknown
    )
    assert "fig9, fig10" in unknown
    assert "did you mean 'table2'?" in refused("ledger", "table3")
    assert "--save" in refused("ledger", "text-e1", "--save", "ledger.txt")


def test_reasons_state_right_numbers(by_name: dict[str, Entry]) -> None:
    """Those that the file states of our own plans, found again by `solve` and by hand."""
    paper, recovered = optuav.load("paper"), optuav.load("paper-table2")

    def hover_s(
        mission: optuav.Mission, problem: Any = "P1", perspective: Any = "battery"
    ) -> float:
        return optuav.solve(mission, problem, perspective=perspective).hover_time_s

    two, one = (hover_s(paper, optuav.P1(stops=most), "available") for most in (2, 1))
    optima = {each.name: hover_s(recovered, optuav.P4(each.name)) for each in recovered.buildings}
    least = {
        soc: hover_s(recovered.replace({"limits.min_soc": soc}), optuav.P4("b1"))
        for soc in (0.05, 0.1, 0.15)
    }
    shown = {
        "model-one-rest": [f"{two:.3f} s in `paper`", f"{one:.3f} s"],
        "fig8-optimum": [f"{min(optima.values()):.2f} to {max(optima.values()):.2f} s"],
        "fig7-drop-10": [f"{100.0 * (1.0 - least[0.1] / least[0.05]):.2f} %"],
        "fig7-drop-15": [f"{100.0 * (1.0 - least[0.15] / least[0.05]):.2f} %"],
        "fig5-same": [f"{hover_s(recovered, perspective=p):.2f}" for p in ("battery", "adjusted")],
        "fig8-crossing": [f"{hover_s(each):.2f} s of `{each.name}`" for each in (paper, recovered)],
    }
    for name, parts in shown.items():
        for part in parts:
            assert part in by_name[name].reason, name


def test_the_csv_has_a_line_an_entry() -> None:
    chosen = optuav.ledger(["table2-4"])
    rows = list(csv.DictReader(io.StringIO(chosen.to_csv())))
    assert [row["stated"] for row in rows] == ["950", "1009.35", "5.09", "-25.58", "11.71"]
    assert {row["verdict"] for row in rows} <= {verdict.value for verdict in Verdict}
