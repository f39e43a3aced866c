"""The kinetic battery model from lifetimes: capacity, ω and k_F.

The model is linear in the current: when the available well runs dry at time T, ωB equals what the
loads have taken out of it, the sum of the responses to every change of the current. So for given ω
and k_F each discharge tells the capacity that it would have taken to last as long as it did, and
the right ω and k_F are those that make all of these agree. What is fitted is their logarithms:
batteries of one kind differ in capacity from one discharge to the next by some percent, and that is
the noise assumed. Unlike the lifetime, which jumps over a pause, all of this is smooth.

What varies by chance are the lifetimes, so their likelihood has a factor |d log B/d log T| for each
discharge. It is largest where the sum of squares, over the geometric mean of these factors, is
least, as for the transformations of Box and Cox [3]_; without it the fit would prefer batteries
whose capacity hardly matters for how long they last.

References
----------
.. [1] J. F. Manwell, J. G. McGowan, "Lead acid battery storage model for hybrid energy systems",
   Solar Energy, 1993.
.. [2] M. R. Jongerden, B. R. Haverkort, "Which battery model to use?", IET Software, 2009.
.. [3] G. E. P. Box, D. R. Cox, "An analysis of transformations", J. R. Stat. Soc. B, 1964, eq (8).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TypeAlias

import numpy as np

from optuav.arrays import Floats
from optuav.calibration.discharges import Discharge, discharges_in
from optuav.calibration.estimation import NOTHING, Unknown, estimate
from optuav.calibration.fit import Fit, Panel, refuse_outside, unclear, values_of
from optuav.calibration.plausible import doubts
from optuav.calibration.together import copies, together
from optuav.errors import Fault, InputError
from optuav.physics.kibam import Battery, Stage, Wells, step
from optuav.physics.packs import lifetime

Asked: TypeAlias = Callable[[float, float], tuple[Floats, Floats]]

KEYS = ("battery.capacity_As", "battery.available_fraction", "battery.flow_rate_per_s")
OF_ONE = "of one pack, so the loads must be those of one"
LEAST_DISCHARGES = 3
SCATTER = 0.02
"""Relative scatter of lifetimes where there are too few to tell."""
FAR = 0.2
"""Relative miss of a lifetime that scatter does not explain; nothing is stated beyond it."""
ALIKE = 1e-3
"""Relative difference below which two currents are of one size."""
EARLIER = 1e-6
"""Share of the lifetime for the difference quotient of a sensitivity."""
LEAST_SENSITIVITY = 1e-3
"""Below it the available well would not run dry but fill up."""
SHARES = (0.1, 0.4, 0.8)
RATES = (0.1, 1.0, 10.0)
"""Where the fit starts: ω, and k' times the typical lifetime."""


def fit_kibam(files: Iterable[str | Path]) -> Fit:
    """Fit capacity [A s], ω [-] and k_F [1/s] of a battery to lifetimes.

    Parameters
    ----------
    files
        CSV files, the loads those of one pack, as the capacity of a mission is. Of lifetimes under
        constant or repeating loads: columns ``load`` (a name), ``current_A``, ``duration_s``
        (empty for a constant load), ``lifetime_s``, with a line for every piece of a load, in
        order. Or a record ``time_s,current_A`` of one discharge, from full, whose last line is the
        moment of cut-off. Currents are positive while discharging; other units go in the header,
        as ``current_mA`` or ``lifetime_min``.

    Returns
    -------
    Fit
        With a warning, and without values, where the data cannot tell the parameters apart or the
        best fit misses a lifetime by more than a fifth.

    Raises
    ------
    InputError
        With every fault of the files, or if there are fewer than three discharges.
    """
    paths = [Path(file) for file in files]
    discharges = [each for found in together(paths, discharges_in) for each in found]
    if len(discharges) < LEAST_DISCHARGES:
        words = (
            f"at least {LEAST_DISCHARGES} discharges for as many parameters; "
            f"there are {len(discharges)}"
        )
        raise InputError([Fault("", "", words, ", ".join(map(str, paths)))])
    asked = _asked(discharges)

    def residuals(values: Floats) -> Floats:
        capacity_As, share, rate = values
        capacities_As, sensitivities = asked(share, rate)
        usual = np.exp(np.mean(np.log(sensitivities)))
        left: Floats = np.log(capacities_As / capacity_As) / usual
        return left

    unknowns = (Unknown(KEYS[0]), Unknown(KEYS[1], "share"), Unknown(KEYS[2]))
    few = len(discharges) == LEAST_DISCHARGES
    found = estimate(
        unknowns, residuals, _starts(discharges, asked), spread=SCATTER if few else None
    )
    fitted_to = f"fitted to {len(discharges)} discharges"
    values = values_of(found, KEYS, (f"{fitted_to}; {OF_ONE}", fitted_to, fitted_to))
    capacity_As, share, rate = (each.value for each in values)
    fitted_s = tuple(
        lifetime(
            each.pieces, capacity_As=capacity_As, available_fraction=share, flow_rate_per_s=rate
        )
        for each in discharges
    )
    largest_A = max(current_A for each in discharges for current_A, _ in each.pieces)
    missed = [
        each.name
        for each, own_s in zip(discharges, fitted_s, strict=True)
        if not abs(own_s / each.lifetime_s - 1.0) <= FAR
    ]
    if missed:
        # Such data have several poor optima, and rounding decides in which one the fit ends.
        values = tuple(
            replace(each, interval=None, bootstrap=None, determined=False) for each in values
        )
    undetermined = bool(found.undetermined) and not missed
    warnings = [
        *(unclear(found) if undetermined else ()),
        *_why_unclear(discharges, undetermined),
        *_misses(missed),
        *(each.doubt for each in discharges if each.doubt),
        *doubts("at most", {"current": largest_A}),
        *doubts("at least", {"lifetime": min(each.lifetime_s for each in discharges)}),
        *copies(paths),
    ]
    refuse_outside(values, ", ".join(map(str, paths)), warnings)
    if few:
        warnings.append(
            f"{LEAST_DISCHARGES} discharges for as many parameters leave nothing over: the "
            f"intervals take lifetimes to scatter by {SCATTER:.0%}"
        )
    return Fit(
        kind="kibam",
        sources=tuple(map(str, paths)),
        data=f"{len(discharges)} discharges of one full pack",
        values=values,
        panels=(
            Panel(
                "lifetime",
                "s",
                tuple(each.lifetime_s for each in discharges),
                fitted_s,
                names=tuple(each.name for each in discharges),
            ),
        ),
        warnings=tuple(warnings),
    )


