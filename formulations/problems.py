"""The problems (P1) to (P4) of the paper."""

from __future__ import annotations

from dataclasses import dataclass, field

from formulations.formulation import Formulation, Given
from optuav.modelling import Model, Variable
from optuav.modelling.expression import Operand
from optuav.options import HoverPoint, Trajectory


@dataclass(frozen=True, kw_only=True)
class P1(Formulation):
    """P1: longest hover within reach of the device, with or without a rest.

    Parameters
    ----------
    trajectory
        Routes to choose from: ``"optimal"`` (direct or by way of any one building), ``"direct"``,
        ``"traj1"`` (by way of the building nearest the device) or ``"traj2"`` (the shortest in
        time by way of one building); the latter two pass by the building or rest there.
    order
        ``"rest-first"``, ``"hover-first"``, or None for the better of the two.
    hover_point
        ``"w_U"``: hover at ``route.hover_m`` of the mission, or where that is not stated at w_U of
        the paper; ``"free"``: wherever is best within reach of the device.
    stops, hovers
        Most rests, 0 to 10, and most pieces in which the UAV hovers, 1 to 10, in any order over
        all places. More than one of either needs the trajectory ``"optimal"``.

    Examples
    --------
    >>> import optuav
    >>> plan = optuav.solve("paper", optuav.P1(trajectory="traj1"), perspective="battery")
    >>> f"{plan.hover_time_s:.2f}"
    '715.05'
    """

    building: None = field(default=None, init=False, repr=False)
    trajectory: Trajectory = "optimal"
    hover_point: HoverPoint = "w_U"
    stops: int = 1
    hovers: int = 1

    def declare(self, model: Model, given: Given) -> None:
        """State (P1), P1.a to P1.e; of equal plans the one with the shortest rest."""
        hover, rest = given.hover_and_rest(model)
        model.maximise(hover)
        state_limits(model, given, "P1", hover, rest)


def state_limits(model: Model, given: Given, problem: str, hover: Variable, rest: Operand) -> None:
    """State constraints a to e, which (P1) and (P2) have in common."""
    in_reach = given.hover_distance_m <= given.coverage_radius_m
    model.subject_to(f"{problem}.a outage", in_reach, unit="m", kind="outage")
    charged = given.soc_end(hover, rest) >= given.min_soc
    model.subject_to(f"{problem}.b state of charge", charged, kind="state of charge")
    given.keep_wells(model, f"{problem}.b", hover, rest)
    model.subject_to(f"{problem}.c ends", given.end_gap_m <= 0.0, unit="m")
    given.keep_deadline(model, f"{problem}.d hover time", hover, rest)
    high_enough = given.hover_altitude_m >= given.min_altitude_m
    model.subject_to(f"{problem}.e altitude", high_enough, unit="m")
    low_enough = given.hover_altitude_m <= given.max_altitude_m
    model.subject_to(f"{problem}.e highest altitude", low_enough, unit="m")


@dataclass(frozen=True, kw_only=True)
class P2(Formulation):
    """P2: shortest flight and rest, the hover time free.

    Parameters
    ----------
    tight
        Whether Δ = T_max − T_fl − T', which the paper's derivation supposes. As printed (False)
        Δ is not in the objective: any feasible Δ is optimal, and the shortest mission is taken.
    trajectory, order
        As for `P1`.

    Examples
    --------
    >>> import optuav
    >>> plan = optuav.solve("paper", optuav.P2(tight=True), perspective="battery")
    >>> f"{plan.hover_time_s:.2f} s of hover in {plan.mission_time_s:.0f} s"
    '719.54 s of hover in 1200 s'
    """

    building: None = field(default=None, init=False, repr=False)
    trajectory: Trajectory = "optimal"
    tight: bool = False

    @property
    def name(self) -> str:
        """``"P2"`` or ``"P2-tight"``."""
        return "P2-tight" if self.tight else "P2"

    def declare(self, model: Model, given: Given) -> None:
        """State (P2), P2.a to P2.e; of equal plans the one with the shortest mission."""
        hover, rest = given.hover_and_rest(model)
        model.minimise(given.flight_time_s + rest)
        model.prefer_small(hover)
        state_limits(model, given, "P2", hover, rest)
        if self.tight:
            model.title = (
                "P2 with the deadline tight: shortest flight and rest, hovering all the time that "
                "is left"
            )
            used = hover + rest if given.rests else hover
            model.subject_to("P2.d deadline tight", used == given.time_left, unit="s")


@dataclass(frozen=True, kw_only=True)
class P3(Formulation):
    """P3: longest hover on a given route without a rest.

    Examples
    --------
    >>> import optuav
    >>> plan = optuav.solve("paper", optuav.P3(), perspective="battery")
    >>> f"{plan.hover_time_s:.3f}"
    '688.848'
    """

    building: None = field(default=None, init=False, repr=False)
    order: None = field(default=None, init=False, repr=False)

    def declare(self, model: Model, given: Given) -> None:
        """State (P3): P3.a state of charge, and P3.b as the upper bound of Δ."""
        hover = model.variable("hover_time_s", "Δ", unit="s")
        given.keep_deadline(model, "P3.b hover time", hover)
        model.maximise(hover)
        charged = given.soc_end(hover) >= given.min_soc
        model.subject_to("P3.a state of charge", charged, kind="state of charge")
        given.keep_wells(model, "P3.a", hover)


@dataclass(frozen=True)
class P4(Formulation):
    """P4: longest hover with one rest on a given building.

    Parameters
    ----------
    building
        Name of the building to rest on.
    order
        ``"rest-first"``, ``"hover-first"``, or None for the better of the two.

    Examples
    --------
    >>> import optuav
    >>> plan = optuav.solve("paper", optuav.P4("b1"), perspective="battery")
    >>> f"{plan.hover_time_s:.2f} s with {plan.rest_time_s:.2f} s of rest"
    '719.54 s with 392.14 s of rest'
    """

    building: str = field(kw_only=False)

    def declare(self, model: Model, given: Given) -> None:
        """State (P4): P4.a state of charge, P4.b deadline; of equal plans the shortest rest."""
        hover = model.variable("hover_time_s", "Δ", unit="s", first_slot=1)
        rest = model.variable("rest_time_s", "T'", unit="s", first_slot=1)
        model.maximise(hover)
        model.prefer_small(rest)
        charged = given.soc_end(hover, rest) >= given.min_soc
        model.subject_to("P4.a state of charge", charged, kind="state of charge")
        given.keep_wells(model, "P4.a", hover, rest)
        given.keep_deadline(model, "P4.b deadline", hover, rest)
