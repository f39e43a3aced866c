"""(P1) of the paper with the hover point among the unknowns."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from formulations.p1 import P1
from formulations.quantities import QUANTITIES
from optuav.modelling import Model
from optuav.physics.flight import Loads
from optuav.physics.kibam import Stage
from optuav.physics.quantity import Vector, dot, norm

AXES = ("x", "y", "z")
HOVER_POINT = tuple(f"hover_{axis}_m" for axis in AXES)
"""Names of the unknowns that make the hover point w."""
WORDS = {
    "flight_time_s": "time of all legs, two of them to w and from w",
    "flight_charge_As": "charge drawn on all legs",
    "flight_energy_J": "energy drawn on all legs",
    "flight_voltage_V": "mean voltage on all legs",
    "hover_current_A": "current drawn at w, less what the laser gives there",
    "hover_received_W": "power received from the laser at w",
}
"""What is printed of quantities whose formula in w fills a page."""
TO_HOVER, FROM_HOVER = "to hover", "from hover"
"""Among the steps of an itinerary, the legs that depend on the hover point."""
ANYWHERE = ((-math.inf,) * 3, (math.inf,) * 3)
STRAIGHT_RAD = 1e-4
"""At 0 the duration of a turn has no derivative: one that vanishes is kept this small [rad]."""


class Side(NamedTuple):
    """The points w with n·w ≥ c."""

    normal: Vector
    least_m: Any


class Cell(NamedTuple):
    """Hover points among which (P1) is smooth.

    Parameters
    ----------
    straight
        Turns that vanish, by number, those of the leg to the hover point first.
    signs
        Of every turn the sign that it keeps; 0 for any.
    sides
        Half-spaces that keep what is in sight in sight.
    least_m, most_m
        Bounds on the coordinates of the hover point [m].
    """

    straight: Sequence[int]
    signs: Sequence[Any]
    sides: Sequence[Side]
    least_m: Vector
    most_m: Vector


@dataclass(frozen=True, kw_only=True)
class P1Free(P1):
    """P1 with the hover point free: longest hover anywhere within reach of the device.

    Flight time, charge and energy are those of the legs that do not touch the hover point, the
    steps name the other two `TO_HOVER` and `FROM_HOVER`, and the hover current is drawn before
    anything is received; `at` puts in what depends on the point.

    Parameters
    ----------
    before_m, after_m
        Places from which the UAV flies to the hover point, and to which it flies on [m].
    device_m, laser_m
        Positions [m]; no laser charges a mission without one.
    laser_sight
        1 where the laser is in sight of the hover point, else 0.
    leg
        What a leg of a displacement [m] draws.
    turns
        Angles [rad] of the turns on such a leg.
    charging
        Current [A] and power [W] received at a distance from the laser [m].
    cell
        Where the hover point has to stay; None for anywhere.
    """

    before_m: Vector
    after_m: Vector
    device_m: Vector
    laser_m: Vector | None
    laser_sight: Any = 1.0
    leg: Callable[[Vector], Loads]
    turns: Callable[[Vector], Sequence[Any]]
    charging: Callable[[Any], tuple[Any, Any]]
    cell: Cell | None = None

    def declare(self, model: Model) -> None:
        """State (P1) over w, Δ and T'."""
        bounds = ANYWHERE if self.cell is None else (self.cell.least_m, self.cell.most_m)
        x, y, z = (
            model.variable(name, f"{axis}_w", unit="m", lower=least_m, upper=most_m)
            for name, axis, least_m, most_m in zip(HOVER_POINT, AXES, *bounds, strict=True)
        )
        w = (x, y, z)
        there = self.at(w)
        named: dict[str, Any] = {
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
        if self.cell is not None:
            self.stay_in(self.cell, w, model)

    def stay_in(self, cell: Cell, w: Vector, model: Model) -> None:
        """State that the hover point is in a cell."""
        for number, (turn, sign) in enumerate(zip(self.turns_at(w), cell.signs, strict=True)):
            if number in cell.straight:
                model.subject_to(f"turn {number} vanishes", turn == STRAIGHT_RAD, unit="rad")
            else:
                least_rad = STRAIGHT_RAD * sign * sign + sign * sign - 1.0
                model.subject_to(f"sign of turn {number}", sign * turn >= least_rad, unit="rad")
        for number, (normal, least_m) in enumerate(cell.sides):
            model.subject_to(f"side {number}", dot(normal, w) >= least_m, unit="m")

    def hover_and_rest(self, model: Model, label: str) -> tuple[Any, Any]:
        """Declare Δ and T'; the time left is no bound on them, as it depends on w."""
        hover = model.variable("hover_time_s", "Δ", unit="s")
        if not self.rests:
            return hover, None
        rest = model.variable("rest_time_s", "T'", unit="s")
        model.prefer_small(rest)
        return hover, rest

    def keep_deadline(self, model: Model, label: str, hover: Any, rest: Any) -> None:
        """State Δ + T' ≤ T_max − T_fl."""
        stay = hover if rest is None else hover + rest
        model.subject_to(label, stay <= self.time_left, unit="s", kind="deadline")

    def turns_at(self, w: Vector) -> Sequence[Any]:
        """Angles [rad] of the turns on the legs to and from a hover point [m]."""
        return (*self.turns(_way(self.before_m, w)), *self.turns(_way(w, self.after_m)))

    def at(self, w: Vector) -> P1Free:
        """The quantities of P1 with the hover point at w [m]: numbers, arrays or symbols."""
        legs = self.leg(_way(self.before_m, w)), self.leg(_way(w, self.after_m))
        charge_As = self.flight_charge_As + sum(leg.charge_As for leg in legs)
        energy_J = self.flight_energy_J + sum(leg.energy_J for leg in legs)
        moved: dict[str, Any] = {
            "flight_time_s": self.flight_time_s + sum(leg.duration_s for leg in legs),
            "flight_charge_As": charge_As,
            "flight_energy_J": energy_J,
            "flight_voltage_V": energy_J / charge_As,
            "hover_distance_m": norm(_way(self.device_m, w)),
            "hover_altitude_m": w[2],
            "steps": self._steps_with(*legs),
        }
        if self.laser_m is not None:
            current_A, power_W = self.charging(norm(_way(self.laser_m, w)))
            moved["hover_current_A"] = self.hover_current_A - self.laser_sight * current_A
            moved["hover_received_W"] = self.laser_sight * power_W
        return replace(self, **moved)

    def _steps_with(self, arriving: Loads, leaving: Loads) -> tuple[Any, ...]:
        """The steps of the itinerary with the stages of the legs to and from the hover point."""
        opened = {TO_HOVER: _stages(arriving), FROM_HOVER: _stages(leaving)}
        steps: list[Any] = []
        for step in self.steps:
            steps += opened.get(step, [step]) if isinstance(step, str) else [step]
        return tuple(steps)


def _stages(leg: Loads) -> list[Stage]:
    """Phases of constant current."""
    return [Stage(-drawn, t) for drawn, t in zip(leg.currents_A, leg.durations_s, strict=True)]


def _way(start: Vector, end: Vector) -> Vector:
    return (end[0] - start[0], end[1] - start[1], end[2] - start[2])
