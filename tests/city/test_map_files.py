"""Map files are read whole, alone and within limits, or refused in words."""

from __future__ import annotations

import json
import re
import sqlite3
import sys
import threading
import warnings
import zipfile
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("geopandas")

import geopandas
import pandas as pd
import shapely

import optuav
from optuav.city import read
from tests.city.maps import EAST_DEG, NORTH_DEG, geojson, polygon, ring, square

TALL = {"height": 30.0}
SUFFIXES = (".gpkg", ".shp", ".fgb", ".geojson", ".geojsonl")


def town(folder: Path, suffix: str, count: int = 60) -> Path:
    """A file with a row of squares."""
    file = folder / f"town{suffix}"
    shapes = [shapely.geometry.shape(square(50.0 * k)) for k in range(count)]
    frame = geopandas.GeoDataFrame({"height": [30.0] * count}, geometry=shapes, crs=4326)
    frame.to_file(file, **({"driver": "GeoJSONSeq"} if suffix == ".geojsonl" else {}))
    return file


def refused(file: object, words: str) -> None:
    with pytest.raises(optuav.InputError, match=words):
        read(file)  # type: ignore[arg-type]


# Nothing else is opened


@pytest.fixture
def asked() -> Iterator[tuple[str, list[str]]]:
    """The address of a server in this process, and what it is asked for."""
    paths = list[str]()

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            paths.append(self.path)
            self.send_error(404)

        do_HEAD = do_GET

        def log_message(self, *_: object) -> None:
            """Print nothing."""

    with HTTPServer(("127.0.0.1", 0), Handler) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield f"http://127.0.0.1:{server.server_port}", paths
        server.shutdown()
        thread.join()


def linked(address: str, folder: Path) -> Iterator[tuple[str, str]]:
    """Names and contents of maps that name an address or another file."""
    secret = town(folder, ".gpkg")
    link = {"type": "link", "properties": {"href": f"{address}/crs", "type": "proj4"}}
    name = {"type": "name", "properties": {"name": f"{address}/crs"}}
    for crs in (link, name, {**link, "properties": {"href": str(secret), "type": "proj4"}}):
        whole = {"type": "FeatureCollection", "crs": crs}
        feature = {"type": "Feature", "properties": TALL, "geometry": square()}
        yield "link.geojson", json.dumps({**whole, "features": [feature]})
        inside = {**feature, "geometry": {**square(), "crs": crs}}
        yield "inside.geojson", json.dumps({"type": "FeatureCollection", "features": [inside]})
    for source in (str(secret), f"/vsicurl/{address}/town.gpkg"):
        content = f"<SrcDataSource>{source}</SrcDataSource><SrcLayer>town</SrcLayer>"
        layer = f'<OGRVRTLayer name="town">{content}</OGRVRTLayer>'
        virtual = f"<OGRVRTDataSource>{layer}</OGRVRTDataSource>"
        for suffix in (".vrt", *SUFFIXES, ".pbf", ".json"):
            yield f"virtual{suffix}", virtual
    command = f"gdal vector read {address}/town.gpkg"
    yield "steps.json", json.dumps({"type": "gdal_streamed_alg", "command_line": command})
    yield "service.geojson", f"<OGRWFSDataSource><URL>{address}</URL></OGRWFSDataSource>"


def test_no_map_makes_anybody_open_an_address_or_another_file(
    asked: tuple[str, list[str]], tmp_path: Path
) -> None:
    """Nor in a zip, nor as the table of a mission. A system inside a geometry means nothing."""
    address, paths = asked
    for name, content in linked(address, tmp_path):
        (file := tmp_path / name).write_text(content)
        packed = tmp_path / "packed.zip"
        with zipfile.ZipFile(packed, "w") as archive:
            archive.write(file, name)
        if name == "inside.geojson":
            assert read(file).names == read(packed).names == ("b0",)
        else:
            words = "is damaged|a VRT|is XML|reference system that|is not JSON|is not GeoJSON"
            refused(file, rf"{words}|has none of")
            refused(packed, r"packed.zip: |holds 0 maps")
        table = tmp_path / "mission.toml"
        table.write_text(f'schema = 1\nextends = "paper"\nbuildings_file = "{name}"\n')
        with pytest.raises(optuav.InputError):
            optuav.load(table)
    assert paths == []


