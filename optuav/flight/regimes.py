"""Flight with constant loads by regime and legs of a stated acceleration."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from optuav import physics
from optuav.fields import Acceleration, Current, LoadCurrent, LoadPower, Power, Speed
from optuav.flight.model import MODEL, FlightModel, FlightTable

if TYPE_CHECKING:
    from optuav.physics.flight import Flow, Loads
    from optuav.physics.quantity import Quantity, Vector

CHARGING = ("charge_current_A", "charge_power_W")


class RegimeFlight(FlightTable):
    """Flight with constant loads by regime and bang-bang legs."""

    model: Annotated[Literal["regimes"], MODEL]
    """Flight model: "regimes" has constant loads in flight, in hover and at rest."""
    acceleration_m_s2: Acceleration
    """Acceleration and braking of a leg [m/s²]."""
    max_speed_m_s: Speed | None = None
    """Largest speed of a leg [m/s]; without it speed has no cap."""
    flight_current_A: LoadCurrent
    """Current in flight [A]."""
    flight_power_W: LoadPower
    """Power in flight [W]."""
    hover_current_A: LoadCurrent
    """Current in hover, communication included [A]."""
    hover_power_W: LoadPower
    """Power in hover, communication included [W]."""
    rest_current_A: Current = 0.0
    """Current at rest [A]."""
    rest_power_W: Power = 0.0
    """Power at rest [W]."""
    charge_current_A: Current | None = None
    """Charging current in sight of the laser [A]; replaces the laser's power model."""
    charge_power_W: Power | None = None
    """Charging power in sight of the laser [W]; replaces the laser's power model."""


@dataclass(eq=False)
class Regimes(FlightModel):
    """Constant current and power in flight, in hover and at rest."""

    flight: RegimeFlight

    name: ClassVar[str] = "regimes"
    table: ClassVar[type[FlightTable]] = RegimeFlight
    refuses: ClassVar[tuple[str, ...]] = ("wind.force_N", "wind.velocity_m_s")
    radio_included: ClassVar[bool] = True

    def leg(self, way_m: Vector) -> Loads:
        keys = self.flight
        cap_m_s = math.inf if keys.max_speed_m_s is None else keys.max_speed_m_s
        drawn = keys.flight_current_A, keys.flight_power_W
        return physics.bang_bang.leg(way_m, keys.acceleration_m_s2, *drawn, cap_m_s)

    def least(self, distance_m: Quantity) -> Loads:
        return self.leg((distance_m, 0.0, 0.0))

    def hover(self) -> Flow:
        return self._flow("hover")

    def rest(self) -> Flow:
        return self._flow("rest")

    @property
    def straight_is_least(self) -> bool:
        return True

    def charging(self) -> Flow | None:
        return None if self.flight.charge_current_A is None else self._flow("charge")

    def _flow(self, regime: str) -> Flow:
        keys = vars(self.flight)
        return physics.flight.Flow(keys[f"{regime}_current_A"], keys[f"{regime}_power_W"])

    @classmethod
    def breaches(cls, document: Mapping[str, Any]) -> Iterator[tuple[tuple[str, ...], str]]:
        charging = [key for key in CHARGING if key in document["flight"]]
        for key in {*CHARGING}.difference(charging) if charging else ():
            yield ("flight", key), f"set together with {charging[0]}"
        if charging and "laser" not in document:
            yield ("laser",), f"needed by flight.{charging[0]}"
