"""Comparisons of plans, by perspective and trajectory or by schedule, and their pictures."""

from __future__ import annotations

import csv
import dataclasses
import io
import json
import re
from pathlib import Path
from typing import Any

import pytest

import optuav
from formulations.soc import PAPER
from optuav.errors import InputError
from optuav.studies.results import Comparison
from tests.wells import SLOW


def two_buildings(name: str) -> optuav.Mission:
    """A shipped mission with b1 and b9 alone."""
    mission = optuav.load(name)
    kept = [each.model_dump() for each in mission.buildings if each.name in ("b1", "b9")]
    return mission.replace({"buildings": kept})


@pytest.fixture(scope="module")
def table2() -> Comparison:
    """Perspectives by trajectories on `paper-table2`, in slots of 1 s as in the paper."""
    return optuav.compare(two_buildings("paper-table2"), by=BOTH, slots_s=1.0)


BOTH = ("perspective", "trajectory")


def hovers(found: Comparison) -> dict[tuple[str, str], float | None]:
    return {(row["perspective"], row["trajectory"]): row["hover_time_s"] for row in found.rows}


def test_every_pair_in_the_order_of_the_paper_and_then_available(table2: Comparison) -> None:
    pairs = [(row["perspective"], row["trajectory"]) for row in table2.rows]
    perspectives = ("battery", "energy", "adjusted", "available")
    trajectories = ("direct", "traj1", "traj2", "optimal")
    assert pairs == [(p, t) for p in perspectives for t in trajectories]


def test_available_alone_never_runs_dry(of_paper: Comparison) -> None:
    """597.27 s that can be flown, where `battery` promises 719.54 s and falls before its end."""
    rows = {row["perspective"]: row for row in of_paper.rows if row["trajectory"] == "optimal"}
    assert rows["available"]["hover_time_s"] == pytest.approx(597.2698, abs=1e-4)
    assert rows["available"]["runs_dry_s"] is None
    assert rows["battery"]["hover_time_s"] == pytest.approx(719.5399, abs=1e-4)
    assert rows["battery"]["runs_dry_s"] is not None


def test_direct_flights_are_those_of_table_2(table2: Comparison) -> None:
    """950, 697 and 950 s at T_max = 1200 s; η1 = 28.3 % belongs to 697 s."""
    found = hovers(table2)
    assert [found[p, "direct"] for p in ("battery", "energy", "adjusted")] == [950.0, 697.0, 950.0]
    energy = next(row for row in table2.rows if row["perspective"] == "energy")
    assert 100.0 * energy["soc_battery"] == pytest.approx(28.3, abs=0.05)


def test_at_800_s_the_deadline_ends_two_of_them() -> None:
    """740.65, 697, 740.65 s."""
    mission = optuav.load("paper-table2").replace({"limits.deadline_s": 800, "buildings": []})
    found = hovers(optuav.compare(mission, by=BOTH, slots_s=1.0))
    direct = [found[each, "direct"] for each in ("battery", "energy", "adjusted")]
    assert direct == pytest.approx([740.65, 697.0, 740.65], abs=0.005)


def test_every_plan_is_the_one_that_solve_finds(table2: Comparison) -> None:
    for row in table2.rows[1:-1:4]:
        plan = optuav.solve(
            table2.mission,
            optuav.P1(trajectory=row["trajectory"]),
            perspective=row["perspective"],
            slot_s=1.0,
        )
        assert row["hover_time_s"] == plan.hover_time_s
        assert row["mission_time_s"] == plan.mission_time_s
        assert {name: row[f"soc_{name}"] for name in PAPER} == plan.soc
        assert row["route"] == plan.route
        assert row["flyable"] is plan.flyable
        assert (row["runs_dry_s"], row["overfull_s"]) == (plan.runs_dry_s, plan.overfull_s)
        assert row["proof"] == plan.proof


@pytest.mark.parametrize(
    ("by", "options", "pairs"),
    [
        (("perspective",), {}, 4),
        (("trajectory",), {"perspective": "energy"}, 4),
        (("trajectory", "perspective"), {}, 16),
    ],
)
def test_one_choice_alone_keeps_the_other(
    by: tuple[str, ...], options: dict[str, Any], pairs: int
) -> None:
    direct_only = optuav.load("paper").replace({"buildings": []})
    found = optuav.compare(direct_only, by=by, **options)
    assert len(found.rows) == pairs
    if by == ("perspective",):
        assert {row["trajectory"] for row in found.rows} == {"optimal"}
    if by == ("trajectory",):
        assert {row["perspective"] for row in found.rows} == {"energy"}
        assert found.rows[0]["hover_time_s"] == pytest.approx(524.628, abs=1e-3)


