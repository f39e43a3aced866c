"""Fig. 8: packs of other sizes without a laser, beside the optimal solution with one."""

from __future__ import annotations

import math
from collections.abc import Iterator

from optuav.mission import Mission
from optuav.paper.curves.battery_size import pack_for, saturation, without_laser
from optuav.paper.curves.settings import DEADLINES_S, OPTIMUM_S, PACK_STEP_AS
from optuav.paper.ledger.least_charge import PAPERS_BUILDING
from optuav.paper.ledger.scenario import Scenario, papers
from optuav.paper.ledger.statement import Statement, Value, setting

PLACE = "text on Fig. 8"


def statements() -> Iterator[Statement]:
    """The optimum, where the curves cross, what that saves, and where one of them saturates."""
    yield setting("fig8-deadline", "Fig. 8, caption", "T_max", DEADLINES_S[1])
    yield Statement(
        name="fig8-optimum",
        place=PLACE,
        what="Δ of the optimal solution with laser",
        stated="951",
        unit="s",
        how="(P1), battery, slots of 1 s",
        compute=lambda s: s.plan(slot_s=1.0).hover_time_s,
        undecided="the buildings' places are not in the paper, and the last digits hang on them",
        reason=_why_optimum,
    )
    yield Statement(
        name="fig8-crossing",
        place=PLACE,
        what="pack with which the direct path without laser hovers 951 s, stated three times",
        stated="39000",
        unit="A s",
        how="where (P3) without laser reaches 951 s",
        compute=_crossing,
        reason=_why_crossing,
        fitted=True,
    )
    yield Statement(
        name="fig8-saving",
        place=PLACE,
        what="charge that the laser saves, 39 000 − 36 000",
        stated="3000",
        unit="A s",
        how="the crossing less B_i",
        compute=_saving,
        fitted=True,
    )
    yield Statement(
        name="fig8-saving-percent",
        place=PLACE,
        what="the same as a share of B_i",
        stated="8.33",
        unit="%",
        how="the crossing over B_i, less 1",
        compute=lambda s: 100.0 * _saving(s) / s.mission.battery.capacity_As,
        fitted=True,
    )
    yield Statement(
        name="fig8-saturation",
        place=PLACE,
        what="pack from which the direct path without laser is ended by the deadline",
        stated="48000",
        unit="A s",
        how="where the deadline begins to bind (P3) without laser",
        compute=lambda s: saturation(_dark(s)),
        undecided="the samples of the figure are not printed",
        reason=_why_saturation,
    )


def _why_optimum() -> str:
    recovered = papers()[1]
    hovers = {
        building.name: recovered.plan(problem="P4", building=building.name).hover_time_s
        for building in recovered.mission.buildings
    }
    best = max(hovers, key=lambda name: hovers[name])
    return (
        f"in continuous times our buildings give {min(hovers.values()):.2f} to "
        f"{hovers[best]:.2f} s, {PAPERS_BUILDING} {hovers[PAPERS_BUILDING]:.2f} s and {best}, our "
        f"best, the most"
    )


def _why_crossing() -> str:
    own = (
        f"{scenario.plan().hover_time_s:.2f} s of {scenario.mission.name} from "
        f"{pack_for(_dark(scenario), scenario.plan().hover_time_s):.0f} A s on"
        for scenario in papers()
    )
    return f"as long as our own optima with laser it hovers elsewhere: {' and '.join(own)}"


def _why_saturation() -> str:
    first = saturation(_dark(papers()[1]))
    assert first is not None
    sample = math.ceil(first / PACK_STEP_AS) * PACK_STEP_AS
    return f"in steps of {PACK_STEP_AS:g} A s the next sample after ours is {sample:g} A s"


def _dark(scenario: Scenario) -> Mission:
    found: Mission = scenario.once("dark", lambda: without_laser(scenario.mission))
    return found


def _crossing(scenario: Scenario) -> Value:
    found: float | None = scenario.once("crossing", lambda: pack_for(_dark(scenario), OPTIMUM_S))
    return found


def _saving(scenario: Scenario) -> float:
    crossing = _crossing(scenario)
    assert isinstance(crossing, float)
    return crossing - scenario.mission.battery.capacity_As
