"""The beam of the paper: straight-line fits of emitter and receiver, and the air between."""

from __future__ import annotations

from typing import TYPE_CHECKING

from optuav.mission.beam import Beam
from optuav.mission.schema import Laser

if TYPE_CHECKING:
    from optuav.physics.laser import Conversion
    from optuav.physics.quantity import Quantity, Vector


class Fits(Beam):
    """Straight-line fits by wavelength; no light is lost beside the receiver."""

    @property
    def conversion(self) -> Conversion:
        """Fits of emitter and receiver."""
        from optuav.physics.laser import Conversion

        assert isinstance(self.mission.laser, Laser)
        return self.mission.laser.as_record(Conversion)

    def received_W(self, source_m: Vector, place_m: Vector, most_W: Quantity) -> Quantity:
        from optuav.physics.laser import received_power
        from optuav.physics.quantity import distance

        assert self.mission.laser is not None
        power_W, air = self.mission.laser.power_W, self.attenuation_per_km
        return received_power(self.conversion, power_W, air, distance(source_m, place_m), most_W)

    def enough_W(self, distance_m: Quantity, most_W: Quantity) -> Quantity:
        from optuav.physics.laser import source_limit, transmission

        share = transmission(self.attenuation_per_km, distance_m)
        return source_limit(self.conversion, most_W, share)
