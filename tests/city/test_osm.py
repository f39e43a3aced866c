"""OpenStreetMap from Overpass and as XML: the same areas as the same town in GeoJSON."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
import pytest

pytest.importorskip("geopandas")

import shapely

import optuav
from optuav.city import read
from tests.city.maps import geojson, polygon, ring, square

COURT = [(5.0, 5.0), (15.0, 5.0), (15.0, 15.0), (5.0, 15.0)]
WIDE = [(0.0, 0.0), (20.0, 0.0), (20.0, 20.0), (0.0, 20.0)]


def corners(east_m: float, shape: list[tuple[float, float]] = WIDE) -> list[list[float]]:
    return ring(shape, east_m)


def town(*, geometry: bool) -> list[dict[str, Any]]:
    """A square, a relation of an outline in two ways with a courtyard, and a road."""
    nodes: dict[tuple[float, float], int] = {}
    elements = list[dict[str, Any]]()

    def way(number: int, places: list[list[float]], tags: Mapping[str, str]) -> dict[str, Any]:
        refs = [nodes.setdefault((x, y), 100 + len(nodes)) for x, y in places]
        made: dict[str, Any] = {"type": "way", "id": number, "nodes": refs, "tags": dict(tags)}
        if geometry:
            made["geometry"] = [{"lat": y, "lon": x} for x, y in places]
        return made

    outline, court = corners(50.0), corners(50.0, COURT)
    elements.append(way(1, corners(0.0), {"building": "yes", "height": "30"}))
    members = [way(2, outline[:3], {}), way(3, outline[2:], {}), way(4, court, {})]
    elements += members
    elements.append(way(5, [[13.0, 52.0], [13.001, 52.0]], {"highway": "service"}))
    parts = [
        {"type": "way", "ref": each["id"], "role": role}
        | ({"geometry": each["geometry"]} if geometry else {})
        for each, role in zip(members, ("outer", "outer", "inner"), strict=True)
    ]
    tags = {"type": "multipolygon", "building": "yes", "building:levels": "4", "name": 'A "B" & C'}
    elements.append({"type": "relation", "id": 9, "members": parts, "tags": tags})
    if not geometry:
        elements += [{"type": "node", "id": n, "lat": y, "lon": x} for (x, y), n in nodes.items()]
    return elements


def xml(elements: list[dict[str, Any]]) -> str:
    """The elements as OSM XML 0.6, nodes first, as the API and JOSM write it."""
    lines = ["<?xml version='1.0' encoding='UTF-8'?>", "<osm version='0.6' generator='JOSM'>"]
    for each in sorted(elements, key=lambda x: ("node", "way", "relation").index(x["type"])):
        place = f" lat='{each['lat']}' lon='{each['lon']}'" if each["type"] == "node" else ""
        lines.append(f"<{each['type']} id='{each['id']}' version='1'{place}>")
        lines += [f"<nd ref='{ref}' />" for ref in each.get("nodes", ())]
        lines += [
            f"<member type='{m['type']}' ref='{m['ref']}' role='{m['role']}' />"
            for m in each.get("members", ())
        ]
        tags = each.get("tags", {}).items()
        lines += [f"<tag k={quoteattr(k)} v={quoteattr(v)} />" for k, v in tags]
        lines.append(f"</{each['type']}>")
    return "\n".join([*lines, "</osm>"])


def written(folder: Path, form: str) -> Path:
    file = folder / ("town.osm" if form == "xml" else "town.json")
    elements = town(geometry=form == "out geom")
    answer = {"version": 0.6, "generator": "Overpass API", "elements": elements}
    file.write_text(xml(elements) if form == "xml" else json.dumps(answer))
    return file


@pytest.mark.parametrize("form", ["out geom", "out body; >; out skel", "xml"])
def test_a_town_is_the_same_in_every_form(tmp_path: Path, form: str) -> None:
    """Two buildings, the second by levels and filled; GDAL rounds places to 1e-7 degrees."""
    city = read(written(tmp_path, form), origin=(13.0, 52.0))
    rings = polygon(corners(50.0), corners(50.0, COURT))
    shapes = [({"height": 30.0}, square()), ({"height": 12.0}, rings)]
    same = read(geojson(tmp_path, shapes), origin=(13.0, 52.0))
    assert sorted(city.position_m[:, 2].tolist()) == [12.0, 30.0]
    by_east = [np.argsort(each.position_m[:, 0]) for each in (city, same)]
    for mine, other in zip(*by_east, strict=True):
        both = city.footprints[mine], same.footprints[other]
        assert shapely.area(shapely.symmetric_difference(*both)) < 0.7
    assert len(city.filled) == len(city.level_heights) == 1


def test_answers_without_places_are_named(tmp_path: Path) -> None:
    elements = [each for each in town(geometry=False) if each["type"] != "node"]
    (file := tmp_path / "town.json").write_text(json.dumps({"elements": elements}))
    with pytest.raises(optuav.InputError, match="is Overpass JSON without geometry: add `out geom"):
        read(file)
    file.write_text(json.dumps({"elements": []}))
    with pytest.raises(optuav.InputError, match=r"has no buildings|no layer has polygons"):
        read(file)


def test_an_element_without_places_is_counted(tmp_path: Path) -> None:
    """Beside others that have some: the town is not said to be whole."""
    bare = {"type": "way", "id": 77, "nodes": [1, 2, 3, 1], "tags": {"building": "yes"}}
    (file := tmp_path / "a.json").write_text(json.dumps({"elements": [*town(geometry=True), bare]}))
    assert "without geometry, left out: 1 building" in "\n".join(read(file).notes())


def test_deleted_elements_of_an_editor_are_none(tmp_path: Path) -> None:
    file = written(tmp_path, "xml")
    file.write_text(file.read_text().replace("<way id='1'", "<way id='1' action='delete'"))
    assert len(read(file).names) == 1


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda text: text[: len(text) // 2], "is damaged or cut off at line"),
        (lambda text: text.replace("<osm", "<osmChange"), "is a change of OpenStreetMap"),
        (lambda _: "<kml xmlns='http://www.opengis.net/kml/2.2'></kml>", "is KML"),
        (lambda text: "<!DOCTYPE a [<!ENTITY b 'c'>]>" + text, "definitions of its own"),
        (lambda text: text.replace(" lat=", " lot="), "has no places of its nodes"),
        (lambda text: text.replace("lat='5", "lat='x"), "is not as OpenStreetMap"),
        (lambda _: "hello", "is not OpenStreetMap's XML"),
    ],
)
def test_damaged_files_are_refused(tmp_path: Path, change: Any, words: str) -> None:
    file = written(tmp_path, "xml")
    file.write_text(change(file.read_text()))
    with pytest.raises(optuav.InputError, match=words):
        read(file)


def test_spoilt_answers_raise_no_other_error(tmp_path: Path) -> None:
    """Each value of the document replaced by others in turn."""
    text = json.dumps({"elements": town(geometry=True)})
    file = tmp_path / "a.json"
    for old, new in (
        ('"nodes": [', '"nodes": 3, "x": ['),
        ('"id": 1', '"id": null'),
        ('"lat": 52', '"lat": "north", "x": 52'),
        ('"tags": {', '"tags": 7, "x": {'),
        ('"members": [', '"members": {}, "x": ['),
        ('"ref": 2', '"ref": []'),
        ('"type": "way"', '"type": 5'),
        ('"yes"', '"\\u0001"'),
    ):
        assert old in text
        file.write_text(text.replace(old, new))
        try:
            read(file, default_height_m=10.0)
        except optuav.InputError:
            continue
