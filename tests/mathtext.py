"""Pages of LaTeX before a strict reader: matplotlib's mathtext, which knows few commands."""

from __future__ import annotations

import re

from matplotlib.mathtext import MathTextParser


def lines_that_can_be_set(page: str) -> list[str]:
    """The lines of some ``align*``, each taken by mathtext without alignment marks and tags."""
    every, ends = page.splitlines(), (r"\begin{align*}", r"\end{align*}")
    assert (every[0], every[-1]) == ends
    lines = [line for line in every if line not in ends]
    parser = MathTextParser("path")
    for line in lines:
        untagged = re.sub(r"\\tag\*\{\\\((.*)\\\)\}", r"\\quad \1", line.removesuffix(r" \\"))
        parser.parse("$" + re.sub(r"(?<!\\)&", "", untagged) + "$")
    return lines
