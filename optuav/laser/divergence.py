"""A beam of a constant divergence, as the literature on laser-charged UAVs has it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from optuav import physics
from optuav.fields import Breadth, Range, Slider
from optuav.laser.beam import BEAM, LaserTable, SpreadingBeam
from optuav.physics import beams
from optuav.presentation.numbers import figure
from optuav.tables import LightReceiver

if TYPE_CHECKING:
    from optuav.physics.beams.divergence import Divergence
    from optuav.physics.beams.gaussian import Chain
    from optuav.physics.quantity import Quantity

ROUNDED_EXCESS = 1e-9  # Relative excess of χA over D² that rounding may cause


class DivergingLaser(LaserTable):
    """A laser with a beam of a constant divergence, whose power is its light power."""

    beam: Annotated[Literal["divergence"], BEAM]
    aperture_m: Breadth
    """Diameter D of the aperture [m]."""
    divergence_rad: Annotated[float, Range("rad", ge=0, le=1)]
    """Full angle Δθ of the divergence [rad]."""


@dataclass(eq=False)
class DivergingBeam(SpreadingBeam):
    """P_r = χA P e^(−αd)/(D + dΔθ)², where χ stands for all efficiencies."""

    laser: DivergingLaser
    receiver: LightReceiver

    name: ClassVar[str] = "divergence"
    table: ClassVar[type[LaserTable]] = DivergingLaser
    needs: ClassVar[tuple[str, ...]] = ("receiver", "receiver.area_m2")
    refuses: ClassVar[tuple[str, ...]] = (
        *("receiver.radius_m", "receiver.cell_efficiency", "receiver.dc_efficiency"),
        *("receiver.max_irradiance_W_m2", "receiver.max_power_W"),
        *("flight.charge_current_A", "flight.charge_power_W"),
    )

    @property
    def beam(self) -> Divergence:
        """Emitter and receiver."""
        tables = vars(self.receiver) | vars(self.laser)
        kind = beams.divergence.Divergence
        return kind(*map(tables.__getitem__, kind._fields))

    @property
    def light_W(self) -> Quantity:
        """Light out of the source [W]; NaN where χA > D², which no mission but a batch can have."""
        D, _, A, χ = self.beam
        whole = physics.quantity.one_where_not_negative((1.0 + ROUNDED_EXCESS) * D**2 - χ * A)
        return self.laser.power_W * whole

    def chain(self, distance_m: Quantity) -> Chain:
        import numpy as np

        light_W, share = self.light_W, beams.divergence.share
        air = physics.laser.transmission(self.attenuation_per_km, distance_m)
        # A receiver larger than the beam gets no more than all of it.
        part = np.minimum(share(self.beam._replace(optics_efficiency=1.0), distance_m), 1.0)
        dc_W = light_W * air * share(self.beam, distance_m)
        return beams.gaussian.Chain(light_W, light_W, air, part, light_W * air * part, dc_W)

    def received_W(self, distance_m: Quantity, most_W: Quantity) -> Quantity:
        way = self.attenuation_per_km, distance_m
        return beams.divergence.received_power(self.beam, self.light_W, *way, most_W)

    def enough_W(self, distance_m: Quantity, most_W: Quantity) -> Quantity:
        import numpy as np

        way = self.attenuation_per_km, distance_m
        with np.errstate(divide="ignore"):  # Where no light arrives, no power is enough
            return most_W / beams.divergence.received_power(self.beam, 1.0, *way)

    def peak(self, distance_m: Quantity, *, still: bool = False) -> Quantity:
        return beams.divergence.disc_irradiance(self.beam, distance_m)

    def reach_m(self, dc_W: float, most_W: float) -> float:
        if dc_W > most_W:
            return 0.0
        air = self.attenuation_per_km
        return float(beams.divergence.reach(self.beam, self.light_W, air, dc_W))

    def sliders(self) -> Iterator[Slider]:
        D, Δθ, A, χ = self.beam
        yield Slider("laser.aperture_m", None, "Aperture", "D", "m", (χ * A) ** 0.5, 2.0 * D)
        widest = 2.0 * Δθ or 1e-3
        yield Slider("laser.divergence_rad", None, "Divergence", "Δθ", "rad", 0.0, widest)

    @classmethod
    def breaches(cls, document: Mapping[str, Any]) -> Iterator[tuple[tuple[str, ...], str]]:
        laser, receiver = document["laser"], document.get("receiver")
        table = receiver if isinstance(receiver, dict) else {}
        sizes = laser.get("aperture_m"), table.get("area_m2"), table.get("optics_efficiency", 1.0)
        if not all(isinstance(number, int | float) for number in sizes):
            return
        D, A, χ = sizes
        if χ * A > (1.0 + ROUNDED_EXCESS) * D**2:
            most = f"{figure(D**2 / χ, 10)} [m2], which is laser.aperture_m squared"
            words = f"a number, x <= {most} / receiver.optics_efficiency"
            yield ("receiver", "area_m2"), f"{words}: no receiver gets more light than is sent"
