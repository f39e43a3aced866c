"""Pictures of plans that come from outside the package."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypeAlias

if TYPE_CHECKING:
    from optuav.plan.plan import Plan

Picture: TypeAlias = Callable[["Plan"], Any]
"""A function of a plan that returns its axes, as the functions of `optuav.plots` do."""

OF_THE_PACKAGE = ("map", "wells", "packs", "leg")
PICTURES: dict[str, Picture] = {}
"""Pictures by name that are saved beside those of the package, see `optuav.register`."""
