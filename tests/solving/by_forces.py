"""What flies a mission, by formulas of the tests' own.

Legs follow from forces and from power over speed, light from quadrature over the receiver, sight
and clearance from points along lines, motion and wells from SciPy's integration.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import shapely
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, minimize_scalar
from scipy.special import j0, j1
from scipy.stats import ncx2

from optuav import Mission
from optuav.physics.rotor import Motor
from tests.kibam import Kibam
from tests.physics.reference import power_coefficients

Array = npt.NDArray[np.float64]
NODES, WEIGHTS = np.polynomial.legendre.leggauss(12)
TIGHT: dict[str, float] = {"xtol": 1e-13, "rtol": 1e-14}
ONE_ROTOR_RPM_PER_V = 9.5493
BESIDE_M = 0.5
"""What sight must not hang on, as points along a line are half a metre apart."""


# Loads


class Part(NamedTuple):
    """A part of a leg or a stay: what is drawn, and v' = push − drag·v² along a straight way."""

    duration_s: float
    drawn_A: float = 0.0
    drawn_W: float = 0.0
    push_m_s2: float = 0.0
    drag_per_m: float = 0.0
    frozen: bool = False  # It does not move, as in a turn
    peak_m_s: float = 0.0


def leg(mission: Mission, way_m: Array, speed_m_s: float | None = None) -> list[Part]:
    """A straight leg from rest to rest; no parts where the wind leaves no way forward."""
    keys, d = vars(mission.flight), float(np.linalg.norm(way_m))
    if not d:
        return []
    if mission.flight.model == "rotors":
        return _rotors(mission, way_m)
    if mission.flight.model == "regimes":
        v = min(math.sqrt(keys["acceleration_m_s2"] * d), keys["max_speed_m_s"] or math.inf)
        rise_s = v / keys["acceleration_m_s2"]
        return _ramps(d / v + rise_s, rise_s, v, (keys["flight_current_A"], keys["flight_power_W"]))
    speed_m_s = named_m_s(mission, way_m) if speed_m_s is None else speed_m_s
    return [] if math.isnan(speed_m_s) else _cruise(mission, way_m, speed_m_s)


def _ramps(T: float, rise_s: float, peak_m_s: float, drawn: tuple[float, float]) -> list[Part]:
    """Speed up, cruise, slow down, at one draw."""
    a = peak_m_s / rise_s
    steps = ((rise_s, a), (T - 2 * rise_s, 0.0), (rise_s, -a))
    return [Part(max(t, 0.0), *drawn, push, peak_m_s=peak_m_s) for t, push in steps]


def _cruise(mission: Mission, way_m: Array, speed_m_s: float) -> list[Part]:
    """A leg of a rotary wing at a horizontal ground speed, or as slow as its climb takes."""
    keys, (d, z) = vars(mission.flight), (math.hypot(*way_m[:2]), float(way_m[2]))
    a, V = keys["acceleration_m_s2"], min(speed_m_s, math.sqrt(keys["acceleration_m_s2"] * d))
    T = max(z / keys["climb_speed_m_s"], -z / keys["descent_speed_m_s"])
    if d and d / V + V / a < T:
        V = brentq(lambda v: d / v + v / a - T, 1e-9 * d, V, **TIGHT)
    elif d:
        T = d / V + V / a
    assert mission.body is not None
    weight_N = mission.body.mass_kg * mission.body.gravity_m_s2
    ground = V * way_m[:2] / d if d else np.zeros(2)
    air = math.hypot(*(ground - mission.wind.velocity_m_s[:2]))
    drawn_W = (power(mission, air) + weight_N * max(z, 0.0) / T) / keys["efficiency"]
    drawn = drawn_W / mission.battery.nominal_voltage_V, drawn_W
    if not d:
        return [Part(T, *drawn, peak_m_s=abs(z) / T)]
    return _ramps(T, V / a, V * float(np.linalg.norm(way_m)) / d, drawn)


def power(mission: Mission, air_m_s: Any) -> Any:
    """Power at the rotors of a rotary wing, as it is printed [W]."""
    keys, V = vars(mission.flight), np.asarray(air_m_s)
    v_0 = keys["induced_speed_m_s"]
    lift = np.sqrt(np.sqrt(1 + V**4 / (4 * v_0**4)) - V**2 / (2 * v_0**2))
    blades = keys["blade_power_W"] * (1 + 3 * V**2 / keys["tip_speed_m_s"] ** 2)
    return blades + keys["induced_power_W"] * lift + keys["parasite_W_s3_m3"] * V**3


