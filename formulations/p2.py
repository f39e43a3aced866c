"""(P2) of the paper: shortest flight and rest, as printed and with the deadline tight."""

from __future__ import annotations

from formulations.formulation import Formulation
from optuav.modelling import Model


class P2(Formulation):
    """P2: shortest flight and rest, the hover time free."""

    def declare(self, model: Model) -> None:
        """State (P2) as printed: any feasible Δ is optimal, and the shortest mission preferred."""
        hover, rest = self.hover_and_rest(model, "P2.d hover time")
        model.minimise(self.flight_time_s + (0.0 if rest is None else rest))
        model.prefer_small(hover)
        model.subject_to("P2.a outage", self.hover_distance_m <= self.coverage_radius_m, unit="m")
        model.subject_to("P2.b state of charge", self.soc_end(hover, rest) >= self.min_soc)
        self.keep_wells(model, "P2.b", hover, rest)
        model.subject_to("P2.c ends", self.end_gap_m <= 0.0, unit="m")
        self.keep_deadline(model, "P2.d hover time", hover, rest)
        model.subject_to("P2.e altitude", self.hover_altitude_m >= self.min_altitude_m, unit="m")
        model.subject_to(
            "P2.e highest altitude", self.hover_altitude_m <= self.max_altitude_m, unit="m"
        )


class P2Tight(P2):
    """P2 with the deadline tight: shortest flight and rest, hovering all the time that is left."""

    def declare(self, model: Model) -> None:
        """State (P2) with Δ = T_max − T_fl − T', which the paper's derivation supposes."""
        super().declare(model)
        hover, *rest = model.variables
        used = sum(rest, start=hover)
        model.subject_to("P2.d deadline tight", used == self.time_left, unit="s")
