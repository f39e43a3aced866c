"""The beam of the paper: straight-line fits of emitter and receiver, and the air between."""

from __future__ import annotations

from typing import TYPE_CHECKING

from optuav import physics
from optuav.mission.beam import Beam
from optuav.mission.schema import Laser

if TYPE_CHECKING:
    from optuav.physics.laser import Conversion
    from optuav.physics.quantity import Quantity


class Fits(Beam):
    """Straight-line fits by wavelength; no light is lost beside the receiver."""

    @property
    def conversion(self) -> Conversion:
        """Fits of emitter and receiver."""
        assert isinstance(self.mission.laser, Laser)
        return self.mission.laser.as_record(physics.laser.Conversion)

    def received_W(self, distance_m: Quantity, most_W: Quantity) -> Quantity:
        assert self.mission.laser is not None
        way = self.mission.laser.power_W, self.attenuation_per_km, distance_m
        return physics.laser.received_power(self.conversion, *way, most_W)

    def enough_W(self, distance_m: Quantity, most_W: Quantity) -> Quantity:
        share = physics.laser.transmission(self.attenuation_per_km, distance_m)
        return physics.laser.source_limit(self.conversion, most_W, share)
