"""Fig. 7: the hover time against the charge that must be left, and against the rotor speed."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from optuav.paper.curves.settings import DEADLINES_S, LEAST_SOC, SPEED_SHARES
from optuav.paper.ledger.scenario import Scenario, papers
from optuav.paper.ledger.statement import Statement, Value, setting
from optuav.plan import Plan

PLACE = "text on Fig. 7"
PAPERS_BUILDING = "b9"
"""The first of our buildings by way of which the hover lasts the paper's 951 s."""


def statements() -> Iterator[Statement]:
    """The deadline, three desired charges, two falls of Δ, and two trends with v_max."""
    yield setting("fig7-deadline", "Fig. 7, caption and text", "T_max", DEADLINES_S[1])
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
        compute=_trend_of_hover,
        reason="the speeds of the figure are not printed; at twice v_max and more Δ falls again",
    )
    yield Statement(
        name="fig7-energy",
        place=PLACE,
        what="how the energy of flying changes with v_max",
        stated="rises",
        how="flights of the same plans at η0 = 5 %",
        compute=_trend_of_energy,
        undecided="the speeds of the figure are not printed",
        reason=_why_energy,
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


def _by_speed(scenario: Scenario, least: float) -> list[Plan]:
    """The optimal plans at the shares of v_max."""
    assert scenario.mission.rotor is not None
    speed = scenario.mission.rotor.max_speed_rad_s
    return [
        scenario.plan({"rotor.max_speed_rad_s": speed * share, "limits.min_soc": least})
        for share in SPEED_SHARES
    ]


def _trend_of_hover(scenario: Scenario) -> Value:
    if not scenario.has_rotors:
        return None
    return _trend(
        *([plan.hover_time_s for plan in _by_speed(scenario, least)] for least in LEAST_SOC)
    )


def _trend_of_energy(scenario: Scenario) -> Value:
    return _trend(_flights_take(scenario, "power_W")) if scenario.has_rotors else None


def _trend(*series: list[float]) -> str:
    return "rises" if all(each == sorted(each) for each in series) else "does not always rise"


def _flights_take(scenario: Scenario, rate: str) -> list[float]:
    """What the flights of the plans at the shares of v_max take, by power_W or current_A."""
    return [
        -sum(
            getattr(phase, rate) * phase.duration_s
            for phase in plan.phases
            if phase.kind == "flight"
        )
        for plan in _by_speed(scenario, LEAST_SOC[0])
    ]


def _why_energy() -> str:
    paper = papers()[0]
    energies, charges = (_flights_take(paper, rate) for rate in ("power_W", "current_A"))
    return (
        f"{_listed([energy / 1000.0 for energy in energies], 1)} kJ, so it rises from the printed "
        f"v_max on only; the charge, which the battery perspective counts, falls: "
        f"{_listed(charges, 0)} A s"
    )


def _listed(numbers: list[float], digits: int) -> str:
    return ", ".join(f"{number:.{digits}f}" for number in numbers)
