"""`reproduce`: the studies of the paper as files, with one report of them and of the ledger.

The report is a tree of elements: text is escaped when it is written as HTML and as Markdown, so
that a name that looks like either is shown as a name.
"""

import base64
import re
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from urllib.parse import quote
from xml.etree.ElementTree import Element, tostring

from formulations.soc import AVAILABLE
from optuav.errors import Fault, refuse, shown
from optuav.mission import Mission, load
from optuav.mission.files import check_place, make_directory, write_files
from optuav.mission.messages import misfits, nearest, path_of, several
from optuav.options import Perspective
from optuav.paper import figures, table2
from optuav.paper.curves import DATA, PAPERS, solve
from optuav.paper.figures import Exhibit, NotShownError, is_papers, why
from optuav.paper.ledger import HEAD, Ledger, Verdict, ledger
from optuav.plots.files import image
from optuav.presentation.markup import element
from optuav.presentation.numbers import minus
from optuav.studies.compare_methods import Progress
from optuav.studies.processes import WORKERS, run_tasks
from optuav.studies.results import as_csv

COUNTED: tuple[Perspective, ...] = ("battery", AVAILABLE)
"""Perspectives of the figures that the paper makes in one."""
LEDGER = "ledger"
MARKS = re.compile(r"[\\`*_\[\]<$|&~]|:(?=//)|(?<=www)\.|^\s*(?:[>#+=-]|\d+[.)])")
"""Characters with a meaning in Markdown."""


@dataclass(frozen=True, eq=False)
class PaperStudy:
    """A figure or table of the paper for a mission, or something that the paper leaves out.

    `make` yields the exhibits of a mission with all that the study `needs`; where it is `counted`,
    it takes a perspective of `COUNTED` as well. `place` and `numbers` refer to the paper.
    """

    name: str
    title: str
    make: Callable[..., Iterator[Exhibit]]
    place: str = ""
    numbers: Sequence[str] = ()
    counted: bool = False
    needs: Sequence[str] = ()

    def heading(self, *, of_paper: bool) -> str:
        """Its title, with its place in the paper if it is made for the paper's missions."""
        return f"{self.place}: {self.title}" if of_paper and self.place else self.title

    def exhibits(self, mission: Mission) -> Iterator[Exhibit | tuple[str, str]]:
        """Its exhibits, or the parts left out with the reason; an empty part means all."""
        has = {
            "laser": mission.laser,
            "rotors": mission.flight.model == "rotors",
            "buildings": mission.buildings,
            "paper": is_papers(mission),
        }
        for options in [(option,) for option in COUNTED] if self.counted else [()]:
            has["turns"] = options == ("battery",) or mission.battery.schedule == "pooled"
            try:
                for need in self.needs:
                    if not has[need]:
                        raise NotShownError(DATA["lacking"][need])
                yield from self.make(mission, *options)
            except NotShownError as reason:
                yield ", ".join(f"perspective {option}" for option in options), str(reason)


STUDIES = tuple(
    PaperStudy(name, **{**texts, "make": getattr(figures, texts["make"])})
    for name, texts in DATA["study"].items()
)
NAMES = (*(study.name for study in STUDIES), LEDGER)
NUMBERS = sorted((n for study in STUDIES for n in study.numbers), key=lambda n: (len(n), n))


