"""State of the explorer: changes of a mission, a problem, and the controls that set them."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any, get_args

import numpy as np

from formulations.formulation import Formulation
from optuav.errors import Fault, InputError, collected, refuse
from optuav.explorer.pictures import PICTURES
from optuav.fields import Range
from optuav.mission import Mission
from optuav.mission.keys import stated_value
from optuav.mission.messages import number, shown, unknown
from optuav.options import ORDERS, ORDERS_OF_SEVERAL, TRAJECTORIES, Perspective, ProblemName
from optuav.plan.display import round_step
from optuav.presentation.numbers import significant
from optuav.solving.question import MOST_FREE, problem_of

DEVICE, LASER = "link.device_m", "laser.position_m"  # Places that can be moved, beside roofs
SWITCHED = "limits.keep_soc"  # Set by the switch beside the slider of η0
ROOF = re.compile(r"buildings\.(.+)\.position_m")
MOST_SLIDER_STEPS = 200
HIGHEST_SOC = 0.95  # End of the slider of η0, which must be less than 1
TIME = Range("s", gt=0.0, le=1e9)
FILES = ("mission", "plan")
OPTIONS: Mapping[str, tuple[str, ...]] = {
    "problem": get_args(ProblemName),
    "perspective": get_args(Perspective),
    "trajectory": TRAJECTORIES,
    "order": ORDERS_OF_SEVERAL,
}
"""The values of each option that has names."""
CURRENT = ("Charging current", "I_ch", "A")
WORDS = {
    "limits.deadline_s": ("Deadline", "T_max", "s"),
    "limits.min_soc": ("Charge left", "η₀", "%"),
    "battery.capacity_As": ("Capacity of a pack", "B_i", "A s"),
    "laser.power_W": ("Laser power", "P_s", "W"),
    "battery.charge_current_A": CURRENT,
    "flight.charge_current_A": CURRENT,
}
"""Words, symbol and unit of the sliders by key."""
READ_IN = {"%": ("%", 0.01), "A s": ("Ah", 3600.0), "rad": ("µrad", 1e-6)}
"""Units that a reader sees, with their size, by the unit of a key; others are read as stated."""


def options_of(mission: Mission) -> dict[str, Sequence[str]]:
    """The values of each option that has names, as far as a mission has them."""
    ways, orders = (*TRAJECTORIES,), (*ORDERS,)
    if mission.devices:
        ways, orders = ("optimal", "direct"), (*ORDERS_OF_SEVERAL,)
    return {**OPTIONS, "trajectory": ways, "order": orders, "building": mission.buildings.names}


def device_keys(mission: Mission) -> list[str]:
    """The key of each device's position, in the order of the mission."""
    names = [device.name for device in mission.devices]
    return [f"devices.{name}.position_m" for name in names] or [DEVICE]


def stated_order(mission: Mission) -> tuple[str, ...] | None:
    """The order of devices that are too many to compare all orders: the mission's; None of few."""
    names = tuple(device.name for device in mission.devices)
    return names if len(names) > MOST_FREE else None


