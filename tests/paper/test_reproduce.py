"""`optuav.reproduce`: the same bytes twice, a page without other files, and right figures."""

from __future__ import annotations

import csv
import html.parser
import io
import re
from html import escape
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import tostring

import numpy as np
import pytest
from markdown_it import MarkdownIt

matplotlib = pytest.importorskip("matplotlib")

import optuav  # noqa: E402
from optuav.errors import InputError  # noqa: E402
from optuav.paper import curves, figures  # noqa: E402
from optuav.paper.curves import solve  # noqa: E402
from optuav.paper.figures import Exhibit, grounded, number  # noqa: E402
from optuav.paper.report import NAMES, NUMBERS, STUDIES, element, listing, markdown, prose, table  # noqa: E402
from optuav.plots import style  # noqa: E402
from tests.cli.run import refused, run  # noqa: E402

QUICK = ("direct-path", "wind", "charging", "misprints")


def small(**values: Any) -> optuav.Mission:
    mission = optuav.load("paper")
    kept = [each.model_dump() for each in mission.buildings if each.name in ("b1", "b9")]
    return mission.replace({"buildings": kept, "name": "small"} | values)


def exhibits(study: str, mission: optuav.Mission | str) -> dict[str, Exhibit]:
    (found,) = (each for each in STUDIES if each.name == study)
    asked = mission if isinstance(mission, optuav.Mission) else optuav.load(mission)
    return {each.name: each for each in found.exhibits(asked) if isinstance(each, Exhibit)}


def left_out(study: str, mission: optuav.Mission) -> list[tuple[str, str]]:
    """Parts that are not shown, and why."""
    (found,) = (each for each in STUDIES if each.name == study)
    return [each for each in found.exhibits(mission) if not isinstance(each, Exhibit)]


def contents(folder: Path) -> dict[str, bytes]:
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
    }


class Sources(html.parser.HTMLParser):
    """What a page loads and says, where it leads, and which anchors it has."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []
        self.links: list[str] = []
        self.anchors: list[str] = []
        self.text = ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.text += "## " * (tag == "h2")
        self.anchors += [f"#{value}" for name, value in attrs if name == "id"]
        places = [value or "" for name, value in attrs if name in ("src", "href", "srcset")]
        (self.links if tag == "a" else self.found).extend(places)

    def handle_data(self, data: str) -> None:
        self.text += data


def report(folder: Path) -> str:
    """The words of the page in a folder, its headings after two #."""
    sources = Sources()
    sources.feed((folder / "report.html").read_text("utf-8"))
    return sources.text


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("reproduced")
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(style, "DOTS_PER_INCH", 40)
        optuav.reproduce(folder, only=(*QUICK, "ledger"))
    return folder


