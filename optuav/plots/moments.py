"""What a reader calls a limit of the available well in a picture: where it is empty, or full."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence

from optuav.plots.style import printed

LIMIT = re.compile(r"\S+ not (dry|past full) after (?:stage (\d+) of flight (\d+)|the (\w+))")
REACHED = {"dry": "empty", "past full": "full"}


def in_words(label: str, labels: Collection[str], route: Sequence[str]) -> str:
    """The label of a constraint; one of the wells by what happens where it is met.

    Parameters
    ----------
    label
        As declared.
    labels
        Those of all constraints of the model, which tell the last stage of a flight.
    route
        Names of the places in the order in which they are reached; empty if nobody knows.
    """
    found = LIMIT.fullmatch(label)
    if found is None:
        return label
    limit, stage, flight, stay = found.groups()
    well = f"available well {REACHED[limit]}"
    if stay is not None:
        return f"{well} after the {stay}"
    end = f"to {printed(route[int(flight)])}" if route else flight
    next_stage = f"after stage {int(stage) + 1} of flight {flight}"
    lands = not any(each.endswith(next_stage) for each in labels)
    return f"{well}, end of flight {end}" if lands else f"{well}, stage {stage} of flight {end}"
