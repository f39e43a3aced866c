"""Perspectives and trajectories side by side: the paper's other comparison."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from formulations.perspectives import AVAILABLE, PAPER
from optuav.errors import Fault, InputError
from optuav.mission import Mission, load
from optuav.plan import Plan
from optuav.solving import solve
from optuav.status import Status
from optuav.studies.comparison import as_csv

if TYPE_CHECKING:
    import pandas

SCHEMA = 1
KIND = "optuav comparison of choices"
AXES: Mapping[str, tuple[str, ...]] = {
    "perspective": (*PAPER, AVAILABLE),
    "trajectory": ("direct", "traj1", "traj2", "optimal"),
}
"""What may be varied, and its values in the order in which they are shown."""


@dataclass(frozen=True)
class Choice:
    """The plan for one perspective and trajectory.

    Parameters
    ----------
    perspective, trajectory
        Their names.
    status
        What is known of the problem.
    hover_time_s, rest_time_s, mission_time_s
        Δ, T' and T [s]; None without a plan.
    soc
        State of charge at the end by perspective [-]; η1 is ``"battery"``. None without a plan.
    route
        Names of places; empty without a plan.
    flyable
        Whether its simulation found nothing against it; None without a plan.
    runs_dry_s, overfull_s
        When the available well is empty, and when charging drives it past full [s]; None if it
        never is, or without a plan.
    proof
        How the answer is known.
    reasons
        Why there is no plan, in words.
    """

    perspective: str
    trajectory: str
    status: Status
    hover_time_s: float | None
    rest_time_s: float | None
    mission_time_s: float | None
    soc: Mapping[str, float] | None
    route: tuple[str, ...]
    flyable: bool | None
    runs_dry_s: float | None
    overfull_s: float | None
    proof: str
    reasons: tuple[str, ...]


@dataclass(frozen=True)
class Choices:
    """What `compare_by` returns. Printed, it is a table.

    Parameters
    ----------
    mission
        What was compared.
    by
        What was varied.
    slot_s
        Length of the slots [s]; None for continuous times.
    rows
        One a plan.
    """

    mission: Mission
    by: tuple[str, ...]
    slot_s: float | None
    rows: tuple[Choice, ...]

    def __str__(self) -> str:
        from optuav.studies.choice_tables import choice_tables
        from optuav.studies.tables import as_text

        return as_text(choice_tables(self))

    def records(self) -> list[dict[str, Any]]:
        """One flat record a plan."""
        return [
            {
                "perspective": row.perspective,
                "trajectory": row.trajectory,
                "status": row.status.value,
                "hover_time_s": row.hover_time_s,
                "rest_time_s": row.rest_time_s,
                "mission_time_s": row.mission_time_s,
                **{f"soc_{name}": (row.soc or {}).get(name) for name in PAPER},
                "route": " > ".join(row.route),
                "flyable": row.flyable,
                "runs_dry_s": row.runs_dry_s,
                "overfull_s": row.overfull_s,
                "proof": row.proof,
            }
            for row in self.rows
        ]

    def to_dict(self) -> dict[str, Any]:
        """The comparison as plain data, mission inside."""
        rows = (
            {**record, "route": list(row.route), "reasons": list(row.reasons)}
            for record, row in zip(self.records(), self.rows, strict=True)
        )
        return {
            "schema": SCHEMA,
            "kind": KIND,
            "by": list(self.by),
            "slot_s": self.slot_s,
            "rows": list(rows),
            "mission": self.mission.to_dict(),
        }

    def to_csv(self) -> str:
        """`records` as comma-separated values with a line of headings."""
        return as_csv(self.records())

    def to_frame(self) -> pandas.DataFrame:
        """One row a plan; needs pandas (``pip install optuav[frame]``)."""
        import pandas

        return pandas.DataFrame(self.records())

    def save_pictures(self, directory: str | Path) -> list[Path]:
        """Write ``choices.png`` into a directory.

        Raises
        ------
        InputError
            If matplotlib is missing, or the directory cannot be made or written to.
        """
        from optuav.studies.pictures import save_choices

        return save_choices(self, directory)


def compare_by(
    mission: Mission | str | Path,
    by: Sequence[str] = ("perspective", "trajectory"),
    *,
    perspective: str = "battery",
    slot_s: float | None = None,
) -> Choices:
    """Solve P1 for every perspective and trajectory.

    The perspectives are the three of the paper, and ``"available"``, under which the battery never
    runs dry.

    Parameters
    ----------
    mission
        A mission, the name of a shipped one, or the path of a mission file.
    by
        What to vary: ``"perspective"``, ``"trajectory"`` or both. The trajectory is ``"optimal"``
        where it is not varied.
    perspective
        One of these four, where it is not varied.
    slot_s
        Length of the time slots [s], 0.001 to 1e7; None for continuous times.

    Returns
    -------
    Choices
        The plans; printed, a table.

    Raises
    ------
    InputError
        If an argument is out of range.
    """
    known = f"some of {', '.join(AXES)}; or schedule alone (compare_schedules, --by schedule)"
    faults = [Fault("by", repr(each), known) for each in by if each not in AXES]
    if not by or len(set(by)) < len(by):
        faults.append(Fault("by", repr(tuple(by)), f"each once, at least one of {', '.join(AXES)}"))
    if perspective not in AXES["perspective"]:
        names = ", ".join(AXES["perspective"])
        faults.append(Fault("perspective", repr(perspective), f"one of {names}"))
    elif "perspective" in by and perspective != "battery":
        faults.append(Fault("perspective", repr(perspective), "is varied already"))
    if faults:
        raise InputError(faults)
    asked = mission if isinstance(mission, Mission) else load(mission)
    fixed = {"perspective": (perspective,), "trajectory": ("optimal",)}
    axes = (AXES[name] if name in by else fixed[name] for name in AXES)
    rows = tuple(
        _choice(solve(asked, perspective=p, trajectory=t, slot_s=slot_s))
        for p, t in itertools.product(*axes)
    )
    return Choices(asked, tuple(by), slot_s, rows)


def _choice(plan: Plan) -> Choice:
    assert plan.trajectory is not None
    return Choice(
        perspective=plan.perspective,
        trajectory=plan.trajectory,
        status=plan.status,
        hover_time_s=plan.hover_time_s if plan else None,
        rest_time_s=plan.rest_time_s if plan else None,
        mission_time_s=plan.mission_time_s if plan else None,
        soc=plan.soc,
        route=plan.route if plan else (),
        flyable=plan.flyable,
        runs_dry_s=plan.runs_dry_s if plan else None,
        overfull_s=plan.overfull_s if plan else None,
        proof=plan.proof,
        reasons=plan.reasons,
    )
