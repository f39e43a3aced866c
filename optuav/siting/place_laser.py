"""Placing one laser or several, for one mission or many."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, field
from functools import partial
from math import isnan
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from formulations.soc import PAPER, PERSPECTIVES
from optuav.arrays import Floats, Integers, plain
from optuav.errors import Fault, collected, printable, refuse
from optuav.fields import Range
from optuav.frames import DataFrame, frame
from optuav.mission import Mission, load_all
from optuav.mission.messages import first_ten, misfits, plural, shown, unlisted
from optuav.network.map_extent import scene
from optuav.network.places import charging_cap
from optuav.options import Perspective
from optuav.presentation.blocks import Block, Facts
from optuav.presentation.numbers import coordinates, figure, fixed, percent, seconds
from optuav.presentation.presented import Presented
from optuav.siting import files
from optuav.siting.candidates import STEP, candidates_of, points_of
from optuav.siting.places import HoverTimes, Progress, refined
from optuav.siting.selection import (
    OBJECTIVES,
    Objective,
    Selection,
    best_sites,
    value_of,
    worth_of,
)
from optuav.solving.question import LIMIT
from optuav.status import SAME_S

COUNT = Range("-", ge=1, le=1000, whole=True)
ENOUGH = Range("s", gt=0.0, le=1e7)
GAP_RANGE = Range("-", ge=0.0, le=1.0)
COORDINATE = Range("m", ge=-1e6, le=1e6)
HEADS = {"mean": "Mean", "worst": "Shortest", "covered": "Covered"}
WITHOUT_PLAN = {
    "mean": "they count as 0 s",
    "worst": "they are left out",
    "covered": "they are not covered",
}
POINTS = "points (x, y, z) [m], |x| <= 1e6, as an array (site, 3) with at least one"


@dataclass(frozen=True, eq=False, repr=False)
class Siting(Presented):
    """The answer of `optuav.place_laser`: sites, their hover times, and a bound.

    Parameters
    ----------
    missions, candidates_m, perspective, at_least_s
        As asked: the missions, the candidates (site, 3) [m], how charge was counted, and the hover
        that counts as covered [s], or None.
    selection
        The candidates selected and a greedy choice, with their values and the bound.
    candidate_hover_s
        Longest hovers (mission, site) [s], NaN without a plan.
    position_m, hover_s
        Final positions of the lasers (laser, 3) [m], in the order of `selection.sites`, and the
        longest hovers with them (mission, laser) [s], NaN without a plan.
    value
        Mean or smallest hover [s], or the number of missions covered, with the lasers at their
        final positions.
    lasers
        Largest number of lasers that was asked for.
    names
        Names of the candidates in their file; empty if the file has no names.

    Examples
    --------
    >>> import optuav
    >>> hazy = optuav.load("paper").replace({"laser.visibility_km": 2.0})
    >>> siting = optuav.place_laser(hazy, [[1000, 0, 50], [1000, 2000, 50]], refine=False)
    >>> siting.selection.sites, siting.gap, siting.position_m.tolist()
    ((1,), 0.0, [[1000.0, 2000.0, 50.0]])
    """

    missions: tuple[Mission, ...]
    candidates_m: Floats
    perspective: Perspective
    at_least_s: float | None
    selection: Selection
    candidate_hover_s: Floats = field(repr=False)
    position_m: Floats
    hover_s: Floats = field(repr=False)
    value: float
    lasers: int = 1
    names: tuple[str, ...] = ()

    @property
    def gap(self) -> float:
        """Relative excess that the best selection may have over this one."""
        return self.selection.gap

    @property
    def laser(self) -> Integers:
        """By mission, the number of the laser that lets it hover longest; −1 without a plan."""
        none = np.full((len(self.missions), 1), -1.0)
        hovers_s = np.concatenate([none, np.nan_to_num(self.hover_s, nan=-1.0)], axis=1)
        longest = hovers_s >= hovers_s.max(axis=1, keepdims=True) - SAME_S
        return np.asarray(longest.argmax(axis=1) - 1)

    def _name(self, site: int) -> str:
        """What a candidate is called in the text and on maps."""
        name = self.names[site] if self.names else ""
        return f"{name} (site {site})" if name else f"Site {site}"

    def mission(self, number: int = 0) -> Mission:
        """Return one of the missions, 0 the first, with the laser that lets it hover longest.

        A mission without a plan is unchanged. Raises `InputError` if that mission does not exist.
        """
        numbers = Range("-", ge=0, lt=len(self.missions), whole=True)
        refuse(misfits(("number", number, numbers)))
        mission, laser = self.missions[number], int(self.laser[number])
        if laser < 0:
            return mission
        return mission.replace({"laser.position_m": self.position_m[laser].tolist()})

    def to_dict(self) -> dict[str, object]:
        """The answer as plain data, ready for JSON; None for a hover without a plan."""
        candidate_hover_s, hover_s = (
            [[None if isnan(hover_s) else hover_s for hover_s in row] for row in table.tolist()]
            for table in (self.candidate_hover_s, self.hover_s)
        )
        return {
            "kind": "optuav siting",
            "missions": [mission.name for mission in self.missions],
            "candidates_m": self.candidates_m.tolist(),
            "names": [*self.names],
            "perspective": self.perspective,
            "at_least_s": self.at_least_s,
            "selection": {**asdict(self.selection), "gap": self.gap},
            "value": self.value,
            "position_m": self.position_m.tolist(),
            "candidate_hover_s": candidate_hover_s,
            "hover_s": hover_s,
            "laser": self.laser.tolist(),
        }

    def save(self, path: str | Path) -> Path:
        """Write the lasers on a map, and return the file; needs pyproj.

        Parameters
        ----------
        path
            A .geojson file, whose heights are above the ellipsoid or left out (`Plan.export`), or a
            .kml file, at altitudes above mean sea level. Points have the names that the text
            prints, such as ``Site 4``, or ``B (site 4)`` if the candidates have names.

        Raises
        ------
        InputError
            If the suffix is another, the first mission has no place on Earth, or the file cannot be
            written.
        """
        sites = self.selection.sites
        moved_m = np.linalg.norm(self.position_m - self.candidates_m[[*sites]], axis=1)
        placed = list[files.PlacedLaser]()
        for number, (site, position_m) in enumerate(zip(sites, self.position_m, strict=True)):
            serves = int((self.laser == number).sum())
            facts = {"site": site, "serves": serves, "moved_m": float(moved_m[number])}
            placed.append(files.PlacedLaser(self._name(site), position_m, facts))
        return files.save(self.missions[0], placed, str(self).splitlines(), path)

    def save_missions(self, directory: str | Path) -> list[Path]:
        """Write every mission with its laser into a directory, made if missing; return the files.

        With several missions, ``town-3.toml`` is the one that `mission` returns for 3.

        Raises
        ------
        InputError
            If the directory or a file cannot be written.
        """
        missions = [self.mission(number) for number in range(len(self.missions))]
        return files.save_missions(missions, directory)

    def to_frame(self) -> DataFrame:
        """Return one row per mission: its name, its `laser`, and its hover ``hover_s`` [s]."""
        rows = [
            (mission.name, laser, hover_s[laser] if laser >= 0 else np.nan)
            for mission, laser, hover_s in zip(self.missions, self.laser, self.hover_s, strict=True)
        ]
        return frame(rows, ["mission", "laser", "hover_s"])

    def summary(self) -> str:
        """Sites, value, bound and gap, greedy choice and refinement in a few lines."""
        return str(self)

    def __repr__(self) -> str:
        return f"<Siting: {self._facts()[0][1]}>"

    def blocks(self) -> Iterator[Block]:
        """Yield sites, value, bound and gap, greedy choice and refinement."""
        yield Facts(self._facts())

    def _facts(self) -> list[tuple[str, str]]:
        best, count, lasers = self.selection, len(self.missions), self.laser
        placed = f"{len(best.sites)} of {plural(len(self.candidates_m), 'candidate')} for "
        lines = [("Placed", f"{placed}{plural(count, 'mission')}, {self.perspective}")]
        for laser, (site, at_m) in enumerate(zip(best.sites, self.position_m, strict=True)):
            served = int((lasers == laser).sum()) or "nobody: the lasers that moved serve all"
            where = f"{_point(self.candidates_m[site])}, serves {served}"
            far_m = float(np.linalg.norm(at_m - self.candidates_m[site]))
            where += f", moved {fixed(far_m, 0)} m to {_point(at_m)}" if far_m else ""
            lines.append((printable(self._name(site)), where))
        if len(best.sites) < self.lasers:
            words = "no other candidate adds anything"
            if len(best.sites) == len(self.candidates_m):
                words = "there are no more candidates"
            lines.append(("Left out", f"{self.lasers - len(best.sites)} of {self.lasers}: {words}"))
        written: Callable[[float], str] = seconds
        enough = ""
        if self.at_least_s is not None:
            written, enough = (
                partial(fixed, decimals=0),
                f" of {count} hover {figure(self.at_least_s)} s or longer",
            )
        proof = f"gap {percent(self.gap)}" if self.gap else "no selection is better"
        alike = [(n, site) for n, site in zip(best.alike, best.sites, strict=True) if n]
        sites = (
            f"site{'s' * (len(best.greedy_sites) > 1)} {first_ten([*map(str, best.greedy_sites)])}"
        )
        greedy = f"{written(best.greedy_value)} on {sites}"
        lines += [
            (HEADS[best.objective], f"{written(best.value)}{enough}"),
            ("Bound", f"{written(best.bound)}, {proof}"),
            ("Greedy", greedy if best.greedy_sites else "no site adds anything"),
        ]
        if alike:
            where = ", ".join(f"{n} in place of site {site}" for n, site in alike)
            lines.append(("Alike", f"other candidates that are as good: {where}{self._why()}"))
        if self.value > best.value:
            words = f"{written(self.value)} at the places moved to, no bound"
            lines.append(("Refined", words))
        if never := int(np.isnan(self.candidate_hover_s).all(axis=1).sum()):
            how = WITHOUT_PLAN[best.objective]
            lines.append(("No plan", f"{never} with a laser on any candidate; {how}"))
        return lines

    def _why(self) -> str:
        """Words on a cap of the charging current that makes candidates alike; empty without."""
        number = int((self.laser >= 0).argmax())
        place_m = self.candidates_m[self.selection.sites[self.laser[number]]].tolist()
        mission = self.missions[number].replace({"laser.position_m": place_m})
        cap = charging_cap(mission, scene(mission).places)
        served = np.flatnonzero(self.laser >= 0).tolist()
        one, name = self.missions[number], {"name": self.missions[number].name}
        alike = [str(n) for n in served if self.missions[n].model_copy(update=name) == one]
        which = f"mission{'s' * (len(alike) > 1)} {first_ten(alike)}, " * (len(self.missions) > 1)
        return f"; {which}{cap.words}" if cap else ""


def place_laser(
    missions: Mission | str | Path | Sequence[Mission | str | Path],
    candidates: npt.ArrayLike | str | Path,
    lasers: int = 1,
    *,
    step_m: float | None = None,
    objective: Objective = "mean",
    at_least_s: float | None = None,
    perspective: Perspective = "available",
    refine: bool = True,
    gap: float = 0.0,
    time_limit_s: float = 60.0,
    progress: Progress | None = None,
) -> Siting:
    """Choose where to put lasers, from candidates, for one mission or for many.

    Every mission flies its best plan with at most one rest, with the one laser that lets it hover
    longest. A mission without a plan hovers for 0 s; ``"worst"`` ignores it if no candidate makes a
    plan possible.

    Parameters
    ----------
    missions
        A mission, the name of a shipped one or the path of a mission file, or several of them, such
        as one for each device. Each must have a laser; only the laser's place changes.
    candidates
        Places where a laser may stand (site, 3) [m], each coordinate up to 1e6; or the path of a
        GeoJSON file of points, whose properties ``name`` and ``z_m`` are their name and height and
        which need a mission on Earth; or ``"grid"``, for points over all places of the missions.
        Without ``z_m``, points are as high as the laser of the first mission.
    lasers
        Largest number of lasers, 1 to 1000. A laser that would add nothing is left out.
    step_m
        Distance between neighbours in a grid [m], > 0 and up to 1e6; None for a tenth of its longer
        side.
    objective
        Quantity to maximise: ``"mean"``, the mean hover time of the missions;
        ``"worst"``, the shortest; ``"covered"``, how many hover for `at_least_s` or longer.
    at_least_s
        With ``"covered"`` and only then: the hover that is enough [s], > 0 and at most 1e7.
    perspective
        How to count charge, as for `optuav.solve`.
    refine
        Whether to move each laser afterwards in the plane, by up to half the distance from its
        candidate to the nearest other one, while the same places stay in its sight. It tries eight
        points around each laser at every step; the steps begin with a quarter of that distance and
        end with 1 m. This needs about 50 hover times per mission and laser, and more if lasers
        move. It ends when no step changes a hover.
    gap
        Relative gap that is small enough to end the search, 0 to 1.
    time_limit_s
        Time after which the search for the best selection ends [s], > 0 and at most 1e9, with the
        gap that is then left; it does not include the hover times and the refinement. An answer
        that it cuts off may differ from machine to machine.
    progress
        Callback for progress before each part of the work: receives the number of hover times done,
        their total (None while lasers move), and words on their purpose.

    Returns
    -------
    Siting
        Sites, value, bound and gap, the value of a greedy choice, and refined places of the lasers.

    Raises
    ------
    InputError
        With all faults: of a mission, its missing laser, packs that take turns under
        ``"available"`` or ``"wells"``, or of an argument.

    Examples
    --------
    >>> import optuav
    >>> hazy = optuav.load("paper").replace({"laser.visibility_km": 2.0})
    >>> by_origin, by_device = [1000, 0, 50], [1000, 2000, 50]
    >>> siting = optuav.place_laser(hazy, [by_origin, by_device], perspective="battery")
    >>> siting.selection.sites, round(siting.selection.value, 2)
    ((1,), 715.05)
    """
    faults = list[Fault]()
    loaded = tuple(load_all(missions, faults))
    if not (loaded or faults):
        faults.append(Fault("missions", "none", "at least one"))
    table_m, names = np.empty((0, 3)), tuple[str, ...]()
    if not isinstance(candidates, str | Path):
        table_m = _points(candidates, faults)
        if step_m is not None:
            faults += misfits(("step_m", step_m, STEP))
    else:
        with collected(faults):
            if faults:
                points_of(candidates, step_m)
            else:
                table_m, names = candidates_of(candidates, loaded, step_m)
    faults += option_faults(lasers, objective, at_least_s, perspective)
    faults += misfits(("gap", gap, GAP_RANGE), ("time_limit_s", time_limit_s, LIMIT))
    if not (progress is None or callable(progress)):
        faults.append(Fault("progress", shown(progress), "a function, or nothing"))
    refuse([*faults, *(fault for mission in loaded for fault in _unfit(mission, perspective))])
    times = HoverTimes(loaded, perspective, progress)
    times_s = times.at(table_m, "hover times", len(loaded) * len(table_m))
    planned = np.asarray(~np.isnan(times_s).all(axis=1))
    counted = planned if objective == "worst" and planned.any() else np.ones_like(planned)

    def value(found_s: Floats) -> float:
        worth = worth_of(found_s[counted], objective, at_least_s)
        return float(value_of(worth.max(axis=1, initial=0.0), objective))

    limits: dict[str, Any] = {"at_least_s": at_least_s, "gap": gap, "time_limit_s": time_limit_s}
    best = best_sites(times_s[counted], int(lasers), objective, **limits)
    at_m, hover_s = table_m[[*best.sites]], times_s[:, [*best.sites]]
    if refine and best.sites:
        reach_m = 0.5 * _nearest_m(table_m, best.sites)
        at_m, hover_s = refined(times, at_m, hover_s, reach_m, value)
    question = loaded, table_m, perspective, at_least_s
    return Siting(*question, best, times_s, at_m, hover_s, value(hover_s), int(lasers), names)


def _nearest_m(points_m: Floats, chosen: Sequence[int]) -> Floats:
    """Distance in the plane from points chosen to the nearest elsewhere; 0 without another [m]."""
    apart_m = np.linalg.norm(points_m[[*chosen], None, :2] - points_m[None, :, :2], axis=2)
    nearest_m = np.where(apart_m > 0.0, apart_m, np.inf).min(axis=1)
    return np.where(np.isfinite(nearest_m), nearest_m, 0.0)


def _points(candidates: npt.ArrayLike, faults: list[Fault]) -> Floats:
    """Return the candidates as an array; append their faults to `faults`."""
    try:
        table_m = plain(candidates).astype(float)
    except (OverflowError, TypeError, ValueError):
        table_m = np.empty(0)
    if table_m.ndim != 2 or table_m.shape[1] != 3 or not len(table_m):
        faults.append(Fault("candidates", shown(candidates), POINTS))
        return np.empty((0, 3))
    for row in np.flatnonzero(~(np.abs(table_m) <= 1e6).all(axis=1)).tolist():
        faults.append(Fault(f"candidates[{row}]", shown(table_m[row].tolist()), COORDINATE.words))
    return table_m


def option_faults(
    lasers: Any,
    objective: Any,
    at_least_s: Any,
    perspective: Any,
) -> Iterator[Fault]:
    """Yield the faults of options, each and together."""
    yield from misfits(("lasers", lasers, COUNT))
    yield from unlisted(("objective", objective, OBJECTIVES))
    yield from unlisted(("perspective", perspective, tuple(PERSPECTIVES)))
    if objective == "covered" and not ENOUGH.accepts(at_least_s):
        yield Fault("at_least_s", shown(at_least_s), f"{ENOUGH.words}, with objective 'covered'")
    if objective in ("mean", "worst") and at_least_s is not None:
        yield Fault(
            "at_least_s", shown(at_least_s), "must be left out, except with objective 'covered'"
        )


def _unfit(mission: Mission, perspective: Perspective) -> Iterator[Fault]:
    """Why the laser of a mission cannot be placed."""
    name, battery = printable(mission.name), mission.battery
    if mission.laser is None:
        yield Fault("laser", "", "is missing, but it is the one to place", name)
    if perspective not in PAPER and battery.takes_turns:
        yield Fault("battery.schedule", shown(battery.schedule), "pooled", name)


def _point(at_m: Floats) -> str:
    """A point as text."""
    return f"{coordinates(np.round(at_m, 1), 8)} m"
