"""``optuav calibrate``: parameters of a mission from data."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from optuav.cli.output import check_places, command, deliver
from optuav.errors import Fault, InputError, NoPlanError, SolverError, collected, refuse, shown

if TYPE_CHECKING:
    from optuav.calibration import Fit
    from optuav.mission import Mission

MOST_ROWS = 40  # Observations that are listed one by one
LONGEST = 30  # Letters of a name or of an interval
NOT_KEYS = {"lag_s": "lag (1−ω)²/k_F [s], not a key"}
"""Names of values that are no keys of a mission."""
Kind = Literal["kibam", "regimes", "rotor", "rotary-wing", "table"]


def calibrate(
    kind: Kind,
    files: list[Path],
    extends: str | None = None,
    never_longer: bool = False,
    as_json: bool = False,
    save: Path | None = None,
    plot: Path | None = None,
) -> None:
    """Find parameters of a mission from measurements, with confidence intervals."""
    from optuav.mission.files import must_be_new, write_text
    from optuav.mission.load import load, must_load

    faults = list[Fault]()
    if never_longer and kind != "kibam":
        faults.append(Fault("--never-longer", "", f"requires KIND kibam, not {kind}"))
        never_longer = False
    if save is not None:
        must_be_new(save)
    check_places(save, plot, ".toml", "")
    from optuav import calibration

    options = {"never_longer": True} if never_longer else {}
    with collected(faults):
        base = None if extends is None else load(extends)
    with collected(faults):
        found: Fit = getattr(calibration, f"fit_{kind.replace('-', '_')}")(files, **options)
    refuse(faults)
    if extends is not None:
        found = replace(found, extends=extends)
    hover = None if base is None or found.lag is None else _hover(found, base)
    written = []
    if save is not None:
        text = found.to_toml(file=save)
        try:
            must_load(text, save)
        except InputError as error:
            name = shown(found.extends)
            of_both = f"values from {', '.join(found.sources)} on top of {name}"
            faults = [replace(fault, source=of_both) for fault in error.faults]
            words = "a mission on which these values load; nothing is written"
            raise InputError([*faults, Fault("extends", name, words)]) from None
        write_text(save, text)
        written.append(save)
    if plot is not None and found.panels:
        from optuav import plots

        written += plots.save_figures([("fit.png", plots.fit(found)[0].values)], plot)
    notes = [f"warning: {warning}" for warning in found.warnings]
    if isinstance(hover, str):
        notes.append(f"{extends} with these values: {hover}")
    elif hover:
        value, *ends = (f"{time_s:.1f}" for time_s in hover.values())
        between = f", 95 % between {' and '.join(ends)} s" if ends else ""
        notes.append(f"{extends} hovers {value} s with these values{between}")
    if found.changes:
        pairs = (("--set", f"{key}={value}") for key, value in found.changes.items())
        notes += ["", command(["optuav", "solve", "MISSION"], *pairs)]
    deliver(
        lambda: found.to_dict() | ({"hover_time_s": hover} if isinstance(hover, dict) else {}),
        (*_found(found), *notes),
        as_json=as_json,
        written=written,
    )


def _hover(found: Fit, mission: Mission) -> dict[str, float] | str | None:
    """Longest hover of a mission with the values, and its least and largest at the edge [s].

    Without a plan, why; without one at the edge, no interval; None without values.
    """
    from optuav.solving import solve

    def hovers(changes: Mapping[str, object]) -> float:
        return solve(mission.replace(changes)).hover_time_s

    if not found.changes:
        return None
    try:
        hover_s = {"value": hovers(found.changes)}
    except (InputError, NoPlanError, SolverError) as error:
        return str(error)
    with suppress(InputError, NoPlanError, SolverError):
        if ends_s := [hovers(each) for each in found.edge]:
            hover_s |= {"low": min(ends_s), "high": max(ends_s)}
    return hover_s


def _found(found: Fit) -> Iterator[str]:
    """The values, table by table of the mission, then the observations."""
    from optuav.presentation.text import tabulated

    yield f"{found.kind}: {found.data}"
    tables: dict[str, list[Sequence[str]]] = {}
    for value in found.rows:
        name, _, key = value.key.rpartition(".")
        name, key = name or "battery", NOT_KEYS.get(key, key)
        row = value.written(" – ")
        if not value.determined:
            row = [row[0] if value.stated else "?", "not determined"]
        rows = tables.setdefault(name, [(f"[{name}]", "value", "95 % between")])
        rows.append((key, *row, *(["–"] if value.determined and not value.interval else [])))
    for rows in tables.values():
        yield from ("", *tabulated(rows, longest=LONGEST))
    for panel in found.panels:
        yield ""
        if not panel.names:
            left = math.dist(panel.observed, panel.fitted) / math.sqrt(len(panel.observed))
            words = f"{left:.3g} {panel.unit} rms left over of {len(panel.observed)} samples"
            yield f"{panel.quantity}: {words}"
            continue
        table = [(f"{panel.quantity} [{panel.unit}]", "observed", "fitted", "difference", "")]
        roles = panel.roles or ["fitted"] * len(panel.names)
        points = [*zip(panel.names, panel.observed, panel.fitted, roles, strict=True)]
        for name, observed, fitted, role in points[:MOST_ROWS]:
            same = math.isclose(fitted, observed, rel_tol=1e-9)
            difference = "0" if same else f"{fitted - observed:+.3g}"
            about = "" if role == "fitted" else role
            table.append((name, f"{observed:.6g}", f"{fitted:.6g}", difference, about))
        yield from tabulated(table, last=1, longest=LONGEST)
        if (more := len(panel.names) - MOST_ROWS) > 0:
            yield f"and {more} more"
