"""Kinetic battery model (KiBaM): charge in an available and a bound well.

dy1/dt = I + k_F (y2/(1−ω) − y1/ω), dy2/dt = −k_F (y2/(1−ω) − y1/ω), with I > 0 while charging. The
full battery holds y1 = ωB and y2 = (1−ω)B; it is empty when y1 = 0, whatever y2 still holds. At a
constant current the total y = y1 + y2 changes by I t, and z = y1 − ωy obeys dz/dt = −k'z + (1−ω)I
with k' = k_F/(ω(1−ω)); that is the closed form used here, equal to eqs (15)-(16) of [2]_.

References
----------
.. [1] J. F. Manwell, J. G. McGowan, "Lead acid battery storage model for hybrid energy systems",
   Solar Energy, 1993.
.. [2] W. Jaafar, H. Yanikomeroglu, "Dynamics of laser-charged UAVs: a battery perspective",
   IEEE Internet of Things Journal, 2020, eqs (11)-(16).
.. [3] M. R. Jongerden, B. R. Haverkort, "Which battery model to use?", IET Software, 2009.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from optuav.physics.quantity import TINY, Quantity

if TYPE_CHECKING:
    from optuav.physics.schedules import Schedule

MOST_STEPS = 100
"""Of Newton's method towards a moment; a dozen are the rule."""

CLOSE = 1e-9
"""Relative step after which the next, its square, is rounding alone."""


@dataclass(frozen=True)
class Battery:
    """A KiBaM battery.

    Parameters
    ----------
    capacity_As
        B [A s], > 0.
    available_fraction
        ω, share of the charge that is available when full [-], in (0, 1).
    flow_rate_per_s
        k_F between the wells [1/s], ≥ 0; at 0 the bound charge stays bound.
    """

    capacity_As: Quantity
    available_fraction: Quantity
    flow_rate_per_s: Quantity

    @property
    def rate_per_s(self) -> Quantity:
        """k' = k_F/(ω(1−ω)) [1/s], the rate at which the wells level out."""
        return self.flow_rate_per_s / (self.available_fraction * (1.0 - self.available_fraction))

    @property
    def full(self) -> Wells:
        """Both wells of the full battery [A s]."""
        return Wells(
            self.available_fraction * self.capacity_As,
            (1.0 - self.available_fraction) * self.capacity_As,
        )


class Wells(NamedTuple):
    """Charge in the two wells [A s]."""

    available_As: Quantity
    bound_As: Quantity

    @property
    def total_As(self) -> Quantity:
        """y = y1 + y2 [A s]."""
        return self.available_As + self.bound_As

    def tilted(self, available_fraction: Quantity) -> Tilted:
        """The same as `Tilted` wells."""
        total = self.total_As
        return Tilted(available_fraction, total, self.available_As - available_fraction * total)


class Tilted(NamedTuple):
    """Both wells by ω [-], their total y and the tilt z = y1 − ωy [A s]; a `Stretch` maps each."""

    available_fraction: Quantity
    total_As: Quantity
    tilt_As: Quantity

    @property
    def available_As(self) -> Quantity:
        """y1 [A s]."""
        return self.available_fraction * self.total_As + self.tilt_As

    @property
    def bound_As(self) -> Quantity:
        """y2 [A s]."""
        return (1.0 - self.available_fraction) * self.total_As - self.tilt_As


class Stage(NamedTuple):
    """A stretch of constant current: I [A], > 0 while charging, for a duration [s], ≥ 0."""

    current_A: Quantity
    duration_s: Quantity


def levelling(battery: Battery, duration_s: Quantity) -> tuple[Quantity, Quantity]:
    """exp(−k't) [-] and its integral (1 − exp(−k't))/k' [s], accurate for small and large k't."""
    rate = np.maximum(battery.rate_per_s, TINY)
    return np.exp(-rate * duration_s), -np.expm1(-rate * duration_s) / rate


def step(battery: Battery, wells: Wells, phase: Stage) -> Wells:
    """Wells [A s] after a phase of constant current, [2]_ eqs (15)-(16).

    Parameters
    ----------
    battery
        The battery.
    wells
        Charge at the start [A s]; need not lie within the wells.
    phase
        Current [A], > 0 while charging, and duration [s], ≥ 0.
    """
    end = along(battery, wells, stretch(battery, phase))
    return Wells(end.available_As, end.bound_As)


