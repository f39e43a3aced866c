"""The constraints a to e that (P1) and (P2) share."""

from formulations.formulation import Given
from formulations.parameters import Covered
from optuav.modelling import Model, Variable
from optuav.modelling.expression import Operand, PartedLabel


def state_limits(
    model: Model, given: Given, problem: str, hover: Variable | None = None, rest: Operand = 0.0
) -> None:
    """State constraints a to e, which (P1) and (P2) share; without times only a, c and e."""
    points = given.covered or (Covered("", given.hover_distance_m, given.hover_altitude_m),)
    for device, distance_m, _ in points:
        in_reach, label = distance_m <= given.coverage_radius_m, f"{problem}.a outage"
        model.subject_to(of_device(label, device), in_reach, unit="m", kind="outage")
    if hover is not None:
        given.keep_charge(model, f"{problem}.b state of charge", hover, rest)
        given.keep_wells(model, f"{problem}.b", hover, rest)
    model.subject_to(f"{problem}.c ends", given.end_gap_m <= 0.0, unit="m")
    if hover is not None:
        given.keep_deadline(model, f"{problem}.d hover time", hover, rest)
    for device, _, altitude_m in points:
        high_enough, low_enough = (
            altitude_m >= given.min_altitude_m,
            altitude_m <= given.max_altitude_m,
        )
        model.subject_to(of_device(f"{problem}.e altitude", device), high_enough, unit="m")
        model.subject_to(of_device(f"{problem}.e highest altitude", device), low_enough, unit="m")


def of_device(label: str, device: str) -> str:
    """A label for one of several devices; of a single one, which needs no name, as it is."""
    return PartedLabel(label, "of", device) if device else label
