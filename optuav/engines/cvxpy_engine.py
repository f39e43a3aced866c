"""Linear programmes by CVXPY: continuous, with binary unknowns, or with times in whole slots.

The rows A x ≤ b of a model become one parametrised CVXPY problem (DPP), which is compiled once and
solved often. HiGHS by default, any other installed solver by name.

References
----------
.. [1] S. Diamond, S. Boyd, "CVXPY: a Python-embedded modeling language for convex optimization",
   Journal of Machine Learning Research, 2016.
.. [2] Q. Huangfu, J. Hall, "Parallelizing the dual revised simplex method", Mathematical
   Programming Computation, 2018 (HiGHS).
"""

import warnings
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from optuav.arrays import Booleans, Floats, Values
from optuav.engines.linear_form import LinearForm, linear_form, own_bounds, slot_ranges
from optuav.engines.registry import OneByOne, Single
from optuav.engines.solution import DUALITY, Solution, single
from optuav.errors import Fault, InputError, SolverError, shown
from optuav.modelling.check import CONSTRAINT_TOLERANCE
from optuav.modelling.expression import Expression, Operand, Variable
from optuav.modelling.model import Model
from optuav.presentation.numbers import figure
from optuav.status import Status

NAME = "cvxpy"
LOSS_TO_LATER_GOALS = 1e-11  # Relative loss of the objective that the preferences may use up
TIGHT = 1e-7  # Relative slack below which a row counts as holding with equality
UNPROVED_GAP = 1e-7
"""Relative gap between an answer and the bound on all others above which it counts as unproved."""
SETTINGS: Mapping[str, Values] = {
    # A rule of its presolve, the aggregator (1 << 12), can take 100 times as long as the programme.
    "HIGHS": {"mip_rel_gap": 0.0, "presolve_rule_off": 1 << 12}
    | {f"{kind}_feasibility_tolerance": 1e-9 for kind in ("primal", "dual", "mip")},
    "SCIPY": {"scipy_options": {"mip_rel_gap": 0.0}},
    "OSQP": {"eps_abs": 1e-10, "eps_rel": 1e-10, "max_iter": 100_000, "polishing": False},
    "SCS": {"eps_abs": 1e-10, "eps_rel": 1e-10},
}
"""Settings of solvers whose defaults are too coarse for seconds."""
TIME_LIMITS = dict.fromkeys(("HIGHS", "CLARABEL", "OSQP"), "time_limit")
TIME_LIMITS["SCS"] = "time_limit_secs"  # How solvers call their time limit
STATUSES = {
    "optimal": Status.OPTIMAL,
    "optimal_inaccurate": Status.FEASIBLE,
    "infeasible": Status.INFEASIBLE,
    "unbounded": Status.UNBOUNDED,
}
"""Status by CVXPY's words; all others but infeasible_or_unbounded are refused."""


def installed(
    name: str | None, whole: bool, time_limit_s: float | None
) -> tuple[str, dict[str, Operand]]:
    """A solver, perhaps for `whole` numbers, as CVXPY calls it, and its options; None is HiGHS."""
    try:
        import cvxpy
    except ImportError as error:
        raise SolverError(f"engine cvxpy needs the package cvxpy: {error}") from error
    # CVXPY's own function would look for every solver again, longer than a small solve takes.
    defines = cvxpy.reductions.solvers.defines
    there, able = defines.INSTALLED_SOLVERS, defines.INSTALLED_MI_SOLVERS
    wanted, name = name, "HIGHS" if name is None else name.upper() if isinstance(name, str) else ""
    if name not in there:
        words = f"one of CVXPY's solvers that are installed: {', '.join(there)}"
        raise InputError([Fault("solver", shown(wanted), words)])
    if whole and name not in able:
        raise InputError(
            f"the solver {name} does not support whole numbers; these do: {', '.join(able)}"
        )
    options: dict[str, Operand] = dict(SETTINGS.get(name, {}))
    if whole and name == "HIGHS":
        # Its presolve may cut off the best whole numbers (ERGO-Code/HiGHS issue 3073), and the
        # heuristic takes two thirds of the time of a small programme.
        options |= {"presolve": "off", "mip_heuristic_run_feasibility_jump": False}
    if time_limit_s is not None:
        if name not in TIME_LIMITS:
            raise InputError(f"the solver {name} accepts no time limit")
        options[TIME_LIMITS[name]] = time_limit_s
    return name, options


