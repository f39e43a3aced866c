"""A program: the declared models of a question, ready to be printed and solved."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from formulations.p1 import P1
from formulations.p3 import P3
from formulations.p4 import P4
from formulations.soc import AVAILABLE
from optuav.engines.prices import ShadowPrice
from optuav.engines.registry import Engine, engine, names, takers
from optuav.engines.solution import Solution
from optuav.errors import SolverError
from optuav.modelling import Checks, Model
from optuav.modelling.classify import Traits, traits
from optuav.network.network import Network
from optuav.plan import Plan
from optuav.solving.assemble import quantities
from optuav.solving.dispatch import answer
from optuav.solving.plans import (
    SAME_S,
    TIMES,
    Part,
    against_p1,
    best,
    plan_of,
    plan_without,
    planned_phases,
    replayed,
    shortfalls,
)
from optuav.solving.question import Question
from optuav.status import Status

if TYPE_CHECKING:
    from optuav.solving.compiled import CompiledProgram
from collections.abc import Iterator

from optuav.engines.ranges import cut_short
from optuav.errors import Fault, InputError
from optuav.mission.messages import written_out
from optuav.modelling import check


@dataclass(frozen=True)
class Program:
    """What `optuav.formulate` returns: print it, or solve it.

    Parameters
    ----------
    question
        What was question.
    network
        The mission's places, legs and itineraries.
    parts
        The declared models; none where nothing can be flown.
    reasons
        Why nothing can be flown; empty if something can.

    Examples
    --------
    >>> import optuav
    >>> program = optuav.formulate("paper", optuav.P4("b1", order="rest-first"))
    >>> program.engines
    ('bracket', 'casadi', 'grid')
    >>> price = program.shadow_prices()["deadline_s"]
    >>> f"{price.more:.3f} s of hover per second"
    '0.000 s of hover per second'
    """

    question: Question
    network: Network
    parts: tuple[Part, ...]
    reasons: tuple[str, ...]

    def __str__(self) -> str:
        if not self.parts:
            return "nothing can be flown: " + "; ".join(self.reasons)
        return self._pages(str)

    def __repr__(self) -> str:
        name, count = self.network.mission.name, len(self.parts)
        question = f"{self.question.problem.name}, perspective {self.question.perspective}"
        return f"<Program for {name!r}: {question}, {count} model{'s' if count != 1 else ''}>"

    @property
    def traits(self) -> tuple[Traits, ...]:
        """What each declared model is, found from its trees: linear, smooth, integer."""
        return tuple(traits(part.model) for part in self.parts)

    @property
    def engines(self) -> tuple[str, ...]:
        """Names of the engines that take every declared model, in slots if they were asked for."""
        slots = self.question.slot_s is not None
        able = [takers(each, slots) for each in self.traits]
        return tuple(name for name in names() if able and all(name in each for each in able))

    def to_latex(self) -> str:
        """The declared models as LaTeX ``align*`` environments (package amsmath)."""
        return self._pages(Model.to_latex, "% ")

    def _pages(self, write: Callable[[Model], str], mark: str = "") -> str:
        """The models in writing, each under a line on its slots; of several, also on its routes."""
        pages = [write(part.model) for part in self.parts]
        if (slot_s := self.question.slot_s) is not None:
            slots = [mark + slots_of(part.model, slot_s) for part in self.parts]
            pages = [f"{line}\n{page}" for line, page in zip(slots, pages, strict=True)]
        if len(pages) > 1:
            heads = (f"{mark}{k} of {len(pages)}: " for k in range(1, len(pages) + 1))
            routes = (routes_of(self.network, part) for part in self.parts)
            pages = [f"{h}{t}\n{page}" for h, t, page in zip(heads, routes, pages, strict=True)]
        return "\n\n".join(pages)

    def check(self, point: Mapping[str, Any]) -> Checks:
        """Every constraint at a point, from wherever it comes, evaluated in NumPy.

        Parameters
        ----------
        point
            Values of the unknowns by name, and of parameters that differ from the mission's;
            numbers, or arrays or lists that broadcast (with one entry an itinerary where it has
            several).

        Returns
        -------
        One `Check` a constraint, in order; printed as a table with both sides, by how much each
        holds or not, and the line that declared it; of several routes, those that violate it.

        Raises
        ------
        InputError
            If no model of the program has just these unknowns, or a name is neither one of
            them nor a parameter; also if it is a plan, which flies one of the routes.
        """
        return checks(self.network, self.parts, point)

    def solve(self) -> Plan:
        """The best plan over all itineraries, evaluated again outside the engine.

        Raises
        ------
        SolverError
            If the engine fails, runs out of time or returns a point that is not feasible.
        """
        if not self.parts:
            return plan_without(
                self.question, self.network, Status.INFEASIBLE, "physics", self.reasons
            )
        if self.question.perspective == AVAILABLE and self._takes_turns:
            from optuav.solving.packs_by_schedule import packs_by_schedule

            return replayed(packs_by_schedule(self.question, self.network, self.parts))
        return self.plan(self.answers())

    def plan(self, solutions: Sequence[Solution]) -> Plan:
        """The best plan by known answers to all parts, evaluated again outside the engine.

        Raises
        ------
        SolverError
            If the engine found neither a plan nor proof that there is none, or returned a point
            that is not feasible.
        """
        question = replace(self.question, engine=solutions[0].engine)
        statuses = {status for solution in solutions for status in solution.statuses}
        if Status.ERROR in statuses:
            _refuse_errors(solutions)
        if Status.UNBOUNDED in statuses:
            why = (
                "no constraint keeps the objective finite: "
                "given.keep_deadline(model, label, hover, rest) states the deadline",
            )
            return plan_without(question, self.network, Status.UNBOUNDED, solutions[0].proof, why)
        chosen = self.best(solutions)
        if chosen is None and Status.ERROR in statuses:
            raise SolverError(
                f"{question.engine} found neither a plan nor proof that there is none"
            )
        if chosen is None:
            return plan_without(
                question,
                self.network,
                Status.INFEASIBLE,
                solutions[0].proof,
                shortfalls(self.question, self.network, self.parts),
            )
        number, entry = chosen
        part, solution = self.parts[number], solutions[number]
        solution.verify(entry)
        plan = plan_of(self.question, self.network, part, solution, entry)
        plan = against_p1(self.question, self.network, self.parts, plan)
        open_s = _open_s(solutions, float(solution.objective[entry]))
        if open_s > SAME_S:
            more = f"not proved: up to {open_s:.6g} s more has not been ruled out"
            update = {"notes": (*plan.notes, more), "status": Status.FEASIBLE}
            plan = plan.model_copy(update=update)
        return replayed(with_promise(self, plan))

    def solution(self) -> Solution:
        """The engine's whole answer for the best itinerary: status, proof, values, multipliers.

        Its fields have one entry; `solve` makes a plan of it.

        Raises
        ------
        InputError
            If nothing can be flown.
        SolverError
            As `solve`.
        """
        return self.compile().solve()

    @property
    def _takes_turns(self) -> bool:
        """Whether packs take turns, which a declared model knows nothing of."""
        return self.network.mission.battery.takes_turns

    def shadow_prices(self) -> dict[str, ShadowPrice]:
        """What one more unit of every named parameter brings; empty where there is no answer.

        Where several itineraries tie, a change for the better may take any of them, and a change
        for the worse has to spoil them all; a figure of a single route spoils that one alone.

        Raises
        ------
        SolverError
            As `solve`.
        """
        solutions = self.answers()
        chosen = self.best(solutions) if solutions else None
        return {} if chosen is None else self.prices(solutions, chosen)

    def prices(
        self, solutions: Sequence[Solution], chosen: tuple[int, int]
    ) -> dict[str, ShadowPrice]:
        """As `shadow_prices`, from the answers to all parts and the part and entry of the best."""
        number, entry = chosen
        best_s = solutions[number].objective[entry]
        rivals = [
            solution.shadow_prices(index)
            for k, solution in enumerate(solutions)
            for index in np.flatnonzero(np.abs(solution.objective - best_s) <= SAME_S).tolist()
            if (k, index) != chosen
        ]
        model, nothing = self.parts[number].model, ShadowPrice(0.0, 0.0)
        better, worse = (max, min) if model.sense == "maximise" else (min, max)
        found = {}
        for name, own in solutions[number].shadow_prices(entry).items():
            # A figure of this route alone leaves the routes that it ties with where they are.
            shared = np.ndim(model.parameters[name].value) == 0
            every = [own, *(each.get(name, nothing) if shared else nothing for each in rivals)]
            found[name] = ShadowPrice(
                less=worse(each.less for each in every), more=better(each.more for each in every)
            )
        return found

    def answers(self) -> list[Solution]:
        """The engine's answers to all programmes, one `Solution` a part.

        Raises
        ------
        SolverError
            If the engine fails or runs out of time.
        """
        return [answer(part.model, len(part.routes), self.question) for part in self.parts]

    def compile(self, engine: str | Engine | None = None) -> CompiledProgram:
        """Hand the models to an engine once, to be solved often with changed parameters.

        Parameters
        ----------
        engine
            An engine or its name; by default the one of the question.

        Raises
        ------
        InputError
            If nothing can be flown, or the engine does not take the models.
        """
        from optuav.solving.compiled import CompiledProgram

        return CompiledProgram(self, replace(self.question, engine=engine or self.question.engine))

    def best(self, solutions: Sequence[Solution]) -> tuple[int, int] | None:
        """Part and entry of the best answer by the tie rule; None without an answer."""
        routes = self.network.routes
        number = np.concatenate([np.full(len(p.routes), k) for k, p in enumerate(self.parts)])
        entry = np.concatenate([np.arange(len(part.routes)) for part in self.parts])
        route = np.concatenate([part.routes for part in self.parts])
        score, stay_s = [], []
        for part, solution in zip(self.parts, solutions, strict=True):
            score.append(solution.objective * part.model.towards)
            stays = [solution.values[name] for name in TIMES if name in solution.values]
            stay_s.append(sum(stays, np.zeros(len(part.routes))))
        order = np.argsort(route, kind="stable")
        mission_s = routes.flight_time_s[route] + np.concatenate(stay_s)
        winner = best(
            np.concatenate(score)[order],
            mission_s[order],
            (routes.building[route] >= 0).astype(float)[order],
        )
        if winner is None:
            return None
        return int(number[order][winner]), int(entry[order][winner])


def with_promise(program: Program, plan: Plan) -> Plan:
    """The plan of a battery that never runs dry, with a note on what charge alone promises.

    The same routes are solved in closed form in the perspective `battery`.
    """
    question, network = program.question, program.network
    promising = isinstance(question.problem, P1 | P3 | P4)
    if question.perspective != AVAILABLE or plan.engine != "bracket" or not promising:
        return plan
    charge = replace(question, perspective="battery", engine="closed-form")
    parts = []
    for part in program.parts:
        given = quantities(network, part.routes, rests=part.rests)
        parts.append(Part(question.problem.model(given, "battery"), part.routes))
    promised = replace(program, question=charge, parts=tuple(parts))
    closed_form = engine("closed-form")
    solutions = [closed_form.solve(part.model, len(part.routes)) for part in parts]
    chosen = promised.best(solutions)
    if chosen is None:
        return plan
    number, entry = chosen
    times = {name: solutions[number].point(entry).get(name, 0.0) for name in TIMES}
    if times["hover_time_s"] <= plan.hover_time_s:
        return plan
    words = (
        "perspective battery, which looks at the charge left at the end alone, "
        f"promises {times['hover_time_s']:.2f} s of hover"
    )
    flown = planned_phases(network, int(parts[number].routes[entry]), **times)
    dry_s = plan.model_copy(update={"phases": flown}).runs_dry_s
    if dry_s is not None:
        words += f"; that plan would run dry and fall at {dry_s:.2f} s"
    return plan.model_copy(update={"notes": (*plan.notes, words)})


def _refuse_errors(solutions: Sequence[Solution]) -> None:
    """Refuse answers with errors, unless a bound of their objective is known."""
    for solution in solutions:
        for index, status in enumerate(solution.statuses):
            bounded = solution.beyond is not None and not np.isnan(solution.beyond[index])
            if status is Status.ERROR and not bounded:
                raise SolverError(solution.refusal(index))


def _open_s(solutions: Sequence[Solution], best_s: float) -> float:
    """By how much longer a hover may be that engines have not ruled out [s]."""
    beyond = [each.beyond for each in solutions if each.beyond is not None]
    return max((float(np.nanmax(each, initial=best_s)) - best_s for each in beyond), default=0.0)


def checks(network: Network, parts: Sequence[Part], point: Mapping[str, Any]) -> Checks:
    """Every constraint of the models that have just the unknowns of a point; see `Program.check`.

    Parameters
    ----------
    network
        The mission's places, legs and itineraries.
    parts
        The declared models.
    point
        Values by name, of the unknowns and of parameters.

    Raises
    ------
    InputError
        As of `Program.check`.
    """
    if not isinstance(point, Mapping):
        words = "as {'hover_time_s': 10.0}; a plan's times are its hover_time_s and rest_time_s"
        raise InputError([Fault("point", repr(point), f"values of the unknowns by name, {words}")])
    unknowns = [{each.name for each in part.model.variables} for part in parts]
    stated = {name for name in point if any(name in names for names in unknowns)}
    matching = [part for part, names in zip(parts, unknowns, strict=True) if names == stated]
    if not matching:
        known = " or ".join(dict.fromkeys(", ".join(sorted(names)) for names in unknowns))
        raise InputError(f"a point of this program states {known or 'nothing'}")
    parameters = dict.fromkeys(name for part in matching for name in part.model.parameters)
    given = stated.union(*(part.model.given for part in matching))
    if strange := [name for name in point if name not in given]:
        words = f"is no parameter of the program; there are {', '.join(parameters)}"
        raise InputError([Fault(name, repr(point[name]), words) for name in strange])
    return Checks(row for part in matching for row in _checks_of(network, part, stated, point))


def _checks_of(network: Network, part: Part, stated: set[str], point: Mapping[str, Any]) -> Checks:
    """Every constraint of one model, its points called after its routes if it has several."""
    known = stated | part.model.given.keys()
    values = {name: value for name, value in point.items() if name in known}
    count = len(part.routes)
    if count == 1:
        return check(part.model, {**part.model.row(0), **values})
    points, names = routes_of(network, part), _names(network, part)
    return Checks(
        replace(row, points=points, names=names) if np.shape(row.satisfied) == (count,) else row
        for row in check(part.model, values)
    )


def _names(network: Network, part: Part) -> tuple[str, ...]:
    """Names of the routes of a model: the places on the way, with hover where that is needed."""
    ways = [network.route_names(int(route))[1:-1] for route in part.routes]
    short = [[name for name in way if name != "hover"] for way in ways]
    for named in (short, ways):
        names = tuple(" → ".join(way) or "direct" for way in named)
        if len(set(names)) == len(names):
            break
    return names


def routes_of(network: Network, part: Part) -> str:
    """Which routes a model speaks of."""
    orders = {network.routes.order(route) for route in part.routes}
    order = orders.pop() if len(orders) == 1 else "with a rest"
    words = order.replace("-", " ") if order and part.rests else "without a rest"
    return words + (f", {len(part.routes)} routes" if len(part.routes) > 1 else "")


def slots_of(model: Model, slot_s: float) -> str:
    """What slots ask of the unknowns, which the model does not state."""
    return ", ".join([f"in whole slots of {written_out(slot_s)} s", *_ends(model, slot_s)])


def _ends(model: Model, slot_s: float) -> Iterator[str]:
    """Where the slots of each unknown begin and end, if not where its bounds do."""
    cut = cut_short(model)
    for time in (each for each in model.variables if not each.binary):
        if time.first_slot > 0:
            yield f"{time.symbol} ≥ {written_out(time.first_slot * slot_s)} s"
        if time.name in cut:
            yield f"the last of {time.symbol} cut short by its bound"
