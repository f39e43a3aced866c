"""The mission: validated data that never changes, and the keys that a new value displaces."""

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from functools import cached_property
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple, Self, TypeAlias

from annotated_types import Len
from pydantic import Field, Strict, ValidationError, model_validator

from optuav import fields, tables
from optuav.errors import MOST_SHOWN, Fault, InputError, for_console, printable
from optuav.fields import MissionSection
from optuav.flight import FLIGHTS
from optuav.flight.model import BENDING, BENT, FlightModel
from optuav.flight.rotors import RotorFlight
from optuav.frames import DataFrame, frame
from optuav.laser import BEAMS
from optuav.laser.beam import Beam
from optuav.laser.fits import CONVERSIONS, Fits
from optuav.mission import validation
from optuav.mission.buildings import RESERVED_NAMES, Buildings
from optuav.mission.files import ending_of, relative_to, write_text
from optuav.mission.forms import CHOICES, LISTS, SCHEMA, TABLES, Flight, Source, table_keys
from optuav.mission.messages import nearest, no_item, path_of, plural, shown
from optuav.mission.validation import Document, Key, StatedMission, keys_of, validate
from optuav.presentation.blocks import Block
from optuav.presentation.numbers import coordinates, figure, percent
from optuav.presentation.presented import Presented

if TYPE_CHECKING:
    from optuav.physics.kibam import Battery

Vector: TypeAlias = tuple[Any, Any, Any]  # Of numbers, or of columns where missions vary
ENERGIES = ("flight_energy_J", "hover_energy_J")
_ENERGIES = {f"battery.{key}" for key in ENERGIES}
_WELLS = {"start.available_As", "start.bound_As"}

DISPLACED: dict[str, set[str]] = {
    "battery.flow_rate_per_s": {"battery.flow_rate_per_min"},
    "battery.flow_rate_per_min": {"battery.flow_rate_per_s"},
    "battery.packs": _ENERGIES | _WELLS,
    "battery.capacity_As": _ENERGIES | _WELLS,
    "battery.available_fraction": _WELLS,
    "battery.schedule": {"battery.period_s"},
    "start.soc": _WELLS,
    "start.available_As": {"start.soc"},
    "start.bound_As": {"start.soc"},
    "laser.visibility_km": {"laser.attenuation_per_km"},
    "laser.attenuation_per_km": {"laser.visibility_km"},
    "laser.wavelength_nm": {f"laser.{key}" for key in CONVERSIONS[810]},
}
"""By key, the keys that a new value of it displaces unless they are stated with it."""
ONE_DEVICE = (("link", "device_m"), ("route", "hover_m"))
"""Keys of a mission with one device, which a list of devices displaces, and which displace it."""
OF_DEVICE = ("position_m", "hover_m", "share")  # Keys of one of several devices


class Served(NamedTuple):
    """A device that the UAV serves, with the share of the hover time that it gets [-]."""

    name: str  # Also of its hover point
    position_m: Vector
    hover_m: Vector | None  # Where it is stated
    share: float