# All of a file, or nothing


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_part_of_a_file_is_no_town(suffix: str, tmp_path: Path) -> None:
    """Wherever it is cut off, but for lines between two of which it is."""
    file = town(tmp_path, suffix)
    content = file.read_bytes()
    for share in (0.3, 0.5, 0.61, 0.9):
        file.write_bytes(content[: int(share * len(content))])
        refused(file, "damaged|incomplete|cut off|is not JSON")
    file.write_bytes(content)
    assert len(read(file).names) == 60


@pytest.mark.parametrize("part", [".shx", ".dbf"])
def test_part_of_a_shapefile_is_no_town(part: str, tmp_path: Path) -> None:
    file = town(tmp_path, ".shp")
    beside = file.with_suffix(part)
    content = beside.read_bytes()
    for length in (5, 50, 400, len(content) - 9):
        beside.write_bytes(content[:length])
        refused(file, rf"{beside.name}: is (cut off: it has {length} of|damaged)")


def test_an_unknown_reference_system_is_not_taken_for_another(tmp_path: Path) -> None:
    """Of GeoJSON by its name, of a GeoPackage by its number; GDAL's own warnings are not heard."""
    content = json.loads(geojson(tmp_path, [(TALL, square())]).read_text())
    for name in ("EPSG:999999", "urn:ogc:def:crs:EPSG::999999", "+proj=utm +zone=33", 5):
        crs = {"type": "name", "properties": {"name": name}}
        (file := tmp_path / "named.geojson").write_text(json.dumps({**content, "crs": crs}))
        refused(
            file,
            f"the file's crs = {re.escape(repr(name))}: is not a reference system that pyproj",
        )
    file.write_text(json.dumps({**content, "crs": "EPSG:25832"}))  # A bare name is no object
    refused(file, r'by its name as in {"type": "name", "properties": {"name": "EPSG:25832"}}')
    crs = {"type": "name", "properties": {"name": "urn:ogc:def:crs:OGC:1.3:CRS84"}}
    file.write_text(json.dumps({**content, "crs": crs}))
    assert read(file).names == ("b0",)
    file = town(tmp_path, ".gpkg")
    with sqlite3.connect(file) as base:
        values = "'x', 999999, 'EPSG', 999999, 'undefined', ''"
        base.execute(f"INSERT INTO gpkg_spatial_ref_sys VALUES ({values})")
        for table in ("gpkg_contents", "gpkg_geometry_columns"):
            base.execute(f"UPDATE {table} SET srs_id = 999999")
    base.close()
    refused(file, "has no coordinate reference system; specify it as crs")


def test_lines_are_features_by_number_or_by_their_own(tmp_path: Path) -> None:
    shapes = [{"type": "Feature", "properties": TALL, "geometry": square(50 * k)} for k in range(3)]
    file = tmp_path / "town.geojsonl"
    file.write_text("\n".join(map(json.dumps, shapes)))
    assert read(file).names == ("b0", "b1", "b2")
    marked = "".join(f"\x1e{json.dumps({**each, 'id': 7 + k})}\n" for k, each in enumerate(shapes))
    file.write_text(marked)
    assert read(file).names == ("b7", "b8", "b9")
    file.write_text(f"{json.dumps(shapes[0])}\n[]\n")
    refused(file, "is not GeoJSON: feature 1 is not as specified")


