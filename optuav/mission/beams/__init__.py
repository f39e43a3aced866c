"""The beams that come with the package, one file each."""

from __future__ import annotations

from typing import TYPE_CHECKING

from optuav.mission.beam import BEAMS, SpreadingBeam
from optuav.mission.beams.divergence import DivergingBeam
from optuav.mission.beams.fits import Fits
from optuav.mission.beams.gaussian import GaussianBeam

if TYPE_CHECKING:
    from optuav.mission.beam import Beam
    from optuav.mission.mission import Mission

__all__ = ["BEAMS", "beam_of", "spreading_beam"]
BEAMS.update({beam.name: beam for beam in (GaussianBeam, DivergingBeam)})


def beam_of(mission: Mission) -> Beam:
    """The beam of a mission with a laser."""
    name = mission.laser and mission.laser.beam
    return BEAMS[name](mission) if name else Fits(mission)


def spreading_beam(mission: Mission) -> SpreadingBeam | None:
    """The beam of a mission if it is one that spreads."""
    beam = None if mission.laser is None else beam_of(mission)
    return beam if isinstance(beam, SpreadingBeam) else None