class Mission(Presented, MissionSection):  # noqa: PLW1641 (pydantic gives it the hash of its values)
    """A mission of a laser-charged UAV; every attribute has the name of its key in a file.

    Missions are equal if all their values are, can be hashed and pickled, and change only by
    `replace`, which makes a new one. All methods that make one raise `InputError` with all faults,
    unknown and missing keys and columns among them; the constructor raises pydantic's own error.

    Parameters
    ----------
    name, description, crs
        Its name and subject, and the reference system of x and y in metres, or None.
    route, limits, battery, start, rotor, body, air, earth, laser, receiver, link, wind, flight
        The tables of a mission file. Each of their keys is an attribute with its unit as a suffix,
        as ``limits.deadline_s`` [s]; ``optuav new FILE`` writes them all, with allowed values.
    devices
        In order, if there are several, each with ``name``, ``position_m``, ``hover_m`` and
        ``share``; one is ``link.device_m`` and ``route.hover_m``, however it was stated.
    buildings
        In order, each with ``name``, ``position_m`` and ``footprint_m``, as columns of numbers too.

    Examples
    --------
    >>> import optuav
    >>> mission = optuav.load("paper")
    >>> mission.battery.packs, len(mission.buildings)
    (2, 10)
    >>> longer = mission.replace({"limits.deadline_s": 1500, "buildings.b3": None})
    >>> longer.limits.deadline_s, len(longer.buildings)
    (1500.0, 9)
    """

    name: fields.Name = "mission"
    """Name of the mission; by default the file's name."""
    description: fields.Description = ""
    """Subject of the mission."""
    crs: fields.ReferenceSystem | None = None
    """Coordinate reference system of x and y, in metres; maps that are saved are in it."""
    route: tables.RouteEnds
    limits: tables.Limits
    battery: tables.BatteryPacks
    start: tables.Start | None = None
    rotor: tables.Rotor | None = None
    body: tables.Body | None = None
    air: tables.Air | None = None
    earth: tables.Earth | None = None
    laser: Source | None = None
    receiver: tables.LightReceiver | None = None
    link: tables.Link
    wind: tables.Wind = tables.Wind()
    flight: Flight = RotorFlight()
    devices: Annotated[
        tuple[tables.Device, ...],
        Len(0, fields.MOST_DEVICES),
        Strict(),
        fields.Listed,
        fields.NotEmpty,
        fields.Allowed(
            f"a list of 1 to {fields.MOST_DEVICES} tables [[devices]] with name, position_m"
        ),
    ] = ()
    buildings: Annotated[
        Buildings,
        fields.Allowed(f"up to {fields.MOST_ITEMS} tables [[buildings]] with name, position_m"),
    ] = Field(default_factory=Buildings, json_schema_extra={"default": []})

    @model_validator(mode="before")
    @classmethod
    def _one_device(cls, stated: object) -> object:
        """A single device that is in order as `link.device_m` and `route.hover_m`."""
        if not (isinstance(stated, dict) and isinstance(listed := stated.get("devices"), list)):
            return stated
        if len(listed) != 1 or not all(isinstance(stated.get(x), dict) for x in ("link", "route")):
            return stated
        try:
            device = tables.Device.model_validate(listed[0])
        except ValidationError:
            return stated
        names = {*RESERVED_NAMES, *validation.names_of(stated.get("buildings", ()))}
        beside = {"device_m": stated["link"], "hover_m": stated["route"]}
        if device.name in names or (device.share or 1.0) != 1.0:
            return stated
        if any(key in table for key, table in beside.items()):
            return stated
        hover = {} if device.hover_m is None else {"hover_m": device.hover_m}
        one = {k: v for k, v in stated.items() if k != "devices"}
        link = {**stated["link"], "device_m": device.position_m}
        return {**one, "link": link, "route": {**stated["route"], **hover}}

    @property
    def device_m(self) -> tuple[float, float, float]:
        """Position of the device [m]; `InputError` if there are several."""
        if self.link.device_m is None:
            words = f"one device; the mission has {len(self.devices)}"
            raise InputError([Fault("devices", "", f"{words}, and this is for one")])
        return self.link.device_m

    @cached_property
    def served(self) -> tuple[Served, ...]:
        """All devices, each with its share; one is named as its place, "hover"."""
        if not self.devices:
            at_m: Any = self.link.device_m
            return (Served("hover", at_m, self.route.hover_m, 1.0),)
        equal = 1.0 / len(self.devices)
        return tuple(
            Served(device.name, device.position_m, device.hover_m, device.share or equal)
            for device in self.devices
        )

    @cached_property
    def flight_model(self) -> FlightModel:
        """The model of its flight and power, see ``flight.model``."""
        return FLIGHTS[self.flight.model].of(self)

    @cached_property
    def beam(self) -> Beam | None:
        """The model of its laser's light, see ``laser.beam``; None without a laser."""
        if self.laser is None:
            return None
        return (BEAMS[self.laser.beam] if self.laser.beam else Fits).of(self)

    @cached_property
    def pack(self) -> "Battery":
        """One pack."""
        from optuav.physics.kibam import Battery

        battery = self.battery
        return Battery(battery.capacity_As, battery.available_fraction, battery.flow_rate_per_s)

    @cached_property
    def pool(self) -> "Battery":
        """All packs as one battery."""
        return replace(self.pack, capacity_As=self.battery.packs * self.battery.capacity_As)

    def __eq__(self, other: object) -> bool:
        """Equal values, and models of the same classes, as one from outside may be replaced."""
        if not (isinstance(other, Mission) and super().__eq__(other)):
            return False
        pairs = (self.flight_model, other.flight_model), (self.beam, other.beam)
        return all(type(mine) is type(theirs) for mine, theirs in pairs)

    def __copy__(self) -> Self:
        """A copy of its values, which `model_copy` changes, without what was made of them."""
        copied = super().__copy__()
        for name in vars(copied).keys() - type(self).model_fields.keys():
            del vars(copied)[name]
        return copied

    @model_validator(mode="after")
    def _rules(self) -> Self:
        document = self._document()
        if len(self.devices) == 1:  # Of a list it is taken apart before
            words = "several devices; a single one is link.device_m and route.hover_m"
            raise InputError([Fault("devices", "", words)])
        if breaches := list(islice(validation.rules(document), MOST_SHOWN)):
            raise InputError(StatedMission(document).faults(breaches))
        return self

    def _document(self) -> Document:
        """Every value as plain data, but the buildings as their table."""
        return {**self._plain(exclude={"buildings"}), "buildings": self.buildings}

    def _plain(self, **options: Any) -> Document:
        """Every value as plain data; without the list of devices where there is but one."""
        plain = self.model_dump(mode="json", exclude_none=True, **options)
        return plain if self.devices else {k: v for k, v in plain.items() if k != "devices"}

    def __repr__(self) -> str:
        name, count, limits = printable(self.name), len(self.buildings), self.limits
        return f"<Mission {name!r}: {count} buildings, within {figure(limits.deadline_s)} s>"

    def blocks(self) -> Iterator[Block]:
        """Yield subject, places, deadline and equipment; in HTML every key and building too."""
        from optuav.mission.display import blocks

        parts = self._sections(), self.devices, self.buildings
        return blocks(self._facts(), self.description, *parts)

    def _sections(self) -> dict[str, MissionSection]:
        """The tables that it states, the buildings aside."""
        return {name: table for name, table in self if isinstance(table, MissionSection)}

    def to_frame(self) -> DataFrame:
        """One row per key, the devices and buildings aside; needs pandas.

        Columns are ``key``, dotted as `replace` takes it, ``value`` in the unit of its name, and
        ``meaning``.
        """
        from optuav.mission.display import keys_with_values

        rows = [
            (f"{name}.{key}", *rest)
            for name, section in self._sections().items()
            for key, *rest in keys_with_values(section)
        ]
        return frame(rows, ["key", "value", "meaning"])

    def replace(self, values: Mapping[str, object]) -> Self:
        """Make a mission that differs in some values, validated as a whole.

        Parameters
        ----------
        values
            New values by dotted key, for example ``{"limits.deadline_s": 800,
            "buildings.b3.position_m": [300, 800, 60]}``; a building goes by its name or as
            ``buildings[2]``. None removes an optional key, a table or a building. A table joins
            the one that is there. A value displaces what made sense only with the old one:
            ``laser.visibility_km`` and ``laser.attenuation_per_km`` each other, a new
            ``laser.wavelength_nm`` the four conversion coefficients, a new
            ``battery.capacity_As`` or ``battery.packs`` the energies E_1 and E_2 of the full
            battery and the wells of ``start``, a new ``battery.available_fraction`` those wells,
            ``start.soc`` and the wells each other, a new ``flight.model`` or ``laser.beam`` the
            keys of the other one, ``flight.obstacles`` and ``flight.through_buildings`` each other,
            ``devices`` the keys ``link.device_m`` and ``route.hover_m``, and either of these the
            devices; a device goes by its name, as ``devices.west.position_m``.
        """
        if not isinstance(values, Mapping):
            raise InputError([Fault("", shown(values), "values by dotted key in a dict")])
        revised, faults = _revised(self._document(), values)
        return validate(type(self), revised, faults)

    def with_buildings(self, table: Mapping[str, Iterable[object]]) -> Self:
        """Make a mission with other buildings in place of all, validated as a whole.

        Parameters
        ----------
        table
            Columns of equal length, such as a pandas data frame of a CSV file: ``name``; ``x_m``,
            ``y_m`` and ``z_m``, the position [m] with the height of the roof; and for footprints
            ``width_m`` and ``depth_m``, the sizes along x and y [m], NaN or None where a building
            has none.

        Examples
        --------
        >>> import optuav
        >>> roofs = {"name": ["a", "b"], "x_m": [0, 90], "y_m": [500, 700], "z_m": [60, 40]}
        >>> optuav.load("paper").with_buildings(roofs).buildings[1].position_m
        (90.0, 700.0, 40.0)
        """
        from optuav.mission.building_columns import of_columns

        return self.replace({"buildings": of_columns(table)})

    def with_devices(self, table: Mapping[str, Iterable[object]]) -> Self:
        """Make a mission with devices in place of its own, validated as a whole.

        Parameters
        ----------
        table
            Columns of equal length, such as a pandas data frame of a CSV file: ``name``; ``x_m``,
            ``y_m`` and ``z_m``, the position [m]; and maybe ``share``, which adds up to 1 [-].

        Examples
        --------
        >>> import optuav
        >>> sensors = {"name": ["a", "b"], "x_m": [400, 1000], "y_m": [2600, 3000], "z_m": [0, 0]}
        >>> [device.name for device in optuav.load("paper").with_devices(sensors).devices]
        ['a', 'b']
        """
        from optuav.mission.device_tables import rows_of_columns

        return self.replace({"devices": rows_of_columns(table)})

    @for_console
    def summary(self) -> str:
        """The mission in a few lines: subject, places, deadline and equipment.

        Examples
        --------
        >>> import optuav
        >>> print(optuav.load("paper").summary())
        Mission      paper: 10 buildings, a laser of 1000 W
        Route        (0, 0, 50) m to (2000, 0, 50) m within 1200 s
        Device       (1000, 3000, 0) m, outage at most 0.01
        Battery      2 × 36000 A s, pooled, at least 5 % left
        Flight       model "rotors", 50 to 100 m above ground
        """
        return str(self)

    def _facts(self) -> dict[str, str]:
        """What, where, how long, and with what, in sentences by heading."""
        route, limits, battery, laser = self.route, self.limits, self.battery, self.laser

        outage = f"outage at most {figure(limits.outage_probability)}"
        if self.devices:
            names = [printable(device.name) for device in self.devices]
            devices = {"Devices": f"{', '.join(names)}, {outage}"}
        else:
            devices = {"Device": f"{coordinates(self.device_m)} m, {outage}"}
        buildings = plural(len(self.buildings), "building")
        source = f"a laser of {figure(laser.power_W)} W" if laser else "no laser"
        return {
            "Mission": f"{printable(self.name)}: {buildings}, {source}",
            "Route": f"{coordinates(route.origin_m)} m to {coordinates(route.destination_m)} m "
            f"within {figure(limits.deadline_s)} s",
            **devices,
            "Battery": f"{battery.packs} × {figure(battery.capacity_As)} A s, {battery.schedule}, "
            f"at least {percent(limits.min_soc)} left",
            "Flight": f'model "{self.flight.model}", {figure(limits.min_altitude_m)} to '
            f"{figure(limits.max_altitude_m)} m above ground",
        }

    def to_dict(self) -> Document:
        """Every value as plain data, as a file without ``extends`` states it.

        Optional keys that are not set are left out.
        """
        return {"schema": SCHEMA, **self._plain()}

    @classmethod
    def from_dict(cls, document: Mapping[str, object]) -> Self:
        """Make a mission of plain data as `to_dict` gives it; None counts as not stated."""
        if not isinstance(document, Mapping):
            raise InputError([Fault("", shown(document), "a mission as a dict")])
        content = without_none(document)
        faults = StatedMission(content).faults(validation.format_breaches(content))
        content.pop("schema", None)
        return validate(cls, StatedMission(content), faults)

    def save(self, path: str | Path) -> Path:
        """Write the mission as a complete TOML file, whole or not at all.

        Buildings that were read from a table stay there: the file names it.

        The suffix is .toml or none; an existing file is replaced. `InputError` if the suffix is
        another, the directory is missing or cannot be written to, or the table of its buildings is
        missing or has changed.
        """
        file = path_of(path)
        ending_of(file, ".toml", "")
        if source := self.buildings.source:
            from optuav.mission.table_files import check

            check(Path(source.path), source.sha256)
            named = relative_to(file, source.path)
            document = {"schema": SCHEMA, "buildings_file": named}
            document |= {k: v for k, v in self._document().items() if k != "buildings"}
        else:
            document = self.to_dict()
        write_text(file, toml_of(document))
        return file


