"""Flight computed from rotors and airframe, by the six-stage model."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from optuav import physics
from optuav.mission.flight_model import MODEL, FlightModel, FlightTable, Slider, wind_sliders
from optuav.mission.schema import Air, Speed

if TYPE_CHECKING:
    from optuav.physics.flight import Flow, LegState, Loads
    from optuav.physics.quantity import Quantity, Vector
    from optuav.physics.rotor import Motor
    from optuav.physics.six_stages import Airframe, Leg

STANDARD_AIR = Air()


class RotorFlight(FlightTable):
    """Flight computed from rotor and airframe."""

    model: Annotated[Literal["rotors"], MODEL] = "rotors"
    """Flight model: "rotors" computes loads and legs from [rotor] and [body]."""
    max_speed_m_s: Speed | None = None
    """Largest speed over ground of a leg [m/s]; without it speed has no cap."""


class Rotors(FlightModel):
    """Rotors with their motors, an airframe, and a steady wind force."""

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
        assert self.mission.rotor is not None
        return self.mission.rotor.as_record(physics.rotor.Motor)

    @cached_property
    def airframe(self) -> Airframe:
        """Mass and inertia."""
        assert self.mission.body is not None
        return self.mission.body.as_record(physics.six_stages.Airframe)

    @property
    def external_force_N(self) -> Vector:
        """Gravity and wind [N]."""
        return self.airframe.external_force_N(self.mission.wind.force_N)

    @property
    def largest_level_wind_N(self) -> float:
        """Largest level wind that the rotors can withstand [N]; NaN for too weak rotors."""
        weight_N = self.airframe.weight_N
        return float(physics.rotor.largest_wind(self.motor, weight_N, (1.0, 0.0, 0.0)))

    @property
    def drag_kg_m(self) -> Quantity:
        """Drag over squared speed [kg/m]."""
        body, air = self.mission.body, self.mission.air or STANDARD_AIR
        assert body is not None
        return physics.drag.coefficient(body.drag_area_m2, air.density_kg_m3)

    def six_stage_leg(self, way_m: Vector) -> Leg:
        """The leg with its attitudes and turns."""
        assert isinstance(self.mission.flight, RotorFlight)
        cap_m_s, wind_N = self.mission.flight.max_speed_m_s, self.mission.wind.force_N
        limits = self.drag_kg_m, math.inf if cap_m_s is None else cap_m_s
        return physics.six_stages.leg(self.airframe, self.motor, way_m, wind_N, *limits)

    def leg(self, way_m: Vector) -> Loads:
        return self.six_stage_leg(way_m).loads

    def least(self, distance_m: Quantity) -> Loads | None:
        capped = getattr(self.mission.flight, "max_speed_m_s", None) is not None
        if capped or self.has_drag:
            return None
        wind_N = self.mission.wind.force_N
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

    def impossible(self) -> str | None:
        why = physics.six_stages.impossible(self.airframe, self.motor, self.mission.wind.force_N)
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
