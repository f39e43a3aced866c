"""(P2) of the paper: shortest flight and rest, as printed, tight, or for a wanted hover time."""

from dataclasses import dataclass, field

from formulations.formulation import Formulation, Given
from formulations.limits import state_limits
from optuav.modelling import Model
from optuav.options import Trajectory


@dataclass(frozen=True, kw_only=True, repr=False)
class P2(Formulation):
    """P2: shortest flight and rest, the hover time free or wanted.

    Parameters
    ----------
    tight
        Whether Δ = T_max − T_fl − T', as the paper's derivation assumes. As printed (False), Δ is
        not in the objective: any feasible Δ is optimal, and optuav chooses the shortest mission.
    hover_time_s
        Least hover time Δ, 0 to 1e7 [s], or None. With it, (P2) finds the shortest flight and rest
        of a plan that hovers for this time; not with ``tight``.
    trajectory, order
        Routes to choose from: ``"optimal"``, ``"direct"``, ``"traj1"`` or ``"traj2"``; and
        ``"rest-first"``, ``"hover-first"``, or None for the better of the two. `P1` explains them.
    device_order
        Names of several devices in the order of the hovers, or None for the best one.

    Examples
    --------
    >>> import optuav
    >>> plan = optuav.solve("paper", optuav.P2(tight=True), perspective="battery")
    >>> f"{plan.hover_time_s:.2f} s of hover in {plan.mission_time_s:.0f} s"
    '719.54 s of hover in 1200 s'
    >>> plan = optuav.solve("paper", optuav.P2(hover_time_s=700), perspective="battery")
    >>> f"{plan.hover_time_s:.2f} s of hover in {plan.mission_time_s:.0f} s"
    '700.00 s of hover in 1009 s'
    """

    building: None = field(default=None, init=False, repr=False)
    trajectory: Trajectory = "optimal"
    device_order: tuple[str, ...] | None = None
    tight: bool = False
    hover_time_s: float | None = None

    @property
    def name(self) -> str:
        """``"P2"`` or ``"P2-tight"``."""
        return "P2-tight" if self.tight else "P2"

    def declare(self, model: Model, given: Given) -> None:
        """Declare (P2), P2.a to P2.e; among equal plans, prefer the shortest mission."""
        hover, rest = given.hover_and_rest(model)
        model.minimise(given.flight_time_s + rest, unit="s")
        model.prefer_small(hover)
        state_limits(model, given, "P2", hover, rest)
        if self.hover_time_s is not None:
            model.title = "P2 for a wanted hover time: shortest flight and rest"
            model.subject_to("P2 wanted hover time", hover >= self.hover_time_s, unit="s")
        if self.tight:
            aim = "shortest flight and rest, hovering all the time that is left"
            model.title = f"P2 with the deadline tight: {aim}"
            used = hover + rest if given.rests else hover
            label, whole = "P2.d deadline tight", used == given.time_left
            model.subject_to(label, whole, unit="s", kind="deadline")
