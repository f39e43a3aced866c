"""Fits of mission parameters to data: battery, loads by regime, rotor, keys from a table."""

from optuav.calibration.fit import Fit, Panel, Value
from optuav.calibration.kibam import fit_kibam
from optuav.calibration.logs.flight_log import FlightLog
from optuav.calibration.regimes import fit_regimes
from optuav.calibration.rotary_wing import fit_rotary_wing
from optuav.calibration.rotor import fit_rotor
from optuav.calibration.table import fit_table

__all__ = [
    "Fit",
    "FlightLog",
    "Panel",
    "Value",
    "fit_kibam",
    "fit_regimes",
    "fit_rotary_wing",
    "fit_rotor",
]
__all__ += ["fit_table"]
