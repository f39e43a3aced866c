"""The mission: validated data that never changes."""

from __future__ import annotations

import re
from collections.abc import Mapping
from itertools import islice
from pathlib import Path
from typing import Annotated, Self

import tomli_w
from pydantic import BeforeValidator, Strict, model_validator

from optuav.errors import MOST_SHOWN, Fault, InputError
from optuav.mission.files import write_text
from optuav.mission.messages import Document, StatedMission, shown
from optuav.mission.overlay import revise, without_none
from optuav.mission.schema import (
    SCHEMA,
    Allowed,
    BatteryPacks,
    Body,
    Building,
    Description,
    Flight,
    Laser,
    Limits,
    Link,
    Listed,
    MissionSection,
    Name,
    Rotor,
    RotorFlight,
    RouteEnds,
    Wind,
)
from optuav.mission.validation import format_breaches, rules, validate

MOST_BUILDINGS = 100_000
"""Most buildings that a mission may have."""


def _few(buildings: object) -> object:
    """The buildings; too many are refused before any of them is validated."""
    if isinstance(buildings, list | tuple) and len(buildings) > MOST_BUILDINGS:
        raise ValueError(f"more than {MOST_BUILDINGS} buildings")
    return buildings


class Mission(MissionSection):
    """A mission of a laser-charged UAV; every attribute has the name of its key in a file.

    Missions are equal if all their values are, can be hashed and pickled, and change only by
    `replace`, which makes a new one. `load`, `from_dict` and `replace` raise
    `optuav.errors.InputError` with all faults; the constructor raises pydantic's own error.

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

    name: Name = "mission"
    """Name of the mission; by default that of its file."""
    description: Description = ""
    """What the mission is about."""
    route: RouteEnds
    limits: Limits
    battery: BatteryPacks
    rotor: Rotor | None = None
    body: Body | None = None
    laser: Laser | None = None
    link: Link
    wind: Wind = Wind()
    flight: Flight = RotorFlight()
    buildings: Annotated[
        tuple[Building, ...],
        Strict(),
        Listed,
        BeforeValidator(_few),
        Allowed(f"up to {MOST_BUILDINGS} tables [[buildings]] with name, position_m"),
    ] = ()

    @model_validator(mode="after")
    def _rules(self) -> Self:
        document: Document = {
            name: _stated(value) if isinstance(value, MissionSection) else value
            for name, value in _stated(self).items()
        }
        document["buildings"] = [_stated(building) for building in self.buildings]
        if breaches := list(islice(rules(document, document), MOST_SHOWN)):
            raise InputError(StatedMission(document).faults(breaches))
        return self

    def replace(self, values: Mapping[str, object]) -> Self:
        """Make a mission that differs in some values.

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
            battery, a new ``flight.model`` the loads of the other one.

        Returns
        -------
        Mission
            The new mission, validated as a whole.

        Raises
        ------
        InputError
            With every fault, unknown keys among them.
        """
        if not isinstance(values, Mapping):
            raise InputError([Fault("", shown(values), "values by dotted key in a dict")])
        stated, faults = revise(self.model_dump(mode="json", exclude_none=True), values)
        return validate(type(self), stated, faults)

    def to_dict(self) -> Document:
        """Every value as plain data, as a file without ``extends`` states it.

        Returns
        -------
        dict
            Strings, numbers, truth values, lists and dicts; optional keys that are not set are
            left out.
        """
        return {"schema": SCHEMA, **self.model_dump(mode="json", exclude_none=True)}

    @classmethod
    def from_dict(cls, document: Mapping[str, object]) -> Self:
        """Make a mission of plain data.

        Parameters
        ----------
        document
            As `to_dict` gives it; None counts as not stated.

        Returns
        -------
        Mission
            The mission.

        Raises
        ------
        InputError
            With every fault.
        """
        if not isinstance(document, Mapping):
            raise InputError([Fault("", shown(document), "a mission as a dict")])
        stated = without_none(document)
        faults = StatedMission(stated).faults(format_breaches(stated))
        stated.pop("schema", None)
        return validate(cls, StatedMission(stated), faults)

    def save(self, path: str | Path) -> None:
        """Write the mission as a complete TOML file, whole or not at all.

        Parameters
        ----------
        path
            The file; what is there is replaced.

        Raises
        ------
        InputError
            If the directory is missing or cannot be written to.
        """
        text = tomli_w.dumps(self.to_dict())
        # Each array on one line; strings are safe, as their line breaks are written escaped.
        for pattern, joint in ((r"\[\n +", "["), (r",\n *\]", "]"), (r",\n +", ", ")):
            text = re.sub(pattern, joint, text)
        write_text(Path(path), text)


def _stated(section: MissionSection) -> Document:
    """The keys of a section that are set, with their values."""
    return {key: item for key, item in vars(section).items() if item is not None}