def toml_of(document: Document) -> str:
    """Plain data of a mission as the text of its file, each array on one line."""
    import tomli_w

    text = tomli_w.dumps(document)
    # Strings are safe, as their line breaks are written escaped.
    for pattern, joint in ((r"\[\n +", "["), (r",\n *\]", "]"), (r",\n +", ", ")):
        text = re.sub(pattern, joint, text)
    return text


def overlay(base: Document, stated: Document) -> tuple[Document, dict[Key, str]]:
    """Lay a document on top of a base, where None removes a key; and list what that displaces.

    Tables join key by key, anything else is replaced. The keys of the base that are displaced come
    with the dotted key whose new value does so.
    """
    joined, gone = {**base, **stated}, dict[Key, str]()
    for name, table in stated.items():
        below = base.get(name)
        if not isinstance(below, dict) or not isinstance(table, dict):
            continue
        joined[name] = {**below, **table}
        for key, others in displaced(name, table).items():
            last = key.partition(".")[2]
            if table.get(last) is not None and table[last] != below.get(last):
                for owner, other in (place.split(".") for place in others):
                    if other in keys_of(base.get(owner)).keys() - keys_of(stated.get(owner)):
                        gone[owner, other] = key
    if stated.get("devices") is not None:
        for table_of, key in ONE_DEVICE:
            if key in keys_of(base.get(table_of)).keys() - keys_of(stated.get(table_of)):
                gone[table_of, key] = "devices"
    elif "devices" in base and "devices" not in stated:
        by = [key for key in ONE_DEVICE if keys_of(stated.get(key[0])).get(key[1]) is not None]
        if by:
            joined.pop("devices")
            if ONE_DEVICE[0] not in by:
                gone[ONE_DEVICE[0]] = ".".join(by[0])
    for name in {str(place[0]) for place in gone}:
        kept = {k: v for k, v in keys_of(base.get(name)).items() if (name, k) not in gone}
        joined[name] = kept | keys_of(stated.get(name))
    return joined, gone


