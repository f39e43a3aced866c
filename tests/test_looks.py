"""The table of colours: used by all, repeated by none, and told apart by every reader."""

from __future__ import annotations

import re
from importlib import import_module
from io import BytesIO
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image, ImageColor

import optuav
from optuav.looks import LOOKS, SERIES, colour, variables

ROOT = Path(optuav.__file__).parents[1]
CODE = re.compile(r"#[0-9a-fA-F]{3,8}\b")
WORDS = ("ink", "muted", "charge", "deadline", "dry", "overfull", "flies")
LIMITS = ("charge", "deadline", "dry", "overfull", "bounds")  # Limits of a plan, drawn together
FLOOR = 4.5  # Least contrast of words, WCAG 2.2 AA
FLOOR_OF_LINES = 3.0
APART = 20.0  # Least distance of two limits, CIE 1976
BLIND = {
    # Machado, Oliveira and Fernandes (2009), severity 1, on linear RGB.
    "protan": [
        [0.152286, 1.052583, -0.204868],
        [0.114503, 0.786281, 0.099216],
        [-0.003882, -0.048116, 1.051998],
    ],
    "deutan": [
        [0.367322, 0.860646, -0.227968],
        [0.280085, 0.672501, 0.047413],
        [-0.011820, 0.042940, 0.968881],
    ],
    "tritan": [
        [1.255528, -0.076749, -0.178779],
        [-0.078411, 0.930809, 0.147602],
        [0.004733, 0.691367, 0.303900],
    ],
}
XYZ = np.array(
    [
        [0.4124564, 0.3575761, 0.1804375],
        [0.2126729, 0.7151522, 0.0721750],
        [0.0193339, 0.1191920, 0.9503041],
    ]
)


def linear(code: str) -> np.ndarray:
    """Linear RGB of a code of six digits."""
    share = np.array([int(code[k : k + 2], 16) for k in (1, 3, 5)]) / 255.0
    return np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)


def contrast(one: str, other: str) -> float:
    """Ratio of two luminances, WCAG 2.2."""
    low, high = sorted(float(XYZ[1] @ linear(each)) + 0.05 for each in (one, other))
    return high / low


def lab(code: str, sight: str) -> np.ndarray:
    """CIELAB of a code as readers of a kind see it."""
    xyz = XYZ @ np.clip(np.array(BLIND[sight]) @ linear(code), 0.0, 1.0) / XYZ.sum(axis=1)
    root = np.where(xyz > (6 / 29) ** 3, np.cbrt(xyz), xyz * (29 / 6) ** 2 / 3 + 4 / 29)
    return np.array([116 * root[1] - 16, 500 * (root[0] - root[1]), 200 * (root[1] - root[2])])


def test_no_other_file_repeats_a_colour_of_the_table() -> None:
    """Pictures, notebook displays, the explorer and the site take theirs from it."""
    known = {code.lower() for look in LOOKS.values() for code in look[:2]} | {
        e.lower() for e in SERIES
    }
    files = [
        file
        for folder in ("optuav", "formulations", "docs", "examples")
        for file in (ROOT / folder).rglob("*")
        if file.suffix in (".py", ".js", ".css", ".html", ".toml", ".mplstyle", ".md")
        and not {"vendor", "mathjax", "_build", "lessons"} & {*file.parts}
    ]
    assert len(files) > 250
    repeated = {
        f"{file.name}: {code}"
        for file in files
        if file.name != "looks.py"
        for code in CODE.findall(file.read_text("utf-8"))
        if code.lower() in known
    }
    assert repeated == set()


@pytest.mark.parametrize("theme", [0, 1], ids=["light", "dark"])
def test_words_are_read_on_both_grounds(theme: int) -> None:
    """Those of limits and verdicts too; and words on fills on each fill that carries some."""
    for role in WORDS:
        for ground in ("panel", "ground"):
            assert contrast(LOOKS[role][theme], LOOKS[ground][theme]) >= FLOOR, (role, ground)
    for words, fill in (
        ("on-fill", "bound"),
        ("on-fill", "rest"),
        ("on-fill", "hover"),
        ("on-dark", "flight"),
        ("on-dark", "available"),
    ):
        assert contrast(LOOKS[words][theme], LOOKS[fill][theme]) >= FLOOR, (words, fill)