def test_a_map_of_another_kind_is_named(tmp_path: Path) -> None:
    """By its content, whatever its name says; the files are those of GDAL, pyarrow and the like."""
    town(tmp_path, ".gpkg")
    town(tmp_path, ".shp")
    town(tmp_path, ".fgb")
    frame = geopandas.GeoDataFrame(TALL, index=[0], geometry=[shapely.box(0, 0, 1, 1)], crs=4326)
    frame.to_parquet(tmp_path / "town.parquet")
    frame.to_file(tmp_path / "town.kml", driver="KML")
    frame.to_file(tmp_path / "town.gml", driver="GML")
    frame.to_file(tmp_path / "town.geojson", driver="GeoJSON")
    (tmp_path / "town.gpx").write_text('<?xml version="1.0"?>\n<gpx version="1.1"/>')
    (tmp_path / "town.pdf").write_bytes(b"%PDF-1.7\n" + bytes(200))
    (tmp_path / "town.ulg").write_bytes(b"ULog\x01\x12\x35\x01" + bytes(200))
    (tmp_path / "town.topojson").write_text('{"type": "Topology", "objects": {}, "arcs": []}')
    for name, suffix, words in (
        ("town.gpkg", ".shp", "is no .shp file but a GeoPackage or another SQLite database"),
        ("town.shp", ".gpkg", "is no .gpkg file but a shapefile"),
        ("town.fgb", ".json", "a FlatGeobuf"),
        ("town.parquet", ".fgb", "is no .fgb file but a Parquet file"),
        ("town.gpkg", ".parquet", "is a GeoPackage"),
        ("town.kml", ".geojson", "is KML"),
        ("town.gml", ".gml", "is GML; ogr2ogr"),
        ("town.gpx", ".osm", "is GPX"),
        (
            "town.geojson",
            ".parquet",
            "is GeoJSON; optuav city reads it if its name ends in .geojson",
        ),
        ("town.geojson", ".txt", "is GeoJSON; optuav city reads it if its name ends in .geojson"),
        ("town.pdf", ".pdf", "is a PDF; ogr2ogr"),
        ("town.ulg", ".ulg", r"is a flight log of PX4 \(.ulg\); optuav calibrate reads it$"),
        ("town.topojson", ".json", "is TopoJSON; ogr2ogr"),
    ):
        (other := tmp_path / f"other{suffix}").write_bytes((tmp_path / name).read_bytes())
        refused(other, words)


