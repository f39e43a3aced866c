"""The beam of the paper: straight-line fits of emitter and receiver, and the air between."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

from pydantic import model_validator

from optuav import physics
from optuav.fields import Range
from optuav.laser.beam import BEAM, Beam, LaserTable

if TYPE_CHECKING:
    from optuav.physics.laser import Conversion
    from optuav.physics.quantity import Quantity

_KNOWN = "; known at 810 and 1550 nm"
Slope = Annotated[float, Range("-", ge=1e-6, le=1e3, note=_KNOWN)]
Offset = Annotated[float, Range("W", ge=-1e9, le=1e9, note=_KNOWN)]

_COEFFICIENTS = ("emitter_slope", "emitter_offset_W", "receiver_slope", "receiver_offset_W")
CONVERSIONS: dict[float, dict[str, float]] = {
    810: dict(zip(_COEFFICIENTS, (0.445, -0.75, 0.5414, -0.2313), strict=True)),
    1550: dict(zip(_COEFFICIENTS, (0.34, -1.1, 0.5434, -0.2761), strict=True)),
}
"""Straight-line fits a1, b1, a2, b2 of emitter and receiver by wavelength [nm]."""


class Laser(LaserTable):
    """The charging laser and the air that it shines through.

    Conversion coefficients that are not stated follow from the wavelength at 810 and 1550 nm.
    """

    beam: Annotated[None, BEAM] = None
    emitter_slope: Slope
    """Slope a1 of the emitter's conversion [-]."""
    emitter_offset_W: Offset
    """Offset b1 of the emitter's conversion [W]."""
    receiver_slope: Slope
    """Slope a2 of the receiver's conversion [-]."""
    receiver_offset_W: Offset
    """Offset b2 of the receiver's conversion [W]."""

    @model_validator(mode="before")
    @classmethod
    def _conversion_of_wavelength(cls, stated: object) -> object:
        """Fill in the four coefficients where none is stated and the wavelength gives them."""
        if not isinstance(stated, dict) or not CONVERSIONS[810].keys().isdisjoint(stated):
            return stated
        wavelength = stated.get("wavelength_nm")
        if not isinstance(wavelength, int | float):
            return stated
        return {**stated, **CONVERSIONS.get(wavelength, {})}


@dataclass(eq=False)
class Fits(Beam):
    """Straight-line fits by wavelength; no light is lost beside the receiver."""

    laser: Laser

    @property
    def conversion(self) -> Conversion:
        """Fits of emitter and receiver."""
        return self.laser.as_record(physics.laser.Conversion)

    def received_W(self, distance_m: Quantity, most_W: Quantity) -> Quantity:
        way = self.laser.power_W, self.attenuation_per_km, distance_m
        return physics.laser.received_power(self.conversion, *way, most_W)

    def enough_W(self, distance_m: Quantity, most_W: Quantity) -> Quantity:
        share = physics.laser.transmission(self.attenuation_per_km, distance_m)
        return physics.laser.source_limit(self.conversion, most_W, share)