def reproduce(
    directory: str | Path = "reproduced",
    *,
    only: str | Sequence[str] = (),
    mission: Mission | str | Path | None = None,
    progress: Progress | None = None,
    workers: int = 1,
) -> list[Path]:
    """Reproduce every table and figure of the paper, and write a report.

    Parameters
    ----------
    directory
        Where to write: ``report.html``, which needs no other file, and ``report.md``; ``figures/``
        with PNG and SVG, ``data/`` with CSV. Made if it is missing; files of these names are
        replaced, once all is computed. The same call writes the same bytes.
    only
        Name of a study, or several; or numbers of the paper such as ``"fig5"`` and ``"table2"``;
        all by default. ``"ledger"`` is the ledger of the paper's numbers.
    mission
        A mission of your own for the studies, without the ledger; the paper's two missions by
        default.
    progress
        Callback for progress: receives the number of steps done, their total, and the name of the
        next one.
    workers
        Number of processes that share the work, 1 to 1000; the files are the same. Several
        processes import the main module again, which must call `reproduce` only if it is run as a
        script.

    Returns
    -------
    list of Path
        The files that were written.

    Raises
    ------
    InputError
        If a study does not exist for the mission, matplotlib is missing, or the directory cannot be
        made or written to. Every file is written whole or not at all.

    Examples
    --------
    >>> import optuav
    >>> optuav.reproduce("out", only=["fig99"])  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    optuav.errors.InputError: only = 'fig99': must be one of wells, system, ...
    """
    loaded = None if mission is None else load(mission)
    choices = (*NAMES, *NUMBERS) if loaded is None else (*NAMES[:-1], *NUMBERS)
    only = several("only", only, str, "the name of a study, or several", 0)
    wrong = [
        Fault(
            "only",
            shown(name),
            "cannot be the ledger, which belongs to the paper's two missions",
        )
        if name == LEDGER
        else Fault("only", shown(name), f"one of {', '.join(choices)}{nearest(name, choices)}")
        for name in only
        if name not in choices
    ]
    refuse([*wrong, *misfits(("workers", workers, WORKERS))])
    folder, files = path_of(directory, "directory"), _files(loaded, only, progress, workers)
    made = {folder / name: content for name, content in files}
    for path, content in made.items():
        if path.parent.is_dir():
            check_place(path, content)  # before directories are made
    for parent in dict.fromkeys(path.parent for path in made):
        make_directory(parent)
    write_files(made)
    return list(made)


def _files(
    own: Mission | None, only: Sequence[str], progress: Progress | None, workers: int
) -> Iterator[tuple[str, bytes]]:
    """Every file by its name in the directory, the report last, with its contents on top."""
    missions = PAPERS if own is None else (own,)
    chosen = [study for study in STUDIES if not only or {study.name, *study.numbers} & {*only}]
    shown = defaultdict[PaperStudy, list[Element]](list)
    left_out = defaultdict[tuple[str, str], list[str]](list)
    steps = [(study, mission) for study in chosen for mission in missions]
    made = run_tasks(_made, [(*step, only) for step in steps], workers)
    tell = progress or (lambda *_: None)
    for done, (study, mission) in enumerate(steps):
        tell(done, len(steps) + 1, f"{study.name} of {mission.name}")
        contents, elements, lacking = next(made)
        yield from contents.items()
        shown[study] += elements
        for part, reason in lacking:
            what = f"{study.heading(of_paper=is_papers(mission))}{part and f', {part}'}"
            left_out[mission.name, reason].append(what)
    numbers = list[Element]()
    if own is None and (not only or LEDGER in only):
        tell(len(steps), len(steps) + 1, LEDGER)
        entries = ledger()
        yield "data/ledger.csv", entries.to_csv().encode()
        numbers = [*_of_the_paper(entries)]
    all_papers = all(map(is_papers, missions))
    sections = numbers[:-1]
    for study, parts in shown.items():
        if parts:
            sections.append(_section(study.name, study.heading(of_paper=all_papers), *parts))
    if left_out:
        why_not = (f"{n}: {'; '.join(what)}. Why: {why}." for (n, why), what in left_out.items())
        sections.append(_section("not-shown", "Not shown", listing(why_not)))
    sections += numbers[-1:]
    names, paper = [mission.name for mission in missions], DATA["paper"]["citation"]
    title = "The paper, reproduced" if numbers else f"The paper's studies for {', '.join(names)}"
    intro = [f"Computed by optuav from {' and '.join(names)}. The paper: {paper}."]
    plans = zip(names, map(solve, missions), strict=True)
    intro += [f"{name} has no plan: {why(plan)}." for name, plan in plans if not plan]
    links = (element("a", s[0].text or "", href=f"#{s.get('id')}") for s in sections)
    head = (element("h1", title), *(element("p", words) for words in intro))
    body = element("body", *head, element("nav", listing(links)), *sections)
    yield "report.md", markdown(body).encode()
    yield "report.html", _page(body).encode()


