"""Kinetic battery model (KiBaM): charge in an available and a bound well.

dy1/dt = I + k_F (y2/(1−ω) − y1/ω), dy2/dt = −k_F (y2/(1−ω) − y1/ω), with I > 0 while charging [1]_.
The full battery holds y1 = ωB and y2 = (1−ω)B; it is empty when y1 = 0, whatever y2 still holds. At
a constant current the total y = y1 + y2 changes by I t, and the tilt z = y1 − ωy obeys
dz/dt = −k'z + (1−ω)I with k' = k_F/(ω(1−ω)). That is the closed form used here, equal to eqs
(15)-(16) of [2]_.

Near full, a charger goes on at constant current, or it tapers. The available well takes the full
current only while y1 < ωB. From then on a tapering charger holds y1 = ωB and gives what seeps into
the bound well, I = ωk'((1−ω)B − y2), so that y2 approaches (1−ω)B at the rate ωk' = k_F/(1−ω). The
current falls from there on and never exceeds the first part's: y1 reaches ωB from below, so
that no more seeps away than comes in.

*Wells that hold more keep holding more.* Let y charge like this at the current I, and v at any
currents u ≤ I that keep v1 ≤ ωB. If y1 ≥ v1 and y2 ≥ v2 at the start, both hold from then on. While
y1 < ωB, the difference w = y − v obeys w' = A w + (I − u, 0) with no negative entry of A off the
diagonal, so it stays non-negative. While y1 = ωB ≥ v1, (y2 − v2)' ≥ −ωk' (y2 − v2). So it is best
at every moment to charge at full current first and then to hold y1 at ωB. Nothing is lost by it
later: legs and hovers keep the order as well.

References
----------
.. [1] J. F. Manwell, J. G. McGowan, "Lead acid battery storage model for hybrid energy systems",
   Solar Energy, 1993.
.. [2] W. Jaafar, H. Yanikomeroglu, "Dynamics of laser-charged UAVs: a battery perspective",
   IEEE Internet of Things Journal, 2021, eqs (11)-(16).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, Self

import numpy as np

from optuav.arrays import Booleans
from optuav.physics.quantity import TINY, Quantity

MOST_STEPS = 100  # Largest number of Newton's steps towards a moment; a dozen are the rule
SETTLED_STEP = 1e-9  # Relative step after which the next, its square, is below rounding


@dataclass(frozen=True)
class Battery:
    """A KiBaM battery; figures are floats, arrays of one shape or symbols.

    Parameters
    ----------
    capacity_As, available_fraction
        B [A s], > 0; ω, share of the charge that is available when full [-], in (0, 1).
    flow_rate_per_s
        k_F between the wells [1/s], ≥ 0; at 0 the bound charge stays bound.

    Examples
    --------
    >>> from optuav.physics.kibam import Battery
    >>> drone = Battery(capacity_As=72_000.0, available_fraction=0.8, flow_rate_per_s=4.5e-5)
    >>> print(f"{drone.full.available_As:.0f} A s available, k' = {drone.rate_per_s:.3g} per s")
    57600 A s available, k' = 0.000281 per s
    """

    capacity_As: Quantity
    available_fraction: Quantity
    flow_rate_per_s: Quantity

    @cached_property
    def bound_fraction(self) -> Quantity:
        """1 − ω, share of the charge that is bound when full [-]."""
        return 1.0 - self.available_fraction

    @cached_property
    def rate_per_s(self) -> Quantity:
        """Levelling rate of the wells k' = k_F/(ω(1−ω)) [1/s]; never quite 0."""
        share = self.available_fraction
        return np.maximum(self.flow_rate_per_s / (share * self.bound_fraction), TINY)

    @cached_property
    def lag_s(self) -> Quantity:
        """L = (1−ω)²/k_F = (1−ω)/(ωk') [s].

        Once the wells have settled, a current I leaves I L unused: a constant one lasts B/I − L.
        """
        return self.bound_fraction / (self.available_fraction * self.rate_per_s)

    @cached_property
    def full(self) -> Wells:
        """Both wells of the full battery [A s]."""
        return Wells(
            self.available_fraction * self.capacity_As, self.bound_fraction * self.capacity_As
        )


class Wells(NamedTuple):
    """Charge in the two wells, `available_As` y1 and `bound_As` y2 [A s]."""

    available_As: Quantity
    bound_As: Quantity

    @property
    def total_As(self) -> Quantity:
        """y = y1 + y2 [A s]; y/B is the state of charge η1, [2]_ eq (19)."""
        return self.available_As + self.bound_As


