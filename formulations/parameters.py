"""The quantities that formulations use, with symbol, unit and key of the mission.

The nomenclature in ``docs/`` says what each stands for.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, dataclass, field, fields
from functools import cached_property
from typing import Any, NamedTuple

from optuav.modelling.expression import Operand
from optuav.physics.kibam import Wells

TO_HOVER, FROM_HOVER = "to hover", "from hover"
"""Among the steps of an itinerary, the legs whose figures depend on a free hover point."""


def _quantity(symbol: str, unit: str, key: str = "", *, default: Any = MISSING) -> Any:
    """A field; with a default it may be left out where no constraint uses it."""
    return field(default=default, metadata={"symbol": symbol, "unit": unit, "key": key})


class MissionFigure(NamedTuple):
    """A number of the mission or of its routes that is no quantity."""

    value: Operand
    unit: str
    key: str = ""  # The mission's key that it comes from, empty if it is derived


class Landing(NamedTuple):
    """The end of a leg that is not the last, at the hover point or on a building."""

    # Drawn by the legs up to it.
    charge_As: Operand
    energy_J: Operand
    stays: tuple[str, ...]  # Before it: "hover" and "rest"
    step: int  # Number of the step that ends there, from 0; -1 without steps


class Hover(NamedTuple):
    """A part of the hover time, over one of several devices, in flight order."""

    share: Operand  # Of Δ
    # As hover_current_A and hover_received_W, at its hover point.
    current_A: Operand
    received_W: Operand


class Covered(NamedTuple):
    """One of several devices with its hover point, in the mission's order."""

    device: str
    distance_m: Operand  # Of the hover point from the device
    altitude_m: Operand  # Of the hover point


@dataclass(frozen=True, kw_only=True)
class Quantities:
    """Numbers of an itinerary, or arrays with one entry an itinerary, or symbols for them."""

    deadline_s: Operand = _quantity("T_max", "s", "limits.deadline_s")
    min_soc: Operand = _quantity("η0", "1", "limits.min_soc")
    packs: Operand = _quantity("N", "1", "battery.packs")
    capacity_As: Operand = _quantity("B_i", "A s", "battery.capacity_As")
    nominal_voltage_V: Operand = _quantity("e_nom", "V", "battery.nominal_voltage_V")
    # Totals of all legs.
    flight_time_s: Operand = _quantity("T_fl", "s")
    flight_charge_As: Operand = _quantity("Q_fl", "A s")
    flight_energy_J: Operand = _quantity("E_fl", "J")
    # While hovering: net current drawn, power drawn with the radio's, and power received.
    hover_current_A: Operand = _quantity("I_hv", "A")
    hover_power_W: Operand = _quantity("P_hv", "W")
    hover_received_W: Operand = _quantity("P_0,hv", "W")
    # While resting: net current and power that charge the battery.
    rest_current_A: Operand = _quantity("I_rest", "A")
    rest_received_W: Operand = _quantity("P_0,rest", "W")
    flight_voltage_V: Operand = _quantity("u_fl", "V", default=math.nan)
    hover_voltage_V: Operand = _quantity("u_hv", "V", default=math.nan)
    # What the full battery holds, None where that is not stated.
    flight_battery_J: Operand = _quantity("E_1", "J", "battery.flight_energy_J", default=None)
    hover_battery_J: Operand = _quantity("E_2", "J", "battery.hover_energy_J", default=None)
    available_fraction: Operand = _quantity(
        "ω", "1", "battery.available_fraction", default=math.nan
    )
    flow_rate_per_s: Operand = _quantity("k_F", "1/s", "battery.flow_rate_per_s", default=math.nan)
    # At the start, None where that is full: of level wells, or both wells.
    start_soc: Operand = _quantity("η_0", "1", "start.soc", default=None)
    start_available_As: Operand = _quantity("y1_0", "A s", "start.available_As", default=None)
    start_bound_As: Operand = _quantity("y2_0", "A s", "start.bound_As", default=None)
    hover_distance_m: Operand = _quantity("d", "m", default=math.nan)
    coverage_radius_m: Operand = _quantity("d_max", "m", default=math.nan)
    hover_altitude_m: Operand = _quantity("z", "m", default=math.nan)
    min_altitude_m: Operand = _quantity("z_min", "m", "limits.min_altitude_m", default=math.nan)
    max_altitude_m: Operand = _quantity("z_max", "m", "limits.max_altitude_m", default=math.nan)
    end_gap_m: Operand = _quantity("|w_1 − w_0| + |w_T − w_F|", "m", default=math.nan)
    # What happens on the way: a `kibam.Stage` for every stage of a leg, or a list of `kibam.Shift`
    # for all of a leg, and "hover" and "rest" for the stays. For the perspectives `wells` and
    # `available` alone.
    steps: Sequence[Any] = ()
    tapers: bool = False  # Whether the charging current falls once y1 = ωB, or drives y1 past it
    rests: bool = True  # Whether the route goes by way of a building, so that there is a rest time
    landings: Sequence[Landing] = ()  # At which η0 must be left as well, in order
    # With several devices: the hovers, which the "hover" among the steps are one after the other,
    # where the way counts; and all devices. The figures of hovering are then means by shares.
    hovers: Sequence[Hover] = ()
    covered: Sequence[Covered] = ()
    # Numbers by name, of a vector by component as ``laser_position_m[2]``; made when asked for
    numbers: Callable[[], Mapping[str, MissionFigure]] = field(
        default=dict, repr=False, compare=False
    )
    # Wells after every step, by Δ and T', as `formulations.soc.levels` has found them.
    known_levels: list[tuple[Operand, Operand, Sequence[Wells]]] = field(
        default_factory=list, init=False, repr=False, compare=False
    )

    @cached_property
    def battery_As(self) -> Operand:
        """B, capacity of all packs [A s]."""
        return self.packs * self.capacity_As

    @property
    def start_share(self) -> Operand:
        """State of charge at the start [-]."""
        if self.start_available_As is not None:
            return (self.start_available_As + self.start_bound_As) / self.battery_As
        return 1.0 if self.start_soc is None else self.start_soc

    @property
    def nominal_battery_J(self) -> Operand:
        """E_0 = B e_nom [J]."""
        return self.battery_As * self.nominal_voltage_V

    @property
    def time_left(self) -> Operand:
        """T_max − T_fl, what the legs leave of the deadline [s]."""
        return self.deadline_s - self.flight_time_s


QUANTITIES = tuple(quantity for quantity in fields(Quantities) if quantity.metadata)
