"""The flight models that come with the package, one file each."""

from optuav.mission.flight_model import FLIGHTS
from optuav.mission.flights.regimes import Regimes
from optuav.mission.flights.rotary_wing import RotaryWing
from optuav.mission.flights.rotors import Rotors

FLIGHTS.update({model.name: model for model in (Rotors, Regimes, RotaryWing)})
