"""The tables and figures of the paper for any mission, and results beyond the paper."""

import contextlib
import itertools
import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from operator import attrgetter
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from formulations.formulation import Formulation
from formulations.p1 import P1
from formulations.p2 import P2
from formulations.p3 import P3
from formulations.p4 import P4
from formulations.soc import AVAILABLE, PAPER
from optuav import plots
from optuav.judge import replay
from optuav.mission import Mission
from optuav.options import Perspective
from optuav.paper import curves
from optuav.paper.curves import BEST, DATA, solve, with_deadline
from optuav.paper.ledger import FAR_M, NEAR_M, Verdict, agrees, ledger
from optuav.plan import Plan
from optuav.plots.files import modelled_leg
from optuav.plots.style import drawable
from optuav.presentation.numbers import figure, fixed, minus, percent, seconds

if TYPE_CHECKING:  # `optuav.plots` reports missing libraries
    from matplotlib.axes import Axes

Record: TypeAlias = Mapping[str, Any]
Exhibits: TypeAlias = Iterator["Exhibit"]

PACKS = {"battery": 61, AVAILABLE: 25}  # Points of the curves in Fig. 8.
SOURCES_W = (100.0, 250.0, 500.0, 1000.0)
"""Source powers in Fig. 10; the paper does not print its own."""
NO_SPEED = "loads by regime"
WAYS = {"one rest, one hover": (1, 1), "two rests": (2, 1), "two hovers": (1, 2)}
"""Most rests and most hovers."""
LATER = (1.0, 2.0)  # Deadlines for trying more stops, over the mission's own
HEAD = ("direct path", "Δ [s]", "T [s]", "η1 [%]", "η2 [%]", "η3 [%]")


class NotShownError(Exception):
    """Why a mission has no such study, or not in some part."""


class Exhibit:
    """A picture, or a table whose first row has the headings, with its numbers and findings.

    `file` and `part` make the name of its files; `file` is also the key of its texts in the
    statements' file. Findings with words that are missing or None are left out.
    """

    def __init__(
        self,
        mission: Mission,
        file: str,
        records: Sequence[Record],
        words: Mapping[str, object] = {},
        axes: "Axes | None" = None,
        bars: Sequence[plots.Bar] = (),
        marks: Sequence[plots.Mark] = (),
        rows: Sequence[Sequence[str]] = (),
        part: str = "",
        findings: Iterable[str] = (),
    ) -> None:
        self.mission, self.file, self.part = mission, file, part
        self.records, self.rows, self.axes = records, rows, axes
        known_of_file = DATA["exhibit"][file]
        options = {"part": part, "deadline_s": mission.limits.deadline_s}
        options |= {name: value for name, value in words.items() if value is not None}
        labels = known_of_file.keys() & {"title", "x_label", "y_label"}
        if texts := {label: known_of_file[label].format(**options) for label in labels}:
            texts["title"] = f"{drawable(mission.name)}: {texts['title']}"
            if bars:
                self.axes = plots.bars(bars, **texts, level=next(iter(marks), None))
            else:
                lines = list(_lines(records, known_of_file, options))
                from_zero = known_of_file.get("y_from_zero", False)
                self.axes = plots.curves(lines, **texts, marks=marks, y_from_zero=from_zero)
        self.findings = list[str]()
        for sentence in known_of_file.get("findings", ()):
            # Findings on a plan or a crossing that does not exist are left out.
            with contextlib.suppress(KeyError):
                self.findings.append(sentence.format(**options))
        self.findings += findings
        self.details = known_of_file.get("details", "").format(**options)

    @property
    def name(self) -> str:
        """Name of its files."""
        mission = re.sub(r"[^\w.-]+", "-", self.mission.name).strip("-.") or "mission"
        return ".".join(filter(None, (self.file, mission, self.part)))

    @property
    def numbers(self) -> Sequence[str]:
        """Its number in the paper, such as ``"fig5"``; several if they differ in the deadline."""
        numbers: Mapping[str, str] = DATA["exhibit"][self.file].get("numbers", {})
        number_of_part = is_papers(self.mission) and numbers.get(self.part)
        return [number_of_part] if number_of_part else [*numbers.values()]

    @property
    def caption(self) -> str:
        """Caption: the content, its place in the paper for the paper's mission, and the mission."""
        words = DATA["exhibit"][self.file]["words"]
        if is_papers(self.mission) and self.numbers:
            place = self.numbers[0].replace("fig", "Fig. ").replace("table2", "Table II")
            words += f" ({place} of the paper)"
        return f"{words}: {', '.join(filter(None, (self.mission.name, self.details)))}"


