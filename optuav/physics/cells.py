"""Wells of kinds of cells, by name: shares and flow rates of the kinetic battery model.

Those of lithium cells were fitted to lifetimes from published electrochemical models (PyBaMM [1]_,
isothermal 25 °C, from full to 3.0 V under load), so that no lifetime is more than 0.15 % longer
than the cell's. Nothing here was compared with a real pack.

References
----------
.. [1] V. Sulzer, S. G. Marquis, R. Timms, M. Robinson, S. J. Chapman, "Python Battery Mathematical
   Modelling (PyBaMM)", Journal of Open Research Software, 2021. Parameter sets: Ecker 2015, Mohtat
   2020, Kim 2011 (NCA), Marquis 2019, Ai 2020; Chen 2020 (21700).
.. [2] W. Jaafar, H. Yanikomeroglu, "Dynamics of laser-charged UAVs: a battery perspective",
   IEEE Internet of Things Journal, 2021, table I.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

from optuav.options import BatteryName
from optuav.physics.kibam import Battery

TYPED = 1e-6  # Relative difference of a number that somebody typed


class CellWells(NamedTuple):
    """Wells of a kind of cells, and what is known about them.

    Parameters
    ----------
    available_fraction, flow_rate_per_s
        ω [-] and k_F [1/s].
    least_lag_s, largest_lag_s
        Lag of the cells behind them [s].
    most_C
        Largest discharge rate to which they were fitted [1/h], a multiple of the rated charge; None
        if unknown.
    source
        Cells and source, in words.

    Examples
    --------
    >>> from optuav.physics.cells import CELLS
    >>> f"{CELLS['lipo'].lag_s:.0f} s of lag"
    '120 s of lag'
    """

    available_fraction: float
    flow_rate_per_s: float
    least_lag_s: float
    largest_lag_s: float
    most_C: float | None
    source: str

    @property
    def lag_s(self) -> float:
        """Lag of these wells [s]."""
        return float(Battery(1.0, self.available_fraction, self.flow_rate_per_s).lag_s)


CELLS: Mapping[BatteryName, CellWells] = {
    "lipo": CellWells(
        0.2, 0.16 / 30.0, 70.0, 135.0, 5.0, "power pouch cells by five published models, 25 °C"
    ),
    "liion": CellWells(
        0.1, 0.0027, 341.0, 341.0, 2.0, "21700 energy cells by one published model, 25 °C"
    ),
    "paper": CellWells(
        0.8, 4.5e-5, 889.0, 889.0, None, "printed by Jaafar and Yanikomeroglu, like a NiMH cell"
    ),
}
"""Wells by the name of `optuav new --battery`."""


def kind_of(available_fraction: float, flow_rate_per_s: float) -> BatteryName | None:
    """The kind of cells that has these wells, as somebody may type them; None of others."""
    for name, wells in CELLS.items():
        pairs = zip(wells[:2], (available_fraction, flow_rate_per_s), strict=True)
        if all(math.isclose(*pair, rel_tol=TYPED) for pair in pairs):
            return name
    return None
