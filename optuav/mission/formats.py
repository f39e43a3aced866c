"""Recognises a file's format by its first bytes, to name it in a refusal."""

import re
from typing import NamedTuple

HEAD = 4096  # First bytes of a file that are looked at


class FileFormat(NamedTuple):
    """What a file is, in words, with what to do about it; and whether it is text."""

    words: str
    binary: bool

    @property
    def name(self) -> str:
        """The words without the advice."""
        return self.words.partition(";")[0]

    @property
    def advice(self) -> str:
        """What to do about it, if no command of optuav takes it; else empty."""
        advice = self.words.partition("; ")[2]
        return "" if "optuav" in advice else advice


BINARY = (
    (0, b"SQLite format 3\0", "a GeoPackage or another SQLite database"),
    (0, b"\0\0\x27\x0a", "a shapefile"),
    (0, b"fgb\x03fgb", "a FlatGeobuf"),
    (4, b"\n\tOSMHeader", "OpenStreetMap data (.osm.pbf)"),
    (0, b"PAR1", "a Parquet file"),
    (0, b"ULog\x01\x12\x35", "a flight log of PX4 (.ulg); optuav calibrate reads it"),
    (0, b"\xa3\x95\x80", "a flight log of ArduPilot (.bin); optuav calibrate reads it"),
    (8, b"\xfe", "a telemetry log of MAVLink (.tlog); the drone's own log is a .ulg or .bin"),
    (8, b"\xfd", "a telemetry log of MAVLink (.tlog); the drone's own log is a .ulg or .bin"),
    (16, b"BUILD", "a DAT file of DJI; DatCon converts it to CSV"),
    (
        0,
        b"PK\x03\x04",
        "a zip file or packed like one; unpack a .kmz, save an .xlsx as .csv",
    ),
    (0, b"\x1f\x8b", "packed by gzip; unpack it"),
    (0, b"BZh", "packed by bzip2; unpack it"),
    (0, b"\xfd7zXZ", "packed by xz; unpack it"),
    (0, b"7z\xbc\xaf", "a 7z archive; unpack it"),
    (0, b"\xff\xfe", "text in UTF-16; save it in UTF-8"),
    (0, b"\xfe\xff", "text in UTF-16; save it in UTF-8"),
    (0, b"%PDF", "a PDF"),
    (0, b"\x89PNG", "a PNG picture"),
    (0, b"\xff\xd8\xff", "a JPEG picture"),
    (0, b"II*\0", "a TIFF picture, perhaps a GeoTIFF, which has no outlines"),
    (0, b"MM\0*", "a TIFF picture, perhaps a GeoTIFF, which has no outlines"),
    (0, b"LASF", "a point cloud (.las), which has no outlines"),
)
"""Bytes that identify a format, and where they begin; several may fit, and the first counts."""
TEXT = (
    (r"FMT, *\d+, *\d+, *\w+,", "a flight log of ArduPilot in text (.log); take its .bin"),
    (r"QGC WPL", "a text of waypoints; optuav audit reads it with --mission"),
    (r"(?=<)(?s:.*)<kml\b", "KML; optuav audit reads a flight plan in it with --mission"),
    (r"(?=<)(?s:.*)<osmChange", "a change of OpenStreetMap (.osc), not a map"),
    (r"(?=<)(?s:.*)<osm\b", "OpenStreetMap data (.osm)"),
    (r"(?=<)(?s:.*)<gpx\b", "GPX, which has tracks and no outlines"),
    (r"(?=<)(?s:.*)(citygml|CityModel)", "CityGML; citygml-tools converts it to CityJSON"),
    (r"(?=<)(?s:.*)opengis\.net/gml", "GML; ogr2ogr, which comes with GDAL, converts it"),
    (r"(?=<)(?s:.*)<OGRVRT", "a VRT, which names other files"),
    (r"(?=<)(?s:.*)<html\b", "a web page (HTML), not the file that it links to"),
    (
        r'\{(?s:.*)"fileType"\s*:\s*"Plan"',
        "a plan of QGroundControl; optuav audit reads it with --mission",
    ),
    (r'\{(?s:.*)"kind"\s*:\s*"optuav plan"', "a saved plan; optuav show and audit read it"),
    (
        r'\{(?s:.*)"(osm3s|generator"\s*:\s*"Overpass)',
        "Overpass JSON; optuav city reads it if its name ends in .json",
    ),
    (
        r'\{(?s:.*)"type"\s*:\s*"CityJSON',
        "CityJSON; optuav city reads it if its name ends in .json",
    ),
    (r'\{(?s:.*)"type"\s*:\s*"Topology"', "TopoJSON; ogr2ogr, which comes with GDAL, converts it"),
    (
        r'\{(?s:.*)"type"\s*:\s*"Feature',
        "GeoJSON; optuav city reads it if its name ends in .geojson",
    ),
    (r"\{(?s:.*)\"asset\"\s*:", "a glTF model, which has no place on Earth"),
)


def named(head: bytes) -> FileFormat | None:
    """Return the format that the first bytes of a file show; None if they show none."""
    for at, start, words in BINARY:
        if head[at:].startswith(start) and (at != 8 or head[:1] == b"\0"):  # Until the year 4200
            return FileFormat(words, binary=True)
    text = head[:HEAD].decode("utf-8-sig", errors="replace").lstrip()
    for pattern, words in TEXT:
        if re.match(pattern, text, re.IGNORECASE):
            return FileFormat(words, binary=False)
    return None
