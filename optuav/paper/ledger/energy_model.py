"""Numbers in the energy model, section II: rotors, stages of a leg, coefficients of the power."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial

import numpy as np
from numpy.polynomial import Polynomial

from optuav.network import vehicle
from optuav.network.places import HOVER
from optuav.paper.ledger.scenario import Scenario, papers
from optuav.paper.ledger.statement import Statement, Value
from optuav.physics import flight, rotor

SAME = 1e-12
"""Relative difference that is rounding of floats."""


def statements() -> Iterator[Statement]:
    """Every number of this section, and the equation that carries a misprint."""
    for name, place, what, stated, how, compute in (
        (
            "model-rotors",
            "eqs (1), (4), (7), (8)",
            "rotors",
            "4",
            "rotors of the model",
            lambda _: float(rotor.ROTORS),
        ),
        (
            "model-stages",
            "section II",
            "stages of a leg",
            "6",
            "flight and hover",
            lambda _: len(flight.STAGES) + 1.0,
        ),
        (
            "eq4-constants",
            "eq (4)",
            "constants c of the power of a rotor",
            "9",
            "coefficients of the power, powers 0 to 4 of the speed and four with its derivative",
            _constants,
        ),
        (
            "eq5-factor",
            "eq (5)",
            "factor in c_2, c_3 and c_6",
            "2",
            "what each must be for e·i of eqs (2) and (3)",
            _factor,
        ),
    ):
        yield Statement(name=name, place=place, what=what, stated=stated, how=how, compute=compute)
    yield Statement(
        name="eq5-c9",
        place="eq (5)",
        what="coefficient c_9 of v² dv/dt in the power of a rotor, over c_6",
        stated="κ_T/T_f",
        how="which quotient gives e·i of eqs (2) and (3), with the numbers of Table I",
        compute=_c9_over_c6,
        reason="a misprint; c_1 to c_8 are right",
        contradicted=lambda: _c9_over_c6(papers()[0]) != "κ_T/T_f",
    )
    yield from _of_stages()
    yield from _turning()
    yield Statement(
        name="eq8-exponent",
        place="eq (8)",
        what="exponent of |F_e|/(4 ϱ) beside c_i in the energy of hovering",
        stated="(i − 1)/2",
        how="whether the sum is the power of a rotor in hover",
        compute=_hover_exponent,
    )


def _of_stages() -> Iterator[Statement]:
    """Which stages turn and which travel, and between which switching times."""
    for name, place, what, stated, how, compute in (
        (
            "model-travelling-stages",
            "eq (6)",
            "stages that travel",
            "5",
            "without hover",
            lambda _: float(len(flight.STAGES)),
        ),
        (
            "model-turns",
            "eq (7) and the text before it",
            "stages that change the orientation",
            "1, 3, 5",
            "turning stages of the model",
            lambda _: ", ".join(map(str, _stages(turn=True))),
        ),
        (
            "model-displacements",
            "eq (7) and the text before it",
            "stages that displace",
            "2, 4",
            "the other stages of the model",
            lambda _: ", ".join(map(str, _stages(turn=False))),
        ),
        (
            "eq7-turning-times",
            "eq (7)",
            "switching times between which stage s turns, τ_0 = 0",
            "2.5 s − 2.5, 2.5 s + 1.5",
            "whether they are as far apart as the stages of the leg to the hover point are long",
            partial(_between, True, -2.5, 1.5),
        ),
        (
            "eq7-displacing-times",
            "eq (7)",
            "switching times between which stage s displaces",
            "2.5 s − 1, 2.5 s",
            "as for those that turn",
            partial(_between, False, -1.0, 0.0),
        ),
        (
            "model-switching-times",
            "section II",
            "switching times τ of a leg",
            "14",
            "switching times of the leg to the hover point",
            _switching_times,
        ),
    ):
        yield Statement(name=name, place=place, what=what, stated=stated, how=how, compute=compute)


def _turning() -> Iterator[Statement]:
    """Coefficients of c_1 to c_5: sums of the powers of the rotor speeds over v_max."""
    root2 = math.sqrt(2.0)
    for power, (stated, exact) in enumerate(
        (
            ("3", 3.0),
            ("1 + √2", 1.0 + root2),
            ("2", 2.0),
            ("1 + 1/√2", 1.0 + 1.0 / root2),
            ("3/2", 1.5),
        )
    ):
        yield Statement(
            name=f"eq7-c{power + 1}",
            place="eq (7), turning stages",
            what=f"coefficient of c_{power + 1}",
            stated=stated,
            how="sum over the rotors that turn, one at v_max and two at v_max/√2",
            compute=partial(_same, stated, exact, power),
        )


def _stages(turn: bool) -> tuple[int, ...]:
    """Numbers of the stages that turn, or of those that displace."""
    return tuple(
        number for number, stage in enumerate(flight.STAGES, start=1) if (stage == "turn") is turn
    )


def _leg(scenario: Scenario) -> flight.Leg | None:
    """From the origin to the hover point, if motors fly it."""
    if not scenario.has_rotors:
        return None
    where = scenario.worked_out.places.position_m
    way = tuple((where[HOVER] - where[0]).tolist())
    airframe, motor = vehicle.airframe(scenario.mission), vehicle.motor(scenario.mission)
    return flight.leg(airframe, motor, way)


def _switching_times(scenario: Scenario) -> Value:
    leg = _leg(scenario)
    return None if leg is None else float(len(leg.switching_times_s))


def _between(turn: bool, first: float, last: float, scenario: Scenario) -> Value:
    """The indices as printed, where they enclose each stage that turns, or that displaces."""
    leg = _leg(scenario)
    if leg is None:
        return None
    times_s = (0.0, *map(float, leg.switching_times_s))
    for stage in _stages(turn):
        begin_s, end_s = (times_s[round(2.5 * stage + each)] for each in (first, last))
        if not math.isclose(end_s - begin_s, float(leg.loads.durations_s[stage - 1]), rel_tol=1e-9):
            return f"not of stage {stage}"
    return ", ".join(_index(each) for each in (first, last))


def _index(constant: float) -> str:
    sign = "−" if constant < 0.0 else "+"
    return f"2.5 s {sign} {abs(constant):g}" if constant else "2.5 s"


def _same(stated: str, exact: float, power: int, _: Scenario) -> Value:
    total = sum(speed**power for speed in flight.TURNING_SPEEDS if speed > 0.0)
    return stated if math.isclose(total, exact, rel_tol=SAME) else f"{total:.6g}"


def _constants(scenario: Scenario) -> Value:
    if not scenario.has_rotors:
        return None
    return float(len(rotor.power_coefficients(vehicle.motor(scenario.mission))))


def _factor(scenario: Scenario) -> Value:
    """The factor that the constants need, if it is one and the same, by polynomials through e·i."""
    if not scenario.has_rotors:
        return None
    motor = vehicle.motor(scenario.mission)
    speeds, change = np.linspace(0.2, 1.0, 5) * motor.max_speed_rad_s, 100.0
    steady = [float(rotor.power(motor, speed)) for speed in speeds]
    up, down = ([float(rotor.power(motor, v, each)) for v in speeds] for each in (change, -change))
    c1, c2, c3, *_ = Polynomial.fit(speeds, steady, 4).convert().coef.tolist()
    c6 = float(Polynomial.fit(speeds, np.subtract(up, down), 2).convert().coef[0]) / (2.0 * change)
    torque, friction = float(motor.torque_constant_Nm_A), motor.friction_torque_Nm
    damping, drag = motor.viscous_damping_Nm_s_rad, motor.drag_coefficient_Nm_s2_rad2
    resistance = motor.resistance_ohm
    needed = (
        (c2 * torque / friction - torque) * torque / (resistance * damping),
        (c3 - damping / torque * (resistance * damping / torque + torque))
        * torque**2
        / (resistance * friction * drag),
        c6 * friction / (motor.inertia_kg_m2 * c1),
    )
    alike = all(math.isclose(each, needed[0], rel_tol=1e-6) for each in needed)
    return needed[0] if alike else ", ".join(f"{each:.6g}" for each in needed)


def _c9_over_c6(scenario: Scenario) -> Value:
    """The quotient with which the polynomial of eq (4) is voltage times current."""
    if not scenario.has_rotors:
        return None
    motor = vehicle.motor(scenario.mission)
    c6, c9 = (float(rotor.power_coefficients(motor)[number]) for number in (5, 8))
    speed, change = 1000.0, 100.0
    rest = float(rotor.polynomial_power(motor, speed, change)) - change * speed**2 * c9
    needed = (float(rotor.power(motor, speed, change)) - rest) / (change * speed**2)
    quotients = {
        "κ_T/T_f": motor.torque_constant_Nm_A / motor.friction_torque_Nm,
        "κ_0/T_f": motor.drag_coefficient_Nm_s2_rad2 / motor.friction_torque_Nm,
    }
    right = (
        name for name, each in quotients.items() if math.isclose(each * c6, needed, rel_tol=1e-6)
    )
    return next(right, None)


def _hover_exponent(scenario: Scenario) -> Value:
    """The exponent as printed, where Σ c_i x^((i − 1)/2) is voltage times current in hover."""
    if not scenario.has_rotors:
        return None
    motor = vehicle.motor(scenario.mission)
    force_N = vehicle.airframe(scenario.mission).external_force_N((0.0, 0.0, 0.0))
    squared = math.hypot(*force_N) / (4.0 * motor.lift_coefficient_N_s2_rad2)
    total = sum(
        float(each) * squared ** (0.5 * power)
        for power, each in enumerate(rotor.power_coefficients(motor)[:5])
    )
    needed = float(rotor.power(motor, rotor.hover_speed(motor, force_N)))
    return "(i − 1)/2" if math.isclose(total, needed, rel_tol=1e-9) else f"{total:.6g} W"