@pytest.mark.parametrize(
    "only", [("wind",), pytest.param((*QUICK, "ledger"), marks=pytest.mark.soak)]
)
def test_the_same_call_writes_the_same_bytes(
    only: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(style, "DOTS_PER_INCH", 40)
    once, again = (optuav.reproduce(tmp_path / name, only=only) for name in ("one", "two"))
    assert contents(tmp_path / "one") == contents(tmp_path / "two")
    assert {path.relative_to(tmp_path / "two").as_posix() for path in again} == {
        path.relative_to(tmp_path / "one").as_posix() for path in once
    }


def test_every_picture_comes_as_png_svg_and_csv(written: Path) -> None:
    names = {path.stem for path in (written / "figures").glob("*.png")}
    assert names == {path.stem for path in (written / "figures").glob("*.svg")}
    data = {path.stem for path in (written / "data").glob("*.csv")}
    tables = {"direct-path.paper", "direct-path.paper-table2", "table2.paper", "misprints.paper"}
    assert data - names == tables | {"table2.paper-table2", "ledger"}
    assert names - data == set()
    assert {"wind.paper", "harvest-efficiency.paper"} <= names


def test_the_page_needs_no_other_file(written: Path) -> None:
    sources = Sources()
    text = (written / "report.html").read_text("utf-8")
    sources.feed(text)
    assert sources.found
    assert all(each.startswith("data:image/png;base64,") for each in sources.found)
    assert "url(" not in text
    assert "@import" not in text


def test_the_page_leads_to_the_files_beside_it_and_to_its_sections(written: Path) -> None:
    sources = Sources()
    sources.feed((written / "report.html").read_text("utf-8"))
    contents = [each for each in sources.links if each.startswith("#")]
    assert contents == sources.anchors
    assert {"#fit", "#direct-path", "#wind", "#misprints", "#ledger"} <= set(contents)
    files = [each for each in sources.links if not each.startswith("#")]
    assert len(files) >= 3 * len(sources.found)
    assert [each for each in files if not (written / each).is_file()] == []


def test_the_markdown_leads_to_the_files_and_has_the_words_of_the_page(written: Path) -> None:
    text = (written / "report.md").read_text("utf-8")
    links = re.findall(r"\]\(([^)]+)\)", text)
    pictures = re.findall(r"!\[[^]]*\]\(([^)]+)\)", text)
    assert [each for each in links if not (written / each).is_file()] == []
    assert len(pictures) == len([*(written / "figures").glob("*.png")])
    headings = re.findall("^## (.*)", report(written), re.MULTILINE)
    assert headings == re.findall("^## (.*)", text, re.MULTILINE)
    assert "26 agree with `paper-table2`: 24 in every printed" in text
    assert "which `optuav show paper` lists" in text
    assert r"\`" not in text


def test_figures_come_in_the_order_of_the_paper() -> None:
    numbers = [number for study in STUDIES for number in study.numbers]
    figs = [int(each.removeprefix("fig")) for each in numbers if each.startswith("fig")]
    assert figs == sorted(figs)


def test_tables_are_text_and_the_ledger_is_folded(written: Path) -> None:
    """So that they can be read on a phone, searched and copied."""
    text = (written / "report.html").read_text("utf-8")
    _, _, after = text.partition('id="direct-path"')
    assert '<td data-head="η2 [%]">−12.79 †</td>' in after
    whole = after.partition('id="ledger"')[2]
    assert whole.index("<details>") < whole.index("<summary>") < whole.index("<table")
    assert "1032036" in whole.partition("<table")[2]
    assert 'name="viewport"' in text


def test_the_report_counts_the_fit(written: Path) -> None:
    """24 of 30 cells, 14 of them fitted, and two at an edge; 6 parameters for 6 numbers."""
    text = report(written)
    assert "Of the 30 cells of Table II 26 agree with paper-table2: 24 in every printed" in text
    assert "14 were used in the fit and 10 follow from it, and 2 in all digits but the last" in text
    assert "24.27 % are those at Δ = 741 s, the whole slots of the rows' 740.65 s" in text
    assert "in hover all 26 show every digit. The other 4 cannot" in text
    assert "6 free parameters and 6 different numbers" in text
    assert "by construction" in text


def test_what_cannot_be_flown_is_counted() -> None:
    """One plan runs dry, one is charged beyond full, one can be flown (SPEC 4, P4 and P3)."""
    paper = optuav.load("paper")
    dry = solve(paper, optuav.P4("b1", order="rest-first"), perspective="battery")
    full = solve(paper, optuav.P1(trajectory="traj2"), perspective="energy")
    flown = solve(paper, optuav.P3())
    assert [*grounded({"flown": flown}, "bars")] == []
    said = [*grounded({"dry": dry, "full": full, "flown": flown}, "bars")]
    assert [each.partition(" the ")[0] for each in said] == ["In 1 of 3 bars"] * 2
    assert ["runs dry" in each for each in said] == [True, False]


@pytest.fixture
def few_points(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of the curves over battery size."""
    monkeypatch.setattr(figures, "PACKS", dict.fromkeys(figures.PACKS, 5))


@pytest.fixture
def coarse(monkeypatch: pytest.MonkeyPatch, few_points: None) -> None:
    """Few points of the curves that take long, and few stops at the mission's own deadline."""
    monkeypatch.setattr(curves, "PACK_HALVINGS", 5)
    monkeypatch.setattr(curves, "SPEED_SHARES", (1.0, 1.1))
    monkeypatch.setattr(figures, "LATER", (1.0,))
    monkeypatch.setattr(figures, "WAYS", {"one rest, one hover": (1, 1)})


@pytest.fixture
def unrendered(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pictures are drawn but not rendered, where their names and the texts are the matter."""
    monkeypatch.setattr("optuav.paper.report.image", lambda figure, form: b"")


@pytest.mark.soak
@pytest.mark.usefixtures("coarse", "unrendered")
def test_a_mission_of_ones_own(tmp_path: Path) -> None:
    """All studies, without the paper's numbers and figures."""
    files = optuav.reproduce(tmp_path, mission=small())
    names = {path.name for path in files}
    assert {"report.html", "wind.small.png", "hover-time.small.1200s.csv"} <= names
    assert not any("ledger" in name or "misprints" in name for name in names)
    assert "of the paper" not in report(tmp_path).partition("##")[2]


@pytest.mark.soak
@pytest.mark.usefixtures("unrendered")
def test_a_mission_without_laser_wind_or_roofs(tmp_path: Path) -> None:
    """Loads by regime do not depend on wind, and without laser there is no charging to draw."""
    bare = curves.without_laser(optuav.load("paper-table2")).replace({"buildings": []})
    studies = ("wind", "charging", "battery-size", "overcharges", "perspectives")
    names = {path.stem for path in optuav.reproduce(tmp_path, mission=bare, only=studies)}
    assert not any(name.startswith(("wind", "harvest", "battery-size", "overch")) for name in names)
    assert any(name.startswith("hover-time") for name in names)


@pytest.mark.soak
@pytest.mark.usefixtures("coarse", "unrendered")
def test_a_mission_that_cannot_be_flown_gets_a_report(tmp_path: Path) -> None:
    """The reason comes first, and every section that is not there is named with it."""
    optuav.reproduce(tmp_path, mission=small(**{"limits.deadline_s": 70.0}))
    text = report(tmp_path)
    reason = "the flight takes 75.79 s, longer than limits.deadline_s = 70 s"
    first, _, rest = text.partition("## Not shown")
    assert f"small has no plan: {reason}" in first
    assert text.count(reason) == 2
    for study in STUDIES:
        title = study.heading(of_paper=False)
        assert f"## {title}" in first or title in rest
    assert "Routes: ." not in text
    assert not re.search(r"\bnan\b", text)


@pytest.mark.soak
@pytest.mark.usefixtures("coarse", "unrendered")
def test_where_one_trajectory_has_no_plan_it_is_said_with_the_reason(tmp_path: Path) -> None:
    """Straight on 89 % would be left, with a rest more."""
    optuav.reproduce(tmp_path, mission=small(**{"limits.min_soc": 0.9}))
    text = report(tmp_path)
    assert "No plan: direct (charge left: 89.11 % ≥ 90 %" in text
    assert "has no plan" not in text
    assert not re.search(r"\bnan\b", text)


def test_a_charge_that_cannot_be_left_has_no_plan_rather_than_no_number() -> None:
    """The direct flight alone leaves 89 %: 88 % can be asked for, 5 % more cannot."""
    (shown, _) = exhibits(
        "least-charge", small(**{"buildings": [], "limits.min_soc": 0.88})
    ).values()
    assert [*shown.findings] == ["From η0 = 93 % on there is no plan at the mission's own v_max."]


def test_a_reading_of_p2_without_a_plan_is_named_with_the_reason() -> None:
    """Without roofs no plan uses the whole deadline."""
    (shown,) = exhibits("second-problem", small(buildings=[])).values()
    assert "P1 688.85 s" in shown.findings[-1]
    assert "P2-tight no plan, " in shown.findings[-1]


@pytest.mark.usefixtures("unrendered")
def test_names_of_missions_are_safe_in_files_and_texts(tmp_path: Path) -> None:
    odd = small(name="a b/c <x> $y_1$ Zoë")
    optuav.reproduce(tmp_path / "out", mission=odd, only=("wind", "perspectives"))
    assert (tmp_path / "out" / "figures" / "wind.a-b-c-x-y_1-Zoë.png").is_file()
    assert "<x>" not in (tmp_path / "out" / "report.html").read_text("utf-8")
    text = report(tmp_path / "out")
    assert "a b/c <x> $y_1$ Zoë" in text
    assert {path.name for path in tmp_path.iterdir()} == {"out"}


def test_plans_that_studies_share_are_found_once() -> None:
    """With the default trajectory and perspective stated, or left to `solve`."""
    asked = small(**{"limits.deadline_s": 1111.0})
    stated = solve(asked, optuav.P1(trajectory="optimal"), perspective="available")
    assert solve(asked) is stated
    assert stated.hover_time_s == optuav.solve(asked).hover_time_s


def test_many_plans_of_packs_that_take_turns_are_left_out_with_words(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Each takes a search by simulation: half a minute where three studies ask for dozens."""
    monkeypatch.setattr("optuav.paper.report.COUNTED", ("available",))
    turns = small(**{"battery.schedule": "alternating", "battery.period_s": 10.0})
    for study in ("least-charge", "battery-size", "more-stops"):
        ((_, why),) = left_out(study, turns)
        assert "search by simulation" in why


def test_nothing_is_written_where_a_study_fails(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(*_: object) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr("optuav.paper.report.image", fails)
    with pytest.raises(ZeroDivisionError):
        optuav.reproduce(tmp_path / "out", only=("wind",))
    assert not (tmp_path / "out").exists()


def test_unknown_studies_are_named() -> None:
    with pytest.raises(InputError, match=r"wint.*did you mean .wind"):
        optuav.reproduce(only=("wint",))
    with pytest.raises(InputError, match="fig8, fig9, fig10, table2"):
        optuav.reproduce(only=("fig99",))


@pytest.mark.usefixtures("unrendered")
def test_progress_is_told_to_the_end(tmp_path: Path) -> None:
    text: list[tuple[int, int, str]] = []
    optuav.reproduce(tmp_path, only=("wind",), progress=lambda *step: text.append(step))
    assert [name for _, _, name in text] == ["wind of paper", "wind of paper-table2"]
    assert all(done < steps for done, steps, _ in text)


@pytest.mark.usefixtures("unrendered")
def test_command_line(tmp_path: Path) -> None:
    ran = run("reproduce", "--out", str(tmp_path / "out"), "--only", "wind", "--mission", "paper")
    assert ran.code == 0
    assert "report.html" in ran.out
    assert (tmp_path / "out" / "figures" / "wind.paper.svg").is_file()
    late = tmp_path / "late.toml"
    late.write_text('schema = 1\nextends = "paper"\n[limits]\ndeadline_s = 70\n', "utf-8")
    ran = run("reproduce", "--out", str(tmp_path), "--only", "wind", "--mission", str(late))
    assert ran.code == 1
    assert "late has no plan: the flight takes 75.79 s" in ran.out
    assert "one of" in refused("reproduce", "--only", "nothing", "--out", str(tmp_path))
    assert "nosuch" in refused("reproduce", "--mission", "nosuch", "--out", str(tmp_path))
    ledger = refused("reproduce", "--only", "ledger", "--mission", "paper", "--out", str(tmp_path))
    assert "paper's two missions" in ledger


def test_names_are_those_of_the_studies() -> None:
    assert (*(study.name for study in STUDIES), "ledger") == NAMES
    figs = (f"fig{each}" for each in range(1, 11))
    assert set(NUMBERS) == {*figs, "table2"}


@pytest.mark.usefixtures("unrendered")
def test_studies_are_chosen_by_the_numbers_of_the_paper(tmp_path: Path) -> None:
    """One study has Figs. 3 to 6, and only what is asked for is shown."""
    files = optuav.reproduce(tmp_path, only=["fig4", "wind"], mission="paper")
    shown = {path.stem for path in files if path.suffix == ".png"}
    assert shown == {"charge-left.paper.800s", "wind.paper"}


@pytest.mark.usefixtures("unrendered")
def test_the_number_of_a_table_chooses_its_tables(tmp_path: Path) -> None:
    """With a mission of one's own, which has its own deadline, Fig. 3 and Fig. 5 are one chart."""
    tables = optuav.reproduce(tmp_path, only=["table2"])
    assert {path.stem.partition(".")[0] for path in tables if path.suffix == ".csv"} == {
        "direct-path",
        "table2",
    }
    for name in ("fig3", "fig5"):
        (shown,) = (
            path
            for path in optuav.reproduce(tmp_path, only=[name], mission=small())
            if path.suffix == ".png"
        )
        assert shown.name == "hover-time.small.1200s.png"


# The studies


def test_bars_stand_for_the_plans() -> None:
    """Perspectives are the groups and trajectories the bars, as in the paper's figures."""
    shown = exhibits("perspectives", small())["hover-time.small.1200s"]
    labels = [text.get_text() for text in shown.axes.get_xticklabels()]
    assert labels[:3] == [
        "battery\nperspective",
        "energy\nperspective",
        "adjusted energy\nperspective",
    ]
    heights = [patch.get_height() for patch in shown.axes.patches]
    assert heights == pytest.approx([each["hover_time_s"] for each in shown.records])
    assert heights[:4] == pytest.approx([688.848, 715.048, 719.540, 719.540], abs=1e-3)
    assert shown.axes.get_ylabel() == "hover time Δ [s]"


@pytest.mark.soak
@pytest.mark.usefixtures("few_points")
def test_curves_of_battery_size_cross_at_the_marks() -> None:
    """39 162 and 46 194 A s: where the direct path is as good, and where the deadline ends it."""
    shown = exhibits("battery-size", "paper-table2")["battery-size.paper-table2.battery"]
    assert "39162 A s" in shown.findings[0]
    assert "46194 A s" in shown.findings[1]
    marked = [line.get_xdata()[0] for line in shown.axes.lines if len(line.get_xdata()) == 2]
    assert marked == pytest.approx([39162.2, 46194.0], abs=0.1)
    packs = np.array([each["pack_As"] for each in shown.records])
    assert all(np.abs(packs - mark).min() < 0.1 for mark in marked)  # curves bend where they do


def test_hover_time_falls_with_the_charge_left() -> None:
    (shown,) = (
        each
        for name, each in exhibits("least-charge", "paper-table2").items()
        if name.endswith("battery")
    )
    hovers = [each["hover_time_s"] for each in shown.records]
    assert hovers == pytest.approx([955.276, 905.326, 855.377], abs=1e-3)
    assert "5.23 %" in shown.findings[0]
    assert "10.46 %" in shown.findings[0]


def test_energy_against_wind_is_even_along_x_and_least_at_the_weight_along_z() -> None:
    mission = optuav.load("paper")
    force_N, energy_J = curves.hover_energy(mission, "x")
    assert energy_J == pytest.approx(energy_J[::-1], rel=1e-9)
    calm = energy_J[force_N == 0.0]
    assert calm == pytest.approx([100.0 * (1310.994 + 5.0)], rel=1e-6)
    assert curves.calmest_N(mission, "z") == pytest.approx(12.74)
    assert curves.wind_limits_N(mission, "z") == pytest.approx((-4.4758, 29.9558), abs=1e-4)


def test_harvest_by_hand() -> None:
    """At 1 km and 1000 W, by the numbers of Table I."""
    import math

    import numpy as np

    energy_J, efficiency = curves.harvest(optuav.load("paper"), 1000.0, np.array([1000.0]))
    share = math.exp(-0.1019)
    power_W = 0.34 * 0.5434 * share * 1000.0 + 0.5434 * -1.1 * share - 0.2761
    assert energy_J == pytest.approx([100.0 * power_W])
    assert efficiency == pytest.approx([power_W / 1000.0])


@pytest.mark.soak
def test_left_out_has_its_numbers() -> None:
    """Check numbers of the model: empty wells, overcharging, and 154.89 m/s."""
    (dry,) = exhibits("runs-dry", "paper").values()
    assert "It is empty at 660.2" in dry.findings[1]
    assert len(dry.findings) == len(set(dry.findings)) == 3
    (over,) = exhibits("overcharges", "paper").values()
    assert "104.3 %" in over.findings[0]
    (fast,) = exhibits("peak-speed", "paper").values()
    assert "154.89 m/s" in fast.findings[0]
    (more,) = exhibits("more-stops", "paper").values()
    hovers = {(each["deadline_s"], each["most"]): each["hover_time_s"] for each in more.records}
    assert hovers[1200.0, "two rests"] == pytest.approx(605.456, abs=1e-3)
    assert hovers[1200.0, "two hovers"] == pytest.approx(598.976, abs=1e-3)
    assert hovers[2400.0, "two hovers"] == pytest.approx(742.834, abs=1e-3)
    (second,) = exhibits("second-problem", "paper").values()
    found = {each["problem"]: each["hover_time_s"] for each in second.records}
    assert (found["P1"], found["P2-tight"]) == pytest.approx((688.848, 678.686), abs=1e-3)


def test_csv_holds_the_numbers_of_the_picture(written: Path) -> None:
    text = (written / "data" / "wind.paper.csv").read_text("utf-8")
    rows = list(csv.DictReader(io.StringIO(text)))
    assert {row["axis"] for row in rows} == {"x", "y", "z"}
    assert max(float(row["wind_N"]) for row in rows) == pytest.approx(29.9558, abs=1e-4)


# The document


def test_texts_are_escaped() -> None:
    """Marks of HTML and of Markdown in texts are shown, not obeyed; code is ours alone."""
    body = element(
        "body",
        element("h1", '<t>" $1'),
        prose("a < b & `y_2`"),
        element("p", "# `no` <script>alert(1)</script> [link](to) \\ 1. $x$"),
        listing(["1. one", "- two\nlines"]),
        table([("a|b",), ("<i>",)]),
    )
    shown = tostring(body, encoding="unicode", method="html")
    assert "<i>" not in shown
    assert "<script>" not in shown
    assert '<h1>&lt;t&gt;" $1' in shown
    assert "a &lt; b &amp; <code>y_2</code>" in shown
    assert "`no` &lt;script&gt;" in shown
    assert markdown(body) == (
        '# \\<t>" \\$1\n\n'
        "a \\< b \\& `y_2`\n\n"
        "\\# \\`no\\` \\<script>alert(1)\\</script> \\[link\\](to) \\\\ 1. \\$x\\$\n\n"
        "- 1\\. one\n- \\- two lines\n\n"
        "| a\\|b |\n| --- |\n| \\<i> |\n"
    )


@pytest.mark.parametrize(
    ("value", "digits", "words"), [(-0.04, 1, "0.0"), (-4.47580, 4, "−4.4758"), (12.0, 2, "12.00")]
)
def test_numbers_in_sentences(value: float, digits: int, words: str) -> None:
    """A minus, not a hyphen, and no sign before 0."""
    assert number(value, digits) == words


@pytest.mark.parametrize(
    "name",
    ["*a* _b_ `c`", "[x](http://e.org)", "<b>|</b>", "http://e.org www.e.org", "# a", "1. a"],
)
def test_a_name_is_text_in_markdown(name: str) -> None:
    """Whatever it is made of, a reader of Markdown shows the name and nothing else."""
    text = markdown(element("body", element("p", name)))
    parsed = MarkdownIt("commonmark").enable("table").render(text)
    assert parsed == f"<p>{escape(name)}</p>\n"
    assert "http://" not in text  # which some readers make a link of
    assert "www.e" not in text


def test_a_refused_report_leaves_no_folders(tmp_path: Path) -> None:
    """What optuav has not written is not replaced, and only folders that hold files are made."""
    (tmp_path / "report.html").write_text("mine", "utf-8")
    assert "report.html" in refused("reproduce", "--only", "table2", "--out", str(tmp_path))
    assert [path.name for path in tmp_path.iterdir()] == ["report.html"]
    optuav.reproduce(tmp_path / "new", only=("table2",))
    assert not (tmp_path / "new" / "figures").exists()
