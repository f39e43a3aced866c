"""The longest hover by perspective, by trajectory or by schedule of the packs, plan by plan."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NotRequired, TypedDict

from formulations.p1 import P1
from formulations.soc import AVAILABLE, PAPER
from optuav.mission import Mission
from optuav.options import SCHEDULES, Perspective, Schedule, Trajectory
from optuav.plan import Plan
from optuav.plan.data import JUDGE_TOLERANCE
from optuav.plan.summary import counted_in
from optuav.presentation.blocks import Block, Heading, Note, Table
from optuav.presentation.numbers import figure, fixed, seconds
from optuav.solving import solve
from optuav.studies.compare_methods import Progress
from optuav.studies.results import ComparedAnswer, Comparison, Pictures, longest_of

COMPARED_PERSPECTIVES: tuple[Perspective, ...] = (*PAPER, AVAILABLE)
COMPARED_TRAJECTORIES: tuple[Trajectory, ...] = ("direct", "traj1", "traj2", "optimal")
AXES: Mapping[str, tuple[str, ...]] = {
    "perspective": COMPARED_PERSPECTIVES,
    "trajectory": COMPARED_TRAJECTORIES,
}
"""Options to compare plans by, and their values in the order of the table."""
PERIODS_S = (60.0,)
PLAN_UNITS = {
    **{"flyable": "", "status": "", "hover_time_s": "s", "rest_time_s": "s", "mission_time_s": "s"},
    **{f"soc_{name}": "-" for name in PAPER},
    **{"route": "", "runs_dry_s": "s", "overfull_s": "s", "proof": ""},
}
GROUNDED = {
    "dry": "cannot be flown, no available charge is left then",
    "full": "cannot be flown, charging would drive the available well past full",
    "low": "cannot be flown, less than limits.min_soc is left in both wells together",
    "no": "cannot be flown, optuav solve and optuav audit show why",
}
"""Words in the column "flies" for a plan that cannot be flown, and their meaning."""


class ComparedSetting(TypedDict):
    """The setting of a plan: perspective and trajectory, or schedule and period."""

    perspective: NotRequired[Perspective]
    trajectory: NotRequired[Trajectory]
    schedule: NotRequired[Schedule]
    period_s: NotRequired[float | None]
    brings_s: NotRequired[float | None]  # Gain of a schedule against the first one


class PlanAnswer(ComparedAnswer, ComparedSetting):
    """A row of a comparison of plans; moments and times are None without a plan."""

    rest_time_s: float | None
    mission_time_s: float | None
    runs_dry_s: float | None
    overfull_s: float | None
    soc_energy: float | None
    soc_adjusted: float | None
    soc_battery: float | None
    flyable: bool | None
    proof: str
    reasons: tuple[str, ...]
    route: tuple[str, ...]


@dataclass(frozen=True, kw_only=True, repr=False)
class PlanComparison(Comparison):
    """The longest hover by perspective, trajectory or schedule, one row per plan.

    Parameters
    ----------
    by, slot_s
        What was compared, and the length of time slots [s], None for continuous times.

    Examples
    --------
    >>> import optuav
    >>> found = optuav.compare("paper", by="trajectory", perspective="battery")
    >>> found.by, [round(plan.hover_time_s) for plan in found.plans]
    (('trajectory',), [689, 715, 720, 720])
    """

    kind = "optuav comparison of plans"
    rows: tuple[PlanAnswer, ...]
    by: tuple[str, ...]
    slot_s: float | None
    plans: tuple[Plan, ...] = field(repr=False)

    @property
    def units(self) -> Mapping[str, str]:
        """Unit of each column by its name."""
        if self._by_schedule:
            return {"schedule": "", "period_s": "s", **PLAN_UNITS, "brings_s": "s"}
        return {**dict.fromkeys(AXES, ""), **PLAN_UNITS}

    @property
    def _by_schedule(self) -> bool:
        return self.by == ("schedule",)

    def blocks(self) -> Iterator[Block]:
        """Yield one line a plan with whether it can be flown, and how each is known."""
        subject = "schedule of the packs" if self._by_schedule else " and ".join(self.by)
        yield Heading(f"{self.mission.name}: longest hover by {subject}, {counted_in(self.slot_s)}")
        yield Note([longest_of([*zip(self._names(), self.rows, strict=True)])])
        gain_head = ["gain [s]"] if self._by_schedule else []
        words = [*(["schedule"] if self._by_schedule else AXES), "flies"]
        heads = [*words, "Δ [s]", *gain_head, "T' [s]", "T [s]", "η1 [%]", "by way of"]
        rows, grounded, proofs = list[list[str]](), set[str](), dict[str, dict[str, None]]()
        for row in self.rows:
            label, soc = _label(row), row["soc_battery"]
            flies = _flies(row, self.mission.limits.min_soc)
            line = (
                label[0] if label[0] not in proofs else "",
                *label[1:],
                flies,
                fixed(row["hover_time_s"]),
                *(fixed(row["brings_s"], otherwise="–", sign="+") for _ in gain_head),
                fixed(row["rest_time_s"]),
                fixed(row["mission_time_s"]),
                fixed(None if soc is None else 100.0 * soc, otherwise="–"),
                ", ".join(row["route"][1:-1]) or "–",
            )
            rows.append([*line])
            grounded.add(flies.split()[0])
            proofs.setdefault(label[0], {})[row["proof"]] = None
        yield Table(heads, rows, len(words), 1)
        if meanings := [f"{word}: {GROUNDED[word]}" for word in GROUNDED if word in grounded]:
            yield Note(meanings)
        lines = list[str]()
        for proof in dict.fromkeys(map("; ".join, proofs.values())):
            names = (name for name, parts in proofs.items() if "; ".join(parts) == proof)
            lines.append(f"{', '.join(names)}: {proof}")
        reasons = dict.fromkeys(reason for row in self.rows for reason in row["reasons"])
        yield Note([*lines, *(f"Because {reason}" for reason in reasons)])

    def _names(self) -> Iterator[str]:
        """Yield the name of each row: what differs between the rows."""
        labels = [_label(row) for row in self.rows]
        differ = [len({*column}) > 1 for column in zip(*labels, strict=True)]
        for label in labels:
            words = [word for word, counts in zip(label, differ, strict=True) if counts]
            yield " ".join(words) or label[-1]

    def pictures(self) -> Pictures:
        """Yield the wells of the packs by schedule, or the hover times by all else."""
        from optuav import plots
        from optuav.plots.style import drawable

        if self._by_schedule:
            if any(self.plans):
                yield "packs.png", plots.packs([plan for plan in self.plans if plan])[0]
            return
        bars = [
            plots.Bar(row["trajectory"], row["perspective"], row["hover_time_s"], row["flyable"])
            for row in self.rows
        ]
        title = f"{drawable(self.mission.name)}: longest hover by trajectory and perspective"
        yield "choices.png", plots.bars(bars, title=title, y_label="hover time Δ [s]")


def compare_plans(
    mission: Mission,
    by: tuple[str, ...],
    perspective: Perspective,
    slot_s: float | None,
    periods_s: Sequence[float],
    progress: Progress | None,
) -> PlanComparison:
    """Solve P1 for every choice of the options compared; see `compare`."""
    by_schedule, settings = by == ("schedule",), _settings(mission, by, perspective, periods_s)
    rows, plans, tell = list[PlanAnswer](), list[Plan](), progress or (lambda *_: None)
    for number, setting in enumerate(settings):
        tell(number, len(settings), " ".join(_label(setting)))
        packs = {f"battery.{n}": setting[n] for n in ("schedule", "period_s") if setting.get(n)}
        problem = P1(trajectory=setting.get("trajectory", "optimal"))
        counted_by = setting.get("perspective", AVAILABLE)
        plan = solve(mission.replace(packs), problem, perspective=counted_by, slot_s=slot_s)
        plans.append(plan)
        soc = plan.soc or {}
        row: PlanAnswer = {
            **setting,
            "hover_time_s": plan.hover_time_s if plan else None,
            "rest_time_s": plan.rest_time_s if plan else None,
            "mission_time_s": plan.mission_time_s if plan else None,
            "runs_dry_s": plan.runs_dry_s if plan else None,
            "overfull_s": plan.overfull_s if plan else None,
            "soc_battery": soc.get("battery"),
            "soc_energy": soc.get("energy"),
            "soc_adjusted": soc.get("adjusted"),
            "flyable": plan.flyable,
            "proof": plan.proof,
            "reasons": plan.reasons,
            "status": plan.status.value,
            "route": plan.route if plan else (),
        }
        if by_schedule:
            comparable = plan and plans[0]
            row["brings_s"] = plan.hover_time_s - plans[0].hover_time_s if comparable else None
        rows.append(row)
    return PlanComparison(
        mission=mission, rows=tuple(rows), by=by, slot_s=slot_s, plans=tuple(plans)
    )


def _settings(
    mission: Mission, by: tuple[str, ...], perspective: Perspective, periods_s: Sequence[float]
) -> list[ComparedSetting]:
    """Return what to choose for each plan: a perspective and a trajectory, or a schedule."""
    if by == ("schedule",):
        own_s = mission.battery.period_s
        turns = [*dict.fromkeys(map(float, [*filter(None, [own_s]), *periods_s]))]
        periods: dict[Schedule, Sequence[float | None]] = {
            name: turns if name == "alternating" else [None] for name in SCHEDULES
        }
        return [
            {"schedule": name, "period_s": period_s}
            for name, periods_of_schedule in periods.items()
            for period_s in periods_of_schedule
        ]
    perspectives = COMPARED_PERSPECTIVES if "perspective" in by else (perspective,)
    # Over several devices, the paper's two ways of choosing a building mean nothing.
    several: tuple[Trajectory, ...] = ("direct", "optimal")
    compared = several if mission.devices else COMPARED_TRAJECTORIES
    trajectories = compared if "trajectory" in by else ("optimal",)
    return [
        {"perspective": counted_by, "trajectory": trajectory}
        for counted_by in perspectives
        for trajectory in trajectories
    ]


def _label(row: ComparedSetting) -> tuple[str, ...]:
    """Return the words that distinguish a plan from the others of its table."""
    if "schedule" not in row:
        return row["perspective"], row["trajectory"]
    period_s = row["period_s"]
    return (row["schedule"] + (f" {figure(period_s)} s" if period_s else ""),)


def _flies(row: PlanAnswer, min_soc: float) -> str:
    """Return whether a plan can be flown, or what prevents it first and from when on."""
    if row["flyable"] is None or row["flyable"]:
        return "–" if row["flyable"] is None else "yes"
    moments = {"dry": row["runs_dry_s"], "full": row["overfull_s"]}
    ends = [(moment_s, word) for word, moment_s in moments.items() if moment_s is not None]
    if ends:
        first_s, word = min(ends)
        return f"{word} {seconds(first_s, 0)}"
    soc = row["soc_battery"]
    return "low" if soc is not None and soc < min_soc - JUDGE_TOLERANCE else "no"
