"""Names for the charge in both wells after a step."""

from __future__ import annotations

from collections.abc import Sequence

from optuav.modelling import Expression, Let
from optuav.modelling.expression import Trend
from optuav.physics import kibam


def named(
    level: kibam.Wells,
    number: int,
    words: str,
    known: Sequence[Trend],
    most: kibam.Wells | None,
) -> kibam.Wells:
    """Names for the wells after a step, else each step would multiply the printed problem.

    Parameters
    ----------
    level
        Charge in both wells after it [A s]; numbers need no names.
    number
        Of the step, from 1.
    words
        What is printed instead of what it stands for; empty if that is.
    known
        What is known of how the available well after it goes with the times.
    most
        What both hold at most while the times are within ranges, if that is known.
    """
    if not isinstance(level.total_As, Expression):
        return level
    return kibam.Wells(
        Let(
            f"available after step {number}",
            f"y1_{number}",
            "A s",
            level.available_As,
            words,
            known,
            most and most.available_As,
        ),
        Let(
            f"bound after step {number}",
            f"y2_{number}",
            "A s",
            level.bound_As,
            words,
            most=most and most.bound_As,
        ),
    )


def most_of(level: kibam.Wells) -> kibam.Wells:
    """What named wells hold at most while the times are within ranges."""
    return kibam.Wells(*(getattr(well, "most", None) for well in level))
