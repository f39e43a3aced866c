"""Models handed through Pyomo to the solvers that it finds."""

from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from optuav.arrays import Values
from optuav.engines.linear_form import own_bounds
from optuav.engines.pyomo_model import NAME, failures_named, library, to_pyomo
from optuav.engines.registry import Need, OneByOne, Single
from optuav.engines.solution import DUALITY, Solution, single, without_solver
from optuav.errors import Fault, InputError, SolverError, refuse, shown
from optuav.modelling.classify import traits
from optuav.modelling.expression import Operand
from optuav.modelling.model import Model
from optuav.modelling.traversal import change_by_step
from optuav.silence import silent
from optuav.status import Status

HIGHS = "appsi_highs"  # HiGHS in Pyomo's words
LINEAR = (HIGHS, "highs", "appsi_cbc", "cbc", "glpk")  # Solvers that take linear models only
FINE = {f"{kind}_feasibility_tolerance": 1e-9 for kind in ("primal", "dual", "mip")}
SETTINGS: Mapping[str, Values] = {
    **dict.fromkeys((HIGHS, "highs"), FINE | {"mip_rel_gap": 0.0}),
    "ipopt": {"tol": 1e-10, "constr_viol_tol": 1e-11, "bound_relax_factor": 0.0},
}
"""Options of solvers whose defaults are too coarse for seconds."""
LOSS_TO_LATER_GOALS = 1e-11
"""Loss of a goal that later ones may use up, as a share of its value, or of a second's worth."""
STATIONARY = 1e-6
"""Largest residual of an answer that meets the conditions of optimality, in a second's worth."""
FOUND = {"infeasible": Status.INFEASIBLE, "unbounded": Status.UNBOUNDED}
ANSWERED = ("optimal", "locallyOptimal", "globallyOptimal")  # Words of solvers that have a point


