"""A program: the declared models of a question, to be printed, checked, solved and compiled."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Never, SupportsIndex, overload

import numpy as np
import numpy.typing as npt

from formulations.p2 import P2
from formulations.soc import AVAILABLE
from optuav.arrays import Floats, Integers, plain
from optuav.engines.bracket import NAME as BRACKET
from optuav.engines.bracket import PROOF_OF_NONE
from optuav.engines.linear_form import cut_short
from optuav.engines.prices import ShadowPrice, ShadowPrices
from optuav.engines.registry import AUTO, Engine, engine_names, of_the_package, takers
from optuav.engines.solution import Solution, returned
from optuav.errors import Fault, InputError, NoPlanError, SolverError, for_console, printable
from optuav.mission.messages import nearest, shown
from optuav.mission.messages import number as number_of_key
from optuav.modelling import Check, Checks, Model, check
from optuav.modelling.check import refuse_misfits
from optuav.modelling.classify import traits
from optuav.modelling.writer import LINE
from optuav.network.feasibility import blocked_legs, impossibilities
from optuav.network.network import Network
from optuav.network.variants import as_variants
from optuav.options import LONGEST_HOVER
from optuav.plan import Plan
from optuav.presentation.numbers import all_digits, figure
from optuav.solving.balance import TIMES
from optuav.solving.files import writer
from optuav.solving.longest_hover import longest_hover
from optuav.solving.more_stops import BOUNDED, PROVED, against_p1, note_what_battery_allows
from optuav.solving.no_plan import plan_without, proof_of_none, shortest_flight, shortfalls
from optuav.solving.question import Question, engine_for, solve_model
from optuav.solving.ranking import best
from optuav.solving.route_models import RouteModel, declarations, permitted_routes
from optuav.solving.route_plan import plan_of, replayed
from optuav.solving.wanted_hover import shortest_for_hover
from optuav.status import Status

if TYPE_CHECKING:
    import pyomo.environ

MOST_REASONS = 10  # blocked legs that are named one by one
ENDLESS = (
    "no constraint keeps the objective finite: "
    "declare the deadline with given.keep_deadline(model, label, hover, rest)"
)


def declared_program(question: Question, network: Network) -> Program:
    """The question as a program; without parts, and with reasons, where nothing can be flown."""
    parts, reasons = list[RouteModel](), impossibilities(network)
    variants = as_variants(network)
    able = permitted_routes(variants, question.problem)
    for part, _ in () if reasons else declarations(question, variants, able):
        if not part.given:
            refuse_misfits(part.declared, len(part.routes))
        if question.engine != AUTO:
            engine_for(part.model, question)
        parts.append(part)
    if not parts and not reasons:
        reasons = _no_route(question, network)
    return Program(question, network, tuple(parts), reasons)


def best_plan(question: Question, network: Network) -> Plan:
    """The best plan over all itineraries; see `Program.solve`."""
    plan = longest_plan(question, network)
    return declared_program(question, network).plan_of_engine() if plan is None else plan


def longest_plan(question: Question, network: Network) -> Plan | None:
    """The plan of `longest_hover`, evaluated on the model of its route."""
    if (found := longest_hover(question, network)) is None:
        return None
    part, solution = found
    return Program(question, network, (part,), ()).plan([solution])


def _no_route(question: Question, network: Network) -> tuple[str, ...]:
    """Why no itinerary of the question can be flown."""
    routes = network.routes
    # As if all could be flown in the same time: traj2 would take any.
    flyable, flight_time_s = np.ones_like(routes.flyable), np.ones_like(routes.flight_time_s)
    alike = replace(routes, flyable=flyable, flight_time_s=flight_time_s)
    wanted = permitted_routes(as_variants(replace(network, routes=alike)), question.problem)[0]
    if not wanted.any():
        return ("the mission has no building to go by way of",)
    blocked = np.flatnonzero(wanted & ~routes.flyable).tolist()
    legs = dict.fromkeys(leg for route in blocked for leg in blocked_legs(network, route))
    if not legs:
        needed = "rest_time_s, which a route by way of a building needs"
        return (f"{question.problem.name} declares no {needed}",)
    more = ("and other legs are blocked as well",) if len(legs) > MOST_REASONS else ()
    return (*tuple(legs)[:MOST_REASONS], *more)


class NoParts(tuple[RouteModel, ...]):
    """The parts of a program where nothing can be flown: none, and a first one is refused."""

    reasons: tuple[str, ...] = ()

    @overload
    def __getitem__(self, place: SupportsIndex) -> Never: ...

    @overload
    def __getitem__(self, place: slice) -> tuple[RouteModel, ...]: ...

    def __getitem__(self, place: SupportsIndex | slice) -> tuple[RouteModel, ...]:
        if isinstance(place, slice):
            return super().__getitem__(place)
        raise NoPlanError(f"nothing can be flown: {'; '.join(self.reasons)}")


@dataclass(frozen=True)
class Program:
    """Declared models, each over some routes; or the reasons why nothing can be flown.

    `optuav.formulate` makes it. Print it, check points, solve it, or compile its models.

    Parameters
    ----------
    question, network
        Problem, perspective, slots, engine and time limit, checked; the mission as arrays.
    parts, reasons
        Models, each with the numbers of its routes; or the reasons why nothing can be flown. Then
        there is no first part, and ``parts[0]`` raises `NoPlanError`.

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
    parts: tuple[RouteModel, ...]
    reasons: tuple[str, ...]

    def __post_init__(self) -> None:
        if not self.parts:
            none = NoParts()
            none.reasons = self.reasons
            object.__setattr__(self, "parts", none)

    @for_console
    def __str__(self) -> str:
        if not self.parts:
            return "nothing can be flown: " + "; ".join(self.reasons)
        return self._pages(str)

    def __repr__(self) -> str:
        name, count = self.network.mission.name, len(self.parts)
        question = f"{self.question.problem.name}, perspective {self.question.perspective}"
        return f"<Program for {name!r}: {question}, {count} model{'s' if count != 1 else ''}>"

    @property
    def engines(self) -> tuple[str, ...]:
        """Names of the engines that accept every declared model, in slots if requested."""
        slots = self.question.slot_s is not None
        able = [takers(traits(part.declared), slots) for part in self.parts]
        return tuple(
            name for name in engine_names() if able and all(name in names for names in able)
        )

    def _repr_html_(self) -> str:
        from xml.etree.ElementTree import Element

        from optuav.modelling.mathml import html
        from optuav.presentation.markup import fold, page, paragraph

        if not self.parts:
            return page(paragraph(str(self), good=False))
        pages = list[Element]()
        for part, heads in zip(self.parts, self._heads(), strict=True):
            content = html(part.model)
            if heads:
                content = [fold("; ".join(heads), *content, is_open=not pages)]
            pages += content
        return page(*pages)

    def to_latex(self, *, width: int = LINE, numbers: bool = True, labels: bool = True) -> str:
        """The declared models as LaTeX ``align*`` environments (package amsmath).

        Parameters
        ----------
        width, numbers, labels
            Characters of mathematics on a line, and whether values and names are shown, as in
            `Model.to_latex`.

        Raises
        ------
        InputError
            If the width is not such a number.
        """
        if not self.parts:
            return f"% {self}"
        write = partial(Model.to_latex, width=width, numbers=numbers, labels=labels)
        return self._pages(write, "% ")

    _repr_latex_ = to_latex

    def _pages(self, write: Callable[[Model], str], mark: str = "") -> str:
        """The models in writing, each under its heads."""
        written = (write(part.model) for part in self.parts)
        pairs = zip(self._heads(), written, strict=True)
        return "\n\n".join("\n".join([*(mark + h for h in heads), w]) for heads, w in pairs)

    def _heads(self) -> Iterator[list[str]]:
        """Heading of each model: its routes, if there are several models, and the rule of slots."""
        for place, part in enumerate(self.parts, start=1):
            heads, slot_s = list[str](), self.question.slot_s
            if len(self.parts) > 1:
                heads.append(f"{place} of {len(self.parts)}: {self._routes_words(part)}")
            if slot_s is not None:
                heads.append(_slots_words(part.model, slot_s))
            yield heads

    def _routes_words(self, part: RouteModel) -> str:
        """Name the routes of a model in words."""
        orders = {self.network.routes.order(route) for route in part.routes}
        order = orders.pop() if len(orders) == 1 else "with a rest"
        words = order.replace("-", " ") if order and part.rests else "without a rest"
        return words + (f", {len(part.routes)} routes" if len(part.routes) > 1 else "")

    def to_file(self, form: str | Path) -> str:
        """Return the programme of the best route with numbers for other solvers, as text.

        Parameters
        ----------
        form
            For linear programmes ``"lp"`` (CPLEX LP) or ``"mps"`` (free MPS); for all programmes,
            written by Pyomo (extra ``pyomo``), ``"nl"`` (AMPL), ``"gms"`` (GAMS) or ``"bar"``
            (BARON). A path with such a suffix also writes the file.

        Raises
        ------
        InputError
            If the form does not exist, it cannot hold a constraint, times are in slots, Pyomo is
            missing, or the path cannot be written to.
        NoPlanError
            If nothing can be flown.
        """
        write = writer(form, *(part.model for part in self.parts))
        (number, entry), best = self._for_others()
        part = self.parts[number]
        route = " -> ".join(self.network.route_names(int(part.routes[entry])))
        mission = f"mission {self.network.mission.name}, perspective {self.question.perspective}"
        remarks = [printable(mission), printable(f"route {route}"), *best]
        return write(part.model, part.model.row(entry), remarks)

    def to_pyomo(self) -> pyomo.environ.ConcreteModel:
        """The programme of the best route with numbers, as a model of Pyomo (extra ``pyomo``).

        Returns
        -------
        pyomo.environ.ConcreteModel
            With ``unknowns``, mutable ``parameters`` and ``quantities`` by name, ``constraints`` by
            label, ``objective``, and the goals after it as ``preferences``, which are not active. A
            constraint without an unknown is left out.

        Raises
        ------
        InputError
            If Pyomo is missing, Pyomo lacks a function or its digits, or a constraint without an
            unknown is violated; otherwise as in `to_file`.

        Examples
        --------
        >>> import optuav
        >>> model = optuav.formulate("paper", optuav.P4("b9", order="hover-first")).to_pyomo()
        >>> list(model.unknowns), model.parameters["deadline_s"].value
        (['hover_time_s', 'rest_time_s'], 1200.0)
        """
        from optuav.engines.pyomo_model import to_pyomo

        (number, entry), _ = self._for_others()
        return to_pyomo(self.parts[number].model, self.parts[number].model.row(entry))

    def _for_others(self) -> tuple[tuple[int, int], list[str]]:
        """Part and entry of the programme that others get, and why it is this one of several."""
        if not self.parts:
            raise NoPlanError(str(self))
        if (slot_s := self.question.slot_s) is not None:
            words = "files and models for other solvers hold continuous times"
            raise InputError([Fault("slot_s", shown(slot_s), words)])
        if (count := sum(len(part.routes) for part in self.parts)) == 1:
            return (0, 0), []
        chosen, said = self.best(self.answers()), "the best"
        if chosen is None:
            said = "no route has an answer; the shortest flight"
            chosen = shortest_flight(self.network, self.parts)
        return chosen, [f"{said} of {count} routes, each a programme of its own"]

    def check(self, point: Mapping[str, npt.ArrayLike]) -> Checks:
        """Evaluate every constraint at a point of any origin with NumPy.

        Parameters
        ----------
        point
            Values of the unknowns by name, and of parameters that differ from the mission's;
            numbers, or arrays or lists that broadcast (one entry per itinerary).

        Returns
        -------
        Checks
            One `Check` per constraint, in order; with several routes, the routes that violate it.

        Raises
        ------
        InputError
            If no model of the program has exactly these unknowns and parameters; also for a plan,
            because it flies only one of the routes.
        NoPlanError
            If nothing can be flown.
        """
        if not isinstance(point, Mapping):
            words = "values by name, such as {'hover_time_s': plan.hover_time_s}"
            raise InputError([Fault("point", shown(point), words)])
        if not self.parts:
            raise NoPlanError(str(self))
        kinds = dict.fromkeys(part.unknowns for part in self.parts)
        unknowns_of_point = frozenset[str]().union(*kinds) & point.keys()
        matching = [part for part in self.parts if part.unknowns == unknowns_of_point]
        if not matching:
            expected = " or ".join(", ".join(sorted(unknowns)) for unknowns in kinds)
            raise InputError(f"a point of this program has values for {expected or 'no unknown'}")
        known_names = unknowns_of_point.union(*(part.model.given for part in matching))
        if strange := [name for name in point if name not in known_names]:
            parameters = dict.fromkeys(name for part in matching for name in part.model.parameters)
            words = f"is not a parameter of the program; there are {', '.join(parameters)}"
            raise InputError([Fault(name, shown(point[name]), words) for name in strange])
        rows = list[Check]()
        for part in matching:
            model, count = part.model, len(part.routes)
            values = {k: v for k, v in point.items() if k in unknowns_of_point | model.given.keys()}
            if count == 1:
                rows += check(model, {**model.row(0), **values})
                continue
            points = self._routes_words(part)
            ways = (self.network.route_names(int(route))[1:-1] for route in part.routes)
            # The hover point says something where one of them rests first and another does not.
            mixed = len(set(self.network.routes.rest_first[part.routes])) > 1
            stops = ([place for place in way if mixed or place != "hover"] for way in ways)
            names = tuple(" → ".join(stop) or "direct" for stop in stops)
            for row in check(model, values):
                by_route = np.shape(row.satisfied) == (count,)
                rows.append(replace(row, points=points, names=names) if by_route else row)
        return Checks(rows)

    def solve(self) -> Plan:
        """Return the best plan over all itineraries, evaluated again outside the engine.

        Raises
        ------
        SolverError
            If the engine fails, runs out of time or returns a point that is not feasible.
        """
        changed = any(part.was_exposed for part in self.parts)
        plan = None if changed else longest_plan(self.question, self.network)
        return self.plan_of_engine() if plan is None else plan

    def plan_of_engine(self) -> Plan:
        """Return the best plan from the engine's answers to all models."""
        question, network = self.question, self.network
        if not self.parts:
            status = Status.INFEASIBLE
            return plan_without(question, network, status, "physics", self.reasons)
        if question.perspective == AVAILABLE and network.mission.battery.takes_turns:
            from optuav.solving.packs_by_schedule import packs_by_schedule

            return replayed(packs_by_schedule(question, network, self.parts))
        changed = any(part.was_exposed for part in self.parts)
        answers = None if changed else shortest_for_hover(question, network)
        if answers is None:
            return self.plan(self.answers())
        if not answers:
            asked, why = (
                replace(question, engine=BRACKET),
                shortfalls(question, network, self.parts),
            )
            return plan_without(asked, network, Status.INFEASIBLE, PROOF_OF_NONE, why)
        parts, solutions = zip(*answers, strict=True)
        return replace(self, parts=parts).plan(solutions)

    def answers(self) -> list[Solution]:
        """Return the engine's answers to all programmes, one `Solution` per part."""
        return [*self._answers]

    @cached_property
    def _answers(self) -> list[Solution]:
        """The same, solved once."""
        solutions = list[Solution]()
        for part in self.parts:
            model, values = (part.model, None) if part.was_exposed else (part.declared, part.given)
            solutions.append(solve_model(model, len(part.routes), self.question, values))
        return solutions

    def plan(self, solutions: Sequence[Solution]) -> Plan:
        """Return the best plan from known answers to all parts, evaluated again."""
        question, network = self.question, self.network
        engine, proof = solutions[0].engine, solutions[0].proof
        with_engine = replace(question, engine=engine)
        statuses = {status for solution in solutions for status in solution.statuses}
        for solution in solutions:
            solution.refuse_unusable()
        if Status.UNBOUNDED in statuses:
            return plan_without(with_engine, network, Status.UNBOUNDED, proof, [ENDLESS])
        chosen = self.best(solutions)
        if chosen is None:
            if Status.UNKNOWN in statuses:
                said = dict.fromkeys(word for s in solutions for word in s.words if word)
                words = "".join(f": {word}" for word in said)
                if not (proof := proof_of_none(self.parts)):
                    nothing = "neither a plan nor proof that none exists"
                    raise SolverError(f"{engine} found {nothing}{words}")
                proof += ", by the engine bracket"
            why = shortfalls(question, network, self.parts)
            return plan_without(with_engine, network, Status.INFEASIBLE, proof, why)
        number, entry = chosen
        solution = solutions[number]
        plan = plan_of(question, network, self.parts[number], solution, entry)
        wanted = isinstance(question.problem, P2) and question.problem.hover_time_s is not None
        if question.problem.name in PROVED and not wanted:
            plan = against_p1(question, network, self.parts, plan)
        best = float(solution.objective[entry])
        beyond = [np.nanmax(s.beyond, initial=best) for s in solutions if s.beyond is not None]
        notes = list(plan.notes)
        if (open_ := max(beyond, default=best) - best) > solution.ties[entry]:
            unit = plan.objective_unit.removeprefix("1")
            more = f"{figure(open_)} {unit}".rstrip()
            notes.append(f"not proved: up to {more} more has not been ruled out")
            changes = {"status": Status.FEASIBLE, "proof": BOUNDED, "bound": best + open_}
            plan = plan.model_copy(update=changes)
        elif plan.status is solution.statuses[entry] and any(
            solution.beyond is None and Status.UNKNOWN in solution.statuses
            for solution in solutions
        ):
            notes.append(f"not proved: on some routes {engine} found neither times nor proof")
            if plan.status is Status.OPTIMAL:
                plan = plan.model_copy(update={"status": Status.FEASIBLE})
        elif solution.statuses[entry] is Status.OPTIMAL and Status.LOCALLY_OPTIMAL in statuses:
            # Better times may exist on routes with only a local optimum.
            local = next(s for s in solutions if Status.LOCALLY_OPTIMAL in s.statuses)
            plan = plan.model_copy(update={"status": Status.LOCALLY_OPTIMAL, "proof": local.proof})
        longest = question.problem.name in LONGEST_HOVER
        if longest and question.perspective == AVAILABLE and engine == "bracket":
            notes += note_what_battery_allows(question, network, plan)
        return replayed(plan.model_copy(update={"notes": tuple(notes)}))

    def best(self, solutions: Sequence[Solution]) -> tuple[int, int] | None:
        """Part and entry of the best answer by the tie rule; None without an answer."""
        return next(iter(self.tied(solutions)), None)

    def tied(self, solutions: Sequence[Solution]) -> list[tuple[int, int]]:
        """Part and entry of all best answers, first the tie rule's choice; empty without one."""
        if sum(len(solution.statuses) for solution in solutions) <= 1:
            return [(0, 0)] if solutions and solutions[0].status.has_answer else []
        table, columns = self.network.routes, list[tuple[Floats, Floats, Floats, Integers]]()
        for part, solution in zip(self.parts, solutions, strict=True):
            stays_s = sum(solution.values.get(name, 0.0) for name in TIMES)
            mission_s = table.flight_time_s[part.routes] + stays_s
            score = solution.objective * part.declared.sign
            columns.append((score, solution.ties, mission_s, part.routes))
        scores, ties, missions_s, routes = map(np.concatenate, zip(*columns, strict=True))
        # Ties are broken by the number of stops, then in the order of the routes.
        ranks = (table.building[routes] >= 0) * len(table) + routes
        if (winner := best(scores, missions_s, ranks, ties)) is None:
            return []
        near = (np.abs(scores - scores[winner]) <= ties[winner]).nonzero()[0].tolist()
        ends = np.cumsum([len(part.routes) for part in self.parts]).tolist()
        numbers = [(k, bisect_right(ends, k)) for k in dict.fromkeys((winner, *near))]
        return [(part, k - ends[part] + len(self.parts[part].routes)) for k, part in numbers]

    def shadow_prices(self, solutions: Sequence[Solution] | None = None) -> ShadowPrices:
        """Return the price of every named parameter per unit; empty without an answer.

        A figure of routes changes on all routes alike. If routes tie, an improvement counts if it
        helps one of them, and a deterioration only if it hurts all of them. A price beyond the
        range of a key is NaN. `solutions` are the answers to all parts, if they are known.
        """
        solutions = self.answers() if solutions is None else solutions
        all_prices = [solutions[k].shadow_prices(index) for k, index in self.tied(solutions)]
        if not solutions or not all(all_prices):
            return ShadowPrices({}, {})
        better, worse = (max, min) if self.parts[0].model.sense == "maximise" else (min, max)
        parameters = {name: p for part in self.parts for name, p in part.model.parameters.items()}
        nothing, prices = ShadowPrice(0.0, 0.0), {}
        for name in dict.fromkeys(name for route_prices in all_prices for name in route_prices):
            less, more = zip(*(prices.get(name, nothing) for prices in all_prices), strict=True)
            sides, now = [worse(less), better(more)], parameters[name].value
            allowed = number_of_key(parameters[name].key)
            for k, end in enumerate((-math.inf, math.inf)):
                if allowed and not (allowed.whole or allowed.accepts(math.nextafter(now, end))):
                    sides[k] = math.nan
            prices[name] = ShadowPrice(*sides)
        return ShadowPrices(prices, parameters)

    def compile(self, engine: str | Engine | None = None) -> CompiledProgram:
        """Hand the models to an engine once, by default the question's, to be solved often.

        Raises
        ------
        InputError
            If nothing can be flown, or the engine does not take the models.
        """
        return CompiledProgram(self, replace(self.question, engine=engine or self.question.engine))


