"""The state of charge at the end, by name of the perspective, and the limits of the available well.

By [1] eqs (11)-(16), y1 ≥ 0 and y1 ≤ ωB hold at every moment if they hold at the end of every stage
of constant current: while a stage discharges, y1 is least at one of its ends and stays below ωB;
while it charges, y1 stays above 0 and is largest at an end. Legs never charge. Where charging
tapers, y1 never passes ωB.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any, NamedTuple, TypeAlias

from formulations.parameters import Landing, Quantities
from optuav.modelling import Expression, Let, Relation
from optuav.modelling.expression import Bounded, Call, Indexed, Operand, PartedLabel
from optuav.modelling.forms import part
from optuav.options import Perspective
from optuav.physics import kibam
from optuav.physics.kibam import Battery, Stage, Tilted, Wells

StateOfCharge: TypeAlias = Callable[[Quantities, Operand, Operand], Operand]


def battery(given: Quantities, hover: Operand, rest: Operand) -> Operand:
    """η1 = (y1 + y2)/B, by charge balance: [1] eq (19), exact for KiBaM."""
    drawn = given.flight_charge_As + given.hover_current_A * hover - given.rest_current_A * rest
    return given.start_share - drawn / given.battery_As


def energy(given: Quantities, hover: Operand, rest: Operand) -> Operand:
    """η2 = 1 − (E_fl + E_hv − E_harv)/E_0, radio included: [1] eq (20)."""
    harvested = given.hover_received_W * hover + given.rest_received_W * rest
    drawn = given.flight_energy_J + given.hover_power_W * hover - harvested
    return given.start_share - drawn / given.nominal_battery_J


def adjusted(given: Quantities, hover: Operand, rest: Operand) -> Operand:
    """η3 = 1 − E_fl/E_1 − E_hv/E_2 + E_harv/E_0; the paper prints the last two signs flipped.

    E_1 and E_2 are as the mission states them, or B u_fl and B u_hv.
    """
    harvested = given.hover_received_W * hover + given.rest_received_W * rest
    in_flight_J, in_hover_J = given.flight_battery_J, given.hover_battery_J
    if in_flight_J is None:
        in_flight_J = given.battery_As * given.flight_voltage_V
    if in_hover_J is None:
        in_hover_J = given.battery_As * given.hover_voltage_V
    flown, hovered = given.flight_energy_J / in_flight_J, given.hover_power_W * hover / in_hover_J
    return given.start_share - flown - hovered + harvested / given.nominal_battery_J


def stepwise(given: Quantities, hover: Operand, rest: Operand) -> Operand:
    """(y1 + y2)/B through both wells, which take all that they are given, as in `battery`."""
    given = replace(given, tapers=False)
    return wells_after_steps(given, hover, rest)[-1].total_As / given.battery_As


def tapered(given: Quantities, hover: Operand, rest: Operand) -> Operand:
    """(y1 + y2)/B where the battery takes less once it is full; a name stands for it in a tree."""
    end = wells_after_steps(given, hover, rest)[-1].total_As / given.battery_As
    return Let("state of charge at the end", "η", "1", end) if isinstance(end, Expression) else end


STAYS = {
    "hover": ("hover_current_A", "hover_power_W", "hover_received_W"),
    "rest": ("rest_current_A", "rest_received_W"),
}
"""Quantities of each stay, which a route without it does not have."""

PAPER: tuple[Perspective, ...] = ("battery", "energy", "adjusted")  # The perspectives of the paper

AVAILABLE: Perspective = "available"
"""Charge balance as in `battery`, and a battery that never runs dry nor is overcharged."""

PERSPECTIVES: Mapping[Perspective, StateOfCharge] = {
    "battery": battery,
    "energy": energy,
    "adjusted": adjusted,
    "wells": stepwise,
    AVAILABLE: battery,
}
"""Where charging tapers, `tapered` has the state of charge of `available`."""


@dataclass(frozen=True)
class _Pool(Battery):
    """All packs as one battery, the rate at which its wells level out known by a name."""

    @cached_property
    def rate_per_s(self) -> Operand:
        """k' [1/s]; a number stays one."""
        rate = super().rate_per_s
        return Let("levelling rate", "k'", "1/s", rate) if isinstance(rate, Expression) else rate


