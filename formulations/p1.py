"""(P1) of the paper: hover as long as possible, on one route at a time."""

from __future__ import annotations

from formulations.formulation import Formulation
from optuav.modelling import Model


class P1(Formulation):
    """P1: longest hover within reach of the device, with or without a rest."""

    def declare(self, model: Model) -> None:
        """State (P1), P1.a to P1.e; of equal plans the shortest rest."""
        hover, rest = self.hover_and_rest(model, "P1.d hover time")
        model.maximise(hover)
        in_reach = self.hover_distance_m <= self.coverage_radius_m
        model.subject_to("P1.a outage", in_reach, unit="m", kind="outage")
        charged = self.soc_end(hover, rest) >= self.min_soc
        model.subject_to("P1.b state of charge", charged, kind="state of charge")
        self.keep_wells(model, "P1.b", hover, rest)
        model.subject_to("P1.c ends", self.end_gap_m <= 0.0, unit="m")
        self.keep_deadline(model, "P1.d hover time", hover, rest)
        model.subject_to("P1.e altitude", self.hover_altitude_m >= self.min_altitude_m, unit="m")
        model.subject_to(
            "P1.e highest altitude", self.hover_altitude_m <= self.max_altitude_m, unit="m"
        )
