"""The format of a mission file as a JSON Schema, for editors that complete and check TOML."""

from __future__ import annotations

from typing import Any

from pydantic.json_schema import models_json_schema
