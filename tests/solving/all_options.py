"""Missions over all combinations of options, from hopeless to plenty."""

from __future__ import annotations

from typing import Any

import numpy as np

import optuav
from optuav import Mission
from tests.flight.test_flights import WING

Document = dict[str, Any]
Choice = dict[str, str]

TURNING = ("sequential", "round-robin", "alternating", "most-available")
WINGED = ("best-range", "best-endurance", "max", "cruise", "free")
GAUSSIAN = ("gaussian", "jitter", "turbulence", "jitter and turbulence", "irradiance", "cells")
OPTIONS: dict[str, tuple[str, ...]] = {
    "flight": ("rotors", "drag", "cap", "drag and cap", "regimes", "capped regimes", *WINGED),
    "beam": ("no laser", "fits", "stated", *GAUSSIAN, "divergence"),
    "obstacles": ("refuse", "ignore", "over", "around"),
    "earth": ("nowhere", "earth", "crs"),
    "start": ("full", "wells", "soc"),
    "wind": ("calm", "wind"),
    "battery": ("constant", "taper", *TURNING),
    "reserve": ("end", "always"),
    "problem": ("P1", "P3", "P4", "two stops"),
}
APART = [
    *((one, "wind") for one in ("regimes", "capped regimes", "stated")),
    *((one, "stated") for one in OPTIONS["flight"] if "regimes" not in one),
    *((one, other) for one in ("free", "two stops") for other in TURNING),
    ("free", "two stops"),
]
WEIGHTS = {"stated": 4.0, **dict.fromkeys(TURNING, 0.2)}
"""One option is rarely possible; packs that take turns take long to plan for."""


def together(one: str, other: str) -> bool:
    """Whether two options go together."""
    return (one, other) not in APART and (other, one) not in APART


def choice_of(rng: np.random.Generator) -> Choice:
    """One option of every kind, which go together."""
    choice: Choice = {}
    for kind, options in OPTIONS.items():
        able = [each for each in options if all(together(each, o) for o in choice.values())]
        weights = np.array([WEIGHTS.get(each, 1.0) for each in able])
        choice[kind] = able[rng.choice(len(able), p=weights / weights.sum())]
    return choice


def mission_of(rng: np.random.Generator, choice: Choice) -> Mission:
    """A mission with some options."""
    document = optuav.load("paper").to_dict()
    _places(rng, document)
    hover_A = _flight(rng, document, choice)
    _battery(rng, document, choice, hover_A)
    _light(rng, document, choice["beam"])
    if choice["earth"] == "earth":
        document["earth"] = {"latitude_deg": rng.uniform(-60, 60), "longitude_deg": 13.0}
    if choice["earth"] == "crs":
        document |= {"crs": "EPSG:25832", "earth": {"altitude_m": rng.uniform(0, 500)}}
    return Mission.from_dict(_plain(document))


def _ten(rng: np.random.Generator, low: float, high: float) -> float:
    return float(10.0 ** rng.uniform(low, high))


def _places(rng: np.random.Generator, document: Document) -> None:
    """State ends, device, perhaps the hover point, and two or three buildings, one in the way."""

    def point(low_m: float, high_m: float) -> list[float]:
        return rng.uniform([-1200, -1200, low_m], [1200, 600, high_m]).tolist()

    ends_m, device_m = (point(0, 60), point(0, 60)), point(0, 15)
    device_m[1] = rng.uniform(1000, 2200)
    document["route"] = dict(zip(("origin_m", "destination_m"), ends_m, strict=True))
    document["link"]["device_m"] = device_m
    if rng.random() < 0.3:
        x, y = np.array(device_m[:2]) + rng.uniform(-250, 250, 2)
        document["route"]["hover_m"] = [x, y, rng.uniform(50, 105)]
    document["buildings"] = []
    for name in ("wall", "b1", "b2")[rng.integers(2) :]:
        x, y, z = point(20, 100)
        outline: Any = None
        if name == "wall":
            middle_m = 0.5 * (np.array(ends_m[rng.integers(2)]) + device_m)
            x, y, z = middle_m + rng.uniform([-60, -60, 20], [60, 60, 150])
            outline = [_ten(rng, 1.5, 2.6), 60.0]
        elif rng.random() < 0.8:
            corners = np.array([[-1, -1], [1, -1], [1.3, 0.4], [0, 1]]) * rng.uniform(10, 40)
            outline = (corners + np.array([x, y])).tolist()
        house = {"name": name, "position_m": [x, y, z], "footprint_m": outline}
        document["buildings"].append({k: each for k, each in house.items() if each is not None})


