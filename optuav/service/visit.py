"""One drone that serves the hover point from a building, again and again: charge and wells."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

from optuav.options import Perspective
from optuav.physics.kibam import (
    Battery,
    Stage,
    Tilted,
    Wells,
    falls_throughout,
    levelling,
    start,
    tilted_after,
)
from optuav.physics.roots import bisect_largest


@dataclass(frozen=True)
class Visit:
    """The legs of a visit from a building, and what hovering and resting do; floats.

    The currents are net: drawn while hovering, and into the battery while resting [A].
    """

    building: str
    battery: Battery
    out: tuple[Stage, ...]
    back: tuple[Stage, ...]
    hover_A: float
    rest_A: float
    least_As: float  # Charge that is left at every landing
    perspective: Perspective
    swap_s: float | None = None  # Duration of an exchange of the pack in place of a rest

    @cached_property
    def flight_s(self) -> float:
        """T, of the legs there and back [s]."""
        return float(sum(stage.duration_s for stage in (*self.out, *self.back)))

    @cached_property
    def flight_As(self) -> float:
        """Q, drawn on both legs [A s]."""
        return -float(sum(stage.duration_s * stage.current_A for stage in (*self.out, *self.back)))

    @property
    def spare_As(self) -> float:
        """F = (1 − η0)B [A s]."""
        return float(self.battery.capacity_As) - self.least_As

    @property
    def balanced_s(self) -> float:
        """Longest hover by charge from full: (F − Q)/I_h [s]."""
        return (self.spare_As - self.flight_As) / self.hover_A

    def rest_s(self, hover_s: float) -> float:
        """Duration of the rest that gives the charge of a visit back, or of the exchange [s]."""
        drawn_As = self.hover_A * hover_s + self.flight_As
        return drawn_As / self.rest_A if self.swap_s is None else self.swap_s

    def period_s(self, hover_s: float) -> float:
        """Duration of a cycle [s]."""
        return hover_s + self.flight_s + self.rest_s(hover_s)

    def share(self, hover_s: float) -> float:
        """Share of the time in which the drone hovers [-]."""
        return hover_s / self.period_s(hover_s)

    def stages(self, hover_s: float) -> tuple[Stage, ...]:
        """Leg out, hover and leg back."""
        return (*self.out, Stage(-self.hover_A, hover_s), *self.back)

    def phases(self, hover_s: float) -> Iterator[tuple[str, tuple[Stage, ...]]]:
        """Kind and stages of leg, hover, leg, and rest; an exchange of the pack has no stages."""
        yield "flight", self.out
        yield "hover", (Stage(-self.hover_A, hover_s),)
        yield "flight", self.back
        if self.swap_s is None:
            yield "rest", (Stage(self.rest_A, self.rest_s(hover_s)),)

    def carried(self, charge: Tilted, *stages: Stage) -> Iterator[Tilted]:
        """Charge after each of some stages."""
        for stage in stages:
            charge = tilted_after(self.battery, charge, stage)
            yield charge

    def available_As(self, charge: Tilted) -> float:
        """y1 [A s]."""
        return float(charge.wells(self.battery).available_As)

    def lasts(self, charge: Tilted, hover_s: float) -> bool:
        """Whether a visit with this charge [A s] at departure keeps y1 ≥ 0 and η0 at landing."""
        ends = [*self.carried(charge, *self.stages(hover_s))]
        dry = self.perspective != "battery" and min(map(self.available_As, ends)) < 0.0
        return not dry and ends[-1].total_As >= self.least_As

    @cached_property
    def from_full_s(self) -> tuple[float, float] | None:
        """Longest hover from full wells, and a hover that none exceeds [s]; None without any."""
        if (most_s := self.balanced_s) < 0.0:
            return None
        if self.perspective == "battery":
            return most_s, most_s
        longest = bisect_largest(lambda hover_s: self.lasts(start(self.battery), hover_s), most_s)
        falls = falls_throughout(self.battery, -self.hover_A)
        return longest if longest is None or falls else (longest[0], most_s)

    def periodic(self, hover_s: float) -> Tilted:
        """Charge at departure of the cycle with this hover, as full as the wells allow [A s].

        The tilt has one periodic solution, its response from 0 over (1 − e^(−k'P)); the total is
        free, and such that the available well is just full when it is fullest. In `battery`, and
        where an exchange or a bound well without flow leaves them so, the wells are full.
        """
        full = start(self.battery)
        apart = self.swap_s is not None or self.battery.flow_rate_per_s == 0.0
        if apart or self.perspective == "battery":
            return full
        stages = [stage for _, phase in self.phases(hover_s) for stage in phase]
        *_, response = self.carried(Tilted(0.0, 0.0), *stages)
        _, integral_s = levelling(self.battery, self.period_s(hover_s))
        tilt_As = response.tilt_As / (integral_s * self.battery.rate_per_s)
        highest_As = max(map(self.available_As, self.carried(Tilted(0.0, tilt_As), *stages)))
        share, capacity_As = self.battery.available_fraction, self.battery.capacity_As
        return Tilted(min(capacity_As - highest_As / share, capacity_As), tilt_As)

    @cached_property
    def longest_s(self) -> float | None:
        """The longest hover that can be repeated without end [s]; None without any.

        The range of y1 over a cycle grows with the hover: no exception is known.
        """
        if self.from_full_s is None:
            return None
        longest = bisect_largest(
            lambda hover_s: self.lasts(self.periodic(hover_s), hover_s), self.most_s
        )
        return None if longest is None else longest[0]

    @property
    def most_s(self) -> float:
        """A hover that no visit exceeds [s]: no departure has more than full wells."""
        assert self.from_full_s is not None
        return self.from_full_s[1]

    def wells(self, hover_s: float) -> Wells:
        """Both wells at departure of the cycle [A s]."""
        return Wells(*map(float, self.periodic(hover_s).wells(self.battery)))
