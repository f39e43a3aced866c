"""The scenery of a map: buildings, device, laser, coverage and sight lines."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.lines import Line2D
from matplotlib.patches import Circle
from matplotlib.typing import LineStyleType

from optuav.arrays import Floats
from optuav.mission import Mission
from optuav.network import vehicle
from optuav.network.obstacles import Prisms, outline_m, prisms
from optuav.network.places import DESTINATION, HOVER, ORIGIN, Places, build_places
from optuav.plots import style
from optuav.plots.labels import Label
from optuav.plots.style import GREEN, GREY, PURPLE, VERMILLION, Look

Point: TypeAlias = tuple[float, float, float]

MARKERS = {"hover": "o", "rest": "s"}
COVERAGE_SHARE = 0.4
"""Most that the coverage disc adds to the map on every side, as a share of the places' span."""
FEW = 30
"""Most sight lines that are drawn strongly."""
MOST_NAMED = 400
"""Most buildings of which those off the route are named where there is room."""


@dataclass(frozen=True)
class Scene:
    """A mission with its places, by number, and its buildings as prisms."""

    mission: Mission
    places: Places
    obstacles: Prisms

    def positions(self, names: Sequence[str]) -> list[Point]:
        """Positions of places [m] by their names."""
        known = dict(zip(self.places.names, self.places.position_m.tolist(), strict=True))
        return [(x, y, z) for x, y, z in (known[name] for name in names)]

    @property
    def direct(self) -> tuple[str, ...]:
        """Places of the direct route; without the hover point where it does not exist."""
        names = self.places.names
        reached = np.isfinite(self.places.position_m[HOVER]).all()
        return (names[ORIGIN], *([names[HOVER]] if reached else []), names[DESTINATION])

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
        mission, position_m = self.mission, self.places.position_m
        device = np.array(mission.link.device_m[:2])
        seen = [device, *position_m[np.isfinite(position_m).all(axis=1), :2]]
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
        disc = Circle(device, radius_m, facecolor=f"{GREEN}26", edgecolor=GREEN, linewidth=0.8)
        disc.set_label("coverage at the hover altitude")
        ax.add_artist(disc)  # unlike a patch, it leaves the limits alone
        entries.append(disc)
    entries += _sight_lines(ax, shown)
    rings = [outline_m(building) for building in mission.buildings]
    footprints = PolyCollection(
        [ring for ring in rings if ring is not None],
        facecolor=style.PALE,
        edgecolor=GREY,
        linewidth=0.6,
        zorder=2,
        label="building",
    )
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


def _sight_lines(ax: Axes, shown: Scene) -> Iterator[Artist]:
    if shown.mission.laser is None:
        return
    source, position_m = shown.mission.laser.position_m[:2], shown.places.position_m
    charging = np.concatenate([[HOVER], shown.places.buildings])
    charging = charging[np.isfinite(position_m[charging]).all(axis=1)]
    sight = shown.places.laser_sight[charging]
    strength = 1.0 if len(charging) <= FEW else 0.5
    looks: tuple[tuple[bool, str, LineStyleType, str], ...] = (
        (False, VERMILLION, (0.0, (2.0, 2.0)), "blocked sight line"),
        (True, PURPLE, "-", "clear sight line of the laser"),
    )
    for clear, colour, dashes, words in looks:
        ends = position_m[charging[sight == clear], :2].tolist()
        if ends:
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
    return {
        "marker": MARKERS[kind],
        "markersize": 6.0,
        "markerfacecolor": colour if stays else "white",
        "markeredgecolor": "white" if stays else colour,
        "markeredgewidth": 0.8,
    }
