"""The tables and figures of the paper for any mission, and what the paper leaves out."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from formulations.perspectives import PAPER
from optuav import plots
from optuav.mission import Mission
from optuav.network import vehicle
from optuav.paper import curves, table2
from optuav.paper.curves import (
    AXES,
    DEADLINES_S,
    LEAST_SOC,
    OURS,
    SPEED_SHARES,
    TRAJECTORIES,
    has_rotors,
    solve,
    with_deadline,
)
from optuav.paper.ledger import ledger
from optuav.paper.statement import Verdict, agrees, data
from optuav.physics import rotor
from optuav.plan import Plan

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Record: TypeAlias = Mapping[str, object]

COUNTED = ("battery", OURS)
"""Perspectives of the figures that the paper makes in one."""
PACKS = {"battery": 61, OURS: 25}
"""Points of the curves in Fig. 8."""
SOURCES_W = (100.0, 250.0, 500.0, 1000.0)
"""Source powers in Fig. 10; the paper does not print its own."""
DISTANCES_M, NEAR_M = np.linspace(0.0, 5000.0, 101), 1000.0
WAYS = {"one rest, one hover": (1, 1), "two rests": (2, 1), "two hovers": (1, 2)}
"""Most rests and most hovers."""
LATER = (1.0, 2.0)
"""Deadlines over the mission's own at which more stops are tried."""
HEAD = ("direct path", "Δ [s]", "T [s]", "η1 [%]", "η2 [%]", "η3 [%]")
MINUS = "\N{MINUS SIGN}"


class NotShownError(Exception):
    """Why a mission has no such study, or has it not in some part."""


@dataclass(frozen=True)
class Exhibit:
    """A picture or a table, with the numbers in it and what they say.

    Parameters
    ----------
    mission
        What it is about.
    file
        Its key in the file of the statements, and the beginning of the name of its files.
    records
        The numbers, one flat record a row.
    axes
        One of the axes of the picture; None for a table.
    rows
        The cells of a table, the headings first.
    part, details
        The end of the name of its files, and of the caption.
    findings
        Sentences.
    """

    mission: Mission
    file: str
    records: Sequence[Record]
    axes: Axes | None = None
    rows: Sequence[Sequence[str]] = ()
    part: str = ""
    details: Sequence[str] = ()
    findings: Sequence[str] = ()

    @property
    def name(self) -> str:
        """Name of its files."""
        mission = re.sub(r"[^\w.-]+", "-", self.mission.name).strip("-.") or "mission"
        return ".".join(filter(None, (self.file, mission, self.part)))

    @property
    def places(self) -> Sequence[str]:
        """Where the paper has it; several places where they differ in the deadline alone."""
        texts = data()["exhibit"][self.file]
        places = texts.get("places", {})
        own = places.get(self.part) if is_papers(self.mission) else None
        return [own] if own else [*places.values()] or [texts.get("place", "")]

    @property
    def numbers(self) -> Sequence[str]:
        """The same as `reproduce` takes it: ``["fig5"]``."""
        return [
            each.lower().replace(". ", "").replace("table ii", "table2") for each in self.places
        ]

    @property
    def caption(self) -> str:
        """What is shown, where the paper has it if the mission is the paper's, and for what."""
        known = self.places[0] and is_papers(self.mission)
        place = f" ({self.places[0]} of the paper)" if known else ""
        what = data()["exhibit"][self.file]["words"]
        return f"{what}{place}: {', '.join((self.mission.name, *self.details))}"


def is_papers(mission: Mission) -> bool:
    """Whether a mission is one of the paper's, to which the paper's numbers belong."""
    return mission.name in ("paper", "paper-table2")


def number(value: float, digits: int) -> str:
    """A number with a minus for its sign, and none where it rounds to 0."""
    return f"{round(value, digits) + 0.0:.{digits}f}".replace("-", MINUS)


