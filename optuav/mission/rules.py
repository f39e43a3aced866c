"""What ties the keys of a mission together."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from optuav.mission.faults import Breach
from optuav.mission.sections import Battery, Laser, RegimeFlight
from optuav.mission.words import allowed, table

RESERVED_NAMES = ("origin", "hover", "destination")
_ATTENUATION = ("visibility_km", "attenuation_per_km")
_CHARGING = ("charge_current_A", "charge_power_W")


def rules(stated: Mapping[str, Any], sound: Mapping[str, Any]) -> Iterator[Breach]:
    """Judge what several keys state together.

    Parameters
    ----------
    stated
        The document: tells which keys there are.
    sound
        The same without the values that are not allowed by themselves; no building is left out.

    Yields
    ------
    Breach
        Where a rule is broken; one whose values are not sound is not judged.
    """
    yield from _limits(_section(sound, "limits"))
    yield from _battery(_section(stated, "battery"), _section(sound, "battery"))
    if isinstance(stated.get("laser"), dict):
        yield from _laser(stated["laser"])
    if isinstance(stated.get("flight", {}), dict):
        yield from _flight(stated, sound)
    yield from _names(sound.get("buildings", ()))
    yield from _footprints(sound.get("buildings", ()))


def _section(document: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    section = document.get(name)
    return section if isinstance(section, dict) else {}


def _limits(limits: Mapping[str, Any]) -> Iterator[Breach]:
    low, high = limits.get("min_altitude_m"), limits.get("max_altitude_m")
    if low is not None and high is not None and low > high:
        yield Breach(("limits", "max_altitude_m"), f"a number, x >= min_altitude_m = {low:g} [m]")


def _battery(stated: Mapping[str, Any], sound: Mapping[str, Any]) -> Iterator[Breach]:
    if "schedule" in stated and "schedule" not in sound:
        return
    if sound.get("schedule", "pooled") != "alternating":
        if "period_s" in stated:
            yield Breach(("battery", "period_s"), 'goes with schedule = "alternating" only')
    elif "period_s" not in stated:
        words = f'{allowed(Battery, "period_s")}, needed by schedule = "alternating"'
        yield Breach(("battery", "period_s"), f"is missing; {words}")


def _laser(laser: Mapping[str, Any]) -> Iterator[Breach]:
    stated = [key for key in _ATTENUATION if key in laser]
    if len(stated) == 2:
        yield Breach(("laser", stated[0]), f"either {' or '.join(stated)}, not both")
    if not stated:
        words = allowed(Laser, "attenuation_per_km")
        yield Breach(
            ("laser", "attenuation_per_km"), f"is missing; {words}; or state visibility_km"
        )


def _flight(stated: Mapping[str, Any], sound: Mapping[str, Any]) -> Iterator[Breach]:
    flight = _section(stated, "flight")
    model = _section(sound, "flight").get("model") if "model" in flight else "rotors"
    if model == "rotors":
        for name in ("rotor", "body"):
            if name not in stated:
                words = f'{table(name)}, needed by flight.model = "rotors"'
                yield Breach((name,), f"is missing; {words}")
    elif model == "regimes":
        charging = [key for key in _CHARGING if key in flight]
        for key in set(_CHARGING).difference(charging) if charging else ():
            words = f"{allowed(RegimeFlight, key)}, stated together with {charging[0]}"
            yield Breach(("flight", key), f"is missing; {words}")
        if charging and "laser" not in stated:
            words = f"{table('laser')}, needed by flight.{charging[0]}"
            yield Breach(("laser",), f"is missing; {words}")
        if any(_section(sound, "wind").get("force_N", ())):
            yield Breach(("wind", "force_N"), '[0, 0, 0] with flight.model = "regimes"')


def _names(buildings: Sequence[Mapping[str, Any]]) -> Iterator[Breach]:
    first: dict[str, int] = {}
    for place, building in enumerate(buildings):
        name = building.get("name")
        if name in RESERVED_NAMES:
            words = f"a name other than {', '.join(RESERVED_NAMES)}"
            yield Breach(("buildings", place, "name"), words)
        elif name is not None and first.setdefault(name, place) != place:
            words = f"a name of its own; buildings[{first[name]}] has this one"
            yield Breach(("buildings", place, "name"), words)


def _footprints(buildings: Sequence[Mapping[str, Any]]) -> Iterator[Breach]:
    """Judge all polygons at once; a size needs no judging, its centre is the position."""
    rings = {
        place: _open(building["footprint_m"])
        for place, building in enumerate(buildings)
        if isinstance(building.get("footprint_m", (0,))[0], list | tuple)
    }
    if not rings:
        return
    import numpy as np
    import shapely

    closable = [place for place, ring in rings.items() if len(ring) >= 3]
    sizes = [len(rings[place]) for place in closable]
    corners = np.array([corner for place in closable for corner in rings[place]], dtype=float)
    lines = shapely.linearrings(
        corners.reshape(-1, 2), indices=np.repeat(np.arange(len(sizes)), sizes)
    )
    polygons = np.asarray(shapely.polygons(lines), dtype=object)
    proper = shapely.is_valid(polygons) & (shapely.area(polygons) > 0)
    simple = {closable[n]: polygons[n] for n in np.flatnonzero(proper)}
    placed = [place for place in simple if "position_m" in buildings[place]]
    points = np.array([buildings[place]["position_m"] for place in placed], dtype=float)
    inside = shapely.intersects_xy(
        [simple[place] for place in placed], *points.reshape(-1, 3).T[:2]
    )
    outside = {placed[n] for n in np.flatnonzero(~inside)}
    for place in rings:
        if place not in simple:
            words = "a polygon with an area, whose edges meet at its corners only"
            yield Breach(("buildings", place, "footprint_m"), words)
        elif place in outside:
            words = "a polygon that contains x and y of position_m"
            yield Breach(("buildings", place, "footprint_m"), words)


def _open(ring: Sequence[Sequence[float]]) -> Sequence[Sequence[float]]:
    """The corners without those at the end that repeat the first."""
    corners = list(ring)
    while len(corners) > 1 and corners[-1] == corners[0]:
        corners.pop()
    return corners
