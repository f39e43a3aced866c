"""The longest hover of a mission by the schedule of its packs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import RenderableType
from rich.text import Text

from formulations.perspectives import AVAILABLE
from optuav.errors import Fault, InputError
from optuav.mission import Mission, load
from optuav.mission.quantities import Number
from optuav.mission.words import counted_in
from optuav.physics.packs import SCHEDULES
from optuav.plan import Plan
from optuav.solving import solve
from optuav.studies.comparison import as_csv
from optuav.studies.tables import add_route_column, between_ends, plain_table

SCHEMA = 1
KIND = "optuav comparison of schedules"
PERIODS_S = (60.0,)
"""Turns of the schedule alternating that are compared unless others are asked for [s]."""

PERIOD = Number("s", ge=1e-3, le=1e7)


@dataclass(frozen=True)
class Schedules:
    """What `compare_schedules` returns. Printed, it is a table.

    Parameters
    ----------
    mission
        What was compared.
    slot_s
        Length of the slots [s]; None for continuous times.
    plans
        The plan under every schedule, pooled first.
    """

    mission: Mission
    slot_s: float | None
    plans: tuple[Plan, ...]

    def __str__(self) -> str:
        from optuav.studies.tables import as_text

        return as_text(self.tables())

    def records(self) -> list[dict[str, Any]]:
        """One flat record a schedule; what it brings is counted from pooled packs [s]."""
        pooled = self.plans[0]
        return [
            {
                "schedule": plan.mission.battery.schedule,
                "period_s": plan.mission.battery.period_s,
                "status": plan.status.value,
                "hover_time_s": plan.hover_time_s if plan else None,
                "brings_s": plan.hover_time_s - pooled.hover_time_s if plan and pooled else None,
                "rest_time_s": plan.rest_time_s if plan else None,
                "soc_battery": plan.soc["battery"] if plan.soc else None,
                "route": " > ".join(plan.route) if plan else "",
                "proof": plan.proof,
            }
            for plan in self.plans
        ]

    def to_dict(self) -> dict[str, Any]:
        """The comparison as plain data, mission inside."""
        return {
            "schema": SCHEMA,
            "kind": KIND,
            "slot_s": self.slot_s,
            "rows": self.records(),
            "mission": self.mission.to_dict(),
        }

    def to_csv(self) -> str:
        """`records` as comma-separated values with a line of headings."""
        return as_csv(self.records())

    def save_pictures(self, directory: str | Path) -> list[Path]:
        """Write ``packs.png`` into a directory.

        Raises
        ------
        InputError
            If matplotlib is missing, or the directory cannot be made or written to.
        """
        from optuav.studies.pictures import save_schedules

        return save_schedules(self, directory)

    def tables(self) -> Iterator[RenderableType]:
        """One line a schedule, and how each is known."""
        times = counted_in(self.slot_s)
        heading = f"{self.mission.name}: longest hover by schedule of the packs, {times}"
        yield Text(heading, style="bold")
        yield ""
        table = plain_table()
        table.add_column("schedule", no_wrap=True)
        for name in ("Δ [s]", "brings [s]", "T' [s]", "η1 [%]"):
            table.add_column(Text(name), justify="right", no_wrap=True)
        add_route_column(table)
        for row, plan in zip(self.records(), self.plans, strict=True):
            period = f" {row['period_s']:g} s" if row["period_s"] else ""
            figures = ("hover_time_s", "rest_time_s")
            hover, rest = ("none" if row[n] is None else f"{row[n]:.2f}" for n in figures)
            table.add_row(
                f"{row['schedule']}{period}",
                hover,
                "–" if row["brings_s"] is None else f"{row['brings_s']:+.2f}",
                rest,
                f"{100.0 * row['soc_battery']:.2f}" if plan else "–",
                between_ends(plan.route if plan else ()),
            )
        yield table
        yield ""
        for proof in dict.fromkeys(plan.proof for plan in self.plans):
            names = [p.mission.battery.schedule for p in self.plans if p.proof == proof]
            yield Text(f"{', '.join(names)}: {proof}")


def compare_schedules(
    mission: Mission | str | Path,
    *,
    periods_s: Sequence[float] = PERIODS_S,
    slot_s: float | None = None,
) -> Schedules:
    """Solve P1 under every schedule of the packs, perspective `available`.

    Parameters
    ----------
    mission
        A mission, the name of a shipped one, or the path of a mission file.
    periods_s
        Turns of the schedule ``"alternating"`` [s], 0.001 to 1e7; its own as well where the
        mission has one.
    slot_s
        Length of the time slots [s], 0.001 to 1e7; None for continuous times.

    Returns
    -------
    Schedules
        The plan under every schedule, pooled packs first; printed, a table.

    Raises
    ------
    InputError
        If an argument is out of range.
    """
    faults = [Fault("periods_s", repr(s), PERIOD.words) for s in periods_s if not PERIOD.accepts(s)]
    if faults:
        raise InputError(faults)
    asked = mission if isinstance(mission, Mission) else load(mission)
    own = asked.battery.period_s
    periods = dict.fromkeys([*([] if own is None else [own]), *map(float, periods_s)])
    changes: list[dict[str, Any]] = [
        {"battery.schedule": name, **({} if period_s is None else {"battery.period_s": period_s})}
        for name in SCHEDULES
        for period_s in (periods if name == "alternating" else (None,))
    ]
    plans = (solve(asked.replace(c), perspective=AVAILABLE, slot_s=slot_s) for c in changes)
    return Schedules(asked, slot_s, tuple(plans))
