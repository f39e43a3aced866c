"""Why a mission has no plan: what cannot hold on the shortest flight, and the proof of it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from formulations.p1 import P1
from formulations.p2 import P2
from optuav.arrays import Booleans, Values
from optuav.engines.registry import AUTO, MOST_UNKNOWNS
from optuav.errors import InputError
from optuav.modelling import Model, Relation, evaluate
from optuav.modelling.check import evaluated
from optuav.modelling.classify import traits
from optuav.modelling.declaration import Constraint
from optuav.modelling.forms import NotExponentialError
from optuav.modelling.traversal import has_unknowns
from optuav.network.network import Network
from optuav.network.variants import as_variants
from optuav.plan import Plan
from optuav.presentation.numbers import all_digits, figure, seconds
from optuav.solving.best_plans import best_plans
from optuav.solving.constraint_words import constraint_words, violation, words
from optuav.solving.question import Question, solve_model
from optuav.solving.route_models import RouteModel
from optuav.solving.route_plan import plan_for
from optuav.status import Status

ANY_S = 1e9  # Longer than any time of a mission [s]
MOST_VIOLATED = 2  # violated constraints that are stated in full


def plan_without(
    question: Question, network: Network, status: Status, proof: str, reasons: Sequence[str]
) -> Plan:
    """Return an empty plan that holds the reasons."""
    engine = "" if question.engine == AUTO else question.engine_name
    why = tuple(reasons)
    return plan_for(question, network, engine=engine, proof=proof, status=status, reasons=why)


def none_proved(model: Model, count: int, values: Values | None = None) -> Booleans:
    """For which of some programmes it is proved that no times are feasible."""
    from optuav.engines.bracket import some_point

    model_traits = traits(model)
    with suppress(NotExponentialError, InputError):
        if not model_traits.integer and model_traits.unknowns <= MOST_UNKNOWNS:
            return some_point(model, count, values)[1]
    return np.zeros(count, bool)


def proof_of_none(parts: Sequence[RouteModel]) -> str:
    """Return the proof that no times are feasible, whatever an engine found; empty without one."""
    from optuav.engines.bracket import PROOF_OF_NONE

    none = (none_proved(part.model, len(part.routes)).all() for part in parts)
    return PROOF_OF_NONE if all(none) else ""


def subset(model: Model, constraints: Iterable[Constraint], far_s: float = math.inf) -> Model:
    """Some constraints of a model over the same unknowns, their sum up to a limit; no objective."""
    part, (first, *others) = Model(model.title), model.variables
    part.variables, part.constraints = model.variables, [*constraints]
    if far_s < math.inf:
        far = Relation(sum(others, start=first + 0.0), "<=", far_s)
        part.constraints.append(Constraint("", far, "s", ""))
    return part


def shortest_flight(network: Network, parts: Sequence[RouteModel]) -> tuple[int, int]:
    """Part and entry of the route with the shortest flight."""
    flight_s = [network.routes.flight_time_s[part.routes] for part in parts]
    number = int(np.argmin([flights_s.min() for flights_s in flight_s]))
    return number, int(flight_s[number].argmin())


def _longest_instead(question: Question, network: Network) -> str:
    """Words on the longest hover if a longer one is wanted; empty if none is, or none fits."""
    wanted = question.problem
    if not isinstance(wanted, P2) or wanted.hover_time_s is None or question.slot_s is not None:
        return ""
    longest = P1(trajectory=wanted.trajectory, device_order=wanted.device_order)
    best = best_plans(as_variants(network), replace(question, problem=longest, engine=AUTO))
    hover_s = float(best.hover_time_s[0])
    if not hover_s < wanted.hover_time_s:  # NaN without a plan
        return ""
    words = f"{figure(wanted.hover_time_s, 12)} s of hover do not fit"
    return f"{words}: the longest is {seconds(hover_s)}, by P1"


def shortfalls(
    question: Question, network: Network, parts: Sequence[RouteModel]
) -> tuple[str, ...]:
    """Why no times are feasible: what cannot hold on the shortest flight, at the least times.

    If each constraint can be met separately, say that they cannot be met together.
    """
    number, entry = shortest_flight(network, parts)
    part, deadline_s = parts[number], network.mission.limits.deadline_s
    shortest_s = network.routes.flight_time_s[part.routes[entry]]
    if shortest_s > deadline_s:
        late = f"longer than limits.deadline_s = {figure(deadline_s)} s"
        return (f"the flight takes {seconds(shortest_s)}, {late}",)
    if longest := _longest_instead(question, network):
        return (longest,)
    model, parameters = part.model, part.model.row(entry)
    continuous = replace(question, slot_s=None, engine=AUTO)
    linear = (part for part in parts if traits(part.model).linear)
    without = (solve_model(part.model, len(part.routes), continuous).statuses for part in linear)
    if question.slot_s is not None and any(s.has_answer for found in without for s in found):
        slots = f"no whole slots of {all_digits(question.slot_s)} s satisfy all constraints"
        reasons = [f"{slots} together; without slots there are times that do"]
        for constraint in model.constraints:
            right = constraint.relation.right
            if constraint.relation.sense == "==" and not has_unknowns(right):
                exact = f"exactly {figure(evaluate(right, parameters))} {constraint.unit}"
                reasons.append(f"{constraint_words(constraint.label)}: {exact} are asked for")
        return tuple(reasons)
    least = {variable.name: evaluate(variable.lower, parameters) for variable in model.variables}
    times = ", ".join(
        f"{unknown.symbol} = {figure(least[unknown.name])}" for unknown in model.variables
    )
    broken = [row for row in evaluated(model, {**parameters, **least}) if not row.satisfied]
    labels = words(network, part, entry, [row.label for row in broken])
    way = " → ".join(network.route_names(int(part.routes[entry])))
    violated = [
        f"{constraint_words(label)}: {violation(row)} does not hold at {times} on {way}"
        for label, row in zip(labels, broken, strict=True)
        if not has_unknowns(*row.constraint.relation.sides)
        or none_proved(subset(model, [row.constraint], ANY_S), 1, parameters)[0]
    ]
    if (more := len(violated) - MOST_VIOLATED) > 0:
        violated[MOST_VIOLATED:] = [
            f"{more} more {'constraints are' if more > 1 else 'constraint is'} violated there"
        ]
    if question.slot_s is not None:
        return tuple(violated) or ("no whole slots satisfy all constraints together",)
    named = " and ".join(map(constraint_words, labels[:MOST_VIOLATED]))
    met = f": those that satisfy {named} break others"
    return tuple(violated) or (f"no times satisfy all constraints together{met * bool(labels)}",)