@dataclass(frozen=True)
class State:
    """A question to the explorer, as the page states it and a link keeps it."""

    changes: Mapping[str, Any] = field(default_factory=dict)  # By mission key
    problem: ProblemName = "P1"
    perspective: Perspective = "available"
    trajectory: str | None = None
    building: str | None = None  # With one, P4 in place of P1
    order: str | None = None
    picture: str | None = None  # Of `PICTURES`, the one in place of the plane
    repairs: bool = False  # Whether to seek changes that make an infeasible mission feasible
    file: str | None = None  # Of `FILES`, one whose text is wanted too
    number: int = 0  # Number of the question, which the answer repeats
    axes: Sequence[float] = ()  # Highest rest and hover time of the plane [s]; chosen if empty

    @classmethod
    def of(cls, stated: object) -> "State":
        """The state that plain data state; refused with all that is wrong."""
        if not isinstance(stated, Mapping) or not isinstance(stated.get("changes", {}), Mapping):
            raise InputError([Fault("", shown(stated), "a state with changes by mission key")])
        names = [member.name for member in fields(cls)]
        faults = [unknown("state", name, names) for name in stated if name not in names]
        options = {**OPTIONS, "file": FILES, "picture": (*PICTURES,)}
        faults += [
            unknown(name, stated[name], choices)
            for name, choices in options.items()
            if stated.get(name) is not None and stated[name] not in choices
        ]
        building = stated.get("building")
        if building is not None and not isinstance(building, str):
            faults.append(Fault("building", shown(building), "the name of a building"))
        if not isinstance(stated.get("number", 0), int):
            faults.append(Fault("number", shown(stated["number"]), "a whole number"))
        axes = stated.get("axes") or []
        if [*map(TIME.accepts, axes if isinstance(axes, list) else [axes])] not in ([], 2 * [True]):
            faults.append(Fault("axes", shown(axes), f"none or two: {TIME.words}"))
        refuse(faults)
        return cls(**{name: value for name, value in stated.items() if value is not None})

    def question(self, mission: Mission) -> Formulation:
        """The problem over a mission with its options."""
        options: dict[str, Any] = {"order": self.order, "device_order": stated_order(mission)}
        if self.building is not None:
            return problem_of("P4", building=self.building, **options)
        return problem_of(self.problem, trajectory=self.trajectory, **options)

    def mission(self, base: Mission) -> Mission:
        """A mission with the changes; footprints move with their roofs."""
        allowed, values, faults = {control.key for control in controls(base)}, dict[str, Any](), []
        allowed |= {SWITCHED, *device_keys(base), *([LASER] if base.laser else [])}
        for key, value in self.changes.items():
            roof = ROOF.fullmatch(key)
            if key not in allowed and (roof is None or roof[1] not in base.buildings.names):
                faults.append(Fault(key, shown(value), "cannot be changed in the explorer"))
                continue
            values[key] = value
            if roof is not None:
                values |= _moved(base, roof[1], value)
        with collected(faults):
            changed = base.replace(values) if values else base
        refuse(faults)
        return changed


def _moved(base: Mission, name: str, position_m: object) -> dict[str, Any]:
    """The footprint of a building whose roof moves, where it is a polygon on the map."""
    building = base.buildings[base.buildings.names.index(name)]
    footprint = building.footprint_m
    if not footprint or not isinstance(footprint[0], tuple):
        return {}
    try:
        step_m = np.subtract(np.asarray(position_m, dtype=float), building.position_m)[:2]
    except (TypeError, ValueError):
        return {}  # The position itself is refused
    return {f"buildings.{name}.footprint_m": np.add(footprint, step_m).tolist()}


@dataclass(frozen=True)
class Control:
    """A slider and the field beside it, for a number or one component of a vector."""

    key: str
    axis: int | None
    label: str
    symbol: str
    unit: str  # As a reader sees it
    scale: float  # Size of that unit in the unit of the key
    low: float
    high: float
    step: float  # A round number of the unit that is seen
    value: float


def controls(mission: Mission) -> Iterator[Control]:
    """The sliders of a mission, around its own values."""
    keys = ["limits.deadline_s", "limits.min_soc", "battery.capacity_As"]
    if mission.laser is not None:
        fixed = stated_value(mission, "flight.charge_current_A") is not None
        charging = "flight" if fixed else "battery"
        keys += ["laser.power_W", f"{charging}.charge_current_A"]
    for key in keys:
        allowed, value = number(key), stated_value(mission, key) or 0.0
        high = HIGHEST_SOC if key == "limits.min_soc" else 2.0 * value or 10.0
        low = 0.0 if allowed and allowed.ge == 0.0 else None
        yield _control(key, None, *WORDS[key], low, high, value)
    sliders = [
        *(mission.beam.sliders() if mission.beam else ()),
        *mission.flight_model.sliders(),
    ]
    for key, axis, label, symbol, unit, low, high in sliders:
        value = stated_value(mission, key if axis is None else f"{key}[{axis}]") or 0.0
        yield _control(key, axis, label, symbol, unit, low, high, value)


def _control(
    key: str,
    axis: int | None,
    label: str,
    symbol: str,
    unit: str,
    low: float | None,
    high: float,
    value: float,
) -> Control:
    """A control of a range in the unit of a key; without a lower end, from its first step on."""
    read_in, scale = READ_IN.get(unit, (unit, 1.0))
    step = significant(round_step(high / scale, MOST_SLIDER_STEPS) * scale, 12)
    low = step if low is None else low
    return Control(key, axis, label, symbol, read_in, scale, low, high, step, value)