class Tilted(NamedTuple):
    """The charge as `total_As` y and `tilt_As` z = y1 − ωy [A s], which change independently."""

    total_As: Quantity
    tilt_As: Quantity

    @classmethod
    def of(cls, battery: Battery, wells: Wells) -> Self:
        """The total and the tilt of two wells."""
        total_As = wells.total_As
        return cls(total_As, wells.available_As - battery.available_fraction * total_As)

    def wells(self, battery: Battery) -> Wells:
        """The two wells of this total and tilt."""
        share, (total_As, tilt_As) = battery.available_fraction, self
        return Wells(share * total_As + tilt_As, battery.bound_fraction * total_As - tilt_As)


def start(battery: Battery) -> Tilted:
    """Return the charge at the start of every mission: both wells are full."""
    return Tilted(battery.capacity_As, 0.0)


class Stage(NamedTuple):
    """A stage of constant current.

    Parameters
    ----------
    current_A
        I [A], > 0 while charging.
    duration_s
        How long it flows [s], ≥ 0.

    Examples
    --------
    >>> from optuav.physics.kibam import Stage
    >>> hover = Stage(-87.91, 600.0)
    >>> print(f"{hover.current_A * hover.duration_s:.0f} A s")
    -52746 A s
    """

    current_A: Quantity
    duration_s: Quantity


class Shift(NamedTuple):
    """Effect of a stage on any charge."""

    gained_As: Quantity  # By the total
    remaining: Quantity  # Share of the tilt that remains [-]
    tilted_As: Quantity  # Tilt that is added to that


def levelling(battery: Battery, duration_s: Quantity) -> tuple[Quantity, Quantity]:
    """exp(−k't) [-] and its integral (1 − exp(−k't))/k' [s], accurate for small and large k't."""
    exponent = -battery.rate_per_s * duration_s
    return np.exp(exponent), -np.expm1(exponent) / battery.rate_per_s


def step(battery: Battery, wells: Wells, stage: Stage) -> Wells:
    """Wells [A s] after a stage of constant current, [2]_ eqs (15)-(16).

    The charge at the start [A s] need not lie within the limits of the wells.

    Examples
    --------
    >>> drone = Battery(capacity_As=72_000.0, available_fraction=0.8, flow_rate_per_s=4.5e-5)
    >>> available_As, bound_As = step(drone, drone.full, Stage(-87.91, 600.0))
    >>> print(f"{available_As:.3f} A s available, {bound_As:.3f} A s bound")
    5696.064 A s available, 13557.936 A s bound
    """
    return tilted_after(battery, Tilted.of(battery, wells), stage).wells(battery)


def shift(battery: Battery, stage: Stage) -> Shift:
    """Return the effect of a stage of constant current on any charge."""
    current_A, duration_s = stage
    remaining, integral_s = levelling(battery, duration_s)
    return Shift(current_A * duration_s, remaining, battery.bound_fraction * current_A * integral_s)


def gentlest(battery: Battery, drawn_As: Quantity, slowest_A: Quantity) -> Shift:
    """Return a shift that leaves as much in the wells as any way to draw a charge, or more.

    The current is never below the slowest [A]. All is drawn at once, and the wells then level out
    for as long as drawing may take.
    """
    remaining = np.exp(-battery.rate_per_s * (drawn_As / slowest_A))
    return Shift(-drawn_As, remaining, -battery.bound_fraction * drawn_As * remaining)


def tilted_after(battery: Battery, charge: Tilted, *stages: Stage | Shift) -> Tilted:
    """Total charge and tilt [A s] after stages of constant current, or their effects, in order."""
    total_As, tilt_As = charge
    for stage in stages:
        moved = stage if isinstance(stage, Shift) else shift(battery, stage)
        total_As = total_As + moved.gained_As
        tilt_As = tilt_As * moved.remaining + moved.tilted_As
    return Tilted(total_As, tilt_As)


def falls_throughout(battery: Battery, current_A: Quantity) -> Quantity:
    """Test if y1 falls all along a stage of this current [A], from any wells within their limits.

    dy1/dt ≤ I + k_F B, since y2 ≤ (1−ω)B and y1 ≥ 0.
    """
    return current_A + battery.flow_rate_per_s * battery.capacity_As <= 0.0


