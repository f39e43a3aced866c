"""What one more unit of a parameter would bring at the optimum."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from optuav.diagnosis.effects import Effect
from optuav.diagnosis.keys import Key, keys
from optuav.engines.prices import ShadowPrice
from optuav.engines.solution import Solution
from optuav.modelling import Model, Parameter
from optuav.modelling.expression import Operand
from optuav.modelling.traversal import has_unknowns, leaves
from optuav.solving import Program
from optuav.solving.plans import SAME_S

NEGLIGIBLE = 1e-7
"""Change of the objective by as much of a parameter as there is, below which it is rounding."""
RATIO_STEP = 0.01
"""One more unit of a ratio is one more percent."""


@dataclass(frozen=True)
class Price:
    """What a parameter of the winning programme is worth, the other parameters held.

    Parameters
    ----------
    name, symbol, unit
        As declared.
    key
        The mission's key of the same meaning and unit; ``""`` if it is derived.
    value
        Its value.
    less, more
        Change of the objective per unit, on either side; they differ at a kink. Infinite on a side
        that is infeasible.
    step
        How much "one more" is.
    gain, loss
        Change of the objective by one step more and by one step less; infinite where that leaves
        no plan.
    solved_again
        Whether gain and loss come from solving again; else from the rates, which hold nearby.
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
        """Whether the two sides differ."""
        return ShadowPrice(self.less, self.more).has_kink

    @property
    def matters(self) -> bool:
        """Whether a change to either side moves the objective, to a rounding."""
        steepest = max(abs(self.less), abs(self.more))
        return steepest * max(abs(self.value), self.step) > NEGLIGIBLE

    def to_dict(self) -> dict[str, Any]:
        """As plain data; null on a side that is infeasible."""
        numbers = {name: getattr(self, name) for name in ("less", "more", "gain", "loss")}
        return {
            "name": self.name,
            "symbol": self.symbol,
            "unit": self.unit,
            "key": self.key,
            "value": self.value,
            "step": self.step,
            "solved_again": self.solved_again,
            **{name: value if math.isfinite(value) else None for name, value in numbers.items()},
        }


def prices(
    program: Program, solutions: Sequence[Solution], chosen: tuple[int, int]
) -> tuple[Price, ...]:
    """Shadow prices of the winning programme, where itineraries tie those of the best of them.

    What the programme only compares with figures that it holds, as the altitude of the hover point
    with its limits, has none: stated otherwise in the mission it would move these figures too.

    Parameters
    ----------
    program
        What was declared.
    solutions
        Answers with continuous times, one for every part.
    chosen
        Part and entry of the best one.
    """
    number, entry = chosen
    model = program.parts[number].model
    towards = model.towards
    own = solutions[number].shadow_prices(entry)
    rivals = [solutions[k].shadow_prices(j) for k, j in _tied(solutions, chosen)]
    row = model.row(entry)
    effect = Effect(program, solutions, chosen)
    found = []
    held = _held(model)
    for name, price in own.items():
        if name in held:
            continue
        parameter = model.parameters[name]
        shared = np.ndim(parameter.value) == 0
        nothing = ShadowPrice(0.0, 0.0)
        sides = [price, *(each.get(name, nothing) if shared else nothing for each in rivals)]
        both = ShadowPrice(
            less=towards * min(towards * each.less for each in sides),
            more=towards * max(towards * each.more for each in sides),
        )
        key = _key(program, parameter)
        step = _step(parameter, key, float(row[name]))
        gain, loss = effect(parameter, step), effect(parameter, -step)
        if open_ := math.isnan(gain) or math.isnan(loss):
            gain, loss = both.more * step, -both.less * step
        found.append(
            Price(
                name=name,
                symbol=parameter.symbol,
                unit=parameter.unit,
                key=key.name if key else "",
                value=float(row[name]),
                less=both.less,
                more=both.more,
                step=step,
                gain=gain,
                loss=loss,
                solved_again=not open_,
            )
        )
    return tuple(sorted(found, key=lambda each: not each.key))


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


def _held(model: Model) -> set[str]:
    """Names of the parameters that stand in constraints without unknowns and nowhere else."""
    free: list[Operand] = []
    fixed: list[Operand] = []
    for constraint in model.constraints:
        sides = constraint.relation.sides
        (free if has_unknowns(*sides) else fixed).extend(sides)
    free += [model.objective, *model.preferences]
    free += [bound for each in model.variables for bound in (each.lower, each.upper)]
    return _names(fixed) - _names(free)


def _names(trees: Sequence[Operand]) -> set[str]:
    return {leaf.name for leaf in leaves(*trees) if isinstance(leaf, Parameter)}


def _tied(solutions: Sequence[Solution], chosen: tuple[int, int]) -> Iterator[tuple[int, int]]:
    """Parts and entries of the answers that are as good as the chosen one."""
    best = solutions[chosen[0]].objective[chosen[1]]
    for k, solution in enumerate(solutions):
        for j in np.flatnonzero(np.abs(solution.objective - best) <= SAME_S).tolist():
            if (k, j) != chosen:
                yield k, j


def _key(program: Program, parameter: Parameter) -> Key | None:
    """The key of a parameter, if both have the same unit."""
    for key in keys(program.network.mission):
        if key.name == parameter.key and key.unit.replace("-", "1") == parameter.unit:
            return key
    return None