class CvxpyProgramme:
    """A linear model handed to CVXPY once, to be solved with changing parameters; see `Cvxpy`."""

    def __init__(
        self,
        model: Model,
        slot_s: float | None = None,
        time_limit_s: float | None = None,
        solver: str | None = None,
    ) -> None:
        self.model, self.slot_s, self.base = model, slot_s, model.row(0)
        self.binary = [variable.binary for variable in model.variables]
        self.counted = [slot_s is not None and not binary for binary in self.binary]
        self.integer = any(self.binary) or any(self.counted)
        self.solver, self.options = installed(solver, self.integer, time_limit_s)
        form = linear_form(model, self.base)
        idle = {row for row, k in form.bounds if _needs_no_rows(model.variables[k])}
        self.stated = [row for row in range(len(form.labels)) if row not in idle]
        self.goals = len(form.directions)
        self._state(form.normals[self.stated, :, 0] != 0.0)

    def _state(self, entries: Booleans) -> None:
        """State the problem for rows whose coefficients (row, unknown) are 0 but for some."""
        import cvxpy

        (rows, unknowns), self.entries = entries.shape, entries
        self.x = cvxpy.Variable(
            unknowns,
            boolean=(np.flatnonzero(self.binary),) if any(self.binary) else False,
            integer=(np.flatnonzero(self.counted),) if any(self.counted) else False,
        )
        # The time to compile grows with the number of entries.
        places = np.nonzero(entries) if entries.any() else None
        self.a = cvxpy.Parameter((rows, unknowns), sparsity=places)
        self.b = cvxpy.Parameter(rows)
        self.c = cvxpy.Parameter(unknowns)
        self.rows = self.a @ self.x <= self.b
        # Among equally good points: no earlier goal may get worse than it was.
        self.kept = cvxpy.Parameter((self.goals, unknowns))
        self.floors = cvxpy.Parameter(self.goals)
        kept = self.kept @ self.x >= self.floors
        self.problem: Any = cvxpy.Problem(cvxpy.Maximize(self.c @ self.x), [self.rows, kept])

    @np.errstate(divide="ignore", invalid="ignore", over="ignore")
    def solve(self, values: Mapping[str, float]) -> Solution:
        """Solve with values of parameters that differ from the model's, by name."""
        values = {**self.base, **values}
        form = linear_form(self.model, values)
        solution = partial(single, self.model, NAME, values)
        if not form.usable.all():
            return solution(Status.ERROR, DUALITY, "a parameter is not a number")
        a, b, c = form.normals[..., 0], form.limits[..., 0], form.directions[..., 0]
        if self.slot_s is not None:
            a, b = self._in_slots(form, values, self.slot_s)
            c = c * np.where(self.counted, self.slot_s, 1.0)
        labels = [form.labels[row] for row in self.stated]
        a, b = a[self.stated], b[self.stated]
        for label, limit in zip(labels, b, strict=True):
            if limit == -np.inf:
                return solution(Status.INFEASIBLE, DUALITY, f"{label} can never hold")
        finite = np.isfinite(b)
        # Solvers' tolerances are absolute: rows and goals of size 1 put them in seconds.
        size, worth = _sizes(a), _sizes(c)
        a = np.where(finite[:, None], a / size[:, None], 0.0)
        b = np.where(finite, b / size, 1.0)
        c = c / worth[:, None]
        if (entries := a != 0.0)[~self.entries].any():
            # Terms that cancel with the model's own values need not with others.
            self._state(self.entries | entries)
        # Values are set without CVXPY's checks, which take longer than a small solve.
        self.a.save_value(a)
        self.b.save_value(b)
        self.c.save_value(c[0])
        self.kept.save_value(np.zeros(self.kept.shape))
        self.floors.save_value(np.zeros(self.floors.shape))
        status, words = self._run()
        if status is None:
            self.c.save_value(np.zeros(self.c.shape))
            feasible = (self._run()[0] or Status.INFEASIBLE).has_answer
            status = Status.UNBOUNDED if feasible else Status.INFEASIBLE
        if not status.has_answer:
            return solution(status, DUALITY, words)
        x, weights = np.asarray(self.x.value, dtype=float), None
        if not self.integer:
            weights = np.maximum(np.asarray(self.rows.dual_value, dtype=float), 0.0)
            self._prove(a, b, c[0], x, weights, words)
            status = Status.OPTIMAL
        if len(c) > 1 and not (weights is not None and _determined(a, weights)):
            x = self._preferred(c, x)
        x = np.where(self.binary, np.round(x), x)
        if self.slot_s is not None:
            x = np.where(self.counted, np.round(x) * self.slot_s, x)
        x = np.clip(x, *np.transpose([*own_bounds(self.model, values).values()])) + 0.0
        net, bounds = defaultdict[tuple[str, int | None], float](float), dict(form.bounds)
        if weights is not None:
            signs = np.array(form.signs)[self.stated]
            turned = (signs * weights * worth[0] / size).tolist()
            for row, label, weight in zip(self.stated, labels, turned, strict=True):
                net[label, bounds.get(row)] += weight
        duals = dict.fromkeys((label for label, _ in net), 0.0)
        for (label, k), weight in net.items():
            # The two bounds of an unknown push against each other.
            duals[label] += weight if k is None else abs(weight)
        proof = f"branch and bound ({self.solver})" if self.integer else DUALITY
        point = dict(zip(form.names, x.tolist(), strict=True))
        return solution(status, proof, f"{self.solver}: {words}", point, duals=duals)

    def _run(self) -> tuple[Status | None, str]:
        """Solve the problem; its status, and the status that the solver itself returned.

        None where it leaves open whether the problem is infeasible or unbounded.
        """
        import cvxpy

        try:
            with warnings.catch_warnings():
                # The status says the same, and inaccurate answers are proved or refused.
                warnings.filterwarnings("ignore", message="Solution may be inaccurate")
                # CVXPY warns of its own use of a sparse parameter.
                warnings.filterwarnings("ignore", message="Reading from a sparse CVXPY expression")
                self.problem.solve(solver=self.solver, **self.options)
        except (cvxpy.error.SolverError, ValueError) as error:
            raise SolverError(f"cvxpy with {self.solver} failed: {error}") from None
        words = str(self.problem.status)
        if words in ("user_limit", "user_limit_inaccurate"):
            raise SolverError(f"cvxpy with {self.solver} stopped at its limit of time or steps")
        if words not in STATUSES and words != "infeasible_or_unbounded":
            raise SolverError(f"cvxpy with {self.solver} is not sure: {words}")
        return STATUSES.get(words), words

    def _prove(
        self, a: Floats, b: Floats, c: Floats, x: Floats, weights: Floats, words: str
    ) -> None:
        """Check that no feasible x' is better than x: c·x' − c·x ≤ (c − Aᵀλ)·x' + λ·b − c·x."""
        excess = float(((a @ x - b) / np.maximum(1.0, np.abs(b))).max(initial=0.0))
        best = float(c @ x)
        more = float(weights @ b - best + np.abs(c - weights @ a) @ (1.0 + np.abs(x)))
        if excess > UNPROVED_GAP or more > UNPROVED_GAP * max(1.0, abs(best)):
            raise SolverError(
                f"{NAME} with {self.solver} says {words}, but its answer violates a row by a share "
                f"of {figure(excess, 2)} and may be {figure(max(0.0, more), 2)} short of the best"
            )

    def _preferred(self, goals: Floats, x: Floats) -> Floats:
        """Among the points that are as good as the best, the one that later goals prefer."""
        kept, floors = np.zeros(self.kept.shape), np.zeros(self.floors.shape)
        for number, goal in enumerate(goals[1:]):
            reached = float(goals[number] @ x)
            kept[number], floors[number] = (
                goals[number],
                reached - LOSS_TO_LATER_GOALS * max(1.0, abs(reached)),
            )
            self.kept.save_value(kept.copy())
            self.floors.save_value(floors.copy())
            self.c.save_value(goal)
            status, _ = self._run()
            if status is None or not status.has_answer:
                break
            x = np.asarray(self.x.value, dtype=float)
        return x

    def _in_slots(self, form: LinearForm, values: Values, slot_s: float) -> tuple[Floats, Floats]:
        """Rows in numbers of slots; bounds of unknowns become their first and last slot."""
        ranges = slot_ranges(self.model, values, slot_s)
        a = form.normals[..., 0] * np.where(self.counted, slot_s, 1.0)
        limits = form.limits[..., 0]
        b = limits + CONSTRAINT_TOLERANCE * np.maximum(1.0, np.abs(limits))
        for row, k in form.bounds:
            if self.counted[k]:
                first, last = ranges[form.names[k]]
                a[row, k], b[row] = (1.0, last) if a[row, k] > 0.0 else (-1.0, -first)
        return a, b


