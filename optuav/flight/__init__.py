"""The flight models that come with the package, one file each."""

from optuav.flight.model import FLIGHTS
from optuav.flight.regimes import Regimes
from optuav.flight.rotary_wing import RotaryWing
from optuav.flight.rotors import Rotors

__all__ = ["FLIGHTS", "Regimes", "RotaryWing", "Rotors"]

FLIGHTS.update({model.name: model for model in (Rotors, Regimes, RotaryWing)})