@pytest.mark.parametrize(
    ("by", "perspective", "words"),
    [
        (("problem",), "battery", "or only method, schedule or speed"),
        ((), "battery", "at least one of"),
        (("trajectory", "trajectory"), "battery", "each once"),
        (("trajectory",), "wells", "one of battery, energy, adjusted, available"),
        (("perspective",), "energy", "is compared by already"),
    ],
)
def test_what_cannot_be_varied_is_refused(
    by: tuple[str, ...], perspective: str, words: str
) -> None:
    with pytest.raises(InputError, match=words):
        optuav.compare("paper", by=by, perspective=perspective)


def test_whether_a_plan_flies_stands_beside_its_name(of_paper: Comparison) -> None:
    """A phone shows the first columns of a wide table."""
    heads = re.findall(r"<th[^>]*>([^<]*)", of_paper._repr_html_())
    assert heads[:3] == ["perspective", "trajectory", "flies"]
    assert str(of_paper).splitlines()[4].split()[:3] == ["perspective", "trajectory", "flies"]


def test_where_there_is_no_plan_the_table_says_why() -> None:
    mission = optuav.load("paper").replace({"limits.deadline_s": 60})
    found = optuav.compare(mission, by="trajectory", perspective="battery")
    assert [row["hover_time_s"] for row in found.rows] == [None] * 4
    assert str(found).count("none") == 12
    assert "Because the flight takes 75.79 s" in str(found)
    assert found.records()[0]["soc_battery"] is None


def test_data_are_plain_and_the_same_again(table2: Comparison) -> None:
    data = table2.to_dict()
    assert json.loads(json.dumps(data, allow_nan=False)) == data
    assert (
        optuav.compare(table2.mission, by="trajectory", perspective="battery", slots_s=1.0).rows
        == table2.rows[:4]
    )
    rows = list(csv.DictReader(io.StringIO(table2.to_csv())))
    assert [float(row["hover_time_s"]) for row in rows] == [r["hover_time_s"] for r in table2.rows]
    assert rows[1]["route"] == "origin > b9 > hover > destination"


def test_a_frame_has_a_row_a_plan(table2: Comparison) -> None:
    pytest.importorskip("pandas")
    frame = table2.to_frame()
    assert frame.pivot(index="perspective", columns="trajectory", values="hover_time_s").shape == (
        (4, 4)
    )


def test_printed_it_fits_80_columns(table2: Comparison) -> None:
    lines = str(table2).splitlines()
    assert max(map(len, lines)) <= 80
    assert lines[0] == "paper-table2: longest hover by perspective and trajectory, slots of 1 s"
    assert lines[2].startswith("Longest      ")  # The verdict comes first
    first = re.split("  +", lines[5])
    assert first[:2] == ["battery", "direct"]
    assert first[2].startswith("dry ")
    assert first[3:7] == ["950.00", "0.00", "1009.35", "5.09"]


@pytest.fixture(scope="module")
def of_paper() -> Comparison:
    """Perspectives by trajectories on `paper`, in continuous times."""
    return optuav.compare("paper", by=BOTH)


def flies_in(found: Comparison) -> list[str]:
    """The first column after the labels."""
    head, *lines = str(found).splitlines()[4 : 5 + len(found.rows)]
    return [line[head.index("flies") :].partition("  ")[0] for line in lines]


def test_the_text_shows_what_can_be_flown_and_how_each_is_known(of_paper: Comparison) -> None:
    """What comes first: resting first charges past full long before `battery` runs dry."""
    flies = flies_in(of_paper)
    overfull = ["full 364 s", "full 157 s", "full 157 s"]
    charge_only = ["dry 660 s", *overfull]
    assert flies == [*charge_only, "yes", *overfull, *charge_only, *["yes"] * 4]
    assert str(of_paper).splitlines()[2] == (
        "Longest      597.27 s of hover: available traj1 and available optimal"
    )
    assert str(of_paper).splitlines()[22:] == [
        "dry: cannot be flown, no available charge is left then",
        "full: cannot be flown, charging would drive the available well past full",
        "",
        "battery, energy, adjusted: closed form: linear programming duality",
        "available: bracketed: a feasible time, and proof that none is longer",
    ]
    assert [row["flyable"] for row in of_paper.records()] == [each == "yes" for each in flies]


