"""An editor completes every figure of a result: no field and no method of one is `Any`."""

from __future__ import annotations

import ast
import importlib
import inspect
import pkgutil
import sys
import typing
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any

import networkx
import numpy as np
import numpy.typing as npt

import formulations
import optuav
from optuav.presentation.presented import Presented
from optuav.studies.compare import compare

OURS = ("optuav.", "formulations.")
NO_RESULTS = (
    *("formulations.", "optuav.physics.", "optuav.flight.", "optuav.laser.", "optuav.network."),
    *("optuav.modelling.expression", "optuav.modelling.model", "optuav.modelling.walk"),
    *("optuav.mission.", "optuav.tables", "optuav.fields", "optuav.solving.route_models"),
    *(f"optuav.engines.{name}" for name in ("registry", "bracket", "closed_form", "grid")),
    *(f"optuav.engines.{name}" for name in ("casadi_engine", "cvxpy_engine", "pyomo_engine")),
)
"""Modules of missions, models, problems and engines: formulas take numbers, arrays or symbols."""


@cache
def modules() -> tuple[ModuleType, ...]:
    """All modules of both packages; those whose libraries are missing are left out."""
    read = list[ModuleType]()
    for package in (optuav, formulations):
        for found in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            if not found.name.endswith("__main__") and ".lessons" not in found.name:
                try:
                    read.append(importlib.import_module(found.name))
                except ImportError:
                    continue
    return tuple(read)


@cache
def names_for_checkers() -> dict[str, Any]:
    """What modules import for type checkers only, by name, and aliases that are strings."""
    import pandas

    names: dict[str, Any] = {"Graph": networkx.DiGraph, "DataFrame": pandas.DataFrame}
    for module in modules():
        text = Path(str(module.__file__)).read_text("utf-8")
        body = ast.parse(text).body if "\nif TYPE_CHECKING" in text else []
        guarded = [node for node in body if isinstance(node, ast.If) and _is_guard(node.test)]
        for statement in (statement for node in guarded for statement in node.body):
            if isinstance(statement, ast.ImportFrom):
                home = importlib.import_module(str(statement.module))
                names |= {n.asname or n.name: getattr(home, n.name) for n in statement.names}
            elif isinstance(statement, ast.Import):
                for alias in statement.names:
                    importlib.import_module(alias.name)
                    top = alias.name.partition(".")[0]
                    names[alias.asname or top] = sys.modules[alias.name if alias.asname else top]
    return names


def _is_guard(test: ast.expr) -> bool:
    return isinstance(test, ast.Name) and test.id == "TYPE_CHECKING"


def types_of(owner: Any, annotations: dict[str, Any]) -> dict[str, Any]:
    """Annotations as types."""
    holder = type("Holder", (), {"__annotations__": annotations, "__module__": owner.__module__})
    known = vars(sys.modules[owner.__module__]) | names_for_checkers()
    return typing.get_type_hints(holder, known)


def has_any(kind: Any) -> bool:
    """Whether a type is `Any` or holds it; the shape of an array is nobody's promise."""
    if kind == npt.ArrayLike:
        return False
    if typing.get_origin(kind) is np.ndarray:
        return has_any(typing.get_args(kind)[1])
    if isinstance(kind, list | tuple):
        return any(map(has_any, kind))
    return kind is Any or any(map(has_any, typing.get_args(kind)))


def classes_in(kind: Any) -> Iterator[type]:
    """Our classes that a type names."""
    if inspect.isclass(kind) and kind.__module__.startswith(OURS):
        yield kind
    for part in kind if isinstance(kind, list | tuple) else typing.get_args(kind):
        yield from classes_in(part)


def members(owner: type) -> Iterator[tuple[str, dict[str, Any]]]:
    """Public fields of a class and of its bases of ours, and the signatures of its methods."""
    for base in (base for base in owner.__mro__ if base.__module__.startswith(OURS)):
        own = inspect.get_annotations(base)
        yield "", types_of(base, {n: kind for n, kind in own.items() if not n.startswith("_")})
        for name, value in vars(base).items():
            function = getattr(value, "fget", None) or getattr(value, "func", None)
            function = function or getattr(value, "__func__", value)
            is_public = not name.startswith("_") or name == "__getitem__"
            if is_public and isinstance(function, FunctionType):
                yield f"{name}: ", types_of(function, inspect.get_annotations(function))


@cache
def results() -> tuple[type, ...]:
    """What public functions return, what shows itself by blocks, and all that these have."""
    public = [getattr(optuav, name) for name in optuav.HOMES]
    ahead = [thing for thing in public if inspect.isclass(thing)]
    for function in filter(inspect.isfunction, public):
        returned = inspect.get_annotations(function).get("return")
        ahead += classes_in(types_of(function, {"return": returned})["return"])
    ahead.append(Presented)
    seen = dict[type, None]()
    while ahead:
        each = ahead.pop()
        if each in seen or f"{each.__module__}.".startswith(NO_RESULTS):
            continue
        seen[each] = None
        ahead += (kind for kind in each.__subclasses__() if kind.__module__.startswith(OURS))
        ahead += classes_in([*getattr(each, "__orig_bases__", ())])  # Such as a tuple of checks
        ahead += (kind for _, found in members(each) for kind in classes_in([*found.values()]))
    return tuple(seen)


def test_no_field_and_no_method_of_a_result_is_any() -> None:
    untyped = {
        f"{each.__name__}.{member}{name}"
        for each in results()
        for member, found in members(each)
        for name, kind in found.items()
        if has_any(kind)
    }
    assert untyped == set()


def test_the_results_are_found() -> None:
    """The search above reaches results of every room, rows and checks among them."""
    names = {each.__name__ for each in results()}
    assert {"Plan", "Replay", "Coverage", "Event", "Fleet", "RobustPlan", "Siting"} <= names
    assert {"MethodComparison", "PlanAnswer", "Swept", "Check", "Program", "Fit"} <= names


def test_each_comparison_has_the_type_of_its_rows() -> None:
    """An editor knows the entries of a row by what is compared, for every kind that there is."""
    types = [
        types_of(kind, inspect.get_annotations(kind)) for kind in typing.get_overloads(compare)
    ]
    assert {
        name: [kinds["return"].__name__ for kinds in types if f"'{name}'" in str(kinds["by"])]
        for name in ("method", "perspective", "trajectory", "schedule", "speed")
    } == {
        "method": ["MethodComparison"],
        **{name: ["PlanComparison"] for name in ("perspective", "trajectory", "schedule")},
        "speed": ["SpeedComparison"],
    }


def test_any_is_seen_wherever_it_hides() -> None:
    assert has_any(dict[str, Any])
    assert has_any(npt.NDArray[Any])
    assert has_any(typing.Callable[[Any], int])
    assert not has_any(npt.NDArray[np.float64])
