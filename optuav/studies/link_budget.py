"""The link budget: light and power on the way from the laser to a place."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from optuav.errors import Fault, InputError, refuse
from optuav.fields import COORDINATE, Range
from optuav.frames import DataFrame, frame
from optuav.laser.beam import BEAMS, SpreadingBeam
from optuav.mission import Mission, load
from optuav.mission.keys import quantity
from optuav.mission.messages import misfits, nearest, shown
from optuav.network import vehicle
from optuav.network.obstacles import CLEAR, crossed
from optuav.network.places import build_places
from optuav.network.prisms import prisms
from optuav.presentation.blocks import Block, Note, Table
from optuav.presentation.numbers import coordinates, figure
from optuav.presentation.presented import Presented

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LEAST_DECREASE = 1e-9  # Smallest relative decrease of a power that a limit counts for
POWER = Range("W", ge=-1e9, le=1e9)


class Station(NamedTuple):
    """Words of a station on the way of the power, the power there [W], and whether it is electric.

    Examples
    --------
    >>> from optuav.studies.link_budget import Station
    >>> Station("light", 2000.0).electric
    False
    """

    words: str
    power_W: float
    electric: bool = False


@dataclass(frozen=True)
class LinkBudget(Presented):
    """Light and power on the way from the laser to a place, as its fields.

    `reach_m` returns the reach of a power, `plot` draws a picture, `to_frame` makes a table.

    Parameters
    ----------
    place
        Name of the place, or its coordinates as text.
    distance_m, in_sight
        Distance from the laser [m], and whether no building is in between. The figures below are
        for clear sight.
    light_W, after_aperture_W, air
        Light that leaves the source and its aperture [W], and the share that the air transmits [-].
    share, on_receiver_W
        Mean share of the arriving light on the receiver [-], and that light [W], before limits.
    dc_W, current_A
        DC power [W] and current into the battery [A], within all limits.
    peak_irradiance_W_m2
        Mean irradiance on the axis, at the place [W/m²].
    limit
        Key and value of the limit that lowers the power; None if no limit does.
    hazard_distance_m, eye_limit_W_m2
        Distance where the beam falls to the limit for the eye [m], and that limit [W/m²]; NaN
        if none is known. This is not a safety assessment.
    charging_limit_W
        Largest power that the battery accepts [W].

    Examples
    --------
    >>> import optuav
    >>> keys = {"beam": "divergence", "aperture_m": 0.1, "divergence_rad": 3.4e-5, "power_W": 600}
    >>> keys |= {"attenuation_per_km": 1e-3}
    >>> laser = {f"laser.{key}": value for key, value in keys.items()}
    >>> others = {"receiver.area_m2": 0.004, "battery.charge_current_A": 50}
    >>> mission = optuav.load("paper").replace(laser | others)
    >>> round(optuav.link_budget(mission, "b7").reach_m(168.5))
    568
    """

    place: str
    distance_m: float
    in_sight: bool
    light_W: float
    after_aperture_W: float
    air: float
    share: float
    on_receiver_W: float
    dc_W: float
    current_A: float
    peak_irradiance_W_m2: float
    limit: str | None
    hazard_distance_m: float
    eye_limit_W_m2: float
    charging_limit_W: float
    beam: SpreadingBeam = field(repr=False, compare=False)

    def reach_m(self, dc_W: float) -> float:
        """Return the largest distance [m] with at least this DC power [W].

        The distance is along the line to the place, in clear sight: 0 if no distance delivers the
        power, infinite if every distance does. Raises `InputError` for a number beyond ±1e9.
        """
        refuse(misfits(("dc_W", dc_W, POWER)))
        return self.beam.reach_m(dc_W, self.charging_limit_W)

    def rows(self) -> list[tuple[str, float, str]]:
        """Names, values and units of the figures, in the order of the way."""
        return [
            ("distance", self.distance_m, "m"),
            ("light of the source", self.light_W, "W"),
            ("light behind the aperture", self.after_aperture_W, "W"),
            ("share through the air", self.air, "-"),
            ("share on the receiver", self.share, "-"),
            ("light on the receiver", self.on_receiver_W, "W"),
            ("DC power", self.dc_W, "W"),
            ("current into the battery", self.current_A, "A"),
            ("peak irradiance", self.peak_irradiance_W_m2, "W/m²"),
            ("hazard distance", self.hazard_distance_m, "m"),
            ("limit for the eye", self.eye_limit_W_m2, "W/m²"),
        ]

    def to_frame(self) -> DataFrame:
        """Return one row per figure: quantity, value and unit; needs pandas."""
        return frame(self.rows(), ["quantity", "value", "unit"])

    def remarks(self) -> list[str]:
        """Sentences on sight, limits and the eye."""
        sight = None if self.in_sight else "a building hides the laser: no charging there"
        limit = self.limit and f"{self.limit} limits the power"
        bound = self.limit and self.beam.limit_warning()
        return [*filter(None, (sight, limit, bound, self.beam.eye_warning))]

    def blocks(self) -> Iterator[Block]:
        """Yield the figures in the order of the way, and remarks."""
        rows = [(name, figure(value), unit) for name, value, unit in self.rows()]
        above = f"Link budget at {self.place}"
        yield Table(["quantity", "value", "unit"], rows, last=1, longest=26, above=above)
        yield Note(self.remarks())

    def stations(self) -> list[Station]:
        """Power on its way from the source to the battery, station by station."""
        source_W = self.beam.laser.power_W
        source = [Station("source", source_W, electric=True)] if source_W != self.light_W else []
        return [
            *source,
            Station("light", self.light_W),
            Station("behind aperture", self.after_aperture_W),
            Station("through the air", self.after_aperture_W * self.air),
            Station("on the receiver", self.on_receiver_W),
            Station("DC", float(self.beam.chain(self.distance_m).dc_W), electric=True),
            Station("into the battery", self.dc_W, electric=True),
        ]

    def plot(self, *, ax: Axes | None = None) -> Axes:
        """Draw the power at each station as a waterfall, and return the axes; needs matplotlib."""
        from optuav import plots  # noqa: F401 - says how to install matplotlib
        from optuav.plots.charts import waterfall
        from optuav.plots.style import titled

        title = titled(self.place, "power from the laser", f"{figure(self.distance_m, 4)} m away")
        return waterfall(self.stations(), title=title, ax=ax)


def link_budget(mission: Mission | str | Path, at: str | Sequence[float]) -> LinkBudget:
    """Compute light and power at each stage from the laser to a place.

    Parameters
    ----------
    mission
        A mission with ``laser.beam``, or its name or path.
    at
        Name of a place ("origin", "hover" or of several devices one, "destination" or a building),
        or its x, y and z [m].

    Returns
    -------
    LinkBudget
        The figures as attributes, a table when printed, and a picture by `plot`.

    Raises
    ------
    InputError
        If the mission has no beam, or the place is unknown or out of reach of the device.

    Examples
    --------
    >>> import optuav
    >>> keys = {"beam": "gaussian", "aperture_m": 0.3, "source_efficiency": 0.4, "power_W": 5000}
    >>> laser = {f"laser.{key}": value for key, value in keys.items()}
    >>> receiver = {"radius_m": 0.25, "cell_efficiency": 0.45}
    >>> mission = optuav.load("paper").replace({**laser, "receiver": receiver})
    >>> budget = optuav.link_budget(mission, "hover")
    >>> round(budget.light_W), round(budget.share, 4), budget.limit
    (2000, 1.0, 'battery.charge_current_A = 10 A')
    """
    mission = load(mission)
    if not isinstance(beam := mission.beam, SpreadingBeam):
        able = [shown(name) for name, kind in BEAMS.items() if issubclass(kind, SpreadingBeam)]
        words, value = f"must be {' or '.join(able)}, a beam that spreads", ""
        if mission.laser and mission.laser.beam:
            value = shown(mission.laser.beam)
        raise InputError([Fault("laser.beam", value, words if value else f"is missing; {words}")])
    name, number, place_m = _place(mission, at)
    away_m = float(vehicle.laser_distance_m(mission, place_m))
    chain, most_W = beam.chain(away_m), vehicle.charging_limit_W(mission)
    dc_W = float(beam.received_W(away_m, most_W))
    key = beam.limiting_key(away_m, most_W)
    limit = (
        f"{key} = {quantity(mission, str(key))}"
        if dc_W < (1.0 - LEAST_DECREASE) * chain.dc_W
        else None
    )
    ends_m = np.array([beam.laser.position_m]), np.array([place_m])
    blocker = crossed(prisms(mission.buildings), *ends_m, np.array([[number]]))
    return LinkBudget(
        place=name,
        distance_m=away_m,
        in_sight=bool(blocker[0] == CLEAR),
        light_W=float(chain.light_W),
        after_aperture_W=float(chain.after_aperture_W),
        air=float(chain.air),
        share=float(chain.share),
        on_receiver_W=float(chain.on_receiver_W),
        dc_W=dc_W,
        current_A=dc_W / mission.battery.nominal_voltage_V,
        peak_irradiance_W_m2=float(chain.after_aperture_W * chain.air * beam.peak(away_m)),
        limit=limit,
        hazard_distance_m=beam.hazard_distance_m,
        eye_limit_W_m2=beam.eye_limit_W_m2,
        charging_limit_W=float(most_W),
        beam=beam,
    )


def _place(mission: Mission, at: Any) -> tuple[str, int, tuple[float, float, float]]:
    """Name, number of the building or `CLEAR`, and position [m] of a place."""
    if isinstance(at, str):
        places = build_places(mission)
        if at not in places.names:
            words = f"a place of the mission or its x, y and z [m]{nearest(at, places.names)}"
            raise InputError([Fault("at", shown(at), words)])
        place = places.names.index(at)
        x, y, z = map(float, places.position_m[place])
        if math.isnan(x):
            raise InputError([Fault("at", shown(at), "a place that exists: none is in reach")])
        return at, max(place - places.first_building, CLEAR), (x, y, z)
    components = [*at] if isinstance(at, Sequence | np.ndarray) else []
    if len(components) != 3 or not all(map(COORDINATE.accepts, components)):
        words = "the name of a place, or its x, y and z, each"
        raise InputError([Fault("at", shown(at), f"{words} {COORDINATE.words}")])
    x, y, z = map(float, components)
    return f"{coordinates((x, y, z))} m", CLEAR, (x, y, z)
