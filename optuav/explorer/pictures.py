"""Pictures in place of the plane, computed while their tab is open: beam, speed and day."""

from collections.abc import Callable, Iterator, Mapping
from itertools import islice
from typing import Any, TypeAlias

import numpy as np

from optuav.diagnosis.in_words import sentence
from optuav.errors import InputError, NoPlanError
from optuav.laser.beam import SpreadingBeam
from optuav.network import vehicle
from optuav.network.network import Network
from optuav.plan import Plan
from optuav.plan.display import rounded_up
from optuav.presentation.numbers import figure, fixed, percent, watts
from optuav.service.cycle import PERSPECTIVES, Coverage, coverage
from optuav.service.fleet import Fleet
from optuav.solving import Program
from optuav.studies.link_budget import link_budget
from optuav.studies.power_curve import power_curve

MOST_DRONES = 12  # Most drones drawn
TURNS_DRAWN = 2.0  # Turns of a drone that are drawn
LONGER = 2.0  # Factor beyond the axis, for a pinned plan or a control that is moved
PADS = 8  # Powers of pads for counting drones
LEAST_LOSS = 5e-4  # Share that is told as lost
HOUR_S = 3600.0
UNITS_OF_TIME = ((HOUR_S, "h"), (60.0, "min"), (1.0, "s"))

Data: TypeAlias = dict[str, Any]


def pictures(network: Network) -> list[str]:
    """Names of the pictures that a mission has."""
    has = {
        "beam": isinstance(network.mission.beam, SpreadingBeam),
        "speed": network.mission.flight_model.power_over_speed(0.0) is not None,
        "day": True,
    }
    return [name for name in PICTURES if has[name]]


def picture(name: str, program: Program, plan: Plan, building: str | None) -> Data:
    """A picture's data with the ends of its axes, or ``words`` on why none exists."""
    try:
        return {"name": name, **PICTURES[name](program, plan, building)}
    except NoPlanError as error:
        return {"name": name, "words": sentence(str(error).removesuffix("."))}
    except InputError as error:  # It begins with the name of a key
        return {"name": name, "words": str(error)}


def _beam(program: Program, plan: Plan, building: str | None) -> Data:
    """Power from the laser to a roof: the chosen one, the plan's, or the one it charges most."""
    places = program.network.places
    strongest = places.first_building + int(np.argmax(places.charge_current_A[places.buildings]))
    roof = building or _rests_at(plan) or places.names[strongest]
    budget = link_budget(program.network.mission, roof)
    stations = budget.stations()
    before_W = [stations[0].power_W, *(station.power_W for station in stations)]
    return {
        "title": f"From the laser to {roof}, {figure(budget.distance_m, 4)} m",
        "stations": [
            {**station._asdict(), "before_W": most_W, "said": _power_words(station.power_W, most_W)}
            for station, most_W in zip(stations, before_W, strict=False)
        ],
        "notes": budget.remarks(),
        "axes": [rounded_up(stations[0].power_W)],
    }


def _power_words(power_W: float, before_W: float) -> str:
    lost = 1.0 - power_W / before_W if before_W else 0.0
    return watts(power_W) + (f", {percent(lost)} lost" if lost > LEAST_LOSS else "")


def _speed(program: Program, plan: Plan, building: str | None) -> Data:
    """Power at the rotors [W] over air speed [m/s], and the speeds that stand out."""
    curve = power_curve(program.network.mission)
    marks = [{"words": "hover, in the wind", "speed_m_s": 0.0, "power_W": curve.hover_power_W}]
    for words, (speed_m_s, power_W) in curve.named.items():
        said = f"{words}: {fixed(speed_m_s, 1)} m/s"
        marks.append({"words": said, "speed_m_s": speed_m_s, "power_W": power_W})
    return {
        "title": "Power against airspeed",
        "speed_m_s": np.round(curve.speeds_m_s, 3).tolist(),
        "power_W": np.round(curve.rotor_power_W, 1).tolist(),
        "marks": marks,
        "notes": [],
        "axes": [*map(rounded_up, (float(curve.speeds_m_s[-1]), float(curve.rotor_power_W.max())))],
    }


