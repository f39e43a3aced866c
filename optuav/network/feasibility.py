"""Figures and warnings that follow from a mission before any battery is simulated."""

import math
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from optuav.arrays import Floats
from optuav.flight.model import BENT
from optuav.laser.beam import SpreadingBeam
from optuav.mission import Mission
from optuav.mission.messages import first_ten
from optuav.mission.mission import Served
from optuav.network import vehicle
from optuav.network.legs import NO_LEG
from optuav.network.network import Network, build_network
from optuav.network.obstacles import CLEAR, crossed
from optuav.network.places import DESTINATION, ORIGIN
from optuav.network.prisms import prisms
from optuav.network.timeline import stay_net
from optuav.network.variants import ON_RIM, as_variants
from optuav.network.ways import way_limits_m
from optuav.physics import flight, link
from optuav.physics.cells import CELLS, TYPED, kind_of
from optuav.presentation.numbers import amperes, figure, figures_apart, fixed, seconds

LARGEST_LAG_S = 400.0  # Lag of the wells above which they are doubted
MOST_RADIO = 0.1  # Share of the hover's current above which a radio is doubted


def impossibilities(network: Network, *, one_stop: bool = True) -> tuple[str, ...]:
    """Reasons why no route can be flown, with one stop or else with any number of them."""
    reasons, mission, limits = list[str](), network.mission, network.mission.limits
    applies = [name for name, where in as_variants(network).hindrances.items() if where.any()]
    if (why := mission.flight_model.impossible()) is not None:
        reasons.append(f"the UAV cannot fly: {why}")
    for device, position_m in zip(mission.served, network.places.hover_points_m, strict=True):
        if "out_of_reach" in applies:
            reasons += _out_of_reach(mission, device, position_m)
        hover_m, low_m, high_m = device.hover_m, limits.min_altitude_m, limits.max_altitude_m
        if hover_m is not None and not low_m <= hover_m[2] <= high_m:
            reasons.append(
                f"P1.e altitude: {_key(mission, device, 'hover_m')} is at {figure(hover_m[2])} m, "
                f"outside [{figure(low_m)}, {figure(high_m)}] m "
                "(limits.min_altitude_m, limits.max_altitude_m)"
            )
    if one_stop and not reasons and not network.routes.flyable.any():
        reasons = [*_unreached_devices(network)] or blocked_legs(network, 0)
    return tuple(reasons)


def _unreached_devices(network: Network) -> Iterator[str]:
    """The devices among several whose hover point no leg leads to, or from, and an example why."""
    legs, names = network.legs, network.places.names
    for place in network.places.hovers.tolist() if network.mission.devices else ():
        for word, ends in (("to", legs.end), ("from", legs.start)):
            (own,) = np.nonzero(ends == place)
            if not legs.flyable[own].any():
                removed = (legs.crosses[own] == CLEAR) & ~np.isnan(legs.duration_s[own])
                lead = f"no leg {word} the hover point of device {names[place]}"
                why = f"can be flown: {_why_blocked(network, int(own[0]))}"
                yield f"{lead} {'is left in the graph' if removed.any() else why}"


def _out_of_reach(mission: Mission, device: Served, position_m: Floats) -> Iterator[str]:
    """Say how far the link of a device reaches, and how far it had to, if it is out of reach."""
    limits, device_m, hover_m = mission.limits, device.position_m, device.hover_m
    radius_m = vehicle.coverage_radius_m(mission)
    name = f"device {device.name}" if mission.devices else "the device"
    if hover_m is None:
        if np.isfinite(position_m).all():
            return
        height_m = abs(limits.min_altitude_m - device_m[2])
        away, reach = figures_apart(height_m, radius_m, 6)
        yield (
            f"{name} is out of reach: its link covers {reach} m, but hovering at "
            f"limits.min_altitude_m = {figure(limits.min_altitude_m)} m means {away} m at least "
            f"({_key(mission, device, 'position_m')}, link.transmit_power_W, "
            "limits.outage_probability)"
        )
        return
    distance_m, most = math.dist(hover_m, device_m), limits.outage_probability
    if distance_m <= radius_m * (1.0 + ON_RIM):
        return
    outage = float(link.outage_probability(vehicle.channel(mission), distance_m))
    away, reach = figures_apart(distance_m, radius_m, 6)
    risk, _ = figures_apart(outage, most, 3)
    yield (
        f"P1.a outage: {_key(mission, device, 'hover_m')} is {away} m from the device, its link "
        f"covers {reach} m (outage {risk}, limits.outage_probability = {figure(most)})"
    )


