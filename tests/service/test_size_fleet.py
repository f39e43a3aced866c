"""Fleets by technology: counts that fewer cannot replace, costs by hand, prices that are wrong."""

import itertools
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import optuav
from optuav.errors import InputError
from optuav.service.size_fleet import _further_sets

PRICES = {"drone": 9000, "laser": 40000, "pad": 1500, "charger": 800}
PRICES |= {"battery_set": 1400, "tether": 25000}


@pytest.mark.parametrize("mission", ["paper", "matrice350", "relay-today"])
@pytest.mark.parametrize(("share", "overlap_s"), [(1.0, 0.0), (0.4, 0.0), (2.5, 60.0)])
def test_one_drone_or_charger_fewer_is_too_few(
    mission: str, share: float, overlap_s: float
) -> None:
    """Turns that come round before a drone is back, or packs that come before a charger is free."""
    table = optuav.size_fleet(mission, None, share, overlap_s)
    rows = {row["technology"]: row for row in table.rows}
    battery = optuav.load(mission).battery
    options: dict[str, Any] = {
        "laser, lit hover": {},
        "laser, dark hover": {"lit_hover": False},
        "pad": {"pad_power_W": battery.charge_current_A * battery.nominal_voltage_V},
        "swap": {"swap_s": 120.0},
    }
    for name, chosen in options.items():
        cycle, row = optuav.coverage(mission, **chosen), rows[name]
        every_s = (cycle.hover_s - overlap_s) / share
        assert (
            (row["drones"] - 1) * every_s < cycle.period_s <= row["drones"] * every_s * (1 + 1e-9)
        )
        assert row["share"] >= share
    drawn_As = -sum(
        phase.current_A * phase.duration_s
        for phase in cycle.plan.phases
        if phase.kind in ("flight", "hover")
    )
    pack_s, chargers = drawn_As / battery.charge_current_A, rows["swap"]["chargers"]
    assert (chargers - 1) * every_s < pack_s <= chargers * every_s * (1 + 1e-9)


def ring_cost(cycle: optuav.Coverage, share: float, overlap_s: float, prices: Any) -> float:
    """Cost of the ring that covers exactly a share, counted from the times of the cycle."""
    every_s = (cycle.hover_s - overlap_s) / share
    drones = math.ceil(cycle.period_s / every_s - 1e-7)
    ground_s = drones * every_s - cycle.hover_s - cycle.flight_s
    stay_s = 120.0 if cycle.charged_by == "exchange" else ground_s
    places = max(math.ceil(stay_s / every_s - 1e-7), 1)
    cost = float(drones * (prices["drone"] + prices["battery_set"]))
    if cycle.charged_by == "laser":
        at_once = cycle.lit_hover * math.ceil(cycle.hover_s / every_s - 1e-7)
        return cost + prices["laser"] * min(places + at_once, drones)  # A beam lights one drone
    if cycle.charged_by == "pad":
        return cost + prices["pad"] * places
    drawn_As = (cycle.soc_at_departure - cycle.soc_at_landing) * cycle.mission.battery.packs
    pack_s = drawn_As * cycle.mission.battery.capacity_As / cycle.mission.battery.charge_current_A
    chargers = math.ceil(pack_s / every_s - 1e-7)
    return cost + chargers * (prices["charger"] + prices["battery_set"])


@pytest.mark.parametrize(("mission", "overlap_s"), [("relay-today", 0.0), ("matrice350", 60.0)])
def test_no_ring_of_at_least_the_share_is_cheaper(mission: str, overlap_s: float) -> None:
    """All shares of a fine grid from the one that is asked for; dear places, cheap drones too."""
    battery = optuav.load(mission).battery
    pad_W = battery.charge_current_A * battery.nominal_voltage_V
    options: Any = [{}, {"lit_hover": False}, {"pad_power_W": pad_W}, {"swap_s": 120.0}]
    cycles = [optuav.coverage(mission, **chosen) for chosen in options]
    grid, faster = np.arange(0.02, 4.0, 0.002), 0
    for prices in (PRICES, {**PRICES, "drone": 1, "battery_set": 1, "pad": 9000}):
        rings = [[ring_cost(cycle, c, overlap_s, prices) for c in grid] for cycle in cycles]
        for share in (0.3, 0.5, 0.81, 0.95, 1.0, 1.5, 1.83, 1.95):
            rows = optuav.size_fleet(mission, prices, share, overlap_s).rows
            for cycle, costs, row in zip(cycles, rings, rows, strict=False):
                assert row["cost"] <= min(itertools.compress(costs, grid >= share - 1e-9))
                assert row["cost"] == ring_cost(cycle, row["share"], overlap_s, prices)
                faster += row["cost"] < ring_cost(cycle, share, overlap_s, prices)
    assert faster