def why(plan: Plan) -> str:
    """Why there is no plan."""
    return "; ".join(plan.reasons) or plan.proof


def record(plan: Plan) -> dict[str, object]:
    """A plan as a row of a CSV file."""
    return {
        "deadline_s": plan.mission.limits.deadline_s,
        "perspective": plan.perspective,
        "hover_time_s": plan.hover_time_s,
        "rest_time_s": plan.rest_time_s,
        "flight_time_s": plan.flight_time_s,
        "mission_time_s": plan.mission_time_s,
        **{f"eta{n}_percent": eta(plan, name) for n, name in enumerate(PAPER, start=1)},
        "runs_dry_s": plan.runs_dry_s,
        "overfull_s": plan.overfull_s,
        "route": " > ".join(plan.route),
    }


def eta(plan: Plan, perspective: str) -> float:
    """State of charge at the end in a perspective [%]."""
    share = (plan.soc or {}).get(perspective)
    return math.nan if share is None else 100.0 * share


def existing(plans: Mapping[str, Plan]) -> dict[str, Plan]:
    """The plans that exist.

    Raises
    ------
    NotShownError
        If none does.
    """
    found = {name: plan for name, plan in plans.items() if plan}
    if not found:
        raise NotShownError(why([*plans.values()][-1]))
    return found


def missing(plans: Mapping[str, Plan]) -> Iterator[str]:
    """Which plans do not exist, and why; nothing if all do."""
    lost = [f"{name} ({why(plan)})" for name, plan in plans.items() if not plan]
    if lost:
        yield f"No plan: {'; '.join(lost)}."


def grounded(plans: Mapping[str, Plan], what: str) -> Iterator[str]:
    """How many of the plans shown as rows or bars cannot be flown; nothing if all can."""
    dry = sum(plan.runs_dry_s is not None for plan in plans.values())
    full = sum(p.runs_dry_s is None and p.overfull_s is not None for p in plans.values())
    for count, words in (
        (dry, "the available well runs dry before the end"),
        (full, "the well lasts, but is charged beyond full"),
    ):
        if count:
            yield f"In {count} of {len(plans)} {what} {words}: such a plan cannot be flown."


def deadlines_s(mission: Mission) -> Sequence[float]:
    """The paper's deadlines for its missions, a mission's own otherwise [s]."""
    return DEADLINES_S if is_papers(mission) else (mission.limits.deadline_s,)


def _titled(mission: Mission, words: str) -> str:
    from optuav.plots.style import printed

    return f"{printed(mission.name)}: {words}"


def _details(mission: Mission, *perspective: str) -> list[str]:
    deadline = f"T_max = {mission.limits.deadline_s:g} s"
    return [*(f"perspective {each}" for each in perspective), deadline]


def _curves(
    mission: Mission,
    file: str,
    lines: Sequence[plots.Line],
    marks: Sequence[plots.Mark] = (),
    part: str = "",
) -> Axes:
    texts = data()["exhibit"][file]
    title, x_label, y_label = (
        texts[key].format(part=part) for key in ("title", "x_label", "y_label")
    )
    from_zero = file.startswith("harvest")
    title = _titled(mission, title)
    return plots.curves(
        lines, title=title, x_label=x_label, y_label=y_label, marks=marks, y_from_zero=from_zero
    )


def _bars(plans: Mapping[str, Plan], mission: Mission, words: str) -> Axes:
    return plots.bars(
        {name: plan.hover_time_s for name, plan in plans.items()},
        title=_titled(mission, words),
        y_label="hover time Δ [s]",
        hatched=[name for name, plan in plans.items() if plan.flyable is False],
    )


def _refuse_turns(mission: Mission, perspective: str) -> None:
    if perspective == OURS and mission.battery.schedule != "pooled":
        raise NotShownError(
            "it takes many plans, and where packs take turns each is a search by simulation"
        )


# Figs. 1 and 2, Table II