def _key(mission: Mission, device: Served, name: str) -> str:
    """The key of a device's place: of one device a key of [link] or [route]."""
    one = {"position_m": "link.device_m", "hover_m": "route.hover_m"}
    return f"devices.{device.name}.{name}" if mission.devices else one[name]


def blocked_legs(network: Network, route: int) -> list[str]:
    """The legs of a route that cannot be flown, and why."""
    blocked = (leg for leg in network.routes.legs[route].tolist() if leg != NO_LEG)
    return [_why_blocked(network, leg) for leg in blocked if not network.legs.flyable[leg]]


def _why_blocked(network: Network, leg: int) -> str:
    """A leg that cannot be flown, and why."""
    legs, names, inside = network.legs, network.places.names, _inside(network)
    buildings, why = network.mission.buildings.names, "is not in the graph"
    if np.isnan(legs.duration_s[leg]):
        why = "cannot be flown at its speed in this wind ([flight], [wind])"
    ends, blocker = (int(legs.start[leg]), int(legs.end[leg])), legs.crosses[leg]
    within = [place for place in ends if place in inside]
    if blocker != CLEAR and within:
        why = f"cannot be flown: {names[within[0]]} lies inside building "
        why += f'{buildings[inside[within[0]]]} (flight.obstacles = "ignore" allows that)'
    elif blocker != CLEAR:
        # The building that closes the bent ways need not stand in the straight line
        verb = "is blocked by" if network.mission.flight.obstacle_rule in BENT else "crosses"
        why = f"{verb} building {buildings[blocker]} ({_remedy(network.mission)})"
    start, end = (names[place] for place in ends)
    return f"the leg {start} → {end} {why}"


def _inside(network: Network) -> dict[int, int]:
    """The building around each end of a mission that lies inside one, by place."""
    places = network.places
    ends = np.array([ORIGIN, *places.hovers, DESTINATION])
    ends = ends[np.isfinite(places.position_m[ends]).all(axis=1)]
    at_m, obstacles = places.position_m[ends], prisms(network.mission.buildings)
    inside = crossed(obstacles, at_m, at_m, np.full((len(ends), 1), CLEAR))
    return {place: k for place, k in zip(ends.tolist(), inside.tolist(), strict=True) if k != CLEAR}


def _remedy(mission: Mission) -> str:
    """Say what frees a leg that a building blocks."""
    keys = mission.flight
    if keys.obstacle_rule == "refuse":
        return 'flight.obstacles = "over" flies over it, "ignore" through it'
    clearance_m, ceiling_m = way_limits_m(keys)
    limits = (
        f"flight.clearance_m = {figure(clearance_m)} m and flight.max_altitude_m = "
        f"{figure(ceiling_m)} m"
    )
    return f"no way {keys.obstacle_rule} it keeps {limits}"


def advice(mission: Mission) -> Iterator[str]:
    """Warnings about a valid mission."""
    network = build_network(mission)
    places, legs = network.places, network.legs
    # Over several devices, the mission's order is one of many.
    yield from impossibilities(network, one_stop=not mission.devices)
    for place, building in _inside(network).items():
        yield f"{places.names[place]} lies inside building {mission.buildings.names[building]}"
    speeds_m_s = np.where(legs.flyable & ~legs.edited, legs.peak_speed_m_s, 0.0)
    fastest = int(speeds_m_s.argmax())
    peak_m_s, has_drag = float(speeds_m_s[fastest]), mission.flight_model.has_drag
    if warning := flight.speed_warning(peak_m_s, has_drag=has_drag):
        start, end = (places.names[ends[fastest]] for ends in (legs.start, legs.end))
        yield f"on the leg {start} → {end}, {warning}"
    battery = mission.battery
    recommended_A = float(mission.pool.capacity_As) / 3600.0
    if battery.charge_current_A > recommended_A:
        setting = f"battery.charge_current_A = {figure(battery.charge_current_A)} A"
        yield f"{setting} is above 1 C of the battery, {figure(recommended_A)} A"
    yield from _lag_doubt(mission)
    yield from rate_doubt(mission, _draws(network))
    yield from _radio_doubt(mission)
    dark = places.exists & ~places.laser_sight
    stays = *places.hovers, *places.buildings
    names = [places.names[place] for place in stays if dark[place]]
    if names and mission.laser is not None:
        yield f"the laser does not see {first_ten(names)}: no charging there"


