"""Wells of kinds of cells, by name: shares and flow rates of the kinetic battery model.

They were fitted to lifetimes at constant currents from published electrochemical models of cells
(PyBaMM [1]_, single-particle model with electrolyte, isothermal 25 °C, from full to 3.0 V under
load) so that no lifetime is longer than the cell's. Nothing here was compared with a real pack.

References
----------
.. [1] V. Sulzer, S. G. Marquis, R. Timms, M. Robinson, S. J. Chapman, "Python Battery Mathematical
   Modelling (PyBaMM)", Journal of Open Research Software, 2021. Parameter sets: Ecker 2015, Mohtat
   2020, Kim 2011 (NCA), Marquis 2019, Ai 2020; Chen 2020 (21700).
.. [2] W. Jaafar, H. Yanikomeroglu, "Dynamics of laser-charged UAVs: a battery perspective",
   IEEE Internet of Things Journal, 2021, table I.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from optuav.options import BatteryName


class CellWells(NamedTuple):
    """Wells of a kind of cells, and what is known about them.

    Parameters
    ----------
    available_fraction, flow_rate_per_s
        ω [-] and k_F [1/s].
    lag_s
        Least and largest lag (1−ω)²/k_F of the cells behind them [s].
    most_C
        Largest discharge rate to which they were fitted [1/h], a multiple of the rated charge.
    source
        Cells and source, in words.

    Examples
    --------
    >>> from optuav.physics.cells import CELLS
    >>> lipo = CELLS["lipo"]
    >>> f"{(1 - lipo.available_fraction) ** 2 / lipo.flow_rate_per_s:.0f} s of lag"
    '120 s of lag'
    """

    available_fraction: float
    flow_rate_per_s: float
    lag_s: tuple[float, float]
    most_C: float
    source: str


CELLS: Mapping[BatteryName, CellWells] = {
    "lipo": CellWells(
        0.2, 0.16 / 30.0, (70.0, 135.0), 5.0, "lithium pouch cells: five published models, 25 °C"
    ),
    "liion": CellWells(
        0.1, 0.0027, (341.0, 341.0), 2.0, "lithium 21700 energy cells: one published model, 25 °C"
    ),
    "paper": CellWells(
        0.8, 4.5e-5, (889.0, 889.0), 2.0, "as printed by Jaafar and Yanikomeroglu; like NiMH cells"
    ),
}
"""Wells by the name of `optuav new --battery`."""
