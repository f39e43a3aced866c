"""The scenery of a map: buildings, device, laser, coverage and sight lines."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.patches import Circle
from matplotlib.typing import LineStyleType

from optuav.arrays import Booleans, Floats
from optuav.mission import Mission
from optuav.network import vehicle
from optuav.network.obstacles import Prisms, outline_m, prisms
from optuav.network.places import HOVER, Places, build_places
from optuav.plots import style
from optuav.plots.style import GREEN, GREY, PURPLE, VERMILLION, Label, Look

MARKERS = {"hover": "o", "rest": "s"}
COVERAGE_SHARE = 0.4
"""Most that the coverage disc adds to the map on every side, as a share of the places' span."""
FAR = 100.0  # Sizes of a map up to which a rim is drawn: one far off has billions of pieces
FEW = 30  # Most sight lines that are drawn strongly
MOST_NAMED = 400  # Most buildings of which those off the route are named where there is room


@dataclass(frozen=True)
class Scene:
    """A mission with its places, by number, and its buildings as prisms."""

    mission: Mission
    places: Places
    obstacles: Prisms

    def positions(self, names: Sequence[str]) -> Floats:
        """Positions of places (place, 3) [m] by their names."""
        return self.places.position_m[[self.places.names.index(name) for name in names]]

    @property
    def disc_radius_m(self) -> float:
        """Radius of the coverage at the altitude of hovering [m]; NaN where it does not reach."""
        hover_z_m = float(self.places.position_m[HOVER, 2])
        altitude_m = self.mission.limits.min_altitude_m if math.isnan(hover_z_m) else hover_z_m
        height_m = altitude_m - self.mission.link.device_m[2]
        squared = vehicle.coverage_radius_m(self.mission) ** 2 - height_m**2
        return math.sqrt(squared) if squared >= 0.0 else math.nan

    @property
    def corners_m(self) -> Floats:
        """Two corners (2, 2) of the box on the map that holds what is worth seeing [m].

        It holds all places, and the coverage as far as it does not dwarf them.
        """
        mission, device = self.mission, np.array(self.mission.link.device_m[:2])
        seen = [device, *self.places.position_m[self.places.exists, :2]]
        seen += [np.array(mission.laser.position_m[:2])] if mission.laser else []
        seen += [np.array(at) for each in mission.buildings for at in outline_m(each) or ()]
        low, high = np.min(seen, axis=0), np.max(seen, axis=0)
        if math.isfinite(radius_m := self.disc_radius_m):
            room = COVERAGE_SHARE * float((high - low).max()) or radius_m
            low, high = (
                np.minimum(low, np.maximum(device - radius_m, low - room)),
                np.maximum(high, np.minimum(device + radius_m, high + room)),
            )
        return np.stack([low, high])

    @property
    def sight_lines(self) -> tuple[Floats, Booleans]:
        """Lines (line, 2, 2) on the map from the laser to where it may charge [m]; if clear."""
        if self.mission.laser is None:
            return np.empty((0, 2, 2)), np.empty(0, dtype=bool)
        charging = np.concatenate([[HOVER], self.places.buildings])
        charging = charging[self.places.exists[charging]]
        ends_m = self.places.position_m[charging, :2]
        source_m = np.broadcast_to(self.mission.laser.position_m[:2], ends_m.shape)
        return np.stack([source_m, ends_m], axis=1), self.places.laser_sight[charging]


def scene(mission: Mission) -> Scene:
    """The places and buildings that a map of a mission shows."""
    obstacles = prisms(mission)
    return Scene(mission, build_places(mission, obstacles), obstacles)


def draw_plan_view(ax: Axes, shown: Scene) -> list[Artist]:
    """Draw the scenery from above, and set the limits; entries of the legend."""
    mission, entries = shown.mission, list[Artist]()
    ax.set_aspect("equal", adjustable="datalim")
    ax.margins(0.0)
    ax.update_datalim(np.transpose([style.margins(values) for values in shown.corners_m.T]))
    device = mission.link.device_m[:2]
    if math.isfinite(radius_m := shown.disc_radius_m):
        radius_m = min(radius_m, FAR * float(np.abs(shown.corners_m - device).max()))
        disc = Circle(device, radius_m, facecolor=f"{GREEN}26", edgecolor=GREEN, linewidth=0.8)
        disc.set_label("coverage at the hover altitude")
        ax.add_artist(disc)  # unlike a patch, it leaves the limits alone
        entries.append(disc)
    entries += _draw_sight_lines(ax, shown)
    rings = [ring for building in mission.buildings if (ring := outline_m(building)) is not None]
    walls: Look = {"facecolor": style.PALE, "edgecolor": GREY, "linewidth": 0.6, "zorder": 2}
    footprints = PolyCollection(rings, label="building", **walls)
    ax.add_collection(footprints, autolim=False)
    roofs = shown.places.position_m[shown.places.buildings]
    ax.plot(*roofs[:, :2].T, ".", color=GREY, markersize=2.5, zorder=2.1)
    entries += [footprints] if mission.buildings else []
    entries += ax.plot(*device, "^", color=GREEN, markersize=6, zorder=4, label="ground device")
    if mission.laser is not None:
        source = mission.laser.position_m[:2]
        entries += ax.plot(*source, "*", color=PURPLE, markersize=9, zorder=4, label="laser")
    ax.set(xlabel="x [m]", ylabel="y [m]")
    return entries


def _draw_sight_lines(ax: Axes, shown: Scene) -> Iterator[Artist]:
    """Draw the sight lines of the laser; entries of the legend."""
    lines, sight = shown.sight_lines
    strength = 1.0 if len(lines) <= FEW else 0.5
    looks: tuple[tuple[bool, str, LineStyleType, str], ...] = (
        (False, VERMILLION, (0.0, (2.0, 2.0)), "blocked sight line"),
        (True, PURPLE, "-", "clear sight line of the laser"),
    )
    for clear, colour, dashes, words in looks:
        if (sight == clear).any():
            look: Look = {"colors": colour, "linestyles": [dashes], "linewidths": 0.6 * strength}
            look |= {"alpha": 0.5 + 0.3 * strength, "zorder": 1.5}
            ax.add_collection(LineCollection([*lines[sight == clear]], **look), autolim=False)
            yield style.entry(words, colour, 0.9, dashes)


def scenery_labels(shown: Scene) -> list[Label]:
    """Names of the device and the laser, and of the buildings where there is room."""
    mission = shown.mission
    found = [Label("device $\\mathbf{w}_u$", mission.link.device_m[:2])]
    if mission.laser is not None:
        found.append(Label("laser $\\mathbf{w}_s$", mission.laser.position_m[:2]))
    for each in mission.buildings if len(mission.buildings) <= MOST_NAMED else ():
        name, at = style.printed(each.name), each.position_m[:2]
        found.append(Label(name, at, needed=False, colour="#404040", size=6.5))
    return found


def stop_look(kind: str, stays: bool) -> Look:
    """The marker of a stop; hollow where the UAV passes by."""
    colour = style.KINDS[kind]
    fill, edge = (colour, "white") if stays else ("white", colour)
    look: Look = {"marker": MARKERS[kind], "markersize": 6.0, "markeredgewidth": 0.8}
    return {**look, "markerfacecolor": fill, "markeredgecolor": edge}