def _lines(records: Sequence[Record], stated: Record, known: Record) -> Iterator[plots.Line]:
    """Columns of records as curves, one for each label that the records give."""
    x_unit, y_unit = stated.get("units", (1.0, 1.0))
    for column, label in stated["lines"].items():
        curve: dict[str, list[tuple[float, float]]] = {}
        for row in records:
            whole = row.get("max_speed_rad_s", 0.0) is not None
            name = label.format(**{**known, **row}) if whole else NO_SPEED
            curve.setdefault(name, []).append((row[stated["x"]], row[column]))
        for name, points in curve.items():
            x, y = np.array(points, dtype=float).T
            yield plots.Line(name, x / x_unit, y / y_unit, stated.get("marker", ""))


def is_papers(mission: Mission) -> bool:
    """Return whether the paper's numbers belong to a mission."""
    return mission.name in ("paper", "paper-table2")


def number(value: float, digits: int) -> str:
    """A number with a minus for its sign, and none where it rounds to 0."""
    return fixed(value, digits)


def why(plan: Plan) -> str:
    """The reasons for no plan."""
    return "; ".join(plan.reasons) or plan.proof


def eta(plan: Plan, perspective: Perspective) -> float:
    """State of charge at the end in a perspective [%]."""
    return 100.0 * (plan.soc or {}).get(perspective, math.nan)


def existing(plans: Mapping[str, Plan]) -> dict[str, Plan]:
    """Return the plans that exist; if none does, the study is not shown."""
    if not any(plans.values()):
        raise NotShownError(why([*plans.values()][-1]))
    return {name: plan for name, plan in plans.items() if plan}


def missing(plans: Mapping[str, Plan]) -> Iterator[str]:
    """Say which plans do not exist, and why; nothing if all do."""
    lost = [f"{name} ({why(plan)})" for name, plan in plans.items() if not plan]
    if lost:
        yield f"No plan: {'; '.join(lost)}."


def grounded(plans: Mapping[str, Plan], what: str) -> Iterator[str]:
    """Say how many plans shown as rows or bars cannot be flown; nothing if all can."""
    dry = [plan.runs_dry_s is not None for plan in plans.values()]
    full = [plan.overfull_s is not None for plan in plans.values() if plan.runs_dry_s is None]
    others = [plan.flyable is False and not plan.warnings for plan in plans.values()]
    for count, words in (
        (sum(dry), "the available well runs dry before the end"),
        (sum(full), "the well lasts, but is charged beyond full"),
        (sum(others), "the wells last, but another limit is broken"),
    ):
        if count:
            yield f"In {count} of {len(plans)} {what} {words}: such a plan cannot be flown."


def deadlines_s(mission: Mission) -> Sequence[float]:
    """The paper's deadlines for its missions, a mission's own otherwise [s]."""
    return curves.DEADLINES_S if is_papers(mission) else (mission.limits.deadline_s,)


def _plan(mission: Mission, perspective: Perspective, problem: Formulation = BEST) -> Plan:
    """Return a plan that exists; without one the study is not shown."""
    return existing({"": solve(mission, problem, perspective=perspective)})[""]


def _records(plans: Mapping[str, Plan], column: str) -> list[Record]:
    """Plans as rows of a CSV file; a column has their names without what stands last in them."""
    times, ends = ("hover", "rest", "flight", "mission"), ("runs_dry_s", "overfull_s")
    return [
        {
            column: name.rpartition(", ")[0] or name,
            "deadline_s": plan.mission.limits.deadline_s,
            "perspective": plan.perspective,
            **{f"{time}_time_s": getattr(plan, f"{time}_time_s") for time in times},
            **{
                f"eta{n}_percent": eta(plan, perspective)
                for n, perspective in enumerate(PAPER, start=1)
            },
            **{end: getattr(plan, end) for end in ends},
            "route": " > ".join(plan.route),
            "stays": "; ".join(_stays(plan)),
        }
        for name, plan in plans.items()
    ]


