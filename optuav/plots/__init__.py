"""Pictures of missions and plans; they need matplotlib (``pip install "optuav[plot]"``).

Every function takes its data and returns the axes; a picture of one axes may be drawn on given
ones. By default it has a figure of its own that belongs to no window:
``wells([plan])[0].figure.savefig("wells.pdf")``.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

from optuav.errors import InputError

if TYPE_CHECKING:
    from optuav.plots.animation import gif_file, save_animation
    from optuav.plots.calibrations import FitAxes, fit
    from optuav.plots.charge import packs, wells
    from optuav.plots.charts import (
        Bar,
        Line,
        Mark,
        Swing,
        bars,
        curves,
        hover_times,
        tornado,
    )
    from optuav.plots.files import save, save_figures, save_pictures
    from optuav.plots.map import MapAxes, mission_map, trajectories
    from optuav.plots.planes import plane
    from optuav.plots.profiles import LegAxes, ProfileAxes, leg, profile

__all__ = ["Bar", "FitAxes", "LegAxes", "Line", "MapAxes", "Mark", "ProfileAxes", "Swing"]
__all__ += ["bars", "curves", "fit", "gif_file", "hover_times", "leg", "mission_map", "packs"]
__all__ += ["plane", "profile", "save", "save_animation", "save_figures", "save_pictures"]
__all__ += ["tornado", "trajectories", "wells"]

NAMES = {
    "animation": "gif_file save_animation",
    "calibrations": "FitAxes fit",
    "charge": "packs wells",
    "charts": "Bar Line Mark Swing bars curves hover_times tornado",
    "files": "save save_figures save_pictures",
    "map": "MapAxes mission_map trajectories",
    "planes": "plane",
    "profiles": "LegAxes ProfileAxes leg profile",
}
"""The public names of every module, which is imported on first use."""
HOMES = {name: module for module, names in NAMES.items() for name in names.split()}


def __getattr__(name: str) -> object:
    if name not in HOMES:
        raise AttributeError(f"module 'optuav.plots' has no attribute {name!r}")
    try:
        value = getattr(import_module(f"optuav.plots.{HOMES[name]}"), name)
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] != "matplotlib":
            raise
        raise InputError('pictures need matplotlib: pip install "optuav[plot]"') from None
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__
