"""From a map file to the buildings of a city."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import geopandas
import numpy as np
import numpy.typing as npt
import pyproj
import shapely

from optuav.arrays import Floats, Integers
from optuav.city.building_parts import built, in_place_of_outlines, underground
from optuav.city.city import ON_EARTH, City, on_earth
from optuav.city.cityjson import FARTHEST
from optuav.city.files import checked_table, features_of, placed, system_of
from optuav.city.height_questions import in_feet, not_asked, nowhere, unknown_heights
from optuav.city.heights import OF_OPENSTREETMAP, heights, remarks_on
from optuav.city.outlines import mended, parts_of
from optuav.errors import Fault, InputError, collected, refuse
from optuav.fields import MOST_CORNERS, Range
from optuav.mission.earth import DEGREES, plane
from optuav.mission.files import label, refusal
from optuav.mission.messages import misfits, path_of, shown
from optuav.presentation.numbers import figure, typed

HEIGHT = Range("m", gt=0, le=1e6)
FACTOR = Range("m", gt=0, le=1000)  # Unit of heights
FARTHEST_M = 1e6  # Largest distance of a building from the origin of a mission
DECIMALS = 3  # Decimals of corners [m], so that they are the same on any processor
HALF_TURN = 180.0  # deg


def read(
    path: str | Path | geopandas.GeoDataFrame,
    *,
    layer: str | None = None,
    crs: str | int | None = None,
    height: str | None = None,
    height_factor: float | None = None,
    levels: str | None = None,
    level_height_m: float = 3.0,
    default_height_m: float | None = None,
    bbox: tuple[float, float, float, float] | None = None,
    origin: tuple[float, float] | None = None,
) -> City:
    """Read the buildings of a map, and project them to metres.

    Every polygon is a building; one of several polygons is as many buildings of the same height.
    Where the features have a column ``building``, such as OpenStreetMap's, a feature counts if its
    value is not missing, blank, ``no``, ``false`` or ``0``. Parts, by ``building:part``, count in
    place of the outline that they lie in. Courtyards count as built over.

    Parameters
    ----------
    path
        A GeoPackage, GeoParquet, GeoJSON (one document, or one feature a line), shapefile,
        FlatGeobuf, or OpenStreetMap's .osm.pbf, .osm or Overpass JSON with geometry; or CityJSON
        (one document, or a sequence), whose solids count by their outline from above and their
        height over the lowest corner of the building that they are a part of; or a zip with one of
        them. Nothing else is opened, and no address. Or a GeoDataFrame.
    layer
        The layer with the buildings; by default the only one with polygons, or the one of them that
        is named after buildings.
    crs
        Coordinate reference system of a file that states none, for example ``"EPSG:25832"``; with
        a second code for heights perhaps, as in ``"EPSG:25832+7837"``.
    height
        Column, or tag of OpenStreetMap, with the height of the roof over ground, as a number or a
        text such as ``12 m``, ``40 ft`` or ``11'4"``; by default ``height``. If it is left out,
        columns that are nearly named so are asked for where a height is missing.
    height_factor
        Metres per unit of heights that are numbers, 0 < x <= 1000 [m], 0.3048 for feet; by default
        1. Solids are in the unit of the reference system; one without a vertical axis leaves it to
        this factor, if no other column is named by `height`.
    levels
        Column or tag with the number of storeys, for buildings without a height; by default
        ``building:levels``, and asked for like `height`. Storeys or the height of the roof, by
        ``roof:levels`` and ``roof:height``, are added.
    level_height_m
        Height of a storey, 0 < x <= 1e6 [m].
    default_height_m
        Height of buildings that state neither, 0 < x <= 1e6 [m]; by default they are refused, and
        so are those that do not begin below their roof, which otherwise keep the roof they state.
    bbox
        West, south, east and north end of the part to read, longitudes and latitudes [deg]; the
        buildings that reach into it count. By default everything.
    origin
        Longitude and latitude of x = y = 0 [deg]; by default the middle of the buildings.

    Returns
    -------
    City
        The buildings in the order of the file, in the plane of metres around the origin.

    Raises
    ------
    InputError
        If the file cannot be read, states no reference system, misses a named column, has other
        columns that may be meant or heights that seem to be in feet, or has no buildings there;
        with every building whose height is missing.

    Examples
    --------
    >>> import optuav
    >>> try:
    ...     optuav.city.read("nowhere.gpkg", level_height_m=-1)
    ... except optuav.InputError as error:
    ...     print(error)
    level_height_m = -1: must be a number, 0 < x <= 1e6 [m]
    nowhere.gpkg: there is no such file
    """
    bbox = tuple(bbox.tolist()) if isinstance(bbox, np.ndarray) else bbox
    origin = tuple(origin.tolist()) if isinstance(origin, np.ndarray) else origin
    named, file = {"height": height, "levels": levels}, Path("GeoDataFrame")
    remarks: tuple[str, ...] = ()
    faults = [*_faults(named, level_height_m, height_factor, default_height_m, bbox, origin)]
    system = None if crs is None else system_of(crs)
    if crs is not None and system is None:
        words = 'a coordinate reference system that pyproj knows, such as "EPSG:25832"'
        faults.append(Fault("crs", shown(crs), words))
    with collected(faults):
        if isinstance(path, geopandas.GeoDataFrame):
            frame = checked_table(path, file, layer)
        else:
            file = path_of(path, words="a path or a GeoDataFrame")
            within = bbox if crs is None and not faults else None
            frame, remarks = features_of(file, layer, within)
    refuse(faults)
    frame, is_part, not_built = built(frame)
    frame, left_out = _with_areas(placed(file, frame, system), file)
    frame = _in_box(frame, bbox, file, remarks)

    names = {option: name or OF_OPENSTREETMAP[option] for option, name in named.items()}
    refuse(nowhere(file, frame, names))
    refuse(in_feet(file, frame, names["height"], height_factor))
    measured = heights(frame, names, level_height_m, height_factor)
    buried, below_others = underground(frame, measured)
    measured = measured.assign(part=is_part, mended=frame["mended"], below_others=below_others)
    town = geopandas.GeoDataFrame(measured, geometry=frame.geometry.to_crs(DEGREES))[~buried]
    if not len(town):
        raise refusal(file, "has no buildings above the ground")
    town, by_parts, too_high = in_place_of_outlines(town)
    unknown = town["roof_m"].isna().to_numpy()
    refuse(not_asked(file, frame.loc[town.index], unknown, named))
    if default_height_m is None:
        refuse(unknown_heights(file, frame, town, names))
    roof_m = town["roof_m"].fillna(town["stated_m"])  # Which no default replaces
    town = town.assign(assumed=roof_m.isna(), roof_m=roof_m.fillna(default_height_m or 0.0))
    gone = {"by_parts": by_parts, "higher_outlines": too_high}
    gone |= {"underground": frame.index[buried], "not_built": not_built, "left_out": left_out}
    remarks = (*remarks, *remarks_on(frame, town, names["height"], height_factor))
    origin = _origin(file, town, origin)
    return _city(file, town, origin, gone, remarks)


def _city(
    file: Path, town: Any, origin: tuple[float, float], gone: dict[str, Any], remarks: Any
) -> City:
    """The city of features in degrees, with the height of their roofs and what is noted on them."""
    shapes = town.geometry.to_crs(plane(origin)).to_numpy()
    # Edges that are straight on one map are bent on another, and rounding moves corners.
    shapes = shapely.transform(shapes, lambda at_m: np.round(at_m, DECIMALS))
    shapes, bent = mended(shapes, town.index, file)
    parts, of = parts_of(shapes)
    areas = np.asarray(shapely.area(parts) > 0.0)
    parts, of = parts[areas], of[areas]
    if not len(parts):
        raise refusal(file, "has no buildings larger than a millimetre")
    footprints = np.asarray(shapely.polygons(shapely.get_exterior_ring(parts)))
    refuse(_detailed(footprints, town.index[of], file))
    names, roofs = _names(town.index, of), town.iloc[of]
    noted = {
        "level_heights": roofs["of_levels"],
        "assumed_heights": roofs["assumed"],
        "unread": roofs["of"] != "",
        "mended": roofs["mended"] | bent[of],
        "filled": shapely.get_num_interior_rings(parts) > 0,
        "from_ground": roofs["raised"],
        "below_others": roofs["below_others"],
    }
    lost = town.index[np.bincount(of, minlength=len(town)) == 0]
    gone = gone | {"left_out": [*gone["left_out"], *lost]}
    return City(
        tuple(names),
        np.column_stack([_points_on(parts), roofs["roof_m"]]),
        footprints,
        (float(origin[0]), float(origin[1])),
        **{name: tuple(itertools.compress(names, where)) for name, where in noted.items()},
        **{name: tuple(map(str, numbers)) for name, numbers in gone.items()},
        remarks=remarks,
    )


def _origin(file: Path, town: Any, origin: tuple[float, float] | None) -> tuple[float, float]:
    """The origin [deg], by default the middle of a town; refused where the town is far from it."""
    west, south, east, north = town.total_bounds.tolist()
    if not (on_earth((west, south)) and on_earth((east, north))):
        raise refusal(file, f"has places that are not on Earth: {ON_EARTH}")
    if origin is None:
        if east - west > HALF_TURN:
            middle = f"180 and {typed((south + north) / 2, 6)} for example"
            raise refusal(file, f"lies on both sides of the antimeridian: set origin, {middle}")
        origin = round((west + east) / 2, 6), round((south + north) / 2, 6)
    ends = np.array([(x, y, *origin) for x in (west, east) for y in (south, north)]).T
    if max(pyproj.Geod(ellps="WGS84").inv(*ends)[2]) > FARTHEST_M:
        words = f"has buildings more than {figure(FARTHEST_M / 1e3)} km from longitude, latitude"
        raise refusal(file, f"{words} = {origin}: choose a part of it by bbox, or a nearer origin")
    return origin


def _faults(
    named: Mapping[str, object],
    level_height_m: object,
    factor: object,
    default_height_m: object,
    bbox: object,
    origin: object,
) -> Iterator[Fault]:
    """Yield the faults of the names and the numbers among the options."""
    for option, name in named.items():
        if not isinstance(name, str | None):
            yield Fault(option, shown(name), "a text")
    yield from misfits(("level_height_m", level_height_m, HEIGHT))
    if factor is not None:
        yield from misfits(("height_factor", factor, FACTOR))
    if default_height_m is not None:
        yield from misfits(("default_height_m", default_height_m, HEIGHT))
    ends = [*bbox] if isinstance(bbox, Sequence) and len(bbox) == 4 else [0] * 4
    ordered = on_earth(ends[:2]) and on_earth(ends[2:]) and ends[0] < ends[2] and ends[1] < ends[3]
    if bbox is not None and not ordered:
        words = "west, south, east, north: longitudes and latitudes, west < east, south < north"
        yield Fault("bbox", shown(bbox), f"{words} [deg]")
    if origin is not None and not on_earth(origin):
        yield Fault("origin", shown(origin), f"longitude, latitude: {ON_EARTH}")


def _with_areas(frame: Any, file: Path) -> tuple[Any, Any]:
    """The features that have an area, with valid outlines, and the names of the others.

    The column `mended` tells which outlines were not valid.
    """
    if (np.abs(frame.total_bounds) > FARTHEST).any():
        raise refusal(file, f"has coordinates beyond {figure(FARTHEST)}")
    shapes, broken = mended(frame.geometry.to_numpy(), frame.index, file)
    frame = frame.set_geometry(geopandas.GeoSeries(shapes, frame.index, frame.crs))
    large = shapely.area(shapes) > 0.0
    return frame.assign(mended=broken)[large], frame.index[~large]


def _in_box(frame: Any, bbox: Any, file: Path, remarks: Sequence[str]) -> Any:
    """The features that reach into a box; refused if there are none."""
    if bbox is not None:
        frame = frame[frame.geometry.to_crs(DEGREES).intersects(shapely.box(*bbox))]
        if not len(frame):
            words = "no building reaches into it"
            raise InputError([Fault("bbox", shown(bbox), words, label(file))])
    if not len(frame):
        raise refusal(file, "; ".join(["has no buildings", *remarks]))
    return frame


def _detailed(footprints: npt.NDArray[np.object_], names: Any, file: Path) -> Iterator[Fault]:
    """Yield a fault for each outline with more corners than a mission takes."""
    corners = shapely.get_num_coordinates(footprints) - 1
    for k in np.flatnonzero(corners > MOST_CORNERS):
        words = f"has an outline with {corners[k]} corners, more than {MOST_CORNERS}; simplify it"
        yield Fault(f"feature {names[k]}", "", words, label(file))


def _points_on(parts: npt.NDArray[np.object_]) -> Floats:
    """A point on each polygon (polygon, 2) [m], in no courtyard, rounded where it stays on it."""
    exact = shapely.get_coordinates(shapely.point_on_surface(parts))
    rounded = np.round(exact, DECIMALS)
    return np.where(shapely.intersects_xy(parts, *rounded.T)[:, None], rounded, exact)


def _names(index: Any, of: Integers) -> list[str]:
    """A name for every part, of its feature and its number there."""
    heads = [f"b{label}" if isinstance(label, int | np.integer) else str(label) for label in index]
    part = np.arange(len(of)) - np.searchsorted(of, of)
    both = zip(of.tolist(), part.tolist(), strict=True)
    return [heads[k] + (f"-{number + 1}" if number else "") for k, number in both]
