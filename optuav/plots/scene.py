"""What stands on the map: buildings, device, laser, coverage and sight lines."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.lines import Line2D
from matplotlib.patches import Circle

from optuav.arrays import Floats, Integers
from optuav.mission import Mission
from optuav.network import vehicle
from optuav.network.obstacles import Prisms, outline_m, prisms
from optuav.network.places import DESTINATION, HOVER, ORIGIN, Places, build_places
from optuav.plots.labels import Label
from optuav.plots.style import GREEN, GREY, PALE, PURPLE, VERMILLION, margins, printed

Point: TypeAlias = tuple[float, float, float]

COVERAGE_SHARE = 0.4
"""How much of the span of the places the coverage disc may add to the map on every side."""
FEW = 30
"""Number of sight lines up to which they are drawn strongly."""
MOST_NAMED = 400
"""Number of buildings up to which those off the route are named where there is room."""


@dataclass(frozen=True)
class Scene:
    """A mission with its places and buildings worked out.

    Parameters
    ----------
    mission
        The mission.
    where
        Its places by number.
    obstacles
        Its buildings as prisms.
    """

    mission: Mission
    where: Places
    obstacles: Prisms

    def positions(self, names: Sequence[str]) -> list[Point]:
        """Positions of places [m] by their names."""
        known = dict(zip(self.where.names, self.where.position_m.tolist(), strict=True))
        return [(x, y, z) for x, y, z in (known[name] for name in names)]

    @property
    def direct(self) -> tuple[str, ...]:
        """Places of the direct route; without the hover point where it does not exist."""
        names = self.where.names
        reached = np.isfinite(self.where.position_m[HOVER]).all()
        return (names[ORIGIN], *([names[HOVER]] if reached else []), names[DESTINATION])

    @property
    def disc_radius_m(self) -> float:
        """Radius of the coverage at the altitude of hovering [m]; NaN where it does not reach."""
        hover_z_m = float(self.where.position_m[HOVER, 2])
        altitude_m = self.mission.limits.min_altitude_m if math.isnan(hover_z_m) else hover_z_m
        height_m = altitude_m - self.mission.link.device_m[2]
        squared = vehicle.coverage_radius_m(self.mission) ** 2 - height_m**2
        return math.sqrt(squared) if squared >= 0.0 else math.nan


def scene(mission: Mission) -> Scene:
    """Work out what a map of a mission shows."""
    obstacles = prisms(mission)
    return Scene(mission, build_places(mission, obstacles), obstacles)


def draw_plan_view(ax: Axes, shown: Scene) -> list[Artist]:
    """Draw all that stands on the map, and set its limits; entries of the legend."""
    mission, entries = shown.mission, list[Artist]()
    _frame(ax, shown)
    radius_m = shown.disc_radius_m
    if math.isfinite(radius_m):
        disc = Circle(
            mission.link.device_m[:2],
            radius_m,
            facecolor=f"{GREEN}26",
            edgecolor=GREEN,
            linewidth=0.8,
            label="coverage at the hover altitude",
        )
        ax.add_artist(disc)  # unlike a patch, it leaves the limits alone
        entries.append(disc)
    entries += _sight_lines(ax, shown)
    rings = [outline_m(building) for building in mission.buildings]
    footprints = PolyCollection(
        [ring for ring in rings if ring is not None],
        facecolor=PALE,
        edgecolor=GREY,
        linewidth=0.6,
        zorder=2,
        label="building",
    )
    ax.add_collection(footprints, autolim=False)
    roofs = shown.where.position_m[shown.where.buildings]
    ax.plot(*roofs[:, :2].T, ".", color=GREY, markersize=2.5, zorder=2.1)
    if mission.buildings:
        entries.append(footprints)
    entries += ax.plot(
        *mission.link.device_m[:2], "^", color=GREEN, markersize=6, zorder=4, label="ground device"
    )
    if mission.laser is not None:
        entries += ax.plot(
            *mission.laser.position_m[:2], "*", color=PURPLE, markersize=9, zorder=4, label="laser"
        )
    ax.set(xlabel="x [m]", ylabel="y [m]")
    return entries


def _frame(ax: Axes, shown: Scene) -> None:
    """Limits that hold all places, and the coverage as far as it does not dwarf them."""
    ax.set_aspect("equal", adjustable="datalim")
    ax.margins(0.0)
    ax.update_datalim(np.transpose([margins(values) for values in extent(shown).T]))


def extent(shown: Scene) -> Floats:
    """Two corners (2, 2) of the box on the map that holds what is worth seeing [m]."""
    mission = shown.mission
    corners = [mission.link.device_m[:2]]
    corners += [position[:2] for position in shown.where.position_m if np.isfinite(position).all()]
    corners += [mission.laser.position_m[:2]] if mission.laser else []
    corners += [corner for each in mission.buildings for corner in outline_m(each) or ()]
    low, high = np.min(corners, axis=0), np.max(corners, axis=0)
    if math.isfinite(radius_m := shown.disc_radius_m):
        device = np.array(mission.link.device_m[:2])
        room = COVERAGE_SHARE * float((high - low).max()) or radius_m
        low, high = (
            np.minimum(low, np.maximum(device - radius_m, low - room)),
            np.maximum(high, np.minimum(device + radius_m, high + room)),
        )
    return np.stack([low, high])


def _sight_lines(ax: Axes, shown: Scene) -> Iterator[Artist]:
    if shown.mission.laser is None:
        return
    source = shown.mission.laser.position_m[:2]
    charging = np.concatenate([[HOVER], shown.where.buildings])
    charging = charging[np.isfinite(shown.where.position_m[charging]).all(axis=1)]
    sight = shown.where.laser_sight[charging]
    strength = 1.0 if len(charging) <= FEW else 0.5
    looks: tuple[tuple[Integers, str, Any, str], ...] = (
        (charging[~sight], VERMILLION, (0.0, (2.0, 2.0)), "blocked sight line"),
        (charging[sight], PURPLE, "-", "clear sight line of the laser"),
    )
    for places_seen, colour, dashes, words in looks:
        if len(places_seen):
            ends = shown.where.position_m[places_seen, :2].tolist()
            lines = LineCollection(
                [[source, end] for end in ends],
                colors=colour,
                linestyles=[dashes],
                linewidths=0.6 * strength,
                alpha=0.5 + 0.3 * strength,
                zorder=1.5,
            )
            ax.add_collection(lines, autolim=False)
            yield Line2D([], [], color=colour, linestyle=dashes, linewidth=0.9, label=words)


def drawn_sight_lines(ax: Axes) -> list[Floats]:
    """Corners of the sight lines on a map."""
    bundles = [each for each in ax.collections if isinstance(each, LineCollection)]
    return [np.asarray(path.vertices) for bundle in bundles for path in bundle.get_paths()]


def scenery_labels(shown: Scene) -> list[Label]:
    """Names of the device and the laser, and of the buildings where there is room."""
    mission = shown.mission
    small = {"fontsize": 6.5, "color": "#404040"}
    found = [Label("device $\\mathbf{w}_u$", mission.link.device_m[:2])]
    if mission.laser is not None:
        found.append(Label("laser $\\mathbf{w}_s$", mission.laser.position_m[:2]))
    found += [
        Label(printed(each.name), each.position_m[:2], needed=False, style=small)
        for each in mission.buildings
        if len(mission.buildings) <= MOST_NAMED
    ]
    return found
