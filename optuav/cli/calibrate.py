"""``optuav calibrate``: parameters of a mission from data."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from optuav.cli.options import by_flags
from optuav.cli.output import check_places, command, deliver
from optuav.errors import Fault, InputError, NoPlanError, SolverError, collected, refuse, shown
from optuav.presentation.blocks import Note
from optuav.presentation.numbers import fixed

if TYPE_CHECKING:
    from optuav.calibration import Fit
    from optuav.mission import Mission

OF_LOGS = ("kibam", "regimes", "rotary-wing")
"""Kinds that read flight logs."""
Kind = Literal["kibam", "regimes", "rotor", "rotary-wing", "table"]


def calibrate(
    kind: Kind,
    files: list[Path],
    extends: str | None = None,
    never_longer: bool = False,
    column: list[str] | None = None,
    as_json: bool = False,
    save: Path | None = None,
    plot: Path | None = None,
) -> None:
    """Find parameters of a mission from measurements, with confidence intervals."""
    from optuav.mission.files import STANDARD

    base, fit = _fitted(kind, files, extends, column, save, plot, never_longer=never_longer)
    hover = None if base is None or fit.lag is None else _hover(fit, base)
    written, faults_of_save = list[Path](), list[Fault]()
    if save is not None:
        with collected(faults_of_save):
            _write(fit, save, base)
            written.append(save)
        if save == STANDARD:
            refuse(faults_of_save)
    if plot is not None and fit.panels and not faults_of_save:
        written += _draw(fit, plot)
    hint = ""
    if fit.changes:
        pairs = (("--set", f"{key}={value}") for key, value in fit.changes.items())
        hint = f"\n{command(['optuav', 'solve', 'MISSION'], *pairs)}"
    deliver(
        lambda: fit.to_dict() | ({"hover_time_s": hover} if isinstance(hover, dict) else {}),
        [*fit.blocks(), Note([*_hover_in_words(extends, hover)])],
        as_json=as_json,
        hint=hint,
        written=written,
    )
    refuse(faults_of_save)


def _fitted(
    kind: Kind,
    files: Sequence[Path],
    extends: str | None,
    column: Sequence[str] | None,
    save: Path | None,
    plot: Path | None,
    *,
    never_longer: bool,
) -> tuple[Mission | None, Fit]:
    """The mission that values extend, and the fit; or all faults of options and files at once."""
    from optuav.calibration.logs.read import LARGEST_LOG, flight_log_in
    from optuav.mission.files import must_be_new, opened
    from optuav.mission.load import load

    faults, of_columns, of_data = (list[Fault]() for _ in range(3))
    if never_longer and kind != "kibam":
        faults.append(Fault("--never-longer", "", f"requires KIND kibam, not {kind}"))
    with collected(faults):
        if save is not None:
            must_be_new(save)
    with collected(faults):
        check_places(save, None, ".toml", "")
    with collected(faults):
        check_places(None, plot)
    from optuav import calibration

    options: dict[str, Any] = {}
    if never_longer and kind == "kibam":
        options["never_longer"] = True
    if column and kind not in OF_LOGS:
        words = f"requires KIND {', '.join(OF_LOGS[:-1])} or {OF_LOGS[-1]}, not {kind}"
        faults.append(Fault("--column", "", words))
    elif column:
        with collected(of_columns):
            options["columns"] = _columns(column)
    with collected(faults):
        base = None if extends is None else load(extends)
    if faults or of_columns:  # Nothing is fitted, but files and their columns are there or not
        for path in files:
            with collected(of_data), opened(path, LARGEST_LOG):
                if "columns" in options:
                    flight_log_in(path, options["columns"])
    else:
        with collected(of_data):
            fit: Fit = getattr(calibration, f"fit_{kind.replace('-', '_')}")(files, **options)
    renamed = (by_flags(fault, {"columns": "--column"}) for fault in of_data)
    refuse([*faults, *of_columns, *renamed])
    return base, fit if extends is None else replace(fit, extends=extends)


def _columns(pairs: Sequence[str]) -> dict[str, str]:
    """New names of headings by the old ones, from OLD=NEW."""
    new_names, faults = dict[str, str](), list[Fault]()
    for pair in pairs:
        old, _, new = pair.rpartition("=")
        if not (old and new):
            words = "OLD=NEW: a heading of the file, and what it stands for"
            faults.append(Fault("--column", shown(pair), words))
        elif old in new_names:
            faults.append(Fault("--column", shown(pair), f"names {shown(old)} a second time"))
        else:
            new_names[old] = new.strip()
    refuse(faults)
    return new_names


def _write(fit: Fit, save: Path, base: Mission | None) -> None:
    """Write the fitted values as a mission, once it is seen to load."""
    from optuav.mission.files import write_text
    from optuav.mission.load import must_load

    text = fit.to_toml(file=save)
    try:
        must_load(text, save)
    except InputError as error:
        name = shown(fit.extends)
        of_both = f"values from {', '.join(fit.sources)} on top of {name}"
        faults = [replace(fault, source=of_both) for fault in error.faults]
        words = "a mission on which these values load; nothing is written"
        model = fit.settings.get("flight.model")
        if base is not None and model not in (None, base.flight.model):
            new = f"as optuav new FILE --from {model} writes"
            words = f"a mission with flight.model = {shown(model)}, {new}; nothing is written"
        raise InputError([*faults, Fault("extends", name, words)]) from None
    write_text(save, text)


def _draw(fit: Fit, directory: Path) -> list[Path]:
    """Draw the fit, and what was read of every flight log."""
    from optuav import plots

    pictures = [("fit.png", plots.fit(fit)[0].values)]
    for number, log in enumerate(fit.logs, start=1):
        name = f"log-{number}.png" if len(fit.logs) > 1 else "log.png"
        pictures.append((name, plots.flight_log(log)[0]))
    return plots.files.save_everywhere(pictures, directory)


def _hover(fit: Fit, mission: Mission) -> dict[str, float] | str | None:
    """Longest hover of a mission with the values, and its least and largest at the edge [s].

    Without a plan, why; without one at the edge, no interval; None without values.
    """
    from optuav.solving import solve

    def hovers(changes: Mapping[str, object]) -> float:
        return solve(mission.replace(changes)).hover_time_s

    if not fit.changes:
        return None
    try:
        hover_s = {"value": hovers(fit.changes)}
    except (InputError, NoPlanError, SolverError) as error:
        return str(error)
    with suppress(InputError, NoPlanError, SolverError):
        if ends_s := [hovers(changes) for changes in fit.edge]:
            hover_s |= {"low": min(ends_s), "high": max(ends_s)}
    return hover_s


def _hover_in_words(extends: str | None, hover: dict[str, float] | str | None) -> Iterator[str]:
    """Yield how long a mission hovers with the values, or why it has no plan."""
    if isinstance(hover, str):
        yield f"{extends} with these values: {hover}"
    elif hover:
        value, *ends = (fixed(time_s, 1) for time_s in hover.values())
        between = f", 95 % between {' and '.join(ends)} s" if ends else ""
        yield f"{extends} hovers {value} s with these values{between}"
