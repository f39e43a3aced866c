"""Names for the charge in both wells after a step."""

from __future__ import annotations

from optuav.modelling import Expression, Let
from optuav.modelling.expression import Indexed
from optuav.physics import kibam


def named(level: kibam.Wells, number: int, words: str) -> kibam.Wells:
    """Names for the wells after a step, else each step would multiply the printed problem.

    Parameters
    ----------
    level
        Charge in both wells after it [A s]; numbers need no names.
    number
        Of the step, from 1.
    words
        What is printed instead of the expression that the name stands for; empty to print that.
    """
    if not isinstance(level.total_As, Expression):
        return level
    return kibam.Wells(
        Let(
            f"available after step {number}",
            Indexed("y1", number),
            "A s",
            level.available_As,
            words,
        ),
        Let(f"bound after step {number}", Indexed("y2", number), "A s", level.bound_As, words),
    )