def _stays(plan: Plan) -> list[str]:
    """The stops of a plan in words."""
    stops = ((dict.fromkeys((stop.kind, str(stop.at))), stop.duration_s) for stop in plan.stops)
    return [f"{' '.join(names)} {seconds(duration_s)}" for names, duration_s in stops]


def _columns(**values: Any) -> list[Record]:
    """Rows of a CSV file from its columns; a scalar stands in each row."""
    columns = (array.tolist() for array in np.broadcast_arrays(*values.values()))
    return [dict(zip(values, row, strict=True)) for row in zip(*columns, strict=True)]


def system(mission: Mission, perspective: Perspective) -> Exhibits:
    """The map with the four trajectories."""
    plans = curves.by_trajectory(mission, perspective)
    plans_found, lost = existing(plans), missing(plans)
    routes = "; ".join(f"{name} {' → '.join(plan.route)}" for name, plan in plans_found.items())
    records, words = _records(plans_found, "trajectory"), {"routes": routes}
    axes = plots.trajectories(plans).plan
    yield Exhibit(mission, "system", records, words, axes, part=perspective, findings=lost)


def wells(mission: Mission, perspective: Perspective) -> Exhibits:
    """The two wells over the optimal plan."""
    plan, full = _plan(mission, perspective), mission.pool.full
    words = {
        name: number(100.0 * sum(getattr(plan.phases[-1], f"{name}_As")) / float(size), 1)
        for name, size in zip(("available", "bound"), full, strict=True)
    }
    said = [f"{warning[:1].upper()}{warning[1:].removesuffix('.')}." for warning in plan.warnings]
    yield _course(plan, "wells", words, part=perspective, findings=said)


def _course(plan: Plan, file: str, words: Mapping[str, object], **others: Any) -> Exhibit:
    """The wells of a plan over time."""
    trace = replay(plan).trace
    wells = {name: getattr(trace, name).sum(axis=1) for name in ("available_As", "bound_As")}
    highest = 100.0 * wells["available_As"].max() / float(plan.mission.pool.full[0])
    context = {"plan": plan, "highest": highest, **words}
    records, axes = _columns(time_s=trace.time_s, **wells), plots.wells([plan])[0]
    return Exhibit(plan.mission, file, records, context, axes, **others)


def direct_path(mission: Mission) -> Exhibits:
    """Table II: the direct path in every perspective, in whole slots as in the paper."""
    plans = {
        f"{figure(deadline_s)} s, {perspective}": curves.table2_row(
            mission, deadline_s, perspective
        )
        for deadline_s in deadlines_s(mission)
        for perspective in (*PAPER, AVAILABLE)
    }
    plans_found = existing(plans)
    rows: list[Sequence[str]] = [HEAD]
    for name, plan in plans_found.items():
        values = (
            plan.hover_time_s,
            plan.mission_time_s,
            *(eta(plan, perspective) for perspective in PAPER),
        )
        rows.append((name, *(number(value, 2) for value in values)))
    said = (*grounded(plans_found, "rows"), *missing(plans))
    records, words = _records(plans_found, "deadline"), {"slot_s": mission.limits.slot_s}
    yield Exhibit(mission, "direct-path", records, words, rows=rows, findings=said)
    if is_papers(mission):
        yield _beside_the_paper(mission)