def _slots_words(model: Model, slot_s: float) -> str:
    """Say what slots require of the unknowns, which the model does not state."""
    words, cut = [f"in whole slots of {all_digits(slot_s)} s"], cut_short(model)
    for time in (variable for variable in model.variables if not variable.binary):
        if time.first_slot > 0:
            words.append(f"{time.symbol} ≥ {all_digits(time.first_slot * slot_s)} s")
        if time.name in cut:
            words.append(f"the last of {time.symbol} cut short by its bound")
    return ", ".join(words)


class CompiledProgram:
    """Models handed to an engine once, to be solved often: what `Program.compile` returns."""

    def __init__(self, program: Program, question: Question) -> None:
        if not program.parts:
            raise InputError(f"nothing to compile: {'; '.join(program.reasons)}")
        if question.engine_name == "grid" and question.slot_s is None:
            question = replace(question, slot_s=program.network.mission.limits.slot_s)
        self.program, self.question = program, question
        engines = [(engine_for(part.model, question), part) for part in program.parts]
        self._compiled = [
            (e, p, e.compile(p.model, len(p.routes), **question.limits)) for e, p in engines
        ]
        parameters_of_parts = (part.model.parameters for part in program.parts)
        self._parameters = {
            name: parameter for own in parameters_of_parts for name, parameter in own.items()
        }
        self.parameters = tuple(self._parameters)  # those that `solve` may change, by name
        # Where the itineraries have several declarations, an array is of none of them.
        self._most = len(program.parts[0].routes) if len(program.parts) == 1 else 1

    def __reduce__(self) -> tuple[type[CompiledProgram], tuple[Program, Question]]:
        """Copies and pickles are compiled again: an engine's preparations stay with it."""
        return type(self), (self.program, self.question)

    def solve(self, **values: npt.ArrayLike) -> Solution:
        """Solve again with other values of named parameters, the rest as in the mission.

        Parameters
        ----------
        values
            For example ``deadline_s=900, min_soc=0.1``: numbers, or arrays with one entry an
            itinerary where all of them belong to one declaration.

        Returns
        -------
        Solution
            Solution for only the best itinerary.

        Raises
        ------
        InputError
            Lists every unknown name and every value that a parameter cannot have.
        SolverError
            If the engine fails, or meets numbers that it cannot use.
        """
        objections = ((n, v, self._objection(n, v)) for n, v in values.items())
        if faults := [Fault(n, shown(v), words) for n, v, words in objections if words]:
            raise InputError(faults)
        numbers = {
            n: np.array(v, float) if np.ndim(v) else np.asarray(v, float).item()
            for n, v in values.items()
        }
        solutions = list[Solution]()
        for engine, part, solve in self._compiled:
            solution = solve(numbers)
            if not of_the_package(engine):
                size = len(part.routes)
                solution = returned(solution, engine.name, part.model, size, numbers)
            solutions.append(replace(solution, given=numbers))
        for solution in solutions:
            solution.refuse_unusable()
            if Status.UNBOUNDED in solution.statuses:
                return solution.only(solution.statuses.index(Status.UNBOUNDED))
        chosen = self.program.best(solutions)
        if chosen is None:
            for solution in solutions:
                if Status.UNKNOWN in solution.statuses:
                    return solution.only(solution.statuses.index(Status.UNKNOWN))
            return solutions[0].only(0)
        number, entry = chosen
        solution = solutions[number]
        solution.verify(entry)
        return solution if len(solution.statuses) == 1 else solution.only(entry)

    def _objection(self, name: str, value: npt.ArrayLike) -> str:
        """Return the fault of a parameter's value; empty without a fault."""
        if name not in self._parameters:
            hint, names = nearest(name, self._parameters), ", ".join(self._parameters)
            return f"is not a parameter of the program{hint}; there are {names}"
        try:
            numbers = plain(None if isinstance(value, bool) else value)
        except ValueError:  # lists of different lengths
            numbers = np.asarray(None)
        fits = numbers.dtype.kind in "iuf" and numbers.shape in ((), (self._most,))
        if not fits or not np.isfinite(numbers).all():
            return "a finite number" + (f", or {self._most} of them" if self._most > 1 else "")
        key = self._parameters[name].key
        allowed = number_of_key(key)
        if allowed is None or all(map(allowed.accepts, np.ravel(value).tolist())):
            return ""
        return f"{allowed.words}, like {key}"


def route_model_of(program: Program, plan: Plan) -> tuple[RouteModel, int]:
    """Return part and entry of the route of a plan; without one, of the shortest flight."""
    names = program.network.route_names
    for part in program.parts if plan else ():
        for entry, route in enumerate(part.routes.tolist()):
            if names(route) == plan.route:
                return part, entry
    number, entry = shortest_flight(program.network, program.parts)
    return program.parts[number], entry
