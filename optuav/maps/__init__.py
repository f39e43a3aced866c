"""The longest hover over positions; maps need xarray (``python -m pip install xarray``).

Examples
--------
>>> import optuav
>>> found = optuav.maps.laser("paper", 250)
>>> found.attrs["best_m"], float(found.max().round(2))
([1000.0, 0.0, 50.0], 597.27)
"""

from optuav.maps.output import save
from optuav.maps.positions import device, hover_point, laser

__all__ = ["device", "hover_point", "laser", "save"]
__dir__ = __all__.copy
