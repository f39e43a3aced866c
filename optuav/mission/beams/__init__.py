"""The beams that come with the package, one file each."""

from __future__ import annotations

from typing import TYPE_CHECKING

from optuav.mission.beams.fits import Fits

if TYPE_CHECKING:
    from optuav.mission.beam import Beam
    from optuav.mission.mission import Mission


def beam_of(mission: Mission) -> Beam:
    """The beam of a mission with a laser."""
    return Fits(mission)
