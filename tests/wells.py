"""Wells after several stages, one after the other."""

from collections.abc import Iterable
from functools import partial, reduce

from optuav.physics.kibam import Battery, Stage, Wells, step

SLOW = {
    "limits.keep_soc": "end",
    "battery.available_fraction": 0.9,
    "battery.flow_rate_per_s": 1e-4,
}
"""A reserve at the end and wells that level in 900 s, with which figures of `matrice350` and
`relay-today` were found by independent code."""


def after(battery: Battery, wells: Wells, stages: Iterable[Stage]) -> Wells:
    """Wells [A s] after several stages of constant current."""
    return reduce(partial(step, battery), stages, wells)
