"""``python -m benchmarks [name ...]``: all benchmarks, or the named ones."""

from __future__ import annotations

import sys
from collections.abc import Callable

from rich.console import Console

from benchmarks import (
    batch,
    bracket,
    closed_form,
    compiled,
    devices,
    explorer,
    grid,
    maps,
    million,
    modellers,
    moving,
    rivals,
    roofs,
    samples,
    schedules,
    sensitivity,
    several_stops,
    sight,
    siting,
    startup,
    sweep,
)
from benchmarks.timing import Row, table

BENCHMARKS: dict[str, Callable[[], list[Row]]] = {
    "grid": grid.run,
    "closed-form": closed_form.run,
    "bracket": bracket.run,
    "compiled": compiled.run,
    "modellers": modellers.run,
    "rivals": rivals.run,
    "roofs": roofs.run,
    "million": million.run,
    "sight": sight.run,
    "moving": moving.run,
    "several-stops": several_stops.run,
    "devices": devices.run,
    "samples": samples.run,
    "schedules": schedules.run,
    "sensitivity": sensitivity.run,
    "batch": batch.run,
    "siting": siting.run,
    "maps": maps.run,
    "sweep": sweep.run,
    "explorer": explorer.run,
    "startup": startup.run,
}


def main() -> int:
    """Run, print, and fail if a stated limit is missed."""
    screen = Console(highlight=False)
    unknown = [name for name in sys.argv[1:] if name not in BENCHMARKS]
    if unknown:
        screen.print(f"no benchmark {', '.join(unknown)}; there are {', '.join(BENCHMARKS)}")
        return 2
    missed = False
    for name in sys.argv[1:] or BENCHMARKS:
        rows = BENCHMARKS[name]()
        screen.print(table(name, rows))
        missed |= any(row.missed for row in rows)
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
