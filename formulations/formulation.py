"""What a formulation is: a class whose fields are its options, with one method, `declare`."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

from formulations.given import Given
from formulations.parameters import Quantities
from formulations.soc import AVAILABLE
from optuav.errors import InputError
from optuav.modelling import Model
from optuav.options import Order, Perspective


@dataclass(frozen=True, kw_only=True)
class Formulation(ABC):
    """A problem over the quantities of an itinerary; subclass it and write `declare`.

    The problem is declared once for the direct route and, where it declares a rest, once for the
    routes by way of a building. Fields of its own make a subclass a dataclass.

    Parameters
    ----------
    building
        Name of the building to go by way of; None for all routes.
    order
        ``"rest-first"``, ``"hover-first"``, or None for the better of the two.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> import optuav
    >>> @dataclass(frozen=True)
    ... class LeastRest(optuav.Formulation):
    ...     '''Least rest for a wanted hover time.'''
    ...     wanted_hover_s: float
    ...     def declare(self, model, given):
    ...         hover, rest = given.hover_and_rest(model)
    ...         model.minimise(rest)
    ...         model.subject_to("wanted hover", hover >= self.wanted_hover_s, unit="s")
    ...         model.subject_to("charge", given.soc_end(hover, rest) >= given.min_soc)
    ...         given.keep_wells(model, "charge", hover, rest)
    ...         given.keep_deadline(model, "deadline", hover, rest)
    >>> plan = optuav.solve("paper", LeastRest(700), perspective="battery")
    >>> f"{plan.rest_time_s:.1f} s at {plan.route[1]}"
    '220.4 s at b1'
    """

    building: str | None = None
    order: Order | None = None

    @property
    def name(self) -> str:
        """Name of the problem for a reader."""
        return type(self).__name__

    @property
    def title(self) -> str:
        """What is sought, in a line: the first of the docstring."""
        return (type(self).__doc__ or self.name).strip().splitlines()[0].rstrip(".")

    @abstractmethod
    def declare(self, model: Model, given: Given) -> None:
        """State unknowns, objective and constraints on the model."""

    def model(self, quantities: Quantities, perspective: Perspective = "battery") -> Model:
        """The declared model, with the quantities of some itineraries for its parameters.

        Raises
        ------
        InputError
            If no unknown or no objective is declared, or the perspective is `available` and
            `given.keep_wells` is not called.
        """
        model = Model(self.title)
        self.declare(model, Given.of(quantities, perspective))
        if not model.variables:
            raise InputError(f"{self.name}: no unknown was declared; model.variable does")
        if not model.has_objective:
            raise InputError(
                f"{self.name}: no objective was stated; model.maximise or model.minimise does"
            )
        if perspective == AVAILABLE and not any(each.kind == "dry" for each in model.constraints):
            raise InputError(
                f"{self.name} does not say when the battery must not run dry: call "
                "given.keep_wells(model, label, hover, rest) in declare, or take another "
                "perspective"
            )
        return model
