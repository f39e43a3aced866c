"""Pictures of missions and plans; they need matplotlib (``python -m pip install matplotlib``).

Every function takes its data and returns the axes, of a figure of its own that belongs to no
window and that a notebook shows: ``wells([plan])[0].figure.savefig("wells.pdf")``. Those with one
panel also draw on axes that they are given (`ax`), those with several into a figure or subfigure
(`figure`, best made with ``layout="constrained"``).
"""

from optuav.errors import require

require("matplotlib", "pictures")

from optuav.plots.animation import save_animation
from optuav.plots.calibrations import FitAxes, FlightLogAxes, fit, flight_log
from optuav.plots.charge import packs, wells
from optuav.plots.charts import Bar, Line, Mark, bars, curves
from optuav.plots.distribution import distribution
from optuav.plots.files import save, save_figures, save_pictures
from optuav.plots.fleets import Turn, fleet_turns
from optuav.plots.map import MapAxes, mission_map, trajectories
from optuav.plots.planes import plane
from optuav.plots.positions import hover_map, sites
from optuav.plots.profiles import LegAxes, ProfileAxes, leg, profile
from optuav.plots.sweeps import swept

__all__ = [
    "Bar",
    "FitAxes",
    "FlightLogAxes",
    "LegAxes",
    "Line",
    "MapAxes",
    "Mark",
    "ProfileAxes",
    "Turn",
]
__all__ += [
    "bars",
    "curves",
    "distribution",
    "fit",
    "fleet_turns",
    "flight_log",
    "hover_map",
    "leg",
]
__all__ += ["mission_map", "packs", "plane", "profile", "save", "save_animation", "save_figures"]
__all__ += ["save_pictures", "sites", "swept", "trajectories", "wells"]
__dir__ = __all__.copy
