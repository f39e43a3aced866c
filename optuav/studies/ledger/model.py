"""Numbers in the models of sections II to IV: counts, coefficients, two misprinted equations."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from functools import partial

from formulations.algorithm1 import algorithm1
from optuav.mission import vehicle
from optuav.mission.one_stop import one_stop_is_enough
from optuav.mission.places import HOVER
from optuav.physics import battery, flight, link, rotor
from optuav.studies.ledger.cells import FLIGHT_J, HOVER_J, NOMINAL_J
from optuav.studies.ledger.scenario import Scenario, papers
from optuav.studies.ledger.statement import Statement, Value

TURN = "eq (7), turning stages"


def statements() -> Iterator[Statement]:
    """Every number of these sections, and the equations that carry a misprint."""
    yield from _counts()
    yield from _turning()
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
    yield Statement(
        name="eq25-signs",
        place="eq (25)",
        what="signs of E_fl, E_hv and E_harv in η3",
        stated="− + −",
        how="how η3 must answer to more of each for Table II to come out",
        compute=_signs,
        reason=lambda: (
            f"with the printed signs the row Δ = 697 s of Table II would end at "
            f"{_percent_at_697((-1.0, 1.0, -1.0)):.0f} %"
        ),
        contradicted=lambda: abs(_percent_at_697((-1.0, 1.0, -1.0)) - 28.30) > 1.0,
    )


def _counts() -> Iterator[Statement]:
    for name, place, what, stated, how, count in (
        ("rotors", "eqs (1), (7), (8)", "rotors", "4", "rotors of the model", rotor.ROTORS),
        ("stages", "section II", "stages of a leg", "6", "flight and hover", _stages() + 1),
        ("travelling-stages", "eq (6)", "stages that travel", "5", "without hover", _stages()),
        (
            "marcum",
            "eq (17)",
            "order of the Marcum Q-function",
            "1",
            "half of the degrees of freedom of χ²",
            link.DEGREES_OF_FREEDOM / 2,
        ),
        (
            "wells",
            "section III",
            "wells of KiBaM, and its differential equations",
            "2",
            "y1 and y2",
            len(battery.Wells._fields),
        ),
    ):
        yield Statement(
            name=f"model-{name}",
            place=place,
            what=what,
            stated=stated,
            how=how,
            compute=partial(_count, count),
        )
    yield Statement(
        name="model-switching-times",
        place="section II",
        what="switching times τ of a leg",
        stated="14",
        how="switching times of the leg to the hover point",
        compute=_switching_times,
    )
    yield Statement(
        name="model-one-rest",
        place="section IV, footnote",
        what="buildings on which resting pays",
        stated="1",
        how="1 where times, charges and energies of the legs obey the triangle inequality",
        compute=lambda s: None if one_stop_is_enough(s.worked_out) else 1.0,
        reason=_why_one_rest,
    )
    yield Statement(
        name="model-first-slot",
        place="Algorithm 1, lines 3 and 4",
        what="first slot of Δ and of T'",
        stated="1",
        how="least Δ in the table of Algorithm 1",
        compute=lambda _: float(algorithm1(lambda hover, rest: 1.0, 3.0, 0.0)[0][0, 0]),
        given=True,
    )
    yield Statement(
        name="model-phases",
        place="section III-B, footnote",
        what="phases of charging, constant current and then constant voltage",
        stated="2",
        how="not computed: the paper charges at constant current",
        compute=lambda _: None,
        undecided="its second phase has no part in the paper",
    )


def _count(count: float, _: Scenario) -> Value:
    return float(count)


def _why_one_rest() -> str:
    one, two = (papers()[0].plan(perspective="available", stops=most) for most in (1, 2))
    return (
        f"true while the available well is not asked; with it, two rests hover "
        f"{two.hover_time_s:.3f} s in `paper`, one {one.hover_time_s:.3f} s"
    )


def _stages() -> int:
    return len(flight.STAGES)


def _switching_times(scenario: Scenario) -> Value:
    if not scenario.has_rotors:
        return None
    where = scenario.worked_out.places.position_m
    way = tuple((where[HOVER] - where[0]).tolist())
    airframe, motor = vehicle.airframe(scenario.mission), vehicle.motor(scenario.mission)
    return float(len(flight.leg(airframe, motor, way).switching_times_s))


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
            place=TURN,
            what=f"coefficient of c_{power + 1}",
            stated=stated,
            how="sum over the rotors that turn, one at v_max and two at v_max/√2",
            compute=partial(_same, stated, exact, power),
        )


def _same(stated: str, exact: float, power: int, _: Scenario) -> Value:
    total = sum(speed**power for speed in flight.TURNING_SPEEDS if speed > 0.0)
    return stated if math.isclose(total, exact, rel_tol=1e-12) else f"{total:.6g}"


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


def _signs(scenario: Scenario) -> Value:
    """The signs with which η3 of the row Δ = 697 s comes out within a percent."""
    if scenario.has_rotors:
        return None
    found = [
        signs
        for signs in itertools.product((-1.0, 1.0), repeat=3)
        if abs(_percent_at_697(signs) - 28.30) < 1.0
    ]
    return " or ".join(" ".join("−" if sign < 0.0 else "+" for sign in each) for each in found)


def _percent_at_697(signs: tuple[float, ...]) -> float:
    """η3 of the row Δ = 697 s with given signs of E_fl, E_hv and E_harv [%]."""
    scenario, hover_s = papers()[1], 697.0
    direct_J = float(scenario.worked_out.itineraries.flight_energy_J[0])
    hover_J = float(vehicle.hover_load(scenario.mission).power_W) * hover_s
    harvested_J = float(vehicle.charging(scenario.mission, 0.0).power_W) * hover_s
    shares = (direct_J / FLIGHT_J, hover_J / HOVER_J, harvested_J / NOMINAL_J)
    return 100.0 * (1.0 + sum(sign * share for sign, share in zip(signs, shares, strict=True)))
