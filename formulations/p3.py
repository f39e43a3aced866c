"""(P3) of the paper: hover as long as the battery and the deadline allow, without a rest."""

from __future__ import annotations

from formulations.formulation import Formulation
from optuav.modelling import Model


class P3(Formulation):
    """P3: longest hover on a given route without a rest."""

    def declare(self, model: Model) -> None:
        """State (P3): P3.a state of charge, P3.b hover time."""
        hover = model.variable(
            "hover_time_s", "Δ", unit="s", upper=self.time_left, label="P3.b hover time"
        )
        model.maximise(hover)
        model.subject_to("P3.a state of charge", self.soc_end(hover) >= self.min_soc)
        self.keep_wells(model, "P3.a", hover)
