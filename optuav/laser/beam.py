"""The base classes of beams, and the registry that [laser] chooses from."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from numbers import Real
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from optuav import physics
from optuav.fields import MadeOfTables, MissionSection, OneOf, Position, Power, Range, Slider
from optuav.presentation.numbers import figure

if TYPE_CHECKING:
    from optuav.physics.beams.gaussian import Chain
    from optuav.physics.quantity import Quantity

BEAMS: dict[str, type[Beam]] = {}
"""Beams by name; one that is added here can be stated as ``laser.beam``."""

BEAM = OneOf(BEAMS)
BATTERY = "battery.charge_current_A"  # Key of the limit that the battery sets


class LaserTable(MissionSection):
    """The charging laser and the air that it shines through."""

    beam: Annotated[str | None, BEAM] = None
    """Model of the beam's spread; without it straight-line fits stand for beam and receiver."""
    position_m: Position
    """Source w_s (x, y, z) [m]."""
    power_W: Power
    """Largest source power P_s; for "divergence" of light, else electrical [W]."""
    wavelength_nm: Annotated[float, Range("nm", ge=1, le=1e6)]
    """Wavelength λ [nm]."""
    visibility_km: Annotated[float, Range("km", ge=1e-3, le=1e4)] | None = None
    """Visibility V [km], which gives the attenuation; or set attenuation_per_km."""
    attenuation_per_km: Annotated[float, Range("1/km", ge=0, le=1e4)] | None = None
    """Attenuation α [1/km]; or set visibility_km."""


@dataclass(eq=False)
class Beam(MadeOfTables, ABC):
    """Model of how much of the laser's light becomes electric power at a place.

    A beam is one class in one file. Its constructor takes the tables of a mission that it is made
    of by their names: ``laser``, and maybe ``receiver``. Its quantities may be numbers, arrays or
    symbols, as in `optuav.physics`. Tables and keys of the mission, and their descriptions, follow
    from the declaration.
    """

    name: ClassVar[str]  # As ``laser.beam`` states it
    table: ClassVar[type[LaserTable]]  # The form of [laser] with the keys of the beam
    needs: ClassVar[tuple[str, ...]] = ()  # Other tables, and dotted keys of them
    refuses: ClassVar[tuple[str, ...]] = ()  # Dotted keys that have no meaning

    laser: LaserTable

    def _on_arrays(self) -> None:
        import numpy as np

        some_m = np.array([[100.0, 200.0]])
        for method in (self.received_W, self.enough_W):
            value = method(some_m, 100.0)
            self._expect(method.__name__, value, (Real, np.ndarray), "a number or an array [W]")

    @property
    def attenuation_per_km(self) -> Quantity:
        """α [1/km] as stated, or from the visibility."""
        if self.laser.attenuation_per_km is not None:
            return self.laser.attenuation_per_km
        return physics.laser.attenuation(self.laser.wavelength_nm, self.laser.visibility_km)

    @abstractmethod
    def received_W(self, distance_m: Quantity, most_W: Quantity) -> Quantity:
        """Mean power received at a distance in sight [W]; the battery takes at most so much [W]."""

    @abstractmethod
    def enough_W(self, distance_m: Quantity, most_W: Quantity) -> Quantity:
        """Source power [W] beyond which reception stays constant; infinite if none is enough."""

    def limiting_key(self, distance_m: Quantity, most_W: Quantity) -> Quantity:
        """Key of the limit that acts first as the light grows; by place for an array."""
        return BATTERY

    @property
    def needs_numbers(self) -> str | None:
        """A sentence on why places cannot be symbols; None where they can."""
        return None

    def sliders(self) -> Iterator[Slider]:
        """Keys worth moving by hand."""
        yield from ()

    def limit_warning(self) -> str | None:
        """A sentence on what limited power is where a limit acts; None where it is exact."""
        return None

    @classmethod
    def breaches(cls, document: Mapping[str, Any]) -> Iterator[tuple[tuple[str, ...], str]]:
        """Keys that break rules for several keys, and their allowed values."""
        yield from ()


class SpreadingBeam(Beam):
    """A beam that spreads, and a receiver of some size: it has a link budget and an eye limit."""

    @abstractmethod
    def chain(self, distance_m: Quantity) -> Chain:
        """The stations of the light on the way to a distance [m], before any limit."""

    @abstractmethod
    def peak(self, distance_m: Quantity, *, still: bool = False) -> Quantity:
        """Mean irradiance on the axis per watt that gets there [1/m²].

        The still beam is one without jitter and turbulence.
        """

    def reach_m(self, dc_W: float, most_W: float) -> float:
        """Largest distance [m] that receives a power [W]: 0 for none, infinite for all."""

        def excess_W(away_m: Quantity) -> Quantity:
            return self.received_W(away_m, most_W) - dc_W

        return float(physics.roots.last_nonnegative(excess_W, 1.0))

    @property
    def eye_limit_W_m2(self) -> float:
        """Largest irradiance for the eye [W/m²]; NaN where none is known for the wavelength."""
        return float(physics.eye.exposure_limit(self.laser.wavelength_nm))

    @property
    def hazard_distance_m(self) -> float:
        """Distance [m] where the still beam, whole before its aperture, falls to the eye limit."""

        def irradiance(distance_m: Quantity) -> Quantity:
            return self.peak(distance_m, still=True)

        light_W = self.chain(0.0).light_W
        air, limit = self.attenuation_per_km, self.eye_limit_W_m2
        return float(physics.eye.hazard_distance(irradiance, light_W, air, limit))

    @property
    def eye_warning(self) -> str:
        """A sentence on how far the beam is dangerous to the eye."""
        limit, distance_km = self.eye_limit_W_m2, self.hazard_distance_m / 1000.0
        no_assessment = "this is not a safety assessment"
        if math.isnan(limit):
            return f"no limit for the eye is known at this wavelength; {no_assessment}"
        return (
            f"the beam exceeds the limit for the eye, {figure(limit, 4)} W/m², up to "
            f"{figure(distance_km, 4)} km from the laser; {no_assessment}"
        )
