"""Pictures of missions and plans; they need matplotlib (``pip install "optuav[plot]"``).

Every function takes its data and the axes to draw on, and returns them. Without axes it makes a
figure of its own that belongs to no window: ``battery(plan).wells.figure.savefig("battery.pdf")``.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from optuav.errors import InputError

if TYPE_CHECKING:
    from optuav.plots.animation import animate as animate
    from optuav.plots.cells import table as table
    from optuav.plots.charge import BatteryAxes as BatteryAxes
    from optuav.plots.charge import battery as battery
    from optuav.plots.comparison import Bar as Bar
    from optuav.plots.comparison import BarAxes as BarAxes
    from optuav.plots.comparison import Gap as Gap
    from optuav.plots.comparison import choice_bars as choice_bars
    from optuav.plots.comparison import slot_gaps as slot_gaps
    from optuav.plots.constraints import plane as plane
    from optuav.plots.files import save_animation as save_animation
    from optuav.plots.files import save_fit as save_fit
    from optuav.plots.files import save_map as save_map
    from optuav.plots.files import save_pictures as save_pictures
    from optuav.plots.files import save_profile as save_profile
    from optuav.plots.fitted import FitAxes as FitAxes
    from optuav.plots.fitted import fit as fit
    from optuav.plots.levels import tanks as tanks
    from optuav.plots.lines import Line as Line
    from optuav.plots.lines import Mark as Mark
    from optuav.plots.lines import curves as curves
    from optuav.plots.map import MapAxes as MapAxes
    from optuav.plots.map import mission_map as mission_map
    from optuav.plots.map import trajectories as trajectories
    from optuav.plots.perspectives import charge_bars as charge_bars
    from optuav.plots.perspectives import hover_bars as hover_bars
    from optuav.plots.plain_bars import bars as bars
    from optuav.plots.replayed import ProfileAxes as ProfileAxes
    from optuav.plots.replayed import profile as profile
    from optuav.plots.stages import LegAxes as LegAxes
    from optuav.plots.stages import leg as leg
    from optuav.plots.turns import packs as packs
    from optuav.plots.uncertainty import Swing as Swing
    from optuav.plots.uncertainty import hover_times as hover_times
    from optuav.plots.uncertainty import tornado as tornado
    from optuav.plots.well_bands import wells as wells

HOMES = {
    "Bar": "optuav.plots.comparison",
    "BarAxes": "optuav.plots.comparison",
    "BatteryAxes": "optuav.plots.charge",
    "FitAxes": "optuav.plots.fitted",
    "Gap": "optuav.plots.comparison",
    "LegAxes": "optuav.plots.stages",
    "Line": "optuav.plots.lines",
    "MapAxes": "optuav.plots.map",
    "Mark": "optuav.plots.lines",
    "ProfileAxes": "optuav.plots.replayed",
    "Swing": "optuav.plots.uncertainty",
    "animate": "optuav.plots.animation",
    "bars": "optuav.plots.plain_bars",
    "battery": "optuav.plots.charge",
    "charge_bars": "optuav.plots.perspectives",
    "choice_bars": "optuav.plots.comparison",
    "curves": "optuav.plots.lines",
    "fit": "optuav.plots.fitted",
    "hover_bars": "optuav.plots.perspectives",
    "hover_times": "optuav.plots.uncertainty",
    "leg": "optuav.plots.stages",
    "mission_map": "optuav.plots.map",
    "packs": "optuav.plots.turns",
    "plane": "optuav.plots.constraints",
    "profile": "optuav.plots.replayed",
    "save_animation": "optuav.plots.files",
    "save_fit": "optuav.plots.files",
    "save_map": "optuav.plots.files",
    "save_pictures": "optuav.plots.files",
    "save_profile": "optuav.plots.files",
    "slot_gaps": "optuav.plots.comparison",
    "table": "optuav.plots.cells",
    "tanks": "optuav.plots.levels",
    "tornado": "optuav.plots.uncertainty",
    "trajectories": "optuav.plots.map",
    "wells": "optuav.plots.well_bands",
}
"""Where each public name is defined."""

__all__ = sorted(HOMES)  # noqa: PLE0605


def __getattr__(name: str) -> Any:
    if name not in HOMES:
        raise AttributeError(f"module 'optuav.plots' has no attribute {name!r}")
    try:
        value = getattr(import_module(HOMES[name]), name)
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] != "matplotlib":
            raise
        raise InputError('pictures need matplotlib: pip install "optuav[plot]"') from None
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__
