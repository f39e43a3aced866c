"""Position of a mission's plane on Earth."""

from __future__ import annotations

from typing import TYPE_CHECKING

from optuav.errors import Fault, InputError, require
from optuav.mission.messages import shown

if TYPE_CHECKING:
    import pyproj

    from optuav.mission.mission import Mission

DEGREES = "EPSG:4326"
"""Longitude and latitude, as maps and GPS receivers state them."""


def plane(origin: tuple[float, float]) -> str:
    """The plane that touches the Earth at a longitude and a latitude [deg], with x east [m].

    Distances and directions from the origin are true; 30 km away, lengths across are 4e-6 too long
    (the azimuthal equidistant projection: J. P. Snyder, "Map Projections", USGS, 1987, chapter 25).
    """
    longitude, latitude = origin
    return f"+proj=aeqd +lon_0={longitude!r} +lat_0={latitude!r} +datum=WGS84 +units=m +no_defs"


def stated_system(mission: Mission) -> str | None:
    """Reference system of x and y, by ``crs`` or by ``[earth]``; None if neither states one."""
    earth = mission.earth
    if mission.crs is not None or earth is None or earth.longitude_deg is None:
        return mission.crs
    assert earth.latitude_deg is not None
    return plane((earth.longitude_deg, earth.latitude_deg))


def system_in_metres(crs: object) -> pyproj.CRS:
    """Return a reference system that pyproj knows and whose axes are in metres; needs pyproj."""
    require("pyproj", "reference systems")
    import pyproj

    try:
        system = pyproj.CRS.from_user_input(crs)
    except pyproj.exceptions.CRSError:
        words = 'a coordinate reference system that pyproj knows, such as "EPSG:25832"'
        raise InputError([Fault("crs", shown(crs), words)]) from None
    if any(axis.unit_name != "metre" for axis in system.axis_info[:2]):
        raise InputError([Fault("crs", shown(crs), "a reference system in metres")])
    return system
