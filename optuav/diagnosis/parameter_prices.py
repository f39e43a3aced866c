"""Shadow prices: the gain from one more unit of a parameter at the optimum."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import compress

import numpy as np

from optuav.arrays import Floats
from optuav.diagnosis.infeasibility import is_own
from optuav.engines import bracket, closed_form
from optuav.engines.prices import ShadowPrice
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

Step = tuple[Parameter, float]  # A parameter and by how much it changes


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
    steps are solved again only for parameters whose price is not 0 on both sides.
    """
    model, rates = program.parts[chosen[0]].model, program.shadow_prices(solutions)
    parameters = [parameter for parameter in _moving(model) if parameter.name in rates]
    keys = stated_keys(program.network.mission).values()
    key_of = {(key.name, key.unit.replace("-", "1")): key for key in keys}
    known_keys = [key_of.get((parameter.key, parameter.unit)) for parameter in parameters]
    row, keyed = model.row(chosen[1]), zip(parameters, known_keys, strict=True)
    steps = [_step(p, key, float(row[p.name])) for p, key in keyed]
    again = [not brief or any(rates[p.name]) for p in parameters]
    pairs = [*compress(zip(parameters, steps, strict=True), again)]
    moved = [(p, sign * step) for sign in (1, -1) for p, step in pairs]
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
        rows.append(Price(*what, less, more, step, gain, loss, not is_open))
    return tuple(sorted(rows, key=lambda each: not each.key))


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
    program: Program, solutions: Sequence[Solution], chosen: tuple[int, int], steps: Sequence[Step]
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
    changed = {parameter.name for parameter, _ in steps}
    for part, solution in zip(program.parts, solutions, strict=True):
        shape = (len(steps), len(part.routes))  # steps by row, routes by column
        values = {
            name: np.array(np.broadcast_to(number.value, shape), dtype=float)
            for name, number in part.model.given.items()
            if np.ndim(number.value) or name in changed
        }
        for k, (parameter, step) in enumerate(steps):
            if parameter.name in values:
                values[parameter.name][k] += step
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
