"""What the text of section V tells of its results, and what its captions set."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial

import numpy as np

from formulations.perspectives import PAPER
from optuav.mission import Mission, vehicle
from optuav.physics import rotor
from optuav.plan import Plan
from optuav.studies.curves.battery_size import pack_for, saturation, without_laser
from optuav.studies.curves.charging import harvest
from optuav.studies.curves.settings import DEADLINES_S, HOVER_S, LEAST_SOC, OPTIMUM_S, PACK_STEP_AS
from optuav.studies.curves.wind import AXES, calmest_N, hover_energy, limits_N
from optuav.studies.ledger.scenario import Scenario, papers
from optuav.studies.ledger.statement import Digits, Statement, Value, meets, printed_interval
from optuav.studies.ledger.table2 import HOVER_J

SAME = ("battery", "adjusted")
TRAJECTORIES = ("direct", "traj1", "traj2", "optimal")
PAPERS_BUILDING = "b9"
"""The first of our buildings by way of which the hover lasts the paper's 951 s."""
SAME_S = 1e-6
HELD = "where gravity and wind take the full thrust; to the digits that can still be held"
CUT = "cut, not rounded: rounded away from 0 it could not be held"
OURS = "the buildings' places are not in the paper, and ours decide the second digit"


def statements() -> Iterator[Statement]:
    """Every number of the results, in the paper's order, without the cells of Table II."""
    yield from _voltages()
    yield from _trajectories()
    yield from _least_charge()
    yield from _battery_size()
    yield from _wind()
    yield from _laser()


# Table II in the text


def _voltages() -> Iterator[Statement]:
    text = "text on Table II"
    yield Statement(
        name="text-697",
        place=text,
        what="Δ of the energy perspective at T_max = 800 s",
        stated="697",
        unit="s",
        how="(P3), energy, slots of 1 s",
        compute=lambda s: _direct(s, 800, "energy").hover_time_s,
    )
    for name, stated, what in (
        ("flight", "15.4", "rotor voltage e_r in flight"),
        ("hover", "14.33", "rotor voltage e_r in hover"),
    ):
        yield Statement(
            name=f"text-voltage-{name}",
            place=text,
            what=what,
            stated=stated,
            unit="V",
            how="eq (2) by the printed parameters; power over current of the recovered loads",
            compute=partial(_voltage, name),
        )
    yield Statement(
        name="text-e1",
        place=text,
        what="E_1 = 2 × (36 000 × 15.4)",
        stated="1108800",
        unit="J",
        how="the product",
        compute=lambda _: 2 * 36000 * 15.4,
    )
    yield Statement(
        name="text-e2",
        place=text,
        what="E_2 = 2 × (36 000 × 14.33)",
        stated="1032036",
        unit="J",
        how="the product",
        compute=lambda _: HOVER_J,
        reason=lambda: f"a slip of {1032036 - HOVER_J:.0f} J; our missions take the product",
        contradicted=lambda: not math.isclose(HOVER_J, 1032036.0, rel_tol=1e-9),
    )
    yield Statement(
        name="text-1009",
        place=text,
        what="mission time T at T_max = 1200 s, battery and adjusted",
        stated="1009.35",
        unit="s",
        how="(P3), battery, slots of 1 s",
        compute=lambda s: _direct(s, 1200, "battery").mission_time_s,
        fitted=True,
    )
    yield Statement(
        name="text-adjusted-is-battery",
        place=text,
        what="which perspectives hover longest on the direct path",
        stated="battery, adjusted",
        how="(P3) at 800 and at 1200 s, slots of 1 s",
        compute=_longest_perspectives,
        reason="by construction: with E_i = B times the voltage in use, η3 is η1",
    )


def _direct(scenario: Scenario, deadline_s: float, perspective: str) -> Plan:
    return scenario.plan(
        {"limits.deadline_s": deadline_s}, problem="P3", perspective=perspective, slot_s=1.0
    )


