"""What plans did on PyBaMM's cells, as stored in ``benchmarks/cells.json``, and some again."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path
from statistics import fmean
from typing import Any

import pytest

from benchmarks import cells
from optuav.physics.cells import CELLS
from optuav.physics.kibam import Battery, time_to_empty
from optuav.physics.packs import lifetime

ROOT = Path(__file__).parents[1]
STORED: dict[str, Any] = json.loads(cells.FILE.read_text("utf-8"))
FLOWN = [name for name, cell in STORED.items() if cell["like"] == "lipo"]
FALLS_S = {"paper": (1157.0, 1172.4, 1159.3), "paper-table2": (1176.4, 1182.3, 1171.8)}
HOVERS_S = {"paper": (597.270, 619.649), "paper-table2": (827.297, 884.240)}
NEVER_LONGER = (
    1.0015  # The simulated lifetimes of Ai2020 and Chen2020 at 2 C are 0.01, 0.12 % less.
)


def wells(name: str) -> Battery:
    """The wells in the package for the kind of a cell."""
    own = CELLS[STORED[name]["like"]]
    return Battery(cells.PACK_As, own.available_fraction, own.flow_rate_per_s)


def gaps(name: str, by: str) -> list[float]:
    """By how much the hovers of plans are longer than the longest of a cell."""
    rows = STORED[name]["missions"]
    return [row["plans"][by]["hover_s"] / row["longest_s"] - 1.0 for row in rows]


def test_the_file_holds_every_cell_and_mission() -> None:
    """Each set with its loads, and as many missions as the pages say."""
    assert [*STORED] == [*cells.SETS]
    for name, cell in STORED.items():
        kind = cells.SETS[name]
        assert {key: cell[key] for key in kind._fields} == kind._asdict()
        assert cell["lifetimes"][0]["load_C"] == [[0.2, 3600.0]]
        assert len(cell["wells"]) == 5
        assert all({*row["by_s"]} == {*cell["wells"]} for row in cell["lifetimes"])
        missions = cell.get("missions", [])
        assert len(missions) == (cells.MISSIONS if name in FLOWN else 0)
        assert all({*row["plans"]} == {*cell["wells"]} for row in missions)
        assert len(cell.get("shipped", [])) == (6 if cell["most_C"] >= 5.0 else 0)


@pytest.mark.parametrize("name", STORED)
def test_shipped_wells_are_never_longer_than_cells(name: str) -> None:
    """Also with pauses; the rated charge is that at 0.2 C."""
    first, *_ = rows = STORED[name]["lifetimes"]
    assert first["lifetime_s"] == pytest.approx(18_000.0, rel=2e-3)
    pack = wells(name)
    for row in rows:
        load = [(cells.PACK_A * rate_C, lasts_s) for rate_C, lasts_s in row["load_C"]]
        if len(load) == 1:
            own_s = time_to_empty(pack, pack.full, -load[0][0])
        else:
            own_s = lifetime(
                load,
                capacity_As=cells.PACK_As,
                available_fraction=float(pack.available_fraction),
                flow_rate_per_s=float(pack.flow_rate_per_s),
            )
        assert own_s <= NEVER_LONGER * row["lifetime_s"], row
        assert own_s == pytest.approx(row["by_s"][STORED[name]["like"]], rel=1e-5)


@pytest.mark.parametrize("name", FLOWN)
def test_plans_that_promise_a_flight_do_not_fall(name: str) -> None:
    """By the wells in the package, and by wells that are fitted and never longer than measured."""
    least = {"paper": -0.15, "lipo": -0.075, "never longer": -0.06}
    for by, gap in {**least, "never longer, constant loads": -0.06}.items():
        assert all(row["plans"][by]["falls_s"] is None for row in STORED[name]["missions"])
        assert gap < fmean(gaps(name, by)) < 0.01
    falls = [row["plans"]["charge only"]["falls_s"] for row in STORED[name]["missions"]]
    assert sum(fall is not None for fall in falls) > 0.8 * len(falls)


def test_the_page_tells_how_far_cells_are_overcharged() -> None:
    """Past the voltage at which they count as full; 0.12 V by `lipo`, and the published rests."""
    full_V = dict.fromkeys(FLOWN, 4.2) | {"Marquis2019": 4.1}
    past_V = [
        row["plans"]["lipo"]["highest_V"] - full_V[name]
        for name in FLOWN
        for row in STORED[name]["missions"]
    ]
    assert f"{max(past_V):.2f}" == "0.12"
    published = [STORED[name]["shipped"][0]["highest_V"] for name in FLOWN[:3]]
    assert [f"{volts:.2f}" for volts in published[:2]] == ["4.29", "4.28"]
    assert published[2] > 1000.0  # No lithium is left in the cathode.


@pytest.mark.parametrize("name", FLOWN)
def test_stored_plans_are_those_of_the_wells_in_the_package(name: str) -> None:
    """Else the page would tell of plans that nobody gets any more."""
    for row in STORED[name]["missions"][:5]:
        hover_s, _ = cells.Mission(**row["mission"]).plan(wells(name))
        assert hover_s == pytest.approx(row["plans"]["lipo"]["hover_s"], abs=0.05)


@pytest.mark.parametrize("mission", FALLS_S)
def test_the_published_optimum_falls_and_flyable_plans_do_not(mission: str) -> None:
    """The moments and hovers as an earlier study of the same cells found them."""
    names = ("Ecker2015", "NCA_Kim2011", "Mohtat2020")
    for name, falls_s in zip(names, FALLS_S[mission], strict=True):
        rows = [row for row in STORED[name]["shipped"] if row["mission"] == mission]
        published, paper, lipo = rows
        assert [row["by"] for row in rows] == ["published", "paper", "lipo"]
        assert published["falls_s"] == pytest.approx(falls_s, abs=0.1)
        assert (paper["falls_s"], lipo["falls_s"]) == (None, None)
        hovers_s = (paper["hover_s"], lipo["hover_s"])
        assert hovers_s == pytest.approx(HOVERS_S[mission], abs=0.005)


def test_pybamm_is_for_developers_who_ask_for_it() -> None:
    """It is in a group of its own, in no extra, and nothing that is installed imports it."""
    with (ROOT / "pyproject.toml").open("rb") as file:
        stated = tomllib.load(file)
    groups = stated["dependency-groups"]
    assert [name for name, needs in groups.items() if "pybamm" in str(needs)] == ["cells"]
    assert "pybamm" not in str(stated["project"])
    imports = re.compile(r"^\s*(?:import|from) pybamm", re.MULTILINE)
    for package in ("optuav", "formulations"):
        for path in (ROOT / package).rglob("*.py"):
            assert not imports.search(path.read_text("utf-8")), path


@pytest.mark.soak
@pytest.mark.filterwarnings("ignore")
def test_cells_still_do_what_is_stored() -> None:
    """Three lifetimes and three missions again, with the PyBaMM that is installed."""
    pytest.importorskip("pybamm")
    stored = STORED["Mohtat2020"]
    cell = cells.Cell("Mohtat2020")
    for row in stored["lifetimes"][2::4]:
        assert cell.lasts_s(row["load_C"]) == pytest.approx(row["lifetime_s"], rel=1e-3)
    for row in stored["missions"][:3]:
        mission = cells.Mission(**row["mission"])
        assert mission.longest_s(cell) == pytest.approx(row["longest_s"], rel=1e-3)
        for plan in row["plans"].values():
            flown = cells.flown(cell, mission, plan["hover_s"], plan["rest_s"])
            assert (flown["falls_s"] is None) == (plan["falls_s"] is None)
