"""The base class of beams: the light that arrives, by position."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from optuav.mission.mission import Mission
    from optuav.physics.quantity import Quantity, Vector


class Beam(ABC):
    """How much of the laser's light becomes electric power at a place.

    A beam is one class in one file. Its quantities may be numbers, arrays or symbols, as in
    `optuav.physics`.

    Parameters
    ----------
    mission
        A mission with a laser, whose tables hold the figures of the beam.
    """

    def __init__(self, mission: Mission) -> None:
        self.mission = mission

    @abstractmethod
    def received_W(self, source_m: Vector, place_m: Vector, most_W: Quantity) -> Quantity:
        """Mean power received in clear sight [W] where the battery takes at most so much [W]."""
