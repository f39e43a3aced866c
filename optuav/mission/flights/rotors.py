"""Flight computed from rotors and airframe, by the six-stage model.

The physics is imported where it is used: reading a mission needs no numpy.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from optuav.mission.flight_model import MODEL, FlightModel, FlightTable, Slider
from optuav.mission.schema import Air, Speed

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

    @property
    def motor(self) -> Motor:
        """Constants of a rotor."""
        from optuav.physics.rotor import Motor

        assert self.mission.rotor is not None
        return self.mission.rotor.as_record(Motor)

    @property
    def airframe(self) -> Airframe:
        """Mass and inertia."""
        from optuav.physics.six_stages import Airframe

        assert self.mission.body is not None
        return self.mission.body.as_record(Airframe)

    @property
    def external_force_N(self) -> Vector:
        """Gravity and wind [N]."""
        return self.airframe.external_force_N(self.mission.wind.force_N)

    @property
    def largest_level_wind_N(self) -> float:
        """Largest level wind that the rotors can withstand [N]; NaN for too weak rotors."""
        from optuav.physics.rotor import largest_wind

        return float(largest_wind(self.motor, self.airframe.weight_N, (1.0, 0.0, 0.0)))

    @property
    def drag_kg_m(self) -> Quantity:
        """Drag over squared speed [kg/m]."""
        from optuav.physics.drag import coefficient

        body, air = self.mission.body, self.mission.air or Air()
        assert body is not None
        return coefficient(body.drag_area_m2, air.density_kg_m3)

    def six_stage_leg(self, way_m: Vector) -> Leg:
        """The leg with its attitudes and turns."""
        from optuav.physics.six_stages import leg

        assert isinstance(self.mission.flight, RotorFlight)
        cap_m_s, wind_N = self.mission.flight.max_speed_m_s, self.mission.wind.force_N
        limits = self.drag_kg_m, math.inf if cap_m_s is None else cap_m_s
        return leg(self.airframe, self.motor, way_m, wind_N, *limits)

    def leg(self, way_m: Vector) -> Loads:
        return self.six_stage_leg(way_m).loads

    def least(self, distance_m: Quantity) -> Loads | None:
        from optuav.physics.six_stages import least_loads

        capped = getattr(self.mission.flight, "max_speed_m_s", None) is not None
        if capped or self.has_drag:
            return None
        return least_loads(self.airframe, self.motor, distance_m, self.mission.wind.force_N)

    def hover(self) -> Flow:
        from optuav.physics import rotor
        from optuav.physics.flight import Flow

        motor, speed = self.motor, rotor.hover_speed(self.motor, self.external_force_N)
        drawn = rotor.current(motor, speed), rotor.power(motor, speed)
        return Flow(*(rotor.ROTORS * figure for figure in drawn))

    def rest(self) -> Flow:
        from optuav.physics.flight import Flow

        return Flow(0.0, 0.0)

    def state(self, leg: Loads, passed_s: Quantity) -> LegState:
        from optuav.physics.six_stages import state_at

        return state_at(self.six_stage_leg(leg.way_m), passed_s)

    @property
    def has_drag(self) -> bool:
        drag = self.drag_kg_m
        return bool(drag.any() if hasattr(drag, "any") else drag > 0.0)

    def impossible(self) -> str | None:
        from optuav.physics.six_stages import impossible

        why = impossible(self.airframe, self.motor, self.mission.wind.force_N)
        return why and f"{why} (body.mass_kg, wind.force_N, rotor.max_speed_rad_s)"

    def figures(self) -> Iterator[tuple[str, float, str]]:
        from optuav.physics.rotor import full_thrust, hover_speed

        motor = self.motor
        yield "full thrust", float(full_thrust(motor)), "N"
        yield "weight", float(self.airframe.weight_N), "N"
        hover_rad_s = float(hover_speed(motor, self.external_force_N))
        yield "rotor speed in hover", hover_rad_s, "rad/s"
        yield "largest level wind", self.largest_level_wind_N, "N"

    def sliders(self) -> Iterator[Slider]:
        most_N = self.largest_level_wind_N
        most_N = math.ceil(most_N if math.isfinite(most_N) else self.airframe.weight_N)
        for axis, towards in enumerate(("eastward", "northward")):
            words = f"Wind, {towards}", f"F_{'xy'[axis]}", "N"
            yield Slider("wind.force_N", axis, *words, -most_N, most_N)
