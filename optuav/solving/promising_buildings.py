"""The routes that may be the best past many buildings, of a mission or of each of its variants."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from formulations.p1 import P1
from formulations.p3 import P3
from formulations.soc import AVAILABLE, PAPER
from optuav.arrays import Booleans, Floats, Integers
from optuav.engines.registry import AUTO
from optuav.flight.model import BENT
from optuav.mission import Mission
from optuav.network import vehicle
from optuav.network.legs import NO_LEG, Legs, build_legs
from optuav.network.network import Network, build_network, network_by
from optuav.network.obstacles import CLEAR
from optuav.network.places import FIRST_BUILDING, HOVER, Places, build_places
from optuav.network.prisms import prisms
from optuav.network.routes import build_routes
from optuav.network.variants import Columns, Variants, as_variants
from optuav.options import Perspective
from optuav.physics.flight import Loads
from optuav.physics.kibam import (
    Shift,
    Stage,
    Tilted,
    falls_throughout,
    gentlest,
    start,
    tilted_after,
)
from optuav.physics.quantity import Quantity, Vector, norm
from optuav.solving.assemble import route_quantities
from optuav.solving.balance import Balance, affine_charge, by_balance, longest_by_balance
from optuav.solving.best_plans import (
    SLACK_S,
    BestPlans,
    best_plans,
    hover_bounds_s,
    impossible,
    takes_arrays,
)
from optuav.solving.question import Question

BUILDINGS_AT_ONCE = 1 << 12
"""Buildings that are bounded or solved together: their legs stay in the cache."""
BOUNDED = 1 << 17  # Pairs of variants and buildings that are bounded together
SHARE = 0.5  # Largest share of open buildings for which not all are solved
FIRST_ROUTES, MOST_ROUTES = 50, 20_000  # Routes that are solved first, and at most
FIRST_BENT = 4  # Routes whose legs are bent first
MANY_BUILDINGS = (
    1000  # Buildings of a mission from which on each variant is solved over the open ones only
)
RARE = 0.1  # Share of variants that the routes tried first may leave open
SHORT = 1e-9  # Share of the capacity that brackets and rounding may take from an empty well


def promising_network(mission: Mission, question: Question) -> Network | None:
    """The network of all routes that may be the best, or that the plan's notes or reasons mention.

    Its plan, or reasons for none, also hold for all routes. None if any route may be the best.
    """
    problem, names = question.problem, mission.buildings.names
    if question.several or question.p1.hover_point != "w_U":
        return None
    places = build_places(mission)
    if isinstance(problem, P3) or problem.trajectory == "direct":
        return network_by(mission, places, np.zeros(0, dtype=np.intp))
    if problem.building is not None:
        return network_by(mission, places, np.array([names.index(problem.building)]))
    turns = mission.battery.takes_turns and question.perspective == AVAILABLE
    alike = question.engine == AUTO and question.slot_s is None
    if problem != P1() or question.perspective not in (*PAPER, AVAILABLE) or turns or not alike:
        return None
    if mission.flight.obstacle_rule in BENT:
        if not mission.flight_model.straight_is_least:
            return None  # Straight legs bound no bent ones
        if len(names) <= BUILDINGS_AT_ONCE:
            return _past_bent(mission, question, places)
    # Walls forbid routes and make none better: only the legs to the best roofs are tried.
    clear = mission.replace({"flight.obstacles": "ignore"})
    bounds_s, size = _bounds_s(clear, question, places), FIRST_ROUTES
    to_hover, from_hover = network_by(mission, places, np.arange(0)).legs.flyable
    if not from_hover:
        bounds_s[:, 0::2] = -np.inf  # Rest first
    if not to_hover:
        bounds_s[:, 1::2] = -np.inf
    while size <= MOST_ROUTES:
        last = min(size, bounds_s.shape[1] - 1)
        best = [np.argpartition(-bound_s, last)[:size] for bound_s in bounds_s]
        chosen = np.unique(np.concatenate(best) // 2)
        network = network_by(mission, places, chosen)
        open_ = _open_routes(bounds_s, _found_s(network, question))
        if np.isin(np.flatnonzero(open_.any(axis=0)) // 2, chosen).all():
            return network
        size *= 4
    return None


def _past_bent(mission: Mission, question: Question, places: Places) -> Network:
    """`promising_network` where legs are bent, which takes long: only those in question are.

    Until it is bent, a leg counts as if nothing were in the way: bent, it costs no less.
    """
    every, obstacles = np.arange(len(mission.buildings)), prisms(mission.buildings)
    legs = network_by(mission.replace({"flight.obstacles": "refuse"}), places, every).legs
    is_clear = legs.crosses == CLEAR
    legs = replace(legs, flyable=np.asarray(np.isfinite(legs.durations_s).all(axis=0)))
    back = np.arange(len(is_clear))  # The leg along the same line, which is bent at the same time
    back[3::4], back[4::4] = back[4::4], back[3::4].copy()

    def bent(legs: Legs, wanted: Integers) -> Legs:
        """The legs, some of them past the buildings if they are not yet."""
        new = np.union1d(wanted, back[wanted])
        if not len(new := new[~is_clear[new]]):
            return legs
        is_clear[new] = True
        ends = legs.start[new], legs.end[new]
        return legs.put(new, build_legs(mission, places, obstacles, *ends))

    found_s, tried, size = np.full(4, -np.inf), np.zeros(1 + 2 * len(every), bool), FIRST_BENT
    wanted = np.array([0, 1])
    while True:
        legs = bent(legs, wanted)
        routes = build_routes(legs, every)
        whole = (is_clear[routes.legs] | (routes.legs == NO_LEG)).all(axis=1)
        fresh = np.append(0, 1 + np.flatnonzero(whole[1:] & ~tried[1:]))
        network, tried = Network(mission, places, legs, routes), whole
        of_fresh = replace(network, routes=routes.take(fresh))
        found_s = np.maximum(found_s, _found_s(of_fresh, question))
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
    return Network(mission, places, legs, build_routes(legs, chosen))


def _found_s(network: Network, question: Question) -> Floats:
    """The best hover, at least 0, and the best `_figures_s`, of the routes of a network [s]."""
    hover_s = best_plans(as_variants(network), question).hover_time_s[0]
    promised_s, *flights_s = _figures_s(network).max(axis=1, initial=-np.inf)
    return np.array([np.fmax(hover_s, 0.0), max(promised_s, 0.0), *flights_s])


def _open_routes(bounds_s: Floats, found_s: Floats) -> Booleans:
    """Routes that may be as good as those found, by kind of bound."""
    return np.asarray((bounds_s >= found_s[:, None] - SLACK_S) & (bounds_s > -np.inf))


def _bounds_s(mission: Mission, question: Question, places: Places) -> Floats:
    """By route with a rest: what no Δ exceeds [s], and the figures of `_figures_s`."""
    count, bounds = len(mission.buildings), list[Floats]()
    for begin in range(0, count, BUILDINGS_AT_ONCE):
        network = network_by(
            mission, places, np.arange(begin, min(begin + BUILDINGS_AT_ONCE, count))
        )
        bounds.append(_bounds_of(network, question))
    return np.concatenate(bounds, axis=1)


def _bounds_of(network: Network, question: Question) -> Floats:
    """By route with a rest of a network: `_bounds_s`."""
    bound_s = hover_bounds_s(as_variants(network), question.perspective)[1:, 0]
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


def few_near(mission: Mission, places: Places, size: int, *others: int) -> Network:
    """The network of some buildings, and as many as stated that are nearest to the hover point."""
    away_m = norm(tuple((places.position_m - places.position_m[HOVER])[FIRST_BUILDING:].T))
    nearest = np.argsort(away_m, kind="stable")[:size]
    return _network_of(mission, places, np.union1d(nearest, np.array(others, dtype=np.intp)))


def promising_subset(network: Network, columns: Columns, question: Question) -> Network | None:
    """Routes that give `best_plans_or_all` most plans of such variants at once.

    Without variants to try them on, those near the hover point; None in smaller missions.
    """
    mission, places, size, few = network.mission, network.places, FIRST_ROUTES // 2, None
    buildings = len(mission.buildings)
    if question.perspective != AVAILABLE or not takes_few(mission, question):
        return None
    if not columns or mission.flight_model.least(0.0) is None:
        return few_near(mission, places, FIRST_ROUTES) if buildings >= MANY_BUILDINGS else None
    likely = np.argsort(-hover_bounds_s(as_variants(network), AVAILABLE)[1:, 0], kind="stable") // 2
    while 4 * size <= buildings:
        tried = few_near(mission, places, size, *likely[: 2 * size].tolist())
        variants = Variants(tried, columns)
        if np.mean(_open(variants, best_plans(variants, question).hover_time_s, AVAILABLE)) <= RARE:
            return tried
        few = few or tried
        size *= 4
    return few if buildings >= MANY_BUILDINGS else None


def takes_few(mission: Mission, question: Question) -> bool:
    """Return whether `best_plans_or_all` answers a question."""
    by_wells_or_charge = question.perspective in (AVAILABLE, "battery") and question.problem == P1()
    constant = mission.battery.charging == "constant"
    return by_wells_or_charge and constant and takes_arrays(mission, question)


def best_plans_or_all(variants: Variants, places: Places, question: Question) -> BestPlans:
    """The plans that `best_plans` finds over all places, for variants of few of their routes.

    Variants that the few do not decide are solved over more of the buildings that bounds leave
    open, the nearest first, until no other is; and over all buildings where bounds leave most of
    them open, or there is no plan, for its reason.
    """
    network, columns, plans = variants.network, variants.columns, _numbered(variants, question)
    mission, longest_s = network.mission, plans["hover_time_s"].copy()
    count, direct = len(mission.buildings), network.only([0])

    def solve(over: Network, some: Integers) -> None:
        """Solve some variants over a network, in place of what they have."""
        for name, values in _numbered(Variants(over, _rows(columns, some)), question).items():
            plans[name][some] = values
        longest_s[some] = np.fmax(longest_s[some], plans["hover_time_s"][some])

    (undecided,) = np.nonzero(_open(variants, longest_s, question.perspective))
    planned = np.isfinite(longest_s[undecided])
    over_all = [undecided[~planned]]
    for some in _in_turn(undecided[planned], 1 + BOUNDED // count):
        left, size, solved = some, 2 * FIRST_ROUTES, np.zeros((len(some), count), bool)
        solved[:, network.routes.building[1:]] = True
        while len(left):
            batch = Variants(direct, _rows(columns, left))
            open_ = _possibly_as_good(batch, longest_s[left], question.perspective)
            most = open_.sum(axis=1) > SHARE * count
            over_all.append(left[most])
            more = (open_ & ~solved).any(axis=1) & ~most
            away_m = np.broadcast_to(_away_m(batch, mission.buildings.roof_m), open_.shape)
            left, solved = left[more], _nearest(open_[more], away_m[more], size)
            for members, buildings in _together(solved):
                solve(_network_of(mission, places, buildings), left[members])
            size *= 4
    for some in _in_turn(np.concatenate(over_all), 1 + BOUNDED // (2 * count)):
        solve(build_network(mission), some)
    return BestPlans(**plans)


def _nearest(open_: Booleans, away_m: Floats, size: int) -> Booleans:
    """So many of the open buildings in each row, the nearest (variant, building)."""
    if size >= open_.shape[1]:
        return open_
    far_m = np.partition(np.where(open_, away_m, np.inf), size - 1, axis=1)[:, [size - 1]]
    return np.asarray(open_ & (away_m <= far_m))


def _rows(columns: Columns, some: Integers) -> Columns:
    """Columns of some variants."""
    return {key: values[some] for key, values in columns.items()}


def _in_turn(numbers: Integers, at_once: int) -> Iterator[Integers]:
    """Numbers, so many at a time."""
    return (numbers[k : k + at_once] for k in range(0, len(numbers), at_once))


def _network_of(mission: Mission, places: Places, buildings: Integers) -> Network:
    """The network of only some buildings, by number, and of no other places.

    For variants, which find what stands in the way of their legs by themselves.
    """
    clear = mission.replace({"flight.obstacles": "ignore"})
    network = network_by(clear, places, np.sort(buildings))
    return replace(network.only(np.arange(len(network.routes))), mission=mission)


def _numbered(variants: Variants, question: Question) -> dict[str, Any]:
    """The best plans of variants of few routes, with the numbers that those have among all."""
    routes = variants.network.routes
    plans = {
        name: np.array(values) for name, values in vars(best_plans(variants, question)).items()
    }
    number = np.where(routes.building < 0, 0, 2 * routes.building + 2 - routes.rest_first)
    plans["route"] = np.append(number, -1)[plans["route"]]
    return plans


def _together(open_: Booleans) -> Iterator[tuple[list[int], Integers]]:
    """Variants that are solved together, by number, and the buildings that are open to any."""
    members, union = list[int](), np.zeros(open_.shape[1], bool)
    for number in np.argsort(open_.sum(axis=1), kind="stable").tolist():
        wider = union | open_[number]
        if members and (1 + len(members)) * np.count_nonzero(wider) > BUILDINGS_AT_ONCE:
            yield members, np.flatnonzero(union)
            members, wider = [], open_[number]
        members, union = [*members, number], wider
    if members:
        yield members, np.flatnonzero(union)


def _away_m(variants: Variants, roofs_m: Floats) -> Floats:
    """Distances of roofs (roof, 3) [m] from the hover point (variant or 1, roof) [m]."""
    x, y, z = np.moveaxis(variants.position_m[:, [HOVER]] - roofs_m, -1, 0)
    return np.asarray(norm((x, y, z)))


def _open(variants: Variants, hover_s: Floats, perspective: Perspective) -> Booleans:
    """Variants where other buildings may give a plan as good as the best of these routes."""
    mission, possible = variants.mission, impossible(variants) == 0
    roofs_m = np.delete(mission.buildings.roof_m, variants.network.routes.building[1:], axis=0)
    leg = mission.flight_model.least(_away_m(variants, roofs_m).min(axis=1, keepdims=True))
    if perspective != AVAILABLE or leg is None:
        return np.asarray(possible)
    after, before = _through_wells(variants, hover_s, leg, leg)
    return np.asarray(possible & (after | before)[:, 0])


@np.errstate(divide="ignore", invalid="ignore", over="ignore")
def _possibly_as_good(variants: Variants, hover_s: Floats, perspective: Perspective) -> Booleans:
    """Where a rest may give a plan as good as some hovers [s] (variant, building).

    By charge and time, and through the wells, as if nothing stood in the way of legs and light.
    """
    mission, table, flight = (
        variants.mission,
        route_quantities(variants),
        variants.mission.flight_model,
    )
    roofs_m, wells = mission.buildings.roof_m, perspective == AVAILABLE
    open_ = np.ones((variants.count, len(roofs_m)), bool)
    if wells and (leg := flight.least(_away_m(variants, roofs_m))) is not None:
        after, before = _through_wells(variants, hover_s, leg, leg)
        open_ &= after | before
    (some,) = np.nonzero(open_.any(axis=0))
    roof_m = tuple(roofs_m[some].T[:, None])
    ends_m = np.moveaxis(variants.position_m[:, :FIRST_BUILDING, None], (1, 3), (0, 1))
    origin, hover, destination = (_way(end_m, roof_m) for end_m in ends_m)
    from_origin, to_roof = flight.leg(origin), flight.leg(hover)
    from_roof, to_destination = flight.leg(_back(hover)), flight.leg(_back(destination))
    kept = [np.ones((1, 1), bool)] * 2
    if wells:
        kept = [*_through_wells(variants, hover_s, from_roof, to_roof)]
    received, drawn = vehicle.charging(mission, roof_m), flight.rest()
    may = np.zeros((variants.count, len(some)), bool)
    orders = ((from_origin, from_roof), 1), ((to_roof, to_destination), 0)
    for ((one, other), shared), by_wells in zip(orders, kept, strict=True):
        shared_s, shared_As, _ = (figures[:, [shared]] for figures in variants.of_legs)
        given = replace(
            table,
            flight_time_s=shared_s + one.duration_s + other.duration_s,
            flight_charge_As=shared_As + one.charge_As + other.charge_As,
            rest_current_A=received.current_A - drawn.current_A,
        )
        routes = Balance(*affine_charge(given, "battery"), given.time_left)
        may |= by_wells & (longest_by_balance(routes) >= hover_s[:, None] - SLACK_S)
    open_[:, some] &= may
    return open_


def _way(start_m: Sequence[Quantity], end_m: Sequence[Quantity]) -> Vector:
    """The way from one place to another [m]."""
    x, y, z = (end - start for start, end in zip(start_m, end_m, strict=True))
    return x, y, z


def _back(way_m: Vector) -> Vector:
    """The way back [m]."""
    x, y, z = way_m
    return -x, -y, -z


def _through_wells(
    variants: Variants, hover_s: Floats, from_roof: Loads, to_roof: Loads
) -> tuple[Booleans, Booleans]:
    """Where the wells may allow hovers [s] after a rest, and before one (variant, roof).

    No rest leaves more than full wells (`optuav.physics.kibam`), so the available well must not be
    empty after the flight to the hover point, the hover and the next flight, if both wells are full
    before. Where it falls all along, longer hovers and flights leave less; the leg between roof
    and hover point counts its charge only.
    """
    mission, table = variants.mission, route_quantities(variants)
    pool = mission.pool
    hover = Stage(-table.hover_current_A, hover_s[:, None] - SLACK_S)
    falls = falls_throughout(pool, hover.current_A) & variants.falls_in_flight
    back, there = (
        gentlest(pool, loads.charge_As, loads.least_current_A) for loads in (from_roof, to_roof)
    )
    to_hover, from_hover = (
        [Shift(*(part[:, [number]] for part in shift)) for shift in variants.shifts]
        for number in (0, 1)
    )
    ways: list[tuple[Tilted, list[Stage | Shift]]] = [
        (start(pool), [back, hover, *from_hover]),
        (vehicle.start(mission), [*to_hover, hover, there]),
    ]
    ends = [tilted_after(pool, begin, *way).wells(pool).available_As for begin, way in ways]
    after, before = (~(falls & (end < -SHORT * pool.capacity_As)) for end in ends)
    return after, before
