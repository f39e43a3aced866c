"""(P1) of the paper with the hover point among the unknowns."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from formulations.given import Given
from formulations.p1 import P1
from formulations.parameters import FROM_HOVER, QUANTITIES, TO_HOVER, Quantities
from optuav.modelling import Model, Parameter
from optuav.options import Perspective
from optuav.physics.flight import Loads
from optuav.physics.kibam import Stage
from optuav.physics.quantity import Quantity, Vector, norm

AXES = ("x", "y", "z")
HOVER_POINT = tuple(f"hover_{axis}_m" for axis in AXES)
"""Names of the unknowns that make the hover point w."""
DESCRIPTIONS = {
    "flight_time_s": "time of all legs, two of them to w and from w",
    "flight_charge_As": "charge drawn on all legs",
    "flight_energy_J": "energy drawn on all legs",
    "flight_voltage_V": "mean voltage on all legs",
    "hover_current_A": "current drawn at w, less what the laser gives there",
    "hover_received_W": "power received from the laser at w",
}
"""Printed in place of formulas in w that would fill a page."""


@dataclass(frozen=True, kw_only=True)
class FreeHover:
    """The quantities of itineraries as functions of their hover point.

    Parameters
    ----------
    rest_of_route
        Quantities without the legs to and from the hover point, which the steps name `TO_HOVER`
        and `FROM_HOVER`; the hover current is what is drawn before anything is received.
    before_m, after_m
        Places from which the UAV flies to the hover point, and to which it flies on [m].
    device_m, laser_m
        Positions [m]; None for a mission without a laser.
    laser_sight
        1 where the laser is in sight of the hover point, else 0.
    leg
        What a leg of a displacement [m] draws.
    charging
        Current [A] and power [W] received at a distance from the laser [m].
    """

    rest_of_route: Quantities
    before_m: Vector
    after_m: Vector
    device_m: Vector
    laser_m: Vector | None
    leg: Callable[[Vector], Loads]
    charging: Callable[[Quantity], tuple[Quantity, Quantity]]
    laser_sight: Quantity = 1.0

    def at(self, w: Vector) -> Quantities:
        """The quantities with the hover point at w [m]: numbers, arrays or symbols."""
        given = self.rest_of_route
        legs = self.leg(_way(self.before_m, w)), self.leg(_way(w, self.after_m))
        charge_As = given.flight_charge_As + sum(leg.charge_As for leg in legs)
        energy_J = given.flight_energy_J + sum(leg.energy_J for leg in legs)
        moved: dict[str, Quantity] = {
            "flight_time_s": given.flight_time_s + sum(leg.duration_s for leg in legs),
            "flight_charge_As": charge_As,
            "flight_energy_J": energy_J,
            "flight_voltage_V": energy_J / charge_As,
            "hover_distance_m": norm(_way(self.device_m, w)),
            "hover_altitude_m": w[2],
            "steps": _steps(given.steps, *legs),
        }
        if self.laser_m is not None:
            current_A, power_W = self.charging(norm(_way(self.laser_m, w)))
            moved["hover_current_A"] = given.hover_current_A - self.laser_sight * current_A
            moved["hover_received_W"] = self.laser_sight * power_W
        return replace(given, **moved)

    def model(self, perspective: Perspective) -> Model:
        """(P1) over w, Δ and T', with the figures of the itineraries as parameters."""
        model = Model("P1 with the hover point free: longest hover within reach of the device")
        x, y, z = (
            model.variable(name, f"{axis}_w", unit="m", lower=-float("inf"))
            for name, axis in zip(HOVER_POINT, AXES, strict=True)
        )
        symbols = replace(
            self,
            rest_of_route=(given := Given.of(self.rest_of_route, perspective)),
            before_m=_place("before", self.before_m),
            after_m=_place("after", self.after_m),
            laser_sight=Parameter("laser_sight", "s_w", "1", self.laser_sight),
        )
        at_w = symbols.at((x, y, z))
        named: dict[str, Quantity] = {
            each.name: model.let(
                each.name,
                value,
                symbol=each.metadata["symbol"],
                unit=each.metadata["unit"],
                words=DESCRIPTIONS.get(each.name, ""),
            )
            for each in QUANTITIES
            if (value := getattr(at_w, each.name)) is not getattr(given, each.name)
        }
        P1().declare(model, replace(given, **named, steps=at_w.steps))
        return model


def _place(name: str, position_m: Vector) -> Vector:
    x, y, z = (
        Parameter(f"{name}_{axis}_m", f"{axis}_{name[0]}", "m", value)
        for axis, value in zip(AXES, position_m, strict=True)
    )
    return x, y, z


def _steps(
    steps: Sequence[Stage | str], arriving: Loads, leaving: Loads
) -> tuple[Stage | str, ...]:
    """The steps of the itinerary with the stages of the legs to and from the hover point."""
    found = list[Stage | str]()
    for step in steps:
        if step in (TO_HOVER, FROM_HOVER):
            leg = arriving if step == TO_HOVER else leaving
            drawn = zip(leg.currents_A, leg.durations_s, strict=True)
            found += [Stage(-current_A, duration_s) for current_A, duration_s in drawn]
        else:
            found.append(step)
    return tuple(found)


def _way(start: Vector, end: Vector) -> Vector:
    return (end[0] - start[0], end[1] - start[1], end[2] - start[2])
