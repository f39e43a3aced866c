"""Mission files in TOML: read with the files that they extend, and the schema for editors."""

import json
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

from optuav.errors import Fault, InputError, collected, safe_name
from optuav.mission.files import STANDARD, label, parse_toml, read_toml, refusal, resolve_from
from optuav.mission.messages import nearest, of_kind, shown
from optuav.mission.mission import Mission, overlay
from optuav.mission.validation import Document, Key, StatedMission, format_breaches, validate
from optuav.options import SET

MOST_NAMED = 10  # Devices that a message names
LONGEST_CHAIN = 32  # Most files that may extend one another

_HERE = Path(__file__).parent
SHIPPED = dict(sorted((path.stem, path) for path in (_HERE / "shipped").iterdir()))
"""The missions that come with the package, by name."""


def load(source: Mission | str | Path) -> Mission:
    """Read a mission.

    Parameters
    ----------
    source
        Name of a shipped mission (`shipped` lists them) or of one of the benchmark set, such as
        ``"set/town-1000-a"``; or path of a TOML file; a mission is returned unchanged. A file that
        ``extends`` another (a shipped name or a path relative to the file) inherits all keys that
        it does not set itself, except name and description; `Mission.replace` lists the keys that a
        new value removes. `load` also reads the tables that a file names as ``buildings_file`` and
        ``devices_file``, by paths relative to the file. A mission without a name gets the name of
        its file.

    Raises
    ------
    InputError
        With every fault of the file, of the files that it extends, and of its tables.

    Examples
    --------
    >>> import optuav
    >>> mission = optuav.load("paper")
    >>> mission.limits.deadline_s
    1200.0
    >>> optuav.load("papr")
    Traceback (most recent call last):
    optuav.errors.InputError: papr: there is no such file; did you mean 'paper'?
    """
    if isinstance(source, Mission):
        return source
    of_kind("mission", source, str | Path, "a shipped mission's name or a file's path")
    if isinstance(source, str) and source.startswith(SET):
        from optuav.mission.benchmark import recipe_of

        recipe = recipe_of(source)
        return recipe.mission(_shipped(recipe.extends))
    return (_shipped if source in SHIPPED else _loaded)(source)


def load_one_device(source: Mission | str | Path, question: str) -> Mission:
    """Read a mission for a question that is answered for one device only."""
    mission = load(source)
    if mission.devices:
        names = ", ".join(safe_name(device.name) for device in mission.devices[:MOST_NAMED])
        words = f"one device for {question}"
        raise InputError([Fault("devices", names, words)])
    return mission


def _loaded(source: str | Path) -> Mission:
    """The mission of a file."""
    content, faults, whole = _read(source, Path(), {})
    return validate(Mission, content, faults, whole=whole)


def must_load(text: str, file: Path) -> None:
    """Refuse the text of a mission that could not be loaded from its file."""
    content, faults, whole = _joined(parse_toml(text, label(file)), file, label(file), {})
    validate(Mission, content, faults, whole=whole)


def is_name(source: str) -> bool:
    """Return whether a string names a mission of the package, and is not a path."""
    return source in SHIPPED or source.startswith(SET)


_shipped = cache(_loaded)  # Nothing changes a mission, nor a file of the package


def load_all(missions: Any, faults: list[Fault]) -> list[Mission]:
    """Load one mission or several; append their faults to `faults`."""
    single = isinstance(missions, Mission | str | Path | dict) or not isinstance(missions, Iterable)
    loaded = list[Mission]()
    for mission in [missions] if single else missions:
        with collected(faults):
            loaded.append(load(mission))
    return loaded


def shipped() -> tuple[str, ...]:
    """Names of the missions that come with the package, in alphabetical order.

    Examples
    --------
    >>> import optuav
    >>> optuav.shipped()
    ('matrice350', 'paper', 'paper-drag', 'paper-table2', 'relay-today', 'three-sensors')
    """
    return tuple(SHIPPED)


