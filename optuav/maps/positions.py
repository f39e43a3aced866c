"""The longest hover over positions of the device, the laser or the hover point."""

from __future__ import annotations

from functools import partial
from math import isfinite, isnan
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from formulations.soc import AVAILABLE
from optuav.arrays import Floats
from optuav.errors import Fault, collected, refuse
from optuav.maps.grid import Bounds, Grid, axes, faults
from optuav.mission import Mission, load
from optuav.network.routes import SAME_S
from optuav.network.scene import scene
from optuav.network.vehicle import hover_point_m
from optuav.options import Perspective
from optuav.solving.question import checked_question
from optuav.studies.batch import batch

if TYPE_CHECKING:
    import xarray

DEVICE, LASER, HOVER_POINT = "link.device_m", "laser.position_m", "route.hover_m"
"""Keys of the places that a map moves."""
ROOM = 0.05  # On every side of what a map shows by default, as a share of its size


def device(
    mission: Mission | str | Path,
    grid: Grid,
    *,
    bounds: Bounds | None = None,
    height_m: float | None = None,
    perspective: Perspective = AVAILABLE,
) -> xarray.DataArray:
    """Find the longest hover with the ground device anywhere on a grid.

    Parameters
    ----------
    mission
        A mission, the name of a shipped one, or the path of a mission file.
    grid
        Distance between two points, 0.001 <= x <= 1e6 [m]; or the arrays x and y, each of at least
        two growing numbers, -1e6 to 1e6 [m]. At most 4 million points.
    bounds
        Least x, least y, largest x and largest y of a grid that states a distance [m]; by default
        around all that the mission has: places, buildings, and the coverage of the device.
    height_m
        Height z of all points, -1e6 to 1e6 [m]; by default that of the mission's own device.
    perspective
        As for `optuav.solve`.

    Returns
    -------
    xarray.DataArray
        Longest hover of P1 by ``y`` and ``x`` [s], NaN without a plan, each as by `optuav.solve`.
        Beside it stands the coordinate ``reason``: why there is no plan, as a number whose words
        are in its attributes ``flag_meanings`` and ``words`` (0 where there is one). Attributes
        state ``mission``, ``perspective``, the key that varies (``over``), its ``height_m``, the
        ``crs`` if the mission has one, and ``best_m``: where the hover is longest, of several such
        points the one nearest to the mission's own.

    Raises
    ------
    InputError
        With all faults of the grid and the options.

    Examples
    --------
    >>> import optuav
    >>> found = optuav.maps.device("paper", ([900, 1000, 1100], [2900, 3000]))
    >>> print(found.round(1).values)
    [[600.1 599.4 600. ]
     [597.9 597.3 597.8]]
    """
    return _hovers(DEVICE, mission, grid, bounds, height_m, perspective)


def laser(
    mission: Mission | str | Path,
    grid: Grid,
    *,
    bounds: Bounds | None = None,
    height_m: float | None = None,
    perspective: Perspective = AVAILABLE,
) -> xarray.DataArray:
    """Find the longest hover with the laser anywhere on a grid.

    Where buildings hide it from the roofs, hovering is as long as without a rest.

    Parameters
    ----------
    mission, grid, bounds, height_m, perspective
        As for `device`; the mission has a laser.

    Returns
    -------
    xarray.DataArray
        As for `device`.

    Raises
    ------
    InputError
        With all faults of the grid and the options, or if the mission has no laser.

    Examples
    --------
    >>> import optuav
    >>> found = optuav.maps.laser("paper", 500, bounds=(0, 0, 2000, 2000), height_m=10)
    >>> dict(found.sizes), found.attrs["best_m"]
    ({'y': 5, 'x': 5}, [1000.0, 0.0, 10.0])
    """
    return _hovers(LASER, mission, grid, bounds, height_m, perspective)


