"""Rows of the engine bracket for many itineraries, from the arrays of their legs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise, zip_longest
from typing import Any, NamedTuple

import numpy as np

from formulations.parameters import Quantities
from formulations.soc import AVAILABLE, PERSPECTIVES
from formulations.wells import Telling, well_limits
from optuav.arrays import Booleans, Floats, Integers
from optuav.engines.rows import Rows, rows_of
from optuav.modelling.kibam_form import CONSTANT, Exponential, unknown
from optuav.physics import kibam

UNUSED = (
    "nominal_voltage_V",
    "flight_energy_J",
    "hover_power_W",
    "hover_received_W",
    "rest_received_W",
)
"""Quantities that this perspective does not speak of."""


class Legs(NamedTuple):
    """Currents [A] and durations [s] of all stages, one leg after another (stage, itinerary).

    Leg m is made of stages ends[m] to ends[m + 1].
    """

    current_A: Floats
    duration_s: Floats
    ends: Sequence[int]

    @property
    def rests(self) -> bool:
        """Whether there are two stays between the legs, so that one is a rest."""
        return len(self.ends) == 4

    def take(self, which: Any) -> Legs:
        """Those of some itineraries, by their numbers or a slice."""
        return Legs(self.current_A[:, which], self.duration_s[:, which], self.ends)


def alike(legs: Legs, figures: Mapping[str, Any], rest_first: bool) -> list[Integers | slice]:
    """Routes in groups that the same limits of the wells tell all about.

    So no answer depends on the itineraries that are worked on together. Parameters as for
    `hover_rows`, with one order of the stays for all.
    """
    count = legs.duration_s.shape[1]
    stays_A = np.array(
        [np.broadcast_to(each, count) for each in _stays_A(legs, figures, rest_first).values()]
    )
    currents_A = np.concatenate([legs.current_A, stays_A])
    told = np.concatenate([_falling(figures, currents_A), stays_A < 0.0, stays_A > 0.0])
    if (told == told[:, :1]).all():
        return [slice(None)]
    _, group = np.unique(told, axis=1, return_inverse=True)
    return [np.flatnonzero(group == number) for number in range(group.max() + 1)]


def hover_rows(
    legs: Legs, figures: Mapping[str, Any], rest_first: bool | Booleans
) -> tuple[Rows, Floats]:
    """What Δ and T', the x and y of the rows, have to satisfy, and the time left for them [s].

    Parameters
    ----------
    legs
        One more than stays, of which there are one or two.
    figures
        What `longest_hovers` takes, by name: numbers, or arrays with one entry an itinerary.
    rest_first
        Whether the rest comes before the hover, where there are both.
    """
    stays_A = _stays_A(legs, figures, rest_first)
    steps, telling = _steps(legs, stays_A, figures)
    unused: dict[str, Any] = dict.fromkeys(UNUSED, np.nan)
    given = Quantities(
        packs=1.0,
        flight_time_s=_sum(legs.duration_s),
        flight_charge_As=-_sum(legs.current_A * legs.duration_s),
        rests=legs.rests,
        steps=steps,
        **unused,
        **{
            **figures,
            "hover_current_A": -stays_A["hover"],
            "rest_current_A": stays_A.get("rest", figures["rest_current_A"]),
        },
    )
    hover, rest = unknown("hover"), unknown("rest") if legs.rests else None
    soc = PERSPECTIVES[AVAILABLE](given, hover, 0.0 if rest is None else rest)
    left_s = given.time_left
    forms = [left_s - (hover if rest is None else hover + rest), soc - given.min_soc]
    sizes = [left_s, 1.0]
    for each in well_limits(given, hover, rest, telling):
        limit = each.relation
        margin = limit.left - limit.right if limit.sense == ">=" else limit.right - limit.left
        forms.append(margin if isinstance(margin, Exponential) else Exponential({CONSTANT: margin}))
        sizes.append(1.0)
    reach_s = np.maximum(left_s, 0.0)
    rows = rows_of(forms, sizes, "hover", "rest" if legs.rests else None, len(reach_s), reach_s)
    return rows.mirrored(~np.asarray(rest_first)) if legs.rests else rows, reach_s


def _sum(stages: Floats) -> Floats:
    """Over the stages (stage, itinerary), one by one however many itineraries there are."""
    return sum(stages, np.zeros(stages.shape[1]))


def _stays_A(legs: Legs, figures: Mapping[str, Any], rest_first: bool | Booleans) -> dict[str, Any]:
    """A stay is to the wells a current [A] for a time: the one before the last is the rest here."""
    hover_A, rest_A = -figures["hover_current_A"], figures["rest_current_A"]
    if not legs.rests:
        return {"hover": hover_A}
    return {
        "rest": _either(rest_first, rest_A, hover_A),
        "hover": _either(rest_first, hover_A, rest_A),
    }


def _falling(figures: Mapping[str, Any], current_A: Any) -> Any:
    """Whether y1 falls all along a step of this current [A]."""
    return kibam.falls_throughout(_whole(figures), current_A)


def _whole(figures: Mapping[str, Any]) -> kibam.Battery:
    """All packs as one."""
    return kibam.Battery(
        figures["capacity_As"], figures["available_fraction"], figures["flow_rate_per_s"]
    )


def _either(which: bool | Booleans, one: Any, other: Any) -> Any:
    if isinstance(which, bool):
        return one if which else other
    return np.where(which, one, other)


def _steps(
    legs: Legs, stays_A: Mapping[str, Any], figures: Mapping[str, Any]
) -> tuple[tuple[Any, ...], list[Telling]]:
    """What happens on the way, and which limits of the wells the others do not imply.

    Where y1 falls all along what comes next, the end of that tells more: so phases of a leg are
    taken together, and before them there is no need to look. Who only drains does not pass full,
    who only charges does not run dry.
    """
    whole = _whole(figures)
    falling = _falling(figures, legs.current_A).all(axis=1).tolist()
    steps: list[Any] = []
    falls: list[bool] = []
    for (start, end), stay in zip_longest(pairwise(legs.ends), stays_A):
        starts = [k for k in range(start, end) if k == start or not falling[k]]
        for first, last in pairwise([*starts, end]):
            run = kibam.Stage(legs.current_A[first:last], legs.duration_s[first:last])
            steps.append(kibam.compose(whole, run))
            falls.append(falling[first])
        if stay:
            steps.append(stay)
            falls.append(bool(np.all(_falling(figures, stays_A[stay]))))
    telling = []
    for step, next_falls in zip(steps, [*falls[1:], False], strict=True):
        stay_A = stays_A[step] if isinstance(step, str) else None
        drains = stay_A is None or bool(np.any(stay_A < 0.0))
        charges = stay_A is not None and bool(np.any(stay_A > 0.0))
        telling.append((drains and not next_falls, charges))
    return tuple(steps), telling
