"""Names of the schedules by which packs take turns, and of the ways in which they are charged.

`optuav.physics.packs` and `optuav.physics.charging` say what they do.
"""

from __future__ import annotations

from typing import Literal, TypeAlias, get_args

Schedule: TypeAlias = Literal[
    "pooled", "sequential", "round-robin", "alternating", "most-available"
]

Charging: TypeAlias = Literal["constant", "taper"]

SCHEDULES: tuple[Schedule, ...] = get_args(Schedule)
"""All of them, the default first."""
