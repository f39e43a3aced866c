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
    from optuav.plots.animation import gif_file as gif_file
    from optuav.plots.animation import save_animation as save_animation
    from optuav.plots.calibrations import FitAxes as FitAxes
    from optuav.plots.calibrations import fit as fit
    from optuav.plots.charge import wells as wells
    from optuav.plots.charts import Bar as Bar
    from optuav.plots.charts import Level as Level
    from optuav.plots.charts import Line as Line
    from optuav.plots.charts import Mark as Mark
    from optuav.plots.charts import bars as bars
    from optuav.plots.charts import curves as curves
    from optuav.plots.files import save as save
    from optuav.plots.files import save_figures as save_figures
    from optuav.plots.files import save_pictures as save_pictures
    from optuav.plots.legs import LegAxes as LegAxes
    from optuav.plots.legs import leg as leg
    from optuav.plots.map import MapAxes as MapAxes
    from optuav.plots.map import mission_map as mission_map
    from optuav.plots.map import trajectories as trajectories
    from optuav.plots.planes import plane as plane
    from optuav.plots.profiles import ProfileAxes as ProfileAxes
    from optuav.plots.profiles import profile as profile
    from optuav.plots.schedules import packs as packs
    from optuav.plots.uncertainty import Swing as Swing
    from optuav.plots.uncertainty import hover_times as hover_times
    from optuav.plots.uncertainty import tornado as tornado

NAMES = {
    "animation": "gif_file save_animation",
    "calibrations": "FitAxes fit",
    "charge": "wells",
    "charts": "Bar Level Line Mark bars curves",
    "files": "save save_figures save_pictures",
    "legs": "LegAxes leg",
    "map": "MapAxes mission_map trajectories",
    "planes": "plane",
    "profiles": "ProfileAxes profile",
    "schedules": "packs",
    "uncertainty": "Swing hover_times tornado",
}
"""The public names of every module, which is imported on first use."""

HOMES = {name: module for module, names in NAMES.items() for name in names.split()}
__all__ = sorted(HOMES)  # noqa: PLE0605


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