def system(mission: Mission, perspective: str) -> Exhibit:
    """The map with the four trajectories."""
    plans = {
        name: solve(mission, trajectory=name, perspective=perspective) for name in TRAJECTORIES
    }
    found = existing(plans)
    records = [{"trajectory": name, **record(plan)} for name, plan in found.items()]
    routes = "; ".join(f"{name} {' → '.join(plan.route)}" for name, plan in found.items())
    axes, details = plots.trajectories(plans).plan, _details(mission, perspective)
    findings = (f"Routes: {routes}.", *missing(plans))
    return Exhibit(mission, "system", records, axes, (), perspective, details, findings)


def wells(mission: Mission, perspective: str) -> Exhibit:
    """The two wells at the end of every phase of the optimal plan."""
    from optuav.plots.charge import moments

    plan = existing({"": solve(mission, perspective=perspective)})[""]
    columns = ("moment", "available_percent_of_full", "bound_percent_of_full")
    levels = [(each.words, 100.0 * each.available, 100.0 * each.bound) for each in moments(plan)]
    findings = [
        f"The available well ends at {number(levels[-1][1], 1)} % of its full charge, the bound "
        f"well at {number(levels[-1][2], 1)} %.",
        *(f"{each[:1].upper()}{each[1:].removesuffix('.')}." for each in plan.warnings),
    ]
    records = [dict(zip(columns, level, strict=True)) for level in levels]
    axes, details = plots.tanks(plan)[0], _details(mission, perspective)
    return Exhibit(mission, "wells", records, axes, (), perspective, details, findings)


def direct_path(mission: Mission) -> Iterator[Exhibit]:
    """Table II: the direct path in every perspective, in whole slots as in the paper."""
    slot_s = mission.limits.slot_s
    plans = {
        f"{deadline_s:g} s, {perspective}": solve(
            with_deadline(mission, deadline_s), "P3", perspective=perspective, slot_s=slot_s
        )
        for deadline_s in deadlines_s(mission)
        for perspective in (*PAPER, OURS)
    }
    found = existing(plans)
    rows = [
        (
            name,
            *(f"{each:.2f}" for each in (plan.hover_time_s, plan.mission_time_s)),
            *(number(eta(plan, each), 2) for each in PAPER),
        )
        for name, plan in found.items()
    ]
    yield Exhibit(
        mission,
        "direct-path",
        [record(plan) for plan in found.values()],
        rows=[HEAD, *rows],
        details=(f"slots of {slot_s:g} s",),
        findings=(*grounded(found, "rows"), *missing(plans)),
    )
    if is_papers(mission):
        yield _beside_the_paper(mission)


def _beside_the_paper(mission: Mission) -> Exhibit:
    """The paper's cells, each with ours below it."""
    columns = ("cell", "paper", "ours", "shows_the_printed_digits")
    records, printed, ours = [], [], []
    for each in ledger(["table2"]).table2:
        paper, value = each.statement, each.printed if mission.name == "paper" else each.recovered
        same = agrees(paper.stated, value)
        cell = (paper.name, paper.stated, value, same)
        records.append(dict(zip(columns, cell, strict=True)))
        printed.append(paper.stated + " †" * (each.verdict is Verdict.CONTRADICTS))
        ours.append(each.shown(value) + " *" * (not same))
    rows: list[tuple[str, ...]] = [HEAD]
    for count, row in enumerate(table2.ROWS):
        cells = slice(5 * count, 5 * count + 5)
        rows.append((f"printed: {row.deadline_s} s, {row.perspective}", *printed[cells]))
        rows.append((f"ours, η at Δ = {row.slots_s:g} s", *ours[cells]))
    rows = [tuple(cell.replace("-", MINUS) for cell in row) for row in rows]
    notes = ("† contradicts other cells of the table; * other digits than the paper's.",)
    return Exhibit(mission, "table2", records, rows=rows, findings=notes)


# Figs. 3 to 6: perspectives and trajectories


