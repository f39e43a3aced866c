"""IPOPT behind CasADi: what it is asked for, and what it says."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from optuav.arrays import Floats
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


@contextmanager
def told() -> Iterator[None]:
    """Turn whatever the library raises into the one error that engines raise."""
    try:
        yield
    except ImportError as error:
        raise SolverError(f"engine casadi needs the package casadi: {error}") from error
    except RuntimeError as error:
        raise SolverError(f"casadi failed: {error}") from error


def prepared(
    programme: Mapping[str, Any], time_limit_s: float | None, accuracy: float, iterations: int
) -> Any:
    """A programme of CasADi's symbols, made ready for `run`."""
    options: dict[str, Any] = {**OPTIONS, "ipopt.tol": accuracy, "ipopt.max_iter": iterations}
    if time_limit_s is not None:
        options["ipopt.max_wall_time"] = time_limit_s
    with told():
        import casadi

        return casadi.nlpsol("programme", "ipopt", programme, options)


def run(programme: Any, arguments: Mapping[str, Floats]) -> tuple[Any, str]:
    """The answer of IPOPT, and its word for it."""
    with told():
        return programme(**arguments), programme.stats()["return_status"]
