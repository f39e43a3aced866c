"""Shadow prices: the gain from one more unit of a parameter at the optimum."""

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import compress
from typing import NamedTuple

import numpy as np

from formulations.formulation import OF_HOVER
from optuav.arrays import Floats
from optuav.diagnosis.infeasibility import is_own
from optuav.engines import bracket, closed_form
from optuav.engines.prices import ShadowPrice, ShadowPrices
from optuav.engines.solution import Solution
from optuav.mission.keys import Key, stated_keys
from optuav.modelling import Model, Parameter
from optuav.modelling.traversal import has_unknowns, leaves
from optuav.solving import Program
from optuav.solving.longest import ITINERARIES_AT_ONCE
from optuav.status import Status

NEGLIGIBLE = 1e-7
"""Change by as much of a parameter as there is, below which it is rounding, in a second's worth."""
RATIO_STEP = 0.01  # One more unit of a ratio is one more percent
AGAIN = {closed_form.NAME: closed_form.solve, bracket.NAME: bracket.solve}
"""The engines that prove every answer, and quickly enough to answer once for every step."""
ROUNDED, BRACKETED = 1e-12, 1e-7
"""Change of the objective that is rounding: a share of it in closed form, of a second's worth when
bracketed."""

MEANS = [name.partition("[")[0] for name in OF_HOVER]
OVER_DEVICE = re.compile(rf"({'|'.join(MEANS)})\[(\d+)\]")
"""The name of a figure of one of several hovers: that of their mean, and the place in the route."""


class ParameterStep(NamedTuple):
    """A change of a parameter; of a hover over one of several devices by the device's number."""

    name: str
    change: float
    device: int | None = None


@dataclass(frozen=True)
class Price:
    """Price of a parameter of the winning programme, with the other parameters held fixed.

    Parameters
    ----------
    name, symbol, unit
        The parameter as the programme has it.
    key
        The mission's key of the same meaning and unit; empty if it is derived.
    value
        Its present value, in its unit.
    less, more
        Change of the objective (s of hover) per unit, below and above the value: they differ at a
        kink, are infinite on a side that is infeasible, and NaN beyond the range of the key; 0
        where that is rounding.
    step
        How much "one more" is, in the parameter's unit.
    gain, loss
        Change of the objective by one step more, and by one less, solved again: infinite where that
        leaves no plan, NaN where it was not solved again or is beyond the range of the key.
    solved_again
        Whether gain and loss are known by solving again.
    device
        Of a figure of the hover over one of several devices, its name; else empty.

    Examples
    --------
    >>> import optuav
    >>> prices = optuav.explain("paper", "P3", perspective="battery").prices
    >>> (price,) = [row for row in prices if row.key == "limits.min_soc"]
    >>> round(price.more, 2), price.step, round(price.gain, 2)
    (-819.02, 0.01, -8.19)
    """

    name: str
    symbol: str
    unit: str
    key: str
    value: float
    less: float
    more: float
    step: float
    gain: float
    loss: float
    solved_again: bool
    device: str = ""

    @property
    def has_kink(self) -> bool:
        """True if the two sides differ."""
        return ShadowPrice(self.less, self.more).has_kink

    @property
    def matters(self) -> bool:
        """True if a change to either side moves the objective beyond rounding."""
        return any(abs(side) > 0.0 for side in (self.less, self.more))

    @property
    def at_edge(self) -> bool:
        """True if one side is infeasible, and the other has no effect."""
        return {math.inf, 0.0} >= {abs(self.less), abs(self.more)} != {0.0}


def prices(
    program: Program, solutions: Sequence[Solution], chosen: tuple[int, int], *, brief: bool = False
) -> tuple[Price, ...]:
    """Shadow prices of the winning programme; where routes tie, of the best of them on either side.

    Chosen are part and entry of the best answer with continuous times. Parameters that are compared
    with figures of the mission only, as the altitude of the hover point, have no price. In brief,
    steps are solved again only for parameters whose price is not 0 on both sides. What changes over
    one of several devices changes the mean over all with it, and the mean all of them.
    """
    model, by_name = program.parts[chosen[0]].model, program.shadow_prices(solutions)
    parameters = [parameter for parameter in _moving(model) if parameter.name in by_name]
    part, served = program.parts[chosen[0]], program.network.mission.served
    order = program.network.routes.devices[part.routes[chosen[1]]].tolist()
    devices = {
        p.name: order[int(at[2]) - 1] for p in parameters if (at := OVER_DEVICE.match(p.name))
    }
    rates = {
        p.name: _rate(
            by_name, _moves(program, ParameterStep(p.name, 1.0, devices.get(p.name)), order)
        )
        for p in parameters
    }
    keys = stated_keys(program.network.mission).values()
    key_of = {(key.name, key.unit.replace("-", "1")): key for key in keys}
    known_keys = [key_of.get((parameter.key, parameter.unit)) for parameter in parameters]
    row, keyed = model.row(chosen[1]), zip(parameters, known_keys, strict=True)
    steps = [_step(p, key, float(row[p.name])) for p, key in keyed]
    again = [not brief or any(rates[p.name]) for p in parameters]
    pairs = [*compress(zip(parameters, steps, strict=True), again)]
    moved = [
        ParameterStep(p.name, sign * step, devices.get(p.name))
        for sign in (1, -1)
        for p, step in pairs
    ]
    changes = np.full((len(parameters), 2), np.nan)
    changes[again] = _effects(program, solutions, chosen, moved).reshape(2, -1).T
    negligible = NEGLIGIBLE * float(solutions[chosen[0]].second[chosen[1]])
    rows, columns = [], (parameters, known_keys, steps, changes.tolist())
    for p, key, step, change in zip(*columns, strict=True):
        rate, is_open = rates[p.name], bool(np.isnan(change).any())
        both = zip((rate.more, rate.less), change, strict=True)
        gain, loss = (math.nan if is_open or math.isnan(side) else again for side, again in both)
        what = p.name, p.symbol, p.unit, key.name if key else "", float(row[p.name])
        size = max(abs(what[-1]), step)
        less, more = (0.0 if abs(side) * size <= negligible else side for side in rate)
        device = served[devices[p.name]].name if p.name in devices else ""
        rows.append(Price(*what, less, more, step, gain, loss, not is_open, device))
    return tuple(sorted(rows, key=lambda each: not each.key))