def soc_after(
    given: Quantities, perspective: Perspective, hover: Operand, rest: Operand = 0.0
) -> Operand:
    """State of charge [-] after all legs, hovering and resting [s], by the perspective.

    A stay of 0.0 s adds no terms.
    """
    if given.tapers and perspective == AVAILABLE:
        return tapered(given, hover, rest)
    zeros = dict[str, Any]()
    for stay, time in zip(STAYS, (hover, rest), strict=True):
        zeros |= dict.fromkeys(STAYS[stay], 0.0) if isinstance(time, float) and not time else {}
    return PERSPECTIVES[perspective](replace(given, **zeros) if zeros else given, hover, rest)


def soc_on_landing(
    given: Quantities, perspective: Perspective, landing: Landing, hover: Operand, rest: Operand
) -> Operand:
    """State of charge [-] at the end of a leg that is not the last, by the perspective."""
    if perspective == "wells" or (given.tapers and perspective == AVAILABLE):
        return wells_after_steps(given, hover, rest)[landing.step].total_As / given.battery_As
    flown = {"flight_charge_As": landing.charge_As, "flight_energy_J": landing.energy_J}
    if given.hovers:
        flown |= hovered_before(given, landing.stays.count("hover"))
    before = zip(STAYS, (hover, rest), strict=True)
    times = (time if stay in landing.stays else 0.0 for stay, time in before)
    return soc_after(replace(given, **flown), perspective, *times)


def hovered_before(given: Quantities, count: int) -> dict[str, Operand]:
    """Figures of the first hovers over several devices, by the second of all hover time Δ."""
    before = given.hovers[:count]
    return {
        "hover_current_A": sum(flow.share * flow.current_A for flow in before),
        "hover_power_W": given.hover_power_W * sum(flow.share for flow in before),
        "hover_received_W": sum(flow.share * flow.received_W for flow in before),
    }


def start_charge(whole: Battery, given: Quantities) -> Tilted:
    """Charge of all packs at the start: as stated, else full."""
    if given.start_available_As is not None:
        return Tilted.of(whole, Wells(given.start_available_As, given.start_bound_As))
    if given.start_soc is not None:
        return Tilted(given.start_soc * whole.capacity_As, 0.0)
    return kibam.start(whole)


def wells_after_steps(given: Quantities, hover: Operand, rest: Operand) -> Sequence[Wells]:
    """The wells after every step of the itinerary.

    Constraints share the trees of the same times; steps have names, which keeps the page short.
    """
    for h, r, known in given.known_levels:
        if h is hover and r is rest:
            return known
    whole = _Pool(given.battery_As, given.available_fraction, given.flow_rate_per_s)
    charge, levels = start_charge(whole, given), list[Wells]()
    hovers = [Stage(-given.hover_current_A, hover)]
    if given.hovers:
        hovers = [Stage(-flow.current_A, part(flow.share, hover)) for flow in given.hovers]
    stays = {"hover": iter(hovers), "rest": iter([Stage(given.rest_current_A, rest)])}
    for n, step in enumerate(given.steps, start=1):
        stay, stage = (step, next(stays[step])) if isinstance(step, str) else ("", step)
        tapers = given.tapers and stay != ""
        if tapers:
            words = f"after the {stay}, whose current tapers once y1 = ωB"
            available, bound = _tapered(whole, charge.wells(whole), stage, stay)
        else:
            words = "" if stay else "by eqs (15)-(16), a stage of flight"
            flight = [stage] if isinstance(stage, Stage) else stage
            total, tilt = kibam.tilted_after(whole, charge, *flight)
            tilt = _named("tilt", "z", tilt, n, words)
            charge = Tilted(_named("charge", "y", total, n, words), tilt)
            available, bound = charge.wells(whole)
        available = _named("available", "y1", available, n, words)
        levels.append(Wells(available, _named("bound", "y2", bound, n, words)))
        if tapers:
            charge = Tilted.of(whole, levels[-1])
    given.known_levels.append((hover, rest, levels))
    return levels


def _named(what: str, symbol: str, tree: Operand, step: int, words: str) -> Operand:
    """A quantity after a step under a name; a number stays one."""
    if not isinstance(tree, Expression):
        return tree
    return Let(PartedLabel(f"{what} after step", step), Indexed(symbol, step), "A s", tree, words)