def named_m_s(mission: Mission, way_m: Array, rule: str | None = None) -> float:
    """The ground speed of a leg by a rule or that of the mission [m/s]; NaN for none."""
    keys, cap_m_s = vars(mission.flight), mission.flight.max_speed_m_s
    if not way_m[:2].any():
        return 0.0
    cruise_m_s = keys["cruise_speed_m_s"] if rule is None else None
    u, w = way_m[:2] / math.hypot(*way_m[:2]), np.array(mission.wind.velocity_m_s[:2])
    along, across = float(w @ u), float(w[0] * u[1] - w[1] * u[0])

    def ground(air: float) -> float:
        speed = along + math.sqrt(air**2 - across**2) if air > abs(across) else 0.0
        return speed if speed > 0.0 else math.nan

    if cruise_m_s is not None:
        return float(np.minimum(cruise_m_s, ground(cap_m_s)))
    rule = rule or keys["speed"] or "best-range"
    if rule == "max" or math.isnan(ground(cap_m_s)):
        return ground(cap_m_s)
    if rule == "best-endurance":
        return ground(_least(lambda V: power(mission, V), cap_m_s))

    def per_metre(V: Any) -> Any:
        return power(mission, np.hypot(V - along, across)) / np.maximum(V, 1e-9)

    return _least(per_metre, ground(cap_m_s))


def _least(of: Any, high: float) -> float:
    """Where a function from 0 on is least, on a grid and then near the best of it."""
    grid = np.linspace(0.0, high, 2001)
    best, step = grid[of(grid).argmin()], grid[1]
    bounds = max(0.0, best - step), min(high, best + step)
    found = minimize_scalar(of, bounds=bounds, method="bounded", options={"xatol": 1e-11})
    return float(high if of(np.array(high)) <= found.fun else found.x)


def _draws(mission: Mission, *speeds_rad_s: float) -> tuple[float, float]:
    """Current [A] and power [W] of rotors at some speeds."""
    assert mission.rotor is not None
    motor, drawn_A, drawn_W = mission.rotor.as_record(Motor), 0.0, 0.0
    for v in speeds_rad_s:
        torque_Nm = motor.friction_torque_Nm + motor.viscous_damping_Nm_s_rad * v
        torque_Nm += motor.drag_coefficient_Nm_s2_rad2 * v**2
        drawn_A += torque_Nm * motor.velocity_constant_rpm_V / ONE_ROTOR_RPM_PER_V
        drawn_W += sum(c * v**n for n, c in enumerate(power_coefficients(motor)[:5]))
    return drawn_A, drawn_W


