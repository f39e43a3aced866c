"""The beams that come with the package, one file each."""

from optuav.laser.beam import BEAMS
from optuav.laser.divergence import DivergingBeam
from optuav.laser.gaussian import GaussianBeam

__all__ = ["BEAMS", "DivergingBeam", "GaussianBeam"]

BEAMS.update({beam.name: beam for beam in (GaussianBeam, DivergingBeam)})
