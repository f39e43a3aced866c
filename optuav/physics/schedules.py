"""Names of the schedules by which packs take turns; `optuav.physics.packs` says what they do."""

from __future__ import annotations

from typing import Literal, TypeAlias, get_args

Schedule: TypeAlias = Literal[
    "pooled", "sequential", "round-robin", "alternating", "most-available"
]

SCHEDULES: tuple[Schedule, ...] = get_args(Schedule)
"""All of them, the default first."""
