"""Fig. 10: harvested energy and efficiency against the distance from the laser."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from optuav import plots
from optuav.mission import Mission
from optuav.paper.curves.charging import harvest
from optuav.paper.curves.settings import HOVER_S
from optuav.paper.reproduce.exhibit import Exhibit, LeftOut, caption, heading, stem

SOURCES_W = (100.0, 250.0, 500.0, 1000.0)
"""Source powers; the paper's are not in its text."""
FARTHEST_M = 5000.0
NEAR_M = 1000.0
POINTS = 101


def charging(mission: Mission) -> Iterator[Exhibit | LeftOut]:
    """Two pictures: the energy, and the efficiency; none where the mission states the charging."""
    if mission.laser is None:
        yield LeftOut("", "the mission has no laser")
        return
    if mission.flight.model == "regimes" and mission.flight.charge_power_W is not None:
        yield LeftOut("", "the mission states with what it charges, whatever the distance")
        return
    distance_m = np.linspace(0.0, FARTHEST_M, POINTS)
    sources_W = sorted({*SOURCES_W, mission.laser.power_W})
    found = {power: harvest(mission, power, distance_m, HOVER_S) for power in sources_W}
    records = [
        {
            "source_power_W": power,
            "distance_m": float(metres),
            "harvested_J": float(energy_J),
            "efficiency_percent": 100.0 * float(efficiency),
        }
        for power, curve in found.items()
        for metres, energy_J, efficiency in zip(*curve, strict=True)
    ]
    near = {power: 100.0 * curve.efficiency[distance_m <= NEAR_M] for power, curve in found.items()}
    by_source = "; ".join(
        f"{power:g} W {share.min():.1f} to {share.max():.1f} %" for power, share in near.items()
    )
    finding = (
        f"Efficiency below {NEAR_M / 1000.0:g} km by source: {by_source}. No limit of the battery "
        "is applied."
    )
    for name, words, y_label, scaled in (
        (
            "harvested-energy",
            f"Energy harvested in {HOVER_S:g} s",
            "harvested energy $E_{harv}$ [kJ]",
            {power: curve.energy_J / 1000.0 for power, curve in found.items()},
        ),
        (
            "harvest-efficiency",
            "Efficiency of harvesting",
            "efficiency $ζ = P_0/P_s$ [%]",
            {power: 100.0 * curve.efficiency for power, curve in found.items()},
        ),
    ):
        yield Exhibit(
            f"{name}.{stem(mission)}",
            caption(mission, f"{words} against distance, for several source powers", "Fig. 10"),
            plots.curves(
                [
                    plots.Line(f"$P_s$ = {power:g} W", distance_m / 1000.0, values)
                    for power, values in scaled.items()
                ],
                title=f"{heading(mission)}: {words.lower()}",
                x_label="distance from the laser to the UAV $d$ [km]",
                y_label=y_label,
                y_from_zero=True,
            ),
            records,
            (finding,),
        )