def _beside_the_paper(mission: Mission) -> Exhibit:
    """The paper's cells, each with ours below it."""
    entries, records = ledger("table2").entries, list[Record]()
    above, below = list[str](), list[str]()
    for entry in entries:
        as_printed, wrong = entry.statement.stated, entry.verdict is Verdict.CONTRADICTS
        ours = entry.printed if mission.name == "paper" else entry.recovered
        cell = {"cell": entry.statement.name, "paper": as_printed, "ours": ours}
        records.append({**cell, "shows_the_printed_digits": (same := agrees(as_printed, ours))})
        above.append(minus(f"{as_printed}{' †' * wrong}"))
        below.append(minus(f"{entry.figure(ours)}{' *' * (not same)}"))
    rows: list[Sequence[str]] = [HEAD]
    for first in range(0, len(entries), len(HEAD) - 1):
        row = slice(first, first + len(HEAD) - 1)
        (_, deadline_s, perspective), *_, (_, _, slots_s) = (
            e.statement.compute for e in entries[row]
        )
        rows.append((f"printed: {deadline_s} s, {perspective}", *above[row]))
        rows.append((f"ours, η at Δ = {slots_s} s", *below[row]))
    return Exhibit(mission, "table2", records, rows=rows)


def by_perspective(mission: Mission) -> Exhibits:
    """Hover time, and charge left, for every deadline."""
    least = plots.Mark(100.0 * mission.limits.min_soc, "least, $η_0$")
    for deadline_s in deadlines_s(mission):
        changed = with_deadline(mission, deadline_s)
        chosen: dict[tuple[str, str], Plan] = {
            (perspective, name): plan
            for perspective in (*PAPER, AVAILABLE)
            for name, plan in curves.by_trajectory(changed, perspective).items()
        }
        plans = {f"{name}, {perspective}": plan for (perspective, name), plan in chosen.items()}
        flown, part = existing(plans), f"{figure(deadline_s)}s"
        records, bars = _records(flown, "trajectory"), _bars(chosen)
        said = list[str]()
        for perspective in (*PAPER, AVAILABLE):
            best, names = curves.longest(changed, perspective)
            ways = " and ".join(names) or " → ".join(best.route)
            said += [f"{perspective}: {seconds(best.hover_time_s)} by {ways}."] if best else []
        said += (*grounded(flown, "bars"), *missing(plans))
        yield Exhibit(changed, "hover-time", records, bars=bars, part=part, findings=said)
        bars = _bars(chosen, lambda plan: eta(plan, "battery"))
        yield Exhibit(changed, "charge-left", records, bars=bars, marks=[least], part=part)


def _bars(
    plans: Mapping[tuple[str, str], Plan],
    value: Callable[[Plan], float] = attrgetter("hover_time_s"),
) -> list[plots.Bar]:
    """A value of plans by their group and name, None without a plan."""
    return [plots.Bar(*n, value(p) if p else None, p.flyable) for n, p in plans.items()]


def least_charge(mission: Mission, perspective: Perspective) -> Exhibits:
    """Hover time by the charge that must be left, one curve per rotor speed."""
    own_share, own_speed, loads = mission.limits.min_soc, None, f"{NO_SPEED}, without v_max, "
    charges = [share for share in (own_share, own_share + 0.05, own_share + 0.1) if share < 1.0]
    speeds: Sequence[float | None] = (None,)
    if mission.flight.model == "rotors" and mission.rotor is not None:
        own_speed, loads = mission.rotor.max_speed_rad_s, ""
        speeds = [share * own_speed for share in curves.SPEED_SHARES]
    records = list[dict[str, Any]]()
    least = curves.LEAST_SOC if is_papers(mission) else charges
    for speed, soc in itertools.product(speeds, least):
        change = {} if speed is None else {"rotor.max_speed_rad_s": speed}
        plan = solve(mission.replace({**change, "limits.min_soc": soc}), perspective=perspective)
        hover_s, route = (plan.hover_time_s, " > ".join(plan.route)) if plan else (math.nan, "")
        row = {"max_speed_rad_s": speed, "min_soc_percent": 100.0 * soc}
        records.append({**row, "hover_time_s": hover_s, "route": route})
    if all(math.isnan(row["hover_time_s"]) for row in records):
        _plan(mission, perspective)
    own_rows = [row for row in records if row["max_speed_rad_s"] == own_speed]
    pairs = [(row["min_soc_percent"], row["hover_time_s"]) for row in own_rows]
    lost = next((figure(soc) for soc, hover_s in pairs if math.isnan(hover_s)), None)
    words = {"lost": lost, "where": "" if loads else " at the mission's own v_max", "loads": loads}
    measured = [pair for pair in pairs if not math.isnan(pair[1])]
    if len(measured) > 1:
        (start, first), *others = measured
        if all(math.isclose(hover_s, first, rel_tol=1e-6) for _, hover_s in others):
            words["constant"] = first
        else:
            falls = (f"{percent(1.0 - s / first)} at η0 = {figure(n)} %" for n, s in others)
            words |= {"least": start, "first": first, "falls": ", ".join(falls)}
    yield Exhibit(mission, "least-charge", records, words, part=perspective)