@pytest.mark.parametrize(("prices", "label", "lines"), [(PRICES, "cost", 5), (None, "drones", 4)])
def test_the_picture_holds_the_cost_between_shares(prices: Any, label: str, lines: int) -> None:
    """Steps that never fall, of costs or of drones, and the overlap in the title."""
    figure = optuav.size_fleet("relay-today", prices, overlap_s=30.0).plot()["sizes.png"]
    (ax,) = figure.axes
    assert (ax.get_ylabel().split()[0], len(ax.get_lines())) == (label, lines)
    assert "30 s of overlap" in ax.get_title(loc="left")
    for line in ax.get_lines():
        x, y = (np.asarray(values, dtype=float) for values in line.get_data())
        assert np.all((np.diff(x) == 0.0) | (np.diff(y) == 0.0))
        assert np.all(np.diff(y) >= 0.0)


def test_titles_say_per_cent_or_devices() -> None:
    """All of the time is 100 %, more than that are devices, or a mean; no value is a dash."""
    titles = {0.5: "for 50 % of the time", 1.0: "for 100 % of the time", 2.0: "for 2 devices:"}
    for share, words in (titles | {2.5: "for 2.5 drones that hover on average"}).items():
        assert words in str(optuav.size_fleet("matrice350", None, share))
    lines = str(optuav.size_fleet("matrice350", PRICES)).splitlines()
    (tether,) = (line for line in lines if line.startswith("tether"))
    assert tether.split()[1:6] == ["–"] * 5


def test_costs_are_counts_times_prices() -> None:
    """By hand for matrice350: 4 lit drones, 4 beams; a swap with 2 drones and 3 chargers."""
    rows = {r["technology"]: r for r in optuav.size_fleet("matrice350", PRICES).rows}
    assert rows["laser, lit hover"]["cost"] == 4 * 9000 + 4 * 40000 + 4 * 1400
    assert rows["swap"]["cost"] == 2 * 9000 + 3 * 800 + 5 * 1400
    assert rows["tether"]["cost"] == 25000


def test_free_of_charge_is_refused() -> None:
    """With every price 0 all costs are equal, and the picture is empty; one price is enough."""
    free = dict.fromkeys(PRICES, 0)
    words = (
        r"prices = all 0: must be at least one above 0, each a number, 0 <= x <= 1e12 \[-\]; leave"
    )
    with pytest.raises(InputError, match=words):
        optuav.size_fleet("matrice350", free)
    rows = optuav.size_fleet("matrice350", {**free, "charger": 1e-3}).rows
    assert [row["cost"] for row in rows] == [0.0, 0.0, 0.0, 0.003, 0.0]


def test_wrong_prices_and_numbers_are_named_all_at_once(tmp_path: Path) -> None:
    """Unknown, missing and negative prices in one error; a share, an overlap and a duration."""
    file = tmp_path / "prices.toml"
    file.write_text('drone = -1\nlaser = "a"\nlazer = 3\n', "utf-8")
    with pytest.raises(InputError) as refused:
        optuav.size_fleet("paper", file)
    words = str(refused.value)
    for name in ("lazer", "prices.drone = -1", "prices.laser = 'a'"):
        assert f"{file}: {name}" in words or name == "lazer"
    assert words.count(str(file)) == 4
    assert "prices: needs also pad, charger, battery_set, tether: each a number" in words
    wrong: Any
    for wrong in ({"share": 0.0}, {"share": 1001}, {"overlap_s": -1.0}, {"swap_s": 0.0}):
        with pytest.raises(InputError, match=next(iter(wrong))):
            optuav.size_fleet("paper", **wrong)
    with pytest.raises(InputError, match="no way to charge") as refused:
        optuav.size_fleet("paper", overlap_s=1e5)
    assert len(str(refused.value).splitlines()) == 4  # The first, and two lasers alike
    assert "\N{REPLACEMENT CHARACTER}" not in str(refused.value)
    with pytest.raises(InputError, match="1 is all of the time"):
        optuav.size_fleet("paper", share=0)


