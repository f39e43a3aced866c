"""Missions for the tests of the diagnosis: quick ones, and random infeasible ones."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import pytest
from hypothesis import assume
from hypothesis import strategies as st

import optuav
from formulations.formulation import Formulation, Given
from optuav.diagnosis import Repair
from optuav.diagnosis.explain import Subject, question_of
from optuav.diagnosis.repair import repairs as repairs_of
from optuav.mission import Mission
from optuav.modelling import Model, Parameter

PAPER = optuav.load("paper")
SMALL = PAPER.replace({"buildings": PAPER.to_dict()["buildings"][:1]})
"""The paper's mission with b1 alone."""


@dataclass(frozen=True)
class InTime(Formulation):
    """Longest hover on the direct route of a mission that leaves time to spare."""

    spare_s: float

    def __post_init__(self) -> None:
        if self.spare_s > 1e5:
            raise ValueError("more than a day")

    def declare(self, model: Model, given: Given) -> None:
        hover = model.variable("hover_time_s", "Δ", unit="s")
        spare = Parameter("spare_s", "s", "s", self.spare_s)
        model.maximise(hover)
        model.subject_to("to spare", given.time_left >= spare, unit="s")
        model.subject_to("charge", given.soc_end(hover) >= given.min_soc)


CHANGES = {
    "limits.deadline_s": st.integers(15, 70),
    "limits.min_soc": st.sampled_from([0.9, 0.95, 0.99]),
    "battery.capacity_As": st.integers(300, 3900),
    "body.mass_kg": st.sampled_from([1.7, 1.755, 2.0, 3.5]),
    "body.gravity_m_s2": st.sampled_from([12.0, 14.0]),
    "rotor.max_speed_rad_s": st.integers(600, 910),
    "link.transmit_power_W": st.sampled_from([1e-3, 0.04, 0.5]),
    "link.snr_threshold_dB": st.sampled_from([4.0, 10.0, 30.0]),
    "limits.outage_probability": st.sampled_from([1e-9, 1e-3]),
    "limits.slot_s": st.sampled_from([7.0, 60.0]),
}
OPTIONS: tuple[dict[str, Any], ...] = (
    {},
    {"problem": "P3"},
    {"problem": "P3", "perspective": "energy"},
    {"problem": optuav.P4("b1", order="hover-first")},
    {"problem": optuav.P4("b1"), "engine": "grid"},
    {"problem": "P2-tight"},
)


@st.composite
def infeasible(draw: st.DrawFn) -> tuple[Mission, dict[str, Any]]:
    """A mission without a plan, one or two changes away from the paper's, and the question."""
    names = draw(st.lists(st.sampled_from(sorted(CHANGES)), min_size=1, max_size=2, unique=True))
    mission = SMALL.replace({name: draw(CHANGES[name]) for name in names})
    options = draw(st.sampled_from(OPTIONS))
    assume(not optuav.solve(mission, **{"perspective": "battery", **options}))
    return mission, options


def only(patch: pytest.MonkeyPatch, *tables: str) -> None:
    """Look for repairs among the keys of some tables, and the wind, alone."""
    patch.setattr("optuav.diagnosis.repair.TABLES", tables)


def repairs(subject: Subject, problem: Any = None, **options: Any) -> tuple[Repair, ...]:
    """The repairs of a question about a mission, or of a program or plan."""
    return repairs_of(question_of(subject, problem=problem, **options))
