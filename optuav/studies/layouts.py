"""Random layouts of a city around a mission."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal, TypeAlias, get_args

import numpy as np

from optuav.arrays import Booleans, Floats, plain
from optuav.errors import Fault, collected, refuse
from optuav.fields import MOST_ITEMS, Range
from optuav.mission import Mission, load
from optuav.mission.messages import misfits, shown, unknown
from optuav.presentation.numbers import typed
from optuav.studies.samples import SEED

Kind: TypeAlias = Literal["uniform", "grid", "manhattan"]
KINDS: tuple[Kind, ...] = get_args(Kind)
COUNT = Range("-", ge=1, le=1e6, whole=True)
HEIGHT = Range("m", ge=0, le=1e4)
OPTIONS = {
    "buildings": Range("-", ge=1, le=MOST_ITEMS, whole=True),
    "size_m": Range("m", ge=1e-3, le=1e4),
    "built_up": Range("-", gt=0, lt=1),
    "per_km2": Range("1/km2", gt=0, le=1e6),
    "height_scale_m": Range("m", gt=0, le=1e3),
}
SQUARES: dict[str, Any] = {"buildings": 10, "heights_m": (60.0, 100.0), "size_m": 40.0}
TOWN: dict[str, Any] = {"built_up": 0.3, "per_km2": 500.0, "height_scale_m": 15.0}
"""Options of the kinds uniform and grid, then of manhattan, with their defaults."""
MOST_TRIES = 1000
ROOFS = "buildings"  # The key of whole layouts in ranges


def layouts(
    mission: Mission | str | Path,
    count: int,
    kind: Kind = "uniform",
    *,
    area_m: Sequence[float] | Floats = (0.0, 0.0, 2000.0, 2000.0),
    buildings: int | None = None,
    heights_m: Sequence[float] | Floats | None = None,
    size_m: float | None = None,
    built_up: float | None = None,
    per_km2: float | None = None,
    height_scale_m: float | None = None,
    seed: int = 0,
) -> list[Mission]:
    """Make missions with random buildings instead of the mission's own.

    Buildings that would contain the origin, the destination or the laser are left out; the kind
    ``"uniform"`` draws them again. Their names are r1, r2, … in the order of drawing, in rows along
    x from the lowest y on.

    Parameters
    ----------
    mission
        A mission, the name of a shipped one, or the path of a mission file.
    count
        Number of layouts, 1 to 1e6. The first layouts are the same for any number.
    kind
        ``"uniform"``: square buildings anywhere in the area, which may overlap; ``"grid"``: square
        buildings at equal distances; ``"manhattan"``: a grid with the statistics of ITU-R P.1410
        [1]_, the crossings of its streets shifted at random.
    area_m
        The area (x low, y low, x high, y high) [m] for the centres of buildings.
    buildings
        Number of buildings, 1 to 100 000, by default 10; a ``"grid"`` has the largest square number
        up to that. Not for ``"manhattan"``.
    heights_m
        Lowest and highest roof [m], by default 60 and 100, all heights between being equally
        likely; not for ``"manhattan"``.
    size_m
        Length of the sides of a building [m], 0.001 to 1e4, by default 40; not for ``"manhattan"``.
    built_up, per_km2, height_scale_m
        α, the share of the land that is built on, 0 to 1; β, buildings per km²; and γ, the scale of
        the Rayleigh distribution of heights [m], by default 0.3, 500 and 15, only for
        ``"manhattan"`` [1]_: sides of 1000 √(α/β) m with streets of 1000/√β m less that between. A
        suburb has 0.1, 750 and 8, a city 0.3, 500 and 15, its centre 0.5, 300 and 20, and
        skyscrapers 0.5, 300 and 50 [2]_.
    seed
        Seed of the layouts, 0 to 2**63.

    Returns
    -------
    list of Mission
        The missions, ready for `optuav.batch`.

    Raises
    ------
    InputError
        With all faults of the options, or if no building finds room.

    References
    ----------
    .. [1] ITU-R P.1410, "Propagation data and prediction methods required for the design of
       terrestrial broadband radio access systems operating in a frequency range from 3 to 60 GHz".
    .. [2] A. Al-Hourani, S. Kandeepan, S. Lardner, "Optimal LAP altitude for maximum coverage",
       IEEE Wireless Communications Letters, 2014.

    Examples
    --------
    >>> import optuav
    >>> towns = optuav.layouts("paper", 20, buildings=5, seed=1)
    >>> results = optuav.batch_arrays(towns, {}, perspective="battery")
    >>> results["hover_time_s"].shape
    (20,)
    """
    given: dict[str, Any] = {"buildings": buildings, "heights_m": heights_m, "size_m": size_m}
    given |= {"built_up": built_up, "per_km2": per_km2, "height_scale_m": height_scale_m}
    given = {name: value for name, value in given.items() if value is not None}
    options = {**SQUARES, **TOWN, **given}
    checked = [(name, options[name], number) for name, number in OPTIONS.items()]
    faults = [*misfits(*checked, ("count", count, COUNT), ("seed", seed, SEED))]
    if kind not in KINDS:
        faults.append(unknown("kind", kind, KINDS))
    else:
        others, words = (SQUARES, "uniform or grid") if kind == "manhattan" else (TOWN, "manhattan")
        wrong = (name for name in given if name in others)
        faults += [Fault(name, shown(given[name]), f"goes with the kind {words}") for name in wrong]
    if not _ordered(options["heights_m"], 2, HEIGHT):
        words = f"two heights, the lower first, each {HEIGHT.words}"
        faults.append(Fault("heights_m", shown(heights_m), words))
    if not _ordered(area_m, 4, Range("m", ge=-1e6, le=1e6)):
        words = "(x low, y low, x high, y high), low < high, each |x| <= 1e6 [m]"
        faults.append(Fault("area_m", shown(area_m), words))
    with collected(faults):
        base = load(mission)
    refuse(faults)
    low_m, high_m = np.array(area_m[:2], float), np.array(area_m[2:], float)
    most, side_m = options["buildings"], float(options["size_m"])
    step_m = np.full(2, 1000.0 / math.sqrt(options["per_km2"]))
    if kind == "grid":
        step_m = (high_m - low_m) / math.isqrt(most)
    elif kind == "manhattan":
        side_m = 1000.0 * math.sqrt(options["built_up"] / options["per_km2"])
        expected = float(np.prod((high_m - low_m) / step_m))
        if expected > MOST_ITEMS:
            words = f"at most {MOST_ITEMS} buildings in the area"
            refuse([Fault("per_km2", typed(options["per_km2"]), words)])
    missions = []
    for number in range(count):
        draw = np.random.default_rng([seed, number])
        if kind == "uniform":
            at_m = _anywhere(draw, base, low_m, high_m, side_m, most)
        else:
            shift = draw.random(2) if kind == "manhattan" else np.full(2, 0.5)
            x_m, y_m = (
                np.arange(low_m[k] + shift[k] * step_m[k], high_m[k], step_m[k]) for k in range(2)
            )
            at_m = np.stack(np.meshgrid(x_m, y_m), axis=-1).reshape(-1, 2)
            at_m = at_m[_free(base, at_m, side_m)]
        if kind == "manhattan":
            roofs_m = draw.rayleigh(options["height_scale_m"], len(at_m))
        else:
            lowest_m, highest_m = options["heights_m"]
            roofs_m = draw.uniform(lowest_m, highest_m, len(at_m))
        if len(at_m) < (most if kind == "uniform" else 1):
            refuse([Fault("area_m", shown(area_m), "an area with room for the buildings")])
        names = [f"r{k + 1}" for k in range(len(at_m))]
        table: dict[str, Iterable[object]] = {"name": names, "z_m": roofs_m}
        table |= {"x_m": at_m[:, 0], "y_m": at_m[:, 1]}
        table |= dict.fromkeys(("width_m", "depth_m"), np.full(len(at_m), side_m))
        missions.append(base.with_buildings(table))
    return missions


def relocated(mission: Mission, roofs_m: object) -> list[Mission]:
    """A mission with its buildings, footprints included, at other places: one for each layout.

    Where they are is an array (layout, building, 3) [m]: the positions of all of its buildings in
    their order.
    """
    count = len(mission.buildings)
    try:
        places_m = plain(roofs_m).astype(float)
    except (TypeError, ValueError):
        places_m = np.zeros(0)
    if not places_m.size or places_m.shape[1:] != (count, 3):
        words = f"an array (layout, {count}, 3) [m]: places of all buildings of the mission"
        refuse([Fault(ROOFS, shown(roofs_m), words)])
    missions, faults = list[Mission](), list[Fault]()
    for number, layout_m in enumerate(places_m):
        rows, wrong = mission.buildings.rows(), list[Fault]()
        for row, place_m, before_m in zip(rows, layout_m, mission.buildings.roof_m, strict=True):
            row["position_m"] = place_m.tolist()
            if len(outline := row.get("footprint_m", ())) > 2:
                row["footprint_m"] = (np.array(outline) + (place_m - before_m)[:2]).tolist()
        with collected(wrong):
            missions.append(mission.replace({"buildings": rows}))
        for fault in wrong[:1]:
            more = f"; and {len(wrong) - 1} more in this layout" if len(wrong) > 1 else ""
            key = f"layout {number}: {fault.key}"
            faults.append(replace(fault, key=key, allowed=f"{fault.allowed}{more}"))
    refuse(faults)
    return missions


def _ordered(values: object, count: int, number: Range) -> bool:
    """Return whether values are `count` numbers, the lower half not above the upper."""
    values = values.tolist() if isinstance(values, np.ndarray) else values
    if not isinstance(values, tuple | list) or len(values) != count:
        return False
    if not all(map(number.accepts, values)):
        return False
    pairs = zip(values[: count // 2], values[count // 2 :], strict=True)
    return all(low < high if count > 2 else low <= high for low, high in pairs)


def _anywhere(
    draw: np.random.Generator,
    mission: Mission,
    low_m: Floats,
    high_m: Floats,
    side_m: float,
    count: int,
) -> Floats:
    """Centres of buildings (building, 2) [m], each drawn again until it stands around no end."""
    kept = np.zeros((0, 2))
    for _ in range(MOST_TRIES):
        if len(kept) >= count:
            break
        more = draw.uniform(low_m, high_m, (count, 2))
        kept = np.concatenate([kept, more[_free(mission, more, side_m)]])
    return kept[:count]


def _free(mission: Mission, at_m: Floats, side_m: float) -> Booleans:
    """Select centres (building, 2) [m] of buildings around no end of the mission."""
    ends = [mission.route.origin_m, mission.route.destination_m]
    ends += [mission.laser.position_m] if mission.laser else []
    apart_m = np.abs(at_m[:, None] - np.array(ends)[:, :2])
    free: Booleans = (apart_m > 0.5 * side_m).any(axis=2).all(axis=1)
    return free
