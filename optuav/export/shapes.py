"""A course as shapes on a map, KML (OGC 12-007r2) and GeoJSON (RFC 7946), at absolute altitudes."""

from __future__ import annotations

import json
from xml.etree import ElementTree

from optuav.export import PlanOnEarth, Step

KML = "http://www.opengis.net/kml/2.2"


def geojson(course: PlanOnEarth) -> str:
    """A line for each flight, and a point for each stay."""
    features = []
    for step in course.steps:
        flies, points = step.kind == "flight", _points(course, step)
        facts = {"kind": step.kind, "place": step.place, "duration_s": step.duration_s}
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
    _leaf(document, "name", course.name)
    _leaf(document, "description", "\n".join(course.notes))
    for step in course.steps:
        mark, flies = ElementTree.SubElement(document, "Placemark"), step.kind == "flight"
        named = f"{step.kind} {'to' if flies else 'at'} {step.place}"
        _leaf(mark, "name", step.kind if step.kind == step.place else named)
        speed = f", at most {step.peak_speed_m_s:.2f} m/s" if flies else ""
        _leaf(mark, "description", f"{step.duration_s:.2f} s{speed}")
        shape = ElementTree.SubElement(mark, "LineString" if flies else "Point")
        _leaf(shape, "altitudeMode", "absolute")
        lines = (",".join(map(repr, point)) for point in _points(course, step))
        _leaf(shape, "coordinates", " ".join(lines))
    ElementTree.indent(root)
    text = ElementTree.tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'


def _points(course: PlanOnEarth, step: Step) -> list[list[float]]:
    """Longitudes and latitudes [deg] and altitudes above mean sea level [m]."""
    return [[*point[:2], round(point.z_m + course.altitude_m, 6)] for point in step.way]


def _leaf(parent: ElementTree.Element, tag: str, words: str) -> None:
    ElementTree.SubElement(parent, tag).text = words