def test_plans_of_one_perspective_that_are_known_otherwise_are_named() -> None:
    """At 80 s the direct flight alone leaves time: a plan by one proof, none by another."""
    late = optuav.load("paper").replace({"limits.deadline_s": 80})
    lines = str(optuav.compare(late, by="trajectory", perspective="available")).splitlines()
    known = " ".join(" ".join(lines[10:12]).split())
    assert known.startswith(
        "available: bracketed: a feasible time, and proof that none is longer; "
    )
    assert known.endswith("bracketed: proof that no times satisfy all constraints")


def test_too_little_charge_at_the_end_is_shown() -> None:
    """`adjusted` trusts a voltage that falls with the load: 19.99 % are left where 20 % must be."""
    found = optuav.compare(optuav.load("matrice350").replace(SLOW), by="perspective")
    assert flies_in(found) == ["yes", "yes", "low", "yes"]
    assert "\nlow: cannot be flown, less than limits.min_soc is left" in str(found)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"runs_dry_s": 300.0}, "dry 300 s"),
        ({"runs_dry_s": 300.0, "overfull_s": 400.0}, "dry 300 s"),
        ({"runs_dry_s": 400.0, "overfull_s": 300.0}, "full 300 s"),
        ({"soc_battery": 0.05 - 2e-6}, "low"),
        ({"soc_battery": 0.05 - 1e-9}, "no"),
    ],
)
def test_what_keeps_a_plan_from_flying_is_shown(
    of_paper: Comparison, changed: dict[str, Any], words: str
) -> None:
    """The earlier of two moments; charge is low where an audit misses some, not by rounding."""
    rows = of_paper.rows[12:]
    row = {**rows[0], "flyable": False, **changed}
    grounded = dataclasses.replace(of_paper, rows=(row, *rows[1:]))
    assert flies_in(grounded) == [words, "yes", "yes", "yes"]
    assert f"\n{words.partition(' ')[0]}: cannot be flown, " in str(grounded)


def test_long_names_of_roofs_give_way_to_every_figure() -> None:
    """On 80 columns the way has a part of its own; the figures are those of short names."""
    paper = optuav.load("paper")
    data = paper.to_dict()
    for building in data["buildings"]:
        building["name"] = f"roof {building['name']} of the national research centre"
    short, long = (
        str(optuav.compare(mission, by="trajectory", perspective="battery")).splitlines()
        for mission in (paper, optuav.Mission.from_dict(data))
    )
    assert max(map(len, long)) <= 80
    assert long[11].endswith("  roof b9 of the national…")
    for was, figures in zip(short[4:9], long[4:9], strict=True):
        assert was.startswith(f"{figures}  ")


# By schedule


@pytest.fixture(scope="module")
def schedules() -> Comparison:
    """`paper` in slots of 40 s."""
    return optuav.compare(
        two_buildings("paper"), by="schedule", slots_s=40.0, periods_s=(30.0, 90.0)
    )


def test_one_row_a_schedule_and_a_period(schedules: Comparison) -> None:
    assert [(row["schedule"], row["period_s"]) for row in schedules.records()] == [
        ("pooled", None),
        ("sequential", None),
        ("round-robin", None),
        ("alternating", 30.0),
        ("alternating", 90.0),
        ("most-available", None),
    ]


def test_what_a_schedule_brings_is_counted_from_pooled_packs(schedules: Comparison) -> None:
    pooled = optuav.solve(schedules.mission, perspective="available", slot_s=40.0)
    assert schedules.rows[0]["hover_time_s"] == pooled.hover_time_s
    for row in schedules.records():
        assert row["brings_s"] == row["hover_time_s"] - pooled.hover_time_s
    assert schedules.records()[1]["brings_s"] < 0.0


def test_text_and_files_hold_the_same_figures(schedules: Comparison) -> None:
    rows = list(csv.DictReader(io.StringIO(schedules.to_csv())))
    hovers_s = [row["hover_time_s"] for row in schedules.rows]
    assert [float(row["hover_time_s"]) for row in rows] == hovers_s
    text = str(schedules)
    assert all(f"{hover_s:.2f}" in text for hover_s in hovers_s)
    assert max(map(len, text.splitlines())) <= 80
    assert schedules.to_dict()["mission"] == schedules.mission.to_dict()


