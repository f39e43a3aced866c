"""Many variants of a mission at once: its quantities as tables, and the longest hover of each.

A table has one row a variant and one column a leg, a place or an itinerary; what is the same in all
variants has a single row. Buildings stay where they are.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import NamedTuple, Self

import numpy as np

from formulations.p1 import P1
from formulations.perspectives import AVAILABLE
from formulations.quantities import Quantities, steps_for
from optuav.arrays import Booleans, Floats, Integers
from optuav.engines import closed_form
from optuav.mission import Mission
from optuav.modelling import Model
from optuav.network import vehicle
from optuav.network.network import Network, build_network
from optuav.network.obstacles import CLEAR, MARGIN_M, Prisms, crossed, prisms
from optuav.network.places import FIRST_BUILDING, HOVER
from optuav.network.routes import NO_LEG
from optuav.options import Perspective
from optuav.physics.flight import Loads
from optuav.physics.kibam import Stage
from optuav.physics.quantity import Quantity, Vector, norm
from optuav.solving.delivered import delivered
from optuav.solving.given import mean_voltage_V
from optuav.solving.ties import SAME_S

Columns = Mapping[str, Floats]
"""Values by key, ``"link.device_m[0]"`` for a component; one entry a variant."""

KEY = re.compile(r"(\w+)\.(\w+)(?:\[([012])\])?")
ENERGIES = ("flight_energy_J", "hover_energy_J")
NO_ROUTE = -1
FEW = 256
"""Lines of a bundle that are tried one by one rather than as a bundle."""


def with_columns(mission: Mission, columns: Columns) -> Mission:
    """Return the mission with columns in place of numbers: for formulas, and not validated.

    As in `Mission.replace`, stated energies of the full battery are dropped if its size varies.
    """
    tables: dict[str, dict[str, object]] = {}
    for key, values in columns.items():
        found = KEY.fullmatch(key)
        assert found is not None, key
        table, name, axis = found.groups()
        changed = tables.setdefault(table, {})
        column = np.asarray(values, dtype=float)[:, None]
        if axis is None:
            changed[name] = column
            continue
        vector = list(getattr(getattr(mission, table), name))
        here = changed.setdefault(name, vector)
        assert isinstance(here, list)
        here[int(axis)] = column
    if {"packs", "capacity_As"} & tables.get("battery", {}).keys():
        tables["battery"] = dict.fromkeys(ENERGIES) | tables["battery"]
    changes = {
        table: getattr(mission, table).model_copy(update=changed)
        for table, changed in tables.items()
    }
    return mission.model_copy(update=changes)


@dataclass(frozen=True)
class Base:
    """The mission that varies, with what is the same in all its variants.

    Parameters
    ----------
    network
        Places, legs and itineraries of the mission.
    obstacles
        Its buildings.
    """

    network: Network
    obstacles: Prisms

    @classmethod
    def of(cls, mission: Mission) -> Self:
        """Return a mission with all its itineraries."""
        return cls(build_network(mission), prisms(mission))

    def only(self, itinerary: int) -> Self:
        """Return the same with a single itinerary, number 0, and the legs that it uses."""
        route, table = self.network.routes.take([itinerary]), self.network.legs
        flown = route.legs != NO_LEG
        used = route.legs[flown]
        legs = replace(
            table, **{each.name: getattr(table, each.name)[..., used] for each in fields(table)}
        )
        route = replace(route, legs=np.where(flown, np.cumsum(flown) - 1, NO_LEG))
        return replace(self, network=replace(self.network, legs=legs, routes=route))


@dataclass(frozen=True)
class Variants:
    """Variants of a mission.

    Parameters
    ----------
    base
        The mission that varies.
    columns
        What varies.
    known_radius_m
        Their coverage radius (variant, 1) [m] if it is known.
    """

    base: Base
    columns: Columns
    known_radius_m: Quantity = None

    @cached_property
    def count(self) -> int:
        """Number of variants."""
        return len(next(iter(self.columns.values())))

    @cached_property
    def mission(self) -> Mission:
        """The mission with columns in place of numbers."""
        return with_columns(self.base.network.mission, self.columns)

    @cached_property
    def coverage_radius_m(self) -> Quantity:
        """d_max (variant, 1) or a number [m]."""
        known_m = self.known_radius_m
        return vehicle.coverage_radius_m(self.mission) if known_m is None else known_m

    @cached_property
    def position_m(self) -> Floats:
        """Places (variant or 1, place, 3) [m]; NaN for a hover point out of reach."""
        route = self.mission.route
        hover_m = vehicle.hover_point_m(self.mission, self.coverage_radius_m)
        roofs_m = self.base.network.places.position_m[None, FIRST_BUILDING:]
        ends_m = map(_points, (route.origin_m, hover_m, route.destination_m))
        return _side_by_side(*ends_m, roofs_m)

    @cached_property
    def received(self) -> vehicle.Flow:
        """Current [A] and power [W] from the laser by place (variant or 1, place)."""
        places = self.position_m.shape[1]
        if self.mission.laser is None:
            return vehicle.Flow(np.zeros((1, places)), np.zeros((1, places)))
        laser_m = _points(self.mission.laser.position_m)
        number = np.arange(places)
        lines = np.stack([np.full(places, places), number], axis=1)
        exempt = np.maximum(number - FIRST_BUILDING, CLEAR)[:, None]
        lit_m = _side_by_side(self.position_m, laser_m)
        sight = clear(self.base.obstacles, lit_m, lines, exempt)
        distance_m = norm(tuple(np.moveaxis(self.position_m - laser_m, -1, 0)))
        load = vehicle.charging(self.mission, distance_m)
        return vehicle.Flow(*(np.where(sight, _table(each), 0.0) for each in load))

    @cached_property
    def flyable(self) -> Booleans:
        """Whether all legs of an itinerary can be flown and cross no building."""
        able = np.isfinite(_table(self._loads.duration_s))
        if not self.mission.flight.through_buildings:
            legs = self.base.network.legs
            ends = np.sort(np.stack([legs.start, legs.end], axis=1), axis=1)
            lines, line = np.unique(ends, axis=0, return_inverse=True)
            free = clear(self.base.obstacles, self.position_m, lines, lines - FIRST_BUILDING)
            able = able & free[:, line]
        able = np.concatenate([able, np.ones((len(able), 1), bool)], axis=1)  # for NO_LEG
        return np.asarray(able[:, self.base.network.routes.legs].all(axis=2))

    @cached_property
    def able(self) -> Booleans:
        """Whether an itinerary can be flown, and its hover point held (variant or 1, itinerary)."""
        return np.asarray(self.flyable & np.isfinite(self.hover_load.current_A))

    @cached_property
    def flight_time_s(self) -> Floats:
        """Flight time of itineraries (variant or 1, itinerary) [s]."""
        return self._total(self._loads.duration_s)

    @cached_property
    def flight_charge_As(self) -> Floats:
        """Charge drawn in flight (variant or 1, itinerary) [A s]."""
        return self._total(self._loads.charge_As)

    @cached_property
    def flight_energy_J(self) -> Floats:
        """Energy drawn in flight (variant or 1, itinerary) [J]."""
        return self._total(self._loads.energy_J)

    @cached_property
    def hover_load(self) -> vehicle.Flow:
        """Drawn while hovering, radio included (variant or 1, 1)."""
        return vehicle.Flow(*map(_table, vehicle.hover_load(self.mission)))

    @cached_property
    def rest_load(self) -> vehicle.Flow:
        """Net current [A] and power [W] into the battery while resting, by itinerary."""
        building = self.base.network.routes.building
        return vehicle.Flow(
            *(
                np.where(building >= 0, received[:, FIRST_BUILDING + building] - drawn, 0.0)
                for received, drawn in zip(
                    self.received, vehicle.rest_load(self.mission), strict=True
                )
            )
        )

    @cached_property
    def _loads(self) -> Loads:
        legs = self.base.network.legs
        way_m = self.position_m[:, legs.end] - self.position_m[:, legs.start]
        x, y, z = np.moveaxis(way_m, -1, 0)
        return vehicle.leg_loads(self.mission, (x, y, z))[0]

    def _total(self, per_leg: Quantity) -> Floats:
        """Return sums over the legs of itineraries."""
        table = _table(per_leg)
        padded = np.concatenate([table, np.zeros((len(table), 1))], axis=1)
        first, *others = (padded[:, legs] for legs in self.base.network.routes.legs.T)
        return sum(others, first)

    def quantities(
        self, variants: Integers, itineraries: Integers, *, rests: bool, steps: bool = False
    ) -> Quantities:
        """Return the quantities of pairs of a variant and an itinerary, one entry a pair.

        Parameters
        ----------
        variants, itineraries
            Numbers (pair,); all itineraries direct, or all by way of a building.
        rests
            Whether a rest on the building may be chosen.
        steps
            Whether to include the steps on the way, which need all itineraries in one order.
        """
        battery, limits = self.mission.battery, self.mission.limits

        def take(values: Quantity) -> Quantity:
            return _taken(_table(values), variants, itineraries)

        def full_J(key: str, voltage_V: Quantity) -> Quantity:
            """Return what the full battery holds; computed if its stated energy was dropped."""
            stated_J = getattr(battery, key)
            if stated_J is not None:
                return take(stated_J)
            if getattr(self.base.network.mission.battery, key) is None:
                return None
            return take(battery.packs) * take(battery.capacity_As) * voltage_V

        nominal_V = take(battery.nominal_voltage_V)
        hover, hover_m = self.hover_load, self.position_m[:, HOVER]
        apart_m = hover_m - _points(self.mission.link.device_m)[:, 0]
        at_hover = vehicle.Flow(*(each[:, [HOVER]] for each in self.received))
        flight_J, flight_As = take(self.flight_energy_J), take(self.flight_charge_As)
        flight_V = mean_voltage_V(flight_J, flight_As, nominal_V)
        hover_V = mean_voltage_V(take(hover.power_W), take(hover.current_A), nominal_V)
        return Quantities(
            deadline_s=take(limits.deadline_s),
            min_soc=take(limits.min_soc),
            packs=take(battery.packs),
            capacity_As=take(battery.capacity_As),
            nominal_voltage_V=nominal_V,
            flight_time_s=take(self.flight_time_s),
            flight_charge_As=flight_As,
            flight_energy_J=flight_J,
            hover_current_A=take(hover.current_A - at_hover.current_A),
            hover_power_W=take(hover.power_W),
            hover_received_W=take(at_hover.power_W),
            rest_current_A=take(self.rest_load.current_A),
            rest_received_W=take(self.rest_load.power_W),
            flight_voltage_V=flight_V,
            hover_voltage_V=hover_V,
            flight_battery_J=full_J("flight_energy_J", flight_V),
            hover_battery_J=full_J("hover_energy_J", hover_V),
            available_fraction=take(battery.available_fraction),
            flow_rate_per_s=take(battery.flow_rate_per_s),
            hover_distance_m=take(np.sqrt((apart_m**2).sum(axis=-1, keepdims=True))),
            coverage_radius_m=take(self.coverage_radius_m),
            hover_altitude_m=take(hover_m[:, 2:]),
            min_altitude_m=take(limits.min_altitude_m),
            max_altitude_m=take(limits.max_altitude_m),
            end_gap_m=0.0,
            steps=self._steps(variants, itineraries, rests) if steps else (),
            tapers=battery.charging == "taper",
            rests=rests,
        )

    def _steps(
        self, variants: Integers, itineraries: Integers, rests: bool
    ) -> tuple[Stage | str, ...]:
        """Return the stages of the legs, and the stays by name."""
        loads, ends = self._loads, self.base.network.legs.end
        every = np.zeros(len(variants))
        found: list[Stage | str] = []
        for legs in self.base.network.routes.legs[itineraries].T:
            if legs[0] == NO_LEG:
                continue
            for duration_s, current_A in zip(loads.durations_s, loads.currents_A, strict=True):
                here = _taken(_table(duration_s), variants, legs)
                drawn = _taken(_table(current_A), variants, legs)
                if np.any(here):
                    found.append(Stage(every - drawn, every + here))
            if ends[legs[0]] == HOVER:
                found.append("hover")
            elif ends[legs[0]] >= FIRST_BUILDING and rests:
                found.append("rest")
        return tuple(found)


def _table(values: Quantity) -> Floats:
    """Return values as a table: a number has one row and one column."""
    return np.reshape(values, (1, 1)) if np.ndim(values) == 0 else np.asarray(values)


def _points(vector: Vector) -> Floats:
    """Return a place with components that are numbers or columns as (variant or 1, 1, 3)."""
    return np.stack(np.broadcast_arrays(*map(_table, vector)), axis=-1)


def _side_by_side(*places_m: Floats) -> Floats:
    """Return tables of places (variant or 1, place, 3) as one."""
    rows = max(map(len, places_m))
    return np.concatenate([np.broadcast_to(m, (rows, *m.shape[1:])) for m in places_m], axis=1)


def _taken(table: Floats, rows: Integers, columns: Integers) -> Quantity:
    """Return entries of a table, or the only one."""
    if table.shape == (1, 1):
        return float(table[0, 0])
    row = rows if table.shape[0] > 1 else np.zeros_like(rows)
    return table[row, columns if table.shape[1] > 1 else 0]


# The longest hover


class Longest(NamedTuple):
    """Hover time [s], NaN without a plan, and itinerary, −1 then; one entry a variant."""

    hover_time_s: Floats
    itinerary: Integers


def longest(variants: Variants, perspective: Perspective) -> Longest:
    """Return the longest hover of each variant over all its itineraries.

    Of itineraries that are as good as the best (to 1e-6 s), it names the first.
    """
    number, itineraries = _candidates(variants, pruned=perspective != AVAILABLE)
    hover_s = _hover_times_s(variants, number, itineraries, perspective)
    best_s = np.full(variants.count, np.nan)
    np.fmax.at(best_s, number, hover_s)
    winner = np.full(variants.count, np.iinfo(np.intp).max)
    tied = hover_s >= best_s[number] - SAME_S
    np.minimum.at(winner, number[tied], itineraries[tied])
    return Longest(best_s, np.where(np.isnan(best_s), NO_ROUTE, winner))


def best_itineraries(variants: Variants, perspective: Perspective) -> Integers:
    """Return the itineraries of a single variant that are as good as the best (to 1e-6 s)."""
    number, itineraries = _candidates(variants, pruned=False)
    hover_s = _hover_times_s(variants, number, itineraries, perspective)
    best_s = np.fmax.reduce(hover_s, initial=-np.inf)
    return np.asarray(itineraries[hover_s >= best_s - SAME_S])


def route_model(variants: Variants, itinerary: int, perspective: Perspective) -> Model:
    """Return (P1) of one itinerary in all variants, with the stages of flight as parameters."""
    every = np.arange(variants.count)
    given = variants.quantities(
        every,
        np.full_like(every, itinerary),
        rests=bool(variants.base.network.routes.building[itinerary] >= 0),
        steps=perspective == AVAILABLE,
    )
    return P1().model(replace(given, steps=steps_for(given.steps, varies=True)), perspective)


def _hover_times_s(
    variants: Variants, number: Integers, itineraries: Integers, perspective: Perspective
) -> Floats:
    """Return the longest hover of pairs of variant and itinerary [s], NaN without a plan."""
    routes = variants.base.network.routes
    by_way, first = routes.building[itineraries] >= 0, routes.rest_first[itineraries]
    groups = [~by_way, by_way]
    if perspective == AVAILABLE:  # which needs one order of the stays for all
        groups = [~by_way, by_way & first, by_way & ~first]
    hover_s = np.full(len(number), np.nan)
    for group in groups:
        count, steps = int(group.sum()), perspective == AVAILABLE
        if not count:
            continue
        rests = bool(by_way[group][0])
        given = variants.quantities(number[group], itineraries[group], rests=rests, steps=steps)
        if steps:
            hover_s[group] = delivered(given, count)["hover_time_s"]
        else:
            hover_s[group] = closed_form.solve(P1().model(given, perspective), count).objective
    return hover_s


def _candidates(variants: Variants, *, pruned: bool) -> tuple[Integers, Integers]:
    """Return pairs of a variant and an itinerary that may be the best of their variant.

    By way of a building, an itinerary is out if another takes no more time, charge and energy in
    flight and charges no less at rest: all constraints that are linear in the times are as easy to
    meet with the other.
    """
    shape = (variants.count, variants.able.shape[1])
    able = np.broadcast_to(variants.able, shape).copy()
    if pruned and shape[1] > 2:
        costs = [
            np.broadcast_to(each, shape)[:, 1:]
            for each in (
                variants.flight_time_s,
                variants.flight_charge_As,
                variants.flight_energy_J,
                -variants.rest_load.current_A,
                -variants.rest_load.power_W,
            )
        ]
        able[:, 1:] &= ~_dominated(costs, able[:, 1:])
    number, itineraries = np.nonzero(able)
    return number, itineraries


def _dominated(costs: list[Floats], able: Booleans) -> Booleans:
    """Return where another column is no worse in all costs; of equal columns the first stays."""
    costs = [np.where(able, each, np.inf) for each in costs]
    out = np.zeros(able.shape, bool)
    number = np.arange(able.shape[1])
    rivals = {rival for cost in costs for rival in np.unique(cost.argmin(axis=1)).tolist()}
    for rival in sorted(rivals):
        no_worse: Booleans = able[:, [rival]] & ~out[:, [rival]]
        better = np.broadcast_to(number > rival, able.shape)
        for cost in costs:
            own = cost[:, [rival]]
            no_worse = no_worse & (own <= cost)
            better = better | (own < cost)
        out |= no_worse & better
    return out


def clear(obstacles: Prisms, position_m: Floats, lines: Integers, exempt: Integers) -> Booleans:
    """Whether lines between places cross no building; False where an end is not known.

    Parameters
    ----------
    obstacles
        The buildings.
    position_m
        Places (variant, place, 3) [m].
    lines
        Numbers of the two places that each line joins (line, 2).
    exempt
        Buildings that do not block a line (line, k), by number; negative for none.

    Returns
    -------
    (variant, line)
    """
    known: Booleans = np.asarray(np.isfinite(position_m).all(axis=2))
    free: Booleans = np.asarray(known[:, lines].all(axis=2))
    stays = (position_m == position_m[:1]).all(axis=(0, 2))
    still = stays[lines].all(axis=1)
    first_m = position_m[0, lines[still]].reshape(-1, 6)
    free[:, still] &= _crossing_none(obstacles, first_m, exempt[still])
    for line in np.flatnonzero(free.any(axis=0) & ~still).tolist():
        (here,) = np.nonzero(free[:, line])
        ends_m = np.concatenate([position_m[here, end].T for end in lines[line]])
        free[here, line] = _bundle(obstacles, ends_m, exempt[line])
    return free


def _bundle(obstacles: Prisms, ends_m: Floats, exempt: Integers) -> Booleans:
    """Whether the lines of a bundle (6, line) are clear: all at once, or in two halves."""
    low, high = ends_m.min(axis=1), ends_m.max(axis=1)
    count = ends_m.shape[1]
    met = _met(obstacles, low, high, exempt)
    if not met.size:
        return np.ones(count, bool)
    if _through_one_wall(obstacles, met, low, high):
        return np.zeros(count, bool)
    if count <= FEW:
        return _crossing_none(obstacles, ends_m.T, np.tile(exempt, (count, 1)))
    order = np.argpartition(ends_m[np.argmax(high - low)], count // 2)
    free = np.empty(count, bool)
    for half in np.array_split(order, 2):
        free[half] = _bundle(obstacles, ends_m[:, half], exempt)
    return free


def _met(obstacles: Prisms, low: Floats, high: Floats, exempt: Integers) -> Integers:
    """Footprints of buildings in the hull of the two boxes that hold the ends of a bundle."""
    import shapely

    hull = shapely.convex_hull(shapely.multipoints(_corners(low, high).reshape(-1, 2)))
    footprint = obstacles.tree.query(hull, predicate="intersects")
    below = obstacles.roof_m[footprint] > min(low[2], low[5])
    exempted = (obstacles.building[footprint, None] == exempt).any(axis=1)
    return np.asarray(footprint[below & ~exempted])


def _through_one_wall(obstacles: Prisms, footprint: Integers, low: Floats, high: Floats) -> bool:
    """Whether all lines between two boxes go through the same wall of a building.

    Let s be how far a place stands before a wall [m] and |s'| how far one behind it. The line from
    one to the other meets the wall's plane at their mean with weights |s'| and s. That it does so
    beside the wall or above it is, times s + |s'|, affine in either place: if the lines between the
    corners of the boxes all go through the wall, from the same side, all lines do. They are told to
    do so only if they do by `MARGIN_M`, which is far more than rounding.
    """
    import shapely

    rings = shapely.get_exterior_ring(obstacles.tree.geometries[footprint])
    corner_m, ring = shapely.get_coordinates(rings, return_index=True)
    (side,) = np.nonzero(ring[1:] == ring[:-1])
    way_m = corner_m[side + 1] - corner_m[side]
    length_m = np.hypot(*way_m.T)[:, None, None]
    along = way_m / length_m[:, 0]
    before = np.stack([-along[:, 1], along[:, 0]], axis=1)
    seen_m = _corners(low, high) - corner_m[side, None, None]  # (wall, box, corner, 2)
    near_m, far_m = np.moveaxis(np.einsum("wbck,wk->wbc", seen_m, before), 1, 0)
    here_m, there_m = np.moveaxis(np.einsum("wbck,wk->wbc", seen_m, along), 1, 0)
    roof_m = obstacles.roof_m[footprint][ring[side], None, None] - 2.0 * MARGIN_M
    near_m, far_m = near_m[:, :, None], far_m[:, None, :]
    opposite = (np.minimum(near_m, -far_m) > MARGIN_M) | (np.minimum(-near_m, far_m) > MARGIN_M)
    near_m, far_m = abs(near_m), abs(far_m)
    at_m = here_m[:, :, None] * far_m + there_m[:, None, :] * near_m
    height_m = high[2] * far_m + high[5] * near_m
    apart_m = near_m + far_m
    through = opposite & (height_m < roof_m * apart_m)
    through &= (at_m > MARGIN_M * apart_m) & (at_m < (length_m - MARGIN_M) * apart_m)
    return bool(through.all(axis=(1, 2)).any())


def _corners(low: Floats, high: Floats) -> Floats:
    """Corners on the map of the boxes of both ends (box, corner, 2) [m]."""
    return np.array(
        [[(x, y) for x in (low[k], high[k]) for y in (low[k + 1], high[k + 1])] for k in (0, 3)]
    )


def _crossing_none(obstacles: Prisms, ends_m: Floats, exempt: Integers) -> Booleans:
    known = np.isfinite(ends_m).all(axis=1)
    free: Booleans = np.asarray(known).copy()
    free[known] = crossed(obstacles, ends_m[known, :3], ends_m[known, 3:], exempt[known]) == CLEAR
    return free