def by_perspective(mission: Mission) -> Iterator[Exhibit]:
    """Hover time, and charge left, for every deadline."""
    from optuav.plots.style import WORDS

    for deadline_s in deadlines_s(mission):
        asked = with_deadline(mission, deadline_s)
        keys = [(perspective, name) for perspective in (*PAPER, OURS) for name in TRAJECTORIES]
        plans = {
            f"{WORDS[name]}, {perspective}": solve(asked, trajectory=name, perspective=perspective)
            for perspective, name in keys
        }
        found = existing(plans)
        shown = [
            plots.Bar(*key, plan.hover_time_s, eta(plan, "battery") / 100.0, plan.flyable is True)
            if plan
            else plots.Bar(*key, None, None)
            for key, plan in zip(keys, plans.values(), strict=True)
        ]
        title, least = _titled(mission, f"$T_{{max}}$ = {deadline_s:g} s"), mission.limits.min_soc
        names = dict(zip(plans, keys, strict=True))
        records = [{"trajectory": names[key][1], **record(plan)} for key, plan in found.items()]
        findings = (*_longest(plans), *grounded(found, "bars"), *missing(plans))
        part, details = f"{deadline_s:g}s", _details(asked)
        axes = plots.hover_bars(shown, f"{title}, hover time")
        yield Exhibit(asked, "hover-time", records, axes, (), part, details, findings)
        axes = plots.charge_bars(shown, f"{title}, charge left", least)
        yield Exhibit(asked, "charge-left", records, axes, (), part, details)


def _longest(plans: Mapping[str, Plan]) -> Iterator[str]:
    """The longest hover of every perspective, and the trajectories that reach it."""
    from optuav.plots.style import WORDS

    for perspective in (*PAPER, OURS):
        *others, optimal = (plans[f"{WORDS[name]}, {perspective}"] for name in TRAJECTORIES)
        if optimal:
            best = [
                WORDS[name]
                for name, plan in zip(TRAJECTORIES, others, strict=False)
                if plan and plan.hover_time_s >= optimal.hover_time_s - 1e-6
            ]
            by = " and ".join(best) or " → ".join(optimal.route)
            yield f"{perspective}: {optimal.hover_time_s:.2f} s by {by}."


# Figs. 7 and 8: the charge that must be left, and the size of the battery


def least_charge(mission: Mission, perspective: str) -> Exhibit:
    """Hover time by the charge that must be left, one curve a rotor speed."""
    _refuse_turns(mission, perspective)
    own, speed = mission.limits.min_soc, None
    least = LEAST_SOC if is_papers(mission) else [x for x in (own, own + 0.05, own + 0.1) if x < 1]
    changes: dict[float | None, dict[str, float]] = {None: {}}
    details = _details(mission, perspective)
    if has_rotors(mission) and mission.rotor is not None:
        speed = mission.rotor.max_speed_rad_s
        speeds = [share * speed for share in SPEED_SHARES]
        changes = {each: {"rotor.max_speed_rad_s": each} for each in speeds}
    else:
        details.insert(0, "loads by regime, without v_max")
    plans = {
        (each, 100.0 * soc): solve(
            mission.replace({**change, "limits.min_soc": soc}), perspective=perspective
        )
        for each, change in changes.items()
        for soc in least
    }
    if not any(plans.values()):
        raise NotShownError(why(solve(mission, perspective=perspective)))
    hovers = {key: plan.hover_time_s if plan else math.nan for key, plan in plans.items()}
    lines = [
        plots.Line(
            "loads by regime" if each is None else f"$v_{{max}}$ = {each:g} rad/s",
            [100.0 * soc for soc in least],
            [hovers[each, 100.0 * soc] for soc in least],
            "o",
        )
        for each in changes
    ]
    records = [
        {"max_speed_rad_s": each, "min_soc_percent": percent, "hover_time_s": hover_s}
        for (each, percent), hover_s in hovers.items()
    ]
    axes = _curves(mission, "least-charge", lines, part=perspective)
    at_own = {percent: hover_s for (each, percent), hover_s in hovers.items() if each == speed}
    findings = [*_falls(at_own, "" if speed is None else " at the mission's own v_max")]
    return Exhibit(mission, "least-charge", records, axes, (), perspective, details, findings)