def battery_size(mission: Mission, perspective: Perspective) -> Exhibits:
    """The direct path with and without laser by pack, and the optimum with laser."""
    dark, own_As = curves.without_laser(mission), mission.battery.capacity_As
    best_s = _plan(mission, perspective).hover_time_s
    crossing_As = curves.least_pack(dark, perspective, best_s)
    full_As = curves.least_pack(dark, perspective)
    ends = {"as long without laser": crossing_As, "ended by the deadline": full_As}
    marks = [plots.Mark(at, f"{words}: {fixed(at, 0)} A s") for words, at in ends.items() if at]
    first_As, last_As = 0.8 * own_As, max([1.15 * own_As, *(1.06 * mark.at for mark in marks)])
    bends = [*(mark.at for mark in marks), curves.least_pack(mission, perspective) or 0.0]
    inner = [bend for bend in bends if first_As < bend < last_As]
    packs_As = np.union1d(np.linspace(first_As, last_As, PACKS[perspective]), inner).tolist()
    columns = {"pack_As": packs_As, "optimum_with_laser_and_own_pack_s": best_s}
    for name, subject in (("without", dark), ("with", mission)):
        plans = (curves.direct(subject, pack_As, perspective) for pack_As in packs_As)
        columns[f"direct_{name}_laser_s"] = [p.hover_time_s if p else math.nan for p in plans]
    words = {"own_As": own_As, "best_s": best_s, "crossing_As": crossing_As, "full_As": full_As}
    if crossing_As is not None:
        words |= {"saved_As": crossing_As - own_As, "percent": 100.0 * (crossing_As / own_As - 1.0)}
    records = _columns(**columns)
    yield Exhibit(mission, "battery-size", records, words, marks=marks, part=perspective)


def wind(mission: Mission) -> Exhibits:
    """Energy of a hover by the wind along x, y and z."""
    records: list[Record] = []
    for axis in curves.AXES:
        force_N, energy_J = curves.hover_energy(mission, axis)
        records += _columns(axis=axis, wind_N=force_N, energy_J=energy_J)
    level, up = (curves.wind_limits_N(mission, axis) for axis in ("x", "z"))
    ends = [("x, y", level[0]), ("z", up[0]), ("x, y", level[1]), ("z", up[1])]
    marks = [plots.Mark(at, f"${axis}$: {number(at, 2)} N") for axis, at in ends]
    words: dict[str, object] = {"level": level[1], "down": number(up[0], 4), "up": up[1]}
    words |= {f"calm_{axis}": curves.calmest_N(mission, axis) for axis in ("x", "z")}
    yield Exhibit(mission, "wind", records, words, marks=marks)


def charging(mission: Mission) -> Exhibits:
    """Harvested energy, and efficiency, by the distance from the laser."""
    if mission.flight_model.charging() is not None:
        raise NotShownError("the mission states its charging, whatever the distance")
    assert mission.laser is not None
    records, spans = list[Record](), list[str]()
    for power_W in sorted({*SOURCES_W, mission.laser.power_W}):
        energy_J, efficiency = curves.harvest(mission, power_W, FAR_M)
        near = efficiency[NEAR_M[-1] >= FAR_M]
        columns = {"source_power_W": power_W, "distance_m": FAR_M, "harvested_J": energy_J}
        records += _columns(**columns, efficiency_percent=100.0 * efficiency)
        spans.append(f"{figure(power_W)} W {percent(near.min(), 1)} to {percent(near.max(), 1)}")
    for file in ("harvested-energy", "harvest-efficiency"):
        yield Exhibit(mission, file, records, {"spans": "; ".join(spans)})


