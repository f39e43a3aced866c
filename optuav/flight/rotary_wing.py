"""Flight at the power that a rotary wing draws over air speed, fitted or from a datasheet."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from optuav import physics
from optuav.fields import (
    Acceleration,
    Allowed,
    Current,
    Efficiency,
    LoadPower,
    Power,
    Range,
    Slider,
    Speed,
)
from optuav.flight.model import MODEL, CruisingModel, FlightTable, wind_sliders
from optuav.presentation.numbers import figure
from optuav.tables import BatteryPacks, Body, Wind

if TYPE_CHECKING:
    from optuav.physics.flight import Flow, Loads, SpeedPower
    from optuav.physics.quantity import Quantity, Vector
    from optuav.physics.rotary_wing import CruiseLeg, PowerCoefficients

CruiseRule = Literal["best-range", "best-endurance", "max"]


class RotaryWingFlight(FlightTable):
    """Flight with the power of a rotary wing over its air speed."""

    model: Annotated[Literal["rotary-wing"], MODEL]
    """Flight model: "rotary-wing" computes loads from the power against airspeed."""
    blade_power_W: LoadPower
    """Power of the blades in hover P_0 [W]."""
    induced_power_W: LoadPower
    """Induced power in hover P_i [W]."""
    induced_speed_m_s: Speed
    """Induced speed in hover v_0 [m/s]."""
    tip_speed_m_s: Speed
    """Speed of the blade tips U_tip [m/s]."""
    parasite_W_s3_m3: Annotated[float, Range("W s3/m3", ge=0, le=1e6)]
    """Power of the fuselage over cubed speed, ½d_0ρsA [W s³/m³]."""
    efficiency: Efficiency = 1.0
    """Share of the battery's power that reaches the rotors [-]."""
    acceleration_m_s2: Acceleration
    """Acceleration and braking of a leg [m/s²]."""
    max_speed_m_s: Speed
    """Largest air speed of a leg [m/s]."""
    climb_speed_m_s: Speed
    """Largest vertical speed of a climb [m/s]."""
    descent_speed_m_s: Speed
    """Largest vertical speed of a descent [m/s]."""
    speed: (
        Annotated[
            CruiseRule, Allowed('one of "best-range", "best-endurance", "max"; or cruise_speed_m_s')
        ]
        | None
    ) = None
    """Air speed of legs: "best-range" (also if left out), "best-endurance" or "max"."""
    cruise_speed_m_s: Speed | None = None
    """Speed over ground of all legs [m/s], up to the largest air speed; in place of speed."""
    rest_current_A: Current = 0.0
    """Current at rest [A]."""
    rest_power_W: Power = 0.0
    """Power at rest [W]."""