def _rotors(mission: Mission, way_m: Array) -> list[Part]:
    """Turn, accelerate, turn, [cruise, turn,] brake, turn: energy over the way, and quadrature."""
    rotor, body, cap = mission.rotor, mission.body, mission.flight.max_speed_m_s
    assert rotor is not None
    assert body is not None
    lift, v_max = rotor.lift_coefficient_N_s2_rad2, rotor.max_speed_rad_s
    m, d, F = body.mass_kg, float(np.linalg.norm(way_m)), 4 * lift * v_max**2
    u, outer_N = way_m / d, np.array(mission.wind.force_N) - [0, 0, m * body.gravity_m_s2]
    # The net force along the path closes the triangle |A u − F_e| = F.
    A, A_b = (
        brentq(lambda N, u=way: np.linalg.norm(N * u - outer_N) - F, 0.0, 3 * F, **TIGHT)
        for way in (u, -u)
    )
    k = 0.5 * (mission.air.density_kg_m3 if mission.air else 1.225) * body.drag_area_m2 / m

    def gained(s: Any) -> Any:  # v² after a way from rest
        return 2 * A / m * s if k == 0 else -A / (m * k) * np.expm1(-2 * k * np.asarray(s))

    def needed(s: Any) -> Any:  # v² from which a way brakes
        return 2 * A_b / m * s if k == 0 else A_b / (m * k) * np.expm1(2 * k * np.asarray(s))

    def excess(s: float) -> float:
        return min(float(needed(d - s)), 1e300) - float(gained(s))

    with np.errstate(over="ignore"):
        s2 = brentq(excess, 0, d, **TIGHT)
    s4, peak2 = d - s2, float(gained(s2))
    cruises = cap is not None and cap**2 < peak2
    if cruises:
        peak2 = cap**2
        s2 = brentq(lambda s: gained(s) - peak2, 0, s2, **TIGHT)
        s4 = brentq(lambda s: needed(s) - peak2, 0, s4, **TIGHT)
    full, peak = _draws(mission, *[v_max] * 4), math.sqrt(peak2)
    steady_N = m * k * peak2 * u - outer_N
    moves = [Part(_time_s(s2, gained), *full, A / m, k, peak_m_s=peak)]
    if cruises:
        v = math.sqrt(np.linalg.norm(steady_N) / (4 * lift))
        moves.append(Part((d - s2 - s4) / peak, *_draws(mission, *[v] * 4), peak_m_s=peak))
    moves.append(Part(_time_s(s4, needed), *full, -A_b / m, k, peak_m_s=peak))
    level = np.array([0.0, 0.0, 1.0])
    thrusts = [level, A * u - outer_N, *[steady_N] * cruises, -A_b * u - outer_N, level]
    angles = [(math.atan2(x, z), math.asin(y / math.hypot(x, y, z))) for x, y, z in thrusts]
    inertias, parts = (body.inertia_y_kg_m2, body.inertia_x_kg_m2), list[Part]()
    for (one, other), move in zip(itertools.pairwise(angles), [*moves, None], strict=True):
        pairs = zip(one, other, inertias, strict=True)
        torque_Nm = body.arm_length_m * lift * v_max**2
        turn_s = sum(2 * math.sqrt(abs(b - a) * inertia / torque_Nm) for a, b, inertia in pairs)
        turning = _draws(mission, v_max, 0.5**0.5 * v_max, 0.5**0.5 * v_max)
        parts += [Part(turn_s, *turning, frozen=True), *([move] if move else [])]
    return parts


def _time_s(way_m: float, squared: Any) -> float:
    """∫ ds/v over a way from or to rest, with s = way·w⁴, in panels."""
    w, weights = panels(np.linspace(0.0, 1.0, 61))
    return float(weights @ (4 * way_m * w**3 / np.sqrt(squared(way_m * w**4))))


def panels(edges: Array) -> tuple[Array, Array]:
    """Points and weights of Gauss's rule in every panel between some edges."""
    half = 0.5 * np.diff(edges)[:, None]
    points = 0.5 * (edges[1:] + edges[:-1])[:, None] + half * NODES
    return points.ravel(), (half * WEIGHTS).ravel()


def hover_A(mission: Mission) -> float:
    """Drawn in hover, the radio included [A]."""
    radio_A = mission.link.transmit_power_W / mission.link.transmit_voltage_V
    keys = vars(mission.flight)
    if mission.flight.model == "regimes":
        return float(keys["hover_current_A"])
    if mission.flight.model == "rotary-wing":
        drawn_W = power(mission, math.hypot(*mission.wind.velocity_m_s)) / keys["efficiency"]
        return float(drawn_W / mission.battery.nominal_voltage_V + radio_A)
    assert mission.rotor is not None
    assert mission.body is not None
    x, y, z = mission.wind.force_N
    force_N = math.hypot(x, y, z - mission.body.mass_kg * mission.body.gravity_m_s2)
    v = math.sqrt(force_N / (4 * mission.rotor.lift_coefficient_N_s2_rad2))
    return _draws(mission, *[v] * 4)[0] + radio_A


# Light


def charging_A(mission: Mission, place_m: Sequence[float]) -> float:
    """Current into the battery in clear sight of the laser [A]."""
    laser, battery, keys = mission.laser, mission.battery, vars(mission.laser)
    if (stated := vars(mission.flight).get("charge_current_A")) is not None:
        return float(stated)
    assert laser is not None
    d, V = math.dist(laser.position_m, place_m), keys["visibility_km"]
    kim = 1.3 if V >= 6 else 0.16 * V + 0.34
    air = math.exp(-3.92 / V * (laser.wavelength_nm / 550) ** -kim * d / 1000)
    most_W = battery.charge_current_A * battery.nominal_voltage_V
    if laser.beam == "gaussian":
        return _gaussian_W(mission, d, air, most_W) / battery.nominal_voltage_V
    if laser.beam == "divergence":
        assert mission.receiver is not None
        area_m2 = mission.receiver.optics_efficiency * vars(mission.receiver)["area_m2"]
        spot_m = keys["aperture_m"] + d * keys["divergence_rad"]
        got_W = area_m2 * laser.power_W * air / spot_m**2
    else:
        sent_W = air * (keys["emitter_slope"] * laser.power_W + keys["emitter_offset_W"])
        got_W = keys["receiver_slope"] * sent_W + keys["receiver_offset_W"]
    return min(max(got_W, 0.0), most_W) / battery.nominal_voltage_V