def _tapered(whole: Battery, level: Wells, stage: Stage, stay: str) -> Wells:
    """Wells after a stay in which charging tapers, in numbers or symbols.

    At constant current neither well would hold less (`optuav.physics.kibam`), and both as much
    while y1 < ωB. That, and the full wells, are bounds in a form that engines take.
    """
    if isinstance(stage.duration_s, float) and stage.duration_s == 0.0:
        return level
    if not any(isinstance(part, Expression) for part in (*level, *stage)):
        return kibam.tapered(whole, level, stage)
    constant, full = kibam.step(whole, level, stage), whole.full
    battery = whole.capacity_As, whole.available_fraction, whole.flow_rate_per_s
    operands = constant.available_As, full.available_As, *level, *stage, *battery
    name = f"the {stay} that tapers"
    functions = (Bounded(name, partial(_tapered_well, number)) for number in (0, 1))
    bounds = zip(functions, constant, full, strict=True)
    return Wells(*(Call(function, (*most, *operands)) for function, *most in bounds))


def _tapered_well(
    number: int, y1: Operand, y2: Operand, current: Operand, time: Operand, *battery: Operand
) -> Operand:
    """The available (0) or the bound well (1) after a stay in which charging tapers."""
    return kibam.tapered(Battery(*battery), Wells(y1, y2), Stage(current, time))[number]


LABELS = {"dry": "not dry", "past full": "not past full"}
"""Names of the limits of the available well, by kind."""


AHEAD = {"hover": "on reaching the hover point", "rest": "on landing at the building"}
"""The end of a leg, by the stay that follows."""


class StepEnd(NamedTuple):
    """The end of a step of an itinerary."""

    flight: int  # Number of the flight, from 1; of the one before where the step is a stay
    stage: int  # Number of the stage in its flight, from 1; 0 for a stay or a landing
    stay: str  # "hover" or "rest"; empty for a stage of flight
    lands: bool  # Whether a flight ends
    ahead: str = ""  # The stay that follows a landing: "hover" or "rest"
    hover: int = 0  # Number of that hover from 1, or of the one that ends, of several devices

    @property
    def parts(self) -> tuple[object, ...]:
        """Label, see `PartedLabel`."""
        if self.hover:
            return *(("after", "hover") if self.stay else ("on", "reaching", "hover")), self.hover
        if self.stay:
            return "after", "the", self.stay
        if self.ahead:
            return (AHEAD[self.ahead],)
        return "after", "stage", self.stage, "of flight", self.flight

    def __str__(self) -> str:
        return PartedLabel(*self.parts)


def landing_moments(given: Quantities) -> Iterator[StepEnd]:
    """The moments of the landings of an itinerary, which hovers as often as it has devices."""
    landings, hovers = given.landings, len(given.hovers) or 1
    for flight, landing in enumerate(landings, start=1):
        ahead = "rest" if landing.stays.count("hover") == hovers else "hover"
        if flight < len(landings):
            ahead = landings[flight].stays[-1]
        number = landing.stays.count("hover") + 1 if given.hovers and ahead == "hover" else 0
        yield StepEnd(flight, 0, "", True, ahead, number)


class WellLimit(NamedTuple):
    """A limit of the available well at the end of a step, see `Constraint` for its fields."""

    kind: str
    step: int
    moment: StepEnd
    relation: Relation


def well_limits(given: Quantities, hover: Operand, rest: Operand) -> Iterator[WellLimit]:
    """Limits that keep y1/B within 0 and ω after every step, in order."""
    flight, stage, last, hovers = 1, 0, len(given.steps) - 1, 0
    ends = zip(given.steps, wells_after_steps(given, hover, rest), strict=True)
    for number, (step, level) in enumerate(ends):
        share = level.available_As / given.battery_As
        stay = step if isinstance(step, str) else ""
        stage = 0 if stay else stage + 1
        lands = not stay and (number == last or isinstance(given.steps[number + 1], str))
        hovers += stay == "hover"
        hover_number = hovers if given.hovers and stay == "hover" else 0
        moment = StepEnd(flight, stage, stay, lands, hover=hover_number)
        flight += bool(stay)
        yield WellLimit("dry", number, moment, Relation(share, ">=", 0.0))
        if stay and not given.tapers:
            below = Relation(share, "<=", given.available_fraction)
            yield WellLimit("past full", number, moment, below)
