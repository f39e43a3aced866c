"""What matters most, as tables of at most 80 columns."""

from __future__ import annotations

import math
from collections.abc import Iterator

from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from optuav.studies.uncertain.chances import Chances
from optuav.studies.uncertain.effects import Effect
from optuav.studies.uncertain.study import Sensitivity

MOST_ROWS = 24
MOVES_S = 5e-3
"""Effects below this are only named [s]."""
ZERO, SMALL = 1e-9, 5e-4
"""Elasticities below this would show no digit."""
MOST_ROUTES = 4
WAVELENGTH = "laser.wavelength_nm"
LONGEST_KEY = 34


def sensitivity_tables(found: Sensitivity) -> Iterator[RenderableType]:
    """Effects of single keys, then what follows from all that is uncertain."""
    yield Text(f"{found.mission.name}: what matters most, {found.perspective}", style="bold")
    yield ""
    moving = [each for each in found.effects if each.swing_s(found.hover_time_s) > MOVES_S]
    stands = (
        f"Longest hover {found.hover_time_s:.2f} s"
        if found.hover_time_s
        else "No hover as it stands"
    )
    yield f"{stands}; one key at a time, everything else held:"
    if moving:
        yield _effects(found, moving[:MOST_ROWS])
    else:
        yield "no key within its range changes that; optuav explain tells what would"
    if len(moving) > MOST_ROWS:
        yield Text(f"and {len(moving) - MOST_ROWS} more with smaller effects")
    yield from _kinks(moving[:MOST_ROWS])
    if any(each.key == WAVELENGTH for each in moving[:MOST_ROWS]):
        yield Text(f"{WAVELENGTH} moves the attenuation alone: slopes and offsets are held")
    idle = [each.key for each in found.effects if each not in moving]
    if moving and idle:
        yield Text(f"Less than {MOVES_S:g} s: {', '.join(idle)}")
    if found.chances is not None:
        yield ""
        yield from _chances(found, found.chances)


def _effects(found: Sensitivity, shown: list[Effect]) -> Table:
    table = Table(box=None, pad_edge=False, padding=(0, 1, 0, 0), header_style="")
    table.add_column("key", no_wrap=True, max_width=LONGEST_KEY)
    for name in ("range", "Δ low", "Δ high", "% by 1 %", "exact"):
        table.add_column(Text(name), justify="right", no_wrap=True)
    for each in shown:
        table.add_row(
            Text(each.key + ("+" if each.along else "")),
            _range(each),
            *("none" if s is None else f"{s:.2f}" for s in (each.hover_low_s, each.hover_high_s)),
            _rate(each.elasticity),
            "kink" if each.has_kink else _rate(each.exact_elasticity),
        )
    return table


def _kinks(shown: list[Effect]) -> Iterator[RenderableType]:
    """Both sides of the exact rates that differ."""
    told = [
        f"{each.key} {_rate(each.exact_less)} below, {_rate(each.exact_more)} above"
        for each in shown
        if each.has_kink
    ]
    if told:
        yield Text(f"Exact at a kink: {'; '.join(told)}")


def _rate(elasticity: float | None) -> str:
    if elasticity is None:
        return "–"
    if abs(elasticity) < SMALL:
        return "<0.001" if abs(elasticity) > ZERO else "0"
    return f"{elasticity:+.3f}"


def _range(effect: Effect) -> str:
    """The range as percent of the value where it is even, else by its ends."""
    below, above = effect.now - effect.low, effect.high - effect.now
    if effect.now and math.isclose(below, above, rel_tol=1e-9):
        return f"±{100.0 * abs(above / effect.now):.3g} %"
    return " to ".join(
        f"{end:.0f}" if 1e4 <= abs(end) < 1e6 else f"{end:.4g}" for end in (effect.low, effect.high)
    )


def _chances(found: Sensitivity, chances: Chances) -> Iterator[RenderableType]:
    how = "as stated" if chances.stated else "within 10 %, as nothing was stated"
    yield Text(
        f"{len(chances.uncertain)} keys at once, {how}: {chances.samples} samples, "
        f"seed {chances.seed}",
        style="bold",
    )
    quantiles = ", ".join(f"{share:.0%} {s:.1f}" for share, s in chances.quantiles_s.items())
    yield Text(f"Hover      mean {chances.mean_s:.1f} s; quantiles [s] {quantiles}")
    routes = list(chances.routes.items())
    words = [f"{name} {share:.1%}" for name, share in routes[:MOST_ROUTES]]
    if len(routes) > MOST_ROUTES:
        words.append(f"others {sum(share for _, share in routes[MOST_ROUTES:]):.1%}")
    if chances.no_plan:
        words.append(f"no plan {chances.no_plan:.1%}")
    yield Text(f"Best       {', '.join(words)}")
    if chances.kept is not None and chances.flyable is not None:
        kept = ", ".join(f"{name} {share:.1%}" for name, share in chances.kept.items())
        yield Text(
            f"Fixed plan {found.plan_hover_time_s:.2f} s of hover, can be flown in "
            f"{chances.flyable:.1%} of the samples; it keeps {kept}"
        )
        yield Text(
            "Hover and Best count the fixed plan too, where it keeps the limits: its hover point "
            "stays, which else moves with the reach of the radio."
        )