def _falls(hovers: Mapping[float, float], where: str) -> Iterator[str]:
    """What the charge that must be left [%] costs of the hover time [s]."""
    lost = [percent for percent, hover_s in hovers.items() if math.isnan(hover_s)]
    if lost:
        yield f"From η0 = {lost[0]:g} % on there is no plan{where}."
    (least, first), *others = hovers.items()
    others = [(percent, hover_s) for percent, hover_s in others if percent not in lost]
    if others and all(math.isclose(hover_s, first, rel_tol=1e-6) for _, hover_s in others):
        yield f"Δ = {first:.2f} s for every η0, which is not what ends the hover."
    elif others:
        falls = (
            f"{100.0 * (1.0 - s / first):.2f} % at η0 = {percent:g} %" for percent, s in others
        )
        yield f"From η0 = {least:g} % on, Δ = {first:.2f} s falls by {', '.join(falls)}."


def battery_size(mission: Mission, perspective: str) -> Exhibit:
    """The direct path with and without laser by pack, and the optimum with laser."""
    if mission.laser is None:
        raise NotShownError("the mission has no laser")
    _refuse_turns(mission, perspective)
    dark, own_As = curves.without_laser(mission), mission.battery.capacity_As
    best_s = existing({"": solve(mission, perspective=perspective)})[""].hover_time_s
    crossing = curves.crossing(mission, best_s, perspective)
    full = curves.saturation(dark, perspective)
    known = [each for each in (crossing, full) if each is not None]
    bends = [*known, curves.saturation(mission, perspective) or 0.0]
    first_As, last_As = 0.8 * own_As, max(1.15 * own_As, *(1.06 * each for each in known), 0.0)
    packs_As = np.union1d(
        np.linspace(first_As, last_As, PACKS[perspective]),
        [each for each in bends if first_As < each < last_As],
    ).tolist()
    series = {
        "optimum_with_laser_and_own_pack_s": [best_s] * len(packs_As),
        "direct_without_laser_s": [_direct_s(dark, each, perspective) for each in packs_As],
        "direct_with_laser_s": [_direct_s(mission, each, perspective) for each in packs_As],
    }
    labels = (f"optimal, laser, $B_i$ = {own_As:g} A s", "direct, no laser", "direct, laser")
    lines = [
        plots.Line(label, packs_As, hovers)
        for label, hovers in zip(labels, series.values(), strict=True)
    ]
    marks, findings = [], []
    if crossing is not None:
        marks.append(plots.Mark(crossing, f"as long without laser: {crossing:.0f} A s"))
        findings.append(
            f"Without laser the direct path hovers {best_s:.2f} s, as the optimum does with it, "
            f"from {crossing:.0f} A s a pack on: the laser saves {crossing - own_As:.0f} A s, "
            f"{100.0 * (crossing / own_As - 1.0):.2f} % of the pack."
        )
    if full is not None:
        marks.append(plots.Mark(full, f"ended by the deadline: {full:.0f} A s"))
        findings.append(f"From {full:.0f} A s on the deadline ends the direct path without laser.")
    rows = zip(packs_As, *series.values(), strict=True)
    records = [dict(zip(("pack_As", *series), row, strict=True)) for row in rows]
    axes = _curves(mission, "battery-size", lines, marks, perspective)
    details = _details(mission, perspective)
    return Exhibit(mission, "battery-size", records, axes, (), perspective, details, findings)


def _direct_s(mission: Mission, pack_As: float, perspective: str) -> float:
    plan = curves.direct(mission, pack_As, perspective)
    return plan.hover_time_s if plan else math.nan


