"""The beam of the paper: straight-line fits of emitter and receiver, and the air between."""

from __future__ import annotations

from typing import TYPE_CHECKING

from optuav.mission.beam import Beam

if TYPE_CHECKING:
    from optuav.physics.laser import Conversion
    from optuav.physics.quantity import Quantity, Vector


class Fits(Beam):
    """Straight-line fits by wavelength; no light is lost beside the receiver."""

    @property
    def conversion(self) -> Conversion:
        """Fits of emitter and receiver."""
        from optuav.physics.laser import Conversion

        assert self.mission.laser is not None
        return self.mission.laser.as_record(Conversion)

    @property
    def attenuation_per_km(self) -> Quantity:
        """α [1/km] as stated, or from the visibility."""
        from optuav.physics.laser import attenuation

        keys = self.mission.laser
        assert keys is not None
        if keys.attenuation_per_km is not None:
            return keys.attenuation_per_km
        return attenuation(keys.wavelength_nm, keys.visibility_km)

    def received_W(self, source_m: Vector, place_m: Vector, most_W: Quantity) -> Quantity:
        from optuav.physics.laser import received_power
        from optuav.physics.quantity import norm

        assert self.mission.laser is not None
        x, y, z = (end - start for start, end in zip(source_m, place_m, strict=True))
        air = self.attenuation_per_km
        power_W = self.mission.laser.power_W
        return received_power(self.conversion, power_W, air, norm((x, y, z)), most_W)
