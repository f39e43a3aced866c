"""A city: the buildings of a map file as columns, on a plane of metres around an origin."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TypeGuard

import geopandas
import numpy as np
import numpy.typing as npt
import pandas as pd
import pyproj

from optuav.arrays import Floats
from optuav.errors import Fault, InputError
from optuav.fields import COORDINATE, Range
from optuav.mission.building_columns import COLUMNS, corners_of, of_polygons
from optuav.mission.buildings import Buildings
from optuav.mission.earth import DEGREES, plane
from optuav.mission.messages import first_ten, plural, shown
from optuav.presentation.numbers import fixed

ON_EARTH = "|longitude| <= 180, |latitude| <= 90 [deg]"
NOTED = {
    "level_heights": "heights from levels",
    "assumed_heights": "assumed heights",
    "unread": "heights or storeys that cannot be read, or that contradict each other",
    "mended": "invalid outlines that were mended",
    "filled": "buildings whose courtyards count as built over",
    "from_ground": "buildings that begin above the ground (min_height), counted from the ground up",
    "by_parts": "outlines that count by their parts (building:part)",
    "higher_outlines": "outlines of parts that state more height than all of their parts",
    "below_others": "buildings in a layer below 0 with a height, counted as not underground",
    "underground": "underground, or in a layer below 0 without a height, left out",
    "left_out": "features without an area, left out",
    "not_built": "features whose building is empty, no, false or 0, left out",
}
"""Notes on how buildings were made from a file, by the fields that list them."""


def on_earth(place: object) -> TypeGuard[tuple[float, float]]:
    """Return whether a value is a longitude and a latitude [deg]."""
    if not isinstance(place, Sequence) or len(place) != 2:
        return False
    limits = Range("deg", ge=-180, le=180), Range("deg", ge=-90, le=90)
    return all(limit.accepts(coordinate) for limit, coordinate in zip(limits, place, strict=True))


@dataclass(frozen=True, eq=False)
class City:
    """Buildings by number, each a prism from the ground at z = 0 up to its roof.

    Parameters
    ----------
    names
        Name of every building: ``b`` and the number of the feature in the file, or a name of the
        file where it has no numbers; ``-2``, ``-3`` and so on for further parts.
    position_m
        Where a UAV rests (building, 3) [m]: a point on the footprint and in no courtyard, at the
        height of the roof.
    footprints
        Polygons without holes (building) [m].
    origin
        Longitude and latitude of x = y = 0 [deg].
    level_heights, assumed_heights
        Names of buildings whose height follows from their levels, or is the one assumed for those
        that state none.
    unread
        Names of buildings whose file states a height or storeys that cannot be read, or that no
        building has, or that do not begin below their roof; `remarks` quotes them.
    mended
        Names of buildings whose outline was invalid, as one that crosses itself.
    filled
        Names of buildings with courtyards, which count as built over.
    from_ground
        Names of buildings that begin above the ground, by ``min_height`` or ``building:min_level``;
        they count from the ground up.
    below_others
        Names of buildings with a ``layer`` below 0 that state a height; they count as above ground.
    by_parts
        Outlines in place of which their parts count, by ``building:part``: their numbers.
    higher_outlines
        Outlines among them that state more height than all of their parts: their numbers.
    underground
        Features with ``location=underground``, ``is_underground``, or a ``layer`` below 0 and no
        height: their numbers.
    left_out
        Features that have no area: their numbers.
    not_built
        Features whose column ``building`` is missing, blank, ``no``, ``false`` or ``0``: their
        numbers.
    remarks
        Sentences on units, on values that cannot be read, and on other objects of the file.

    Examples
    --------
    >>> import optuav
    >>> from tempfile import TemporaryDirectory
    >>> square = "[[13, 52], [13.0003, 52], [13.0003, 52.0002], [13, 52.0002], [13, 52]]"
    >>> shape = f'{{"type": "Polygon", "coordinates": [{square}]}}'.replace("'", '"')
    >>> feature = f'{{"type": "Feature", "properties": {{"height": 21}}, "geometry": {shape}}}'
    >>> with TemporaryDirectory() as folder:
    ...     file = f"{folder}/block.geojson"
    ...     with open(file, "w") as text:
    ...         _ = text.write(f'{{"type": "FeatureCollection", "features": [{feature}]}}')
    ...     block = optuav.city.read(file, origin=(13.0, 52.0))
    >>> block.names, [round(x, 1) for x in block.position_m[0].tolist()]
    (('b0',), [10.3, 11.1, 21.0])
    >>> optuav.load("paper").replace({"buildings": block.buildings()}).buildings[0].name
    'b0'
    """

    names: tuple[str, ...]
    position_m: Floats
    footprints: npt.NDArray[np.object_]
    origin: tuple[float, float]
    level_heights: tuple[str, ...] = ()
    assumed_heights: tuple[str, ...] = ()
    unread: tuple[str, ...] = ()
    mended: tuple[str, ...] = ()
    filled: tuple[str, ...] = ()
    from_ground: tuple[str, ...] = ()
    below_others: tuple[str, ...] = ()
    by_parts: tuple[str, ...] = ()
    higher_outlines: tuple[str, ...] = ()
    underground: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()
    not_built: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()

    @property
    def crs(self) -> str:
        """The plane of x and y, as pyproj and geopandas take it."""
        return plane(self.origin)

    def point_m(
        self, longitude: float, latitude: float, height_m: float
    ) -> tuple[float, float, float]:
        """Return a place on the map [deg] and over ground [m] as x, y and z [m], to a millimetre.

        Raises
        ------
        InputError
            If the place is not on Earth, or the height is out of range.
        """
        if not on_earth(place := (longitude, latitude)):
            raise InputError([Fault("longitude, latitude", shown(place), ON_EARTH)])
        if not COORDINATE.accepts(height_m):
            raise InputError([Fault("height_m", shown(height_m), COORDINATE.words)])
        ahead = pyproj.Transformer.from_crs(DEGREES, self.crs, always_xy=True)
        x_m, y_m = ahead.transform(*place, errcheck=True)
        return round(x_m, 3), round(y_m, 3), float(height_m)

    def buildings(self) -> Buildings:
        """Return the buildings of a mission, for `Mission.replace`.

        Raises
        ------
        InputError
            With every name and place that a building may not have.
        """
        return of_polygons(self.names, self.position_m, *corners_of(self.footprints))

    def to_frame(self) -> geopandas.GeoDataFrame:
        """Return the buildings by name as a table that geopandas draws and writes.

        Returns
        -------
        GeoDataFrame
            Columns ``x_m``, ``y_m`` and ``z_m``, the point where a UAV rests, and the outlines, in
            the plane of the city. `read` takes it with ``height="z_m"``, a mission file as a table.
        """
        index = pd.Index(self.names, name="name")
        columns = dict(zip(COLUMNS[1:], self.position_m.T, strict=True))
        return geopandas.GeoDataFrame(columns, index, geometry=self.footprints, crs=self.crs)

    def __repr__(self) -> str:
        noted = ((words, len(getattr(self, name))) for name, words in NOTED.items())
        lines = [f"City of {plural(len(self.names), 'building')} around {self.origin}"]
        return "\n".join([*lines, *(f"  {words}: {count}" for words, count in noted if count)])

    def notes(self) -> Iterator[str]:
        """Yield sentences on how the buildings were made of the file."""
        longitude, latitude = self.origin
        yield (
            f"{plural(len(self.names), 'building')} around longitude {fixed(longitude, 6)}, "
            f"latitude {fixed(latitude, 6)}, where x = y = 0: azimuthal equidistant projection, x "
            "east, y north"
        )
        for name, words in NOTED.items():
            if names := getattr(self, name):
                yield f"{words}: {len(names)} ({first_ten(names)})"
        yield from self.remarks
