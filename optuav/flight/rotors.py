"""Flight computed from rotors and airframe, by the six-stage model."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from optuav import physics
from optuav.fields import Slider, Speed
from optuav.flight.model import MODEL, FlightModel, FlightTable, wind_sliders
from optuav.tables import Air, Body, Rotor, Wind

if TYPE_CHECKING:
    from optuav.physics.flight import Flow, LegState, Loads
    from optuav.physics.quantity import Quantity, Vector
    from optuav.physics.rotor import Motor
    from optuav.physics.six_stages import Airframe, Leg


class RotorFlight(FlightTable):
    """Flight computed from rotor and airframe."""

    model: Annotated[Literal["rotors"], MODEL] = "rotors"
    """Flight model: "rotors" computes loads and legs from [rotor] and [body]."""
    max_speed_m_s: Speed | None = None
    """Largest speed over ground of a leg [m/s]; without it speed has no cap."""


@dataclass(eq=False)
class Rotors(FlightModel):
    """Rotors with their motors, an airframe, and a steady wind force."""

    flight: RotorFlight
    rotor: Rotor
    body: Body
    wind: Wind
    air: Air = Air()

    name: ClassVar[str] = "rotors"
    table: ClassVar[type[FlightTable]] = RotorFlight
    needs: ClassVar[tuple[str, ...]] = (
        "rotor",
        "body",
        *(f"body.{key}" for key in ("arm_length_m", *(f"inertia_{k}_kg_m2" for k in "xyz"))),
    )
    refuses: ClassVar[tuple[str, ...]] = ("wind.velocity_m_s",)

    @cached_property
    def motor(self) -> Motor:
        """Constants of a rotor."""
        return self.rotor.as_record(physics.rotor.Motor)

    @cached_property
    def airframe(self) -> Airframe:
        """Mass and inertia."""
        return self.body.as_record(physics.six_stages.Airframe)

    @property
    def external_force_N(self) -> Vector:
        """Gravity and wind [N]."""
        return self.airframe.external_force_N(self.wind.force_N)

    @property
    def largest_level_wind_N(self) -> float:
        """Largest level wind that the rotors can withstand [N]; NaN for too weak rotors."""
        weight_N = self.airframe.weight_N
        return float(physics.rotor.largest_wind(self.motor, weight_N, (1.0, 0.0, 0.0)))

    @property
    def drag_kg_m(self) -> Quantity:
        """Drag over squared speed [kg/m]."""
        return physics.drag.coefficient(self.body.drag_area_m2, self.air.density_kg_m3)

    def six_stage_leg(self, way_m: Vector) -> Leg:
        """The leg with its attitudes and turns."""
        cap_m_s, wind_N = self.flight.max_speed_m_s, self.wind.force_N
        limits = self.drag_kg_m, math.inf if cap_m_s is None else cap_m_s
        return physics.six_stages.leg(self.airframe, self.motor, way_m, wind_N, *limits)

    def leg(self, way_m: Vector) -> Loads:
        return self.six_stage_leg(way_m).loads

    def least(self, distance_m: Quantity) -> Loads | None:
        if self.flight.max_speed_m_s is not None or self.has_drag:
            return None
        wind_N = self.wind.force_N
        return physics.six_stages.least_loads(self.airframe, self.motor, distance_m, wind_N)

    def hover(self) -> Flow:
        motor, rotor = self.motor, physics.rotor
        speed = rotor.hover_speed(motor, self.external_force_N)
        drawn = rotor.current(motor, speed), rotor.power(motor, speed)
        return physics.flight.Flow(*(rotor.ROTORS * figure for figure in drawn))

    def rest(self) -> Flow:
        return physics.flight.Flow(0.0, 0.0)

    def state(self, leg: Loads, passed_s: Quantity) -> LegState:
        return physics.six_stages.state_at(self.six_stage_leg(leg.way_m), passed_s)

    @property
    def has_drag(self) -> bool:
        drag = self.drag_kg_m
        return bool(drag.any() if hasattr(drag, "any") else drag > 0.0)

    @property
    def straight_is_least(self) -> bool:
        return not self.has_drag

    def impossible(self) -> str | None:
        why = physics.six_stages.impossible(self.airframe, self.motor, self.wind.force_N)
        return why and f"{why} (body.mass_kg, wind.force_N, rotor.max_speed_rad_s)"

    def figures(self) -> Iterator[tuple[str, float, str]]:
        motor = self.motor
        yield "full thrust", float(physics.rotor.full_thrust(motor)), "N"
        yield "weight", float(self.airframe.weight_N), "N"
        hover_rad_s = float(physics.rotor.hover_speed(motor, self.external_force_N))
        yield "rotor speed in hover", hover_rad_s, "rad/s"
        yield "largest level wind", self.largest_level_wind_N, "N"

    def sliders(self) -> Iterator[Slider]:
        most_N = self.largest_level_wind_N
        most_N = math.ceil(most_N if math.isfinite(most_N) else self.airframe.weight_N)
        yield from wind_sliders("wind.force_N", "F", "N", most_N)
