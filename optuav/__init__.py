"""Optimise missions of laser-charged drones, with proof, and check their plans.

The public names load on first use, so that importing the package is quick.
"""

import os
import re
from importlib import import_module
from importlib.util import find_spec
from typing import Any

with open(os.path.join(os.path.dirname(__file__), "__init__.pyi"), encoding="utf-8") as _stub:
    HOMES = {
        name: module
        for module, name in re.findall(r"^from (\S+) import (\w+)", _stub.read(), re.MULTILINE)
    }
"""Module that defines each public name."""

_FOUND = find_spec("formulations")
_FOLDERS = (_FOUND and _FOUND.submodule_search_locations) or ()
if not any(os.path.exists(os.path.join(folder, "formulation.py")) for folder in _FOLDERS):
    raise ImportError(
        f"{_FOUND.origin if _FOUND else 'nothing'} is found as 'formulations', and hides the "
        "package of this name that comes with optuav: rename it, or work in another folder"
    )

__all__ = ["__version__", *sorted(HOMES)]  # noqa: PLE0604


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import PackageNotFoundError, version

        try:
            return version("optuav")
        except PackageNotFoundError:  # a checkout on the path
            return "not installed"
    if HOMES.get(name, "optuav") == "optuav":
        # Also the packages behind the public names, which else were there once they are used.
        if name.startswith("_") or find_spec(f"optuav.{name}") is None:
            raise AttributeError(f"module 'optuav' has no attribute {name!r}")
        return import_module(f"optuav.{name}")
    value = getattr(import_module(HOMES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__
