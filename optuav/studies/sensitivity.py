"""Sensitivity of the longest hover: one key at a time, and samples of all that is uncertain."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypedDict

import numpy as np

from formulations.soc import AVAILABLE, PAPER
from optuav.arrays import Floats
from optuav.errors import Fault, collected, refuse
from optuav.fields import Range
from optuav.mission import Mission, load
from optuav.mission.messages import misfits, plural, shown, unlisted
from optuav.options import Perspective
from optuav.plan import Plan, load_plan
from optuav.presentation.blocks import Block, Facts, Heading, Note, Table
from optuav.presentation.numbers import figure, fixed, percent, seconds
from optuav.solving import solve
from optuav.solving.question import checked_question
from optuav.studies.batch import best_of
from optuav.studies.results import Pictures, Result
from optuav.studies.samples import (
    SEED,
    WAVELENGTH,
    Draws,
    Spread,
    completed,
    independent,
    spreads,
    unstated,
    with_conversion,
)
from optuav.studies.scenarios import Scenarios
from optuav.studies.uncertainty import Chances, FixedPlan, chances

SAMPLES = Range("-", ge=1, le=1e8, whole=True)
WORLD = ("battery", "rotor", "body", "laser", "link", "flight")
"""Tables of measured values; [route] and [limits] hold choices."""
STEP = 1e-4  # Step of the rates at the value of a key, relative to it
EFFECT_UNITS = {
    **dict.fromkeys(("key", "unit", "now", "low", "high"), ""),
    **{"hover_low_s": "s", "hover_high_s": "s", "elasticity": "-"},
    **{"local_less": "-", "local_more": "-", "local_elasticity": "-", "swing_s": "s"},
}
MOST_ROWS = 10
MOVES_S = 5e-3  # Keys that move the hover time less than this are not printed [s]
ZERO, SMALL, KINK = 1e-6, 5e-4, 1e-5
"""Elasticities below these are 0, or have no digit to show; beyond the last two sides differ."""
LONGEST_KEY = 34

HEADS = (
    "Δ low, Δ high: hover [s] at the ends of the range. % by 1 %: percent of hover per percent of "
    "the key, over the range. local: the same at the mission's value."
)


class Effect(TypedDict):
    """A row of a sensitivity: a key with the hover times [s] at the ends of its range."""

    key: str
    unit: str
    now: float
    low: float
    high: float
    hover_low_s: float | None
    hover_high_s: float | None
    elasticity: float | None
    local_less: float | None
    local_more: float | None
    local_elasticity: float | None
    has_kink: bool
    at_end: bool
    swing_s: float
    along: tuple[str, ...]


@dataclass(frozen=True, kw_only=True, repr=False)
class Sensitivity(Result):
    """What matters most to the longest hover of a mission, one row per key.

    Parameters
    ----------
    perspective
        How to count charge.
    hover_time_s, plan_hover_time_s
        Longest hover of the mission itself, 0 without a plan; that of the fixed plan, or None [s].
    chances
        Over the samples: quantiles of the longest hover, how often each route is the best, and the
        share in which the fixed plan can be flown; None if nothing is uncertain.

    Examples
    --------
    >>> import optuav
    >>> size = {"battery.capacity_As": {"percent": 10}}
    >>> result = optuav.sensitivity("paper", size, perspective="battery", samples=10)
    >>> round(result.hover_time_s, 2), result.chances.samples
    (719.54, 10)
    """

    kind = "optuav sensitivity"
    units = EFFECT_UNITS
    rows: tuple[Effect, ...]
    perspective: Perspective
    hover_time_s: float
    plan_hover_time_s: float | None
    chances: Chances | None

    def blocks(self) -> Iterator[Block]:
        """Yield the effects of single keys, then the results of the samples."""
        yield Heading(f"{self.mission.name}: what matters most, {self.perspective}")
        rows = [row for row in self.rows if row["swing_s"] > MOVES_S][:MOST_ROWS]
        has_plan = f"Longest hover {seconds(self.hover_time_s)}"
        itself = has_plan if self.hover_time_s else "The mission has no plan"
        itself += "; one key at a time, everything else held:"
        below = [*self._below(rows)]
        if rows:
            heads = ["key", "range", "Δ low", "Δ high", "% by 1 %", "local"]
            cells = [*map(_cells, rows)]
            yield Table(heads, cells, gap=1, longest=LONGEST_KEY, above=itself, below=below)
        else:
            yield Note(
                [itself, "no key within its range changes that; optuav explain shows what would"]
            )
        if self.chances is not None:
            yield from _chances(self.chances, self.plan_hover_time_s)

    def _below(self, rows: Sequence[Effect]) -> Iterator[str]:
        """Yield the lines below the table of some rows."""
        if more := len(self.rows) - len(rows):
            yield f"and {more} more with smaller effects"
        yield HEADS
        if kinks := [row for row in rows if row["has_kink"] or row["at_end"]]:
            sides = (
                f"{row['key']} {_rate(row['local_less'])} below, {_rate(row['local_more'])} above"
                + (", the end of the range" if row["at_end"] else "")
                for row in kinks
            )
            yield f"Local on either side: {'; '.join(sides)}"
        if any(row["key"] == WAVELENGTH for row in rows):
            yield f"{WAVELENGTH} moves only the attenuation: slopes and offsets are held"

    def pictures(self) -> Pictures:
        """Yield a tornado of the keys, and how the hover times of the samples are spread."""
        from optuav.plots.uncertainty import hover_times, tornado

        yield "tornado.png", tornado(self.rows, self.hover_time_s, self.mission.name)
        if self.chances is not None:
            times_s, plan_s = self.chances.hover_times_s, self.plan_hover_time_s
            yield "hover.png", hover_times(times_s, self.mission.name, fixed_s=plan_s)


def sensitivity(
    mission: Mission | str | Path,
    uncertainty: Mapping[str, object] | str | Path | None = None,
    *,
    perspective: Perspective = AVAILABLE,
    plan: Plan | str | Path | None = None,
    samples: int = 10_000,
    seed: int = 0,
) -> Sensitivity:
    """Find which numbers of a mission matter most to its longest hover.

    Parameters
    ----------
    mission
        A mission, the name of a shipped one, or the path of a mission file.
    uncertainty
        Distributions of keys: a TOML file with the tables and keys of a mission, each key as ``{
        low = 1, high = 2 }`` (uniform), ``{ low = 1, likely = 1.5, high = 2 }`` (triangular), ``{
        deviation = 0.1 }`` (normal about the mission's value, cut off at the allowed range) or ``{
        percent = 5 }`` (uniform); ``along = ["table.key"]`` changes other keys by the same factor.
        Or the same as a dict. By default every number that is measured rather than chosen is within
        10 % of its value; gravity varies only if you list it. Keys are independent of each other. A
        key that the mission does not set needs low and high; its likely value, or the middle, then
        counts as the mission's own.
    perspective
        How to count charge, as for `optuav.solve` but for ``"wells"``.
    plan
        The plan that stays fixed, or the path of its file; by default the mission's best plan.
    samples
        Number of samples, 1 to 1e8. The first samples are the same for any number.
    seed
        Seed of the samples, 0 to 2**63.

    Returns
    -------
    Sensitivity
        One row per key, the largest effect first: the hover times [s] at the ends of its range (the
        given one or 10 %), None without a plan; the elasticity, percent of hover time per percent
        of the key, as a mean over the range; and the local elasticity at the value itself, from
        steps of 0.01 and 0.02 % below and above it, which differ at a kink (``local_less``,
        ``local_more``; None if such a step leaves the possible values, ``at_end`` if that is the
        range of the key). ``hover_time_s`` is the longest hover of the mission itself (0 without a
        plan), and ``chances`` comes from the samples: quantiles of the longest hover, how often
        each route is the best, and the share of samples where the fixed plan can be flown; None if
        nothing is uncertain.

    Raises
    ------
    InputError
        If an argument cannot be used.

    Examples
    --------
    >>> import optuav
    >>> size = {"battery": {"capacity_As": {"percent": 10}}}
    >>> results = optuav.sensitivity("paper", size, perspective="battery", samples=100)
    >>> capacity = next(row for row in results.rows if row["key"] == "battery.capacity_As")
    >>> round(capacity["hover_low_s"], 1), round(capacity["hover_high_s"], 1)
    (649.7, 789.4)
    >>> round(capacity["local_elasticity"], 3)
    0.971
    """
    faults = [*misfits(("samples", samples, SAMPLES), ("seed", seed, SEED))]
    faults += unlisted(("perspective", perspective, (*PAPER, AVAILABLE)))
    with collected(faults):
        plan = None if plan is None else load_plan(plan)
        if plan is not None and not plan:
            faults.append(Fault("plan", plan.status.value, "a plan that can be flown on a route"))
    with collected(faults):
        studied = load(mission)
        if studied.battery.takes_turns and str(perspective) == AVAILABLE:
            words = "pooled, or another perspective: each sample would take seconds"
            faults.append(Fault("battery.schedule", shown(studied.battery.schedule), words))
    refuse(faults)
    uncertain = () if uncertainty is None else spreads(studied, uncertainty)
    studied = completed(studied, uncertain)
    varied = {spread.key.name: spread for spread in (*unstated(studied), *uncertain)}
    taken = {other.name for spread in uncertain for other in spread.along}
    alone_in_turn = [spread for name, spread in varied.items() if name not in taken]
    if uncertainty is None:
        names = {name for name in varied if name.partition(".")[0] in WORLD and "[" not in name}
        uncertain = tuple(spread for spread in alone_in_turn if spread.key.name in names)
    best = solve(studied, perspective=perspective)
    held = FixedPlan.of(plan or best, studied) if plan or best else None
    hover_s, of_samples = best.hover_time_s if best else 0.0, None
    if uncertain:
        draws = Draws(studied, uncertain, int(samples), int(seed), independent)
        of_samples = chances(draws, perspective, held, stated=uncertainty is not None)
    return Sensitivity(
        mission=studied,
        rows=effects(studied, alone_in_turn, perspective, hover_s),
        perspective=perspective,
        hover_time_s=hover_s,
        plan_hover_time_s=None if held is None else held.hover_time_s,
        chances=of_samples,
    )


def effects(
    mission: Mission, spreads: Sequence[Spread], perspective: Perspective, hover_time_s: float
) -> tuple[Effect, ...]:
    """Return the effect of each key on the longest hover, the others held; the largest first."""
    steps = STEP * np.array([abs(spread.key.now) or spread.high - spread.low for spread in spreads])
    values = np.array([[spread.low, spread.high, *[spread.key.now] * 5] for spread in spreads])
    values[:, 2:] += steps[:, None] * np.arange(-2.0, 3.0)
    ends = np.array([[spread.key.low, spread.key.high] for spread in spreads])
    allowed = (values >= ends[:, :1]) & (values <= ends[:, 1:])
    values = np.where(allowed, values, values[:, 4:5])
    question = checked_question(mission, perspective=perspective)
    scenarios = Scenarios(mission, with_conversion(mission, _one_by_one(spreads, values)))
    found_s = [plans.hover_time_s for *_, (plans,) in best_of(scenarios, [question])]
    best_s = np.concatenate(found_s).reshape(-1, 7)
    lows_s, highs_s, *near_s = np.where(allowed, best_s, np.nan).T
    # To one side each, of second order: at the value itself another limit or route may take over.
    below = (near_s[0] - 4.0 * near_s[1] + 3.0 * near_s[2]) / (2.0 * steps)
    above = (4.0 * near_s[3] - near_s[4] - 3.0 * near_s[2]) / (2.0 * steps)
    rows = list[Effect]()
    table = np.transpose([lows_s, highs_s, below, above]).tolist()
    for spread, inside, (low_s, high_s, *rates) in zip(spreads, allowed, table, strict=True):
        key = spread.key
        share = key.now / hover_time_s if hover_time_s and key.now else math.nan
        slope = (high_s - low_s) / (spread.high - spread.low)
        figures = (low_s, high_s, slope * share, *(rate * share for rate in rates))
        low, high, mean, less, more = (x if np.isfinite(x) else None for x in figures)
        at_end = not inside[2:].all()
        has_kink = (less is None) != (more is None) and not at_end
        if less is not None and more is not None:
            has_kink = not math.isclose(less, more, rel_tol=0.01, abs_tol=KINK)  # else a curve
        row = Effect(
            key=key.name,
            unit=key.unit,
            now=key.now,
            low=spread.low,
            high=spread.high,
            hover_low_s=low,
            hover_high_s=high,
            elasticity=mean,
            local_less=less,
            local_more=more,
            local_elasticity=None if has_kink else less if more is None else more,
            has_kink=has_kink,
            at_end=at_end,
            swing_s=max(abs((end_s or 0.0) - hover_time_s) for end_s in (low, high)),
            along=tuple(other.name for other in spread.along),
        )
        rows.append(row)
    return tuple(sorted(rows, key=lambda row: -row["swing_s"]))


def _one_by_one(spreads: Sequence[Spread], values: Floats) -> dict[str, Floats]:
    """Return columns of scenarios where only one key differs, by its row (key, value)."""
    count = values.shape[1]
    columns: dict[str, Floats] = {}
    for number, (spread, own) in enumerate(zip(spreads, values, strict=True)):
        now = {key.name: key.now for key in (spread.key, *spread.along)}
        for name, column in spread.columns(own):
            values_of_key = columns.setdefault(name, np.full(values.size, now[name]))
            values_of_key[count * number : count * (number + 1)] = column
    return columns


def _cells(row: Effect) -> list[str]:
    """A row as it is shown."""
    bend = "kink" if row["has_kink"] else "end" if row["at_end"] else ""
    ends = row["hover_low_s"], row["hover_high_s"]
    return [
        row["key"] + "+" * bool(row["along"]),
        _range(row["now"], row["low"], row["high"]),
        *map(fixed, ends),
        _rate(row["elasticity"]),
        bend or _rate(row["local_elasticity"]),
    ]


def _rate(elasticity: float | None) -> str:
    if elasticity is None:
        return "–"
    if abs(elasticity) < SMALL:
        return "<0.001" if abs(elasticity) > ZERO else "0"
    return fixed(elasticity, 3, sign="+")


def _range(now: float, low: float, high: float) -> str:
    """Return a range as percent of the value if it is even, else by its ends."""
    if now and math.isclose(now - low, high - now, rel_tol=1e-9):
        return f"±{percent(abs((high - now) / now))}"
    ends = (fixed(end, 0) if 1e4 <= abs(end) < 1e6 else figure(end, 4) for end in (low, high))
    return " to ".join(ends)


def _chances(chances: Chances, plan_hover_s: float | None) -> Iterator[Block]:
    how = "as specified" if chances.stated else "within 10 %, by default"
    count = f"{plural(len(chances.uncertain), 'key')} at once, {how}: {chances.samples} samples"
    yield Heading(f"{count}, seed {chances.seed}")
    quantiles = ", ".join(
        f"{percent(share)} {fixed(s, 1)}" for share, s in chances.quantiles_s.items()
    )
    mean = f"mean {seconds(chances.mean_s, 1)}"
    if 0.0 < chances.no_plan < 1.0:
        flown_s = chances.mean_s / (1.0 - chances.no_plan)
        mean += f" with 0 s for no plan, {seconds(flown_s, 1)} where there is one"
    none = {"no plan": chances.no_plan} if chances.no_plan else {}
    facts = [("Hover", f"{mean}; quantiles [s] {quantiles}")]
    facts.append(("Best", _shares({**chances.routes, **none})))
    if chances.kept is not None and chances.flyable is not None and plan_hover_s is not None:
        flies = f"can be flown in {percent(chances.flyable)} of the samples"
        words = f"{seconds(plan_hover_s)} of hover, {flies}; it keeps {_shares(chances.kept)}"
        facts.append(("Fixed plan", words))
    yield Facts(facts)


def _shares(shares: Mapping[str, float]) -> str:
    return ", ".join(f"{name} {percent(share)}" for name, share in shares.items())