def _made(
    study: PaperStudy, mission: Mission, only: Sequence[str]
) -> tuple[dict[str, bytes], list[Element], list[tuple[str, str]]]:
    """Files of a study of a mission, its part of the report, and omissions with reasons."""
    contents: dict[str, bytes] = {}
    elements, left_out = list[Element](), list[tuple[str, str]]()
    for exhibit in study.exhibits(mission):
        if isinstance(exhibit, tuple):
            left_out.append(exhibit)
        elif not only or {*only}.intersection([study.name, *exhibit.numbers]):
            axes, names = exhibit.axes, [f"figures/{exhibit.name}.{end}" for end in ("png", "svg")]
            pictures = {name: image(axes, Path(name)) for name in names} if axes else {}
            table_file = {f"data/{exhibit.name}.csv": as_csv(exhibit.records).encode()}
            contents |= pictures | table_file
            elements += _figure(exhibit, pictures)
    return contents, elements, left_out


def _page(body: Element) -> str:
    """The report as one HTML page."""
    head = (
        element("meta", charset="utf-8"),
        element("meta", name="generator", content="optuav"),
        element("meta", name="viewport", content="width=device-width, initial-scale=1"),
        element("title", body[0].text or ""),
        element("style", files("optuav.paper").joinpath("report.css").read_text("utf-8")),
    )
    page = element("html", element("head", *head), body, lang="en")
    for node in page.iter():
        if node.tag in ("p", "ul", "li", "tr", "figure", "section", "nav", "h1", "h2", "details"):
            node.tail = "\n"
    return f"<!DOCTYPE html>\n{tostring(page, encoding='unicode', method='html')}\n"


def markdown(body: Element) -> str:
    """The report as Markdown, with its pictures and data in files beside it."""
    return "\n\n".join(_blocks(body)) + "\n"


def _blocks(parent: Element) -> Iterator[str]:
    """Blocks of Markdown; a picture is the first file that its caption leads to."""
    for block in parent:
        image, caption = block.find("div/img"), block.find("figcaption/a")
        if image is not None and caption is not None:
            yield f"![{_plain(image.get('alt', ''))}]({caption.get('href')})"
        if block.tag in ("h1", "h2"):
            yield f"{'#' * int(block.tag[1])} {_inline(block)}"
        elif block.tag in ("p", "figcaption"):
            yield _inline(block)
        elif block.tag == "ul":
            yield "\n".join(f"- {_inline(item)}" for item in block)
        elif block.tag == "table":
            head, *body = ([_inline(cell) for cell in row] for row in block)
            yield "\n".join(f"| {' | '.join(row)} |" for row in [head, ["---"] * len(head), *body])
        elif block.tag not in ("nav", "summary"):
            yield from _blocks(block)


def _inline(parent: Element) -> str:
    """The texts, code and links of an element."""
    parts = [_plain(parent.text or "")]
    for inline in parent:
        text = inline.text or ""
        link = f"[{_plain(text)}]({inline.get('href')})"
        parts += [f"`{text}`" if inline.tag == "code" else link, _plain(inline.tail or "")]
    return "".join(parts)


def _plain(text: str) -> str:
    """Text on one line, what Markdown would read as its own escaped."""
    return MARKS.sub(lambda found: f"{found[0][:-1]}\\{found[0][-1]}", " ".join(text.splitlines()))


def _section(anchor: str, title: str, *content: Element) -> Element:
    """A section that the contents lead to."""
    return element("section", element("h2", title), *content, id=anchor)