def test_geoparquet_is_read_as_overture_writes_it(tmp_path: Path) -> None:
    """Records and lists beside plain columns, a box of each row, longitudes and latitudes."""
    shapes = [shapely.geometry.shape(square(50.0 * k)) for k in range(60)]
    columns = {
        "id": [f"08b2{k:04}" for k in range(60)],
        "names": [{"primary": "a", "common": None}] * 60,
        "sources": [[{"dataset": "OpenStreetMap"}]] * 60,
        "height": [30.0] * 59 + [None],
        "num_floors": [None] * 59 + [4],
    }
    frame = geopandas.GeoDataFrame(columns, geometry=shapes, crs="OGC:CRS84")
    file = tmp_path / "town.parquet"
    frame.to_parquet(file, write_covering_bbox=True, schema_version="1.1.0", index=False)
    city = read(file, levels="num_floors", height="height")
    assert len(city.names) == 60
    assert city.position_m[-1, 2] == 12.0
    west, south, east, north = shapes[3].bounds
    box = read(file, bbox=(west + 1e-6, south, east - 1e-6, north), height="height")
    assert len(box.names) == 1
    refused(file, "num_floors")  # It may state heights that are missing
    content = file.read_bytes()
    for part in (b"PAR1", content[: len(content) // 2], content[:-4] + b"XXXX"):
        file.write_bytes(part)
        refused(file, "is a Parquet file that is damaged or cut off")


def test_geoparquet_without_a_system_takes_the_stated_one(tmp_path: Path) -> None:
    shape = shapely.box(391000, 5820000, 391020, 5820020)
    frame = geopandas.GeoDataFrame(TALL, index=[0], geometry=[shape], crs=None)
    frame.to_parquet(file := tmp_path / "town.parquet")
    refused(file, "has no coordinate reference system; specify it as crs")
    assert shapely.area(read(file, crs=25833).footprints) == pytest.approx([400], rel=2e-3)
    pd.DataFrame({"height": [1.0]}).to_parquet(plain := tmp_path / "plain.parquet")
    refused(plain, "is a Parquet file without the metadata of GeoParquet")


@pytest.mark.parametrize("suffix", [".gpkg", ".shp", ".fgb", ".parquet", ".geojson"])
def test_a_file_without_a_system_takes_the_stated_one(tmp_path: Path, suffix: str) -> None:
    """And refuses to be read without: GDAL writes all of these with no system at all."""
    shape = shapely.box(391000, 5820000, 391020, 5820020)
    frame = geopandas.GeoDataFrame(TALL, index=[0], geometry=[shape], crs=None)
    file = tmp_path / f"town{suffix}"
    with warnings.catch_warnings(action="ignore"):
        frame.to_parquet(file) if suffix == ".parquet" else frame.to_file(file)
    refused(file, "has no coordinate reference system; specify it as crs")
    assert shapely.area(read(file, crs="EPSG:25833").footprints) == pytest.approx([400], rel=2e-3)


@pytest.mark.parametrize(
    "name",
    [
        "EPSG:25833+7837",
        "urn:ogc:def:crs,crs:EPSG::25833,crs:EPSG::7837",
        "http://www.opengis.net/def/crs-compound?1=http://www.opengis.net/def/crs/EPSG/0/25833"
        "&2=http://www.opengis.net/def/crs/EPSG/0/7837",
        "urn:ogc:def:crs:EPSG::25833",
    ],
)
def test_systems_of_two_codes(tmp_path: Path, name: str) -> None:
    """In a file, and stated for one that has none: the plane is that of the first code."""
    corners = [[391000, 5820000], [391020, 5820000], [391020, 5820020], [391000, 5820020]]
    file = geojson(tmp_path, [(TALL, polygon([*corners, corners[0]]))])
    plain = read(file, crs="EPSG:25833")
    assert np.allclose(read(file, crs=name).position_m, plain.position_m, atol=2e-3)
    document = json.loads(file.read_text())
    document["crs"] = {"type": "name", "properties": {"name": name}}
    file.write_text(json.dumps(document))
    assert np.allclose(read(file).position_m, plain.position_m, atol=2e-3)


@pytest.mark.parametrize("name", ["OGC:CRS84h", "urn:ogc:def:crs:OGC::CRS84h", "OGC:CRS84"])
def test_longitudes_before_latitudes_with_heights_or_without(tmp_path: Path, name: str) -> None:
    """Systems of OGC; stating EPSG:4326 beside them changes nothing, as x is the longitude."""
    file = geojson(tmp_path, [(TALL, square())])
    plain = read(file, crs="EPSG:4326")
    document = json.loads(file.read_text())
    document["crs"] = {"type": "name", "properties": {"name": name}}
    file.write_text(json.dumps(document))
    assert read(file).origin == plain.origin
    assert np.allclose(read(file).position_m, plain.position_m)
    for same in ("EPSG:4326", "OGC:CRS84", "OGC:CRS84h"):
        assert read(file, crs=same).origin == plain.origin


def test_lines_of_json_are_seen_whatever_the_suffix(tmp_path: Path) -> None:
    shapes = [{"type": "Feature", "properties": TALL, "geometry": square(50 * k)} for k in range(3)]
    (file := tmp_path / "town.json").write_text("\n".join(map(json.dumps, shapes)))
    assert read(file).names == ("b0", "b1", "b2")


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("a.geojson", " \n", "a.geojson: is empty"),
        (
            "a.geojson",
            "<?xml version='1.0'?><osm version='0.6'/>",
            r"OpenStreetMap .*name it a.osm",
        ),
        ("a.geojson", "PAR1" + 50 * "\0", "is a Parquet file; name it a.parquet"),
        ("a.geojson", "%PDF-1.7", "a.geojson: is a PDF$"),
        ("a.geojson", '{"type": "FeatureCollection", "features": [{', "as if it were cut off"),
        ("a.jsonl", '{"type": "Feature"}\n{"type": "Fea', "is cut off within its last line"),
        (
            "a.json",
            '{"elements": [], "remark": "timed out"}',
            "no elements; Overpass says 'timed out'",
        ),
    ],
)
def test_what_is_wrong_with_a_text_is_said(
    tmp_path: Path, name: str, content: str, words: str
) -> None:
    """Empty, cut off, another format under a wrong suffix, or nothing from a server."""
    (tmp_path / name).write_text(content)
    refused(tmp_path / name, words)


