"""The base class of flight models and the registry that [flight] chooses from."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from optuav import physics
from optuav.fields import (
    Allowed,
    Altitude,
    Clearance,
    MadeOfTables,
    MissionSection,
    OneOf,
    Slider,
    Switch,
)
from optuav.options import Obstacles

if TYPE_CHECKING:
    from optuav.physics.flight import Flow, LegState, Loads, SpeedPower
    from optuav.physics.quantity import Quantity, Vector

FLIGHTS: dict[str, type[FlightModel]] = {}
"""Flight models by name; one that is added here can be stated as ``flight.model``."""

MODEL = OneOf(FLIGHTS)
OBSTACLES = Allowed('one of "refuse", "ignore", "over", "around"')
BENT = ("over", "around")
"""Rules that bend a leg around a building that blocks it."""
BENDING = ("clearance_m", "max_altitude_m")
"""Keys that go with these rules only."""


def wind_sliders(key: str, symbol: str, unit: str, most: float) -> Iterator[Slider]:
    """The level components of a wind, up to a strength."""
    for axis, direction in enumerate(("eastward", "northward")):
        words = f"Wind, {direction}", f"{symbol}_{'xy'[axis]}", unit
        yield Slider(key, axis, *words, -most, most)


class FlightTable(MissionSection):
    """The flight of legs, and its power."""

    model: Annotated[str, MODEL]
    """Flight model."""
    obstacles: Annotated[Obstacles, OBSTACLES] | None = None
    """Legs that a building blocks: "refuse" (also if left out), "ignore", "over" or "around"."""
    clearance_m: Clearance | None = None
    """Distance that bent ways keep from buildings [m]; 5 if left out."""
    max_altitude_m: Altitude | None = None
    """Largest altitude of the waypoints of bent ways [m]; 10 000 if left out."""
    through_buildings: Switch | None = None
    """True lets a leg cross a building; true is obstacles = "ignore", false "refuse"."""

    @property
    def obstacle_rule(self) -> Obstacles:
        """Rule for legs that a building blocks."""
        return self.obstacles or ("ignore" if self.through_buildings else "refuse")


@dataclass(eq=False)
class FlightModel(MadeOfTables, ABC):
    """Model of a UAV's flight and power: the figures of legs, hover and rest.

    A model is one class in one file. Its constructor takes the tables of a mission that it is made
    of by their names, such as ``flight``, ``body`` and ``wind``. Its quantities may be numbers,
    arrays over missions or legs, or symbols, as in `optuav.physics`.
    """

    name: ClassVar[str]  # As ``flight.model`` states it
    table: ClassVar[type[FlightTable]]  # The form of [flight] with the keys of the model
    needs: ClassVar[tuple[str, ...]] = ()  # Other tables of the mission
    refuses: ClassVar[tuple[str, ...]] = ()  # Dotted keys that have no meaning, unless 0
    radio_included: ClassVar[bool] = False  # Whether `hover` counts the radio

    flight: FlightTable

    def _on_arrays(self) -> None:
        import numpy as np

        some_m = np.array([[100.0, 200.0]])
        flight = physics.flight
        self._expect("hover", self.hover(), flight.Flow, "a Flow")
        self._expect("rest", self.rest(), flight.Flow, "a Flow")
        self._expect("leg", self.leg((some_m, some_m, some_m)), flight.Loads, "Loads")

    @abstractmethod
    def leg(self, way_m: Vector) -> Loads:
        """Legs from rest to rest along ways (x, y, z) [m]."""

    def least(self, distance_m: Quantity) -> Loads | None:
        """Loads that draw no more than any leg of a length [m]; None if none are known."""
        return None

    @abstractmethod
    def hover(self) -> Flow:
        """Return what hovering draws; NaN where the UAV cannot hold its place."""

    @abstractmethod
    def rest(self) -> Flow:
        """Return what resting on a roof draws."""

    def state(self, leg: Loads, passed_s: Quantity) -> LegState:
        """State on one leg at moments since it began [s].

        By default the speed rises evenly to its peak, stays there, and falls for as long as it
        rose.
        """
        return physics.bang_bang.state_at(leg, passed_s)

    def impossible(self) -> str | None:
        """A sentence on why no leg can be flown, with the keys that decide; None if legs can."""
        return None

    def too_windy(self) -> Quantity:
        """Return whether the wind is faster than the UAV can fly; also columns."""
        return False

    def slowed(self, way_m: Vector) -> str | None:
        """A sentence on a limit that keeps legs below their stated speed; None where none does."""
        return None

    @property
    def has_drag(self) -> bool:
        """True if the air slows the UAV down in this model."""
        return False

    @property
    def straight_is_least(self) -> bool:
        """True if no way with stops draws less charge, or takes less time, than a straight leg.

        A stop may save charge where legs are faster than is best for the charge.
        """
        return False

    @property
    def needs_numbers(self) -> str | None:
        """A sentence on why ways cannot be symbols; None where they can."""
        return None

    def power_over_speed(self, air_speed_m_s: Quantity) -> SpeedPower | None:
        """Return what level flight draws at air speeds [m/s]; None if the model cannot tell."""
        return None

    def charging(self) -> Flow | None:
        """Return the charging in sight of the laser that the mission states, or None."""
        return None

    def figures(self) -> Iterator[tuple[str, float, str]]:
        """Names, values and units that follow from only the tables."""
        yield from ()

    def sliders(self) -> Iterator[Slider]:
        """Keys worth moving by hand."""
        yield from ()

    @classmethod
    def breaches(cls, document: Mapping[str, Any]) -> Iterator[tuple[tuple[str, ...], str]]:
        """Keys that break rules for several keys, and their allowed values."""
        yield from ()


class CruisingModel(FlightModel):
    """A flight model whose legs have a horizontal ground speed that may be chosen."""

    @abstractmethod
    def leg_at(self, way_m: Vector, speed_m_s: Quantity) -> Loads:
        """Legs from rest to rest at horizontal ground speeds [m/s], as far as they reach them."""

    @abstractmethod
    def named_speed_m_s(self, way_m: Vector, rule: str) -> Quantity:
        """The speed that legs reach by a rule of ``flight.speed`` [m/s]; NaN for no way forward."""

    @abstractmethod
    def priced_speed_m_s(self, way_m: Vector, price_A: Quantity) -> Quantity:
        """The speed of the least charge, if each second of the leg costs charge [A]."""

    @abstractmethod
    def price_A(self, way_m: Vector, speed_m_s: Quantity) -> Quantity:
        """The price of a second [A] that makes a speed the cheapest, if no limit binds."""

    @abstractmethod
    def level(
        self, length_m: Quantity, direction: Vector, speed_m_s: Quantity
    ) -> tuple[Quantity, Flow]:
        """Duration [s] and draw of level legs at speeds [m/s] that they reach; also symbols."""
