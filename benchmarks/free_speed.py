"""Gain of free speeds over named ones on random missions: ``python benchmarks/free_speed.py``."""

from __future__ import annotations

import numpy as np

import optuav

MISSIONS = 50
RULES = ("best-range", "best-endurance", "max")


def missions() -> list[optuav.Mission]:
    """Missions of the radio relay with other ends, deadlines, batteries and winds."""
    random, found = np.random.default_rng(31), list[optuav.Mission]()
    relay = optuav.load("relay-today")
    for _ in range(MISSIONS):
        x, y = random.uniform(-2500.0, 2500.0, 2)
        keys = {
            "route.origin_m": [x, y, 2.0],
            "route.destination_m": [x + 4.0, y + 3.0, 2.0],
            "limits.deadline_s": random.uniform(600.0, 2400.0),
            "battery.capacity_As": random.uniform(12_000.0, 24_000.0),
            "wind.velocity_m_s": [*random.uniform(-5.0, 5.0, 2), 0.0],
            "flight.through_buildings": True,
        }
        found.append(relay.replace(keys))
    return found


def main() -> None:
    """Print the gain over each named speed, and over the better of best range and largest."""
    for perspective in ("battery", "available"):
        rows = []
        for mission in missions():
            plans = [
                optuav.solve(mission.replace({"flight.speed": rule}), perspective=perspective)
                for rule in RULES
            ]
            plans.append(optuav.solve(mission, optuav.P1(speed="free"), perspective=perspective))
            if all(plans):
                rows.append([plan.hover_time_s for plan in plans])
        far, slow, fast, free = np.array(rows).T
        print(f"{perspective}: {len(rows)} missions with a plan at each named speed")
        for name, named in (
            ("the better of best range and max", np.maximum(far, fast)),
            ("best range", far),
            ("max", fast),
            ("best endurance", slow),
        ):
            gain_s = free - named
            print(f"  over {name}: {gain_s.mean():.1f} s mean, {gain_s.max():.1f} s at most")


if __name__ == "__main__":
    main()
