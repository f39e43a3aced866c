"""The solvers behind CVXPY: which are there, what they are asked for, and what they say."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import Any

from optuav.errors import InputError, SolverError
from optuav.status import Status

DEFAULT_SOLVER = "HIGHS"
SETTINGS: Mapping[str, Mapping[str, Any]] = {
    "HIGHS": {
        "primal_feasibility_tolerance": 1e-9,
        "dual_feasibility_tolerance": 1e-9,
        "mip_feasibility_tolerance": 1e-9,
        "mip_rel_gap": 0.0,
    },
    "SCIPY": {"scipy_options": {"mip_rel_gap": 0.0}},
    "OSQP": {"eps_abs": 1e-10, "eps_rel": 1e-10, "max_iter": 100_000, "polishing": False},
    "SCS": {"eps_abs": 1e-10, "eps_rel": 1e-10},
}
"""What solvers are asked for where their own choice is too coarse for seconds."""
TIME_LIMITS = {
    "HIGHS": "time_limit",
    "CLARABEL": "time_limit",
    "OSQP": "time_limit",
    "SCS": "time_limit_secs",
}
"""How solvers call their time limit."""
STATUSES = {
    "optimal": Status.OPTIMAL,
    "optimal_inaccurate": Status.FEASIBLE,
    "infeasible": Status.INFEASIBLE,
    "unbounded": Status.UNBOUNDED,
}
"""What CVXPY's words mean; all others are refused."""
UNDECIDED = "infeasible_or_unbounded"
OUT_OF_TIME = ("user_limit", "user_limit_inaccurate")


class Solver:
    """An installed solver with its options.

    Parameters
    ----------
    name
        As CVXPY calls it, in letters of any case; None for HiGHS.
    whole
        Whether some unknowns take whole numbers only.
    time_limit_s
        Longest that one solve may take [s]; None for no limit.

    Raises
    ------
    InputError
        If it is not installed, does not take whole numbers where there are some, or has no limit.
    SolverError
        If CVXPY cannot be loaded.
    """

    def __init__(self, name: str | None, whole: bool, time_limit_s: float | None) -> None:
        try:
            import cvxpy
        except ImportError as error:
            raise SolverError(f"engine cvxpy needs the package cvxpy: {error}") from error

        installed = cvxpy.installed_solvers()  # type: ignore[no-untyped-call]
        asked = DEFAULT_SOLVER if name is None else name
        name = str(asked).upper()
        if name not in installed:
            raise InputError(f"CVXPY has no solver {asked!r}; installed: {', '.join(installed)}")
        if whole and name not in (able := _takers_of_whole_numbers()):
            raise InputError(
                f"the solver {name} takes no whole numbers; installed ones that do: "
                f"{', '.join(able)}"
            )
        self.name = name
        self.options: dict[str, Any] = dict(SETTINGS.get(name, {}))
        if whole and name == DEFAULT_SOLVER:
            # Its presolve may cut off the best whole numbers (ERGO-Code/HiGHS issue 3073).
            self.options["presolve"] = "off"
        if time_limit_s is not None:
            if name not in TIME_LIMITS:
                raise InputError(f"the solver {name} takes no time limit")
            self.options[TIME_LIMITS[name]] = time_limit_s

    def run(self, problem: Any) -> tuple[Status | None, str]:
        """Solve a CVXPY problem: what the solver says of it, in our word and in its own.

        None where it leaves open whether the problem is infeasible or unbounded.

        Raises
        ------
        SolverError
            If it fails, stops at a limit or is not sure.
        """
        import cvxpy

        try:
            with warnings.catch_warnings():
                # The status says the same, and inaccurate answers are proved or refused.
                warnings.filterwarnings("ignore", message="Solution may be inaccurate")
                problem.solve(solver=self.name, **self.options)
        except (cvxpy.error.SolverError, ValueError) as error:
            raise SolverError(f"cvxpy with {self.name} failed: {error}") from None
        words = str(problem.status)
        if words in OUT_OF_TIME:
            raise SolverError(f"cvxpy with {self.name} stopped at its limit of time or steps")
        if words not in STATUSES and words != UNDECIDED:
            raise SolverError(f"cvxpy with {self.name} is not sure: {words}")
        return STATUSES.get(words), words


def _takers_of_whole_numbers() -> list[str]:
    """Names of the installed solvers that take integers."""
    from cvxpy.reductions.solvers.defines import INSTALLED_MI_SOLVERS

    return list(INSTALLED_MI_SOLVERS)
