"""The endless cycle: hover as long as possible, and come back with the charge of the start."""

from dataclasses import dataclass, field, replace

from formulations.formulation import Formulation, Given
from formulations.soc import AVAILABLE, wells_after_steps
from optuav.modelling import Model
from optuav.options import Order


@dataclass(frozen=True)
class Cycle(Formulation):
    """Cycle: longest hover between rests on one building that can be repeated without end.

    The mission must begin and end on the building's roof, like the mission of
    ``optuav.coverage(…).plan``. Its ``start`` is ignored: the initial charge is an unknown that the
    cycle restores. In `battery` that is only the state of charge, in `available` the charge of both
    wells.

    Parameters
    ----------
    building
        Name of the building to rest on.

    Examples
    --------
    >>> import optuav
    >>> mission = optuav.coverage("paper").plan.mission
    >>> plan = optuav.solve(mission, optuav.Cycle("b9"))
    >>> f"hover {plan.hover_time_s:.2f} s, rest {plan.rest_time_s:.1f} s"
    'hover 608.33 s, rest 5787.0 s'
    """

    building: str = field(kw_only=False)
    order: Order = field(default="hover-first", init=False, repr=False)

    def declare(self, model: Model, given: Given) -> None:
        """Declare that the cycle restores the charge and that every landing keeps η0."""
        hover = model.variable("hover_time_s", "Δ", unit="s")
        rest = model.variable("rest_time_s", "T'", unit="s")
        model.maximise(hover)
        if given.perspective == AVAILABLE:
            full_As = given.available_fraction * given.battery_As
            y1 = model.variable("start_available_As", "y1_0", unit="A s", upper=full_As)
            y2 = model.variable(
                "start_bound_As", "y2_0", unit="A s", upper=given.battery_As - full_As
            )
            given = replace(given, start_soc=None, start_available_As=y1, start_bound_As=y2)
            end = wells_after_steps(given, hover, rest)[-1]
            # As shares of the capacity, which a solver's tolerance suits better than charges.
            size_As = given.battery_As
            model.subject_to("Cycle.a available well", end.available_As / size_As == y1 / size_As)
            model.subject_to("Cycle.a bound well", end.bound_As / size_As == y2 / size_As)
        else:
            soc = model.variable("start_soc", "η_s", unit="1", upper=1.0)
            given = replace(given, start_soc=soc, start_available_As=None, start_bound_As=None)
            model.subject_to("Cycle.a charge", given.soc_end(hover, rest) == soc)
        landing = given.soc_end(hover) >= given.min_soc
        model.subject_to("Cycle.b charge at landing", landing, kind="state of charge")
        given.keep_wells(model, "Cycle.c", hover, rest)