def displaced(name: str, table: Document) -> dict[str, set[str]]:
    """The keys of a table, each with those that a new value of it displaces."""
    others = {key: gone for key, gone in DISPLACED.items() if key.startswith(f"{name}.")}
    if choice := CHOICES.get(name):  # Keys of other flight models, or other beams
        foreign = table_keys(name).keys() - choice.form_of(table).model_fields.keys()
        others[f"{name}.{choice.key}"] = {f"{name}.{key}" for key in foreign}
    if name == "flight":
        ways = set() if table.get("obstacles") in BENT else {f"flight.{key}" for key in BENDING}
        others["flight.obstacles"] = ways | {"flight.through_buildings"}
        others["flight.through_buildings"] = ways | {"flight.obstacles"}
    return others


def without_none(value: Any, depth: int = 3, *, kept: bool = False) -> Any:
    """Tables, models and NumPy's values as plain data, without keys that are None unless kept."""
    if isinstance(value, MissionSection):
        return value.model_dump(mode="json", exclude_none=True)
    if depth and isinstance(value, Mapping):
        items = [(key, item) for key, item in value.items() if kept or item is not None]
        return {key: without_none(item, depth - 1, kept=kept) for key, item in items}
    if depth and isinstance(value, list | tuple):
        return [without_none(entry, depth - 1, kept=kept) for entry in value]
    return value.tolist() if hasattr(value, "tolist") else value


