"""Samples of uncertain keys that fill their ranges evenly, for batches."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Literal, TypeAlias, get_args

import numpy as np

from optuav.arrays import Floats
from optuav.errors import Fault, collected, refuse
from optuav.mission import Mission, load
from optuav.mission.messages import misfits, unknown
from optuav.mission.schema import Number
from optuav.studies.uncertainty import Spread, spreads

Method: TypeAlias = Literal["sobol", "latin-hypercube"]
METHODS: tuple[Method, ...] = get_args(Method)
COUNT = Number("-", ge=1, le=1e7, whole=True)
SEED = Number("-", ge=0, le=2**63, whole=True)


def samples(
    mission: Mission | str | Path,
    uncertainty: Mapping[str, object] | str | Path,
    count: int,
    *,
    method: Method = "sobol",
    seed: int = 0,
) -> dict[str, Floats]:
    """Draw samples of uncertain keys that cover their distributions evenly.

    Parameters
    ----------
    mission
        A mission, the name of a shipped one, or the path of a mission file.
    uncertainty
        Distributions of keys, as for `optuav.sensitivity`: a TOML file or a dict, in which keys may
        be dotted, as in ``{"limits.deadline_s": {"low": 600, "high": 1800}}``.
    count
        Number of samples, 1 to 1e7.
    method
        ``"sobol"``: a scrambled Sobol sequence [1]_, of which the first samples are the same for
        any count; or ``"latin-hypercube"``: each key has one sample in every of `count` equally
        likely parts of its range [2]_.
    seed
        Seed of the samples, 0 to 2**63.

    Returns
    -------
    dict
        Values by key, one entry a sample, as `optuav.batch` takes them with ``paired=True``.

    Raises
    ------
    InputError
        With all faults of the distributions and options.

    References
    ----------
    .. [1] I. M. Sobol, "On the distribution of points in a cube and the approximate evaluation of
       integrals", USSR Computational Mathematics and Mathematical Physics, 1967.
    .. [2] M. D. McKay, R. J. Beckman, W. J. Conover, "A comparison of three methods for selecting
       values of input variables in the analysis of output from a computer code", Technometrics,
       1979.

    Examples
    --------
    >>> import optuav
    >>> spread = {"battery.capacity_As": {"percent": 10}, "limits.deadline_s": {"deviation": 60}}
    >>> drawn = optuav.samples("paper", spread, 256)
    >>> found = optuav.batch_arrays("paper", drawn, perspective="battery", paired=True)
    >>> f"{found['hover_time_s'].mean():.0f} s of hover on average"
    '720 s of hover on average'
    """
    faults = [*misfits(("count", count, COUNT), ("seed", seed, SEED))]
    if method not in METHODS:
        faults.append(unknown("method", method, METHODS))
    spread = tuple[Spread, ...]()
    with collected(faults):
        if not (spread := spreads(load(mission), uncertainty)):
            faults.append(Fault("uncertainty", "", "at least one key with its distribution"))
    refuse(faults)
    if method == "sobol":
        shares = sobol(len(spread), seed, 0, count)
    else:
        from scipy.stats import qmc

        shares = qmc.LatinHypercube(len(spread), rng=seed).random(count)
    found: dict[str, Floats] = {}
    for each, column in zip(spread, shares.T, strict=True):
        found |= each.columns(each.at(column))
    return found


def sobol(dimensions: int, seed: int, first: int, count: int) -> Floats:
    """Points of a scrambled Sobol sequence from number `first` on, by rows."""
    from scipy.stats import qmc

    points = qmc.Sobol(dimensions, rng=seed)
    begin = points.random(1)  # A first draw of other than a power of two would warn
    if first:
        found: Floats = points.fast_forward(first - 1).random(count)
        return found
    return np.concatenate([begin, points.random(count - 1)])
