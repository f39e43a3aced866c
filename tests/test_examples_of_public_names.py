"""Every public name explains itself by an example, and examples print what they show."""

from __future__ import annotations

import doctest
import importlib
import inspect
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import optuav
from optuav.calibration import FlightLog, Panel
from optuav.diagnosis import Repair
from optuav.diagnosis.key_prices import KeyPrice
from optuav.diagnosis.parameter_prices import Price
from optuav.diagnosis.report import Explanation
from optuav.engines.prices import Residuals, ShadowPrice, ShadowPrices
from optuav.engines.solution import Solution
from optuav.exercises import Grade, Task
from optuav.judge import Stop
from optuav.modelling import Check, Constraint
from optuav.modelling.expression import Let, Parameter, Variable
from optuav.network.timeline import Phase, PhaseStage
from optuav.paper.ledger import Ledger
from optuav.physics.kibam import Battery, Stage, Tilted, Wells
from optuav.plan.trace import FlightEvent, Trace
from optuav.solving.longest import Hovers
from optuav.solving.route_choice import RouteChoice
from optuav.studies.sweep import Swept

NAMES = [name for name in optuav.__all__ if name not in ("__version__", "city", "plots")]
ROOT = Path(__file__).parents[1]
MODULES = [
    ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
    for package in ("optuav", "formulations")
    for path in sorted((ROOT / package).rglob("*.py"))
    if ">>> " in path.read_text("utf-8")
]


@pytest.mark.parametrize("name", NAMES)
def test_a_public_name_has_an_example(name: str) -> None:
    """Its own docstring, not an inherited one, holds at least one line that runs."""
    assert ">>> " in inspect.cleandoc(getattr(optuav, name).__doc__ or "")


LISTED = re.findall(
    r"^   (optuav\..+)$", (ROOT / "docs" / "api.md").read_text("utf-8"), re.MULTILINE
)


@pytest.mark.parametrize("name", LISTED)
def test_a_name_of_the_reference_has_an_example(name: str) -> None:
    """The site promises one for each."""
    module, _, own = name.rpartition(".")
    assert ">>> " in inspect.cleandoc(getattr(importlib.import_module(module), own).__doc__ or "")


RECORDS: list[Any] = [
    *(
        Battery,
        Check,
        Constraint,
        FlightEvent,
        FlightLog,
        Explanation,
        Grade,
        Hovers,
        Ledger,
        Let,
        Panel,
        Parameter,
        Phase,
        PhaseStage,
    ),
    *(
        KeyPrice,
        Price,
        Repair,
        Residuals,
        RouteChoice,
        ShadowPrice,
        ShadowPrices,
        Solution,
        Stage,
        Stop,
        Swept,
        Task,
        Tilted,
        Trace,
    ),
    *(Variable, Wells, optuav.Datasheet, optuav.Fault, optuav.Itinerary, optuav.Plan),
    *(optuav.Program, optuav.Selection, optuav.Siting),
]


@pytest.mark.parametrize("record", RECORDS, ids=lambda each: each.__qualname__)
def test_help_explains_the_fields_of_what_users_hold(record: Any) -> None:
    """`help` shows docstrings, not the comments behind fields."""
    names = getattr(record, "model_fields", None) or inspect.signature(record).parameters
    assert [name for name in names if not re.search(rf"\b{name}\b", record.__doc__)] == []


@pytest.mark.parametrize(
    "function",
    [each for each in (getattr(optuav, name) for name in NAMES) if inspect.isfunction(each)],
    ids=lambda each: each.__name__,
)
def test_a_public_function_explains_its_own_parameters(function: Callable[..., Any]) -> None:
    """All by name, none by reference to another function."""
    text = inspect.cleandoc(function.__doc__ or "").partition("Parameters\n----------\n")[2]
    section = re.split(r"\n\n\w+\n---", text)[0]
    headings = re.findall(r"^\w.*", section, re.MULTILINE)
    named = {name for line in headings for name in line.split(", ")}
    assert set(inspect.signature(function).parameters) <= named
    assert not re.search(r"\bAs (for|from|in) `", section)


@pytest.mark.parametrize("module", MODULES)
def test_examples_print_what_they_show(module: str) -> None:
    """All of a module: of names that users call, and of those that only the house calls."""
    tried = doctest.testmod(importlib.import_module(module))
    assert tried.attempted > 0
    assert tried.failed == 0
