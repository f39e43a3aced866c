"""HiGHS as siting uses it: silent, on one thread, up to a time."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import highspy

LEAST_S = 0.01  # With less time left nothing is begun [s]


def solver_with(**options: float) -> highspy.Highs:
    """An empty programme with some options of the solver."""
    import highspy

    solver = highspy.Highs()  # type: ignore[no-untyped-call]
    solver.setOptionValue("output_flag", False)
    solver.setOptionValue("parallel", "off")
    for name, value in options.items():
        solver.setOptionValue(name, value)
    return solver


def run(solver: highspy.Highs, latest: float) -> bool:
    """Solve up to a time of `time.monotonic` [s], and tell whether there was any left to begin."""
    left_s = latest - time.monotonic()
    if left_s < LEAST_S:
        return False
    solver.setOptionValue("time_limit", left_s)
    solver.run()
    return True
