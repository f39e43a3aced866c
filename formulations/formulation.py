"""What a formulation is: a class with one method, `declare`."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Self

from formulations.available import LABELS, well_limits
from formulations.perspectives import AVAILABLE, PERSPECTIVES
from formulations.quantities import QUANTITIES, Quantities, steps_for, symbol_for
from optuav.errors import InputError
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

    def hover_and_rest(self, model: Model, label: str) -> tuple[Any, Any]:
        """Declare Δ and, where the route goes by way of a building, T'; else T' is None.

        Without a rest the time left is Δ's own bound, so that its last slot may be cut short; with
        one, `keep_deadline` states it. Of equal plans the one with the shortest rest is preferred.
        """
        if not self.rests:
            return model.variable(
                "hover_time_s", "Δ", unit="s", upper=self.time_left, label=label, kind="deadline"
            ), None
        hover = model.variable("hover_time_s", "Δ", unit="s", first_slot=1)
        rest = model.variable("rest_time_s", "T'", unit="s", first_slot=1)
        model.prefer_small(rest)
        return hover, rest

    def keep_deadline(self, model: Model, label: str, hover: Any, rest: Any) -> None:
        """State Δ + T' ≤ T_max − T_fl where there is a rest."""
        if rest is not None:
            model.subject_to(label, hover + rest <= self.time_left, unit="s", kind="deadline")

    def soc_end(self, hover: Any, rest: Any = None) -> Any:
        """State of charge at the end [-] after hovering and resting [s], by the perspective.

        Without a rest its current and power do not occur in the model.
        """
        if rest is None:
            return self._without_rest.soc_end(hover, 0.0)
        return PERSPECTIVES[self.perspective](self, hover, rest)

    @cached_property
    def _without_rest(self) -> Self:
        return replace(self, rest_current_A=0.0, rest_received_W=0.0)

    def keep_wells(self, model: Model, label: str, hover: Any, rest: Any = None) -> None:
        """State that the battery never runs dry nor is overcharged; in `available` only."""
        if self.perspective != AVAILABLE:
            return
        if rest is None:
            return self._without_rest.keep_wells(model, label, hover, 0.0)
        for kind, step, moment, relation in well_limits(self, hover, rest):
            name = f"{label} {LABELS[kind]}"
            model.subject_to(name, relation, kind=kind, step=step, moment=moment)

    @classmethod
    def model(cls, given: Quantities, perspective: str = "battery", **more: Any) -> Model:
        """The declared model, its parameters at the given values; further fields as they are.

        Raises
        ------
        InputError
            If no unknown or no objective is declared, or the perspective is `available` and the
            formulation does not call `keep_wells`.
        """
        symbols: dict[str, Any] = {
            each.name: symbol_for(each, getattr(given, each.name)) for each in QUANTITIES
        }
        declared = Model((cls.__doc__ or cls.__name__).strip().splitlines()[0].rstrip("."))
        kept: dict[str, Any] = {"steps": steps_for(given.steps)}
        kept |= {"rests": given.rests, "tapers": given.tapers}
        symbolic = cls(**symbols, **kept, perspective=perspective, **more)
        symbolic.declare(declared)
        if not declared.variables:
            raise InputError(f"{cls.__name__}: no unknown was declared; model.variable does")
        if not declared.has_objective:
            raise InputError(
                f"{cls.__name__}: no objective was stated; model.maximise or model.minimise does"
            )
        if perspective == AVAILABLE and not any(
            each.kind == "dry" for each in declared.constraints
        ):
            raise InputError(
                f"{cls.__name__} does not say when the battery must not run dry: call "
                "self.keep_wells(model, label, hover, rest) in declare, or take another perspective"
            )
        return declared
