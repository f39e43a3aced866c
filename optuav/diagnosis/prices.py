"""Shadow prices: what one more unit of a parameter brings at the optimum."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from optuav.arrays import Floats
from optuav.diagnosis.keys import Key, keys
from optuav.engines import bracket, closed_form
from optuav.engines.prices import ShadowPrice
from optuav.engines.solution import Solution
from optuav.modelling import Model, Parameter
from optuav.modelling.expression import Operand
from optuav.modelling.traversal import has_unknowns, leaves
from optuav.solving import Program
from optuav.solving.outcome import Part
from optuav.status import Status

NEGLIGIBLE = 1e-7
"""Change of the objective by as much of a parameter as there is, below which it is rounding."""
RATIO_STEP = 0.01
"""One more unit of a ratio is one more percent."""
AGAIN = {closed_form.NAME: closed_form.solve, bracket.NAME: bracket.solve}
"""The engines that prove every answer, and quickly enough to answer once for every step."""
ROUNDING = 1e-12
"""Share of the objective that is rounding where all of it is solved in closed form."""
BRACKETED = 1e-7
"""Change of the objective within which two bracketed answers are the same."""
AT_ONCE = 1 << 14
"""Programmes that are solved together: few enough for bounded memory."""

Step = tuple[Parameter, float]
"""A parameter and by how much it changes."""


@dataclass(frozen=True)
class Price:
    """What a parameter of the winning programme is worth, the other parameters held."""

    name: str
    symbol: str
    unit: str
    key: str  # The mission's key of the same meaning and unit; empty if it is derived
    value: float
    # Change of the objective per unit on either side: they differ at a kink, and are infinite on a
    # side that is infeasible.
    less: float
    more: float
    step: float  # How much "one more" is
    gain: float  # Change of the objective by one step more; infinite where that leaves no plan
    loss: float  # The same by one step less
    solved_again: bool  # Whether gain and loss come from solving again, else from the rates

    @property
    def has_kink(self) -> bool:
        """Whether the two sides differ."""
        return ShadowPrice(self.less, self.more).has_kink

    @property
    def matters(self) -> bool:
        """Whether a change to either side moves the objective, to a rounding."""
        steepest = max(abs(self.less), abs(self.more))
        return steepest * max(abs(self.value), self.step) > NEGLIGIBLE

    @property
    def at_edge(self) -> bool:
        """Whether one side is infeasible, and the other one without effect."""
        finite = [each for each in (self.less, self.more) if math.isfinite(each)]
        return len(finite) < 2 and not any(finite)

    def to_dict(self) -> dict[str, object]:
        """As plain data; None on a side that is infeasible."""
        return {
            name: None if isinstance(value, float) and math.isinf(value) else value
            for name, value in vars(self).items()
        }


def prices(
    program: Program, solutions: Sequence[Solution], chosen: tuple[int, int]
) -> tuple[Price, ...]:
    """Shadow prices of the winning programme; where itineraries tie, those of the best of them.

    Chosen are the part and entry of the best of the answers with continuous times. Parameters that
    the programme only compares with other figures, as the altitude of the hover point with its
    limits, have none: another value in the mission would move these figures too.
    """
    model = program.parts[chosen[0]].model
    row, fixed = model.row(chosen[1]), _compared_alone(model)
    rates = {k: v for k, v in program.prices(solutions, chosen).items() if k not in fixed}
    stated = {name: model.parameters[name] for name in rates}
    known = {name: _key(program, parameter) for name, parameter in stated.items()}
    values = {name: float(row[name]) for name in rates}
    steps = {name: _step(stated[name], known[name], values[name]) for name in rates}
    up: list[Step] = [(stated[name], steps[name]) for name in rates]
    down: list[Step] = [(parameter, -step) for parameter, step in up]
    changes = _effects(program, solutions, chosen, [*up, *down]).tolist()
    found = []
    for k, (name, rate) in enumerate(rates.items()):
        gain, loss = changes[k], changes[k + len(rates)]
        if is_open := math.isnan(gain) or math.isnan(loss):
            gain, loss = rate.more * steps[name], -rate.less * steps[name]
        key = known[name]
        found.append(
            Price(
                name=name,
                symbol=stated[name].symbol,
                unit=stated[name].unit,
                key=key.name if key else "",
                value=values[name],
                less=rate.less,
                more=rate.more,
                step=steps[name],
                gain=gain,
                loss=loss,
                solved_again=not is_open,
            )
        )
    return tuple(sorted(found, key=lambda each: not each.key))


def _effects(
    program: Program,
    solutions: Sequence[Solution],
    chosen: tuple[int, int],
    steps: Sequence[Step],
) -> Floats:
    """Change of the best objective by each of some steps, solved again by the same engines.

    Infinite where a step leaves no plan; NaN where an engine is not among `AGAIN`, or leaves an
    answer open.
    """
    if any(each.engine not in AGAIN for each in solutions):
        return np.full(len(steps), np.nan)
    number, entry = chosen
    best, is_open = np.full(len(steps), -np.inf), np.zeros(len(steps), bool)
    for k, (part, solution) in enumerate(zip(program.parts, solutions, strict=True)):
        own = entry if k == number else None
        size = max(1, AT_ONCE // len(part.routes))
        for begin in range(0, len(steps), size):
            some = slice(begin, begin + size)
            found = _solved_again(part, solution.engine, own, steps[some])
            # Steps by row, routes by column.
            table = (part.model.towards * found.objective).reshape(-1, len(part.routes))
            best[some] = np.fmax(best[some], np.fmax.reduce(table, axis=1, initial=-np.inf))
            unclear = [status is Status.FEASIBLE for status in found.statuses]
            if found.words:
                unclear = [a or bool(b) for a, b in zip(unclear, found.words, strict=True)]
            is_open[some] |= np.reshape(unclear, table.shape).any(axis=1)
    before = float(solutions[number].objective[entry])
    change = program.parts[number].model.towards * best - before
    exact = all(each.engine == closed_form.NAME for each in solutions)
    change[np.abs(change) <= (ROUNDING * abs(before) if exact else BRACKETED)] = 0.0
    change[is_open] = np.nan
    return change


@np.errstate(divide="ignore", invalid="ignore", over="ignore")
def _solved_again(part: Part, engine: str, own: int | None, steps: Sequence[Step]) -> Solution:
    """A part solved for all steps at once, one programme for each step and route.

    A figure of a single route changes on the entry `own` alone, or nowhere.
    """
    routes = len(part.routes)
    shape = (len(steps), routes)
    values = {
        name: np.tile(each.value, len(steps))
        for name, each in part.model.given.items()
        if np.ndim(each.value)
    }
    for k, (parameter, step) in enumerate(steps):
        name, single = parameter.name, np.ndim(parameter.value) > 0
        if name not in part.model.given or (single and own is None):
            continue
        table = np.array(np.broadcast_to(part.model.given[name].value, shape), dtype=float)
        table = values[name].reshape(shape) if name in values else table
        table[k, own if single else slice(None)] += step
        values[name] = table.ravel()
    return AGAIN[engine](part.model, routes * len(steps), values)


def _step(parameter: Parameter, key: Key | None, value: float) -> float:
    """What "one more" is: a percent of a ratio, a unit, or the first digit of what is far less.

    A tenth of that, and so on, where the key could not be so large.
    """
    size = abs(value)
    if parameter.unit == "1" and not (key and key.whole):
        step = RATIO_STEP
    elif size == 0.0 or size >= RATIO_STEP:
        step = 1.0
    else:
        step = 10.0 ** math.floor(math.log10(size) - 1)
    while key and value + step > key.high > value:
        step /= 10.0
    return step


def _compared_alone(model: Model) -> set[str]:
    """Names of the parameters that stand in constraints without unknowns and nowhere else."""
    free: list[Operand] = [model.objective, *model.preferences]
    free += [bound for each in model.variables for bound in (each.lower, each.upper)]
    fixed: list[Operand] = []
    for constraint in model.constraints:
        sides = constraint.relation.sides
        (free if has_unknowns(*sides) else fixed).extend(sides)
    return {*_names(fixed)} - {*_names(free)}


def _names(trees: Sequence[Operand]) -> Iterator[str]:
    return (leaf.name for leaf in leaves(*trees) if isinstance(leaf, Parameter))


def _key(program: Program, parameter: Parameter) -> Key | None:
    """The key of a parameter, if both have the same unit."""
    for key in keys(program.network.mission):
        if key.name == parameter.key and key.unit.replace("-", "1") == parameter.unit:
            return key
    return None
