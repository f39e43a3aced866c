"""What matters most: one key at a time, and everything that is uncertain at once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from formulations.perspectives import AVAILABLE, PAPER
from optuav.errors import Fault, InputError
from optuav.mission import Mission, load
from optuav.mission.quantities import Number
from optuav.mission.words import nearest, shown
from optuav.plan import Plan
from optuav.solving import solve
from optuav.studies.comparison import as_csv
from optuav.studies.uncertain.chances import Chances, chances
from optuav.studies.uncertain.effects import Effect, effects
from optuav.studies.uncertain.ensemble import Base
from optuav.studies.uncertain.fixed_plan import FixedPlan
from optuav.studies.uncertain.spread import (
    WORLD,
    Spread,
    around,
    everything,
    read_spreads,
    spreads,
)

SCHEMA, KIND = 1, "optuav sensitivity"
SAMPLES = Number("-", ge=1, le=1e8, whole=True)
SEED = Number("-", ge=0, le=2**63, whole=True)


@dataclass(frozen=True)
class Sensitivity:
    """What `optuav.sensitivity` returns; printed, it is two tables.

    Parameters
    ----------
    mission, perspective
        What was asked about.
    hover_time_s
        Longest hover of the mission as it stands [s]; 0 without a plan.
    plan_hover_time_s
        Hover of the plan that is held fixed [s]; None without one.
    effects
        One entry a key, the largest effect first.
    chances
        What follows from everything that is uncertain; None where nothing is.
    """

    mission: Mission
    perspective: str
    hover_time_s: float
    plan_hover_time_s: float | None
    effects: tuple[Effect, ...]
    chances: Chances | None

    def __str__(self) -> str:
        from optuav.studies.tables import as_text
        from optuav.studies.uncertain.tables import sensitivity_tables

        return as_text(sensitivity_tables(self))

    def records(self) -> list[dict[str, Any]]:
        """One flat record a key."""
        return [
            {name: getattr(each, name) for name in Effect.__dataclass_fields__ if name != "along"}
            for each in self.effects
        ]

    def to_csv(self) -> str:
        """`records` as comma-separated values with a line of headings."""
        return as_csv(self.records())

    def to_dict(self) -> dict[str, Any]:
        """Everything but the single samples as plain data, mission inside."""
        found = self.chances
        chances = found and {
            "samples": found.samples,
            "seed": found.seed,
            "uncertain": list(found.uncertain),
            "stated": found.stated,
            "mean_s": found.mean_s,
            "quantiles_s": {f"{share:g}": value for share, value in found.quantiles_s.items()},
            "no_plan": found.no_plan,
            "routes": dict(found.routes),
            "kept": None if found.kept is None else dict(found.kept),
            "flyable": found.flyable,
        }
        return {
            "schema": SCHEMA,
            "kind": KIND,
            "perspective": self.perspective,
            "hover_time_s": self.hover_time_s,
            "plan_hover_time_s": self.plan_hover_time_s,
            "effects": [
                {**record, "along": list(each.along)}
                for record, each in zip(self.records(), self.effects, strict=True)
            ],
            "chances": chances,
            "mission": self.mission.to_dict(),
        }

    def save_pictures(self, directory: str | Path) -> list[Path]:
        """Write ``tornado.png`` into a directory, and ``hover.png`` where something is uncertain.

        Raises
        ------
        InputError
            If matplotlib is missing, or the directory cannot be made or written to.
        """
        from optuav import plots
        from optuav.plots.files import save_figures

        bars = [
            plots.Swing(each.key, each.low, each.high, each.hover_low_s, each.hover_high_s)
            for each in self.effects
        ]
        axes = [("tornado.png", plots.tornado(bars, self.hover_time_s, self.mission.name))]
        if self.chances is not None:
            times_s, fixed_s = self.chances.hover_times_s, self.plan_hover_time_s
            drawing = plots.hover_times(times_s, self.mission.name, fixed_s=fixed_s)
            axes.append(("hover.png", drawing))
        figures = [(name, ax.get_figure(root=True)) for name, ax in axes]
        return save_figures(figures, Path(directory))


def sensitivity(
    mission: Mission | str | Path,
    uncertainty: Mapping[str, Any] | str | Path | None = None,
    *,
    perspective: str = "available",
    plan: Plan | None = None,
    samples: int = 10_000,
    seed: int = 0,
) -> Sensitivity:
    """Tell which numbers of a mission matter most to its longest hover.

    Parameters
    ----------
    mission
        A mission, the name of a shipped one, or a file.
    uncertainty
        How keys are spread: a TOML file with the tables and keys of a mission, each key as
        ``{ low = 1, high = 2 }`` (all values alike), ``{ low = 1, likely = 1.5, high = 2 }``
        (triangular), ``{ deviation = 0.1 }`` (normal about the mission's value, cut off at what is
        allowed) or ``{ percent = 5 }``; ``along = ["table.key"]`` changes others by the same
        factor. Or the same as a dict. Without it every number that is measured rather than chosen
        is within 10 % of its value. Samples are independent from key to key.
    perspective
        ``"available"``, ``"battery"``, ``"energy"`` or ``"adjusted"``.
    plan
        What is flown in spite of the uncertainty; by default the best plan of the mission.
    samples
        Number of samples, ≥ 1. The first of them are the same for any number.
    seed
        What they are drawn from, ≥ 0.

    Returns
    -------
    Effects of single keys, within their stated range or 10 %; and, with everything uncertain at
    once, quantiles of the longest hover, and the share of samples in which the plan can be flown.

    Raises
    ------
    InputError
        If an argument cannot be used.
    """
    asked = mission if isinstance(mission, Mission) else load(mission)
    faults = [
        Fault(name, shown(value), number.words)
        for name, value, number in (("samples", samples, SAMPLES), ("seed", seed, SEED))
        if not isinstance(value, int) or not number.accepts(value)
    ]
    known = (*PAPER, AVAILABLE)
    if perspective not in known:
        words = f"one of {', '.join(known)}{nearest(str(perspective), known)}"
        faults.append(Fault("perspective", shown(perspective), words))
    if faults:
        raise InputError(faults)
    stated = _stated(asked, uncertainty)
    best = solve(asked, perspective=perspective)
    fixed = plan if plan is not None else (best or None)
    held = None if fixed is None else FixedPlan.of(fixed, asked)
    hover_s = best.hover_time_s if best else 0.0
    base = Base.of(asked)
    varied = {each.key.name: each for each in _default(asked)} | {
        each.key.name: each for each in stated or ()
    }
    taken = {other.name for each in stated or () for other in each.along}
    looked_at = [each for name, each in varied.items() if name not in taken]
    uncertain = stated
    if uncertain is None:
        uncertain = tuple(
            s for s in looked_at if s.key.name.partition(".")[0] in WORLD and "[" not in s.key.name
        )
    found = None
    if uncertain:
        found = chances(
            base,
            uncertain,
            perspective,
            held,
            samples,
            seed,
            stated=stated is not None,
        )
    return Sensitivity(
        asked,
        perspective,
        hover_s,
        None if fixed is None else fixed.hover_time_s,
        effects(base, looked_at, perspective, hover_s),
        found,
    )


def _stated(
    mission: Mission, uncertainty: Mapping[str, Any] | str | Path | None
) -> tuple[Spread, ...] | None:
    if uncertainty is None:
        return None
    if isinstance(uncertainty, Mapping):
        return spreads(mission, uncertainty)
    return read_spreads(mission, uncertainty)


def _default(mission: Mission) -> list[Spread]:
    return [spread for key in everything(mission).values() if (spread := around(key)) is not None]
