"""(P4) of the paper: hover as long as possible with one rest on a given building."""

from dataclasses import dataclass, field

from formulations.formulation import Formulation, Given
from optuav.modelling import Model
from optuav.options import Speed


@dataclass(frozen=True, repr=False)
class P4(Formulation):
    """P4: longest hover with one rest on a given building.

    Parameters
    ----------
    building
        Name of the building to rest on.
    order
        ``"rest-first"``, ``"hover-first"``, or None for the better of the two; with several devices
        ``"between"`` too, and None for the best.
    speed
        ``"mission"``, or ``"free"``: legs at the ground speeds that are best, as in `P1`.
    device_order
        Names of several devices in the order of the hovers, or None for the best one.

    Examples
    --------
    >>> import optuav
    >>> plan = optuav.solve("paper", optuav.P4("b1"), perspective="battery")
    >>> f"{plan.hover_time_s:.2f} s with {plan.rest_time_s:.2f} s of rest"
    '719.54 s with 392.14 s of rest'
    """

    building: str = field(kw_only=False)
    speed: Speed = field(default="mission", kw_only=True)
    device_order: tuple[str, ...] | None = field(default=None, kw_only=True)

    def declare(self, model: Model, given: Given) -> None:
        """Declare (P4): P4.a state of charge, P4.b deadline; prefer the shortest rest."""
        hover = model.variable("hover_time_s", "Δ", unit="s", first_slot=1)
        rest = model.variable("rest_time_s", "T'", unit="s", first_slot=1)
        model.maximise(hover)
        model.prefer_small(rest)
        given.keep_charge(model, "P4.a state of charge", hover, rest)
        given.keep_wells(model, "P4.a", hover, rest)
        given.keep_deadline(model, "P4.b deadline", hover, rest)
