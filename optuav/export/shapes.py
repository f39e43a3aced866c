"""A course as shapes on a map: KML (OGC 12-007r2) above mean sea level, and GeoJSON (RFC 7946)."""

from __future__ import annotations

import json
from collections.abc import Iterator
from xml.etree import ElementTree

from optuav.export import PlanOnEarth, Step

KML = "http://www.opengis.net/kml/2.2"


def geojson(course: PlanOnEarth) -> str:
    """A line for each flight, and a point for each stay; heights are above the ellipsoid."""
    features = []
    for step in course.steps:
        flies = step.kind == "flight"
        points = [
            [*point[:2], *([] if point.ellipsoid_m is None else [point.ellipsoid_m])]
            for point in step.way
        ]
        facts: dict[str, object] = {"kind": step.kind, "place": step.place}
        facts |= {"duration_s": step.duration_s, "altitudes_m": [*_altitudes_m(course, step)]}
        facts |= {"peak_speed_m_s": step.peak_speed_m_s} if flies else {}
        shape = {"type": "Point", "coordinates": points[0]}
        shape = {"type": "LineString", "coordinates": points} if flies else shape
        features.append({"type": "Feature", "properties": facts, "geometry": shape})
    head = {"type": "FeatureCollection", "name": course.name, "creator": "optuav"}
    document = {**head, "notes": course.notes, "features": features}
    return json.dumps(document, ensure_ascii=False, allow_nan=False, indent=1) + "\n"


def kml(course: PlanOnEarth) -> str:
    """A placemark for each flight and each stay."""
    root = ElementTree.Element("kml", xmlns=KML)
    document = ElementTree.SubElement(root, "Document")
    _text(document, "name", course.name)
    _text(document, "description", "\n".join(course.notes))
    for step in course.steps:
        mark, flies = ElementTree.SubElement(document, "Placemark"), step.kind == "flight"
        named = f"{step.kind} {'to' if flies else 'at'} {step.place}"
        _text(mark, "name", step.kind if step.kind == step.place else named)
        speed = f", at most {step.peak_speed_m_s:.2f} m/s" if flies else ""
        _text(mark, "description", f"{step.duration_s:.2f} s{speed}")
        shape = ElementTree.SubElement(mark, "LineString" if flies else "Point")
        _text(shape, "altitudeMode", "absolute")
        altitudes_m = _altitudes_m(course, step)
        points = ([*point[:2], z_m] for point, z_m in zip(step.way, altitudes_m, strict=True))
        lines = (",".join(map(repr, point)) for point in points)
        _text(shape, "coordinates", " ".join(lines))
    ElementTree.indent(root)
    text = ElementTree.tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'


def _altitudes_m(course: PlanOnEarth, step: Step) -> Iterator[float]:
    """Yield altitudes above mean sea level [m]."""
    yield from (round(point.z_m + course.altitude_m, 6) for point in step.way)


def _text(parent: ElementTree.Element, tag: str, words: str) -> None:
    ElementTree.SubElement(parent, tag).text = words
