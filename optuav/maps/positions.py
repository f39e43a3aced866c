"""The longest hover over positions of the device, the laser or the hover point."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import isfinite, isnan
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np

from formulations.soc import AVAILABLE, PERSPECTIVES
from optuav.arrays import Floats
from optuav.errors import Fault, collected, refuse, require
from optuav.fields import Range
from optuav.mission import Mission, load
from optuav.mission.earth import stated_system
from optuav.mission.messages import first_ten, misfits, nearest, shown, unlisted
from optuav.network.map_extent import scene
from optuav.network.places import charging_cap
from optuav.network.vehicle import hover_points_m
from optuav.options import Perspective
from optuav.presentation.numbers import figure, seconds
from optuav.service.calm_air import in_calm_air, with_words
from optuav.solving import solve
from optuav.solving.question import checked_question
from optuav.status import SAME_S
from optuav.studies.batch import Solved, labelled, solved_batch

if TYPE_CHECKING:
    import xarray

Bounds: TypeAlias = Sequence[float] | Floats
COORDINATE, DISTANCE = Range("m", ge=-1e6, le=1e6), Range("m", ge=1e-3, le=1e6)
DECIMALS = 6  # Decimals of coordinates [m]
ROUNDED_DISTANCE = 1e-9  # Share of a distance that bounds may fall short of the last point
MOST_POINTS, BYTES = 4_000_000, 100
"""Most points of a map, and about the memory that each takes while it is computed."""
DEVICE, LASER, HOVER_POINT = "link.device_m", "laser.position_m", "route.hover_m"
"""Keys of the places that a map moves; those of one of several devices are in `OF_SEVERAL`."""
OF_SEVERAL = {DEVICE: "devices.{}.position_m", HOVER_POINT: "devices.{}.hover_m"}
ROOM = 0.05  # Margin of a map's default bounds on every side, as a share of its size


def device(
    mission: Mission | str | Path,
    step_m: float,
    *,
    device: str | None = None,
    bounds: Bounds | None = None,
    height_m: float | None = None,
    perspective: Perspective = AVAILABLE,
) -> xarray.DataArray:
    """Find the longest hover with the ground device anywhere on a grid.

    Parameters
    ----------
    mission
        A mission, the name of a shipped one, or the path of a mission file.
    step_m
        Distance between two points along x and along y [m], 0.001 to 1e6; at most 4 million points.
    device
        Name of the device that moves, of a mission with several; the others stay.
    bounds
        Least x, least y, largest x and largest y [m], each -1e6 to 1e6, the first two being a
        point's; by default multiples of the distance around everything in the mission.
    height_m
        Height z of all points [m], -1e6 to 1e6; by default that of the mission's own device.
    perspective
        As for `optuav.solve`.

    Returns
    -------
    xarray.DataArray
        Longest hover of P1 by ``y`` and ``x`` [s], NaN without a plan, each as by `optuav.solve`.
        The coordinate ``reason`` is why there is no plan, as a number whose words are in its
        attributes ``flag_meanings`` and ``words`` (0 with a plan). Attributes state ``mission``,
        ``perspective``, the key that varies (``over``), its ``height_m``, the ``crs`` if there is
        one, ``best_m``: where the hover is longest, of ``best_points`` such points the one nearest
        to the mission's own, ``best_at``: whether that is ``"inside"`` the map or at its
        ``"edge"``, ``best_because``: what caps the charging current there, if something does, and
        ``in_calm_air``: what calm air gives there, if hovering counts on the wind.

    Raises
    ------
    InputError
        With all faults of the points and the options.

    Examples
    --------
    >>> import optuav
    >>> hover_map = optuav.maps.device("paper", 100, bounds=(900, 2900, 1100, 3000))
    >>> print(hover_map.round(1).values)
    [[600.1 599.4 600. ]
     [597.9 597.3 597.8]]
    """
    return hovers(DEVICE, mission, step_m, bounds, height_m, perspective, device).labelled()


def laser(
    mission: Mission | str | Path,
    step_m: float,
    *,
    bounds: Bounds | None = None,
    height_m: float | None = None,
    perspective: Perspective = AVAILABLE,
) -> xarray.DataArray:
    """Find the longest hover with the laser anywhere on a grid.

    Where buildings hide it from the roofs, hovering is as long as without a rest.

    Parameters
    ----------
    mission, step_m, bounds, height_m, perspective
        As for `device`; the mission has a laser.

    Returns
    -------
    xarray.DataArray
        As for `device`.

    Raises
    ------
    InputError
        With all faults of the points and the options, or if the mission has no laser.

    Examples
    --------
    >>> import optuav
    >>> hover_map = optuav.maps.laser("paper", 500, bounds=(0, 0, 2000, 2000), height_m=10)
    >>> dict(hover_map.sizes), hover_map.attrs["best_m"]
    ({'y': 5, 'x': 5}, [1000.0, 0.0, 10.0])
    """
    return hovers(LASER, mission, step_m, bounds, height_m, perspective).labelled()


def hover_point(
    mission: Mission | str | Path,
    step_m: float,
    *,
    device: str | None = None,
    bounds: Bounds | None = None,
    height_m: float | None = None,
    perspective: Perspective = AVAILABLE,
) -> xarray.DataArray:
    """Find the longest hover anywhere on a grid within reach of the device.

    Parameters
    ----------
    mission, step_m, perspective
        As for `device`.
    device
        Name of the device whose hover point moves, of a mission with several.
    bounds
        As for `device`; by default around the points within reach of the device.
    height_m
        Height of the points [m]; by default the height of the mission's own hover point.

    Returns
    -------
    xarray.DataArray
        As for `device`; out of reach of the device it is NaN, with this reason.

    Raises
    ------
    InputError
        With all faults of the points and the options.

    Examples
    --------
    >>> import optuav
    >>> hover_map = optuav.maps.hover_point("paper", 300, bounds=(1000, 2450, 1600, 2750))
    >>> print(hover_map.round(1).values)
    [[  nan   nan   nan]
     [592.3   nan   nan]]
    >>> hover_map.reason.attrs["words"].splitlines()[int(hover_map.reason[0, 0])][:46]
    'the device is out of reach of the hover point '
    """
    return hovers(HOVER_POINT, mission, step_m, bounds, height_m, perspective, device).labelled()


class HoverMap(NamedTuple):
    """The longest hovers over positions, without the library that labels arrays."""

    solved: Solved
    facts: dict[str, Any]
    # Coordinates of the points [m].
    x: Floats
    y: Floats

    def labelled(self) -> xarray.DataArray:
        """The map as an array with coordinates and attributes."""
        require("xarray", "maps")
        keys = dict(zip(self.solved.keys, "yx", strict=True))
        values = labelled(self.solved).set_coords("reason")["hover_time_s"]
        return values.rename(keys).assign_attrs(self.facts)


def hovers(
    over: str,
    mission: Mission | str | Path,
    step_m: float,
    bounds: Bounds | None,
    height_m: float | None,
    perspective: Perspective,
    device: str | None = None,
) -> HoverMap:
    """The longest hovers with a place of the mission, by its key, anywhere on a grid.

    With several devices, the place is that of the device by its name.
    """
    faults = [*faults_of(step_m, bounds, height_m, perspective)]
    with collected(faults):
        whole = load(mission)
        faults += _device_faults(over, whole, device)
        if over == LASER and whole.laser is None:
            faults.append(Fault("laser", "", "the mission has none that could be elsewhere"))
        checked_question(whole, "P1", perspective)
    refuse(dict.fromkeys(faults))
    key = OF_SEVERAL[over].format(device) if device is not None else over
    number = [served.name for served in whole.served].index(device) if device is not None else 0
    own_m = _own_m(over, whole, number)
    x_m, y_m, z_m = own_m if height_m is None else (*own_m[:2], float(height_m))
    base = whole.replace({key: (x_m, y_m, z_m)})
    around_m = _around_m(over, base, number, step_m) if bounds is None else np.array([*bounds])
    x, y = _axes(around_m.reshape(2, 2), float(step_m))
    solved = solved_batch(base, {f"{key}[1]": y, f"{key}[0]": x}, perspective=perspective)
    facts: dict[str, Any] = {"mission": whole.name, "perspective": perspective}
    facts |= {"over": key, "height_m": z_m}
    facts |= {"crs": crs} if (crs := stated_system(whole)) else {}
    hover_s = solved.values["hover_time_s"]
    if not np.isnan(hover_s).all():
        longest = hover_s >= np.nanmax(hover_s) - SAME_S
        away = np.where(longest, (x - x_m) ** 2 + (y - y_m)[:, None] ** 2, np.inf)
        row, column = divmod(int(away.argmin()), len(x))
        facts["best_m"] = [float(x[column]), float(y[row]), z_m]
        facts["best_points"] = int(longest.sum())
        if over == LASER:
            there = base.replace({LASER: facts["best_m"]})
            if cap := charging_cap(there, scene(there).places):
                facts["best_because"] = cap.words
        at_edge = row in (0, len(y) - 1) or column in (0, len(x) - 1)
        facts["best_at"] = "edge" if at_edge else "inside"
        _, words = with_words(
            in_calm_air(
                base.replace({key: facts["best_m"]}),
                lambda calm: solve(calm, perspective=perspective).hover_time_s,
            ),
            lambda hover_s: f"{seconds(hover_s)} of hover there",
        )
        facts |= {"in_calm_air": words} if words else {}
    return HoverMap(solved, facts, x, y)


def faults_of(
    step_m: object, bounds: Any, height_m: object, perspective: object
) -> Iterator[Fault]:
    """Yield the faults of a map's options that do not depend on the mission."""
    if height_m is not None:
        yield from misfits(("height_m", height_m, COORDINATE))
    yield from misfits(("step_m", step_m, DISTANCE))
    if bounds is not None:
        ends = [*bounds] if isinstance(bounds, Sequence) or np.ndim(bounds) == 1 else []
        is_box = len(ends) == 4 and all(map(COORDINATE.accepts, ends))
        if not is_box or ends[0] >= ends[2] or ends[1] >= ends[3]:
            words = "least x, least y, largest x and largest y, larger than the least, each"
            yield Fault("bounds", shown(bounds), f"{words} {COORDINATE.words}")
        elif DISTANCE.accepts(step_m) and min(ends[2] - ends[0], ends[3] - ends[1]) < step_m:
            words = "must hold at least two points each way: too near for step_m"
            yield Fault("bounds", shown(bounds), words)
    yield from unlisted(("perspective", perspective, tuple(PERSPECTIVES)))


