"""All packs of an itinerary as one battery, for formulations that follow its wells."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

from formulations.quantities import Quantities
from optuav.modelling import Expression, Let
from optuav.physics import kibam


@dataclass(frozen=True)
class Pool(kibam.Battery):
    """All packs as one battery, the rate at which its wells level out known by a name."""

    @cached_property
    def rate_per_s(self) -> Any:
        """k' [1/s]; a number stays one."""
        rate = super().rate_per_s
        named = isinstance(rate, Expression)
        return Let("levelling rate", "k'", "1/s", rate) if named else rate


def pool(given: Quantities) -> kibam.Battery:
    """The battery of an itinerary."""
    return Pool(given.battery_As, given.available_fraction, given.flow_rate_per_s)
