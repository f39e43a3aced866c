"""``optuav city``: a mission among the buildings of a map file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from optuav.cli.options import by_flags, numbers_in
from optuav.cli.output import check_places, deliver, say
from optuav.errors import Fault, InputError, collected, refuse, shown
from optuav.presentation.blocks import Note
from optuav.presentation.numbers import figure

if TYPE_CHECKING:
    from optuav.city.city import City
    from optuav.mission import Mission

LEAST_BYTES = 50  # Size of a building in a mission file
ARGUMENT = r"(?<=as |by )\w+|\w+_\w+"  # Arguments of `optuav.city.read`, as its errors name them
FAR_M = 5000.0  # A place this far from all buildings is hardly meant [m]


@dataclass(frozen=True)
class Site:
    """Options of ``optuav city``: places as longitude, latitude [deg] and height [m].

    One device, or a table of several.
    """

    origin: str
    destination: str
    laser: str
    device: str | None = None
    devices: Path | None = None

    @property
    def stated(self) -> dict[str, str]:
        """The places that are stated, by name."""
        places = {"origin": self.origin, "destination": self.destination}
        places |= {} if self.device is None else {"device": self.device}
        return {**places, "laser": self.laser}


@dataclass(frozen=True)
class Map:
    """Options of ``optuav city``: the parts of the map file that count; None if not stated."""

    layer: str | None = None
    height: str | None = None
    height_factor: float | None = None
    levels: str | None = None
    level_height_m: float = 3.0
    crs: str | None = None
    bbox: str | None = None
    default_height_m: float | None = None


def city(
    file: Path,
    site: Site,
    map: Map,
    source: str = "matrice350",
    as_json: bool = False,
    save: Path | None = None,
) -> None:
    """Make a mission among the buildings of a map file (needs geopandas)."""
    from optuav.city.city import NOTED
    from optuav.mission.files import STANDARD, write_files

    check_places(save, None, ".toml")
    printed = save in (None, STANDARD)
    faults = [Fault("--json", "", "goes with --save FILE")] if as_json and printed else []
    base, town, places = _read(file, site, map, source, faults)
    devices = places.pop("devices", [])
    at_m = {name: town.point_m(*place) for name, place in places.items()}
    served: dict[str, Any] = {"route.hover_m": None, "link.device_m": at_m.get("device")}
    if devices:
        for device in devices:
            at_m[f"device {device['name']}"] = town.point_m(*device["position_m"])
            device["position_m"] = [*at_m[f"device {device['name']}"]]
        served = {"devices": devices}
    mission = base.replace(
        {
            "name": file.name.partition(".")[0],
            "description": "",
            "crs": town.crs,
            "route.origin_m": at_m["origin"],
            "route.destination_m": at_m["destination"],
            **served,
            "laser.position_m": at_m["laser"],
            "buildings": town.buildings(),
        }
    )
    notes, warnings = [*town.notes()], [*_warnings(mission, at_m)]
    remarks = [*notes, *(f"warning: {warning}" for warning in warnings)]
    files = _files(mission, remarks, save)
    write_files(files)
    if printed:
        for remark in remarks:  # The standard output may be the mission's file
            say(remark, error=True)
        return
    lists = {name: [*getattr(town, name)] for name in NOTED}
    record = {"kind": "optuav city", "crs": town.crs, "buildings": len(town.names), **lists}
    record |= {"notes": notes, "warnings": warnings, "written": [str(path) for path in files]}
    deliver(lambda: record, [Note(remarks)], as_json=as_json, written=[*files])


def _read(
    file: Path, site: Site, map: Map, source: str, faults: list[Fault]
) -> tuple[Mission, City, dict[str, Any]]:
    """The mission to start from, the buildings, and the places; or a refusal with all faults."""
    from optuav.city import read
    from optuav.city.city import ON_EARTH, on_earth
    from optuav.fields import COORDINATE
    from optuav.mission import load
    from optuav.mission.device_tables import read_devices

    places: dict[str, Any] = {name: numbers_in(text) for name, text in site.stated.items()}
    words = f"LONGITUDE,LATITUDE,HEIGHT: {ON_EARTH}; height: {COORDINATE.words}"
    for name, place in places.items():
        if len(place) != 3 or not (on_earth(place[:2]) and COORDINATE.accepts(place[2])):
            faults.append(Fault(name, repr(getattr(site, name)), words))
    if (site.device is None) == (site.devices is None):
        faults.append(Fault("device", "", "either --device PLACE or --devices FILE"))
    if site.devices is not None:
        with collected(faults):
            places["devices"] = read_devices(site.devices, on_earth=True)
        for n, device in enumerate(places.get("devices", ())):
            at = device["position_m"]
            numbers = all(COORDINATE.accepts(x) for x in at)
            if not (numbers and on_earth(at[:2]) and isinstance(device["name"], str)):
                faults.append(Fault(f"devices[{n}]", shown([device["name"], *at]), words))
    bbox = None if map.bbox is None else numbers_in(map.bbox)
    if bbox is not None and len(bbox) != 4:
        faults.append(Fault("bbox", repr(map.bbox), "WEST,SOUTH,EAST,NORTH [deg]"))
    with collected(faults):
        base = load(source)
    options, origin = {**vars(map), "bbox": None if faults else bbox}, places["origin"][:2]
    of_map = list[Fault]()
    with collected(of_map):
        town = read(file, **options, origin=None if faults else origin)
    flags = {name: f"--{name.replace('_', '-')}" for name in options}
    refuse([*faults, *(by_flags(fault, flags, ARGUMENT) for fault in of_map)])
    return base, town, places


def _files(mission: Mission, remarks: Sequence[str], save: Path | None) -> dict[Path, bytes]:
    """The mission as a file; where it has too many buildings to be read, with a table of them."""
    from optuav.mission.files import LARGEST_TOML, STANDARD
    from optuav.mission.table_files import geoparquet
    from optuav.mission.template import template

    few = len(mission.buildings) * LEAST_BYTES <= LARGEST_TOML
    text = template(mission, mission.name, remarks) if few else ""
    if text and len(text) <= LARGEST_TOML:
        return {save or STANDARD: text.encode("utf-8")}
    if save is None:
        words = f"{len(mission.buildings)} buildings make a mission of more than the "
        words += (
            f"{figure(LARGEST_TOML / 1e6)} MB that optuav reads: choose a smaller part of the map, "
        )
        raise InputError([Fault("bbox", "", f"{words}or --save, which writes them apart")])
    table = save.with_suffix(".parquet")
    content, named = geoparquet(mission.buildings, str(mission.crs), table)
    text = template(mission.replace({"buildings": named}), mission.name, remarks, save)
    return {table: content, save: text.encode("utf-8")}


def _warnings(mission: Mission, at_m: Mapping[str, tuple[float, float, float]]) -> Iterator[str]:
    """Return warnings, and the buildings in the way from take-off to the hover point and on."""
    import numpy as np

    from optuav.network.feasibility import advice, blocked_legs
    from optuav.network.network import build_network
    from optuav.network.obstacles import CLEAR

    for name, (x, y, z) in at_m.items():
        away_m = np.hypot(*(mission.buildings.roof_m[:, :2] - (x, y)).T).min()
        if away_m > FAR_M:
            yield f"{name} is {figure(away_m / 1000, 3)} km away from the nearest building"
        if z < 0.0:
            yield f"{name} lies {figure(-z)} m below the ground"
    warnings, network = [*advice(mission)], build_network(mission)
    yield from warnings
    if not mission.devices and (network.legs.crosses[:2] != CLEAR).any():
        yield from (leg for leg in blocked_legs(network, 0) if leg not in warnings)