def _asked(discharges: Sequence[Discharge]) -> Asked:
    """What each lifetime asks for at given ω and k_F [1/s].

    That is the capacity [A s], and by how much it grows with the lifetime, d log B/d log T.
    """
    changes = [each.changes for each in discharges]
    first = np.cumsum([0, *(len(sizes) for sizes, _ in changes[:-1])])
    changes_A = np.concatenate([sizes for sizes, _ in changes])
    before_end_s = np.concatenate([times for _, times in changes])
    lifetimes_s = np.array([each.lifetime_s for each in discharges])
    earlier_s = np.repeat(EARLIER * lifetimes_s, [len(sizes) for sizes, _ in changes])

    def taken(battery: Battery, times_s: Floats) -> Floats:
        unit = step(battery, Wells(0.0, 0.0), Stage(1.0, times_s)).available_As
        charge_As: Floats = np.add.reduceat(changes_A * unit, first)
        return np.maximum(charge_As, NOTHING)

    def asked(share: float, rate_per_s: float) -> tuple[Floats, Floats]:
        battery = Battery(1.0, share, rate_per_s)
        now, before = taken(battery, before_end_s), taken(battery, before_end_s - earlier_s)
        return now / share, np.maximum((1.0 - before / now) / EARLIER, LEAST_SENSITIVITY)

    return asked


def _starts(discharges: Sequence[Discharge], asked: Asked) -> Iterator[tuple[float, float, float]]:
    """Values to start from, on a grid of ω and of k'; the capacity follows."""
    typical_s = float(np.median([each.lifetime_s for each in discharges]))
    for share in SHARES:
        for rate in RATES:
            flow_rate_per_s = rate / typical_s * share * (1.0 - share)
            capacities_As, _ = asked(share, flow_rate_per_s)
            yield float(np.exp(np.mean(np.log(capacities_As)))), share, flow_rate_per_s


def _why_unclear(discharges: Sequence[Discharge], unclear_: bool) -> Iterator[str]:
    for each in discharges:
        if each.ends_in_pause:
            yield (
                f"{each.name} is told to end in a pause, where a battery cannot run dry: "
                "its lifetime may be wrong"
            )
    if not unclear_:
        return
    sizes = {each.pieces[0][0] for each in discharges}
    if all(each.constant for each in discharges):
        one = max(sizes) - min(sizes) <= ALIKE * max(sizes)
        yield (
            "all loads are constant and of one size, which says how much charge the battery gives "
            "at that current and nothing else; "
            if one
            else "all loads are constant; "
        ) + "add loads of other sizes, from very small to very large, and with pauses"
    else:
        yield "add loads of other sizes, constant ones and ones with long and short pauses"


def _misses(missed: Sequence[str]) -> Iterator[str]:
    if missed:
        yield (
            "no kinetic battery lasts like that, so no value is stated: the fit misses "
            f"{', '.join(missed)} by more than {FAR:.0%}; look at units, and whether it was one "
            "full battery each time"
        )
