"""Plugins: installed packages that register flight models, beams, problems, engines and pictures.

A package names itself in its entry points of the group ``optuav.plugins``: each is a module whose
import registers things by `optuav.register`, or a function that does. The command line and the
processes that it starts read them when they begin.
"""

from functools import cache
from types import ModuleType

from optuav.errors import InputError

GROUP = "optuav.plugins"


@cache
def read_plugins() -> None:
    """Import the plugins that are installed, once; refused in words if one fails."""
    from importlib.metadata import entry_points

    for entry in entry_points(group=GROUP):
        try:
            loaded = entry.load()
            if not isinstance(loaded, ModuleType):
                loaded()
        except Exception as error:
            name = f"{entry.dist.name}, " if entry.dist else ""
            kind = "" if isinstance(error, InputError) else f"{type(error).__name__}: "
            words = f"plugin {entry.name} = {entry.value} ({name}entry point of {GROUP}) fails"
            words = f"{words}: {kind}{error}. Repair its package or uninstall it"
            raise InputError(words) from error
