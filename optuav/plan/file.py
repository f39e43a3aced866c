"""Plans read from JSON files."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from optuav.errors import Fault, InputError
from optuav.mission import Mission
from optuav.mission.files import label, read_text
from optuav.mission.messages import safe_name, shown
from optuav.mission.schema import short
from optuav.plan.plan import DERIVED, KIND, SCHEMA, Plan

LARGEST_BYTES = 200_000_000

TYPES = {
    "float_type": "a number",
    "finite_number": "a finite number",
    "string_type": "a string",
    "bool_type": "true or false",
    "tuple_type": "a list",
    "dict_type": "an object",
    "dataclass_type": "an object",
}
"""What a value may be, by pydantic's name of its error."""


def load_plan(path: str | Path) -> Plan:
    """Read a plan that `Plan.save` wrote; the round trip is exact.

    Parameters
    ----------
    path
        A JSON file, up to 200 MB.

    Returns
    -------
    Plan
        The plan, its mission inside.

    Raises
    ------
    InputError
        With everything that is wrong with the file.

    Examples
    --------
    >>> import optuav, tempfile
    >>> plan = optuav.solve("paper", "P3", perspective="available")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     plan.save(f"{folder}/plan.json")
    ...     optuav.load_plan(f"{folder}/plan.json") == plan
    True
    """
    source = label(Path(path))
    plan, data = parse_plan(read_text(Path(path), LARGEST_BYTES), source)
    follows = plan.to_dict()
    faults = [
        Fault(name, shown(data[name]), f"{shown(follows[name])} is what the phases say", source)
        for name in DERIVED
        if name in data and data[name] != follows[name]
    ]
    if faults:
        raise InputError(faults)
    return plan


def parse_plan(text: str, source: str) -> tuple[Plan, dict[str, Any]]:
    """A plan and the data of its file, whose repeated figures may contradict the plan.

    Raises `InputError` with everything that keeps the text from being a plan.
    """
    try:
        data = json.loads(text, parse_constant=_no_constant)
    except (ValueError, RecursionError) as error:
        raise InputError([Fault("", "", f"is not JSON: {_first_line(error)}", source)]) from None
    if not isinstance(data, dict) or "kind" not in data:
        raise InputError([Fault("", "", f'is no plan: "kind": "{KIND}" is missing', source)])
    if data["kind"] != KIND:
        raise InputError([Fault("kind", shown(data["kind"]), f'"{KIND}"', source)])
    if data.get("schema") != SCHEMA:
        value = shown(data["schema"]) if "schema" in data else ""
        words = f"{SCHEMA} is the only version that is read"
        raise InputError([Fault("schema", value, words, source)])
    return _plan(data, source), data


def _no_constant(name: str) -> float:
    raise ValueError(f"{name} is no JSON number")


def _first_line(error: Exception) -> str:
    return "it is nested too deeply" if isinstance(error, RecursionError) else str(error)


def _plan(data: dict[str, Any], source: str) -> Plan:
    fields = {k: v for k, v in data.items() if k not in ("schema", "kind", "mission", *DERIVED)}
    faults: list[Fault] = []
    if "mission" in data:
        try:
            fields["mission"] = Mission.from_dict(data["mission"])
        except InputError as error:
            fields["mission"] = None
            faults += [
                Fault(f"mission.{each.key}".rstrip("."), each.value, each.allowed, source)
                for each in error.faults
            ]
    known = {"mission"} if faults else set()
    try:
        plan = Plan.model_validate(fields)
    except ValidationError as error:
        faults += [each for each in _record_faults(error, source) if each.key not in known]
    if faults:
        raise InputError(faults)
    return plan


def _record_faults(error: ValidationError, source: str) -> Iterator[Fault]:
    """What is wrong with the data of a plan, by dotted key.

    For pydantic a list with wrong entries is too short as well; the entries alone are reported.
    """
    details = error.errors(include_url=False)
    above = {detail["loc"][:depth] for detail in details for depth in range(1, len(detail["loc"]))}
    for detail in details:
        if detail["loc"] in above:
            continue
        key = ".".join(safe_name(part) for part in detail["loc"])
        value = "" if detail["type"] == "missing" or not key else shown(detail["input"])
        yield Fault(key, value, _allowed(detail), source)


def _allowed(detail: ErrorDetails) -> str:
    """What is allowed where pydantic found an error."""
    known = detail.get("ctx", {})
    match detail["type"]:
        case "missing":
            return "is missing"
        case "extra_forbidden" | "unexpected_keyword_argument":
            return "unknown key"
        case "greater_than_equal":
            return f"a number, x >= {short(known['ge'])}"
        case "less_than_equal":
            return f"a number, x <= {short(known['le'])}"
        case "literal_error" | "enum":
            return str(known["expected"])
        case "too_short":
            return "a list that is not empty"
        case "value_error":
            return str(known["error"])
        case kind:
            return TYPES.get(kind, detail["msg"])
