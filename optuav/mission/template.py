"""A mission to start from: a commented file, or one made of a drone's datasheet."""

import math
import textwrap
from abc import abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import tomli_w
from pydantic import ValidationError

from optuav.errors import Fault, InputError, refuse
from optuav.fields import MissionSection, Range
from optuav.mission.buildings import Buildings
from optuav.mission.files import STANDARD, relative_to
from optuav.mission.forms import SCHEMA
from optuav.mission.load import load
from optuav.mission.messages import range_in_words, shown, unlisted
from optuav.mission.mission import Mission, without_none
from optuav.mission.validation import StatedMission, breaches_of
from optuav.options import BATTERIES, BatteryName
from optuav.physics.cells import CELLS, kind_of
from optuav.presentation.numbers import figure, percent, seconds

SCENE = "matrice350"
"""The shipped mission whose places, limits, link and laser stand in for the owner's."""

CELL_V = 3.7  # Nominal voltage of a lithium-polymer cell
REST_SHARE = 0.02
"""Power at rest over power in hover, an assumption: electronics awake, rotors stopped."""

GRAVITY_M_S2 = 9.8
MOTION = {"climb_speed_m_s": 5.0, "descent_speed_m_s": 4.0, "acceleration_m_s2": 2.5}
"""Speeds and acceleration assumed for a drone whose rotors and fuselage are known."""

Minutes = Annotated[float, Range("min", ge=1, le=1e4)]
Watts = Annotated[float, Range("W", ge=1, le=1e6)]

INSTEAD = {"hover_power_W": "hover_min", "cruise_power_W": "cruise_min"}
"""Powers that may be stated in place of times."""
HOVERED = "hover_min", "hover_power_W"
REGIMES = {"hover": HOVERED, "rest": HOVERED, "flight": ("cruise_min", "cruise_power_W", *HOVERED)}
LOADED = "packs", "cells", "capacity_mAh", "mass_kg", "payload_kg"
"""Fields of a datasheet that decide the draw of each regime, and of all."""
DISC = "rotors", "rotor_radius_m"
BLADES = *DISC, "blade_solidity", "tip_speed_m_s"
LIFTED = "mass_kg", "payload_kg", *DISC
"""Fields of rotors that decide the power of blades and of lift."""


def wells_of(battery: BatteryName) -> dict[str, float]:
    """The wells of a kind of cells, by dotted key."""
    refuse(unlisted(("battery", battery, BATTERIES)))
    wells = CELLS[battery]
    return {
        "battery.available_fraction": wells.available_fraction,
        "battery.flow_rate_per_s": wells.flow_rate_per_s,
    }


def template(
    mission: Mission,
    name: str,
    remarks: Sequence[str] = (),
    file: Path = STANDARD,
    *,
    battery: BatteryName | None = None,
) -> str:
    """The text of a TOML file with a mission's values, with an explanation of every key.

    Keys that are not set stand there as comments; the remarks are lines for the head of the file. A
    table of buildings is named by its path from the folder of the file. A battery by name gets the
    wells of such cells; a comment says where known wells come from.
    """
    if battery is not None:
        mission = mission.replace(wells_of(battery))
    source, listed = mission.buildings.source, mission.buildings
    lines = [
        "# A mission for optuav. Change what differs in yours; `optuav validate` checks the file.",
        "# Lengths in metres, ground at z = 0; every key carries its unit as a suffix.",
        *(f"# {remark}" for remark in remarks),
        "",
        f"schema = {SCHEMA}",
        f"name = {_shown(name)}",
        'description = ""',
        *(f"# {line}" for line in Mission.descriptions()["crs"].splitlines()),
        f"crs = {_shown(mission.crs)}" if mission.crs else "# crs =",
    ]
    if source:
        lines.append(f"buildings_file = {_shown(relative_to(file, source.path))}")
        listed = Buildings()
    for key in Mission.model_fields:
        table = getattr(mission, key)
        if isinstance(table, MissionSection):
            lines += ["", f"[{key}]", *(_wells_remarks(table) if key == "battery" else ())]
            lines += _entries(table, explained=True)
    for key, items in (("devices", mission.devices), ("buildings", listed)):
        for number, item in enumerate(items):
            lines += ["", f"[[{key}]]", *_entries(item, explained=number == 0)]
    return "\n".join(lines) + "\n"


