"""Pictures of missions and plans; they need matplotlib (``pip install "optuav[plot]"``).

Every function takes its data and the axes to draw on, and returns them. Without axes it makes a
figure of its own that belongs to no window: ``battery(plan).wells.figure.savefig("battery.pdf")``.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

from optuav.errors import InputError

if TYPE_CHECKING:
    from optuav.plots.animation import animate as animate
    from optuav.plots.calibrations import FitAxes as FitAxes
    from optuav.plots.calibrations import fit as fit
    from optuav.plots.charge import BatteryAxes as BatteryAxes
    from optuav.plots.charge import battery as battery
    from optuav.plots.charge import tanks as tanks
    from optuav.plots.charge import wells as wells
    from optuav.plots.comparison import Bar as Bar
    from optuav.plots.comparison import BarAxes as BarAxes
    from optuav.plots.comparison import Gap as Gap
    from optuav.plots.comparison import bars as bars
    from optuav.plots.comparison import charge_bars as charge_bars
    from optuav.plots.comparison import choice_bars as choice_bars
    from optuav.plots.comparison import hover_bars as hover_bars
    from optuav.plots.comparison import slot_gaps as slot_gaps
    from optuav.plots.files import save_animation as save_animation
    from optuav.plots.files import save_fit as save_fit
    from optuav.plots.files import save_map as save_map
    from optuav.plots.files import save_pictures as save_pictures
    from optuav.plots.files import save_profile as save_profile
    from optuav.plots.legs import LegAxes as LegAxes
    from optuav.plots.legs import leg as leg
    from optuav.plots.lines import Line as Line
    from optuav.plots.lines import Mark as Mark
    from optuav.plots.lines import curves as curves
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
    "animation": "animate",
    "calibrations": "FitAxes fit",
    "charge": "BatteryAxes battery tanks wells",
    "comparison": "Bar BarAxes Gap bars charge_bars choice_bars hover_bars slot_gaps",
    "files": "save_animation save_fit save_map save_pictures save_profile",
    "legs": "LegAxes leg",
    "lines": "Line Mark curves",
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