class Stretch(NamedTuple):
    """What several phases do to the wells together: an affine map of y and z = y1 − ωy.

    y becomes y + charge, z becomes z · remaining + tilt.
    """

    charge_As: Quantity
    remaining: Quantity
    tilt_As: Quantity


def compose(battery: Battery, phases: Stage) -> Stretch:
    """Phases of constant current, one after another, as one `Stretch`.

    Parameters
    ----------
    battery
        The battery.
    phases
        Currents [A] and durations [s] (phase, …), at least one phase.
    """
    current_A, duration_s = np.asarray(phases.current_A), np.asarray(phases.duration_s)
    left_s = np.cumsum(duration_s[::-1], axis=0)[::-1]
    remaining, integral_s = levelling(battery, left_s)
    integral_s[:-1] -= integral_s[1:]
    return Stretch(
        (current_A * duration_s).sum(axis=0),
        remaining[0],
        (1.0 - battery.available_fraction) * (current_A * integral_s).sum(axis=0),
    )


def stretch(battery: Battery, phase: Stage) -> Stretch:
    """One phase of constant current as a `Stretch`."""
    current_A, duration_s = phase
    remaining, integral_s = levelling(battery, duration_s)
    tilt_As = (1.0 - battery.available_fraction) * current_A * integral_s
    return Stretch(current_A * duration_s, remaining, tilt_As)


def along(battery: Battery, wells: Wells | Tilted, stretch: Stretch) -> Tilted:
    """Wells [A s] after a `Stretch`, the same as after its phases one by one."""
    share = battery.available_fraction
    _, total, tilt = wells if isinstance(wells, Tilted) else wells.tilted(share)
    return Tilted(share, total + stretch.charge_As, tilt * stretch.remaining + stretch.tilt_As)


def falls_throughout(battery: Battery, current_A: Quantity) -> Quantity:
    """Whether y1 falls all along a phase of this current [A], wherever the wells stand in range.

    dy1/dt ≤ I + k_F B, since y2 ≤ (1−ω)B and y1 ≥ 0.
    """
    return current_A + battery.flow_rate_per_s * battery.capacity_As <= 0.0


def after(battery: Battery, wells: Wells, phases: Iterable[Stage]) -> Wells:
    """Wells [A s] after a list of phases, one `step` each."""
    for phase in phases:
        wells = step(battery, wells, phase)
    return wells


def state_of_charge(battery: Battery, wells: Wells) -> Quantity:
    """η1 = (y1 + y2)/B [-], [2]_ eq (19)."""
    return wells.total_As / battery.capacity_As


def largest_discharge_current(battery: Battery, wells: Wells, duration_s: Quantity) -> Quantity:
    """Largest constant current drawn [A] that leaves y1 ≥ 0 throughout a duration [s], > 0.

    While discharging y1 is least at an end of the phase, so its end decides. The wells must start
    with y1 ≥ 0, y2 ≥ 0.
    """
    resting, per_ampere_s = _response(battery, wells, duration_s)
    return resting / per_ampere_s


def largest_charge_current(battery: Battery, wells: Wells, duration_s: Quantity) -> Quantity:
    """Largest constant charging current [A] that keeps y1 ≤ ωB throughout a duration [s], > 0.

    While charging y1 is largest at an end of the phase, so its end decides. The wells must start
    within y1 ≤ ωB, y2 ≤ (1−ω)B.
    """
    resting, per_ampere_s = _response(battery, wells, duration_s)
    return (battery.full.available_As - resting) / per_ampere_s


def _response(battery: Battery, wells: Wells, duration_s: Quantity) -> tuple[Quantity, Quantity]:
    """y1 [A s] after a duration without current, and what each ampere adds to it [A s/A]."""
    resting = step(battery, wells, Stage(0.0, duration_s)).available_As
    unit = step(battery, Wells(0.0, 0.0), Stage(1.0, duration_s)).available_As
    return resting, unit


def time_to_empty(battery: Battery, wells: Wells, current_A: Quantity) -> Quantity:
    """When the available well runs dry at a constant current [s]; floats and arrays.

    Parameters
    ----------
    battery
        The battery.
    wells
        Charge at the start [A s], 0 ≤ y1 ≤ ωB and 0 ≤ y2 ≤ (1−ω)B.
    current_A
        I [A], > 0 while charging.

    Returns
    -------
    First moment from which y1 < 0 [s]; ``inf`` where it never comes.
    """
    return _crossing(battery, wells, current_A, -1.0, Wells(0.0, 0.0))