def _gaussian_W(mission: Mission, d: float, air: float, most_W: float) -> float:
    """The mean over the jitter of what the receiver makes of its share, within its limits."""
    keys, receiver = vars(mission.laser), vars(mission.receiver)
    a, D, λ = receiver["radius_m"], keys["aperture_m"], keys["wavelength_nm"] * 1e-9
    w_0, σ = keys["waist_m"] or D / math.sqrt(8), keys["jitter_rad"] * d
    w2 = w_0**2 + (keys["m2"] * λ * d / (math.pi * w_0)) ** 2
    sent_W = keys["power_W"] * keys["source_efficiency"] * -math.expm1(-(D**2) / (2 * w_0**2)) * air
    cells = math.prod(receiver[f"{part}_efficiency"] or 1 for part in ("optics", "cell", "dc"))
    most = min(most_W, receiver["max_power_W"] or math.inf) / (sent_W * cells)
    if receiver["max_irradiance_W_m2"] is not None:
        most = min(most, receiver["max_irradiance_W_m2"] * math.pi * a**2 / sent_W)
    k = 2 * math.pi / λ
    κ, weights = panels(np.linspace(0, math.sqrt(8 * 40 / w2), 301))
    blur = 0.5 * 1.09275 * keys["turbulence_cn2"] * k**2 * d * (κ * d / k) ** (5 / 3)
    spectrum = weights * a * j1(a * κ) * np.exp(-(κ**2) * w2 / 8 - blur)

    def share(r: Any) -> Any:  # Of what arrives, on a receiver that the beam misses by r
        if keys["turbulence_cn2"]:
            return j0(np.asarray(r)[..., None] * κ) @ spectrum
        return ncx2.cdf(4 * a**2 / w2, 2, 4 * r**2 / w2)

    if not σ:
        return sent_W * cells * min(float(share(0.0)), most)
    # The miss has the law of Rayleigh; the limit acts up to one.
    edges = np.linspace(0, 8.5 * σ, 21)
    if share(edges[-1]) < most < share(0.0):
        edges = np.sort(np.append(edges, brentq(lambda r: share(r) - most, 0, edges[-1])))
    r, weights = panels(edges)
    law = weights * r / σ**2 * np.exp(-(r**2) / (2 * σ**2))
    return sent_W * cells * float(law @ np.minimum(share(r), most))


# Space


def walls(mission: Mission) -> list[tuple[str, shapely.Polygon, float]]:
    """Names, footprints and roofs of the buildings that have a footprint."""
    found = []
    for house in mission.to_dict()["buildings"]:
        (x, y, roof_m), outline = house["position_m"], house.get("footprint_m")
        if outline is not None:
            dx, dy = outline if not isinstance(outline[0], list) else (0, 0)
            box = shapely.box(x - dx / 2, y - dy / 2, x + dx / 2, y + dy / 2)
            found.append((house["name"], box if dx else shapely.Polygon(outline), roof_m))
    return found


def lowest_m(a: Array, b: Array, area: shapely.Geometry) -> float:
    """The least height of a line over an area [m], by points on it; ∞ where it is not over it."""
    points = a + np.linspace(0, 1, 4001)[:, None] * (b - a)
    inside = shapely.contains_xy(area, points[:, 0], points[:, 1])
    return float(points[inside, 2].min()) if inside.any() else math.inf


def sights(mission: Mission, place: str, place_m: Array) -> set[bool]:
    """Whether the laser shines there: both answers where that hangs on less than half a metre."""
    assert mission.laser is not None
    found, source_m = set(), np.array(mission.laser.position_m)
    for beside_m in (-BESIDE_M, 0.0, BESIDE_M):
        grown = ((area.buffer(beside_m), top, name) for name, area, top in walls(mission))
        found.add(
            all(
                lowest_m(source_m, place_m, area) >= roof_m + beside_m
                for area, roof_m, name in grown
                if name != place
            )
        )
    return found


