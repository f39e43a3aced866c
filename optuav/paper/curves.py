"""Data shared by the paper's figures and its ledger: the file of statements, plans and curves."""

import math
import tomllib
from functools import lru_cache
from importlib.resources import files

import numpy as np

from formulations.formulation import Formulation
from formulations.p1 import P1
from formulations.p3 import P3
from formulations.soc import AVAILABLE
from optuav import solving
from optuav.arrays import Floats
from optuav.flight.rotors import Rotors
from optuav.laser.fits import Fits
from optuav.mission import Mission, load
from optuav.network.network import build_network
from optuav.network.variants import Variants
from optuav.options import Perspective, Trajectory
from optuav.physics import laser, rotor
from optuav.plan import Plan
from optuav.status import SAME_S

DATA = tomllib.loads(files("optuav.paper").joinpath("statements.toml").read_text("utf-8"))
"""The file of the paper's statements."""
PAPERS = (load("paper"), load("paper-table2"))
"""The mission with the printed parameters, and the one with the recovered loads."""
TRAJECTORIES: tuple[Trajectory, ...] = ("direct", "traj1", "traj2", "optimal")
AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}

DEADLINES_S = (800.0, 1200.0)
"""T_max of Table II and of Figs. 3 to 6 [s]; the later figures take the second."""
LEAST_SOC = (0.05, 0.10, 0.15)  # η0 of Fig. 7.
SPEED_SHARES = (0.95, 1.0, 1.05, 1.1)
"""Rotor speeds of Fig. 7 over the mission's v_max; the paper does not print its own."""
HOVER_S = 100.0  # Hover time of Figs. 9 and 10 [s].

WIND_POINTS = 401
PACK_HALVINGS = 30  # Halvings of the size of a pack
LARGEST_PACK = 4.0  # Largest pack that is tried, over the mission's own
REMEMBERED = 512
BEST = P1()
_solve = lru_cache(maxsize=REMEMBERED)(solving.solve)


def solve(
    mission: Mission,
    problem: Formulation = BEST,
    *,
    perspective: Perspective = AVAILABLE,
    slot_s: float | None = None,
) -> Plan:
    """Solve as `optuav.solve` does, and keep the plan for the next call."""
    return _solve(mission, problem, perspective=perspective, slot_s=slot_s)


def with_deadline(mission: Mission, deadline_s: float) -> Mission:
    """The mission with another deadline [s]."""
    return mission.replace({"limits.deadline_s": deadline_s})


def by_trajectory(mission: Mission, perspective: Perspective) -> dict[str, Plan]:
    """The plan of every trajectory."""
    return {
        name: solve(mission, P1(trajectory=name), perspective=perspective) for name in TRAJECTORIES
    }


def longest(mission: Mission, perspective: Perspective) -> tuple[Plan, list[str]]:
    """The plan of the optimal trajectory, and the other trajectories that hover as long."""
    plans = by_trajectory(mission, perspective)
    best = plans.pop("optimal")
    hovers_s = {name: plan.hover_time_s for name, plan in plans.items() if plan}
    return best, [name for name in hovers_s if hovers_s[name] >= best.hover_time_s - SAME_S]


def without_laser(mission: Mission) -> Mission:
    """The mission without its laser, and without the charging that it states."""
    charges = mission.flight_model.charging() is not None
    charging_keys = ("flight.charge_current_A", "flight.charge_power_W") if charges else ()
    return mission.replace(dict.fromkeys(("laser", *charging_keys)))


def table2_row(mission: Mission, deadline_s: float, perspective: Perspective) -> Plan:
    """(P3) in the mission's own slots, as a row of Table II has it."""
    changed = with_deadline(mission, deadline_s)
    return solve(changed, P3(), perspective=perspective, slot_s=mission.limits.slot_s)


def direct(mission: Mission, pack_As: float, perspective: Perspective) -> Plan:
    """(P3) with packs of another capacity [A s]."""
    return solve(mission.replace({"battery.capacity_As": pack_As}), P3(), perspective=perspective)


@lru_cache(maxsize=REMEMBERED)
def least_pack(
    mission: Mission, perspective: Perspective, hover_s: float | None = None
) -> float | None:
    """Least pack [A s] with which the direct path hovers for `hover_s`, if any, by halving.

    By default for as long as the deadline allows.
    """
    low, high = 0.0, LARGEST_PACK * mission.battery.capacity_As
    most, deadline_s = direct(mission, high, perspective), mission.limits.deadline_s
    if not most:
        return None
    if hover_s is None:
        left_s, rounding_s = deadline_s - most.mission_time_s, 1e-9 * deadline_s
        hover_s = most.hover_time_s - rounding_s if left_s <= rounding_s else math.inf
    if most.hover_time_s < hover_s:
        return None
    for _ in range(PACK_HALVINGS):
        plan = direct(mission, middle := 0.5 * (low + high), perspective)
        enough = bool(plan) and plan.hover_time_s >= hover_s
        low, high = (low, middle) if enough else (middle, high)
    return high


def wind_limits_N(mission: Mission, axis: str) -> tuple[float, float]:
    """Least and largest wind along an axis that lets rotors hold the place [N]."""
    rotors = Rotors.of(mission)
    motor, weight_N = rotors.motor, rotors.airframe.weight_N
    x, y, z = AXES[axis]
    low, high = (rotor.largest_wind(motor, weight_N, way) for way in ((-x, -y, -z), (x, y, z)))
    return -float(low), float(high)


def hover_energy(mission: Mission, axis: str) -> tuple[Floats, Floats]:
    """Wind along an axis [N], 0 N and the weight among it, and energy of `HOVER_S` [J]."""
    low, high = wind_limits_N(mission, axis)
    weight_N = float(Rotors.of(mission).airframe.weight_N)
    inner = [force for force in (0.0, weight_N) if low < force < high]
    force_N = np.union1d(np.linspace(low, high, WIND_POINTS), inner)
    # At the limits themselves rounding could take the thrust beyond the largest.
    inside = np.clip(force_N, low * (1.0 - 1e-12), high * (1.0 - 1e-12))
    winds = {f"wind.force_N[{k}]": inside * part for k, part in enumerate(AXES[axis])}
    load = Variants(build_network(mission), winds).hover_load
    return force_N, HOVER_S * np.asarray(load.power_W[:, 0], dtype=float)


def calmest_N(mission: Mission, axis: str) -> float:
    """Wind along an axis that makes hovering take the least energy [N]."""
    force_N, energy_J = hover_energy(mission, axis)
    return float(force_N[np.argmin(energy_J)])


def harvest(mission: Mission, source_W: float, distance_m: Floats) -> tuple[Floats, Floats]:
    """Energy from a source in `HOVER_S` [J] and efficiency ζ [-], by distance, in clear sight.

    The energy is not limited to the battery's intake.
    """
    conversion, per_km = Fits.of(mission).conversion, Fits.of(mission).attenuation_per_km
    power_W = laser.received_power(conversion, source_W, per_km, distance_m, np.inf)
    efficiency = laser.efficiency(power_W, source_W)
    return HOVER_S * np.asarray(power_W, dtype=float), np.asarray(efficiency, dtype=float)
