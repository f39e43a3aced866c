"""The routes of a mission with many buildings that may be the best, by bounds on all of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from formulations.p1 import P1
from formulations.p3 import P3
from formulations.soc import AVAILABLE, PAPER
from optuav.arrays import Booleans, Floats, Integers
from optuav.engines.registry import AUTO
from optuav.mission import Mission
from optuav.mission.flight_model import BENT, flight_of
from optuav.network import vehicle
from optuav.network.legs import NO_LEG, Legs, build_legs
from optuav.network.network import Network, network_by
from optuav.network.obstacles import CLEAR
from optuav.network.places import FIRST_BUILDING, HOVER, Places, build_places
from optuav.network.prisms import prisms
from optuav.network.routes import build_routes
from optuav.network.variants import Columns, Variants, stacked
from optuav.physics.kibam import (
    Shift,
    Stage,
    Tilted,
    falls_throughout,
    gentlest,
    start,
    tilted_after,
)
from optuav.physics.quantity import norm
from optuav.solving.assemble import figures
from optuav.solving.balance import by_balance
from optuav.solving.best_plans import Best, best_plans, hover_bounds_s, impossible, takes_arrays
from optuav.solving.program import SLACK_S, Program, declared_program
from optuav.solving.question import Question

AT_ONCE = 1 << 12
"""Buildings that are bounded together: their legs stay in the cache."""
FIRST, MOST = 50, 20_000  # Routes that are solved first, and at most
FEW = 4  # Routes whose legs are bent first
RARE = 0.1  # Share of variants that may be solved on all routes
SHORT = 1e-9  # Share of the capacity that brackets and rounding may take from an empty well


def narrowed(mission: Mission, question: Question) -> Program | None:
    """The program over all routes that may be the best, or that its notes or reasons mention.

    Its plan, or reasons for none, also hold for the program over all routes. None if any route
    may be the best.
    """
    problem, names = question.problem, mission.buildings.names
    if question.several or question.p1.hover_point != "w_U":
        return None
    places = build_places(mission)
    if isinstance(problem, P3) or problem.trajectory == "direct":
        return _over(mission, question, places, np.zeros(0, dtype=np.intp))
    if problem.building is not None:
        return _over(mission, question, places, np.array([names.index(problem.building)]))
    turns = mission.battery.takes_turns and question.perspective == AVAILABLE
    alike = question.engine == AUTO and question.slot_s is None
    if problem != P1() or question.perspective not in (*PAPER, AVAILABLE) or turns or not alike:
        return None
    if mission.flight.obstacle_rule in BENT and len(names) <= AT_ONCE:
        return _past_bent(mission, question, places)
    # Walls forbid routes and make none better: only the legs to the best roofs are tried.
    clear = mission.replace({"flight.obstacles": "ignore"})
    bounds_s, size = _bounds_s(clear, question, places), FIRST
    to_hover, from_hover = network_by(mission, places, np.arange(0)).legs.flyable
    if not from_hover:
        bounds_s[:, 0::2] = -np.inf  # Rest first
    if not to_hover:
        bounds_s[:, 1::2] = -np.inf
    while size <= MOST:
        last = min(size, bounds_s.shape[1] - 1)
        best = [np.argpartition(-bound_s, last)[:size] for bound_s in bounds_s]
        chosen = np.unique(np.concatenate(best) // 2)
        program = _over(mission, question, places, chosen)
        open_ = _open_routes(bounds_s, _found_s(program))
        if np.isin(np.flatnonzero(open_.any(axis=0)) // 2, chosen).all():
            return program
        size *= 4
    return None


def _past_bent(mission: Mission, question: Question, places: Places) -> Program:
    """`narrowed` where legs are bent, which takes long: only those of routes in question are.

    Until it is bent, a leg counts as if nothing were in the way: bent, it costs no less.
    """
    every, obstacles = np.arange(len(mission.buildings)), prisms(mission.buildings)
    legs = network_by(mission.replace({"flight.obstacles": "refuse"}), places, every).legs
    known = legs.crosses == CLEAR
    legs = replace(legs, flyable=np.asarray(np.isfinite(legs.durations_s).all(axis=0)))
    back = np.arange(len(known))  # The leg along the same line, which is bent at the same time
    back[3::4], back[4::4] = back[4::4], back[3::4].copy()

    def bent(legs: Legs, wanted: Integers) -> Legs:
        """The legs, some of them past the buildings if they are not yet."""
        new = np.union1d(wanted, back[wanted])
        if not len(new := new[~known[new]]):
            return legs
        known[new] = True
        ends = legs.start[new], legs.end[new]
        return legs.put(new, build_legs(mission, places, obstacles, *ends))

    found_s, tried, size = np.full(4, -np.inf), np.zeros(1 + 2 * len(every), bool), FEW
    wanted = np.array([0, 1])
    while True:
        legs = bent(legs, wanted)
        routes = build_routes(legs, every)
        whole = (known[routes.legs] | (routes.legs == NO_LEG)).all(axis=1)
        fresh = np.append(0, 1 + np.flatnonzero(whole[1:] & ~tried[1:]))
        network, tried = Network(mission, places, legs, routes), whole
        program = declared_program(question, replace(network, routes=routes.take(fresh)))
        found_s = np.maximum(found_s, _found_s(program))
        bounds_s = _bounds_of(network, question)
        open_ = _open_routes(bounds_s, found_s)
        left_s = np.where(open_ & ~whole[1:], bounds_s, -np.inf)
        if np.isneginf(left_s).all():
            break
        best = [np.argsort(-left, kind="stable")[:size] for left in left_s]
        likely = [some[np.isfinite(left[some])] for some, left in zip(best, left_s, strict=True)]
        wanted, size = routes.legs[1 + np.unique(np.concatenate(likely))], 2 * size
        wanted = wanted[wanted != NO_LEG]
    chosen = np.unique(np.flatnonzero(open_.any(axis=0)) // 2)
    numbers = np.append([0, 1], 2 + 4 * chosen[:, None] + np.arange(4))
    legs = bent(legs, numbers).take(numbers)
    return declared_program(question, Network(mission, places, legs, build_routes(legs, chosen)))


def _found_s(program: Program) -> Floats:
    """The best hover, at least 0, and the best `_figures_s`, of the routes of a program [s]."""
    scores = [solution.objective.max(initial=-np.inf) for solution in program.answers()]
    promised_s, *flights_s = _figures_s(program.network).max(axis=1, initial=-np.inf)
    return np.array([np.fmax.reduce(scores, initial=0.0), max(promised_s, 0.0), *flights_s])


def _open_routes(bounds_s: Floats, found_s: Floats) -> Booleans:
    """Routes that may be as good as those found, by kind of bound."""
    return np.asarray((bounds_s >= found_s[:, None] - SLACK_S) & (bounds_s > -np.inf))


def _over(mission: Mission, question: Question, places: Places, buildings: Integers) -> Program:
    """The program over only the routes by way of some buildings."""
    return declared_program(question, network_by(mission, places, buildings))


def _bounds_s(mission: Mission, question: Question, places: Places) -> Floats:
    """By route with a rest: what no Δ exceeds [s], and the figures of `_figures_s`."""
    count, bounds = len(mission.buildings), list[Floats]()
    for begin in range(0, count, AT_ONCE):
        network = network_by(mission, places, np.arange(begin, min(begin + AT_ONCE, count)))
        bounds.append(_bounds_of(network, question))
    return np.concatenate(bounds, axis=1)


def _bounds_of(network: Network, question: Question) -> Floats:
    """By route with a rest of a network: `_bounds_s`."""
    bound_s = hover_bounds_s(stacked(network), question.perspective)[1:, 0]
    return np.concatenate([bound_s[None], _figures_s(network)])


def _figures_s(network: Network) -> Floats:
    """By route with a rest: what charge promises, and how short the flight is, by order [s].

    That is minus the flight time of rest first and of hover first; −∞ of the other order, and of
    routes that cannot be flown.
    """
    routes = network.routes
    promised_s, short_s = by_balance(network)[0], -routes.flight_time_s
    by_order = [np.where(routes.rest_first == first, short_s, -np.inf) for first in (True, False)]
    return np.where(routes.flyable, [promised_s, *by_order], -np.inf)[:, 1:]


def fewer(network: Network, columns: Columns, question: Question) -> Network | None:
    """Routes that give `best_of_few` most plans of such variants; None without any."""
    mission, places, size = network.mission, network.places, FIRST // 2
    known = question.perspective == AVAILABLE and mission.battery.charging == "constant"
    known = known and flight_of(mission).least(0.0) is not None
    if not known or question.problem != P1() or not takes_arrays(mission, question):
        return None
    away_m = norm(tuple((places.position_m - places.position_m[HOVER])[FIRST_BUILDING:].T))
    likely = np.argsort(-hover_bounds_s(stacked(network), AVAILABLE)[1:, 0], kind="stable") // 2
    while 4 * size <= len(away_m):
        chosen = np.union1d(likely[: 2 * size], np.argsort(away_m, kind="stable")[:size])
        few = Variants(network_by(mission, places, chosen), columns)
        if np.mean(_open(few, best_plans(few, question).hover_time_s)) <= RARE:
            return few.network
        size *= 4
    return None


def best_of_few(variants: Variants, network: Network, question: Question) -> Best:
    """The plans that `best_plans` finds on a whole network, for variants of few of its routes.

    Those that the few do not decide are found on all routes.
    """
    routes = variants.network.routes
    plans = {name: np.array(each) for name, each in vars(best_plans(variants, question)).items()}
    number = np.where(routes.building < 0, 0, 2 * routes.building + 2 - routes.rest_first)
    plans["route"] = np.append(number, -1)[plans["route"]]
    (left,) = np.nonzero(_open(variants, plans["hover_time_s"]))
    at_once = 1 + variants.count * len(routes) // len(network.routes)
    for some in np.split(left, range(at_once, len(left), at_once)):
        batch = Variants(network, {key: values[some] for key, values in variants.columns.items()})
        for name, values in vars(best_plans(batch, question)).items() if len(some) else ():
            plans[name][some] = values
    return Best(**plans)


def _open(variants: Variants, hover_s: Floats) -> Booleans:
    """Variants where other buildings may give a plan as good as the best of these routes.

    No rest leaves more than full wells (`optuav.physics.kibam`), so the available well must not be
    empty after the flight to the hover point, the hover and the next flight, if both wells are full
    before. Where it falls all along, longer hovers and flights leave less; the leg between roof
    and hover point counts its charge at the least that any such leg draws.
    """
    mission, table = variants.mission, figures(variants)
    pool, hover_m = vehicle.pool(mission), variants.position_m[:, [HOVER]]
    roofs_m = np.delete(mission.buildings.roof_m, variants.network.routes.building[1:], axis=0)
    x, y, z = np.moveaxis(hover_m - roofs_m, -1, 0)
    nearest_m = np.sqrt((x * x + y * y + z * z).min(axis=1, keepdims=True))
    loads = flight_of(mission).least(nearest_m)
    assert loads is not None
    leg = gentlest(pool, loads.charge_As, loads.least_current_A)
    hover = Stage(-table.hover_current_A, hover_s[:, None] - SLACK_S)
    to_hover, from_hover = (
        [Shift(*(part[:, [number]] for part in shift)) for shift in variants.shifts]
        for number in (0, 1)
    )
    falls = falls_throughout(pool, hover.current_A)
    ways: list[tuple[Tilted, list[Stage | Shift]]] = [
        (start(pool), [leg, hover, *from_hover]),
        (vehicle.start(mission), [*to_hover, hover, leg]),
    ]
    ends = [tilted_after(pool, begin, *way).wells(pool).available_As for begin, way in ways]
    short = np.maximum(*ends) < -SHORT * pool.capacity_As
    decided = (short & falls & variants.falls_in_flight)[:, 0]
    return np.asarray(~decided & (impossible(variants) == 0))
