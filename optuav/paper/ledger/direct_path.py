"""What the text tells of Table II: two hover voltages, two energies, and who hovers longest."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial

from formulations.perspectives import PAPER
from optuav.network import vehicle
from optuav.paper.ledger.cells import FLIGHT_J, HOVER_J
from optuav.paper.ledger.scenario import Scenario
from optuav.paper.ledger.statement import Statement, Value
from optuav.physics import rotor
from optuav.plan import Plan

PLACE = "text on Table II"
PRINTED_E2_J = 1032036.0
SAME_S = 1e-6


def statements() -> Iterator[Statement]:
    """Every number of this text, in its order."""
    yield Statement(
        name="text-697",
        place=PLACE,
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
            place=PLACE,
            what=what,
            stated=stated,
            unit="V",
            how="eq (2) by the printed parameters; power over current of the recovered loads",
            compute=partial(_voltage, name),
        )
    yield Statement(
        name="text-e1",
        place=PLACE,
        what="E_1 = 2 × (36 000 × 15.4)",
        stated="1108800",
        unit="J",
        how="the product",
        compute=lambda _: FLIGHT_J,
    )
    yield Statement(
        name="text-e2",
        place=PLACE,
        what="E_2 = 2 × (36 000 × 14.33)",
        stated=f"{PRINTED_E2_J:.0f}",
        unit="J",
        how="the product",
        compute=lambda _: HOVER_J,
        reason=f"a slip of {PRINTED_E2_J - HOVER_J:.0f} J; our missions take the product",
        contradicted=lambda: not math.isclose(HOVER_J, PRINTED_E2_J, rel_tol=1e-9),
    )
    yield Statement(
        name="text-1009",
        place=PLACE,
        what="mission time T at T_max = 1200 s, battery and adjusted",
        stated="1009.35",
        unit="s",
        how="(P3), battery, slots of 1 s",
        compute=lambda s: _direct(s, 1200, "battery").mission_time_s,
        fitted=True,
    )
    yield Statement(
        name="text-adjusted-is-battery",
        place=PLACE,
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
