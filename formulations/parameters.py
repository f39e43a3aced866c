"""The quantities that formulations speak of: name, symbol, unit and where each comes from."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import MISSING, Field, dataclass, field, fields
from functools import cached_property
from typing import Any

import numpy as np

from optuav.modelling import Parameter
from optuav.modelling.expression import Operand
from optuav.physics.kibam import Stage

TO_HOVER, FROM_HOVER = "to hover", "from hover"
"""Among the steps of an itinerary, the legs whose figures depend on a free hover point."""


def _quantity(symbol: str, unit: str, key: str = "", *, default: Any = MISSING) -> Any:
    """A field; with a default it may be left out where no constraint speaks of it."""
    return field(default=default, metadata={"symbol": symbol, "unit": unit, "key": key})


@dataclass(frozen=True, kw_only=True)
class Quantities:
    """Numbers of an itinerary, or arrays with one entry an itinerary, or symbols for them.

    Parameters
    ----------
    deadline_s
        T_max, longest mission [s].
    min_soc
        η0, least state of charge at the end [-].
    packs, capacity_As
        Number of packs and capacity of one [A s]; B is their product.
    nominal_voltage_V
        e_nom [V].
    flight_time_s, flight_charge_As, flight_energy_J
        T_fl [s], and charge [A s] and energy [J] drawn on all legs.
    hover_current_A
        Net current drawn while hovering: rotors and radio less the laser's [A].
    hover_power_W, hover_received_W
        Power drawn while hovering, radio included, and received meanwhile [W].
    rest_current_A, rest_received_W
        Net current [A] and power [W] that charge the battery while resting.
    flight_voltage_V, hover_voltage_V
        Mean voltages u_fl and u_hv [V], at which flight and hover draw their charge.
    flight_battery_J, hover_battery_J
        E_1 and E_2 [J], what the full battery holds in flight and in hover, where that is stated;
        None for B u_fl and B u_hv.
    available_fraction, flow_rate_per_s
        ω [-] and k_F [1/s] of the two wells.
    hover_distance_m, coverage_radius_m
        From the hover point to the device, and d_max, at which P_out = ε [m].
    hover_altitude_m, min_altitude_m, max_altitude_m
        z of the hover point, z_min and z_max [m].
    end_gap_m
        By how much the route misses w_0 and w_F [m].
    steps
        What happens on the way: a `kibam.Stage` for every stage of a leg, or a `kibam.Transition`
        for several, ``"hover"`` and ``"rest"`` for the stays. Read by the perspectives `wells` and
        `available` alone.
    tapers
        Whether the charging current falls once y1 = ωB, instead of driving y1 past it.
    rests
        Whether the route goes by way of a building, so that there is a rest time.
    """

    deadline_s: Operand = _quantity("T_max", "s", "limits.deadline_s")
    min_soc: Operand = _quantity("η0", "1", "limits.min_soc")
    packs: Operand = _quantity("N", "1", "battery.packs")
    capacity_As: Operand = _quantity("B_i", "A s", "battery.capacity_As")
    nominal_voltage_V: Operand = _quantity("e_nom", "V", "battery.nominal_voltage_V")
    flight_time_s: Operand = _quantity("T_fl", "s")
    flight_charge_As: Operand = _quantity("Q_fl", "A s")
    flight_energy_J: Operand = _quantity("E_fl", "J")
    hover_current_A: Operand = _quantity("I_hv", "A")
    hover_power_W: Operand = _quantity("P_hv", "W")
    hover_received_W: Operand = _quantity("P_0,hv", "W")
    rest_current_A: Operand = _quantity("I_rest", "A")
    rest_received_W: Operand = _quantity("P_0,rest", "W")
    flight_voltage_V: Operand = _quantity("u_fl", "V", default=math.nan)
    hover_voltage_V: Operand = _quantity("u_hv", "V", default=math.nan)
    flight_battery_J: Operand = _quantity("E_1", "J", "battery.flight_energy_J", default=None)
    hover_battery_J: Operand = _quantity("E_2", "J", "battery.hover_energy_J", default=None)
    available_fraction: Operand = _quantity(
        "ω", "1", "battery.available_fraction", default=math.nan
    )
    flow_rate_per_s: Operand = _quantity("k_F", "1/s", "battery.flow_rate_per_s", default=math.nan)
    hover_distance_m: Operand = _quantity("d", "m", default=math.nan)
    coverage_radius_m: Operand = _quantity("d_max", "m", default=math.nan)
    hover_altitude_m: Operand = _quantity("z", "m", default=math.nan)
    min_altitude_m: Operand = _quantity("z_min", "m", "limits.min_altitude_m", default=math.nan)
    max_altitude_m: Operand = _quantity("z_max", "m", "limits.max_altitude_m", default=math.nan)
    end_gap_m: Operand = _quantity("|w_1 − w_0| + |w_T − w_F|", "m", default=math.nan)
    steps: Sequence[Any] = ()
    tapers: bool = False
    rests: bool = True

    @cached_property
    def known_levels(self) -> list[tuple[Operand, Operand, Operand]]:
        """Wells after every step, by Δ and T', as `formulations.wells.levels` has found them."""
        return []

    @property
    def battery_As(self) -> Operand:
        """B, capacity of all packs [A s]."""
        return self.packs * self.capacity_As

    @property
    def nominal_battery_J(self) -> Operand:
        """E_0 = B e_nom [J]."""
        return self.battery_As * self.nominal_voltage_V

    @property
    def battery_in_flight_J(self) -> Operand:
        """E_1 as stated, or B u_fl [J]."""
        stated_J = self.flight_battery_J
        return self.battery_As * self.flight_voltage_V if stated_J is None else stated_J

    @property
    def battery_in_hover_J(self) -> Operand:
        """E_2 as stated, or B u_hv [J]."""
        stated_J = self.hover_battery_J
        return self.battery_As * self.hover_voltage_V if stated_J is None else stated_J

    @property
    def time_left(self) -> Operand:
        """T_max − T_fl, what the legs leave of the deadline [s]."""
        return self.deadline_s - self.flight_time_s


def symbol_for(quantity: Field[Any], value: Any) -> Parameter | None:
    """The parameter that stands for a quantity in a model; none for one that is not stated."""
    if value is None:
        return None
    meta = quantity.metadata
    return Parameter(quantity.name, meta["symbol"], meta["unit"], value, meta["key"])


def steps_for(steps: Sequence[Any], *, varies: bool = False) -> tuple[Any, ...]:
    """Steps of a model: figures that differ between its itineraries become symbols.

    Parameters of the model, with shadow prices, where they vary.
    """

    def figure(name: str, symbol: str, unit: str, value: Operand) -> Operand:
        return Parameter(name, symbol, unit, value, varies=varies) if np.ndim(value) else value

    return tuple(
        step
        if isinstance(step, str)
        else Stage(
            figure(f"step_{number}_current_A", f"I_{number}", "A", step.current_A),
            figure(f"step_{number}_duration_s", f"t_{number}", "s", step.duration_s),
        )
        for number, step in enumerate(steps, start=1)
    )


QUANTITIES = tuple(each for each in fields(Quantities) if each.metadata)
