"""IPOPT behind CasADi: what it is asked for and what it says; NumPy's functions on its symbols."""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import numpy as np

from optuav.engines.arrays import Floats
from optuav.errors import SolverError

OPTIONS = {
    "print_time": False,
    "calc_lam_p": False,
    "show_eval_warnings": False,
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.constr_viol_tol": 1e-11,
    "ipopt.bound_relax_factor": 0.0,
    "ipopt.diverging_iterates_tol": 1e8,
}
SOLVED = ("Solve_Succeeded", "Solved_To_Acceptable_Level")
TOO_SLOW = ("Maximum_WallTime_Exceeded", "Maximum_CpuTime_Exceeded")
UNBOUNDED = "Diverging_Iterates"
UNUSABLE = "Invalid_Number_Detected"
NO_WAY_IN = "Infeasible_Problem_Detected"


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
        np.sign: casadi.sign,
        np.heaviside: lambda a, b: (a > 0.0) + (a == 0.0) * b,
        np.square: lambda a: a * a,
        np.reciprocal: lambda a: 1.0 / a,
        np.sqrt: casadi.sqrt,
        np.exp: casadi.exp,
        np.expm1: casadi.expm1,
        np.log: casadi.log,
        np.log1p: casadi.log1p,
        np.log10: casadi.log10,
        np.sin: casadi.sin,
        np.cos: casadi.cos,
        np.tan: casadi.tan,
        np.tanh: casadi.tanh,
        np.arcsin: casadi.asin,
        np.arccos: casadi.acos,
        np.arctan: casadi.atan,
        np.hypot: casadi.hypot,
        np.arctan2: casadi.atan2,
        np.maximum: casadi.fmax,
        np.minimum: casadi.fmin,
    }


@contextmanager
def told() -> Iterator[None]:
    """Turn whatever the library raises into the one error that engines raise."""
    try:
        yield
    except ImportError as error:
        raise SolverError(f"engine casadi needs the package casadi: {error}") from error
    except RuntimeError as error:
        raise SolverError(f"casadi failed: {error}") from error


def run(programme: Any, arguments: Mapping[str, Floats]) -> tuple[Any, str]:
    """The answer of IPOPT, and its word for it."""
    with told():
        return programme(**arguments), programme.stats()["return_status"]