def test_a_mission_s_own_period_is_among_them() -> None:
    own = optuav.load("paper").replace(
        {"battery.schedule": "alternating", "battery.period_s": 45, "buildings": []}
    )
    periods = [
        row["period_s"] for row in optuav.compare(own, by="schedule", slots_s=40.0).records()
    ]
    assert periods == [None, None, None, 45.0, 60.0, None]


def test_periods_are_judged() -> None:
    with pytest.raises(InputError, match="periods_s"):
        optuav.compare("paper", by="schedule", periods_s=(0.0, -5.0))


# Pictures

SLOTS_S = (1.0, 10.0, 60.0)


def small(**values: Any) -> optuav.Mission:
    mission = optuav.load("paper")
    kept = [each.model_dump() for each in mission.buildings if each.name == "b1"]
    return mission.replace({"buildings": kept} | values)


@pytest.fixture(scope="module")
def by_method() -> Comparison:
    """`paper` with one building, by the grid."""
    return optuav.compare(small(), slots_s=SLOTS_S, engines=("grid",), perspective="battery")


def test_files_of_a_comparison(by_method: Comparison, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    written = by_method.save_pictures(tmp_path / "new")
    assert [path.name for path in written] == ["gaps.png", "gaps.svg", "gaps.pdf"]
    begins = [path.read_bytes()[:5] for path in written]
    assert begins == [b"\x89PNG\r", b"<?xml", b"%PDF-"]


def test_without_slots_or_plans_there_is_nothing_to_draw(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    direct = optuav.load("paper").replace({"buildings": []})
    assert optuav.compare(direct, slots_s=(), engines=()).save_pictures(tmp_path) == []
    late = optuav.compare(small(**{"limits.deadline_s": 60}), slots_s=(10.0,), engines=("grid",))
    assert late.save_pictures(tmp_path) == []


def test_files_of_plans(of_paper: Comparison, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    written = of_paper.save_pictures(tmp_path)
    assert [path.name for path in written] == ["choices.png", "choices.svg", "choices.pdf"]


def test_gaps_are_drawn_as_shares_of_a_slot_below_their_bound(by_method: Comparison) -> None:
    """Of all buildings the largest, and of P3 what rounding down to whole slots takes."""
    pytest.importorskip("matplotlib")
    from matplotlib.colors import to_rgba

    from optuav.plots.style import GREY

    ax = by_method.plot()["gaps.png"].axes[0]
    assert [text.get_text() for text in ax.get_xticklabels()] == ["1 s", "10 s", "60 s"]
    p3 = [bar.get_height() for bar in ax.patches if bar.get_facecolor() == to_rgba(GREY)]
    assert p3 == pytest.approx([84.8, 88.48, 100.0 * 28.848 / 60.0], abs=0.01)
    levels = sorted({line.get_ydata()[0] for line in ax.lines})
    assert levels == [0.0, pytest.approx(200.0)]


def test_batteries_that_not_all_engines_take_are_refused_with_all_their_settings() -> None:
    """Packs in turns are simulated, and a charge that tapers has kinks, which CasADi refuses."""
    settings = {"schedule": "alternating", "period_s": 60.0, "charging": "taper"}
    mission = small(**{f"battery.{name}": value for name, value in settings.items()})
    with pytest.raises(InputError) as refusal:
        optuav.compare(mission, slots_s=[60.0])
    keys = [fault.key for fault in refusal.value.faults]
    assert keys == ["battery.schedule", "battery.charging"]
    found = optuav.compare(mission, slots_s=[60.0], engines=["grid"], perspective="battery")
    assert found.agrees


def test_an_engine_that_is_not_compared_is_refused() -> None:
    """An engine for linear programmes is not left out of `available` in silence."""
    words = "engines = 'cvxpy': must be some of bracket, casadi, grid in the perspective available"
    with pytest.raises(InputError, match=words):
        optuav.compare("paper", engines=["cvxpy"], slots_s=[60.0])
    with pytest.raises(InputError, match="engines = 'bracket': must be some of closed-form, cvxpy"):
        optuav.compare("paper", engines=["bracket"], slots_s=[60.0], perspective="battery")
