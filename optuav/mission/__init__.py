"""The mission as validated data: what is to be flown, with what, and within which limits."""

from optuav.mission.load import json_schema, load, load_all, shipped
from optuav.mission.mission import Mission

__all__ = ["Mission", "json_schema", "load", "load_all", "shipped"]