def _wells_remarks(battery: Any) -> Iterator[str]:
    """Lines of comment on wells that are those of a kind of cells."""
    name = kind_of(battery.available_fraction, battery.flow_rate_per_s)
    if name is None:
        return
    wells = CELLS[name]
    fitted = behind = rated = ""
    if wells.most_C is not None:
        fitted = f", to {figure(wells.most_C)} C"
        rated = "capacity_As is the rated charge of a pack, at 0.2 C until the cut-off. "
    if wells.least_lag_s < wells.largest_lag_s:
        behind = f"; over such cells {figure(wells.least_lag_s)} to {figure(wells.largest_lag_s)} s"
    elif round(wells.lag_s) != wells.least_lag_s:
        behind = (
            ", chosen so as not to last longer; the one cell behind it "
            f"{figure(wells.least_lag_s)} s"
        )
    words = (
        f"Wells `{name}`: {wells.source}{fitted}. Lag (1−ω)²/k_F "
        f"{seconds(wells.lag_s, 0)}{behind}. {rated}Calibrate with your own lifetimes: optuav "
        "calibrate kibam."
    )
    yield from (f"# {line}" for line in textwrap.wrap(words, 98, break_on_hyphens=False))


def _entries(table: MissionSection, *, explained: bool) -> Iterator[str]:
    """Lines of a table; explained, each key has a comment, and those not set stand there too."""
    for key, value in table.model_dump(mode="json").items():
        if explained:
            yield from (f"# {line}" for line in table.descriptions().get(key, "").splitlines())
        if value is not None:
            yield f"{key} = {_shown(value)}"
        elif explained:
            yield f"# {key} ="


def _shown(value: object) -> str:
    """A value as TOML writes it; a whole number as one."""
    if isinstance(value, list):
        return f"[{', '.join(_shown(entry) for entry in value)}]"
    if isinstance(value, float) and value.is_integer() and abs(value) < 1e9:
        value = int(value)
    return tomli_w.dumps({"x": value}).partition("=")[2].strip()


