"""(P3) of the paper: hover as long as possible on a given route, without a rest."""

from dataclasses import dataclass, field

from formulations.formulation import Formulation, Given
from optuav.modelling import Model
from optuav.options import Speed


@dataclass(frozen=True, kw_only=True, repr=False)
class P3(Formulation):
    """P3: longest hover on a given route without a rest.

    Parameters
    ----------
    speed
        ``"mission"``, or ``"free"``: legs at the ground speeds that are best, as in `P1`.
    device_order
        Names of several devices in the order of the hovers, or None for the best one.

    Examples
    --------
    >>> import optuav
    >>> plan = optuav.solve("paper", optuav.P3(), perspective="battery")
    >>> f"{plan.hover_time_s:.3f}"
    '688.848'
    """

    building: None = field(default=None, init=False, repr=False)
    order: None = field(default=None, init=False, repr=False)
    speed: Speed = "mission"
    device_order: tuple[str, ...] | None = None

    def declare(self, model: Model, given: Given) -> None:
        """Declare (P3): P3.a state of charge, and P3.b as the upper bound of Δ."""
        hover = model.variable("hover_time_s", "Δ", unit="s")
        given.keep_deadline(model, "P3.b hover time", hover)
        model.maximise(hover)
        given.keep_charge(model, "P3.a state of charge", hover)
        given.keep_wells(model, "P3.a", hover)
