"""Wells after several stages, one after the other."""

from collections.abc import Iterable
from functools import partial, reduce

from optuav.physics.kibam import Battery, Stage, Wells, step


def after(battery: Battery, wells: Wells, stages: Iterable[Stage]) -> Wells:
    """Wells [A s] after several stages of constant current."""
    return reduce(partial(step, battery), stages, wells)
