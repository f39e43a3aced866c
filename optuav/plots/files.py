"""Pictures as files; the same plan gives the same bytes."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes

from optuav.errors import Fault, InputError
from optuav.mission import Mission
from optuav.mission.files import ending_of, make_directory, write_files
from optuav.mission.messages import of_kind, path_of, shown
from optuav.plan import Phase, Plan, Plans, load_plans, load_subject
from optuav.plan.pictures import PICTURES
from optuav.plots import style
from optuav.plots.charge import packs, wells
from optuav.plots.map import mission_map
from optuav.plots.profiles import leg

AXES = "axes as a function of optuav.plots returns them"
UNSEEN_S = 0.01  # Difference of two stays that no picture shows
FORMATS: Mapping[str, Mapping[str, str | None] | None] = {
    ".png": {"Software": "optuav"},
    ".svg": {"Creator": "optuav", "Date": None},
    ".pdf": {"Creator": "optuav", "Producer": None, "CreationDate": None},
    **dict.fromkeys((".jpg", ".jpeg", ".tif", ".tiff", ".webp")),
}
"""Origin stated in a file, by suffix: matplotlib's formats that need
no other program, can show transparent colours, and hold no date."""
SEVERAL = (".png", ".svg", ".pdf")  # Formats for screens, for pages and editors, and for print


def save_pictures(
    subject: Plan | Mission | str | Path, directory: str | Path, beside: Plans = ()
) -> list[Path]:
    """Write the pictures of a plan as PNG, SVG and PDF; the same plan gives the same bytes.

    ``map.png``, ``map.svg`` and ``map.pdf``; in the same formats ``wells``, or ``packs`` where
    packs take turns; ``leg`` of the first leg that the flight model describes; and pictures of your
    own, see `optuav.register`. Only the map without a plan.

    Parameters
    ----------
    subject
        A plan, or a mission, which has a map only; also by its name or path.
    directory
        Where to write; made if it is missing. Files of these names are replaced.
    beside
        Plans whose wells are drawn below the plan's, unless they are flown alike, or their files.

    Returns
    -------
    The files.

    Raises
    ------
    InputError
        If the directory cannot be made or written to, or a picture of your own returns no axes;
        every file is written whole or not at all.

    Examples
    --------
    >>> import optuav, tempfile
    >>> late = optuav.load("paper").replace({"limits.deadline_s": 10.0})
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     [path.name for path in optuav.plots.save_pictures(optuav.solve(late), folder)]
    ['map.png', 'map.svg', 'map.pdf']
    """
    subject, others = load_subject(subject), load_plans(beside, "beside", 0)
    drawn = {"map": mission_map(subject).plan}
    if isinstance(subject, Plan) and subject:
        if subject.mission.battery.takes_turns:
            drawn["packs"] = packs([subject])[0]
        else:
            more = [other for other in others if not _alike(subject, other)]
            drawn["wells"] = wells([subject, *more])[0]
        if first := modelled_leg(subject):
            drawn["leg"] = leg(subject.mission, first.start_place, first.end_place).speed
        for name, picture in PICTURES.items():
            drawn[name] = of_kind(name, _axes(picture(subject)), Axes, AXES)
    return save_everywhere(drawn.items(), directory)


def save_everywhere(drawn: Iterable[tuple[str, Axes]], directory: str | Path) -> list[Path]:
    """Write the figures of axes under names, of which endings are dropped, in several formats."""
    named = ((f"{Path(name).stem}{ending}", axes) for name, axes in drawn for ending in SEVERAL)
    return save_figures(named, directory)


def _alike(one: Plan, other: Plan) -> bool:
    """Return whether pictures of two plans would be the same."""
    stays = zip(one.stops, other.stops, strict=False)
    near = all(abs(a.duration_s - b.duration_s) < UNSEEN_S for a, b in stays)
    return near and (one.mission, one.route) == (other.mission, other.route)


def modelled_leg(plan: Plan) -> Phase | None:
    """The first leg that takes time and has its figures from the flight model, if there is one."""
    legs = (phase for phase in plan.phases if phase.kind == "flight")
    return next((leg for leg in legs if leg.duration_s > 0.0 and not leg.edited), None)


def save(drawn: Any, path: str | Path) -> Path:
    """Write the figure of axes as a file; the same figure gives the same bytes.

    Parameters
    ----------
    drawn
        Axes as the functions of `optuav.plots` return them, or a single named picture.
    path
        The file, in the format of its suffix: .png, .svg, .pdf, .jpg, .jpeg, .tif, .tiff or .webp.
        An existing file is replaced, whole or not at all.

    Returns
    -------
    The file.

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
    file = path_of(path)
    only = drawn[0][1] if isinstance(drawn, style.Pictures) and len(drawn) == 1 else drawn
    write_files({file: image(only, file)})
    return file


def save_figures(
    drawn: Mapping[str, Any] | Iterable[tuple[str, Any]], directory: str | Path
) -> list[Path]:
    """Write the figures of axes under the given names, all drawn before the first is written.

    Parameters
    ----------
    drawn
        Names of files, each with axes as `save` takes them; the suffix is its format.
    directory
        Where they go; it is made if missing.

    Returns
    -------
    The files, in the order given.

    Raises
    ------
    InputError
        If a suffix is not a format of pictures, or a file cannot be written; then none is.

    Examples
    --------
    >>> import optuav, tempfile
    >>> drawn = optuav.plots.mission_map("paper")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     [file.name for file in optuav.plots.save_figures({"map.svg": drawn}, folder)]
    ['map.svg']
    """
    directory = path_of(directory, "directory")
    named: Any = drawn.items() if isinstance(drawn, Mapping) else drawn
    pairs = [*named] if isinstance(named, Iterable) else [named]
    if not all(isinstance(e, tuple) and len(e) == 2 and isinstance(e[0], str) for e in pairs):
        words = "axes by name, as plots.swept returns them"
        raise InputError([Fault("drawn", shown(drawn), words)])
    pictures = {directory / name: image(axes, directory / name) for name, axes in pairs}
    make_directory(directory)
    write_files(pictures)
    return list(pictures)


def _axes(drawn: Any) -> Any:
    """The first axes of several."""
    while isinstance(drawn, tuple | list) and drawn:
        drawn = drawn[0]
    return drawn


def image(drawn: Any, path: Path) -> bytes:
    """The figure of axes as the content of a file, in the format of its suffix."""
    words = f"{AXES}; save_figures takes several pictures"
    ax, suffix = of_kind("drawn", _axes(drawn), Axes, words), ending_of(path, *FORMATS)
    return style.image(style.root(ax), format=suffix[1:], metadata=FORMATS[suffix])