def runs_dry(mission: Mission) -> Exhibits:
    """The available well over the direct path, which η1 ignores."""
    plan, kept = _plan(mission, "battery", P3()), solve(mission, P3())
    level = 100.0 * plan.phases[-1].available_As[0] / float(mission.pool.capacity_As)
    words = {
        "left": eta(plan, "battery"),
        "level": number(level, 1),
        "dry_s": plan.runs_dry_s,
        "lasting": f"Δ = {seconds(kept.hover_time_s)}" if kept else f"no plan exists: {why(kept)}",
    }
    yield _course(plan, "runs-dry", words)


def overcharges(mission: Mission) -> Exhibits:
    """The wells where the UAV rests first, which charges a battery that is nearly full."""
    names = mission.buildings.names
    plans = {n: solve(mission, P4(n, order="rest-first"), perspective="battery") for n in names}
    plan = max(existing(plans).values(), key=attrgetter("hover_time_s"))
    yield _course(plan, "overcharges", {"full_s": plan.overfull_s})


def second_problem(mission: Mission) -> Exhibits:
    """(P2) in its two readings beside (P1)."""
    changed = with_deadline(mission, deadlines_s(mission)[0])
    _plan(changed, "battery")
    problems = (P1(), P2(), P2(tight=True))
    plans = {problem.name: solve(changed, problem, perspective="battery") for problem in problems}
    labels = DATA["exhibit"]["second-problem"]["labels"]
    said = {n: seconds(p.hover_time_s) if p else f"no plan, {why(p)}" for n, p in plans.items()}
    hovers = "; ".join(f"{name} {words}" for name, words in said.items())
    records = _records(flown := existing(plans), "problem")
    bars = _bars({(labels[name], ""): plan for name, plan in flown.items()})
    yield Exhibit(changed, "second-problem", records, {"hovers": hovers}, bars=bars)


def more_stops(mission: Mission) -> Exhibits:
    """The longest hover with two rests, and in two pieces, while the available well lasts."""
    plans = dict[str, Plan]()
    for times, (words, (stops, hovers)) in itertools.product(LATER, WAYS.items()):
        deadline_s = times * mission.limits.deadline_s
        plan = solve(with_deadline(mission, deadline_s), P1(stops=stops, hovers=hovers))
        plans[f"{words}, T_max = {figure(deadline_s)} s"] = plan
    flown = existing(plans)
    said = [f"{n}: {seconds(p.hover_time_s, 3)}; {', '.join(_stays(p))}." for n, p in flown.items()]
    bars = _bars({(n.replace(", T_max", ",\n$T_{\\max}$"), ""): plan for n, plan in flown.items()})
    said += missing(plans)
    yield Exhibit(mission, "more-stops", _records(flown, "most"), bars=bars, findings=said)


def peak_speed(mission: Mission) -> Exhibits:
    """Speed over the first leg: nothing in the model slows the UAV down."""
    plan = _plan(mission, "battery", P3())
    first = modelled_leg(plan)
    if first is None:
        raise NotShownError("the mission's legs are stated, not modelled")
    columns = ("start_place", "end_place", "distance_m", "duration_s", "peak_speed_m_s")
    legs = [phase for phase in plan.phases if phase.kind == "flight"]
    records = [{name: getattr(leg, name) for name in columns} for leg in legs]
    capped = getattr(mission.flight, "max_speed_m_s", None) is not None
    cap, speed = " but the mission's own" if capped else "", plan.peak_speed_m_s
    words = {"speed": speed, "kmh": 3.6 * speed, "cap": cap}
    axes = plots.leg(mission, first.start_place, first.end_place).speed
    yield Exhibit(mission, "peak-speed", records, words, axes)


def misprints(mission: Mission) -> Exhibits:
    """The misprints of the paper and of the source of its flight model."""
    if mission.name == "paper":
        listed = DATA["misprint"]
        rows = [[*listed[0]], *([*misprint.values()] for misprint in listed)]
        yield Exhibit(mission, "misprints", listed, rows=rows)