def _needs_no_rows(unknown: Variable) -> bool:
    """Return whether an unknown keeps its bounds because it is binary."""
    low, high = unknown.lower, unknown.upper
    if isinstance(low, Expression) or isinstance(high, Expression):
        return False
    return bool(unknown.binary and low <= 0.0 and high >= 1.0)


def _determined(a: Floats, weights: Floats) -> bool:
    """Return whether the rows with a multiplier determine the point: then no other is as good."""
    heavy = a[weights > TIGHT * max(1.0, weights.max(initial=0.0))]
    return bool(np.linalg.matrix_rank(heavy, tol=TIGHT) == a.shape[1])


def _sizes(rows: Floats) -> Floats:
    """Largest coefficient of every row; 1 for an empty row."""
    largest = np.abs(rows).max(axis=1, initial=0.0)
    return np.where(largest > 0.0, largest, 1.0)


@dataclass(frozen=True)
class Cvxpy(OneByOne):
    """The engine that hands linear programmes to CVXPY.

    Parameters
    ----------
    solver
        Name of an installed CVXPY solver, in letters of any case; None for HiGHS.

    Examples
    --------
    >>> from optuav.engines.cvxpy_engine import Cvxpy
    >>> Cvxpy(solver="clarabel").integer
    True
    """

    name = NAME
    integer = True
    slots = True
    solver: str | None = None

    def prepare(
        self, model: Model, slot_s: float | None = None, time_limit_s: float | None = None
    ) -> Single:
        """Hand over a model, to be solved for one programme at a time."""
        return CvxpyProgramme(model, slot_s, time_limit_s, self.solver).solve
