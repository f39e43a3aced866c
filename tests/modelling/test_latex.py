"""LaTeX of programmes: its options, and what LaTeX, KaTeX and MathJax make of it."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from functools import cache
from pathlib import Path
from typing import Any

import pytest

import optuav
from optuav.errors import InputError
from optuav.modelling import Model
from optuav.solving.question import problem_of
from tests.mathtext import lines_that_can_be_set

PERSPECTIVES = ("battery", "energy", "adjusted", "wells", "available")
PROBLEMS = ("P1", "P2", "P2-tight", "P3", "P4")
READERS = Path(__file__).with_name("readers.cjs")
PACKAGES = ("katex@0.16.25", "mathjax-full@3.2.2")
EVIL = "<script>alert(1)</script> & $x_1$ 100 % #1 {a} ~ \\href{javascript:a}{b} ^"


def program(problem: str, perspective: str) -> optuav.Program:
    stated = problem_of(problem, building="b1" if problem == "P4" else None)
    return optuav.formulate("paper", stated, perspective=perspective)  # type: ignore[arg-type]


def pages(**options: Any) -> list[str]:
    """All problems under all perspectives."""
    every = (program(each, view) for each in PROBLEMS for view in PERSPECTIVES)
    return [each.to_latex(**options) for each in every]


def evil() -> str:
    """A page whose names are anything."""
    model = Model(EVIL)
    model.subject_to(EVIL, model.variable("x", EVIL, unit=EVIL) <= 1.0, unit=EVIL)
    return model.to_latex()


def compiled(text: str, layout: str, folder: Path) -> str:
    """What pdflatex prints of a text in an article."""
    head = rf"\documentclass[{layout}]{{article}}\usepackage{{amsmath}}\allowdisplaybreaks"
    (folder / "page.tex").write_text(rf"{head}\begin{{document}}{text}\end{{document}}", "ascii")
    command = ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "page.tex"]
    found = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert found.returncode == 0, found.stdout[-2000:]
    return found.stdout


def long_sum() -> Model:
    model = Model("A long sum")
    x, y = (model.variable(name, name, unit="1") for name in "xy")
    total = sum((float(k) * x for k in range(2, 30)), start=1.0 * y)
    model.subject_to("long one", total <= 1.0)
    return model


@pytest.mark.parametrize("width", [24, 36, 46])
def test_lines_are_as_long_as_asked_for(width: int) -> None:
    """Terms such as 12 x take four characters with their sign; no more fit on a line, nor less."""
    page = long_sum().to_latex(width=width, labels=False)
    terms = [len(re.findall(r"\\,x", line)) for line in page.splitlines() if r"\,x" in line]
    assert sum(terms) == 28
    assert width / 5 - 2 <= max(terms) <= width / 4


def test_narrow_pages_have_heads_of_their_own() -> None:
    lines = lines_that_can_be_set(long_sum().to_latex(width=36))
    assert r"& \text{maximise} \\" in lines
    assert r"& \text{subject to} \\" in lines


def test_values_and_names_can_be_left_out() -> None:
    model = program("P3", "battery").parts[0].model
    whole, symbols = model.to_latex(), model.to_latex(numbers=False)
    assert r"\eta_0 = 0.05" in whole
    assert whole.startswith(symbols)
    assert not re.search(r"\d\.\d", symbols)
    unnamed = model.to_latex(labels=False)
    assert r"\tag" not in unnamed
    assert unnamed == re.sub(r" \\tag\*\{\\\(.*\\\)\}", "", whole)


@pytest.mark.parametrize("width", [23, 30.0, "wide", None])
def test_a_width_is_a_whole_number(width: Any) -> None:
    with pytest.raises(InputError, match=r"width = .*a whole number, x >= 24"):
        program("P3", "battery").to_latex(width=width)


def test_a_notebook_prints_the_same() -> None:
    found = program("P1", "battery")
    assert found._repr_latex_() == found.to_latex()


@cache
def folder(parent: Path) -> Path:
    """Where node finds the readers; a skip where they cannot be installed."""
    if shutil.which("node") is None or shutil.which("npm") is None:
        pytest.skip("there is no node with npm")
    command = ["npm", "install", "--no-audit", "--no-fund", "--prefix", str(parent), *PACKAGES]
    if subprocess.run(command, capture_output=True, check=False, timeout=300).returncode:
        pytest.skip(f"npm does not get {', '.join(PACKAGES)}")
    shutil.copy(READERS, parent)
    return parent


def objections(where: Path, texts: list[str]) -> dict[str, Any]:
    """What KaTeX and MathJax say of pages."""
    command = ["node", str(where / READERS.name)]
    read = subprocess.run(
        command, input=json.dumps(texts), capture_output=True, text=True, check=True
    )
    found: dict[str, Any] = json.loads(read.stdout)
    return found


@pytest.mark.soak
@pytest.mark.parametrize("options", [{}, {"width": 36, "numbers": False}], ids=["whole", "narrow"])
def test_katex_and_mathjax_render_it(
    options: dict[str, Any], tmp_path_factory: pytest.TempPathFactory
) -> None:
    """Without an error, a warning, or a letter that their fonts lack; a mistake would be seen."""
    where = folder(tmp_path_factory.getbasetemp() / "readers")
    found = objections(where, [*pages(**options), evil()])
    assert found.pop("rendered") >= len(PROBLEMS) * len(PERSPECTIVES)
    assert found == {"katex": [], "mathjax": []}
    wrong = objections(where, [r"\begin{align*} \nothing{a_} & − \end{align*}"])
    assert wrong["katex"]
    assert wrong["mathjax"]


@pytest.mark.soak
@pytest.mark.skipif(shutil.which("pdflatex") is None, reason="there is no pdflatex")
@pytest.mark.parametrize(
    ("options", "layout"),
    [({}, ""), ({"width": 36}, "twocolumn"), ({"numbers": False, "labels": False}, "")],
    ids=["article", "two columns", "symbols"],
)
def test_latex_compiles_without_a_warning(
    options: dict[str, Any], layout: str, tmp_path: Path
) -> None:
    """Every problem under every perspective, in 345 pt, or in 230 pt of a column."""
    texts = "\n\n".join(f"Page {number}\n{text}" for number, text in enumerate(pages(**options)))
    said = compiled(texts, layout, tmp_path)
    assert "Overfull" not in said
    assert "Warning" not in said
    compiled(evil(), layout, tmp_path)