# Figs. 9 and 10: wind, and charging from afar


def wind(mission: Mission) -> Iterator[Exhibit]:
    """Energy of a hover by the wind along x, y and z."""
    if not has_rotors(mission):
        raise NotShownError("loads that are stated by regime know no wind")
    found = {axis: curves.hover_energy(mission, along) for axis, along in AXES.items()}
    level, up = (curves.wind_limits_N(mission, AXES[axis]) for axis in ("x", "z"))
    ends = [("x, y", level[0]), ("z", up[0]), ("x, y", level[1]), ("z", up[1])]
    marks = [plots.Mark(at, f"${axis}$: {number(at, 2)} N") for axis, at in ends]
    lines = [
        plots.Line(f"wind along ${axis}$", curve.force_N, curve.energy_J / 1000.0)
        for axis, curve in found.items()
    ]
    records = [
        {"axis": axis, "wind_N": float(force_N), "energy_J": float(energy_J)}
        for axis, curve in found.items()
        for force_N, energy_J in zip(*curve, strict=True)
    ]
    finding = (
        f"Level wind is held up to {level[1]:.4f} N, wind along z from {number(up[0], 4)} to "
        f"{up[1]:.4f} N; the energy is least at {found['x'].calmest_N:g} N level and at "
        f"{found['z'].calmest_N:g} N upwards, where the wind carries the weight."
    )
    axes = _curves(mission, "wind", lines, marks)
    yield Exhibit(mission, "wind", records, axes, findings=(finding,))


def charging(mission: Mission) -> Iterator[Exhibit]:
    """Harvested energy, and efficiency, by the distance from the laser."""
    if mission.laser is None:
        raise NotShownError("the mission has no laser")
    if mission.flight.model == "regimes" and mission.flight.charge_power_W is not None:
        raise NotShownError("the mission states with what it charges, whatever the distance")
    powers_W = sorted({*SOURCES_W, mission.laser.power_W})
    found = {power: curves.harvest(mission, power, DISTANCES_M) for power in powers_W}
    columns = ("source_power_W", "distance_m", "harvested_J", "efficiency_percent")
    records = [
        dict(zip(columns, (power, *map(float, row)), strict=True))
        for power, curve in found.items()
        for row in zip(DISTANCES_M, curve.energy_J, 100.0 * curve.efficiency, strict=True)
    ]
    near = {p: 100.0 * curve.efficiency[DISTANCES_M <= NEAR_M] for p, curve in found.items()}
    spans = "; ".join(f"{p:g} W {each.min():.1f} to {each.max():.1f} %" for p, each in near.items())
    finding = f"Efficiency below 1 km by source: {spans}. No limit of the battery is applied."
    energies = {power: curve.energy_J / 1000.0 for power, curve in found.items()}
    percents = {power: 100.0 * curve.efficiency for power, curve in found.items()}
    for file, shown in (("harvested-energy", energies), ("harvest-efficiency", percents)):
        lines = [
            plots.Line(f"$P_s$ = {power:g} W", DISTANCES_M / 1000.0, values)
            for power, values in shown.items()
        ]
        axes = _curves(mission, file, lines)
        yield Exhibit(mission, file, records, axes, findings=(finding,))


# What the paper leaves out


def runs_dry(mission: Mission) -> Iterator[Exhibit]:
    """The available well over the direct path, of which η1 says nothing."""
    plan = existing({"": solve(mission, "P3", perspective="battery")})[""]
    kept = solve(mission, "P3")
    level = 100.0 * plan.phases[-1].available_As[0] / float(vehicle.pool(mission).capacity_As)
    lasting = f"Δ = {kept.hover_time_s:.2f} s" if kept else f"there is no plan: {why(kept)}"
    findings = [
        f"η1 = {eta(plan, 'battery'):.2f} % is left, but the available well ends at "
        f"{number(level, 1)} % of the capacity.",
        f"With a well that lasts {lasting}.",
    ]
    if plan.runs_dry_s is not None:
        empty = f"It is empty at {plan.runs_dry_s:.2f} s of {plan.mission_time_s:.2f} s."
        findings.insert(1, empty)
    yield _wells_over(plan, "runs-dry", [f"Δ = {plan.hover_time_s:.2f} s"], findings)