def _day(program: Program, plan: Plan, building: str | None) -> Data:
    """Share of the day that one drone covers, the ring that covers all of it, and its pads."""
    mission, perspective = program.network.mission, program.question.perspective
    if perspective not in PERSPECTIVES:
        raise NoPlanError("Judge by the available well or by charge to see the day.")
    cycle = coverage(mission, perspective=perspective)
    roof = building or _rests_at(plan) or cycle.building
    cycle = _cycle_on(cycle, roof)
    fleet = cycle.fleet()
    most_W = vehicle.charging_limit_W(mission)
    end_h = rounded_up(TURNS_DRAWN * fleet.starts_every_s * fleet.drones / HOUR_S)
    turns = [*islice(_turns(fleet, LONGER * end_h), MOST_DRONES)]
    pads = [*_pads(program, most_W, roof)]
    durations_s = {"hover": cycle.hover_s, "flight": cycle.flight_s, "rest": cycle.rest_s}
    durations_s |= {"wait": fleet.rows[0]["wait_s"]}
    some = "; the first ones are drawn" * (fleet.drones > MOST_DRONES)
    return {
        "title": f"One drone on {roof} covers {percent(cycle.share)} of the day",
        "key": [(kind, f"{kind} {lasting(s)}") for kind, s in durations_s.items() if s > 0.0],
        "notes": [
            f"{fleet.drones} drones leave no gap: {fleet.places} places, "
            f"{fleet.beams} beams{some}.",
        ],
        "drones": fleet.drones,
        "turns": turns,
        "pads": pads,
        "most_W": most_W,
        "axes": [
            end_h,
            len(turns),
            rounded_up(most_W),
            rounded_up(1.1 * max(fleet.drones, *(pad["drones"] for pad in pads), 1)),
        ],
    }


def _rests_at(plan: Plan) -> str | None:
    """The roof where a plan rests first; None without a rest."""
    rests = (stop.at for stop in plan.stops if stop.kind == "rest") if plan else ()
    return next((at for at in rests if isinstance(at, str)), None)


def _cycle_on(cycle: Coverage, roof: str | None) -> Coverage:
    """The longest cycle that rests on a roof, so that the day tells of the roof on the map."""
    visits = {visit.building: visit for visit in (cycle.finite_cycle(), *cycle.visits)}
    visit = visits.get(roof or "")
    if visit is None or visit.from_full_s is None or not visit.longest_s:
        raise NoPlanError(f"A drone that rests on {roof} cannot hover in an endless cycle.")
    return cycle.on(visit)


def lasting(time_s: float) -> str:
    """A duration as a person says it: in seconds, minutes or hours, of three digits."""
    size_s, unit = next(
        (size_s, unit) for size_s, unit in UNITS_OF_TIME if time_s >= size_s or size_s == 1.0
    )
    return f"{figure(time_s / size_s, 3)} {unit}"


def _turns(fleet: Fleet, end_h: float) -> Iterator[list[Data]]:
    """Return legs, hovers, rests and waits of each drone of a ring until a time [h]."""
    for row in fleet.rows:
        leg_s, at_h, phases = row["flight_s"] / 2.0, row["offset_s"] / HOUR_S, list[Data]()
        turn = [("flight", leg_s), ("hover", row["hover_s"]), ("flight", leg_s)]
        turn += [("rest", row["rest_s"]), ("wait", row["wait_s"])]
        while at_h < end_h:
            for kind, duration_s in turn:
                phases.append({"kind": kind, "start_h": at_h, "end_h": at_h + duration_s / HOUR_S})
                at_h = phases[-1]["end_h"]
        yield phases


def _pads(program: Program, most_W: float, roof: str | None) -> Iterator[Data]:
    """How many drones leave no gap, by the power of pads on a roof [W]; none for weak pads."""
    mission, perspective = program.network.mission, program.question.perspective
    for power_W in np.linspace(0.0, most_W, PADS + 1)[1:].tolist():
        try:
            by_pads = coverage(mission, perspective=perspective, pad_power_W=power_W)
            fleet = _cycle_on(by_pads, roof).fleet()
        except (InputError, NoPlanError):
            continue
        yield {"power_W": power_W, "drones": fleet.drones}


PICTURES: Mapping[str, Callable[[Program, Plan, str | None], Data]] = {
    "beam": _beam,
    "speed": _speed,
    "day": _day,
}
"""Function that computes each picture."""