def _lag_doubt(mission: Mission) -> Iterator[str]:
    """Doubt wells that leave more charge bound than those of any lithium cell.

    They leave at most (1−ω)B, however slowly it flows.
    """
    lag_s, hover_A = float(mission.pool.lag_s), float(vehicle.hover_load(mission).current_A)
    bound_As = float(mission.pool.full.bound_As)
    if lag_s > LARGEST_LAG_S and bound_As > CELLS["lipo"].least_lag_s * hover_A:
        size = f"of {seconds(lag_s, 0)}" if mission.battery.flow_rate_per_s > 0.0 else "without end"
        usual = f"{figure(CELLS['lipo'].least_lag_s)} to {figure(CELLS['liion'].largest_lag_s)} s"
        yield (
            f"the wells have a lag (1−ω)²/k_F {size}, unlike any lithium cell at 25 °C ({usual}): "
            "optuav new --battery lipo writes wells of such cells"
        )


def rate_doubt(mission: Mission, draws: Iterable[tuple[str, float]]) -> Iterator[str]:
    """Doubt the largest of some draws [A] if the wells are of cells never drawn from so fast."""
    battery = mission.battery
    kind = kind_of(battery.available_fraction, battery.flow_rate_per_s)
    most_C = None if kind is None else CELLS[kind].most_C
    carrying = mission.pack if battery.takes_turns else mission.pool
    what, largest_A = max(draws, key=lambda draw: draw[1], default=("", 0.0))
    rate_C = largest_A * 3600.0 / float(carrying.capacity_As)
    if most_C is not None and rate_C > most_C * (1.0 + TYPED):
        yield (
            f"{what} draws {amperes(largest_A)}, {figure(rate_C, 3)} C, beyond the "
            f"{figure(most_C)} C to which wells `{kind}` were fitted: nothing is promised there"
        )


def _draws(network: Network) -> Iterator[tuple[str, float]]:
    """The largest draw of every leg that can be flown, and that of the hover [A]."""
    legs, names = network.legs, network.places.names
    for place in network.places.hovers.tolist():
        hover_A = -float(stay_net(network, place).current_A)
        over = f" over {names[place]}" if network.mission.devices else ""
        if math.isfinite(hover_A):
            yield f"the hover{over}", hover_A
    for leg in np.flatnonzero(legs.flyable).tolist():
        way = f"the leg {names[legs.start[leg]]} → {names[legs.end[leg]]}"
        yield way, max(-stage.current_A for stage in legs.stages_of(leg))


def _radio_doubt(mission: Mission) -> Iterator[str]:
    """Doubt a radio that draws a large share of the hover: its voltage may not be the pack's."""
    model, radio, pack_V = mission.flight_model, mission.link, mission.battery.nominal_voltage_V
    radio_A = radio.transmit_power_W / radio.transmit_voltage_V
    hover_A = float(model.hover().current_A)
    if not model.radio_included and radio_A > MOST_RADIO * hover_A:
        yield (
            f"the radio draws {amperes(radio_A)} (link.transmit_power_W = "
            f"{figure(radio.transmit_power_W)} W at link.transmit_voltage_V = "
            f"{figure(radio.transmit_voltage_V)} V), more than a tenth of the {amperes(hover_A)} "
            "of hovering; a radio fed by the pack has its voltage, battery.nominal_voltage_V = "
            f"{figure(pack_V)} V"
        )


class Figure(NamedTuple):
    """A derived value."""

    name: str
    value: float | tuple[float, ...] | None  # A number or a position; None where it does not exist
    unit: str

    @property
    def text(self) -> str:
        """The value to six digits, a position to the centimetre."""
        if self.value is None:
            return "none"
        if isinstance(self.value, tuple):
            return "(" + ", ".join(fixed(component) for component in self.value) + ")"
        return figure(self.value)


