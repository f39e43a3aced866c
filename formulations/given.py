"""What a formulation is given: the quantities of an itinerary as symbols, and what they imply."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Self

import numpy as np

from formulations.parameters import QUANTITIES, Quantities, steps_for, symbol_for
from formulations.soc import AVAILABLE, PERSPECTIVES
from formulations.wells import LABELS, well_limits
from optuav.modelling import Expression, Model, Variable
from optuav.modelling.expression import Operand
from optuav.modelling.traversal import has_unknowns
from optuav.options import Perspective


@dataclass(frozen=True, kw_only=True)
class Given(Quantities):
    """The quantities of an itinerary as named parameters, for use in `Formulation.declare`.

    Parameters
    ----------
    perspective
        How the state of charge is written.
    """

    perspective: Perspective = "battery"

    @classmethod
    def of(cls, quantities: Quantities, perspective: Perspective) -> Given:
        """Symbols for the numbers of some itineraries; without a rest, its figures are 0."""
        symbols: dict[str, Any] = {
            each.name: symbol_for(each, getattr(quantities, each.name)) for each in QUANTITIES
        }
        if not quantities.rests:
            symbols |= {"rest_current_A": 0.0, "rest_received_W": 0.0}
        return cls(
            **symbols,
            steps=steps_for(quantities.steps),
            rests=quantities.rests,
            tapers=quantities.tapers,
            perspective=perspective,
        )

    def hover_and_rest(self, model: Model) -> tuple[Variable, Operand]:
        """Declare Δ and, where the route goes by way of a building, T'; else T' is 0.0.

        Of equally good plans the one with the shortest rest is preferred.
        """
        if not self.rests:
            return model.variable("hover_time_s", "Δ", unit="s"), 0.0
        hover = model.variable("hover_time_s", "Δ", unit="s", first_slot=1)
        rest = model.variable("rest_time_s", "T'", unit="s", first_slot=1)
        model.prefer_small(rest)
        return hover, rest

    def keep_deadline(self, model: Model, label: str, hover: Variable, rest: Operand = 0.0) -> None:
        """State Δ + T' ≤ T_max − T_fl.

        Without a rest the time left becomes the upper bound of Δ itself, so that the last slot of
        Δ may be cut short.
        """
        open_above = isinstance(hover.upper, float) and math.isinf(hover.upper)
        if _lasts(rest) or not open_above or has_unknowns(self.time_left):
            stay = hover + rest if _lasts(rest) else hover
            model.subject_to(label, stay <= self.time_left, unit="s", kind="deadline")
        else:
            hover.upper, hover.label, hover.kind = self.time_left, label, "deadline"

    def soc_end(self, hover: Operand, rest: Operand = 0.0) -> Operand:
        """State of charge at the end [-] after hovering and resting [s], by the perspective."""
        given = self if _lasts(rest) else self._without_rest
        return PERSPECTIVES[self.perspective](given, hover, rest)

    def keep_wells(self, model: Model, label: str, hover: Operand, rest: Operand = 0.0) -> None:
        """State that the battery never runs dry nor is overcharged; in `available` only."""
        if self.perspective != AVAILABLE:
            return
        given = self if _lasts(rest) else self._without_rest
        for kind, step, moment, relation in well_limits(given, hover, rest):
            name = f"{label} {LABELS[kind]}"
            model.subject_to(name, relation, kind=kind, step=step, moment=moment)

    @cached_property
    def _without_rest(self) -> Self:
        if not self.rests:
            return self
        return replace(self, rest_current_A=0.0, rest_received_W=0.0)


def _lasts(rest: Operand) -> bool:
    """Whether a rest is an unknown, or a number other than 0."""
    return isinstance(rest, Expression) or bool(np.any(rest))
