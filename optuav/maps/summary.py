"""A map in words and as plain data."""

from __future__ import annotations

from collections.abc import Iterator
from math import isnan
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import xarray


def summary(found: xarray.DataArray) -> str:
    """What a map is of, where the hover is longest, and why some points have no plan."""
    facts, values, places = found.attrs, found.to_numpy(), dict[str, str]()
    height, width = found.shape
    places["Map"] = f"{facts['mission']}, {facts['perspective']}: {facts['over']} on {width} × "
    places["Map"] += f"{height} points at z = {facts['height_m']:.10g} m"
    for name, axis in ("x", found.x), ("y", found.y):
        places[name] = f"{float(axis[0]):.10g} to {float(axis[-1]):.10g} m"
    if not np.isnan(values).all():
        x, y, _ = facts["best_m"]
        places["Longest"] = f"{np.nanmax(values):.2f} s at ({x:.10g}, {y:.10g}) m"
        places["Shortest"] = f"{np.nanmin(values):.2f} s"
    lines = [f"{head:11}{words}" for head, words in places.items()]
    return "\n".join([*lines, *(f"No plan    {count} points: {why}" for count, why in _why(found))])


def to_dict(found: xarray.DataArray) -> dict[str, Any]:
    """A map as plain data for JSON, None where there is no plan."""
    rows = [[None if isnan(at) else at for at in row] for row in found.to_numpy().tolist()]
    axes = {f"{name}_m": found[name].to_numpy().tolist() for name in ("x", "y")}
    names = found.reason.attrs["flag_meanings"].split()
    reasons = {"reason": found.reason.to_numpy().tolist(), "reason_words": names}
    return {**found.attrs, **axes, "hover_time_s": rows, **reasons}


def _why(found: xarray.DataArray) -> Iterator[tuple[int, str]]:
    """Numbers of points without a plan and the reasons, the most frequent first."""
    words = found.reason.attrs["words"].splitlines()
    codes, counts = np.unique(found.reason.to_numpy(), return_counts=True)
    for place in np.argsort(-counts, kind="stable"):
        if codes[place]:
            yield int(counts[place]), words[codes[place]]