def _rate(by_name: ShadowPrices, moves: Iterator[tuple[str, float]]) -> ShadowPrice:
    """The price of parameters that move together."""
    rates = [(weight, by_name[name]) for name, weight in moves if name in by_name]
    less, more = (sum(weight * rate[side] for weight, rate in rates) for side in (0, 1))
    return ShadowPrice(less, more)


def _moves(
    program: Program, step: ParameterStep, order: Sequence[int]
) -> Iterator[tuple[str, float]]:
    """Yield the parameters that a step changes on routes with an order of devices, and how far."""
    name, change, device = step
    if device is not None:
        mean, place = name.partition("[")[0], order.index(device) + 1
        yield f"{mean}[{place}]", change
        yield mean, change * program.network.mission.served[device].share
        return
    yield name, change
    if name in MEANS:
        yield from ((f"{name}[{place}]", change) for place in range(1, len(order) + 1))


def _moving(model: Model) -> list[Parameter]:
    """The parameters in the objective, in bounds, in constraints with unknowns, and one's own."""
    trees = [model.objective, *model.preferences]
    trees += [bound for variable in model.variables for bound in (variable.lower, variable.upper)]
    sides = [constraint.relation.sides for constraint in model.constraints]
    trees += [side for both in sides if has_unknowns(*both) for side in both]
    names = {leaf.name for leaf in leaves(*trees)}
    return [p for p in model.parameters.values() if p.name in names or is_own(p)]


def _step(parameter: Parameter, key: Key | None, value: float) -> float:
    """Return the size of "one more": a percent of a ratio, a unit, or a first digit if far less.

    A tenth of that, and so on, where the key could not be so large.
    """
    step = 1.0
    if parameter.unit == "1" and not (key and key.whole):
        step = RATIO_STEP
    elif 0.0 < abs(value) < RATIO_STEP:
        step = 10.0 ** math.floor(math.log10(abs(value)) - 1)
    while key and value + step > key.high > value:
        step /= 10.0
    return step


@np.errstate(divide="ignore", invalid="ignore", over="ignore")
def _effects(
    program: Program,
    solutions: Sequence[Solution],
    chosen: tuple[int, int],
    steps: Sequence[ParameterStep],
) -> Floats:
    """Change of the best objective by each of some steps, on all routes, with the same engines.

    Infinite where no plan is left; NaN where an engine is not in `AGAIN` or leaves an answer open.
    """
    if any(solution.engine not in AGAIN for solution in solutions):
        return np.full(len(steps), np.nan)
    half = len(steps) // 2
    if half and len(steps) * max(len(part.routes) for part in program.parts) > ITINERARIES_AT_ONCE:
        halves = (_effects(program, solutions, chosen, e) for e in (steps[:half], steps[half:]))
        return np.concatenate([*halves])
    best, is_open = np.full(len(steps), -np.inf), np.zeros(len(steps), bool)
    some = program.network.routes.devices[0].tolist()
    changed = {name for step in steps for name, _ in _moves(program, step, some)}
    if any(step.device is not None for step in steps):  # At other places on other routes
        changed |= {name.format(place) for name in OF_HOVER for place in range(1, len(some) + 1)}
    for part, solution in zip(program.parts, solutions, strict=True):
        shape = (len(steps), len(part.routes))  # steps by row, routes by column
        values = {
            name: np.array(np.broadcast_to(number.value, shape), dtype=float)
            for name, number in part.model.given.items()
            if np.ndim(number.value) or name in changed
        }
        orders, place = np.unique(
            program.network.routes.devices[part.routes], axis=0, return_inverse=True
        )
        for k, step in enumerate(steps):
            for number, order in enumerate(orders.tolist()):
                for name, by in _moves(program, step, order):
                    if name in values:
                        values[name][k, place.ravel() == number] += by
        columns = {name: table.ravel() for name, table in values.items()}
        solution_moved = AGAIN[solution.engine](part.model, math.prod(shape), columns)
        table = (part.model.sign * solution_moved.objective).reshape(shape)
        best = np.fmax(best, np.fmax.reduce(table, axis=1, initial=-np.inf))
        unclear = np.isin(solution_moved.statuses, [Status.FEASIBLE, Status.UNKNOWN])
        is_open |= unclear.reshape(shape).any(axis=1)
    winner, entry = solutions[chosen[0]], chosen[1]
    before = float(winner.objective[entry])
    change = program.parts[chosen[0]].model.sign * best - before
    exact = all(solution.engine == closed_form.NAME for solution in solutions)
    rounding = ROUNDED * abs(before) if exact else BRACKETED * winner.second[entry]
    change[np.abs(change) <= rounding] = 0.0
    change[is_open] = np.nan
    return change
