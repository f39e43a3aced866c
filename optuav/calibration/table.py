"""Keys of a mission from a table of results: which are known, which are free.

Each row of the table is a mission flown: a hover and a rest of known length on a known route. Its
flight time and the charge and energy that are left follow from the mission by the same phases that
plans are made of; the free keys are fitted to those that the table tells. What is stated as a check
is predicted only, or repeats a number that was fitted: then it tests nothing.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from optuav.arrays import Floats
from optuav.calibration.estimation import Unknown, estimate
from optuav.calibration.fit import Fit, Panel, Role, rounded, unclear, values_of
from optuav.calibration.flown import QUANTITIES, quantities
from optuav.calibration.table_statement import Cell, Statement, read_statement, tie, value_of
from optuav.errors import Fault, InputError
from optuav.mission import Mission
from optuav.mission.words import shown
from optuav.network.network import Network, build_network

SHARE_OF_RESOLUTION = 1.0 / math.sqrt(12.0)
"""Standard deviation of a rounding error, in steps of the rounding."""
IMPOSSIBLE = 1e9
"""Residual where a row cannot be flown, or the values are not those of a mission."""
EDGE = 1e-3
"""Relative distance from a value within which there is an edge that has shaped it."""
SAME = 1e-9
"""Difference of two numbers that a mission tells, relative or in their unit, that is none."""
SCALES = (1.0, 0.5, 2.0)
"""Where the fit starts, as multiples of the stated values."""


def fit_table(files: Iterable[str | Path]) -> Fit:
    """Fit keys of a mission to a table of results.

    Parameters
    ----------
    files
        One TOML file: ``mission`` (what is known, a shipped name or a path relative to the file),
        ``[known]`` (keys that differ), ``[free]`` (keys to be fitted with a value to start from),
        ``[tied]`` (keys that are products of others), ``[resolution]`` (by quantity, the step to
        which the table is rounded), and ``[[rows]]`` with ``name``, ``given`` (hover_time_s,
        rest_time_s, building, order, laser, or keys of the mission), ``fit`` and ``check``
        (numbers by quantity, see `QUANTITIES`).

    Returns
    -------
    Fit
        Intervals follow from the resolution, and from the residuals where those are larger. With
        warnings where the values do not meet the table, or a key lies where hardly a mission is.

    Raises
    ------
    InputError
        With every fault of the statement, if it has fewer numbers to fit than free keys, or if a
        row cannot be flown with the values found.
    """
    paths = [Path(file) for file in files]
    if len(paths) != 1:
        raise InputError("one file that states the table, what is known and what is free")
    stated = read_statement(paths[0])
    cells = [cell for row in stated.rows for cell in row.cells]
    fits = np.array([cell.fits for cell in cells])
    steps = np.array([SHARE_OF_RESOLUTION * cell.resolution for cell in cells])
    observed = np.array([cell.observed for cell in cells])

    def residuals(values: Floats) -> Floats:
        left: Floats = ((_tried(stated, values, len(cells)) - observed) / steps)[fits]
        return np.nan_to_num(left, nan=IMPOSSIBLE)

    keys = tuple(stated.free)
    starts = [tuple(scale * each for each in stated.free.values()) for scale in SCALES]
    found = estimate([Unknown(key) for key in keys], residuals, starts, spread=1.0, bootstrap=False)
    count = int(fits.sum())
    values = values_of(found, keys, f"fitted to {_numbers(count)} of the table")
    mission = stated.with_values(found.values.tolist())
    told = _told(stated, mission)
    _refuse_unflown(stated, cells, told)
    roles = _roles(cells, told.tolist())
    products = {
        key: rounded(value_of(mission, key))
        for key, factors in stated.tied.items()
        if not set(factors) & set(found.undetermined)
    }
    repeated = f", {roles.count('repeat')} repeated" if "repeat" in roles else ""
    return Fit(
        kind="table",
        sources=(str(paths[0]),),
        data=(
            f"{_numbers(count)} of the table fitted by {len(keys)} free "
            f"key{'s' * (len(keys) > 1)}{repeated}, {roles.count('predicted')} predicted"
        ),
        values=values,
        panels=tuple(_panels(cells, told, roles)),
        warnings=(
            *unclear(found),
            *_missed(cells, told),
            *_fitted_again(cells, told.tolist()),
            *_at_an_edge(stated, found.values, len(cells)),
        ),
        settings={**stated.known, **products},
        extends=stated.base,
    )


def _told(stated: Statement, mission: Mission) -> Floats:
    """The numbers of the table as a mission has them."""
    different: list[Mapping[str, Any]] = []
    networks: list[Network] = []
    found = []
    for row in stated.rows:
        if row.changes not in different:
            changed = mission.replace(row.changes) if row.changes else mission
            different.append(row.changes)
            networks.append(build_network(tie(changed, stated.tied)))
        told = quantities(networks[different.index(row.changes)], row.stay)
        found += [told[cell.quantity] for cell in row.cells]
    return np.array(found)


def _tried(stated: Statement, values: Floats, count: int) -> Floats:
    """The numbers of the table with values that may be none of a mission; NaN then."""
    try:
        return _told(stated, stated.with_values(values.tolist()))
    except InputError:
        return np.full(count, math.nan)


def _roles(cells: Sequence[Cell], told: Sequence[float]) -> list[Role]:
    """Fitted, predicted, or both stated and told like a number that is fitted."""
    fitted = [(cell, each) for cell, each in zip(cells, told, strict=True) if cell.fits]

    def role(cell: Cell, value: float) -> Role:
        if cell.fits:
            return "fitted"
        alike = any(_repeats(cell, value, *other) for other in fitted)
        return "repeat" if alike else "predicted"

    return [role(cell, value) for cell, value in zip(cells, told, strict=True)]


def _repeats(cell: Cell, value: float, other: Cell, its: float) -> bool:
    """Whether two numbers of the table are one: of one quantity, stated and told alike."""
    stated = (cell.quantity, cell.observed) == (other.quantity, other.observed)
    return stated and math.isclose(value, its, rel_tol=SAME, abs_tol=SAME)


def _fitted_again(cells: Sequence[Cell], told: Sequence[float]) -> Iterator[str]:
    """That a number counts more than once, as if it had been measured again."""
    fitted = [(cell, each) for cell, each in zip(cells, told, strict=True) if cell.fits]
    again = sum(
        any(_repeats(*each, *other) for other in fitted[:place])
        for place, each in enumerate(fitted)
    )
    if again:
        yield (
            f"{_numbers(again)} to be fitted repeat{'s' * (again == 1)} another: state it as a "
            "check, or the intervals are too narrow"
        )


def _numbers(count: int) -> str:
    return f"{count} number{'s' * (count > 1)}"


def _missed(cells: Sequence[Cell], told: Floats) -> Iterator[str]:
    """That the table asks for what the values do not give."""
    fitted = [(cell, each) for cell, each in zip(cells, told.tolist(), strict=True) if cell.fits]
    steps = [abs(each - cell.observed) / cell.resolution for cell, each in fitted]
    missed = sum(each > 1.0 for each in steps)
    if missed:
        cell, value = fitted[int(np.argmax(steps))]
        yield (
            f"the values do not meet the table: {missed} of {len(fitted)} numbers are missed by "
            f"more than their rounding, {cell.quantity} of {cell.row} by "
            f"{value - cell.observed:+.3g}"
        )


def _at_an_edge(stated: Statement, values: Floats, count: int) -> Iterator[str]:
    """Which keys the fit has driven to where no mission is, or none that can be flown."""
    for place, key in enumerate(stated.free):
        for words, factor in (("less", 1.0 - EDGE), ("more", 1.0 + EDGE)):
            beyond = values.copy()
            beyond[place] *= factor
            if not np.isfinite(_tried(stated, beyond, count)).all():
                yield (
                    f"{key.rpartition('.')[2]} is at an edge: with a thousandth {words} of it the "
                    "rows cannot be flown, or it is out of its range"
                )


def _refuse_unflown(stated: Statement, cells: Sequence[Cell], told: Floats) -> None:
    """Refuse rows that the values found cannot fly: nothing is told by them, nothing predicted."""
    unflown = {cell.row for cell, each in zip(cells, told, strict=True) if not math.isfinite(each)}
    words = "a row that can be flown; none of the values tried can: start from others in [free]"
    faults = [Fault("rows", shown(name), words, stated.source) for name in sorted(unflown)]
    if faults:
        raise InputError(faults)


def _panels(cells: Sequence[Cell], told: Floats, roles: Sequence[Role]) -> Iterator[Panel]:
    for quantity in dict.fromkeys(cell.quantity for cell in cells):
        own = [number for number, cell in enumerate(cells) if cell.quantity == quantity]
        words = quantity.rpartition("_")[0]
        yield Panel(
            words.replace("_", " "),
            QUANTITIES[quantity],
            tuple(cells[number].observed for number in own),
            tuple(told[own].tolist()),
            names=tuple(cells[number].row for number in own),
            roles=tuple(roles[number] for number in own),
        )
