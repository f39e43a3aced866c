"""Pictures as files: which, whole or not at all, the same bytes again."""

from __future__ import annotations

import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

matplotlib = pytest.importorskip("matplotlib")
from matplotlib.figure import Figure  # noqa: E402

import optuav  # noqa: E402
from optuav import plots  # noqa: E402
from optuav.errors import InputError, require  # noqa: E402
from optuav.plots import files, style  # noqa: E402
from tests.wells import SLOW  # noqa: E402

PNG = b"\x89PNG\r\n\x1a\n"


@pytest.fixture(scope="module")
def nothing(paper: optuav.Plan) -> optuav.Plan:
    """A plan that says that there is none; it has one picture only."""
    return optuav.solve(paper.mission.replace({"limits.deadline_s": 10}), perspective="battery")


def settings() -> dict[str, object]:
    """The user's settings; to look at the backend would choose one."""
    return {key: matplotlib.rcParams[key] for key in matplotlib.rcParams if key != "backend"}


@pytest.fixture
def names_only(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pictures are named and neither drawn nor written, apart from packs."""
    empty = Figure().subplots()
    monkeypatch.setattr(files, "image", lambda *_: PNG)
    for name in ("mission_map", "leg", "wells"):
        axes = SimpleNamespace(plan=empty, wells=empty, speed=empty)
        drawn = [empty] if name == "wells" else axes
        monkeypatch.setattr(files, name, lambda *_, drawn=drawn: drawn)


@pytest.mark.parametrize("drawn", ["nothing", pytest.param("paper", marks=pytest.mark.soak)])
def test_bytes_do_not_depend_on_the_users_settings(
    drawn: str, request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plan = request.getfixturevalue(drawn)
    monkeypatch.setattr(style, "DOTS_PER_INCH", 40)
    first = plots.save_pictures(plan, tmp_path / "new" / "first")
    with matplotlib.rc_context({"font.size": 30.0, "axes.grid": True, "savefig.dpi": 40}):
        mine = settings()
        second = plots.save_pictures(plan, str(tmp_path / "second"))
        assert settings() == mine
    names = ["map.png", "map.svg", "map.pdf", "wells.png", "wells.svg", "wells.pdf"]
    names += ["leg.png", "leg.svg", "leg.pdf"]
    assert [path.name for path in first] == (names if plan else names[:3])
    for one, other in zip(first, second, strict=True):
        content = one.read_bytes()
        assert content.startswith({".png": PNG, ".svg": b"<?xml", ".pdf": b"%PDF"}[one.suffix])
        assert content == other.read_bytes()
        assert b"optuav" in content


@pytest.mark.usefixtures("names_only")
def test_without_a_plan_there_is_a_map_alone(nothing: optuav.Plan, tmp_path: Path) -> None:
    written = plots.save_pictures(nothing, tmp_path)
    files_of_map = [tmp_path / f"map{ending}" for ending in (".png", ".svg", ".pdf")]
    assert sorted(written) == sorted(files_of_map) == sorted(tmp_path.iterdir())


@pytest.mark.usefixtures("names_only")
def test_a_twin_is_not_drawn_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where another perspective is flown alike, as in matrice350 with a reserve at the end."""
    drawn = list[int]()
    own = files.wells
    monkeypatch.setattr(files, "wells", lambda plans: drawn.append(len(plans)) or own(plans))
    alike = optuav.load("matrice350").replace(SLOW)
    plan, twin = (optuav.solve(alike, perspective=x) for x in ("available", "battery"))
    files.save_pictures(plan, tmp_path, [twin])
    files.save_pictures(optuav.solve("paper"), tmp_path, optuav.solve("paper", "P3"))
    assert drawn == [1, 2]


@pytest.mark.usefixtures("names_only")
def test_packs_that_take_turns_are_drawn_as_such(tmp_path: Path) -> None:
    """There is no pooled battery whose wells could be shown; a single pack is one."""
    direct = optuav.load("paper").replace({"battery.schedule": "round-robin"})
    plan = optuav.solve(direct, "P3", slot_s=200)
    written = plots.save_pictures(plan, tmp_path / "two")
    assert [*dict.fromkeys(path.stem for path in written)] == ["map", "packs", "leg"]
    alone = optuav.solve(direct.replace({"battery.packs": 1}), "P3", perspective="battery")
    written = plots.save_pictures(alone, tmp_path / "one")
    assert [*dict.fromkeys(path.stem for path in written)] == ["map", "wells", "leg"]


def test_a_leg_with_figures_of_the_user_is_not_drawn_from_the_model(paper: optuav.Plan) -> None:
    edited = [replace(phase, edited=True) for phase in paper.phases]
    plan = paper.model_copy(update={"phases": tuple(edited)})
    assert files.modelled_leg(plan) is None
    shown = files.modelled_leg(paper)
    assert shown is not None
    assert (shown.start_place, shown.end_place) == ("origin", "b1")


@pytest.mark.usefixtures("names_only")
def test_places_that_cannot_be_written_are_refused(nothing: optuav.Plan, tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_text("mine")
    with pytest.raises(InputError, match="file: is not a directory"):
        plots.save_pictures(nothing, file)
    with pytest.raises(InputError, match="cannot be made: Not a directory"):
        plots.save_pictures(nothing, file / "pictures")
    with pytest.raises(InputError, match="not a possible path"):
        plots.save_pictures(nothing, "nul\0")
    assert file.read_text() == "mine"


@pytest.mark.usefixtures("names_only")
def test_a_file_is_written_whole_or_not_at_all(nothing: optuav.Plan, tmp_path: Path) -> None:
    (tmp_path / "map.png").mkdir()
    with pytest.raises(InputError, match=r"map\.png: is a directory"):
        plots.save_pictures(nothing, tmp_path)
    assert list(tmp_path.iterdir()) == [tmp_path / "map.png"]


@pytest.mark.parametrize(
    ("name", "start"),
    [
        ("map.png", PNG),
        ("map.PNG", PNG),
        ("map.svg", b"<?xml"),
        ("map.pdf", b"%PDF"),
        ("map.jpg", b"\xff\xd8\xff"),
        ("map.tiff", b"II*\0"),
        ("map.webp", b"RIFF"),
    ],
)
def test_a_picture_has_the_format_of_its_suffix(name: str, start: bytes, tmp_path: Path) -> None:
    """Whichever function writes it; and the same bytes again, without a date."""
    ax = style.page(1.0, 1.0).subplots()
    content = plots.save(ax, tmp_path / name).read_bytes()
    (again,) = plots.save_figures([(name, ax)], tmp_path / "again")
    assert content.startswith(start)
    assert content == again.read_bytes()
    assert b"Date" not in content


@pytest.mark.parametrize("name", ["map.xyz", "map", "map.svgz"])
def test_a_suffix_that_no_picture_has_is_refused(name: str, tmp_path: Path) -> None:
    ax = style.page(1.0, 1.0).subplots()
    words = rf"{name}': must be a name that ends in \.png, \.svg, \.pdf, "
    with pytest.raises(InputError, match=words):
        plots.save(ax, tmp_path / name)
    with pytest.raises(InputError, match=words):
        plots.save_figures([("first.png", ax), (name, ax)], tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_matplotlib_is_imported_late_missed_in_words_and_opens_no_window(tmp_path: Path) -> None:
    """Without a window no backend is chosen."""
    code = """
import sys
import optuav
assert not any(name.partition(".")[0] == "matplotlib" for name in sys.modules)
sys.modules["matplotlib"] = None
try:
    optuav.plots.wells
except optuav.errors.InputError as error:
    print(error)
del sys.modules["matplotlib"]
ax = optuav.plots.bars([optuav.plots.Bar("a", "", 1.0)], title="one", y_label="y")
ax.figure.savefig(sys.argv[1], dpi=20)
import matplotlib
print("matplotlib.pyplot" in sys.modules, matplotlib.get_backend(auto_select=False))
"""
    ran = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path / "bars.png")],
        capture_output=True,
        text=True,
        check=True,
        timeout=60,
    )
    assert ran.stdout.splitlines() == [
        "pictures need matplotlib, of the extra optuav[plot]; "
        'in a clone of optuav: python -m pip install ".[plot]"',
        "False None",
    ]