def test_a_system_is_stated_for_geojson_in_metres(tmp_path: Path) -> None:
    """If the file states none; in degrees it needs none, and any other is refused."""
    corners = [[391000, 5820000], [391020, 5820000], [391020, 5820020], [391000, 5820020]]
    file = geojson(tmp_path, [({"height": 10}, polygon([*corners, corners[0]]))])
    city = read(file, crs="EPSG:25833")
    assert shapely.area(city.footprints) == pytest.approx([400], rel=2e-3)
    refused(file, "has no coordinate reference system; specify it as crs")
    lines = tmp_path / "town.geojsonl"
    lines.write_text(json.dumps(json.loads(file.read_text())["features"][0]))
    assert read(lines, crs=25833).origin == city.origin
    degrees = geojson(tmp_path, [(TALL, square())])
    words = "must be EPSG:4326, which a GeoJSON without a reference system is in"
    with pytest.raises(optuav.InputError, match=words):
        read(degrees, crs="EPSG:25833")


@pytest.mark.parametrize("number", [-1, 0])
def test_an_undefined_system_of_a_geopackage_is_none(tmp_path: Path, number: int) -> None:
    """By its numbers -1 and 0, for places in metres and in degrees."""
    file = tmp_path / "town.gpkg"
    shape = shapely.box(391000, 5820000, 391020, 5820020)
    geopandas.GeoDataFrame(TALL, index=[0], geometry=[shape], crs=25833).to_file(file)
    with sqlite3.connect(file) as base:
        for table in ("gpkg_contents", "gpkg_geometry_columns"):
            base.execute(f"UPDATE {table} SET srs_id = {number}")
    base.close()
    refused(file, "has no coordinate reference system; specify it as crs")
    assert shapely.area(read(file, crs=25833).footprints) == pytest.approx([400], rel=2e-3)


# What a building is


def test_what_says_that_it_is_no_building_is_none_and_listed(tmp_path: Path) -> None:
    kinds = ["yes", "no", False, True, 0, 1, "0", "False", None, "house", "", " \t"]
    shapes = [({**TALL, "building": kind}, square(50.0 * k)) for k, kind in enumerate(kinds)]
    file = geojson(tmp_path, shapes)
    city = read(file)
    assert city.names == ("b0", "b3", "b5", "b9")
    assert city.not_built == ("1", "2", "4", "6", "7", "8", "10", "11")
    assert "building is empty, no, false or 0, left out: 8 (1, 2" in "\n".join(city.notes())
    frame = geopandas.GeoDataFrame.from_features(json.loads(file.read_text()), crs=4326)
    for missing in (None, np.nan, pd.NA, "", "  "):
        frame["building"] = ["yes", *[missing] * 11]
        assert (read(frame).names, len(read(frame).not_built)) == (("b0",), 11)


# What is asked for


@pytest.mark.parametrize(
    ("source", "value"),
    [(3, "3"), (None, "None"), ("", "''"), (pd.DataFrame({"a": [0, 1]}), "a DataFrame of 2 rows")],
)
def test_a_source_is_a_path_or_a_table_with_a_map(source: object, value: str) -> None:
    refused(source, f"^path = {value}: must be a path or a GeoDataFrame$")


