"""`reproduce`: all studies, computed first and then written."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from optuav.errors import Fault, InputError
from optuav.mission import Mission, load
from optuav.mission.files import make_directory, write_bytes
from optuav.mission.messages import nearest
from optuav.paper.ledger import Ledger, ledger
from optuav.paper.reproduce.battery_size import battery_size
from optuav.paper.reproduce.charging import charging
from optuav.paper.reproduce.direct_path import direct_path
from optuav.paper.reproduce.document import markdown, page
from optuav.paper.reproduce.exhibit import Exhibit, LeftOut, Study
from optuav.paper.reproduce.least_charge import least_charge
from optuav.paper.reproduce.misprints import misprints
from optuav.paper.reproduce.more_stops import more_stops
from optuav.paper.reproduce.omissions import overcharges, peak_speed, runs_dry, second_problem
from optuav.paper.reproduce.perspectives import by_perspective
from optuav.paper.reproduce.report import blocks, title
from optuav.paper.reproduce.system import system
from optuav.paper.reproduce.wells import wells
from optuav.paper.reproduce.wind import wind
from optuav.plots.files import png, svg
from optuav.studies.results import as_csv

Progress = Callable[[int, int, str], None]

STUDIES = (
    Study("system", "System and trajectories", system),
    Study("wells", "The wells of the battery", wells),
    Study("direct-path", "Table II: the direct path", direct_path),
    Study("perspectives", "Perspectives and trajectories", by_perspective),
    Study("least-charge", "Hover time and the charge that must be left", least_charge),
    Study("battery-size", "Hover time and battery size", battery_size),
    Study("wind", "Hover against wind", wind),
    Study("charging", "Charging from afar", charging),
    Study("runs-dry", "Left out: whether the available well lasts", runs_dry),
    Study("overcharges", "Left out: whether resting first overcharges", overcharges),
    Study("second-problem", "Left out: (P2) as printed", second_problem),
    Study("more-stops", "Left out: more than one rest or hover", more_stops),
    Study("peak-speed", "Left out: no drag, no largest speed", peak_speed),
    Study("misprints", "Left out: misprints", misprints),
)
LEDGER = "ledger"
NAMES = (*(study.name for study in STUDIES), LEDGER)


def reproduce(
    directory: str | Path = "reproduced",
    *,
    only: Sequence[str] = (),
    mission: Mission | str | Path | None = None,
    progress: Progress | None = None,
) -> list[Path]:
    """Make every table and figure of the paper anew, and write a report.

    Parameters
    ----------
    directory
        Where to write: ``report.html``, which needs no other file, and ``report.md``; ``figures/``
        with PNG and SVG, ``data/`` with CSV. Made if it is missing; files of these names are
        replaced, once all is computed. The same call writes the same bytes.
    only
        Names of studies; all by default. ``"ledger"`` is the ledger of the paper's numbers, which
        a mission of your own has not.
    mission
        A mission of your own to make the studies for, without the ledger; the paper's two missions
        by default.
    progress
        Called with the number of steps done, of all, and the name of the next.

    Returns
    -------
    The files that were written.

    Raises
    ------
    InputError
        If there is no such study of such a mission, matplotlib is missing, or the directory cannot
        be made or written to. Every file is written whole or not at all.
    """
    missions = _missions(mission)
    chosen = _chosen(only, own=mission is not None)
    with_ledger = mission is None and (not only or LEDGER in only)
    files = _made(Path(directory), lambda: dict(_files(missions, chosen, with_ledger, progress)))
    for name in ("figures", "data"):
        make_directory(Path(directory) / name)
    for name, content in files.items():
        write_bytes(Path(directory) / name, content)
    return [Path(directory) / name for name in files]


def _made(directory: Path, files: Callable[[], dict[str, bytes]]) -> dict[str, bytes]:
    """Files for a directory that is made first, and taken away again where they fail."""
    new = not directory.exists()
    make_directory(directory)
    try:
        return files()
    except BaseException:
        if new:
            directory.rmdir()
        raise


def _missions(mission: Mission | str | Path | None) -> tuple[Mission, ...]:
    if mission is None:
        return load("paper"), load("paper-table2")
    return (mission if isinstance(mission, Mission) else load(mission),)


def _chosen(only: Sequence[str], *, own: bool) -> tuple[Study, ...]:
    known = tuple(study.name for study in STUDIES) if own else NAMES
    faults = [
        Fault(
            "only", repr(name), "the ledger is of the paper's two missions, and goes with no other"
        )
        if name == LEDGER and own
        else Fault("only", repr(name), f"one of {', '.join(known)}{nearest(name, known)}")
        for name in only
        if name not in known
    ]
    if faults:
        raise InputError(faults)
    return tuple(study for study in STUDIES if not only or study.name in only)


def _files(
    missions: Sequence[Mission],
    chosen: Sequence[Study],
    with_ledger: bool,
    progress: Progress | None,
) -> Iterator[tuple[str, bytes]]:
    """Every file by its name in the directory."""
    made: dict[Study, list[Exhibit]] = {}
    left_out: list[tuple[Study, Mission, LeftOut]] = []
    pictures: dict[str, bytes] = {}
    steps = len(chosen) * len(missions) + 1
    for number, study in enumerate(chosen):
        made[study] = []
        for place, mission in enumerate(missions):
            if progress is not None:
                progress(number * len(missions) + place, steps, f"{study.name} of {mission.name}")
            for exhibit in study.make(mission):
                if isinstance(exhibit, LeftOut):
                    left_out.append((study, mission, exhibit))
                    continue
                made[study].append(exhibit)
                figure = exhibit.axes.get_figure(root=True)
                assert figure is not None
                pictures[exhibit.name] = png(figure)
                yield f"figures/{exhibit.name}.png", pictures[exhibit.name]
                yield f"figures/{exhibit.name}.svg", svg(figure)
                yield f"data/{exhibit.name}.csv", as_csv(exhibit.records).encode()
    entries: Ledger | None = None
    if with_ledger:
        if progress is not None:
            progress(steps - 1, steps, LEDGER)
        entries = ledger()
        yield "data/ledger.csv", entries.to_csv().encode()
    report = list(blocks(missions, made, left_out, entries))
    yield "report.md", markdown(report).encode()
    yield "report.html", page(title(missions, entries), report, pictures).encode()