@pytest.mark.parametrize("theme", [0, 1], ids=["light", "dark"])
def test_lines_are_seen_on_both_grounds(theme: int) -> None:
    lines = [role for role, look in LOOKS.items() if look.width]
    assert "flight" in lines
    for role in lines:
        for ground in ("panel", "ground"):
            assert contrast(LOOKS[role][theme], LOOKS[ground][theme]) >= FLOOR_OF_LINES, role


@pytest.mark.parametrize("sight", BLIND)
@pytest.mark.parametrize("theme", [0, 1], ids=["light", "dark"])
def test_limits_are_told_apart_by_colour_blind_readers(theme: int, sight: str) -> None:
    """Charge and bounds in the dark are near for tritan readers: their dashes differ most."""
    for one, other in combinations(LIMITS, 2):
        distance = np.linalg.norm(lab(LOOKS[one][theme], sight) - lab(LOOKS[other][theme], sight))
        near = (theme, sight, {one, other}) == (1, "tritan", {"charge", "bounds"})
        assert distance >= (16.0 if near else APART), (one, other)


def test_no_two_limits_have_the_same_line() -> None:
    assert len({(LOOKS[role].width, LOOKS[role].dash) for role in LIMITS}) == len(LIMITS)
    assert len({LOOKS[role].dash for role in LIMITS}) == len(LIMITS)


def test_css_names_every_role_for_both_themes() -> None:
    written = variables(".page")
    assert colour("dry") == f"light-dark({LOOKS['dry'].light}, {LOOKS['dry'].dark})"
    assert all(f"--{role}: {colour(role)};" in written for role in LOOKS)


def test_pictures_draw_limits_as_the_table_has_them() -> None:
    """The charge that must be left and the full battery, in Matplotlib and in a notebook."""
    pytest.importorskip("matplotlib")
    from matplotlib.colors import to_hex

    plan = optuav.solve("paper", "P3", perspective="battery")
    (ax,) = optuav.plots.wells([plan])
    drawn = {to_hex(line.get_color()): line.is_dashed() for line in ax.lines}
    for role, dashed in (("charge", True), ("overfull", True), ("dry", False)):
        assert drawn[LOOKS[role].light.lower()] == dashed
    assert LOOKS["dry"].light in plan._repr_html_()


def test_pictures_for_dark_pages_have_the_colours_of_the_dark(monkeypatch: Any) -> None:
    """Wells keep their colours, and white becomes the ground."""
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    maker = import_module("make_dark")
    roles = ("charge", "dry", "overfull", "laser", "available", "bound", "flight", "hover", "rest")
    picture = Image.new("RGB", (len(roles) + 1, 1), "white")
    for at, role in enumerate(roles):
        picture.putpixel((at, 0), ImageColor.getrgb(LOOKS[role].light))
    written = BytesIO()
    picture.save(written, "png")
    dark = Image.open(BytesIO(maker.dark(written.getvalue())))
    shown = [dark.getpixel((at, 0)) for at in range(len(roles) + 1)]
    expected = [ImageColor.getrgb(LOOKS[role].dark) for role in roles]
    assert shown == [*expected, (20, 24, 30)]


def test_a_limit_on_a_well_reads_in_both_themes(monkeypatch: Any) -> None:
    """Beside the line of the charge to be left, on the bound well, whose fill both themes share."""
    pytest.importorskip("matplotlib")
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    kept = optuav.load("paper").replace({"limits.keep_soc": "always"})  # A line over the mission
    plan, written = optuav.solve(kept, "P3", perspective="battery"), BytesIO()
    (ax,) = optuav.plots.wells([plan])
    ax.figure.set_dpi(400)  # The line is then 7.5 pixels wide, and its casing 5 on each side
    ax.figure.savefig(written, dpi=400)
    left_As = 0.05 * 72_000.0
    x, up = ax.transData.transform([(time_s, left_As) for time_s in np.linspace(100, 500, 99)]).T
    for theme, content in (
        ("light", written.getvalue()),
        ("dark", import_module("make_dark").dark(written.getvalue())),
    ):
        picture = np.asarray(Image.open(BytesIO(content)).convert("RGB"))
        row, columns = len(picture) - round(up[0]), np.round(x).astype(int)
        line = ImageColor.getrgb(getattr(LOOKS["charge"], theme))
        on_dash = columns[(picture[row, columns] == line).all(axis=-1)]
        assert len(on_dash) > 30
        beside = picture[[row - 6, row + 6]][:, on_dash].reshape(-1, 3).tolist()
        for pixel in {tuple(each) for each in beside}:
            assert contrast(f"#{bytes(line).hex()}", f"#{bytes(pixel).hex()}") >= FLOOR