class Drone(MissionSection):
    """Fields of every datasheet of a multirotor, and what follows from them."""

    mass_kg: Annotated[float, Range("kg", ge=0.05, le=1000)]
    """Take-off mass of the published flight times [kg]."""
    payload_kg: Annotated[float, Range("kg", ge=0, le=1000)] = 0.0
    """Mass carried in addition, such as the receiver of the laser [kg]."""
    packs: Annotated[int, Range("-", ge=1, le=100, whole=True)] = 1
    """Number of battery packs [-]."""
    cells: Annotated[int, Range("-", ge=1, le=100, whole=True)]
    """Cells of a pack in series [-]."""
    capacity_mAh: Annotated[float, Range("mAh", ge=10, le=1e6)]
    """Capacity of one pack [mAh]."""
    cruise_speed_m_s: Annotated[float, Range("m/s", ge=0.5, le=100)]
    """Cruise speed [m/s]."""
    reserve_percent: Annotated[float, Range("%", ge=0, le=90)] = 20.0
    """Charge that must be left after landing [%]."""
    laser_power_W: Annotated[float, Range("W", ge=0, le=1e6)] = 5000.0
    """Power that the laser draws [W]."""
    battery: BatteryName = "lipo"
    """Kind of cells, which determines the wells: lipo, liion or paper."""

    sources: ClassVar[Mapping[str, tuple[str, ...]]] = {}
    """Keys of [flight] that follow from the fields, each with these fields."""

    if not TYPE_CHECKING:  # which knows the fields by their annotations

        def __init__(self, **stated: Any) -> None:
            settings = without_none(stated)
            faults = [*self.misfits(settings)]
            try:
                super().__init__(**settings)
            except ValidationError as error:
                document = StatedMission(settings)
                faults += document.faults(breaches_of(type(self), error, document))
            refuse(faults)

    @classmethod
    def misfits(cls, stated: Mapping[str, Any]) -> Iterator[Fault]:
        """Values that exclude each other, or miss a partner."""
        yield from ()

    @property
    def voltage_V(self) -> float:
        """Nominal voltage of a pack [V]."""
        return self.cells * CELL_V

    def placed(self, flight: Mapping[str, object]) -> Mission:
        """The drone with its keys of flight, in the places of the shipped mission `matrice350`.

        `InputError` if fields together give a key beyond its range.
        """
        keys = {
            "name": "drone",
            "description": "",
            "limits.min_soc": self.reserve_percent / 100.0,
            "battery.packs": self.packs,
            "battery.capacity_As": self.capacity_mAh * 3.6,
            "battery.nominal_voltage_V": round(self.voltage_V, 3),
            **wells_of(self.battery),
            "battery.charge_current_A": round(self.packs * self.capacity_mAh / 1000.0, 4),
            "laser.power_W": self.laser_power_W,
            "flight.max_speed_m_s": self.cruise_speed_m_s,
            **flight,
        }
        try:
            return load(SCENE).replace(keys)
        except InputError as error:
            raise InputError(map(self._stated, error.faults)) from None

    def _stated(self, fault: Fault) -> Fault:
        """The fault of a key of the mission in terms of the fields that it follows from."""
        names = self.sources.get(fault.key.removeprefix("flight."), ())
        values = {name: getattr(self, name) for name in names}
        settings = {name: _shown(value) for name, value in values.items() if value is not None}
        if not settings:
            return fault
        words = f"together must give {fault.key}, {fault.allowed}; together they give {fault.value}"
        return Fault(", ".join(settings), ", ".join(settings.values()), words)

    def remarks(self) -> tuple[str, ...]:
        """Lines on the sources of the mission, and its assumptions."""
        values = self.model_dump(exclude_none=True).items()
        return (*(f"{name} = {_shown(value)}" for name, value in values), *self.assumptions())

    def assumptions(self) -> list[str]:
        """Lines of the mission that go beyond the datasheet."""
        return textwrap.wrap(
            f"Assumed: {figure(CELL_V)} V per cell, charging at 1 C, {percent(REST_SHARE)} of the "
            f"hover power at rest, wells `{self.battery}` ({CELLS[self.battery].source}), and "
            f"{self.assumed}. Places, buildings, link, air and laser ({figure(self.laser_power_W)} "
            f"W) come from the mission {SCENE}: replace them with your own.",
            width=78,
        )

    @abstractmethod
    def mission(self) -> Mission:
        """The drone in the places of the shipped mission `matrice350`."""

    @property
    @abstractmethod
    def assumed(self) -> str:
        """Assumptions of this kind of datasheet, in words."""