def overcharges(mission: Mission) -> Iterator[Exhibit]:
    """The wells where the UAV rests first, which charges a battery that is nearly full."""
    from optuav.plots.charge import course

    if not mission.buildings:
        raise NotShownError("the mission has no building to rest on")
    names = [each.name for each in mission.buildings]
    plans = {
        name: solve(mission, "P4", building=name, order="rest-first", perspective="battery")
        for name in names
    }
    plan = max(existing(plans).values(), key=lambda each: each.hover_time_s)
    pool = vehicle.pool(mission)
    highest = 100.0 * float(course(pool, plan).available_As.max() / pool.full.available_As)
    when = "" if plan.overfull_s is None else f", which is full from {plan.overfull_s:.2f} s on"
    finding = f"Charging takes the available well to {highest:.1f} % of its full charge{when}."
    times = (f"Δ = {plan.hover_time_s:.2f} s", f"T' = {plan.rest_time_s:.2f} s")
    yield _wells_over(plan, "overcharges", (f"on {plan.route[1]}", *times), (finding,))


def _wells_over(plan: Plan, file: str, details: Sequence[str], findings: Sequence[str]) -> Exhibit:
    from optuav.plots.charge import course

    columns = ("time_s", "available_As", "bound_As")
    rows = zip(*course(vehicle.pool(plan.mission), plan), strict=True)
    records = [dict(zip(columns, map(float, row), strict=True)) for row in rows]
    axes = plots.battery(plan).wells
    return Exhibit(plan.mission, file, records, axes, details=details, findings=findings)


def second_problem(mission: Mission) -> Iterator[Exhibit]:
    """(P2) in its two readings beside (P1)."""
    asked = with_deadline(mission, deadlines_s(mission)[0])
    labels = {
        "P1": "(P1)\nlongest hover",
        "P2": "(P2) as printed\nleast $T_{fl} + T'$",
        "P2-tight": "(P2), whole\ndeadline used",
    }
    plans = {problem: solve(asked, problem, perspective="battery") for problem in labels}
    existing({"P1": plans["P1"]})
    found = existing(plans)
    hovers = "; ".join(
        f"{name} " + (f"{plan.hover_time_s:.2f} s" if plan else f"no plan, {why(plan)}")
        for name, plan in plans.items()
    )
    yield Exhibit(
        asked,
        "second-problem",
        [{"problem": problem, **record(plan)} for problem, plan in found.items()],
        _bars({labels[name]: plan for name, plan in found.items()}, asked, "hover by problem"),
        details=_details(asked),
        findings=(
            "The objective of (P2) as printed has no Δ: every feasible Δ is optimal, 0 included.",
            "P2-tight asks, as the text does, for Δ = T_max − T_fl − T': only plans that use the "
            "whole deadline are left.",
            f"Hover: {hovers}.",
        ),
    )


def more_stops(mission: Mission) -> Iterator[Exhibit]:
    """The longest hover with two rests, and in two pieces, in which the available well lasts."""
    _refuse_turns(mission, OURS)
    plans = {
        f"{words}, $T_{{max}}$ = {deadline_s:g} s": solve(
            with_deadline(mission, deadline_s), stops=stops, hovers=hovers
        )
        for deadline_s in (times * mission.limits.deadline_s for times in LATER)
        for words, (stops, hovers) in WAYS.items()
    }
    found = existing(plans)
    stays = {name: ", ".join(_stays(plan)) for name, plan in found.items()}
    answers = (
        f"{plan.hover_time_s:.3f} s; {stays[name]}" if plan else f"no plan, {why(plan)}"
        for name, plan in plans.items()
    )
    bars = {name.replace(", $", ",\n$"): plan for name, plan in found.items()}
    names = [name.replace("$T_{max}$", "T_max") for name in plans]
    yield Exhibit(
        mission,
        "more-stops",
        [
            {"most": name.partition(", $")[0], **record(plan), "stays": stays[name]}
            for name, plan in found.items()
        ],
        _bars(bars, mission, "more rests, and hovering in pieces"),
        details=[f"perspective {OURS}"],
        findings=[f"{name}: {answer}." for name, answer in zip(names, answers, strict=True)],
    )


