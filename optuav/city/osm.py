"""OpenStreetMap's own formats: answers of Overpass as JSON, and .osm as XML.

Both are written again as plain OSM XML 0.6, which GDAL reads: it assembles areas, and gets no file
that somebody else wrote, as its driver for XML is chosen by the content.
"""

from __future__ import annotations

import io
import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any
from xml.etree import ElementTree
from xml.sax.saxutils import quoteattr

from optuav.mission.files import read_text, refusal
from optuav.mission.formats import HEAD, named
from optuav.mission.maps import LARGEST_MAP, UNREADABLE
from optuav.mission.messages import plural

Element = Mapping[str, Any]
NEW = 10**15  # Beyond all numbers of OpenStreetMap
NO_GEOMETRY = "is Overpass JSON without geometry: add `out geom` to the query"


def of_xml(file: Path) -> Iterator[Element]:
    """The elements of a .osm file, in the form of Overpass JSON."""
    text = read_text(file, LARGEST_MAP)
    if not re.search(r"<osm\b", text[:HEAD]):
        what = named(text[:HEAD].encode())
        raise refusal(file, f"is {what.words}" if what else "is not OpenStreetMap's XML")
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise refusal(file, "is XML with definitions of its own, which no .osm file has")
    tags: dict[str, str] = {}
    nodes, places, members = list[Any](), list[Any](), list[dict[str, Any]]()
    try:
        for _, item in ElementTree.iterparse(io.StringIO(text)):
            facts = item.attrib
            if item.tag == "tag":
                tags[facts["k"]] = facts["v"]
            elif item.tag == "nd":
                nodes.append(facts.get("ref"))
                places.append(facts if "lat" in facts else None)
            elif item.tag == "member":
                members.append({**facts, "geometry": places})
                nodes, places = [], []
            elif item.tag in ("node", "way", "relation"):
                if not {facts.get("action"), facts.get("visible")} & {"delete", "false"}:
                    element = {"nodes": nodes, "geometry": places, "members": members, "tags": tags}
                    yield {**element, **facts, "type": item.tag}
                tags, nodes, places, members = {}, [], [], []
                item.clear()
    except ElementTree.ParseError as error:
        line, column = error.position
        raise refusal(file, f"is damaged or cut off at line {line}, column {column}") from None
    except LookupError:
        raise refusal(file, "is not as OpenStreetMap writes it") from None


def plain(elements: Iterable[Element], file: Path) -> tuple[str, tuple[str, ...]]:
    """Plain OSM XML of elements, and remarks on what has no geometry."""
    numbers: dict[tuple[float, float], int] = {}
    at: dict[str, int] = {}  # number of a node's place, by its own number
    ways: dict[str, tuple[list[int], str]] = {}
    relations: dict[str, tuple[list[tuple[str, str]], str]] = {}
    listed, bare, every = list[Element](), 0, [*elements]

    def number(place: Element) -> int:
        key = float(place["lat"]), float(place["lon"])
        return numbers.setdefault(key, len(numbers) + 1)

    try:
        for element in every:
            if element["type"] == "node" and "lat" in element:
                at[str(element["id"])] = number(element)
            else:
                listed.append(element)
        for element in listed:
            if element["type"] == "way":
                places = [place for place in element.get("geometry") or () if place]
                whole = len(places) == len(element.get("nodes") or places) > 0
                refs = [*map(number, places)] if whole else _known(element, at)
                bare += not refs and _is_building(element)
                ways[str(element["id"])] = refs, _tags(element.get("tags") or {})
        for element in listed:
            if element["type"] == "relation":
                members = list[tuple[str, str]]()
                for member in element.get("members") or ():
                    places = [place for place in member.get("geometry") or () if place]
                    ref = str(member["ref"])
                    if member["type"] == "way":
                        ways.setdefault(ref, ([*map(number, places)], ""))
                        members.append((ref, str(member.get("role", ""))))
                bare += _is_building(element) and not any(ways[ref][0] for ref, _ in members)
                relations[str(element["id"])] = members, _tags(element.get("tags") or {})
    except UNREADABLE:
        raise refusal(file, "is not as OpenStreetMap or Overpass writes it") from None
    if listed and not any(refs for refs, _ in ways.values()):
        raise refusal(file, NO_GEOMETRY if file.suffix != ".osm" else "has no places of its nodes")
    numbered = _numbered(ways)
    lines = ['<?xml version="1.0" encoding="UTF-8"?>', '<osm version="0.6">']
    lines += [f'<node id="{n}" lat="{lat!r}" lon="{lon!r}"/>' for (lat, lon), n in numbers.items()]
    for ref, (refs, tags) in ways.items():
        nodes = "".join(f'<nd ref="{n}"/>' for n in refs)
        lines.append(f'<way id="{numbered[ref]}">{nodes}{tags}</way>')
    for place, (members, tags) in zip(
        _numbered(relations).values(), relations.values(), strict=True
    ):
        parts = (
            f'<member type="way" ref="{numbered[ref]}" role={quoteattr(_legal(role))}/>'
            for ref, role in members
        )
        lines.append(f'<relation id="{place}">{"".join(parts)}{tags}</relation>')
    remarks = (f"without geometry, left out: {plural(bare, 'building')}",) if bare else ()
    return "\n".join([*lines, "</osm>"]), remarks


def _is_building(element: Element) -> bool:
    return not {"building", "building:part"}.isdisjoint(element.get("tags") or ())


def _known(way: Element, at: Mapping[str, int]) -> list[int]:
    """The places of a way's nodes; none if one of them is missing."""
    refs = [at.get(str(ref)) for ref in way.get("nodes") or ()]
    return [] if None in refs else [ref for ref in refs if ref is not None]


def _numbered(names: Iterable[str]) -> dict[str, int]:
    """The numbers of elements: their own, or large ones for the new elements of an editor."""
    return {
        name: int(name) if name.isdecimal() and 0 < int(name) < NEW else NEW + place
        for place, name in enumerate(names)
    }


def _tags(tags: Mapping[str, str]) -> str:
    """Tags as XML."""
    pairs = ((quoteattr(_legal(str(k))), quoteattr(_legal(str(v)))) for k, v in tags.items())
    return "".join(f"<tag k={key} v={value}/>" for key, value in pairs)


def _legal(text: str) -> str:
    """A text without the control characters that XML forbids."""
    return "".join(letter for letter in text if letter >= " " or letter in "\t\n")