def _figure(exhibit: Exhibit, pictures: Mapping[str, bytes]) -> Iterator[Element]:
    """A picture, or a table, with its caption, links to its files, and its findings."""
    names, links = [*pictures, f"data/{exhibit.name}.csv"], list[str | Element]()
    for name in names:
        links += (" ", element("a", name.rpartition(".")[2].upper(), href=quote(name)))
    if pictures:
        encoded = base64.b64encode(pictures[names[0]]).decode("ascii")
        source = f"data:image/png;base64,{encoded}"
        shown = element("div", element("img", alt=exhibit.caption, src=source), class_="wide")
    else:
        shown = table(exhibit.rows)
    yield element("figure", shown, element("figcaption", f"{exhibit.caption}.", *links))
    if exhibit.findings:
        yield listing(exhibit.findings)


def _of_the_paper(entries: Ledger) -> Iterator[Element]:
    """Return the ledger's verdicts in short, the fit of Table II, and all statements, folded."""
    counts = [(verdict.value, str(count)) for verdict, count in entries.counts.items()]
    rows = [("verdict", "statements of the paper"), *counts, ("all", str(len(entries.entries)))]
    yield _section("in-short", "In short", prose(DATA["paper"]["missions"]), table(rows))
    texts, cells = DATA["table2"], entries.table2
    verdicts = Counter(cell.verdict for cell in cells)
    count = {verdict.name.lower(): verdicts[verdict] for verdict in Verdict}
    exact = count["fitted"] + count["recovered"]
    numbers = {
        **count,
        **{"cells": len(cells), "exact": exact, "agreeing": exact + count["within"]},
        "parameters": len(texts["free_parameters"]),
        "exists": "is a" if table2.loads_exist(table2.CONSISTENT) else "is no",
    }
    agreement, worth, *others = (
        prose(texts[name].format(**texts, **numbers))
        for name in ("agreement", "worth", "adjusted", "existence")
    )
    parameters = f"Free parameters: {'; '.join(texts['free_parameters'])}."
    listed = listing((parameters, f"Data: {'; '.join(texts['data'])}."))
    wrong = [["cell", "printed", "by paper-table2", "why it cannot be matched"]]
    for cell in cells:
        if cell.verdict is Verdict.CONTRADICTS:
            paper, values = cell.statement, (cell.statement.stated, cell.figure(cell.recovered))
            shown = (minus(f"{value}\N{NO-BREAK SPACE}%") for value in values)
            wrong.append([f"{paper.place}, {paper.what}", *shown, cell.reason])
    content = (agreement, worth, listed, *others, table(wrong, cards=True))
    yield _section("fit", "Table II and the fit behind it", *content)
    keys = (*HEAD[1:], "by printed parameters", "by recovered parameters", "verdict", "reason")
    records = [keys, *([record[key] for key in keys] for record in entries.records())]
    summary = element("summary", f"All {len(entries.entries)} statements")
    folded = element("details", summary, table(records, cards=True))
    not_counted = prose(f"Not counted: {'; '.join(DATA['paper']['not_counted'])}.")
    content = (prose(DATA["paper"]["ledger"]), not_counted, folded)
    yield _section(LEDGER, "The ledger", *content)


def prose(text: str, tag: str = "p", **attributes: str) -> Element:
    """A paragraph of our own words, with code between backquotes."""
    parts = (element("code", e) if n % 2 else e for n, e in enumerate(text.split("`")))
    return element(tag, *parts, **attributes)


def listing(items: Iterable[str | Element]) -> Element:
    """Short texts, one per line."""
    return element("ul", *(element("li", item) for item in items))


def table(rows: Sequence[Sequence[str]], *, cards: bool = False) -> Element:
    """A table whose first row has the headings; as cards, a row of our words is a block."""
    head, *body = rows
    written = prose if cards else lambda cell, tag, **named: element(tag, cell, **named)
    lines = [element("tr", *(element("th", cell) for cell in head))]
    for row in body:
        cells = zip(head, row, strict=True)
        lines.append(element("tr", *(written(cell, "td", data_head=name) for name, cell in cells)))
    shown = element("table", *lines, class_="cards" if cards else "plain")
    return element("div", shown, class_="wide")