def _stays(plan: Plan) -> list[str]:
    return [
        f"{stop.kind if stop.kind == stop.at else f'{stop.kind} {stop.at}'} {stop.duration_s:.2f} s"
        for stop in plan.stops
    ]


def peak_speed(mission: Mission) -> Iterator[Exhibit]:
    """Speed over the first leg: nothing in the model slows the UAV down."""
    from optuav.plots.files import modelled_leg

    plan = existing({"": solve(mission, "P3", perspective="battery")})[""]
    first = modelled_leg(plan)
    if first is None:
        raise NotShownError("the mission's legs are stated, not modelled")
    columns = ("start_place", "end_place", "distance_m", "duration_s", "peak_speed_m_s")
    legs = [phase for phase in plan.phases if phase.kind == "flight"]
    records = [{name: getattr(leg, name) for name in columns} for leg in legs]
    capped = mission.flight.model == "regimes" and mission.flight.max_speed_m_s is not None
    speed, cap = plan.peak_speed_m_s, " but the mission's" if capped else ""
    finding = (
        f"Peak speed {speed:.2f} m/s, {3.6 * speed:.0f} km/h: the legs know neither drag nor a "
        f"largest speed{cap}."
    )
    axes = plots.leg(mission, first.start_place, first.end_place).speed
    yield Exhibit(mission, "peak-speed", records, axes, findings=(finding,))


def misprints(mission: Mission) -> Iterator[Exhibit]:
    """All misprints, and pictures of two: c_9 of the rotors, the signs of η3."""
    if not is_papers(mission):
        raise NotShownError("it is about the paper's own numbers")
    if has_rotors(mission):
        found = data()["misprint"]
        head = ("place", "printed", "right", "effect")
        rows = [head, *(tuple(each[key] for key in head) for each in found)]
        yield Exhibit(mission, "misprints", found, rows=rows)
        motor, x = vehicle.motor(mission), np.linspace(-200.0, 200.0, 81)
        right = np.asarray(rotor.power(motor, 1000.0, x), dtype=float) / 1000.0
        c6, c9 = (float(rotor.power_coefficients(motor)[each]) for each in (5, 8))
        wrong_c9 = motor.torque_constant_Nm_A / motor.friction_torque_Nm * c6
        wrong = right + 1000.0 * x * (wrong_c9 - c9)
        file, columns = "c9", ("change_rad_s2", "power_kW", "power_as_printed_kW")
        finding = (
            f"As printed c_9 is {wrong_c9 / c9:.3g} times what e·i needs; at constant speed it has "
            "no part."
        )
    else:
        x = np.linspace(0.0, 1000.0, 101)
        right = np.array([table2.charge_left(mission, 3, hover_s) for hover_s in x])
        wrong = 2.0 * right[0] - right
        file, columns = "signs", ("hover_time_s", "eta3_percent", "eta3_as_printed_percent")
        finding = "As printed the battery would gain charge from hovering."
    lines = [plots.Line("right", x, right), plots.Line("as printed", x, wrong)]
    rows_of = zip(x.tolist(), right.tolist(), wrong.tolist(), strict=True)
    records = [dict(zip(columns, row, strict=True)) for row in rows_of]
    yield Exhibit(mission, file, records, _curves(mission, file, lines), findings=(finding,))