def too_near(mission: Mission, ends: tuple[str, str], points_m: Array, apart_m: float) -> set[str]:
    """Buildings from which a way by points keeps less than a clearance, above or beside them.

    An end within the clearance sees the building's own outline, one above its roof its own height.
    """
    found = set()
    for name, area, roof_m in walls(mission):
        grown, top_m = area.buffer(apart_m, join_style="mitre"), roof_m + apart_m
        if any(shapely.intersects_xy(grown, *p[:2]) for p in points_m[[0, -1]]):
            over = [p[2] for p in points_m[[0, -1]] if shapely.intersects_xy(area, *p[:2])]
            grown, top_m = area, min([top_m, *(z for z in over if z >= roof_m - 1e-5)])
        inner = grown.buffer(-0.01, join_style="mitre")
        ways = itertools.pairwise(points_m)
        if name not in ends and any(lowest_m(a, b, inner) < top_m - 0.01 for a, b in ways):
            found.add(name)
    return found


# Charge


def start_As(mission: Mission) -> tuple[float, float]:
    """Both wells at take-off [A s]."""
    battery, start = mission.battery, mission.start
    whole_As, share = battery.packs * battery.capacity_As, battery.available_fraction
    if start is not None and start.available_As is not None and start.bound_As is not None:
        return start.available_As, start.bound_As
    level = 1.0 if start is None or start.soc is None else start.soc
    return level * share * whole_As, level * (1 - share) * whole_As


def kibam(mission: Mission) -> Kibam:
    """The wells at take-off, to be stepped."""
    battery = mission.battery
    whole_As = battery.packs * battery.capacity_As
    wells = Kibam(whole_As, battery.available_fraction, battery.flow_rate_per_s)
    wells.y1, wells.y2 = map(np.array, start_As(mission))
    wells.least = wells.most = wells.y1 / whole_As
    return wells


class Course(NamedTuple):
    """Way along a straight line [m], speed [m/s] and wells [A s] at some moments."""

    along_m: Array
    speed_m_s: Array
    available_As: Array
    bound_As: Array


def integrate(
    mission: Mission, part: Part, net_A: float, state: Sequence[float], passed_s: Array
) -> Course:
    """A part of a phase by SciPy; where charging tapers, a full well stays full."""
    battery = mission.battery
    ω, k = battery.available_fraction, battery.flow_rate_per_s
    whole_As = battery.packs * battery.capacity_As
    tapers, full_As = battery.charging == "taper" and net_A > 0.0, ω * whole_As

    def slope(_: float, y: Array, held: bool) -> list[float]:
        flow_A = k * (y[3] / (1 - ω) - y[2] / ω)
        filled_A = net_A + flow_A if not held or y[2] < full_As * (1 - 1e-12) else 0.0
        moves = 0.0 if part.frozen else 1.0
        push = part.push_m_s2 - part.drag_per_m * y[1] ** 2
        return [moves * y[1], moves * push, min(filled_A, net_A + flow_A), -flow_A]

    def room_As(_: float, y: Array, held: bool) -> float:
        return 1.0 if held or not tapers else float(full_As - y[2])

    room_As.terminal, room_As.direction = True, -1.0  # type: ignore[attr-defined]
    held, begun_s, rows = tapers and state[2] >= full_As * (1 - 1e-9), 0.0, np.empty((4, 0))
    moments_s, place = np.unique(passed_s, return_inverse=True)
    precision = {"rtol": 1e-10, "atol": 1e-11 * np.array([1e3, 10.0, whole_As, whole_As])}
    while True:
        span, left_s = (begun_s, max(part.duration_s, begun_s + 1e-12)), moments_s[rows.shape[1] :]
        options = {"t_eval": left_s, "args": (held,), "events": room_As, **precision}
        run = solve_ivp(slope, span, state, "DOP853", **options)
        rows = np.concatenate([rows, run.y], axis=1)
        if run.status != 1:
            return Course(*rows[:, place])
        begun_s, (state,), held = float(run.t_events[0][0]), run.y_events[0], True
