"""What a formulation is: a class with one method, `declare`."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import Any

from formulations.perspectives import PERSPECTIVES
from formulations.quantities import QUANTITIES, Quantities, symbol_for
from optuav.modelling import Model


@dataclass(frozen=True, kw_only=True)
class Formulation(Quantities, ABC):
    """A problem over symbols: inside `declare`, every quantity is a named parameter.

    Parameters
    ----------
    perspective
        Name of the way in which the state of charge is written, see `PERSPECTIVES`.
    """

    perspective: str = "battery"

    @abstractmethod
    def declare(self, model: Model) -> None:
        """State unknowns, objective and constraints on the model."""

    def soc_end(self, hover: Any, rest: Any = None) -> Any:
        """State of charge at the end [-] after hovering and resting [s], by the perspective.

        Without a rest its current and power do not occur in the model.
        """
        if rest is None:
            without = replace(self, rest_current_A=0.0, rest_received_W=0.0)
            return without.soc_end(hover, 0.0)
        return PERSPECTIVES[self.perspective](self, hover, rest)

    @classmethod
    def model(cls, given: Quantities, perspective: str = "battery") -> Model:
        """The declared model, its parameters at the given values."""
        symbols = {each.name: symbol_for(each, getattr(given, each.name)) for each in QUANTITIES}
        declared = Model((cls.__doc__ or cls.__name__).strip().splitlines()[0].rstrip("."))
        cls(**symbols, perspective=perspective).declare(declared)
        return declared