def _axes(corners_m: Floats, step_m: float) -> list[Floats]:
    """Coordinates x and y of points at one distance, from the first of two corners (2, 2) [m]."""
    most = np.floor(np.diff(corners_m, axis=0)[0] / step_m + ROUNDED_DISTANCE).astype(int) + 1
    columns, rows = most.tolist()
    if (count := columns * rows) > MOST_POINTS:
        words = f"at most {MOST_POINTS} points, which take {figure(MOST_POINTS * BYTES / 1e9)} GB"
        refuse([Fault("step_m", f"{columns} × {rows} = {count} points", words)])
    return [
        np.round(first_m + step_m * np.arange(number), DECIMALS) + 0.0  # no -0.0
        for first_m, number in zip(corners_m[0], most, strict=True)
    ]


def _device_faults(over: str, mission: Mission, device: object) -> Iterator[Fault]:
    """Yield the fault of the name of a device: one of several must be named, a single one is it."""
    names = [served.name for served in mission.devices]
    if device is None:
        if names and over in OF_SEVERAL:
            words = f"is missing; the mission has several devices: one of {first_ten(names)}"
            yield Fault("device", "", words)
    elif over not in OF_SEVERAL:
        yield Fault("device", shown(device), "goes with maps of a device or of its hover point")
    elif not names:
        yield Fault("device", shown(device), "goes with several devices, and the mission has one")
    elif device not in names:
        words = f"one of the devices {first_ten(names)}{nearest(str(device), names)}"
        yield Fault("device", shown(device), words)


def _own_m(over: str, mission: Mission, number: int) -> tuple[float, float, float]:
    """The place that the mission itself has [m]; without a hover point, one near the device."""
    if over == LASER:
        assert mission.laser is not None
        return mission.laser.position_m
    device_m = mission.served[number].position_m
    if over == DEVICE:
        return device_m
    x, y, z = map(float, hover_points_m(mission)[number])
    return (*device_m[:2], mission.limits.min_altitude_m) if isnan(z) else (x, y, z)


def _around_m(over: str, mission: Mission, number: int, step_m: float) -> Floats:
    """Two corners (2, 2) of a map's default bounds, multiples of a distance [m]."""
    around = scene(mission)
    low_m, high_m = around.corners_m
    if over == HOVER_POINT and isfinite(reach_m := around.disc_radii_m[number]):
        device_m = around.devices_m[number, :2]
        low_m, high_m = device_m - reach_m, device_m + reach_m
    room_m = ROOM * (high_m - low_m).max()
    first, last = np.floor((low_m - room_m) / step_m), np.ceil((high_m + room_m) / step_m)
    return step_m * np.array([first, np.maximum(last, first + 1.0)])
