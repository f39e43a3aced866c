"""Sensitivity of the longest hover: one key at a time, and samples of all that is uncertain."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from rich.console import RenderableType
from rich.text import Text

from formulations.p1 import P1
from formulations.parameters import steps_for
from formulations.soc import AVAILABLE, PAPER
from optuav.arrays import Floats
from optuav.engines import bracket, closed_form
from optuav.engines.prices import ShadowPrice
from optuav.errors import Fault, InputError
from optuav.mission import Mission, load
from optuav.mission.messages import nearest, shown
from optuav.mission.schema import Number
from optuav.network.network import Network, build_network
from optuav.network.variants import Variants
from optuav.options import Perspective
from optuav.plan import Plan
from optuav.solving import solve
from optuav.solving.assemble import quantities
from optuav.solving.batch import hover_times_s
from optuav.solving.outcome import SAME_S
from optuav.studies.results import Results, Row, fixed, plain_table
from optuav.studies.uncertainty import (
    Chances,
    FixedPlan,
    Spread,
    around,
    chances,
    spreadable,
    spreads,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SAMPLES = Number("-", ge=1, le=1e8, whole=True)
SEED = Number("-", ge=0, le=2**63, whole=True)
WORLD = ("battery", "rotor", "body", "laser", "link", "flight")
"""Tables of what is measured; [route] and [limits] state what is chosen."""
PLACE = {
    *("hover_distance_m", "coverage_radius_m", "end_gap_m"),
    *("hover_altitude_m", "min_altitude_m", "max_altitude_m"),
}
"""Quantities of constraints without a time. They hold by construction: the hover point always lies
on the rim of what the radio covers."""
STEP = 1e-5
"""Relative step of the derivatives of parameters by keys."""
UNITS = {
    **dict.fromkeys(("key", "unit", "now", "low", "high"), ""),
    **{"hover_low_s": "s", "hover_high_s": "s", "elasticity": "-"},
    **{"exact_less": "-", "exact_more": "-", "exact_elasticity": "-", "swing_s": "s"},
}
MOST_ROWS = 24
MOVES_S = 5e-3
"""Keys that move the hover time less than this are not printed [s]."""
ZERO, SMALL = 1e-9, 5e-4
"""Elasticities below these are 0, and have no digit to show."""
WAVELENGTH = "laser.wavelength_nm"
LONGEST_KEY = 34


def sensitivity(
    mission: Mission | str | Path,
    uncertainty: Mapping[str, object] | str | Path | None = None,
    *,
    perspective: Perspective = AVAILABLE,
    plan: Plan | None = None,
    samples: int = 10_000,
    seed: int = 0,
) -> Results:
    """Find which numbers of a mission matter most to its longest hover.

    Parameters
    ----------
    mission
        A mission, the name of a shipped one, or the path of a mission file.
    uncertainty
        Distributions of keys: a TOML file with the tables and keys of a mission, each key as
        ``{ low = 1, high = 2 }`` (uniform), ``{ low = 1, likely = 1.5, high = 2 }`` (triangular),
        ``{ deviation = 0.1 }`` (normal about the mission's value, cut off at what is allowed) or
        ``{ percent = 5 }`` (uniform); ``along = ["table.key"]`` changes other keys by the same
        factor. Or the same as a dict. By default every number that is measured rather than chosen
        is within 10 % of its value. Keys are independent of each other.
    perspective
        How charge is counted: ``"available"``, ``"battery"``, ``"energy"`` or ``"adjusted"``.
    plan
        The plan that is held fixed; by default the best one of the mission.
    samples
        Number of samples, 1 to 1e8. The first of them are the same for any number.
    seed
        Seed of the samples, 0 to 2**63.

    Returns
    -------
    Results
        One row a key, the largest effect first: the hover times [s] at the ends of its range (the
        stated one or 10 %), None without a plan; the elasticity, percent of hover time by one
        percent of the key, as a mean over the range; and the exact one below the value and above
        it, from shadow prices, which differ at a kink. Among the facts are ``hover_time_s``, the
        longest hover of the mission itself (0 without a plan), and ``chances``, what the samples
        say: quantiles of the longest hover, how often each route is the best, and the share of
        samples in which the fixed plan can be flown; None if nothing is uncertain.

    Raises
    ------
    InputError
        If an argument cannot be used.

    Examples
    --------
    >>> import optuav
    >>> size = {"battery": {"capacity_As": {"percent": 10}}}
    >>> found = optuav.sensitivity("paper", size, perspective="battery", samples=100)
    >>> capacity = next(row for row in found.rows if row["key"] == "battery.capacity_As")
    >>> round(capacity["hover_low_s"], 1), round(capacity["hover_high_s"], 1)
    (649.7, 789.4)
    >>> round(capacity["exact_elasticity"], 3)
    0.971
    """
    faults = [
        Fault(name, shown(value), number.words)
        for name, value, number in (("samples", samples, SAMPLES), ("seed", seed, SEED))
        if not isinstance(value, int) or not number.accepts(value)
    ]
    if perspective not in (known := (*PAPER, AVAILABLE)):
        words = f"one of {', '.join(known)}{nearest(str(perspective), known)}"
        faults.append(Fault("perspective", shown(perspective), words))
    if plan is not None and not plan:
        words = "a plan that can be flown on a route"
        faults.append(Fault("plan", plan.status.value, words))
    if faults:
        raise InputError(faults)
    studied = mission if isinstance(mission, Mission) else load(mission)
    stated = None if uncertainty is None else spreads(studied, uncertainty)
    default = [each for key in spreadable(studied).values() if (each := around(key)) is not None]
    varied = {each.key.name: each for each in (*default, *(stated or ()))}
    taken = {other.name for each in stated or () for other in each.along}
    alone = [each for name, each in varied.items() if name not in taken]
    uncertain = stated
    if uncertain is None:
        measured = (each for each in alone if each.key.name.partition(".")[0] in WORLD)
        uncertain = tuple(each for each in measured if "[" not in each.key.name)
    best, network = solve(studied, perspective=perspective), build_network(studied)
    held = FixedPlan.of(plan or best, studied) if plan or best else None
    hover_s, found = best.hover_time_s if best else 0.0, None
    if uncertain:
        is_stated = stated is not None
        found = chances(network, uncertain, perspective, held, samples, seed, stated=is_stated)
    facts = {
        "perspective": perspective,
        "hover_time_s": hover_s,
        "plan_hover_time_s": None if held is None else held.hover_time_s,
        "chances": found,
    }
    rows = effects(network, alone, perspective, hover_s)
    return Results("optuav sensitivity", studied, facts, UNITS, rows, _tables, _figures)


# One key at a time


def effects(
    network: Network, spreads: Sequence[Spread], perspective: Perspective, hover_time_s: float
) -> tuple[Row, ...]:
    """Return the effect of each key on the longest hover, the others held; the largest first."""
    found, exact = list[Row](), _rates(network, spreads, perspective)
    ends = _one_by_one(network, spreads, np.array([[each.low, each.high] for each in spreads]))
    ends_s = np.fmax.reduce(hover_times_s(ends, perspective), axis=1).reshape(-1, 2).tolist()
    for spread, (low_s, high_s), rates in zip(spreads, ends_s, exact.T.tolist(), strict=True):
        key = spread.key
        share = key.now / hover_time_s if hover_time_s and key.now else math.nan
        slope = (high_s - low_s) / (spread.high - spread.low)
        figures = (low_s, high_s, slope * share, *(rate * share for rate in rates))
        low, high, mean, less, more = (each if np.isfinite(each) else None for each in figures)
        has_kink = (less is None) != (more is None)
        if less is not None and more is not None:
            has_kink = ShadowPrice(less, more).has_kink
        row = {
            "key": key.name,
            "unit": key.unit,
            "now": key.now,
            "low": spread.low,
            "high": spread.high,
            "hover_low_s": low,
            "hover_high_s": high,
            "elasticity": mean,
            "exact_less": less,
            "exact_more": more,
            "exact_elasticity": None if has_kink else more,
            "has_kink": has_kink,
            "swing_s": max(abs((each or 0.0) - hover_time_s) for each in (low, high)),
            "along": tuple(other.name for other in spread.along),
        }
        found.append(row)
    return tuple(sorted(found, key=lambda row: -row["swing_s"]))


def _one_by_one(network: Network, spreads: Sequence[Spread], values: Floats) -> Variants:
    """Return variants in which one key alone differs, by its row of values (key, value)."""
    count = values.shape[1]
    columns: dict[str, Floats] = {}
    for number, (spread, own) in enumerate(zip(spreads, values, strict=True)):
        now = {key.name: key.now for key in (spread.key, *spread.along)}
        for name, column in spread.columns(own):
            every = columns.setdefault(name, np.full(values.size, now[name]))
            every[count * number : count * (number + 1)] = column
    return Variants(network, columns)


def _rates(network: Network, spreads: Sequence[Spread], perspective: Perspective) -> Floats:
    """Return the rates dΔ/dkey [s per unit] below and above (2, key); NaN where there are none.

    Each of the itineraries that tie has its own: below the value the one with the lowest rate is
    the best, above it the one with the highest.
    """
    now = np.array([each.key.now for each in spreads])
    here = _one_by_one(network, spreads[:1], now[:1, None])
    here_s = hover_times_s(here, perspective)[0]
    tied = np.flatnonzero(here_s >= np.fmax.reduce(here_s) - SAME_S)
    if not len(tied):
        return np.full((2, len(spreads)), np.nan)
    steps = np.array([STEP * (abs(each.key.now) or each.high - each.low) for each in spreads])
    near = _one_by_one(network, spreads, now[:, None] + steps[:, None] * [-1.0, 0.0, 1.0])
    sides = np.array([_rates_of(near, each, steps, perspective) for each in tied.tolist()])
    return np.array([sides[:, 0].min(axis=0), sides[:, 1].max(axis=0)])


def _rates_of(near: Variants, itinerary: int, steps: Floats, perspective: Perspective) -> Floats:
    """Return dΔ/dkey of one itinerary below and above (2, key), by the chain rule.

    Each key has three variants: a step below its value, at it, and a step above. A parameter that
    the key moves may have another price on either side; where two have, their prices do not say
    what both together are worth, and the rate is NaN.
    """
    every, rests = np.arange(near.count), bool(near.network.routes.building[itinerary] >= 0)
    which, is_available = np.full_like(every, itinerary), perspective == AVAILABLE
    given = quantities(near, which, every, rests=rests, steps=is_available)
    given = replace(given, steps=steps_for(given.steps, varies=True))
    model, engine = P1().model(given, perspective), bracket if is_available else closed_form
    prices = engine.solve(model, 1, model.row(1)).shadow_prices()
    rates, kinks = np.zeros((2, len(steps))), np.zeros(len(steps))
    for name in (each for each in prices if each not in PLACE):
        figure = np.broadcast_to(model.parameters[name].value, near.count)
        below, _, above = figure.reshape(-1, 3).T
        slopes = (above - below) / (2.0 * steps)
        less, more = prices[name]
        sides = np.where(slopes > 0.0, [[less], [more]], [[more], [less]])
        with np.errstate(invalid="ignore"):
            rates += np.where(slopes == 0.0, 0.0, slopes * sides)
        kinks += prices[name].has_kink & (slopes != 0.0)
    return np.where(kinks > 1, np.nan, rates)


# The printed text and the pictures


def _tables(found: Results) -> Iterator[RenderableType]:
    """Yield the effects of single keys, then what the samples say."""
    facts, hover_s = found.facts, found.facts["hover_time_s"]
    yield Text(f"{found.mission.name}: what matters most, {facts['perspective']}", style="bold")
    yield ""
    rows = [row for row in found.rows if row["swing_s"] > MOVES_S][:MOST_ROWS]
    itself = f"Longest hover {hover_s:.2f} s" if hover_s else "The mission has no plan"
    yield f"{itself}; one key at a time, everything else held:"
    table = plain_table("range", "Δ low", "Δ high", "% by 1 %", "exact", words=["key"], gap=1)
    table.columns[0].max_width = LONGEST_KEY
    for row in rows:
        table.add_row(
            Text(row["key"] + ("+" if row["along"] else "")),
            _range(row["now"], row["low"], row["high"]),
            fixed(row["hover_low_s"]),
            fixed(row["hover_high_s"]),
            _rate(row["elasticity"]),
            "kink" if row["has_kink"] else _rate(row["exact_elasticity"]),
        )
    yield table if rows else "no key within its range changes that; optuav explain shows what would"
    if rows and (more := len(found.rows) - len(rows)):
        yield Text(f"and {more} more with smaller effects")
    if kinks := [row for row in rows if row["has_kink"]]:
        sides = (
            f"{row['key']} {_rate(row['exact_less'])} below, {_rate(row['exact_more'])} above"
            for row in kinks
        )
        yield Text(f"Exact at a kink: {'; '.join(sides)}")
    if any(row["key"] == WAVELENGTH for row in rows):
        yield Text(f"{WAVELENGTH} moves the attenuation alone: slopes and offsets are held")
    if facts["chances"] is not None:
        yield ""
        yield from _chances(facts["chances"], facts["plan_hover_time_s"])


def _rate(elasticity: float | None) -> str:
    if elasticity is None:
        return "–"
    if abs(elasticity) < SMALL:
        return "<0.001" if abs(elasticity) > ZERO else "0"
    return f"{elasticity:+.3f}"


def _range(now: float, low: float, high: float) -> str:
    """Return a range as percent of the value if it is even, else by its ends."""
    if now and math.isclose(now - low, high - now, rel_tol=1e-9):
        return f"±{100.0 * abs((high - now) / now):.3g} %"
    ends = (f"{end:.0f}" if 1e4 <= abs(end) < 1e6 else f"{end:.4g}" for end in (low, high))
    return " to ".join(ends)


def _chances(found: Chances, plan_hover_s: float | None) -> Iterator[RenderableType]:
    how = "as stated" if found.stated else "within 10 %, as nothing was stated"
    count = f"{len(found.uncertain)} keys at once, {how}: {found.samples} samples"
    yield Text(f"{count}, seed {found.seed}", style="bold")
    quantiles = ", ".join(f"{share:.0%} {s:.1f}" for share, s in found.quantiles_s.items())
    yield Text(f"Hover      mean {found.mean_s:.1f} s; quantiles [s] {quantiles}")
    none = {"no plan": found.no_plan} if found.no_plan else {}
    yield Text(f"Best       {_percent({**found.routes, **none})}")
    if found.kept is not None and found.flyable is not None:
        yield Text(
            f"Fixed plan {plan_hover_s:.2f} s of hover, can be flown in "
            f"{found.flyable:.1%} of the samples; it keeps {_percent(found.kept)}"
        )


def _percent(shares: Mapping[str, float]) -> str:
    return ", ".join(f"{name} {share:.1%}" for name, share in shares.items())


def _figures(found: Results) -> Iterator[tuple[str, Axes]]:
    """Yield a tornado of the keys, and how the hover times of the samples are spread."""
    from optuav import plots

    name, facts = found.mission.name, found.facts
    ends = ("key", "low", "high", "hover_low_s", "hover_high_s")
    bars = [plots.Swing(*(row[end] for end in ends)) for row in found.rows]
    yield "tornado.png", plots.tornado(bars, facts["hover_time_s"], name)
    if facts["chances"] is not None:
        times_s, plan_s = facts["chances"].hover_times_s, facts["plan_hover_time_s"]
        yield "hover.png", plots.hover_times(times_s, name, fixed_s=plan_s)
