"""Fig. 7: the hover time against the charge that must be left, and against the rotor speed."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from optuav.studies.curves.settings import DEADLINES_S, LEAST_SOC, SPEED_SHARES
from optuav.studies.ledger.scenario import Scenario, papers
from optuav.studies.ledger.statement import Statement, Value, setting

PLACE = "text on Fig. 7"
PAPERS_BUILDING = "b9"
"""The first of our buildings by way of which the hover lasts the paper's 951 s."""


def statements() -> Iterator[Statement]:
    """The deadline, three desired charges, two falls of Δ, and how it changes with v_max."""
    yield setting("fig7-deadline", "Fig. 7, caption", "T_max", DEADLINES_S[1])
    percents = [100.0 * least for least in LEAST_SOC]
    for percent in percents:
        yield setting(f"fig7-eta0-{percent:g}", PLACE, "desired charge η0", percent, "%")
    for percent, stated in zip(percents[1:], ("5.25", "10.5"), strict=True):
        yield Statement(
            name=f"fig7-drop-{percent:g}",
            place=PLACE,
            what=f"by how much Δ falls from η0 = 5 % to {percent:g} %, approximately",
            stated=stated,
            unit="%",
            how=f"(P4) by way of {PAPERS_BUILDING}, by which Δ is the paper's 951 s",
            compute=partial(_drop_percent, percent, PAPERS_BUILDING),
            reason=partial(_why_drop, percent),
        )
    yield Statement(
        name="fig7-speed",
        place=PLACE,
        what="how Δ changes with v_max, for any η0",
        stated="rises",
        how=f"(P1) at {', '.join(f'{share:g}' for share in SPEED_SHARES)} times v_max, each η0",
        compute=_trend_with_speed,
    )


def _drop_percent(percent: float, building: str, scenario: Scenario) -> float:
    first_s, later_s = (
        scenario.plan({"limits.min_soc": least}, problem="P4", building=building).hover_time_s
        for least in (LEAST_SOC[0], percent / 100.0)
    )
    return 100.0 * (1.0 - later_s / first_s)


def _why_drop(percent: float) -> str:
    recovered = papers()[1]
    best = recovered.plan().route[1]
    drop = _drop_percent(percent, best, recovered)
    return (
        f"which of our buildings is the paper's is one free choice, made by the 951 s; by way of "
        f"our best one, {best}, it is {drop:.2f} %"
    )


def _trend_with_speed(scenario: Scenario) -> Value:
    if not scenario.has_rotors or scenario.mission.rotor is None:
        return None
    speed = scenario.mission.rotor.max_speed_rad_s
    for least in LEAST_SOC:
        hovers = [
            scenario.plan(
                {"rotor.max_speed_rad_s": speed * share, "limits.min_soc": least}
            ).hover_time_s
            for share in SPEED_SHARES
        ]
        if hovers != sorted(hovers):
            return "does not always rise"
    return "rises"
