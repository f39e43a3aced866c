"""Fleets by technology: counts that fewer cannot replace, costs by hand, prices that are wrong."""

from pathlib import Path
from typing import Any

import pytest

import optuav
from optuav.errors import InputError

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
    drawn_As = -sum(
        phase.current_A * phase.duration_s
        for phase in cycle.plan.phases
        if phase.kind in ("flight", "hover")
    )
    pack_s, chargers = drawn_As / battery.charge_current_A, rows["swap"]["chargers"]
    assert (chargers - 1) * every_s < pack_s <= chargers * every_s * (1 + 1e-9)


def test_costs_are_counts_times_prices() -> None:
    """By hand for matrice350: 4 lit drones, 4 beams; a swap with 2 drones and 3 chargers."""
    rows = {r["technology"]: r for r in optuav.size_fleet("matrice350", PRICES).rows}
    assert rows["laser, lit hover"]["cost"] == 4 * 9000 + 4 * 40000 + 4 * 1400
    assert rows["swap"]["cost"] == 2 * 9000 + 3 * 800 + 5 * 1400
    assert rows["tether"]["cost"] == 25000


def test_wrong_prices_and_numbers_are_named_all_at_once(tmp_path: Path) -> None:
    """Unknown, missing and negative prices in one error; a share, an overlap and a duration."""
    file = tmp_path / "prices.toml"
    file.write_text('drone = -1\nlaser = "a"\nlazer = 3\n', "utf-8")
    with pytest.raises(InputError) as refused:
        optuav.size_fleet("paper", file)
    words = str(refused.value)
    for name in ("lazer", "prices.drone = -1", "prices.laser", "prices.pad", "prices.tether"):
        assert name in words
    wrong: Any
    for wrong in ({"share": 0.0}, {"share": 1001}, {"overlap_s": -1.0}, {"swap_s": 0.0}):
        with pytest.raises(InputError, match=next(iter(wrong))):
            optuav.size_fleet("paper", **wrong)
    with pytest.raises(InputError, match="no way to charge"):
        optuav.size_fleet("paper", overlap_s=1e5)


def test_a_mission_without_a_laser_still_has_pads_and_exchanges() -> None:
    """Rows without an answer say why."""
    bare = optuav.load("paper").replace({"laser": None})
    rows = {row["technology"]: row for row in optuav.size_fleet(bare).rows}
    assert rows["laser, lit hover"]["drones"] is None
    assert "laser" in rows["laser, lit hover"]["why"]
    assert rows["pad"]["drones"] > 0
    assert rows["swap"]["drones"] > 0
