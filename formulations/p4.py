"""(P4) of the paper: hover as long as possible with one rest on a given building."""

from __future__ import annotations

from formulations.formulation import Formulation
from optuav.modelling import Model


class P4(Formulation):
    """P4: longest hover with one rest on a given building."""

    def declare(self, model: Model) -> None:
        """State (P4): P4.a state of charge, P4.b deadline; of equal plans the shortest rest."""
        hover = model.variable("hover_time_s", "Δ", unit="s", first_slot=1)
        rest = model.variable("rest_time_s", "T'", unit="s", first_slot=1)
        model.maximise(hover)
        model.prefer_small(rest)
        model.subject_to("P4.a state of charge", self.soc_end(hover, rest) >= self.min_soc)
        self.keep_wells(model, "P4.a", hover, rest)
        model.subject_to("P4.b deadline", hover + rest <= self.time_left, unit="s")
