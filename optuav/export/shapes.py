"""A course as shapes on a map: KML (OGC 12-007r2) above mean sea level, and GeoJSON (RFC 7946)."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from typing import NamedTuple
from xml.etree import ElementTree

from optuav.export import PlanOnEarth, Position, Step
from optuav.presentation.numbers import figure

KML = "http://www.opengis.net/kml/2.2"


def geojson(course: PlanOnEarth) -> str:
    """A line for each flight, and a point for each stay; heights are above the ellipsoid."""
    features = []
    for step in course.steps:
        flies = step.kind == "flight"
        points = [*map(_coordinates, step.way)]
        facts: dict[str, object] = {"kind": step.kind, "place": step.place}
        facts |= {"duration_s": step.duration_s, "altitudes_m": [*_altitudes_m(course, step)]}
        facts |= {"peak_speed_m_s": step.peak_speed_m_s} if flies else {}
        facts |= {} if step.tapers_s is None else {"tapers_after_s": step.tapers_s}
        shape = {"type": "Point", "coordinates": points[0]}
        shape = {"type": "LineString", "coordinates": points} if flies else shape
        features.append({"type": "Feature", "properties": facts, "geometry": shape})
    return _collection(course.name, course.notes, features)


def kml(course: PlanOnEarth) -> str:
    """A placemark for each flight and each stay."""
    root, document = _kml(course.name, course.notes)
    for step in course.steps:
        mark, flies = ElementTree.SubElement(document, "Placemark"), step.kind == "flight"
        named = f"{step.kind} {'to' if flies else 'at'} {step.place}"
        _leaf(mark, "name", step.kind if step.kind == step.place else named)
        speed = f", at most {figure(max(step.level_speeds_m_s), 5)} m/s level" if flies else ""
        words = f"{figure(round(step.duration_s, 3), 10)} s{speed}"
        if step.tapers_s is not None:
            words += f", charging tapers after {figure(round(step.tapers_s, 3), 10)} s"
        _leaf(mark, "description", words)
        shape = ElementTree.SubElement(mark, "LineString" if flies else "Point")
        _leaf(shape, "altitudeMode", "absolute")
        altitudes_m = _altitudes_m(course, step)
        points = ([*point[:2], z_m] for point, z_m in zip(step.way, altitudes_m, strict=True))
        lines = (",".join(map(repr, point)) for point in points)
        _leaf(shape, "coordinates", " ".join(lines))
    return _xml(root)


class MapPoint(NamedTuple):
    """A point of a map with a name and facts."""

    name: str
    position: Position
    facts: dict[str, float]


def marked_geojson(name: str, notes: Sequence[str], marks: Sequence[MapPoint]) -> str:
    """A point for each mark; heights are above the ellipsoid."""
    features = [
        {
            "type": "Feature",
            "properties": {"name": mark.name, **mark.facts, "z_m": mark.position.z_m},
            "geometry": {"type": "Point", "coordinates": _coordinates(mark.position)},
        }
        for mark in marks
    ]
    return _collection(name, notes, features)


def marked_kml(
    name: str, notes: Sequence[str], altitude_m: float, marks: Sequence[MapPoint]
) -> str:
    """A placemark for each mark, above mean sea level by the altitude of z = 0 [m]."""
    root, document = _kml(name, notes)
    for mark in marks:
        placemark = ElementTree.SubElement(document, "Placemark")
        _leaf(placemark, "name", mark.name)
        facts = (f"{key} {figure(value, 10)}" for key, value in mark.facts.items())
        _leaf(placemark, "description", ", ".join(facts))
        shape = ElementTree.SubElement(placemark, "Point")
        _leaf(shape, "altitudeMode", "absolute")
        at = *mark.position[:2], round(mark.position.z_m + altitude_m, 6)
        _leaf(shape, "coordinates", ",".join(map(repr, at)))
    return _xml(root)


def _altitudes_m(course: PlanOnEarth, step: Step) -> Iterator[float]:
    """Yield altitudes above mean sea level [m]."""
    yield from (round(point.z_m + course.altitude_m, 6) for point in step.way)


def _leaf(parent: ElementTree.Element, tag: str, words: str) -> None:
    ElementTree.SubElement(parent, tag).text = words


def _coordinates(point: Position) -> list[float]:
    """Longitude and latitude [deg], and the height above the ellipsoid [m] if it is known."""
    return [*point[:2], *([] if point.ellipsoid_m is None else [point.ellipsoid_m])]


def _collection(name: str, notes: Sequence[str], features: Sequence[object]) -> str:
    """Features as the text of a file."""
    head = {"type": "FeatureCollection", "name": name, "creator": "optuav"}
    document = {**head, "notes": notes, "features": features}
    return json.dumps(document, ensure_ascii=False, allow_nan=False, indent=1) + "\n"


def _kml(name: str, notes: Sequence[str]) -> tuple[ElementTree.Element, ElementTree.Element]:
    """A file and its document, which has a name and notes."""
    root = ElementTree.Element("kml", xmlns=KML)
    document = ElementTree.SubElement(root, "Document")
    _leaf(document, "name", name)
    _leaf(document, "description", "\n".join(notes))
    return root, document


def _xml(root: ElementTree.Element) -> str:
    """An element as the text of a file."""
    ElementTree.indent(root)
    text = ElementTree.tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'