class Datasheet(Drone):
    """Datasheet of a multirotor; `mission` makes a mission of it.

    Parameters
    ----------
    mass_kg, payload_kg
        Take-off mass of the published flight times, 0.05 to 1000, and the payload on top, such as
        the receiver of the laser, 0 to 1000, by default 0 [kg].
    packs, cells, capacity_mAh
        Battery packs and cells of a pack in series, 1 to 100, one pack by default; capacity of one
        pack [mAh], 10 to 1e6.
    hover_min, cruise_min
        Times until the battery is empty, without payload [min], 1 to 1e4: in hover, and in flight
        at cruise speed, which by default lasts as long.
    hover_power_W, cruise_power_W
        Power without payload [W], 1 to 1e6, in place of the time.
    cruise_speed_m_s, reserve_percent, laser_power_W
        Cruise speed [m/s], 0.5 to 100; charge that must be left after landing [%], 0 to 90, by
        default 20; power that the laser draws [W], 0 to 1e6, by default 5000.
    battery
        Kind of cells, which determines the wells: ``"lipo"`` (power pouch cells, the default),
        ``"liion"`` (21700 energy cells, up to 2 C) or ``"paper"``.

    Examples
    --------
    >>> import optuav
    >>> drone = optuav.Datasheet(
    ...     mass_kg=6.3, packs=2, cells=12, capacity_mAh=5000, hover_min=41, cruise_speed_m_s=12
    ... )
    >>> mission = drone.mission()
    >>> mission.flight.hover_current_A
    14.6341
    """

    sources: ClassVar[Mapping[str, tuple[str, ...]]] = {
        f"{regime}_{figure}": (*draw, *LOADED)
        for regime, draw in REGIMES.items()
        for figure in ("current_A", "power_W")
    }

    hover_min: Minutes | None = None
    """Hover time without payload until the battery is empty [min]."""
    cruise_min: Minutes | None = None
    """Flight time at cruise speed until empty; without it the hover time [min]."""
    hover_power_W: Watts | None = None
    """Instead of hover_min: power in hover without payload [W]."""
    cruise_power_W: Watts | None = None
    """Instead of cruise_min: power at cruise speed without payload [W]."""

    @classmethod
    def misfits(cls, stated: Mapping[str, Any]) -> Iterator[Fault]:
        """Yield faults: both a time and its power are set, or neither for the hover."""
        for power, minutes in INSTEAD.items():
            if {power, minutes} <= stated.keys():
                yield Fault(power, shown(stated[power]), f"either {power} or {minutes}")
        if stated.keys().isdisjoint(("hover_min", "hover_power_W")):
            words = f"is missing; {range_in_words(cls, 'hover_min')}; or set hover_power_W"
            yield Fault("hover_min", "", words)

    @property
    def load_factor(self) -> float:
        """Power with over power without payload [-], by the momentum theory of rotors.

        Hover power grows with the mass to the power of 3/2 (W. Johnson, "Helicopter Theory",
        Dover, 1994, chapter 2).
        """
        return math.sqrt((1.0 + self.payload_kg / self.mass_kg) ** 3)

    def mission(self) -> Mission:
        """The drone in the places of the shipped mission `matrice350`.

        The currents empty the packs in the times of the datasheet, times `load_factor`; the powers
        follow from the nominal voltage. Packs charge at 1 C at most. The acceleration, the link and
        the laser, except for its power, come from that mission.
        """
        charge_As = self.packs * self.capacity_mAh * 3.6

        def current_A(minutes: float | None, power_W: float | None) -> float:
            empty_A = charge_As / (minutes * 60.0) if minutes else 0.0
            return (power_W / self.voltage_V if power_W else empty_A) * self.load_factor

        hover_A = current_A(self.hover_min, self.hover_power_W)
        flight_A = current_A(self.cruise_min, self.cruise_power_W) or hover_A
        currents_A = {"flight": flight_A, "hover": hover_A, "rest": REST_SHARE * hover_A}
        loads = dict[str, float]()
        for regime, load_A in currents_A.items():
            loads[f"flight.{regime}_current_A"] = round(load_A, 4)
            loads[f"flight.{regime}_power_W"] = round(load_A * self.voltage_V, 2)
        return self.placed(loads)

    @property
    def assumed(self) -> str:
        """The growth of the power with the mass."""
        loaded = (
            f" ({figure(self.load_factor, 4)} times with the payload)" if self.payload_kg else ""
        )
        return f"2.8 times the power for twice the mass{loaded}"


