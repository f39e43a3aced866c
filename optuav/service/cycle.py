"""The share of the day that one drone covers: the best endless cycle of hover and rest."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypedDict, TypeVar

import numpy as np

from optuav.arrays import Floats
from optuav.errors import Fault, InputError, NoPlanError, collected, refuse
from optuav.fields import Range
from optuav.mission import Mission
from optuav.mission.load import load_one_device
from optuav.mission.messages import misfits, plural, shown, unlisted
from optuav.network import vehicle
from optuav.network.network import Network, build_network
from optuav.network.places import FIRST_BUILDING, HOVER
from optuav.options import Perspective
from optuav.presentation.numbers import amperes, figure, percent, typed, watts
from optuav.service.calm_air import hover_words, in_calm_air, with_words
from optuav.service.declared import CycleComparison, compared, program_of
from optuav.service.endless import NEVER_LANDS, EndlessCycle, cycle_figures
from optuav.service.event import Event, Progress, event_of
from optuav.service.fleet import Fleet, PadPower, fleet_of, pad_power
from optuav.service.flyable import flyable_network, schedule_faults
from optuav.service.horizon import Horizon, horizon_of
from optuav.service.visit import Visit
from optuav.solving.program import Program

Figure = TypeVar("Figure")
PERSPECTIVES = ("available", "battery")
DURATION = Range("s", gt=0, le=1e7)
POWER = Range("W", gt=0, le=1e9)
STEP = Range("m", ge=-1000, le=1000)
DRONES_IN_CALM = "{} drones".format


class CoverageOptions(TypedDict):
    """Options of `coverage`."""

    perspective: Perspective
    swap_s: float | None
    lit_hover: bool
    pad_power_W: float | None


@dataclass(frozen=True, kw_only=True, repr=False)
class Coverage(EndlessCycle):
    """The best endless cycle of one drone, with one row per phase.

    Parameters
    ----------
    share, bound, limit_share
        Share of the time in which the drone hovers, a share that no cycle on one building exceeds,
        and the share if flights were free, I_r/(I_r + I_h) [-].
    building, hover_s, rest_s, flight_s, period_s
        Building to rest on, None for an endless hover; durations in a cycle, legs together [s].
    soc_at_departure, soc_at_landing
        (y1 + y2)/B at the building [-].
    calm_share, in_calm_air
        If the hover depends on the wind, the share in calm air [-], None without a cycle there, and
        the same in words; else None. `fleet`, `event` and `horizon` have such figures too.
    status, proof
        As in a plan: ``"optimal"`` if share and bound agree within 1e-9, else ``"feasible"``.
    charged_by, lit_hover, perspective
        ``"laser"``, ``"pad"`` or ``"exchange"``; whether the laser charges the hovering drone too;
        and how charge is counted.

    Examples
    --------
    >>> import optuav
    >>> cycle = optuav.coverage("paper")
    >>> f"{cycle.share:.6%} at {cycle.building}: hover {cycle.hover_s:.1f} s"
    '9.448002% at b9: hover 608.3 s'
    """

    # The cycle in calm air, or why there is none, if hovering counts on the wind
    calm: Coverage | str | None = field(default=None, repr=False)
    options: CoverageOptions = field(repr=False)  # As asked

    def fleet(self, share: float = 1.0, overlap_s: float = 0.0) -> Fleet:
        """Find the smallest fleet of such drones that covers a share of the time.

        Parameters
        ----------
        share
            Mean number of drones that hover [-], > 0 and up to 1000. Above 1, the fleet serves
            several devices that are equally far away, and each lit hover has a beam of its own.
        overlap_s
            Time that two drones hover together at a handover [s], at most half of the hover.

        Returns
        -------
        Fleet
            Counts of drones, places and beams, the start of each drone, and the judge's replay. A
            waiting drone stays at its charging place; without charging, the wells would drift.

        Raises
        ------
        InputError, NoPlanError
            If a number is out of range; or the hover never ends, or 100 000 drones are too few.
        """
        fleet = fleet_of(self, share, overlap_s)
        drones, words = self._in_calm_air(
            lambda calm: calm.fleet(share, overlap_s).drones, DRONES_IN_CALM
        )
        return replace(fleet, calm_drones=drones, in_calm_air=words)

    def program(self) -> Program:
        """Declare this cycle as a problem: `Cycle` on its building, with an unknown initial charge.

        Returns
        -------
        Program
            Over the mission of `plan`; print it, or solve it with any engine that accepts it.

        Raises
        ------
        InputError, NoPlanError
            If the mission's laser does not serve hover and rest, or if the hover never ends.

        Examples
        --------
        >>> import optuav
        >>> optuav.coverage("paper", perspective="battery").program().engines
        ('cvxpy', 'casadi')
        """
        return program_of(self)

    def compare(self) -> CycleComparison:
        """Compare this cycle with the answers of all engines that accept `program`.

        Returns
        -------
        CycleComparison
            One row per method, with hover and rest [s], share [-] and distance of the hover [s].

        Raises
        ------
        InputError, NoPlanError, SolverError
            See `program`; also if an engine fails.
        """
        return compared(self)

    def horizon(self, hours: float) -> Horizon:
        """Plan one drone's day from full wells: hovers, and rests until full, in turn.

        Every landing keeps ``limits.min_soc``. The day begins at the origin and ends at the
        destination of the mission.

        Parameters
        ----------
        hours
            Length of the day [h], > 0 and up to 2000.

        Returns
        -------
        Horizon
            Hover in all with its bound [s], one row per stop, and the itinerary for `audit`.

        Raises
        ------
        InputError, NoPlanError
            If the hours are out of range, the mission's laser does not serve hover and rest, or the
            perspective is not ``"available"``; or if the hover never ends, or none fits.

        Examples
        --------
        >>> import optuav
        >>> day = optuav.coverage("paper").horizon(8)
        >>> f"{day.hover_s:.2f} s of {day.bound_s:.2f} s"
        '3277.31 s of 3305.80 s'
        """
        day = horizon_of(self, hours)
        hover_s, words = self._in_calm_air(lambda calm: calm.horizon(hours).hover_s, hover_words)
        return replace(day, calm_hover_s=hover_s, in_calm_air=words)

    def event(
        self,
        hours: float,
        drones: int | None = None,
        progress: Progress | None = None,
        *,
        overlap_s: float = 0.0,
        separation_m: float | Sequence[float] | None = None,
    ) -> Event:
        """Find the fewest drones that cover some hours without a gap, all full at the start.

        The drones rest on one building, the one that needs fewest, and hover in turns, each for as
        long as a linear programme says. If only charge counts, no smaller number of drones can take
        turns on any building. The judge then flies the roster through the wells. If a drone runs
        dry, `event` shortens the hovers, then tries the endless ring, and finally adds a drone.

        Parameters
        ----------
        hours
            Duration of the event [h], > 0 and up to 240, from the first drone's hover on.
        drones
            Number of drones, 1 to 100; None for the fewest.
        progress
            Callback for progress before each roster: receives the number of rosters tried, None,
            and words on the next one.
        overlap_s
            Time that a hover continues after the next one has begun [s], at most half of a hover.
        separation_m
            Distance between the hover points of drones that take turns [m]: a number for a point
            that is higher, or the step (x, y, z) to it, up to 1000 m long; None for one point. Of
            an odd number of drones, the last one hovers two steps away; where it cannot, their
            number is even. Every drone keeps its point, with the legs and the light of that point.

        Returns
        -------
        Event
            The number of drones, the least number that the charge allows, a row per hover, and the
            judge's replay.

        Raises
        ------
        InputError, NoPlanError
            If a number is out of range, or the perspective is ``"battery"``; or if that number of
            drones is not enough, no drone can serve the device from a separate point, or the hover
            never ends.

        Examples
        --------
        >>> import optuav
        >>> relay = optuav.coverage("matrice350")
        >>> [relay.event(hours).drones for hours in (1, 2, 4)]
        [2, 3, 4]
        >>> relay.event(2, overlap_s=60, separation_m=10).drones
        3
        """
        step_m = None if separation_m is None else step_of(separation_m)
        cycles = [self, *([] if step_m is None else self._apart(step_m))]
        event = event_of(cycles, hours, drones, overlap_s, step_m, progress)
        number, words = self._in_calm_air(
            lambda calm: (
                calm.event(
                    hours, progress=progress, overlap_s=overlap_s, separation_m=separation_m
                ).drones
            ),
            DRONES_IN_CALM,
        )
        return replace(event, calm_drones=number, in_calm_air=words)

    def _apart(self, step_m: Sequence[float]) -> Iterator[Coverage]:
        """Yield the cycles a step [m] from the hover point, and two steps, if there is one."""
        for steps in (1, 2):
            try:
                moved = _moved(self.mission, [steps * metres for metres in step_m])
                yield coverage(moved, **self.options)
            except NoPlanError as error:
                if steps == 1:
                    words = f"nobody hovers separation_m from the hover point: {error}"
                    raise NoPlanError(words) from None

    def watts(self, drones: int, share: float = 1.0, overlap_s: float = 0.0) -> PadPower:
        """Find the pad power with which some drones cover a share, without light for the hover.

        Parameters
        ----------
        drones
            How many, 1 to 10000.
        share, overlap_s
            See `fleet`.

        Returns
        -------
        PadPower
            Least power and current of every drone's pad, on the building that is best for pads;
            whether the battery accepts it.

        Raises
        ------
        InputError, NoPlanError
            If a number is out of range; or if no power suffices, or the hover never ends.
        """
        self.finite_cycle()
        network = build_network(self.mission)
        currents = _net_currents(network, lit=False, pad_power_W=math.inf)
        visits = _visits(network, *currents, self.perspective, None, math.inf)
        pads = pad_power(self.mission, [*visits], drones, share, overlap_s)
        _, words = self._in_calm_air(lambda calm: calm.watts(drones, share, overlap_s), str)
        return pads._replace(in_calm_air=words)

    def _in_calm_air(
        self, ask: Callable[[Coverage], Figure], words: Callable[..., str]
    ) -> tuple[Figure | None, str | None]:
        """A figure in calm air, if this cycle counts on the wind, and the same in words."""
        if not isinstance(self.calm, Coverage):
            return None, self.calm
        try:
            return with_words(ask(self.calm), words)
        except (InputError, NoPlanError) as error:
            return None, str(error)


def coverage(
    mission: Mission | str | Path,
    *,
    perspective: Perspective = "available",
    swap_s: float | None = None,
    lit_hover: bool = True,
    pad_power_W: float | None = None,
) -> Coverage:
    """Find the endless cycle in which one drone hovers for the largest share of the time.

    A cycle is a leg from a building to the hover point, a hover, the leg back, and a rest, to the
    same wells; ``limits.min_soc`` holds at every landing; the deadline does not apply.

    Parameters
    ----------
    mission
        A mission, or its name or path.
    perspective
        How to count charge, as for `optuav.solve`: ``"available"`` or ``"battery"``.
    swap_s
        Duration of an exchange of the pack instead of a rest [s], > 0 and up to 1e7.
    lit_hover
        Whether the laser also charges the hovering drone; not with an exchange or a pad.
    pad_power_W
        Power into the battery from a pad by cable on every building [W], > 0 and up to 1e9,
        capped by ``battery.charge_current_A``, instead of the laser.

    Returns
    -------
    Coverage
        Share, bound and phases of the cycle, with a plan that the judge replays.

    Raises
    ------
    InputError, NoPlanError
        If an option does not allow its value, the packs take turns, no building is in reach, or
        nothing charges there; or if the drone cannot fly, or no building allows a hover that can be
        repeated.

    Examples
    --------
    >>> import optuav
    >>> today = optuav.coverage("matrice350")
    >>> swapped = optuav.coverage("matrice350", swap_s=120)
    >>> f"{today.share:.1%} with the laser, {swapped.share:.1%} with new packs in two minutes"
    '25.4% with the laser, 86.8% with new packs in two minutes'
    """
    faults = [*_option_faults(perspective, swap_s, lit_hover, pad_power_W)]
    with collected(faults):
        loaded = load_one_device(mission, "coverage")
        faults += schedule_faults(loaded)
    refuse(faults)
    network = flyable_network(loaded)
    lit = lit_hover and swap_s is None and pad_power_W is None
    hover_A, rest_A = _net_currents(network, lit, pad_power_W)
    charged_by = "pad" if pad_power_W is not None else "laser" if swap_s is None else "exchange"
    options: CoverageOptions = {
        "perspective": perspective,
        "swap_s": swap_s,
        "lit_hover": lit_hover,
        "pad_power_W": pad_power_W,
    }
    calm = in_calm_air(loaded, lambda calm: coverage(calm, **options))
    in_calm = calm.share if isinstance(calm, Coverage) else calm
    calm_share, words = with_words(in_calm, lambda share: f"{percent(share)} of the time")
    asked: dict[str, Any] = {
        "mission": loaded,
        "charged_by": charged_by,
        "lit_hover": lit,
        "perspective": perspective,
        "calm_share": calm_share,
        "in_calm_air": words,
        "calm": calm,
        "options": options,
    }
    if hover_A <= 0.0:
        return Coverage(rows=(), **NEVER_LANDS, **asked)
    visits = [*_visits(network, hover_A, rest_A, perspective, swap_s, pad_power_W)]
    best, hover_s, bound = _best(visits)
    most_A = math.inf if swap_s is not None else float(rest_A.max())
    return Coverage(
        **cycle_figures(best, hover_s, bound),
        limit_share=1.0 / (1.0 + hover_A / most_A),
        visits=tuple(visit for visit in visits if visit is not best),
        **asked,
    )


def step_of(separation_m: float | str | Sequence[float]) -> tuple[float, ...]:
    """A separation as a step (x, y, z) [m], a number being one in height."""
    number = isinstance(separation_m, int | float)
    step_m: Any = (0.0, 0.0, separation_m) if number else separation_m
    is_step = isinstance(step_m, Sequence) and len(step_m) == 3 and all(map(STEP.accepts, step_m))
    least = 0.0 if number else -1000.0
    if not is_step or not 0.0 < math.hypot(*step_m) <= 1000.0 or step_m[2] < least:
        words = "must be a number, 0 < x <= 1000, or a step (x, y, z), up to 1000 long [m]"
        raise InputError([Fault("separation_m", shown(separation_m), words)])
    return tuple(map(float, step_m))


def _moved(mission: Mission, step_m: Sequence[float]) -> Mission:
    """The mission with its hover point a step [m] away, upwards along the edge of the link."""
    point_m, limits = [*map(float, vehicle.hover_point_m(mission))], mission.limits
    height_m = point_m[2] + step_m[2]
    if height_m > limits.max_altitude_m:
        words = (
            f"it is at {figure(height_m)} m, above limits.max_altitude_m = "
            f"{figure(limits.max_altitude_m)} m"
        )
        raise NoPlanError(words)
    if mission.route.hover_m is None and step_m[2] > 0.0 and not any(step_m[:2]):
        lifted = mission.replace({"limits.min_altitude_m": height_m})
        higher_m = [*map(float, vehicle.hover_point_m(lifted))]
        if not np.isfinite(higher_m).all():
            raise NoPlanError(f"the link of the device does not reach {figure(height_m)} m")
        return mission.replace({"route.hover_m": higher_m})
    moved_m = [at + by for at, by in zip(point_m, step_m, strict=True)]
    return mission.replace({"route.hover_m": moved_m})


def _option_faults(
    perspective: str, swap_s: float | None, lit_hover: bool, pad_power_W: float | None
) -> Iterator[Fault]:
    """Yield options that have no such value, or exclude each other."""
    yield from unlisted(("perspective", perspective, PERSPECTIVES))
    options = ("swap_s", swap_s, DURATION), ("pad_power_W", pad_power_W, POWER)
    yield from misfits(*(option for option in options if option[1] is not None))
    if not isinstance(lit_hover, bool):
        yield Fault("lit_hover", shown(lit_hover), "must be True or False")
    if swap_s is not None and pad_power_W is not None:
        yield Fault("pad_power_W", shown(pad_power_W), "must be left out beside swap_s")


def _net_currents(network: Network, lit: bool, pad_power_W: float | None) -> tuple[float, Floats]:
    """Drawn while hovering, and into the battery while resting on each building [A]."""
    mission, places = network.mission, network.places
    received_A = float(places.charge_current_A[HOVER]) if lit else 0.0
    charge_A = places.charge_current_A[FIRST_BUILDING:]
    if pad_power_W is not None:
        pad_A = pad_power_W / mission.battery.nominal_voltage_V
        charge_A = np.full_like(charge_A, min(pad_A, mission.battery.charge_current_A))
    hover_A = float(vehicle.hover_load(mission).current_A) - received_A
    return hover_A, charge_A - float(mission.flight_model.rest().current_A)


def _visits(
    network: Network,
    hover_A: float,
    rest_A: Floats,
    perspective: Perspective,
    swap_s: float | None,
    pad_power_W: float | None,
) -> Iterator[Visit]:
    """Yield the visit from every building in reach that charges."""
    legs, mission, pool = network.legs, network.mission, network.mission.pool
    number = 2 + 4 * np.arange(len(mission.buildings))
    reach = legs.flyable[number + 1] & legs.flyable[number + 2]
    if not reach.any():
        words = "needs one from which the hover point can be reached and back; the mission has"
        raise InputError([Fault("buildings", "", f"{words} {plural(len(reach), 'building')}")])
    charges = reach & ((rest_A > 0.0) | (swap_s is not None))
    if not charges.any():
        raise InputError([_uncharged(mission, float(rest_A[reach].max()), pad_power_W)])
    least_As = mission.limits.min_soc * float(pool.capacity_As)
    for k in np.flatnonzero(charges).tolist():
        out, back = (legs.stages_of(number[k] + leg) for leg in (1, 2))
        name, charged_A = mission.buildings.names[k], float(rest_A[k])
        yield Visit(name, pool, out, back, hover_A, charged_A, least_As, perspective, swap_s)


def _uncharged(mission: Mission, net_A: float, pad_power_W: float | None) -> Fault:
    """Return why no resting drone charges: the net current into the best one is not above 0."""
    battery, drawn_A = mission.battery, float(mission.flight_model.rest().current_A)
    given_A, other = net_A + drawn_A, "set a pad (pad_power_W) or an exchange (swap_s)"
    if given_A >= battery.charge_current_A:
        words = f"must exceed the {amperes(drawn_A)} that a resting drone draws"
        return Fault("battery.charge_current_A", typed(battery.charge_current_A), words)
    if pad_power_W is not None:
        drawn_W = drawn_A * battery.nominal_voltage_V
        words = f"must exceed the {watts(drawn_W)} that a resting drone draws"
        return Fault("pad_power_W", shown(pad_power_W), words)
    if mission.laser is None:
        return Fault("laser", "", f"nothing charges a resting drone: {other}")
    words = f"gives {amperes(given_A)} to a resting drone, which draws {amperes(drawn_A)}"
    words += f": the laser must be stronger or see a roof, or {other}"
    return Fault("laser.power_W", typed(mission.laser.power_W), words)


def _best(visits: list[Visit]) -> tuple[Visit, float, float]:
    """Return the first visit with the largest share, its hover [s], and a share none exceeds."""

    def by_charge(visit: Visit) -> float:
        return visit.share(visit.balanced_s) if visit.balanced_s > 0.0 else -math.inf

    best, share, bound = list[tuple[Visit, float]](), 0.0, 0.0
    for visit in sorted(visits, key=by_charge, reverse=True):
        if by_charge(visit) <= share:
            break
        if visit.from_full_s is None or (most := visit.share(visit.most_s)) <= share:
            continue
        bound = max(bound, most)
        hover_s = visit.longest_s
        if hover_s and visit.share(hover_s) > share * (1.0 + 1e-12):
            best, share = [(visit, hover_s)], visit.share(hover_s)
    if not best:
        words = "no building allows a hover that can be repeated: the legs need too much charge"
        raise NoPlanError(f"{words} (battery.capacity_As, limits.min_soc)")
    return *best[0], bound