def hover_point(
    mission: Mission | str | Path,
    grid: Grid,
    *,
    bounds: Bounds | None = None,
    height_m: float | None = None,
    perspective: Perspective = AVAILABLE,
) -> xarray.DataArray:
    """Find the longest hover anywhere on a grid within reach of the device.

    Parameters
    ----------
    mission, grid, perspective
        As for `device`.
    bounds
        As for `device`; by default around the points within reach of the device.
    height_m
        Height of the points [m]; by default that of the mission's own hover point.

    Returns
    -------
    xarray.DataArray
        As for `device`; out of reach of the device it is NaN, with this reason.

    Raises
    ------
    InputError
        With all faults of the grid and the options.

    Examples
    --------
    >>> import optuav
    >>> found = optuav.maps.hover_point("paper", ([1000, 1600], [2500.0, 2600.0]))
    >>> print(found.round(1).values)
    [[  nan   nan]
     [595.2   nan]]
    >>> found.reason.attrs["words"].splitlines()[int(found.reason[0, 0])][:46]
    'the device is out of reach of the hover point '
    """
    return _hovers(HOVER_POINT, mission, grid, bounds, height_m, perspective)


def _hovers(
    over: str,
    mission: Mission | str | Path,
    grid: Grid,
    bounds: Bounds | None,
    height_m: float | None,
    perspective: Perspective,
) -> xarray.DataArray:
    """The longest hovers with a place of the mission, by its key, anywhere on a grid."""
    found, own_m = [*faults(grid, bounds, height_m)], None
    with collected(found):
        whole = load(mission)
        if (own_m := _own_m(over, whole)) is None:
            found.append(Fault("laser", "", "the mission has none that could be elsewhere"))
        checked_question(whole, "P1", perspective)
    refuse(found)
    assert own_m is not None
    x_m, y_m, z_m = own_m if height_m is None else (*own_m[:2], float(height_m))
    base = whole.replace({over: (x_m, y_m, z_m)})
    x, y = axes(grid, bounds, partial(_around_m, over, base))
    keys = {f"{over}[1]": "y", f"{over}[0]": "x"}
    values = batch(base, dict(zip(keys, (y, x), strict=True)), perspective=perspective)
    hover_s = values.set_coords("reason")["hover_time_s"].rename(keys)
    facts: dict[str, Any] = {"mission": whole.name, "perspective": perspective}
    facts |= {"over": over, "height_m": z_m} | ({"crs": whole.crs} if whole.crs else {})
    if (best_m := _best(hover_s.to_numpy(), x - x_m, y - y_m)) is not None:
        facts["best_m"] = [float(x[best_m[1]]), float(y[best_m[0]]), z_m]
    return hover_s.assign_attrs(facts)


def _own_m(over: str, mission: Mission) -> tuple[float, float, float] | None:
    """The place that the mission itself has, by its key [m]; for lack of a hover point, one near.

    None without a laser.
    """
    if over == DEVICE:
        return mission.link.device_m
    if over == LASER:
        return mission.laser.position_m if mission.laser else None
    x, y, z = map(float, hover_point_m(mission))
    return (*mission.link.device_m[:2], mission.limits.min_altitude_m) if isnan(z) else (x, y, z)


def _around_m(over: str, mission: Mission) -> Floats:
    """Two corners (2, 2) of what a map shows by default [m]."""
    shown = scene(mission)
    low_m, high_m = shown.corners_m
    if over == HOVER_POINT and isfinite(reach_m := shown.disc_radius_m):
        device_m = np.array(mission.link.device_m[:2])
        low_m, high_m = device_m - reach_m, device_m + reach_m
    room_m = ROOM * (high_m - low_m).max()
    return np.array([low_m - room_m, high_m + room_m])


def _best(hover_s: Floats, away_x: Floats, away_y: Floats) -> tuple[int, int] | None:
    """Row and column of the longest hover [s], of several the nearest; None without a plan."""
    if np.isnan(hover_s).all():
        return None
    longest = hover_s >= np.nanmax(hover_s) - SAME_S
    away = np.where(longest, away_x**2 + away_y[:, None] ** 2, np.inf)
    row, column = divmod(int(away.argmin()), len(away_x))
    return row, column