def _flight(rng: np.random.Generator, document: Document, choice: Choice) -> float:
    """State how the UAV flies; returns about what it draws in hover [A]."""
    flight, windy, keys = choice["flight"], choice["wind"] == "wind", dict[str, Any]()
    hover_A = 88.0
    if flight in WINGED:
        hover_A, keys = 16.0, {**WING}
        for key in ("blade_power_W", "induced_power_W", "parasite_W_s3_m3", "acceleration_m_s2"):
            keys[key] = WING[key] * rng.uniform(0.7, 1.5)
        keys |= {"max_speed_m_s": rng.uniform(12, 30), "efficiency": rng.uniform(0.6, 1.0)}
        keys |= {"rest_current_A": rng.choice([0.0, 0.2])}
        keys |= {"cruise_speed_m_s": rng.uniform(5, 15)} if flight == "cruise" else {}
        keys |= {"speed": flight} if flight in WINGED[:3] else {}
        document |= {"wind": {"velocity_m_s": [*rng.uniform(-5, 5, 2), 0.0]}} if windy else {}
        del document["rotor"]
    elif "regimes" in flight:
        keys = {"model": "regimes", "flight_current_A": 93.0, "flight_power_W": 1443.0}
        keys |= {"hover_current_A": 72.0, "hover_power_W": 1033.0}
        keys |= {"acceleration_m_s2": rng.uniform(1, 12), "rest_current_A": rng.choice([0.0, 0.5])}
        del document["rotor"], document["body"]
    elif windy:
        document["wind"] = {"force_N": [*rng.uniform(-2, 2, 2), rng.uniform(-0.5, 0.5)]}
    if "drag" in flight:
        document["body"]["drag_area_m2"] = _ten(rng, -2.5, -0.8)
        document["air"] = {"density_kg_m3": rng.uniform(0.9, 1.3)}
    if "cap" in flight:
        keys["max_speed_m_s"] = rng.uniform(8, 60)
    if choice["obstacles"] in ("over", "around"):
        keys |= {"clearance_m": rng.uniform(0, 25)} if rng.random() < 0.7 else {}
        keys |= {"max_altitude_m": rng.uniform(60, 260)} if rng.random() < 0.5 else {}
    document["flight"] = keys | {"obstacles": choice["obstacles"]}
    return hover_A


def _battery(rng: np.random.Generator, document: Document, choice: Choice, hover_A: float) -> None:
    """State deadline, reserve, packs and the charge at the start."""
    deadline_s, min_soc = _ten(rng, 2.5, 3.5), rng.choice([0.0, 0.05, 0.2])
    document["limits"] |= {"deadline_s": deadline_s, "min_soc": min_soc}
    document["limits"]["keep_soc"] = choice["reserve"]
    capacity_As, share = 0.5 * hover_A * _ten(rng, 2.4, 3.5), rng.uniform(0.3, 0.95)
    document["battery"] |= {
        "capacity_As": capacity_As,
        "available_fraction": share,
        "flow_rate_per_s": _ten(rng, -6, -3),
        "charge_current_A": hover_A * _ten(rng, -1.5, 0.3),
        "schedule" if choice["battery"] in TURNING else "charging": choice["battery"],
    }
    if choice["battery"] == "alternating":
        document["battery"]["period_s"] = rng.uniform(20, 200)
    if choice["start"] == "soc":
        document["start"] = {"soc": rng.uniform(0.5, 1.0)}
    if choice["start"] == "wells":
        levels = 2 * capacity_As * rng.uniform(0.4, 1.0, 2) * [share, 1 - share]
        document["start"] = dict(zip(("available_As", "bound_As"), levels, strict=True))


def _light(rng: np.random.Generator, document: Document, beam: str) -> None:
    """State the laser and the receiver."""
    position_m = [*rng.uniform(-800, 1200, 2), rng.uniform(5, 60)]
    laser = {"position_m": position_m, "power_W": _ten(rng, 2.7, 4.3), "wavelength_nm": 1550.0}
    laser |= {"visibility_km": rng.uniform(2, 30)}
    aperture_m, receiver = rng.uniform(0.05, 0.5), dict[str, float]()
    if beam == "stated":
        document["flight"] |= {"charge_current_A": rng.uniform(1, 30), "charge_power_W": 100.0}
    if beam == "divergence":
        laser |= {"beam": beam, "aperture_m": aperture_m, "divergence_rad": _ten(rng, -5, -3.5)}
        receiver = {"area_m2": aperture_m**2 * rng.uniform(0.2, 1.0)}
    if beam in GAUSSIAN:
        laser |= {"beam": "gaussian", "aperture_m": aperture_m, "m2": rng.uniform(1, 3)}
        laser |= {"source_efficiency": rng.uniform(0.3, 0.6)}
        laser |= {"wavelength_nm": rng.choice([850.0, 1070.0, 1550.0])}
        if "jitter" in beam or rng.random() < 0.2:
            laser["jitter_rad"] = _ten(rng, -5.5, -4)
        if "turbulence" in beam:
            laser["turbulence_cn2"] = _ten(rng, -16, -13.5)
        receiver = {"radius_m": rng.uniform(0.05, 0.5), "cell_efficiency": rng.uniform(0.2, 0.6)}
        receiver |= {"optics_efficiency": 0.9, "dc_efficiency": rng.uniform(0.8, 1.0)}
        receiver |= {"max_irradiance_W_m2": _ten(rng, 2.5, 4)} if beam == "irradiance" else {}
        receiver |= {"max_power_W": _ten(rng, 1, 2.7)} if beam == "cells" else {}
    del document["laser"]
    document |= {"laser": laser} if beam != "no laser" else {}
    document |= {"receiver": receiver} if receiver else {}


def _plain(value: Any) -> Any:
    """The document without NumPy's numbers."""
    if isinstance(value, dict):
        return {key: _plain(each) for key, each in value.items()}
    if isinstance(value, list):
        return [*map(_plain, value)]
    return value.item() if isinstance(value, np.generic) else value