def test_a_town_on_both_sides_of_the_antimeridian_needs_an_origin(tmp_path: Path) -> None:
    shapes = [shapely.box(x, -17.0, x + 5e-4, -16.9995) for x in (179.999, -179.999)]
    frame = geopandas.GeoDataFrame({"height": [9.0, 9.0]}, geometry=shapes, crs=4326)
    with pytest.raises(optuav.InputError, match=r"antimeridian: set origin, 180 and -16\.9997"):
        read(frame)
    city = read(frame, origin=(180.0, -17.0))
    apart_m = np.diff(city.position_m[:, 0])[0]
    assert apart_m == pytest.approx(
        0.002 * 6378137 * np.cos(np.radians(17)) * np.pi / 180, rel=2e-3
    )


# Limits


def test_an_outline_that_crosses_itself_everywhere_is_refused(tmp_path: Path) -> None:
    """Mended, it would take minutes and gigabytes; one that is only large is read."""
    corners = np.random.default_rng(1).uniform(0.0, 100.0, (3000, 2)).tolist()
    tangled = geojson(tmp_path, [(TALL, square(200)), (TALL, polygon(ring(corners)))])
    refused(
        tangled, "feature 1: is too tangled to be mended: .* 100000 crossings and 5000000 pairs"
    )
    around = np.linspace(0.0, 2.0 * np.pi, 3000, endpoint=False)
    circle = np.column_stack([np.cos(around), np.sin(around)]) * 90.0
    circle[[10, 11]] = circle[[11, 10]]
    assert read(geojson(tmp_path, [(TALL, polygon(ring(circle.tolist())))])).mended


def test_an_outline_has_as_many_corners_as_a_mission_takes(tmp_path: Path) -> None:
    """The refusal names the feature of the file, not the building of a mission."""
    around = np.linspace(0.0, 2.0 * np.pi, 50_000, endpoint=False)
    circle = np.column_stack([np.cos(around), np.sin(around)]) * 9000.0
    large, allowed = (polygon(ring(circle[::step].tolist())) for step in (1, 5))
    file = geojson(tmp_path, [(TALL, square(20_000)), (TALL, large)])
    refused(file, "map.geojson: feature 1: has an outline with 50000 corners, more than 10000")
    assert len(read(geojson(tmp_path, [(TALL, allowed)])).buildings()) == 1