def json_schema() -> Document:
    """JSON Schema (draft 7) of the files that `load` reads.

    A file without ``extends`` must contain every required key; a file with it needs only
    ``schema``. `load` checks the rules between values (names, footprints, altitudes, loads of the
    flight models).

    Examples
    --------
    >>> import optuav
    >>> schema = optuav.json_schema()
    >>> schema["definitions"]["Limits"]["properties"]["deadline_s"]["maximum"]
    10000000.0
    """
    schema: Document = json.loads((_HERE / "mission.schema.json").read_text("utf-8"))
    return schema


def _read(
    source: str | Path, directory: Path, above: dict[str, str]
) -> tuple[StatedMission, list[Fault], bool]:
    """Read a shipped mission or a file, on top of the mission that it extends.

    With the faults of both, and whether all could be read; `above` are the files that extend it.
    """
    if len(above) == LONGEST_CHAIN:
        raise InputError(f"a chain of at most {LONGEST_CHAIN} files")
    if path := SHIPPED.get(str(source)) if isinstance(source, str) else None:
        name, hint = str(source), ""
    else:
        path = resolve_from(directory, source)
        name = label(path)
        hint = nearest(path.name, SHIPPED) or f"; shipped missions are {', '.join(SHIPPED)}"
    document = read_toml(path, hint=hint)
    if {"mission", "stops"} <= document.keys():
        raise refusal(path, "is an itinerary, not a mission: use optuav audit")
    return _joined(document, path, name, above)


def _read_table(document: Document, table: str, folder: Path, source: str) -> Iterator[Fault]:
    """Put the rows of a table's own file into a document; yield what is wrong with the file."""
    key = f"{table}_file"
    if (named := document.pop(key, None)) is None:
        return
    from optuav.mission.device_tables import read_devices
    from optuav.mission.table_files import read_buildings

    read: Mapping[str, Callable[[Path], Any]] = {
        "buildings": read_buildings,
        "devices": read_devices,
    }
    try:
        if not isinstance(named, str) or table in document:
            raise InputError(f"a path relative to this file, and no [[{table}]] beside it")
        document[table] = read[table](resolve_from(folder, named))
    except InputError as error:
        for fault in error.faults:
            words = f"the file {fault}" if fault.source else str(fault)
            yield fault if fault.key else Fault(key, shown(named), words, source)


def _joined(
    document: Document, path: Path, name: str, above: dict[str, str]
) -> tuple[StatedMission, list[Fault], bool]:
    """Put the content of a file on top of the mission that it extends, see `_read`."""
    real = os.path.realpath(path)
    if real in above:
        circle = " -> ".join([*above.values(), name])
        raise InputError(f"a file that does not lead back to one before it: {circle}")
    faults = StatedMission(document, {(): name}).faults(format_breaches(document))
    document.pop("schema", None)
    extends, whole = document.pop("extends", None), True
    for key in ("name", "description") if above else ():  # which are a file's own
        document.pop(key, None)
    for table in ("buildings", "devices"):
        faults += _read_table(document, table, path.parent, name)
    sources: dict[Key, str] = {(): name}
    for table, keys in document.items():
        inside = keys if isinstance(keys, dict) else ()
        sources |= dict.fromkeys([(table,), *((table, key) for key in inside)], name)
    content = StatedMission(document, sources)
    if extends is not None:
        try:
            if not isinstance(extends, str):
                raise InputError("a shipped mission's name or a path relative to this file")
            below, more, whole = _read(extends, path.parent, {**above, real: name})
        except InputError as error:
            words = "; ".join(str(error).splitlines())
            return content, [Fault("extends", shown(extends), words, name), *faults], False
        faults += more
        document, gone = overlay(below.document, document)
        content = StatedMission(document, {**below.sources, **sources}, {**below.displaced, **gone})
    if not above and "name" not in document:
        document["name"] = "mission" if path == STANDARD else safe_name(path.stem)
    return content, faults, whole
