"""The declarations of a question over the routes of a mission, or over variants of it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from formulations.formulation import Formulation
from formulations.p3 import P3
from formulations.soc import PAPER
from optuav.arrays import Booleans, Integers, Values
from optuav.modelling import Model
from optuav.network.places import FIRST_BUILDING
from optuav.network.routes import Routes
from optuav.network.variants import Variants
from optuav.solving.assemble import quantities
from optuav.solving.question import Question
from optuav.status import SAME_S


@dataclass(frozen=True)
class RouteModel:
    """One declaration that serves several itineraries."""

    declared: Model  # Parts of a kind share it
    routes: Integers  # Numbers of the itineraries
    # Values of parameters unlike the declared ones; arrays with one entry per itinerary
    given: Values = field(default_factory=dict)

    @cached_property
    def model(self) -> Model:
        """The declaration with the values of its parameters; changes to it are solved."""
        return self.declared.with_values(self.given) if self.given else self.declared

    @property
    def was_exposed(self) -> bool:
        """True if somebody asked for the model, and may have changed it."""
        return "model" in vars(self)

    @cached_property
    def unknowns(self) -> frozenset[str]:
        """Names of the unknowns."""
        return frozenset(variable.name for variable in self.declared.variables)

    @property
    def rests(self) -> bool:
        """True if the declaration has a rest time."""
        return "rest_time_s" in self.unknowns


def permitted_routes(
    variants: Variants, problem: Formulation, possible: Booleans | None = None
) -> Booleans:
    """Return which flyable routes a problem may take in every variant (variant or 1, route).

    No route in variants that are not `possible` (variant,).
    """
    network, routes, able = variants.network, variants.network.routes, variants.able
    rests, trajectory = routes.building >= 0, problem.trajectory
    if possible is not None and not possible.all():
        able = able & possible[:, None]
    if problem.building is not None:
        number = network.mission.buildings.names.index(problem.building)
        able = able & (routes.building == number)
    if problem.order is not None:
        able = able & (~rests | routes.in_order(problem.order))
    if isinstance(problem, P3) or trajectory == "direct":
        able = able & ~rests
    elif trajectory in ("traj1", "traj2"):
        able = able & rests
    if trajectory == "traj1" and rests.any():  # By the building nearest the device
        nearest = variants.device_distance_m(slice(FIRST_BUILDING, None)).argmin(axis=1)
        able = able & (routes.building == nearest[:, None])
    elif trajectory == "traj2":  # The shortest in time, or several that tie
        times_s = np.where(able, variants.flight[0], np.inf)
        able = able & (times_s <= times_s.min(axis=1, keepdims=True) + SAME_S)
    return able


def routes_by_kind(
    routes: Routes,
    which: Integers,
    *,
    ordered: bool,
    passing: bool = False,
    shares: Sequence[float] = (),
) -> Iterator[tuple[Integers, bool]]:
    """Positions in `which` of the routes that one declaration serves, and whether they may rest.

    Routes in a group stay in the same order, for the same shares of several devices, if the order
    matters, as it does through the wells and for a reserve at every landing.
    Routes by way of a building may also pass it by, without a rest.
    """
    by_way, after = routes.building[which] >= 0, routes.rest_after[which]
    for kind, rests in (by_way if passing else ~by_way, False), (by_way, True):
        orders = (kind & (after == k) for k in range(routes.devices.shape[1] + 1))
        for alike in orders if ordered else (kind,):
            if len(group := alike.nonzero()[0]):
                alike_in = shares if ordered else ()
                groups = by_shares(routes.devices[which[group]], alike_in)
                yield from ((group[same], rests) for same in groups)


def by_shares(devices: Integers, shares: Sequence[float]) -> Iterator[Any]:
    """Positions of routes that hover for the same shares one after the other."""
    if len({*shares}) < 2:
        yield ...
        return
    in_order = np.array(shares)[devices]
    _, kind = np.unique(in_order, axis=0, return_inverse=True)
    for number in range(kind.max() + 1):
        yield kind.ravel() == number


def declarations(
    question: Question, variants: Variants, able: Booleans
) -> Iterator[tuple[RouteModel, Integers]]:
    """The declarations that serve all itineraries that can be flown, with their variants."""
    problem, through_wells = question.problem, question.perspective not in PAPER
    # A rest takes at least one slot, so to pass a building by is a choice of its own.
    passing = question.slot_s is not None and problem.trajectory in ("traj1", "traj2")
    ordered = through_wells or variants.mission.limits.keep_soc == "always"
    variant, route = np.broadcast_to(able, (variants.count, able.shape[1])).nonzero()
    shares = [device.share for device in variants.mission.served]
    for group, rests in routes_by_kind(
        variants.network.routes, route, ordered=ordered, passing=passing, shares=shares
    ):
        which, variants_in = route[group], variant[group]
        table = quantities(variants, which, variants_in, rests=rests, steps=through_wells)
        model, values = problem.declared(table, question.perspective)
        part = RouteModel(model, which, values)
        if part.rests == rests:  # else the problem has no use for the rests of these routes
            yield part, variants_in