def _voltage(regime: str, scenario: Scenario) -> Value:
    if regime == "hover" and scenario.has_rotors:
        motor = vehicle.motor(scenario.mission)
        force_N = vehicle.airframe(scenario.mission).external_force_N((0.0, 0.0, 0.0))
        return float(rotor.voltage(motor, rotor.hover_speed(motor, force_N)))
    if regime == "hover":
        load = vehicle.hover_load(scenario.mission)
        return float(load.power_W) / float(load.current_A)
    return float(scenario.legs.energy_J[0] / scenario.legs.charge_As[0])


def _longest_perspectives(scenario: Scenario) -> Value:
    longest: set[str] = set()
    for deadline_s in (800, 1200):
        hovers = {name: _direct(scenario, deadline_s, name).hover_time_s for name in PAPER}
        longest |= {name for name in hovers if hovers[name] >= max(hovers.values()) - SAME_S}
    return ", ".join(name for name in PAPER if name in longest)


# Figures 3 to 6: trajectories and perspectives


def _trajectories() -> Iterator[Statement]:
    for number, deadline_s, what in (
        (3, DEADLINES_S[0], "hover time"),
        (4, DEADLINES_S[0], "charge left"),
        (5, DEADLINES_S[1], "hover time"),
        (6, DEADLINES_S[1], "charge left"),
    ):
        yield _setting(
            f"fig{number}-deadline", f"Fig. {number}, caption", f"T_max of the {what}", deadline_s
        )
    for number, deadline_s, stated in zip((3, 5), DEADLINES_S, ("direct", "traj2"), strict=True):
        yield Statement(
            name=f"fig{number}-best",
            place=f"text on Fig. {number}",
            what=f"trajectory with the longest hover at {deadline_s:g} s, which is the optimal one",
            stated=stated,
            how="(P1) by trajectory, in every perspective of the paper",
            compute=partial(_best_trajectory, deadline_s),
        )
    yield Statement(
        name="fig3-energy",
        place="text on Fig. 3",
        what="whether the energy perspective hovers less than the two others",
        stated="yes",
        how="(P1) by trajectory at 800 s",
        compute=partial(_energy_is_shorter, DEADLINES_S[0]),
    )
    yield Statement(
        name="fig5-same",
        place="text on Fig. 5",
        what="whether battery and adjusted perspective have the same best hover time",
        stated="yes",
        how="(P1) at 1200 s, slots of 1 s",
        compute=_same_in_slots,
    )
    yield Statement(
        name="fig4-least",
        place="text on Fig. 4",
        what="whether η1 keeps η0 in all bars",
        stated="yes",
        how="η1 at the end of every plan at 800 s",
        compute=_keeps_least_charge,
    )


def _setting(name: str, place: str, what: str, value: float, unit: str = "s") -> Statement:
    """A number that a caption or a sentence sets for a study."""
    return Statement(
        name=name,
        place=place,
        what=what,
        stated=f"{value:g}",
        unit=unit,
        how="what our study of the same name takes",
        compute=lambda _: float(value),
        given=True,
    )


def _best_trajectory(deadline_s: float, scenario: Scenario) -> Value:
    """The trajectory that is best in all perspectives, or the best of each."""
    best = {name: _best_of(deadline_s, name, scenario) for name in PAPER}
    different = dict.fromkeys(best.values())
    if len(different) == 1:
        return best["battery"]
    return ", ".join(f"{name}: {way}" for name, way in best.items())


def _best_of(deadline_s: float, perspective: str, scenario: Scenario) -> str:
    hovers = {
        name: scenario.plan(
            {"limits.deadline_s": deadline_s}, trajectory=name, perspective=perspective
        ).hover_time_s
        for name in TRAJECTORIES
    }
    named = {name: hovers[name] for name in TRAJECTORIES[:-1]}
    best = max(named, key=lambda name: named[name])
    return best if named[best] >= hovers["optimal"] - SAME_S else "none of them"


def _same_in_slots(scenario: Scenario) -> Value:
    hovers = {scenario.plan(perspective=name, slot_s=1.0).hover_time_s for name in SAME}
    return "yes" if len(hovers) == 1 else "no"