def test_a_mission_without_a_laser_still_has_pads_and_exchanges() -> None:
    """Rows without an answer say why."""
    bare = optuav.load("paper").replace({"laser": None})
    rows = {row["technology"]: row for row in optuav.size_fleet(bare).rows}
    assert rows["laser, lit hover"]["drones"] is None
    assert "laser" in rows["laser, lit hover"]["why"]
    assert rows["pad"]["drones"] > 0
    assert rows["swap"]["drones"] > 0


@pytest.mark.parametrize("mission", ["matrice350", "relay-today"])
@pytest.mark.parametrize("overlap_s", [0.0, 60.0])
def test_an_event_costs_what_its_roster_needs(mission: str, overlap_s: float) -> None:
    """Counted by hand: a beam or a pad per drone, a bay, and sets that are charged in time."""
    table = optuav.size_fleet(mission, PRICES, overlap_s=overlap_s, hours=4)
    rows = {row["technology"]: row for row in table.rows}
    pack = optuav.load(mission).battery
    pad = {"pad_power_W": pack.charge_current_A * pack.nominal_voltage_V}
    ways: Any = {"laser, lit hover": {}, "laser, dark hover": {"lit_hover": False}, "pad": pad}
    for name, options in ways.items():
        drones = optuav.coverage(mission, **options).event(4, overlap_s=overlap_s).drones
        places = PRICES["pad" if name == "pad" else "laser"]
        assert rows[name]["drones"] == rows[name]["battery_sets"] == drones
        assert rows[name]["cost"] == drones * (PRICES["drone"] + PRICES["battery_set"] + places)
    assert rows["tether"]["cost"] == PRICES["tether"]
    event, swap = optuav.coverage(mission, swap_s=120).event(4, overlap_s=overlap_s), rows["swap"]
    assert swap["bays"] == 1
    counted = swap["drones"] * PRICES["drone"] + swap["chargers"] * PRICES["charger"]
    assert swap["cost"] == counted + swap["battery_sets"] * PRICES["battery_set"]
    # Every hover its own set is never cheaper than what was found
    assert swap["cost"] <= event.drones * PRICES["drone"] + len(event.rows) * PRICES["battery_set"]
    alone = optuav.size_fleet(mission, overlap_s=overlap_s, hours=4)
    swap = next(row for row in alone.rows if row["technology"] == "swap")
    assert (swap["chargers"], swap["battery_sets"]) == (0, len(event.rows))
    assert "for an event of 4 h" in str(alone)


def test_hover_points_apart_count_in_an_event() -> None:
    """Points 50 m apart have no third one below the limit, so that drones are even in number."""
    cycle, apart = optuav.coverage("matrice350"), (0.0, 0.0, 50.0)
    row = optuav.size_fleet("matrice350", hours=2, separation_m=50).rows[0]
    assert row["drones"] == cycle.event(2, separation_m=apart).drones == 4
    assert cycle.event(2).drones == 3
    assert "next drone 50 m higher" in str(optuav.size_fleet("matrice350", None, 1, 0, 120, 2, 50))
    with pytest.raises(InputError) as refused:
        optuav.size_fleet("matrice350", share=0, separation_m=10)
    assert {fault.key for fault in refused.value.faults} == {"share", "separation_m"}


def test_sets_are_charged_one_after_the_other() -> None:
    """Packs land every 100 s and take 250 s to charge: by hand, with 0 to 3 chargers."""
    landings = [(100.0 * k, 250.0) for k in range(8)]
    # One charger: full at 250, 500, 750, taken at 300, 500; the exchange at 700 finds none
    assert [_further_sets(landings, chargers, 1.0) for chargers in range(4)] == [8, 6, 4, 3]


def test_events_refuse_a_share() -> None:
    """Together with hours that are out of range."""
    with pytest.raises(InputError) as refused:
        optuav.size_fleet("matrice350", share=0.5, hours=0)
    assert {fault.key for fault in refused.value.faults} == {"share", "hours"}