def _revised(base: Document, values: Mapping[str, object]) -> tuple[StatedMission, list[Fault]]:
    """Return a mission's document after changes by dotted key, not yet validated, and unknown keys.

    Values are put on top of the complete document; None removes a key, a table or a building.
    """
    kept, items = Document(), {name: Document() for name in LISTS}
    faults: list[Fault] = []
    named = ((k if isinstance(k, str) else shown(k), value) for k, value in values.items())
    plain = ((key, without_none(value, 2, kept=True)) for key, value in named)
    # Whole tables first, so that their keys can be stated beside them.
    for key, value in sorted(plain, key=lambda item: item[0].count(".")):
        name, _, field = key.partition(".")
        if listed_in := next((x for x in LISTS if key.startswith((f"{x}.", f"{x}["))), None):
            items[listed_in][key] = value
        elif unknown := [*unknown_names({key: value})]:
            faults += unknown
        else:
            kept[name] = {**keys_of(kept.get(name)), field: value} if field else value
    document, gone = overlay(base, kept)
    for key, changes in items.items():
        if not changes:
            continue
        listed = document.get(key)
        rows = listed.rows() if isinstance(listed, Buildings) else listed
        revised = list(rows) if isinstance(rows, list | tuple) else []
        faults += _revise_items(key, revised, changes)
        if revised:
            document[key] = [item for item in revised if item is not None]
        if isinstance(listed, Buildings) and len(revised) > fields.MOST_ITEMS:
            from optuav.mission.building_columns import row_by_row

            document["buildings"] = row_by_row(document["buildings"])
    return StatedMission(without_none(document), displaced=gone), faults