def time_to_empty(battery: Battery, wells: Wells, current_A: Quantity) -> Quantity:
    """First moment of y1 < 0 at a constant current I [A] [s]; floats and arrays.

    ``inf`` where it never comes. The wells at the start lie within 0 ≤ y1 ≤ ωB, 0 ≤ y2 ≤ (1−ω)B.
    """
    return _crossing(battery, wells, current_A, -1.0, Wells(0.0, 0.0))


def time_to_full(battery: Battery, wells: Wells, current_A: Quantity) -> Quantity:
    """First moment of y1 > ωB [s], ``inf`` if it never comes; like `time_to_empty`."""
    return _crossing(battery, wells, current_A, 1.0, battery.full)


@np.errstate(divide="ignore", invalid="ignore", over="ignore")
def _crossing(
    battery: Battery, wells: Wells, current_A: Quantity, direction: float, bound: Wells
) -> Quantity:
    """First moment of y1 beyond its bound [s], above (direction 1) or below (−1).

    y1 has the form a + b t + c exp(−k't), which turns at most once and then heads for the bound:
    it passes once, and has passed when the total charge is at its own bound. Newton's method
    approaches that moment from one side without overshooting: from behind if the distance beyond
    the bound is convex, that is c > 0 seen in the direction of the bound, else from the start.
    """
    current = np.asarray(current_A, dtype=float)[()]
    share, rate, charge = battery.available_fraction, battery.rate_per_s, Tilted.of(battery, wells)
    latest_s = np.maximum((bound.total_As - charge.total_As) / current, 0.0)
    bend = battery.bound_fraction * current - rate * charge.tilt_As  # dy1/dt = ωI + bend exp(−k't)
    moment_s = np.where(direction * bend < 0.0, latest_s, 0.0)[()]
    settled: Booleans = np.zeros_like(moment_s, dtype=bool)
    for _ in range(MOST_STEPS):
        end = tilted_after(battery, charge, Stage(current, moment_s)).wells(battery)
        slope = share * current + bend * np.exp(-rate * moment_s)
        nearer_s = moment_s - (end.available_As - bound.available_As) / slope
        # A settled moment stays, so that no result depends on the other elements of the array.
        moves, before_s = ~settled & np.isfinite(nearer_s), moment_s
        moment_s = np.where(moves, np.minimum(np.maximum(nearer_s, 0.0), latest_s), before_s)[()]
        settled = (np.abs(moment_s - before_s) <= SETTLED_STEP * moment_s) | ~np.isfinite(moment_s)
        if settled.all():
            break
    # A current of TINY takes longer than the range of floats.
    moment_s = np.where(direction * current <= TINY, np.inf, moment_s)
    return np.where(np.isnan(current), np.nan, moment_s)[()]


def holding_current(battery: Battery, wells: Wells) -> Quantity:
    """Current that keeps y1 where it is [A]: what seeps into the bound well."""
    filled = wells.available_As / battery.available_fraction
    return battery.flow_rate_per_s * (filled - wells.bound_As / battery.bound_fraction)


def held(battery: Battery, wells: Wells, duration_s: Quantity) -> Wells:
    """Wells [A s] after a duration [s], ≥ 0, that holds y1 constant."""
    gained = -np.expm1(-battery.flow_rate_per_s / battery.bound_fraction * duration_s)
    level = battery.bound_fraction / battery.available_fraction * wells.available_As
    return Wells(wells.available_As, wells.bound_As + (level - wells.bound_As) * gained)


def tapered(battery: Battery, wells: Wells, stage: Stage) -> Wells:
    """Wells [A s] after a stage whose current tapers once y1 = ωB; floats and arrays.

    At the start y1 ≤ ωB and y2 ≤ (1−ω)B. The current of the stage is the charger's offer less
    the drawn current.
    """
    if np.all(np.asarray(stage.current_A) <= 0.0):
        return step(battery, wells, stage)
    return tapered_from(battery, wells, stage, time_to_full(battery, wells, stage.current_A))


def tapered_from(battery: Battery, wells: Wells, stage: Stage, full_s: Quantity) -> Wells:
    """The wells of `tapered`, whose current tapers from a known moment [s] on."""
    steady_s = np.minimum(stage.duration_s, full_s)
    steady = step(battery, wells, Stage(stage.current_A, steady_s))
    return held(battery, steady, stage.duration_s - steady_s)


STEP_BY_CHARGING = {"constant": step, "taper": tapered}
"""Effect of a stage on the wells, by name of the charging; at constant current y1 may exceed ωB."""
