"""The benchmark set: missions by name, each made from a line of ``missions.toml``."""

import random
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from optuav.errors import Fault, InputError
from optuav.mission.files import read_toml
from optuav.mission.messages import nearest
from optuav.mission.mission import Mission
from optuav.options import SET

FILE = Path(__file__).with_name("missions.toml")
PERSPECTIVES = ("available", "battery", "energy", "adjusted")
SHARED: Mapping[str, Any] = {
    **{"about": "", "extends": "", "problems": ["P1"], "perspectives": [*PERSPECTIVES]},
    **{"without": (), "town": None},
}
"""Keys of a family or a mission beside the keys of a mission, with their defaults."""


@dataclass(frozen=True)
class Recipe:
    """Recipe of a mission of the set, and the questions about it."""

    name: str  # As `optuav.load` takes it
    family: str
    about: str  # Description of the family
    extends: str  # Shipped mission
    changes: Mapping[str, Any]
    without: Sequence[str]  # Tables that it removes
    town: Mapping[str, Any] | None  # Options of `town`; None where the buildings stay
    problems: Sequence[str]  # Such as "P1" or "P4 building=b1", each asked in all perspectives
    perspectives: Sequence[str]

    def mission(self, extended: Mission) -> Mission:
        """The mission, made from the one that it extends."""
        words = f"Benchmark set, {self.family}: {self.about}"
        values = {"name": self.name, "description": words, **self.changes}
        made = extended.replace(values | dict.fromkeys(self.without))
        if self.town is None:
            return made
        kept_m = [made.route.origin_m, made.route.destination_m]
        kept_m += [device.position_m for device in made.served]
        kept_m += [made.laser.position_m] if made.laser else []
        return made.with_buildings(town(kept_m, **self.town))


@cache
def recipes() -> dict[str, Recipe]:
    """All recipes by name, in the order of the list."""
    by_name = {}
    for family, table in read_toml(FILE).items():
        lines = table.pop("missions")
        for line in lines:
            changes = {**SHARED, **table, **line}
            options = {key: changes.pop(key) for key in SHARED}
            name = f"{SET}{family}-{changes.pop('name')}"
            by_name[name] = Recipe(name=name, family=family, changes=changes, **options)
    return by_name


def recipe_of(name: str) -> Recipe:
    """The recipe of a mission, or an `InputError`."""
    recipe_of = recipes()
    if name not in recipe_of:
        hint = nearest(name, recipe_of) or "; optuav missions --set lists them"
        raise InputError([Fault("", "", f"there is no such mission in the set{hint}", name)])
    return recipe_of[name]


def town(
    kept_m: Sequence[Sequence[float]],
    roofs: int,
    seed: int,
    size_m: int = 2000,
    heights_m: tuple[int, int] = (30, 100),
    width_m: int = 0,
    streets: bool = False,
) -> dict[str, list[Any]]:
    """A table of roofs at random in whole metres, the same on every machine.

    They stand in a square from (0, 0) to (`size_m`, `size_m`), on a grid if there are `streets`.
    Footprints are squares of `width_m`, if that is not 0, and cover none of the points to be kept.
    Only ``random()`` of Python's generator is used, whose numbers are the same in every version.
    """
    draw = random.Random(seed).random
    across = next(side for side in range(1, roofs + 1) if side**2 >= roofs)
    low_m, high_m = heights_m
    places = list[tuple[int, int]]()
    while len(places) < roofs:
        if streets:
            row, column = divmod(len(places), across)
            x, y = ((2 * place + 1) * size_m // (2 * across) for place in (column, row))
        else:
            x, y = int(draw() * size_m), int(draw() * size_m)
        if streets or not any(max(abs(x - p[0]), abs(y - p[1])) <= width_m for p in kept_m):
            places.append((x, y))
    table: dict[str, list[Any]] = {
        "name": [f"r{number}" for number in range(1, roofs + 1)],
        "x_m": [x for x, _ in places],
        "y_m": [y for _, y in places],
        "z_m": [low_m + int(draw() * (high_m - low_m)) for _ in places],
    }
    return table | (dict.fromkeys(("width_m", "depth_m"), [width_m] * roofs) if width_m else {})


def parsed(problem: str) -> tuple[str, dict[str, Any]]:
    """The name of a problem and its options: of ``"P1 stops=2"`` they are "P1" and stops 2."""
    name, *options = problem.split()
    pairs = (option.partition("=") for option in options)
    return name, {key: int(value) if value.isdigit() else value for key, _, value in pairs}
