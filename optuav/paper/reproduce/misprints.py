"""The misprints of the paper and of the source of its flight model, each with what it would do."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from formulations.perspectives import adjusted
from optuav import plots
from optuav.mission import Mission
from optuav.network import vehicle
from optuav.network.network import build_network
from optuav.paper.ledger.cells import HOVER_J
from optuav.paper.reproduce.exhibit import Exhibit, LeftOut
from optuav.physics import flight, rotor
from optuav.solving.given import quantities

SPEED_RAD_S = 1000.0
PICTURE = "see the picture"
HOVERS_S = np.linspace(0.0, 1000.0, 101)


class Misprint(NamedTuple):
    """Where something is misprinted, what stands there, what is right, and what it would do."""

    place: str
    printed: str
    right: str
    effect: str


def misprints(mission: Mission) -> Iterator[Exhibit | LeftOut]:
    """c_9 where the mission has rotors, the signs of η3 where it has the paper's E_1 and E_2."""
    if mission.name == "paper":
        yield _c9(mission)
    elif mission.name == "paper-table2":
        yield _signs(mission)
    else:
        yield LeftOut("", "it is about the paper's own numbers")


def _c9(mission: Mission) -> Exhibit:
    motor = vehicle.motor(mission)
    changes = np.linspace(-200.0, 200.0, 81)
    right_W = np.asarray(rotor.power(motor, SPEED_RAD_S, changes), dtype=float)
    c6, c9 = (float(rotor.power_coefficients(motor)[number]) for number in (5, 8))
    printed_c9 = motor.torque_constant_Nm_A / motor.friction_torque_Nm * c6
    printed_W = right_W + changes * SPEED_RAD_S**2 * (printed_c9 - c9)
    return Exhibit(
        "misprints.paper",
        f"Power of a rotor at {SPEED_RAD_S:g} rad/s that changes its speed: e·i of eqs (2) and "
        "(3), and the polynomial of eq (4) with c_9 as printed",
        plots.curves(
            [
                plots.Line("voltage × current", changes, right_W / 1000.0),
                plots.Line("polynomial with $c_9$ as printed", changes, printed_W / 1000.0),
            ],
            title=f"A misprint: $c_9$ in the power of a rotor at {SPEED_RAD_S:g} rad/s",
            x_label="change of rotor speed [rad/s²]",
            y_label="power [kW]",
        ),
        [each._asdict() for each in all_misprints(mission)],
        (
            f"As printed c_9 is {printed_c9 / c9:.3g} times what e·i needs; at constant speed it "
            "has no part.",
        ),
    )


def _signs(mission: Mission) -> Exhibit:
    given = quantities(build_network(mission), np.array([0]), rests=False)
    right = np.array([float(adjusted(given, hover, 0.0)[0]) for hover in HOVERS_S])
    at_start = float(adjusted(given, 0.0, 0.0)[0])
    printed = 2.0 * at_start - right
    return Exhibit(
        "signs.paper-table2",
        "η3 on the direct path over the hover time: as printed, and with its two signs put right",
        plots.curves(
            [
                plots.Line("signs put right", HOVERS_S, 100.0 * right),
                plots.Line("as printed", HOVERS_S, 100.0 * printed),
            ],
            title="A misprint: two signs in $η_3$",
            x_label="hover time Δ [s]",
            y_label="charge left $η_3$ [%]",
        ),
        [
            {"hover_time_s": float(hover), "eta3": float(one), "eta3_as_printed": float(other)}
            for hover, one, other in zip(HOVERS_S, right, printed, strict=True)
        ],
        ("As printed the battery would gain charge from hovering.",),
    )


def all_misprints(mission: Mission) -> Iterator[Misprint]:
    """Every misprint we know, with numbers for the mission `paper`."""
    motor, airframe = vehicle.motor(mission), vehicle.airframe(mission)
    leg = flight.leg(airframe, motor, (1000.0, 0.0, 0.0))
    once_s = math.sqrt(2.0 * 1000.0 * (1.0 / leg.acceleration_m_s2 + 1.0 / leg.braking_m_s2))
    inverted_s = math.sqrt(2.0 * 1000.0 * (leg.acceleration_m_s2 + leg.braking_m_s2))
    _, turning_W = flight.turning_load(motor)
    full_W = float(rotor.power(motor, motor.max_speed_rad_s))
    yield Misprint("eq (5)", "c_9 = (κ_T/T_f) c_6", "c_9 = (κ_0/T_f) c_6", PICTURE)
    yield Misprint("eq (25)", "+ E_hv/E_2 − E_harv/E_0", "− E_hv/E_2 + E_harv/E_0", PICTURE)
    yield Misprint("text, E_2", "1032036 J", f"{HOVER_J:.0f} J", "0.03 % of E_2")
    yield Misprint("Table I, ϱ", "N/rad/s", "N s²/rad²", "unit only")
    yield Misprint("Table I, κ_0", "N m/rad/s", "N m s²/rad²", "unit only")
    yield Misprint("Table I, k_F", "no unit", "1/s", "60 times less if it were 1/min")
    yield Misprint(
        "flight model's source, eq (82)",
        "acceleration m/A",
        "A/m",
        f"1 km in {inverted_s:.0f} s instead of {once_s:.2f} s, turns left out",
    )
    yield Misprint(
        "flight model's source, eq (46)",
        "two rotors at v_max",
        "two rotors at v_max/√2",
        f"turns would draw {3.0 * full_W:.0f} W instead of {float(turning_W):.0f} W",
    )
    lift_N = float(rotor.full_thrust(motor)) * math.cos(float(leg.cruise.pitch_rad))
    yield Misprint(
        "flight model's source, Lemma 2",
        "angles that break its own balance of forces",
        "thrust along A u − F_e",
        f"lift on a level leg is then m g: {lift_N:.2f} N",
    )