def time_to_full(battery: Battery, wells: Wells, current_A: Quantity) -> Quantity:
    """When the available well is filled at a constant current [s]; arguments as `time_to_empty`.

    Returns
    -------
    First moment from which y1 > ωB [s]; ``inf`` where it never comes.
    """
    return _crossing(battery, wells, current_A, 1.0, battery.full)


@np.errstate(divide="ignore", invalid="ignore", over="ignore")
def _crossing(
    battery: Battery, wells: Wells, current_A: Quantity, direction: float, bound: Wells
) -> Quantity:
    """First moment from which y1 lies beyond its bound [s], above (direction 1) or below (−1).

    y1 has the form a + b t + c exp(−k't), which turns at most once and then heads for the bound:
    it passes once, and has passed when the total charge is at its own bound. Newton's method nears
    that moment from one side without overshooting: from behind if the distance beyond the bound is
    convex, that is c > 0 seen in the direction of the bound, else from the start.
    """
    current = np.asarray(current_A, dtype=float)
    latest_s = np.maximum((bound.total_As - wells.total_As) / current, 0.0)
    share, rate = battery.available_fraction, np.maximum(battery.rate_per_s, TINY)
    tilt = wells.available_As - share * wells.total_As - (1.0 - share) * current / rate
    moment_s = np.where(direction * tilt > 0.0, latest_s, 0.0)
    settled: Any = False
    for _ in range(MOST_STEPS):
        end = step(battery, wells, Stage(current, moment_s))
        inflow = battery.flow_rate_per_s * (end.bound_As / (1.0 - share) - end.available_As / share)
        nearer_s = moment_s - (end.available_As - bound.available_As) / (current + inflow)
        nearer_s = np.where(np.isfinite(nearer_s), np.clip(nearer_s, 0.0, latest_s), moment_s)
        # What is settled stays: no moment depends on those that are found along with it.
        before_s, moment_s = moment_s, np.where(settled, moment_s, nearer_s)
        settled = (np.abs(moment_s - before_s) <= CLOSE * moment_s) | ~np.isfinite(moment_s)
        if settled.all():
            break
    # A current of TINY takes longer than the range of floats.
    moment_s = np.where(direction * current <= TINY, np.inf, moment_s)
    return np.where(np.isnan(current), np.nan, moment_s)[()]


def lifetime(
    load: Sequence[tuple[float, float]],
    *,
    capacity_As: float,
    available_fraction: float,
    flow_rate_per_s: float,
    packs: int = 1,
    schedule: Schedule = "pooled",
    period_s: float | None = None,
) -> float:
    """How long full packs carry a load that is repeated for ever [s]; ``inf`` if for ever.

    Mind the sign: here a positive current **discharges**, as is usual for loads, while in the rest
    of this module I > 0 charges.

    Parameters
    ----------
    load
        Pairs of current [A] and duration [s], > 0. A current > 0 is a job, carried by one pack; 0
        is idle; < 0 charges the pack with the least y1, and what full packs do not take is lost.
    capacity_As
        Of **one** pack [A s], > 0; ``"pooled"`` makes one battery of `packs` times as much.
    available_fraction
        ω [-], in (0, 1).
    flow_rate_per_s
        k_F [1/s], ≥ 0; not k' = k_F/(ω(1−ω)).
    packs
        How many, 1 to 1000.
    schedule
        ``"pooled"``, ``"sequential"`` (the first until it is empty, then the next),
        ``"round-robin"`` (the next at each job), ``"alternating"`` (the next every `period_s`) or
        ``"most-available"`` (the one with the largest y1 at each job's start, the first of equals).
        A pack seen empty is not used again; another takes over in the middle of the job.
    period_s
        Of ``"alternating"``, and of no other schedule [s], ≥ 1e-3.

    Returns
    -------
    First moment at which no pack is left to carry the load [s].

    Raises
    ------
    InputError
        With everything that is wrong.
    SolverError
        If 50 000 steps do not tell, some ten seconds: a step ends where a job does, a turn by the
        clock, or a pack is empty or full. Under any schedule that takes jobs that nearly recharge
        what they draw; very small loads that never charge do it under ``"alternating"`` and
        ``"most-available"`` only, as elsewhere rounds in which no pack is emptied are skipped.

    References
    ----------
    [3]_ has the test loads.
    """
    from optuav.physics import lifetimes

    return lifetimes.lifetime(
        load, capacity_As, available_fraction, flow_rate_per_s, packs, schedule, period_s
    )
