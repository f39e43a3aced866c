"""What the paper sets: the scenario of its section V, and Table I.

Settings are taken as given, and the ledger checks that `paper` has them. Where another source or
arithmetic gives one of them again, that is our value.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

from optuav.network import vehicle
from optuav.paper.ledger.scenario import Scenario
from optuav.paper.ledger.statement import Statement, Value
from optuav.physics import laser

TEXT = "section V, settings"
TABLE = "Table I"
CELL_V = 3.7
"""Nominal voltage of a LiPo cell [V]."""
PROPELLER_RADIUS_M, AIR_KG_M3, THRUST_COEFFICIENT, TORQUE_COEFFICIENT = (
    0.12,
    1.225,
    4.8e-3,
    2.3515e-4,
)
"""The propeller of Morbidi et al. (2016), from which ϱ and κ_0 follow."""
CLEAR_AIR_KM = 10.0
"""Visibility at which Zhang et al. (2018) take the attenuation of clear air [km]."""

KEYS = (
    (TEXT, "origin w_0", "[0, 0, 50]", "m", "route.origin_m"),
    (TEXT, "destination w_F", "[2000, 0, 50]", "m", "route.destination_m"),
    (TEXT, "laser w_s", "[1000, 0, 50]", "m", "laser.position_m"),
    (TEXT, "ground device w_u", "[1000, 3000, 0]", "m", "link.device_m"),
    (TEXT, "time slot, stated twice", "1", "s", "limits.slot_s"),
    (TEXT, "packs", "2", "", "battery.packs"),
    (TEXT, "capacity of a pack B_1 = B_2", "36000", "A s", "battery.capacity_As"),
    (TEXT, "nominal voltage of a pack", "11.1", "V", "battery.nominal_voltage_V"),
    (TEXT, "path-loss exponent β", "2", "", "link.path_loss_exponent"),
    (TEXT, "Rice factor K", "20", "", "link.rice_factor"),
    (TEXT, "noise power N_0", "1e-4", "W", "link.noise_power_W"),
    (TEXT, "SNR threshold γ_th", "-11", "dB", "link.snr_threshold_dB"),
    (TEXT, "outage limit ε", "1e-2", "", "limits.outage_probability"),
    (TEXT, "lowest altitude z_min", "50", "m", "limits.min_altitude_m"),
    (TEXT, "highest altitude z_max", "100", "m", "limits.max_altitude_m"),
    (TABLE, "largest rotor speed v_max", "1060", "rad/s", "rotor.max_speed_rad_s"),
    (TABLE, "mass m", "1.3", "kg", "body.mass_kg"),
    (TABLE, "emitter slope a_1", "0.34", "", "laser.emitter_slope"),
    (TABLE, "emitter offset b_1", "-1.1", "W", "laser.emitter_offset_W"),
    (TABLE, "receiver slope a_2", "0.5434", "", "laser.receiver_slope"),
    (TABLE, "receiver offset b_2", "-0.2761", "W", "laser.receiver_offset_W"),
    (TABLE, "wavelength λ", "1550", "nm", "laser.wavelength_nm"),
    (TABLE, "transmit power P_u", "5", "W", "link.transmit_power_W"),
    (TABLE, "motor friction T_f", "0.04", "N m", "rotor.friction_torque_Nm"),
    (TABLE, "winding resistance R", "0.2", "Ω", "rotor.resistance_ohm"),
    (TABLE, "velocity constant κ_V", "920", "rpm/V", "rotor.velocity_constant_rpm_V"),
    (TABLE, "split of the wells ω", "0.8", "", "battery.available_fraction"),
    (TABLE, "nominal voltage e_nom", "11.1", "V", "battery.nominal_voltage_V"),
    (TABLE, "charging current I_ch", "10", "A", "battery.charge_current_A"),
    (TABLE, "viscous damping D_f", "2e-4", "N m s/rad", "rotor.viscous_damping_Nm_s_rad"),
    (TABLE, "transceiver voltage e_tr", "1", "V", "link.transmit_voltage_V"),
    (TABLE, "rotor inertia J", "4.1904e-5", "kg m²", "rotor.inertia_kg_m2"),
    (TABLE, "flow rate k_F", "4.5e-5", "1/s", "battery.flow_rate_per_s"),
)
BARE = "printed without a unit"
REASONS = {
    "battery.flow_rate_per_s": f"{BARE}; per second fits the literature's lifetimes",
    "link.rice_factor": "a ratio, not dB",
    "link.noise_power_W": f"{BARE}; eq (17) needs that of P_u",
    "laser.emitter_offset_W": f"{BARE}; eq (10) needs that of a power",
    "laser.receiver_offset_W": f"{BARE}; eq (10) needs that of a power",
}


def statements() -> Iterator[Statement]:
    """Every setting."""
    for place, what, stated, unit, key in KEYS:
        yield Statement(
            name=_name(place, key),
            place=place,
            what=what,
            stated=stated,
            unit=unit,
            how=f"{key} of the mission",
            compute=_value_of(key),
            reason=REASONS.get(key, ""),
            command="optuav show paper",
            given=True,
        )
    yield from _counted()
    yield from _derived()
    yield from _from_other_sources()


def _name(place: str, key: str) -> str:
    section, _, rest = key.partition(".")
    where = "table1" if place == TABLE else "text"
    return f"{where}-{section}-{rest}".replace("_", "-").lower()


def _value_of(key: str) -> Callable[[Scenario], Value]:
    section, _, name = key.partition(".")

    def value(scenario: Scenario) -> Value:
        stated: Any = getattr(getattr(scenario.mission, section), name)
        if isinstance(stated, tuple):
            return "[" + ", ".join(f"{each:g}" for each in stated) + "]"
        return float(stated)

    return value


def _counted() -> Iterator[Statement]:
    yield Statement(
        name="text-buildings",
        place="section IV",
        what="number of buildings",
        stated="10",
        how="buildings of the mission",
        compute=lambda s: float(len(s.mission.buildings)),
        command="optuav show paper",
        given=True,
    )
    yield Statement(
        name="text-building-heights",
        place=TEXT,
        what="heights of the buildings",
        stated="{60, 80, 100}",
        unit="m",
        how="roofs of the mission's buildings",
        compute=_heights,
        reason="their places and footprints are not in the paper; ours keep its order",
        command="optuav show paper",
        given=True,
    )


def _heights(scenario: Scenario) -> str:
    roofs = sorted({building.position_m[2] for building in scenario.mission.buildings})
    return "{" + ", ".join(f"{roof:g}" for roof in roofs) + "}"


def _derived() -> Iterator[Statement]:
    yield Statement(
        name="text-weight",
        place=TEXT,
        what="external force F_e along z",
        stated="-12.74",
        unit="N",
        how="−m g with m of Table I and g = 9.8 m/s²",
        compute=lambda s: -float(vehicle.airframe(s.mission).weight_N),
    )
    yield Statement(
        name="text-cells",
        place=TEXT,
        what="cells in series, 3S",
        stated="3",
        how="11.1 V over the 3.7 V of a LiPo cell",
        compute=lambda s: s.mission.battery.nominal_voltage_V / CELL_V,
    )
    yield Statement(
        name="text-capacity-ah",
        place=TEXT,
        what="capacity of a pack in ampere-hours",
        stated="10",
        unit="A h",
        how="36 000 A s over 3600 s/h",
        compute=lambda s: s.mission.battery.capacity_As / 3600.0,
    )
    yield Statement(
        name="text-nominal-energy",
        place=TEXT,
        what="nominal energy E_0 = 2 × (36 000 × 11.1)",
        stated="799200",
        unit="J",
        how="B e_nom",
        compute=lambda s: (
            float(vehicle.pool(s.mission).capacity_As) * s.mission.battery.nominal_voltage_V
        ),
    )


def _from_other_sources() -> Iterator[Statement]:
    disc_m2 = math.pi * PROPELLER_RADIUS_M**2
    blade = AIR_KG_M3 * disc_m2 * PROPELLER_RADIUS_M**2
    yield Statement(
        name="table1-lift-coefficient",
        place=TABLE,
        what="lift coefficient ϱ",
        stated="3.8305e-6",
        unit="N s²/rad²",
        how="C_T × air × disc × r², for the propeller of Morbidi et al.",
        compute=lambda _: THRUST_COEFFICIENT * blade,
        reason="printed in N/rad/s; a thrust that grows with v² needs N s²/rad²",
    )
    yield Statement(
        name="table1-drag-coefficient",
        place=TABLE,
        what="drag coefficient κ_0",
        stated="2.2518e-8",
        unit="N m s²/rad²",
        how="C_Q × air × disc × r³, for the propeller of Morbidi et al.",
        compute=lambda _: TORQUE_COEFFICIENT * blade * PROPELLER_RADIUS_M,
        reason="printed in N m/rad/s; a torque that grows with v² needs N m s²/rad²",
    )
    yield Statement(
        name="table1-rpm-per-rad-s",
        place=TABLE,
        what="factor in κ_E = κ_T = 9.5493/κ_V",
        stated="9.5493",
        unit="rpm s/rad",
        how="60/(2π)",
        compute=lambda _: 60.0 / (2.0 * math.pi),
    )
    yield Statement(
        name="table1-attenuation",
        place=TABLE,
        what="attenuation α",
        stated="0.1019",
        unit="1/km",
        how="Kim's model at 1550 nm and 10 km of visibility",
        compute=lambda s: float(laser.attenuation(_wavelength_nm(s), CLEAR_AIR_KM)),
        reason=f"{BARE}; per kilometre is what Kim's model gives",
    )
    yield Statement(
        name="text-c-rate",
        place="section III-B",
        what="charging current in capacities per hour, at most 1 C",
        stated="1",
        unit="C",
        how="I_ch over the capacity of a pack in A h",
        compute=lambda s: (
            s.mission.battery.charge_current_A / (s.mission.battery.capacity_As / 3600.0)
        ),
        reason="I_ch is just at the recommended limit",
    )


def _wavelength_nm(scenario: Scenario) -> float:
    assert scenario.mission.laser is not None
    return scenario.mission.laser.wavelength_nm
