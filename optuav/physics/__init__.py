"""Physics of the mission as plain functions, which know no model and no mission.

They take floats, NumPy arrays (which broadcast) and symbols of the modelling layer alike, unless
their docstring says floats and arrays. Where an element is impossible, the result is NaN there.
"""

from collections.abc import Callable
from importlib import import_module
from importlib.util import find_spec
from types import ModuleType


def lazy_submodules(package: str) -> Callable[[str], ModuleType]:
    """A `__getattr__` that loads modules on first use: reading a mission needs no NumPy."""

    def module(name: str) -> ModuleType:
        if name.startswith("_") or find_spec(f"{package}.{name}") is None:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        return import_module(f"{package}.{name}")

    return module


__getattr__ = lazy_submodules(__name__)
