"""(P1) of the paper: hover as long as possible, on one route at a time."""

from dataclasses import dataclass, field

from formulations.formulation import Formulation, Given
from formulations.limits import state_limits
from optuav.modelling import Model
from optuav.options import HoverPoint, Speed, Trajectory


@dataclass(frozen=True, kw_only=True, repr=False)
class P1(Formulation):
    """P1: longest hover within reach of the device, with or without a rest.

    Parameters
    ----------
    trajectory
        Routes to choose from: ``"optimal"`` (direct or via any one building), ``"direct"``,
        ``"traj1"`` (via the building nearest to the device) or ``"traj2"`` (the shortest in time
        via one building); the latter two pass by the building or rest there.
    order
        ``"rest-first"``, ``"hover-first"``, or None for the better of the two. With several
        devices, these rest before or after all hovers, ``"between"`` rests between two of them, and
        None means the best order.
    device_order
        Names of several devices in the order of the hovers, or None for the best one. With several
        devices the trajectory is ``"optimal"`` or ``"direct"``, and the options below have their
        defaults.
    hover_point
        ``"w_U"``: hover at ``route.hover_m`` of the mission, or at the paper's w_U if the mission
        does not set it; ``"free"``: at the best point within reach of the device.
    speed
        ``"mission"``: legs fly at the mission's speed; ``"free"``: each leg at its best ground
        speed, for flight models that have speeds to choose from.
    stops, hovers
        Largest number of rests, 0 to 10, and of pieces of the hover, 1 to 10, in any order over all
        places. More than one of either needs the trajectory ``"optimal"``.

    Examples
    --------
    >>> import optuav
    >>> plan = optuav.solve("paper", optuav.P1(trajectory="traj1"), perspective="battery")
    >>> f"{plan.hover_time_s:.2f}"
    '715.05'
    """

    building: None = field(default=None, init=False, repr=False)
    trajectory: Trajectory = "optimal"
    device_order: tuple[str, ...] | None = None
    hover_point: HoverPoint = "w_U"
    speed: Speed = "mission"
    stops: int = 1
    hovers: int = 1

    def declare(self, model: Model, given: Given) -> None:
        """Declare (P1), P1.a to P1.e; among equal plans, prefer the shortest rest."""
        hover, rest = given.hover_and_rest(model)
        model.maximise(hover)
        state_limits(model, given, "P1", hover, rest)