def test_outlines_over_each_other_are_compared_with_themselves_only(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """20 rings of 100 edges have 20 * 100² ordered pairs, and their crossings are each one's own.

    Edges side by side that hardly cross have a limit of their own.
    """
    search, pairs = shapely.STRtree.query, list[int]()

    def counted(tree: shapely.STRtree, *args: object, **options: object) -> object:
        found = search(tree, *args, **options)
        pairs.append(found.shape[-1])
        return found

    monkeypatch.setattr(shapely.STRtree, "query", counted)
    rings = np.random.default_rng(1).uniform(0.0, 100.0, (20, 100, 2)).tolist()
    town = geojson(tmp_path, [(TALL, polygon(ring(corners))) for corners in rings])
    assert len({name.partition("-")[0] for name in read(town).mended}) == 20
    assert sum(pairs) < 2 * 20 * 100**2  # Those with overlapping boxes, and those that cross
    along, ends = np.linspace(0.0, 20.0, 200), np.where(np.arange(200) % 2, 99.0, -99.0)
    hatch = np.column_stack([ends + along, ends - along])
    hatch[100] += [1.0, -1.0]  # Over its neighbours
    town = geojson(tmp_path, [(TALL, square(200)), (TALL, polygon(ring(hatch.tolist())))])
    assert "b1" in read(town).mended
    monkeypatch.setattr(sys.modules["optuav.city.outlines"], "MOST_PAIRS", 5_000)
    refused(town, "feature 1: is too tangled to be mended")


def test_a_zip_holds_one_map_of_a_size_that_is_unpacked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The size is looked at before anything is unpacked, and nothing leaves the folder."""
    file, packed = town(tmp_path, ".shp"), tmp_path / "town.zip"
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for part in tmp_path.glob("town.*"):
            if part != packed:
                archive.write(part, f"../../{part.name}")
    assert read(packed).names == read(file).names
    content = packed.read_bytes()
    packed.write_bytes(content[: len(content) // 2])
    refused(packed, "is damaged, encrypted or no zip")
    with zipfile.ZipFile(packed, "w") as archive:
        archive.writestr("a.geojson", "{}")
        archive.writestr("b.geojson", "{}")
    refused(packed, "holds 2 maps, not one: 'a.geojson', 'b.geojson'")
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("blank.geojson", " " * 3_000_000)
    monkeypatch.setattr(sys.modules["optuav.city.files"], "LARGEST_MAP", 2_000_000)
    refused(packed, "holds 3 MB, more than the 2 MB that are unpacked")


# Tables of Python


def test_a_table_is_read_as_the_file_it_came_from(tmp_path: Path) -> None:
    """By its index, or by number where that is not unique; a table without a map is refused."""
    file = geojson(tmp_path, [(TALL, square(50.0 * k)) for k in range(3)])
    frame, expected = geopandas.read_file(file), read(file)
    city = read(frame)
    assert (city.names, city.origin) == (expected.names, expected.origin)
    assert (city.position_m == expected.position_m).all()
    ways = frame.set_index(pd.MultiIndex.from_tuples([("way", 5), ("way", 7), ("relation", 5)]))
    names = optuav.load("paper").replace({"buildings": read(ways).buildings()}).buildings.names
    assert [*names] == ["way/5", "way/7", "relation/5"]
    assert read(frame.set_index([pd.Index([4, 4, 4])])).names == ("b0", "b1", "b2")
    twice = pd.concat([frame, frame[["height"]]], axis=1)
    assert read(twice).names == expected.names
    for wrong, words in (
        (frame.set_crs(None, allow_override=True), "GeoDataFrame: has no coordinate reference"),
        (geopandas.GeoDataFrame({"height": [3.0]}), "GeoDataFrame: has no geometry"),
        (frame.iloc[:0], "GeoDataFrame: has no buildings"),
        (frame.drop(columns="height"), "GeoDataFrame: height = 'height': no column of this name"),
    ):
        with pytest.raises(optuav.InputError, match=words):
            read(wrong)


def test_a_city_as_a_table_comes_back_and_makes_a_mission(tmp_path: Path) -> None:
    """Read again it is the same city, and as a file it is the buildings of a mission."""
    horseshoe = [(0, 0), (30, 0), (30, 30), (20, 30), (20, 10), (10, 10), (10, 30), (0, 30)]
    shapes = [(TALL, square(80 * EAST_DEG, NORTH_DEG)), (TALL, polygon(ring(horseshoe, 90)))]
    city = read(geojson(tmp_path, shapes))
    frame = city.to_frame()
    again = read(frame, height="z_m", origin=city.origin)
    assert again.names == city.names
    assert np.abs(again.position_m - city.position_m).max() < 2e-3
    assert shapely.hausdorff_distance(again.footprints, city.footprints).max() < 2e-3
    frame.to_file(tmp_path / "roofs.gpkg")
    mission = tmp_path / "mission.toml"
    mission.write_text('schema = 1\nextends = "paper"\nbuildings_file = "roofs.gpkg"\n')
    assert optuav.load(mission).buildings.rows() == city.buildings().rows()


def test_a_city_shows_itself_in_a_few_lines(tmp_path: Path) -> None:
    tags = {"building": "yes", "building:levels": 3}
    shapes = [(tags, square(50.0 * k)) for k in range(500)]
    city = read(geojson(tmp_path, [*shapes, ({"building": "no"}, square(-50))]))
    shown = repr(city).splitlines()
    assert shown[0].startswith("City of ")
    assert len(shown) <= 10
    assert max(map(len, shown)) <= 80
