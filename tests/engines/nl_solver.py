"""A solver that Pyomo finds under the name "casadi-nl": IPOPT, on the .nl file that Pyomo writes.

CasADi reads the file back, so that nothing of what optuav made of the problem is used.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import casadi
import numpy as np
from pyomo.environ import SolverFactory, TerminationCondition
from pyomo.opt import SolverResults

NAME = "casadi-nl"
IPOPT = {
    "print_time": False,
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.tol": 1e-11,
    "ipopt.constr_viol_tol": 1e-11,
    "ipopt.bound_relax_factor": 0.0,
}
SAID = {
    "Solve_Succeeded": TerminationCondition.optimal,
    "Solved_To_Acceptable_Level": TerminationCondition.optimal,
    "Infeasible_Problem_Detected": TerminationCondition.infeasible,
    "Diverging_Iterates": TerminationCondition.unbounded,
    "Maximum_WallTime_Exceeded": TerminationCondition.maxTimeLimit,
}


def by_ipopt(text: str, options: Mapping[str, Any] | None = None) -> tuple[list[float], str]:
    """The point that IPOPT finds for an .nl file, by number of the unknown, and its word."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "programme.nl"
        path.write_text(text, "utf-8")
        read = casadi.NlpBuilder()
        read.import_nl(str(path), {})
    programme = {"x": casadi.vertcat(*read.x), "f": read.f, "g": casadi.vertcat(*read.g)}
    solver = casadi.nlpsol("solver", "ipopt", programme, {**IPOPT, **(options or {})})
    found = solver(x0=read.x_init, lbx=read.x_lb, ubx=read.x_ub, lbg=read.g_lb, ubg=read.g_ub)
    return np.asarray(found["x"]).ravel().tolist(), solver.stats()["return_status"]


@SolverFactory.register(NAME)
class CasadiNl:
    """What Pyomo asks of a solver."""

    def __init__(self, **_: Any) -> None:
        self.options: dict[str, Any] = {}

    def available(self, exception_flag: bool = True) -> bool:
        return True

    def solve(
        self,
        model: Any,
        load_solutions: bool = True,
        options: Mapping[str, Any] | None = None,
        timelimit: float | None = None,
    ) -> SolverResults:
        assert not load_solutions
        own = dict(options or {})
        if timelimit is not None:
            own["ipopt.max_wall_time"] = timelimit
        with TemporaryDirectory() as folder:
            path = Path(folder) / "programme.nl"
            _, number = model.write(str(path))
            values, word = by_ipopt(path.read_text("utf-8"), own)
        results = SolverResults()
        results.solver.termination_condition = SAID.get(word, TerminationCondition.other)
        solution = results.solution.add()
        for k, value in enumerate(values):
            solution.variable[f"v{k}"] = {"Value": value}
        results._smap_id = number
        return results