def unknown_names(values: Mapping[str, object]) -> Iterator[Fault]:
    """Yield a fault for each dotted key outside the buildings that no mission has."""
    whole = ("name", "description", "crs", *TABLES)
    for key, value in values.items():
        name, _, field = key.partition(".")
        if key not in whole and field not in validation.keys_in_file(name):
            keys = [*whole, *validation.dotted_keys(), *(f"devices.NAME.{x}" for x in OF_DEVICE)]
            yield Fault(key, shown(value), f"unknown key{nearest(key, keys)}")


def _revise_items(table: str, items: list[object], values: Document) -> Iterator[Fault]:
    """Apply values to a list in place; None takes the place of an item that is removed.

    Keys are ``buildings.b3``, ``buildings.b3.position_m`` or ``buildings[2].position_m``.
    """
    named = {f"{table}.{keys_of(item).get('name')}": n for n, item in enumerate(items)}
    places = {f"{table}[{n}]": n for n in range(len(items))} | named
    for key, value in values.items():
        item, _, field = (key, "", "") if key in places else key.rpartition(".")
        if item not in places:
            names = [name.removeprefix(f"{table}.") for name in named]
            yield Fault(key, shown(value), no_item(table, key, names))
            continue
        place, new = places[item], {field: value} if field else value
        items[place] = {**keys_of(items[place]), **new} if isinstance(new, dict) else new