def test_every_public_name_is_of_the_package() -> None:
    for name in plots.__all__:
        assert getattr(plots, name).__module__.startswith("optuav.plots.")


def test_pictures_made_in_threads_leave_the_settings_as_they_were() -> None:
    """The settings are those of the process: one thread may not restore what another has set."""
    mine = settings()

    def draw(_: int) -> None:
        with style.applied():
            time.sleep(0.002)
            with style.applied():
                assert matplotlib.rcParams["font.size"] == 8.0

    with ThreadPoolExecutor(4) as threads:
        list(threads.map(draw, range(12)))
    assert settings() == mine


def test_a_backend_that_does_not_exist_is_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    """As by MPLBACKEND=nosuch, which ends the import of matplotlib."""

    def refuse(_: str) -> None:
        raise ValueError("'nosuch' is not valid")

    monkeypatch.setattr("optuav.errors.import_module", refuse)
    with pytest.raises(InputError, match=r"pictures need matplotlib.*'nosuch' is not valid"):
        require("matplotlib", "pictures")


def test_pictures_of_one_panel_are_drawn_where_one_wants_them() -> None:
    left, right = Figure().subplots(1, 2)
    assert plots.bars([plots.Bar("a", "", 1.0)], title="one", y_label="y", ax=left) is left
    problem = optuav.P4("b1", order="rest-first")
    part = optuav.formulate("paper", problem, perspective="battery").parts[0]
    assert plots.plane(part.model, part.model.row(0), ax=right) is right


def test_what_a_function_of_several_axes_returns_is_saved(tmp_path: Path) -> None:
    """`wells` and `packs` return panels, the others axes or tuples of them."""
    drawn = style.Panels([style.page(1.0, 1.0).subplots()])
    assert plots.save(drawn, tmp_path / "wells.svg").stat().st_size > 1000
