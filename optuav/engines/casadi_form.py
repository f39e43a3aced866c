"""A smooth model in CasADi's symbols: a programme for the objective and for each later goal."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from optuav.engines.ipopt import told
from optuav.errors import InputError
from optuav.modelling.expression import Operand
from optuav.modelling.model import Model
from optuav.modelling.traversal import fold, has_unknowns

NAME = "casadi"


class CasadiForm:
    """Programmes over scaled unknowns, with the parameters of a model as parameters.

    Attributes
    ----------
    names, given
        Names of the unknowns and of the parameters, in order.
    constraints
        Those with unknowns; a row without leaves IPOPT no interior to walk in.
    settled
        The others.
    programmes
        For the objective, divided by its steepness, and then for every preference, what
        `casadi.nlpsol` takes. Their parameters are those of the model, the scales of the unknowns,
        the steepness, and limits that keep the earlier goals as good as they were; the rows are the
        constraints and those limits.
    slope
        (scaled unknowns, parameters and scales) → gradient of what is minimised.

    Raises
    ------
    InputError
        If a function in the model is unknown to CasADi.
    SolverError
        If CasADi cannot be loaded.
    """

    def __init__(self, model: Model) -> None:
        with told():
            import casadi

        self.names = [variable.name for variable in model.variables]
        self.given = list(model.given)
        stated = [(has_unknowns(*each.relation.sides), each) for each in model.constraints]
        self.constraints = [each for moves, each in stated if moves]
        self.settled = [each for moves, each in stated if not moves]
        unknowns = casadi.SX.sym("x", len(self.names))
        scales = casadi.SX.sym("s", len(self.names))
        parameters = casadi.SX.sym("p", len(self.given))
        steepness = casadi.SX.sym("w")
        floors = casadi.SX.sym("floor", len(model.preferences))
        leaves = {name: unknowns[k] * scales[k] for k, name in enumerate(self.names)}
        leaves |= {name: parameters[k] for k, name in enumerate(self.given)}
        table = operations()

        def applied(ufunc: np.ufunc, arguments: tuple[Any, ...]) -> Any:
            if ufunc not in table:
                raise InputError(f"engine {NAME} does not know the function {ufunc.__name__}")
            return table[ufunc](*arguments)

        def symbols(tree: Operand) -> Any:
            return casadi.SX(fold(tree, lambda leaf: leaves[leaf.name], applied))

        cost = -model.towards * symbols(model.objective)
        everything = casadi.vertcat(parameters, scales)
        self.slope = casadi.Function(
            "slope", [unknowns, everything], [casadi.gradient(cost, unknowns)]
        )
        sides = [map(symbols, each.relation.sides) for each in self.constraints]
        excess = [left - right for left, right in sides]
        goals = [cost / steepness, *map(symbols, model.preferences)]
        self.programmes = [
            {
                "x": unknowns,
                "p": casadi.vertcat(everything, steepness, *(floors[j] for j in range(k))),
                "f": goal,
                "g": casadi.vertcat(*excess, *(goals[j] - floors[j] for j in range(k))),
            }
            for k, goal in enumerate(goals)
        ]


def operations() -> Mapping[np.ufunc, Callable[..., Any]]:
    """What a ufunc becomes on CasADi's symbols."""
    import casadi

    return {
        np.add: operator.add,
        np.subtract: operator.sub,
        np.multiply: operator.mul,
        np.divide: operator.truediv,
        np.power: operator.pow,
        np.negative: operator.neg,
        np.positive: operator.pos,
        np.absolute: casadi.fabs,
        np.fabs: casadi.fabs,
        np.floor: casadi.floor,
        np.ceil: casadi.ceil,
        np.trunc: lambda a: casadi.sign(a) * casadi.floor(casadi.fabs(a)),
        np.sign: casadi.sign,
        np.heaviside: lambda a, b: (a > 0.0) + (a == 0.0) * b,
        np.square: lambda a: a * a,
        np.reciprocal: lambda a: 1.0 / a,
        np.sqrt: casadi.sqrt,
        np.cbrt: lambda a: casadi.sign(a) * casadi.fabs(a) ** (1.0 / 3.0),
        np.exp: casadi.exp,
        np.exp2: lambda a: 2.0**a,
        np.expm1: casadi.expm1,
        np.log: casadi.log,
        np.log1p: casadi.log1p,
        np.log2: lambda a: casadi.log(a) / math.log(2.0),
        np.log10: casadi.log10,
        np.sin: casadi.sin,
        np.cos: casadi.cos,
        np.tan: casadi.tan,
        np.sinh: casadi.sinh,
        np.cosh: casadi.cosh,
        np.tanh: casadi.tanh,
        np.arcsin: casadi.asin,
        np.arccos: casadi.acos,
        np.arctan: casadi.atan,
        np.arcsinh: casadi.asinh,
        np.arccosh: casadi.acosh,
        np.arctanh: casadi.atanh,
        np.deg2rad: lambda a: a * (math.pi / 180.0),
        np.radians: lambda a: a * (math.pi / 180.0),
        np.rad2deg: lambda a: a * (180.0 / math.pi),
        np.degrees: lambda a: a * (180.0 / math.pi),
        np.logaddexp: lambda a, b: casadi.logsumexp(casadi.vertcat(a, b)),
        np.hypot: casadi.hypot,
        np.arctan2: casadi.atan2,
        np.maximum: casadi.fmax,
        np.fmax: casadi.fmax,
        np.minimum: casadi.fmin,
        np.fmin: casadi.fmin,
    }
