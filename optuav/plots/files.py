"""Pictures as files; the same plan gives the same bytes."""

from __future__ import annotations

import io
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from optuav import plots
from optuav.calibration.fit import Fit
from optuav.errors import Fault, InputError
from optuav.mission import Mission
from optuav.mission.files import make_directory, write_bytes
from optuav.mission.messages import shown
from optuav.plan import Phase, Plan

if TYPE_CHECKING:
    from matplotlib.animation import FuncAnimation
    from matplotlib.figure import Figure

    from optuav.plots.profiles import Replayed


def save_pictures(plan: Plan, directory: str | Path, beside: Sequence[Plan] = ()) -> list[Path]:
    """Write the pictures of a plan as PNG files.

    ``map.png``; ``battery.png``, or ``packs.png`` where packs take turns; ``wells.png`` if there
    are plans to compare it with; and ``leg.png`` of the first leg that the flight model describes;
    the map alone where there is no plan. The same plan gives the same bytes.

    Parameters
    ----------
    plan
        Any plan.
    directory
        Where to write; made if it is missing. Files of these names are replaced.
    beside
        Plans that exist whose wells are drawn below those of the plan.

    Returns
    -------
    The files that were written.

    Raises
    ------
    InputError
        If matplotlib is missing, or the directory cannot be made or written to. Every file is
        written whole or not at all.

    Examples
    --------
    >>> import optuav, tempfile
    >>> late = optuav.load("paper").replace({"limits.deadline_s": 10.0})
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     [path.name for path in optuav.plots.save_pictures(optuav.solve(late), folder)]
    ['map.png']
    """
    return save_figures(_figures(plan, beside), Path(directory))


def save_map(mission: Mission, directory: str | Path) -> list[Path]:
    """Write the map of a mission as ``map.png``; arguments and errors are those of `save_pictures`.

    Examples
    --------
    >>> import optuav, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     [path.name for path in optuav.plots.save_map(optuav.load("paper"), folder)]
    ['map.png']
    """
    drawn = plots.mission_map(mission).plan.get_figure(root=True)
    return save_figures([("map.png", drawn)], Path(directory))


def save_profile(replayed: Replayed, path: str | Path) -> Path:
    """Write altitude, speed and power over a simulated plan as a PNG file.

    Parameters
    ----------
    replayed
        From `optuav.replay`.
    path
        The file; what is there is replaced, whole or not at all.

    Raises
    ------
    InputError
        If matplotlib is missing, or the file cannot be written.
    NoPlanError
        If nothing is flown.

    Examples
    --------
    >>> import optuav, pathlib, tempfile
    >>> replayed = optuav.replay(optuav.solve("paper", "P3"))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     optuav.plots.save_profile(replayed, pathlib.Path(folder, "profile.png")).name
    'profile.png'
    """
    write_bytes(Path(path), png(plots.profile(replayed).power.get_figure(root=True)))
    return Path(path)


def save_animation(replayed: Replayed, path: str | Path) -> Path:
    """Write a simulated plan in motion as a GIF of some seconds.

    Arguments and errors are those of `save_profile`; the name of the file ends in ``.gif``.

    Examples
    --------
    >>> import optuav
    >>> replayed = optuav.replay(optuav.solve("paper", "P3"))
    >>> optuav.plots.save_animation(replayed, "mission.mp4")
    Traceback (most recent call last):
    ...
    optuav.errors.InputError: animation = 'mission.mp4': a name that ends in .gif
    """
    file = gif_file(path)
    write_bytes(file, gif(plots.animate(replayed)))
    return file


def gif_file(path: str | Path) -> Path:
    """The file of an animation.

    Raises
    ------
    InputError
        If its name does not end in ``.gif``.
    """
    file = Path(path)
    if file.suffix.lower() != ".gif":
        raise InputError([Fault("animation", shown(str(file)), "a name that ends in .gif")])
    return file


def save_fit(found: Fit, directory: str | Path) -> list[Path]:
    """Write the picture of a calibration as ``fit.png``, if it rests on observations.

    Arguments and errors are those of `save_pictures`.

    Examples
    --------
    >>> import optuav, tempfile
    >>> stated = optuav.Fit("rotor", ("propeller.csv",), "a data sheet", (), ())
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     optuav.plots.save_fit(stated, folder)
    []
    """
    if not found.panels:
        return []
    drawn = plots.fit(found)[0].values.get_figure(root=True)
    return save_figures([("fit.png", drawn)], Path(directory))


def save_figures(figures: Iterable[tuple[str, Figure | None]], folder: Path) -> list[Path]:
    """Write figures under the given names, all drawn before the first is written."""
    make_directory(folder)
    pictures = {name: png(figure) for name, figure in figures}
    for name, content in pictures.items():
        write_bytes(folder / name, content)
    return [folder / name for name in pictures]


def _figures(plan: Plan, beside: Sequence[Plan]) -> Iterator[tuple[str, Figure | None]]:
    yield "map.png", plots.mission_map(plan).plan.get_figure(root=True)
    if plan and plan.mission.battery.takes_turns:
        yield "packs.png", plots.packs([plan])[0].get_figure(root=True)
    elif plan:
        yield "battery.png", plots.battery(plan).wells.get_figure(root=True)
    if plan and beside:
        yield "wells.png", plots.wells([plan, *beside])[0].get_figure(root=True)
    first = modelled_leg(plan)
    if first is not None:
        drawn = plots.leg(plan.mission, first.start_place, first.end_place)
        yield "leg.png", drawn.speed.get_figure(root=True)


def modelled_leg(plan: Plan) -> Phase | None:
    """The first leg that takes time and has its figures from the flight model, if there is one."""
    legs = (each for each in plan.phases if each.kind == "flight")
    return next((each for each in legs if each.duration_s > 0.0 and not each.edited), None)


def png(figure: Figure | None) -> bytes:
    """A figure as PNG; the same figure gives the same bytes."""
    return _file(figure, "png", {"Software": None})


def svg(figure: Figure | None) -> bytes:
    """A figure as SVG; the same figure gives the same bytes."""
    return _file(figure, "svg", {"Date": None, "Creator": None})


def _file(figure: Figure | None, form: str, metadata: dict[str, None]) -> bytes:
    """A file without the version of matplotlib and the date, which it has by default."""
    from optuav.plots import style

    assert figure is not None
    content = io.BytesIO()
    figure.set_layout_engine("none")  # the picture is laid out already
    with style.applied():
        figure.savefig(content, format=form, dpi=figure.dpi, metadata=metadata)
    return content.getvalue()


def gif(moving: FuncAnimation) -> bytes:
    """An animation as GIF; the same animation gives the same bytes."""
    from optuav.plots import style
    from optuav.plots.animation import FRAMES_PER_S, GifWriter

    writer = GifWriter(fps=FRAMES_PER_S)
    with style.applied():
        moving.save("moving.gif", writer)  # the writer keeps it in memory
    return writer.content
