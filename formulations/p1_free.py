"""(P1) of the paper with the hover point among the unknowns."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from formulations.p1 import P1
from formulations.quantities import QUANTITIES
from optuav.modelling import Model
from optuav.physics.flight import Loads
from optuav.physics.quantity import Vector, dot, norm


WORDS = {
    "flight_time_s": "time of the legs by way of w",
    "flight_charge_As": "charge drawn on the legs by way of w",
    "flight_energy_J": "energy drawn on the legs by way of w",
    "flight_battery_J": "energy of a battery that is drawn as on the legs by way of w",
    "hover_current_A": "current drawn at w, less what the laser gives there",
    "hover_received_W": "power received from the laser at w",
}
"""What is printed of quantities whose formula in w fills a page."""


class HalfSpace(NamedTuple):
    """The points w with n·w ≥ c; `label` names it among the constraints."""

    label: str
    normal: Vector
    least_m: float


@dataclass(frozen=True, kw_only=True)
class Way:
    """What depends on where the UAV hovers, and where it may.

    Parameters
    ----------
    places_m
        Positions of the places of the route in order [m]; None stands for the hover point.
    device_m
        Position of the device [m].
    laser_m
        Position of the laser where it is in sight of the hover point [m]; else None.
    leg
        What a leg of a displacement [m] draws.
    charging
        Current [A] and power [W] received at a distance from the laser [m].
    hover_current_A
        Drawn while hovering, whatever is received [A].
    flight_battery_J
        E_1 [J] where the mission states it; else None.
    least_m, most_m
        Bounds on the coordinates of the hover point [m].
    cell
        Half-spaces in which the hover point has the same sights.
    """

    places_m: Sequence[Vector | None]
    device_m: Vector
    laser_m: Vector | None
    leg: Callable[[Vector], Loads]
    charging: Callable[[Any], tuple[Any, Any]]
    hover_current_A: float
    flight_battery_J: float | None
    least_m: Vector
    most_m: Vector
    cell: Sequence[HalfSpace] = ()


@dataclass(frozen=True, kw_only=True)
class P1Free(P1):
    """P1 with the hover point free: longest hover anywhere within reach of the device.

    Parameters
    ----------
    way
        What depends on the hover point.
    """

    way: Way

    def declare(self, model: Model) -> None:
        """State (P1) over w, Δ and T'."""
        w = tuple(
            model.variable(f"hover_{axis}_m", f"{axis}_w", unit="m", lower=low, upper=high)
            for axis, low, high in zip("xyz", self.way.least_m, self.way.most_m, strict=True)
        )
        for each in self.way.cell:
            model.subject_to(each.label, dot(each.normal, w) >= each.least_m, unit="m")
        there = self.at(w)
        named = {
            each.name: model.let(
                each.name,
                value,
                symbol=each.metadata["symbol"],
                unit=each.metadata["unit"],
                words=WORDS.get(each.name, ""),
            )
            for each in QUANTITIES
            if (value := getattr(there, each.name)) is not getattr(self, each.name)
        }
        P1.declare(replace(there, **named), model)

    def hover_and_rest(self, model: Model, label: str) -> tuple[Any, Any]:
        """Declare Δ and, where the route goes by way of a building, T'; else T' is None.

        The time left depends on the hover point, so that it is no bound: `keep_deadline` states it.
        """
        hover = model.variable("hover_time_s", "Δ", unit="s")
        if not self.rests:
            return hover, None
        rest = model.variable("rest_time_s", "T'", unit="s")
        model.prefer_small(rest)
        return hover, rest

    def keep_deadline(self, model: Model, label: str, hover: Any, rest: Any) -> None:
        """State Δ + T' ≤ T_max − T_fl."""
        stay = hover if rest is None else hover + rest
        model.subject_to(label, stay <= self.time_left, unit="s")

    def at(self, w: Vector) -> P1Free:
        """The quantities with the hover point at w [m]: numbers, arrays or symbols."""
        way = self.way
        stops = [w if place is None else place for place in way.places_m]
        legs = [way.leg(_from_to(start, end)) for start, end in itertools.pairwise(stops)]
        charge_As = sum(leg.charge_As for leg in legs)
        energy_J = sum(leg.energy_J for leg in legs)
        current_A, power_W = (0.0, 0.0)
        if way.laser_m is not None:
            current_A, power_W = way.charging(norm(_from_to(way.laser_m, w)))
        stated_J = way.flight_battery_J
        return replace(
            self,
            flight_time_s=sum(leg.duration_s for leg in legs),
            flight_charge_As=charge_As,
            flight_energy_J=energy_J,
            hover_current_A=way.hover_current_A - current_A,
            hover_received_W=power_W,
            flight_battery_J=self.battery_As * energy_J / charge_As if stated_J is None else stated_J,
            hover_distance_m=norm(_from_to(way.device_m, w)),
            hover_altitude_m=w[2],
        )


def _from_to(start: Vector, end: Vector) -> Vector:
    return (end[0] - start[0], end[1] - start[1], end[2] - start[2])