class RotorDatasheet(Drone):
    """Datasheet of rotors and fuselage; `mission` makes a rotary-wing mission of it.

    The power against airspeed follows Y. Zeng, J. Xu, R. Zhang, IEEE Transactions on Wireless
    Communications, 2019, eqs (61)-(65).

    Parameters
    ----------
    mass_kg, payload_kg, packs, cells, capacity_mAh, reserve_percent, laser_power_W, battery
        As in `Datasheet`; the mass without the payload.
    cruise_speed_m_s
        Largest air speed [m/s], 0.5 to 100.
    rotors, rotor_radius_m
        Number of rotors, 1 to 100, by default 4, and their radius [m], 0.01 to 20.
    blade_solidity, tip_speed_m_s
        Share of a rotor's disc that its blades fill [-], 0.001 to 1, and the speed of their tips in
        hover [m/s], 1 to 340.
    drag_ratio
        Drag area of the fuselage over the area of all blades [-], 0 to 100.
    efficiency
        Share of the battery's power that reaches the rotors [-], up to 1, by default 0.75.

    Examples
    --------
    >>> import optuav
    >>> drone = optuav.RotorDatasheet(
    ...     mass_kg=2.04, cells=6, capacity_mAh=5000, cruise_speed_m_s=20, rotor_radius_m=0.2,
    ...     blade_solidity=0.05, tip_speed_m_s=120, drag_ratio=0.3,
    ... )
    >>> round(drone.mission().flight.induced_speed_m_s, 2)
    4.03
    """

    sources: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "blade_power_W": BLADES,
        "induced_power_W": LIFTED,
        "induced_speed_m_s": LIFTED,
        "parasite_W_s3_m3": (*DISC, "blade_solidity", "drag_ratio"),
        "rest_current_A": (*LIFTED, *BLADES[2:], "efficiency", "cells"),
        "rest_power_W": (*LIFTED, *BLADES[2:], "efficiency"),
    }

    rotors: Annotated[int, Range("-", ge=1, le=100, whole=True)] = 4
    """Number of rotors [-]."""
    rotor_radius_m: Annotated[float, Range("m", ge=0.01, le=20)]
    """Radius of a rotor [m]."""
    blade_solidity: Annotated[float, Range("-", ge=1e-3, le=1)]
    """Share of a rotor's disc that its blades fill [-]."""
    tip_speed_m_s: Annotated[float, Range("m/s", ge=1, le=340)]
    """Speed of the blade tips in hover [m/s]."""
    drag_ratio: Annotated[float, Range("-", ge=0, le=100)]
    """Drag area of the fuselage over the area of all blades [-]."""
    efficiency: Annotated[float, Range("-", ge=0.01, le=1)] = 0.75
    """Share of the battery's power that reaches the rotors [-]."""

    def mission(self) -> Mission:
        """The drone in the places of the shipped mission `matrice350`, as a rotary wing."""
        from optuav.physics import rotary_wing

        mass_kg = self.mass_kg + self.payload_kg
        disc_m2 = self.rotors * math.pi * self.rotor_radius_m**2
        blades = self.blade_solidity, self.tip_speed_m_s
        weight_N = mass_kg * GRAVITY_M_S2
        wing = rotary_wing.coefficients(disc_m2, *blades, weight_N, self.drag_ratio)
        hover_W = float(rotary_wing.power(wing, 0.0)) / self.efficiency
        keys = {name: round(float(value), 6) for name, value in wing._asdict().items()} | {
            "model": "rotary-wing",
            "efficiency": self.efficiency,
            **MOTION,
            "rest_current_A": round(REST_SHARE * hover_W / self.voltage_V, 4),
            "rest_power_W": round(REST_SHARE * hover_W, 2),
        }
        flight = {f"flight.{name}": value for name, value in keys.items()}
        body = {"mass_kg": round(mass_kg, 6), "gravity_m_s2": GRAVITY_M_S2}
        # The radio adds to the power of this model, unlike to the loads of regimes.
        radio = {"link.transmit_voltage_V": round(self.voltage_V, 3)}
        return self.placed({"body": body, **radio, **flight})

    @property
    def assumed(self) -> str:
        """The motion, and the coefficients of blades and lift."""
        climb, descent, gain = MOTION.values()
        return (
            f"{figure(gain)} m/s² of acceleration, {figure(climb)} m/s up and {figure(descent)} "
            f"m/s down, air of 1.225 kg/m³, rotors with {percent(self.efficiency)} of the "
            "battery's power, and a radio fed by the pack"
        )