@dataclass(frozen=True)
class Pyomo(OneByOne):
    """The engine that hands models to a solver through Pyomo; needs the extra ``pyomo``.

    Parameters
    ----------
    solver
        Name of a solver that Pyomo finds, by default HiGHS, which accepts linear models.
    options
        Options of the solver, by its own names; HiGHS's options are checked.

    Raises
    ------
    InputError
        If the solver is not a name, or HiGHS takes no such option.

    Examples
    --------
    >>> import optuav
    >>> plan = optuav.solve("paper", "P3", perspective="battery", engine=optuav.Pyomo())
    >>> print(f"{plan.hover_time_s:.3f} s, {plan.status.value}")
    688.848 s, optimal
    """

    name = NAME
    integer = True
    solver: str = HIGHS
    options: Mapping[str, Operand] = field(default_factory=dict, hash=False)

    def __post_init__(self) -> None:
        if not isinstance(self.solver, str):
            raise InputError([Fault("solver", shown(self.solver), f"a name, such as {HIGHS!r}")])
        if not isinstance(self.options, Mapping):
            raise InputError([Fault("options", shown(self.options), "values by name")])
        refuse(self._refused() if self.options and self.solver in (HIGHS, "highs") else ())

    def _refused(self) -> Iterator[Fault]:
        """Options that HiGHS does not take; Pyomo leaves them out without a word."""
        import highspy

        with silent():
            file = highspy.Highs()  # type: ignore[no-untyped-call]
            file.setOptionValue("output_flag", False)
        for key, option in self.options.items():
            with suppress(TypeError):
                if file.setOptionValue(key, option) == highspy.HighsStatus.kOk:
                    continue
            yield Fault(f"options[{shown(key)}]", shown(option), "an option and a value of HiGHS")

    @property
    def nonlinear(self) -> bool:  # type: ignore[override]
        """Whether the solver accepts models that are not linear, as far as optuav knows."""
        return self.solver not in LINEAR

    @property
    def needs(self) -> tuple[Need, ...]:  # type: ignore[override]
        """Derivatives, if the models are not linear."""
        return ("derivatives",) if self.nonlinear else ()

    def prepare(
        self, model: Model, slot_s: float | None = None, time_limit_s: float | None = None
    ) -> Single:
        """Hand over a model, to be solved for one programme at a time."""
        made = to_pyomo(model, model.row(0), checked=False)
        options: Values = {"options": {**SETTINGS.get(self.solver, {}), **self.options}}
        if time_limit_s is not None:
            options = {**options, "timelimit": time_limit_s}
        if not self._solver().available(exception_flag=False):
            words = f"a solver that Pyomo finds; optuav[pyomo] installs only HiGHS, {HIGHS}"
            raise InputError([Fault("solver", shown(self.solver), words)])
        return lambda values: self._solved(model, made, {**model.row(0), **values}, options)

    def _solver(self) -> Any:
        """A solver that knows of no programme yet."""
        with failures_named(self.solver):
            return library().SolverFactory(self.solver)

    def _solved(self, model: Model, made: Any, parameters: Values, asked: Values) -> Solution:
        """The solution with values of parameters: the best for each goal among the best before."""
        if decided := without_solver(model, NAME, parameters):
            return decided
        solution, linear = partial(single, model, NAME, parameters), traits(model).linear
        goals, solver, words = [made.objective, *made.preferences.values()], self._solver(), []
        trees = [model.objective, *model.preferences]
        made.parameters.store_values({key: float(value) for key, value in parameters.items()})
        for goal in goals:
            goal.deactivate()
        start = {name: unknown.value for name, unknown in made.unknowns.items()}
        for component in ("kept", "sought"):
            made.del_component(component)
        made.kept = library().ConstraintList()
        for goal, tree in zip(goals, trees, strict=True):
            # Tolerances of solvers are absolute: a second is worth 1 to them.
            size = float(change_by_step(tree, model.variables, {**parameters, **start})) or 1.0
            made.del_component("sought")
            made.sought = library().Objective(expr=goal.expr / size, sense=goal.sense)
            with failures_named(self.solver):
                results = solver.solve(made, load_solutions=False, **asked)
                words.append(str(results.solver.termination_condition))
                if words[-1] in ANSWERED:
                    made.solutions.load_from(results)
            if words[-1] == "maxTimeLimit":
                raise SolverError(f"{NAME} with {self.solver} did not finish within the time limit")
            if words[-1] not in ANSWERED:
                break
            sign, reached = 1.0 if goal.is_minimizing() else -1.0, library().value(made.sought)
            loss = sign * (made.sought.expr - reached)
            made.kept.add(loss <= LOSS_TO_LATER_GOALS * max(1.0, abs(reached)))
        if (word := words[0]) not in ANSWERED:
            # A local solver proves no infeasibility.
            meanings = FOUND if linear or word != "infeasible" else {}
            return solution(meanings.get(word, Status.UNKNOWN), f"by {self.solver}", word)
        whole = [variable.binary for variable in model.variables]
        x = np.array([unknown.value for unknown in made.unknowns.values()], float)
        bounds = np.transpose([*own_bounds(model, parameters).values()])
        x = np.clip(np.where(whole, np.round(x), x), *bounds) + 0.0
        point = dict(zip(made.unknowns, x.tolist(), strict=True))
        status, proof = Status.LOCALLY_OPTIMAL, f"local: {self.solver} says {word}"
        if linear:
            branched = f"branch and bound ({self.solver})"
            status, proof = Status.OPTIMAL, branched if any(whole) else DUALITY
        answer = solution(status, proof, word, point)
        if any(whole):
            return answer
        answer = replace(answer, duals=None)
        violation, *others = answer.residuals()
        if max(violation, np.max(others) / (answer.second[0] or 1.0)) > STATIONARY:
            return replace(answer, statuses=[Status.FEASIBLE], proof=f"{self.solver} says {word}")
        return answer