class BuildingFigures(NamedTuple):
    """Derived figures of a building."""

    # As the mission states them.
    name: str
    position_m: tuple[float, float, float]
    footprint_m: tuple[float, float] | tuple[tuple[float, float], ...] | None
    laser_sight: bool  # Whether the laser is in clear sight
    received_power_W: float  # Power from the laser there [W]
    # Flight time with a stop there, resting or hovering first [s]; None where it cannot be flown.
    rest_first_s: float | None
    hover_first_s: float | None


class LinkFigures(NamedTuple):
    """Figures of a spreading beam at a place; powers are 0 out of its sight."""

    name: str
    laser_sight: bool
    distance_m: float  # From the laser [m]
    share: float  # Mean share of the light there that meets the receiver, before limits [-]
    received_power_W: float  # DC power within all limits [W]
    charge_current_A: float


def link_figures(mission: Mission) -> tuple[LinkFigures, ...]:
    """Figures of the beam at the hover point and all buildings; none where no beam is stated."""
    if not isinstance(beam := mission.beam, SpreadingBeam):
        return ()
    places = build_network(mission).places
    which = np.array([*places.hovers, *places.buildings])
    x, y, z = places.position_m[which].T
    away_m = vehicle.laser_distance_m(mission, (x, y, z))
    received = places.received_power_W[which], places.charge_current_A[which]
    figures = np.transpose([away_m, beam.chain(away_m).share, *received]).tolist()
    names = (places.names[place] for place in which)
    sights = places.laser_sight[which].tolist()
    rows = zip(names, sights, figures, strict=True)
    return tuple(LinkFigures(name, sight, *row) for name, sight, row in rows)


def derived(mission: Mission) -> tuple[Figure, ...]:
    """Derived figures of a mission, in the order of the physics."""
    return tuple(
        Figure(name, value if np.isfinite(value).all() else None, unit)
        for name, value, unit in _figures(mission)
    )


def _figures(mission: Mission) -> Iterator[tuple[str, float | tuple[float, ...], str]]:
    """Names, values (NaN if missing) and units."""
    network = build_network(mission)
    places, routes = network.places, network.routes
    capacity_As = float(mission.pool.capacity_As)
    yield "battery capacity B", capacity_As, "A s"
    yield "nominal battery energy E_0", capacity_As * mission.battery.nominal_voltage_V, "J"
    yield from mission.flight_model.figures()
    drawn = vehicle.hover_load(mission)
    yield "hover power, radio included", float(drawn.power_W), "W"
    yield "hover current, radio included", float(drawn.current_A), "A"
    yield "coverage radius d_max", vehicle.coverage_radius_m(mission), "m"
    several = dict(zip(places.hovers.tolist(), mission.devices, strict=False))
    for place in places.hovers.tolist():
        of = f" of {several[place].name}" if several else ""
        yield f"hover point{of}", tuple(places.position_m[place].tolist()), "m"
    direct_s = float(routes.flight_time_s[0]) if routes.flyable[0] else math.nan
    yield "direct flight" + ", devices in order" * bool(several), direct_s, "s"
    for place in places.hovers.tolist() if mission.laser is not None else ():
        over = f" over {several[place].name}" if several else ""
        yield f"net current in hover{over}", stay_net(network, place).current_A, "A"
        sight = "" if places.laser_sight[place] else " (no sight)"
        power_W = float(places.received_power_W[place])
        yield f"power received at hover{over}{sight}", power_W, "W"


def building_figures(mission: Mission) -> tuple[BuildingFigures, ...]:
    """Derived figures of every building, in the mission's order."""
    network = build_network(mission)
    places, routes = network.places, network.routes
    flights = zip(routes.flight_time_s.tolist(), routes.flyable.tolist(), strict=True)
    _, *times_s = (time_s if flies else None for time_s, flies in flights)
    places_of_rest = 1 + len(mission.served)
    figures = list[BuildingFigures]()
    for k, (building, place) in enumerate(zip(mission.buildings, places.buildings, strict=True)):
        as_stated = building.name, building.position_m, building.footprint_m
        light = bool(places.laser_sight[place]), float(places.received_power_W[place])
        of_roof = times_s[places_of_rest * k : places_of_rest * (k + 1)]
        figures.append(BuildingFigures(*as_stated, *light, of_roof[0], of_roof[-1]))
    return tuple(figures)
