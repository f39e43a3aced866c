"""Fig. 9: energy of a hover against wind."""

from __future__ import annotations

from collections.abc import Iterator

from optuav import plots
from optuav.mission import Mission
from optuav.paper.curves.settings import HOVER_S
from optuav.paper.curves.wind import AXES, calmest_N, hover_energy, limits_N
from optuav.paper.reproduce.exhibit import Exhibit, LeftOut, caption, heading, number, stem


def wind(mission: Mission) -> Iterator[Exhibit | LeftOut]:
    """Curves along x, y and z; regime loads do not know wind."""
    if mission.flight.model != "rotors":
        yield LeftOut("", "loads that are stated by regime know no wind")
        return
    curves = {axis: hover_energy(mission, along, HOVER_S) for axis, along in AXES.items()}
    limits = {axis: limits_N(mission, along) for axis, along in AXES.items()}
    level, up = limits["x"], limits["z"]
    yield Exhibit(
        f"wind.{stem(mission)}",
        caption(
            mission,
            f"Energy of {HOVER_S:g} s of hover, radio included, against wind",
            "Fig. 9",
        ),
        plots.curves(
            [
                plots.Line(f"wind along ${axis}$", curve.force_N, curve.energy_J / 1000.0)
                for axis, curve in curves.items()
            ],
            title=f"{heading(mission)}: energy of {HOVER_S:g} s of hover against wind",
            x_label="wind force $F_w$ [N]",
            y_label="hover and radio energy $E_{hv}$ [kJ]",
            marks=[
                plots.Mark(force_N, f"${axis}$: {number(force_N, 2)} N")
                for axis, force_N in (
                    ("x, y", level[0]),
                    ("z", up[0]),
                    ("x, y", level[1]),
                    ("z", up[1]),
                )
            ],
        ),
        [
            {"axis": axis, "wind_N": float(force_N), "energy_J": float(energy_J)}
            for axis, curve in curves.items()
            for force_N, energy_J in zip(curve.force_N, curve.energy_J, strict=True)
        ],
        (
            f"Level wind is held up to {level[1]:.4f} N, wind along z from {number(up[0], 4)} to "
            f"{up[1]:.4f} N; the energy is least at {calmest_N(curves['x']):g} N level and at "
            f"{calmest_N(curves['z']):g} N upwards, where the wind carries the weight.",
        ),
    )
