"""The mission as validated data: the task, the vehicle and the limits."""

from optuav.mission.load import json_schema, load, load_all, shipped
from optuav.mission.mission import Mission

__all__ = ["Mission", "json_schema", "load", "load_all", "shipped"]
