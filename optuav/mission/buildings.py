"""The buildings of a mission as one table of columns, which makes each `Building` when asked.

The columns are plain buffers, so that a mission is read without NumPy; they are arrays to those who
compute with them.
"""

from __future__ import annotations

from array import array
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import accumulate, chain, pairwise
from typing import TYPE_CHECKING, Annotated, Any, overload

from pydantic import GetCoreSchemaHandler, Strict
from pydantic_core import CoreSchema, core_schema

from optuav.fields import Listed
from optuav.frames import DataFrame, frame
from optuav.mission.messages import plural
from optuav.tables import Building

if TYPE_CHECKING:
    from optuav.arrays import Floats, Integers

RESERVED_NAMES = ("origin", "hover", "destination")
HASHED = 64  # Most buildings that go into the hash
POLYGONS_AT_ONCE = 1 << 16  # Polygons that are judged together
Stated = Annotated[tuple[Building, ...], Strict(), Listed]


@dataclass(frozen=True)
class TableFile:
    """A file with a table of buildings: its path, the hash of its content, and how many it has."""

    path: str
    sha256: str
    buildings: int


@dataclass(frozen=True, repr=False)
class Buildings(Sequence[Building]):
    """Buildings by number: a sequence that never changes, equal by content and source.

    Examples
    --------
    >>> import optuav
    >>> buildings = optuav.load("paper").buildings
    >>> len(buildings), buildings[2].name, buildings.roof_m.shape
    (10, 'b3', (10, 3))
    """

    names: tuple[str, ...] = ()
    # x, y and z of the roof of every building.
    roofs: array[float] = field(default_factory=lambda: array("d"))
    # Corners of all footprints, a size in place of one, and their number before each building.
    corners: array[float] = field(default_factory=lambda: array("d"))
    begins: array[int] = field(default_factory=lambda: array("q", [0]))
    source: TableFile | None = None  # The file that they were read from

    @classmethod
    def of(cls, buildings: Iterable[Building]) -> Buildings:
        """The table of single buildings."""
        listed, flat, rings = [*buildings], chain.from_iterable, list[Sequence[Any]]()
        for building in listed:
            stated: Any = building.footprint_m or ()
            rings.append(stated if not stated or isinstance(stated[0], tuple) else (stated,))
        return cls(
            tuple(building.name for building in listed),
            array("d", flat(building.position_m for building in listed)),
            array("d", flat(flat(rings))),
            array("q", accumulate(map(len, rings), initial=0)),
        )

    @classmethod
    def __get_pydantic_core_schema__(cls, _: object, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Lists of buildings are judged one by one; a table has been."""
        written = core_schema.plain_serializer_function_ser_schema(cls.rows)
        return core_schema.no_info_wrap_validator_function(
            lambda stated, judge: stated if isinstance(stated, cls) else cls.of(judge(stated)),
            handler.generate_schema(Stated),
            serialization=written,
        )

    def __len__(self) -> int:
        return len(self.names)

    @overload
    def __getitem__(self, number: int) -> Building: ...
    @overload
    def __getitem__(self, number: slice) -> Buildings: ...
    def __getitem__(self, number: int | slice) -> Building | Buildings:
        chosen = range(len(self))[number]
        if isinstance(chosen, range):
            return Buildings.of(map(self.__getitem__, chosen))
        return Building.model_construct(**self.row(chosen, tuple))

    def row(self, number: int, kind: type[list[Any] | tuple[Any, ...]] = list) -> dict[str, Any]:
        """A building as a file states it, or with tuples as the kind of its sequences."""
        roof_m = self.roofs[3 * number : 3 * number + 3]
        values = {"name": self.names[number], "position_m": kind(roof_m)}
        begin, end = self.begins[number : number + 2]
        flat = self.corners[2 * begin : 2 * end]
        if ring := kind(map(kind, zip(flat[::2], flat[1::2], strict=True))):
            values["footprint_m"] = ring if len(ring) > 1 else ring[0]
        return values

    def rows(self) -> list[dict[str, Any]]:
        """All of them as a file states them."""
        return [*map(self.row, range(len(self)))]

    def __hash__(self) -> int:
        return hash((self.names[:HASHED], *self.roofs[: 3 * HASHED], len(self.corners)))

    def __repr__(self) -> str:
        return f"<{plural(len(self), 'building')}>"

    def _repr_html_(self) -> str:
        from optuav.mission.display import buildings_table
        from optuav.presentation.html import as_html

        return as_html([buildings_table(self)])

    def to_frame(self) -> DataFrame:
        """One row per building, ready for `Mission.with_buildings`; needs pandas.

        Columns ``name``, ``x_m``, ``y_m`` and ``z_m``, and ``width_m`` and ``depth_m``, the sizes
        of footprints along x and y [m], NaN without one or where it is a polygon.
        """
        import numpy as np

        count, size_m = np.diff(self.begins), np.full((len(self), 2), np.nan)
        size_m[count == 1] = np.reshape(self.corners, (-1, 2))[(count == 1).repeat(count)]
        columns = np.column_stack([self.roof_m, size_m])
        names = ("x_m", "y_m", "z_m", "width_m", "depth_m")
        return frame({"name": self.names, **dict(zip(names, columns.T, strict=True))})

    def __reduce__(self) -> tuple[Any, ...]:
        return Buildings, (self.names, self.roofs, self.corners, self.begins, self.source)

    @property
    def lacking(self) -> int:
        """Number of buildings of their table that are missing here, as in a plan without it."""
        return self.source.buildings - len(self) if self.source else 0

    def read_from(self, source: TableFile | None) -> Buildings:
        """The same buildings, with everything known of them, read from a file."""
        read = object.__new__(Buildings)
        vars(read).update(vars(self), source=source)
        return read

    @cached_property
    def roof_m(self) -> Floats:
        """Places where the UAV rests (building, 3) [m]."""
        import numpy as np

        return np.asarray(memoryview(self.roofs).toreadonly()).reshape(-1, 3)

    def outlines(self) -> tuple[Floats, Integers]:
        """Corners of all footprints (corner, 2) [m]; and by building their number, 0 for none."""
        import numpy as np

        corners_m = np.asarray(memoryview(self.corners).toreadonly()).reshape(-1, 2)
        corners_each = np.diff(self.begins)
        if not (sized := corners_each == 1).any():
            return corners_m, corners_each
        count = np.where(sized, 4, corners_each)
        of_size, of_box = sized.repeat(corners_each), sized.repeat(count)
        middle_m, half_m = self.roof_m[sized, None, :2], corners_m[of_size, None] / 2
        found_m = np.empty((len(of_box), 2))
        found_m[~of_box] = corners_m[~of_size]
        found_m[of_box] = np.where(HIGH_ENDS, middle_m + half_m, middle_m - half_m).reshape(-1, 2)
        return found_m, count

    @cached_property
    def breaches(self) -> tuple[tuple[int, str, str], ...]:
        """Faults between buildings: number, key, and the allowed values."""
        faults, unique_names = list[tuple[int, str, str]](), {*self.names}
        if len(unique_names) < len(self.names) or not unique_names.isdisjoint(RESERVED_NAMES):
            faults += ((number, "name", words) for number, words in misnamed(self.names))
        if any(end - begin > 1 for begin, end in pairwise(self.begins)):
            import numpy as np

            corners_m, count = self.outlines()
            (which,) = np.nonzero(np.diff(self.begins) > 1)
            own_m = corners_m[np.isin(np.arange(len(count)), which).repeat(count)]
            for ring, words in misshapen(own_m, count[which], self.roof_m[which, :2]):
                faults.append((int(which[ring]), "footprint_m", words))
        return tuple(faults)


HIGH_ENDS = ((False, False), (True, False), (True, True), (False, True))
"""Corners of a box, counter-clockwise: True at the high end along x and y."""


def misnamed(names: Iterable[str | None]) -> Iterator[tuple[int, str]]:
    """Numbers of buildings with forbidden names, and words; None means without a name."""
    first = dict[str, int]()
    for number, name in enumerate(names):
        if name in RESERVED_NAMES:
            yield number, f"a name other than {', '.join(RESERVED_NAMES)}"
        elif name is not None and first.setdefault(name, number) != number:
            yield number, f"a name of its own; buildings[{first[name]}] has this one"


def misshapen(corners_m: Floats, count: Integers, at_m: Floats) -> Iterator[tuple[int, str]]:
    """Numbers of polygons that are not footprints, and words.

    Of all polygons the corners (corner, 2) [m], how many each has, and x and y of the position
    (polygon, 2) [m], NaN where it is not known.
    """
    import numpy as np
    import shapely

    ends = np.cumsum(count)
    for begin in range(0, len(count), POLYGONS_AT_ONCE):
        batch, place_m = (
            count[begin : begin + POLYGONS_AT_ONCE],
            at_m[begin : begin + POLYGONS_AT_ONCE],
        )
        corners = corners_m[ends[begin] - batch[0] : ends[begin] - batch[0] + batch.sum()]
        ring_of = np.repeat(np.arange(len(batch)), batch)
        polygons = np.asarray(shapely.polygons(shapely.linearrings(corners, indices=ring_of)))
        proper = shapely.is_valid(polygons) & (shapely.area(polygons) > 0)
        around = shapely.intersects_xy(polygons, *place_m.T) | np.isnan(place_m[:, 0])
        for ring in np.flatnonzero(~(proper & around)).tolist():
            if not proper[ring]:
                yield begin + ring, "a polygon with an area, whose edges meet at its corners only"
            else:
                yield begin + ring, "a polygon that contains x and y of position_m"
