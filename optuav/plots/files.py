"""Pictures as files; the same plan gives the same bytes."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from matplotlib.axes import Axes

from optuav.mission import Mission
from optuav.mission.files import ending_of, make_directory, write_files
from optuav.plan import Phase, Plan
from optuav.plots import style
from optuav.plots.charge import packs, wells
from optuav.plots.map import mission_map
from optuav.plots.profiles import leg

FORMATS: Mapping[str, Mapping[str, str | None] | None] = {
    ".png": {"Software": "optuav"},
    ".svg": {"Creator": "optuav", "Date": None},
    ".pdf": {"Creator": "optuav", "Producer": None, "CreationDate": None},
    **dict.fromkeys((".jpg", ".jpeg", ".tif", ".tiff", ".webp")),
}
"""What a file says of its origin, by suffix: of the formats that matplotlib writes, those that need
no other program, can show transparent colours, and hold no date."""


def save_pictures(
    subject: Plan | Mission, directory: str | Path, beside: Sequence[Plan] = ()
) -> list[Path]:
    """Write the pictures of a plan as PNG files.

    ``map.png``; ``wells.png``, or ``packs.png`` where packs take turns; and ``leg.png`` of the
    first leg that the flight model describes; the map alone where there is no plan. The same plan
    gives the same bytes.

    Parameters
    ----------
    subject
        A plan, or a mission, which has a map only.
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
    drawn = {"map.png": mission_map(subject).plan}
    if isinstance(subject, Plan) and subject:
        if subject.mission.battery.takes_turns:
            drawn["packs.png"] = packs([subject])[0]
        else:
            drawn["wells.png"] = wells([subject, *beside])[0]
        if first := modelled_leg(subject):
            axes = leg(subject.mission, first.start_place, first.end_place)
            drawn["leg.png"] = axes.speed
    return save_figures(drawn.items(), Path(directory))


def modelled_leg(plan: Plan) -> Phase | None:
    """The first leg that takes time and has its figures from the flight model, if there is one."""
    legs = (each for each in plan.phases if each.kind == "flight")
    return next((each for each in legs if each.duration_s > 0.0 and not each.edited), None)


def save(drawn: Axes | Sequence[Axes | None], path: str | Path) -> Path:
    """Write the figure of axes as a file; the same figure gives the same bytes.

    Parameters
    ----------
    drawn
        Axes as the functions of `optuav.plots` return them.
    path
        The file, in the format of its suffix: .png, .svg, .pdf, .jpg, .jpeg, .tif, .tiff or .webp.
        What is there is replaced, whole or not at all.

    Returns
    -------
    The file that was written.

    Raises
    ------
    InputError
        If the file cannot be written or has another suffix.

    Examples
    --------
    >>> import optuav, pathlib, tempfile
    >>> drawn = optuav.plots.mission_map(optuav.load("paper"))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     optuav.plots.save(drawn, pathlib.Path(folder, "map.png")).name
    'map.png'
    """
    ax = drawn if isinstance(drawn, Axes) else drawn[0]
    assert ax is not None
    write_files({Path(path): image(ax, Path(path))})
    return Path(path)


def save_figures(drawn: Iterable[tuple[str, Axes]], folder: Path) -> list[Path]:
    """Write the figures of axes under the given names, all drawn before the first is written.

    Parameters
    ----------
    drawn
        Names of files, each with axes whose figure it is to hold; the suffix is its format.
    folder
        Where they go; it is made if there is none.

    Returns
    -------
    The files that were written, in the order given.

    Raises
    ------
    InputError
        If a suffix is no format of pictures, or a file cannot be written; then none is.

    Examples
    --------
    >>> import optuav, pathlib, tempfile
    >>> drawn = optuav.plots.mission_map(optuav.load("paper"))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     files = optuav.plots.save_figures([("map.svg", drawn.plan)], pathlib.Path(folder))
    >>> [file.name for file in files]
    ['map.svg']
    """
    pictures = {folder / name: image(ax, folder / name) for name, ax in drawn}
    make_directory(folder)
    write_files(pictures)
    return list(pictures)


def image(ax: Axes, path: Path) -> bytes:
    """The figure of axes as the content of a file, in the format of its suffix."""
    suffix = ending_of(path, *FORMATS)
    return style.written(style.root(ax), format=suffix[1:], metadata=FORMATS[suffix])
