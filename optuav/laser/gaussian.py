"""A Gaussian beam from an aperture, widened by diffraction, jitter and turbulence."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from optuav import physics
from optuav.fields import Breadth, Efficiency, Range, Slider
from optuav.laser.beam import BATTERY, BEAM, LaserTable, SpreadingBeam
from optuav.physics import beams
from optuav.tables import LightReceiver

if TYPE_CHECKING:
    from optuav.physics.beams.gaussian import Chain, Emitter, Receiver
    from optuav.physics.quantity import Quantity


class GaussianLaser(LaserTable):
    """A laser with a Gaussian beam that spreads by diffraction, jitter and turbulence."""

    beam: Annotated[Literal["gaussian"], BEAM]
    aperture_m: Breadth
    """Diameter D of the aperture [m]."""
    waist_m: Breadth | None = None
    """Radius w_0 at the aperture, at 1/e² of the intensity [m]; without it D/(2√2)."""
    m2: Annotated[float, Range("-", ge=1, le=1e4)] = 1.0
    """Beam quality M² [-]."""
    jitter_rad: Annotated[float, Range("rad", ge=0, le=0.1)] = 0.0
    """Standard deviation σ of the pointing, per axis [rad]."""
    turbulence_cn2: Annotated[float, Range("m^(-2/3)", ge=0, le=1e-8)] = 0.0
    """Strength of the turbulence C_n², the same all along the way [m^(−2/3)]."""
    source_efficiency: Efficiency
    """Light over electric power of the source [-]."""


@dataclass(eq=False)
class GaussianBeam(SpreadingBeam):
    """Diffraction, jitter and turbulence, and a round receiver with limits of its own."""

    laser: GaussianLaser
    receiver: LightReceiver

    name: ClassVar[str] = "gaussian"
    table: ClassVar[type[LaserTable]] = GaussianLaser
    needs: ClassVar[tuple[str, ...]] = (
        *("receiver", "receiver.radius_m", "receiver.cell_efficiency"),
    )
    refuses: ClassVar[tuple[str, ...]] = (
        *("receiver.area_m2", "flight.charge_current_A", "flight.charge_power_W"),
    )

    @cached_property
    def emitter(self) -> Emitter:
        """Laser and telescope."""
        emitter = self.laser.as_record(beams.gaussian.Emitter)
        if emitter.waist_m is not None:
            return emitter
        return emitter._replace(waist_m=beams.gaussian.default_waist(emitter.aperture_m))

    @cached_property
    def limits(self) -> Receiver:
        """The receiver and its limits."""
        table, kind = vars(self.receiver), beams.gaussian.Receiver
        return kind(**{k: v for k in kind._fields if (v := table[k]) is not None})

    def chain(self, distance_m: Quantity) -> Chain:
        way = self.laser.power_W, self.attenuation_per_km, distance_m
        return beams.gaussian.chain(self.emitter, self.limits, *way)

    def received_W(self, distance_m: Quantity, most_W: Quantity) -> Quantity:
        way = self.laser.power_W, self.attenuation_per_km, distance_m
        return beams.gaussian.received_power(self.emitter, self.limits, *way, most_W)

    def enough_W(self, distance_m: Quantity, most_W: Quantity) -> Quantity:
        import numpy as np

        if self.laser.jitter_rad:  # Some of the moments still have less light
            return np.full_like(distance_m, np.inf, dtype=float)[()]
        part = beams.gaussian.share(self.emitter, self.limits.radius_m, distance_m)
        return np.min(self._shares(1.0, distance_m, most_W), axis=0) / part

    def limiting_key(self, distance_m: Quantity, most_W: Quantity) -> Quantity:
        import numpy as np

        names = np.array(("receiver.max_irradiance_W_m2", "receiver.max_power_W", BATTERY))
        return names[np.argmin(self._shares(self.laser.power_W, distance_m, most_W), axis=0)]

    def _shares(self, power_W: float, distance_m: Quantity, most_W: Quantity) -> Quantity:
        """Shares (limit, place) of the arriving light where each limit acts."""
        import numpy as np

        passed = self.laser.source_efficiency * beams.gaussian.aperture_share(self.emitter)
        air = physics.laser.transmission(self.attenuation_per_km, distance_m)
        shares = beams.gaussian.largest_shares(self.limits, power_W * passed * air, most_W)
        return np.array(np.broadcast_arrays(*shares))

    def peak(self, distance_m: Quantity, *, still: bool = False) -> Quantity:
        calm = {"jitter_rad": 0.0, "turbulence_cn2": 0.0} if still else {}
        return beams.gaussian.axis_irradiance(self.emitter._replace(**calm), distance_m)

    @property
    def needs_numbers(self) -> str | None:
        if not self.laser.jitter_rad:
            return None
        return "solvers have no formula for the mean of clipped light; set laser.jitter_rad = 0"

    def limit_warning(self) -> str | None:
        if not self.laser.turbulence_cn2:
            return None
        return (
            "where a limit clips the charging power, the figure is an upper bound: turbulence "
            "makes the light flicker, and only its mean is known (laser.turbulence_cn2)"
        )

    def sliders(self) -> Iterator[Slider]:
        laser, radius_m = self.laser, self.limits.radius_m
        yield Slider("laser.aperture_m", None, "Aperture", "D", "m", 0.01, 2.0 * laser.aperture_m)
        jitter_rad = 2.0 * laser.jitter_rad or 1e-4
        yield Slider("laser.jitter_rad", None, "Pointing jitter", "σ", "rad", 0.0, jitter_rad)
        yield Slider(
            "receiver.radius_m", None, "Radius of receiver", "a", "m", 0.01, 2.0 * radius_m
        )