@dataclass(eq=False)
class RotaryWing(CruisingModel):
    """Power against airspeed, the weight, and a level wind."""

    flight: RotaryWingFlight
    body: Body
    wind: Wind
    battery: BatteryPacks

    name: ClassVar[str] = "rotary-wing"
    table: ClassVar[type[FlightTable]] = RotaryWingFlight
    needs: ClassVar[tuple[str, ...]] = ("body",)
    refuses: ClassVar[tuple[str, ...]] = ("rotor", "air", "wind.force_N", "body.drag_area_m2")

    @cached_property
    def wing(self) -> PowerCoefficients:
        """Coefficients of the power against airspeed."""
        return self.flight.as_record(physics.rotary_wing.PowerCoefficients)

    @property
    def weight_N(self) -> Quantity:
        """Weight [N]."""
        return self.body.mass_kg * self.body.gravity_m_s2

    def cruise_speed_m_s(self, direction: Vector) -> Quantity:
        """Speed over ground along a level direction [m/s]; NaN where the wind is too strong."""
        keys = self.flight
        if keys.cruise_speed_m_s is None:
            return self._ruled_m_s(direction, keys.speed or "best-range")
        if self._never_slowed:
            return keys.cruise_speed_m_s
        limits = keys.max_speed_m_s, self.wind.velocity_m_s, direction
        return physics.rotary_wing.capped(keys.cruise_speed_m_s, *limits)

    @property
    def _never_slowed(self) -> bool:
        """True if a stated cruise speed is below the cap in any direction, whatever varies."""
        speed_m_s, cap_m_s = self.flight.cruise_speed_m_s, self.flight.max_speed_m_s
        wind_m_s = self.wind.velocity_m_s
        if not all(isinstance(speed, int | float) for speed in (speed_m_s, cap_m_s, *wind_m_s)):
            return False
        return bool(speed_m_s + self._wind_speed_m_s <= cap_m_s)

    @property
    def _wind_speed_m_s(self) -> Quantity:
        """Speed of the wind [m/s]."""
        return physics.quantity.norm(self.wind.velocity_m_s)

    def slowed(self, way_m: Vector) -> str | None:
        wanted_m_s, cap_m_s = self.flight.cruise_speed_m_s, self.flight.max_speed_m_s
        if wanted_m_s is None or self._never_slowed:
            return None
        allowed_m_s = self._ruled_m_s(physics.rotary_wing.level_direction(way_m), "max")
        slower = self.leg_at(way_m, wanted_m_s).duration_s < self.leg(way_m).duration_s
        if not slower.any():
            return None
        return (
            f"flight.max_speed_m_s = {figure(cap_m_s)} m/s, an air speed, allows only "
            f"{figure(allowed_m_s[slower].min(), 4)} m/s over ground on a leg, less than "
            f"flight.cruise_speed_m_s = {figure(wanted_m_s)} m/s"
        )

    def _ruled_m_s(self, direction: Vector, rule: str) -> Quantity:
        """Speed over ground along a level direction [m/s] by a rule of `CruiseRule`."""
        cap_m_s, wind_m_s = self.flight.max_speed_m_s, self.wind.velocity_m_s
        wings, air_speed = physics.rotary_wing, cap_m_s
        if rule == "best-range":
            way = (wind_m_s, direction) if _blows(wind_m_s) else ()
            return wings.best_range(self.wing, cap_m_s, *way)
        if rule == "best-endurance":
            air_speed = wings.best_endurance(self.wing, cap_m_s)
        return wings.ground_speed(air_speed, wind_m_s, direction)

    def leg(self, way_m: Vector) -> Loads:
        return self.leg_at(way_m, self.cruise_speed_m_s(physics.rotary_wing.level_direction(way_m)))

    def leg_at(self, way_m: Vector, speed_m_s: Quantity) -> Loads:
        leg = self._leg(way_m, speed_m_s)
        drawn, peak = self._drawn(leg.power_W), leg.peak_speed_m_s
        each = (leg.duration_s,), (drawn.current_A,), (drawn.power_W,)
        return physics.flight.Loads(way_m, ("flight",), *each, peak, leg.rise_s)

    def _leg(self, way_m: Vector, speed_m_s: Quantity) -> CruiseLeg:
        """The leg with its power at the rotors."""
        keys, wind_m_s = self.flight, self.wind.velocity_m_s
        limits = keys.acceleration_m_s2, (keys.climb_speed_m_s, keys.descent_speed_m_s)
        weights = self.weight_N, wind_m_s
        return physics.rotary_wing.leg(self.wing, way_m, speed_m_s, *limits, *weights)

    def named_speed_m_s(self, way_m: Vector, rule: str) -> Quantity:
        ruled_m_s = self._ruled_m_s(physics.rotary_wing.level_direction(way_m), rule)
        leg, a = self._leg(way_m, ruled_m_s), self.flight.acceleration_m_s2
        return physics.rotary_wing.reached(leg, ruled_m_s, a)

    def priced_speed_m_s(self, way_m: Vector, price_A: Quantity) -> Quantity:
        keys, wind_m_s = self.flight, self.wind.velocity_m_s
        # A climb or a descent may take longer; its power does not depend on the speed.
        most_m_s = self.named_speed_m_s(way_m, "max")
        wings, price_W = physics.rotary_wing, price_A / self._drawn(1.0).current_A
        easiest_m_s = wings.best_endurance(self.wing, keys.max_speed_m_s)
        length_m, direction = wings.level_length(way_m), wings.level_direction(way_m)
        leg = self.wing, length_m, keys.acceleration_m_s2
        return wings.priced_speed(*leg, price_W, most_m_s, easiest_m_s, wind_m_s, direction)

    def price_A(self, way_m: Vector, speed_m_s: Quantity) -> Quantity:
        wings, wind_m_s = physics.rotary_wing, self.wind.velocity_m_s
        length_m, direction = wings.level_length(way_m), wings.level_direction(way_m)
        leg = self.wing, length_m, self.flight.acceleration_m_s2
        return self._drawn(wings.price(*leg, speed_m_s, wind_m_s, direction)).current_A

    def level(
        self, length_m: Quantity, direction: Vector, speed_m_s: Quantity
    ) -> tuple[Quantity, Flow]:
        wind_m_s, V = self.wind.velocity_m_s, speed_m_s
        air = physics.rotary_wing.air_speed(V, wind_m_s, direction) if _blows(wind_m_s) else V
        duration_s = length_m / V + V / self.flight.acceleration_m_s2
        return duration_s, self._drawn(physics.rotary_wing.power(self.wing, air))

    def hover(self) -> Flow:
        return self._drawn(self.hover_power_W)

    @property
    def hover_power_W(self) -> Quantity:
        """Power at the rotors in hover, which a wind lowers [W]."""
        wings, wind_m_s = physics.rotary_wing, self.wind.velocity_m_s
        return wings.power(self.wing, wings.air_speed(0.0, wind_m_s, (1.0, 0.0, 0.0)))

    def power_over_speed(self, air_speed_m_s: Quantity) -> SpeedPower:
        wings, wing, cap_m_s = physics.rotary_wing, self.wing, self.flight.max_speed_m_s
        power_W = wings.power(wing, air_speed_m_s)
        named = wings.best_endurance(wing, cap_m_s), wings.best_range(wing, cap_m_s)
        stand_out = ((speed, wings.power(wing, speed)) for speed in named)
        drawn, hover_W = self._drawn(power_W), self.hover_power_W
        return physics.flight.SpeedPower(power_W, drawn, hover_W, cap_m_s, *stand_out)

    def rest(self) -> Flow:
        return physics.flight.Flow(self.flight.rest_current_A, self.flight.rest_power_W)

    def impossible(self) -> str | None:
        if not self.too_windy():
            return None
        wind, cap = self._wind_speed_m_s, self.flight.max_speed_m_s
        keys = "wind.velocity_m_s, flight.max_speed_m_s"
        return (
            f"the wind blows at {figure(wind)} m/s, the UAV flies at {figure(cap)} m/s at most "
            f"({keys})"
        )

    def too_windy(self) -> Quantity:
        return self._wind_speed_m_s > self.flight.max_speed_m_s

    @property
    def has_drag(self) -> bool:
        return True

    @property
    def straight_is_least(self) -> bool:
        return self.flight.cruise_speed_m_s is None and self.flight.speed != "max"

    @property
    def needs_numbers(self) -> str | None:
        has_speed = self.flight.cruise_speed_m_s is not None
        if not _blows(self.wind.velocity_m_s) or (has_speed and self._never_slowed):
            return None
        slower = " that flight.max_speed_m_s allows against the wind" * has_speed
        return (
            "in a wind the speed of a leg depends on its direction; "
            f"set {'a ' * has_speed}flight.cruise_speed_m_s{slower}"
        )

    def figures(self) -> Iterator[tuple[str, float, str]]:
        curve = self.power_over_speed(0.0)
        yield "power in hover without wind", float(curve.power_W), "W"
        yield "air speed of best endurance", float(curve.best_endurance[0]), "m/s"
        yield "air speed of best range", float(curve.best_range[0]), "m/s"

    def sliders(self) -> Iterator[Slider]:
        cap_m_s = math.ceil(self.flight.max_speed_m_s)
        yield from wind_sliders("wind.velocity_m_s", "w", "m/s", cap_m_s)

    @classmethod
    def breaches(cls, document: Mapping[str, Any]) -> Iterator[tuple[tuple[str, ...], str]]:
        if {"speed", "cruise_speed_m_s"} <= document["flight"].keys():
            yield ("flight", "cruise_speed_m_s"), "either speed or cruise_speed_m_s"

    def _drawn(self, power_W: Quantity) -> Flow:
        """Current and power of the battery for a power at the rotors [W]."""
        drawn_W = power_W / self.flight.efficiency
        return physics.flight.Flow(drawn_W / self.battery.nominal_voltage_V, drawn_W)


def _blows(wind_m_s: Vector) -> bool:
    """Return whether a wind blows; a variable wind counts."""
    return any(not isinstance(component, int | float) or component for component in wind_m_s)
