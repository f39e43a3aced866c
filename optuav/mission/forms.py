"""The forms of tables: [flight] has one for every flight model, [laser] one for every beam."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated

from pydantic import GetPydanticSchema, WithJsonSchema
from pydantic_core.core_schema import no_info_plain_validator_function

from optuav import tables
from optuav.fields import MissionSection
from optuav.flight import FLIGHTS
from optuav.flight.model import FlightModel, FlightTable
from optuav.laser import BEAMS
from optuav.laser.beam import Beam, LaserTable
from optuav.laser.fits import Laser

SCHEMA = 1  # Version of the format of a mission file

SECTIONS: dict[str, type[MissionSection]] = {
    "route": tables.RouteEnds,
    "limits": tables.Limits,
    "battery": tables.BatteryPacks,
    "start": tables.Start,
    "rotor": tables.Rotor,
    "body": tables.Body,
    "air": tables.Air,
    "earth": tables.Earth,
    "laser": Laser,
    "receiver": tables.LightReceiver,
    "link": tables.Link,
    "wind": tables.Wind,
    "devices": tables.Device,
    "buildings": tables.Building,
}
"""The tables of a mission file but [flight]; [laser] has more forms, one for every beam."""


@dataclass(frozen=True)
class KeyedForms:
    """A table with a key that names a model, and a form for each."""

    key: str
    models: Mapping[str, type[FlightModel] | type[Beam]]
    plain: type[MissionSection] | None = None  # Form without the key, if it is not the first of all

    def forms(self) -> list[type[MissionSection]]:
        """All forms, that without the key first."""
        return [*filter(None, (self.plain,)), *(model.table for model in self.models.values())]

    def is_misspelt(self, stated: object) -> bool:
        """Whether a table states a model that does not exist."""
        name = stated.get(self.key) if isinstance(stated, dict) else None
        return name is not None and name not in [*self.models]

    def form_of(self, stated: object) -> type[MissionSection]:
        """The form that is meant; of a misspelt model, the one with most of the keys."""
        keys = stated if isinstance(stated, dict) else {}
        if (name := keys.get(self.key)) is None:
            return self.forms()[0]
        if not self.is_misspelt(keys):
            return self.models[name].table
        tables = self.forms()[self.plain is not None :]
        return max(tables, key=lambda form: len(keys.keys() & form.model_fields.keys()))

    def table(self, stated: object) -> MissionSection:
        """A table of the form that is meant."""
        if isinstance(stated, MissionSection):
            return stated
        return self.form_of(stated).model_validate(stated)

    def models_with(self, key: str) -> list[str]:
        """Names of the models whose form has a key."""
        return [name for name, model in self.models.items() if key in model.table.model_fields]


CHOICES = {"flight": KeyedForms("model", FLIGHTS), "laser": KeyedForms("beam", BEAMS, Laser)}
"""Tables whose form a key chooses."""

_OBJECT = WithJsonSchema({"type": "object"})


def _form(table: str) -> GetPydanticSchema:
    """The schema of a table in any of its forms, which keeps all keys of its own when saved."""
    validate = CHOICES[table].table
    return GetPydanticSchema(lambda *_: no_info_plain_validator_function(validate))


Flight = Annotated[FlightTable, _form("flight"), _OBJECT]
"""Any form of [flight]."""
Source = Annotated[LaserTable, _form("laser"), _OBJECT]
"""Any form of [laser]."""

LISTS = ("devices", "buildings")  # Tables of a mission file that are there several times
SINGLE = (*(name for name in SECTIONS if name not in LISTS), "flight")
TABLES = (*SINGLE, *LISTS)  # Tables of a mission file, in order


def forms(table: str) -> tuple[type[MissionSection], ...]:
    """The forms that a table of a mission may have; none for other names."""
    if table in CHOICES:
        return tuple(CHOICES[table].forms())
    return (SECTIONS[table],) if table in SECTIONS else ()


def table_keys(table: str) -> dict[str, type[MissionSection]]:
    """The keys of a table of the mission, each with the first form that has it."""
    form_by_key: dict[str, type[MissionSection]] = {}
    for form in forms(table):
        form_by_key = {**dict.fromkeys(form.model_fields, form), **form_by_key}
    return form_by_key