def _energy_is_shorter(deadline_s: float, scenario: Scenario) -> Value:
    changes = {"limits.deadline_s": deadline_s}
    shorter = all(
        scenario.plan(changes, trajectory=way, perspective="energy").hover_time_s
        < scenario.plan(changes, trajectory=way, perspective=name).hover_time_s
        for way in TRAJECTORIES
        for name in SAME
    )
    return "yes" if shorter else "no"


def _keeps_least_charge(scenario: Scenario) -> Value:
    least = scenario.mission.limits.min_soc - 1e-9
    plans = (
        scenario.plan({"limits.deadline_s": 800}, trajectory=way, perspective=perspective)
        for way in TRAJECTORIES
        for perspective in PAPER
    )
    return "yes" if all((plan.soc or {})["battery"] >= least for plan in plans) else "no"


# Figure 7: least charge and rotor speed


def _least_charge() -> Iterator[Statement]:
    place = "text on Fig. 7"
    yield _setting("fig7-deadline", "Fig. 7, caption", "T_max", DEADLINES_S[1])
    percents = [100.0 * least for least in LEAST_SOC]
    for percent in percents:
        yield _setting(f"fig7-eta0-{percent:g}", place, "desired charge η0", percent, "%")
    for percent, stated in zip(percents[1:], ("5.25", "10.5"), strict=True):
        yield Statement(
            name=f"fig7-drop-{percent:g}",
            place=place,
            what=f"by how much Δ falls from η0 = 5 % to {percent:g} %, approximately",
            stated=stated,
            unit="%",
            how=f"(P4) by way of {PAPERS_BUILDING}, by which Δ is the paper's 951 s",
            compute=partial(_drop_percent, percent, PAPERS_BUILDING),
            reason=partial(_why_drop, percent),
        )
    yield Statement(
        name="fig7-speed",
        place=place,
        what="how Δ changes with v_max",
        stated="rises",
        how="(P1) at 0.95, 1 and 1.05 times v_max",
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
    hovers = [
        scenario.plan({"rotor.max_speed_rad_s": speed * share}).hover_time_s
        for share in (0.95, 1.0, 1.05)
    ]
    return "rises" if hovers == sorted(hovers) else "does not always rise"


# Figure 8: battery size


def _why_optimum() -> str:
    recovered = papers()[1]
    best = recovered.plan()
    by_way = recovered.plan(problem="P4", building=PAPERS_BUILDING)
    return (
        f"in continuous times {by_way.hover_time_s:.2f} s by way of {PAPERS_BUILDING}, and "
        f"{best.hover_time_s:.2f} s by way of {best.route[1]}, our best"
    )


def _why_saturation() -> str:
    first = saturation(_dark(papers()[1]))
    assert first is not None
    sample = math.ceil(first / PACK_STEP_AS) * PACK_STEP_AS
    return f"in steps of {PACK_STEP_AS:g} A s the next sample after ours is {sample:g} A s"


def _battery_size() -> Iterator[Statement]:
    place = "text on Fig. 8"
    yield _setting("fig8-deadline", "Fig. 8, caption", "T_max", DEADLINES_S[1])
    yield Statement(
        name="fig8-optimum",
        place=place,
        what="Δ of the optimal solution with laser",
        stated="951",
        unit="s",
        how="(P1), battery, slots of 1 s",
        compute=lambda s: s.plan(slot_s=1.0).hover_time_s,
        undecided=OURS,
        reason=_why_optimum,
    )
    yield Statement(
        name="fig8-crossing",
        place=place,
        what="pack with which the direct path without laser hovers as long, stated three times",
        stated="39000",
        unit="A s",
        how="where (P3) without laser reaches 951 s",
        compute=_crossing,
        fitted=True,
    )
    yield Statement(
        name="fig8-saving",
        place=place,
        what="charge that the laser saves, 39 000 − 36 000",
        stated="3000",
        unit="A s",
        how="the crossing less B_i",
        compute=_saving,
        fitted=True,
    )
    yield Statement(
        name="fig8-saving-percent",
        place=place,
        what="the same as a share of B_i",
        stated="8.33",
        unit="%",
        how="the crossing over B_i, less 1",
        compute=lambda s: 100.0 * _saving(s) / s.mission.battery.capacity_As,
        fitted=True,
    )
    yield Statement(
        name="fig8-saturation",
        place=place,
        what="pack from which the direct path without laser is ended by the deadline",
        stated="48000",
        unit="A s",
        how="where the deadline begins to bind (P3) without laser",
        compute=lambda s: saturation(_dark(s)),
        undecided="the samples of the figure are not printed",
        reason=_why_saturation,
    )


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


# Figure 9: wind


def _wind() -> Iterator[Statement]:
    place = "text on Fig. 9"
    yield _setting("fig9-hover", place, "hover time Δ", HOVER_S)
    for axis in ("x", "y"):
        yield Statement(
            name=f"fig9-least-{axis}",
            place=place,
            what=f"wind along {axis} with the least hover energy",
            stated="0",
            unit="N",
            how="where the curve of the energy is lowest",
            compute=partial(_calmest, axis),
        )
        for end, stated in ((1, "11.57"), (0, "-11.57")):
            yield Statement(
                name=f"fig9-limit-{axis}-{'plus' if end else 'minus'}",
                place=place,
                what=f"limit of the wind along {axis}",
                stated=stated,
                unit="N",
                how=HELD,
                compute=partial(_limit, axis, end),
                digits=Digits.INWARDS,
                reason=CUT,
            )
    yield Statement(
        name="fig9-limit-z-minus",
        place=place,
        what="limit of the wind along z",
        stated="-4.45",
        unit="N",
        how=HELD,
        compute=partial(_limit, "z", 0),
        digits=Digits.INWARDS,
        reason=_why_down,
        contradicted=lambda: not meets("-4.45", _down_by_level_limit()),
    )
    yield Statement(
        name="fig9-limit-z-plus",
        place=place,
        what="limit of the wind along z",
        stated="29.9",
        unit="N",
        how=HELD,
        compute=partial(_limit, "z", 1),
        digits=Digits.INWARDS,
        reason=CUT,
    )
    yield Statement(
        name="fig9-least-z",
        place=place,
        what="wind along z with the least hover energy, stated twice",
        stated="12.74",
        unit="N",
        how="where the curve of the energy is lowest",
        compute=partial(_calmest, "z"),
    )


def _calmest(axis: str, scenario: Scenario) -> Value:
    if not scenario.has_rotors:
        return None
    return calmest_N(hover_energy(scenario.mission, AXES[axis], HOVER_S))


def _limit(axis: str, end: int, scenario: Scenario) -> Value:
    return limits_N(scenario.mission, AXES[axis])[end] if scenario.has_rotors else None


def _down_by_level_limit() -> tuple[float, float]:
    """Limit downwards that follows from the printed 11.57 N and 12.74 N [N]: F − m g."""
    least, most = printed_interval("11.57")
    # A limit that is cut, not rounded, may be up to a whole unit larger.
    thrusts = (math.hypot(least, 12.74), math.hypot(most + 0.005, 12.74))
    return 12.74 - thrusts[1], 12.74 - thrusts[0]


def _why_down() -> str:
    low, high = _down_by_level_limit()
    return f"with the printed 11.57 N the full thrust leaves {high:.2f} to {low:.2f} N downwards"


# Figure 10: laser


def _laser() -> Iterator[Statement]:
    place = "text on Fig. 10"
    yield _setting("fig10-hover", place, "hover time", HOVER_S)
    yield Statement(
        name="fig10-efficiency",
        place=place,
        what="efficiency ζ = P_0/P_s below 1 km, around",
        stated="17.5",
        unit="%",
        how="least and largest ζ from 0 to 1 km for sources of 500 and 1000 W",
        compute=_efficiencies,
        undecided="the source powers of the figure are not printed in the text",
    )


def _efficiencies(scenario: Scenario) -> Value:
    distance_m = np.linspace(0.0, 1000.0, 101)
    found = [
        harvest(scenario.mission, power_W, distance_m, HOVER_S).efficiency
        for power_W in (500.0, 1000.0)
    ]
    return f"{100.0 * np.min(found):.1f} to {100.0 * np.max(found):.1f}"
