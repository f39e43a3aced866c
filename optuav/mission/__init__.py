"""The mission: what is to be flown, with what, and within which limits, as validated data.

`load` reads a shipped mission (`shipped` names them) or a TOML file into a `Mission`;
`json_schema` describes such files to an editor.
"""

from optuav.mission.editors import json_schema
from optuav.mission.load import load, shipped
from optuav.mission.schema import Mission

__all__ = ["Mission", "json_schema", "load", "shipped"]
